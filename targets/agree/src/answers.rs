//! All that can be asked, of every structure.

use core::mem::MaybeUninit;

use super::rays;
use super::scenes::{Made, SHAPES};
use raykern::{
    Accel, AccelMut, BuildError, BuildOptions, GridKind, GridOptions, Hit, Instance, Layout, NONE,
    PlainList, Precision, QueryOptions, Ray, Scene,
};

/// What the caller lends: the scene, and memory for two blocks.
#[repr(C, align(64))]
pub struct Room {
    made: Made,
    blocks: [Block; 2],
}

/// Blocks begin at multiples of 64 bytes.
#[repr(align(64))]
struct Block([MaybeUninit<u8>; BLOCK]);

const BLOCK: usize = 1 << 20;

impl Room {
    /// The number, from `count` rays a scene; 1 if a build failed, 2 or more if structures answer differently. The room is
    /// zeros before.
    pub fn agree(&mut self, count: u32) -> u32 {
        match answers(self, count) {
            Ok(hash) => hash,
            Err(Wrong::Build) => 1,
            Err(Wrong::Answer(structure)) => 2 + structure,
        }
    }
}

enum Wrong {
    Build,
    /// This structure answers differently than a list.
    Answer(u32),
}

impl From<BuildError> for Wrong {
    fn from(_: BuildError) -> Wrong {
        Wrong::Build
    }
}

/// All ways to build a scene; the first is the measure of the others.
const STRUCTURES: u32 = 9;

fn options(structure: u32) -> (bool, BuildOptions<'static>) {
    let plain_list = if structure == 0 { PlainList::Always } else { PlainList::Never };
    let layout = match structure {
        2 => Layout::Wide(4),
        3 => Layout::Wide(8),
        4 => Layout::Wide(16),
        _ => Layout::Compact,
    };
    let kind = match structure {
        5 => GridKind::Uniform,
        6 => GridKind::Octree,
        _ => GridKind::Nested,
    };
    let grid = GridOptions { kind, ..GridOptions::default() };
    let refit = structure == 8;
    (
        (5..8).contains(&structure),
        BuildOptions { plain_list, layout, grid, refit, ..BuildOptions::default() },
    )
}

fn build<'m>(
    scene: &Scene<'_, 'm>,
    structure: u32,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    let (grid, options) = options(structure);
    match grid {
        true => raykern::build_grid(scene, &options, memory),
        false => raykern::build_bvh(scene, &options, memory),
    }
}

fn answers(room: &mut Room, count: u32) -> Result<u32, Wrong> {
    let Room { made, blocks: [Block(child), Block(block)] } = room;
    let mut all = Hash::default();
    for shape in 0..SHAPES {
        made.fill(shape);
        let mut first = None;
        for structure in 0..STRUCTURES {
            let hash = made.with_scene(|scene| -> Result<_, BuildError> {
                let child = build(scene, structure, child)?;
                let mut hash = Hash::default();
                trace(&child, shape, count, &mut hash);
                let instances = [TURNED, MIRRORED].map(|map| Instance::new(&child, map));
                let whole =
                    build(&Scene::new(&[], &[]).with_instances(&instances), structure, block)?;
                trace(&whole, shape, count / 4, &mut hash);
                Ok(hash)
            })?;
            if *first.get_or_insert(hash.0) != hash.0 {
                return Err(Wrong::Answer(structure));
            }
        }
        all.add(first.unwrap_or(0));
        all.add(refitted(made, shape, count, block)?);
    }
    Ok(all.0.max(2 + STRUCTURES))
}

/// The answers after everything has moved.
fn refitted(
    made: &mut Made,
    shape: u32,
    count: u32,
    memory: &mut [MaybeUninit<u8>],
) -> Result<u32, BuildError> {
    let options = BuildOptions { refit: true, ..BuildOptions::default() };
    let mut built = made.with_scene(|scene| AccelMut::bvh(scene, &options, memory))?;
    made.shift();
    // Refused only if the scene were another.
    let growth = made.with_scene(|scene| built.refit(scene, None)).unwrap_or(0.0);
    let mut hash = Hash::default();
    hash.add(growth.to_bits());
    trace(&built.accel(), shape, count, &mut hash);
    Ok(hash.0)
}

const TURNED: [f32; 12] = [0.6, -0.8, 0.0, 1.0, 0.8, 0.6, 0.0, -2.0, 0.0, 0.0, 1.0, 0.5];
const MIRRORED: [f32; 12] = [-1.5, 0.0, 0.25, -3.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.125, 2.0, 0.0];

/// Adds all that can be asked of `accel`.
fn trace(accel: &Accel, shape: u32, count: u32, hash: &mut Hash) {
    for i in 0..count {
        let ray = rays::ray(shape, i);
        let hit = accel.intersect(&ray);
        hash.add_hit(&hit.unwrap_or(Hit::MISS));
        hash.add(u32::from(accel.occluded(&ray) == hit.is_some()));
        // What watertight queries find beyond that is another matter in each structure.
        let loosely = QueryOptions { precision: Precision::Watertight, ..QueryOptions::default() };
        hash.add(u32::from(hit.is_none() || accel.occluded_with(&ray, &loosely)));
        if i.is_multiple_of(8) {
            rarely(accel, &ray, hit, hash);
        }
    }
}

/// The same for what is asked more rarely.
fn rarely(accel: &Accel, ray: &Ray, hit: Option<Hit>, hash: &mut Hash) {
    for hit in accel.hits(ray, &QueryOptions::default()).take(6) {
        hash.add_hit(&hit);
    }
    if let Some(surface) = hit.and_then(|hit| accel.surface(ray, &hit)) {
        hash.add_point(surface.position);
        hash.add_point(surface.normal);
        hash.add_point(surface.front_origin);
    }
    if let Some(near) = accel.closest_point(ray.origin, 10.0, &QueryOptions::default()) {
        hash.add_point(near.point);
        hash.add_point([near.distance, near.u, near.v]);
        hash.add(near.prim);
    }
    let mut hits = [Hit::MISS; 2];
    accel.intersect_batch(&[*ray, rays::turned(ray)], &mut hits);
    hits.iter().for_each(|hit| hash.add_hit(hit));
}

/// FNV-1a.
struct Hash(u32);

impl Default for Hash {
    fn default() -> Self {
        Hash(0x811C_9DC5)
    }
}

impl Hash {
    fn add(&mut self, word: u32) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }

    fn add_point(&mut self, point: [f32; 3]) {
        point.iter().for_each(|x| self.add(x.to_bits()));
    }

    fn add_hit(&mut self, hit: &Hit) {
        self.add_point([hit.t, hit.u, hit.v]);
        self.add(if hit.prim == NONE { 0 } else { hit.prim + 1 });
        self.add(hit.geometry);
        self.add(hit.instance);
    }
}
