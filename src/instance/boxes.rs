//! The boxes of instances.

use glam::DVec3;

use super::map::Map;
use super::parts::Parts;
use crate::block::Finished;
use crate::error::BuildError;
use crate::math::Aabb;
use crate::math::rounding::{f32_above, f32_below};
use crate::scene::{Boxes, Scene};

/// The boxes of the index are wide enough for rays from up to so many times as far away as the instances are.
const CALM: f64 = 4.0;

/// The instances of a scene, all of which have an inverse, and what is common to their boxes.
#[derive(Clone, Copy)]
pub(crate) struct Placed<'s> {
    scene: &'s Scene<'s, 's>,
    /// Around all instances, before their boxes are widened, and everything else.
    pub bounds: Aabb,
    /// How far away rays may begin without further widening, and how much must be added for each unit beyond.
    pub calm: f32,
    pub spread: f32,
}

/// One instance of a scene.
pub(crate) struct Placing<'s> {
    pub map: Map,
    pub mask: u32,
    /// The block that stands there.
    child: Finished<'s>,
}

impl<'s> Placed<'s> {
    /// The instances of `scene`; `bounds` is the box around all else in it.
    pub fn new(scene: &'s Scene<'s, 's>, bounds: Aabb) -> Result<Self, BuildError> {
        if u32::try_from(scene.instance_count()).is_err() {
            return Err(BuildError::TooLarge);
        }
        let mut placed = Placed { scene, bounds, calm: 0.0, spread: 0.0 };
        let (mut reach, mut spread) = (0.0f64, 0.0f64);
        let [mut least, mut most] = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for i in 0..scene.instance_count() {
            let placing = placed.check(i, Map::roughly)?;
            if placing.is_empty() {
                continue;
            }
            let [lower, upper] = placing.map.bounds(placing.contents());
            (least, most) = (least.min(lower), most.max(upper));
            reach = reach.max(lower.abs().max(upper.abs()).max_element());
            spread = spread.max(placing.map.spread());
        }
        placed.bounds.add(&outward([least, most]));
        // Rounded down and up. A box of no size still has room for rounding.
        placed.calm = f32_below((reach * CALM).min(f64::from(f32::MAX)));
        placed.spread = f32_above(spread);
        Ok(placed)
    }

    fn check(
        &self,
        i: usize,
        map: fn([f32; 12]) -> Option<Map>,
    ) -> Result<Placing<'s>, BuildError> {
        let number = i as u32;
        let instance = self.scene.instance(i).ok_or(BuildError::TooLarge)?;
        if instance.child.has_level() {
            return Err(BuildError::NestedInstance { instance: number });
        }
        let map = map(instance.object_to_world);
        let map = map.ok_or(BuildError::SingularInstance { instance: number })?;
        Ok(Placing { map, mask: instance.mask, child: instance.child })
    }

    /// The bytes of the block that instance `i` shows.
    pub fn child(&self, i: usize) -> Option<*const u8> {
        self.scene.instance(i).map(|instance| instance.child.bytes().as_ptr())
    }

    /// Instance `i`.
    pub fn get(&self, i: usize) -> Option<Placing<'s>> {
        self.check(i, Map::new).ok()
    }

    /// Its box in the index.
    pub fn aabb_of(&self, placing: &Placing) -> Aabb {
        if placing.is_empty() {
            return Aabb::EMPTY;
        }
        let Placing { map, child, .. } = placing;
        let contents = placing.contents();
        let [lower, upper] = Parts::of(*child).map_or_else(
            || map.bounds(contents),
            |parts| {
                let [lower, upper] = parts.bounds(map);
                let rounding = map.rounding(contents);
                [lower - rounding, upper + rounding]
            },
        );
        let blur = map.blur(contents, f64::from(self.calm));
        outward([lower - blur, upper + blur])
    }
}

impl<'s> Placing<'s> {
    /// The box around what is in it.
    fn contents(&self) -> &'s Aabb {
        &self.child.header().bounds
    }

    /// The bytes of what stands there.
    pub fn bytes(&self) -> *const u8 {
        self.child.bytes().as_ptr()
    }

    /// Whether nothing in it can be hit.
    fn is_empty(&self) -> bool {
        self.contents().lower[0] > self.contents().upper[0]
    }
}

impl Boxes for Placed<'_> {
    fn count(&self) -> usize {
        self.scene.instance_count()
    }

    fn aabb(&self, i: usize) -> Aabb {
        self.get(i).map_or(Aabb::EMPTY, |placing| self.aabb_of(&placing))
    }
}

/// Instances of which only those are told apart in which there is something: their boxes take a while to compute.
pub(crate) struct Counted<'p, 's>(pub &'p Placed<'s>);

impl Boxes for Counted<'_, '_> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn aabb(&self, i: usize) -> Aabb {
        let bounds = self.0.scene.instance(i).map(|instance| instance.child.header().bounds);
        let has_something = bounds.is_some_and(|bounds| bounds.lower[0] <= bounds.upper[0]);
        if has_something { Aabb::around(&[[0.0; 3]]) } else { Aabb::EMPTY }
    }
}

fn outward([lower, upper]: [DVec3; 2]) -> Aabb {
    Aabb { lower: lower.to_array().map(f32_below), upper: upper.to_array().map(f32_above) }
}
