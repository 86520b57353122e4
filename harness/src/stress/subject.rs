//! Who is asked: list, grid and BVH over one scene, or something that claims to be them.

use raykern::{BuildOptions, Hit, OwnedAccel, PlainList, Precision, QueryOptions};

use super::{Scenery, Shot};

/// What one ray is answered.
#[derive(Clone, Copy, Debug)]
pub struct Answers {
    /// List, grid and BVH, exactly.
    pub exact: [Option<Hit>; 3],
    /// Whether each says that something is hit.
    pub occluded: [bool; 3],
    /// The BVH with [`Precision::Watertight`], and whether it says that something is hit.
    pub watertight: (Option<Hit>, bool),
}

/// What answers rays.
pub trait Subject {
    /// Answers a ray.
    fn ask(&self, shot: &Shot) -> Answers;
}

/// Makes a subject for a scene.
pub type Build<'a> = &'a (dyn Fn(&Scenery) -> Box<dyn Subject> + Sync);

/// The names of those that answer [`Answers::exact`].
pub const STRUCTURES: [&str; 3] = ["list", "grid", "bvh"];

/// List, grid and BVH, each forced.
pub struct Structures([OwnedAccel<'static>; 3]);

impl Structures {
    /// Builds all three.
    pub fn new(scenery: &Scenery) -> Self {
        let with = |plain_list| BuildOptions { plain_list, ..Default::default() };
        let never = with(PlainList::Never);
        scenery.model.with_masked_scene(&scenery.masks, |scene| {
            Structures([
                OwnedAccel::bvh(scene, &with(PlainList::Always)).expect("a list"),
                OwnedAccel::grid(scene, &never).expect("a grid"),
                OwnedAccel::bvh(scene, &never).expect("a BVH"),
            ])
        })
    }

    /// The [`Build`] of what is to be tested.
    pub fn boxed(scenery: &Scenery) -> Box<dyn Subject> {
        Box::new(Self::new(scenery))
    }
}

impl Subject for Structures {
    fn ask(&self, Shot { ray, options }: &Shot) -> Answers {
        let accels = [0, 1, 2].map(|i| self.0[i].accel());
        let tight = QueryOptions { precision: Precision::Watertight, ..*options };
        Answers {
            exact: accels.map(|accel| accel.intersect_with(ray, options)),
            occluded: accels.map(|accel| accel.occluded_with(ray, options)),
            watertight: (
                accels[2].intersect_with(ray, &tight),
                accels[2].occluded_with(ray, &tight),
            ),
        }
    }
}

/// All bits of an answer.
pub fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    let hit = hit?;
    Some([hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim, hit.geometry, hit.instance])
}
