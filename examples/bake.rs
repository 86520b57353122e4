//! Bakes a mesh for a program that has no time, no memory or no code to build a structure: the finished block, as a C
//! source with its header, or as bytes.
//!
//! ```text
//! cargo run --release --example bake -- dragon.ply -o scene.c
//! cargo run --release --example bake -- targets/scene.obj -o targets/scene.block
//! ```

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::{Parser, ValueEnum};
use raykern::{Accel, BuildOptions, GridKind, GridOptions, Info, Layout, OwnedAccel, Quality};
use raykern_harness::load::{self, load_mesh};
use raykern_harness::model::Model;

/// Builds a structure over a mesh, or a scene of meshes and spheres, and writes its block.
#[derive(Debug, Parser)]
struct Options {
    /// A mesh (.obj, .ply) or a scene (.xml)
    scene: PathBuf,
    /// Where to write: a .c, beside which a .h is written, or bytes under any other ending
    #[arg(short, long)]
    out: PathBuf,
    /// The structure
    #[arg(long, value_enum, default_value_t = Structure::Bvh)]
    structure: Structure,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Structure {
    /// A compact BVH: the least memory, and all that a small build of the library reads
    Bvh,
    /// A BVH of 16 boxes side by side
    Wide,
    /// Nested grids
    Grid,
    /// One grid
    Uniform,
}

fn main() -> Result<()> {
    let Options { scene, out, structure } = Options::parse();
    let built = build(&model(&scene)?, structure).context("the scene cannot be built")?;
    let accel = built.accel();
    let name = || out.display().to_string();
    if out.extension().is_some_and(|ending| ending == "c") {
        let symbol = symbol(&out)?;
        fs::write(out.with_extension("h"), header(&symbol, &accel)).with_context(name)?;
        fs::write(&out, source(&symbol, &accel)).with_context(name)?;
    } else {
        fs::write(&out, accel.block()).with_context(name)?;
    }
    print!("{}", costs(&accel.info()));
    Ok(())
}

fn model(path: &Path) -> Result<Model> {
    if path.extension().is_some_and(|ending| ending == "xml") {
        return load::load(path)?.model.flattened().context("ellipsoids are not baked");
    }
    Ok(load_mesh(path)?.into())
}

fn build(model: &Model, structure: Structure) -> Result<OwnedAccel<'static>> {
    let kind = if structure == Structure::Uniform { GridKind::Uniform } else { GridKind::Nested };
    let options = BuildOptions {
        quality: Quality::Best,
        layout: if structure == Structure::Wide { Layout::Wide(16) } else { Layout::Compact },
        grid: GridOptions { kind, ..GridOptions::default() },
        ..BuildOptions::default()
    };
    model.with_scene(|scene| {
        Ok(match structure {
            Structure::Bvh | Structure::Wide => OwnedAccel::bvh(scene, &options)?,
            Structure::Grid | Structure::Uniform => OwnedAccel::grid(scene, &options)?,
        })
    })
}

/// The name of a file as one of C.
fn symbol(path: &Path) -> Result<String> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.is_empty() || name.starts_with(|c: char| c.is_ascii_digit()) {
        bail!("`{stem}` cannot be the name of an array in C");
    }
    Ok(name)
}

fn header(symbol: &str, accel: &Accel) -> String {
    let size = accel.block().len();
    let guard = symbol.to_uppercase();
    format!(
        "// A block of raykern: open it with rt_accel_open.\n\n#ifndef {guard}_H\n#define {guard}_H\n\n\
         enum {{ {symbol}_size = {size} }};\nextern const unsigned char {symbol}[{size}];\n\n#endif\n"
    )
}

fn source(symbol: &str, accel: &Accel) -> String {
    let block = accel.block();
    let mut text = format!(
        "#include \"{symbol}.h\"\n\n__attribute__((aligned(64))) const unsigned char {symbol}[{}] = {{\n",
        block.len()
    );
    for line in block.chunks(24) {
        let numbers: Vec<String> = line.iter().map(u8::to_string).collect();
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {},", numbers.join(", "));
    }
    text + "};\n"
}

/// What the block takes in flash.
fn costs(info: &Info) -> String {
    let prims = info.triangle_count + info.sphere_count;
    let rest = info.size - info.structure_size - info.leaf_size - info.id_size;
    format!(
        "{} triangles, {} spheres, {} left out\n\
         {} bytes of flash, {:.1} for each primitive, and of RAM none:\n\
         {:>9} structure\n{:>9} primitives\n{:>9} their numbers\n{:>9} header and gaps\n",
        info.triangle_count,
        info.sphere_count,
        info.ignored_count,
        info.size,
        info.size as f64 / f64::from(prims.max(1)),
        info.structure_size,
        info.leaf_size,
        info.id_size,
        rest,
    )
}
