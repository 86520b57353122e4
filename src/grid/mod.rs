//! Grids in flat arrays: uniform ones, and grids within the cells of grids.
//!
//! [`uniform`] builds the plain grid, [`nested`] one whose full cells are divided again. A ray goes through both the same way:
//! [`walk`] follows it from cell to cell along its [`way`], by the steps of [`steps`], in the coordinates of [`ray`]. [`walks`] are sixteen
//! of those side by side.

#[cfg(test)]
mod bounds;
mod list;
mod narrow;
mod near;
mod nested;
mod options;
mod overlap;
mod ray;
mod search;
mod sixteen;
mod space;
mod steps;
mod uniform;
mod validate;
mod walk;
mod walks;
mod way;

pub use options::{GridKind, GridOptions};
pub(crate) use search::search;
pub(crate) use validate::grids_are_sound;
pub(crate) use walk::{Cells, from_afar, visit, walk};
pub(crate) use walks::{Found, Walks};
pub(crate) use way::{Entry, Way};

use crate::block::Census;
use crate::caller::Caller;
use crate::error::BuildError;
use crate::prim::Survey;
use crate::scene::Scene;

/// How much memory a grid wants, and what was found out for that.
#[derive(Clone, Copy)]
pub(crate) struct Needs {
    /// The bytes for the grid that the options ask for, and the bytes below which there is none.
    pub size: usize,
    pub minimum: usize,
    plan: Option<uniform::Plan>,
}

/// How much memory the grid that the options ask for wants.
pub(crate) fn needs(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    caller: &Caller,
) -> Result<Needs, BuildError> {
    match options.kind {
        GridKind::Uniform => uniform::needs(scene, survey, census, options, caller),
        GridKind::Nested | GridKind::Octree => {
            let (size, minimum) = nested::needs(survey, census)?;
            Ok(Needs { size, minimum, plan: None })
        }
    }
}

/// Builds into `bytes`, which are at least the minimum of [`needs`]; returns the size of the
/// finished block. At least one primitive can be hit.
pub(crate) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    needs: &Needs,
    caller: &Caller,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    match options.kind {
        GridKind::Uniform => match needs.plan.filter(|plan| plan.size <= bytes.len()) {
            Some(plan) => uniform::build(scene, census, &plan, caller, bytes),
            None => {
                let limit = bytes.len();
                let plan = uniform::Plan::finest(scene, survey, census, options, caller, limit)?;
                uniform::build(scene, census, &plan, caller, bytes)
            }
        },
        GridKind::Nested | GridKind::Octree => {
            nested::build(scene, survey, census, options, caller, bytes)
        }
    }
}

/// Origins further away than this many of the finest cells are too far for `f64`: rounding moves their rays by 2^-14 of a cell.
const BEYOND: f64 = (1u64 << 36) as f64;

/// How far around a cell primitives are listed in it, in cells, when `finest` of them would fill the outermost grid along that axis.
///
/// Stepping errs by less than three quarters of it: `42 u` times `finest` in grids eight deep, and 2^-14 for what `f64` is off.
fn dilation(finest: f64) -> f64 {
    1.0 / 4096.0 + finest / (1u64 << 18) as f64
}

/// The most finest cells along an axis: primitives are listed up to a sixteenth of a cell around them then.
const FINEST: u32 = 1 << 14;
