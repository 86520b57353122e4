//! A scene and questions about it, what must hold of the answers, and the case as Rust source.
//!
//! Also compiled into `tests/fuzz_cases.rs`, so that a finding is checked there as it was found.

use std::fmt;

use raykern::{
    Accel, BuildOptions, Counts, GridKind, GridOptions, Hit, Mesh, NONE, OwnedAccel, PlainList,
    Precision, QueryOptions, Ray, Scene, SphereSet, build_grid, grid_needs,
};
use raykern_harness::model::{Model, TriangleMesh};
use raykern_harness::oracle::{Judgement, Oracle};

/// The oracle judges scenes of at most so many primitives: it takes about 10 us for each.
const JUDGED: usize = 48;

/// Geometry, masks and questions.
#[derive(Clone, Debug, Default)]
pub struct Case {
    /// The meshes and sphere sets.
    pub model: Model,
    /// A mask a geometry; missing ones are 0.
    pub masks: Vec<u32>,
    /// What is asked.
    pub questions: Vec<(Ray, QueryOptions)>,
}

/// A block in memory of its own.
pub struct Bytes {
    memory: Vec<u8>,
    start: usize,
    len: usize,
}

impl Bytes {
    /// A copy of `bytes` from a multiple of 64.
    pub fn copy(bytes: &[u8]) -> Self {
        let mut memory = vec![0; bytes.len() + 64];
        let start = memory.as_ptr().align_offset(64);
        memory[start..start + bytes.len()].copy_from_slice(bytes);
        Bytes { memory, start, len: bytes.len() }
    }

    /// The copy.
    pub fn get(&self) -> &[u8] {
        &self.memory[self.start..self.start + self.len]
    }

    /// The copy, to write to.
    pub fn get_mut(&mut self) -> &mut [u8] {
        &mut self.memory[self.start..self.start + self.len]
    }
}

/// A scene, built in every way, with its oracle.
pub struct Subject {
    blocks: Vec<(&'static str, Bytes)>,
    oracle: Option<Oracle>,
}

impl Subject {
    /// Builds list, grids and BVH, each forced, and a grid in the least memory.
    pub fn build(model: &Model, masks: &[u32]) -> Self {
        let with = |plain_list| BuildOptions { plain_list, ..Default::default() };
        let (always, never) = (with(PlainList::Always), with(PlainList::Never));
        let copy = |accel: Accel| Bytes::copy(accel.block());
        let owned = |built: OwnedAccel| copy(built.accel());
        let blocks = with_scene(model, masks, |scene| {
            let grid = |kind| {
                let grid = GridOptions { kind, ..GridOptions::default() };
                OwnedAccel::grid(scene, &BuildOptions { grid, ..never })
            };
            vec![
                ("list", owned(OwnedAccel::bvh(scene, &always).expect("a list"))),
                ("nested grid", owned(grid(GridKind::Nested).expect("a grid"))),
                ("uniform grid", owned(grid(GridKind::Uniform).expect("a grid"))),
                ("octree", owned(grid(GridKind::Octree).expect("a grid"))),
                ("bvh", owned(OwnedAccel::bvh(scene, &never).expect("a BVH"))),
                (
                    "automatic",
                    owned(OwnedAccel::bvh(scene, &with(PlainList::Automatic)).expect("a BVH")),
                ),
                ("coarse", coarse_grid(scene, &never)),
            ]
        });
        let small = model.triangle_count() + model.sphere_count() <= JUDGED;
        let oracle = small.then(|| Oracle::with_masks(model, masks));
        Subject { blocks, oracle }
    }

    /// Opens each block as one that came from elsewhere.
    pub fn open(&self) -> Vec<(&'static str, Accel<'_>)> {
        (self.blocks.iter())
            .map(|(name, bytes)| {
                (*name, Accel::open(bytes.get()).unwrap_or_else(|e| panic!("{name}: {e:?}")))
            })
            .collect()
    }

    /// Asks one question everywhere; panics when answers differ or are wrong.
    pub fn ask(&self, accels: &[(&str, Accel)], ray: &Ray, options: &QueryOptions) -> Option<Hit> {
        let exact = QueryOptions { precision: Precision::Exact, ..*options };
        let expected = accels[0].1.intersect_with(ray, &exact);
        let surface = expected.map(|hit| surface_bits(&accels[0].1, ray, &hit));
        for (i, (name, accel)) in accels.iter().enumerate() {
            let hit = accel.intersect_with(ray, &exact);
            assert_eq!(bits(hit), bits(expected), "{name} differs: {hit:?} {expected:?}");
            assert_eq!(accel.occluded_with(ray, &exact), hit.is_some(), "{name}: occluded");
            if i as u32 % 3 == ray.origin[0].to_bits() % 3 {
                // Not everywhere, for the sake of speed.
                let mut counts = Counts::default();
                let counted = accel.intersect_counted(ray, &exact, &mut counts);
                assert_eq!(bits(counted), bits(expected), "{name}: counted");
                let counted = accel.occluded_counted(ray, &exact, &mut counts);
                assert_eq!(counted, hit.is_some(), "{name}: occluded, counted");
            }
            if let Some(hit) = hit {
                assert_eq!(Some(surface_bits(accel, ray, &hit)), surface, "{name}: surface");
            }
            watertight(name, accel, ray, options, expected);
        }
        if let Some(oracle) = &self.oracle {
            let judgement = oracle.judge(ray, &exact, expected);
            assert_eq!(judgement, Judgement::Right, "the oracle of {expected:?}");
        }
        expected
    }
}

impl Case {
    /// Builds the scene and asks all questions; panics with the case where something is wrong.
    pub fn check(&self) {
        let subject = Subject::build(&self.model, &self.masks);
        self.check_in(&subject);
    }

    /// Asks all questions of a scene that is built already.
    pub fn check_in(&self, subject: &Subject) {
        let accels = subject.open();
        for (ray, options) in &self.questions {
            subject.ask(&accels, ray, options);
        }
        let rays: Vec<Ray> = self.questions.iter().map(|(ray, _)| *ray).collect();
        for (name, accel) in accels.iter().skip(rays.len() % accels.len()).take(1) {
            let mut hits = vec![Hit::MISS; rays.len()];
            let mut occluded = vec![false; rays.len()];
            accel.intersect_batch(&rays, &mut hits);
            accel.occluded_batch(&rays, &mut occluded);
            for (i, ray) in rays.iter().enumerate() {
                let single = accel.intersect(ray);
                let (batched, expected) = (bits(Some(hits[i])), single.unwrap_or(Hit::MISS));
                assert_eq!(batched, bits(Some(expected)), "{name}: batch, {ray:?}");
                assert_eq!(occluded[i], single.is_some(), "{name}: occluded batch, {ray:?}");
            }
        }
    }
}

/// The watertight mode may differ, but it misses nothing, and what it answers is well-formed.
fn watertight(name: &str, accel: &Accel, ray: &Ray, options: &QueryOptions, exact: Option<Hit>) {
    let options = QueryOptions { precision: Precision::Watertight, ..*options };
    let hit = accel.intersect_with(ray, &options);
    assert!(hit.is_some() || exact.is_none(), "{name}: watertight misses {exact:?}");
    assert_eq!(accel.occluded_with(ray, &options), hit.is_some(), "{name}: watertight occluded");
    if let Some(Hit { t, u, v, prim, geometry, .. }) = hit {
        let sound = t.is_finite() && u >= 0.0 && v >= 0.0 && 1.0 - u - v >= 0.0;
        assert!(sound && prim != NONE && geometry != NONE, "{name}: watertight gives {hit:?}");
    }
}

fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    let hit = hit?;
    Some([hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim, hit.geometry, hit.instance])
}

/// The surface at a hit, which must be there, with a normal of length one.
fn surface_bits(accel: &Accel, ray: &Ray, hit: &Hit) -> Vec<u32> {
    let surface = accel.surface(ray, hit).unwrap_or_else(|| panic!("no surface at {hit:?}"));
    let square: f64 = surface.normal.iter().map(|x| f64::from(*x).powi(2)).sum();
    assert!((square - 1.0).abs() < 1e-5, "{surface:?}");
    let points = [surface.position, surface.normal, surface.front_origin, surface.back_origin];
    let floats = points.as_flattened().iter().chain([&surface.position_error]);
    floats.map(|x| x.to_bits()).collect()
}

fn with_scene<R>(model: &Model, masks: &[u32], f: impl FnOnce(&Scene) -> R) -> R {
    let mask = |i: usize| masks.get(i).copied().unwrap_or(0);
    let meshes: Vec<Mesh> = (model.meshes.iter().enumerate())
        .map(|(i, m)| Mesh::indexed(&m.vertices, &m.indices).with_mask(mask(i)))
        .collect();
    let sets: Vec<SphereSet> = (model.sphere_sets.iter().enumerate())
        .map(|(i, s)| SphereSet::new(s).with_mask(mask(model.meshes.len() + i)))
        .collect();
    f(&Scene::new(&meshes, &sets))
}

fn coarse_grid(scene: &Scene, options: &BuildOptions) -> Bytes {
    let minimum = grid_needs(scene, options).expect("a size").minimum;
    let mut memory = vec![std::mem::MaybeUninit::new(0xa5u8); minimum + 64];
    let start = memory.as_ptr().align_offset(64);
    let place = &mut memory[start..start + minimum];
    Bytes::copy(build_grid(scene, options, place).expect("the least memory is enough").block())
}

/// The case as an element of the table in `tests/fuzz_cases.rs`.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Case {{")?;
        writeln!(f, "    model: Model {{")?;
        writeln!(f, "        meshes: vec![")?;
        for TriangleMesh { vertices, indices } in &self.model.meshes {
            let vertices = source(vertices);
            writeln!(
                f,
                "            TriangleMesh {{ vertices: vec!{vertices}, indices: vec!{indices:?} }},"
            )?;
        }
        writeln!(f, "        ],")?;
        writeln!(f, "        sphere_sets: vec![")?;
        for set in &self.model.sphere_sets {
            writeln!(f, "            vec!{},", source(set))?;
        }
        writeln!(f, "        ],")?;
        writeln!(f, "    }},")?;
        writeln!(f, "    masks: vec!{:?},", self.masks)?;
        writeln!(f, "    questions: vec![")?;
        for (ray, options) in &self.questions {
            let Ray { origin, t_min, direction, t_max } = ray;
            let [origin, direction] = [source(origin), source(direction)];
            let [t_min, t_max] = [source(t_min), source(t_max)];
            writeln!(f, "        (Ray::new({origin}, {direction}).with_limits({t_min}, {t_max}),")?;
            let QueryOptions { precision, mask, facing, skip } = options;
            writeln!(
                f,
                "         QueryOptions {{ precision: Precision::{precision:?}, mask: {mask}, \
                 facing: Facing::{facing:?}, skip: {skip:?} }}),"
            )?;
        }
        writeln!(f, "    ],")?;
        writeln!(f, "}}")
    }
}

/// Numbers as Rust writes them; they are read back to the bit, but for the payload of a NaN.
fn source(value: &impl fmt::Debug) -> String {
    format!("{value:?}").replace("inf", "f32::INFINITY").replace("NaN", "f32::NAN")
}
