//! Tables to read, and one to compute with.

use std::path::Path;

use anyhow::Result;
use raykern::Counts;

use crate::measure::{KindResult, MethodResult, SceneResult};
use crate::options::Options;
use crate::watch::EVENTS;

/// What everything below was measured on, and how.
pub fn machine(core: Option<usize>, options: &Options) {
    let on = core.map_or("not kept on one core".to_string(), |core| format!("on core {core}"));
    println!(
        "raykern {} on {}; one thread, {on}; {} rays a kind, {} runs",
        env!("CARGO_PKG_VERSION"),
        processor(),
        options.ray_count(),
        options.run_count()
    );
}

/// The processor's name, where the system tells.
pub fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|line| line.starts_with("model name"));
    let name = model.and_then(|line| line.split(": ").nth(1));
    name.unwrap_or(std::env::consts::ARCH).to_string()
}

/// Everything about one scene.
pub fn scene(result: &SceneResult) {
    let SceneResult { name, count, unit, .. } = result;
    println!("{name}: {count} {unit}s");
    result.notes.iter().for_each(|note| println!("  {note}"));
    let [each, bytes] = ["ns", "bytes"].map(|what| format!("{what}/{unit}"));
    println!("  {:<36}{:>10}{each:>14}{bytes:>16}", "build", "ms");
    for structure in &result.structures {
        let each = |x: f64| x / result.count.max(1) as f64;
        let bytes = structure.bytes.map(|bytes| format!("{:.1}", each(bytes as f64)));
        println!(
            "  {:<36}{:>10.2}{:>14.0}{:>16}",
            structure.name,
            1e3 * structure.seconds,
            each(1e9 * structure.seconds),
            bytes.unwrap_or("-".to_string())
        );
    }
    table(result, "ns a ray", |kind, method| {
        Some(format!("{:.1}", 1e9 * method.median_seconds()? / kind.rays as f64))
    });
    for (event, name) in EVENTS.iter().enumerate() {
        table(result, &format!("{name} a ray"), |kind, method| {
            Some(format!("{:.1}", method.median_event(event)? / kind.rays as f64))
        });
    }
    table(result, "answers unlike ours", |_, method| {
        (method.differing > 0).then(|| method.differing.to_string())
    });
    visits(result, "nodes or bundles", |counts| counts.steps);
    visits(result, "leaf blocks", |counts| counts.blocks);
    visits(result, "t in f64", |counts| counts.intervals);
    visits(result, "decisions in integers", |counts| counts.exact + counts.roundings);
    print!("  {:<36}", "(rays that hit, %)");
    result.kinds.iter().for_each(|kind| print!("{:>11.1}", 100.0 * kind.hit_share));
    println!("\n");
}

/// What our BVH did for a ray of each kind.
fn visits(result: &SceneResult, what: &str, count: fn(&Counts) -> u64) {
    print!("  {:<36}", format!("(bvh: {what} a ray)"));
    for kind in &result.kinds {
        print!("{:>11.3}", count(&kind.visits) as f64 / kind.rays.max(1) as f64);
    }
    println!();
}

/// A row for each method, a column for each kind; rows and tables without any value are left out.
fn table(
    result: &SceneResult,
    title: &str,
    value: impl Fn(&KindResult, &MethodResult) -> Option<String>,
) {
    let row = |i: usize| -> Vec<Option<String>> {
        result.kinds.iter().map(|kind| value(kind, &kind.methods[i])).collect()
    };
    let rows: Vec<_> = (0..result.subjects.len())
        .map(|i| (&result.subjects[i].0, row(i)))
        .filter(|(_, row)| row.iter().any(Option::is_some))
        .collect();
    if rows.is_empty() {
        return;
    }
    print!("  {title:<36}");
    result.kinds.iter().for_each(|kind| print!("{:>11}", kind.kind.name()));
    println!();
    for (name, row) in rows {
        print!("  {name:<36}");
        row.iter().for_each(|cell| print!("{:>11}", cell.as_deref().unwrap_or("-")));
        println!();
    }
}

/// How building and tracing grow with the scene: a row for each size and method.
pub fn growth(results: &[SceneResult]) {
    println!("GROWTH");
    print!("  {:>10}  {:<20}{:>12}{:>12}", "triangles", "method", "build ns", "bytes");
    let kinds = results.first().map_or(&[][..], |first| &first.kinds);
    kinds.iter().for_each(|kind| print!("{:>11}", kind.kind.name()));
    println!();
    for result in results {
        let each = |x: f64| x / result.count.max(1) as f64;
        for structure in &result.structures {
            let bytes = structure.bytes.map(|bytes| format!("{:.1}", each(bytes as f64)));
            print!(
                "  {:>10}  {:<20}{:>12.0}{:>12}",
                result.count,
                structure.name,
                each(1e9 * structure.seconds),
                bytes.unwrap_or("-".to_string())
            );
            let subject = result.subjects.iter().position(|(name, _)| *name == structure.name);
            for kind in &result.kinds {
                let seconds = subject.and_then(|i| kind.methods[i].median_seconds());
                let ns = seconds.map(|s| format!("{:.1}", 1e9 * s / kind.rays as f64));
                print!("{:>11}", ns.as_deref().unwrap_or("-"));
            }
            println!();
        }
    }
    println!();
}

/// Every number: a line for each scene, kind of ray, method and run, with builds as a kind.
pub fn csv(results: &[SceneResult], file: &Path) -> Result<()> {
    let mut out = csv::Writer::from_path(file)?;
    let mut head = vec!["scene", "triangles", "kind", "method", "run", "count", "seconds", "bytes"];
    head.push("differing");
    head.extend(EVENTS);
    out.write_record(&head)?;
    for result in results {
        let triangles = result.count.to_string();
        for structure in &result.structures {
            let bytes = structure.bytes.map_or(String::new(), |bytes| bytes.to_string());
            let seconds = structure.seconds.to_string();
            let mut line = [&result.name, &triangles, "build", &structure.name, "0", &triangles]
                .map(str::to_string)
                .to_vec();
            line.extend([seconds, bytes]);
            line.resize(head.len(), String::new());
            out.write_record(&line)?;
        }
        for kind in &result.kinds {
            for ((name, _), method) in result.subjects.iter().zip(&kind.methods) {
                for (run, cost) in method.runs.iter().enumerate() {
                    let mut line = vec![
                        result.name.clone(),
                        triangles.clone(),
                        kind.kind.name().to_string(),
                        name.clone(),
                        run.to_string(),
                        kind.rays.to_string(),
                        cost.seconds.to_string(),
                        String::new(),
                        method.differing.to_string(),
                    ];
                    line.extend(cost.events.iter().flatten().map(f64::to_string));
                    line.resize(head.len(), String::new());
                    out.write_record(&line)?;
                }
            }
        }
    }
    out.flush()?;
    Ok(())
}
