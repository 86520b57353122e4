//! Every backend answers with the bits of the portable code, in either precision and from every structure.
//!
//! One test alone, because the choice of the backend holds for the whole process.

#![allow(missing_docs)]

mod common;

use common::{All, bits, odd_models};
use raykern::{Accel, Backend, Precision, QueryOptions, Ray};
use raykern_harness::make;
use raykern_harness::rays::{Family, RayMaker};
use raykern_harness::threads::map;

/// What a backend answers to all rays in both precisions.
fn answers(accel: &Accel, rays: &[Ray], backend: Backend) -> Vec<(Option<[u32; 6]>, bool)> {
    backend.force();
    let precisions = [Precision::Exact, Precision::Watertight];
    let ask = |ray: &Ray, precision| {
        let options = QueryOptions { precision, ..Default::default() };
        (bits(accel.intersect_with(ray, &options)), accel.occluded_with(ray, &options))
    };
    map(rays, |ray| precisions.map(|precision| ask(ray, precision))).concat()
}

/// What it finds closest to the origins of some of them.
fn closest(accel: &Accel, rays: &[Ray], backend: Backend) -> Vec<Option<[u32; 3]>> {
    backend.force();
    let ask = |ray: &Ray| {
        let hit = accel.closest_point(ray.origin, f32::INFINITY, &QueryOptions::default())?;
        Some([hit.distance.to_bits(), hit.geometry, hit.prim])
    };
    map(rays.iter().step_by(7), ask)
}

#[test]
fn all_backends_give_the_same_bits() {
    let best = Backend::detected();
    println!("this processor has {best:?}");
    let made = make::ALL.map(|(name, make)| (name, make(3_000)));
    let mut hits = 0;
    for (name, model) in made.into_iter().chain(odd_models()) {
        let all = All::of(&model);
        let families = Family::ORDINARY.into_iter().chain(Family::HOSTILE);
        let rays: Vec<Ray> = families
            .enumerate()
            .flat_map(|(seed, family)| RayMaker::new(&model, seed as u64).many(family, 150))
            .collect();
        for (structure, accel) in all.accels() {
            let expected = answers(&accel, &rays, Backend::Scalar);
            let near = closest(&accel, &rays, Backend::Scalar);
            hits += expected.iter().filter(|(hit, _)| hit.is_some()).count();
            for backend in Backend::ALL.into_iter().filter(|b| *b <= best) {
                assert_eq!(backend.force(), backend);
                let got = answers(&accel, &rays, backend);
                for (i, (got, expected)) in got.iter().zip(&expected).enumerate() {
                    assert_eq!(got, expected, "{name} {structure} {backend:?} {:?}", rays[i / 2]);
                }
                assert_eq!(closest(&accel, &rays, backend), near, "{name} {structure} {backend:?}");
            }
        }
    }
    assert!(hits > 100_000, "{hits}");
}
