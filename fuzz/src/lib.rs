//! What the fuzz targets share: bytes become cases, cases are checked.

pub mod aim;
pub mod case;
pub mod damage;
pub mod input;
pub mod scenes;

/// Prints what the bytes became when `RAYKERN_FUZZ_SHOW` is set: for turning a finding into a case.
pub fn show(what: &impl std::fmt::Display) {
    if std::env::var_os("RAYKERN_FUZZ_SHOW").is_some() {
        println!("{what}");
    }
}
