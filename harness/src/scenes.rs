//! Scenes made in code, with the contrasts of the collected ones: for machines without those.
//!
//! | name | stands for | what it stresses |
//! | --- | --- | --- |
//! | `spheres` | two_spheres | two primitives: neither structure should cost much |
//! | `ball` | chinese_dragon | one dense mesh, even cells |
//! | `marching` | marching_dragons | nine instances of a dense mesh on a floor 100 times as long |
//! | `stadium` | a teapot in a stadium | a small dense thing in a large, finely cut hall |
//! | `glass` | scienceTree_glass | mirrors and glass: rays from inside objects |

use glam::{DAffine3, DQuat, DVec3};

use crate::assembly::{Assembly, Place};
use crate::make::{self, Random};
use crate::model::{Model, TriangleMesh};
use crate::render::{Camera, Material, MaterialKind, PointLight, RenderScene};

/// A maker of a scene.
pub type SceneMaker = fn() -> RenderScene;

/// All built-in scenes by name, the light ones first.
pub const ALL: [(&str, SceneMaker); 5] = [
    ("spheres", spheres),
    ("glass", glass),
    ("ball", ball),
    ("stadium", stadium),
    ("marching", marching),
];

/// The scene called `name`.
pub fn by_name(name: &str) -> Option<RenderScene> {
    ALL.iter().find(|(known, _)| *known == name).map(|(_, make)| make())
}

/// Two shiny spheres, one touching the other's side.
pub fn spheres() -> RenderScene {
    let mut parts = Parts::default();
    parts.sphere([0.0, 0.0, 0.0, 1.0], Material::matte([0.85, 0.3, 0.2]).shiny(0.6, 40.0));
    parts.sphere([0.95, 0.85, 0.7, 0.45], Material::matte([0.2, 0.4, 0.85]).shiny(0.6, 40.0));
    let camera = View { eye: [0.0, 0.0, 5.0], target: [0.25, 0.2, 0.0], fov: 35.0 };
    parts.seen(camera, [800, 800], &[([5.0, 5.0, 5.0], 9_000.0)])
}

/// A wrinkled ball of 870,000 triangles.
pub fn ball() -> RenderScene {
    let mut parts = Parts::default();
    let mesh = make::blob(870_000, 5);
    parts.mesh(mesh, Material::matte([0.75, 0.7, 0.6]).shiny(0.15, 20.0));
    let camera = View { eye: [0.5, 1.4, 4.2], target: [0.0; 3], fov: 36.0 };
    parts.seen(camera, [800, 800], &[([2.0, 3.5, 5.0], 9_500.0), ([-6.0, 2.0, 1.0], 2_000.0)])
}

/// A knot of 200,000 triangles nine times on two triangles of floor, 2 wide and 101 long.
pub fn marching() -> RenderScene {
    let mut parts = Parts::default();
    let floor = [[-1.0, 0.0, 100.0], [1.0, 0.0, 100.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
    parts.mesh(quad(floor), Material::matte([0.8; 3]));
    let knot = parts.child(make::knot(200_000));
    for k in 0..9 {
        let (row, column) = (k / 3, k % 3);
        let place = [0.25 * (column as f64 - 1.0), 0.11, -0.25 * row as f64];
        let hue = k as f64 / 9.0;
        parts.place(knot, 0.1, place, Material::matte(rainbow(hue)).shiny(0.4, 30.0));
    }
    let camera = View { eye: [0.0, 0.95, 1.5], target: [0.0, 0.06, -0.27], fov: 22.0 };
    parts.seen(camera, [960, 540], &[([-0.7, 1.6, 1.2], 700.0), ([0.8, 1.4, 0.3], 250.0)])
}

/// A knot of 100,000 triangles and 16 cm on the floor of a hall of 60 by 40 m, whose floor, walls
/// and tiers are cut into 60,000 triangles.
pub fn stadium() -> RenderScene {
    let mut parts = Parts::default();
    let stretched = |[x, y, z]: [f64; 3]| [60.0 * (x - 0.5), 40.0 * (y - 0.5), z];
    parts.mesh(make::plane(20_000).mapped(stretched), Material::matte([0.45, 0.6, 0.4]));
    let mut tiers = TriangleMesh::default();
    for tier in 0..5 {
        let (inner, low) = (f64::from(tier) * 2.0, f64::from(tier) * 1.2);
        let [x, y] = [30.0 + inner, 20.0 + inner];
        for side in [-1.0, 1.0] {
            let along = [side * y, side * (y + 2.0)];
            let [near, far] = [along[0].min(along[1]), along[0].max(along[1])];
            tiers.append(&make::box_mesh([-x, near, low], [x, far, low + 1.2], 18));
            let along = [side * x, side * (x + 2.0)];
            let [near, far] = [along[0].min(along[1]), along[0].max(along[1])];
            tiers.append(&make::box_mesh([near, -y, low], [far, y, low + 1.2], 18));
        }
    }
    parts.mesh(tiers, Material::matte([0.7, 0.68, 0.65]));
    let knot = make::knot(100_000).placed(0.08, [0.0, 0.0, 0.05]);
    parts.mesh(knot, Material::matte([0.85, 0.5, 0.25]).shiny(0.5, 40.0));
    let camera = View { eye: [0.42, -0.5, 0.24], target: [0.0, 0.0, 0.04], fov: 24.0 };
    parts.seen_with(camera, DVec3::Z, [960, 540], &[([6.0, -8.0, 12.0], 45_000.0)])
}

/// Glass and mirror balls, meshes and spheres, among small dull ones in a room.
pub fn glass() -> RenderScene {
    let mut parts = Parts::default();
    let room = make::box_mesh([-9.0, 0.0, -9.0], [9.0, 9.0, 10.0], 10);
    parts.mesh(room, Material::matte([0.7, 0.72, 0.78]));
    let absorption = DVec3::new(0.25, 0.05, 0.15);
    let glass = MaterialKind::Dielectric { refraction_index: 1.5, absorption };
    let mirror = MaterialKind::Mirror { reflectance: DVec3::splat(0.75) };
    let gold = MaterialKind::Conductor {
        reflectance: DVec3::new(1.0, 0.8, 0.45),
        refraction_index: 0.37,
        absorption_index: 2.8,
    };
    let clear = |kind| Material { kind, ..Material::matte([0.0; 3]).shiny(0.4, 200.0) };
    parts.sphere([-1.5, 1.0, 0.0, 1.0], clear(glass));
    parts.mesh(make::sphere(3_000).placed(0.9, [2.1, 0.9, 0.6]), clear(glass));
    parts.sphere([0.4, 1.2, -2.4, 1.2], clear(mirror));
    parts.mesh(make::knot(6_000).placed(0.9, [-3.6, 0.95, -2.6]), clear(gold));
    let mut random = Random::new(4);
    for k in 0..60 {
        let radius = random.between(0.1, 0.28);
        let [x, z] = [random.between(-5.0, 5.0), random.between(-6.0, 3.2)];
        let dull = Material::matte(rainbow(f64::from(k) / 60.0)).shiny(0.3, 30.0);
        parts.sphere([x, radius, z, radius], dull);
    }
    let camera = View { eye: [0.0, 2.6, 8.5], target: [0.0, 0.7, -0.4], fov: 34.0 };
    let lights = [([-4.0, 7.5, 5.0], 11_000.0), ([5.0, 6.5, 2.0], 5_000.0)];
    RenderScene { max_recursion_depth: 6, ..parts.seen(camera, [960, 540], &lights) }
}

/// Geometry with its materials, while a scene is being put together.
#[derive(Default)]
struct Parts {
    meshes: Vec<(TriangleMesh, Material)>,
    spheres: Vec<([f32; 4], Material)>,
    children: Vec<Model>,
    places: Vec<(Place, Material)>,
}

/// Where the picture is taken from.
struct View {
    eye: [f64; 3],
    target: [f64; 3],
    /// The vertical angle in degrees.
    fov: f64,
}

impl Parts {
    fn mesh(&mut self, mesh: TriangleMesh, material: Material) {
        self.meshes.push((mesh, material));
    }

    fn sphere(&mut self, sphere: [f64; 4], material: Material) {
        self.spheres.push((sphere.map(|x| x as f32), material));
    }

    /// What is shown by [`place`](Self::place) alone.
    fn child(&mut self, mesh: TriangleMesh) -> usize {
        self.children.push(mesh.into());
        self.children.len() - 1
    }

    fn place(&mut self, child: usize, scale: f64, at: [f64; 3], material: Material) {
        let map = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            DQuat::IDENTITY,
            DVec3::from(at),
        );
        let place = Place::new(child, &map).expect("a scale that is not zero");
        self.places.push((place, material));
    }

    fn seen(self, view: View, size: [u32; 2], lights: &[([f64; 3], f64)]) -> RenderScene {
        self.seen_with(view, DVec3::Y, size, lights)
    }

    fn seen_with(
        self,
        view: View,
        up: DVec3,
        size: [u32; 2],
        lights: &[([f64; 3], f64)],
    ) -> RenderScene {
        let (meshes, mut materials): (Vec<_>, Vec<_>) = self.meshes.into_iter().unzip();
        let (spheres, more): (Vec<_>, Vec<_>) = self.spheres.into_iter().unzip();
        materials.extend(more);
        let geometries = materials.len();
        let (places, more): (Vec<_>, Vec<_>) = self.places.into_iter().unzip();
        materials.extend(more);
        let [eye, target] = [view.eye, view.target].map(DVec3::from);
        let camera = Camera::look_at(eye, target, up, view.fov, 1.0, size);
        RenderScene {
            model: Assembly {
                own: Model { meshes, sphere_sets: spheres.into_iter().map(|s| vec![s]).collect() },
                children: self.children,
                places,
            },
            geometry_material: (0..geometries).collect(),
            place_material: (geometries..materials.len()).collect(),
            materials,
            lights: lights
                .iter()
                .map(|&(position, intensity)| PointLight {
                    position: position.into(),
                    intensity: DVec3::splat(intensity),
                })
                .collect(),
            ambient: DVec3::splat(24.0),
            cameras: vec![camera.expect("the cameras here are sound")],
            background: DVec3::ZERO,
            shadow_ray_epsilon: 1e-4 * (eye - target).length(),
            intersection_epsilon: 0.0,
            max_recursion_depth: 0,
        }
    }
}

/// Two triangles over four corners.
fn quad(corners: [[f32; 3]; 4]) -> TriangleMesh {
    TriangleMesh { vertices: corners.to_vec(), indices: vec![[0, 1, 2], [0, 2, 3]] }
}

/// Soft colours around the wheel; `hue` runs from 0 to 1.
fn rainbow(hue: f64) -> [f64; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| {
        let wave = (std::f64::consts::TAU * (hue + shift)).cos();
        0.5 + 0.35 * wave
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_material_for_each_geometry() {
        for (name, make) in ALL {
            let scene = make();
            let own = &scene.model.own;
            let geometries = own.meshes.len() + own.sphere_sets.len();
            assert_eq!(scene.geometry_material.len(), geometries, "{name}");
            assert_eq!(scene.place_material.len(), scene.model.places.len(), "{name}");
            let mut numbers = scene.geometry_material.iter().chain(&scene.place_material);
            assert!(numbers.all(|&m| m < scene.materials.len()), "{name}");
            assert!(by_name(name).is_some());
        }
        assert!(by_name("no such scene").is_none());
    }
}
