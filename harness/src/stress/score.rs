//! Counts of what was answered, and what must never happen.

use raykern::Hit;

use super::Shot;
use super::subject::{Answers, bits};
use crate::oracle::{Judgement, Oracle, Place, Verdict};

/// The judgements of one answerer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Rays judged.
    pub rays: u64,
    /// The ray hits something, and nothing was named.
    pub false_misses: u64,
    /// The ray does not hit what was named.
    pub false_hits: u64,
    /// Another primitive is hit at a smaller t.
    pub wrong_prims: u64,
    /// Another primitive than the first of those hit at the least t.
    pub wrong_ties: u64,
    /// The right primitive and not the nearest float to t.
    pub wrong_ts: u64,
    /// The right primitive and a t more than 64 floats from the nearest one.
    pub far_ts: u64,
    /// The right primitive and t, and weights out of their bound.
    pub wrong_weights: u64,
    /// The largest distance, in floats, of a t from the nearest float.
    pub worst_ulps: u64,
}

impl Score {
    fn add(&mut self, judgement: Judgement, tie: bool) {
        self.rays += 1;
        match judgement {
            Judgement::Right => {}
            Judgement::FalseMiss => self.false_misses += 1,
            Judgement::FalseHit => self.false_hits += 1,
            Judgement::WrongPrim if tie => self.wrong_ties += 1,
            Judgement::WrongPrim => self.wrong_prims += 1,
            Judgement::WrongT { ulps } => {
                self.wrong_ts += 1;
                self.far_ts += u64::from(ulps > 64);
                self.worst_ulps = self.worst_ulps.max(ulps);
            }
            Judgement::WrongWeights { .. } => self.wrong_weights += 1,
        }
    }

    fn merge(&mut self, other: &Score) {
        self.rays += other.rays;
        self.false_misses += other.false_misses;
        self.false_hits += other.false_hits;
        self.wrong_prims += other.wrong_prims;
        self.wrong_ties += other.wrong_ties;
        self.wrong_ts += other.wrong_ts;
        self.far_ts += other.far_ts;
        self.wrong_weights += other.wrong_weights;
        self.worst_ulps = self.worst_ulps.max(other.worst_ulps);
    }
}

/// What a family of cases came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Rays shot.
    pub rays: u64,
    /// Rays that hit something.
    pub hits: u64,
    /// Rays with several primitives at the least t.
    pub ties: u64,
    /// Rays on which list, grid and BVH differ in any bit, or `occluded` from `intersect`.
    pub differences: u64,
    /// Ours: for each ray the first answer of list, grid and BVH that is not right.
    pub exact: Score,
    /// The BVH in watertight precision.
    pub watertight: Score,
    /// Embree by default and with its robust flag, on the rays it may be asked.
    pub embree: [Score; 2],
    /// Thread seconds from the scene to the last verdict.
    pub seconds: f64,
}

/// What must never happen. Two are equal when they are of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Complaint(pub &'static str);

impl Row {
    /// Counts the answers to one ray, and says what must not be among them.
    pub fn add(
        &mut self,
        oracle: &Oracle,
        shot: &Shot,
        verdict: &Verdict,
        answers: &Answers,
    ) -> Option<Complaint> {
        let judge = |hit| oracle.judge_by(verdict, &shot.ray, &shot.options, hit);
        self.rays += 1;
        self.hits += u64::from(verdict.hit.is_some());
        self.ties += u64::from(!verdict.equal_t.is_empty());
        let differ = differ(answers);
        self.differences += u64::from(differ.is_some());
        // Equal answers are judged once.
        let all = if differ.is_some() { &answers.exact[..] } else { &answers.exact[..1] };
        let judged = all.iter().map(|hit| (judge(*hit), *hit));
        let wrong = judged.into_iter().find(|(judgement, _)| *judgement != Judgement::Right);
        let (judgement, hit) = wrong.unwrap_or((Judgement::Right, None));
        self.exact.add(judgement, is_tie(verdict, hit));
        // Who says that nothing is in the way has missed it as well.
        let (tight, tight_occluded) = answers.watertight;
        let tight = tight.filter(|_| tight_occluded);
        let tight_judgement = unweighted(judge(tight));
        self.watertight.add(tight_judgement, is_tie(verdict, tight));
        let missed = verdict.hit.is_some() && tight.is_none();
        name(judgement).or(differ).or(missed.then_some("watertight misses")).map(Complaint)
    }

    /// Counts Embree's answers, default and robust, to one ray.
    pub fn add_embree(
        &mut self,
        oracle: &Oracle,
        shot: &Shot,
        verdict: &Verdict,
        hits: &[Option<Hit>; 2],
    ) {
        for (score, hit) in self.embree.iter_mut().zip(hits) {
            let judgement = oracle.judge_by(verdict, &shot.ray, &shot.options, *hit);
            score.add(unweighted(judgement), is_tie(verdict, *hit));
        }
    }

    /// Adds what another part of the family came to.
    pub fn merge(&mut self, other: &Row) {
        self.rays += other.rays;
        self.hits += other.hits;
        self.ties += other.ties;
        self.differences += other.differences;
        self.exact.merge(&other.exact);
        self.watertight.merge(&other.watertight);
        (self.embree.iter_mut().zip(&other.embree)).for_each(|(a, b)| a.merge(b));
        self.seconds += other.seconds;
    }

    /// Exact answers that are not right, and contradictions.
    pub fn wrong(&self) -> u64 {
        let Score { false_misses, false_hits, wrong_prims, wrong_ties, wrong_ts, .. } = self.exact;
        let wrong = false_misses + false_hits + wrong_prims + wrong_ties + wrong_ts;
        wrong + self.exact.wrong_weights + self.differences
    }

    /// Whether nothing happened that must not.
    pub fn is_right(&self) -> bool {
        self.wrong() + self.watertight.false_misses == 0
    }
}

/// How the structures contradict each other or themselves.
fn differ(answers: &Answers) -> Option<&'static str> {
    let Answers { exact, occluded, .. } = answers;
    if exact.iter().any(|hit| bits(*hit) != bits(exact[0])) {
        return Some("list, grid and BVH differ");
    }
    let denied = exact.iter().zip(occluded).any(|(hit, occluded)| hit.is_some() != *occluded);
    denied.then_some("occluded contradicts intersect")
}

fn name(judgement: Judgement) -> Option<&'static str> {
    Some(match judgement {
        Judgement::Right => return None,
        Judgement::FalseMiss => "false miss",
        Judgement::FalseHit => "false hit",
        Judgement::WrongPrim => "wrong primitive",
        Judgement::WrongT { .. } => "t is not the nearest float",
        Judgement::WrongWeights { .. } => "weights out of their bound",
    })
}

/// Only exact answers have a bound on their weights.
fn unweighted(judgement: Judgement) -> Judgement {
    match judgement {
        Judgement::WrongWeights { .. } => Judgement::Right,
        other => other,
    }
}

fn is_tie(verdict: &Verdict, hit: Option<Hit>) -> bool {
    let place = hit.map(|hit| Place { geometry: hit.geometry, prim: hit.prim });
    place.is_some_and(|place| verdict.equal_t.contains(&place))
}
