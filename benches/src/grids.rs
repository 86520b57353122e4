//! Grids against BVHs: rays through the nested grid against the binary BVH over the same leaf blocks, also in scenes of mixed sizes,
//! where grids are known to fail; and what the automatic choice costs over the better of what there is.

use std::rc::Rc;

use anyhow::{Context, Result};
use glam::{DQuat, DVec3};
use raykern::{BuildOptions, GridKind, GridOptions, Layout, OwnedAccel, Precision, Quality};
use raykern_harness::make::{self, Random};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::render::RenderScene;
use raykern_harness::scenes::{self as made, SceneMaker};

use crate::lineup::{Class, Lineup};
use crate::measure::{KindResult, SceneResult, measure_lineup};
use crate::options::Options;
use crate::ours::{Batch, Single};
use crate::report;
use crate::scenes::{self, Loaded, View, load_file, prepared};
use crate::watch::{Watch, timed_build};

/// Files in which a plain grid fails.
const FILES: [(&str, &str); 3] = [
    ("dragon_metal", "metu/dragon_metal_standin.xml"),
    ("teapot_stadium", "classic/teapot_stadium.xml"),
    ("marching_dragons", "metu/marching_dragons.xml"),
];
/// The same made in code, and others.
const MADE: [(&str, SceneMaker); 4] =
    [("hall", made::stadium), ("marching", made::marching), ("tubes", tubes), ("sizes", sizes)];
/// What is left out unless it is named: these take minutes.
const LARGE: [&str; 2] = ["cave", "marching_dragons"];

/// Rays for each primitive until the next build, for which the choice is judged.
const RAYS_PER_PRIM: [f32; 10] = [0.01, 0.03, 0.06, 0.1, 0.2, 0.4, 1.0, 3.0, 10.0, 100.0];

/// Measures every scene; prints the regrets, and returns the rest.
pub fn run(options: &Options, watch: &mut Watch) -> Result<Vec<SceneResult>> {
    let (mut results, mut regrets) = (Vec::new(), Vec::new());
    let mut each = |name: &str, scene: Result<Loaded, String>| {
        match scene {
            Ok(scene) => {
                let (lineup, blocks) = lineup(&scene.model)?;
                let result = measure_lineup(name, &scene, lineup, options, watch);
                let result = result.context(name.to_string())?;
                report::scene(&result);
                regrets.push((name.to_string(), regret(&result, &blocks, &scene.model)?));
                results.push(result);
            }
            Err(reason) => println!("{name}: skipped: {reason}\n"),
        }
        anyhow::Ok(())
    };
    let wanted = |name: &str| options.names_scene(name).unwrap_or(!LARGE.contains(&name));
    for case in scenes::cases(options).iter().filter(|case| !case.fixed_cost && wanted(&case.name))
    {
        each(&case.name, case.load(options))?;
    }
    for (name, file) in FILES.iter().filter(|(name, _)| !options.quick && wanted(name)) {
        each(name, load_file(file, options))?;
    }
    for (name, make) in MADE.iter().filter(|(name, _)| !options.quick && wanted(name)) {
        each(name, prepared(make(), View::Given))?;
    }
    print_costs(&results);
    print_regrets(&regrets);
    Ok(results)
}

/// What there is to choose from, and a mark in the table of regrets for each.
const CHOICES: [(&str, &str); 4] =
    [("bvh", " "), ("bvh-fast", "f"), ("grid", "n"), ("uniform", "u")];

/// What there is to choose from, by name.
type Blocks = Vec<(&'static str, Rc<OwnedAccel<'static>>)>;

/// The structures that there are to choose from, and the binary BVH.
fn lineup(model: &Model) -> Result<(Lineup, Blocks)> {
    let (mut lineup, mut blocks) = (Lineup::default(), Blocks::new());
    let uniform = GridOptions { kind: GridKind::Uniform, ..GridOptions::default() };
    let compact = BuildOptions { layout: Layout::Compact, ..BuildOptions::default() };
    let fast = BuildOptions { quality: Quality::Fast, ..BuildOptions::default() };
    let exact = Precision::Exact;
    for (name, class, options) in [
        ("bvh", Class::Single(exact), BuildOptions::default()),
        ("bvh-fast", Class::Fast, fast),
        ("bvh-compact", Class::Compact, compact),
        ("grid", Class::Grid(exact), BuildOptions::default()),
        ("uniform", Class::Grid(exact), BuildOptions { grid: uniform, ..BuildOptions::default() }),
    ] {
        let is_grid = matches!(class, Class::Grid(_));
        let (built, seconds) = timed_build(|| {
            model.with_scene(|scene| match is_grid {
                true => OwnedAccel::grid(scene, &options),
                false => OwnedAccel::bvh(scene, &options),
            })
        });
        let built = Rc::new(built.context(name)?);
        lineup.built(name, seconds, Some(built.accel().block().len()));
        lineup.add(name, class, Single::new(&built, exact));
        if name == "grid" {
            lineup.add("grid batch", class, Batch(built.clone()));
        }
        blocks.push((name, built));
    }
    Ok((lineup, blocks))
}

/// For each of [`RAYS_PER_PRIM`] what is chosen, as a number in [`CHOICES`], and its time, building and tracing, over that of the best.
fn regret(result: &SceneResult, blocks: &Blocks, model: &Model) -> Result<Vec<(usize, f64)>> {
    let costs = CHOICES.map(|(name, _)| cost(result, name));
    let of = |rays_per_prim| {
        let options = BuildOptions { rays_per_prim, ..BuildOptions::default() };
        let built = model.with_scene(|scene| OwnedAccel::automatic(scene, &options))?;
        let is_it =
            |(_, other): &&(&str, Rc<OwnedAccel>)| other.accel().block() == built.accel().block();
        let name =
            blocks.iter().find(is_it).context("what was chosen is not there to choose from")?.0;
        let chosen = CHOICES.iter().position(|(other, _)| *other == name).context("no choice")?;
        let times = costs.map(|[build, ray]| build + f64::from(rays_per_prim) * ray);
        Ok((chosen, times[chosen] / times.into_iter().fold(f64::INFINITY, f64::min)))
    };
    RAYS_PER_PRIM.into_iter().map(of).collect()
}

/// The seconds to build a structure, for each primitive, and those of a ray, the geometric mean of all kinds, by a sample where it was
/// too slow to be measured.
fn cost(result: &SceneResult, name: &str) -> [f64; 2] {
    let structure = result.structures.iter().find(|structure| structure.name == name);
    let subject = result.subjects.iter().position(|(subject, _)| subject == name);
    let seconds = |kind: &KindResult| {
        let method = subject.map(|i| &kind.methods[i]);
        let measured = method.map(|method| method.median_seconds().unwrap_or(method.by_sample));
        (measured.unwrap_or(f64::INFINITY) / kind.rays as f64).ln()
    };
    let mean = result.kinds.iter().map(seconds).sum::<f64>() / result.kinds.len() as f64;
    let build = structure.map_or(f64::INFINITY, |s| s.seconds) / result.count.max(1) as f64;
    [build, mean.exp()]
}

/// The costs of what there is to choose from.
fn print_costs(results: &[SceneResult]) {
    println!(
        "COST: nanoseconds for each triangle to build, and for a ray, the mean of all kinds.\n"
    );
    print!("  {:<24}", "");
    CHOICES.iter().for_each(|(name, _)| print!("{name:>14}"));
    println!();
    for result in results {
        print!("  {:<24}", result.name);
        for (name, _) in CHOICES {
            let [build, ray] = cost(result, name).map(|seconds| 1e9 * seconds);
            print!("{:>14}", format!("{build:.0}, {ray:.0}"));
        }
        println!();
    }
    println!();
}

fn print_regrets(regrets: &[(String, Vec<(usize, f64)>)]) {
    println!(
        "REGRET of the choice, building and tracing; f: a fast BVH was chosen, n: a nested grid, u: a uniform one.\n"
    );
    print!("  {:<24}", "rays a primitive");
    RAYS_PER_PRIM.iter().for_each(|rays| print!("{rays:>9}"));
    println!();
    for (name, row) in regrets {
        print!("  {name:<24}");
        for (chosen, regret) in row {
            print!("{:>9}", format!("{regret:.2}{}", CHOICES[*chosen].1));
        }
        println!();
    }
    let all: Vec<f64> = regrets.iter().flat_map(|(_, row)| row.iter().map(|cell| cell.1)).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    println!("  mean {mean:.3}, worst {:.2}\n", all.iter().copied().fold(1.0, f64::max));
}

/// 1,500 tubes of 24 sides, 1 to 6 hundredths thick and 0.4 to 4 long, a third of them askew: 72,000 triangles.
fn tubes() -> RenderScene {
    const SIDES: u32 = 24;
    let mut random = Random::new(11);
    let mut mesh = TriangleMesh::default();
    for i in 0..1_500 {
        let along = match i % 3 {
            0 => DVec3::from(random.direction()),
            axis => DVec3::AXES[(axis - 1 + random.below(2)) % 3],
        };
        let turn = DQuat::from_rotation_arc(DVec3::Z, along);
        let (radius, length) = (random.between(0.005, 0.03), random.between(0.4, 4.0));
        let middle = DVec3::from(random.point(0.0, 1.0)) * DVec3::new(8.0, 2.4, 2.4);
        let first = mesh.vertices.len() as u32;
        for side in 0..SIDES {
            let angle = f64::from(side) / f64::from(SIDES) * std::f64::consts::TAU;
            for end in [-0.5, 0.5] {
                let p = DVec3::new(radius * angle.cos(), radius * angle.sin(), end * length);
                mesh.vertices.push((middle + turn * p).as_vec3().to_array());
            }
            let [a, b] = [first + 2 * side, first + 2 * ((side + 1) % SIDES)];
            mesh.indices.extend([[a, b, a + 1], [b, b + 1, a + 1]]);
        }
    }
    seen(mesh.into())
}

/// 103 balls of 1,000 to 40,000 triangles on a floor, in sizes of 1 to 1/1000.
fn sizes() -> RenderScene {
    let mut random = Random::new(12);
    let mut mesh = make::plane(20_000).placed(8.0, [-4.0, -4.0, 0.0]);
    for i in 0..103 {
        let radius = 0.5 * 10f64.powf(-3.0 * random.unit());
        let [x, y, _] = random.point(-3.0, 3.0);
        let triangles = if i % 25 == 0 { 40_000 } else { random.below(4_000) + 1_000 };
        mesh.append(&make::blob(triangles, i).placed(radius, [x, y, 1.2 * radius]));
    }
    seen(mesh.into())
}

fn seen(model: Model) -> RenderScene {
    RenderScene::portrait(model, DVec3::Z, DVec3::new(0.3, -1.0, 0.5))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[test]
    fn grids_agree_and_nothing_is_better_than_the_best() {
        let words = ["", "--quick", "--scene", "sphere", "--rays", "300", "--runs", "2"];
        let options = Options::parse_from(words);
        let case = scenes::cases(&options).remove(0);
        let scene = case.load(&options).expect("a generated scene");
        let (lineup, blocks) = lineup(&scene.model).expect("structures");
        let result = measure_lineup(&case.name, &scene, lineup, &options, &mut Watch::new());
        let result = result.expect("the same answers");
        assert_eq!((result.structures.len(), result.subjects.len()), (5, 6));
        let regrets = regret(&result, &blocks, &scene.model).expect("a choice");
        assert!(regrets.iter().all(|(_, regret)| *regret >= 1.0));
        assert_eq!(CHOICES[regrets[RAYS_PER_PRIM.len() - 1].0].0, "bvh");
    }

    #[test]
    fn scenes_of_mixed_sizes_are_as_large_as_they_say() {
        for (scene, triangles) in [(tubes(), 72_000), (sizes(), 300_000)] {
            let model = prepared(scene, View::Given).expect("triangles").model;
            let count = model.triangle_count();
            assert!((triangles..2 * triangles).contains(&count), "{count}");
        }
    }
}
