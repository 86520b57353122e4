//! Damaged blocks: refused, or harmless to ask.
//!
//! An input that begins as a block does is taken as one; others say what to damage in a sound one.

#![no_main]

use std::sync::LazyLock;

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use raykern::Ray;
use raykern_fuzz::damage::{Damage, originals};

static ORIGINALS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(originals);

fuzz_target!(|data: &[u8]| {
    let damage = if data.starts_with(&ORIGINALS[0][..8]) {
        Damage { bytes: data.to_vec(), rays: rays(), ..Damage::default() }
    } else {
        let Ok(damage) = Damage::of(&mut Unstructured::new(data)) else { return };
        damage
    };
    raykern_fuzz::show(&damage);
    damage.check(&ORIGINALS);
});

/// Rays through the unit cube, in which the sound blocks lie: along axes, slanted, from far away.
fn rays() -> Vec<Ray> {
    let mut rays = vec![Ray::new([0.3, 0.4, 5.0], [-0.0, 0.0, -1.0])];
    rays.push(Ray::new([1e30, -1e30, 1e30], [-1.0, 1.0, -1.0]));
    rays.push(
        Ray::new([-1.0, 0.3, 0.2], [1.0, 0.1, 1e-40]).with_limits(f32::NEG_INFINITY, f32::MAX),
    );
    rays
}
