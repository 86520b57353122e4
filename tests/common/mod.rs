//! All structures over one scene, and answers as bits.

#![allow(dead_code, reason = "each test file uses a part of it")]

pub mod batch;

use raykern::{
    Accel, Backend, BuildOptions, GridKind, GridOptions, Hit, Layout, OpenError, OwnedAccel,
    PlainList, Quality, QueryOptions, Ray, Scene,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};

/// List, grids of every kind, and BVH in every layout and quality over one scene, each forced.
pub struct All<'c>([(&'static str, OwnedAccel<'c>); 13]);

/// Uses the backend that the environment's `RAYKERN_BACKEND` names, if it names one.
pub fn choose_backend() {
    let Ok(name) = std::env::var("RAYKERN_BACKEND") else { return };
    let backend = Backend::ALL.into_iter().find(|b| format!("{b:?}").eq_ignore_ascii_case(&name));
    backend.unwrap_or_else(|| panic!("no backend {name}: {:?}", Backend::ALL)).force();
}

impl<'c> All<'c> {
    pub fn build(scene: &Scene<'_, 'c>) -> Self {
        choose_backend();
        let with = |plain_list| BuildOptions { plain_list, ..Default::default() };
        let never = with(PlainList::Never);
        let of_quality = |layout, quality| {
            let options = BuildOptions { layout, quality, ..never };
            let built = OwnedAccel::bvh(scene, &options).expect("a BVH");
            check_block(&built);
            built
        };
        let bvh = |layout| of_quality(layout, Quality::Balanced);
        let grid = |kind, density, depth| {
            let options = BuildOptions { grid: GridOptions { kind, density, depth }, ..never };
            let built = OwnedAccel::grid(scene, &options).expect("a grid");
            check_block(&built);
            built
        };
        All([
            ("list", OwnedAccel::bvh(scene, &with(PlainList::Always)).expect("a list")),
            ("nested grid", grid(GridKind::Nested, 0.0, 0)),
            ("fine nested grid", grid(GridKind::Nested, 3.0, 2)),
            ("uniform grid", grid(GridKind::Uniform, 0.0, 0)),
            ("octree", grid(GridKind::Octree, 0.0, 0)),
            ("compact", bvh(Layout::Compact)),
            ("wide 4", bvh(Layout::Wide(4))),
            ("wide 8", bvh(Layout::Wide(8))),
            ("wide 16", bvh(Layout::Wide(16))),
            ("compact fast", of_quality(Layout::Compact, Quality::Fast)),
            ("compact best", of_quality(Layout::Compact, Quality::Best)),
            ("wide 16 fast", of_quality(Layout::Wide(16), Quality::Fast)),
            ("wide 16 best", of_quality(Layout::Wide(16), Quality::Best)),
        ])
    }

    pub fn accels(&self) -> [(&'static str, Accel<'_>); 13] {
        self.0.each_ref().map(|(name, built)| (*name, built.accel()))
    }
}

impl All<'static> {
    pub fn of(model: &Model) -> Self {
        model.with_scene(Self::build)
    }
}

/// A block can be opened, unless it refers to others.
fn check_block(built: &OwnedAccel) {
    let accel = built.accel();
    let opened = Accel::open(accel.block());
    let expected = accel.is_linked().then_some(OpenError::Linked);
    assert_eq!(opened.err(), expected, "{:?}", accel.info());
}

/// All bits of an answer.
pub fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    let hit = hit?;
    Some([hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim, hit.geometry, hit.instance])
}

/// The answer on which all agree; panics where they do not.
pub fn agreed(accels: &[(&str, Accel)], ray: &Ray, options: &QueryOptions) -> Option<Hit> {
    let (_, first) = &accels[0];
    let expected = first.intersect_with(ray, options);
    for (name, accel) in accels {
        let hit = accel.intersect_with(ray, options);
        assert_eq!(bits(hit), bits(expected), "{name} {ray:?} {options:?}: {hit:?} {expected:?}");
        let occluded = accel.occluded_with(ray, options);
        assert_eq!(occluded, hit.is_some(), "{name} occluded {ray:?} {options:?}");
    }
    expected
}

/// Up to 30 triangles and 11 spheres of such numbers.
pub fn strewn(random: &mut Random, number: &impl Fn(&mut Random) -> f32) -> Model {
    let point = |r: &mut Random| [0, 1, 2].map(|_| number(r));
    let triangles = 1 + random.below(30);
    let vertices: Vec<_> = (0..3 * triangles).map(|_| point(random)).collect();
    let indices = (0..triangles as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let spheres: Vec<_> = (0..random.below(12))
        .map(|_| (point(random), point(random)))
        .map(|([x, y, z], [r, ..])| [x, y, z, r.abs()])
        .collect();
    Model { meshes: vec![TriangleMesh { vertices, indices }], sphere_sets: vec![spheres] }
}

/// A ray of such numbers, mostly towards a vertex; half of them have limits.
pub fn ray_towards(
    random: &mut Random,
    vertices: &[[f32; 3]],
    number: &impl Fn(&mut Random) -> f32,
) -> Ray {
    let point = |r: &mut Random| [0, 1, 2].map(|_| number(r));
    let origin = point(random);
    let to = vertices[random.below(vertices.len())];
    let direction = match random.below(3) {
        0 => point(random),
        1 => [0, 1, 2].map(|k| to[k] - origin[k]),
        _ => [0, 1, 2].map(|k| to[k] / 2.0 - origin[k] / 2.0),
    };
    let ray = Ray::new(origin, direction);
    match random.below(2) {
        0 => ray.with_limits(number(random), number(random)),
        _ => ray,
    }
}

/// Models with flat, doubled and degenerate triangles, one primitive, and none.
pub fn odd_models() -> Vec<(&'static str, Model)> {
    let mut doubled: Model = make::blob(200, 1).into();
    doubled.meshes.push(doubled.meshes[0].clone());
    doubled.meshes[0].indices.extend_from_within(..50);
    let mut degenerate: Model = make::sphere(200).into();
    let flat: Vec<_> = degenerate.meshes[0].indices.iter().map(|t| [t[0], t[1], t[1]]).collect();
    degenerate.meshes[0].indices.splice(0..0, flat);
    degenerate.meshes[0].vertices[7] = [f32::NAN, 0.0, f32::INFINITY];
    let mut stadium: Model = make::sphere(500).into();
    stadium.meshes.push(make::plane(50).placed(1e5, [-5e4, -5e4, -1.0]));
    // Each triangle a quarter of the one before: a tree is about as deep as they are many.
    let mut peeled = TriangleMesh::default();
    for i in 0..40 {
        peeled.append(&make::plane(2).placed(0.25f64.powi(i), [0.25f64.powi(i), 0.0, 0.0]));
    }
    let mut mixed = make::spheres(100, 2);
    mixed.sphere_sets.push(vec![[0.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.5, -1.0], [0.5, 0.5, 0.5, 0.3]]);
    mixed.sphere_sets.push(vec![[0.5, 0.5, 0.5, 0.3], [f32::NAN, 0.0, 0.0, 1.0]]);
    mixed.meshes.push(make::soup(100, 2));
    vec![
        ("none", Model::default()),
        ("one", make::plane(1).into()),
        ("flat", make::plane(200).into()),
        ("doubled", doubled),
        ("degenerate", degenerate),
        ("stadium", stadium),
        ("peeled", peeled.into()),
        ("mixed", mixed),
    ]
}
