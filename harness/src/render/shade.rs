//! From a hit to a colour.

use glam::DVec3;
use raykern::{Hit, PrimId, Ray};

use super::scene::{Material, MaterialKind, RenderScene};
use super::{RayCounts, Tracer};

/// Follows rays through a scene and counts them.
pub struct Shader<'a, T> {
    scene: &'a RenderScene,
    tracer: &'a T,
    /// The rays so far.
    pub rays: RayCounts,
}

/// A point on a surface, as the shading sees it.
struct Point {
    position: DVec3,
    /// Outward, of length one.
    normal: DVec3,
    /// Of length one, away from the ray's origin.
    direction: DVec3,
    /// Where rays leave that stay on this side and that go through, and what they cannot meet.
    before: DVec3,
    beyond: DVec3,
    skip: Option<PrimId>,
}

impl<'a, T: Tracer> Shader<'a, T> {
    /// A shader that has traced nothing yet.
    pub fn new(scene: &'a RenderScene, tracer: &'a T) -> Self {
        Shader { scene, tracer, rays: RayCounts::default() }
    }

    /// `ray` with the scene's least distance for primary rays.
    pub fn limited(&self, ray: &Ray) -> Ray {
        ray.with_limits(self.scene.intersection_epsilon as f32, f32::INFINITY)
    }

    /// The colour that comes along a primary ray.
    pub fn primary(&mut self, ray: &Ray) -> DVec3 {
        self.rays.primary += 1;
        let ray = self.limited(ray);
        match self.tracer.intersect(&ray, None) {
            Some(hit) => self.shade(&ray, &hit, 0),
            None => self.scene.background,
        }
    }

    /// The colour that comes along a mirrored or refracted ray, and how far from; black from
    /// nowhere.
    fn secondary(
        &mut self,
        (origin, skip): (DVec3, Option<PrimId>),
        direction: DVec3,
        depth: u32,
    ) -> (DVec3, f64) {
        self.rays.secondary += 1;
        let ray = ray(origin, direction);
        match self.tracer.intersect(&ray, skip) {
            Some(hit) => (self.shade(&ray, &hit, depth), f64::from(hit.t)),
            None => (DVec3::ZERO, f64::INFINITY),
        }
    }

    fn shade(&mut self, ray: &Ray, hit: &Hit, depth: u32) -> DVec3 {
        let point = self.point(ray, hit);
        let scene = self.scene;
        let material = scene.material(hit);
        let local =
            if point.is_inside_of(material) { DVec3::ZERO } else { self.local(&point, material) };
        if depth >= scene.max_recursion_depth {
            return local;
        }
        local
            + match material.kind {
                MaterialKind::Plain => DVec3::ZERO,
                MaterialKind::Mirror { reflectance } => reflectance * self.mirrored(&point, depth),
                MaterialKind::Conductor { reflectance, refraction_index, absorption_index } => {
                    let cosine = point.normal.dot(point.direction).abs();
                    let share = fresnel_conductor(cosine, refraction_index, absorption_index);
                    share * reflectance * self.mirrored(&point, depth)
                }
                MaterialKind::Dielectric { refraction_index, absorption } => {
                    self.dielectric(&point, refraction_index, absorption, depth)
                }
            }
    }

    /// Ambient light, and each lamp that is not hidden: Lambert and Blinn-Phong.
    fn local(&mut self, point: &Point, material: &Material) -> DVec3 {
        let mut color = self.scene.ambient * material.ambient;
        let facing = point.facing_normal();
        for light in &self.scene.lights {
            let path = light.position - point.position;
            let square = path.length_squared();
            let to_light = path / square.sqrt();
            let cosine = facing.dot(to_light);
            // A light exactly on the surface makes a NaN, and lights nothing.
            if cosine <= 0.0 || cosine.is_nan() {
                continue;
            }
            self.rays.shadow += 1;
            let path = light.position - point.before;
            let ray = ray(point.before, path).with_limits(0.0, 1.0);
            if self.tracer.occluded(&ray, point.skip) {
                continue;
            }
            let half = (to_light - point.direction).normalize_or_zero();
            let highlight = facing.dot(half).max(0.0).powf(material.phong_exponent);
            let share = material.diffuse * cosine + material.specular * highlight;
            color += share * light.intensity / square;
        }
        color
    }

    fn mirrored(&mut self, point: &Point, depth: u32) -> DVec3 {
        let direction = point.direction.reflect(point.facing_normal());
        self.secondary((point.before, point.skip), direction, depth + 1).0
    }

    fn dielectric(
        &mut self,
        point: &Point,
        refraction_index: f64,
        absorption: DVec3,
        depth: u32,
    ) -> DVec3 {
        let inside = point.direction.dot(point.normal) > 0.0;
        let facing = point.facing_normal();
        let ratio = if inside { refraction_index } else { refraction_index.recip() };
        let cosine = -point.direction.dot(facing);
        let fade = |color: DVec3, length: f64, is_inside: bool| {
            let lost = -absorption * length;
            if is_inside && length.is_finite() { color * exp(lost) } else { color }
        };
        let mirror = point.direction.reflect(facing);
        let (color, length) = self.secondary((point.before, point.skip), mirror, depth + 1);
        let reflected = fade(color, length, inside);
        let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
        if square < 0.0 {
            return reflected;
        }
        let beyond = square.sqrt();
        let share = fresnel_dielectric(cosine, beyond, ratio);
        let onward = ratio * point.direction + (ratio * cosine - beyond) * facing;
        let (color, length) = self.secondary((point.beyond, point.skip), onward, depth + 1);
        share * reflected + (1.0 - share) * fade(color, length, !inside)
    }

    /// The point of a hit, computed in f64 from the ray, and the normal from what is met.
    fn point(&self, ray: &Ray, hit: &Hit) -> Point {
        let [origin, step] = [ray.origin, ray.direction].map(wide);
        let position = origin + f64::from(hit.t) * step;
        let normal = self.scene.normal(hit, position);
        let (before, beyond, skip) = self.leaving(ray, hit, position, normal);
        Point { position, normal, direction: step.normalize(), before, beyond, skip }
    }

    /// Where rays leave to this side and to the other, and what they skip.
    fn leaving(
        &self,
        ray: &Ray,
        hit: &Hit,
        position: DVec3,
        normal: DVec3,
    ) -> (DVec3, DVec3, Option<PrimId>) {
        let is_back = wide(ray.direction).dot(normal) > 0.0;
        let epsilon = self.scene.shadow_ray_epsilon;
        let exact = || self.tracer.surface(ray, hit);
        let (front, back, skip) = match (epsilon == 0.0).then(exact).flatten() {
            Some(surface) => {
                let Hit { prim, geometry, instance, .. } = *hit;
                let skip = PrimId { prim, geometry, instance };
                (wide(surface.front_origin), wide(surface.back_origin), Some(skip))
            }
            None => (position + normal * epsilon, position - normal * epsilon, None),
        };
        if is_back { (back, front, skip) } else { (front, back, skip) }
    }
}

impl Point {
    /// Whether the ray came through glass: from there, no lamp shines on the surface.
    fn is_inside_of(&self, material: &Material) -> bool {
        let glass = matches!(material.kind, MaterialKind::Dielectric { .. });
        glass && self.direction.dot(self.normal) > 0.0
    }

    /// The normal on the side from which the ray came.
    fn facing_normal(&self) -> DVec3 {
        if self.direction.dot(self.normal) > 0.0 { -self.normal } else { self.normal }
    }
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray::new(origin.as_vec3().to_array(), direction.as_vec3().to_array())
}

fn exp(v: DVec3) -> DVec3 {
    DVec3::new(v.x.exp(), v.y.exp(), v.z.exp())
}

/// The share of unpolarised light that a metal mirrors.
fn fresnel_conductor(cosine: f64, index: f64, absorption: f64) -> f64 {
    let square = index * index + absorption * absorption;
    let mixed = 2.0 * index * cosine;
    let cosine2 = cosine * cosine;
    let across = (square - mixed + cosine2) / (square + mixed + cosine2);
    let along = (square * cosine2 - mixed + 1.0) / (square * cosine2 + mixed + 1.0);
    0.5 * (across + along)
}

/// The share of unpolarised light that glass mirrors; `ratio` is the index of this side over that
/// of the other, the cosines are those on this and on the other side.
fn fresnel_dielectric(cosine: f64, beyond: f64, ratio: f64) -> f64 {
    let along = (cosine - ratio * beyond) / (cosine + ratio * beyond);
    let across = (ratio * cosine - beyond) / (ratio * cosine + beyond);
    0.5 * (along * along + across * across)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_mirrors_four_hundredths_straight_on_and_all_at_a_glance() {
        assert!((fresnel_dielectric(1.0, 1.0, 1.0 / 1.5) - 0.04).abs() < 1e-12);
        assert!((fresnel_dielectric(1.0, 1.0, 1.5) - 0.04).abs() < 1e-12);
        assert!((fresnel_dielectric(0.0, 0.7, 1.0 / 1.5) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_metal_mirrors_more_at_a_glance() {
        let straight = fresnel_conductor(1.0, 0.135, 3.985);
        // ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)
        let expected =
            (0.865f64.powi(2) + 3.985f64.powi(2)) / (1.135f64.powi(2) + 3.985f64.powi(2));
        assert!((straight - expected).abs() < 1e-12);
        assert!((fresnel_conductor(0.0, 0.135, 3.985) - 1.0).abs() < 1e-12);
    }
}
