//! Triangles across the ray: vertices in the sheared space, and the areas that the ray's point spans with edges.
//!
//! Source: \[WBW13\] for the shear; the bounds are our own, derived in `docs/METHODS.md`.

use crate::math::rounding::UNIT32;
use crate::ray::{PreparedRay, TINY};
use crate::simd::{Lanes, Width, mul_add, mul_sub};

/// Depths of vertices: how far along the ray's axis they are.
#[derive(Clone, Copy)]
pub(super) struct Along<V> {
    /// From the frame's zero, without rounding.
    pub raw: V,
    /// From the ray's origin.
    pub depth: V,
}

impl<V: Copy> Along<V> {
    /// From given coordinates, an array for each axis.
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const N: usize>(
        s: S,
        ray: &PreparedRay,
        vertices: &[[f32; N]; 3],
    ) -> Self
    where
        V: Lanes<N>,
    {
        let shear = &ray.shear;
        let [.., depth] = shear.axes;
        let raw = s.load(&vertices[depth as usize]).mul(s.splat(shear.depth_scale));
        Along { raw, depth: raw.sub(s.splat(shear.origin_depth)) }
    }
}

/// Vertices in the sheared space, in which the ray is the line x = y = 0 and depth grows along it, but for their
/// depth.
#[derive(Clone, Copy)]
pub(super) struct Across<V> {
    /// Minus x, and minus y: areas are the same.
    pub x: V,
    pub y: V,
}

impl<V: Copy> Across<V> {
    /// From given coordinates, an array for each axis.
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const FUSED: bool, const N: usize>(
        s: S,
        ray: &PreparedRay,
        vertices: &[[f32; N]; 3],
        along: &Along<V>,
    ) -> Self
    where
        V: Lanes<N>,
    {
        let [kx, ky, _] = ray.shear.axes;
        let (kx, ky) = (kx as usize, ky as usize);
        let [slope_x, slope_y] = ray.shear.slope();
        let scale = s.splat(ray.scale);
        let (from_x, from_y) = (s.splat(ray.origin[kx]), s.splat(ray.origin[ky]));
        let x = mul_sub::<V, FUSED, N>(s.load(&vertices[kx]), scale, from_x);
        let y = mul_sub::<V, FUSED, N>(s.load(&vertices[ky]), scale, from_y);
        let x = mul_sub::<V, FUSED, N>(along.depth, s.splat(slope_x), x);
        let y = mul_sub::<V, FUSED, N>(along.depth, s.splat(slope_y), y);
        Across { x, y }
    }

    /// The larger distance from the ray along x and y.
    #[inline(always)]
    pub fn size<const N: usize>(&self) -> V
    where
        V: Lanes<N>,
    {
        self.x.abs().max(self.y.abs())
    }
}

/// Twice the area that the ray's point spans with two vertices.
#[inline(always)]
pub(super) fn area<V: Lanes<N>, const FUSED: bool, const N: usize>(
    p: &Across<V>,
    q: &Across<V>,
) -> V {
    mul_sub::<V, FUSED, N>(p.x, q.y, p.y.mul(q.x))
}

/// What x and y of a vertex may be off, when none is larger than `size` and no depth than `deepest`:
/// `2.5 u size + 5.5 u steepness deepest`. Here the second part, which all vertices of a block share.
#[inline(always)]
pub(super) fn shared_error(ray: &PreparedRay, deepest: f32) -> f32 {
    ray.shear.blur() * deepest
}

/// What an area may be off, by the largest [size](Across::size) of the three vertices or more.
///
/// With `e` what a coordinate may be off, `e (4 size + 2 e) + 4.5 u size^2`, as a polynomial in `size`.
#[derive(Clone, Copy)]
pub(super) struct AreaError<V> {
    linear: V,
    constant: V,
}

impl<V: Copy> AreaError<V> {
    #[inline(always)]
    pub fn new<S: Width<N, V = V>, const N: usize>(s: S, shared_error: V) -> Self
    where
        V: Lanes<N>,
    {
        let root = shared_error.mul(s.splat(1.42));
        let constant = root.mul(root).add(s.splat(TINY));
        AreaError { linear: shared_error.mul(s.splat(4.01)), constant }
    }

    #[inline(always)]
    pub fn of<S: Width<N, V = V>, const FUSED: bool, const N: usize>(&self, s: S, size: V) -> V
    where
        V: Lanes<N>,
    {
        let square = s.splat(14.6 * UNIT32);
        let slope = mul_add::<V, FUSED, N>(size, square, self.linear);
        mul_add::<V, FUSED, N>(size, slope, self.constant)
    }
}

/// The areas that the ray's point spans with the edges of triangles, each over the vertex opposite to it.
#[derive(Clone, Copy)]
pub(super) struct Areas<V> {
    pub over: [V; 3],
    /// What each of them may be off.
    pub error: V,
}

impl<V: Copy> Areas<V> {
    #[inline(always)]
    pub fn new<const FUSED: bool, const N: usize>([a, b, c]: &[Across<V>; 3], error: V) -> Self
    where
        V: Lanes<N>,
    {
        let over =
            [area::<V, FUSED, N>(b, c), area::<V, FUSED, N>(c, a), area::<V, FUSED, N>(a, b)];
        Areas { over, error }
    }

    /// The least and the largest of the three.
    #[inline(always)]
    fn extremes<const N: usize>(&self) -> [V; 2]
    where
        V: Lanes<N>,
    {
        let [x, y, z] = self.over;
        [x.min(y).min(z), x.max(y).max(z)]
    }

    /// Lanes whose triangle the ray's line surely passes by.
    #[inline(always)]
    pub fn outside<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        let [least, most] = self.extremes();
        least.less(s.splat(0.0).sub(self.error)) & self.error.less(most)
    }

    /// Lanes between whose edges the ray's line surely passes.
    #[inline(always)]
    pub fn sure<S: Width<N, V = V>, const N: usize>(&self, s: S) -> u32
    where
        V: Lanes<N>,
    {
        let [least, most] = self.extremes();
        self.error.less(least) | most.less(s.splat(0.0).sub(self.error))
    }
}
