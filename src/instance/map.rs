//! The map of an instance: its inverse, and what the rounding of rays in object space comes to in the world.

use glam::DVec3;

use crate::block::level::InstanceRecord;
use crate::exact::{Line, volumes};
use crate::math::rounding::UNIT32;
use crate::math::{Aabb, wide};
use crate::ray::Ray;
use crate::simd::{Doubles, Halves, Simd};

/// `p -> A p + b`, and the inverse of `A`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map {
    pub object_to_world: [f32; 12],
    /// Each number within `4 UNIT` of the real inverse's.
    pub world_to_object: [[f64; 3]; 3],
}

/// Beyond these, what the inverse and the least floats take away is no longer far below a unit of `f32`: such an instance
/// is visited by every ray.
const WILD: f64 = (1u64 << 40) as f64;

/// Coordinates of boxes count as no larger than this, which is beyond all that can be hit.
const FAR: f64 = 1e39;

impl Map {
    /// The map with these three rows of four; `None` if it is not finite or has no inverse.
    ///
    /// The determinant is exact in sign, and within `1.001 UNIT`; the minors are differences of exact products.
    pub fn new(object_to_world: [f32; 12]) -> Option<Map> {
        let rows = rows(&object_to_world);
        Self::with(object_to_world, rows, exact_determinant(rows))
    }

    /// The same with an inverse that may be off by `2^-30` of itself: for those who look at many maps before they use any.
    pub fn roughly(object_to_world: [f32; 12]) -> Option<Map> {
        let rows = rows(&object_to_world);
        let [a, b, c] = rows.map(wide);
        let minors = minors(b, c);
        let (sum, size) = (a.dot(minors), a.abs().dot(minors.abs()));
        // Of six roundings, each within `UNIT` of the size.
        let is_clear = sum.abs() > size / (1u64 << 20) as f64 && size < f64::INFINITY;
        Self::with(object_to_world, rows, if is_clear { sum } else { exact_determinant(rows) })
    }

    fn with(object_to_world: [f32; 12], rows: [[f32; 3]; 3], determinant: f64) -> Option<Map> {
        if determinant == 0.0 || !object_to_world.iter().all(|x| x.is_finite()) {
            return None;
        }
        let [a, b, c] = rows.map(wide);
        let [x, y, z] = [minors(b, c), minors(c, a), minors(a, b)].map(|p| p / determinant);
        let world_to_object = [[x.x, y.x, z.x], [x.y, y.y, z.y], [x.z, y.z, z.z]];
        Some(Map { object_to_world, world_to_object })
    }

    /// The box around an instance of what is in `aabb`, conservatively, before it is widened.
    pub fn bounds(&self, aabb: &Aabb) -> [DVec3; 2] {
        let (lower, upper) = (clamped(aabb.lower).to_array(), clamped(aabb.upper).to_array());
        let (mut least, mut most) = (self.shift(), self.shift());
        let mut size = self.shift().abs();
        for (column, (lower, upper)) in self.linear().into_iter().zip(lower.into_iter().zip(upper))
        {
            let (p, q) = (column * lower, column * upper);
            least += p.min(q);
            most += p.max(q);
            size += p.abs().max(q.abs());
        }
        // Three products, and three sums that are rounded.
        let rounding = size / (1u64 << 50) as f64;
        [least - rounding, most + rounding]
    }

    /// What three sums of three products and the shift may be off, for points of `aabb`.
    pub fn rounding(&self, aabb: &Aabb) -> DVec3 {
        let contents = clamped(aabb.lower).abs().max(clamped(aabb.upper).abs());
        (self.widest(contents) + self.shift().abs()) / (1u64 << 50) as f64
    }

    /// How far a point of a ray may be, along each axis, from where the instance of what its rounded ray meets is, when the ray
    /// comes from at most `distance` along each axis. Infinite for wild maps.
    ///
    /// See `docs/METHODS.md`, "Instances".
    pub fn blur(&self, aabb: &Aabb, distance: f64) -> DVec3 {
        if self.is_wild() {
            return DVec3::INFINITY;
        }
        let origin = DVec3::splat(distance) + self.shift().abs();
        let contents = clamped(aabb.lower).abs().max(clamped(aabb.upper).abs());
        let met = self.widest(self.widest_inverse(origin) * 2.0 + contents);
        let inverse = self.widest(self.widest_inverse(met));
        let least = self.widest(DVec3::splat(f64::from(f32::from_bits(1))));
        met * (1.125 * f64::from(UNIT32)) + inverse / (1u64 << 49) as f64 + least
    }

    /// By how much more than at any distance this grows for each unit that the ray comes from further away.
    pub fn spread(&self) -> f64 {
        let condition = self.condition();
        condition * (2.25 * f64::from(UNIT32) + condition / (1u64 << 47) as f64)
    }

    /// The inverse as a [record](InstanceRecord) has it.
    pub fn columns(&self) -> [f64; 10] {
        let rows = &self.world_to_object;
        core::array::from_fn(|i| {
            rows.get(i % 3).filter(|_| i < 9).map_or(0.0, |row| row[i / 3 % 3])
        })
    }

    fn is_wild(&self) -> bool {
        // Written so that a NaN is wild.
        let size = self.widest(DVec3::ONE).max_element();
        !(size <= WILD && self.condition() <= WILD)
    }

    /// The largest row of `|A| |A^-1|`.
    fn condition(&self) -> f64 {
        self.widest(self.widest_inverse(DVec3::ONE)).max_element()
    }

    /// `|A| v`.
    pub fn widest(&self, v: DVec3) -> DVec3 {
        let [x, y, z] = self.linear().map(DVec3::abs);
        x * v.x + y * v.y + z * v.z
    }

    /// `|A^-1| v`.
    fn widest_inverse(&self, v: DVec3) -> DVec3 {
        DVec3::from(self.world_to_object.map(|row| DVec3::from(row).abs().dot(v)))
    }

    /// The columns of `A`.
    pub fn linear(&self) -> [DVec3; 3] {
        let [ax, bx, cx, _, ay, by, cy, _, az, bz, cz, _] = self.object_to_world;
        [wide([ax, ay, az]), wide([bx, by, bz]), wide([cx, cy, cz])]
    }

    /// `b`.
    pub fn shift(&self) -> DVec3 {
        let m = &self.object_to_world;
        wide([m[3], m[7], m[11]])
    }

    /// `A p + b`.
    pub fn point(&self, p: DVec3) -> DVec3 {
        let [x, y, z] = self.linear();
        x * p.x + y * p.y + z * p.z + self.shift()
    }

    /// The inverse transpose times `n`.
    pub fn normal(&self, n: DVec3) -> DVec3 {
        let [x, y, z] = self.world_to_object.map(DVec3::from);
        x * n.x + y * n.y + z * n.z
    }
}

fn rows(m: &[f32; 12]) -> [[f32; 3]; 3] {
    let [ax, bx, cx, _, ay, by, cy, _, az, bz, cz, _] = *m;
    [[ax, bx, cx], [ay, by, cy], [az, bz, cz]]
}

/// `a . (b x c)`; zero if that is not finite.
fn exact_determinant(rows: [[f32; 3]; 3]) -> f64 {
    if !rows.as_flattened().iter().all(|x| x.is_finite()) {
        return 0.0;
    }
    let [a, b, c] = rows;
    // The volume of the second pair.
    let [_, determinant, _] = volumes(&Line { origin: [0.0; 3], direction: a }, &[b, c, b]);
    determinant
}

/// `p x q` of floats: each product is exact, so each component is rounded once.
fn minors(p: DVec3, q: DVec3) -> DVec3 {
    p.cross(q)
}

fn clamped(p: [f32; 3]) -> DVec3 {
    wide(p).clamp(DVec3::splat(-FAR), DVec3::splat(FAR))
}

impl InstanceRecord {
    /// The map.
    pub fn map(&self) -> Map {
        let InstanceRecord { object_to_world, .. } = *self;
        Map { object_to_world, world_to_object: self.inverse() }
    }

    /// A column of the inverse, and what follows it.
    #[inline(always)]
    fn column(&self, k: usize) -> &[f64; 4] {
        self.world_to_object[3 * k..].first_chunk().unwrap_or(&[0.0; 4])
    }

    /// The rows of the inverse.
    #[inline(always)]
    fn inverse(&self) -> [[f64; 3]; 3] {
        let [a, b, c, d, e, f, g, h, i, _] = self.world_to_object;
        [[a, d, g], [b, e, h], [c, f, i]]
    }

    /// The ray in object space: sums in `f64`, in this order and without fusing, rounded once. `None` when a component of that
    /// leaves the range of `f32`, or the direction becomes zero: then the instance is not hit.
    #[inline(always)]
    pub fn object_ray(&self, ray: &Ray) -> Option<Ray> {
        let [_, _, _, shift_x, _, _, _, shift_y, _, _, _, shift_z] = self.object_to_world;
        let from = |x: f32, shift: f32| f64::from(x) - f64::from(shift);
        let [x, y, z] = ray.origin;
        let o = [from(x, shift_x), from(y, shift_y), from(z, shift_z)];
        let d = ray.direction.map(f64::from);
        let mapped =
            |v: [f64; 3]| self.inverse().map(|[x, y, z]| ((x * v[0] + y * v[1]) + z * v[2]) as f32);
        let (origin, direction) = (mapped(o), mapped(d));
        let finite = origin.iter().chain(&direction).all(|x| x.is_finite());
        let moves = direction.iter().any(|x| *x != 0.0);
        (finite && moves).then_some(Ray { origin, direction, ..*ray })
    }

    /// The same up to `t_max` by vectors where these are fast, in `room`, which is written as a whole, since vectors read it soon.
    /// If there is no such ray this may also be one that hits nothing by definition.
    #[inline(always)]
    pub fn object_ray_by<'r, S: Simd>(
        &self,
        s: S,
        ray: &Ray,
        t_max: f32,
        room: &'r mut [f32; 8],
    ) -> Option<&'r Ray> {
        if S::FLIES {
            let row = ray.row();
            let m = &self.object_to_world;
            let shift = [m[3], m[7], m[11], 0.0, 0.0, 0.0, 0.0, 0.0];
            let from = s.widened(row).sub(s.widened(&shift));
            let [x, y, z] = from.spread();
            let sum = s.twice(self.column(0)).mul(x).add(s.twice(self.column(1)).mul(y));
            let sum = sum.add(s.twice(self.column(2)).mul(z));
            *room = s.narrowed(sum.beside(from, f64::from(t_max)));
        } else {
            let [from, along] = self.object_ray(&Ray { t_max, ..*ray })?.rows();
            room[..4].copy_from_slice(&from);
            room[4..].copy_from_slice(&along);
        }
        Some(Ray::of_row(room))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Extent;
    use crate::simd::{self, Kernel, Scalar};

    #[test]
    fn only_maps_without_volume_are_singular() {
        let with = |m: [f32; 9]| {
            Map::new([m[0], m[1], m[2], 1.0, m[3], m[4], m[5], 2.0, m[6], m[7], m[8], 3.0])
        };
        assert!(with([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]).is_none());
        assert!(with([1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 0.0, 0.0, 1.0]).is_none());
        assert!(with([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]).is_none());
        assert!(with([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0f32.next_up()]).is_some());
        assert!(with([f32::NAN, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).is_none());
        assert!(with([1e-44, 0.0, 0.0, 0.0, 1e-44, 0.0, 0.0, 0.0, 1e-44]).is_some());
        assert!(with([3e38, 0.0, 0.0, 0.0, 3e38, 0.0, 0.0, 0.0, 3e38]).is_some());
    }

    #[test]
    fn vectors_map_rays_as_numbers_do() {
        struct Compare<'a>(&'a InstanceRecord, &'a Ray);
        impl Kernel for Compare<'_> {
            type Output = ();

            fn run<S: Simd>(self, s: S) {
                let Compare(record, ray) = self;
                let limited = Ray { t_max: 7.0, ..*ray };
                let (expected, mut room) = (record.object_ray(&limited), [0.0; 8]);
                let mapped = record.object_ray_by(s, ray, 7.0, &mut room);
                let bits = |ray: &Ray| ray.row().map(f32::to_bits);
                match expected {
                    Some(expected) => assert_eq!(mapped.map(bits), Some(bits(&expected))),
                    // Whoever is asked about it finds out.
                    None => {
                        assert!(mapped.is_none_or(|ray| ray.prepare(Extent::new(1.0, 1)).is_none()))
                    }
                }
            }
        }
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 8) as f32 / (1 << 22) as f32 - 2.0
        };
        for i in 0..500 {
            let size = [1.0, 1e-30, 1e20, 3e37][i % 4];
            let Some(map) = Map::new([0; 12].map(|_| next() * size)) else { continue };
            let record = InstanceRecord {
                world_to_object: map.columns(),
                child: 0,
                mask: 0,
                object_to_world: map.object_to_world,
                bounds: Aabb::EMPTY,
            };
            let inverse = record.map().world_to_object;
            assert_eq!(inverse, map.world_to_object);
            let direction = if i % 9 == 0 { [0.0, -0.0, next()] } else { [0; 3].map(|_| next()) };
            let ray = Ray::new([0; 3].map(|_| next() * size), direction);
            let compare = || Compare(&record, &ray);
            simd::dispatch(compare());
            Scalar.run(compare());
        }
    }

    #[test]
    fn rough_maps_are_nearly_right() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        for i in 0..1000 {
            let mut m = [0; 12].map(|_| next());
            // Half of them nearly flat: their determinants are exact.
            for k in (0..3).filter(|_| i % 2 == 0) {
                m[8 + k] = m[k] + m[4 + k];
            }
            let maps = Map::new(m).zip(Map::roughly(m));
            assert_eq!(maps.is_some(), Map::roughly(m).is_some());
            let Some((map, rough)) = maps else { continue };
            let pairs = map.world_to_object.into_iter().zip(rough.world_to_object);
            for (x, y) in pairs.flat_map(|(x, y)| x.into_iter().zip(y)) {
                assert!((x - y).abs() <= x.abs() / (1u64 << 30) as f64, "{m:?}");
            }
        }
    }

    #[test]
    fn a_nearly_singular_map_has_a_good_inverse() {
        let m = [1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.0, 7.0, 8.0, 9.0f32.next_up(), 0.0];
        let map = Map::new(m).expect("an inverse");
        // The determinant is -3 times a unit of 9: the upper left minor over it, in whole numbers of that unit.
        let unit = f64::from(9.0f32.next_up()) - 9.0;
        let expected = (5.0 * (9.0 + unit) - 48.0) / (-3.0 * unit);
        assert!((map.world_to_object[0][0] / expected - 1.0).abs() < 1e-15);
    }
}
