//! Any scene, and rays aimed at what is in it: all structures and the oracle agree.

#![no_main]

use arbitrary::Unstructured;
use libfuzzer_sys::fuzz_target;
use raykern_fuzz::case::Case;
use raykern_fuzz::input::Maker;

fuzz_target!(|data: &[u8]| {
    if let Ok(case) = decode(data) {
        raykern_fuzz::show(&case);
        case.check();
    }
});

fn decode(data: &[u8]) -> arbitrary::Result<Case> {
    let mut bytes = Unstructured::new(data);
    let mut maker = Maker::new(&mut bytes)?;
    let mut case = maker.scene()?;
    maker.questions(&mut case)?;
    Ok(case)
}
