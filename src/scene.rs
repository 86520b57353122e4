//! What a build reads: meshes, sphere sets and instances that stay the caller's.

use crate::block::Finished;
use crate::math::Aabb;

/// Elements of a few words each, at equal distances in the caller's memory.
///
/// Element `i` is `words[i * stride ..][.. N]`. Words between elements are never read.
#[derive(Clone, Copy, Debug)]
pub struct Strided<'a, T> {
    words: &'a [T],
    stride: usize,
    count: usize,
}

impl<'a, T: Copy> Strided<'a, T> {
    /// `count` elements of `width` words, `stride` words apart.
    ///
    /// `None` when `words` ends before the last element does, or when `stride < width` with more
    /// than one element.
    pub fn new(words: &'a [T], width: usize, stride: usize, count: usize) -> Option<Self> {
        let needed = match count {
            0 => 0,
            n => (n - 1).checked_mul(stride)?.checked_add(width)?,
        };
        let overlap = count > 1 && stride < width;
        (needed <= words.len() && !overlap).then_some(Strided { words, stride, count })
    }

    /// The number of elements.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Element `i`, or `None` beyond the last one.
    #[inline(always)]
    pub fn get<const N: usize>(&self, i: usize) -> Option<[T; N]> {
        if i >= self.count {
            return None;
        }
        self.words.get(i * self.stride..)?.first_chunk::<N>().copied()
    }
}

/// Triangles over vertices, with or without indices.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    vertices: Strided<'a, f32>,
    indices: Option<Strided<'a, u32>>,
    triangle_count: usize,
    mask: u32,
}

impl<'a> Mesh<'a> {
    /// Triangles that name their vertices by number.
    pub fn indexed(vertices: &'a [[f32; 3]], indices: &'a [[u32; 3]]) -> Self {
        let vertices = packed(vertices);
        let indices = packed(indices);
        Mesh { vertices, indices: Some(indices), triangle_count: indices.len(), mask: 0 }
    }

    /// Triangles whose vertices stand in threes.
    pub fn soup(triangles: &'a [[[f32; 3]; 3]]) -> Self {
        let vertices = packed(triangles.as_flattened());
        Mesh { vertices, indices: None, triangle_count: triangles.len(), mask: 0 }
    }

    /// Vertices and, unless they stand in threes, indices at any distance in memory.
    ///
    /// `vertices` has elements of three words, `indices` too. With indices, `triangle_count` must
    /// not exceed their number.
    pub fn strided(
        vertices: Strided<'a, f32>,
        indices: Option<Strided<'a, u32>>,
        triangle_count: usize,
    ) -> Self {
        Mesh { vertices, indices, triangle_count, mask: 0 }
    }

    /// The same mesh, seen only by queries whose mask shares a bit with `mask`; 0: by all.
    pub fn with_mask(self, mask: u32) -> Self {
        Mesh { mask, ..self }
    }

    /// Whether triangles name their vertices by number.
    pub fn is_indexed(&self) -> bool {
        self.indices.is_some()
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangle_count
    }

    /// The number of vertices, used or not.
    pub fn vertex_count(&self) -> usize {
        self.vertices.len()
    }

    /// The mask; 0 is seen by every query.
    pub fn mask(&self) -> u32 {
        self.mask
    }

    /// The first index of triangle `i`, if it has any.
    #[inline]
    pub(crate) fn first_index(&self, i: usize) -> Option<&'a u32> {
        let indices = self.indices.as_ref()?;
        indices.words.get(i.wrapping_mul(indices.stride))
    }

    /// The first word of each vertex of triangle `i`, if it has them all.
    #[inline]
    pub(crate) fn first_words(&self, i: usize) -> Option<[&'a f32; 3]> {
        let word = |v: usize| self.vertices.words.get(v.wrapping_mul(self.vertices.stride));
        let [a, b, c] = self.numbers(i)?;
        Some([word(a)?, word(b)?, word(c)?])
    }

    /// The vertices of triangle `i`, or `None` when it or one of its vertices does not exist.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn triangle(&self, i: usize) -> Option<[[f32; 3]; 3]> {
        let corner = |v: usize| self.vertices.get::<3>(v);
        let [a, b, c] = self.numbers(i)?;
        Some([corner(a)?, corner(b)?, corner(c)?])
    }

    /// Vertex `v`, if there is one.
    #[inline]
    pub(crate) fn vertex(&self, v: usize) -> Option<[f32; 3]> {
        self.vertices.get::<3>(v)
    }

    /// The numbers of the vertices of triangle `i`, which need not exist. There may be more indices or vertices than
    /// triangles use.
    #[inline]
    pub(crate) fn numbers(&self, i: usize) -> Option<[usize; 3]> {
        match &self.indices {
            _ if i >= self.triangle_count => None,
            Some(indices) => Some(indices.get::<3>(i)?.map(|v| v as usize)),
            None => Some([3 * i, 3 * i + 1, 3 * i + 2]),
        }
    }
}

/// Spheres, each `x y z radius`.
#[derive(Clone, Copy, Debug)]
pub struct SphereSet<'a> {
    spheres: Strided<'a, f32>,
    mask: u32,
}

impl<'a> SphereSet<'a> {
    /// Spheres `[x, y, z, radius]`, one after the other.
    pub fn new(spheres: &'a [[f32; 4]]) -> Self {
        SphereSet { spheres: packed(spheres), mask: 0 }
    }

    /// Spheres of four words each at any distance in memory.
    pub fn strided(spheres: Strided<'a, f32>) -> Self {
        SphereSet { spheres, mask: 0 }
    }

    /// The same spheres, seen only by queries whose mask shares a bit with `mask`; 0: by all.
    pub fn with_mask(self, mask: u32) -> Self {
        SphereSet { mask, ..self }
    }

    /// The number of spheres.
    pub fn sphere_count(&self) -> usize {
        self.spheres.len()
    }

    /// The mask; 0 is seen by every query.
    pub fn mask(&self) -> u32 {
        self.mask
    }

    /// Sphere `i` as `[x, y, z, radius]`.
    pub fn sphere(&self, i: usize) -> Option<[f32; 4]> {
        self.spheres.get::<4>(i)
    }
}

/// A built structure at another place: [`Instance::new`](crate::Instance::new).
#[derive(Clone, Copy)]
pub struct Instance<'c> {
    pub(crate) child: Finished<'c>,
    pub(crate) object_to_world: [f32; 12],
    pub(crate) mask: u32,
}

impl Instance<'_> {
    /// The same instance, seen only by queries whose mask shares a bit with `mask`; 0: by all. What is in it has
    /// masks of its own, and is seen if both are.
    pub fn with_mask(self, mask: u32) -> Self {
        Instance { mask, ..self }
    }
}

/// Everything that can be hit. Any list may be empty.
///
/// Geometries are numbered: the meshes first, then the sphere sets. Instances have numbers of their own, and what is in
/// them is numbered as in the accel that stands there.
///
/// A build reads meshes and sphere sets, and forgets them; but what it makes of instances goes on to refer to their accels,
/// for `'c`.
#[derive(Clone, Copy)]
pub struct Scene<'a, 'c> {
    source: Source<'a>,
    instances: Instances<'a, 'c>,
}

/// Where the geometries come from: slices, or arrays in another language's types that are read
/// element by element.
#[derive(Clone, Copy)]
enum Source<'a> {
    Slices {
        meshes: &'a [Mesh<'a>],
        sphere_sets: &'a [SphereSet<'a>],
    },
    Foreign(&'a (dyn Geometries + 'a)),
    /// What an index over instances is built of; one geometry.
    Boxes(&'a (dyn Boxes + 'a)),
}

#[derive(Clone, Copy)]
enum Instances<'a, 'c> {
    Slice(&'a [Instance<'c>]),
    Foreign(&'c (dyn Placements + 'c)),
}

/// Geometries that are made when they are asked for, on any thread of a build.
pub(crate) trait Geometries: Sync {
    fn mesh_count(&self) -> usize;
    fn mesh(&self, i: usize) -> Option<Mesh<'_>>;
    fn sphere_set_count(&self) -> usize;
    fn sphere_set(&self, i: usize) -> Option<SphereSet<'_>>;
}

/// Instances that are made when they are asked for.
pub(crate) trait Placements: Sync {
    fn instance_count(&self) -> usize;
    fn instance(&self, i: usize) -> Option<Instance<'_>>;
}

/// Boxes that are made when they are asked for, on any thread of a build.
pub(crate) trait Boxes: Sync {
    fn count(&self) -> usize;
    /// The box of this number, empty if there is nothing in it.
    fn aabb(&self, i: usize) -> Aabb;
}

impl<'a, 'c> Scene<'a, 'c> {
    /// A scene of these meshes and sphere sets.
    pub const fn new(meshes: &'a [Mesh<'a>], sphere_sets: &'a [SphereSet<'a>]) -> Self {
        let source = Source::Slices { meshes, sphere_sets };
        Scene { source, instances: Instances::Slice(&[]) }
    }

    /// The same scene with these instances in place of others.
    pub const fn with_instances<'i>(self, instances: &'i [Instance<'c>]) -> Scene<'i, 'c>
    where
        'a: 'i,
    {
        Scene { source: self.source, instances: Instances::Slice(instances) }
    }

    /// A scene whose geometries and instances are made when they are asked for.
    #[cfg_attr(
        any(not(feature = "capi"), test),
        expect(dead_code, reason = "only the C face needs it")
    )]
    pub(crate) const fn foreign(
        geometries: &'a (dyn Geometries + 'a),
        instances: &'c (dyn Placements + 'c),
    ) -> Self {
        Scene { source: Source::Foreign(geometries), instances: Instances::Foreign(instances) }
    }

    /// A scene of boxes.
    pub(crate) const fn of_boxes(boxes: &'a (dyn Boxes + 'a)) -> Self {
        Scene { source: Source::Boxes(boxes), instances: Instances::Slice(&[]) }
    }

    /// The number of meshes.
    pub fn mesh_count(&self) -> usize {
        match self.source {
            Source::Slices { meshes, .. } => meshes.len(),
            Source::Foreign(geometries) => geometries.mesh_count(),
            Source::Boxes(_) => 0,
        }
    }

    /// Mesh `i`, or `None` beyond the last one.
    pub fn mesh(&self, i: usize) -> Option<Mesh<'a>> {
        match self.source {
            Source::Slices { meshes, .. } => meshes.get(i).copied(),
            Source::Foreign(geometries) => geometries.mesh(i),
            Source::Boxes(_) => None,
        }
    }

    /// The number of sphere sets.
    pub fn sphere_set_count(&self) -> usize {
        match self.source {
            Source::Slices { sphere_sets, .. } => sphere_sets.len(),
            Source::Foreign(geometries) => geometries.sphere_set_count(),
            Source::Boxes(_) => 0,
        }
    }

    /// Sphere set `i`, or `None` beyond the last one.
    pub fn sphere_set(&self, i: usize) -> Option<SphereSet<'a>> {
        match self.source {
            Source::Slices { sphere_sets, .. } => sphere_sets.get(i).copied(),
            Source::Foreign(geometries) => geometries.sphere_set(i),
            Source::Boxes(_) => None,
        }
    }

    /// The number of instances.
    pub fn instance_count(&self) -> usize {
        match self.instances {
            Instances::Slice(instances) => instances.len(),
            Instances::Foreign(instances) => instances.instance_count(),
        }
    }

    /// Instance `i`, or `None` beyond the last one.
    pub fn instance(&self, i: usize) -> Option<Instance<'c>> {
        match self.instances {
            Instances::Slice(instances) => instances.get(i).copied(),
            Instances::Foreign(instances) => instances.instance(i),
        }
    }

    /// The boxes, if it is a scene of boxes.
    pub(crate) fn boxes(&self) -> Option<&'a (dyn Boxes + 'a)> {
        match self.source {
            Source::Boxes(boxes) => Some(boxes),
            _ => None,
        }
    }
}

fn packed<T: Copy, const N: usize>(elements: &[[T; N]]) -> Strided<'_, T> {
    Strided { words: elements.as_flattened(), stride: N, count: elements.len() }
}
