//! How long something takes: in cycles of this thread where the kernel counts them, and in time.

use std::time::Instant;

#[cfg(target_os = "linux")]
use perf_event::Counter;

/// What one pass took.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Nanoseconds: of this thread on a processor if the kernel tells, else on the wall.
    pub nanoseconds: f64,
    /// Processor cycles outside the kernel, if it counts them.
    pub cycles: Option<f64>,
}

impl Sample {
    /// What ratios are made of: cycles, which a changing clock rate leaves alone, or time.
    pub fn cost(&self) -> f64 {
        self.cycles.unwrap_or(self.nanoseconds)
    }
}

/// The counters at hand.
pub struct Clock {
    #[cfg(target_os = "linux")]
    cycles: Option<Counter>,
    #[cfg(target_os = "linux")]
    on_processor: Option<Counter>,
}

#[cfg(target_os = "linux")]
impl Clock {
    /// Opens what the kernel grants; a virtual machine often has no cycles.
    pub fn new() -> Self {
        use perf_event::Builder;
        use perf_event::events::{Hardware, Software};
        let started = |counter: std::io::Result<Counter>| {
            let mut counter = counter.ok()?;
            counter.enable().ok()?;
            Some(counter)
        };
        Clock {
            cycles: started(Builder::new(Hardware::CPU_CYCLES).build()),
            on_processor: started(Builder::new(Software::TASK_CLOCK).build()),
        }
    }

    /// What is being measured, for the heading of the table.
    pub fn name(&self) -> &'static str {
        match (&self.cycles, &self.on_processor) {
            (Some(_), _) => "ratios of processor cycles",
            (None, Some(_)) => {
                "ratios of this thread's time on the processor (no cycle counter here)"
            }
            (None, None) => "ratios of time on the wall (no counters here)",
        }
    }

    fn read(&mut self) -> (Option<u64>, Option<u64>) {
        let read = |counter: &mut Option<Counter>| counter.as_mut()?.read().ok();
        (read(&mut self.cycles), read(&mut self.on_processor))
    }
}

#[cfg(not(target_os = "linux"))]
impl Clock {
    /// A clock of time on the wall.
    pub fn new() -> Self {
        Clock {}
    }

    /// What is being measured, for the heading of the table.
    pub fn name(&self) -> &'static str {
        "ratios of time on the wall (no counters here)"
    }

    fn read(&mut self) -> (Option<u64>, Option<u64>) {
        (None, None)
    }
}

impl Clock {
    /// Runs `work` and says what it took.
    pub fn time(&mut self, work: impl FnOnce()) -> Sample {
        let before = self.read();
        let started = Instant::now();
        work();
        let wall = started.elapsed().as_nanos() as f64;
        let after = self.read();
        let grown = |a: Option<u64>, b: Option<u64>| {
            let difference = b?.checked_sub(a?)?;
            (difference > 0).then_some(difference as f64)
        };
        Sample {
            nanoseconds: grown(before.1, after.1).unwrap_or(wall),
            cycles: grown(before.0, after.0),
        }
    }
}
