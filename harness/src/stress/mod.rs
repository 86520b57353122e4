//! A stress suite: families of scenes and rays that look for wrong answers, judged exactly.
//!
//! A [`Family`] makes [`Case`]s, small scenes each with some hundreds of rays, from nothing but a
//! seed and a number. [`run`](run::run) asks list, grid and BVH, judges every answer by the
//! [oracle](crate::oracle), and [shrinks](shrink) what is wrong to a case that can be pasted into a
//! test. With Embree at hand it answers the same rays, so that the table shows what a number means.
//!
//! ```sh
//! cargo run --release -p raykern-harness --bin stress -- --embree
//! ```

mod broken;
mod closed;
pub mod embree;
mod kit;
mod layers;
mod level;
mod limits;
mod ordinary;
mod paste;
mod plane;
mod round;
pub mod run;
mod scale;
pub mod score;
pub mod shrink;
pub mod subject;
mod table;
mod thin;

use raykern::{Facing, NONE, PrimId, QueryOptions, Ray};

use crate::make::Random;
use crate::model::Model;
use crate::oracle::Oracle;
pub use paste::as_test;
pub use table::{csv, markdown, table};

/// A scene with the masks of its geometries; missing ones are 0.
#[derive(Clone, Debug, Default)]
pub struct Scenery {
    /// Meshes and spheres.
    pub model: Model,
    /// One for each geometry, or fewer.
    pub masks: Vec<u32>,
}

/// A ray and what it asks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// The ray.
    pub ray: Ray,
    /// What is left out.
    pub options: QueryOptions,
}

/// One scene and the rays shot at it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The scene.
    pub scenery: Scenery,
    /// The rays.
    pub shots: Vec<Shot>,
}

/// What is special about some scenes and rays.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// A name for tables and for the command line.
    pub name: &'static str,
    /// What its scenes and rays are.
    pub about: &'static str,
    /// Makes a scene and about this many rays.
    make: fn(&mut Random, usize) -> Case,
}

/// How many rays a case has.
pub const RAYS_PER_CASE: usize = 250;

const fn family(
    name: &'static str,
    about: &'static str,
    make: fn(&mut Random, usize) -> Case,
) -> Family {
    Family { name, about, make }
}

/// Every family.
pub const ALL: [Family; 31] = [
    family("ordinary", "scenes and rays as a renderer has them", ordinary::ordinary),
    family("hostile", "the same scenes; vertices, edges, planes, limits", ordinary::hostile),
    family("closed-outside", "closed meshes at vertices and edges, rounded", closed::outside),
    family("closed-inside", "the same from inside, where no ray may leave", closed::inside),
    family("closed-exact", "exactly through vertices and edges of lattice meshes", closed::exact),
    family("needles", "triangles up to 1e7 times as long as wide", thin::needles),
    family("slivers", "three corners on a line, up to rounding", thin::slivers),
    family("planet-pebble", "a pebble on a planet 1e6 to 1e8 times as large", scale::planet),
    family("far-off", "millimetres of detail 1e4 to 1e6 from the origin", scale::far_off),
    family("scales", "whole scenes times 1e-44 to 1e37", scale::scales),
    family("lengths", "directions of length 1e-44 to 1e38", scale::lengths),
    family("far-origins", "rays from 1e3 to 1e30 scene sizes away", scale::far_origins),
    family("denormals", "coordinates without leading bits", scale::denormals),
    family("in-plane", "in a face's plane, along edges", plane::in_plane),
    family("axis-parallel", "in box faces, cell walls, with zeros of both signs", plane::axes),
    family("on-surface", "from points of faces, edges, vertices", plane::on_surface),
    family("limits", "limits at and next to the real t, infinite, negative", limits::limits),
    family("options", "masks, sides, skipped primitives on all rays", limits::options),
    family("layers", "duplicates, and coplanar layers floats apart", layers::layers),
    family("lattice", "small whole numbers: ties, tangents, parallels", layers::lattice),
    family("broken", "NaN, infinities, no area, no radius; invalid rays", broken::broken),
    family("bits", "every bit pattern of a float", broken::bits),
    family("exponents", "every exponent, at once or near either end", broken::exponents),
    family("balls", "overlapping spheres from outside, inside, on them", round::balls),
    family("tangents", "lines that touch spheres, exactly or nearly", round::tangents),
    family("ground", "spheres of radius 1e3 to 1e30 as a floor", round::ground),
    family("specks", "spheres 1e3 to 1e30 times smaller than their distance", round::specks),
    family("level-balls", "two spheres met at the same t, or an ulp apart", level::balls),
    family("level-mixed", "sphere and triangle met at the same t, or an ulp apart", level::mixed),
    family("level-wild", "the same at any scale and far away", level::wild),
    family("level-roots", "square roots that are nearly or exactly equal", level::roots),
];

impl Family {
    /// The family called `name`.
    pub fn by_name(name: &str) -> Option<Family> {
        ALL.into_iter().find(|family| family.name == name)
    }

    /// Case `number` of those that belong to `seed`: the same on every call.
    pub fn case(&self, seed: u64, number: u64) -> Case {
        let start = self.name.bytes().fold(seed, |h, b| Random::new(h ^ u64::from(b)).bits());
        let mut random = Random::new(Random::new(start ^ number).bits());
        let mut case = (self.make)(&mut random, RAYS_PER_CASE);
        // One case in four has masks, and options on a part of its rays.
        if random.below(4) == 0 {
            case.mix_options(&mut random, 0.3);
        }
        case
    }
}

impl Case {
    /// Rays that leave out nothing.
    fn new(model: Model, rays: Vec<Ray>) -> Self {
        let shots = rays.into_iter().map(|ray| Shot { ray, options: QueryOptions::default() });
        Case { scenery: Scenery { model, masks: Vec::new() }, shots: shots.collect() }
    }

    /// Gives masks to the geometries and options to a share of the rays.
    ///
    /// A skipped primitive is mostly the one that the ray would have hit.
    fn mix_options(&mut self, random: &mut Random, share: f64) {
        let Scenery { model, masks } = &mut self.scenery;
        let geometries = model.meshes.len() + model.sphere_sets.len();
        *masks = (0..geometries).map(|_| [0, 1, 2, 3][random.below(4)]).collect();
        let oracle = Oracle::with_masks(model, masks);
        for shot in &mut self.shots {
            if random.unit() >= share {
                continue;
            }
            shot.options.mask = random.below(4) as u32;
            shot.options.facing = [Facing::Both, Facing::Front, Facing::Back][random.below(3)];
            let any = PrimId {
                prim: random.below(12) as u32,
                geometry: random.below(geometries + 1) as u32,
                instance: NONE,
            };
            let hit = oracle.closest(&shot.ray, &shot.options).hit.map(|hit| PrimId {
                prim: hit.place.prim,
                geometry: hit.place.geometry,
                instance: NONE,
            });
            shot.options.skip = [None, Some(any), hit, hit][random.below(4)];
        }
    }
}
