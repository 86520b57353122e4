//! Any rays and options on a few scenes full of trouble: all structures and the oracle agree.

#![no_main]

use std::sync::LazyLock;

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use raykern_fuzz::case::{Case, Subject};
use raykern_fuzz::input::Maker;
use raykern_fuzz::scenes;

/// The masks of the first geometries; the rest is seen by all.
const MASKS: [u32; 3] = [1, 2, 3];

static SUBJECTS: LazyLock<Vec<(Case, Subject)>> = LazyLock::new(|| {
    let subject = |(_, model)| {
        let subject = Subject::build(&model, &MASKS);
        (Case { model, masks: MASKS.to_vec(), questions: vec![] }, subject)
    };
    scenes::all().into_iter().map(subject).collect()
});

fuzz_target!(|data: &[u8]| {
    let Some((choice, rest)) = data.split_first() else { return };
    let (scene, subject) = &SUBJECTS[usize::from(*choice) % SUBJECTS.len()];
    let mut case = scene.clone();
    if ask(rest, &mut case).is_ok() {
        raykern_fuzz::show(&case);
        case.check_in(subject);
    }
});

fn ask(data: &[u8], case: &mut Case) -> arbitrary::Result<()> {
    let mut bytes = Unstructured::new(data);
    Maker::new(&mut bytes)?.questions(case)
}
