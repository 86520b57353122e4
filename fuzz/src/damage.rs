//! Blocks as an enemy would write them, and what must hold when one is opened.
//!
//! Also compiled into `tests/fuzz_cases.rs`.

use std::fmt;

use raykern::{
    Accel, AccelMut, BuildOptions, Facing, GridKind, GridOptions, Hit, Instance, Layout, NONE,
    OwnedAccel, PlainList, Precision, PrimId, Scene,
};
use raykern::{QueryOptions, Ray};
use raykern_harness::make;
use raykern_harness::model::{Model, TriangleMesh};

use crate::aim::Aim;
use crate::case::Bytes;

/// A built block with words written over it, or whole bytes, and rays.
#[derive(Clone, Debug, Default)]
pub struct Damage {
    /// Which of [`originals`], modulo their number.
    pub original: usize,
    /// Bytes from which on, and what stands there instead; modulo the size of the block.
    pub words: Vec<(usize, u32)>,
    /// Bytes from which on, where a copy of them goes, and how many: modulo the size of the block. Done before the words.
    pub copies: Vec<[usize; 3]>,
    /// Words of parts that are few but matter, and what stands there instead; the places are those of the sound block.
    pub aimed: Vec<(Aim, u32)>,
    /// If there are any, the block instead of an original.
    pub bytes: Vec<u8>,
    /// What is asked.
    pub rays: Vec<Ray>,
}

/// What the sound blocks are over.
fn models() -> [Model; 5] {
    let mut mixed = make::spheres(20, 2);
    mixed.meshes.push(make::soup(40, 2));
    let clustered = {
        let mut model: Model = make::plane(40).into();
        model.meshes.push(make::blob(60, 1).placed(0.01, [0.3, 0.3, 0.1]));
        model
    };
    let empty = Model { meshes: vec![TriangleMesh::default()], sphere_sets: vec![] };
    [empty, make::plane(1).into(), make::spheres(40, 3), mixed, clustered]
}

/// Sound blocks: list, grid and BVH over a few scenes, some of which can be refitted.
pub fn originals() -> Vec<Vec<u8>> {
    let with = |plain_list| BuildOptions { plain_list, ..Default::default() };
    let build = |model: &Model| {
        model.with_scene(|scene| {
            let never = with(PlainList::Never);
            let octree = GridOptions { kind: GridKind::Octree, ..GridOptions::default() };
            let refit = BuildOptions { refit: true, ..never };
            [
                OwnedAccel::bvh(scene, &with(PlainList::Always)),
                OwnedAccel::grid(scene, &never),
                OwnedAccel::grid(scene, &BuildOptions { grid: octree, ..never }),
                OwnedAccel::bvh(scene, &never),
                OwnedAccel::bvh(scene, &refit),
                OwnedAccel::bvh(scene, &BuildOptions { layout: Layout::Compact, ..refit }),
                OwnedAccel::bvh(scene, &BuildOptions { layout: Layout::Wide(4), ..refit }),
                OwnedAccel::bvh(scene, &BuildOptions { plain_list: PlainList::Always, ..refit }),
            ]
            .map(|built| built.expect("a structure").accel().block().to_vec())
        })
    };
    models().iter().flat_map(build).chain(packed()).collect()
}

/// Blocks that hold others and instances of them.
fn packed() -> Vec<Vec<u8>> {
    let children = [make::blob(40, 1).into(), make::spheres(10, 3)].map(|model: Model| {
        model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()).expect("a BVH"))
    });
    let map = |x: f32| [1.0, 0.2, 0.0, x, 0.0, -1.0, 0.3, 0.0, 0.1, 0.0, 2.0, 0.5];
    let place = |i: usize| Instance::new(&children[i % 3 % 2].accel(), map(i as f32 / 8.0));
    let (few, many): (Vec<_>, Vec<_>) = ((0..4).map(place).collect(), (0..30).map(place).collect());
    let never = BuildOptions { plain_list: PlainList::Never, ..Default::default() };
    let mut blocks = Vec::new();
    for instances in [few, many] {
        let scene = Scene::new(&[], &[]).with_instances(&instances);
        let built = [
            OwnedAccel::bvh(&scene, &BuildOptions::default()),
            OwnedAccel::grid(&scene, &never),
            OwnedAccel::bvh(&scene, &BuildOptions { layout: Layout::Compact, ..never }),
            OwnedAccel::bvh(&scene, &BuildOptions { layout: Layout::Wide(8), ..never }),
            OwnedAccel::bvh(&scene, &BuildOptions { plain_list: PlainList::Always, ..never }),
        ];
        blocks.extend(built.map(|built| {
            built.expect("a structure").packed().expect("a block").accel().block().to_vec()
        }));
    }
    blocks
}

/// More than both roots of everything in these blocks.
const MOST_HITS: usize = 10_000;

impl Damage {
    /// The block.
    pub fn block(&self, originals: &[Vec<u8>]) -> Vec<u8> {
        if !self.bytes.is_empty() {
            return self.bytes.clone();
        }
        let mut block = originals[self.original % originals.len()].clone();
        let size = block.len();
        for [from, to, count] in self.copies.iter().map(|copy| copy.map(|place| place % size)) {
            let count = count.min(size - from).min(size - to);
            block.copy_within(from..from + count, to);
        }
        let sound = &originals[self.original % originals.len()];
        let aimed = self.aimed.iter().filter_map(|(aim, word)| Some((aim.place(sound)?, *word)));
        for (at, word) in self.words.iter().copied().chain(aimed) {
            let at = at % block.len();
            for (byte, new) in block[at..].iter_mut().zip(word.to_le_bytes()) {
                *byte = new;
            }
        }
        block
    }

    /// Opens the block and, when it is accepted, asks everything. Whether it was accepted.
    ///
    /// Answers may be nonsense. They come, they name what the block has, and nothing panics.
    pub fn check(&self, originals: &[Vec<u8>]) -> bool {
        let mut bytes = Bytes::copy(&self.block(originals));
        let Ok(accel) = Accel::open(bytes.get()) else { return false };
        self.ask(&accel);
        // Whatever was accepted may be refitted, or not; and is accepted again.
        for model in models() {
            let Ok(mut accel) = AccelMut::open(bytes.get_mut()) else { panic!("refused again") };
            if model.with_scene(|scene| accel.refit(scene, None)).is_ok() {
                let accel = Accel::open(bytes.get()).expect("as sound as before");
                self.ask(&accel);
            }
        }
        true
    }

    /// Asks everything.
    fn ask(&self, accel: &Accel) {
        let info = accel.info();
        assert!(accel.block().len() == info.size);
        let id = PrimId { prim: 0, geometry: 0, instance: NONE };
        for precision in [Precision::Exact, Precision::Watertight] {
            let all = QueryOptions { precision, ..Default::default() };
            let some = QueryOptions { mask: 1, facing: Facing::Front, skip: Some(id), ..all };
            for ray in &self.rays {
                for options in [all, some] {
                    let hit = accel.intersect_with(ray, &options);
                    accel.occluded_with(ray, &options);
                    accel.intersect_counted(ray, &options, &mut Default::default());
                    if let Some(hit) = hit {
                        accel.surface(ray, &hit);
                    }
                    let count = accel.hits(ray, &options).take(MOST_HITS).count();
                    assert!(count < MOST_HITS, "no end of hits");
                    for radius in [1.0, f32::INFINITY] {
                        accel.closest_point(ray.origin, radius, &options);
                    }
                }
            }
        }
        let mut hits = vec![Hit::MISS; self.rays.len()];
        accel.intersect_batch(&self.rays, &mut hits);
        accel.occluded_batch(&self.rays, &mut vec![false; self.rays.len()]);
        // Hits that nobody returned.
        for ray in &self.rays {
            for prim in [0, 1, 1000, NONE - 1, NONE] {
                for geometry in [0, 1, NONE] {
                    accel.surface(ray, &Hit { prim, geometry, t: 1.0, ..Hit::MISS });
                }
            }
        }
    }
}

/// The damage as an element of the table in `tests/fuzz_cases.rs`.
impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Damage { original, words, copies, aimed, bytes, rays } = self;
        let rays = format!("{rays:?}").replace("inf", "f32::INFINITY").replace("NaN", "f32::NAN");
        writeln!(f, "Damage {{")?;
        writeln!(f, "    original: {original},")?;
        writeln!(f, "    words: vec!{words:?},")?;
        writeln!(f, "    copies: vec!{copies:?},")?;
        writeln!(f, "    aimed: vec!{aimed:?},")?;
        writeln!(f, "    bytes: vec!{bytes:?},")?;
        writeln!(f, "    rays: vec!{rays},")?;
        writeln!(f, "}}")
    }
}
