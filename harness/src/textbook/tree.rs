//! A plain binary tree: binned surface area heuristic, boxes judged in `f64`.

use raykern::Ray;

use super::TriangleTest;
use crate::model::Model;
use crate::oracle::Place;

/// Triangles in a binary tree.
#[derive(Debug)]
pub struct Tree<T> {
    nodes: Vec<Node>,
    triangles: Vec<T>,
    places: Vec<Place>,
}

/// A box, and either two children side by side or the triangles of a leaf.
#[derive(Clone, Copy, Debug)]
struct Node {
    lower: [f32; 3],
    upper: [f32; 3],
    /// The first child, or the first triangle.
    first: u32,
    /// How many triangles; zero inside.
    count: u32,
}

/// As many triangles are not divided.
const LEAF: usize = 4;
const BINS: usize = 16;
/// As deep as a tree of 2^32 triangles that are halved, and as much again.
const STACK: usize = 64;
/// More than three roundings to the nearest `f64`.
const PAD: f64 = 1.0 + 1e-15;

struct Item {
    corners: [[f32; 3]; 3],
    place: Place,
    lower: [f32; 3],
    upper: [f32; 3],
}

impl<T: TriangleTest> Tree<T> {
    /// Over all triangles of `model`.
    pub fn new(model: &Model) -> Self {
        let mut items: Vec<Item> = Vec::with_capacity(model.triangle_count());
        for (geometry, mesh) in model.meshes.iter().enumerate() {
            for (prim, triangle) in mesh.indices.iter().enumerate() {
                let place = Place { geometry: geometry as u32, prim: prim as u32 };
                items.push(Item::new(triangle.map(|v| mesh.vertices[v as usize]), place));
            }
        }
        let mut nodes = vec![Node::around(&items)];
        let mut open = vec![(0, 0, items.len(), 0)];
        while let Some((node, from, to, depth)) = open.pop() {
            let part = &mut items[from..to];
            let Some(middle) = split(part, depth) else {
                nodes[node].first = from as u32;
                nodes[node].count = part.len() as u32;
                continue;
            };
            let first = nodes.len();
            nodes[node].first = first as u32;
            let (left, right) = part.split_at(middle);
            nodes.extend([Node::around(left), Node::around(right)]);
            open.push((first, from, from + middle, depth + 1));
            open.push((first + 1, from + middle, to, depth + 1));
        }
        let triangles = items.iter().map(|item| T::new(item.corners)).collect();
        Tree { nodes, triangles, places: items.iter().map(|item| item.place).collect() }
    }

    /// What it keeps.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.places[..])
    }

    /// The first of the closest hits that the test finds.
    pub fn closest(&self, ray: &Ray) -> Option<(f32, Place)> {
        let (line, slabs) = (T::line(ray), Slabs::new(ray));
        let (mut best, mut t_best) = (None, ray.t_max);
        let mut stack = [(0, 0.0); STACK];
        let mut height = 0;
        let mut at = slabs.enter(&self.nodes[0], t_best).map(|near| (0, near));
        while let Some((number, near)) = at.take().or_else(|| pop(&stack, &mut height)) {
            if near > f64::from(t_best) * PAD {
                continue;
            }
            let node = &self.nodes[number];
            let first = node.first as usize;
            if node.count > 0 {
                for i in first..first + node.count as usize {
                    // At equal t the first found stays.
                    let t = self.triangles[i].meet(&line, ray.t_min, t_best);
                    if let Some(t) = t.filter(|t| best.is_none() || *t < t_best) {
                        (best, t_best) = (Some((t, self.places[i])), t);
                    }
                }
                continue;
            }
            let enter = |i: usize| slabs.enter(&self.nodes[i], t_best).map(|near| (i, near));
            match (enter(first), enter(first + 1)) {
                (Some(a), Some(b)) => {
                    let (near, far) = if b.1 < a.1 { (b, a) } else { (a, b) };
                    stack[height] = far;
                    height += 1;
                    at = Some(near);
                }
                (a, b) => at = a.or(b),
            }
        }
        best
    }
}

fn pop(stack: &[(usize, f64); STACK], height: &mut usize) -> Option<(usize, f64)> {
    *height = height.checked_sub(1)?;
    Some(stack[*height])
}

/// The ray in `f64`, with the reciprocals of its direction.
struct Slabs {
    origin: [f64; 3],
    inverse: [f64; 3],
    t_min: f64,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        let inverse = ray.direction.map(|d| 1.0 / f64::from(d));
        Slabs { origin: ray.origin.map(f64::from), inverse, t_min: f64::from(ray.t_min) }
    }

    /// Where the ray enters the box, or a little before.
    fn enter(&self, node: &Node, t_max: f32) -> Option<f64> {
        let (mut near, mut far) = (self.t_min, f64::from(t_max));
        for k in 0..3 {
            let (mut from, mut to) = (node.lower[k], node.upper[k]);
            if self.inverse[k].is_sign_negative() {
                (from, to) = (to, from);
            }
            // Zero times infinity, a wall that the ray lies in, is dropped by min and max.
            near = near.max((f64::from(from) - self.origin[k]) * self.inverse[k]);
            far = far.min((f64::from(to) - self.origin[k]) * self.inverse[k]);
        }
        (near <= far * PAD).then_some(near)
    }
}

impl Item {
    fn new(corners: [[f32; 3]; 3], place: Place) -> Self {
        let [a, b, c] = corners;
        let lower = std::array::from_fn(|k| a[k].min(b[k]).min(c[k]));
        let upper = std::array::from_fn(|k| a[k].max(b[k]).max(c[k]));
        Item { corners, place, lower, upper }
    }

    /// Twice the middle of the box.
    fn middle(&self, axis: usize) -> f64 {
        f64::from(self.lower[axis]) + f64::from(self.upper[axis])
    }
}

impl Node {
    fn around(items: &[Item]) -> Self {
        let (lower, upper) = items.iter().fold(EMPTY, |(l, u), item| {
            let lower = std::array::from_fn(|k| f32::min(l[k], item.lower[k]));
            (lower, std::array::from_fn(|k| f32::max(u[k], item.upper[k])))
        });
        Node { lower, upper, first: 0, count: 0 }
    }

    /// Half its surface; nothing for an empty one.
    fn area(&self) -> f64 {
        let [x, y, z]: [f64; 3] =
            std::array::from_fn(|k| (f64::from(self.upper[k]) - f64::from(self.lower[k])).max(0.0));
        x * y + y * z + z * x
    }
}

const EMPTY: ([f32; 3], [f32; 3]) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);

/// Sorts the items into two parts, the first of which has the number returned; `None` for a leaf.
fn split(items: &mut [Item], depth: usize) -> Option<usize> {
    if items.len() <= LEAF {
        return None;
    }
    // Halved where a tree of odd shape might outgrow the stack.
    if depth < STACK / 2
        && let Some((axis, wall)) = cheapest(items)
    {
        items.sort_unstable_by_key(|item| item.middle(axis) >= wall);
        return Some(items.partition_point(|item| item.middle(axis) < wall));
    }
    Some(items.len() / 2)
}

/// The axis and the wall, doubled like the middles, at which the heuristic is least; `None` if all middles are the same.
fn cheapest(items: &[Item]) -> Option<(usize, f64)> {
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..3 {
        let middles = items.iter().map(|item| item.middle(axis));
        let low = middles.clone().fold(f64::INFINITY, f64::min);
        let width = (middles.fold(f64::NEG_INFINITY, f64::max) - low) / BINS as f64;
        if !(width > 0.0 && width.is_finite()) {
            continue;
        }
        let wall = |bin: usize| low + width * bin as f64;
        for (bin, cost) in costs(items, |item| (item.middle(axis) - low) / width) {
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, wall(bin)));
            }
        }
    }
    // A wall that rounds to the end of the items divides nothing.
    best.map(|(_, axis, wall)| (axis, wall)).filter(|&(axis, wall)| {
        items.iter().any(|item| item.middle(axis) < wall)
            && items.iter().any(|item| item.middle(axis) >= wall)
    })
}

/// For every wall between bins that leaves items on both sides, area times number on either side.
fn costs(items: &[Item], bin: impl Fn(&Item) -> f64) -> Vec<(usize, f64)> {
    let (lower, upper) = EMPTY;
    let mut bins = [Node { lower, upper, first: 0, count: 0 }; BINS];
    for item in items {
        bins[(bin(item) as usize).min(BINS - 1)].add(&item.lower, &item.upper, 1);
    }
    let side = |bins: &mut dyn Iterator<Item = &Node>| {
        let mut sum = Node { lower, upper, first: 0, count: 0 };
        bins.for_each(|bin| sum.add(&bin.lower, &bin.upper, bin.count));
        (sum.count > 0).then(|| sum.area() * f64::from(sum.count))
    };
    let cost = |wall| Some(side(&mut bins[..wall].iter())? + side(&mut bins[wall..].iter())?);
    (1..BINS).filter_map(|wall| Some((wall, cost(wall)?))).collect()
}

impl Node {
    fn add(&mut self, lower: &[f32; 3], upper: &[f32; 3], count: u32) {
        self.lower = std::array::from_fn(|k| self.lower[k].min(lower[k]));
        self.upper = std::array::from_fn(|k| self.upper[k].max(upper[k]));
        self.count += count;
    }
}
