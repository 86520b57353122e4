//! Rays that leave a surface without any epsilon: no acne, no leak.
//!
//! Around a closed surface each point has a winding number: how often more a ray from there, in any direction, leaves the
//! surface than it enters it. It is one more just behind the surface than just before it. A surface that is met again
//! where a ray starts, or one that a ray starts beyond, makes another number; so does a gap.

use std::collections::HashMap;
use std::path::Path;

use raykern::{Accel, BuildOptions, Facing, Hit, OwnedAccel, PrimId, QueryOptions, Ray, Surface};
use raykern_harness::load::load;
use raykern_harness::make::Random;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::render::{Image, Job, RenderScene, read_png, render};
use raykern_harness::{scenes, shared_scenes};

/// Whether each edge has as many triangles on one side as on the other.
fn is_closed(mesh: &TriangleMesh) -> bool {
    let mut edges = HashMap::<_, i32>::new();
    for triangle in &mesh.indices {
        let corners = triangle.map(|v| mesh.vertices[v as usize].map(|x| (x + 0.0).to_bits()));
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    edges.values().all(|sum| *sum == 0)
}

fn dot(a: [f64; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|k| a[k] * f64::from(b[k])).sum()
}

/// How rays leave a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// From the origins that come with a surface, and without the primitive itself.
    Origins,
    /// From the rounded point of the surface.
    Position,
}

/// The winding number of the surface of `hit` at a point to one side of it, seen in a random direction to that side.
fn winding(
    accel: &Accel,
    (hit, surface): (&Hit, &Surface),
    (way, side): (Way, f64),
    random: &mut Random,
) -> i64 {
    let direction = random.direction();
    let up = side * dot(direction, surface.normal).signum();
    let Hit { prim, geometry, instance, .. } = *hit;
    let (origin, skip) = match way {
        Way::Position => (surface.position, None),
        Way::Origins if side > 0.0 => {
            (surface.front_origin, Some(PrimId { prim, geometry, instance }))
        }
        Way::Origins => (surface.back_origin, Some(PrimId { prim, geometry, instance })),
    };
    let ray = Ray::new(origin, direction.map(|x| (x * up) as f32));
    let count = |facing| {
        let hits = accel.hits(&ray, &QueryOptions { facing, skip, ..Default::default() });
        hits.filter(|other| other.geometry == geometry).count() as i64
    };
    count(Facing::Back) - count(Facing::Front)
}

/// Surfaces looked at, and those around which numbers do not fit.
fn count_wrong(accel: &Accel, scene: &RenderScene, way: Way, step: u32) -> [usize; 2] {
    let model: &Model = &scene.model.own;
    let closed: Vec<_> = model.meshes.iter().map(is_closed).collect();
    let camera = &scene.cameras[0];
    let [width, height] = camera.resolution;
    let (mut random, mut counts) = (Random::new(1), [0, 0]);
    for pixel in (0..width * height).step_by(step as usize) {
        let ray = camera.ray(pixel % width, pixel / width);
        // All that the ray passes through, and not only what it meets first.
        for hit in accel.hits(&ray, &QueryOptions::default()) {
            if closed.get(hit.geometry as usize) == Some(&false) {
                continue;
            }
            let surface = accel.surface(&ray, &hit).expect("the hit is there");
            let mut at = |side| winding(accel, (&hit, &surface), (way, side), &mut random);
            let [front, again, back] = [at(1.0), at(1.0), at(-1.0)];
            counts[0] += 1;
            counts[1] += usize::from(front != again || back != front + 1);
        }
    }
    counts
}

fn check(name: &str, scene: &RenderScene, step: u32) {
    type Built = Result<OwnedAccel<'static>, raykern::BuildError>;
    type Build = fn(&raykern::Scene<'_, 'static>, &BuildOptions) -> Built;
    for build in [OwnedAccel::grid as Build, OwnedAccel::bvh as Build] {
        let owned =
            scene.model.own.with_scene(|s| build(s, &BuildOptions::default()).expect("a build"));
        let [seen, wrong] = count_wrong(&owned.accel(), scene, Way::Origins, step);
        println!("{name}: {wrong} of {seen} surfaces");
        assert!(seen > 5_000 && wrong == 0, "{name}: {wrong} of {seen}");
        // Else this would show nothing.
        let [_, naive] = count_wrong(&owned.accel(), scene, Way::Position, step);
        println!("{name}: {naive} of {seen} when rays start on the surface");
        assert!(naive > seen / 100, "{name}: {naive} of {seen}");
    }
}

#[test]
fn glass_that_is_made_here() {
    check("glass", &scenes::glass(), 97);
}

#[test]
fn the_glass_tree() {
    let Some(folder) = shared_scenes::folder(None) else {
        println!("skipped: no folder of scenes (RAYKERN_SCENES)");
        return;
    };
    let scene = load(&folder.join("metu/scienceTree_glass.xml")).unwrap_or_else(|e| panic!("{e}"));
    check("scienceTree_glass", &scene, 17);
}

/// How many pixels differ by more than two levels in some colour.
fn far(a: &Image, b: &Image) -> usize {
    let pairs = a.pixels.iter().zip(&b.pixels);
    pairs.filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 2)).count()
}

/// Draws `scene` without any epsilon, once from origins beside the surface and once from the surface itself, and compares both
/// with `expected`.
fn check_picture(name: &str, scene: &RenderScene, expected: &Image, allowed: usize) {
    let owned = scene.model.build(|s| OwnedAccel::bvh(s, &BuildOptions::default()));
    let owned = owned.expect("a build");
    let picture = |epsilon: f64| {
        let scene = RenderScene { shadow_ray_epsilon: epsilon, ..scene.clone() };
        let mut camera = scene.cameras[0].clone();
        camera.resolution = expected.resolution;
        render(&scene, &owned.accel(), &Job::whole(&camera)).image
    };
    // So little moves nothing.
    let [exact, naive] = [0.0, 1e-30].map(picture);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (image, what) in [(&exact, "exact"), (&naive, "naive")] {
        let file = folder.join(format!("leaving_{name}_{what}.png"));
        image.write_png(&file).expect("a picture");
        println!("{}", file.display());
    }
    let [off, acne] = [&exact, &naive].map(|image| far(image, expected));
    println!("{name}: {off} pixels are off, {acne} when rays start on the surface");
    assert!(off <= allowed, "{name}: {off} pixels are off, {allowed} allowed");
    assert!(acne > 50 * allowed, "{name}: {acne} pixels of acne show nothing");
}

#[test]
fn pictures_need_no_epsilon() {
    let scene = scenes::glass();
    let owned = scene.model.build(|s| OwnedAccel::bvh(s, &BuildOptions::default()));
    let with_epsilon =
        render(&scene, &owned.expect("a build").accel(), &Job::whole(&scene.cameras[0])).image;
    check_picture("glass", &scene, &with_epsilon, 2_000);
    let Some(folder) = shared_scenes::folder(None) else {
        println!("skipped: no folder of scenes (RAYKERN_SCENES)");
        return;
    };
    let metu = folder.join("metu");
    let scene = load(&metu.join("scienceTree_glass.xml")).unwrap_or_else(|e| panic!("{e}"));
    let picture = read_png(&metu.join("reference/scienceTree_glass.png"));
    check_picture("scienceTree_glass", &scene, &picture.unwrap_or_else(|e| panic!("{e}")), 1_000);
}

/// Of a sphere only the root nearest to `t = 0` is skipped: a ray that enters it still leaves it, and one that starts inside
/// does not see where it started.
#[test]
fn a_skipped_sphere_is_left() {
    let model = Model { meshes: vec![], sphere_sets: vec![vec![[0.0, 0.0, 0.0, 1.0]]] };
    let owned = model.with_scene(|s| OwnedAccel::bvh(s, &BuildOptions::default()).expect("a list"));
    let skip = Some(PrimId { prim: 0, geometry: 0, instance: raykern::NONE });
    let options = QueryOptions { skip, ..Default::default() };
    for (z, expected) in
        [(-3.0, 4.0), (-1.0f32.next_up(), 2.0), (-1.0, 2.0), (-0.5, 1.5), (0.5, 0.0)]
    {
        let ray = Ray::new([0.0, 0.0, z], [0.0, 0.0, 1.0]);
        let hits: Vec<_> = owned.accel().hits(&ray, &options).map(|hit| hit.t).collect();
        let expected = if z == 0.5 { vec![] } else { vec![expected] };
        assert_eq!(hits, expected, "from {z}");
    }
}
