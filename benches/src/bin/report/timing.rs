//! Paired runs: all methods on the same rays, in turns, begun by another one each time.

use raykern::{Hit, Ray};
use raykern_bench::lineup::Tracer;
use raykern_bench::watch::Watch;

/// What is asked of all methods.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    pub rays: &'a [Ray],
    /// Whether any hit will do.
    pub any: bool,
    /// Whether neighbours are alike.
    pub coherent: bool,
}

/// A run takes about this long at most, so a slow method answers fewer of the rays, evenly spread.
const RUN_SECONDS: f64 = 0.03;
/// It answers at least as many.
const LEAST: usize = 40;

/// One timed run: how many rays, and the seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed {
    pub method: usize,
    pub run: usize,
    pub rays: usize,
    pub seconds: f64,
}

/// Runs every method `runs` times. Each run follows an untimed one of the same method, so that the caches hold what it reads.
pub fn in_turns(tracers: &[&dyn Tracer], job: &Job, runs: usize) -> Vec<Timed> {
    let mut watch = Watch::new();
    let shares: Vec<Vec<Ray>> =
        tracers.iter().map(|tracer| share(*tracer, job, &mut watch)).collect();
    let mut timed = Vec::new();
    for run in 0..runs {
        for turn in 0..tracers.len() {
            let method = (run + turn) % tracers.len();
            let rays = &shares[method];
            seconds(tracers[method], job, rays, &mut watch);
            let seconds = seconds(tracers[method], job, rays, &mut watch);
            timed.push(Timed { method, run, rays: rays.len(), seconds });
        }
    }
    timed
}

/// As many of the rays as the method answers in the time of a run.
fn share(tracer: &dyn Tracer, job: &Job, watch: &mut Watch) -> Vec<Ray> {
    let sample = spread(job.rays, LEAST);
    seconds(tracer, job, &sample, watch);
    let each = seconds(tracer, job, &sample, watch) / sample.len().max(1) as f64;
    let count = (RUN_SECONDS / each.max(1e-12)) as usize;
    spread(job.rays, count.max(LEAST))
}

/// So many rays of the list, evenly spread, or all of them.
pub fn spread(rays: &[Ray], count: usize) -> Vec<Ray> {
    match count >= rays.len() {
        true => rays.to_vec(),
        false => (0..count).map(|i| rays[i * rays.len() / count]).collect(),
    }
}

fn seconds(tracer: &dyn Tracer, job: &Job, rays: &[Ray], watch: &mut Watch) -> f64 {
    watch.take();
    match job.any {
        true => tracer.any(rays, &mut vec![false; rays.len()], job.coherent, watch),
        false => tracer.closest(rays, &mut vec![Hit::MISS; rays.len()], job.coherent, watch),
    }
    watch.take().seconds
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts nothing and takes no time.
    struct Idle;

    impl Tracer for Idle {
        fn closest(&self, _: &[Ray], _: &mut [Hit], _: bool, watch: &mut Watch) {
            watch.time(|| std::hint::black_box(0));
        }

        fn any(&self, _: &[Ray], _: &mut [bool], _: bool, watch: &mut Watch) {
            watch.time(|| std::hint::black_box(0));
        }
    }

    #[test]
    fn all_take_as_many_turns_and_another_begins_each() {
        let rays = vec![Ray::new([0.0; 3], [1.0; 3]); 100];
        let job = Job { rays: &rays, any: false, coherent: true };
        let timed = in_turns(&[&Idle, &Idle, &Idle], &job, 3);
        let order: Vec<_> = timed.iter().map(|t| (t.run, t.method)).collect();
        let turns = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (1, 0), (2, 2), (2, 0), (2, 1)];
        assert_eq!(order, turns);
        assert!(timed.iter().all(|t| t.rays == 100 && t.seconds >= 0.0));
    }

    #[test]
    fn rays_are_spread_evenly() {
        let rays: Vec<_> = (0..10).map(|i| Ray::new([i as f32, 0.0, 0.0], [1.0; 3])).collect();
        let firsts = |count| spread(&rays, count).iter().map(|r| r.origin[0]).collect::<Vec<_>>();
        assert_eq!(firsts(5), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(firsts(50).len(), 10);
    }
}
