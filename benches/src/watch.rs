//! Time and, where the machine lets us, what the processor counts.

use std::time::Instant;

use raykern_harness::stats;

/// What one timed piece of work cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Seconds of this thread's processor time.
    pub seconds: f64,
    /// In the order of [`EVENTS`], when they can be counted.
    pub events: Option<[f64; EVENTS.len()]>,
}

/// What is counted besides time.
pub const EVENTS: [&str; 4] = ["cycles", "instructions", "branch misses", "L1 data misses"];

/// Times work, and counts where it can.
pub struct Watch {
    counters: Option<counters::Counters>,
    cost: Cost,
}

impl Default for Watch {
    fn default() -> Self {
        Watch::new()
    }
}

impl Watch {
    /// A watch at zero; without counters when the system refuses any of them.
    pub fn new() -> Self {
        Watch { counters: counters::Counters::new(), cost: Cost::default() }
    }

    /// Whether events are counted too.
    pub fn counts_events(&self) -> bool {
        self.counters.is_some()
    }

    /// Adds the cost of `work`.
    pub fn time<R>(&mut self, work: impl FnOnce() -> R) -> R {
        if let Some(counters) = &mut self.counters {
            counters.start();
        }
        let started = thread_seconds();
        let result = work();
        self.cost.seconds += thread_seconds() - started;
        if let Some(counted) = self.counters.as_mut().and_then(counters::Counters::stop) {
            let sums = self.cost.events.get_or_insert_default();
            sums.iter_mut().zip(counted).for_each(|(sum, more)| *sum += more);
        }
        result
    }

    /// The cost since the last call, and starts again from zero.
    pub fn take(&mut self) -> Cost {
        std::mem::take(&mut self.cost)
    }
}

/// The seconds and the result of the median of up to three builds, fewer when they take long.
pub fn timed_build<T>(mut build: impl FnMut() -> T) -> (T, f64) {
    let mut seconds = Vec::new();
    let begun = Instant::now();
    loop {
        let started = thread_seconds();
        let built = build();
        seconds.push(thread_seconds() - started);
        if seconds.len() == 3 || begun.elapsed().as_secs_f64() > 1.0 {
            return (built, median(&seconds));
        }
    }
}

/// The median, of an even number the mean of the middle two; zero of none.
pub fn median(values: &[f64]) -> f64 {
    stats::median(values).unwrap_or(0.0)
}

/// Processor time of this thread: what others on the core take is not in it.
#[cfg(target_os = "linux")]
pub fn thread_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

#[cfg(not(target_os = "linux"))]
pub fn thread_seconds() -> f64 {
    use std::sync::OnceLock;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// Keeps this thread, and those it starts later, on one core. Returns which, where that can be had.
#[cfg(target_os = "linux")]
pub fn stay_on(core: Option<usize>) -> Option<usize> {
    use rustix::thread::{CpuSet, sched_getcpu, sched_setaffinity};
    let core = core.unwrap_or_else(sched_getcpu);
    let mut set = CpuSet::new();
    set.set(core);
    sched_setaffinity(None, &set).ok().map(|()| core)
}

#[cfg(not(target_os = "linux"))]
pub fn stay_on(_core: Option<usize>) -> Option<usize> {
    None
}

#[cfg(target_os = "linux")]
mod counters {
    use perf_event::events::{Cache, CacheId, CacheOp, CacheResult, Hardware};
    use perf_event::{Builder, Counter, Group};

    use super::EVENTS;

    /// The events of one thread, counted together.
    pub struct Counters {
        group: Group,
        events: [Counter; EVENTS.len()],
    }

    impl Counters {
        pub fn new() -> Option<Self> {
            let mut group = Group::new().ok()?;
            let misses =
                Cache { which: CacheId::L1D, operation: CacheOp::READ, result: CacheResult::MISS };
            let hardware = |event| Builder::new(event);
            let events = [
                hardware(Hardware::CPU_CYCLES).build_with_group(&mut group).ok()?,
                hardware(Hardware::INSTRUCTIONS).build_with_group(&mut group).ok()?,
                hardware(Hardware::BRANCH_MISSES).build_with_group(&mut group).ok()?,
                Builder::new(misses).build_with_group(&mut group).ok()?,
            ];
            Some(Counters { group, events })
        }

        pub fn start(&mut self) {
            // Counts that could not be reset or read show as none at all.
            let _ = self.group.reset();
            let _ = self.group.enable();
        }

        pub fn stop(&mut self) -> Option<[f64; EVENTS.len()]> {
            self.group.disable().ok()?;
            let counts = self.group.read().ok()?;
            let counted: Vec<f64> = self.events.iter().map(|event| counts[event] as f64).collect();
            <[f64; EVENTS.len()]>::try_from(counted).ok().filter(|counts| counts[0] > 0.0)
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod counters {
    use super::EVENTS;

    pub struct Counters;

    impl Counters {
        pub fn new() -> Option<Self> {
            None
        }

        pub fn start(&mut self) {}

        pub fn stop(&mut self) -> Option<[f64; EVENTS.len()]> {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median(&[]), 0.0);
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
    }

    #[test]
    fn time_passes() {
        let mut watch = Watch::new();
        let sum: f64 = watch.time(|| (0..1_000_000).map(f64::from).map(f64::sqrt).sum());
        assert!(sum > 0.0 && watch.take().seconds > 0.0 && watch.take().seconds == 0.0);
    }
}
