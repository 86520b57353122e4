//! tinybvh: its eight-wide tree for processors with AVX2. The wrapper has no query for any hit, so
//! the closest one stands in.

use raykern::Ray;
use raykern_harness::model::Model;
use tinybvh_rs::{Intersector, bvh, bvh8_cpu, mbvh};

use super::Library;

/// Built by `Build`.
pub struct Fast(bvh8_cpu::BVH);
/// Built by `BuildHQ`, with spatial splits.
pub struct HighQuality(bvh8_cpu::BVH);

fn build(model: &Model, high: bool) -> Result<bvh8_cpu::BVH, String> {
    let vertices: Vec<[f32; 4]> =
        super::triangles(model).flatten().map(|[x, y, z]| [x, y, z, 0.0]).collect();
    let positions = vertices.as_slice().into();
    let make = if high { bvh::BVH::new_hq } else { bvh::BVH::new };
    let mut binary = make(positions).map_err(|error| format!("{error:?}"))?;
    // The most that a leaf of the wide tree takes.
    binary.split_leaves(4);
    let wide = mbvh::BVH::new(&binary);
    bvh8_cpu::BVH::new(&wide).map_err(|error| format!("{error:?}"))
}

fn closest(tree: &bvh8_cpu::BVH, ray: &Ray) -> Option<(f32, u32)> {
    let mut query = tinybvh_rs::Ray::new(ray.origin, ray.direction);
    let t_max = ray.t_max.min(query.hit.t);
    query.hit.t = t_max;
    tree.intersect(&mut query);
    (query.hit.t < t_max).then_some((query.hit.t, query.hit.prim))
}

/// Both builds are asked alike.
macro_rules! built_by {
    ($name:ident, $high:literal) => {
        impl Library for $name {
            fn build(model: &Model) -> Result<Self, String> {
                build(model, $high).map($name)
            }

            fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
                closest(&self.0, ray)
            }

            fn any(&self, ray: &Ray) -> bool {
                closest(&self.0, ray).is_some()
            }
        }
    };
}

built_by!(Fast, false);
built_by!(HighQuality, true);
