//! How build, memory and rays grow, with a law fitted to each and what it predicts.

use anyhow::Result;
use raykern_harness::chart::plot::{Axis, Plot, Point, Scale, Series};
use raykern_harness::fit::PowerLaw;

use super::cost::{Cost, scenes};
use super::{Figure, lines, number};
use crate::rows::{Build, Run};

/// What grows.
#[derive(Clone, Copy)]
pub struct Measure {
    pub name: &'static str,
    pub unit: &'static str,
    of: fn(&Cost) -> f64,
    /// In the unit, of one of the count.
    each: bool,
}

/// The three of them.
pub const MEASURES: [Measure; 3] = [
    Measure { name: "build", unit: "ns to build", of: |cost| 1e9 * cost.build, each: true },
    Measure { name: "memory", unit: "bytes", of: |cost| cost.bytes as f64, each: true },
    Measure { name: "ray", unit: "ns a random ray", of: |cost| 1e9 * cost.ray, each: false },
];

/// Laws are fitted to so many of the largest scenes: in small ones caches and fixed costs rule.
const FITTED: usize = 5;
/// What is predicted.
const FAR: f64 = 1e9;

/// One measure of every method over the scenes of a family; `what` they are counted in, in the singular.
pub fn chart(
    builds: &[Build],
    runs: &[Run],
    family: &str,
    what: &str,
    measure: Measure,
) -> Result<Figure> {
    let mut methods: Vec<&str> = Vec::new();
    for build in builds.iter().filter(|build| build.family == family) {
        if !methods.contains(&build.method.as_str()) {
            methods.push(&build.method);
        }
    }
    let scenes = scenes(builds, family);
    let curve = |method: &str| -> Vec<(f64, f64)> {
        let cost = |scene: &&str| Cost::of(builds, runs, [family, scene, method]);
        let value = |cost: Cost| {
            let share = if measure.each { cost.count as f64 } else { 1.0 };
            (cost.count as f64, (measure.of)(&cost) / share)
        };
        scenes.iter().filter_map(cost).map(value).collect()
    };
    let series = methods.iter().enumerate().map(|(style, method)| Series {
        name: (*method).to_owned(),
        style,
        points: curve(method).into_iter().map(|(x, y)| Point::bare(x, y)).collect(),
        joined: true,
    });
    let per = if measure.each { format!(" for each {what}") } else { String::new() };
    let plot = Plot {
        title: format!("{what}s and {}", measure.name),
        x: Axis::new(format!("{what}s"), Scale::Log),
        y: Axis::new(format!("{}{per}", measure.unit), Scale::Log),
        series: series.collect(),
        front: Vec::new(),
        size: (860, 480),
    };
    let row = |method: &&str| prediction(method, &curve(method));
    let head = ["method", "points fitted", "exponent", "predicted at 1e9", "low", "high"];
    let table = lines(&head, methods.iter().filter_map(row));
    let caption = format!(
        "Medians of the runs; a flat line grows in proportion. {}",
        words(&table, &format!("{}{per}", measure.unit))
    );
    Figure::new(format!("{family}-{}", measure.name), plot.svg(), caption, table)
}

/// A law through the largest scenes.
fn prediction(method: &str, curve: &[(f64, f64)]) -> Option<Vec<String>> {
    let last = &curve[curve.len().saturating_sub(FITTED)..];
    let law = PowerLaw::through(last)?;
    let (value, (low, high)) = law.at(FAR);
    let numbers = [law.exponent, value, low, high].map(number);
    Some([vec![method.to_owned(), last.len().to_string()], numbers.to_vec()].concat())
}

fn words(table: &[Vec<String>], unit: &str) -> String {
    let of = |line: &Vec<String>| format!("{} {} ({} to {})", line[0], line[3], line[4], line[5]);
    let all: Vec<String> = table.iter().skip(1).map(of).collect();
    format!(
        "Predicted for 1e9, not measured, by power laws through the {FITTED} largest, in {unit}: {}.",
        all.join("; ")
    )
}
