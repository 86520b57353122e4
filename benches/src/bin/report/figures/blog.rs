//! The blog post's table, and beside it what its own numbers say when they are paired.

use raykern_harness::stats::{Summary, median, median_interval};

use super::{lines, number};
use crate::blog::{FAMILY, STRUCTURES};
use crate::rows::Run;

/// Mean of ten with Student's interval, and median with the bootstrap's, in nanoseconds a ray, shading included.
pub fn table(runs: &[Run]) -> Vec<Vec<String>> {
    let mine: Vec<&Run> = runs.iter().filter(|run| run.family == FAMILY).collect();
    let head = [
        "scene",
        "structure",
        "mean of 10, ns a ray",
        "plus or minus",
        "least",
        "greatest",
        "median",
        "from",
        "to",
        "grid over BVH",
    ];
    let scenes = mine.chunk_by(|a, b| a.scene == b.scene);
    let mut rows = Vec::new();
    for scene in scenes {
        let of = |structure: &str| -> Vec<f64> {
            let runs = scene.iter().filter(|run| run.method == structure);
            runs.map(|run| 1e9 * run.seconds / run.rays.max(1) as f64).collect()
        };
        let bvh = Summary::of(&of("BVH"));
        for structure in STRUCTURES {
            let samples = of(structure);
            let (Some(sum), Some(middle)) = (Summary::of(&samples), median(&samples)) else {
                continue;
            };
            let (from, to) = median_interval(&samples).unwrap_or((middle, middle));
            let ratio = bvh.map_or(f64::NAN, |bvh| sum.mean / bvh.mean);
            let numbers = [
                sum.mean,
                sum.half_width.unwrap_or(0.0),
                sum.min,
                sum.max,
                middle,
                from,
                to,
                ratio,
            ];
            let names = [scene[0].scene.clone(), structure.to_owned()];
            rows.push(names.into_iter().chain(numbers.map(number)).collect());
        }
    }
    lines(&head, rows)
}
