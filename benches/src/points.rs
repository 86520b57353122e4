//! Points: what the closest point of a scene costs, anywhere in its box and near its surfaces.

use anyhow::{Context, Result, ensure};
use glam::DVec3;
use raykern::{BuildOptions, Hit, Layout, OwnedAccel, QueryOptions};
use raykern_harness::make::Random;
use raykern_harness::model::Model;
use raykern_harness::render::bounds;

use crate::options::Options;
use crate::ours;
use crate::scenes;
use crate::watch::{Watch, median};

/// The scenes, unless others are named.
const SCENES: [&str; 4] = ["chinese_dragon", "sponza_part", "hair", "sphere"];
/// A point takes as long as many rays.
const FEWER: usize = 5;
/// How far points near surfaces are from them at most, of the size of the box.
const NEAR: f64 = 0.01;
/// Of the size of the box: what distances in `f32` may be off.
const ALLOWED: f64 = 1e-5;

/// Finds the closest point for each of many: only the distance of a hit counts, and which primitive it is.
pub trait Finder {
    /// Answers for each point.
    fn find(&self, points: &[[f32; 3]], found: &mut [Hit]);
}

/// Measures the scenes that are asked for.
pub fn run(options: &Options) -> Result<()> {
    println!("POINTS: nanoseconds for the closest point.\n");
    for case in scenes::cases(options) {
        let wanted = options.names_scene(&case.name).unwrap_or(SCENES.contains(&&*case.name));
        if !wanted {
            continue;
        }
        match case.load(options) {
            Ok(scene) => measure(&case.name, &scene.model, options).context(case.name.clone())?,
            Err(reason) => println!("{}: skipped: {reason}\n", case.name),
        }
    }
    Ok(())
}

fn measure(name: &str, model: &Model, options: &Options) -> Result<()> {
    let count = options.ray_count() / FEWER;
    let kinds = [("in the box", anywhere(model, count)), ("near", near(model, count))];
    #[cfg_attr(not(feature = "embree"), expect(unused_mut, reason = "there are no others"))]
    let mut finders = ours(model)?;
    let ours = finders.len();
    #[cfg(feature = "embree")]
    finders.extend(crate::embree::finders(model, options));
    println!("{name}: {} triangles, {count} points", model.triangle_count());
    println!("  {:<20}{:>12}{:>12}", "", kinds[0].0, kinds[1].0);
    let (lower, upper) = bounds(model);
    let allowed = ALLOWED * (upper - lower).max_element();
    let mut table = vec![([0.0; 2], [0; 2]); finders.len()];
    for (k, (kind, points)) in kinds.iter().enumerate() {
        let mut right = vec![Hit::MISS; points.len()];
        finders[0].1.find(points, &mut right);
        let mut seconds = vec![Vec::new(); finders.len()];
        for _ in 0..options.run_count() {
            for (i, ((name, finder), seconds)) in finders.iter().zip(&mut seconds).enumerate() {
                let (mut found, mut watch) = (vec![Hit::MISS; points.len()], Watch::new());
                watch.time(|| finder.find(points, &mut found));
                seconds.push(watch.take().seconds);
                let far = |(a, b): &(&Hit, &Hit)| f64::from((a.t - b.t).abs()) > allowed;
                let wrong = found.iter().zip(&right).filter(|pair| far(pair)).count();
                ensure!(wrong == 0 || i >= ours, "{name}: {wrong} points {kind}");
                table[i].1[k] = wrong;
            }
        }
        for ((row, _), seconds) in table.iter_mut().zip(&mut seconds) {
            row[k] = 1e9 * median(seconds) / points.len() as f64;
        }
    }
    for ((name, _), ([first, second], wrong)) in finders.iter().zip(&table) {
        // What a peer computes in `f32` may come out farther.
        let wrong = match wrong {
            [0, 0] => String::new(),
            [first, second] => format!("  ({first} and {second} wrong)"),
        };
        println!("  {name:<20}{first:>12.0}{second:>12.0}{wrong}");
    }
    println!();
    Ok(())
}

fn anywhere(model: &Model, count: usize) -> Vec<[f32; 3]> {
    let (lower, upper) = bounds(model);
    let mut random = Random::new(3);
    let mut point = || lower + (upper - lower) * DVec3::from(random.point(0.0, 1.0));
    (0..count).map(|_| point().as_vec3().to_array()).collect()
}

/// Beside vertices of the model, which are where its triangles are.
fn near(model: &Model, count: usize) -> Vec<[f32; 3]> {
    let (lower, upper) = bounds(model);
    let away = NEAR * (upper - lower).max_element();
    let vertices: Vec<_> = model.meshes.iter().flat_map(|mesh| &mesh.vertices).collect();
    let mut random = Random::new(4);
    let mut point = || {
        let vertex = vertices[random.below(vertices.len())].map(f64::from);
        DVec3::from(vertex) + DVec3::from(random.point(-away, away))
    };
    (0..count).map(|_| point().as_vec3().to_array()).collect()
}

type Named = (String, Box<dyn Finder>);

fn ours(model: &Model) -> Result<Vec<Named>> {
    let grid = model.with_scene(|scene| OwnedAccel::grid(scene, &BuildOptions::default()))?;
    let built = [
        ("bvh", ours::bvh(model, Layout::Automatic)?),
        ("bvh-compact", ours::bvh(model, Layout::Compact)?),
        ("grid", grid),
    ];
    Ok(built.map(|(name, built)| (name.to_string(), Box::new(built) as Box<dyn Finder>)).into())
}

impl Finder for OwnedAccel<'static> {
    fn find(&self, points: &[[f32; 3]], found: &mut [Hit]) {
        let (accel, options) = (self.accel(), QueryOptions::default());
        for (point, found) in points.iter().zip(found) {
            let closest = accel.closest_point(*point, f32::INFINITY, &options);
            *found = closest.map_or(Hit::MISS, |hit| Hit {
                t: hit.distance,
                prim: hit.prim,
                geometry: hit.geometry,
                ..Hit::MISS
            });
        }
    }
}
