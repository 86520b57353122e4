//! The scenes: files, where they are at hand, and generated geometry.

use glam::DVec3;
use raykern_harness::load::load;
use raykern_harness::make;
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::render::{Camera, RenderScene};
use raykern_harness::shared_scenes;

use crate::options::Options;

/// Where rays start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// From the file's camera or, for a bare mesh, from outside with all of it in view.
    Given,
    /// From the place inside that is furthest from any surface.
    Inside,
}

/// A scene before it is made.
pub struct Case {
    /// The name in tables.
    pub name: String,
    source: Source,
    view: View,
    /// Whether it is a plain call that is measured, not a scene.
    pub fixed_cost: bool,
}

enum Source {
    File(&'static str),
    Made { make: fn(usize) -> Model, triangles: usize, up: DVec3, from: DVec3 },
}

/// A scene, ready to be built over.
pub struct Loaded {
    /// Triangles only.
    pub model: Model,
    /// Where rays start.
    pub view: View,
    /// For [`View::Given`].
    pub camera: Camera,
    /// For [`View::Given`]: where shadow rays end.
    pub light: DVec3,
}

const FILES: [(&str, &str, View); 8] = [
    ("chinese_dragon", "metu/chinese_dragon.xml", View::Given),
    ("sponza_part", "classic/sponza_part.obj", View::Inside),
    ("bunny_monastery", "classic/bunny_monastery.xml", View::Given),
    ("japanese_maple", "classic/japanese_maple.obj", View::Given),
    ("armadillo", "classic/armadillo.obj", View::Given),
    ("buddha", "classic/buddha.obj", View::Given),
    ("scienceTree_glass", "metu/scienceTree_glass.xml", View::Given),
    ("samurai", "classic/samurai_monastry.obj", View::Given),
];

/// Name, maker, triangles, view.
type Made = (&'static str, fn(usize) -> Model, usize, View);

const MADE: [Made; 5] = [
    ("sphere", |n| make::sphere(n).into(), 1_000_000, View::Given),
    ("terrain", |n| make::terrain(n, 1).into(), 1_000_000, View::Given),
    ("hair", |n| make::hair(n, 1).into(), 1_000_000, View::Given),
    ("architecture", halls, 800_000, View::Inside),
    ("cave", cave, 8_000_000, View::Inside),
];

/// How much smaller generated scenes are in a quick run.
const QUICK: usize = 25;
/// The scenes of a quick run that names none.
const QUICK_SCENES: [&str; 2] = ["sphere", "architecture"];

/// The scenes that `options` asks for.
pub fn cases(options: &Options) -> Vec<Case> {
    if options.growth {
        let mut cases = growth(if options.quick { 100_000 } else { 10_000_000 });
        cases.retain(|case| options.names_scene(&case.name).unwrap_or(true));
        return cases;
    }
    let made = MADE.iter().map(|&(name, make, triangles, view)| {
        let triangles = if options.quick { triangles / QUICK } else { triangles };
        made(name, make, triangles, view)
    });
    let files = FILES.iter().map(|&(name, file, view)| Case {
        name: name.to_string(),
        source: Source::File(file),
        view,
        fixed_cost: false,
    });
    let call = Case { fixed_cost: true, ..made_outside("one_triangle", one_triangle, 1) };
    let wanted = |case: &Case| {
        options.names_scene(&case.name).unwrap_or(
            !options.quick || case.fixed_cost || QUICK_SCENES.contains(&case.name.as_str()),
        )
    };
    [call].into_iter().chain(files).chain(made).filter(wanted).collect()
}

/// Spheres from a thousand triangles to `largest`, two to a factor of ten.
fn growth(largest: usize) -> Vec<Case> {
    let sizes = (6..=14).map(|i| 10f64.powf(f64::from(i) / 2.0) as usize);
    let sizes = sizes.filter(|&size| size <= largest);
    sizes.map(|n| made_outside(&format!("sphere_{n}"), |n| make::sphere(n).into(), n)).collect()
}

fn made_outside(name: &str, make: fn(usize) -> Model, triangles: usize) -> Case {
    made(name, make, triangles, View::Given)
}

fn made(name: &str, make: fn(usize) -> Model, triangles: usize, view: View) -> Case {
    let (up, from) = (DVec3::Z, DVec3::new(0.3, -1.0, 0.5));
    let source = Source::Made { make, triangles, up, from };
    Case { name: name.to_string(), source, view, fixed_cost: false }
}

impl Case {
    /// Loads or makes it; the reason when that cannot be done.
    pub fn load(&self, options: &Options) -> Result<Loaded, String> {
        let scene = match self.source {
            Source::Made { make, triangles, up, from } => {
                RenderScene::portrait(make(triangles), up, from)
            }
            Source::File(file) => read_file(file, options)?,
        };
        prepared(scene, self.view)
    }
}

/// The scene of a file in the folder of scenes, seen as the file says; the reason when it cannot be loaded.
pub fn load_file(file: &str, options: &Options) -> Result<Loaded, String> {
    prepared(read_file(file, options)?, View::Given)
}

fn read_file(file: &str, options: &Options) -> Result<RenderScene, String> {
    let folder = shared_scenes::folder(options.folder.as_deref());
    let folder = folder.ok_or("no folder of scenes (--folder, RAYKERN_SCENES)")?;
    load(&folder.join(file)).map_err(|error| error.to_string())
}

/// A scene as it is measured: triangles alone.
pub fn prepared(mut scene: RenderScene, view: View) -> Result<Loaded, String> {
    let mut model = scene.model.flattened().ok_or("has ellipsoids")?;
    model.sphere_sets.clear();
    let camera = scene.cameras.swap_remove(0);
    let light = scene.lights.first().map_or(camera.position, |light| light.position);
    Ok(Loaded { model, view, camera, light })
}

/// Four by four halls of pillars and crates on each of five storeys, with gaps between them.
fn halls(triangles: usize) -> Model {
    let mut mesh = TriangleMesh::default();
    for i in 0..80u32 {
        let [x, y, z] = [i % 4, i / 4 % 4, i / 16].map(f64::from);
        let hall = make::architecture(triangles / 80, u64::from(i));
        mesh.append(&hall.placed(1.0, [41.0 * x, 21.0 * y, 9.0 * z]));
    }
    mesh.into()
}

/// A wrinkled hollow with a knot floating in it, for a camera inside.
fn cave(triangles: usize) -> Model {
    let mut mesh = make::blob(triangles / 8 * 7, 1);
    mesh.append(&make::knot(triangles / 8).placed(0.25, [0.3, 0.2, -0.2]));
    mesh.into()
}

fn one_triangle(_: usize) -> Model {
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 0.1, 1.0]];
    TriangleMesh { vertices, indices: vec![[0, 1, 2]] }.into()
}
