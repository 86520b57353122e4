//! Who takes part: structures, and the ways to ask them.

use raykern::{Hit, Precision, Ray};
use raykern_harness::model::Model;

use crate::options::Options;
use crate::watch::Watch;
use crate::{c_face, ours};

/// A way to ask one structure. Only the asking itself is timed: rays may be brought into another
/// layout before, and answers afterwards.
pub trait Tracer {
    /// The closest hits; a miss is [`Hit::MISS`]. `coherent`: neighbours in the list are alike.
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherent: bool, watch: &mut Watch);
    /// Whether anything is hit.
    fn any(&self, rays: &[Ray], occluded: &mut [bool], coherent: bool, watch: &mut Watch);
}

/// What kind of method a subject is: with what it is compared, and how right it must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    not(all(feature = "embree", feature = "peers")),
    allow(dead_code, reason = "peers that are left out are named all the same")
)]
pub enum Class {
    /// Our BVH, one ray at a time.
    Single(Precision),
    /// Our BVH, all rays in one call.
    Batch(Precision),
    /// Our BVH of the quality fast, one ray at a time.
    Fast,
    /// Our BVH of the quality best, one ray at a time.
    Best,
    /// Our binary BVH, one ray at a time: with what grids are compared.
    Compact,
    /// Our grid.
    Grid(Precision),
    /// Our C face.
    Face,
    /// Our BVH once more: how far the same thing differs from itself.
    Noise,
    /// One ray at a time, medium quality, default accuracy.
    Embree,
    /// As `Embree`, in the robust mode.
    EmbreeRobust,
    /// As `Embree`, with the quality high.
    EmbreeHigh,
    /// As `Embree`, with the quality low.
    EmbreeLow,
    /// Streams without the coherent flag, medium quality, default accuracy.
    EmbreeStream,
    /// Packets, and streams with the flag.
    EmbreePackets,
    /// Packets and streams in the robust mode.
    EmbreeRobustBatch,
    /// A library in Rust, or with a face in Rust.
    RustPeer,
}

impl Class {
    /// Whether it is part of raykern.
    pub fn is_ours(self) -> bool {
        matches!(
            self,
            Class::Single(_)
                | Class::Batch(_)
                | Class::Fast
                | Class::Best
                | Class::Compact
                | Class::Grid(_)
                | Class::Face
                | Class::Noise
        )
    }

    /// Whether its answers must equal the reference to the bit.
    pub fn is_exact(self) -> bool {
        self.is_ours()
            && !matches!(
                self,
                Class::Single(Precision::Watertight)
                    | Class::Batch(Precision::Watertight)
                    | Class::Grid(Precision::Watertight)
            )
    }
}

/// What a build cost.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The method's name.
    pub name: String,
    /// Seconds of the median build.
    pub seconds: f64,
    /// Bytes kept, triangles included; `None` when the library does not say.
    pub bytes: Option<usize>,
}

/// One method that answers rays.
pub struct Subject {
    /// The name in tables.
    pub name: String,
    /// The kind of method.
    pub class: Class,
    /// What asks.
    pub tracer: Box<dyn Tracer>,
}

/// All methods over one scene.
#[derive(Default)]
pub struct Lineup {
    /// Every structure once.
    pub structures: Vec<Structure>,
    /// Every way to ask one.
    pub subjects: Vec<Subject>,
    /// What could not take part, and why.
    pub notes: Vec<String>,
}

impl Lineup {
    /// Builds everything that `options` asks for. With `fixed_cost`, the C face takes part.
    pub fn build(model: &Model, options: &Options, fixed_cost: bool) -> anyhow::Result<Self> {
        let mut lineup = Lineup::default();
        ours::join(&mut lineup, model, options)?;
        if fixed_cost {
            c_face::join(&mut lineup, model)?;
        }
        #[cfg(feature = "embree")]
        crate::embree::join(&mut lineup, model, options);
        #[cfg(feature = "peers")]
        crate::peers::join(&mut lineup, model, options);
        Ok(lineup)
    }

    /// Adds a method.
    pub fn add(&mut self, name: impl Into<String>, class: Class, tracer: impl Tracer + 'static) {
        self.add_boxed(name, class, Box::new(tracer));
    }

    /// The same with a tracer in a box.
    pub fn add_boxed(&mut self, name: impl Into<String>, class: Class, tracer: Box<dyn Tracer>) {
        self.subjects.push(Subject { name: name.into(), class, tracer });
    }

    /// Adds what a build cost.
    pub fn built(&mut self, name: impl Into<String>, seconds: f64, bytes: Option<usize>) {
        self.structures.push(Structure { name: name.into(), seconds, bytes });
    }
}
