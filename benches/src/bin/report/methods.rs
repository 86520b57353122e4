//! Every method and precision: how it is built, what it can be asked, and what it promises.

use std::rc::Rc;

use raykern::{
    Backend, BuildOptions, GridKind, GridOptions, Hit, Layout, NONE, OwnedAccel, PlainList,
    Precision, Quality, Ray,
};
use raykern_bench::lineup::Tracer;
use raykern_bench::ours::{Single, each};
use raykern_bench::watch::{Watch, timed_build};
use raykern_harness::model::Model;
use raykern_harness::textbook::{
    BaldwinWeber, MoellerTrumbore, MoellerTrumboreF64, Tree, TriangleTest, WoopBenthinWald,
};

/// Whose method it is, and what is promised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Ours, exact.
    Exact,
    /// Ours, watertight.
    Watertight,
    /// Embree.
    Embree,
    /// Another library.
    Library,
    /// A triangle test from a paper, in a plain tree.
    Textbook,
}

impl Group {
    /// In the order of legends.
    pub const ALL: [Group; 5] =
        [Group::Exact, Group::Watertight, Group::Embree, Group::Library, Group::Textbook];

    /// In legends.
    pub fn name(self) -> &'static str {
        match self {
            Group::Exact => "raykern, exact",
            Group::Watertight => "raykern, watertight",
            Group::Embree => "Embree",
            Group::Library => "other libraries",
            Group::Textbook => "textbook tests in a plain tree",
        }
    }

    /// The number of its colour and shape.
    pub fn style(self) -> usize {
        match self {
            Group::Exact => 1,
            Group::Watertight => 5,
            Group::Embree => 0,
            Group::Library => 2,
            Group::Textbook => 3,
        }
    }
}

/// A structure over one scene, ready to be asked.
pub struct Built {
    pub tracer: Rc<dyn Tracer>,
    /// Of the median build.
    pub seconds: f64,
    /// Kept, triangles included; `None` when the library does not say.
    pub bytes: Option<usize>,
}

/// A method.
pub struct Method {
    pub name: &'static str,
    pub group: Group,
    /// Whether it knows spheres.
    pub spheres: bool,
    /// Whether it heeds `t_min`.
    pub t_min: bool,
    /// Whether it says which triangle it met.
    pub names: bool,
    make: Make,
}

/// How a method comes to be.
enum Make {
    Ours(Structure, Precision, Option<Backend>),
    #[cfg(feature = "embree")]
    Embree(raykern_bench::embree::Way),
    /// With these flags of a scene.
    #[cfg(feature = "embree")]
    Embree4(i32),
    #[cfg(feature = "peers")]
    Library(fn(&Model) -> Result<raykern_bench::peers::Built, String>),
    Textbook(BuildTree),
}

/// Builds a tree, with the bytes that it keeps.
type BuildTree = fn(&Model) -> (Box<dyn Tracer>, usize);

/// A structure of ours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Structure {
    List,
    Grid(GridKind),
    Binary,
    Wide(Quality),
    /// What is chosen for so many rays for each primitive; zero means many.
    Automatic(f32),
}

impl Structure {
    /// Builds it, even over one primitive.
    pub fn build(self, model: &Model) -> Result<OwnedAccel<'static>, String> {
        let mut options = BuildOptions { plain_list: PlainList::Never, ..BuildOptions::default() };
        match self {
            Structure::List => options.plain_list = PlainList::Always,
            Structure::Grid(kind) => options.grid = GridOptions { kind, ..Default::default() },
            Structure::Binary => options.layout = Layout::Compact,
            Structure::Wide(quality) => options.quality = quality,
            Structure::Automatic(rays) => {
                options.plain_list = PlainList::Automatic;
                options.rays_per_prim = rays;
            }
        }
        let built = model.with_scene(|scene| match self {
            Structure::Grid(_) => OwnedAccel::grid(scene, &options),
            Structure::Automatic(_) => OwnedAccel::automatic(scene, &options),
            _ => OwnedAccel::bvh(scene, &options),
        });
        built.map_err(|error| error.to_string())
    }
}

impl Method {
    /// Builds it over a model.
    pub fn build(&self, model: &Model) -> Result<Built, String> {
        match &self.make {
            Make::Ours(structure, precision, backend) => {
                let (accel, seconds) = timed_build(|| structure.build(model));
                let accel = Rc::new(accel?);
                let bytes = Some(accel.accel().block().len());
                let single = Single::new(&accel, *precision);
                let backend = backend.unwrap_or(Backend::detected());
                Ok(Built { tracer: Rc::new(Forced { single, backend }), seconds, bytes })
            }
            #[cfg(feature = "embree")]
            Make::Embree(way) => {
                let (tracer, seconds, bytes) =
                    raykern_bench::embree::single(model, *way).ok_or("Embree refuses")?;
                Ok(Built { tracer: tracer.into(), seconds, bytes: Some(bytes) })
            }
            #[cfg(feature = "embree")]
            Make::Embree4(flags) => {
                let (tracer, seconds, bytes) = raykern_bench::embree4::single(model, *flags)?;
                Ok(Built { tracer: tracer.into(), seconds, bytes: Some(bytes) })
            }
            #[cfg(feature = "peers")]
            Make::Library(build) => {
                let (built, seconds) = timed_build(|| build(model));
                let (tracer, bytes) = built?;
                Ok(Built { tracer: tracer.into(), seconds, bytes })
            }
            Make::Textbook(build) => {
                let ((tracer, bytes), seconds) = timed_build(|| build(model));
                Ok(Built { tracer: tracer.into(), seconds, bytes: Some(bytes) })
            }
        }
    }
}

/// What others are compared with.
pub const REFERENCE: &str = "Embree 3";

/// Every method that this program was compiled with, ours first.
pub fn all() -> Vec<Method> {
    let mut methods = ours();
    #[cfg(feature = "embree")]
    methods.extend(embree());
    #[cfg(feature = "peers")]
    methods.extend(libraries());
    methods.extend(textbook());
    methods
}

fn ours() -> Vec<Method> {
    let balanced = Structure::Wide(Quality::Balanced);
    let exact = [
        ("list", Structure::List, None),
        ("plain grid", Structure::Grid(GridKind::Uniform), None),
        ("nested grid", Structure::Grid(GridKind::Nested), None),
        ("binary BVH", Structure::Binary, None),
        ("BVH", balanced, None),
        ("BVH again", balanced, None),
        ("BVH, AVX2", balanced, Some(Backend::Avx2)),
        ("BVH, 128 bits", balanced, Some(Backend::Bits128)),
        ("BVH, scalar", balanced, Some(Backend::Scalar)),
    ];
    let method =
        |name, group, make| Method { name, group, spheres: true, t_min: true, names: true, make };
    let least = |backend: &Option<Backend>| backend.is_none_or(|b| b < Backend::detected());
    let exact = exact.into_iter().filter(|(.., backend)| least(backend));
    let mut methods: Vec<_> = exact
        .map(|(name, structure, backend)| {
            method(name, Group::Exact, Make::Ours(structure, Precision::Exact, backend))
        })
        .collect();
    let watertight = Make::Ours(balanced, Precision::Watertight, None);
    methods.push(method("BVH watertight", Group::Watertight, watertight));
    methods
}

/// The same method twice, which shows the machine's noise; no figure but that of the noise has it.
pub const AGAIN: &str = "BVH again";

#[cfg(feature = "embree")]
fn embree() -> impl Iterator<Item = Method> {
    use raykern_bench::embree::{COMPACT, PLAIN, ROBUST, Way};
    let ways = [
        ("Embree 3", 1, PLAIN, c""),
        ("Embree 3, AVX2", 1, PLAIN, c"isa=avx2"),
        ("Embree 3 robust", 1, ROBUST, c""),
        ("Embree 3 compact", 1, COMPACT, c""),
        ("Embree 3 high", 2, PLAIN, c""),
    ];
    let fourth = [("Embree 4", PLAIN), ("Embree 4 robust", ROBUST)];
    let fourth = fourth.into_iter().map(|(name, flags)| (name, Make::Embree4(flags)));
    let third = ways
        .into_iter()
        .map(|(name, quality, flags, config)| (name, Make::Embree(Way { quality, flags, config })));
    third.chain(fourth).map(|(name, make)| Method {
        name,
        group: Group::Embree,
        spheres: true,
        t_min: true,
        names: true,
        make,
    })
}

#[cfg(feature = "peers")]
fn libraries() -> impl Iterator<Item = Method> {
    // The slow presets build for minutes and find the same triangles.
    let fast = |maker: &raykern_bench::peers::Maker| maker.name != "obvhs-slow";
    raykern_bench::peers::all().into_iter().filter(fast).map(|maker| Method {
        name: maker.name,
        group: Group::Library,
        spheres: false,
        t_min: maker.name == "obvhs" || maker.name == "bvh-crate",
        names: maker.name != "parry",
        make: Make::Library(maker.build),
    })
}

fn textbook() -> impl Iterator<Item = Method> {
    let tests: [(&str, BuildTree); 4] = [
        ("Moeller-Trumbore", plain_tree::<MoellerTrumbore>),
        ("Moeller-Trumbore f64", plain_tree::<MoellerTrumboreF64>),
        ("Woop-Benthin-Wald", plain_tree::<WoopBenthinWald>),
        ("Baldwin-Weber", plain_tree::<BaldwinWeber>),
    ];
    tests.into_iter().map(|(name, build)| Method {
        name,
        group: Group::Textbook,
        spheres: false,
        t_min: true,
        names: true,
        make: Make::Textbook(build),
    })
}

fn plain_tree<T: TriangleTest + 'static>(model: &Model) -> (Box<dyn Tracer>, usize) {
    let tree = Tree::<T>::new(model);
    let bytes = tree.bytes();
    (Box::new(Plain(tree)), bytes)
}

/// The version of Embree that is linked, as its header says.
pub fn embree_version() -> String {
    #[cfg(feature = "embree")]
    return raykern_bench::embree::version();
    #[cfg(not(feature = "embree"))]
    "left out".to_owned()
}

/// Ours with no more than these instructions; the processor's best are set again afterwards.
struct Forced {
    single: Single,
    backend: Backend,
}

impl Tracer for Forced {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherent: bool, watch: &mut Watch) {
        self.backend.force();
        self.single.closest(rays, hits, coherent, watch);
        Backend::detected().force();
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], coherent: bool, watch: &mut Watch) {
        self.backend.force();
        self.single.any(rays, occluded, coherent, watch);
        Backend::detected().force();
    }
}

/// A textbook test, of which the closest hit stands in for any.
struct Plain<T>(Tree<T>);

impl<T: TriangleTest> Tracer for Plain<T> {
    fn closest(&self, rays: &[Ray], hits: &mut [Hit], _coherent: bool, watch: &mut Watch) {
        watch.time(|| {
            each(rays, hits, |ray| match self.0.closest(ray) {
                None => Hit::MISS,
                Some((t, place)) => Hit {
                    t,
                    u: 0.0,
                    v: 0.0,
                    prim: place.prim,
                    geometry: place.geometry,
                    instance: NONE,
                },
            });
        });
    }

    fn any(&self, rays: &[Ray], occluded: &mut [bool], _coherent: bool, watch: &mut Watch) {
        watch.time(|| each(rays, occluded, |ray| self.0.closest(ray).is_some()));
    }
}
