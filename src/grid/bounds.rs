//! The bounds of grid steps and of insertion: a search for what breaks them, and how much of them is used.

use std::println;
use std::vec::Vec;

use raykern_harness::make::Random;
use raykern_harness::oracle::dyadic::Dyadic;
use raykern_harness::search::{Worst, samples};

use super::narrow::Narrow;
use super::near::{NOTHING, Near, Sum};
use super::overlap::cells_near;
use super::ray::CellRay;
use super::sixteen::Sixteen;
use super::space::Space;
use super::steps::Level;
use super::way::time_above;
use super::{FINEST, dilation};
use crate::block::cells::CellBox;
use crate::math::{Aabb, Extent, wide};
use crate::prim::Shape;
use crate::ray::{PreparedRay, Ray};
use crate::simd::Scalar;

/// A box that may be flat, far from zero, or both.
pub(super) fn bounds(random: &mut Random) -> Aabb {
    let size = 2f32.powi(random.below(100) as i32 - 80);
    let mut aabb = Aabb::EMPTY;
    for k in 0..3 {
        let far = [[-3, 20], [20, 90]][random.below(2)];
        let middle = [0.0, random.wild(far) * size][random.below(2)];
        let extent = [1.0, 1.0, random.unit() as f32, 2f32.powi(-13), 0.0][random.below(5)] * size;
        (aabb.lower[k], aabb.upper[k]) = (middle, middle + extent);
    }
    // A triangle has area, and the box of a sphere is rounded outwards.
    if (0..3).filter(|k| aabb.lower[*k] < aabb.upper[*k]).count() < 2 {
        return bounds(random);
    }
    aabb
}

/// Resolutions of a grid and of those in it.
fn resolutions(random: &mut Random) -> Vec<[u32; 3]> {
    let mut all = std::vec![[0; 3].map(|_| 1 + random.below(300) as u32)];
    let mut finest = all[0];
    for _ in 0..random.below(5) {
        let inner = [0; 3].map(|_| 1 + random.below(12) as u32);
        finest = [0, 1, 2].map(|k| finest[k] * inner[k]);
        if finest.iter().any(|n| *n > FINEST) {
            break;
        }
        all.push(inner);
    }
    all
}

fn point_in(random: &mut Random, aabb: &Aabb) -> [f32; 3] {
    [0, 1, 2].map(|k| {
        let s = [0.0, 1.0, random.unit() as f32, random.unit() as f32][random.below(4)];
        let x = aabb.lower[k] + (aabb.upper[k] - aabb.lower[k]) * s;
        x.clamp(aabb.lower[k], aabb.upper[k])
    })
}

/// From within 2^30 grids to a point of the box.
pub(super) fn ray_to(random: &mut Random, aabb: &Aabb) -> Option<PreparedRay> {
    let (from, to) = (point_in(random, aabb), point_in(random, aabb));
    let size = (wide(aabb.upper) - wide(aabb.lower)).max_element();
    let away = 2f64.powi(random.below(40) as i32 - 9);
    let away = if random.below(4) == 0 { 0.0 } else { away * size };
    let turn = random.direction();
    let origin = [0, 1, 2].map(|k| (f64::from(from[k]) + turn[k] * away) as f32);
    let mut direction = [0, 1, 2].map(|k| (f64::from(to[k]) - f64::from(origin[k])) as f32);
    if random.below(4) == 0 {
        let k = random.below(3);
        direction[k] *= [0.0, 1e-9, 1e-13, 1e-20][random.below(4)];
    }
    Ray::new(origin, direction).prepare(Extent::new(aabb.reach(), 1))
}

/// A ray without error in the cells of a grid, turned as the walk turns it.
struct RealRay {
    origin: [Dyadic; 3],
    direction: [Dyadic; 3],
}

impl RealRay {
    fn new(space: &Space, ray: &PreparedRay, cell_ray: &CellRay) -> Self {
        let head = space.head(0, 1);
        let in_cells = |k: usize, x: Dyadic| &x * &Dyadic::from_f64(head.per_length[k]);
        let origin = [0, 1, 2].map(|k| {
            let o = Dyadic::from_f32(ray.given.origin[k]);
            let o = in_cells(k, &o - &Dyadic::from_f64(head.lower[k]));
            let n = Dyadic::from_f64(f64::from(space.resolution[k]));
            if cell_ray.turned[k] == 0 { o } else { &n - &o }
        });
        let direction = [0, 1, 2].map(|k| {
            let d = in_cells(k, Dyadic::from_f32(ray.given.direction[k]));
            if cell_ray.turned[k] == 0 { d } else { -d }
        });
        RealRay { origin, direction }
    }

    /// In the cells of a grid in a cell.
    fn within(&self, cell: [f32; 3], resolution: [u32; 3]) -> Self {
        let n = resolution.map(|n| Dyadic::from_f64(f64::from(n)));
        let scaled = |k: usize, x: &Dyadic| x * &n[k];
        RealRay {
            origin: [0, 1, 2].map(|k| scaled(k, &(&self.origin[k] - &Dyadic::from_f32(cell[k])))),
            direction: [0, 1, 2].map(|k| scaled(k, &self.direction[k])),
        }
    }

    /// How far it is outside of a cell at a given `t`.
    fn outside(&self, k: usize, t: &Dyadic, cell: f32) -> f64 {
        let at = &self.origin[k] + &(t * &self.direction[k]);
        let one = Dyadic::from_f64(1.0);
        (&at - &Dyadic::from_f32(cell))
            .ratio(&one)
            .min(0.0)
            .abs()
            .max((&at - &Dyadic::from_f32(cell + 1.0)).ratio(&one).max(0.0))
    }
}

/// A walk through grids in grids, here and there by a jump.
struct Walker<'r> {
    random: &'r mut Random,
    cell_ray: CellRay,
    /// Where its times count from, and those between which the ray is in the outermost grid.
    start: f64,
    inside: [f64; 2],
    t_scale: f64,
    resolutions: Vec<[u32; 3]>,
}

impl Walker<'_> {
    /// Walks through a grid and some of those in its cells, until the walk around it goes on; whether a bound was broken.
    fn walk(
        &mut self,
        depth: usize,
        (mut level, until): (Level<[f32; 4]>, f32),
        real: &RealRay,
        worst: &mut Worst,
    ) -> bool {
        const NO_BOUND: [f32; 4] = [f32::INFINITY; 4];
        let mut broken = false;
        for _ in 0..24 {
            let seen = level.seen(Scalar, until);
            let cell = seen.cell;
            let [begin, end] = seen.times.map(f64::from);
            let times = [begin.max(self.inside[0]), end.min(self.inside[1])];
            for k in (0..3).filter(|_| times[0] <= times[1]) {
                let along = self.resolutions[..=depth].iter().map(|n| f64::from(n[k])).product();
                for t in times {
                    // Both the start and what is counted from it are exact.
                    let t = &Dyadic::from_f64(self.start / self.t_scale)
                        + &Dyadic::from_f64(t / self.t_scale);
                    broken |= worst.see(real.outside(k, &t, cell[k]), dilation(along));
                }
            }
            if broken {
                println!("{seen:?} at depth {depth}");
                return true;
            }
            if let Some(inner) =
                self.resolutions.get(depth + 1).copied().filter(|_| self.random.below(3) == 0)
            {
                let deeper = level.inner(Scalar, (0, inner), self.cell_ray.turned);
                let deeper = (deeper, seen.times[1]);
                if self.walk(depth + 1, deeper, &real.within(cell, inner), worst) {
                    return true;
                }
            }
            let ahead = [0.0, 0.0, 1.0, 4.0][self.random.below(4)];
            if !(if ahead == 0.0 {
                level.step(Scalar, NO_BOUND)
            } else {
                level.jump(Scalar, ahead, NO_BOUND)
            }) {
                break;
            }
        }
        false
    }
}

/// Where a walk says that the ray is in a cell, from entering it to leaving it, the ray really is within the dilation of it.
#[test]
fn steps() {
    const SEED: u64 = 41;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let mut worst = Worst::new("grid: cell of a ray");
    for sample in 0..samples(4_000) {
        let before = random.clone();
        let (aabb, mut resolutions) = (bounds(&mut random), resolutions(&mut random));
        let space = Space::over(&aabb, resolutions[0]);
        resolutions[0] = space.resolution;
        let Some(ray) = ray_to(&mut random, &aabb) else { continue };
        let parts = resolutions[1..].iter().fold([1; 3], |all, n| [0, 1, 2].map(|k| all[k] * n[k]));
        let finest = parts.into_iter().max().unwrap_or(1);
        let cell_ray = CellRay::new(&space.head(0, finest), space.resolution, &ray);
        let [enter, exit] = cell_ray.part([0.0, f64::INFINITY]);
        if !cell_ray.is_near(finest) || enter > exit {
            continue;
        }
        // As early and as late as the box of the contents may say.
        let a_cell = 1.0 / cell_ray.direction.iter().fold(0.0, |most, speed| speed.max(most));
        let (early, late) = (random.unit() * 0.06 * a_cell, random.unit() * 0.06 * a_cell);
        let start = f64::from((enter - early).max(0.0) as f32);
        if !cell_ray.holds(cell_ray.at(start)) {
            continue;
        }
        let inside = [(enter - start).max(0.0), exit - start];
        let exit = exit + late;
        let until = time_above(exit, start);
        let level = Level::outermost(Scalar, &cell_ray, 0, cell_ray.at(start), until);
        let real = RealRay::new(&space, &ray, &cell_ray);
        let t_scale = ray.t_scale;
        let mut walker =
            Walker { random: &mut random, cell_ray, start, inside, t_scale, resolutions };
        let broken = walker.walk(0, (level, until), &real, &mut worst);
        assert!(!broken, "sample {sample} of seed {SEED}: {before:?}");
    }
    worst.assert_tight(0.02);
}

/// Every point of a triangle is within three quarters of the dilation of a cell that lists the triangle, whichever of the
/// cells around it that is.
#[test]
fn insertion() {
    const SEED: u64 = 43;
    println!("seed {SEED}");
    let mut random = Random::new(SEED);
    let (mut points, mut left_out, mut left_out_small, mut tight) = (0, 0, 0, 0);
    for _ in 0..samples(3_000) {
        let aabb = bounds(&mut random);
        let n = [0; 3].map(|_| 1 + random.below(40) as u32);
        let mut space = Space::over(&aabb, n);
        if random.below(2) == 0 {
            let cell = space.resolution.map(|n| random.below(n as usize) as u32);
            space = space.within(space.place_of(cell), [0; 3].map(|_| 1 + random.below(9) as u32));
        }
        let mut corners = [(); 3].map(|()| point_in(&mut random, &aabb));
        let is_small = random.below(4) > 0;
        if is_small {
            let per_length = space.lines().1;
            for (corner, k) in [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)] {
                let away = (1.8 * random.unit() - 0.9) / per_length[k];
                corners[corner][k] = (f64::from(corners[0][k]) + away) as f32;
            }
        }
        let shape = Shape::Triangle(corners);
        let mut listed = Vec::new();
        let looked_at = cells_near(&space, &shape, |cell| listed.push(cell));
        left_out += looked_at - listed.len() as u64;
        let (mut sixteen, mut abreast) = (Sixteen::EMPTY, Vec::new());
        sixteen.push(0, &shape);
        let (near, mut sum) = (Near::new(&space), NOTHING);
        near.find(&sixteen, &[], |cell, _, ends| {
            abreast.push(cell);
            ends.add(&mut sum);
        });
        tight +=
            abreast.iter().filter(|cell| box_is_tight(&space, &near, **cell, &shape, &sum)).count();
        let (range, wide) =
            (Narrow::new(&space).range_of(&shape.aabb()), space.range_of(&shape.aabb()));
        left_out_small += u64::from(is_small) * (range.cell_count() - abreast.len() as u64);
        for k in 0..3 {
            assert!(
                range.first[k] <= wide.first[k] && range.last[k] >= wide.last[k],
                "{space:?} {corners:?}"
            );
        }
        let at = corners.map(|corner| space.point(corner));
        for _ in 0..8 {
            let (a, b) = (random.unit(), random.unit());
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let point =
                [0, 1, 2].map(|k| at[0][k] + a * (at[1][k] - at[0][k]) + b * (at[2][k] - at[0][k]));
            // A point that the grid does not hold is in none of its cells.
            let inside = (0..3).all(|k| (0.0..=f64::from(space.resolution[k])).contains(&point[k]));
            if !inside {
                continue;
            }
            for corner in 0..8 {
                let cell = [0, 1, 2].map(|k| {
                    let off = 0.75 * space.dilation[k] * [-1.0, 1.0][corner >> k & 1];
                    ((point[k] + off) as u32).min(space.resolution[k] - 1)
                });
                points += 1;
                let number = space.number(cell);
                let both = listed.contains(&number) && abreast.contains(&number);
                assert!(both, "{space:?} {corners:?} {cell:?}");
            }
        }
    }
    assert!(points > 10_000 && left_out > 10_000, "{points} {left_out}");
    assert!(left_out_small > 300, "{left_out_small}");
    assert!(tight > 5_000, "{tight}");
}

/// Whether a box in a cell is what it would be if nothing were rounded; it is never smaller.
fn box_is_tight(space: &Space, near: &Near, number: usize, shape: &Shape, sum: &Sum) -> bool {
    let (cell, aabb) = (space.cell(number as u32), shape.aabb());
    let (mut lower, mut upper) = (space.point(aabb.lower), space.point(aabb.upper));
    for k in 0..3 {
        lower[k] -= f64::from(cell[k]) + 2.0 * space.dilation[k];
        upper[k] -= f64::from(cell[k]) - 2.0 * space.dilation[k];
    }
    let (found, exact) = (near.box_in(cell, sum), CellBox::around(lower, upper));
    let is_around =
        (0..3).all(|k| found.lower[k] <= exact.lower[k] && found.upper[k] >= exact.upper[k]);
    assert!(is_around, "{space:?} {shape:?} {cell:?}: {found:?} {exact:?}");
    found == exact
}

/// All that a block can hold lies inside the walls by more than rounding the times of entry and exit can take.
#[test]
fn exits_are_behind_the_contents() {
    let mut random = Random::new(44);
    for _ in 0..samples(100_000) {
        let aabb = bounds(&mut random);
        let space = Space::over(&aabb, [0; 3].map(|_| 1 + random.below(300) as u32));
        let (lower, upper) = (space.point(aabb.lower), space.point(aabb.upper));
        for k in 0..3 {
            let n = f64::from(space.resolution[k]);
            let margin = lower[k].min(n - upper[k]);
            assert!(margin >= 1.0 / 1024.0, "{k} {space:?} {aabb:?}");
        }
    }
}
