//! The exact parameter of a hit: rational on triangles, quadratic on spheres.

use std::cmp::Ordering;

use super::dyadic::Dyadic;

/// The real number `(p + q * sqrt(s)) / divisor`, with `s >= 0` and `divisor > 0`.
#[derive(Clone, Debug)]
pub struct Root {
    p: Dyadic,
    q: i32,
    s: Dyadic,
    divisor: Dyadic,
}

impl Root {
    /// `p / divisor`; `divisor` is not zero.
    pub fn rational(p: Dyadic, divisor: Dyadic) -> Self {
        let (p, divisor) = if divisor.sign() < 0 { (-p, -divisor) } else { (p, divisor) };
        Root { p, q: 0, s: Dyadic::zero(), divisor }
    }

    /// `(p + q * sqrt(s)) / divisor` with `q` -1 or 1, `s >= 0` and `divisor > 0`.
    pub fn quadratic(p: Dyadic, q: i32, s: Dyadic, divisor: Dyadic) -> Self {
        Root { p, q, s, divisor }
    }

    /// A float as an exact number.
    pub fn float(x: f32) -> Self {
        Self::rational(Dyadic::from_f32(x), Dyadic::from_f32(1.0))
    }

    /// The same distance from zero, on the positive side.
    pub fn magnitude(&self) -> Self {
        match self.cmp(&Root::float(0.0)) {
            Ordering::Less => Root { p: -self.p.clone(), q: -self.q, ..self.clone() },
            _ => self.clone(),
        }
    }

    /// Within a few units of 1e-16 of `|p| + sqrt(s)` over the divisor.
    pub fn approximate(&self) -> f64 {
        let irrational = f64::from(self.q) * self.s.sqrt_ratio(&self.divisor);
        self.p.ratio(&self.divisor) + irrational
    }

    /// The nearest float, of two equally near ones the even one, and +0 for every zero.
    ///
    /// The number must not be beyond the largest float.
    pub fn rounded(&self) -> f32 {
        let guess = (self.approximate() as f32).clamp(-f32::MAX, f32::MAX);
        let near = |x: f32| self.is_nearest(x);
        let close = [guess, guess.next_up(), guess.next_down()].into_iter().find(|x| near(*x));
        close.unwrap_or_else(|| self.bisected()) + 0.0
    }

    fn is_nearest(&self, x: f32) -> bool {
        let even = x.to_bits() & 1 == 0;
        let beats = |neighbour: f32, beyond: Ordering| {
            if !neighbour.is_finite() {
                return true;
            }
            let sum = &Dyadic::from_f32(x) + &Dyadic::from_f32(neighbour);
            let order = self.cmp(&Root::rational(sum.half(), Dyadic::from_f32(1.0)));
            order != beyond && (even || order != Ordering::Equal)
        };
        x.is_finite()
            && beats(x.next_up(), Ordering::Greater)
            && beats(x.next_down(), Ordering::Less)
    }

    /// The nearest float when no guess is good: by halving the list of all floats.
    fn bisected(&self) -> f32 {
        let (mut low, mut high) = (ordinal(-f32::MAX), ordinal(f32::MAX));
        // The largest float that is not above the number.
        while low < high {
            let middle = low + (high - low + 1) / 2;
            match Root::float(from_ordinal(middle)).cmp(self) {
                Ordering::Greater => high = middle - 1,
                _ => low = middle,
            }
        }
        let below = from_ordinal(low);
        if self.is_nearest(below) { below } else { below.next_up() }
    }
}

/// The place of `x` among all floats.
fn ordinal(x: f32) -> i64 {
    let bits = i64::from(x.to_bits() & 0x7fff_ffff);
    if x.is_sign_negative() { -bits } else { bits }
}

fn from_ordinal(n: i64) -> f32 {
    let magnitude = f32::from_bits(n.unsigned_abs() as u32);
    if n < 0 { -magnitude } else { magnitude }
}

/// How many floats apart two floats are.
pub fn ulps_apart(a: f32, b: f32) -> u64 {
    (ordinal(a) - ordinal(b)).unsigned_abs()
}

/// The sign of `a + b * sqrt(s)`.
fn sign_with_root(a: &Dyadic, b: &Dyadic, s: &Dyadic) -> i32 {
    let (sign_a, sign_b) = (a.sign(), b.sign() * s.sign());
    if sign_a == 0 || sign_b == 0 || sign_a == sign_b {
        return if sign_a == 0 { sign_b } else { sign_a };
    }
    let (a2, b2s) = (a * a, &(b * b) * s);
    sign_a * (&a2 - &b2s).sign()
}

/// The sign of `a + b * sqrt(s) + c * sqrt(r)`.
fn sign_with_roots(a: &Dyadic, b: &Dyadic, s: &Dyadic, c: &Dyadic, r: &Dyadic) -> i32 {
    let left = sign_with_root(a, b, s);
    let right = c.sign() * r.sign();
    if left == 0 || right == 0 || left == right {
        return if left == 0 { right } else { left };
    }
    // |a + b sqrt(s)|^2 - |c sqrt(r)|^2
    let squares = &(&(a * a) + &(&(b * b) * s)) - &(&(c * c) * r);
    let ab = a * b;
    left * sign_with_root(&squares, &(&ab + &ab), s)
}

impl Ord for Root {
    fn cmp(&self, other: &Self) -> Ordering {
        let times = |q: i32, d: &Dyadic| match q {
            0 => Dyadic::zero(),
            1 => d.clone(),
            _ => -d.clone(),
        };
        let a = &(&self.p * &other.divisor) - &(&other.p * &self.divisor);
        let b = times(self.q, &other.divisor);
        let c = times(-other.q, &self.divisor);
        sign_with_roots(&a, &b, &self.s, &c, &other.s).cmp(&0)
    }
}

impl PartialOrd for Root {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Root {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Root {}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(x: f32) -> Dyadic {
        Dyadic::from_f32(x)
    }

    fn quadratic(p: f32, q: i32, s: f32, divisor: f32) -> Root {
        Root::quadratic(number(p), q, number(s), number(divisor))
    }

    #[test]
    fn roots_compare_as_real_numbers() {
        // sqrt(2) < 17/12 < sqrt(3), sqrt(8)/2 = sqrt(2), 3 - sqrt(2) < sqrt(3).
        let fraction = Root::rational(number(-17.0), number(-12.0));
        let root2 = quadratic(0.0, 1, 2.0, 1.0);
        assert!(root2 < fraction && fraction < quadratic(0.0, 1, 3.0, 1.0));
        assert_eq!(quadratic(0.0, 1, 8.0, 2.0), root2);
        assert!(quadratic(3.0, -1, 2.0, 1.0) < quadratic(0.0, 1, 3.0, 1.0));
        assert_eq!(quadratic(1.0, -1, 4.0, 1.0), Root::float(-1.0));
        assert_eq!(quadratic(0.0, -1, 2.0, 1.0).magnitude(), root2);
    }

    #[test]
    fn rounding_is_to_nearest_and_to_even() {
        let up = 1.0f32.next_up();
        let middle = (&number(1.0) + &number(up)).half();
        let exactly = |p: Dyadic| Root::rational(p, number(1.0)).rounded();
        assert_eq!(exactly(middle.clone()), 1.0);
        assert_eq!(exactly(&middle + &number(1e-40)), up);
        assert_eq!(exactly((&number(up) + &number(up.next_up())).half()), up.next_up());
        assert_eq!(exactly(number(1e-45).half()).to_bits(), 0);
        assert_eq!(exactly(-number(1e-45).half()).to_bits(), 0);
        assert_eq!(exactly(&number(f32::MAX) - &number(1e-45)), f32::MAX);
        assert_eq!(quadratic(0.0, 1, 2.0, 1.0).rounded(), 2f64.sqrt() as f32);
    }

    #[test]
    fn cancellation_does_not_spoil_the_rounding() {
        // x - sqrt(x^2 - tiny): no digit of the guess is right.
        let x = number(1.0);
        let s = &x - &number(1e-40);
        let root = Root::quadratic(x, -1, s, number(1.0));
        assert_eq!(root.rounded(), 1e-40f32 / 2.0);
        for x in [0.0, 1.0, -1.0, f32::MAX, -f32::MAX, 1e-45] {
            assert_eq!(Root::float(x).bisected(), x);
        }
    }
}
