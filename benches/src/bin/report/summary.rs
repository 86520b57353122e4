//! What many runs and judgements of a method come to.

use std::collections::BTreeMap;

use raykern_harness::stats::{Ratio, median, share_interval};

use crate::judge::Tally;
use crate::methods::{Group, Method, REFERENCE};
use crate::rows::{Judged, Run};

/// A method's speed and faults, over some families.
pub struct Summary {
    pub name: &'static str,
    pub group: Group,
    /// Rays a second over the reference's, of each scene, kind and run.
    pub ratios: Vec<f64>,
    /// The geometric mean over scenes and kinds of the median of the runs, with the interval of 95 % over the runs.
    pub speed: Option<(f64, (f64, f64))>,
    /// All judgements.
    pub tally: Tally,
}

impl Summary {
    /// Of the runs and judgements whose family is one of these.
    pub fn of(
        method: &Method,
        runs: &[Run],
        judged: &[Judged],
        wanted: impl Fn(&str) -> bool,
    ) -> Self {
        let mut tally = Tally::default();
        let mine = judged.iter().filter(|row| row.method == method.name && wanted(&row.family));
        mine.for_each(|row| tally.merge(&row.tally()));
        let cells = cells(method.name, REFERENCE, runs, &wanted);
        Summary {
            name: method.name,
            group: method.group,
            ratios: cells.values().flatten().map(|(_, ratio)| *ratio).collect(),
            speed: speed(&cells),
            tally,
        }
    }

    /// Wrong answers a million, with the interval of 95 %.
    pub fn wrong(&self) -> Option<(f64, (f64, f64))> {
        let (wrong, asked) = (self.tally.wrong(), self.tally.asked);
        let (low, high) = share_interval(wrong, asked);
        (asked > 0).then(|| (1e6 * wrong as f64 / asked as f64, (1e6 * low, 1e6 * high)))
    }
}

/// A family, a scene and a kind of ray.
pub type Cell = (String, String, String);
/// Of each, the runs with their ratios.
pub type Cells = BTreeMap<Cell, Vec<(usize, f64)>>;

/// Rays a second of a method over those of a reference, run by run.
pub fn cells(method: &str, reference: &str, runs: &[Run], wanted: impl Fn(&str) -> bool) -> Cells {
    let cell = |run: &Run| (run.family.clone(), run.scene.clone(), run.kind.clone());
    let each = |run: &Run| run.seconds / run.rays.max(1) as f64;
    let reference: BTreeMap<_, f64> = (runs.iter())
        .filter(|run| run.method == reference && wanted(&run.family))
        .map(|run| ((cell(run), run.run), each(run)))
        .collect();
    let mut cells = Cells::new();
    for run in runs.iter().filter(|run| run.method == method && wanted(&run.family)) {
        if let Some(theirs) = reference.get(&(cell(run), run.run)) {
            cells.entry(cell(run)).or_default().push((run.run, theirs / each(run)));
        }
    }
    cells
}

fn speed(cells: &Cells) -> Option<(f64, (f64, f64))> {
    let medians: Vec<f64> = (cells.values())
        .filter_map(|runs| median(&runs.iter().map(|run| run.1).collect::<Vec<_>>()))
        .collect();
    let mean = geomean(&medians)?;
    // One number a run: the mean over all cells. How cells differ from each other is no uncertainty.
    let mut by_run: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (run, ratio) in cells.values().flatten() {
        by_run.entry(*run).or_default().push(*ratio);
    }
    let means: Vec<f64> = by_run.values().filter_map(|ratios| geomean(ratios)).collect();
    let interval = Ratio::paired(&means, &vec![1.0; means.len()])?.interval;
    Some((mean, interval.unwrap_or((mean, mean))))
}

/// The geometric mean.
pub fn geomean(values: &[f64]) -> Option<f64> {
    let logs: f64 = values.iter().map(|x| x.ln()).sum();
    (!values.is_empty()).then(|| (logs / values.len() as f64).exp())
}

/// Those that no other beats: faster than all that are wrong as seldom. The fastest first.
pub fn front(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for point in sorted {
        if front.last().is_none_or(|last| point.1 < last.1) {
            front.push(point);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [(1.0, 5.0), (2.0, 5.0), (3.0, 90.0), (1.5, 7.0), (0.5, 0.0), (0.4, 0.0)];
        assert_eq!(front(&points), [(3.0, 90.0), (2.0, 5.0), (0.5, 0.0)]);
        assert_eq!(front(&[]), []);
    }

    #[test]
    fn ratios_pair_the_runs_of_a_cell() {
        let run = |method: &str, kind: &str, run, seconds| Run {
            family: "scenes".into(),
            scene: "ball".into(),
            kind: kind.into(),
            method: method.into(),
            run,
            rays: 10,
            seconds,
        };
        let mut runs = Vec::new();
        // The second run is disturbed, both halves alike; the kinds differ by a factor of four.
        for (number, slow) in [(0, 1.0), (1, 7.0), (2, 1.0)] {
            for (kind, ours) in [("a", 1.0), ("b", 0.25)] {
                runs.push(run(REFERENCE, kind, number, 2.0 * slow));
                runs.push(run("BVH", kind, number, ours * slow));
            }
        }
        let bvh = methods::all().into_iter().find(|method| method.name == "BVH").unwrap();
        let summary = Summary::of(&bvh, &runs, &[], |family| family == "scenes");
        let (speed, (low, high)) = summary.speed.unwrap();
        assert!((speed - 4.0).abs() < 1e-9 && (high / low - 1.0).abs() < 1e-6, "{speed}");
        assert_eq!(summary.ratios.len(), 6);
        assert!(summary.wrong().is_none());
    }
}
