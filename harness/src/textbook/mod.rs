//! Triangle tests as their papers print them, in a plain binary tree of our own.
//!
//! They share nothing with the core. The tree's boxes are judged in `f64` and padded, so whatever is missed or hit wrongly is
//! the triangle test's doing; its speed is that of plain scalar code. [`Tree`] takes any [`TriangleTest`]:
//!
//! | test | source |
//! | --- | --- |
//! | [`MoellerTrumbore`] | Moeller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997 |
//! | [`MoellerTrumboreF64`] | the same in `f64`, its `t` rounded to `f32` |
//! | [`WoopBenthinWald`] | Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", 2013 |
//! | [`BaldwinWeber`] | Baldwin and Weber, "Fast Ray-Triangle Intersections by Coordinate Transformation", 2016 |

mod baldwin_weber;
mod moeller_trumbore;
mod tree;
pub mod walk;
mod woop_benthin_wald;

use raykern::Ray;

pub use baldwin_weber::BaldwinWeber;
pub use moeller_trumbore::{MoellerTrumbore, MoellerTrumboreF64};
pub use tree::Tree;
pub use woop_benthin_wald::WoopBenthinWald;

/// A triangle, stored as its test wants it.
pub trait TriangleTest {
    /// What is computed once for a ray.
    type Line;
    /// From the corners.
    fn new(corners: [[f32; 3]; 3]) -> Self;
    /// From the ray, which is finite and has a direction.
    fn line(ray: &Ray) -> Self::Line;
    /// The `t` of a hit between the limits.
    fn meet(&self, line: &Self::Line, t_min: f32, t_max: f32) -> Option<f32>;
}

/// `t`, if it is within both limits; a NaN is not.
fn within(t: f32, t_min: f32, t_max: f32) -> Option<f32> {
    (t >= t_min && t <= t_max).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::make;
    use crate::model::Model;
    use crate::oracle::{Judgement, Oracle};
    use crate::rays::{Family, RayMaker};
    use raykern::{Hit, NONE, QueryOptions};

    /// How many of the answers to rays from off the surfaces are another triangle, or hit or miss unlike the truth.
    fn wrong<T: TriangleTest>(model: &Model) -> usize {
        let (tree, oracle) = (Tree::<T>::new(model), Oracle::new(model));
        let mut maker = RayMaker::new(model, 3);
        let options = QueryOptions::default();
        let families = [Family::Primary, Family::Random, Family::Inside];
        let rays = families.iter().flat_map(|family| maker.many(*family, 500));
        let misjudged = |ray: &Ray| {
            let claimed = tree.closest(ray).map(|(t, place)| Hit {
                t,
                u: 0.0,
                v: 0.0,
                prim: place.prim,
                geometry: place.geometry,
                instance: NONE,
            });
            let judgement = oracle.judge(ray, &options, claimed);
            !matches!(
                judgement,
                Judgement::Right | Judgement::WrongT { .. } | Judgement::WrongWeights { .. }
            )
        };
        rays.collect::<Vec<_>>().iter().filter(|ray| misjudged(ray)).count()
    }

    #[test]
    fn rays_from_off_the_surfaces_find_their_triangles() {
        // From inside the box of a plane every ray starts on the surface.
        let fit = |name: &str| name != "spheres" && name != "plane";
        for (name, make) in make::ALL.into_iter().filter(|(name, _)| fit(name)) {
            let model = make(600);
            for (test, wrong) in [
                ("Moeller-Trumbore", wrong::<MoellerTrumbore>(&model)),
                ("Moeller-Trumbore in f64", wrong::<MoellerTrumboreF64>(&model)),
                ("Woop-Benthin-Wald", wrong::<WoopBenthinWald>(&model)),
                ("Baldwin-Weber", wrong::<BaldwinWeber>(&model)),
            ] {
                assert!(wrong <= 20, "{test} on {name}: {wrong} of 1500");
            }
        }
    }

    #[test]
    fn an_empty_tree_is_missed() {
        let tree = Tree::<MoellerTrumbore>::new(&Model::default());
        assert_eq!(tree.closest(&Ray::new([0.0; 3], [1.0; 3])), None);
    }
}
