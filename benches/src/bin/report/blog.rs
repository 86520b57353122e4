//! The comparison as the blog post made it: each structure renders a picture ten times, one structure after the other; the mean
//! of ten with Student's interval.

use std::time::Instant;

use anyhow::Result;
use raykern::{Accel, BuildOptions, GridKind, GridOptions, OwnedAccel};
use raykern_harness::render::{Job, RenderScene, render};
use raykern_harness::scenes;

use crate::options::Options;
use crate::rows::{self, Run};

/// What these runs are called.
pub const FAMILY: &str = "blog";
/// The post's grid, ours, and the BVH.
pub const STRUCTURES: [&str; 3] = ["plain grid", "nested grid", "BVH"];
const RUNS: usize = 10;
/// Pixels of each picture.
const PIXELS: usize = 4_000;
/// A run stops here: it is extrapolated.
const LONGEST: std::time::Duration = std::time::Duration::from_secs(1);

/// Renders every scene of the post, or what stands for it.
pub fn measure(options: &Options) -> Result<()> {
    let mut runs = Vec::new();
    let scenes = scenes::ALL.iter().take(if options.quick { 2 } else { scenes::ALL.len() });
    for (name, make) in scenes {
        eprintln!("  {name}");
        let scene = make();
        for structure in STRUCTURES {
            let accel = scene.model.build(|s| build(structure, s))?;
            for run in 0..RUNS {
                runs.push(timed(name, structure, run, &scene, &accel.accel()));
            }
        }
    }
    rows::replace(options.data(), runs, |row: &Run| row.family == FAMILY)
}

fn build<'c>(
    structure: &str,
    scene: &raykern::Scene<'_, 'c>,
) -> Result<OwnedAccel<'c>, raykern::BuildError> {
    let kind = if structure == "plain grid" { GridKind::Uniform } else { GridKind::Nested };
    let grid = GridOptions { kind, ..GridOptions::default() };
    let options = BuildOptions { grid, ..BuildOptions::default() };
    match structure {
        "BVH" => OwnedAccel::bvh(scene, &options),
        _ => OwnedAccel::grid(scene, &options),
    }
}

fn timed(name: &str, structure: &str, run: usize, scene: &RenderScene, accel: &Accel) -> Run {
    let camera = &scene.cameras[0];
    // Evenly spread: every so many-th pixel.
    let step = (camera.pixel_count() / PIXELS).max(1);
    let pixels: Vec<u32> = (0..camera.pixel_count() as u32).step_by(step).collect();
    let deadline = Some(Instant::now() + LONGEST);
    let job = Job { camera, pixels: Some(&pixels), deadline, progress: None };
    let rendering = render(scene, accel, &job);
    Run {
        family: FAMILY.to_owned(),
        scene: name.to_owned(),
        kind: "picture".to_owned(),
        method: structure.to_owned(),
        run,
        rays: rendering.rays.total() as usize,
        seconds: rendering.time.as_secs_f64(),
    }
}
