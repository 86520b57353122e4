//! The caller's memory: enough is enough, less is refused, and a block is its bytes.

#![allow(missing_docs)]

mod common;

use common::{bits, odd_models};
use raykern::{
    Accel, BuildError, BuildOptions, GridKind, GridOptions, Kind, Layout, Memory, Mesh, OpenError,
    PlainList, Quality, Ray, Scene, SphereSet,
};
use raykern_harness::make::{self, Random};
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};
use std::mem::MaybeUninit;

type Needs = fn(&Scene, &BuildOptions) -> Result<Memory, BuildError>;
type Build = for<'m> fn(
    &Scene<'_, 'm>,
    &BuildOptions,
    &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError>;

/// A structure to build, forced.
#[derive(Clone, Copy)]
struct Structure {
    name: &'static str,
    needs: Needs,
    build: Build,
    layout: Layout,
    grid: GridKind,
}

const STRUCTURES: [Structure; 7] = [
    grid("nested grid", GridKind::Nested),
    grid("uniform grid", GridKind::Uniform),
    grid("octree", GridKind::Octree),
    bvh("compact", Layout::Compact),
    bvh("wide 4", Layout::Wide(4)),
    bvh("wide 8", Layout::Wide(8)),
    bvh("wide 16", Layout::Wide(16)),
];

const fn grid(name: &'static str, grid: GridKind) -> Structure {
    let (needs, build) = (raykern::grid_needs as Needs, raykern::build_grid as Build);
    Structure { name, needs, build, layout: Layout::Automatic, grid }
}

const fn bvh(name: &'static str, layout: Layout) -> Structure {
    let (needs, build) = (raykern::bvh_needs as Needs, raykern::build_bvh as Build);
    Structure { name, needs, build, layout, grid: GridKind::Nested }
}

impl Structure {
    fn options(&self) -> BuildOptions<'static> {
        let (layout, plain_list) = (self.layout, PlainList::Never);
        let grid = GridOptions { kind: self.grid, ..GridOptions::default() };
        BuildOptions { layout, plain_list, grid, ..BuildOptions::default() }
    }

    fn needs(&self, scene: &Scene) -> Memory {
        (self.needs)(scene, &self.options()).expect("a size")
    }

    fn build<'m>(
        &self,
        scene: &Scene<'_, 'm>,
        memory: &'m mut [MaybeUninit<u8>],
    ) -> Result<Accel<'m>, BuildError> {
        (self.build)(scene, &self.options(), memory)
    }

    fn block(&self, model: &Model) -> Vec<u8> {
        model.with_scene(|scene| {
            let size = self.needs(scene).size;
            with_memory(size, 0, |m| self.build(scene, m).expect("enough").block().to_vec())
        })
    }
}

/// `size` bytes from a multiple of 64 plus `shift`, filled with a pattern.
fn with_memory<R>(size: usize, shift: usize, f: impl FnOnce(&mut [MaybeUninit<u8>]) -> R) -> R {
    let mut memory = vec![MaybeUninit::new(0xa5u8); size + shift + 64];
    let start = memory.as_ptr().align_offset(64) + shift;
    f(&mut memory[start..start + size])
}

fn with_copy<R>(bytes: &[u8], f: impl FnOnce(&mut [u8]) -> R) -> R {
    let mut memory = vec![0u8; bytes.len() + 64];
    let start = memory.as_ptr().align_offset(64);
    let place = &mut memory[start..start + bytes.len()];
    place.copy_from_slice(bytes);
    f(place)
}

fn models() -> Vec<(&'static str, Model)> {
    let made = make::ALL.map(|(name, make)| (name, make(500)));
    odd_models().into_iter().chain(made).collect()
}

#[test]
fn what_is_needed_is_enough_and_less_than_the_minimum_is_refused() {
    for (name, model) in models() {
        for structure in STRUCTURES {
            let Structure { name: kind, .. } = structure;
            model.with_scene(|scene| {
                let Memory { size, minimum, alignment } = structure.needs(scene);
                assert!(minimum <= size && alignment == 64, "{name} {kind}");
                for enough in [size, minimum] {
                    let built = with_memory(enough, 0, |m| structure.build(scene, m).map(|_| ()));
                    assert_eq!(built, Ok(()), "{name} {kind} {enough}");
                }
                let untouched = |m: &[MaybeUninit<u8>]| {
                    // SAFETY: `with_memory` has written every byte.
                    #[allow(unsafe_code, reason = "looks at bytes that are initialised")]
                    m.iter().all(|b| unsafe { b.assume_init() } == 0xa5)
                };
                with_memory(minimum - 1, 0, |m| {
                    let built = structure.build(scene, m).map(|_| ());
                    assert_eq!(built, Err(BuildError::OutOfMemory { minimum }), "{name}");
                    assert!(untouched(m), "{name} {kind}");
                });
                with_memory(size, 4, |m| {
                    let built = structure.build(scene, m).map(|_| ());
                    assert_eq!(built, Err(BuildError::Misaligned), "{name}");
                    assert!(untouched(m), "{name} {kind}");
                });
            });
        }
    }
}

#[test]
fn with_less_memory_wide_leaves_fill_up_and_then_the_layout_is_compact() {
    let (mut fuller, mut compact) = (0, 0);
    for (name, model) in models() {
        let rays = RayMaker::new(&model, 1).many(Family::Random, 50);
        for structure in STRUCTURES {
            let Layout::Wide(_) = structure.layout else { continue };
            let full = structure.block(&model);
            model.with_scene(|scene| {
                let Memory { size, minimum, .. } = structure.needs(scene);
                with_copy(&full, |full| {
                    let full = Accel::open(full).expect("sound");
                    for step in 0..=60 {
                        // Odd sizes too: the memory need not end on a line.
                        let between = minimum + (size - minimum) * step / 60;
                        with_memory(between, 0, |m| {
                            let built = structure.build(scene, m).expect("enough");
                            match built.info().layout {
                                Layout::Compact => compact += 1,
                                _ => fuller += usize::from(built.block() != full.block()),
                            }
                            assert!(with_copy(built.block(), |m| Accel::open(m).is_ok()), "{name}");
                            for ray in &rays {
                                let (a, b) = (built.intersect(ray), full.intersect(ray));
                                assert_eq!(bits(a), bits(b), "{name} {} {between}", structure.name);
                            }
                        });
                    }
                });
            });
        }
    }
    assert!(fuller > 4 && compact > 20, "{fuller} fuller, {compact} compact");
}

#[test]
fn with_less_memory_grids_are_coarser_and_answer_the_same() {
    let (mut coarser, mut whole) = (0, 0);
    for (name, model) in models() {
        let rays = RayMaker::new(&model, 1).many(Family::Random, 50);
        for structure in STRUCTURES.into_iter().filter(|s| s.layout == Layout::Automatic) {
            let full = structure.block(&model);
            model.with_scene(|scene| {
                let Memory { size, minimum, .. } = structure.needs(scene);
                with_copy(&full, |full| {
                    let full = Accel::open(full).expect("sound");
                    for step in 0..=20 {
                        let between = minimum + (size - minimum) * step / 20;
                        with_memory(between, 0, |m| {
                            let built = structure.build(scene, m).expect("enough");
                            let same = built.block() == full.block();
                            (coarser, whole) =
                                (coarser + usize::from(!same), whole + usize::from(same));
                            assert!(with_copy(built.block(), |m| Accel::open(m).is_ok()), "{name}");
                            for ray in &rays {
                                let (a, b) = (built.intersect(ray), full.intersect(ray));
                                assert_eq!(bits(a), bits(b), "{name} {} {between}", structure.name);
                            }
                        });
                    }
                });
            });
        }
    }
    assert!(coarser > 100 && whole > 100, "{coarser} coarser, {whole} whole");
}

#[test]
fn nested_grids_take_what_is_promised() {
    const COUNT: usize = 20_000;
    for (name, make) in make::ALL {
        let model = make(COUNT);
        let structure = STRUCTURES[0];
        model.with_scene(|scene| {
            let Memory { size, .. } = structure.needs(scene);
            let prims = model.triangle_count() + model.sphere_count();
            with_memory(size, 0, |m| {
                let info = structure.build(scene, m).expect("enough").info();
                assert_eq!(info.kind, Kind::Grid, "{name}");
                assert!(info.resolution.iter().product::<u32>() > 1, "{name}: one cell");
                assert!(size <= 122 * prims, "{name}: {} bytes", size / prims);
                // An even scene is listed seldom, and leaves much of it free.
                assert!(2 * size <= 7 * info.size, "{name}: {size} for {}", info.size);
            });
        });
    }
}

#[test]
fn wide_layouts_take_what_is_promised() {
    const COUNT: usize = 20_000;
    for (name, make) in make::ALL {
        let model = make(COUNT);
        for structure in STRUCTURES {
            let Layout::Wide(_) = structure.layout else { continue };
            model.with_scene(|scene| {
                let Memory { size, .. } = structure.needs(scene);
                let prims = model.triangle_count() + model.sphere_count();
                with_memory(size, 0, |m| {
                    let info = structure.build(scene, m).expect("enough").info();
                    let kind = structure.name;
                    assert_eq!(info.layout, structure.layout, "{name}");
                    assert!(size <= 100 * prims, "{name} {kind}: {} bytes", size / prims);
                    assert!(size <= 3 * info.size, "{name} {kind}: {size} for {}", info.size);
                });
            });
        }
    }
}

/// A few large triangles among small ones: what is cut in two takes more leaves.
#[test]
fn wide_layouts_are_what_was_asked_for_if_refs_are_cut() {
    for (count, large) in [(60, 10), (500, 3), (500, 60), (2000, 30), (20_000, 3), (20_000, 300)] {
        let mut random = Random::new(count as u64);
        let soup: Vec<_> = (0..count)
            .map(|i| (if i < large { [0.5; 3] } else { random.point(0.0, 1.0) }, i < large))
            .collect();
        let soup: Vec<[[f32; 3]; 3]> = soup
            .into_iter()
            .map(|(at, is_large)| {
                let size = if is_large { 0.5 } else { 0.01 };
                [0; 3].map(|_| {
                    let away = random.point(-1.0, 1.0);
                    [0, 1, 2].map(|k| (at[k] + size * away[k]) as f32)
                })
            })
            .collect();
        let meshes = [Mesh::soup(&soup)];
        let scene = Scene::new(&meshes, &[]);
        for layout in [4, 8, 16].map(Layout::Wide) {
            for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
                let options = BuildOptions { quality, layout, ..BuildOptions::default() };
                let size = raykern::bvh_needs(&scene, &options).expect("a size").size;
                let info = with_memory(size, 0, |m| {
                    raykern::build_bvh(&scene, &options, m).expect("enough").info()
                });
                assert_eq!(info.layout, layout, "{count} {large} {quality:?}");
            }
        }
    }
}

/// Loose triangles whose halves, and halves of these, are so many that leaves come out with three or less.
#[test]
fn wide_layouts_are_what_was_asked_for_over_lattices() {
    let corner = |x: f32, y: f32, z: f32| [[x, y, z], [x + 0.1, y, z], [x, y + 0.1, z + 0.1]];
    for count in [6, 7, 12, 24, 96, 500, 2000, 6000] {
        let cube = (f64::from(count).cbrt().ceil() as u32).max(1);
        let square = (f64::from(count).sqrt().ceil() as u32).max(1);
        let place = |i: u32, n: u32| [i % n, i / n % n, i / n / n].map(|x| 2.0 * x as f32);
        let of = |n: u32| -> Vec<_> {
            (0..count).map(|i| place(i, n)).map(|[x, y, z]| corner(x, y, z)).collect()
        };
        let line: Vec<_> =
            (0..count).map(|i| corner(1.5f32.powi(i as i32 % 90), 0.0, 0.0)).collect();
        // A sheet of which each triangle has vertices of its own, which are told apart where it moves.
        let sheet: Vec<_> = (0..count)
            .map(|i| (i % 2, place(i / 2, square)))
            .map(|(odd, [x, y, _])| match odd {
                0 => [[x, y, 0.0], [x + 2.0, y, 0.0], [x + 2.0, y + 2.0, 0.0]],
                _ => [[x, y, 0.0], [x + 2.0, y + 2.0, 0.0], [x, y + 2.0, 0.0]],
            })
            .collect();
        let balls: Vec<_> =
            (0..count / 3).map(|i| place(i, cube)).map(|[x, y, z]| [x, y, z, 0.2]).collect();
        for (name, triangles) in
            [("cube", of(cube)), ("square", of(square)), ("line", line), ("sheet", sheet)]
        {
            let meshes = [Mesh::soup(&triangles)];
            let balls = [SphereSet::new(&balls)];
            for (sets, quality, refit, width) in
                (0..36).map(|i| (i % 2, i / 2 % 3, i / 6 % 2, i / 12))
            {
                let scene = Scene::new(&meshes, &balls[..sets]);
                let quality = [Quality::Fast, Quality::Balanced, Quality::Best][quality];
                let layout = Layout::Wide([4, 8, 16][width]);
                let plain_list = PlainList::Never;
                let options = BuildOptions {
                    quality,
                    refit: refit == 1,
                    layout,
                    plain_list,
                    ..Default::default()
                };
                let Memory { size, minimum, .. } =
                    raykern::bvh_needs(&scene, &options).expect("a size");
                // Of many, only the ones that were promised something.
                for part in if count > 1000 { 4..=4 } else { 0..=4 } {
                    let given =
                        if part == 4 { size } else { minimum + (size - minimum) / 4 * part };
                    let info = with_memory(given, 0, |m| {
                        let accel = raykern::build_bvh(&scene, &options, m).expect("enough");
                        assert!(Accel::open(accel.block()).is_ok());
                        let [x, y, z] = triangles[count as usize / 2][0];
                        let ray = Ray::new([x + 0.03, y + 0.02, z - 1.0], [0.0, 0.0, 1.0]);
                        // Some are too far out for so small a step.
                        let is_met = name == "line" || accel.intersect(&ray).is_some();
                        assert!(is_met, "{name} {count}");
                        accel.info()
                    });
                    let is_asked_for = part < 4 || info.layout == layout;
                    assert!(is_asked_for, "{name} {count} {sets} {quality:?} {refit} {layout:?}");
                }
            }
        }
    }
}

#[test]
fn layouts_are_four_and_a_block_knows_its_own() {
    let model: Model = make::sphere(500).into();
    model.with_scene(|scene| {
        for width in [0, 1, 2, 3, 5, 7, 9, 15, 17, 32, u32::MAX] {
            let options = BuildOptions { layout: Layout::Wide(width), ..BuildOptions::default() };
            let refused = Some(BuildError::NoSuchLayout { width });
            assert_eq!(raykern::bvh_needs(scene, &options).err(), refused);
            assert_eq!(raykern::grid_needs(scene, &options).err(), refused);
        }
        let layout_of = |options: &BuildOptions| {
            let size = raykern::bvh_needs(scene, options).expect("a size").size;
            with_memory(size, 0, |m| {
                raykern::build_bvh(scene, options, m).expect("enough").info().layout
            })
        };
        let default = BuildOptions::default();
        assert_eq!(layout_of(&default), Layout::Wide(16));
        for layout in [Layout::Compact, Layout::Wide(4), Layout::Wide(8), Layout::Wide(16)] {
            assert_eq!(layout_of(&BuildOptions { layout, ..default }), layout);
        }
        let list = BuildOptions { plain_list: PlainList::Always, ..default };
        assert_eq!(layout_of(&list), Layout::Compact);
    });
}

#[test]
fn equal_builds_give_equal_bytes_and_a_copy_gives_equal_answers() {
    for (name, model) in models() {
        for structure in STRUCTURES {
            let first = structure.block(&model);
            assert_eq!(first, structure.block(&model), "{name} {}", structure.name);
            with_copy(&first, |a| {
                with_copy(&first, |b| {
                    let (a, b) = (Accel::open(a).expect("sound"), Accel::open(b).expect("sound"));
                    for ray in RayMaker::new(&model, 1).many(Family::Random, 200) {
                        assert_eq!(bits(a.intersect(&ray)), bits(b.intersect(&ray)), "{name}");
                    }
                });
            });
        }
    }
}

#[test]
fn broken_blocks_are_refused_or_harmless() {
    let mut random = Random::new(9);
    for structure in STRUCTURES {
        let (mut refused, mut opened) = (0, 0);
        for (name, model) in models() {
            let rays = RayMaker::new(&model, 1).many(Family::Random, 20);
            let good = structure.block(&model);
            for cut in [0, 1, 63, 64, good.len() / 2, good.len() - 1] {
                with_copy(&good[..cut.min(good.len() - 1)], |m| {
                    assert!(Accel::open(m).is_err(), "{name} cut to {cut}");
                });
            }
            with_copy(&[&good[..], &[0; 64]].concat(), |m| {
                assert_eq!(Accel::open(&m[1..]).err(), Some(OpenError::Misaligned), "{name}");
            });
            for _ in 0..200 {
                with_copy(&good, |m| {
                    // Half the changes go to the first bytes, where the sizes stand.
                    let reach = if random.below(2) == 0 { m.len().min(256) } else { m.len() };
                    for _ in 0..=random.below(3) {
                        let at = random.below(reach);
                        match random.below(3) {
                            0 => m[at] ^= 1 << random.below(8),
                            1 => m[at] = 0xff,
                            _ => m[at] = random.bits() as u8,
                        }
                    }
                    match Accel::open(m) {
                        Err(_) => refused += 1,
                        Ok(accel) => {
                            opened += 1;
                            for ray in &rays {
                                let hit = accel.intersect(ray);
                                accel.occluded(ray);
                                hit.map(|hit| accel.surface(ray, &hit));
                            }
                        }
                    }
                });
            }
        }
        let name = structure.name;
        assert!(refused > 500 && opened > 500, "{name}: {refused} refused, {opened} opened");
    }
}
