//! What a scene needs: structures by memory, build and rays, and from how many rays on each pays.

use std::collections::BTreeMap;

use anyhow::Result;
use raykern_harness::chart::plot::{Axis, Plot, Point, Scale, Series};
use raykern_harness::stats::median;

use super::{Figure, lines, number, style};
use crate::ordinary::FAMILY;
use crate::rows::{Build, Run};
use crate::structures::{ALL, AUTOMATIC, COSTS, SIZES};
use crate::summary::geomean;

/// What a structure costs over one scene.
#[derive(Clone)]
pub struct Cost {
    pub count: usize,
    /// Seconds of the median build.
    pub build: f64,
    pub bytes: usize,
    /// Seconds a ray: the geometric mean over kinds of the median of the runs.
    pub ray: f64,
    pub took: String,
    pub builds: usize,
    pub runs: usize,
}

impl Cost {
    /// Of one method over one scene of a family.
    pub fn of(builds: &[Build], runs: &[Run], [family, scene, method]: [&str; 3]) -> Option<Self> {
        let mine: Vec<&Build> = (builds.iter())
            .filter(|b| {
                (b.family.as_str(), b.scene.as_str(), b.method.as_str()) == (family, scene, method)
            })
            .collect();
        let seconds: Vec<f64> = mine.iter().map(|build| build.seconds).collect();
        let mut kinds: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        let mine_too = |r: &&Run| {
            (r.family.as_str(), r.scene.as_str(), r.method.as_str()) == (family, scene, method)
        };
        for run in runs.iter().filter(mine_too) {
            kinds.entry(&run.kind).or_default().push(run.seconds / run.rays as f64);
        }
        let medians: Vec<f64> = kinds.values().filter_map(|runs| median(runs)).collect();
        Some(Cost {
            count: mine.first()?.count,
            build: median(&seconds)?,
            bytes: mine.first()?.bytes,
            ray: geomean(&medians)?,
            took: mine.first()?.took.clone(),
            builds: seconds.len(),
            runs: kinds.values().map(Vec::len).sum(),
        })
    }

    /// Seconds a triangle for a build and then so many rays for each.
    fn total(&self, rays: f64) -> f64 {
        self.build / self.count as f64 + rays * self.ray
    }
}

/// The scenes of a family, in the order in which they were measured.
pub fn scenes<'a>(builds: &'a [Build], family: &str) -> Vec<&'a str> {
    let mut scenes: Vec<&str> = Vec::new();
    for build in builds.iter().filter(|build| build.family == family) {
        if !scenes.contains(&build.scene.as_str()) {
            scenes.push(&build.scene);
        }
    }
    scenes
}

/// Every structure over a scene.
fn costs(builds: &[Build], runs: &[Run], family: &str, scene: &str) -> Vec<(&'static str, Cost)> {
    let cost = |(name, _)| Some((name, Cost::of(builds, runs, [family, scene, name])?));
    ALL.into_iter().filter_map(cost).collect()
}

/// A table of every structure over every scene, with how much worse the automatic choice is than the best.
pub fn table(builds: &[Build], runs: &[Run]) -> Vec<Vec<String>> {
    let head = [
        "scene",
        "structure",
        "took",
        "bytes a triangle",
        "build ns a triangle",
        "ns a ray",
        "of the best, many rays",
        "of the best, 0.1 rays",
        "builds",
        "runs",
    ];
    let mut rows = Vec::new();
    for scene in scenes(builds, COSTS) {
        let all = costs(builds, runs, COSTS, scene);
        let best =
            |rays| all.iter().map(|(_, cost)| cost.total(rays)).fold(f64::INFINITY, f64::min);
        for (name, cost) in &all {
            let each = |x: f64| number(x / cost.count as f64);
            rows.push(vec![
                scene.to_owned(),
                (*name).to_owned(),
                if AUTOMATIC.contains(name) { cost.took.clone() } else { String::new() },
                each(cost.bytes as f64),
                each(1e9 * cost.build),
                number(1e9 * cost.ray),
                number(cost.total(MANY) / best(MANY)),
                number(cost.total(0.1) / best(0.1)),
                cost.builds.to_string(),
                cost.runs.to_string(),
            ]);
        }
    }
    lines(&head, rows)
}

/// Of every method, by the geometric mean over the scenes: what a triangle takes to build, and to keep.
pub fn builds_table(builds: &[Build], methods: &[&str]) -> Vec<Vec<String>> {
    let row = |method: &&str| {
        let mine = || builds.iter().filter(|b| b.family == FAMILY && b.method == *method);
        let mean = |of: fn(&Build) -> f64| {
            geomean(&mine().map(|b| of(b) / b.count as f64).collect::<Vec<_>>())
        };
        let bytes = mean(|b| b.bytes as f64).filter(|bytes| *bytes > 0.0);
        let bytes = bytes.map_or("not told".to_owned(), number);
        Some(vec![(*method).to_owned(), number(mean(|b| 1e9 * b.seconds)?), bytes])
    };
    lines(&["method", "build ns a triangle", "bytes a triangle"], methods.iter().filter_map(row))
}

/// Rays for each triangle that count as many.
const MANY: f64 = 100.0;

/// Time a triangle, over rays for each triangle: whose line is lowest pays.
pub fn break_even(builds: &[Build], runs: &[Run], scene: &str) -> Result<Figure> {
    let mut all = costs(builds, runs, COSTS, scene);
    // It would flatten all other lines.
    all.retain(|(name, _)| *name != "list" && !AUTOMATIC.contains(name));
    let steps = (0..=20).map(|i| 10f64.powf(f64::from(i) / 5.0 - 2.0));
    let series = all.iter().map(|(name, cost)| Series {
        name: (*name).to_owned(),
        style: style(name),
        points: steps.clone().map(|rays| Point::bare(rays, 1e9 * cost.total(rays))).collect(),
        joined: true,
    });
    let plot = Plot {
        title: format!("{scene}: build and rays together"),
        x: Axis::new("rays for each triangle until the next build", Scale::Log),
        y: Axis::new("ns a triangle, build and rays", Scale::Log),
        series: series.collect(),
        front: Vec::new(),
        size: (560, 420),
    };
    let row = |(name, cost): &(&str, Cost)| {
        let from = [0.01, 0.1, 1.0, 10.0, 100.0].map(|rays| number(1e9 * cost.total(rays)));
        [vec![(*name).to_owned()], from.to_vec()].concat()
    };
    let caption = format!(
        "The lowest line is the structure that pays: {} {}",
        pays(&all),
        measured(all.iter().map(|(_, cost)| cost))
    );
    let table = lines(&["structure", "0.01", "0.1", "1", "10", "100"], all.iter().map(row));
    Figure::new(format!("break-even-{scene}"), plot.svg(), caption, table)
}

/// How often these were measured, in words.
pub fn measured<'a>(costs: impl Iterator<Item = &'a Cost>) -> String {
    let counts: Vec<[usize; 2]> = costs.map(|cost| [cost.builds, cost.runs]).collect();
    let range = |k: usize| {
        let all = || counts.iter().map(|pair| pair[k]);
        match (all().min().unwrap_or(0), all().max().unwrap_or(0)) {
            (least, most) if least == most => least.to_string(),
            (least, most) => format!("{least} to {most}"),
        }
    };
    format!("Medians of {} builds and {} runs.", range(0), range(1))
}

/// Who is cheapest from how many rays on.
fn pays(all: &[(&str, Cost)]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut last: Option<&(&str, Cost)> = None;
    for rays in (0..=200).map(|i| 10f64.powf(f64::from(i) / 40.0 - 3.0)) {
        let cheapest = all.iter().min_by(|a, b| a.1.total(rays).total_cmp(&b.1.total(rays)));
        let Some(now) = cheapest else { continue };
        match last {
            None => words.push(format!("{} at first", now.0)),
            Some(before) if before.0 != now.0 => {
                // Where the lines cross, close below this number of rays.
                let dearer = now.1.total(0.0) - before.1.total(0.0);
                let from = dearer / (before.1.ray - now.1.ray);
                words.push(format!("{} from {} rays a triangle on", now.0, number(from)));
            }
            _ => {}
        }
        last = cheapest;
    }
    words.join(", ") + "."
}

/// Time a ray over the number of triangles, a few of them.
pub fn sizes(builds: &[Build], runs: &[Run]) -> Result<Figure> {
    let all = ALL.iter().filter(|(name, _)| !AUTOMATIC.contains(name));
    let point = |scene: &str, name: &str| {
        let cost = Cost::of(builds, runs, [SIZES, scene, name])?;
        Some(Point::bare(cost.count as f64, 1e9 * cost.ray))
    };
    let scenes = scenes(builds, SIZES);
    let series = all.map(|(name, _)| Series {
        name: (*name).to_owned(),
        style: style(name),
        points: scenes.iter().filter_map(|scene| point(scene, name)).collect(),
        joined: true,
    });
    let plot = Plot {
        title: "A few triangles: who begins to win where".to_owned(),
        x: Axis::new("triangles of a soup", Scale::Log),
        y: Axis::new("ns a random ray", Scale::Log),
        series: series.collect(),
        front: Vec::new(),
        size: (860, 520),
    };
    let took = |scene: &&str| {
        Cost::of(builds, runs, [SIZES, scene, AUTOMATIC[0]]).map(|cost| (cost.count, cost.took))
    };
    let lists = scenes
        .iter()
        .filter_map(took)
        .filter(|(_, took)| took == "list")
        .map(|(count, _)| count)
        .max();
    let of = |scene: &&str| costs(builds, runs, SIZES, scene).into_iter().map(|(_, cost)| cost);
    let all: Vec<Cost> = scenes.iter().flat_map(of).collect();
    let caption = format!(
        "{} {} The automatic choice takes a list up to {} triangles here.",
        wins(builds, runs, &scenes),
        measured(all.iter()),
        lists.map_or("no".to_owned(), |count| count.to_string())
    );
    let row = |scene: &&str| {
        let cells = ALL.iter().map(|(name, _)| {
            let cost = Cost::of(builds, runs, [SIZES, scene, name]);
            cost.map_or(String::new(), |cost| number(1e9 * cost.ray))
        });
        std::iter::once((*scene).to_owned()).chain(cells).collect()
    };
    let names: Vec<&str> =
        std::iter::once("triangles").chain(ALL.iter().map(|(name, _)| *name)).collect();
    Figure::new("sizes", plot.svg(), caption, lines(&names, scenes.iter().map(row)))
}

/// From how many triangles on each structure's rays are faster than those of a list, at every size measured.
fn wins(builds: &[Build], runs: &[Run], scenes: &[&str]) -> String {
    let ray =
        |scene: &str, name: &str| Cost::of(builds, runs, [SIZES, scene, name]).map(|cost| cost.ray);
    let first = |name: &str| {
        let faster = |scene: &&&str| ray(scene, name) < ray(scene, "list");
        let from = scenes.iter().rev().take_while(faster).last();
        from.map(|scene| format!("{name} from {scene}"))
    };
    let structures = ALL[1..7].iter().filter_map(|(name, _)| first(name));
    format!(
        "Rays are faster than through a list: {} triangles on.",
        structures.collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(build: f64, ray: f64) -> Cost {
        let took = String::new();
        Cost { count: 10, build, bytes: 1, ray, took, builds: 1, runs: 1 }
    }

    #[test]
    fn what_is_dear_to_build_pays_from_some_number_of_rays_on() {
        let all = [("grid", cost(1.0, 1.0)), ("BVH", cost(2.0, 0.5)), ("worse", cost(3.0, 0.6))];
        // 0.1 + r = 0.2 + r / 2 at r = 0.2
        assert_eq!(pays(&all), "grid at first, BVH from 0.200 rays a triangle on.");
    }
}
