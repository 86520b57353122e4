//! A block saved to a file, mapped, and opened where it lies: nothing is read but what the check looks at, nothing
//! is copied.
//!
//! ```text
//! cargo run --release --example saved_block
//! cargo run --release --example saved_block -- --triangles 10000000
//! ```

use std::fs::{self, File};
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Parser;
use memmap2::Mmap;
use raykern::{Accel, BuildOptions, OwnedAccel, Ray};
use raykern_harness::make;
use raykern_harness::model::Model;

/// Saves a block, maps the file and opens the block in it.
#[derive(Debug, Parser)]
struct Options {
    /// About how many triangles
    #[arg(long, default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..=50_000_000))]
    triangles: u32,
    /// The file, which is removed in the end
    #[arg(long, default_value = "target/saved_block.raykern")]
    file: PathBuf,
}

fn main() -> Result<()> {
    let Options { triangles, file } = Options::parse();
    let model: Model = make::blob(triangles as usize, 1).into();
    let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()))?;
    let name = file.display().to_string();
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder).with_context(|| name.clone())?;
    }
    fs::write(&file, built.accel().block()).with_context(|| name.clone())?;
    let done = open(&file, &built.accel()).with_context(|| name.clone());
    fs::remove_file(&file).with_context(|| name)?;
    done
}

fn open(file: &PathBuf, built: &Accel) -> Result<()> {
    let file = File::open(file)?;
    // SAFETY: nobody else writes to the file; a page, and so the block, starts at a multiple of 64.
    #[allow(unsafe_code, reason = "a mapping is as safe as the file is left alone")]
    let map = unsafe { Mmap::map(&file) }?;
    for time in ["first", "second"] {
        let start = Instant::now();
        let accel = Accel::open(&map)?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let size = accel.block().len();
        println!("{size} bytes opened in {ms:.2} ms the {time} time");
        for i in 0..1000 {
            let x = (i as f32 - 500.0) / 400.0;
            let ray = Ray::new([x, 0.3 * x, 5.0], [0.0, 0.01, -1.0]);
            assert!(accel.intersect(&ray) == built.intersect(&ray), "another answer: {ray:?}");
        }
    }
    Ok(())
}
