//! Claimed hits, judged.

use std::fmt;

use raykern::{Hit, QueryOptions, Ray};

use super::{Oracle, Place, Verdict, ulps_apart};

/// What is wrong with a claimed answer, if anything; the gravest first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Judgement {
    /// Nothing: the primitive, the correctly rounded `t`, and `u` and `v` within
    /// 2^-23 plus the noise of computing them in `f64`.
    Right,
    /// The ray hits something.
    FalseMiss,
    /// The ray does not hit the claimed primitive.
    FalseHit,
    /// The ray hits the claimed primitive, but another one first, or one before it in order at
    /// equal `t`.
    WrongPrim,
    /// The right primitive with a `t` that is this many floats from the right one.
    WrongT {
        /// The distance in floats.
        ulps: u64,
    },
    /// Weights out of their bound, or one of `u`, `v`, `1 - u - v` negative.
    WrongWeights {
        /// The larger of the two errors.
        error: f64,
    },
}

/// How often each judgement was passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays judged.
    pub rays: u64,
    /// Rays that hit something.
    pub hits: u64,
    /// Rays with several primitives at the least `t`.
    pub ties: u64,
    /// Counts of the judgements of the same name.
    pub false_misses: u64,
    #[allow(missing_docs, reason = "named like the judgement")]
    pub false_hits: u64,
    #[allow(missing_docs, reason = "named like the judgement")]
    pub wrong_prims: u64,
    #[allow(missing_docs, reason = "named like the judgement")]
    pub wrong_ts: u64,
    #[allow(missing_docs, reason = "named like the judgement")]
    pub wrong_weights: u64,
}

impl Oracle {
    /// Judges `claimed`, the answer for `ray` under `options`.
    pub fn judge(&self, ray: &Ray, options: &QueryOptions, claimed: Option<Hit>) -> Judgement {
        self.judge_by(&self.closest(ray, options), ray, options, claimed)
    }

    /// Judges by a verdict that is already known.
    pub fn judge_by(
        &self,
        verdict: &Verdict,
        ray: &Ray,
        options: &QueryOptions,
        claimed: Option<Hit>,
    ) -> Judgement {
        let (exact, claimed) = match (&verdict.hit, claimed) {
            (None, None) => return Judgement::Right,
            (None, Some(_)) => return Judgement::FalseHit,
            (Some(_), None) => return Judgement::FalseMiss,
            (Some(exact), Some(claimed)) => (exact, claimed),
        };
        let place = Place { geometry: claimed.geometry, prim: claimed.prim };
        if place != exact.place || claimed.instance != raykern::NONE {
            let real = self.all_hits(ray, options).iter().any(|hit| hit.place == place);
            return if real { Judgement::WrongPrim } else { Judgement::FalseHit };
        }
        let right = exact.t.rounded();
        if claimed.t.to_bits() != right.to_bits() {
            // A zero of the wrong sign is wrong as well.
            return Judgement::WrongT { ulps: ulps_apart(claimed.t, right).max(1) };
        }
        let (u, v) = (claimed.u, claimed.v);
        let [exact_u, exact_v] = exact.weights;
        let error = (f64::from(u) - exact_u).abs().max((f64::from(v) - exact_v).abs());
        let inside = u >= 0.0 && v >= 0.0 && 1.0 - u - v >= 0.0;
        // Written so that a NaN is wrong.
        if inside && error <= f64::from(f32::EPSILON) {
            Judgement::Right
        } else {
            Judgement::WrongWeights { error }
        }
    }
}

impl Tally {
    /// Judges and counts.
    pub fn add(
        &mut self,
        oracle: &Oracle,
        ray: &Ray,
        options: &QueryOptions,
        claimed: Option<Hit>,
    ) -> Judgement {
        let verdict = oracle.closest(ray, options);
        let judgement = oracle.judge_by(&verdict, ray, options, claimed);
        self.rays += 1;
        self.hits += u64::from(verdict.hit.is_some());
        self.ties += u64::from(!verdict.equal_t.is_empty());
        match judgement {
            Judgement::Right => {}
            Judgement::FalseMiss => self.false_misses += 1,
            Judgement::FalseHit => self.false_hits += 1,
            Judgement::WrongPrim => self.wrong_prims += 1,
            Judgement::WrongT { .. } => self.wrong_ts += 1,
            Judgement::WrongWeights { .. } => self.wrong_weights += 1,
        }
        judgement
    }

    /// The number of answers that were not right.
    pub fn wrong(&self) -> u64 {
        let Tally { false_misses, false_hits, wrong_prims, wrong_ts, wrong_weights, .. } = self;
        false_misses + false_hits + wrong_prims + wrong_ts + wrong_weights
    }

    /// The names of the columns that [`Display`](fmt::Display) prints.
    pub const COLUMNS: &str = "    rays     hits     ties  f.miss   f.hit    prim       t     u,v";
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tally { rays, hits, ties, .. } = self;
        write!(f, "{rays:8} {hits:8} {ties:8}")?;
        let Tally { false_misses, false_hits, wrong_prims, wrong_ts, wrong_weights, .. } = self;
        for count in [false_misses, false_hits, wrong_prims, wrong_ts, wrong_weights] {
            write!(f, " {count:7}")?;
        }
        Ok(())
    }
}
