//! Triangles across the ray: vertices in the sheared space, and the areas that the ray's point spans with edges.
//!
//! Source: \[WBW13\] for the shear; the bounds are our own, derived in `docs/METHODS.md`.

use super::TINY;
use crate::math::Aabb;
use crate::math::rounding::UNIT32;
use crate::ray::PreparedRay;
use crate::simd::{Lanes, Width, mul_sub};

/// Vertices in the sheared space: the ray is the line x = y = 0, and depth grows along it.
#[derive(Clone, Copy)]
pub(super) struct Sheared<V> {
    /// Minus x, and minus y: areas are the same.
    pub x: V,
    pub y: V,
    /// The larger distance from the ray along x and y.
    pub size: V,
    /// Depth from the frame's zero, without rounding.
    pub raw: V,
    /// Depth from the ray's origin.
    pub depth: V,
}

impl<V: Copy> Sheared<V> {
    /// From given coordinates, an array for each axis.
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        ray: &PreparedRay,
        vertices: &[[f32; N]; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let shear = &ray.shear;
        let [kx, ky, kz] = shear.axes;
        let scale = s.splat(ray.scale);
        let raw = s.load(&vertices[kz]).mul(s.splat(ray.scale * shear.depth_sign));
        let depth = raw.sub(s.splat(ray.origin[kz] * shear.depth_sign));
        let flat = |k: usize| s.splat(ray.origin[k]);
        let x = mul_sub::<V, FUSED, N>(s.load(&vertices[kx]), scale, flat(kx));
        let y = mul_sub::<V, FUSED, N>(s.load(&vertices[ky]), scale, flat(ky));
        let x = mul_sub::<V, FUSED, N>(depth, s.splat(shear.slope[0]), x);
        let y = mul_sub::<V, FUSED, N>(depth, s.splat(shear.slope[1]), y);
        Sheared { x, y, size: x.abs().max(y.abs()), raw, depth }
    }
}

/// Twice the area that the ray's point spans with two vertices.
#[inline(always)]
pub(super) fn area<V: Lanes<N>, const FUSED: bool, const N: usize>(
    p: &Sheared<V>,
    q: &Sheared<V>,
) -> V {
    mul_sub::<V, FUSED, N>(p.x, q.y, p.y.mul(q.x))
}

/// What x and y of a vertex may be off, when none is larger than `size` and no depth than `deepest`:
/// `2.5 u size + 5.5 u steepness deepest`. Here the second part, which all vertices of a block share.
#[inline(always)]
pub(super) fn shared_error(ray: &PreparedRay, deepest: f32) -> f32 {
    5.5 * UNIT32 * ray.shear.steepness * deepest
}

/// What an area may be off, by the largest [size](Sheared::size) of the three vertices.
///
/// With `e` what a coordinate may be off, `e (4 size + 2 e) + 4.5 u size^2`, as a polynomial in `size`.
#[derive(Clone, Copy)]
pub(super) struct AreaError {
    pub linear: f32,
    pub constant: f32,
}

impl AreaError {
    const SQUARE: f32 = 14.6 * UNIT32;

    #[inline(always)]
    pub fn new(shared_error: f32) -> Self {
        AreaError {
            linear: 4.01 * shared_error,
            constant: 2.01 * shared_error * shared_error + TINY,
        }
    }

    #[inline(always)]
    pub fn of<S: Width<N>, const FUSED: bool, const N: usize>(&self, s: S, size: S::V) -> S::V {
        let (square, linear, constant) = (Self::SQUARE, -self.linear, -self.constant);
        let slope = mul_sub::<S::V, FUSED, N>(size, s.splat(square), s.splat(linear));
        mul_sub::<S::V, FUSED, N>(size, slope, s.splat(constant))
    }
}

/// The depth of the point of a box that is deepest before or behind the ray's origin.
#[inline(always)]
pub(super) fn deepest(ray: &PreparedRay, aabb: &Aabb) -> f32 {
    let k = ray.shear.axes[2];
    let depth = |wall: f32| (wall * ray.scale - ray.origin[k]).abs();
    let (lower, upper) = (depth(aabb.lower[k]), depth(aabb.upper[k]));
    if lower > upper { lower } else { upper }
}

/// The areas that the ray's point spans with the edges of triangles, each over the vertex opposite to it.
pub(super) struct Areas<V> {
    pub over: [V; 3],
    /// What each of them may be off.
    pub error: V,
    pub least: V,
    pub most: V,
}

impl<V: Copy> Areas<V> {
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        error: &AreaError,
        [a, b, c]: &[Sheared<V>; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let over =
            [area::<V, FUSED, N>(b, c), area::<V, FUSED, N>(c, a), area::<V, FUSED, N>(a, b)];
        let [x, y, z] = over;
        Areas {
            over,
            error: error.of::<S, FUSED, N>(s, a.size.max(b.size).max(c.size)),
            least: x.min(y).min(z),
            most: x.max(y).max(z),
        }
    }

    /// Lanes whose triangle the ray's line surely passes by.
    #[inline(always)]
    pub fn outside<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        self.least.less(s.splat(0.0).sub(self.error)) & self.error.less(self.most)
    }

    /// Lanes between whose edges the ray's line surely passes.
    #[inline(always)]
    pub fn sure<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        self.error.less(self.least) | self.most.less(s.splat(0.0).sub(self.error))
    }
}
