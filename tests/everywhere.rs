//! What runs on other processors, run here: their answers are compared with the committed ones, and so are these.

#![allow(missing_docs)]

#[path = "../targets/agree/src/answers.rs"]
mod answers;
#[path = "../targets/agree/src/rays.rs"]
mod rays;
#[path = "../targets/agree/src/scenes.rs"]
mod scenes;

use std::fs;
use std::path::Path;

use answers::Room;
use raykern::{Backend, BuildOptions, Layout, OwnedAccel, Quality};
use raykern_harness::load::load_mesh;
use raykern_harness::model::Model;

fn committed(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("targets").join(name);
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn every_structure_and_backend_gives_the_number() {
    let expected = String::from_utf8(committed("agree.txt")).unwrap();
    for backend in Backend::ALL {
        backend.force();
        let room = Box::<Room>::new_zeroed();
        // SAFETY: zeros are a value of all that is in it.
        #[allow(unsafe_code, reason = "as the C programs do")]
        let mut room = unsafe { room.assume_init() };
        assert_eq!(format!("answers {:08x}\n", room.agree(400)), expected, "{backend:?}");
    }
}

/// The same bytes from every machine, so those that were committed; `cargo run --example bake` writes them.
#[test]
fn the_committed_block_is_what_a_build_gives() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("targets/scene.obj");
    let model = Model::from(load_mesh(&path).unwrap());
    let options =
        BuildOptions { quality: Quality::Best, layout: Layout::Compact, ..BuildOptions::default() };
    let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options)).unwrap();
    assert!(built.accel().block() == committed("scene.block"), "bake targets/scene.block anew");
}
