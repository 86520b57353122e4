//! How models move: other places, the same meshes.

use raykern_harness::make::Random;
use raykern_harness::model::Model;

/// Moves every vertex and centre; the radii of spheres are scaled.
fn moved(model: &Model, scale: f64, mut place: impl FnMut([f64; 3]) -> [f64; 3]) -> Model {
    let mut model = model.clone();
    let mut place = |p: [f32; 3]| place(p.map(f64::from)).map(|x| x as f32);
    model.meshes.iter_mut().flat_map(|m| &mut m.vertices).for_each(|v| *v = place(*v));
    for [x, y, z, radius] in model.sphere_sets.iter_mut().flatten() {
        [*x, *y, *z] = place([*x, *y, *z]);
        *radius = (f64::from(*radius) * scale) as f32;
    }
    model
}

/// Turned by a third of a right angle about a vertical axis, and moved away.
pub fn rigid(model: &Model) -> Model {
    let (sine, cosine) = (0.5, 0.75f64.sqrt());
    moved(model, 1.0, |[x, y, z]| [cosine * x - sine * y + 10.0, sine * x + cosine * y, z - 3.0])
}

/// Every vertex anywhere.
pub fn wild(model: &Model) -> Model {
    let mut random = Random::new(5);
    moved(model, 1.0, |_| random.point(-2.0, 2.0))
}

/// All in one point.
pub fn collapsed(model: &Model) -> Model {
    moved(model, 0.0, |_| [1.0, 2.0, 3.0])
}

/// In a plane, so that much stands on edge.
pub fn flat(model: &Model) -> Model {
    moved(model, 1.0, |[x, y, _]| [x, y, 0.25])
}

/// Every other vertex where the one before is, so that many triangles lose their area.
pub fn pinched(model: &Model) -> Model {
    let (mut last, mut odd) = ([0.0; 3], false);
    moved(model, 1.0, |p| {
        odd = !odd;
        last = if odd { p } else { last };
        last
    })
}

/// About as large as the least float.
pub fn tiny(model: &Model) -> Model {
    moved(model, 1e-43, |p| p.map(|x| 1e-43 * x))
}

/// So large that products overflow.
pub fn huge(model: &Model) -> Model {
    moved(model, 1e36, |p| p.map(|x| 1e36 * x))
}

/// Small and huge vertices side by side.
pub fn uneven(model: &Model) -> Model {
    let mut random = Random::new(7);
    moved(model, 1e-20, |_| [0; 3].map(|_| f64::from(random.wild([-140, 120]))))
}

/// Here and there a NaN or an infinity, or a radius that is none.
pub fn broken(model: &Model) -> Model {
    let mut random = Random::new(9);
    let mut broken = moved(model, 1.0, |p| match random.below(12) {
        0 => [f64::NAN, p[1], p[2]],
        1 => [p[0], f64::INFINITY, p[2]],
        2 => [p[0], p[1], f64::NEG_INFINITY],
        _ => p,
    });
    for sphere in broken.sphere_sets.iter_mut().flatten() {
        match random.below(8) {
            0 => sphere[3] = -sphere[3],
            1 => sphere[3] = f32::NAN,
            _ => {}
        }
    }
    broken
}

/// Nothing can be hit.
pub fn gone(model: &Model) -> Model {
    moved(model, f64::NAN, |_| [f64::NAN; 3])
}

/// A motion with its name.
pub type Motion = (&'static str, fn(&Model) -> Model);

/// All of these.
pub const ALL: [Motion; 10] = [
    ("rigid", rigid),
    ("wild", wild),
    ("collapsed", collapsed),
    ("flat", flat),
    ("pinched", pinched),
    ("tiny", tiny),
    ("huge", huge),
    ("uneven", uneven),
    ("broken", broken),
    ("gone", gone),
];
