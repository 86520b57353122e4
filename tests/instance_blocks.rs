//! Blocks with instances: what is refused, how much memory they take, packing, and the surface at a hit.

#![allow(missing_docs)]

mod common;

use std::mem::MaybeUninit;

use common::bits;
use raykern::{
    Accel, BuildError, BuildOptions, GridKind, GridOptions, Hit, Instance, Kind, Layout, Mesh,
    NONE, OpenError, OwnedAccel, PlainList, Ray, Scene, Surface, build_bvh, build_grid, bvh_needs,
    grid_needs,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;

const ONE: [f32; 12] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.];

fn bvh_of(model: &Model) -> OwnedAccel<'static> {
    model.with_scene(|scene| OwnedAccel::bvh(scene, &BuildOptions::default()).expect("a BVH"))
}

fn model() -> Model {
    let mut model: Model = make::blob(300, 2).into();
    model.sphere_sets.push(vec![[0.8, 0.0, 0.0, 0.5], [-0.5, 0.9, 0.1, 0.4]]);
    model
}

fn random_maps(random: &mut Random, count: usize) -> Vec<[f32; 12]> {
    (0..count).map(|_| [0.0; 12].map(|_: f32| random.between(-1.5, 1.5) as f32)).collect()
}

fn rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let mut numbers = |size: f64| [0, 1, 2].map(|_| random.between(-size, size) as f32);
    (0..count)
        .map(|_| {
            let (from, to) = (numbers(4.0), numbers(1.5));
            Ray::new(from, [0, 1, 2].map(|k| to[k] - from[k]))
        })
        .collect()
}

/// Bytes at a multiple of 64.
struct Memory {
    bytes: Vec<MaybeUninit<u8>>,
    start: usize,
}

impl Memory {
    fn new(size: usize) -> Self {
        let bytes = vec![MaybeUninit::new(0x55); size + 64];
        let start = bytes.as_ptr().align_offset(64);
        Memory { bytes, start }
    }

    fn get(&mut self, size: usize) -> &mut [MaybeUninit<u8>] {
        &mut self.bytes[self.start..][..size]
    }
}

#[test]
fn maps_without_inverse_and_third_levels_are_refused() {
    let child = bvh_of(&model());
    let good = Instance::new(&child.accel(), ONE);
    let mut flat = ONE;
    flat[10] = 0.0;
    let mut infinite = ONE;
    infinite[3] = f32::INFINITY;
    let nested = [good];
    let nested =
        OwnedAccel::bvh(&Scene::new(&[], &[]).with_instances(&nested), &BuildOptions::default())
            .expect("a BVH");
    for (bad, expected) in [
        (Instance::new(&child.accel(), flat), BuildError::SingularInstance { instance: 1 }),
        (Instance::new(&child.accel(), infinite), BuildError::SingularInstance { instance: 1 }),
        (Instance::new(&nested.accel(), ONE), BuildError::NestedInstance { instance: 1 }),
    ] {
        let instances = [good, bad];
        let scene = Scene::new(&[], &[]).with_instances(&instances);
        let options = BuildOptions::default();
        assert_eq!(bvh_needs(&scene, &options).err(), Some(expected));
        assert_eq!(grid_needs(&scene, &options).err(), Some(expected));
        let mut memory = Memory::new(100_000);
        assert_eq!(build_bvh(&scene, &options, memory.get(100_000)).err(), Some(expected));
        assert_eq!(build_grid(&scene, &options, memory.get(100_000)).err(), Some(expected));
    }
}

/// Every structure over instances, in all the memory it wants and in the least.
#[test]
fn needs_is_enough_and_the_minimum_too() {
    let child = bvh_of(&model());
    let mut random = Random::new(1);
    let own = make::plane(60);
    let mesh = [Mesh::indexed(&own.vertices, &own.indices)];
    let rays = rays(&mut random, 200);
    for count in [1, 2, 17, 300] {
        let maps = random_maps(&mut random, count);
        let instances: Vec<_> = maps.iter().map(|m| Instance::new(&child.accel(), *m)).collect();
        let scene = Scene::new(&mesh, &[]).with_instances(&instances);
        let expected: Vec<_> = {
            let built = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
            rays.iter().map(|ray| bits(built.accel().intersect(ray))).collect()
        };
        let check = |is_grid: bool, options: BuildOptions, kind: Kind| {
            let needs = if is_grid { grid_needs } else { bvh_needs }(&scene, &options);
            let needs = needs.expect("a size");
            for size in [needs.size, needs.minimum] {
                let mut memory = Memory::new(size);
                let memory = memory.get(size);
                let build = if is_grid { build_grid } else { build_bvh };
                let accel = build(&scene, &options, memory).expect("enough");
                let info = accel.info();
                assert_eq!((info.kind, info.instance_count), (kind, count as u32), "{options:?}");
                // One box alone may as well be a compact tree.
                if kind == Kind::Bvh && size == needs.size && count > 1 {
                    assert_eq!(info.layout, options.layout, "{count}");
                }
                for (ray, expected) in rays.iter().zip(&expected) {
                    assert_eq!(bits(accel.intersect(ray)), *expected, "{options:?} {ray:?}");
                }
            }
            let mut memory = Memory::new(needs.minimum);
            let less = memory.get(needs.minimum - 64);
            let built = if is_grid { build_grid } else { build_bvh }(&scene, &options, less);
            let minimum = needs.minimum;
            assert_eq!(built.err(), Some(BuildError::OutOfMemory { minimum }));
        };
        let with = |layout| BuildOptions { layout, ..Default::default() };
        check(false, with(Layout::Compact), Kind::Bvh);
        check(false, with(Layout::Wide(4)), Kind::Bvh);
        check(false, with(Layout::Wide(8)), Kind::Bvh);
        check(false, with(Layout::Wide(16)), Kind::Bvh);
        let list = BuildOptions { plain_list: PlainList::Always, ..Default::default() };
        check(false, list, Kind::List);
        for kind in [GridKind::Nested, GridKind::Uniform, GridKind::Octree] {
            let grid = GridOptions { kind, ..GridOptions::default() };
            check(true, BuildOptions { grid, ..Default::default() }, Kind::Grid);
        }
    }
}

/// Balls around long boxes reach further than these.
#[test]
fn needs_is_enough_for_grids_over_poles() {
    let pole = [[[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.0, 30.0]]];
    let meshes = [Mesh::soup(&pole)];
    let child =
        OwnedAccel::bvh(&Scene::new(&meshes, &[]), &BuildOptions::default()).expect("a list");
    let child = child.accel();
    let at =
        |x: usize, y: usize| [1.0, 0.0, 0.0, x as f32, 0.0, 1.0, 0.0, y as f32, 0.0, 0.0, 1.0, 0.0];
    for side in [1, 2, 8, 30] {
        let instances: Vec<_> =
            (0..side * side).map(|i| Instance::new(&child, at(i % side, i / side))).collect();
        let scene = Scene::new(&[], &[]).with_instances(&instances);
        for kind in [GridKind::Uniform, GridKind::Nested, GridKind::Octree] {
            for density in [0.0, 1.0, 8.0, 64.0] {
                let grid = GridOptions { kind, density, ..Default::default() };
                let options =
                    BuildOptions { grid, plain_list: PlainList::Never, ..Default::default() };
                let needs = raykern::grid_needs(&scene, &options).expect("a size");
                for size in [needs.size, needs.minimum] {
                    let mut memory = Memory::new(size);
                    let built = raykern::build_grid(&scene, &options, memory.get(size));
                    let accel = built.unwrap_or_else(|e| panic!("{side} {kind:?} {density} {e}"));
                    let ray = Ray::new([0.001, 0.0, 50.0], [0.0, 0.0, -1.0]);
                    assert_eq!(accel.intersect(&ray), None);
                    let ray = Ray::new([0.004, -9.0, 10.0], [0.0, 1.0, 0.0]);
                    assert_eq!(accel.intersect(&ray).map(|hit| hit.instance), Some(0));
                }
            }
        }
    }
}

/// A packed block holds each child once, stands alone, can be copied and opened, and answers as before.
#[test]
fn packed_blocks_stand_alone() {
    // Which of two children comes first in memory is not the test's to say.
    pack_with([0, 1]);
    pack_with([1, 0]);
}

/// With these of two children for even and odd pairs of instances.
fn pack_with(order: [usize; 2]) {
    let mut random = Random::new(5);
    let rays = rays(&mut random, 300);
    let (maps, own) = (random_maps(&mut random, 9), make::plane(100));
    let mesh = [Mesh::indexed(&own.vertices, &own.indices)];
    let (packed, expected, size) = {
        let children = [bvh_of(&model()), bvh_of(&make::sphere(500).into())];
        let instances: Vec<_> = (maps.iter().enumerate())
            .map(|(i, map)| Instance::new(&children[order[i.div_ceil(2) % 2]].accel(), *map))
            .collect();
        let scene = Scene::new(&mesh, &[]).with_instances(&instances);
        let built = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
        let accel = built.accel();
        assert!(accel.is_linked());
        assert_eq!(Accel::open(accel.block()).err(), Some(OpenError::Linked));
        let needs = accel.pack_needs().expect("a size");
        let sizes: usize = children.iter().map(|child| child.accel().block().len()).sum();
        assert_eq!(needs.size, accel.block().len() + sizes);
        let mut memory = Memory::new(needs.size);
        let short = memory.get(needs.size - 1);
        let minimum = needs.size;
        assert_eq!(accel.pack(short).err(), Some(BuildError::OutOfMemory { minimum }));
        let packed = accel.pack(memory.get(needs.size)).expect("a block");
        assert!(!packed.is_linked());
        let hits: Vec<_> = rays.iter().map(|ray| accel.intersect(ray)).collect();
        assert!(hits.iter().flatten().any(|hit| hit.instance != NONE));
        let surfaces: Vec<_> = (rays.iter().zip(&hits))
            .map(|(ray, hit)| hit.and_then(|hit| accel.surface(ray, &hit)))
            .collect();
        (packed.block().to_vec(), (hits, surfaces), needs.size)
    };
    // The children are gone.
    let mut copy = vec![0; size + 64];
    let start = copy.as_ptr().align_offset(64);
    copy[start..start + size].copy_from_slice(&packed);
    let bytes = &copy[start..start + size];
    let opened = Accel::open(bytes).expect("a sound block");
    for ((ray, hit), surface) in rays.iter().zip(&expected.0).zip(&expected.1) {
        assert_eq!(bits(opened.intersect(ray)), bits(*hit), "{ray:?}");
        assert_eq!(hit.and_then(|hit| opened.surface(ray, &hit)), *surface, "{ray:?}");
    }
    // Packed once more it is the same, and what is cut off or continued is refused.
    let mut again = Memory::new(size);
    assert_eq!(opened.pack(again.get(size)).expect("a block").block(), packed);
    assert_eq!(Accel::open(&bytes[..size - 64]).err(), Some(OpenError::Truncated));
}

/// The normal is that of the mapped surface, on the side that the object's normal is on; origins are on their sides, in the
/// world and in object space.
#[test]
fn surfaces_of_instances_are_in_the_world() {
    let model = model();
    let child = bvh_of(&model);
    let mut random = Random::new(9);
    let maps = random_maps(&mut random, 12);
    let instances: Vec<_> = maps.iter().map(|map| Instance::new(&child.accel(), *map)).collect();
    let scene = Scene::new(&[], &[]).with_instances(&instances);
    let built = OwnedAccel::bvh(&scene, &BuildOptions::default()).expect("a BVH");
    let accel = built.accel();
    let mut kinds = [0, 0];
    for ray in rays(&mut random, 2_000) {
        let Some(hit) = accel.intersect(&ray) else { continue };
        let surface = accel.surface(&ray, &hit).expect("the hit");
        let map = Affine(maps[hit.instance as usize].map(f64::from));
        kinds[usize::from(hit.geometry == 1)] += 1;
        check_surface(&model, &hit, &surface, &map);
        // A ray from an origin to its own side does not meet the triangle that it left.
        for (origin, sign) in [(surface.front_origin, 1.0), (surface.back_origin, -1.0)] {
            let away = Ray::new(origin, surface.normal.map(|x| x * sign));
            let again = accel.intersect(&away);
            let same = |other: &Hit| {
                (other.instance, other.prim, other.geometry)
                    == (hit.instance, hit.prim, hit.geometry)
            };
            assert!(hit.geometry == 1 || !again.is_some_and(|hit| same(&hit)), "{ray:?} {away:?}");
        }
    }
    assert!(kinds[0] > 200 && kinds[1] > 100, "{kinds:?}");
    let miss = Hit { instance: 99, ..Hit::MISS };
    assert_eq!(accel.surface(&Ray::new([0.0; 3], [1.0; 3]), &miss), None);
}

type Vector = [f64; 3];

struct Affine([f64; 12]);

impl Affine {
    fn vector(&self, v: Vector) -> Vector {
        [0, 4, 8].map(|i| (0..3).map(|k| self.0[i + k] * v[k]).sum())
    }

    fn point(&self, p: Vector) -> Vector {
        let v = self.vector(p);
        [0, 1, 2].map(|k| v[k] + self.0[4 * k + 3])
    }

    fn determinant(&self) -> f64 {
        let [a, b, c] = [0, 1, 2].map(|k| [self.0[k], self.0[4 + k], self.0[8 + k]]);
        dot(a, cross(b, c))
    }

    /// `A^-1 v`, by Cramer's rule.
    fn back(&self, v: Vector) -> Vector {
        let [a, b, c] = [0, 1, 2].map(|k| [self.0[k], self.0[4 + k], self.0[8 + k]]);
        [(b, c), (c, a), (a, b)].map(|(p, q)| dot(v, cross(p, q)) / self.determinant())
    }
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn cross(p: Vector, q: Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| p[i] * q[j] - p[j] * q[i])
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn check_surface(model: &Model, hit: &Hit, surface: &Surface, map: &Affine) {
    let position = surface.position.map(f64::from);
    let (point, normal) = if hit.geometry == 0 {
        let mesh = &model.meshes[0];
        let corners = mesh.indices[hit.prim as usize].map(|v| mesh.vertices[v as usize]);
        let [a, b, c] = corners.map(|v| map.point(v.map(f64::from)));
        let n = cross(minus(b, a), minus(c, a));
        (a, n.map(|x| x * map.determinant().signum()))
    } else {
        let [x, y, z, r] = model.sphere_sets[0][hit.prim as usize].map(f64::from);
        let shift = [map.0[3], map.0[7], map.0[11]];
        let from_centre = minus(map.back(minus(position, shift)), [x, y, z]);
        let length = dot(from_centre, from_centre).sqrt();
        let at = from_centre.map(|v| v * r / length);
        // The gradient: across all images of what is across the radius.
        let across = cross(at, if at[0].abs() < 0.5 * r { [1., 0., 0.] } else { [0., 1., 0.] });
        let n = cross(map.vector(across), map.vector(cross(at, across)));
        let sign = dot(n, map.vector(at)).signum();
        (map.point([at[0] + x, at[1] + y, at[2] + z]), n.map(|v| v * sign))
    };
    let length = dot(normal, normal).sqrt();
    let normal = normal.map(|x| x / length);
    let turned = dot(normal, surface.normal.map(f64::from));
    assert!((turned - 1.0).abs() < 1e-5, "{hit:?} {surface:?} {normal:?}");
    let height = |p: [f32; 3]| dot(minus(p.map(f64::from), point), normal);
    let reach = normal.iter().map(|x| x.abs()).sum::<f64>() * f64::from(surface.position_error);
    assert!(height(surface.position).abs() <= reach, "{hit:?} {surface:?}");
    if hit.geometry == 0 {
        assert!(height(surface.front_origin) > 0.0 && height(surface.back_origin) < 0.0);
    }
    assert!(height(surface.front_origin) <= 4.0 * reach, "{hit:?} {surface:?}");
}
