//! Measures one scene: builds, a pilot, rounds in which the structures take turns, and counts.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use raykern::{Counts, Info, OwnedAccel};
use raykern_harness::render::{Camera, Counting, Image, Job, RenderScene, Rendering, render};
use raykern_harness::stats::Summary;

use crate::heat;
use crate::options::{Options, Structure};
use crate::plan::{Plan, plan, scattered};
use crate::subjects::Subject;

/// All that was learnt about a scene.
pub struct Measured {
    /// The scene's name.
    pub name: String,
    /// Its file.
    pub origin: String,
    /// Triangles that are stored: once, however often they are seen.
    pub triangles: usize,
    /// Spheres, likewise.
    pub spheres: usize,
    /// The places where they are seen besides.
    pub instances: usize,
    /// Width and height.
    pub resolution: [u32; 2],
    /// In the order of the options.
    pub structures: Vec<MeasuredStructure>,
    /// Pixels rendered by two structures in the same round, and how many of them differ.
    pub compared: (usize, usize),
    /// What was shortened or stopped.
    pub notes: Vec<String>,
}

/// What was learnt about one structure over it.
pub struct MeasuredStructure {
    /// Which.
    pub structure: Structure,
    /// Seconds of each build.
    pub builds: Vec<f64>,
    /// Sizes.
    pub info: Info,
    /// One a round.
    pub runs: Vec<Run>,
    /// What queries did, over a sample of pixels.
    pub counts: Counts,
    /// The rays of that sample.
    pub counted_rays: u64,
}

/// One timed rendering.
#[derive(Clone, Copy)]
pub struct Run {
    /// How many pixels it got done.
    pub pixels: usize,
    /// How many rays that took.
    pub rays: u64,
    /// How long it took.
    pub seconds: f64,
    /// How long the whole picture takes at that rate.
    pub whole_seconds: f64,
}

impl MeasuredStructure {
    /// The seconds for a whole picture.
    pub fn summary(&self) -> Option<Summary> {
        Summary::of(&self.whole_seconds())
    }

    /// The seconds for a whole picture, by round.
    pub fn whole_seconds(&self) -> Vec<f64> {
        self.runs.iter().map(|run| run.whole_seconds).collect()
    }

    /// Rays answered per second, shading included.
    pub fn rays_per_second(&self) -> f64 {
        let rays: u64 = self.runs.iter().map(|run| run.rays).sum();
        rays as f64 / self.runs.iter().map(|run| run.seconds).sum::<f64>()
    }
}

/// However late it is, a run may take this long.
const LEAST_RUN: Duration = Duration::from_secs(2);

/// A scene with its structures, ready to be measured.
struct Bench<'a> {
    scene: &'a RenderScene,
    camera: &'a Camera,
    built: &'a [OwnedAccel<'a>],
    order: Vec<u32>,
    bar: ProgressBar,
}

/// Measures `subject` until about `deadline` and writes its pictures to the chosen folder.
pub fn scene(subject: &Subject, options: &Options, deadline: Instant) -> Result<Measured> {
    let bar = progress_bar(&subject.name);
    bar.set_message("loading");
    let scene = subject.load()?;
    let own = &scene.cameras[0];
    let camera = own.with_resolution(options.size.of(own.resolution)).context("--size")?;
    let mut structures = Vec::new();
    let mut built = Vec::new();
    for &structure in &options.structure {
        bar.set_message(format!("building {}", structure.name()));
        let (accel, builds) = build(&scene, structure, options.runs)?;
        let info = accel.accel().info();
        let (runs, counts) = (Vec::new(), Counts::default());
        structures.push(MeasuredStructure {
            structure,
            builds,
            info,
            runs,
            counts,
            counted_rays: 0,
        });
        built.push(accel);
    }
    let order = scattered(camera.pixel_count());
    let bench = Bench { scene: &scene, camera: &camera, built: &built, order, bar };
    let mut measured = Measured {
        name: subject.name.clone(),
        origin: subject.origin(),
        triangles: scene.model.triangle_count(),
        spheres: scene.model.sphere_count(),
        instances: scene.model.places.len(),
        resolution: camera.resolution,
        structures,
        compared: (0, 0),
        notes: Vec::new(),
    };
    bench.count(&mut measured, deadline);
    bench.heat(&mut measured, deadline, &options.out)?;
    let plan = bench.pilot(options.runs, deadline);
    bench.rounds(&plan, &mut measured, deadline, &options.out)?;
    measured.note_plan(&plan, options.runs);
    Ok(measured)
}

/// Builds once, and again while that costs little, for the time it takes.
fn build(
    scene: &RenderScene,
    structure: Structure,
    runs: u32,
) -> Result<(OwnedAccel<'static>, Vec<f64>)> {
    let once = || {
        let start = Instant::now();
        let accel = scene.model.build(|s| structure.build(s));
        accel.map(|accel| (accel, start.elapsed().as_secs_f64()))
    };
    let (mut accel, first) =
        once().with_context(|| format!("building the {}", structure.name()))?;
    let mut builds = vec![first];
    while builds.len() < runs as usize && builds.iter().sum::<f64>() + first < 2.0 {
        let (again, seconds) = once()?;
        accel = again;
        builds.push(seconds);
    }
    Ok((accel, builds))
}

impl Bench<'_> {
    /// What queries do, on a sample of pixels: a pass of its own, since counting costs time.
    fn count(&self, measured: &mut Measured, deadline: Instant) {
        let limit = (deadline.saturating_duration_since(Instant::now()) / 20)
            .clamp(Duration::from_millis(100), Duration::from_secs(4));
        let sample = &self.order[..self.order.len().min(20_000)];
        for (accel, result) in self.built.iter().zip(&mut measured.structures) {
            self.bar.set_message(format!("counting {}", result.structure.name()));
            let counting = Counting::new(accel.accel());
            let job = self.job(Some(sample), Instant::now() + limit, None);
            let rendering = render(self.scene, &counting, &job);
            result.counts = counting.counts();
            result.counted_rays = rendering.rays.total();
        }
    }

    /// Heat maps of each structure, as far as there is time.
    fn heat(&self, measured: &mut Measured, deadline: Instant, out: &Path) -> Result<()> {
        for (accel, result) in self.built.iter().zip(&measured.structures) {
            self.bar.set_message(format!("heat map of {}", result.structure.name()));
            let limit = (deadline.saturating_duration_since(Instant::now()) / 20)
                .clamp(Duration::from_millis(500), Duration::from_secs(10));
            match heat::maps(&accel.accel(), self.camera, Instant::now() + limit)? {
                Some(maps) => {
                    maps.write(out, &format!("{}_{}", measured.name, result.structure.name()))?;
                }
                None => measured.notes.push(format!("{}: no heat map", result.structure.name())),
            }
        }
        Ok(())
    }

    /// Renders with each structure for a second at most, and plans by the rate.
    fn pilot(&self, runs: u32, deadline: Instant) -> Plan {
        let limit = Duration::from_secs(1);
        let seconds: Vec<f64> = (self.built.iter())
            .map(|accel| {
                self.bar.set_message("pilot");
                let job = self.job(Some(&self.order), Instant::now() + limit, None);
                let rendering = render(self.scene, &accel.accel(), &job);
                self.whole(&rendering)
            })
            .collect();
        // A tenth is kept for pictures and for rates that the pilot judged too well.
        let share = 0.9 * deadline.saturating_duration_since(Instant::now()).as_secs_f64();
        plan(&seconds, self.camera.pixel_count(), runs, share)
    }

    /// Measures as planned. Past the deadline there are no more rounds, but for the second one,
    /// without which there is no interval.
    fn rounds(
        &self,
        plan: &Plan,
        measured: &mut Measured,
        deadline: Instant,
        out: &Path,
    ) -> Result<()> {
        let count = self.built.len();
        let in_round: usize = plan.pixels.iter().map(|p| p.unwrap_or(self.order.len())).sum();
        self.bar.set_length((in_round * plan.rounds) as u64);
        self.bar.set_position(0);
        for round in 0..plan.rounds {
            if round >= 2 && Instant::now() > deadline {
                let problem = format!("stopped after {round} of {} planned runs", plan.rounds);
                measured.notes.push(problem);
                break;
            }
            let mut renderings: Vec<Option<(Rendering, Option<Vec<u32>>)>> = vec![None; count];
            for turn in 0..count {
                // Who goes first changes from round to round.
                let i = (turn + round) % count;
                let structure = measured.structures[i].structure;
                self.bar.set_message(format!("{} {}/{}", structure.name(), round + 1, plan.rounds));
                let sample = plan.pixels[i].map(|size| self.sample(round, size));
                let limit = deadline.max(Instant::now() + LEAST_RUN);
                let rendering = self.timed(i, sample.as_deref(), limit);
                if !rendering.finished {
                    measured.notes.push(format!(
                        "{}: run {} stopped at the time limit after {} pixels and {} rays",
                        structure.name(),
                        round + 1,
                        rendering.pixels_done,
                        rendering.rays.total()
                    ));
                }
                measured.structures[i].runs.push(Run {
                    pixels: rendering.pixels_done,
                    rays: rendering.rays.total(),
                    seconds: rendering.time.as_secs_f64(),
                    whole_seconds: self.whole(&rendering),
                });
                if round == 0 && sample.is_none() && rendering.finished {
                    let name = format!("{}_{}.png", measured.name, structure.name());
                    rendering.image.write_png(&out.join(name))?;
                }
                renderings[i] = Some((rendering, sample));
            }
            let renderings: Vec<_> = renderings.into_iter().flatten().collect();
            measured.compare(&renderings);
        }
        self.bar.finish_and_clear();
        Ok(())
    }

    fn timed(&self, i: usize, sample: Option<&[u32]>, limit: Instant) -> Rendering {
        let progress = |pixels| self.bar.inc(pixels);
        render(self.scene, &self.built[i].accel(), &self.job(sample, limit, Some(&progress)))
    }

    /// The sample of a round: the rounds go through the scattered order one after the other.
    fn sample(&self, round: usize, size: usize) -> Vec<u32> {
        let pixels = self.order.iter().cycle().skip(round * size % self.order.len());
        pixels.take(size).copied().collect()
    }

    fn whole(&self, rendering: &Rendering) -> f64 {
        let share = rendering.pixels_done as f64 / self.camera.pixel_count() as f64;
        rendering.time.as_secs_f64() / share
    }

    fn job<'b>(
        &'b self,
        pixels: Option<&'b [u32]>,
        deadline: Instant,
        progress: Option<&'b dyn Fn(u64)>,
    ) -> Job<'b> {
        Job { camera: self.camera, pixels, deadline: Some(deadline), progress }
    }
}

impl Measured {
    /// Compares the renderings of a round with the first one that is whole; without a whole one,
    /// with the first one, as far as both went through the same pixels.
    fn compare(&mut self, renderings: &[(Rendering, Option<Vec<u32>>)]) {
        let is_whole = |(r, sample): &(Rendering, Option<Vec<u32>>)| sample.is_none() && r.finished;
        let whole = renderings.iter().position(is_whole);
        let (base, base_sample) = &renderings[whole.unwrap_or(0)];
        for (i, (rendering, sample)) in renderings.iter().enumerate() {
            let done = match whole {
                Some(_) => rendering.pixels_done,
                None if sample == base_sample => rendering.pixels_done.min(base.pixels_done),
                None => 0,
            };
            if i != whole.unwrap_or(0) {
                self.compared.0 += done;
                self.compared.1 +=
                    differing(&base.image, &rendering.image, sample.as_deref(), done);
            }
        }
    }

    fn note_plan(&mut self, plan: &Plan, wanted: u32) {
        if plan.rounds < wanted as usize {
            self.notes.push(format!("{} runs, not {wanted}, to keep the budget", plan.rounds));
        }
        let total = self.resolution[0] as usize * self.resolution[1] as usize;
        for (result, pixels) in self.structures.iter().zip(&plan.pixels) {
            let Some(pixels) = pixels else { continue };
            let rays: u64 = result.runs.iter().map(|run| run.rays).sum();
            self.notes.push(format!(
                "{}: each run rendered another {pixels} of {total} pixels, spread evenly ({rays} rays \
                 in all); its times are extrapolated to the whole picture",
                result.structure.name()
            ));
        }
    }
}

/// How many of the first `done` pixels, of `sample` or in order, differ.
fn differing(a: &Image, b: &Image, sample: Option<&[u32]>, done: usize) -> usize {
    let pixel = |k: usize| sample.map_or(k, |list| list[k] as usize);
    (0..done).map(pixel).filter(|&p| a.pixels[p] != b.pixels[p]).count()
}

/// A bar on the terminal; nothing where there is none.
fn progress_bar(name: &str) -> ProgressBar {
    let bar = ProgressBar::new(0).with_prefix(name.to_owned());
    let style = ProgressStyle::with_template("{prefix:20} {bar:30} {percent:>3} %  {msg} ({eta})");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}
