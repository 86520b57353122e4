//! Baldwin and Weber's test: a map, made once, to where the triangle is the unit one.

use glam::Vec3;
use raykern::Ray;

use super::{TriangleTest, within};

/// Three rows of four: what gives `u`, `v` and the height over the plane. All zero for a triangle without area.
#[derive(Debug)]
pub struct BaldwinWeber([[f32; 4]; 3]);

impl TriangleTest for BaldwinWeber {
    type Line = ([f32; 3], [f32; 3]);

    fn new(corners: [[f32; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(Vec3::from);
        let (e1, e2) = (b - a, c - a);
        let n = e1.cross(e2);
        // The axis along which the normal is longest becomes the height, the two after it u and v.
        let size = n.abs();
        let k = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        if n[k] == 0.0 {
            return BaldwinWeber([[0.0; 4]; 3]);
        }
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let mut rows = [[0.0; 4]; 3];
        rows[0][i] = e2[j] / n[k];
        rows[0][j] = -e2[i] / n[k];
        rows[0][3] = (c[i] * a[j] - c[j] * a[i]) / n[k];
        rows[1][i] = -e1[j] / n[k];
        rows[1][j] = e1[i] / n[k];
        rows[1][3] = -(b[i] * a[j] - b[j] * a[i]) / n[k];
        rows[2][k] = 1.0;
        rows[2][i] = n[i] / n[k];
        rows[2][j] = n[j] / n[k];
        rows[2][3] = -n.dot(a) / n[k];
        BaldwinWeber(rows)
    }

    fn line(ray: &Ray) -> Self::Line {
        (ray.origin, ray.direction)
    }

    fn meet(&self, (origin, direction): &Self::Line, t_min: f32, t_max: f32) -> Option<f32> {
        let [u_row, v_row, height] = &self.0;
        let start = dot(height, origin) + height[3];
        let speed = dot(height, direction);
        let t = within(-start / speed, t_min, t_max)?;
        let at: [f32; 3] = std::array::from_fn(|k| origin[k] + t * direction[k]);
        let u = dot(u_row, &at) + u_row[3];
        let v = dot(v_row, &at) + v_row[3];
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(t)
    }
}

fn dot(row: &[f32; 4], point: &[f32; 3]) -> f32 {
    row[0] * point[0] + row[1] * point[1] + row[2] * point[2]
}
