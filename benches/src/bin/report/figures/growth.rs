//! How build, memory and rays grow, with a law fitted to each and what it predicts.

use anyhow::Result;
use raykern_harness::chart::plot::{Axis, Plot, Point, Scale, Series};
use raykern_harness::fit::PowerLaw;

use super::cost::{Cost, measured, scenes};
use super::{Figure, lines, number, style};
use crate::methods::REFERENCE;
use crate::rows::{Build, Run};

/// What grows.
#[derive(Clone, Copy)]
pub struct Measure {
    /// In the name of the figure.
    pub name: &'static str,
    title: &'static str,
    pub unit: &'static str,
    of: fn(&Cost) -> f64,
    /// In the unit, of one of the count.
    each: bool,
}

/// The three of them.
pub const MEASURES: [Measure; 3] = [
    Measure {
        name: "build",
        title: "Building",
        unit: "ns to build",
        of: |cost| 1e9 * cost.build,
        each: true,
    },
    Measure {
        name: "memory",
        title: "Memory",
        unit: "bytes",
        of: |cost| cost.bytes as f64,
        each: true,
    },
    Measure {
        name: "ray",
        title: "A random ray",
        unit: "ns a random ray",
        of: |cost| 1e9 * cost.ray,
        each: false,
    },
];

/// Laws are fitted to so many of the largest scenes, which have so many at least: in small ones fixed costs rule.
const FITTED: usize = 5;
const LEAST: f64 = 1_000.0;
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
    let series = |method: &&str| {
        let points = curve(method).into_iter().map(|(x, y)| Point::bare(x, y)).collect();
        Series { name: (*method).to_owned(), style: style(method), points, joined: true }
    };
    let predicted = |method: &&str| {
        let points = law(&curve(method)).into_iter().map(|law| prediction(method, &law)).collect();
        Series { name: String::new(), style: style(method), points, joined: false }
    };
    let per = if measure.each { format!(" for each {what}") } else { String::new() };
    let plot = Plot {
        title: format!("{}, by {what}s", measure.title),
        x: Axis::new(format!("{what}s"), Scale::Log),
        y: Axis::new(format!("{}{per}", measure.unit), Scale::Log),
        series: methods.iter().map(series).chain(methods.iter().map(predicted)).collect(),
        front: Vec::new(),
        size: (860, 480),
    };
    let row = |method: &&str| Some(line(method, &law(&curve(method))?));
    let head = ["method", "exponent", "predicted at 1e9", "low", "high"];
    let table = lines(&head, methods.iter().filter_map(row));
    let of = |scene: &&str| {
        let cost = |method: &&str| Cost::of(builds, runs, [family, scene, method]);
        methods.iter().filter_map(cost).collect::<Vec<_>>()
    };
    let costs: Vec<Cost> = scenes.iter().flat_map(of).collect();
    let caption = format!(
        "A flat line grows in proportion. {} What stands alone at 1e9 is predicted, not measured, by power laws \
         through the {FITTED} largest scenes of a thousand or more: {}.",
        measured(costs.iter()),
        words(&table, &format!("{}{per}", measure.unit))
    );
    Figure::new(format!("{family}-{}", measure.name), plot.svg(), caption, table)
}

/// Through the largest scenes.
fn law(curve: &[(f64, f64)]) -> Option<PowerLaw> {
    let large: Vec<_> = curve.iter().copied().filter(|point| point.0 >= LEAST).collect();
    PowerLaw::through(&large[large.len().saturating_sub(FITTED)..])
}

fn prediction(method: &str, law: &PowerLaw) -> Point {
    let (value, interval) = law.at(FAR);
    // The others would cover each other.
    let told = ["BVH", REFERENCE].contains(&method);
    let label = if told { format!("{method}, predicted") } else { String::new() };
    Point { at: (FAR, value), x_interval: None, y_interval: Some(interval), label }
}

fn line(method: &str, law: &PowerLaw) -> Vec<String> {
    let (value, (low, high)) = law.at(FAR);
    let numbers = [law.exponent, value, low, high].map(number);
    [vec![method.to_owned()], numbers.to_vec()].concat()
}

fn words(table: &[Vec<String>], unit: &str) -> String {
    let of = |line: &Vec<String>| format!("{} {} ({} to {})", line[0], line[2], line[3], line[4]);
    let all: Vec<String> = table.iter().skip(1).map(of).collect();
    if all.is_empty() { "too few".to_owned() } else { format!("{} {unit}", all.join("; ")) }
}
