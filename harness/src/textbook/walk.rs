//! Walks through the cells of a regular grid over the unit cube, after Amanatides and Woo, "A Fast Voxel Traversal Algorithm
//! for Ray Tracing", 1987: with the paper's sums, and with every wall's `t` from its number.

use raykern::Ray;

/// A cell by its numbers.
pub type Cell = [i32; 3];

/// How a walk finds the `t` of the next wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walls {
    /// As printed: the last one's and the time between two, added up.
    Summed,
    /// From the number of the wall.
    Numbered,
}

/// The cells of a grid with `side` of them along each axis that the ray visits, in `f32`.
pub fn visited(ray: &Ray, side: i32, walls: Walls) -> Vec<Cell> {
    let n = side as f32;
    let inverse = ray.direction.map(|d| 1.0 / d);
    let Some(enter) = entry(ray, inverse) else { return Vec::new() };
    let at: [f32; 3] = std::array::from_fn(|k| ray.origin[k] + enter * ray.direction[k]);
    let mut cell = at.map(|x| ((x * n) as i32).clamp(0, side - 1));
    let step = ray.direction.map(|d| if d < 0.0 { -1 } else { 1 });
    let wall = |k: usize, cell: Cell| {
        let number = cell[k] + i32::from(step[k] > 0);
        (number as f32 / n - ray.origin[k]) * inverse[k]
    };
    let mut next: [f32; 3] = std::array::from_fn(|k| wall(k, cell));
    let between = inverse.map(|i| (i / n).abs());
    let mut cells = Vec::new();
    while cell.iter().all(|c| (0..side).contains(c)) {
        cells.push(cell);
        let k = (0..3).fold(0, |best, k| if next[k] < next[best] { k } else { best });
        cell[k] += step[k];
        next[k] = match walls {
            Walls::Summed => next[k] + between[k],
            Walls::Numbered => wall(k, cell),
        };
    }
    cells
}

/// The cells in which the ray is for more than `least` of a cell's width, in `f64`.
pub fn crossed(ray: &Ray, side: i32, least: f64) -> Vec<Cell> {
    let n = f64::from(side);
    let (origin, direction) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
    let mut times: Vec<f64> = (0..3)
        .flat_map(|k| (0..=side).map(move |i| (k, f64::from(i) / n)))
        .map(|(k, wall)| (wall - origin[k]) / direction[k])
        .filter(|t| t.is_finite() && *t >= 0.0)
        .collect();
    times.sort_by(f64::total_cmp);
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let long = |pair: &&[f64]| (pair[1] - pair[0]) * length * n > least;
    let cell = |pair: &[f64]| {
        let t = 0.5 * (pair[0] + pair[1]);
        let cell: Cell =
            std::array::from_fn(|k| ((origin[k] + t * direction[k]) * n).floor() as i32);
        cell.iter().all(|c| (0..side).contains(c)).then_some(cell)
    };
    times.windows(2).filter(long).filter_map(cell).collect()
}

/// Where the ray enters the unit cube.
fn entry(ray: &Ray, inverse: [f32; 3]) -> Option<f32> {
    let (mut near, mut far) = (0.0f32, f32::INFINITY);
    for (origin, inverse) in ray.origin.into_iter().zip(inverse) {
        let [a, b] = [0.0, 1.0].map(|wall: f32| (wall - origin) * inverse);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near <= far).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn in_a_coarse_grid_all_walks_agree() {
        let ray = Ray::new([-0.5, 0.1, 0.2], [1.0, 0.37, 0.21]);
        let [summed, numbered] =
            [Walls::Summed, Walls::Numbered].map(|walls| visited(&ray, 8, walls));
        assert_eq!(summed, numbered);
        assert_eq!(summed, crossed(&ray, 8, 0.0));
        assert!(summed.len() > 8);
        assert!(
            visited(&Ray::new([-0.5, 2.0, 0.2], [1.0, 0.37, 0.21]), 8, Walls::Summed).is_empty()
        );
    }
}
