//! Heat maps: what the ray of each pixel costs.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use glam::DVec3;
use raykern::{Accel, Counts, QueryOptions};
use raykern_harness::render::{Camera, Image};

/// A map is this many pixels wide at most: a plain grid may take a millisecond for one.
const WIDTH: f64 = 320.0;
/// What is brightest: this many steps or tests, or more.
const BRIGHTEST: f64 = 4096.0;

/// Two maps of one structure.
pub struct Maps {
    steps: Image,
    tests: Image,
}

/// Counts what the camera's rays do, one for each pixel of a small picture; `None` if there was no time for all.
pub fn maps(accel: &Accel, camera: &Camera, deadline: Instant) -> Result<Option<Maps>> {
    let [width, _] = camera.resolution.map(f64::from);
    let factor = (WIDTH / width).min(1.0);
    let size = camera.resolution.map(|n| (f64::from(n) * factor).round().max(1.0) as u32);
    let camera = camera.with_resolution(size)?;
    let mut maps = Maps { steps: Image::black(size), tests: Image::black(size) };
    for pixel in 0..camera.pixel_count() {
        if Instant::now() > deadline {
            return Ok(None);
        }
        let [x, y] = maps.steps.position(pixel);
        let mut counts = Counts::default();
        accel.intersect_counted(&camera.ray(x, y), &QueryOptions::default(), &mut counts);
        maps.steps.set(pixel, color(counts.steps));
        maps.tests.set(pixel, color(counts.tests));
    }
    Ok(Some(maps))
}

impl Maps {
    /// Writes both beside each other, by the name of scene and structure.
    pub fn write(&self, folder: &Path, name: &str) -> Result<()> {
        self.steps.write_png(&folder.join(format!("{name}_steps.png")))?;
        Ok(self.tests.write_png(&folder.join(format!("{name}_tests.png")))?)
    }
}

/// Black for nothing, then blue, red, yellow and white, on a logarithmic scale that is the same for all maps.
fn color(count: u64) -> DVec3 {
    let heat = 4.0 * (1.0 + count as f64).log2() / (1.0 + BRIGHTEST).log2();
    let part = |from: f64| (heat - from).clamp(0.0, 1.0);
    let blue = (part(0.0) - part(1.0)).max(part(3.0));
    255.0 * DVec3::new(part(1.0), part(2.0), blue)
}
