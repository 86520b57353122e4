//! How far a scene reaches, and what is far outside of it.

/// How far from zero a scene reaches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Its largest coordinate; infinite if that is not representable.
    pub scene: f32,
    /// What is farther out is *far outside*.
    pub near: f32,
}

impl Extent {
    /// Of a scene of so many primitives.
    ///
    /// In `f32`, differences from a point that is far enough away tell none of the primitives' boxes from others. The more there are the
    /// smaller these are, and the sooner it is worth the way through `f64`: from `2^23 n^-3/8` times the scene's size on, as measured in
    /// `docs/METHODS.md`.
    #[inline(always)]
    pub fn new(scene: f32, prims: u32) -> Self {
        // Three eighths of an exponent for each bit that `n` has less; what is no whole exponent goes on into the fraction.
        let times = f32::from_bits((138 << 23) + prims.leading_zeros() * (3 << 20));
        Extent { scene, near: scene * times }
    }
}

#[cfg(test)]
mod tests {
    use super::Extent;

    #[test]
    fn the_more_there_is_the_nearer_is_far_outside() {
        for prims in (0..=32).map(|digits| (1u64 << digits) - 1) {
            let near = Extent::new(0.5, prims as u32).near;
            let exact = 0.5 * 2f64.powi(23) * ((prims + 1) as f64).powf(-0.375);
            assert!((0.999..1.1).contains(&(f64::from(near) / exact)), "{prims}: {near} {exact}");
        }
        assert_eq!(Extent::new(f32::INFINITY, 7).near, f32::INFINITY);
    }
}
