//! How a child is asked about many rays.

use super::together::Traveller;
use crate::batch::Manner;
use crate::block::Finished;
use crate::block::level::Level;
use crate::math::Aabb;
use crate::ray::Ray;

/// So many pairs of neighbours are looked at.
const LOOKED_AT: usize = 12;
/// Rays that pass this near each other, of the child's size, meet much the same of it.
const CLOSE: f32 = 1.0 / 700.0;
/// Directions that differ less, of their largest component, are alike.
const ALIKE: f32 = 1.0 / 8.0;

/// Children that take less together, in bytes, are mostly in the cache: then there is nothing to wait for in company.
const SMALL: usize = 4 << 20;
/// Of so many children at most this is asked.
const COUNTED: usize = 64;

/// Whether all children together are small.
pub(super) fn are_small(level: &Level) -> bool {
    let sizes = level.children.iter().filter_map(|child| level.child_at(*child));
    level.children.len() <= COUNTED && sizes.map(|child| child.bytes().len()).sum::<usize>() < SMALL
}

/// Whether most neighbours run so differently that they come to different instances.
pub(super) fn are_unlike(rays: &[Ray]) -> bool {
    let (mut pairs, mut unlike) = (0, 0);
    for pair in rays.windows(2).take(LOOKED_AT) {
        pairs += 1;
        unlike += usize::from(!run_alike(&pair[0], &pair[1]));
    }
    2 * unlike > pairs
}

/// How a child had better be asked about these rays.
///
/// Neighbours that pass further than `far` from each other, of the child's size, are no stream. Where rays begin says
/// little here: those of a camera begin at one point, and come to a small instance as far apart as any.
pub(super) fn manner_of(child: Finished, rays: &[Ray], who: &[Traveller], far: f32) -> Manner {
    let Aabb { lower, upper } = child.header().bounds;
    let (size, middle) =
        (largest_difference(lower, upper), [0, 1, 2].map(|k| 0.5 * (lower[k] + upper[k])));
    let (mut pairs, mut apart, mut sum) = (0, 0, 0.0);
    let pair = rays.iter().zip(who);
    for ((a, of_a), (b, of_b)) in pair.clone().zip(pair.skip(1)).take(LOOKED_AT) {
        let distance = largest_difference(passing(a, middle), passing(b, middle));
        let alike = of_a.instance == of_b.instance && run_alike(a, b);
        pairs += 1;
        sum += if alike { distance } else { f32::INFINITY };
        apart += usize::from(!(alike && distance < far * size));
    }
    match () {
        () if sum < CLOSE * size * pairs as f32 => Manner::AsTheyAre,
        () if 2 * apart < pairs => Manner::Stream,
        () => Manner::Flights,
    }
}

/// Whether two rays run nearly the same way.
fn run_alike(a: &Ray, b: &Ray) -> bool {
    let turned = largest_difference(a.direction, b.direction);
    turned < ALIKE * largest_difference(a.direction, [0.0; 3])
}

/// Where the line of a ray is nearest to a point, or nearly.
fn passing(ray: &Ray, point: [f32; 3]) -> [f32; 3] {
    let Ray { origin: o, direction: d, .. } = *ray;
    let dot = |v: [f32; 3]| v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
    let t = dot([point[0] - o[0], point[1] - o[1], point[2] - o[2]]) / dot(d);
    [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]
}

fn largest_difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).fold(0.0, |largest, k| f32::max(largest, (b[k] - a[k]).abs()))
}
