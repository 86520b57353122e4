//! What is right: our exact BVH, itself held against a plain list of all triangles.

use anyhow::{Result, ensure};
use raykern::{Accel, Hit, NONE, Ray};

use crate::rays::Question;

/// Answers to a list of rays.
pub enum Answers {
    /// To [`Question::Closest`].
    Hits(Vec<Hit>),
    /// To [`Question::Any`].
    Occluded(Vec<bool>),
}

impl Answers {
    /// What `accel` says.
    pub fn of(accel: &Accel, rays: &[Ray], question: Question) -> Self {
        match question {
            Question::Closest => Answers::Hits(
                rays.iter().map(|ray| accel.intersect(ray).unwrap_or(Hit::MISS)).collect(),
            ),
            Question::Any => {
                Answers::Occluded(rays.iter().map(|ray| accel.occluded(ray)).collect())
            }
        }
    }

    /// As many misses.
    pub fn none(question: Question, count: usize) -> Self {
        match question {
            Question::Closest => Answers::Hits(vec![Hit::MISS; count]),
            Question::Any => Answers::Occluded(vec![false; count]),
        }
    }

    /// The share of rays that meet something.
    pub fn hit_share(&self) -> f64 {
        let (hits, count) = match self {
            Answers::Hits(hits) => {
                (hits.iter().filter(|hit| hit.geometry != NONE).count(), hits.len())
            }
            Answers::Occluded(all) => (all.iter().filter(|occluded| **occluded).count(), all.len()),
        };
        hits as f64 / count.max(1) as f64
    }

    /// How many answers differ: in any bit when `exact`; else in hit or miss, or in `t` by more than
    /// a thousandth. Which of two surfaces at about the same `t` is met is left open then.
    pub fn differing(&self, from: &Answers, exact: bool) -> usize {
        match (self, from) {
            (Answers::Hits(a), Answers::Hits(b)) => {
                let same = if exact { equal } else { alike };
                a.iter().zip(b).filter(|(a, b)| !same(a, b)).count()
            }
            (Answers::Occluded(a), Answers::Occluded(b)) => {
                a.iter().zip(b).filter(|(a, b)| a != b).count()
            }
            _ => unreachable!("both answer the same question"),
        }
    }
}

/// To the bit; `u` and `v` are ours to choose, and equal too.
fn equal(a: &Hit, b: &Hit) -> bool {
    let bits = |hit: &Hit| [hit.t, hit.u, hit.v].map(f32::to_bits);
    bits(a) == bits(b) && (a.prim, a.geometry, a.instance) == (b.prim, b.geometry, b.instance)
}

fn alike(a: &Hit, b: &Hit) -> bool {
    let missed = |hit: &Hit| hit.geometry == NONE;
    let near = || (a.t - b.t).abs() <= 1e-3 * a.t.abs().max(b.t.abs());
    missed(a) == missed(b) && (missed(a) || near())
}

/// How many rays of each kind are compared with the list: each tests every triangle.
const LISTED: usize = 8;

/// Fails unless a few of `answers`, spread over all rays, are those of a plain list.
pub fn hold_against_list(list: &Accel, rays: &[Ray], answers: &Answers) -> Result<()> {
    for k in 0..LISTED.min(rays.len()) {
        let i = k * rays.len() / LISTED.min(rays.len());
        let agrees = match answers {
            Answers::Hits(hits) => equal(&hits[i], &list.intersect(&rays[i]).unwrap_or(Hit::MISS)),
            Answers::Occluded(occluded) => occluded[i] == list.occluded(&rays[i]),
        };
        ensure!(agrees, "the BVH and the list differ on {:?}", rays[i]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_counted() {
        let hit = |t: f32, prim| Hit { t, u: 0.0, v: 0.0, prim, geometry: 0, instance: NONE };
        let right = Answers::Hits(vec![hit(1.0, 1), hit(1.0, 1), Hit::MISS, hit(2.0, 1)]);
        let found = Answers::Hits(vec![hit(1.0, 1), hit(1.00001, 2), hit(1.0, 1), hit(2.1, 1)]);
        assert_eq!((found.differing(&right, true), found.differing(&right, false)), (3, 2));
        assert_eq!(right.differing(&right, true), 0);
        assert_eq!(right.hit_share(), 0.75);
    }
}
