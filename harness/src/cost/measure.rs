//! Exact and watertight queries on the same structure, in turns.

use std::hint::black_box;

use raykern::{Accel, Counts, Hit, Precision, QueryOptions};
use raykern_harness::stats::Ratio;

use crate::clock::{Clock, Sample};
use crate::subjects::Rays;

/// Rays of which the work is counted, and the answers of both precisions compared.
const COUNTED: usize = 20_000;
/// Tests of a primitive that the comparison with a list may take.
const LISTED: usize = 20_000_000;

/// One line of the table.
pub struct Line {
    /// Medians in nanoseconds a ray: exact, watertight.
    pub nanoseconds: [f64; 2],
    /// How many times as much the exact mode takes.
    pub ratio: Ratio,
    /// Rays that hit, in hundredths.
    pub hits: f64,
    /// What the exact mode did for a ray: steps, blocks, tests, intervals, exact, roundings.
    pub work: [f64; 6],
    /// Rays that hit in the exact mode alone.
    pub misses: usize,
    /// Rays that hit in the watertight mode alone.
    pub extra: usize,
}

fn options(precision: Precision) -> QueryOptions {
    QueryOptions { precision, ..Default::default() }
}

/// Measures one kind of rays on one structure, `runs` times in either mode.
pub fn measure(accel: &Accel, rays: &Rays, runs: usize, clock: &mut Clock) -> Line {
    let precisions = [Precision::Exact, Precision::Watertight];
    precisions.iter().for_each(|p| pass(accel, rays, *p));
    let mut samples: [Vec<Sample>; 2] = [vec![], vec![]];
    for run in 0..runs {
        // Each mode goes first as often as the other.
        for i in [run % 2, 1 - run % 2] {
            samples[i].push(clock.time(|| pass(accel, rays, precisions[i])));
        }
    }
    let costs = samples.each_ref().map(|s| s.iter().map(Sample::cost).collect::<Vec<_>>());
    let a_ray = |s: &Vec<Sample>| {
        median(s.iter().map(|s| s.nanoseconds).collect()) / rays.rays.len() as f64
    };
    let (hits, misses, extra) = compare(accel, rays);
    Line {
        nanoseconds: samples.each_ref().map(a_ray),
        ratio: Ratio::paired(&costs[0], &costs[1]).expect("at least one run"),
        hits,
        work: work(accel, rays),
        misses,
        extra,
    }
}

fn pass(accel: &Accel, rays: &Rays, precision: Precision) {
    let options = options(precision);
    for ray in &rays.rays {
        if rays.occluded {
            black_box(accel.occluded_with(ray, &options));
        } else {
            black_box(accel.intersect_with(ray, &options));
        }
    }
}

/// The share of rays that hit exactly, and how many hit in one mode alone.
fn compare(accel: &Accel, rays: &Rays) -> (f64, usize, usize) {
    let [mut hits, mut misses, mut extra, mut count] = [0; 4];
    for ray in rays.rays.iter().take(COUNTED) {
        let exact = accel.occluded_with(ray, &options(Precision::Exact));
        let watertight = accel.occluded_with(ray, &options(Precision::Watertight));
        count += 1;
        hits += usize::from(exact);
        misses += usize::from(exact && !watertight);
        extra += usize::from(watertight && !exact);
    }
    (100.0 * hits as f64 / count as f64, misses, extra)
}

fn work(accel: &Accel, rays: &Rays) -> [f64; 6] {
    let mut counts = Counts::default();
    let options = options(Precision::Exact);
    let some = &rays.rays[..rays.rays.len().min(COUNTED)];
    for ray in some {
        if rays.occluded {
            accel.occluded_counted(ray, &options, &mut counts);
        } else {
            accel.intersect_counted(ray, &options, &mut counts);
        }
    }
    let Counts { steps, blocks, tests, intervals, exact, roundings, .. } = counts;
    [steps, blocks, tests, intervals, exact, roundings].map(|n| n as f64 / some.len() as f64)
}

/// Panics unless the exact answers of the structures have the same bits, on a sample of the rays.
pub fn check(name: &str, [list, grid, bvh]: [&Accel; 3], rays: &Rays, prims: usize) {
    let bits = |hit: Option<Hit>| {
        let Hit { t, u, v, prim, geometry, instance } = hit.unwrap_or(Hit::MISS);
        [t.to_bits(), u.to_bits(), v.to_bits(), prim, geometry, instance]
    };
    let listed = LISTED / prims.max(1);
    let step = (rays.rays.len() / 2_000).max(1);
    for (i, ray) in rays.rays.iter().step_by(step).enumerate() {
        let expected = bits(bvh.intersect(ray));
        assert_eq!(bits(grid.intersect(ray)), expected, "{name}: grid and BVH, {ray:?}");
        assert_eq!(bvh.occluded(ray), expected[3] != raykern::NONE, "{name}: occluded, {ray:?}");
        if i < listed {
            assert_eq!(bits(list.intersect(ray)), expected, "{name}: list and BVH, {ray:?}");
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) }
}
