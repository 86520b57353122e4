//! Pictures: a deterministic ray tracer with one sample a pixel, on one thread.
//!
//! Works on any [`Tracer`], so that the same picture can be made by every structure. Rays leave
//! through pixel centres; colours are clamped and rounded. A rendering can be stopped at a
//! deadline, and can be limited to any list of pixels.

mod camera;
mod image;
mod scene;
mod shade;

use std::cell::Cell;
use std::time::{Duration, Instant};

use raykern::{Accel, Counts, Hit, PrimId, QueryOptions, Ray, Surface};

pub use self::camera::{Camera, CameraError};
pub use self::image::{Image, ImageError, read_png};
pub use self::scene::{Material, MaterialKind, PointLight, RenderScene, bounds};
pub use self::shade::Shader;

/// What answers rays.
pub trait Tracer {
    /// The closest hit of anything but `skip`.
    fn intersect(&self, ray: &Ray, skip: Option<PrimId>) -> Option<Hit>;
    /// Whether anything but `skip` is hit.
    fn occluded(&self, ray: &Ray, skip: Option<PrimId>) -> bool;
    /// The surface where the ray was found to hit.
    fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface>;
}

impl Tracer for Accel<'_> {
    fn intersect(&self, ray: &Ray, skip: Option<PrimId>) -> Option<Hit> {
        match skip {
            None => Accel::intersect(self, ray),
            Some(_) => self.intersect_with(ray, &all_but(skip)),
        }
    }

    fn occluded(&self, ray: &Ray, skip: Option<PrimId>) -> bool {
        match skip {
            None => Accel::occluded(self, ray),
            Some(_) => self.occluded_with(ray, &all_but(skip)),
        }
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        Accel::surface(self, ray, hit)
    }
}

fn all_but(skip: Option<PrimId>) -> QueryOptions {
    QueryOptions { skip, ..QueryOptions::default() }
}

/// An accel that adds up what its queries did.
pub struct Counting<'a> {
    accel: Accel<'a>,
    counts: Cell<Counts>,
}

impl<'a> Counting<'a> {
    /// Counts from zero.
    pub fn new(accel: Accel<'a>) -> Self {
        Counting { accel, counts: Cell::default() }
    }

    /// The sums so far.
    pub fn counts(&self) -> Counts {
        self.counts.get()
    }

    fn count<R>(&self, query: impl FnOnce(&mut Counts) -> R) -> R {
        let mut counts = self.counts.get();
        let answer = query(&mut counts);
        self.counts.set(counts);
        answer
    }
}

impl Tracer for Counting<'_> {
    fn intersect(&self, ray: &Ray, skip: Option<PrimId>) -> Option<Hit> {
        self.count(|counts| self.accel.intersect_counted(ray, &all_but(skip), counts))
    }

    fn occluded(&self, ray: &Ray, skip: Option<PrimId>) -> bool {
        self.count(|counts| self.accel.occluded_counted(ray, &all_but(skip), counts))
    }

    fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        self.accel.surface(ray, hit)
    }
}

/// How many rays were traced, by what they were for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera.
    pub primary: u64,
    /// Towards lights.
    pub shadow: u64,
    /// Mirrored and refracted.
    pub secondary: u64,
}

impl RayCounts {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.primary + self.shadow + self.secondary
    }
}

/// Which pixels to render, how long at most, and whom to tell.
pub struct Job<'a> {
    /// The camera; its resolution is the picture's.
    pub camera: &'a Camera,
    /// The pixels by number, row by row from the top; `None`: all of them.
    pub pixels: Option<&'a [u32]>,
    /// When to stop, finished or not.
    pub deadline: Option<Instant>,
    /// Called now and then with the number of pixels done since the last call.
    pub progress: Option<&'a dyn Fn(u64)>,
}

impl<'a> Job<'a> {
    /// The whole picture, without a limit.
    pub fn whole(camera: &'a Camera) -> Self {
        Job { camera, pixels: None, deadline: None, progress: None }
    }
}

/// What came of a [`Job`].
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture; pixels that were not rendered are black.
    pub image: Image,
    /// How many pixels were rendered, in the order of the job.
    pub pixels_done: usize,
    /// Whether that was all of them.
    pub finished: bool,
    /// The rays it took.
    pub rays: RayCounts,
    /// The time it took.
    pub time: Duration,
}

/// Renders `job`.
pub fn render(scene: &RenderScene, tracer: &impl Tracer, job: &Job) -> Rendering {
    let mut image = Image::black(job.camera.resolution);
    let mut shader = Shader::new(scene, tracer);
    let wanted = job.pixels.map_or(job.camera.pixel_count(), <[u32]>::len);
    let start = Instant::now();
    let mut done = 0;
    let mut batch = Batch::new(start);
    while done < wanted {
        let end = wanted.min(done + batch.size);
        for k in done..end {
            let pixel = job.pixels.map_or(k, |list| list[k] as usize);
            let [i, j] = image.position(pixel);
            image.set(pixel, shader.primary(&job.camera.ray(i, j)));
        }
        let now = batch.finished();
        if let Some(progress) = job.progress {
            progress((end - done) as u64);
        }
        done = end;
        if job.deadline.is_some_and(|deadline| now >= deadline) {
            break;
        }
    }
    Rendering {
        image,
        pixels_done: done,
        finished: done == wanted,
        rays: shader.rays,
        time: start.elapsed(),
    }
}

/// Whether the primary ray of each pixel hits anything, row by row from the top.
pub fn hit_mask(scene: &RenderScene, tracer: &impl Tracer, camera: &Camera) -> Vec<bool> {
    let shader = Shader::new(scene, tracer);
    let [width, height] = camera.resolution;
    let pixels = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
    let hits = |(i, j)| tracer.intersect(&shader.limited(&camera.ray(i, j)), None).is_some();
    pixels.map(hits).collect()
}

/// How many pixels to render between two looks at the clock: about a millisecond's worth, so that
/// looking costs nothing and a deadline is kept even when one pixel takes long.
struct Batch {
    size: usize,
    last: Instant,
}

impl Batch {
    fn new(start: Instant) -> Self {
        Batch { size: 1, last: start }
    }

    fn finished(&mut self) -> Instant {
        let now = Instant::now();
        if now - self.last < Duration::from_micros(500) {
            self.size = (self.size * 2).min(4096);
        } else if now - self.last > Duration::from_millis(2) {
            self.size = (self.size / 2).max(1);
        }
        self.last = now;
        now
    }
}
