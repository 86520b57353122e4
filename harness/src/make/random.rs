//! A small source of random numbers whose sequence never changes.

/// SplitMix64: one addition and three mixing steps a number.
///
/// Source: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of `seed`.
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`, which must not be zero.
    pub fn below(&mut self, end: usize) -> usize {
        // The bias of 2^-64 * end is far below what any test here could see.
        ((u128::from(self.bits()) * end as u128) >> 64) as usize
    }

    /// A multiple of 2^-53 in `0 .. 1`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A number in `low .. high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A float of either sign whose exponent is anything from `low` to `high`, subnormals included;
    /// now and then a power of two or zero.
    pub fn wild(&mut self, [low, high]: [i32; 2]) -> f32 {
        let exponent = low + self.below((high - low + 1) as usize) as i32;
        let bits = self.bits();
        let fraction = match bits >> 60 {
            0 => return 0.0,
            1 => 0.0,
            _ => (bits >> 8 & 0x7f_ffff) as f64 / f64::from(1 << 23),
        };
        let sign = if bits & 1 == 0 { 1.0 } else { -1.0 };
        (sign * (1.0 + fraction) * 2f64.powi(exponent)) as f32
    }

    /// A point in the cube `low .. high`.
    pub fn point(&mut self, low: f64, high: f64) -> [f64; 3] {
        std::array::from_fn(|_| self.between(low, high))
    }

    /// A unit vector, all directions alike.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let p = self.point(-1.0, 1.0);
            let square: f64 = p.iter().map(|x| x * x).sum();
            if (1e-6..=1.0).contains(&square) {
                return p.map(|x| x / square.sqrt());
            }
        }
    }
}
