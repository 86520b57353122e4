//! What the user may ask for.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Parser, ValueEnum};
use raykern::{BuildError, BuildOptions, GridKind, GridOptions, OwnedAccel, PlainList, Scene};

/// Compares the grids with the BVH: build time, memory, rendering time, and why.
#[derive(Debug, Parser)]
#[command(name = "compare")]
pub struct Options {
    /// A scene: a name (see --list-scenes) or the path of an .xml, .ply or .obj file; repeatable
    #[arg(long, value_name = "NAME|PATH")]
    pub scene: Vec<String>,
    /// Measured renderings of each scene with each structure
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Picture size: pixels (640x480), or a factor on the scene's own size (0.5)
    #[arg(long, value_name = "WxH|FACTOR", default_value = "1")]
    pub size: Size,
    /// The structures, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', default_value = "plain,grid,bvh,automatic")]
    pub structure: Vec<Structure>,
    /// The folder for pictures, tables and the chart
    #[arg(long, value_name = "DIR", default_value = "target/compare")]
    pub out: PathBuf,
    /// About how many seconds the whole comparison may take
    #[arg(long, value_name = "SECONDS", default_value_t = 480,
        value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub budget: u64,
    /// The folder of collected scenes [default: ../shared/scenes, or $RAYKERN_SCENES]
    #[arg(long, value_name = "DIR")]
    pub scenes: Option<PathBuf>,
    /// Names the scenes that are at hand, and ends
    #[arg(long)]
    pub list_scenes: bool,
}

/// A structure to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Structure {
    /// The blog post's grid: uniform, the cube root of the number of triangles as cells along each axis
    Plain,
    /// The nested grid
    Grid,
    /// The grid of two cells along each axis, and again two in each
    Octree,
    /// The bounding volume hierarchy
    Bvh,
    /// Whichever the library takes by itself
    Automatic,
    /// No structure: every ray is tested against every leaf block
    List,
}

impl Structure {
    /// As in tables and file names.
    pub fn name(self) -> &'static str {
        match self {
            Structure::Plain => "plain",
            Structure::Grid => "grid",
            Structure::Octree => "octree",
            Structure::Bvh => "bvh",
            Structure::Automatic => "auto",
            Structure::List => "list",
        }
    }

    /// Builds it over `scene`, however small that is.
    pub fn build<'c>(self, scene: &Scene<'_, 'c>) -> Result<OwnedAccel<'c>, BuildError> {
        let plain_list = match self {
            Structure::List => PlainList::Always,
            Structure::Automatic => PlainList::Automatic,
            _ => PlainList::Never,
        };
        let kind = match self {
            Structure::Plain => GridKind::Uniform,
            Structure::Octree => GridKind::Octree,
            _ => GridKind::Nested,
        };
        let grid = GridOptions { kind, ..Default::default() };
        let options = BuildOptions { plain_list, grid, ..Default::default() };
        match self {
            Structure::Plain | Structure::Grid | Structure::Octree => {
                OwnedAccel::grid(scene, &options)
            }
            Structure::Bvh | Structure::List => OwnedAccel::bvh(scene, &options),
            Structure::Automatic => OwnedAccel::automatic(scene, &options),
        }
    }
}

/// The size of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// In pixels.
    Pixels([u32; 2]),
    /// A factor on the scene's own size.
    Factor(f64),
}

impl Size {
    /// The size for a camera that asks for `own`.
    pub fn of(self, own: [u32; 2]) -> [u32; 2] {
        match self {
            Size::Pixels(size) => size,
            Size::Factor(factor) => own.map(|n| (f64::from(n) * factor).round().max(1.0) as u32),
        }
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected WIDTHxHEIGHT in pixels, or a factor above 0".to_owned();
        if let Some((width, height)) = text.split_once('x') {
            let number = |n: &str| n.parse().ok().filter(|n| (1..=32768).contains(n));
            let size = number(width).zip(number(height)).ok_or_else(expected)?;
            return Ok(Size::Pixels([size.0, size.1]));
        }
        let factor = text.parse().ok().filter(|f: &f64| *f > 0.0 && f.is_finite());
        factor.map(Size::Factor).ok_or_else(expected)
    }
}
