//! Pictures with instances: against the same scene without them, the pictures of the course, and ellipsoids by their equation.
//!
//! A flattened scene is another one: its vertices are rounded after they are mapped, while the rays of instances are rounded
//! before. Where both are exact, answers are the same bits. Elsewhere rays that pass an edge by about the last bit
//! may fall to either side, and pixels differ; how many is counted here.

use glam::{DAffine3, DMat3, DVec3};
use raykern::{BuildOptions, Hit, OwnedAccel, PlainList, Scene};
use raykern_harness::assembly::{Assembly, Place};
use raykern_harness::load::load;
use raykern_harness::make;
use raykern_harness::render::{Camera, Image, Job, RenderScene, hit_mask, read_png, render};
use raykern_harness::shared_scenes;

type Build =
    for<'c> fn(&Scene<'_, 'c>, &BuildOptions) -> Result<OwnedAccel<'c>, raykern::BuildError>;

fn built(model: &Assembly, build: Build) -> OwnedAccel<'static> {
    let options = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    model.build(|scene| build(scene, &options)).expect("a scene that can be built")
}

fn file(name: &str) -> Option<RenderScene> {
    let Some(folder) = shared_scenes::folder(None) else {
        println!("skipped: no folder of scenes (RAYKERN_SCENES)");
        return None;
    };
    Some(load(&folder.join(name)).unwrap_or_else(|e| panic!("{e}")))
}

/// A scene with and without instances.
struct Pair {
    instanced: (RenderScene, OwnedAccel<'static>),
    flat: (RenderScene, OwnedAccel<'static>),
}

impl Pair {
    fn new(scene: RenderScene) -> Self {
        let flat = scene.flattened().expect("no ellipsoids");
        let [first, second] = [&scene, &flat].map(|scene| built(&scene.model, OwnedAccel::bvh));
        Pair { instanced: (scene, first), flat: (flat, second) }
    }

    /// Pixels whose rays answer differently by `differ`, pixels of different colours, and those that differ by more than one
    /// of 255 levels.
    fn count(
        &self,
        camera: &Camera,
        differ: impl Fn(Option<Hit>, Option<Hit>) -> bool,
    ) -> [usize; 3] {
        let picture = |(scene, owned): &(RenderScene, OwnedAccel)| -> Image {
            render(scene, &owned.accel(), &Job::whole(camera)).image
        };
        let [instanced, flat] = [&self.instanced, &self.flat].map(|(_, owned)| owned.accel());
        let [width, height] = camera.resolution;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| camera.ray(x, y)));
        let differing = pixels.filter(|ray| differ(instanced.intersect(ray), flat.intersect(ray)));
        let differing = differing.count();
        let [ours, theirs] = [picture(&self.instanced), picture(&self.flat)];
        let pairs = ours.pixels.iter().zip(&theirs.pixels);
        let far = pairs.filter(|(a, b)| (0..3).any(|k| a[k].abs_diff(b[k]) > 1)).count();
        [differing, ours.differing_pixels(&theirs), far]
    }
}

/// Knots with vertices of few digits, turned by quarters, mirrored, doubled, halved, moved by few digits.
fn exact_scene() -> RenderScene {
    let knot = make::knot(3_000).mapped(|p| p.map(|x| (x * 512.0).round() / 512.0));
    let floor = make::plane(2).mapped(|[x, y, _]| [16.0 * x - 8.0, 16.0 * y - 8.0, -2.0]);
    let quarter = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let maps = [
        (DMat3::IDENTITY, [-3.0, -2.5, 0.25]),
        (quarter, [0.0, -2.5, 0.0]),
        (2.0 * mirror, [3.0, 2.0, 0.5]),
        (0.5 * quarter * quarter, [-2.75, 2.0, -0.125]),
        (DMat3::from_diagonal(DVec3::new(0.5, 1.0, 2.0)), [3.5, -3.0, 0.0]),
        (mirror * quarter, [-1.0, 1.5, 1.0]),
    ];
    let place = |(linear, shift): &(DMat3, [f64; 3])| {
        let map = DAffine3::from_mat3_translation(*linear, DVec3::from(*shift));
        Place::new(0, &map).expect("maps with volume")
    };
    let mut scene = RenderScene::portrait(floor.into(), DVec3::Z, DVec3::new(0.5, -1.0, 1.0));
    scene.model.children.push(knot.into());
    scene.model.places = maps.iter().map(place).collect();
    scene.place_material = vec![0; maps.len()];
    let camera = Camera::look_at(
        DVec3::new(3.25, -12.5, 9.75),
        DVec3::ZERO,
        DVec3::Z,
        50.0,
        1.0,
        [160, 160],
    );
    scene.cameras = vec![camera.expect("a sound camera")];
    scene
}

#[test]
fn exact_rays_and_vertices_make_no_difference() {
    let pair = Pair::new(exact_scene());
    let scene = &pair.instanced.0;
    // Of the first geometries the floor is its own, the others are those of places.
    let named = |hit: Hit| (hit.t.to_bits(), hit.prim, hit.instance.wrapping_add(1));
    let flat = |hit: Hit| (hit.t.to_bits(), hit.prim, hit.geometry);
    let camera = &scene.cameras[0];
    let [rays, pixels, _] = pair.count(camera, |a, b| a.map(named) != b.map(flat));
    let accel = pair.instanced.1.accel();
    let seen: Vec<_> = (0..camera.pixel_count() as u32)
        .filter_map(|i| accel.intersect(&camera.ray(i % 160, i / 160)))
        .collect();
    for instance in 0..6 {
        let pixels = seen.iter().filter(|hit| hit.instance == instance).count();
        assert!(pixels > 30, "{pixels} pixels of instance {instance}");
    }
    // Shadow rays start at points that are not exact, but far from edges as a rule.
    println!("{rays} rays, {pixels} pixels differ");
    assert!(rays == 0 && pixels <= 2, "{rays} rays, {pixels} pixels differ");
}

/// `allowed`: pixels of other primitives, of other colours, and of colours more than one level apart.
fn check_against_flat(name: &str, divisor: u32, allowed: [usize; 3]) {
    let Some(scene) = file(name) else { return };
    let camera = &scene.cameras[0];
    let camera = camera.with_resolution(camera.resolution.map(|n| n / divisor)).unwrap();
    let pair = Pair::new(scene);
    let other = |a: Option<Hit>, b: Option<Hit>| {
        assert_eq!(a.is_some(), b.is_some(), "{a:?} {b:?}");
        a.map(|hit| hit.prim) != b.map(|hit| hit.prim)
    };
    let found = pair.count(&camera, other);
    println!(
        "{name}: {found:?} of {} pixels differ in the primitive, in colour, by more than a level",
        camera.pixel_count()
    );
    assert!((0..3).all(|k| found[k] <= allowed[k]), "{name}: {found:?}, {allowed:?} allowed");
}

#[test]
fn flattened_dragons_differ_in_few_pixels() {
    check_against_flat("metu/marching_dragons.xml", 4, [10, 400, 10]);
}

#[test]
fn flattened_grass_differs_in_few_pixels() {
    check_against_flat("metu/grass_desert.xml", 4, [10, 400, 10]);
}

/// By either structure over either. Since most that is not a dragon is the floor, the colours of some pixels are compared too.
#[test]
fn marching_dragons_are_where_their_picture_shows_them() {
    let Some(scene) = file("metu/marching_dragons.xml") else { return };
    let folder = shared_scenes::folder(None).expect("the folder of that scene");
    let picture = folder.join("metu/reference/marching_dragons.png");
    let picture = read_png(&picture).unwrap_or_else(|e| panic!("{e}"));
    let expected: Vec<bool> = picture.pixels.iter().map(|p| *p != [0; 3]).collect();
    for build in [OwnedAccel::grid as Build, OwnedAccel::bvh] {
        let owned = built(&scene.model, build);
        let found = hit_mask(&scene, &owned.accel(), &scene.cameras[0]);
        let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0, "{:?}: pixels that differ", owned.accel().info().kind);
        let some: Vec<u32> = (0..expected.len() as u32).step_by(23).collect();
        let job = Job { pixels: Some(&some), ..Job::whole(&scene.cameras[0]) };
        let ours = render(&scene, &owned.accel(), &job).image;
        let far = |i: &&u32| {
            let [a, b] = [&ours, &picture].map(|image| image.pixels[**i as usize]);
            (0..3).any(|k| a[k].abs_diff(b[k]) > 2)
        };
        let far = some.iter().filter(far).count();
        println!("{far} of {} pixels have other colours", some.len());
        assert!(far < 300, "{far} of {} pixels have other colours", some.len());
    }
}

/// Where the ray of a pixel first meets an ellipsoid in front of it, in the ellipsoid's own space in `f64`, and how
/// safely: the discriminant in parts of its terms.
fn meeting(place: &Place, origin: DVec3, direction: DVec3) -> (Option<f64>, f64) {
    let inverse = place.map().inverse();
    let (o, d) = (inverse.transform_point3(origin), inverse.transform_vector3(direction));
    let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
    let discriminant = b * b - a * c;
    let t = (-b - discriminant.sqrt()) / a;
    (Some(t).filter(|t| *t > 0.0), discriminant.abs() / (b * b))
}

#[test]
fn ellipsoids_are_where_their_equation_says() {
    let Some(scene) = file("metu/ellipsoids.xml") else { return };
    let camera = &scene.cameras[0];
    let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
    assert_eq!((scene.model.places.len(), scene.model.own.sphere_count()), (3, 3));
    for build in [OwnedAccel::grid as Build, OwnedAccel::bvh] {
        let owned = built(&scene.model, build);
        let (mut on_ellipsoids, mut unsure) = (0, 0);
        for pixel in 0..camera.pixel_count() as u32 {
            let ray = camera.ray(pixel % camera.resolution[0], pixel / camera.resolution[0]);
            let (origin, direction) = (wide(ray.origin), wide(ray.direction));
            let all = scene.model.places.iter().map(|place| meeting(place, origin, direction));
            let all: Vec<_> = all.collect();
            if all.iter().any(|(_, safety)| *safety < 1e-5) {
                unsure += 1;
                continue;
            }
            let first = all.iter().filter_map(|(t, _)| *t).fold(f64::INFINITY, f64::min);
            let hit = owned.accel().intersect(&ray);
            match hit.filter(|hit| hit.instance != raykern::NONE) {
                None => {
                    assert!(hit.is_some_and(|hit| f64::from(hit.t) < first) || first.is_infinite())
                }
                Some(hit) => {
                    assert!(
                        (f64::from(hit.t) / first - 1.0).abs() < 1e-5,
                        "{pixel}: {hit:?} {first}"
                    );
                    let normal = scene.normal(&hit, origin + first * direction);
                    let ours = owned.accel().surface(&ray, &hit).expect("the hit is there");
                    assert!((normal - wide(ours.normal)).length() < 1e-3, "{normal} {ours:?}");
                    on_ellipsoids += 1;
                }
            }
        }
        println!("{on_ellipsoids} pixels of ellipsoids, {unsure} too close to their edges");
        assert!(on_ellipsoids > 30_000 && unsure < 200, "{on_ellipsoids} {unsure}");
    }
}
