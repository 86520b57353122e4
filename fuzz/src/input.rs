//! Fuzzer bytes as floats, points, scenes, rays and options.
//!
//! Raw bits alone hardly ever make two coordinates equal or a ray pass through a vertex. So most
//! bytes choose: small whole numbers, powers of two, subnormals, the ends of the range, a number seen
//! before or its neighbour; and rays are aimed at what the scene holds.

use arbitrary::{Result, Unstructured};
use raykern::{Facing, NONE, Precision, PrimId, QueryOptions, Ray};
use raykern_harness::model::{Model, TriangleMesh};

use crate::aim::Aim;
use crate::case::Case;
use crate::damage::Damage;

const SPECIAL: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::MAX,
    -f32::MAX,
    f32::MIN_POSITIVE,
    1.0 + f32::EPSILON,
    1.0 - f32::EPSILON / 2.0,
    1e-45,
    -1e-45,
    1e30,
    -1e-30,
    16_777_216.0,
    f32::INFINITY,
    f32::NAN,
];

/// Which numbers are likely: a scene of one kind keeps its coincidences.
#[derive(Clone, Copy)]
enum Theme {
    Lattice,
    Near,
    Extreme,
    Any,
}

/// Makes things of bytes, and remembers numbers and points for making them again.
pub struct Maker<'u, 'b> {
    bytes: &'u mut Unstructured<'b>,
    theme: Theme,
    numbers: Vec<f32>,
    points: Vec<[f32; 3]>,
}

impl<'u, 'b> Maker<'u, 'b> {
    /// A maker whose first byte chooses the theme.
    pub fn new(bytes: &'u mut Unstructured<'b>) -> Result<Self> {
        let theme = match bytes.arbitrary::<u8>()? % 8 {
            0..=2 => Theme::Lattice,
            3 | 4 => Theme::Near,
            5 => Theme::Extreme,
            _ => Theme::Any,
        };
        Ok(Maker { bytes, theme, numbers: vec![0.0], points: vec![[0.0; 3]] })
    }

    fn byte(&mut self) -> Result<u8> {
        self.bytes.arbitrary()
    }

    fn below(&mut self, end: usize) -> Result<usize> {
        Ok(usize::from(self.byte()?) % end)
    }

    /// A number, more often than not of the theme.
    pub fn number(&mut self) -> Result<f32> {
        let choice = self.byte()?;
        let kind = match (self.theme, choice % 16) {
            (Theme::Lattice, 0..=11) => 0,
            (Theme::Near, 0..=3) => 0,
            (Theme::Near, 4..=11) => 5,
            (Theme::Extreme, 0..=5) => 1,
            (Theme::Extreme, 6..=8) => 3,
            (Theme::Extreme, 9..=11) => 2,
            (_, other) => other % 8,
        };
        let high = f32::from(choice / 16);
        let number = match kind {
            0 => high - 8.0,
            1 => {
                let exponent = i32::from(self.byte()?) - 128;
                let sign = if choice & 16 == 0 { 1.0 } else { -1.0 };
                // Half the powers have a small factor, and those above the range become its end.
                let power = 2f64.powi(exponent.max(-149)) * f64::from(1.0 + high / 4.0);
                sign * (power as f32).min(f32::MAX)
            }
            2 => f32::from_bits(
                u32::from(self.bytes.arbitrary::<u16>()?) | u32::from(choice & 128) << 24,
            ),
            3 => SPECIAL[usize::from(choice / 16)],
            4 => self.seen()?,
            5 => {
                let (from, steps) = (self.seen()?, self.byte()? % 5);
                neighbour(from, i32::from(steps) - 2)
            }
            6 => self.seen()? * [0.5, 2.0, -1.0, 0.25][usize::from(choice / 16 % 4)],
            _ => f32::from_bits(self.bytes.arbitrary()?),
        };
        self.numbers.push(number);
        Ok(number)
    }

    fn seen(&mut self) -> Result<f32> {
        let i = self.below(self.numbers.len())?;
        Ok(self.numbers[i])
    }

    fn seen_point(&mut self) -> Result<[f32; 3]> {
        let i = self.below(self.points.len())?;
        Ok(self.points[i])
    }

    /// A point: a new one, or one that has to do with those before.
    pub fn point(&mut self) -> Result<[f32; 3]> {
        let point = match self.byte()? % 8 {
            0 => self.seen_point()?,
            1 => {
                let mut point = self.seen_point()?;
                point[self.below(3)?] = self.number()?;
                point
            }
            2 => {
                let (a, b) = (self.seen_point()?, self.seen_point()?);
                std::array::from_fn(|k| 0.5 * a[k] + 0.5 * b[k])
            }
            3 => {
                // The fourth corner of a parallelogram: in one plane with three others.
                let (a, b, c) = (self.seen_point()?, self.seen_point()?, self.seen_point()?);
                std::array::from_fn(|k| a[k] + (b[k] - c[k]))
            }
            _ => [self.number()?, self.number()?, self.number()?],
        };
        self.points.push(point);
        Ok(point)
    }

    /// Up to two meshes and two sphere sets, with masks.
    pub fn scene(&mut self) -> Result<Case> {
        let mut case = Case::default();
        for _ in 0..=self.below(2)? {
            let mesh = self.mesh()?;
            case.model.meshes.push(mesh);
        }
        for _ in 0..self.below(3)? {
            let set = self.spheres()?;
            case.model.sphere_sets.push(set);
        }
        let geometries = case.model.meshes.len() + case.model.sphere_sets.len();
        for _ in 0..geometries {
            case.masks.push(u32::from(self.byte()?.saturating_sub(128) % 4));
        }
        Ok(case)
    }

    fn mesh(&mut self) -> Result<TriangleMesh> {
        let (vertex_count, triangle_count) = (1 + self.below(20)?, self.below(24)?);
        let mut mesh = TriangleMesh::default();
        for _ in 0..vertex_count {
            let point = self.point()?;
            mesh.vertices.push(point);
        }
        for _ in 0..triangle_count {
            let corner = |m: &mut Self| m.below(vertex_count).map(|v| v as u32);
            mesh.indices.push([corner(self)?, corner(self)?, corner(self)?]);
        }
        // Now and then enough copies for a deep tree and a fine grid, beside each other or not.
        if self.byte()? % 8 == 0 {
            let (copies, step) = (self.below(12)?, self.point()?);
            let one = mesh.clone();
            for i in 1..=copies {
                let mut copy = one.clone();
                for vertex in &mut copy.vertices {
                    *vertex = std::array::from_fn(|k| vertex[k] + step[k] * i as f32);
                }
                mesh.append(&copy);
            }
        }
        Ok(mesh)
    }

    fn spheres(&mut self) -> Result<Vec<[f32; 4]>> {
        let count = self.below(8)?;
        let mut set = Vec::with_capacity(count);
        for _ in 0..count {
            let [x, y, z] = self.point()?;
            let radius = self.number()?;
            // A third stays negative: never hit.
            set.push([x, y, z, if self.byte()? % 3 == 0 { radius } else { radius.abs() }]);
        }
        Ok(set)
    }

    /// Up to eight questions about the scene of `case`.
    pub fn questions(&mut self, case: &mut Case) -> Result<()> {
        for _ in 0..=self.below(8)? {
            let ray = self.ray(&case.model)?;
            let options = self.options(&case.model)?;
            case.questions.push((ray, options));
        }
        Ok(())
    }

    /// A ray of any bits, or aimed at something in the scene.
    pub fn ray(&mut self, model: &Model) -> Result<Ray> {
        let kind = self.byte()?;
        if kind % 16 == 0 {
            let mut words = [0.0; 8];
            for word in &mut words {
                *word = f32::from_bits(self.bytes.arbitrary()?);
            }
            let [a, b, c, d, e, f, t_min, t_max] = words;
            return Ok(Ray::new([a, b, c], [d, e, f]).with_limits(t_min, t_max));
        }
        let origin = if kind & 16 == 0 { self.point()? } else { self.target(model)? };
        let direction = match kind % 16 {
            1 => self.point()?,
            2 | 3 => {
                let mut axis = [0.0, -0.0, 0.0];
                axis[self.below(3)?] = self.number()?;
                axis
            }
            4 => {
                let (a, b) = (self.target(model)?, self.target(model)?);
                std::array::from_fn(|k| b[k] - a[k])
            }
            5 => {
                // Halved first: differences of the largest numbers stay finite.
                let to = self.target(model)?;
                std::array::from_fn(|k| 0.5 * to[k] - 0.5 * origin[k])
            }
            6 => {
                let (to, power) = (self.target(model)?, i32::from(self.byte()?) - 128);
                let scale = 2f64.powi(power);
                std::array::from_fn(|k| ((f64::from(to[k]) - f64::from(origin[k])) * scale) as f32)
            }
            _ => {
                let to = self.target(model)?;
                std::array::from_fn(|k| to[k] - origin[k])
            }
        };
        let ray = Ray::new(origin, direction);
        Ok(match self.byte()? % 16 {
            0 => ray.with_limits(self.number()?, self.number()?),
            1 => ray.with_limits(0.0, 1.0),
            2 => ray.with_limits(1.0, f32::INFINITY),
            3 => ray.with_limits(1.0, 1.0),
            4 => ray.with_limits(f32::NEG_INFINITY, f32::INFINITY),
            5 => ray.with_limits(f32::NEG_INFINITY, -0.0),
            6 => ray.with_limits(-self.number()?.abs(), self.number()?.abs()),
            7 => ray.with_limits(0.0, 1f32.next_down()),
            _ => ray,
        })
    }

    /// A vertex, a point of an edge or a face, a centre, a point of a sphere beside it, or any point.
    fn target(&mut self, model: &Model) -> Result<[f32; 3]> {
        let kind = self.byte()? % 8;
        if kind == 0 {
            return self.point();
        }
        let triangles = model.meshes.iter().any(|m| !m.indices.is_empty());
        let spheres = model.sphere_sets.iter().any(|s| !s.is_empty());
        if spheres && (kind < 3 || !triangles) {
            let all: Vec<_> = model.sphere_sets.iter().flatten().collect();
            let [x, y, z, r] = *all[self.below(all.len())?];
            let mut point = [x, y, z];
            match self.byte()? % 4 {
                0 => {}
                1 => point[self.below(3)?] += r,
                2 => point[self.below(3)?] -= r,
                _ => point = point.map(|x| x + r * 0.577_350_3),
            }
            return Ok(point);
        }
        if !triangles {
            return self.point();
        }
        let all: Vec<_> =
            model.meshes.iter().flat_map(|m| m.indices.iter().map(move |t| (m, t))).collect();
        let (mesh, triangle) = all[usize::from(self.bytes.arbitrary::<u16>()?) % all.len()];
        let [a, b, c] = triangle.map(|v| mesh.vertices[v as usize]);
        let step = self.byte()?;
        let share = f32::from(step % 9) / 8.0;
        Ok(match kind {
            3 | 4 => [a, b, c][usize::from(step) % 3],
            5 => std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share),
            6 => std::array::from_fn(|k| 0.5 * b[k] + 0.25 * a[k] + 0.25 * c[k]),
            _ => {
                [a, b, c][usize::from(step) % 3].map(|x| neighbour(x, i32::from(step / 16) % 3 - 1))
            }
        })
    }

    /// Options: the default as often as not.
    pub fn options(&mut self, model: &Model) -> Result<QueryOptions> {
        let choice = self.byte()?;
        if choice < 128 {
            return Ok(QueryOptions::default());
        }
        let geometries = model.meshes.len() + model.sphere_sets.len();
        let skip = if choice & 64 == 0 {
            None
        } else {
            let geometry = self.below(geometries + 1)? as u32;
            let instance = if self.byte()? % 16 == 0 { 0 } else { NONE };
            Some(PrimId { prim: u32::from(self.byte()?) % 24, geometry, instance })
        };
        Ok(QueryOptions {
            precision: Precision::Exact,
            mask: u32::from(choice >> 2) % 4,
            facing: [Facing::Both, Facing::Front, Facing::Back, Facing::Both]
                [usize::from(choice) % 4],
            skip,
        })
    }
}

/// The float `steps` floats above `x`.
fn neighbour(x: f32, steps: i32) -> f32 {
    (0..steps.abs()).fold(x, |x, _| if steps < 0 { x.next_down() } else { x.next_up() })
}

impl Damage {
    /// Damage of any bytes: words at places of 4 bytes, half of them in the header, with values that
    /// counts, references and floats are broken by.
    pub fn of(bytes: &mut Unstructured) -> Result<Self> {
        let mut damage =
            Damage { original: usize::from(bytes.arbitrary::<u8>()?), ..Damage::default() };
        let mut maker = Maker::new(bytes)?;
        for _ in 0..=maker.below(4)? {
            let ray = maker.ray(&Model::default())?;
            damage.rays.push(ray);
        }
        for _ in 0..maker.below(6)? {
            let word = maker.word()?;
            damage.words.push(word);
        }
        for _ in 0..maker.below(3)? {
            let copy = maker.copy()?;
            damage.copies.push(copy);
        }
        for _ in 0..maker.below(4)? {
            let (part, (place, value)) = (maker.below(6)?, maker.word()?);
            damage.aimed.push((Aim { part, word: place / 4 }, value));
        }
        Ok(damage)
    }
}

impl Maker<'_, '_> {
    /// A copy of as many bytes as a word, a node, a bundle or a leaf block has, or a line of them, to a place where one
    /// may be.
    fn copy(&mut self) -> Result<[usize; 3]> {
        let size = [4, 16, 32, 64, 112, 224, 256, 448][self.below(8)?];
        let step = size.min(64);
        let mut place =
            || -> Result<usize> { Ok(step * usize::from(self.bytes.arbitrary::<u16>()?)) };
        Ok([place()?, place()?, size])
    }

    fn word(&mut self) -> Result<(usize, u32)> {
        let kind = self.byte()?;
        let place = usize::from(self.bytes.arbitrary::<u16>()?);
        let at = if kind & 128 == 0 { 4 * (place % 64) } else { 4 * place };
        let word = match kind % 8 {
            0 => 0,
            1 => u32::MAX,
            2 | 3 => u32::from(self.byte()?),
            4 => 1 << (self.byte()? % 32),
            5 => self.bytes.arbitrary()?,
            _ => self.number()?.to_bits(),
        };
        Ok((at, word))
    }
}
