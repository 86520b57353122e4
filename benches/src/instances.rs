//! Instances: one model many times, turned and scaled, and what a frame costs in which they have moved.

use std::rc::Rc;

use anyhow::{Context, Result};
use glam::{DAffine3, DMat3, DVec3};
use raykern::{BuildOptions, OwnedAccel};
use raykern_harness::assembly::{Assembly, Place};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::render::{Camera, bounds};

use crate::check::Answers;
use crate::lineup::Lineup;
use crate::measure::{SceneResult, measure_kind};
use crate::options::Options;
use crate::ours;
use crate::rays::RayMaker;
use crate::report;
use crate::scenes::{Loaded, View, load_file};
use crate::watch::{Watch, timed_build};

/// How often the model is shown.
const COUNTS: [usize; 2] = [8, 400];
/// The triangles of a model that is made, where the file is not at hand: as many as that has.
const TRIANGLES: usize = 871_414;

/// Measures every number of instances.
pub fn run(options: &Options, watch: &mut Watch) -> Result<Vec<SceneResult>> {
    let (name, model) = match load_file("metu/chinese_dragon.xml", options) {
        Ok(scene) if !options.quick => ("chinese_dragon", scene.model),
        _ => ("blob", make::blob(if options.quick { 20_000 } else { TRIANGLES }, 1).into()),
    };
    println!("INSTANCES: builds are those over the instances alone.\n");
    let mut results = Vec::new();
    for count in COUNTS {
        let name = format!("{count} of {name}");
        if options.names_scene(&count.to_string()).unwrap_or(true) {
            let result = measure(&name, &model, count, options, watch).context(name)?;
            report::scene(&result);
            results.push(result);
        }
    }
    Ok(results)
}

fn measure(
    name: &str,
    model: &Model,
    count: usize,
    options: &Options,
    watch: &mut Watch,
) -> Result<SceneResult> {
    let (assembly, view) = strewn(model, count);
    let defaults = BuildOptions::default();
    let mut lineup = Lineup::default();
    let child = model.with_scene(|scene| OwnedAccel::bvh(scene, &defaults))?;
    let bvh = assembly.with_scene_over(std::slice::from_ref(&child), |scene| {
        let (top, seconds) = timed_build(|| OwnedAccel::bvh(scene, &defaults));
        let top = top?;
        lineup.built("bvh", seconds, Some(top.accel().block().len()));
        top.packed()
    })?;
    drop(child);
    let (bvh, grid) = (Rc::new(bvh), assembly.build(|scene| OwnedAccel::grid(scene, &defaults))?);
    ours::add_instances(&mut lineup, &bvh, grid);
    #[cfg(feature = "embree")]
    {
        let maps: Vec<_> = assembly.places.iter().map(|place| place.object_to_world).collect();
        crate::embree::join_instances(&mut lineup, model, &maps, options);
    }
    let accel = bvh.accel();
    let maker = RayMaker::new(&view, &accel, options.ray_count());
    let mut kinds = Vec::new();
    for kind in options.kinds() {
        let rays = maker.make(kind);
        // The grid, which takes part, shows whether this is right.
        let right = Answers::of(&accel, &rays, kind.question());
        let (rays, right) = (rays.as_slice(), &right);
        kinds.push(measure_kind(&lineup.subjects, &accel, kind, (rays, right), options, watch)?);
    }
    Ok(SceneResult {
        name: name.to_string(),
        fixed_cost: false,
        count,
        unit: "instance",
        structures: lineup.structures,
        subjects: lineup.subjects.into_iter().map(|s| (s.name, s.class)).collect(),
        kinds,
        notes: lineup.notes,
    })
}

/// `count` instances in a square, each turned about the vertical, scaled by 0.7 to 1.3 and raised or lowered a little; seen from
/// above its edge.
fn strewn(model: &Model, count: usize) -> (Assembly, Loaded) {
    let (lower, upper) = bounds(model);
    let (middle, step) = (0.5 * (lower + upper), (upper - lower).max_element());
    let side = (count as f64).sqrt().ceil();
    let mut random = Random::new(5);
    let mut place = |i: usize| {
        let (x, z) = ((i as f64 % side).floor(), (i as f64 / side).floor());
        let y = random.between(-0.2, 0.2);
        let turn = DMat3::from_rotation_y(random.between(0.0, std::f64::consts::TAU));
        let linear = turn * random.between(0.7, 1.3);
        let at = step * DVec3::new(x, y, z) - linear * middle;
        Place::new(0, &DAffine3::from_mat3_translation(linear, at)).expect("a map with volume")
    };
    let places = (0..count).map(&mut place).collect();
    let assembly = Assembly { own: Model::default(), children: vec![model.clone()], places };
    let width = step * side;
    let eye = DVec3::new(0.5 * width, 0.6 * width, 1.4 * width);
    let target = DVec3::new(0.5 * width, 0.0, 0.4 * width);
    let camera = Camera::look_at(eye, target, DVec3::Y, 45.0, 1.0, [1024, 1024]);
    let light = DVec3::new(-0.3 * width, width, 0.2 * width);
    let camera = camera.expect("a sound camera");
    (assembly, Loaded { model: Model::default(), view: View::Given, camera, light })
}
