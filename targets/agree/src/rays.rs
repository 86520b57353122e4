//! Rays of every sort: ordinary ones, through vertices and along edges, along axes, and at the ends of the floats.

use raykern::Ray;

/// Ray `i` for a scene.
pub fn ray(shape: u32, i: u32) -> Ray {
    let mut random = Random(i.wrapping_mul(0x9E37_79B1) ^ shape.wrapping_mul(0x85EB_CA77) ^ 1);
    let centre = if shape == 2 { [1000.0, 0.0, 0.0] } else { [0.0; 3] };
    let from = [0, 1, 2].map(|k| centre[k] + random.whole(12) + random.part());
    // Every second ray starts and ends on the lattice.
    let from = if i.is_multiple_of(2) { from.map(|x| x as i32 as f32) } else { from };
    let to = [0, 1, 2].map(|k| centre[k] + random.whole(5));
    let ahead = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    let ahead = if i.is_multiple_of(2) { ahead } else { ahead.map(|x| x + 0.25 * random.part()) };
    let ray = Ray::new(from, ahead);
    match i % 16 {
        5 => Ray::new(from, [0.0, 0.0, if from[2] > 0.0 { -1.0 } else { 1.0 }]),
        6 => Ray::new(from, ahead.map(|x| x * 1e-30)),
        7 => Ray::new(from.map(|x| x * 1e20), ahead.map(|x| x * -1e20)),
        8 => ray.with_limits(0.5, 1.0),
        9 => ray.with_limits(-2.0, f32::INFINITY),
        10 => Ray::new(from, [ahead[0], 0.0, -0.0]),
        _ => ray,
    }
}

/// The ray the other way.
pub fn turned(ray: &Ray) -> Ray {
    Ray { direction: ray.direction.map(|x| -x), ..*ray }
}

struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0 >> 8
    }

    /// A whole number from `-most` to `most`.
    fn whole(&mut self, most: u32) -> f32 {
        (self.next() % (2 * most + 1)) as f32 - most as f32
    }

    /// Between 0 and 1.
    fn part(&mut self) -> f32 {
        self.next() as f32 / 16_777_216.0
    }
}
