//! What a ray may ask: its options, and the traversal's side of the question.

/// Which of two sides of a surface a ray may meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facing {
    /// Both sides.
    #[default]
    Both,
    /// Only the front: the side from which a triangle's vertices run counter-clockwise, and the
    /// outside of a sphere.
    Front,
    /// Only the back.
    Back,
}

/// A primitive by its numbers, as they stand in a [`Hit`](crate::Hit).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimId {
    /// The number within the geometry.
    pub prim: u32,
    /// The mesh, or the number of meshes plus the sphere set.
    pub geometry: u32,
    /// The instance, [`NONE`](crate::NONE) outside instances.
    pub instance: u32,
}

/// What one query may leave out. The default leaves out nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryOptions {
    /// A geometry is seen when its mask and this one share a bit, or when either is zero.
    pub mask: u32,
    /// The sides of surfaces that count.
    pub facing: Facing,
    /// A primitive to leave out, such as the one the ray starts on. Of a sphere only the root
    /// nearest to `t = 0` is left out, so that a ray refracted into it still leaves it.
    pub skip: Option<PrimId>,
}
