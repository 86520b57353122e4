//! A case of a stress family as anyone can be asked it.

use raykern::{QueryOptions, Ray};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::stress::embree::{may_be_asked, may_be_built};
use raykern_harness::stress::{Family, Scenery};

use crate::methods::{Group, Method};

/// Families in which spheres are the matter; in the others they are left out, since few methods know them.
const ROUND: [&str; 8] = [
    "balls",
    "tangents",
    "ground",
    "specks",
    "level-balls",
    "level-mixed",
    "level-wild",
    "level-roots",
];

/// A scene with its triangles as one mesh, and rays that ask for nothing special.
pub struct Case {
    pub model: Model,
    pub rays: Vec<Ray>,
    /// Whether all numbers of the scene are finite and of a size that others take.
    tame: bool,
    round: bool,
    /// Of each ray, likewise.
    tame_rays: Vec<bool>,
}

/// All cases are of this seed.
pub const SEED: u64 = 1;

impl Case {
    /// Case `number` of a family.
    pub fn of(family: &Family, number: u64) -> Self {
        let mut case = family.case(SEED, number);
        let round = ROUND.contains(&family.name);
        let mut model = merged(&case.scenery.model);
        if !round {
            model.sphere_sets.clear();
        }
        case.shots.retain(|shot| shot.options == QueryOptions::default());
        let tame_rays = case.shots.iter().map(may_be_asked).collect();
        let scenery = Scenery { model, masks: Vec::new() };
        let tame = may_be_built(&scenery);
        let rays = case.shots.iter().map(|shot| shot.ray).collect();
        Case { model: scenery.model, rays, tame, round, tame_rays }
    }

    /// The numbers of the rays that a method is asked: ours all of them.
    pub fn asked(&self, method: &Method) -> Vec<usize> {
        let ours = matches!(method.group, Group::Exact | Group::Watertight);
        let fit = ours || self.tame && (method.spheres || !self.round);
        let takes = |i: &usize| {
            fit && (ours || self.tame_rays[*i] && (method.t_min || self.rays[*i].t_min == 0.0))
        };
        (0..self.rays.len()).filter(takes).collect()
    }
}

/// The same with one mesh, or none.
pub fn merged(model: &Model) -> Model {
    let mut mesh = TriangleMesh::default();
    model.meshes.iter().for_each(|other| mesh.append(other));
    let meshes = if mesh.indices.is_empty() { Vec::new() } else { vec![mesh] };
    let mut sphere_sets = model.sphere_sets.clone();
    sphere_sets.retain(|set| !set.is_empty());
    Model { meshes, sphere_sets }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods;

    #[test]
    fn meshes_become_one_in_their_order() {
        let mesh = |x: f32| TriangleMesh {
            vertices: vec![[x, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]],
            indices: vec![[0, 1, 2]],
        };
        let meshes = vec![mesh(1.0), TriangleMesh::default(), mesh(2.0)];
        let merged = merged(&Model { meshes, sphere_sets: vec![vec![], vec![[1.0; 4]]] });
        assert_eq!((merged.meshes.len(), merged.sphere_sets.len()), (1, 1));
        assert_eq!(merged.meshes[0].indices, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(merged.meshes[0].vertices[3][0], 2.0);
    }

    #[test]
    fn others_are_asked_what_they_take_and_ours_everything() {
        let method = |group| methods::all().into_iter().find(|m| m.group == group).unwrap();
        let [ours, test] = [Group::Exact, Group::Textbook].map(method);
        let case = |name| Case::of(&Family::by_name(name).unwrap(), 0);
        let ground = case("ground");
        assert_eq!(ground.asked(&ours).len(), ground.rays.len());
        assert!(ground.asked(&test).is_empty() && !ground.model.sphere_sets.is_empty());
        let needles = case("needles");
        assert!(needles.model.sphere_sets.is_empty() && needles.model.meshes.len() == 1);
        assert!(needles.asked(&test).len() > 50);
        let bits = case("bits");
        assert!(bits.asked(&test).is_empty() && bits.asked(&ours).len() == bits.rays.len());
    }
}
