//! How build, memory and rays grow with the scene: by triangles, and by instances.

use std::rc::Rc;

use anyhow::{Result, anyhow};
use glam::{DAffine3, DMat3, DVec3};
use raykern::{BuildOptions, GridKind, OwnedAccel, Precision, Quality};
use raykern_bench::ours::Single;
use raykern_bench::watch::thread_seconds;
use raykern_harness::assembly::{Assembly, Place};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;

#[cfg(feature = "embree")]
use crate::methods::REFERENCE;
use crate::methods::Structure;
use crate::options::Options;
use crate::rows::Build;
use crate::structures::{Measured, Ready, build_all, random_rays, time};
use crate::timing::Job;

/// What these runs are called.
pub const TRIANGLES: &str = "growth";
/// Likewise, with instances.
pub const INSTANCES: &str = "instances";

const STRUCTURES: [(&str, Structure); 5] = [
    ("BVH", Structure::Wide(Quality::Balanced)),
    ("BVH fast", Structure::Wide(Quality::Fast)),
    ("binary BVH", Structure::Binary),
    ("nested grid", Structure::Grid(GridKind::Nested)),
    ("plain grid", Structure::Grid(GridKind::Uniform)),
];
const RAYS: usize = 20_000;
/// Triangles of what is shown many times.
const CHILD: usize = 2_000;

/// Wrinkled balls from a thousand triangles on, two to a factor of ten.
pub fn measure_triangles(options: &Options) -> Result<()> {
    let mut measured = Measured::default();
    let sizes = (6..).map(|i| 10f64.powf(f64::from(i) / 2.0) as usize);
    let wanted = |size: &usize| options.wants_scene(&size.to_string());
    for size in sizes.take_while(|size| *size <= options.largest()).filter(wanted) {
        eprintln!("  {size} triangles");
        let model: Model = make::blob(size, 1).into();
        let name = model.triangle_count().to_string();
        let mut ready = build_all([TRIANGLES, &name], &model, &STRUCTURES, options, &mut measured)?;
        ready.extend(reference(&name, &model, &mut measured));
        let rays = random_rays(&model, RAYS);
        let job = Job { rays: &rays, any: false, coherent: false };
        time([TRIANGLES, &name, "random"], &ready, &job, options, &mut measured);
    }
    measured.replace(options, TRIANGLES)
}

#[cfg(feature = "embree")]
fn reference(name: &str, model: &Model, measured: &mut Measured) -> Option<Ready> {
    let (tracer, seconds, bytes) = raykern_bench::embree::single(model, EMBREE)?;
    measured.builds.push(build(
        [TRIANGLES, name],
        REFERENCE,
        model.triangle_count(),
        seconds,
        bytes,
    ));
    Some(Ready { name: REFERENCE, tracer: tracer.into() })
}

#[cfg(not(feature = "embree"))]
fn reference(_: &str, _: &Model, _: &mut Measured) -> Option<Ready> {
    None
}

#[cfg(feature = "embree")]
const EMBREE: raykern_bench::embree::Way =
    raykern_bench::embree::Way { quality: 1, flags: raykern_bench::embree::PLAIN, config: c"" };

fn build(
    [family, scene]: [&str; 2],
    method: &str,
    count: usize,
    seconds: f64,
    bytes: usize,
) -> Build {
    Build {
        family: family.to_owned(),
        scene: scene.to_owned(),
        method: method.to_owned(),
        count,
        run: 0,
        seconds,
        bytes,
        took: String::new(),
    }
}

/// One ball from once to as often as is asked for, ten times as often each time. Builds are those over the instances alone.
pub fn measure_instances(options: &Options) -> Result<()> {
    let mut measured = Measured::default();
    let child: Model = make::blob(CHILD, 1).into();
    let defaults = BuildOptions::default();
    let built = child.with_scene(|scene| OwnedAccel::bvh(scene, &defaults))?;
    let counts = (0..).map(|i| 10usize.pow(i));
    for count in counts.take_while(|count| *count <= options.most_instances()) {
        eprintln!("  {count} instances");
        let assembly = strewn(&child, count);
        let name = count.to_string();
        let accel = assembly.with_scene_over(std::slice::from_ref(&built), |scene| {
            let mut all = |run| {
                let begun = thread_seconds();
                let top = OwnedAccel::bvh(scene, &defaults);
                let seconds = thread_seconds() - begun;
                let bytes = top.as_ref().map_or(0, |top| top.accel().block().len());
                let row = build([INSTANCES, &name], "BVH", count, seconds, bytes);
                measured.builds.push(Build { run, ..row });
                top
            };
            (1..options.run_count().min(5)).try_for_each(|run| all(run).map(drop))?;
            all(0)?.packed()
        });
        let accel = accel.map_err(|error| anyhow!("{count} instances: {error}"))?;
        let rays = around(&accel, RAYS);
        let single = Single::new(&Rc::new(accel), Precision::Exact);
        let mut ready = vec![Ready { name: "BVH", tracer: Rc::new(single) }];
        ready.extend(reference_instances(&assembly, count, &mut measured));
        let job = Job { rays: &rays, any: false, coherent: false };
        time([INSTANCES, &name, "random"], &ready, &job, options, &mut measured);
    }
    measured.replace(options, INSTANCES)
}

#[cfg(feature = "embree")]
fn reference_instances(
    assembly: &Assembly,
    count: usize,
    measured: &mut Measured,
) -> Option<Ready> {
    let maps: Vec<_> = assembly.places.iter().map(|place| place.object_to_world).collect();
    let child = &assembly.children[0];
    let (tracer, seconds, bytes) = raykern_bench::embree::single_instances(child, &maps, EMBREE)?;
    measured.builds.push(build([INSTANCES, &count.to_string()], REFERENCE, count, seconds, bytes));
    Some(Ready { name: REFERENCE, tracer: tracer.into() })
}

#[cfg(not(feature = "embree"))]
fn reference_instances(_: &Assembly, _: usize, _: &mut Measured) -> Option<Ready> {
    None
}

/// Random rays through the box of a structure.
fn around(accel: &OwnedAccel, count: usize) -> Vec<raykern::Ray> {
    let info = accel.accel().info();
    let corners = Model {
        meshes: Vec::new(),
        sphere_sets: vec![[info.lower, info.upper].map(|[x, y, z]| [x, y, z, 0.0]).to_vec()],
    };
    random_rays(&corners, count)
}

/// In a cube, each turned at random, scaled by 0.3 to 0.7 of the room it has.
fn strewn(child: &Model, count: usize) -> Assembly {
    let side = (count as f64).cbrt().ceil();
    let mut random = Random::new(9);
    let place = |i: usize| {
        let i = i as f64;
        let at = DVec3::new(i % side, (i / side).floor() % side, (i / side / side).floor());
        let [x, z] = [0; 2].map(|_| random.between(0.0, std::f64::consts::TAU));
        let turn = DMat3::from_rotation_x(x) * DMat3::from_rotation_z(z);
        let map = DAffine3::from_mat3_translation(turn * random.between(0.15, 0.35), at);
        Place::new(0, &map).expect("a map with volume")
    };
    let places = (0..count).map(place).collect();
    Assembly { own: Model::default(), children: vec![child.clone()], places }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_instances_as_asked_and_rays_meet_some() {
        let child: Model = make::blob(50, 1).into();
        let assembly = strewn(&child, 30);
        assert_eq!(assembly.places.len(), 30);
        let accel =
            assembly.build(|scene| OwnedAccel::bvh(scene, &BuildOptions::default())).unwrap();
        let rays = around(&accel, 500);
        let hits = rays.iter().filter(|ray| accel.accel().occluded(ray)).count();
        assert!(hits > 50, "{hits}");
    }
}
