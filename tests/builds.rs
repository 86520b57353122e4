//! Builds with every quality, on any number of threads, watched and cancelled.

#![allow(missing_docs)]

mod common;

use std::cell::RefCell;
use std::sync::atomic::{AtomicU32, Ordering};

use common::{bits, odd_models};
use raykern::{
    Accel, BuildError, BuildOptions, GridKind, GridOptions, Kind, Layout, OwnedAccel, PlainList,
    Quality, Scene, Threads,
};
use raykern_harness::make;
use raykern_harness::model::Model;
use raykern_harness::rays::{Family, RayMaker};

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::Best];
const LAYOUTS: [Layout; 2] = [Layout::Compact, Layout::Wide(16)];

/// This many threads, each taking the next task, the last one first.
struct Crew {
    workers: usize,
    tasks: AtomicU32,
}

impl Crew {
    fn of(workers: usize) -> Crew {
        Crew { workers, tasks: AtomicU32::new(0) }
    }
}

impl Threads for Crew {
    fn worker_count(&self) -> usize {
        self.workers
    }

    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        self.tasks.fetch_add(count, Ordering::Relaxed);
        let next = AtomicU32::new(0);
        std::thread::scope(|scope| {
            for _ in 0..self.workers {
                scope.spawn(|| {
                    while let Some(i) = count.checked_sub(next.fetch_add(1, Ordering::Relaxed) + 1)
                    {
                        task(i);
                    }
                });
            }
        });
    }
}

fn block(model: &Model, options: &BuildOptions) -> Vec<u8> {
    block_of(OwnedAccel::bvh, model, options)
}

fn block_of(build: Build, model: &Model, options: &BuildOptions) -> Vec<u8> {
    let built = model.with_scene(|scene| build(scene, options)).expect("a structure");
    built.accel().block().to_vec()
}

/// Large enough to have branches, and some that are odd.
fn models() -> Vec<(&'static str, Model)> {
    let made = make::ALL.map(|(name, make)| (name, make(20_000)));
    odd_models().into_iter().chain(made).collect()
}

fn options(quality: Quality, layout: Layout) -> BuildOptions<'static> {
    BuildOptions { quality, layout, plain_list: PlainList::Never, ..BuildOptions::default() }
}

#[test]
fn the_number_of_threads_changes_no_byte() {
    let mut most_tasks = 0;
    for (name, model) in models() {
        for (quality, layout) in QUALITIES.iter().flat_map(|q| LAYOUTS.map(|l| (*q, l))) {
            let alone = block(&model, &options(quality, layout));
            for workers in [1, 2, 3, 16] {
                let crew = Crew::of(workers);
                let options = BuildOptions { threads: Some(&crew), ..options(quality, layout) };
                assert!(
                    alone == block(&model, &options),
                    "{name} {quality:?} {layout:?} {workers}"
                );
                let tasks = crew.tasks.into_inner();
                assert!(workers > 1 || tasks == 0, "one thread lends nothing");
                most_tasks = most_tasks.max(tasks);
            }
        }
    }
    assert!(most_tasks > 8, "{most_tasks} tasks: nothing ran at the same time");
}

const GRIDS: [GridKind; 3] = [GridKind::Uniform, GridKind::Nested, GridKind::Octree];

fn grid_options(kind: GridKind) -> BuildOptions<'static> {
    let grid = GridOptions { kind, ..GridOptions::default() };
    BuildOptions { grid, plain_list: PlainList::Never, ..BuildOptions::default() }
}

#[test]
fn the_number_of_threads_changes_no_byte_of_a_grid() {
    for kind in GRIDS {
        let mut most_tasks = 0;
        for (name, model) in models() {
            let alone = block_of(OwnedAccel::grid, &model, &grid_options(kind));
            for workers in [1, 2, 3, 8] {
                let crew = Crew::of(workers);
                let options = BuildOptions { threads: Some(&crew), ..grid_options(kind) };
                let together = block_of(OwnedAccel::grid, &model, &options);
                assert!(alone == together, "{name} {kind:?} {workers}");
                let tasks = crew.tasks.into_inner();
                assert!(workers > 1 || tasks == 0, "one thread lends nothing");
                most_tasks = most_tasks.max(tasks);
            }
        }
        assert!(most_tasks > 8, "{kind:?}: {most_tasks} tasks: nothing ran at the same time");
    }
}

/// Where memory is short a build by one thread divides what it comes to first, and leaves the rest whole.
#[test]
fn nor_of_one_in_little_memory() {
    let crew = Crew::of(3);
    let mut blocks = std::collections::BTreeSet::new();
    for name in ["architecture", "hair", "blob"] {
        let (_, make) = make::ALL.into_iter().find(|(known, _)| *known == name).expect(name);
        let model = make(20_000);
        for (kind, step) in GRIDS.into_iter().flat_map(|kind| (0..8).map(move |step| (kind, step)))
        {
            let alone = in_part_of_memory(&model, &grid_options(kind), step);
            let options = BuildOptions { threads: Some(&crew), ..grid_options(kind) };
            let together = in_part_of_memory(&model, &options, step);
            assert!(alone == together, "{name} {kind:?} {step}");
            blocks.insert(alone);
        }
    }
    assert!(blocks.len() > 40, "only {} blocks differ", blocks.len());
}

/// The block of a grid that is given the minimum of memory and some eighths of what it would like more.
fn in_part_of_memory(model: &Model, options: &BuildOptions, eighths: usize) -> Vec<u8> {
    model.with_scene(|scene| {
        let needs = raykern::grid_needs(scene, options).expect("a size");
        let size = needs.minimum + (needs.size - needs.minimum) * eighths / 8;
        let mut memory = vec![std::mem::MaybeUninit::new(0xa5u8); size + 64];
        let start = memory.as_ptr().align_offset(64);
        let built = raykern::build_grid(scene, options, &mut memory[start..start + size]);
        built.expect("enough").block().to_vec()
    })
}

#[test]
#[cfg(feature = "parallel")]
fn rayon_lends_its_threads() {
    let model: Model = make::blob(50_000, 1).into();
    for (quality, refit) in QUALITIES.into_iter().flat_map(|q| [(q, false), (q, true)]) {
        let alone = BuildOptions { refit, ..options(quality, Layout::Automatic) };
        let many = BuildOptions { threads: Some(&raykern::Rayon), ..alone };
        let expected = block(&model, &alone);
        assert!(expected == block(&model, &many), "{quality:?}");
        for count in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("threads");
            // The threads are those of the pool that the build runs in.
            pool.install(|| {
                // A build does itself what is left undone, so its bytes do not show who worked.
                let done = [const { AtomicU32::new(0) }; 100];
                raykern::Rayon.parallel_for(100, &|i| {
                    assert!(rayon::current_thread_index().is_some_and(|thread| thread < count));
                    done[i as usize].fetch_add(1, Ordering::Relaxed);
                });
                assert!(done.iter().all(|times| times.load(Ordering::Relaxed) == 1));
                assert_eq!(raykern::Rayon.worker_count(), count);
                let many = BuildOptions {
                    refit,
                    threads: Some(&raykern::Rayon),
                    ..options(quality, Layout::Automatic)
                };
                assert!(expected == block(&model, &many), "{quality:?} {count}");
            });
        }
    }
}

#[test]
fn qualities_differ_in_bytes_and_not_in_answers() {
    let mut different = 0;
    for (name, model) in models() {
        let rays = RayMaker::new(&model, 3).many(Family::Random, 300);
        for layout in LAYOUTS {
            let built = QUALITIES.map(|quality| {
                let options = options(quality, layout);
                model.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("a BVH")
            });
            let [fast, balanced, best] = built
                .each_ref()
                .map(|built| Accel::open(built.accel().block()).expect("a sound block"));
            different += usize::from(fast.block() != balanced.block());
            different += usize::from(best.block() != balanced.block());
            for ray in &rays {
                let expected = bits(balanced.intersect(ray));
                assert_eq!(bits(fast.intersect(ray)), expected, "{name} {layout:?} {ray:?}");
                assert_eq!(bits(best.intersect(ray)), expected, "{name} {layout:?} {ray:?}");
            }
        }
    }
    assert!(different > 20, "only {different} blocks differ");
}

#[test]
fn every_quality_takes_what_is_promised() {
    for (name, make) in make::ALL {
        let model = make(20_000);
        let prims = model.triangle_count() + model.sphere_count();
        for quality in QUALITIES {
            let options = options(quality, Layout::Wide(16));
            let size =
                model.with_scene(|scene| raykern::bvh_needs(scene, &options)).expect("a size").size;
            assert!(size <= 100 * prims, "{name} {quality:?}: {}", size / prims);
            let built = model.with_scene(|scene| OwnedAccel::bvh(scene, &options)).expect("a BVH");
            let info = built.accel().info();
            assert_eq!(info.layout, Layout::Wide(16), "{name} {quality:?}");
            assert!(size <= 3 * info.size, "{name} {quality:?}: {size} for {}", info.size);
        }
    }
}

/// Halls have walls to cut: with less memory fewer, and with little none.
#[test]
fn the_best_quality_takes_any_memory_from_the_minimum_on() {
    let (_, make) = make::ALL.into_iter().find(|(name, _)| *name == "architecture").expect("halls");
    let model = make(5_000);
    let rays = RayMaker::new(&model, 5).many(Family::Random, 100);
    let options = options(Quality::Best, Layout::Wide(16));
    let known = block(&model, &BuildOptions { quality: Quality::Balanced, ..options });
    let mut blocks = std::collections::BTreeSet::new();
    model.with_scene(|scene| {
        let needs = raykern::bvh_needs(scene, &options).expect("a size");
        for step in 0..=12 {
            let size = needs.minimum + (needs.size - needs.minimum) * step / 8;
            let mut memory = vec![std::mem::MaybeUninit::new(0xa5u8); size + 64];
            let start = memory.as_ptr().align_offset(64);
            let memory = &mut memory[start..start + size];
            let built = raykern::build_bvh(scene, &options, memory).expect("enough");
            Accel::open(built.block()).expect("a sound block");
            blocks.insert(built.block().to_vec());
            with_open(&known, |known| {
                for ray in &rays {
                    assert_eq!(bits(built.intersect(ray)), bits(known.intersect(ray)), "{size}");
                }
            });
        }
    });
    assert!(blocks.len() > 3, "only {} blocks differ", blocks.len());
}

/// Calls `f` with the structure in a copy of a block.
fn with_open(block: &[u8], f: impl FnOnce(&Accel)) {
    let mut memory = vec![0u8; block.len() + 64];
    let start = memory.as_ptr().align_offset(64);
    memory[start..start + block.len()].copy_from_slice(block);
    f(&Accel::open(&memory[start..start + block.len()]).expect("a sound block"));
}

type Build = for<'c> fn(&Scene<'_, 'c>, &BuildOptions) -> Result<OwnedAccel<'c>, BuildError>;

#[test]
fn progress_is_told_and_may_cancel() {
    let model: Model = make::blob(5_000, 1).into();
    let crew = Crew::of(2);
    let bvh = |layout| options(Quality::Balanced, layout);
    let together = |kind| BuildOptions { threads: Some(&crew), ..grid_options(kind) };
    let builds: [(Build, BuildOptions); 6] = [
        (OwnedAccel::bvh, bvh(Layout::Wide(16))),
        (OwnedAccel::bvh, bvh(Layout::Compact)),
        (OwnedAccel::grid, grid_options(GridKind::Nested)),
        (OwnedAccel::grid, grid_options(GridKind::Uniform)),
        (OwnedAccel::grid, together(GridKind::Nested)),
        (OwnedAccel::grid, together(GridKind::Uniform)),
    ];
    for (build, options) in builds {
        let told = RefCell::new(Vec::new());
        let watched = |most: usize| {
            told.borrow_mut().clear();
            let progress = |done| {
                told.borrow_mut().push(done);
                told.borrow().len() < most
            };
            let options = BuildOptions { progress: Some(&progress), ..options };
            model
                .with_scene(|scene| build(scene, &options))
                .map(|built| built.accel().block().len())
        };
        assert!(watched(usize::MAX).is_ok());
        let all = told.borrow().clone();
        assert_eq!((all.first(), all.last()), (Some(&0.0), Some(&1.0)));
        assert!(all.is_sorted() && all.len() > 3, "{options:?} {all:?}");
        for most in 1..=all.len() {
            assert_eq!(watched(most), Err(BuildError::Cancelled), "{options:?} {most}");
            assert_eq!(told.borrow()[..], all[..most], "{options:?}: asked after it said no");
        }
    }
}

#[test]
fn memory_of_a_cancelled_build_may_be_used_again() {
    let model: Model = make::blob(5_000, 1).into();
    let plain = options(Quality::Balanced, Layout::Automatic);
    let expected = block(&model, &plain);
    let told = AtomicU32::new(0);
    let progress = |_| told.fetch_add(1, Ordering::Relaxed) < 3;
    let cancelled = BuildOptions { progress: Some(&progress), ..plain };
    model.with_scene(|scene| {
        let size = raykern::bvh_needs(scene, &plain).expect("a size").size;
        let mut memory = vec![std::mem::MaybeUninit::uninit(); size + 64];
        let start = memory.as_ptr().align_offset(64);
        let memory = &mut memory[start..start + size];
        let stopped = raykern::build_bvh(scene, &cancelled, memory).map(|_| ());
        assert_eq!(stopped, Err(BuildError::Cancelled));
        assert!(raykern::build_bvh(scene, &plain, memory).expect("enough").block() == expected);
    });
}

/// The parts of a model in an order that says nothing of where they are.
fn mixed(model: &Model) -> Model {
    let mut mixed = model.clone();
    let indices = &mut mixed.meshes[0].indices;
    let count = indices.len();
    *indices = (0..count).map(|i| model.meshes[0].indices[i * 1009 % count]).collect();
    mixed
}

/// What [`OwnedAccel::automatic`] makes of a model, told by its bytes.
fn chosen(model: &Model, quality: Quality, rays_per_prim: f32) -> &'static str {
    let options = BuildOptions { quality, rays_per_prim, ..BuildOptions::default() };
    model.with_scene(|scene| {
        let size = raykern::needs(scene, &options).expect("a size").size;
        let built = OwnedAccel::automatic(scene, &options).expect("a structure");
        assert!(built.accel().block().len() <= size);
        let is_it = |other: Result<OwnedAccel, BuildError>| {
            other.expect("a structure").accel().block() == built.accel().block()
        };
        let grid = |kind| {
            let grid = GridOptions { kind, ..GridOptions::default() };
            is_it(OwnedAccel::grid(scene, &BuildOptions { grid, ..options }))
        };
        let bvh = |quality| is_it(OwnedAccel::bvh(scene, &BuildOptions { quality, ..options }));
        match () {
            () if built.accel().info().kind == Kind::List => "list",
            () if grid(GridKind::Uniform) => "uniform",
            () if grid(GridKind::Nested) => "nested",
            () if bvh(Quality::Fast) => "fast",
            () if bvh(Quality::Balanced) => "balanced",
            () if bvh(Quality::Best) => "best",
            () => "nothing known",
        }
    })
}

/// With many rays the BVH that was asked for; with few a fast one, unless the best was asked for; with fewer a grid, the sooner the longer a
/// BVH takes or the less a ray has to test in a grid.
#[test]
fn the_choice_follows_the_rays_and_the_scene() {
    let surface: Model = make::plane(5_000).into();
    let mixed_surface = mixed(&surface);
    let handful: Model = make::plane(8).into();
    let hair: Model = make::hair(300_000, 1).into();
    let mut stadium = surface.clone();
    stadium.meshes.push(make::plane(50).placed(1e3, [-5e2, -5e2, -1.0]));
    let mut crowd: Model = make::blob(30_000, 0).placed(0.15, [0.0; 3]).into();
    for i in 1..8u32 {
        let place = [i % 2, i / 2 % 2, i / 4].map(|x| 3.0 * f64::from(x));
        crowd.meshes.push(make::blob(30_000, i.into()).placed(0.15, place));
    }
    let mut in_order: Model = make::plane(30_000).into();
    let mut on_a_floor = mixed(&in_order);
    for model in [&mut in_order, &mut on_a_floor] {
        model.meshes.push(make::plane(32).placed(10.0, [-5.0, -5.0, -1.0]));
    }
    // Two triangles stand apart, and are no matter.
    let mut on_two = mixed_surface.clone();
    on_two.meshes.push(make::plane(2).placed(10.0, [-5.0, -5.0, -1.0]));
    let (fast, balanced, best) = (Quality::Fast, Quality::Balanced, Quality::Best);
    let cases = [
        ("many", &surface, balanced, 0.0, "balanced"),
        ("many", &surface, balanced, 7.0, "balanced"),
        ("many", &surface, balanced, f32::INFINITY, "balanced"),
        ("many", &surface, balanced, f32::NAN, "balanced"),
        ("many, fast", &surface, fast, 7.0, "fast"),
        ("many, best", &surface, best, 7.0, "best"),
        ("surface", &surface, balanced, 5.0, "fast"),
        ("surface", &surface, balanced, 0.6, "fast"),
        ("surface", &surface, balanced, 0.3, "uniform"),
        ("surface, fast", &surface, fast, 0.6, "fast"),
        ("surface, best", &surface, best, 5.0, "best"),
        ("surface, best", &surface, best, 0.6, "uniform"),
        ("in no order", &mixed_surface, balanced, 0.6, "uniform"),
        ("in no order", &mixed_surface, balanced, 1.2, "fast"),
        ("long", &hair, balanced, 0.1, "fast"),
        ("long", &hair, balanced, 0.01, "uniform"),
        ("uneven", &stadium, balanced, 0.5, "fast"),
        ("uneven", &stadium, balanced, 0.1, "uniform"),
        ("crowded", &crowd, balanced, 0.06, "fast"),
        ("crowded", &crowd, balanced, 0.01, "uniform"),
        ("very uneven", &on_a_floor, balanced, 0.01, "uniform"),
        ("very uneven", &on_a_floor, balanced, 0.2, "nested"),
        ("very uneven", &on_a_floor, balanced, 1.0, "fast"),
        ("very uneven, in order", &in_order, balanced, 0.2, "fast"),
        ("on two triangles", &on_two, balanced, 0.2, "fast"),
        ("a handful", &handful, balanced, 0.05, "list"),
    ];
    let wrong: Vec<_> = cases
        .iter()
        .map(|(name, model, quality, rays, right)| {
            (*name, *rays, *right, chosen(model, *quality, *rays))
        })
        .filter(|(_, _, right, chosen)| right != chosen)
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}
