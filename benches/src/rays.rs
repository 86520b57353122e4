//! The rays: made once a scene, kept in memory, the same for everyone.

use glam::DVec3;
use raykern::{Accel, Ray};
use raykern_harness::make::Random;
use raykern_harness::render::Camera;

use crate::scenes::{Loaded, View};

/// A kind of ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// From the camera, row by row.
    Primary,
    /// From the camera, in tiles of 8 x 8 pixels.
    Tiles,
    /// From where a primary ray hit, by the cosine of the normal.
    Diffuse,
    /// From anywhere in the box in any direction.
    Random,
    /// From where a primary ray hit to a point light; any hit.
    Shadow,
    /// As diffuse, a tenth of the box long at most; any hit.
    Occlusion,
}

/// What a ray asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The closest hit.
    Closest,
    /// Whether there is a hit.
    Any,
}

impl Kind {
    /// Every kind, in the order of the tables.
    pub const ALL: [Kind; 6] =
        [Kind::Primary, Kind::Tiles, Kind::Diffuse, Kind::Random, Kind::Shadow, Kind::Occlusion];

    /// The name in tables and options.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Primary => "primary",
            Kind::Tiles => "tiles",
            Kind::Diffuse => "diffuse",
            Kind::Random => "random",
            Kind::Shadow => "shadow",
            Kind::Occlusion => "occlusion",
        }
    }

    /// The kind with this name.
    pub fn parse(name: &str) -> Result<Self, String> {
        let names = Kind::ALL.map(Kind::name).join(", ");
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| format!("expected one of {names}"))
    }

    /// What its rays ask.
    pub fn question(self) -> Question {
        match self {
            Kind::Shadow | Kind::Occlusion => Question::Any,
            _ => Question::Closest,
        }
    }

    /// Whether neighbours in the list are alike.
    pub fn is_coherent(self) -> bool {
        matches!(self, Kind::Primary | Kind::Tiles | Kind::Shadow)
    }
}

/// Width and height of the picture whose pixels primary rays go through.
const SIDE: u32 = 1024;
/// Width and height of a tile.
const TILE: u32 = 8;
/// How far secondary rays start from a surface, in sizes of the box.
const LIFT: f64 = 1e-5;

/// Makes the rays of one scene.
pub struct RayMaker<'a> {
    accel: &'a Accel<'a>,
    camera: Camera,
    light: DVec3,
    lower: DVec3,
    size: DVec3,
    count: usize,
}

impl<'a> RayMaker<'a> {
    /// Sets up the camera. `accel` is over the scene; `count` is how many rays of a kind to make.
    pub fn new(scene: &Loaded, accel: &'a Accel<'a>, count: usize) -> Self {
        let info = accel.info();
        let [lower, upper] = [info.lower, info.upper].map(wide);
        let (camera, light) = (scene.camera.clone(), scene.light);
        let mut maker = RayMaker { accel, camera, light, lower, size: upper - lower, count };
        if scene.view == View::Inside {
            let (eye, target) = maker.freest(1);
            let up = if (target - eye).normalize().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
            let camera = Camera::look_at(eye, target, up, 60.0, 1.0, [SIDE; 2]);
            maker.camera = camera.unwrap_or(maker.camera);
            maker.light = maker.freest(2).0;
        }
        maker.camera = maker.camera.with_resolution([SIDE; 2]).expect("a sound number of pixels");
        maker
    }

    /// The rays of one kind: always as many as asked for.
    pub fn make(&self, kind: Kind) -> Vec<Ray> {
        let random = &mut Random::new(7);
        match kind {
            Kind::Primary => self.primary(),
            Kind::Tiles => self.tiles(),
            Kind::Diffuse => {
                self.leaving_surfaces(|from, normal| Ray::new(from, cosine(normal, random)))
            }
            Kind::Random => (0..self.count).map(|_| self.random(random)).collect(),
            Kind::Shadow => self.leaving_surfaces(|from, _| {
                let way = self.light - wide(from);
                Ray::new(from, narrow(way)).with_limits(0.0, 0.999)
            }),
            Kind::Occlusion => {
                let reach = 0.1 * self.size.max_element();
                self.leaving_surfaces(|from, normal| {
                    Ray::new(from, cosine(normal, random)).with_limits(0.0, reach as f32)
                })
            }
        }
    }

    /// Whole rows, evenly spread over the picture.
    fn primary(&self) -> Vec<Ray> {
        let rows = (self.count as u32).div_ceil(SIDE).min(SIDE);
        let row = |i: u32| i * SIDE / rows;
        let pixels = (0..rows).flat_map(|i| (0..SIDE).map(move |x| (x, row(i))));
        self.through(pixels)
    }

    /// Whole tiles, evenly spread over the picture.
    fn tiles(&self) -> Vec<Ray> {
        let across = SIDE / TILE;
        let all = across * across;
        let tiles = (self.count as u32).div_ceil(TILE * TILE).min(all);
        let pixels = (0..tiles).flat_map(move |i| {
            let tile = (u64::from(i) * u64::from(all) / u64::from(tiles)) as u32;
            let (x, y) = (tile % across * TILE, tile / across * TILE);
            (0..TILE * TILE).map(move |k| (x + k % TILE, y + k / TILE))
        });
        self.through(pixels)
    }

    /// The rays through these pixels, over and over if there are too few.
    fn through(&self, pixels: impl Iterator<Item = (u32, u32)> + Clone) -> Vec<Ray> {
        let ray = |(x, y): (u32, u32)| self.camera.ray(x, y);
        pixels.map(ray).collect::<Vec<_>>().into_iter().cycle().take(self.count).collect()
    }

    fn random(&self, random: &mut Random) -> Ray {
        let from = self.lower + self.size * DVec3::from(random.point(0.0, 1.0));
        Ray::new(narrow(from), random.direction().map(|x| x as f32))
    }

    /// Rays that leave where primary rays hit, in their order; several of each if few hit.
    fn leaving_surfaces(&self, mut leave: impl FnMut([f32; 3], DVec3) -> Ray) -> Vec<Ray> {
        let mut places: Vec<_> =
            self.primary().iter().filter_map(|ray| self.beside_surface(ray)).collect();
        if places.is_empty() {
            places.push((narrow(self.lower), DVec3::Z));
        }
        let places = (0..self.count).map(|i| places[i * places.len() / self.count]);
        places.map(|(from, normal)| leave(from, normal)).collect()
    }

    /// Where a ray that came along `ray` leaves again, and the normal on its side.
    fn beside_surface(&self, ray: &Ray) -> Option<([f32; 3], DVec3)> {
        let surface = self.accel.surface(ray, &self.accel.intersect(ray)?)?;
        let normal = wide(surface.normal);
        let (from, normal) = match normal.dot(wide(ray.direction)) < 0.0 {
            true => (surface.front_origin, normal),
            false => (surface.back_origin, -normal),
        };
        // Far enough for those who need not be exact: nobody shall be fast by meeting the surface
        // that the ray has just left.
        let step = LIFT * self.size.max_element();
        Some((narrow(wide(from) + step * normal), normal))
    }

    /// Of some random places the one furthest from any surface, and the furthest point seen.
    fn freest(&self, seed: u64) -> (DVec3, DVec3) {
        let random = &mut Random::new(seed);
        let mut best = (0.0, self.lower + 0.5 * self.size, self.lower);
        for _ in 0..300 {
            let from = self.lower + self.size * DVec3::from(random.point(0.1, 0.9));
            let seen: Vec<(f64, DVec3)> = (0..40)
                .filter_map(|_| {
                    let way = DVec3::from(random.direction());
                    let hit = self.accel.intersect(&Ray::new(narrow(from), narrow(way)))?;
                    Some((f64::from(hit.t), from + f64::from(hit.t) * way))
                })
                .collect();
            let least = seen.iter().map(|s| s.0).fold(f64::INFINITY, f64::min);
            let enclosed = seen.len() >= 30;
            if let Some(far) = seen.iter().max_by(|a, b| a.0.total_cmp(&b.0))
                && enclosed
                && least > best.0
            {
                best = (least, from, far.1);
            }
        }
        (best.1, best.2)
    }
}

/// A direction around `normal`, likelier the steeper.
fn cosine(normal: DVec3, random: &mut Random) -> [f32; 3] {
    let direction = normal * 1.0001 + DVec3::from(random.direction());
    narrow(direction.normalize())
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use raykern::Layout;

    use super::*;
    use crate::options::Options;
    use crate::ours::bvh;
    use crate::scenes::cases;

    #[test]
    fn every_kind_has_all_its_rays_and_they_are_sound() {
        let options =
            Options::parse_from(["", "--quick", "--scene", "cave", "--scene", "architecture"]);
        for case in cases(&options) {
            let scene = case.load(&options).expect("a generated scene");
            let built = bvh(&scene.model, Layout::Automatic).expect("a BVH");
            let accel = built.accel();
            let maker = RayMaker::new(&scene, &accel, 2_000);
            for kind in Kind::ALL {
                let rays = maker.make(kind);
                assert_eq!(rays.len(), 2_000, "{}", kind.name());
                let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
                let sound = |r: &Ray| finite(r.origin) && finite(r.direction) && r.t_min == 0.0;
                assert!(rays.iter().all(sound), "{}", kind.name());
                assert_eq!(rays, maker.make(kind), "{}", kind.name());
            }
            let hits =
                maker.make(Kind::Primary).iter().filter(|r| built.accel().occluded(r)).count();
            assert!(hits > 1_000, "{hits}: the camera looks out of {}", case.name);
        }
    }
}
