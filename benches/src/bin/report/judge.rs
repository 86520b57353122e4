//! Judging anyone's answers by the exact oracle.
//!
//! A *wrong answer* is a miss where something is hit, a hit where nothing is, or a triangle that is not among those met first.
//! Of several triangles at the same real `t` any will do, and `t` itself is judged apart, in floats from the nearest one. Who
//! claims to be exact is held to more: the first in order of those, the nearest float, and weights within their bound.

use std::cell::OnceCell;

use raykern::{Hit, NONE, QueryOptions, Ray};
use raykern_harness::model::Model;
use raykern_harness::oracle::{Judgement, Oracle, Place, Verdict, ulps_apart};

/// Who judges one model.
pub struct Judge {
    oracle: Oracle,
    options: QueryOptions,
}

/// The truth about a ray: known, or presumed until someone contradicts.
pub struct Truth {
    presumed: Option<Hit>,
    /// The verdict, and the nearest float to its `t`.
    known: OnceCell<(Verdict, Option<f32>)>,
}

/// What became of many answers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    pub asked: u64,
    pub false_misses: u64,
    pub false_hits: u64,
    pub wrong_prims: u64,
    /// Not as an exact method must answer.
    pub not_exact: u64,
    /// Not answered, as the method aborted or panicked.
    pub gave_up: u64,
    /// Of right answers.
    pub ulps: Ulps,
}

impl Tally {
    /// Answers that are wrong for anyone.
    pub fn wrong(&self) -> u64 {
        self.false_misses + self.false_hits + self.wrong_prims
    }

    /// Adds another one.
    pub fn merge(&mut self, other: &Tally) {
        self.asked += other.asked;
        self.false_misses += other.false_misses;
        self.false_hits += other.false_hits;
        self.wrong_prims += other.wrong_prims;
        self.not_exact += other.not_exact;
        self.gave_up += other.gave_up;
        self.ulps.merge(&other.ulps);
    }
}

/// Distances of `t` from the nearest float, counted by powers of two.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ulps {
    /// 0, 1, 2, up to 4, up to 8, ...
    counts: Vec<u64>,
    pub max: u64,
}

impl Ulps {
    fn add(&mut self, ulps: u64) {
        let bin = (u64::BITS - ulps.leading_zeros()) as usize
            + usize::from(ulps > 0 && !ulps.is_power_of_two());
        if self.counts.len() <= bin {
            self.counts.resize(bin + 1, 0);
        }
        self.counts[bin] += 1;
        self.max = self.max.max(ulps);
    }

    fn merge(&mut self, other: &Ulps) {
        self.counts.resize(self.counts.len().max(other.counts.len()), 0);
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
        self.max = self.max.max(other.max);
    }

    /// A distance that this share does not exceed: exact up to 2, else the next power of two. `None` of none.
    pub fn quantile(&self, share: f64) -> Option<u64> {
        let all: u64 = self.counts.iter().sum();
        let mut left = (share * all as f64).ceil().max(1.0) as u64;
        for (bin, count) in self.counts.iter().enumerate() {
            if *count >= left {
                return Some(if bin == 0 { 0 } else { (1 << (bin - 1)).min(self.max) });
            }
            left -= count;
        }
        None
    }

    /// As in a file.
    pub fn text(&self) -> String {
        self.counts.iter().map(u64::to_string).collect::<Vec<_>>().join(" ")
    }

    /// Out of a file.
    pub fn parse(text: &str, max: u64) -> Self {
        Ulps { counts: text.split(' ').filter_map(|count| count.parse().ok()).collect(), max }
    }
}

impl Judge {
    /// For a model, each geometry of which everyone sees.
    pub fn new(model: &Model) -> Self {
        Judge { oracle: Oracle::new(model), options: QueryOptions::default() }
    }

    /// What is true of a ray.
    pub fn truth(&self, ray: &Ray) -> Truth {
        let truth = Truth { presumed: None, known: OnceCell::new() };
        self.known(&truth, ray);
        truth
    }

    /// What an exact method says, believed of everyone who says the same: the same triangle, or that nothing is hit.
    pub fn presumed(hit: Hit) -> Truth {
        Truth { presumed: Some(hit), known: OnceCell::new() }
    }

    fn known<'a>(&self, truth: &'a Truth, ray: &Ray) -> &'a (Verdict, Option<f32>) {
        truth.known.get_or_init(|| {
            let verdict = self.oracle.closest(ray, &self.options);
            let t = verdict.hit.as_ref().map(|hit| hit.t.rounded());
            (verdict, t)
        })
    }

    /// Judges an answer. `names`: whether the method says which triangle it met.
    pub fn judge(&self, tally: &mut Tally, ray: &Ray, truth: &Truth, hit: &Hit, names: bool) {
        tally.asked += 1;
        if let Some(presumed) = truth.presumed
            && truth.known.get().is_none()
            && agree(&presumed, hit, names)
        {
            tally.not_exact += u64::from(bits(&presumed) != bits(hit));
            if hit.geometry != NONE {
                tally.ulps.add(ulps_apart(hit.t + 0.0, presumed.t));
            }
            return;
        }
        self.judge_by(tally, ray, self.known(truth, ray), hit, names);
    }

    fn judge_by(
        &self,
        tally: &mut Tally,
        ray: &Ray,
        (verdict, t): &(Verdict, Option<f32>),
        hit: &Hit,
        names: bool,
    ) {
        let claimed = (hit.geometry != NONE).then_some(*hit);
        let strict = self.oracle.judge_by(verdict, ray, &self.options, claimed);
        tally.not_exact += u64::from(strict != Judgement::Right);
        let (Some(right), Some(claimed)) = (*t, claimed) else {
            tally.false_misses += u64::from(t.is_some() && claimed.is_none());
            tally.false_hits += u64::from(t.is_none() && claimed.is_some());
            return;
        };
        let place = Place { geometry: claimed.geometry, prim: claimed.prim };
        let ulps = ulps_apart(claimed.t + 0.0, right);
        let met_first = match names {
            true => {
                verdict.hit.as_ref().is_some_and(|hit| hit.place == place)
                    || verdict.equal_t.contains(&place)
            }
            false => ulps <= NEAR,
        };
        match () {
            () if met_first => tally.ulps.add(ulps),
            () if names && strict == Judgement::FalseHit => tally.false_hits += 1,
            () => tally.wrong_prims += 1,
        }
    }

    /// Judges whether anything is in the way.
    pub fn judge_any(&self, tally: &mut Tally, ray: &Ray, truth: &Truth, occluded: bool) {
        tally.asked += 1;
        let presumed = truth.presumed.filter(|_| truth.known.get().is_none());
        if presumed.is_some_and(|hit| (hit.geometry != NONE) == occluded) {
            return;
        }
        let blocked = self.known(truth, ray).1.is_some();
        tally.false_misses += u64::from(blocked && !occluded);
        tally.false_hits += u64::from(!blocked && occluded);
        tally.not_exact += u64::from(blocked != occluded);
    }
}

/// Who names no triangle is told by its `t`, which may be this many floats off.
const NEAR: u64 = 1 << 14;

fn agree(presumed: &Hit, hit: &Hit, names: bool) -> bool {
    let missed = |hit: &Hit| hit.geometry == NONE;
    match names {
        _ if missed(presumed) || missed(hit) => missed(presumed) == missed(hit),
        true => (presumed.prim, presumed.geometry) == (hit.prim, hit.geometry),
        false => ulps_apart(presumed.t, hit.t) <= NEAR,
    }
}

/// All that an exact answer settles.
fn bits(hit: &Hit) -> [u32; 6] {
    let [t, u, v] = [hit.t, hit.u, hit.v].map(f32::to_bits);
    [t, u, v, hit.prim, hit.geometry, hit.instance]
}

#[cfg(test)]
mod tests {
    use super::*;
    use raykern_harness::model::TriangleMesh;

    /// Two triangles in one plane, the second twice the first, and a third behind them.
    fn model() -> Model {
        let vertices = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 0.0, -1.0],
            [2.0, 0.0, -1.0],
            [0.0, 2.0, -1.0],
        ];
        TriangleMesh { vertices, indices: vec![[0, 1, 2], [0, 3, 4], [5, 6, 7]] }.into()
    }

    fn judged(to: [f32; 2], hit: Hit, names: bool) -> Tally {
        let (judge, mut tally) = (Judge::new(&model()), Tally::default());
        let ray = Ray::new([to[0], to[1], 3.0], [0.0, 0.0, -1.0]);
        judge.judge(&mut tally, &ray, &judge.truth(&ray), &hit, names);
        tally
    }

    fn hit(t: f32, prim: u32) -> Hit {
        Hit { t, u: 0.25, v: 0.25, prim, geometry: 0, instance: NONE }
    }

    #[test]
    fn each_fault_is_counted_as_what_it_is() {
        let at = [0.25, 0.25];
        let right = judged(at, hit(3.0, 0), true);
        assert_eq!((right.wrong(), right.not_exact, right.ulps.max), (0, 0, 0));
        let tie = judged(at, hit(3.0, 1), true);
        assert_eq!((tie.wrong(), tie.not_exact), (0, 1));
        let late = judged(at, hit(3.0f32.next_up(), 0), true);
        assert_eq!((late.wrong(), late.not_exact, late.ulps.max), (0, 1, 1));
        assert_eq!(judged(at, hit(4.0, 2), true).wrong_prims, 1);
        assert_eq!(judged(at, Hit::MISS, true).false_misses, 1);
        assert_eq!(judged([3.0, 3.0], hit(3.0, 0), true).false_hits, 1);
        assert_eq!(judged([1.0, 0.5], hit(3.0, 0), true).false_hits, 1);
        assert_eq!(judged(at, hit(4.0, 0), false).wrong_prims, 1);
        assert_eq!(judged(at, hit(3.0, 7), false).wrong(), 0);
    }

    #[test]
    fn what_is_presumed_holds_until_it_is_contradicted() {
        let judge = Judge::new(&model());
        let ray = Ray::new([0.25, 0.25, 3.0], [0.0, 0.0, -1.0]);
        // A lie, on which two agree: only the third makes the judge look.
        let truth = Judge::presumed(hit(4.0, 2));
        let mut tally = Tally::default();
        judge.judge(&mut tally, &ray, &truth, &hit(4.0, 2), true);
        assert_eq!((tally.asked, tally.wrong(), tally.not_exact), (1, 0, 0));
        judge.judge(&mut tally, &ray, &truth, &hit(3.0, 0), true);
        assert_eq!((tally.asked, tally.wrong()), (2, 0));
        judge.judge(&mut tally, &ray, &truth, &hit(4.0, 2), true);
        assert_eq!((tally.asked, tally.wrong_prims), (3, 1));
        let truth = Judge::presumed(Hit::MISS);
        let mut tally = Tally::default();
        judge.judge_any(&mut tally, &ray, &truth, true);
        judge.judge_any(&mut tally, &ray, &truth, false);
        assert_eq!((tally.false_misses, tally.false_hits), (1, 0));
    }

    #[test]
    fn quantiles_of_distances() {
        let mut ulps = Ulps::default();
        [0, 0, 1, 2, 3, 4, 5, 100].into_iter().for_each(|x| ulps.add(x));
        assert_eq!(ulps.text(), "2 1 1 2 1 0 0 0 1");
        let quantiles = [0.25, 0.375, 0.5, 0.75, 1.0].map(|share| ulps.quantile(share));
        assert_eq!(quantiles, [Some(0), Some(1), Some(2), Some(4), Some(100)]);
        assert_eq!(Ulps::parse(&ulps.text(), 100), ulps);
        assert_eq!(Ulps::default().quantile(0.5), None);
    }
}
