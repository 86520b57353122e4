//! Makers of rays: deterministic families over a model, from ordinary to hostile.
//!
//! Each family is named after what is special about its rays, so that a table of results by family
//! says where answers go wrong. All rays but those of [`Family::Invalid`] are finite.

use raykern::Ray;

use crate::make::Random;
use crate::model::Model;

/// What is special about a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    /// From a camera outside, through a raster of directions.
    Primary,
    /// Through the box, from anywhere around it.
    Random,
    /// From a point near a surface in a random direction, as after a diffuse bounce.
    Bounce,
    /// From a point near a surface to another one: shadows; `t` ends at 1.
    Shadow,
    /// From near a surface in a random direction, and short: ambient occlusion.
    Occlusion,
    /// Aimed at a vertex: direction and target are rounded.
    AtVertex,
    /// Aimed at a point of an edge, rounded.
    AtEdge,
    /// Axis-parallel and exactly through a vertex.
    ThroughVertex,
    /// In the plane of a triangle, up to rounding.
    InPlane,
    /// Parallel to an axis.
    AxisParallel,
    /// Parallel to an axis and in a face of the box, or in one of its 16 equal slices.
    InBoxFace,
    /// From inside the box.
    Inside,
    /// From a rounded point of a surface.
    FromSurface,
    /// Exactly from a vertex.
    FromVertex,
    /// From 1e4 to 1e6 times the size of the box away.
    Far,
    /// With directions of length 1e-20 to 1e20.
    OddLength,
    /// With limits around or equal to a distance to a vertex, and with negative ones.
    Limited,
    /// NaN, infinities, zero directions, limits the wrong way round: hits nothing by definition.
    Invalid,
}

impl Family {
    /// Families as a renderer makes them.
    pub const ORDINARY: [Family; 6] = [
        Family::Primary,
        Family::Random,
        Family::Bounce,
        Family::Shadow,
        Family::Occlusion,
        Family::Inside,
    ];

    /// Families that look for trouble, all of them valid rays.
    pub const HOSTILE: [Family; 11] = [
        Family::AtVertex,
        Family::AtEdge,
        Family::ThroughVertex,
        Family::InPlane,
        Family::AxisParallel,
        Family::InBoxFace,
        Family::FromSurface,
        Family::FromVertex,
        Family::Far,
        Family::OddLength,
        Family::Limited,
    ];
}

/// Makes rays for one model.
pub struct RayMaker<'a> {
    model: &'a Model,
    random: Random,
    lower: [f64; 3],
    upper: [f64; 3],
}

impl<'a> RayMaker<'a> {
    /// A maker whose rays depend on the model, the seed and the calls alone.
    pub fn new(model: &'a Model, seed: u64) -> Self {
        let mut lower = [f64::INFINITY; 3];
        let mut upper = [f64::NEG_INFINITY; 3];
        let mut grow = |p: [f32; 3], r: f32| {
            if p.iter().all(|x| x.is_finite()) && r.is_finite() {
                lower = std::array::from_fn(|k| lower[k].min(f64::from(p[k]) - f64::from(r)));
                upper = std::array::from_fn(|k| upper[k].max(f64::from(p[k]) + f64::from(r)));
            }
        };
        model.meshes.iter().flat_map(|m| &m.vertices).for_each(|v| grow(*v, 0.0));
        model.sphere_sets.iter().flatten().for_each(|&[x, y, z, r]| grow([x, y, z], r.max(0.0)));
        if lower[0] > upper[0] {
            (lower, upper) = ([-1.0; 3], [1.0; 3]);
        }
        RayMaker { model, random: Random::new(seed), lower, upper }
    }

    /// `count` rays of one family.
    pub fn many(&mut self, family: Family, count: usize) -> Vec<Ray> {
        (0..count).map(|_| self.one(family)).collect()
    }

    /// One ray.
    pub fn one(&mut self, family: Family) -> Ray {
        match family {
            Family::Primary => self.primary(),
            Family::Random => {
                let from = self.around(1.0);
                self.towards(from, 0.0)
            }
            Family::Bounce => self.bounce(f32::INFINITY),
            Family::Shadow => {
                let (from, to) = (self.near_surface(), self.near_surface());
                aimed(from, to).with_limits(0.0, 1.0)
            }
            Family::Occlusion => {
                let reach = 0.1 * self.size();
                self.bounce(reach as f32)
            }
            Family::AtVertex => {
                let (from, to) = (self.around(1.0), self.vertex());
                aimed(round(from), to)
            }
            Family::AtEdge => {
                let (from, [a, b, _], s) = (self.around(1.0), self.corners(), self.random.unit());
                aimed(round(from), mix(a, b, s))
            }
            Family::ThroughVertex => {
                let vertex = self.vertex();
                self.along_axis(vertex)
            }
            Family::InPlane => self.in_plane(),
            Family::AxisParallel => {
                let through = self.inside();
                self.along_axis(round(through))
            }
            Family::InBoxFace => self.in_box_face(),
            Family::Inside => Ray::new(round(self.inside()), round(self.random.direction())),
            Family::FromSurface => Ray::new(self.on_surface(), round(self.random.direction())),
            Family::FromVertex => self.leaving_vertex(),
            Family::Far => {
                let distance = 10f64.powf(self.random.between(4.0, 6.0));
                let from = self.around(distance);
                self.towards(from, 0.0)
            }
            Family::OddLength => {
                let from = self.around(1.0);
                let power = self.random.between(-20.0, 20.0);
                self.towards(from, power)
            }
            Family::Limited => self.limited(),
            Family::Invalid => self.invalid(),
        }
    }

    fn size(&self) -> f64 {
        (0..3).map(|k| self.upper[k] - self.lower[k]).fold(0.0, f64::max)
    }

    fn inside(&mut self) -> [f64; 3] {
        std::array::from_fn(|k| self.random.between(self.lower[k], self.upper[k]))
    }

    /// A point `distance` sizes from the middle of the box.
    fn around(&mut self, distance: f64) -> [f64; 3] {
        let (direction, reach) = (self.random.direction(), distance * self.size());
        std::array::from_fn(|k| 0.5 * (self.lower[k] + self.upper[k]) + reach * direction[k])
    }

    /// From a point to a random point of the box, with a direction of length `10^power`.
    fn towards(&mut self, from: [f64; 3], power: f64) -> Ray {
        let to = self.inside();
        let way: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
        let scale = 10f64.powf(power) / length(way).max(1e-300);
        Ray::new(round(from), nonzero(way.map(|x| x * scale)))
    }

    fn primary(&mut self) -> Ray {
        // A camera in front and above, and a point of its image plane through the box.
        let middle: [f64; 3] = std::array::from_fn(|k| 0.5 * (self.lower[k] + self.upper[k]));
        let size = self.size();
        let camera = [middle[0] + 0.3 * size, middle[1] - 1.2 * size, middle[2] + 0.7 * size];
        let pixel = |r: &mut Random| (r.below(1024) as f64 + 0.5) / 1024.0 - 0.5;
        let (x, z) = (pixel(&mut self.random) * size, pixel(&mut self.random) * size);
        let to = [middle[0] + x, middle[1] + 0.58 * z, middle[2] + z];
        let way: [f64; 3] = std::array::from_fn(|k| to[k] - camera[k]);
        Ray::new(round(camera), nonzero(way.map(|x| x / length(way).max(1e-300))))
    }

    fn bounce(&mut self, t_max: f32) -> Ray {
        let (from, direction) = (self.near_surface(), self.random.direction());
        Ray::new(from, round(direction)).with_limits(0.0, t_max)
    }

    fn corners(&mut self) -> [[f32; 3]; 3] {
        let with_triangles: Vec<_> =
            self.model.meshes.iter().filter(|m| !m.indices.is_empty()).collect();
        if with_triangles.is_empty() {
            let point = self.sphere_point();
            return [point, self.sphere_point(), self.sphere_point()];
        }
        let mesh = with_triangles[self.random.below(with_triangles.len())];
        let triangle = mesh.indices[self.random.below(mesh.indices.len())];
        let corners = triangle.map(|v| mesh.vertices[v as usize]);
        corners.map(|p| p.map(|x| if x.is_finite() { x } else { 0.0 }))
    }

    fn vertex(&mut self) -> [f32; 3] {
        self.corners()[0]
    }

    fn sphere_point(&mut self) -> [f32; 3] {
        let sets: Vec<_> = self.model.sphere_sets.iter().filter(|s| !s.is_empty()).collect();
        if sets.is_empty() {
            return round(self.inside());
        }
        let set = sets[self.random.below(sets.len())];
        let [x, y, z, r] = set[self.random.below(set.len())].map(f64::from);
        let direction = self.random.direction();
        round([x + r * direction[0], y + r * direction[1], z + r * direction[2]])
    }

    /// A point of a surface, rounded.
    fn on_surface(&mut self) -> [f32; 3] {
        let triangles = self.model.triangle_count();
        let count = triangles + self.model.sphere_count();
        if self.random.below(count.max(1)) >= triangles {
            return self.sphere_point();
        }
        let [a, b, c] = self.corners();
        let (s, t) = (self.random.unit().sqrt(), self.random.unit());
        mix(a, mix(b, c, t), s)
    }

    /// A point beside a surface, as far as renderers move theirs.
    fn near_surface(&mut self) -> [f32; 3] {
        let (point, direction) = (self.on_surface(), self.random.direction());
        let step = 1e-4 * self.size();
        round(std::array::from_fn(|k| f64::from(point[k]) + step * direction[k]))
    }

    fn along_axis(&mut self, through: [f32; 3]) -> Ray {
        let axis = self.random.below(3);
        let back = self.random.below(2) == 1;
        let mut origin = through;
        let mut direction = [0.0; 3].map(|x: f32| if self.random.below(2) == 0 { x } else { -x });
        let distance = 0.6 * (self.upper[axis] - self.lower[axis]) + 0.1 * self.size();
        let middle = 0.5 * (self.lower[axis] + self.upper[axis]);
        origin[axis] = (if back { middle + distance } else { middle - distance }) as f32;
        direction[axis] = if back { -1.0 } else { 1.0 };
        Ray::new(origin, direction)
    }

    fn in_box_face(&mut self) -> Ray {
        let mut through = self.inside();
        let axis = self.random.below(3);
        let step = self.random.below(17) as f64 / 16.0;
        through[axis] = self.lower[axis] + step * (self.upper[axis] - self.lower[axis]);
        self.along_axis(round(through))
    }

    fn in_plane(&mut self) -> Ray {
        let [a, b, c] = self.corners();
        // Two points of the plane, the first well outside the triangle.
        let (s, t) = (self.random.between(1.5, 4.0), self.random.between(-0.5, 1.5));
        let from = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * s as f32);
        aimed(from, mix(a, c, t))
    }

    fn leaving_vertex(&mut self) -> Ray {
        let from = self.vertex();
        if self.random.below(2) == 0 {
            return Ray::new(from, round(self.random.direction()));
        }
        aimed(from, self.vertex())
    }

    fn limited(&mut self) -> Ray {
        let ray = self.one(Family::AtVertex);
        match self.random.below(5) {
            0 => ray.with_limits(1.0, 1.0),
            1 => ray.with_limits(1.0, f32::INFINITY),
            2 => ray.with_limits(0.0, 1.0),
            3 => ray.with_limits(f32::NEG_INFINITY, 1.0f32.next_down()),
            _ => ray.with_limits(-3.0, self.random.between(-2.0, 2.0) as f32),
        }
    }

    fn invalid(&mut self) -> Ray {
        let mut ray = self.one(Family::Random);
        let axis = self.random.below(3);
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][self.random.below(3)];
        match self.random.below(6) {
            0 => ray.origin[axis] = odd,
            1 => ray.direction[axis] = odd,
            2 => ray.direction = [0.0, -0.0, 0.0],
            3 => ray.t_min = f32::NAN,
            4 => ray.t_max = f32::NAN,
            _ => (ray.t_min, ray.t_max) = (1.0, 1.0f32.next_down()),
        }
        ray
    }
}

/// From `from` with `t = 1` at `to`, up to rounding.
pub(crate) fn aimed(from: [f32; 3], to: [f32; 3]) -> Ray {
    Ray::new(from, nonzero(std::array::from_fn(|k| f64::from(to[k]) - f64::from(from[k]))))
}

pub(crate) fn mix(a: [f32; 3], b: [f32; 3], s: f64) -> [f32; 3] {
    round(std::array::from_fn(|k| f64::from(a[k]) * (1.0 - s) + f64::from(b[k]) * s))
}

pub(crate) fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Rounded, and cut to what is finite.
pub(crate) fn round(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| (x as f32).clamp(-f32::MAX, f32::MAX))
}

pub(crate) fn nonzero(v: [f64; 3]) -> [f32; 3] {
    let direction = round(v);
    if direction == [0.0; 3] { [1.0, 0.0, 0.0] } else { direction }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::make;

    #[test]
    fn valid_families_are_finite_and_all_repeat() {
        for (name, make) in make::ALL {
            let model = make(50);
            for family in Family::ORDINARY.into_iter().chain(Family::HOSTILE) {
                let rays = RayMaker::new(&model, 3).many(family, 200);
                let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
                for ray in &rays {
                    let sound = finite(ray.origin) && finite(ray.direction);
                    let sound = sound && ray.direction != [0.0; 3] && ray.t_min <= ray.t_max;
                    assert!(sound, "{name} {family:?} {ray:?}");
                }
                assert_eq!(rays, RayMaker::new(&model, 3).many(family, 200), "{name} {family:?}");
            }
        }
    }

    #[test]
    fn no_invalid_ray_hits_anything() {
        let model: Model = make::sphere(100).into();
        let oracle = crate::oracle::Oracle::new(&model);
        for ray in RayMaker::new(&model, 4).many(Family::Invalid, 300) {
            assert!(oracle.closest(&ray, &Default::default()).hit.is_none(), "{ray:?}");
        }
    }
}
