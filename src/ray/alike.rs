//! What rays have in common that are traced together.

use super::Ray;
use super::exponents::{is_ordinary, scale_below};
use super::packet::GROUPS;
use crate::math::Extent;
use crate::simd::{Lanes, Width};

/// Fewer rays are not worth it.
const LEAST: usize = 8;
/// How far directions may be apart along an axis, of their largest component, and origins, of the scene's largest
/// coordinate.
const ASUNDER: f32 = 0.25;
const APART: f32 = 0.125;

/// Rays that begin and run nearly the same, and the same way along each axis: their one frame, in which the axis of the
/// longest direction's largest component is the depth.
///
/// Along it all of them run at least three quarters as fast as the longest, and so as fast as along the others, or
/// nearly.
#[derive(Clone, Copy)]
pub(crate) struct Alike {
    /// From given coordinates to the frame's, a power of two.
    pub scale: f32,
    /// The largest coordinate of scene and origins, in the frame.
    pub reach: f32,
    /// The axes x, y and depth, an even permutation.
    pub axes: [usize; 3],
    /// Whether they run towards lower coordinates.
    pub backwards: [bool; 3],
}

impl Alike {
    /// What the first of these rays have in common, and how many these are: 16, 32, 48 or 64, or all; `None` if not even 16 had better
    /// go together.
    #[inline(always)]
    pub fn first_of<S: Width<8>>(s: S, rays: &[Ray], extent: Extent) -> Option<(Self, usize)> {
        let mut known = None;
        let mut extremes: Option<Extremes<S::V>> = None;
        let mut count = 0;
        for part in rays.chunks(16).take(GROUPS) {
            let Some(more) = Extremes::of(s, part, extremes) else { break };
            let Some(alike) = Alike::within(more.stored(), extent) else { break };
            count += part.len();
            (known, extremes) = (Some((alike, count)), Some(more));
        }
        known.filter(|(_, count)| *count >= LEAST)
    }

    /// What rays have in common whose numbers lie within these.
    #[inline(always)]
    fn within([least, most]: [[f32; 8]; 2], extent: Extent) -> Option<Self> {
        let ([o_least, d_least], [o_most, d_most]) =
            ([&least[..3], &least[4..7]], [&most[..3], &most[4..7]]);
        let (mut apart, mut asunder, mut longest, mut depth) = (0f32, 0f32, 0f32, 0);
        let (mut farthest, mut one_way) = (extent.scene, true);
        for k in 0..3 {
            apart = apart.max(o_most[k] - o_least[k]);
            asunder = asunder.max(d_most[k] - d_least[k]);
            farthest = farthest.max(o_most[k].max(-o_least[k]));
            let size = d_most[k].max(-d_least[k]);
            (longest, depth) = if size > longest { (size, k) } else { (longest, depth) };
            one_way &= d_least[k] > 0.0 || d_most[k] < 0.0;
        }
        let near = asunder <= ASUNDER * longest && apart <= APART * extent.scene;
        let ordinary = is_ordinary(0.5 * longest) && is_ordinary(longest) && is_ordinary(farthest);
        let ordinary = ordinary && farthest <= extent.near;
        if !(one_way && near && ordinary) {
            return None;
        }
        let scale = scale_below(farthest);
        Some(Alike {
            scale,
            reach: farthest * scale,
            axes: [(depth + 1) % 3, (depth + 2) % 3, depth],
            backwards: [0, 1, 2].map(|k| d_most[k] < 0.0),
        })
    }

    /// From given coordinates along the last axis to depths, which grow along the rays.
    #[inline(always)]
    pub fn depth_scale(&self) -> f32 {
        if self.backwards[self.axes[2]] { -self.scale } else { self.scale }
    }
}

/// The least and the largest numbers of rays, as in a [row](Ray::row); a NaN is left out.
#[derive(Clone, Copy)]
struct Extremes<V>([V; 2]);

impl<V: Lanes<8>> Extremes<V> {
    /// Of these rays, and of those `before`.
    #[inline(always)]
    fn of<S: Width<8, V = V>>(s: S, rays: &[Ray], before: Option<Self>) -> Option<Self> {
        let first = s.load(rays.first()?.row());
        let Extremes([mut least, mut most]) = before.unwrap_or(Extremes([first, first]));
        for ray in rays {
            let row = s.load(ray.row());
            (least, most) = (row.min(least), row.max(most));
        }
        Some(Extremes([least, most]))
    }

    #[inline(always)]
    fn stored(&self) -> [[f32; 8]; 2] {
        let mut extremes = [[0.0; 8]; 2];
        self.0[0].store(&mut extremes[0]);
        self.0[1].store(&mut extremes[1]);
        extremes
    }
}
