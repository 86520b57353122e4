//! Axis-aligned boxes.

/// A closed box; empty when a lower coordinate is above its upper one.
///
/// ```text
/// byte 0       12      24
///      | lower | upper |
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub(crate) struct Aabb {
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}
const _: () = assert!(size_of::<Aabb>() == 24);

impl Aabb {
    /// The box around nothing: neutral in unions.
    pub const EMPTY: Aabb = Aabb { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    /// The smallest box around `points`.
    pub fn around(points: &[[f32; 3]]) -> Aabb {
        let mut aabb = Aabb::EMPTY;
        for p in points {
            aabb.add(&Aabb { lower: *p, upper: *p });
        }
        aabb
    }

    /// The lower and the upper corner.
    #[inline(always)]
    pub fn corners(&self) -> [&[f32; 3]; 2] {
        [&self.lower, &self.upper]
    }

    /// Grows the box until it holds `other`. Of equal zeros the box's own stays, on every machine.
    pub fn add(&mut self, other: &Aabb) {
        for k in 0..3 {
            let [lower, upper] = [self.lower[k], self.upper[k]];
            self.lower[k] = if other.lower[k] < lower { other.lower[k] } else { lower };
            self.upper[k] = if other.upper[k] > upper { other.upper[k] } else { upper };
        }
    }

    /// The same without -0: which of equal zeros stays depends on what came first, and bytes shall not.
    pub fn without_minus_zero(&self) -> Aabb {
        Aabb { lower: self.lower.map(|x| x + 0.0), upper: self.upper.map(|x| x + 0.0) }
    }

    /// The point of the box that is nearest to `point` along each axis; `lower` where that is NaN.
    pub fn nearest(&self, point: [f32; 3]) -> [f32; 3] {
        let mut nearest = self.lower;
        for k in 0..3 {
            let above = if point[k] > self.lower[k] { point[k] } else { self.lower[k] };
            nearest[k] = if above < self.upper[k] { above } else { self.upper[k] };
        }
        nearest
    }

    /// The largest coordinate in size; 0 for the empty box.
    #[cfg_attr(target_os = "none", inline(never))]
    pub fn reach(&self) -> f32 {
        let mut reach = 0.0;
        for k in 0..3 {
            for x in [self.lower[k].abs(), self.upper[k].abs()] {
                reach = if x > reach { x } else { reach };
            }
        }
        if self.lower[0] > self.upper[0] { 0.0 } else { reach }
    }
}
