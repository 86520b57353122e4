//! Searches for violations of a bound: how long they go on, and the worst that they saw.

/// The number of samples: `few`, times the environment variable `RAYKERN_SEARCH` if it is set.
pub fn samples(few: u64) -> u64 {
    let times = std::env::var("RAYKERN_SEARCH").ok().and_then(|times| times.parse().ok());
    few * times.unwrap_or(1)
}

/// The largest part of a bound that an error was seen to take.
#[derive(Clone, Debug)]
pub struct Worst {
    name: &'static str,
    ratio: f64,
    seen: u64,
}

impl Worst {
    /// Nothing seen yet.
    pub fn new(name: &'static str) -> Self {
        Worst { name, ratio: 0.0, seen: 0 }
    }

    /// An error and the bound that was granted for it; true when that was not enough.
    pub fn see(&mut self, error: f64, bound: f64) -> bool {
        self.seen += 1;
        let ratio = if error == 0.0 { 0.0 } else { error.abs() / bound };
        // A NaN is too much, and stays.
        self.ratio = if self.ratio <= ratio || ratio.is_nan() { ratio } else { self.ratio };
        ratio.is_nan() || ratio > 1.0
    }

    /// Prints a line of the table, and asserts that the bound held and is not far too wide.
    ///
    /// # Panics
    ///
    /// When the largest ratio is not between `least` and 1.
    pub fn assert_tight(&self, least: f64) {
        let Worst { name, ratio, seen } = self;
        let ratio = &if *seen == 0 { f64::NAN } else { *ratio };
        println!("{name:44} {ratio:7.4} of the bound at most, in {seen} samples");
        assert!(*ratio <= 1.0 && *ratio >= least, "{name}: {ratio}");
    }
}
