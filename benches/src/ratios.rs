//! Who is faster, and by how much: a peer's time over ours.

use raykern::Precision;
use raykern_harness::stats::Ratio;

use crate::lineup::Class;
use crate::measure::{KindResult, SceneResult};
use crate::rays::Kind;

/// Methods of ours against the best of some peers.
struct Match {
    ours: Class,
    against: &'static str,
    peers: &'static [Class],
}

const EXACT: Class = Class::Single(Precision::Exact);
const WATERTIGHT: Class = Class::Single(Precision::Watertight);
const BATCH: Class = Class::Batch(Precision::Exact);

/// Of several devices or forms the fastest counts, for each scene and kind of ray anew.
const MATCHES: [Match; 17] = [
    Match { ours: EXACT, against: "itself (the noise)", peers: &[Class::Noise] },
    Match { ours: EXACT, against: "embree", peers: &[Class::Embree] },
    Match { ours: EXACT, against: "embree robust", peers: &[Class::EmbreeRobust] },
    Match { ours: EXACT, against: "embree high", peers: &[Class::EmbreeHigh] },
    Match { ours: EXACT, against: "rust peers", peers: &[Class::RustPeer] },
    Match { ours: WATERTIGHT, against: "embree", peers: &[Class::Embree] },
    Match { ours: WATERTIGHT, against: "embree robust", peers: &[Class::EmbreeRobust] },
    Match {
        ours: BATCH,
        against: "embree, one ray or stream",
        peers: &[Class::Embree, Class::EmbreeStream],
    },
    Match {
        ours: BATCH,
        against: "embree, any form",
        peers: &[Class::Embree, Class::EmbreeStream, Class::EmbreePackets],
    },
    Match {
        ours: BATCH,
        against: "embree robust, any form",
        peers: &[Class::EmbreeRobust, Class::EmbreeRobustBatch],
    },
    Match { ours: Class::Fast, against: "our bvh", peers: &[EXACT] },
    Match { ours: Class::Fast, against: "embree low", peers: &[Class::EmbreeLow] },
    Match { ours: Class::Best, against: "our bvh", peers: &[EXACT] },
    Match { ours: Class::Best, against: "embree high", peers: &[Class::EmbreeHigh] },
    Match {
        ours: Class::Grid(Precision::Exact),
        against: "our binary bvh",
        peers: &[Class::Compact],
    },
    Match { ours: Class::Grid(Precision::Exact), against: "our bvh", peers: &[EXACT] },
    Match { ours: Class::Grid(Precision::Exact), against: "embree", peers: &[Class::Embree] },
];

/// Prints every match that took place, scene by scene, with geometric mean and worst.
pub fn print(results: &[SceneResult]) {
    println!("RATIOS: the time of the best peer over ours; above 1 we are faster.");
    println!("With the half width of the 95 % interval, in per cent.\n");
    let scenes: Vec<&SceneResult> = results.iter().filter(|scene| !scene.fixed_cost).collect();
    for game in &MATCHES {
        for name in names(&scenes, game.ours) {
            print_match(&scenes, game, &name);
        }
    }
}

/// The methods of this class, each once.
fn names(scenes: &[&SceneResult], class: Class) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (name, of) in scenes.iter().flat_map(|scene| &scene.subjects) {
        if *of == class && !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

fn print_match(scenes: &[&SceneResult], game: &Match, ours: &str) {
    let ratios: Vec<Vec<(Kind, Option<Ratio>)>> = scenes
        .iter()
        .map(|scene| {
            let ratio = |kind: &KindResult| (kind.kind, best_ratio(scene, kind, ours, game.peers));
            scene.kinds.iter().map(ratio).collect()
        })
        .collect();
    if ratios.iter().flatten().all(|(_, ratio)| ratio.is_none()) {
        return;
    }
    let kinds: Vec<Kind> = ratios[0].iter().map(|(kind, _)| *kind).collect();
    print!("{:<42}", format!("{ours} against {}", game.against));
    kinds.iter().for_each(|kind| print!("{:>13}", kind.name()));
    println!();
    for (scene, row) in scenes.iter().zip(&ratios) {
        print!("  {:<40}", scene.name);
        row.iter().for_each(|(_, ratio)| print!("{:>13}", cell(ratio.as_ref())));
        println!();
    }
    let column = |k: usize| -> Vec<f64> {
        ratios.iter().filter_map(|row| row[k].1.as_ref().map(|ratio| ratio.mean)).collect()
    };
    for (name, sum) in [("geometric mean", geomean as fn(&[f64]) -> f64), ("worst", least)] {
        print!("  {name:<40}");
        (0..kinds.len()).for_each(|k| print!("{:>13}", format!("{:.2}     ", sum(&column(k)))));
        println!();
    }
    println!();
}

/// The ratio of the fastest of these peers to ours; `None` when one side was not measured.
fn best_ratio(
    scene: &SceneResult,
    kind: &KindResult,
    ours: &str,
    peers: &[Class],
) -> Option<Ratio> {
    let of = |i: usize| &kind.methods[i];
    let mine = scene.subjects.iter().position(|(name, _)| name == ours)?;
    let peers = (0..scene.subjects.len())
        .filter(|&i| i != mine && peers.contains(&scene.subjects[i].1))
        .filter_map(|i| Some((of(i).median_seconds()?, i)));
    let (_, best) = peers.min_by(|a, b| a.0.total_cmp(&b.0))?;
    Ratio::paired(&of(best).seconds(), &of(mine).seconds())
}

fn cell(ratio: Option<&Ratio>) -> String {
    let Some(ratio) = ratio else { return "-     ".to_string() };
    let half = ratio.interval.map(|(low, high)| 50.0 * (high / low).ln());
    let half = half.map_or("     ".to_string(), |half| format!(" ±{half:>3.0}"));
    format!("{:.2}{half}", ratio.mean)
}

fn geomean(values: &[f64]) -> f64 {
    (values.iter().map(|x| x.ln()).sum::<f64>() / values.len() as f64).exp()
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_cells() {
        assert!((geomean(&[0.5, 2.0, 8.0]) - 2.0).abs() < 1e-12);
        assert_eq!(least(&[0.5, 2.0]), 0.5);
        let ratio = Ratio { mean: 1.5, interval: Some((1.5 / 1.1, 1.5 * 1.1)) };
        assert_eq!(cell(Some(&ratio)), "1.50 ± 10");
    }
}
