//! How far a scene reaches, and from where on it is seen from far outside.

use crate::simd::SMALL;

/// How far from zero a scene reaches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Its largest coordinate; infinite if that is not representable.
    pub scene: f32,
    /// Rays that begin farther out begin *far outside*: they are followed from near the scene on.
    pub near: f32,
}

impl Extent {
    /// Of a scene of so many primitives.
    ///
    /// Boxes are padded by what `f32` may be off at a ray's origin, and from far enough all of them are met. The more
    /// there are the smaller they are, and the sooner it is worth the way through `f64` to begin nearer: from `2^23 n^-3/8` times the
    /// scene's size on, as measured in `docs/METHODS.md`.
    #[inline(always)]
    pub fn new(scene: f32, prims: u32) -> Self {
        let digits = u32::BITS - prims.leading_zeros();
        let times = f32::from_bits((127 + 23 - 3 * digits / 8) << 23);
        // Those who are small have no such way.
        Extent { scene, near: if SMALL { f32::INFINITY } else { scene * times } }
    }
}

#[cfg(test)]
mod tests {
    use super::Extent;

    #[test]
    fn the_more_there_is_the_sooner_a_ray_is_far_outside() {
        for (prims, near) in [(0, 23), (12, 22), (200, 20), (2_000, 19), (20_000, 18)] {
            assert_eq!(Extent::new(0.5, prims).near, 2f32.powi(near - 1), "{prims}");
        }
        for (prims, near) in [(500_000, 16), (10_000_000, 14), (u32::MAX, 11)] {
            assert_eq!(Extent::new(0.5, prims).near, 2f32.powi(near - 1), "{prims}");
        }
        assert_eq!(Extent::new(f32::INFINITY, 7).near, f32::INFINITY);
    }
}
