//! Embree 4 through the shim in `embree4.c`, where a library is at hand: `RAYKERN_EMBREE4` has its path.
//!
//! The wheel `embreex` of PyPI has one: `pip download --no-deps embreex`, unpack it, and name its `libembree4-*.so.4`.

use std::ffi::{CString, c_char, c_int};

use raykern::{Hit, Ray};
use raykern_harness::model::Model;

use crate::lineup::Tracer;
use crate::watch::{Watch, median, thread_seconds};

/// An opaque `BenchEmbree4`.
#[repr(C)]
struct Raw([u8; 0]);

unsafe extern "C" {
    fn bench_embree4_new(path: *const c_char, quality: c_int, flags: c_int) -> *mut Raw;
    fn bench_embree4_mesh(
        scene: *mut Raw,
        vertices: *const f32,
        vertex_count: usize,
        indices: *const u32,
        triangle_count: usize,
    ) -> c_int;
    fn bench_embree4_spheres(scene: *mut Raw, spheres: *const f32, count: usize) -> c_int;
    fn bench_embree4_commit(scene: *mut Raw) -> c_int;
    fn bench_embree4_bytes(scene: *const Raw) -> usize;
    fn bench_embree4_free(scene: *mut Raw);
    fn bench_embree4_closest(scene: *mut Raw, rays: *const Ray, hits: *mut Hit, count: usize);
    fn bench_embree4_any(scene: *mut Raw, rays: *const Ray, occluded: *mut u8, count: usize);
}

/// A scene of medium quality with these flags of [`embree`](crate::embree), with the seconds of its build and its bytes; the
/// reason when it cannot be had.
pub fn single(model: &Model, flags: c_int) -> Result<(Box<dyn Tracer>, f64, usize), String> {
    let path = std::env::var("RAYKERN_EMBREE4").map_err(|_| "RAYKERN_EMBREE4 names no library")?;
    let path = CString::new(path).map_err(|error| error.to_string())?;
    let mut seconds = Vec::new();
    loop {
        // SAFETY: the string ends with a zero.
        let raw = unsafe { bench_embree4_new(path.as_ptr(), 1, flags) };
        if raw.is_null() {
            return Err(format!("{}: not an Embree 4", path.to_string_lossy()));
        }
        let scene = Scene(raw);
        scene.add(model).ok_or("Embree 4 refuses")?;
        let begun = thread_seconds();
        // SAFETY: the scene exists until it is dropped.
        let failed = unsafe { bench_embree4_commit(scene.0) != 0 };
        seconds.push(thread_seconds() - begun);
        if failed {
            return Err("Embree 4 refuses".to_owned());
        }
        if seconds.len() == 3 || seconds.iter().sum::<f64>() > 0.5 {
            // SAFETY: as above.
            let bytes = unsafe { bench_embree4_bytes(scene.0) };
            return Ok((Box::new(scene), median(&seconds), bytes));
        }
    }
}

/// A device and a scene on it.
struct Scene(*mut Raw);

impl Scene {
    fn add(&self, model: &Model) -> Option<()> {
        for mesh in &model.meshes {
            let (vertices, indices) = (&mesh.vertices, &mesh.indices);
            // SAFETY: the counts are those of the slices, and every index names a vertex.
            let failed = unsafe {
                bench_embree4_mesh(
                    self.0,
                    vertices.as_flattened().as_ptr(),
                    vertices.len(),
                    indices.as_flattened().as_ptr(),
                    indices.len(),
                )
            };
            (failed == 0).then_some(())?;
        }
        for set in &model.sphere_sets {
            let spheres = set.as_flattened().as_ptr();
            // SAFETY: the count is that of the slice.
            let failed = unsafe { bench_embree4_spheres(self.0, spheres, set.len()) };
            (failed == 0).then_some(())?;
        }
        Some(())
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: nobody else frees it.
        unsafe { bench_embree4_free(self.0) }
    }
}

impl Tracer for Scene {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), hits.len());
        let (scene, rays, count, hits) = (self.0, rays.as_ptr(), rays.len(), hits.as_mut_ptr());
        // SAFETY: both slices have `count` elements.
        watch.time(|| unsafe { bench_embree4_closest(scene, rays, hits, count) });
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        assert_eq!(rays.len(), occluded.len());
        let (scene, count, occluded) = (self.0, rays.len(), occluded.as_mut_ptr().cast());
        // SAFETY: both slices have `count` elements, and only 0 and 1 are written.
        watch.time(|| unsafe { bench_embree4_any(scene, rays.as_ptr(), occluded, count) });
    }
}
