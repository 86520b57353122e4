//! Speed over faults: the chart that the report is for, for scenes, for all stress families, and for each of them.

use anyhow::Result;
use raykern_harness::chart::plot::{Axis, Plot, Point, Scale, Series};
use raykern_harness::chart::rows::{Row, Rows};
use raykern_harness::stats::{median, median_interval};

use super::{Figure, grouped, lines, number};
use crate::methods::{AGAIN, Group, REFERENCE};
use crate::ordinary::FAMILY;
use crate::rows::Run;
use crate::summary::{Cell, Summary, cells, front};

const SPEED: &str = "rays a second, one thread, over those of Embree 3 by default";

/// Wrong answers over speed.
pub fn wrong(name: &str, title: &str, summaries: &[Summary], small: bool) -> Result<Figure> {
    let shown = |s: &&Summary| s.name != AGAIN && s.speed.is_some() && s.wrong().is_some();
    let shown: Vec<&Summary> = summaries.iter().filter(shown).collect();
    let place = |s: &Summary| Some((s.speed?.0, s.wrong()?.0));
    let point = |s: &Summary| {
        let ((x, x_interval), (y, y_interval)) = (s.speed?, s.wrong()?);
        let label = if small { String::new() } else { s.name.to_owned() };
        Some(Point {
            at: (x, y),
            x_interval: Some(x_interval),
            y_interval: Some(y_interval),
            label,
        })
    };
    let places: Vec<_> = shown.iter().filter_map(|s| place(s)).collect();
    let plot = Plot {
        title: title.to_owned(),
        x: Axis::new(if small { "speed, Embree 3 = 1" } else { SPEED }, Scale::Log),
        y: Axis::new("wrong answers a million rays", Scale::LogWithZero),
        series: by_group(&shown, point),
        front: front(&places),
        size: if small { (460, 380) } else { (1000, 680) },
    };
    let (rays, runs) = (grouped(&most_asked(&shown).to_string()), run_count(&shown));
    let caption = format!(
        "Right is faster, down is more often right; whiskers are intervals of 95 %, from zero up to where the true share may \
         still be when no wrong answer was seen. The line joins what no other method beats. Up to {rays} rays a method judged, {runs} \
         timed pairs a method."
    );
    Figure::new(name, plot.svg(), caption, table(&shown))
}

/// The error of `t` over speed.
pub fn t_error(name: &str, title: &str, summaries: &[Summary]) -> Result<Figure> {
    let shown =
        |s: &&Summary| s.name != AGAIN && s.speed.is_some() && s.tally.ulps.quantile(0.5).is_some();
    let shown: Vec<&Summary> = summaries.iter().filter(shown).collect();
    let at = |s: &Summary, share| s.tally.ulps.quantile(share).map(|ulps| ulps as f64);
    let point = |s: &Summary| {
        let (middle, most) = (at(s, 0.99)?, s.tally.ulps.max as f64);
        Some(Point {
            at: (s.speed?.0, middle),
            x_interval: None,
            y_interval: Some((at(s, 0.5)?, most)),
            label: s.name.to_owned(),
        })
    };
    let places: Vec<_> = shown.iter().filter_map(|s| Some((s.speed?.0, at(s, 0.99)?))).collect();
    let plot = Plot {
        title: title.to_owned(),
        x: Axis::new(SPEED, Scale::Log),
        y: Axis::new("error of t in floats (ulps)", Scale::LogWithZero),
        series: by_group(&shown, point),
        front: front(&places),
        size: (1000, 680),
    };
    let caption = "How far t is from the nearest float where the right triangle was met: marks at the 99th percentile, \
                   whiskers from the median to the worst. The line joins what no other method beats.";
    Figure::new(name, plot.svg(), caption, table(&shown))
}

/// Every single ratio of a run to the reference's run beside it.
pub fn runs(name: &str, title: &str, summaries: &[Summary]) -> Result<Figure> {
    let row = |s: &Summary| {
        let middle = median(&s.ratios)?;
        let interval = median_interval(&s.ratios)?;
        Some(Row {
            name: s.name.to_owned(),
            style: s.group.style(),
            values: s.ratios.clone(),
            middle: Some((middle, interval)),
        })
    };
    let shown: Vec<&Summary> = summaries.iter().filter(|s| s.name != REFERENCE).collect();
    let rows: Vec<Row> = shown.iter().filter_map(|s| row(s)).collect();
    let numbers = shown
        .iter()
        .flat_map(|s| s.ratios.iter().map(|ratio| vec![s.name.to_owned(), number(*ratio)]));
    let table = lines(&["method", "ratio"], numbers);
    let chart = Rows {
        title: title.to_owned(),
        axis: Axis::new(SPEED, Scale::Log),
        rows,
        reference: Some(1.0),
        width: 1000,
    };
    let caption = format!(
        "Each dot is one run of a method over the run of Embree 3 beside it, on one scene and kind of ray: {} dots a method, none \
         left out. Bars are medians of all dots with their bootstrap intervals of 95 %, so they hold the differences between scenes; \
         within a scene runs differ by a few per cent.",
        run_count(&shown)
    );
    Figure::new(name, chart.svg(), caption, table)
}

/// A method over itself, each scene and kind a row: what a ratio of one looks like here.
pub fn noise(runs: &[Run]) -> Result<Figure> {
    let cells = cells(AGAIN, "BVH", runs, |family| family == FAMILY);
    let row = |((_, scene, kind), ratios): (&Cell, &Vec<(usize, f64)>)| {
        let values: Vec<f64> = ratios.iter().map(|ratio| ratio.1).collect();
        let middle = Some((median(&values)?, median_interval(&values)?));
        Some(Row { name: format!("{scene}, {kind}"), style: 1, values, middle })
    };
    let rows: Vec<Row> = cells.iter().filter_map(row).collect();
    let numbers =
        rows.iter().flat_map(|row| row.values.iter().map(|v| vec![row.name.clone(), number(*v)]));
    let table = lines(&["scene and kind", "ratio"], numbers);
    let runs = rows.first().map_or(0, |row| row.values.len());
    let chart = Rows {
        title: "The noise of this machine: the same method against itself".to_owned(),
        axis: Axis::new("rays a second of the BVH, asked again, over its own", Scale::Log),
        rows,
        reference: Some(1.0),
        width: 1000,
    };
    let caption = format!(
        "Two turns of one method in each of {runs} rounds; whatever differs from one is noise. Bars are medians with bootstrap \
         intervals of 95 %."
    );
    Figure::new("noise", chart.svg(), caption, table)
}

fn by_group(shown: &[&Summary], point: impl Fn(&Summary) -> Option<Point>) -> Vec<Series> {
    let series = |group: Group| Series {
        name: group.name().to_owned(),
        style: group.style(),
        points: shown.iter().filter(|s| s.group == group).filter_map(|s| point(s)).collect(),
        joined: false,
    };
    Group::ALL.map(series).into_iter().filter(|series| !series.points.is_empty()).collect()
}

fn most_asked(shown: &[&Summary]) -> u64 {
    shown.iter().map(|s| s.tally.asked).max().unwrap_or(0)
}

fn run_count(shown: &[&Summary]) -> usize {
    shown.iter().map(|s| s.ratios.len()).max().unwrap_or(0)
}

/// The numbers behind the charts, and a table of the page.
pub fn table(shown: &[&Summary]) -> Vec<Vec<String>> {
    let head = [
        "method",
        "speed",
        "low",
        "high",
        "rays",
        "false misses",
        "false hits",
        "other triangle",
        "wrong a million",
        "at least",
        "at most",
        "t: median ulps",
        "99 %",
        "worst",
        "not exact",
        "gave up",
    ];
    let row = |s: &&Summary| {
        let speed = s.speed.map(|(mean, (low, high))| [mean, low, high].map(number));
        let wrong = s.wrong().map(|(share, (low, high))| [share, low, high].map(number));
        let none = || [const { String::new() }; 3];
        let ulps = |share| s.tally.ulps.quantile(share).map_or(String::new(), |u| u.to_string());
        let t = &s.tally;
        let mut line = vec![s.name.to_owned()];
        line.extend(speed.unwrap_or_else(none));
        line.extend([t.asked, t.false_misses, t.false_hits, t.wrong_prims].map(|n| n.to_string()));
        line.extend(wrong.unwrap_or_else(none));
        line.extend([ulps(0.5), ulps(0.99), ulps(1.0)]);
        line.extend([t.not_exact, t.gave_up].map(|n| n.to_string()));
        line
    };
    lines(&head, shown.iter().map(row))
}
