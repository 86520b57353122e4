//! raykern's own methods.

use std::rc::Rc;

use anyhow::{Context, Result};
use raykern::{
    Accel, BuildError, BuildOptions, Hit, Layout, OwnedAccel, PlainList, Precision, Quality,
    QueryOptions, Ray,
};
use raykern_harness::model::Model;

use crate::lineup::{Class, Lineup, Tracer};
use crate::options::Options;
use crate::watch::{Watch, timed_build};

/// Adds the BVH in every layout asked for, in the other qualities too, and the grid.
pub fn join(lineup: &mut Lineup, model: &Model, options: &Options) -> Result<()> {
    for (name, layout) in options.layouts() {
        let name = match layout {
            Layout::Automatic => "bvh".to_string(),
            _ => format!("bvh-{name}"),
        };
        let (accel, seconds) = timed_build(|| bvh(model, layout));
        let accel = accel.with_context(|| name.clone())?;
        lineup.built(&name, seconds, Some(accel.accel().block().len()));
        add_bvh(lineup, &name, &Rc::new(accel));
        for (quality, suffix, class) in
            [(Quality::Fast, "fast", Class::Fast), (Quality::Best, "best", Class::Best)]
        {
            let name = format!("{name}-{suffix}");
            let (built, seconds) = timed_build(|| bvh_of(model, layout, quality));
            let built = Rc::new(built.with_context(|| name.clone())?);
            lineup.built(&name, seconds, Some(built.accel().block().len()));
            lineup.add(&name, class, Single::new(&built, Precision::Exact));
        }
    }
    let (grid, seconds) =
        timed_build(|| model.with_scene(|scene| OwnedAccel::grid(scene, &BuildOptions::default())));
    let grid = grid.context("grid")?;
    lineup.built("grid", seconds, Some(grid.accel().block().len()));
    let grid = Rc::new(grid);
    lineup.add("grid", Class::Grid(Precision::Exact), Single::new(&grid, Precision::Exact));
    Ok(())
}

/// A BVH, or for a handful of triangles the list that stands in for it.
pub fn bvh(model: &Model, layout: Layout) -> Result<OwnedAccel<'static>, BuildError> {
    bvh_of(model, layout, Quality::Balanced)
}

fn bvh_of(
    model: &Model,
    layout: Layout,
    quality: Quality,
) -> Result<OwnedAccel<'static>, BuildError> {
    let options = BuildOptions { layout, quality, ..BuildOptions::default() };
    model.with_scene(|scene| OwnedAccel::bvh(scene, &options))
}

/// No structure at all: what every other answer must equal.
pub fn list(model: &Model) -> Result<OwnedAccel<'static>, BuildError> {
    let options = BuildOptions { plain_list: PlainList::Always, ..BuildOptions::default() };
    model.with_scene(|scene| OwnedAccel::bvh(scene, &options))
}

fn add_bvh(lineup: &mut Lineup, name: &str, accel: &Rc<OwnedAccel<'static>>) {
    let (exact, watertight) = (Precision::Exact, Precision::Watertight);
    lineup.add(name, Class::Single(exact), Single::new(accel, exact));
    lineup.add(format!("{name} again"), Class::Noise, Single::new(accel, exact));
    let single = Single::new(accel, watertight);
    lineup.add(format!("{name} watertight"), Class::Single(watertight), single);
    lineup.add(format!("{name} batch"), Class::Batch(exact), Batch(accel.clone()));
}

/// Adds structures over instances.
pub fn add_instances(
    lineup: &mut Lineup,
    bvh: &Rc<OwnedAccel<'static>>,
    grid: OwnedAccel<'static>,
) {
    add_bvh(lineup, "bvh", bvh);
    let grid = Single::new(&Rc::new(grid), Precision::Exact);
    lineup.add("grid over grid", Class::Grid(Precision::Exact), grid);
}

/// One call a ray.
pub struct Single {
    accel: Rc<OwnedAccel<'static>>,
    options: QueryOptions,
}

impl Single {
    /// Asks `accel`.
    pub fn new(accel: &Rc<OwnedAccel<'static>>, precision: Precision) -> Self {
        let options = QueryOptions { precision, ..QueryOptions::default() };
        Single { accel: accel.clone(), options }
    }
}

impl Tracer for Single {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        let accel = self.accel.accel();
        watch.time(|| match self.options.precision {
            Precision::Exact => each(rays, hits, |ray| closest(&accel, ray)),
            Precision::Watertight => each(rays, hits, |ray| {
                accel.intersect_with(ray, &self.options).unwrap_or(Hit::MISS)
            }),
        });
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        let accel = self.accel.accel();
        watch.time(|| match self.options.precision {
            Precision::Exact => each(rays, occluded, |ray| accel.occluded(ray)),
            Precision::Watertight => {
                each(rays, occluded, |ray| accel.occluded_with(ray, &self.options))
            }
        });
    }
}

fn closest(accel: &Accel, ray: &Ray) -> Hit {
    accel.intersect(ray).unwrap_or(Hit::MISS)
}

/// Writes the answer to each ray.
pub fn each<A>(rays: &[Ray], answers: &mut [A], ask: impl Fn(&Ray) -> A) {
    rays.iter().zip(answers).for_each(|(ray, answer)| *answer = ask(ray));
}

/// One call for all rays.
pub struct Batch(pub Rc<OwnedAccel<'static>>);

impl Tracer for Batch {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        let accel = self.0.accel();
        watch.time(|| accel.intersect_batch(rays, hits));
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        let accel = self.0.accel();
        watch.time(|| accel.occluded_batch(rays, occluded));
    }
}
