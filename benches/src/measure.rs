//! Measures one scene: every method on the same rays, in turns.

use anyhow::{Result, ensure};
use raykern::{Accel, Counts, Layout, QueryOptions, Ray};

use crate::check::{Answers, hold_against_list};
use crate::lineup::{Class, Lineup, Structure, Subject};
use crate::options::Options;
use crate::ours;
use crate::rays::{Kind, Question, RayMaker};
use crate::scenes::{Case, Loaded};
use crate::watch::{Cost, Watch, median};

/// All that was learnt about a scene.
pub struct SceneResult {
    /// Its name.
    pub name: String,
    /// Whether a plain call was measured, not a scene.
    pub fixed_cost: bool,
    /// How many there are of what structures are built over.
    pub count: usize,
    /// What that is, in the singular: triangles, or instances.
    pub unit: &'static str,
    /// What builds cost.
    pub structures: Vec<Structure>,
    /// Name and class of each method.
    pub subjects: Vec<(String, Class)>,
    /// Each kind of ray.
    pub kinds: Vec<KindResult>,
    /// What could not take part, and why.
    pub notes: Vec<String>,
}

/// One kind of ray.
pub struct KindResult {
    /// Which.
    pub kind: Kind,
    /// How many.
    pub rays: usize,
    /// The share of them that hit.
    pub hit_share: f64,
    /// What our BVH visited and tested for all of them.
    pub visits: Counts,
    /// Each method, in the order of the subjects.
    pub methods: Vec<MethodResult>,
}

/// One method on one kind of ray.
#[derive(Default)]
pub struct MethodResult {
    /// The cost of each run; empty when the method was too slow to be measured.
    pub runs: Vec<Cost>,
    /// The seconds of all rays by those of a sample: roughly right, and known of slow methods too.
    pub by_sample: f64,
    /// Answers that differ from ours.
    pub differing: usize,
}

impl MethodResult {
    /// The seconds of each run.
    pub fn seconds(&self) -> Vec<f64> {
        self.runs.iter().map(|cost| cost.seconds).collect()
    }

    /// The median of the seconds; `None` when not measured.
    pub fn median_seconds(&self) -> Option<f64> {
        (!self.runs.is_empty()).then(|| median(&self.seconds()))
    }

    /// The median of an event; `None` when not counted.
    pub fn median_event(&self, event: usize) -> Option<f64> {
        let counted: Option<Vec<f64>> =
            self.runs.iter().map(|cost| cost.events.map(|events| events[event])).collect();
        counted.filter(|all| !all.is_empty()).map(|all| median(&all))
    }
}

/// Builds, traces and checks everything over one scene.
pub fn measure(
    case: &Case,
    scene: &Loaded,
    options: &Options,
    watch: &mut Watch,
) -> Result<SceneResult> {
    let lineup = Lineup::build(&scene.model, options, case.fixed_cost)?;
    let result = measure_lineup(&case.name, scene, lineup, options, watch)?;
    Ok(SceneResult { fixed_cost: case.fixed_cost, ..result })
}

/// Traces and checks everything of a lineup.
pub fn measure_lineup(
    name: &str,
    scene: &Loaded,
    lineup: Lineup,
    options: &Options,
    watch: &mut Watch,
) -> Result<SceneResult> {
    let reference = ours::bvh(&scene.model, Layout::Automatic)?;
    let list = ours::list(&scene.model)?;
    let accel = reference.accel();
    let maker = RayMaker::new(scene, &accel, options.ray_count());
    let mut kinds = Vec::new();
    for kind in options.kinds() {
        let rays = maker.make(kind);
        let right = Answers::of(&accel, &rays, kind.question());
        hold_against_list(&list.accel(), &rays, &right)?;
        kinds.push(measure_kind(&lineup.subjects, &accel, kind, (&rays, &right), options, watch)?);
    }
    Ok(SceneResult {
        name: name.to_string(),
        fixed_cost: false,
        count: scene.model.triangle_count(),
        unit: "triangle",
        structures: lineup.structures,
        subjects: lineup.subjects.into_iter().map(|s| (s.name, s.class)).collect(),
        kinds,
        notes: lineup.notes,
    })
}

/// Traces and checks the rays of one kind; `accel` says what is right, which is known already, and what is visited.
pub fn measure_kind(
    subjects: &[Subject],
    accel: &Accel,
    kind: Kind,
    (rays, right): (&[Ray], &Answers),
    options: &Options,
    watch: &mut Watch,
) -> Result<KindResult> {
    let methods = take_turns(subjects, kind, rays, right, options, watch);
    for (subject, method) in subjects.iter().zip(&methods) {
        let allowed = allowed_to_differ(subject.class, rays.len(), options.quick);
        ensure!(
            method.differing <= allowed,
            "{} answers {} of {} {} rays unlike our exact BVH",
            subject.name,
            method.differing,
            rays.len(),
            kind.name()
        );
    }
    Ok(KindResult {
        kind,
        rays: rays.len(),
        hit_share: right.hit_share(),
        visits: visits(accel, rays, kind.question()),
        methods,
    })
}

/// What the BVH visits and tests for these rays.
fn visits(accel: &Accel, rays: &[Ray], question: Question) -> Counts {
    let (mut counts, options) = (Counts::default(), QueryOptions::default());
    for ray in rays {
        match question {
            Question::Closest => drop(accel.intersect_counted(ray, &options, &mut counts)),
            Question::Any => drop(accel.occluded_counted(ray, &options, &mut counts)),
        }
    }
    counts
}

/// How many answers may differ. Peers are counted, not judged, but in a quick run, whose scenes are
/// known: more than a few would mean that like is not compared with like.
fn allowed_to_differ(class: Class, rays: usize, quick: bool) -> usize {
    match () {
        () if class.is_exact() => 0,
        () if class.is_ours() || !quick => usize::MAX,
        () => rays / 100,
    }
}

/// A method this many times slower than the first on a sample of the rays is left out.
const TOO_SLOW: f64 = 30.0;
/// Each so many-th ray is in the sample.
const SAMPLE: usize = 50;
/// Each so many-th ray is traced once more before a timed run.
const WARM_UP: usize = 1;

/// A first run of each method warms up and is checked; then all take turns, each round begun by
/// another one, so that whatever slows the machine for a while slows all of them.
fn take_turns(
    subjects: &[Subject],
    kind: Kind,
    rays: &[Ray],
    right: &Answers,
    options: &Options,
    watch: &mut Watch,
) -> Vec<MethodResult> {
    let sample: Vec<Ray> = rays.iter().step_by(SAMPLE).copied().collect();
    let warm_up: Vec<Ray> = rays.iter().step_by(WARM_UP).copied().collect();
    let mut fastest = f64::INFINITY;
    let mut results = Vec::new();
    for subject in subjects {
        trace(subject, kind, &sample, watch);
        let (_, cost) = trace(subject, kind, &sample, watch);
        fastest = fastest.min(cost.seconds);
        let slow = sample.len() > 100 && cost.seconds > TOO_SLOW * fastest;
        let differing = match slow {
            true => 0,
            false => {
                let (answers, _) = trace(subject, kind, rays, watch);
                answers.differing(right, subject.class.is_exact())
            }
        };
        let by_sample = cost.seconds * rays.len() as f64 / sample.len().max(1) as f64;
        results.push((slow, MethodResult { runs: Vec::new(), by_sample, differing }));
    }
    for run in 0..options.run_count() {
        for turn in 0..subjects.len() {
            let i = (run + turn) % subjects.len();
            if !results[i].0 {
                // The caches hold what the method before it read.
                trace(&subjects[i], kind, &warm_up, watch);
                let (_, cost) = trace(&subjects[i], kind, rays, watch);
                results[i].1.runs.push(cost);
            }
        }
    }
    results.into_iter().map(|(_, result)| result).collect()
}

fn trace(subject: &Subject, kind: Kind, rays: &[Ray], watch: &mut Watch) -> (Answers, Cost) {
    let mut answers = Answers::none(kind.question(), rays.len());
    let coherent = kind.is_coherent();
    match &mut answers {
        Answers::Hits(hits) => subject.tracer.closest(rays, hits, coherent, watch),
        Answers::Occluded(occluded) => subject.tracer.any(rays, occluded, coherent, watch),
    }
    (answers, watch.take())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::scenes::cases;

    #[test]
    fn small_scenes_are_measured_and_all_of_ours_agree() {
        // Without peers: so few rays over one triangle begin at its corner, where those need not be right.
        let words = ["", "--quick", "--rays", "300", "--runs", "2", "--peer", "none"];
        let options = Options::parse_from(words);
        for case in cases(&options) {
            let scene = case.load(&options).expect("a generated scene");
            let result = measure(&case, &scene, &options, &mut Watch::new()).expect("a result");
            assert_eq!(result.kinds.len(), Kind::ALL.len());
            for kind in &result.kinds {
                assert_eq!((kind.rays, kind.methods.len()), (300, result.subjects.len()));
                assert!(kind.methods.iter().all(|method| method.runs.len() == 2));
            }
        }
    }

    #[test]
    fn peers_are_judged_in_quick_runs_alone() {
        let allowed = |class, quick| allowed_to_differ(class, 500, quick);
        assert_eq!((allowed(Class::Embree, true), allowed(Class::Noise, true)), (5, 0));
        assert_eq!(allowed(Class::Embree, false), usize::MAX);
    }
}
