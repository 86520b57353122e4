//! What is printed and written: tables, CSV files, a chart.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use raykern_harness::chart::{Chart, Series};
use raykern_harness::stats::{Ratio, Summary};

use crate::measure::{Measured, MeasuredStructure};
use crate::options::{Options, Structure};

/// Everything measured so far, and where it goes.
pub struct Report {
    folder: PathBuf,
    scenes: Vec<Measured>,
}

/// What a reader of the tables must know first.
pub fn preamble(options: &Options, folder: Option<&Path>) -> String {
    let scenes = match folder {
        _ if !options.scene.is_empty() => "the scenes asked for".to_owned(),
        Some(folder) => format!("the blog post's scenes, from {}", folder.display()),
        None => "built-in scenes (no folder of collected scenes is at hand)".to_owned(),
    };
    format!(
        "raykern: {scenes}; one thread, {} runs, about {} s.\n\
         Times are seconds for a whole picture, shading included: min, max, mean ± 95 % confidence \
         (Student's t).\n\
         `~` marks times extrapolated from a sample of the pixels.\n",
        options.runs, options.budget
    )
}

impl Report {
    /// Makes the folder, and finds out now whether it can be written to.
    pub fn create(folder: &Path) -> Result<Self> {
        let cannot = || format!("--out {}: cannot be written to", folder.display());
        std::fs::create_dir_all(folder).with_context(cannot)?;
        let report = Report { folder: folder.to_owned(), scenes: Vec::new() };
        report.write_tables().with_context(cannot)?;
        Ok(report)
    }

    /// Prints a scene's table and writes all tables anew.
    pub fn add(&mut self, measured: Measured) -> Result<()> {
        print_scene(&measured);
        self.scenes.push(measured);
        self.write_tables()
    }

    /// Prints the table of all scenes and draws the chart.
    pub fn finish(&self, elapsed: Duration) -> Result<()> {
        self.print_all();
        self.chart().write(&self.folder.join("times.svg")).map_err(|e| anyhow!(e))?;
        println!(
            "\n{:.0} s in all. Pictures, heat maps, summary.csv, runs.csv and times.svg are in {}.",
            elapsed.as_secs_f64(),
            self.folder.display()
        );
        Ok(())
    }

    fn print_all(&self) {
        let kinds = self.kinds();
        let heads: Vec<_> =
            kinds.iter().map(|s| format!("{:>22}", format!("{}, s", s.name()))).collect();
        println!("{:20} {}   grid / bvh (95 %)", "scene", heads.join(" "));
        for scene in &self.scenes {
            let cell = |s: &Structure| scene.result(*s).map(|r| scene.mean(r)).unwrap_or_default();
            let cells: Vec<_> = kinds.iter().map(|s| format!("{:>22}", cell(s))).collect();
            let ratio = scene.ratio(Structure::Grid).map(ratio_text).unwrap_or_default();
            println!("{:20} {}   {ratio}", scene.name, cells.join(" "));
        }
    }

    /// The structures that were measured, in the order in which they were.
    fn kinds(&self) -> Vec<Structure> {
        let mut kinds = Vec::new();
        for result in self.scenes.iter().flat_map(|scene| &scene.structures) {
            if !kinds.contains(&result.structure) {
                kinds.push(result.structure);
            }
        }
        kinds
    }

    fn write_tables(&self) -> Result<()> {
        let mut summary = csv::Writer::from_path(self.folder.join("summary.csv"))?;
        summary.write_record([
            "scene",
            "file",
            "structure",
            "triangles",
            "spheres",
            "width",
            "height",
            "runs",
            "sampled",
            "min_s",
            "max_s",
            "mean_s",
            "half_width_95_s",
            "ratio_to_bvh",
            "ratio_low",
            "ratio_high",
            "build_min_s",
            "build_mean_s",
            "bytes",
            "bytes_per_prim",
            "rays_per_s",
            "steps_per_ray",
            "blocks_per_ray",
            "tests_per_ray",
            "compared_pixels",
            "differing_pixels",
        ])?;
        let mut runs = csv::Writer::from_path(self.folder.join("runs.csv"))?;
        runs.write_record(["scene", "structure", "run", "pixels", "rays", "seconds", "whole_s"])?;
        for scene in &self.scenes {
            for result in &scene.structures {
                summary.write_record(summary_record(scene, result))?;
                for (number, run) in result.runs.iter().enumerate() {
                    runs.write_record([
                        scene.name.clone(),
                        result.structure.name().to_owned(),
                        (number + 1).to_string(),
                        run.pixels.to_string(),
                        run.rays.to_string(),
                        run.seconds.to_string(),
                        run.whole_seconds.to_string(),
                    ])?;
                }
            }
        }
        summary.flush()?;
        runs.flush()?;
        Ok(())
    }

    fn chart(&self) -> Chart {
        let values = |s| {
            self.scenes.iter().map(|c| c.result(s).and_then(MeasuredStructure::summary)).collect()
        };
        Chart {
            title: "Rendering time by structure".into(),
            subtitle: "Thick: 95 % confidence of the mean. Thin: least to greatest. ~ is \
                       extrapolated from a sample of the pixels."
                .into(),
            axis: "seconds for one picture on one thread (logarithmic)".into(),
            rows: self.scenes.iter().map(Measured::label).collect(),
            series: (self.kinds().into_iter())
                .map(|s| Series { name: s.name().into(), values: values(s) })
                .collect(),
        }
    }
}

impl Measured {
    fn result(&self, structure: Structure) -> Option<&MeasuredStructure> {
        self.structures.iter().find(|result| result.structure == structure)
    }

    /// How many times longer `structure` takes than the BVH.
    fn ratio(&self, structure: Structure) -> Option<Ratio> {
        let [above, below] = [self.result(structure)?, self.result(Structure::Bvh)?];
        Ratio::paired(&above.whole_seconds(), &below.whole_seconds())
    }

    fn is_sampled(&self, result: &MeasuredStructure) -> bool {
        let whole = self.resolution[0] as usize * self.resolution[1] as usize;
        result.runs.iter().any(|run| run.pixels < whole)
    }

    fn mean(&self, result: &MeasuredStructure) -> String {
        result.summary().map(|s| mean_of(&s, self.is_sampled(result))).unwrap_or_default()
    }

    /// The scene's name, marked when one of its times is extrapolated.
    fn label(&self) -> String {
        let sampled = self.structures.iter().any(|result| self.is_sampled(result));
        format!("{}{}", self.name, if sampled { " ~" } else { "" })
    }
}

fn print_scene(scene: &Measured) {
    let [width, height] = scene.resolution;
    println!(
        "{} ({}): {} triangles, {} spheres{}, {width} x {height}",
        scene.name,
        scene.origin,
        scene.triangles,
        scene.spheres,
        if scene.instances > 0 {
            format!(", {} instances", scene.instances)
        } else {
            String::new()
        }
    );
    println!(
        "  {:5} {:>9} {:>8} {:>8} {:>10} {:>10} {:>22} {:>8} {:>9} {:>8} {:>9}  to bvh (95 %)",
        "",
        "build s",
        "MB",
        "B/prim",
        "min s",
        "max s",
        "mean s",
        "Mray/s",
        "steps",
        "blocks",
        "tests"
    );
    for result in &scene.structures {
        let Some(summary) = result.summary() else { continue };
        let rays = result.counted_rays.max(1) as f64;
        let [steps, blocks, tests] =
            [result.counts.steps, result.counts.blocks, result.counts.tests]
                .map(|n| n as f64 / rays);
        let ratio = match result.structure {
            Structure::Bvh => String::new(),
            other => scene.ratio(other).map(ratio_text).unwrap_or_default(),
        };
        println!(
            "  {:5} {:>9} {:>8} {:>8.0} {:>10} {:>10} {:>22} {:>8} {:>9} {:>8} {:>9}  {ratio}",
            result.structure.name(),
            digits(least(&result.builds)),
            digits(result.info.size as f64 * 1e-6),
            bytes_per_prim(scene, result),
            digits(summary.min),
            digits(summary.max),
            mean_of(&summary, scene.is_sampled(result)),
            digits(result.rays_per_second() * 1e-6),
            digits(steps),
            digits(blocks),
            digits(tests),
        );
    }
    let (compared, differing) = scene.compared;
    if scene.structures.len() > 1 {
        println!("  pictures: {differing} of {compared} compared pixels differ");
    }
    scene.notes.iter().for_each(|note| println!("  shortened: {note}"));
    println!();
}

fn summary_record(scene: &Measured, result: &MeasuredStructure) -> Vec<String> {
    let summary = result.summary();
    let number = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let ratio = scene.ratio(result.structure);
    let interval = ratio.and_then(|r| r.interval);
    let rays = result.counted_rays.max(1) as f64;
    let builds = Summary::of(&result.builds);
    vec![
        scene.name.clone(),
        scene.origin.clone(),
        result.structure.name().to_owned(),
        scene.triangles.to_string(),
        scene.spheres.to_string(),
        scene.resolution[0].to_string(),
        scene.resolution[1].to_string(),
        result.runs.len().to_string(),
        scene.is_sampled(result).to_string(),
        number(summary.map(|s| s.min)),
        number(summary.map(|s| s.max)),
        number(summary.map(|s| s.mean)),
        number(summary.and_then(|s| s.half_width)),
        number(ratio.map(|r| r.mean)),
        number(interval.map(|i| i.0)),
        number(interval.map(|i| i.1)),
        number(builds.map(|b| b.min)),
        number(builds.map(|b| b.mean)),
        result.info.size.to_string(),
        bytes_per_prim(scene, result).to_string(),
        result.rays_per_second().to_string(),
        (result.counts.steps as f64 / rays).to_string(),
        (result.counts.blocks as f64 / rays).to_string(),
        (result.counts.tests as f64 / rays).to_string(),
        scene.compared.0.to_string(),
        scene.compared.1.to_string(),
    ]
}

fn bytes_per_prim(scene: &Measured, result: &MeasuredStructure) -> f64 {
    result.info.size as f64 / (scene.triangles + scene.spheres).max(1) as f64
}

fn mean_of(summary: &Summary, sampled: bool) -> String {
    let mark = if sampled { "~" } else { "" };
    let spread = summary.half_width.map(|half| format!(" ± {}", digits(half))).unwrap_or_default();
    format!("{mark}{}{spread}", digits(summary.mean))
}

fn ratio_text(ratio: Ratio) -> String {
    let interval =
        ratio.interval.map(|(low, high)| format!(" ({} to {})", digits(low), digits(high)));
    format!("{}{}", digits(ratio.mean), interval.unwrap_or_default())
}

fn least(list: &[f64]) -> f64 {
    list.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Three significant digits.
fn digits(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    match x.abs().log10().floor() as i32 {
        power @ -4..=2 => format!("{x:.*}", (2 - power) as usize),
        3..=6 => format!("{x:.0}"),
        _ => format!("{x:.2e}"),
    }
}
