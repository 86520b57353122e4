//! Power laws through measured points, and what they predict.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// `y = factor * x^exponent`, by least squares of logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// At x = 1.
    pub factor: f64,
    /// How much faster than x it grows, if above one.
    pub exponent: f64,
    points: f64,
    /// Of the logarithms of x: their mean and the sum of the squares around it.
    mean: f64,
    spread: f64,
    /// The standard deviation of what is left, in logarithms.
    left: f64,
}

impl PowerLaw {
    /// Through at least three points of two different x, all numbers positive.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
        let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
        let spread: f64 = logs.iter().map(|p| (p.0 - mx).powi(2)).sum();
        let exponent = logs.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>() / spread;
        let rest = |p: &(f64, f64)| (p.1 - my - exponent * (p.0 - mx)).powi(2);
        let left = (logs.iter().map(rest).sum::<f64>() / (n - 2.0)).sqrt();
        let factor = (my - exponent * mx).exp();
        let sound = points.len() >= 3 && factor.is_finite() && left.is_finite();
        sound.then_some(PowerLaw { factor, exponent, points: n, mean: mx, spread, left })
    }

    /// The value at `x`, and the interval in which a measurement there would lie with 95 %, if the law holds that far.
    pub fn at(&self, x: f64) -> (f64, (f64, f64)) {
        let middle = self.factor.ln() + self.exponent * x.ln();
        let far = (x.ln() - self.mean).powi(2) / self.spread;
        let deviation = self.left * (1.0 + 1.0 / self.points + far).sqrt();
        let t = StudentsT::new(0.0, 1.0, self.points - 2.0)
            .map_or(f64::INFINITY, |t| t.inverse_cdf(0.975));
        let half = t * deviation;
        (middle.exp(), ((middle - half).exp(), (middle + half).exp()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_law_is_found_and_predicts_itself() {
        let points: Vec<_> = [1e3, 1e4, 1e5, 1e6].map(|x: f64| (x, 2.5 * x.powf(1.25))).to_vec();
        let law = PowerLaw::through(&points).unwrap();
        assert!((law.factor - 2.5).abs() < 1e-9 && (law.exponent - 1.25).abs() < 1e-12);
        let (y, (low, high)) = law.at(1e9);
        assert!((y / 2.5 / 1e9f64.powf(1.25) - 1.0).abs() < 1e-9 && high / low < 1.0 + 1e-6);
    }

    #[test]
    fn what_scatters_is_predicted_with_an_interval() {
        let points = [(1e3, 1.1e3), (1e4, 0.9e4), (1e5, 1.1e5), (1e6, 0.9e6)];
        let law = PowerLaw::through(&points).unwrap();
        let [near, far] = [1e5, 1e9].map(|x| law.at(x).1);
        assert!(near.0 < 1e5 && near.1 > 1e5);
        assert!(far.1 / far.0 > 2.0 * near.1 / near.0);
        assert_eq!(PowerLaw::through(&points[..2]), None);
        assert_eq!(PowerLaw::through(&[(1.0, 2.0); 4]), None);
    }
}
