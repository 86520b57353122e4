//! Embree 3 through the shim in `embree.c`.

use std::ffi::{CStr, CString, c_char, c_int};
use std::rc::Rc;
use std::time::Instant;

use raykern::{Hit, Ray};
use raykern_harness::model::Model;

use crate::builds::Builder;
use crate::lineup::{Class, Lineup, Tracer};
use crate::motion::Follower;
use crate::options::Options;
use crate::points::Finder;
use crate::watch::{Watch, timed_build};

/// An opaque `BenchEmbree`.
#[repr(C)]
struct RawScene([u8; 0]);
/// An opaque `BenchBatch`.
#[repr(C)]
struct RawBatch([u8; 0]);

unsafe extern "C" {
    fn bench_embree_version() -> c_int;
    fn bench_embree_new(config: *const c_char, quality: c_int, flags: c_int) -> *mut RawScene;
    fn bench_embree_mesh(
        scene: *mut RawScene,
        vertices: *const f32,
        vertex_count: usize,
        indices: *const u32,
        triangle_count: usize,
    ) -> c_int;
    fn bench_embree_spheres(scene: *mut RawScene, spheres: *const f32, count: usize) -> c_int;
    fn bench_embree_moving(scene: *mut RawScene, refit: c_int);
    fn bench_embree_move(scene: *mut RawScene, vertices: *const f32, vertex_count: usize);
    fn bench_embree_instance(scene: *mut RawScene, maps: *const f32, count: usize) -> c_int;
    fn bench_embree_place(scene: *mut RawScene, maps: *const f32, count: usize);
    fn bench_embree_commit(scene: *mut RawScene) -> c_int;
    fn bench_embree_bytes(scene: *const RawScene) -> usize;
    fn bench_embree_free(scene: *mut RawScene);
    fn bench_embree_closest(scene: *mut RawScene, rays: *const Ray, hits: *mut Hit, count: usize);
    fn bench_embree_any(scene: *mut RawScene, rays: *const Ray, occluded: *mut u8, count: usize);
    fn bench_embree_points(scene: *mut RawScene, points: *const f32, found: *mut Hit, count: usize);
    fn bench_batch_new(rays: *const Ray, count: usize, width: c_int, any: c_int) -> *mut RawBatch;
    fn bench_batch_run(scene: *mut RawScene, batch: *mut RawBatch, coherent: c_int);
    fn bench_batch_hits(batch: *const RawBatch, hits: *mut Hit);
    fn bench_batch_occluded(batch: *const RawBatch, occluded: *mut u8);
    fn bench_batch_free(batch: *mut RawBatch);
}

/// How a scene is built.
#[derive(Clone, Copy)]
pub struct Way {
    /// 0 low, 1 medium, 2 high.
    pub quality: c_int,
    /// Of the scene: [`PLAIN`], [`COMPACT`], [`ROBUST`].
    pub flags: c_int,
    /// Settings of the device.
    pub config: &'static CStr,
}

/// No flag.
pub const PLAIN: c_int = 0;
/// `RTC_SCENE_FLAG_COMPACT`.
pub const COMPACT: c_int = 2;
/// `RTC_SCENE_FLAG_ROBUST`.
pub const ROBUST: c_int = 4;

/// How it takes part in the comparison.
struct Setup {
    name: &'static str,
    quality: c_int,
    flags: c_int,
    single: Class,
    /// The classes of streams, and of packets and streams with the coherent flag; `None` to leave them out.
    batch: Option<[Class; 2]>,
}

const SETUPS: [Setup; 4] = [
    Setup {
        name: "embree",
        quality: 1,
        flags: PLAIN,
        single: Class::Embree,
        batch: Some([Class::EmbreeStream, Class::EmbreePackets]),
    },
    Setup {
        name: "embree-robust",
        quality: 1,
        flags: ROBUST,
        single: Class::EmbreeRobust,
        batch: Some([Class::EmbreeRobustBatch; 2]),
    },
    Setup { name: "embree-high", quality: 2, flags: PLAIN, single: Class::EmbreeHigh, batch: None },
    Setup { name: "embree-low", quality: 0, flags: PLAIN, single: Class::EmbreeLow, batch: None },
];

/// What follows the name, and the device's settings. On some processors Embree is faster without
/// the widest vectors.
const DEVICES: [(&str, &CStr); 2] = [("", c""), ("-avx2", c"isa=avx2")];

impl Setup {
    fn on(&self, config: &'static CStr) -> Way {
        Way { quality: self.quality, flags: self.flags, config }
    }
}

/// Adds every setup on every device.
pub fn join(lineup: &mut Lineup, model: &Model, options: &Options) {
    for setup in &SETUPS {
        for (suffix, config) in DEVICES {
            let name = format!("{}{suffix}", setup.name);
            if !options.wants_peer(&name) {
                continue;
            }
            let (scene, seconds) = timed_scene(model, setup.on(config));
            let Some(scene) = scene else {
                lineup.notes.push(format!("{name}: Embree refused"));
                continue;
            };
            lineup.built(&name, seconds, Some(scene.bytes()));
            let scene = Rc::new(scene);
            if let Some(classes) = setup.batch {
                add_batches(lineup, &name, classes, &scene);
            }
            lineup.add(name, setup.single, Single(scene));
        }
    }
}

/// Adds the setups of medium quality over instances of `model`. Of the builds only that over the instances counts.
///
/// One ray at a time: packets and streams are left out, since `rtcOccluded16` of Embree 3.13.5 does not come back from instances.
pub fn join_instances(lineup: &mut Lineup, model: &Model, maps: &[[f32; 12]], options: &Options) {
    for setup in SETUPS.iter().filter(|setup| setup.batch.is_some()) {
        for (suffix, config) in DEVICES {
            let name = format!("{}{suffix}", setup.name);
            if !options.wants_peer(&name) {
                continue;
            }
            let Some((scene, seconds, bytes)) = Scene::instanced(model, maps, setup.on(config))
            else {
                lineup.notes.push(format!("{name}: Embree refused"));
                continue;
            };
            lineup.built(&name, seconds, Some(bytes));
            lineup.add(name, setup.single, Single(Rc::new(scene)));
        }
    }
}

fn add_batches(lineup: &mut Lineup, name: &str, [streams, packets]: [Class; 2], scene: &Rc<Scene>) {
    for (form, class, width, coherent) in [
        ("x8", packets, 8, None),
        ("x16", packets, 16, None),
        ("stream", streams, 1, Some(false)),
        ("stream coherent", packets, 1, Some(true)),
    ] {
        let batch = Batched { scene: scene.clone(), width, coherent };
        lineup.add(format!("{name} {form}"), class, batch);
    }
}

/// Embree's version, as its header says.
pub fn version() -> String {
    // SAFETY: it returns a constant.
    let number = unsafe { bench_embree_version() };
    format!("{}.{}.{}", number / 10_000, number / 100 % 100, number % 100)
}

/// One scene, asked one ray at a time, with the seconds of its build and its bytes; `None` when Embree refuses.
pub fn single(model: &Model, way: Way) -> Option<(Box<dyn Tracer>, f64, usize)> {
    let (scene, seconds) = timed_scene(model, way);
    let scene = scene?;
    let bytes = scene.bytes();
    Some((Box::new(Single(Rc::new(scene))), seconds, bytes))
}

/// The same over instances of `model`; seconds and bytes are of what is over the model.
pub fn single_instances(
    model: &Model,
    maps: &[[f32; 12]],
    way: Way,
) -> Option<(Box<dyn Tracer>, f64, usize)> {
    let (scene, seconds, bytes) = Scene::instanced(model, maps, way)?;
    Some((Box::new(Single(Rc::new(scene))), seconds, bytes))
}

/// Only the commit is timed: meshes are copied before.
fn timed_scene(model: &Model, way: Way) -> (Option<Scene>, f64) {
    let mut commits = Vec::new();
    let (scene, _) = timed_build(|| {
        let scene = Scene::new(model, way)?;
        let mut watch = Watch::new();
        let failed = watch.time(|| scene.commit());
        commits.push(watch.take().seconds);
        (!failed).then_some(scene)
    });
    (scene, crate::watch::median(&commits))
}

/// Every quality, built by the default of instruction sets; without the copying of meshes.
pub fn builders(options: &Options) -> Vec<Builder> {
    let wanted = |setup: &&Setup| setup.flags == PLAIN && options.wants_peer(setup.name);
    let builders = SETUPS.iter().filter(wanted).map(|setup| Builder {
        name: setup.name.to_string(),
        build: Box::new(|model, threads| {
            let config = CString::new(format!("threads={threads},start_threads=1")).ok()?;
            let scene = Scene::configured(model, setup.quality, PLAIN, &config)?;
            let started = Instant::now();
            let failed = scene.commit();
            (!failed).then(|| started.elapsed().as_secs_f64())
        }),
        ours: None,
    });
    builders.collect()
}

/// Every way to follow one mesh that moves, by name. Like the others, each is timed without the copying of vertices.
pub fn followers(model: &Model, options: &Options) -> Vec<(String, Box<dyn Follower>)> {
    let mut followers: Vec<(String, Box<dyn Follower>)> = Vec::new();
    for (suffix, config) in DEVICES {
        // `None`: a scene that is not said to move.
        for (way, refit) in [("refit", Some(true)), ("low", Some(false)), ("low, still", None)] {
            let name = format!("embree{suffix} {way}");
            let scene = Scene::followed(model, config, refit).filter(|_| options.wants_peer(&name));
            followers.extend(scene.map(|scene| (name, Box::new(scene) as Box<dyn Follower>)));
        }
    }
    followers
}

/// The closest point by Embree, whose caller computes the distance to each triangle.
pub fn finders(model: &Model, options: &Options) -> Vec<(String, Box<dyn Finder>)> {
    let mut finders: Vec<(String, Box<dyn Finder>)> = Vec::new();
    for (suffix, config) in DEVICES {
        let name = format!("embree{suffix}");
        let scene = Scene::new(model, SETUPS[0].on(config)).filter(|scene| !scene.commit());
        let scene = scene.filter(|_| options.wants_peer(&name));
        finders.extend(scene.map(|scene| (name, Box::new(scene) as Box<dyn Finder>)));
    }
    finders
}

impl Finder for Scene {
    fn find(&self, points: &[[f32; 3]], found: &mut [Hit]) {
        let count = points.len().min(found.len());
        let numbers = points.as_flattened().as_ptr();
        // SAFETY: both slices have that many elements.
        unsafe { bench_embree_points(self.0, numbers, found.as_mut_ptr(), count) };
    }
}

impl Follower for Scene {
    fn follow(&mut self, model: &Model, rays: &[Ray], hits: &mut [Hit]) -> [f64; 2] {
        let vertices = model.meshes[0].vertices.as_flattened();
        // SAFETY: the scene has one mesh with as many vertices.
        unsafe { bench_embree_move(self.0, vertices.as_ptr(), vertices.len() / 3) };
        let mut watch = Watch::new();
        watch.time(|| self.commit());
        let update = watch.take().seconds;
        let count = rays.len().min(hits.len());
        // SAFETY: both slices have that many elements.
        let trace =
            || unsafe { bench_embree_closest(self.0, rays.as_ptr(), hits.as_mut_ptr(), count) };
        watch.time(trace);
        [update, watch.take().seconds]
    }
}

/// A device and a scene on it.
struct Scene(*mut RawScene);

impl Scene {
    fn new(model: &Model, Way { quality, flags, config }: Way) -> Option<Self> {
        Scene::configured(model, quality, flags, config)
    }

    fn configured(model: &Model, quality: c_int, flags: c_int, config: &CStr) -> Option<Self> {
        // SAFETY: the string ends with a zero.
        let raw = unsafe { bench_embree_new(config.as_ptr(), quality, flags) };
        (!raw.is_null()).then_some(Scene(raw))?.with_meshes(model)
    }

    /// For a model that moves.
    fn followed(model: &Model, config: &CStr, refit: Option<bool>) -> Option<Self> {
        // SAFETY: the string ends with a zero.
        let raw = unsafe { bench_embree_new(config.as_ptr(), 0, PLAIN) };
        let scene = (!raw.is_null()).then_some(Scene(raw))?;
        if let Some(refit) = refit {
            // SAFETY: the scene exists.
            unsafe { bench_embree_moving(scene.0, refit.into()) };
        }
        let scene = scene.with_meshes(model)?;
        (!scene.commit()).then_some(scene)
    }

    /// Over instances of a model; with the seconds and the bytes that what is over the model takes, built anew as for a frame.
    fn instanced(model: &Model, maps: &[[f32; 12]], way: Way) -> Option<(Self, f64, usize)> {
        let scene = Scene::new(model, way).filter(|scene| !scene.commit())?;
        let below = scene.bytes();
        let (numbers, count) = (maps.as_flattened().as_ptr(), maps.len());
        // SAFETY: the scene is built, and there are that many maps.
        if unsafe { bench_embree_instance(scene.0, numbers, count) != 0 } || scene.commit() {
            return None;
        }
        let (_, seconds) = timed_build(|| {
            // SAFETY: the scene has that many instances.
            unsafe { bench_embree_place(scene.0, numbers, count) };
            scene.commit()
        });
        let bytes = scene.bytes() - below;
        Some((scene, seconds, bytes))
    }

    fn with_meshes(self, model: &Model) -> Option<Self> {
        for mesh in &model.meshes {
            let vertices = mesh.vertices.as_flattened();
            let indices = mesh.indices.as_flattened();
            // SAFETY: the counts are those of the slices, and every index names a vertex.
            let failed = unsafe {
                bench_embree_mesh(
                    self.0,
                    vertices.as_ptr(),
                    vertices.len() / 3,
                    indices.as_ptr(),
                    indices.len() / 3,
                )
            };
            if failed != 0 {
                return None;
            }
        }
        for set in &model.sphere_sets {
            // SAFETY: the count is that of the slice.
            let failed =
                unsafe { bench_embree_spheres(self.0, set.as_flattened().as_ptr(), set.len()) };
            if failed != 0 {
                return None;
            }
        }
        Some(self)
    }

    /// Whether it failed.
    fn commit(&self) -> bool {
        // SAFETY: the scene exists until it is dropped.
        unsafe { bench_embree_commit(self.0) != 0 }
    }

    fn bytes(&self) -> usize {
        // SAFETY: as above.
        unsafe { bench_embree_bytes(self.0) }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: nobody else frees it.
        unsafe { bench_embree_free(self.0) }
    }
}

/// One call a ray.
struct Single(Rc<Scene>);

impl Tracer for Single {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), hits.len());
        let (scene, rays, count, hits) = (self.0.0, rays.as_ptr(), rays.len(), hits.as_mut_ptr());
        // SAFETY: both slices have `count` elements.
        watch.time(|| unsafe { bench_embree_closest(scene, rays, hits, count) });
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), occluded.len());
        let (scene, count, occluded) = (self.0.0, rays.len(), occluded.as_mut_ptr().cast());
        // SAFETY: both slices have `count` elements, and only 0 and 1 are written.
        watch.time(|| unsafe { bench_embree_any(scene, rays.as_ptr(), occluded, count) });
    }
}

/// Packets or a stream, in Embree's own layout.
struct Batched {
    scene: Rc<Scene>,
    width: c_int,
    /// What Embree is told, unless it follows from the rays.
    coherent: Option<bool>,
}

impl Batched {
    fn run(&self, rays: &[Ray], any: bool, coherent: bool, watch: &mut Watch) -> RawBatchOwner {
        // SAFETY: the slice has that many rays.
        let raw = unsafe { bench_batch_new(rays.as_ptr(), rays.len(), self.width, any.into()) };
        assert!(!raw.is_null(), "memory for rays");
        let coherent = self.coherent.unwrap_or(coherent).into();
        // SAFETY: both exist, and the batch has not been run before.
        watch.time(|| unsafe { bench_batch_run(self.scene.0, raw, coherent) });
        RawBatchOwner(raw)
    }
}

impl Tracer for Batched {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), hits.len());
        let batch = self.run(rays, false, coherent, watch);
        // SAFETY: there are as many hits as rays in the batch.
        unsafe { bench_batch_hits(batch.0, hits.as_mut_ptr()) };
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), occluded.len());
        let batch = self.run(rays, true, coherent, watch);
        // SAFETY: as above, and only 0 and 1 are written.
        unsafe { bench_batch_occluded(batch.0, occluded.as_mut_ptr().cast()) };
    }
}

struct RawBatchOwner(*mut RawBatch);

impl Drop for RawBatchOwner {
    fn drop(&mut self) {
        // SAFETY: nobody else frees it.
        unsafe { bench_batch_free(self.0) }
    }
}
