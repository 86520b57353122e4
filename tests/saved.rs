//! Blocks in files: saved, mapped, opened where they lie.

#![allow(missing_docs)]

mod common;

use std::fs::{self, File};

use common::{bits, odd_models};
use memmap2::{Mmap, MmapMut, MmapOptions};
use raykern::{Accel, AccelMut, BuildOptions, Layout, OpenError, OwnedAccel, PlainList};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};

/// Calls `f` with a file that holds `bytes`, and removes it.
fn with_file<R>(name: &str, bytes: &[u8], f: impl FnOnce(&File) -> R) -> R {
    let path = std::env::temp_dir().join(format!("raykern-{name}-{}", std::process::id()));
    fs::write(&path, bytes).expect("a file");
    let file = File::options().read(true).write(true).open(&path).expect("the file");
    let result = f(&file);
    fs::remove_file(&path).expect("the file");
    result
}

#[allow(unsafe_code, reason = "a mapping is as safe as the file is left alone")]
fn mapped(file: &File) -> Mmap {
    // SAFETY: the file is this test's own, and only mapped to be read.
    unsafe { Mmap::map(file) }.expect("a mapping")
}

/// A mapping whose changes stay in memory.
#[allow(unsafe_code, reason = "a mapping is as safe as the file is left alone")]
fn mapped_to_write(file: &File) -> MmapMut {
    // SAFETY: the file is this test's own.
    unsafe { MmapOptions::new().map_copy(file) }.expect("a mapping")
}

#[test]
fn mapped_blocks_answer_as_built_ones() {
    let never = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    let refit = BuildOptions { refit: true, ..never };
    for (name, model) in odd_models() {
        let rays = RayMaker::new(&model, 2).many(Family::Random, 100);
        let built = model.with_scene(|scene| {
            [
                OwnedAccel::bvh(scene, &BuildOptions { plain_list: PlainList::Always, ..never }),
                OwnedAccel::grid(scene, &never),
                OwnedAccel::bvh(scene, &never),
                OwnedAccel::bvh(scene, &BuildOptions { layout: Layout::Compact, ..never }),
                OwnedAccel::bvh(scene, &refit),
            ]
        });
        for built in built.map(|built| built.expect("a structure")) {
            with_file("answers", built.accel().block(), |file| {
                let map = mapped(file);
                let accel = Accel::open(&map).expect("a sound block");
                for ray in &rays {
                    assert_eq!(
                        bits(accel.intersect(ray)),
                        bits(built.accel().intersect(ray)),
                        "{name}"
                    );
                }
            });
        }
    }
}

#[test]
fn a_mapped_block_may_be_refitted_in_memory() {
    let model: Model = make::blob(500, 1).into();
    let mut moved = model.clone();
    moved.meshes[0] = model.meshes[0].clone().placed(2.0, [1.0, 0.0, 0.0]);
    let options = BuildOptions { refit: true, ..Default::default() };
    let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("a BVH");
    let anew = moved.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("a BVH");
    with_file("refit", built.accel().block(), |file| {
        let mut map = mapped_to_write(file);
        let mut accel = AccelMut::open(&mut map).expect("a sound block");
        moved.with_scene(|scene| accel.refit(scene, None)).expect("the same mesh");
        for ray in RayMaker::new(&moved, 2).many(Family::Random, 200) {
            assert_eq!(bits(accel.accel().intersect(&ray)), bits(anew.accel().intersect(&ray)));
        }
    });
}

#[test]
fn half_a_file_is_refused() {
    let model: Model = make::blob(500, 1).into();
    let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()));
    let built = built.expect("a BVH");
    let block = built.accel().block();
    with_file("half", &block[..block.len() / 2], |file| {
        assert_eq!(Accel::open(&mapped(file)).err(), Some(OpenError::Truncated));
    });
}
