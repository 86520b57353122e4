//! What is measured: ordinary scenes, and scenes in which floats alone cannot decide.

use raykern::Ray;
use raykern_harness::load::load;
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::shared_scenes;

/// Exact against watertight where triangles are thin or sizes differ widely.
const STRESS: f64 = 2.0;
/// Exact against watertight where every ray meets several primitives at the same `t`.
const TIES: f64 = 3.0;

/// A scene, the rays to ask, and the ratio that is not to be exceeded.
pub struct Subject {
    /// Its name in the table.
    pub name: String,
    /// The geometry.
    pub model: Model,
    /// The rays by kind.
    pub rays: Vec<Rays>,
    /// The most that exactness may cost; none where it is only reported.
    pub target: Option<f64>,
}

/// Rays of one kind.
pub struct Rays {
    /// The name of the kind.
    pub kind: &'static str,
    /// The rays.
    pub rays: Vec<Ray>,
    /// Whether `occluded` is asked, or else `intersect`.
    pub occluded: bool,
}

/// A subject that is made when its turn comes; `None` when its file is absent.
type Maker = Box<dyn Fn(usize) -> Option<Subject>>;

/// The same for one that needs no file.
type Stress = fn(usize) -> Subject;

/// All subjects by name, the ordinary ones first.
pub fn all() -> Vec<(String, Maker)> {
    let mut makers: Vec<(String, Maker)> = Vec::new();
    for file in ["metu/bunny.xml", "metu/chinese_dragon.xml", "classic/sponza_part.obj"] {
        makers.push((file.to_owned(), Box::new(move |count| from_file(file, count))));
    }
    makers.push((
        "sphere of 1M".to_owned(),
        Box::new(|count| Some(ordinary("sphere of 1M", make::sphere(1_000_000).into(), count))),
    ));
    let stress: [(&str, Stress); 8] = [
        ("needles", needles),
        ("planet and pebble", |n| planet_and_pebble("planet and pebble", 1e6, n)),
        ("town and pin", |n| planet_and_pebble("town and pin", 1e3, n)),
        ("spheres 1e6 apart", spheres_of_all_sizes),
        ("far away", far_away),
        ("lattice", lattice),
        ("triplicated", triplicated),
        ("coplanar layers", coplanar_layers),
    ];
    for (name, make) in stress {
        makers.push((name.to_owned(), Box::new(move |count| Some(make(count)))));
    }
    makers
}

fn from_file(file: &'static str, count: usize) -> Option<Subject> {
    let path = shared_scenes::folder(None)?.join(file);
    match load(&path) {
        Ok(scene) => Some(ordinary(file, scene.model.flattened()?, count)),
        Err(error) => {
            eprintln!("{error}");
            None
        }
    }
}

/// As a renderer asks: what exactness costs where it is hardly needed.
fn ordinary(name: &str, model: Model, count: usize) -> Subject {
    let kinds = [
        ("primary", Family::Primary, false),
        ("bounce", Family::Bounce, false),
        ("shadow", Family::Shadow, true),
        ("random", Family::Random, false),
    ];
    of_families(name, model, &kinds, None, count)
}

fn of_families(
    name: &str,
    model: Model,
    kinds: &[(&'static str, Family, bool)],
    target: Option<f64>,
    count: usize,
) -> Subject {
    let mut rays = Vec::new();
    for (seed, &(kind, family, occluded)) in kinds.iter().enumerate() {
        let made = RayMaker::new(&model, seed as u64 + 1).many(family, count);
        rays.push(Rays { kind, rays: made, occluded });
    }
    Subject { name: name.to_owned(), model, rays, target }
}

/// 100,000 triangles a twentieth as long as the scene is wide, and 1e3 to 1e7 times longer than wide.
fn needles(count: usize) -> Subject {
    let mut random = Random::new(1);
    let mut mesh = TriangleMesh::default();
    for i in 0..100_000 {
        let (at, way, side) = (random.point(0.0, 1.0), random.direction(), random.direction());
        let width = 0.05 * 10f64.powf(random.between(-7.0, -3.0));
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[along, across]| {
            std::array::from_fn(|k| {
                (at[k] + 0.05 * along * way[k] + width * across * side[k]) as f32
            })
        });
        mesh.vertices.extend(corners);
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let kinds = [
        ("random", Family::Random, false),
        ("at edges", Family::AtEdge, false),
        ("at vertices", Family::AtVertex, false),
        ("shadow", Family::Shadow, true),
    ];
    of_families("needles", mesh.into(), &kinds, Some(STRESS), count)
}

/// A wrinkled ball of radius 1 on a ball `ratio` times as large, of 80,000 triangles each: seen from
/// a few small radii away, and from a large one.
fn planet_and_pebble(name: &str, ratio: f64, count: usize) -> Subject {
    let planet = make::sphere(80_000).placed(ratio, [0.0, 0.0, -ratio]);
    let pebble = make::blob(80_000, 1).placed(1.0, [0.0, 0.0, 0.8]);
    let model = Model { meshes: vec![planet, pebble], sphere_sets: vec![] };
    let rays = vec![
        Rays { kind: "near", rays: towards_origin(count, 4.0, 2.0), occluded: false },
        Rays { kind: "from afar", rays: towards_origin(count, ratio, 2.0), occluded: false },
        Rays { kind: "shadow", rays: towards_origin(count, 4.0, 2.0), occluded: true },
    ];
    Subject { name: name.to_owned(), model, rays, target: Some(STRESS) }
}

/// Spheres with radii from 1 to 1e-6 that come closer to the origin as they get smaller.
fn spheres_of_all_sizes(count: usize) -> Subject {
    let mut random = Random::new(2);
    let mut set = vec![[0.0, 0.0, -1e3, 1e3]];
    for _ in 0..20_000 {
        let size = 10f64.powf(random.between(-6.0, 0.0));
        let [x, y, z] = random.direction().map(|c| 10.0 * c * size);
        set.push([x, y, z.abs(), 0.3 * size].map(|v| v as f32));
    }
    let model = Model { meshes: vec![], sphere_sets: vec![set] };
    let rays = vec![
        Rays { kind: "random", rays: towards_origin(count, 20.0, 5.0), occluded: false },
        Rays { kind: "to the small", rays: towards_origin(count, 20.0, 1e-5), occluded: false },
        Rays { kind: "shadow", rays: towards_origin(count, 1e-2, 5.0), occluded: true },
    ];
    Subject { name: "spheres 1e6 apart".to_owned(), model, rays, target: Some(STRESS) }
}

/// A wrinkled ball of radius 1, with its centre 10,000 from the origin along each axis.
fn far_away(count: usize) -> Subject {
    let model = make::blob(100_000, 1).placed(1.0, [1e4, -1e4, 1e4]).into();
    let kinds = [("random", Family::Random, false), ("bounce", Family::Bounce, false)];
    of_families("far away", model, &kinds, None, count)
}

/// Whole numbers throughout: every ray runs exactly through a vertex, where six triangles meet.
fn lattice(count: usize) -> Subject {
    const SIDE: usize = 200;
    let mut random = Random::new(3);
    let mut mesh = make::plane(2 * SIDE * SIDE).mapped(|p| p.map(|c| (c * SIDE as f64).round()));
    for vertex in &mut mesh.vertices {
        vertex[2] = random.below(4) as f32;
    }
    let mut through = |slanted: bool| {
        let ray = |_| {
            let to = mesh.vertices[random.below(mesh.vertices.len())];
            let mut step = || if slanted { random.below(9) as f32 - 4.0 } else { 0.0 };
            let direction = [step(), step(), -4.0];
            Ray::new(std::array::from_fn(|k| to[k] - 4.0 * direction[k]), direction)
        };
        (0..count).map(ray).collect()
    };
    let rays = vec![
        Rays { kind: "straight down", rays: through(false), occluded: false },
        Rays { kind: "slanted", rays: through(true), occluded: false },
    ];
    Subject { name: "lattice".to_owned(), model: mesh.into(), rays, target: Some(TIES) }
}

/// The same ball three times, so that every hit is three hits.
fn triplicated(count: usize) -> Subject {
    let mesh = make::blob(50_000, 1);
    let model = Model { meshes: vec![mesh.clone(), mesh.clone(), mesh], sphere_sets: vec![] };
    let kinds = [
        ("primary", Family::Primary, false),
        ("random", Family::Random, false),
        ("bounce", Family::Bounce, false),
    ];
    of_families("triplicated", model, &kinds, Some(TIES), count)
}

/// Four rasters of 8 to 64 squares a side in one slanted plane: four triangles at every hit.
fn coplanar_layers(count: usize) -> Subject {
    let layer =
        |side: usize| make::plane(2 * side * side).mapped(|[x, y, _]| [x, y, 0.5 * x + 0.25 * y]);
    let meshes = [8, 16, 32, 64].map(layer).to_vec();
    let model = Model { meshes, sphere_sets: vec![] };
    let kinds = [
        ("random", Family::Random, false),
        ("axis-parallel", Family::AxisParallel, false),
        ("at vertices", Family::ThroughVertex, false),
    ];
    of_families("coplanar layers", model, &kinds, Some(TIES), count)
}

/// Rays from `distance` above the origin, in all directions, to points within `reach` of it.
fn towards_origin(count: usize, distance: f64, reach: f64) -> Vec<Ray> {
    let mut random = Random::new(4);
    let ray = |_| {
        let [x, y, z] = random.direction().map(|c| c * distance);
        let (from, to) = ([x, y, z.abs()], random.point(-reach, reach));
        let direction = std::array::from_fn(|k| (to[k] - from[k]) as f32);
        Ray::new(from.map(|c| c as f32), direction)
    };
    (0..count).map(ray).collect()
}
