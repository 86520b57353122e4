//! Which cells of a grid sixteen primitives come near to.

use super::narrow::{Axis, Narrow};
use super::overlap::{ACROSS, cells_near};
use super::sixteen::{Sixteen, ends};
use super::space::Space;
use crate::block::cells::CellBox;
use crate::simd::{Kernel, Lanes, Simd, Width, dispatch};

/// The cells of a grid, in which primitives are looked up.
pub(super) struct Near<'g> {
    space: &'g Space,
    narrow: Narrow,
    /// How far from a cell each of eight is, of which it is the first.
    steps: [usize; 8],
}

impl<'g> Near<'g> {
    pub fn new(space: &'g Space) -> Self {
        let [nx, ny, _] = space.resolution.map(|n| n as usize);
        let steps = [0, 1, 2, 3, 4, 5, 6, 7].map(|o| (o & 1) + nx * ((o >> 1 & 1) + ny * (o >> 2)));
        Near { space, narrow: Narrow::new(space), steps }
    }

    /// Calls `f` with the numbers of each cell and primitive that come near each other and the box of the latter, in the order of the
    /// primitives, of which those with the numbers `but` are left out; returns how many cells were looked at, or how many are near.
    #[inline(always)]
    pub fn find(&self, sixteen: &Sixteen, but: &[u32], mut f: impl FnMut(usize, u32, Ends)) -> u64 {
        let found = dispatch(Find { narrow: &self.narrow, sixteen });
        let mut work = 0;
        for lane in 0..sixteen.count.min(16) {
            let id = sixteen.ids[lane];
            if !but.is_empty() && but.contains(&id) {
                continue;
            }
            let ends = Ends { of: &found.ends, lane };
            let mut bits = u32::from(found.bits[lane]);
            if bits == 0 {
                work += cells_near(self.space, &sixteen.shape(lane), |cell| f(cell, id, ends));
                continue;
            }
            let first = self.space.number(found.first.map(|axis| axis[lane] as u32));
            work += u64::from(bits.count_ones());
            while bits != 0 {
                f(first + self.steps[bits.trailing_zeros() as usize % 8], id, ends);
                bits &= bits - 1;
            }
        }
        work
    }

    /// The box of what is in a cell, as far as it is in that and wider by what a walk may be off, from boxes [added up](Ends::add).
    pub fn box_in(&self, cell: [u32; 3], sum: &Sum) -> CellBox {
        let (mut lower, mut upper) = ([0.0; 3], [0.0; 3]);
        for k in 0..3 {
            let [least, most] = [sum[k], sum[k + 4]].map(|x| f64::from(f32::from_bits(x)));
            // What the coordinates have lost to rounding is in the reach.
            let around = self.space.dilation[k] + f64::from(self.narrow.reach[k]);
            lower[k] = least - f64::from(cell[k]) - around;
            upper[k] = -most - f64::from(cell[k]) + around;
        }
        CellBox::around(lower, upper)
    }
}

/// The box of a primitive that is looked up, in cells.
#[derive(Clone, Copy)]
pub(super) struct Ends<'f> {
    of: &'f [[[f32; 16]; 2]; 3],
    lane: usize,
}

/// The box around several: bits of the least coordinates, and of the least that the largest are with their signs changed.
///
/// ```text
/// word 0       3   4          7   8
///      | x y z | - | -x -y -z | - |
/// ```
pub(super) type Sum = [u32; 8];

/// That of none.
pub(super) const NOTHING: Sum = [f32::INFINITY.to_bits(); 8];

impl Ends<'_> {
    /// Adds it to others.
    #[inline(always)]
    pub fn add(self, sum: &mut Sum) {
        let [[x, to_x], [y, to_y], [z, to_z]] = self.of;
        let i = self.lane % 16;
        let own = [x[i], y[i], z[i], z[i], -to_x[i], -to_y[i], -to_z[i], -to_z[i]];
        for (sum, x) in sum.iter_mut().zip(own) {
            let least = f32::from_bits(*sum);
            *sum = if x < least { x } else { least }.to_bits();
        }
    }
}

/// What was found of sixteen primitives.
struct Found {
    /// The first cell along each axis.
    first: [[f32; 16]; 3],
    /// The least and the largest coordinate along each axis, in cells.
    ends: [[[f32; 16]; 2]; 3],
    /// One bit for each of the eight cells from there on, `x` first, that a primitive comes near; none if it is too large to tell.
    bits: [u8; 16],
}

/// Finds that.
///
/// A triangle whose box reaches two cells along each axis at most is held against them as [`Overlap`](super::overlap::Overlap) does, in `f32`, relative to the
/// first of them: its coordinates are below [`MOST`] then. That they are not the real ones is what [`Narrow`] grants. Sides of edges and the plane are off by less
/// than `2^10 u` of a cell, which [`ROUNDING`] grants, or the product of two edges; a projection so thin that its orientation is in doubt is left out.
struct Find<'a> {
    narrow: &'a Narrow,
    sixteen: &'a Sixteen,
}

const MOST: f32 = 8.0;
const ROUNDING: f32 = 1.0 / (1u32 << 14) as f32;
const IN_DOUBT: f32 = 1.0 / (1u32 << 20) as f32;

impl Kernel for Find<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Found {
        let Find { narrow, sixteen } = self;
        let (zero, most) = (splat(s, 0.0), splat(s, MOST));
        let mut found = Found { first: [[0.0; 16]; 3], ends: [[[0.0; 16]; 2]; 3], bits: [0; 16] };
        let mut corners = [[zero; 3]; 3];
        let (mut small, mut two) = (!(!0 << sixteen.count.min(16)), [0; 3]);
        for k in 0..3 {
            let axis: Axis<_> = narrow.axis::<S, 16>(s, k);
            let [a, b, c] = sixteen.along(s, k);
            let at = [axis.at(a), axis.at(b), axis.at(c)];
            let [least, largest] = ends(at);
            let (first, last) = (axis.first(least), axis.last(largest));
            first.store(&mut found.first[k]);
            least.store(&mut found.ends[k][0]);
            largest.store(&mut found.ends[k][1]);
            let more = last.sub(first);
            small &= more.less_or_equal(splat(s, 1.0));
            small &= first.sub(least).less_or_equal(most) & largest.sub(first).less_or_equal(most);
            two[k] = splat(s, 0.5).less(more);
            corners[k] = [at[0].sub(first), at[1].sub(first), at[2].sub(first)];
        }
        let [x, y, z] = two;
        let (mut near, crooked) = ([small; 8], x & y | y & z | z & x);
        if small & crooked & sixteen.triangles != 0 {
            near = cells(s, &corners, narrow);
        }
        for (cell, near) in near.iter_mut().enumerate() {
            let alone = small & !(crooked & sixteen.triangles);
            *near = *near & small | alone;
            for (k, two) in two.iter().enumerate() {
                *near &= if cell >> k & 1 == 1 { *two } else { !0 };
            }
        }
        for (lane, bits) in found.bits.iter_mut().enumerate() {
            for (cell, near) in near.iter().enumerate() {
                *bits |= ((near >> lane & 1) as u8) << cell;
            }
        }
        found
    }
}

/// The lanes whose triangle comes near each of eight cells, of which the first is at zero.
#[inline(always)]
fn cells<S: Simd>(s: S, corners: &[[<S as Width<16>>::V; 3]; 3], narrow: &Narrow) -> [u32; 8] {
    let zero = splat(s, 0.0);
    let mut edges = [[zero; 3]; 3];
    let mut sizes = [zero; 2];
    for k in 0..3 {
        let [a, b, c] = corners[k];
        edges[k] = [b.sub(a), c.sub(b), a.sub(c)];
        sizes = [sizes[0].add(edges[k][0].abs()), sizes[1].add(edges[k][1].abs())];
    }
    let rounding = sizes[0].mul(sizes[1]).mul(splat(s, ROUNDING / 2.0));
    let (mut below, mut above) = (rounding, rounding);
    let mut normal = [zero; 3];
    let mut sides = [[zero; 4]; 3];
    for (k, [x, y]) in ACROSS.into_iter().enumerate() {
        let (p, q) = (edges[x][0].mul(edges[y][1]), edges[y][0].mul(edges[x][1]));
        normal[k] = p.sub(q);
        let clear = p.abs().add(q.abs()).mul(splat(s, IN_DOUBT)).less(normal[k].abs());
        let turn = Width::<16>::select(s, clear, splat(s, 1.0).flipped_by(normal[k]), zero);
        let reach = [x, y].map(|axis| narrow.reach[axis] + ROUNDING);
        sides[k] = least_sides(s, [corners[x], corners[y]], [edges[x], edges[y]], turn, reach);
        // The plane, from the corner at which it comes first to that at which it comes last.
        let (d, n) = (splat(s, narrow.reach[k] + ROUNDING), normal[k]);
        let (near, far) = (zero.sub(n.mul(d)), n.mul(splat(s, 1.0).add(d)));
        let at = n.mul(corners[k][0]);
        below = below.add(at.sub(near.min(far)));
        above = above.sub(at.sub(near.max(far)));
    }
    let mut near = [0; 8];
    for (cell, near) in near.iter_mut().enumerate() {
        let [x, y, z] = [cell & 1, cell >> 1 & 1, cell >> 2];
        let mut at = zero;
        for (k, one) in [x, y, z].into_iter().enumerate() {
            at = if one == 1 { at.add(normal[k]) } else { at };
        }
        let plane = below.sub(at).min(above.add(at));
        let side = sides[0][y + 2 * z].min(sides[1][z + 2 * x]).min(sides[2][x + 2 * y]);
        *near = zero.less_or_equal(plane.min(side));
    }
    near
}

/// Of a projection, how far the corner of each of four squares that is furthest inside of an edge is, at the edge for which that is the least; for triangles that turn
/// as the signs of `turn` say, and nothing where that is zero.
#[inline(always)]
fn least_sides<S: Simd>(
    s: S,
    [xs, ys]: [[<S as Width<16>>::V; 3]; 2],
    [along_x, along_y]: [[<S as Width<16>>::V; 3]; 2],
    turn: <S as Width<16>>::V,
    [reach_x, reach_y]: [f32; 2],
) -> [<S as Width<16>>::V; 4] {
    let zero = splat(s, 0.0);
    let (dx, dy) = (splat(s, reach_x), splat(s, reach_y));
    let (wx, wy) = (splat(s, 1.0 + 2.0 * reach_x), splat(s, 1.0 + 2.0 * reach_y));
    let mut sides = [zero; 4];
    for i in 0..3 {
        let (nx, ny) = (zero.sub(along_y[i]).mul(turn), along_x[i].mul(turn));
        let reach = nx.max(zero).mul(wx).add(ny.max(zero).mul(wy));
        let from = nx.mul(xs[i].add(dx)).add(ny.mul(ys[i].add(dy)));
        let one = reach.sub(from);
        let two = one.add(ny);
        let four = [one, one.add(nx), two, two.add(nx)];
        for (side, other) in sides.iter_mut().zip(four) {
            *side = if i == 0 { other } else { side.min(other) };
        }
    }
    sides
}

#[inline(always)]
fn splat<S: Simd>(s: S, x: f32) -> <S as Width<16>>::V {
    Width::<16>::splat(s, x)
}
