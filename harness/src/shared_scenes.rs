//! Where the folder of collected scenes is, if this machine has it.

use std::path::{Path, PathBuf};

/// The folder of scenes: `chosen`, else the environment's `RAYKERN_SCENES`, else
/// `../shared/scenes` beside the workspace; `None` when it is not there.
pub fn folder(chosen: Option<&Path>) -> Option<PathBuf> {
    let from_environment = || std::env::var_os("RAYKERN_SCENES").map(PathBuf::from);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    let folder = chosen.map(Path::to_owned).or_else(from_environment).unwrap_or_else(beside);
    folder.is_dir().then(|| folder.canonicalize().unwrap_or(folder))
}
