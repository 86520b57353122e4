//! Woop, Benthin and Wald's test: the triangle sheared so that the ray is the axis z.

use raykern::Ray;

use super::{TriangleTest, within};

/// The corners, as they are.
#[derive(Debug)]
pub struct WoopBenthinWald([[f32; 3]; 3]);

/// The axes with the longest of the direction last, in an order that keeps the winding, and the shear.
#[derive(Debug)]
pub struct Sheared {
    origin: [f32; 3],
    axes: [usize; 3],
    shear: [f32; 3],
}

impl TriangleTest for WoopBenthinWald {
    type Line = Sheared;

    fn new(corners: [[f32; 3]; 3]) -> Self {
        WoopBenthinWald(corners)
    }

    fn line(ray: &Ray) -> Sheared {
        let d = ray.direction;
        let z = (0..3).fold(0, |best, k| if d[k].abs() > d[best].abs() { k } else { best });
        let [mut x, mut y] = [(z + 1) % 3, (z + 2) % 3];
        if d[z] < 0.0 {
            (x, y) = (y, x);
        }
        Sheared {
            origin: ray.origin,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
        }
    }

    fn meet(&self, line: &Sheared, t_min: f32, t_max: f32) -> Option<f32> {
        let ([x, y, z], [sx, sy, sz]) = (line.axes, line.shear);
        let [a, b, c] = self.0.map(|corner| {
            let from: [f32; 3] = std::array::from_fn(|k| corner[k] - line.origin[k]);
            [from[x] - sx * from[z], from[y] - sy * from[z], from[z]]
        });
        let [u, v, w] = edges(a, b, c);
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let depth = u * (sz * a[2]) + v * (sz * b[2]) + w * (sz * c[2]);
        within(depth / determinant, t_min, t_max)
    }
}

/// The edge functions; in `f64` where one of them vanishes, as the paper does it.
fn edges(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> [f32; 3] {
    let pairs = [[c, b], [a, c], [b, a]];
    let quick = pairs.map(|[p, q]| p[0] * q[1] - p[1] * q[0]);
    if quick.iter().all(|e| *e != 0.0) {
        return quick;
    }
    pairs.map(|[p, q]| {
        let [p, q] = [p, q].map(|point| point.map(f64::from));
        (p[0] * q[1] - p[1] * q[0]) as f32
    })
}
