//! A picture with a light and its shadows, or of what each pixel costs.

use raykern::{Accel, Counts, Hit, QueryOptions, Ray};

/// Where the picture is seen from, as the page writes it down.
#[repr(C)]
pub struct Camera {
    eye: [f32; 3],
    ahead: [f32; 3],
    right: [f32; 3],
    up: [f32; 3],
    light: [f32; 3],
    width: u32,
    height: u32,
    /// 1 for the costs.
    heat: u32,
}

impl Camera {
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The ray through the middle of a pixel.
    fn ray(&self, x: usize, y: usize) -> Ray {
        let s = (2 * x + 1) as f32 / self.width as f32 - 1.0;
        let t = 1.0 - (2 * y + 1) as f32 / self.height as f32;
        let ahead = [0, 1, 2].map(|k| self.ahead[k] + s * self.right[k] + t * self.up[k]);
        Ray::new(self.eye, ahead)
    }
}

/// What is to be seen.
pub struct Shown<'a> {
    pub accel: Accel<'a>,
    pub vertices: &'a [[f32; 3]],
    pub indices: &'a [[u32; 3]],
}

/// The colour where nothing is.
const SKY: [f32; 3] = [0.80, 0.87, 0.95];
/// So many steps and tests are red.
const HOT: f32 = 160.0;

impl Shown<'_> {
    /// Writes the pixels; returns the steps that all rays took.
    pub fn trace(&self, camera: &Camera, pixels: &mut [u32]) -> f64 {
        let mut steps = 0;
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let (x, y) = (i % camera.width.max(1) as usize, i / camera.width.max(1) as usize);
            let mut counts = Counts::default();
            let colour = self.colour(camera, &camera.ray(x, y), &mut counts);
            let cost = (counts.steps + counts.tests) as f32 / HOT;
            *pixel = rgba(if camera.heat == 1 { heat(cost) } else { colour });
            steps += counts.steps;
        }
        steps as f64
    }

    fn colour(&self, camera: &Camera, ray: &Ray, counts: &mut Counts) -> [f32; 3] {
        let everything = QueryOptions::default();
        let Some(hit) = self.accel.intersect_counted(ray, &everything, counts) else { return SKY };
        let normal = self.normal(&hit);
        let facing = if dot(normal, ray.direction) < 0.0 { 1.0 } else { -1.0 };
        // A little off the surface.
        let point = |k: usize| ray.origin[k] + hit.t * ray.direction[k] + 1e-4 * facing * normal[k];
        let from = [point(0), point(1), point(2)];
        let to_light = [0, 1, 2].map(|k| camera.light[k] - from[k]);
        let length = libm::sqrtf(dot(to_light, to_light));
        let bright = (facing * dot(normal, to_light) / length).max(0.0);
        let shadow = Ray::new(from, to_light).with_limits(0.0, 1.0);
        let dark = bright == 0.0 || self.accel.occluded_counted(&shadow, &everything, counts);
        let light = 0.25 + if dark { 0.0 } else { 0.75 * bright };
        let height = (from[1] + 1.0) / 3.0;
        [0.95 - 0.35 * height, 0.75, 0.50 + 0.30 * height].map(|part| part * light)
    }

    /// The unit normal of the triangle that is hit.
    fn normal(&self, hit: &Hit) -> [f32; 3] {
        let corners = self.indices.get(hit.prim as usize).copied().unwrap_or_default();
        let [a, b, c] = corners.map(|v| self.vertices.get(v as usize).copied().unwrap_or_default());
        let (p, q) = (minus(b, a), minus(c, a));
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let length = libm::sqrtf(dot(n, n));
        n.map(|x| x / length)
    }
}

fn minus(p: [f32; 3], q: [f32; 3]) -> [f32; 3] {
    [p[0] - q[0], p[1] - q[1], p[2] - q[2]]
}

fn dot(p: [f32; 3], q: [f32; 3]) -> f32 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

/// From blue over green to red.
fn heat(cost: f32) -> [f32; 3] {
    [3.0 * cost - 1.0, 1.0 - (2.0 * cost - 1.0) * (2.0 * cost - 1.0), 1.0 - 2.0 * cost]
}

/// As canvases have it, red in the lowest byte.
fn rgba(colour: [f32; 3]) -> u32 {
    let [r, g, b] = colour.map(|part| (255.0 * part.max(0.0).min(1.0)) as u32);
    0xFF00_0000 | b << 16 | g << 8 | r
}
