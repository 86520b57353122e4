//! Libraries in Rust, or with a face in Rust: one ray at a time, each as its documentation shows.

mod bvh;
mod obvhs;
mod parry;
#[cfg(target_feature = "avx2")]
mod tinybvh;

use raykern::{Hit, NONE, Ray};
use raykern_harness::model::Model;

use crate::lineup::{Class, Lineup, Tracer};
use crate::options::Options;
use crate::ours::each;
use crate::watch::{Watch, timed_build};

/// A library over one scene.
pub trait Library: Sized + 'static {
    /// Builds; all meshes as one list of triangles.
    fn build(model: &Model) -> Result<Self, String>;
    /// Bytes kept, triangles included, when they can be told.
    fn bytes(&self) -> Option<usize> {
        None
    }
    /// The `t` and the triangle of the closest hit.
    fn closest(&self, ray: &Ray) -> Option<(f32, u32)>;
    /// Whether anything is hit.
    fn any(&self, ray: &Ray) -> bool;
}

/// A library over one scene, with the bytes it keeps when they can be told.
pub type Built = (Box<dyn Tracer>, Option<usize>);

/// A library by name, and what builds it.
pub struct Maker {
    /// The name in tables.
    pub name: &'static str,
    /// Builds it; the reason when it refuses.
    pub build: fn(&Model) -> Result<Built, String>,
}

/// Every library.
pub fn all() -> Vec<Maker> {
    vec![
        maker::<obvhs::Medium>("obvhs"),
        maker::<obvhs::Slow>("obvhs-slow"),
        maker::<bvh::Tree>("bvh-crate"),
        maker::<parry::Mesh>("parry"),
        #[cfg(target_feature = "avx2")]
        maker::<tinybvh::Fast>("tinybvh"),
        #[cfg(target_feature = "avx2")]
        maker::<tinybvh::HighQuality>("tinybvh-hq"),
    ]
}

fn maker<L: Library>(name: &'static str) -> Maker {
    let build = |model: &Model| {
        let library = L::build(model)?;
        let bytes = library.bytes();
        Ok((Box::new(Peer(library)) as Box<dyn Tracer>, bytes))
    };
    Maker { name, build }
}

/// Adds every library that is wanted.
pub fn join(lineup: &mut Lineup, model: &Model, options: &Options) {
    for Maker { name, build } in all().iter().filter(|maker| options.wants_peer(maker.name)) {
        match timed_build(|| build(model)) {
            (Ok((tracer, bytes)), seconds) => {
                lineup.built(*name, seconds, bytes);
                lineup.add_boxed(*name, Class::RustPeer, tracer);
            }
            (Err(reason), _) => lineup.notes.push(format!("{name}: {reason}")),
        }
    }
    #[cfg(not(target_feature = "avx2"))]
    if options.wants_peer("tinybvh") {
        let flags = "RUSTFLAGS=-Ctarget-cpu=native";
        lineup.notes.push(format!("tinybvh: its fast form needs {flags}"));
    }
}

struct Peer<L>(L);

impl<L: Library> Tracer for Peer<L> {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        let hit = |(t, prim)| Hit { t, u: 0.0, v: 0.0, prim, geometry: 0, instance: NONE };
        watch.time(|| each(rays, hits, |ray| self.0.closest(ray).map_or(Hit::MISS, hit)));
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        watch.time(|| each(rays, occluded, |ray| self.0.any(ray)));
    }
}

/// The corners of every triangle.
fn triangles(model: &Model) -> impl Iterator<Item = [[f32; 3]; 3]> + '_ {
    let corners = |mesh: &'_ raykern_harness::model::TriangleMesh, triangle: &[u32; 3]| {
        triangle.map(|v| mesh.vertices[v as usize])
    };
    model.meshes.iter().flat_map(move |mesh| mesh.indices.iter().map(move |t| corners(mesh, t)))
}
