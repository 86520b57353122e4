//! An axis: from numbers to pixels, and where its ticks are.

use super::draw::{digits, label};

/// How an axis counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By factors.
    Log,
    /// By factors, with a place of its own for zero at the low end.
    LogWithZero,
}

/// An axis before it is drawn.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What is counted, with its unit.
    pub label: String,
    /// How.
    pub scale: Scale,
}

impl Axis {
    /// An axis with these words.
    pub fn new(label: impl Into<String>, scale: Scale) -> Self {
        Axis { label: label.into(), scale }
    }
}

/// An axis on paper: pixels grow from `from` to `to`, whichever is greater.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    scale: Scale,
    low: f64,
    high: f64,
    from: i32,
    to: i32,
}

/// The share of an axis that zero has to itself.
const ZERO: f64 = 0.1;

impl Placed {
    /// Wide enough for all values that can be shown.
    pub fn over(scale: Scale, values: impl Iterator<Item = f64>, [from, to]: [i32; 2]) -> Self {
        let shown = |x: &f64| x.is_finite() && (scale == Scale::Linear || *x > 0.0);
        let (low, high) = values
            .filter(shown)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let (low, high) = if low > high { (0.1, 1.0) } else { (low, high) };
        let (low, high) = match scale {
            Scale::Linear => (low.min(0.0), if high > 0.0 { 1.05 * high } else { 1.0 }),
            _ => around(low, high),
        };
        Placed { scale, low, high, from, to }
    }

    /// The pixel of a value; those beyond the ends are at them.
    pub fn at(&self, value: f64) -> i32 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log => self.log_share(value),
            Scale::LogWithZero if value <= 0.0 => 0.5 * ZERO,
            Scale::LogWithZero => ZERO + (1.0 - ZERO) * self.log_share(value).clamp(0.0, 1.0),
        };
        self.from + (share.clamp(0.0, 1.0) * f64::from(self.to - self.from)).round() as i32
    }

    fn log_share(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }

    /// Values with a line across the chart, and their words.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        if self.scale == Scale::Linear {
            let step = even_step(self.high - self.low);
            let count = ((self.high - self.low) / step) as i32;
            return (0..=count).map(|i| f64::from(i) * step).map(|x| (x, digits(x))).collect();
        }
        let zero = (self.scale == Scale::LogWithZero).then(|| (0.0, "0".to_owned()));
        zero.into_iter().chain(log_ticks(self.low, self.high)).collect()
    }
}

/// A little further out than both.
fn around(low: f64, high: f64) -> (f64, f64) {
    (low / 1.25, high * 1.25)
}

/// Powers of ten, each or each so many; where these are few, what is between them; and over a narrow range even steps.
fn log_ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let [first, last] = [low.log10().ceil() as i32, high.log10().floor() as i32];
    let power = |p: i32| 10f64.powi(p);
    if last - first >= 2 {
        let step = 1 + (last - first) as usize / 9;
        let powers = (first..=last).step_by(step);
        return powers.map(|p| (power(p), label(power(p)))).collect();
    }
    if high / low < 3.0 {
        let step = even_step(high - low);
        let numbers = (low / step).ceil() as i64..=(high / step).floor() as i64;
        return numbers.map(|i| i as f64 * step).map(|x| (x, short(x))).collect();
    }
    let between: &[f64] =
        if high / low < 20.0 { &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0] } else { &[1.0, 2.0, 5.0] };
    let steps = (first - 1..=last).flat_map(|p| between.iter().map(move |m| m * power(p)));
    let within = steps.filter(|x| (low..=high).contains(x));
    within.map(|x| (x, short(x))).collect()
}

/// Without zeros at the end.
fn short(x: f64) -> String {
    let text = digits(x);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// One, two or five times a power of ten, some five to a width.
fn even_step(width: f64) -> f64 {
    let power = 10f64.powf((width / 5.0).log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * power * 6.0 >= width);
    factor.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_has_a_place_of_its_own_below_the_least() {
        let values = [0.0, 3.0, 40_000.0];
        let axis = Placed::over(Scale::LogWithZero, values.into_iter(), [500, 100]);
        assert!(axis.at(0.0) > axis.at(3.0) && axis.at(3.0) > axis.at(40_000.0));
        assert!((100..=500).contains(&axis.at(0.0)));
        let words: Vec<_> = axis.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(words, ["0", "10", "100", "1,000", "10,000"]);
    }

    #[test]
    fn narrow_axes_have_ticks_between_powers_of_ten() {
        let axis = Placed::over(Scale::Log, [0.4, 1.6].into_iter(), [0, 100]);
        let words: Vec<_> = axis.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(words, ["0.5", "0.7", "1", "1.5", "2"]);
        let axis = Placed::over(Scale::Log, [1.0, 1.2].into_iter(), [0, 100]);
        let words: Vec<_> = axis.ticks().into_iter().map(|tick| tick.1).collect();
        assert_eq!(words, ["0.8", "1", "1.2", "1.4"]);
        let axis = Placed::over(Scale::Linear, [10.0, 90.0].into_iter(), [0, 100]);
        assert_eq!(axis.ticks().len(), 5);
    }
}
