//! Asking and judging: cases of all families, on as many threads as are wanted.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::embree::Embree;
use super::score::{Complaint, Row};
use super::subject::{Answers, Build};
use super::{Case, Family, RAYS_PER_CASE, Scenery, Shot};
use crate::oracle::{Oracle, Verdict};

/// What is to be run.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// The families, each of which gets an equal share of the rays.
    pub families: &'a [Family],
    /// About how many rays in all.
    pub rays: usize,
    /// From which all cases follow.
    pub seed: u64,
    /// Who is asked.
    pub build: Build<'a>,
    /// The compiled program that asks Embree.
    pub embree: Option<&'a Path>,
    /// How many threads.
    pub threads: usize,
}

/// A ray that was answered as it must not be.
#[derive(Clone, Debug)]
pub struct Failure {
    /// What is wrong.
    pub complaint: Complaint,
    /// Which family, case and ray: with the seed they name the ray for good.
    pub family: &'static str,
    /// The number of the case.
    pub case: u64,
    /// The number of the ray in it.
    pub number: usize,
    /// The scene.
    pub scenery: Scenery,
    /// The ray.
    pub shot: Shot,
}

/// What came of a [`Plan`].
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One for each family, in the order of the plan.
    pub rows: Vec<Row>,
    /// The first failures of each case, in the order of the cases.
    pub failures: Vec<Failure>,
}

/// More than this many failures of one case are counted and not kept.
const KEPT_PER_CASE: usize = 2;

/// Runs the plan. The outcome does not depend on the number of threads, but for the seconds.
pub fn run(plan: &Plan) -> Outcome {
    let families = plan.families.len().max(1);
    let cases = plan.rays.div_ceil(families * RAYS_PER_CASE);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut embree = plan.embree.map(Embree::new);
        let mut part =
            Outcome { rows: vec![Row::default(); plan.families.len()], failures: vec![] };
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            // Case by case through all families, so that the slow ones are spread.
            let (family, number) = (job % families, (job / families) as u64);
            if number >= cases as u64 || plan.families.is_empty() {
                return part;
            }
            let case = plan.families[family].case(plan.seed, number);
            let (row, failures) = judge(&case, plan.build, embree.as_mut());
            part.rows[family].merge(&row);
            part.failures.extend(failures.into_iter().map(|(complaint, i)| Failure {
                complaint,
                family: plan.families[family].name,
                case: number,
                number: i,
                scenery: case.scenery.clone(),
                shot: case.shots[i],
            }));
        }
    };
    let parts: Vec<Outcome> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..plan.threads.max(1)).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().expect("a judge finished")).collect()
    });
    let mut outcome = Outcome { rows: vec![Row::default(); plan.families.len()], failures: vec![] };
    for part in parts {
        outcome.rows.iter_mut().zip(&part.rows).for_each(|(row, other)| row.merge(other));
        outcome.failures.extend(part.failures);
    }
    let place = |family| plan.families.iter().position(|f| f.name == family);
    outcome.failures.sort_by_key(|f| (place(f.family), f.case, f.number));
    outcome
}

/// Judges all rays of a case; the complaints come with the numbers of their rays.
fn judge(case: &Case, build: Build, embree: Option<&mut Embree>) -> (Row, Vec<(Complaint, usize)>) {
    let started = Instant::now();
    let mut row = Row::default();
    let mut complaints = Vec::new();
    let oracle = Oracle::with_masks(&case.scenery.model, &case.scenery.masks);
    let embree = embree.map_or_else(Vec::new, |embree| embree.answers(case));
    let subject = calm(|| build(&case.scenery));
    for (i, shot) in case.shots.iter().enumerate() {
        let verdict = oracle.closest(&shot.ray, &shot.options);
        let complaint = match subject.as_deref().and_then(|subject| calm(|| subject.ask(shot))) {
            Some(answers) => row.add(&oracle, shot, &verdict, &answers),
            None => {
                row.differences += 1;
                Some(Complaint("panic"))
            }
        };
        if let Some(hits) = embree.get(i).and_then(Option::as_ref) {
            row.add_embree(&oracle, shot, &verdict, hits);
        }
        if let Some(complaint) = complaint
            && complaints.len() < KEPT_PER_CASE
        {
            complaints.push((complaint, i));
        }
    }
    row.seconds = started.elapsed().as_secs_f64();
    (row, complaints)
}

/// The result, unless it panics.
fn calm<T>(f: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(f)).ok()
}

/// What is wrong with the answers to one ray, if anything, and the answers.
pub fn complaint(
    scenery: &Scenery,
    shot: &Shot,
    build: Build,
) -> (Option<Complaint>, Option<Answers>, Verdict) {
    let oracle = Oracle::with_masks(&scenery.model, &scenery.masks);
    let verdict = oracle.closest(&shot.ray, &shot.options);
    let subject = calm(|| build(scenery));
    let answers = subject.as_deref().and_then(|subject| calm(|| subject.ask(shot)));
    let complaint = match &answers {
        Some(answers) => Row::default().add(&oracle, shot, &verdict, answers),
        None => Some(Complaint("panic")),
    };
    (complaint, answers, verdict)
}

/// For tests: panics when list, grid, BVH or watertight answer as they must not.
///
/// # Panics
///
/// With the answers and the verdict.
pub fn assert_right(scenery: &Scenery, shot: &Shot) {
    let (complaint, answers, verdict) =
        complaint(scenery, shot, &super::subject::Structures::boxed);
    assert!(complaint.is_none(), "{complaint:?}: {answers:#?}\nright: {:?}", Right(&verdict));
}

/// A verdict for people.
struct Right<'a>(&'a Verdict);

impl std::fmt::Debug for Right<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.0.hit {
            None => f.write_str("a miss"),
            Some(hit) => write!(f, "{:?} at t = {:?}", hit.place, hit.t.rounded()),
        }
    }
}
