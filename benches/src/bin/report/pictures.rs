//! Failures to look at: one small scene for each way to fail, one ray a square, every answer judged.

use anyhow::Result;
use glam::DVec3;
use raykern::{Hit, Ray};
use raykern_bench::watch::Watch;
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::textbook::walk::{Walls, crossed, visited};

use crate::judge::{Judge, Tally};
use crate::methods;
use crate::options::Options;
use crate::rows::{self, Square};

/// Squares in a row of a picture, and rows.
pub const SIDE: usize = 48;

/// What became of a ray, as pictures show it.
const OUTCOMES: [&str; 5] = [
    "right, hit",
    "right, nothing hit",
    "missed what is hit",
    "hit what is not",
    "another triangle",
];

/// The same of a walk.
const WALKED: [&str; 5] = ["every cell visited", "", "a cell skipped", "", ""];

/// A picture before it is taken.
pub struct Picture {
    /// Also the test that takes it.
    pub name: &'static str,
    pub title: &'static str,
    /// Why it fails.
    pub about: &'static str,
    /// What its squares' outcomes are called.
    pub outcomes: [&'static str; 5],
    shot: Shot,
}

/// What is shown.
enum Shot {
    /// A scene, and the methods that are asked.
    Scene { make: fn() -> (Model, Vec<Ray>), methods: &'static [&'static str] },
    /// Walks through the cells of a grid.
    Walks { side: i32 },
}

/// All of them.
pub const ALL: [Picture; 4] = [
    Picture {
        name: "light_leaks_through_an_edge",
        title: "Light leaks through a mesh's edges",
        about: "A closed ball from inside, a window of a millionth of its radius around one vertex: whatever the direction, the ray \
                hits. A test that decides each triangle by rounded numbers of its own lets rays through where triangles meet, which \
                shows as bright dots in a picture.",
        outcomes: OUTCOMES,
        shot: Shot::Scene {
            make: leak,
            methods: &["BVH", "Embree 3 robust", "Embree 3", "Moeller-Trumbore"],
        },
    },
    Picture {
        name: "holes_far_from_the_origin",
        title: "Holes far from the origin",
        about: "A closed box 0.4 wide, 100,000 from the origin along each axis, where floats are 0.0078 apart, seen from 1 away. Boxes of its flat sides, tested as wall times reciprocal \
                minus origin times reciprocal, lose what distinguishes the two products; and a plane's constant is rounded once for all.",
        outcomes: OUTCOMES,
        shot: Shot::Scene {
            make: far,
            methods: &["BVH", "Embree 3 robust", "Embree 3", "Baldwin-Weber"],
        },
    },
    Picture {
        name: "a_sphere_horizon_with_false_hits",
        title: "The horizon of a sphere of radius 1e7",
        about: "The eye is 2 above the ground, the window a thousandth of a radian around the horizon. The discriminant of the \
                quadratic is a small difference of large squares. Ours in watertight precision takes whatever its bound cannot exclude.",
        outcomes: OUTCOMES,
        shot: Shot::Scene {
            make: horizon,
            methods: &["BVH", "BVH watertight", "Embree 3 robust", "Embree 3"],
        },
    },
    Picture {
        name: "a_grid_that_skips_a_cell",
        title: "A grid that skips a cell",
        about: "A walk through 512 cells along each axis; a square is wrong if a cell in which the ray is for over a thousandth of a \
                cell is never visited. The textbook walk adds up the times of walls, and its sums drift; ours has each from the wall's \
                number. What lies in a cell that is skipped is not hit.",
        outcomes: WALKED,
        shot: Shot::Walks { side: 512 },
    },
];

/// Takes every picture.
pub fn measure(options: &Options) -> Result<()> {
    let squares: Vec<Square> = ALL.iter().flat_map(Picture::take).collect();
    rows::write(options.data(), &squares)
}

impl Picture {
    /// What each method made of each square.
    fn take(&self) -> Vec<Square> {
        let panels = match self.shot {
            Shot::Scene { make, methods } => photographs(make(), methods),
            Shot::Walks { side } => walks(side),
        };
        let square = |method: &str, (i, outcome): (usize, usize)| Square {
            picture: self.name.to_owned(),
            method: method.to_owned(),
            x: i % SIDE,
            y: i / SIDE,
            outcome,
        };
        let all = panels.iter().map(|(method, outcomes)| {
            outcomes
                .iter()
                .copied()
                .enumerate()
                .map(|found| square(method, found))
                .collect::<Vec<_>>()
        });
        all.flatten().collect()
    }
}

type Panels = Vec<(String, Vec<usize>)>;

fn photographs((model, rays): (Model, Vec<Ray>), wanted: &[&str]) -> Panels {
    let judge = Judge::new(&model);
    let truths: Vec<_> = rays.iter().map(|ray| judge.truth(ray)).collect();
    let all = methods::all();
    let asked = wanted.iter().filter_map(|name| all.iter().find(|method| method.name == *name));
    let panel = |method: &methods::Method| {
        let built = method.build(&model).ok()?;
        let mut hits = vec![Hit::MISS; rays.len()];
        built.tracer.closest(&rays, &mut hits, false, &mut Watch::new());
        let outcome = |i: usize| {
            let mut tally = Tally::default();
            judge.judge(&mut tally, &rays[i], &truths[i], &hits[i], method.names);
            match (tally.false_misses, tally.false_hits, tally.wrong_prims) {
                (0, 0, 0) => usize::from(hits[i] == Hit::MISS),
                (1.., ..) => 2,
                (_, 1.., _) => 3,
                _ => 4,
            }
        };
        Some((method.name.to_owned(), (0..rays.len()).map(outcome).collect()))
    };
    asked.filter_map(panel).collect()
}

fn walks(side: i32) -> Panels {
    let rays = window(DVec3::new(-0.7, -0.6, -0.8), DVec3::new(0.5, 0.5, 0.5), DVec3::Y, 0.45);
    let panel = |(name, walls): (&str, Walls)| {
        let skips = |ray: &Ray| {
            let visited = visited(ray, side, walls);
            let passed: std::collections::HashSet<_> = visited.into_iter().collect();
            crossed(ray, side, 1e-3).iter().any(|cell| !passed.contains(cell))
        };
        let outcomes = rays.iter().map(|ray| if skips(ray) { 2 } else { 0 }).collect();
        (name.to_owned(), outcomes)
    };
    [("walls by number", Walls::Numbered), ("walls added up", Walls::Summed)].map(panel).to_vec()
}

/// Rays from an eye through a square window around a target, which is `half` from its middle to its sides.
fn window(eye: DVec3, target: DVec3, up: DVec3, half: f64) -> Vec<Ray> {
    let right = (target - eye).cross(up).normalize();
    let up = right.cross(target - eye).normalize();
    let eye = eye.as_vec3().as_dvec3();
    let place = |i: usize| (2.0 * (i as f64 + 0.5) / SIDE as f64 - 1.0) * half;
    let ray = |i: usize| {
        let to = target + right * place(i % SIDE) - up * place(i / SIDE);
        Ray::new(eye.as_vec3().to_array(), (to - eye).as_vec3().to_array())
    };
    (0..SIDE * SIDE).map(ray).collect()
}

/// From inside a closed ball, tightly around a vertex.
fn leak() -> (Model, Vec<Ray>) {
    let mesh = make::blob(768, 3);
    let vertex = DVec3::from(mesh.vertices[mesh.indices[100][0] as usize].map(f64::from));
    let eye = DVec3::new(0.013, -0.021, 0.007);
    let up = DVec3::new(0.3, 0.9, -0.2);
    (mesh.into(), window(eye, vertex, up, 5e-7))
}

/// A box far away, and the eye with it.
fn far() -> (Model, Vec<Ray>) {
    let at = DVec3::new(1e5, -1e5, 1e5);
    let mesh = make::box_mesh([-0.2; 3], [0.2; 3], 4).placed(1.0, at.to_array());
    (mesh.into(), window(at + DVec3::new(0.375, 0.5, 0.75), at, DVec3::Y, 0.3))
}

/// A planet from just above it.
fn horizon() -> (Model, Vec<Ray>) {
    let radius: f64 = 1e7;
    let model = Model {
        meshes: Vec::new(),
        sphere_sets: vec![vec![[0.0, -radius as f32, 0.0, radius as f32]]],
    };
    let (height, distance) = (2.0, 1000.0);
    let dip = (2.0 * height / radius).sqrt();
    let target = DVec3::new(0.0, height - dip * distance, -distance);
    (model, window(DVec3::new(0.0, height, 0.0), target, DVec3::Y, 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of each method's squares those that are wrong: ours none; the culprit's, where it is at hand, at least `least`.
    fn check(name: &str, culprit: &str, least: usize) {
        let picture = ALL.iter().find(|picture| picture.name == name).expect("a picture");
        let squares = picture.take();
        let mut names: Vec<&str> = squares.iter().map(|square| square.method.as_str()).collect();
        names.dedup();
        assert_eq!(squares.len(), SIDE * SIDE * names.len());
        for method in names {
            let wrong = squares.iter().filter(|s| s.method == method && s.outcome > 1).count();
            println!("{method}: {wrong} of {}", SIDE * SIDE);
            match method {
                "BVH" | "walls by number" => assert_eq!(wrong, 0),
                _ => assert!(method != culprit || wrong >= least, "{wrong} fail, not {least}"),
            }
        }
        let hits = squares.iter().filter(|square| square.outcome == 0).count();
        assert!(hits > 100, "{hits}: nothing to be seen");
    }

    #[test]
    fn light_leaks_through_an_edge() {
        check("light_leaks_through_an_edge", "Moeller-Trumbore", 20);
    }

    #[test]
    fn holes_far_from_the_origin() {
        check("holes_far_from_the_origin", "Embree 3", 20);
    }

    #[test]
    fn a_sphere_horizon_with_false_hits() {
        check("a_sphere_horizon_with_false_hits", "Embree 3", 20);
    }

    #[test]
    fn a_grid_that_skips_a_cell() {
        check("a_grid_that_skips_a_cell", "walls added up", 200);
    }
}
