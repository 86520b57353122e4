//! Means, medians and shares with their uncertainty.

use statrs::distribution::{Beta, ContinuousCDF, StudentsT};

use crate::make::Random;

/// What a list of measurements amounts to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// How many.
    pub count: usize,
    /// The least.
    pub min: f64,
    /// The greatest.
    pub max: f64,
    /// The arithmetic mean.
    pub mean: f64,
    /// Half the width of the interval that covers the true mean with a confidence of 95 %, by
    /// Student's t for independent, about normal errors; `None` for a single measurement.
    pub half_width: Option<f64>,
}

impl Summary {
    /// Sums up `samples`; `None` when there are none.
    pub fn of(samples: &[f64]) -> Option<Self> {
        if samples.is_empty() {
            return None;
        }
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let squares: f64 = samples.iter().map(|x| (x - mean).powi(2)).sum();
        let half_width =
            t_95(samples.len() - 1).map(|t| t * (squares / (n - 1.0)).sqrt() / n.sqrt());
        Some(Summary {
            count: samples.len(),
            min: samples.iter().copied().fold(f64::INFINITY, f64::min),
            max: samples.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean,
            half_width,
        })
    }
}

/// How many times larger one thing is than another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// The geometric mean of the pairs' ratios.
    pub mean: f64,
    /// The interval of 95 % confidence; `None` for a single pair.
    pub interval: Option<(f64, f64)>,
}

impl Ratio {
    /// The ratio of `above[i]` to `below[i]`, measured in pairs of positive numbers.
    ///
    /// Works on logarithms, for which a ratio and its inverse are alike. Whatever slowed both
    /// halves of a pair cancels. `None` without pairs.
    pub fn paired(above: &[f64], below: &[f64]) -> Option<Self> {
        let logs: Vec<f64> = above.iter().zip(below).map(|(a, b)| (a / b).ln()).collect();
        let summary = Summary::of(&logs)?;
        let interval = summary
            .half_width
            .map(|half| ((summary.mean - half).exp(), (summary.mean + half).exp()));
        Some(Ratio { mean: summary.mean.exp(), interval })
    }
}

/// The median, of an even number the mean of the middle two; `None` of none.
pub fn median(samples: &[f64]) -> Option<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    (n > 0).then(|| 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]))
}

/// How often samples are drawn anew.
const DRAWS: usize = 2_000;

/// The interval of 95 % confidence of the median, by the bootstrap: the medians of many samples of the same size, drawn with
/// replacement. The same samples always give the same interval. `None` below two samples.
pub fn median_interval(samples: &[f64]) -> Option<(f64, f64)> {
    if samples.len() < 2 {
        return None;
    }
    let mut random = Random::new(1);
    let mut draw = |_| {
        let drawn: Vec<f64> =
            samples.iter().map(|_| samples[random.below(samples.len())]).collect();
        median(&drawn)
    };
    let mut medians: Vec<f64> = (0..DRAWS).filter_map(&mut draw).collect();
    medians.sort_by(f64::total_cmp);
    Some((*medians.get(DRAWS / 40)?, *medians.get(DRAWS - 1 - DRAWS / 40)?))
}

/// The interval of 95 % confidence of the share of which `count` of `of` were seen, by Clopper and Pearson: exact for independent
/// draws. Where none was seen, its upper end has all of the 5 %: some three in `of`.
pub fn share_interval(count: u64, of: u64) -> (f64, f64) {
    let (k, n) = (count as f64, of as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p));
    if of == 0 {
        return (0.0, 1.0);
    }
    if count == 0 {
        return (0.0, 1.0 - 0.05f64.powf(1.0 / n));
    }
    let low = quantile(k, n - k + 1.0, 0.025).unwrap_or(0.0);
    let high = if count >= of { 1.0 } else { quantile(k + 1.0, n - k, 0.975).unwrap_or(1.0) };
    (low, high)
}

/// The factor of a two-sided 95 % interval with that many degrees of freedom; `None` for zero.
fn t_95(freedom: usize) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, freedom as f64).ok()?;
    Some(distribution.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factors_are_those_of_the_tables() {
        for (freedom, expected) in [(1, 12.706), (2, 4.303), (9, 2.262), (100, 1.984)] {
            assert!((t_95(freedom).unwrap() - expected).abs() < 5e-4, "{freedom}");
        }
        assert_eq!(t_95(0), None);
    }

    #[test]
    fn a_summary_of_known_numbers() {
        let summary = Summary::of(&[1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!((summary.min, summary.max, summary.mean), (1.0, 4.0, 2.5));
        // s = sqrt(5 / 3), t(3) = 3.1824
        assert!((summary.half_width.unwrap() - 3.1824 * (5.0f64 / 3.0).sqrt() / 2.0).abs() < 1e-4);
        assert_eq!(Summary::of(&[7.0]).unwrap().half_width, None);
        assert_eq!(Summary::of(&[]), None);
    }

    #[test]
    fn medians_and_their_intervals() {
        assert_eq!((median(&[]), median(&[3.0, 1.0, 2.0])), (None, Some(2.0)));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        let samples: Vec<f64> = (0..101).map(f64::from).collect();
        let (low, high) = median_interval(&samples).unwrap();
        // By the binomial distribution: the 40th and the 60th of 101.
        assert!((37.0..=44.0).contains(&low) && (56.0..=63.0).contains(&high), "{low} {high}");
        assert_eq!(median_interval(&[1.0]), None);
        assert_eq!(median_interval(&[2.0; 5]), Some((2.0, 2.0)));
    }

    #[test]
    fn shares_by_the_tables() {
        let (low, high) = share_interval(0, 1_000_000);
        assert!(low == 0.0 && (high * 1e6 - 2.9957).abs() < 1e-3, "{high}");
        // Clopper and Pearson's own example: 5 of 20.
        let (low, high) = share_interval(5, 20);
        assert!((low - 0.0866).abs() < 1e-3 && (high - 0.4910).abs() < 1e-3, "{low} {high}");
        assert_eq!(share_interval(7, 7).1, 1.0);
    }

    #[test]
    fn a_shared_disturbance_leaves_the_ratio_alone() {
        let ratio = Ratio::paired(&[2.0, 20.0, 6.0], &[1.0, 10.0, 3.0]).unwrap();
        let (low, high) = ratio.interval.unwrap();
        assert!((ratio.mean - 2.0).abs() < 1e-12 && high - low < 1e-9);
        let ratio = Ratio::paired(&[1.0, 4.0], &[1.0, 1.0]).unwrap();
        assert!((ratio.mean - 2.0).abs() < 1e-12);
        assert!(ratio.interval.unwrap().0 < 1.0 && ratio.interval.unwrap().1 > 4.0);
    }
}
