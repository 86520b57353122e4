//! What a picture is made of: geometry, materials, lights, cameras.

use glam::{DAffine3, DVec3};
use raykern::Hit;

use super::camera::Camera;
use crate::assembly::Assembly;
use crate::model::Model;

/// Everything a picture needs. Colours count from 0 to 255.
#[derive(Clone, Debug)]
pub struct RenderScene {
    /// The geometry.
    pub model: Assembly,
    /// For each geometry of the model itself its number in `materials`.
    pub geometry_material: Vec<usize>,
    /// For each of its places the number of what is seen there.
    pub place_material: Vec<usize>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The point lights.
    pub lights: Vec<PointLight>,
    /// Light that reaches every surface.
    pub ambient: DVec3,
    /// At least one.
    pub cameras: Vec<Camera>,
    /// What a primary ray sees that hits nothing.
    pub background: DVec3,
    /// How far the origin of a secondary ray is moved along the normal; at 0 it is one that is surely beside the surface, and
    /// the primitive is skipped.
    pub shadow_ray_epsilon: f64,
    /// The least distance at which a primary ray may hit.
    pub intersection_epsilon: f64,
    /// How often a path may be mirrored or refracted.
    pub max_recursion_depth: u32,
}

/// How a surface answers to light: Blinn-Phong, and what its kind adds.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Share of the ambient light.
    pub ambient: DVec3,
    /// Lambert's share.
    pub diffuse: DVec3,
    /// The highlight's share.
    pub specular: DVec3,
    /// The highlight's exponent.
    pub phong_exponent: f64,
    /// What leaves the surface besides.
    pub kind: MaterialKind,
}

/// What rays a surface sends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaterialKind {
    /// None.
    Plain,
    /// A mirrored ray, without Fresnel.
    Mirror {
        /// Share of each colour.
        reflectance: DVec3,
    },
    /// A mirrored ray weighed by the Fresnel term of a metal.
    Conductor {
        /// Share of each colour.
        reflectance: DVec3,
        /// The real part of the refraction index.
        refraction_index: f64,
        /// The imaginary part.
        absorption_index: f64,
    },
    /// A mirrored and a refracted ray.
    Dielectric {
        /// Inside against outside.
        refraction_index: f64,
        /// Inside, light fades by `exp(-c x)` over a length x.
        absorption: DVec3,
    },
}

/// A light whose strength falls with the squared distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Where it is.
    pub position: DVec3,
    /// Its strength at distance one.
    pub intensity: DVec3,
}

impl Material {
    /// A dull surface of one colour.
    pub fn matte(color: [f64; 3]) -> Self {
        let color = DVec3::from(color);
        Material {
            ambient: color,
            diffuse: color,
            specular: DVec3::ZERO,
            phong_exponent: 1.0,
            kind: MaterialKind::Plain,
        }
    }

    /// The same surface with a white highlight.
    pub fn shiny(self, strength: f64, phong_exponent: f64) -> Self {
        Material { specular: DVec3::splat(strength), phong_exponent, ..self }
    }
}

impl RenderScene {
    /// A scene of one grey material, seen from `direction` so that all of `model` is in view.
    pub fn portrait(model: Model, up: DVec3, direction: DVec3) -> Self {
        let (lower, upper) = bounds(&model);
        let center = 0.5 * (lower + upper);
        let radius = (0.5 * (upper - lower).length()).max(1e-30);
        let fov = 35.0f64;
        let back = direction.normalize();
        let eye = center + back * (radius / (0.5 * fov.to_radians()).sin());
        let camera = Camera::look_at(eye, center, up, fov, 1.0, [800, 800])
            .expect("the caller's `up` is not along `direction`");
        let side = up.cross(back).normalize();
        let lamp = eye + (side + up.normalize()) * radius;
        let intensity = DVec3::splat(230.0 * (lamp - center).length_squared());
        let geometries = model.meshes.len() + model.sphere_sets.len();
        RenderScene {
            model: model.into(),
            geometry_material: vec![0; geometries],
            place_material: Vec::new(),
            materials: vec![Material::matte([0.8; 3])],
            lights: vec![PointLight { position: lamp, intensity }],
            ambient: DVec3::splat(20.0),
            cameras: vec![camera],
            background: DVec3::ZERO,
            shadow_ray_epsilon: 1e-4 * radius,
            intersection_epsilon: 0.0,
            max_recursion_depth: 0,
        }
    }

    /// The same scene without places, [flattened](Assembly::flattened); `None` if there are ellipsoids.
    pub fn flattened(&self) -> Option<RenderScene> {
        let model = self.model.flattened()?;
        let shown = |count: fn(&Model) -> usize| {
            let places = self.model.places.iter().zip(&self.place_material);
            places.flat_map(move |(place, material)| {
                std::iter::repeat_n(*material, count(&self.model.children[place.child]))
            })
        };
        let (meshes, spheres) = self.geometry_material.split_at(self.model.own.meshes.len());
        let mut geometry_material = meshes.to_vec();
        geometry_material.extend(shown(|child| child.meshes.len()));
        geometry_material.extend(spheres);
        geometry_material.extend(shown(|child| child.sphere_sets.len()));
        let (model, place_material) = (model.into(), Vec::new());
        Some(RenderScene { model, geometry_material, place_material, ..self.clone() })
    }

    /// What is met.
    pub fn material(&self, hit: &Hit) -> &Material {
        let number = match self.place_material.get(hit.instance as usize) {
            Some(number) => *number,
            None => self.geometry_material[hit.geometry as usize],
        };
        &self.materials[number]
    }

    /// The unit normal at `position`, which was met: that of the triangle's order, or outward; in an instance, the one that is
    /// mapped with the surface, so that what is outside stays so.
    pub fn normal(&self, hit: &Hit, position: DVec3) -> DVec3 {
        let place = self.model.places.get(hit.instance as usize);
        let model = place.map_or(&self.model.own, |place| &self.model.children[place.child]);
        let inverse = place.map_or(DAffine3::IDENTITY, |place| place.map().inverse());
        let (geometry, prim) = (hit.geometry as usize, hit.prim as usize);
        let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
        let normal = match model.meshes.get(geometry) {
            Some(mesh) => {
                let [a, b, c] = mesh.indices[prim].map(|v| wide(mesh.vertices[v as usize]));
                (b - a).cross(c - a)
            }
            None => {
                let [x, y, z, _] = model.sphere_sets[geometry - model.meshes.len()][prim];
                inverse.transform_point3(position) - wide([x, y, z])
            }
        };
        (inverse.matrix3.transpose() * normal).normalize_or_zero()
    }
}

/// The box around every finite vertex and sphere of `model`; a point when there are none.
pub fn bounds(model: &Model) -> (DVec3, DVec3) {
    let points = model.meshes.iter().flat_map(|m| &m.vertices).map(|&v| (v, 0.0));
    let balls = model.sphere_sets.iter().flatten().map(|&[x, y, z, r]| ([x, y, z], r.abs()));
    let mut range = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (center, radius) in points.chain(balls) {
        let center = DVec3::from(center.map(f64::from));
        if center.is_finite() && radius.is_finite() {
            let radius = f64::from(radius);
            range = (range.0.min(center - radius), range.1.max(center + radius));
        }
    }
    if range.0.is_finite() { range } else { (DVec3::ZERO, DVec3::ZERO) }
}
