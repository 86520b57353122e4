//! A ref parted by a plane: the boxes of what lies on either side.

use super::refs::PrimRef;
use super::split::Box4;
use crate::math::rounding::{f32_above, f32_below};
use crate::prim::Shape;

/// The parts of a ref on either side of the plane where the coordinate of `axis` is `plane`; `None` for
/// a side that has nothing of it. Without a shape, or with a sphere, the box itself is cut.
///
/// Conservative: each point of the shape that lies in the box of `r`, in real arithmetic, lies in the
/// box of the part on its side, and a point in the plane in one of the two.
pub(super) fn clip(
    r: &PrimRef,
    shape: Option<Shape>,
    axis: usize,
    plane: f32,
) -> [Option<PrimRef>; 2] {
    if r.bounds.upper[axis] <= plane {
        return [Some(*r), None];
    }
    if r.bounds.lower[axis] >= plane {
        return [None, Some(*r)];
    }
    let mut sides = [r.bounds; 2];
    sides[0].upper[axis] = plane;
    sides[1].lower[axis] = plane;
    if let Some(Shape::Triangle(corners)) = shape {
        let parts = parts(&corners, axis, plane);
        sides.iter_mut().zip(&parts).for_each(|(side, part)| narrow(side, part));
    }
    sides.map(|side| {
        let holds = (0..3).all(|k| side.lower[k] <= side.upper[k]);
        holds.then_some(PrimRef { bounds: side })
    })
}

/// Boxes around what a triangle has on either side of a plane.
///
/// The part on a side is the convex hull of its corners there and of the points where edges pass
/// through the plane. The point between `p` and `q` is computed in `f64` as `p + (q - p) * s` with
/// `s = (plane - p) / (q - p)` on the axis: five roundings of `(q - p) * s`, which is at most `2 m` where no
/// coordinate of the two is larger than `m`, and one of the sum make `11.1 * 2^-53 * m` at most. It is
/// widened by `16 * 2^-53 * m`, which also covers the rounding of that sum. Nothing underflows: floats
/// are at least `2^-149`.
fn parts(corners: &[[f32; 3]; 3], axis: usize, plane: f32) -> [Box4; 2] {
    let mut parts = [Box4::EMPTY; 2];
    for i in 0..3 {
        let (p, q) = (&corners[i], &corners[(i + 1) % 3]);
        let [from, to] = [p[axis], q[axis]];
        if from <= plane {
            parts[0].add(&Box4::at(point(p)));
        }
        if from >= plane {
            parts[1].add(&Box4::at(point(p)));
        }
        if (from < plane && to > plane) || (from > plane && to < plane) {
            let crossing = crossing(p, q, axis, plane);
            parts.iter_mut().for_each(|part| part.add(&crossing));
        }
    }
    parts
}

/// A box around the point in which an edge that passes through the plane meets it.
fn crossing(p: &[f32; 3], q: &[f32; 3], axis: usize, plane: f32) -> Box4 {
    const MARGIN: f64 = 1.0 / (1u64 << 49) as f64;
    let (from, to) = (f64::from(p[axis]), f64::from(q[axis]));
    let s = (f64::from(plane) - from) / (to - from);
    let mut all = Box4::at([plane; 4]);
    for k in (0..3).filter(|k| *k != axis) {
        let (p, q) = (f64::from(p[k]), f64::from(q[k]));
        let (at, margin) = (p + (q - p) * s, MARGIN * p.abs().max(q.abs()));
        all.lower[k] = f32_below(at - margin);
        all.upper[k] = f32_above(at + margin);
    }
    all
}

fn point([x, y, z]: &[f32; 3]) -> [f32; 4] {
    [*x, *y, *z, 0.0]
}

/// Takes from `side` what is outside of `part`; the fourth lanes stay, and -0 becomes +0.
fn narrow(side: &mut Box4, part: &Box4) {
    for k in 0..3 {
        side.lower[k] = part.lower[k].max(side.lower[k]) + 0.0;
        side.upper[k] = part.upper[k].min(side.upper[k]) + 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;

    /// Whether `x` is at most (or, with `sign` -1, at least) where the edge from `p` to `q` meets the plane, all but
    /// `x` integers: `(x - p) * span <= (q - p) * (plane - from)`, without error.
    fn bounds(x: f32, sign: i128, [p, q]: [f32; 2], [from, to]: [f32; 2], plane: f32) -> bool {
        const ONE: i128 = 1 << 50;
        let fixed = |x: f32| (f64::from(x) * ONE as f64) as i128;
        let [whole_p, q, from, to, plane] = [p, q, from, to, plane].map(|x| x as i128);
        let sign = sign * (to - from).signum();
        sign * (fixed(x) - fixed(p)) * (to - from) <= sign * (q - whole_p) * (plane - from) * ONE
    }

    #[test]
    fn parts_hold_what_is_on_their_side() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 16) as i32 % 4096 - 2048
        };
        let mut crossings = 0;
        for _ in 0..20_000 {
            let corners: [[f32; 3]; 3] = core::array::from_fn(|_| [0; 3].map(|_| next() as f32));
            let r = PrimRef::new(7, &Aabb::around(&corners), false);
            let (axis, plane) = (next() as usize % 3, next() as f32);
            let sides = clip(&r, Some(Shape::Triangle(corners)), axis, plane);
            for i in 0..3 {
                let (p, q) = (corners[i], corners[(i + 1) % 3]);
                let ends = [p[axis], q[axis]];
                let held = sides.iter().flatten().any(|part| {
                    let Box4 { lower, upper } = part.bounds;
                    (0..3).all(|k| lower[k] <= p[k] && p[k] <= upper[k])
                });
                assert!(held, "{corners:?} {axis} {plane}: corner {i}");
                if (ends[0] < plane) == (ends[1] < plane) || ends.contains(&plane) {
                    continue;
                }
                crossings += 1;
                for (part, k) in
                    sides.iter().flatten().flat_map(|part| [0, 1, 2].map(|k| (part, k)))
                {
                    let Box4 { lower, upper } = part.bounds;
                    let edge = [p[k], q[k]];
                    let held = bounds(lower[k], 1, edge, ends, plane)
                        && bounds(upper[k], -1, edge, ends, plane);
                    assert!(held, "{corners:?} {axis} {plane} {k}: {lower:?} {upper:?}");
                }
            }
        }
        assert!(crossings > 10_000, "{crossings}");
    }

    #[test]
    fn what_only_touches_the_plane_is_on_one_side() {
        let flat = [[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [1.0, 0.0, 2.0]];
        let r = PrimRef::new(3, &Aabb::around(&flat), false);
        let sides = |axis, plane| clip(&r, Some(Shape::Triangle(flat)), axis, plane);
        assert!(matches!(sides(0, 1.0), [Some(_), None]));
        assert!(matches!(sides(1, 0.0), [None, Some(_)]));
        let [left, right] = sides(1, 1.0).map(|part| part.expect("both sides"));
        assert_eq!((left.id(), right.id()), (3, 3));
        // From two on the right side to one, up to the rounding.
        assert!(right.bounds.upper[2] >= 1.0 && right.bounds.upper[2] < 1.001);
        assert_eq!(left.bounds.upper[2], 2.0);
    }
}
