//! From a failing ray in a scene to the least scene and the simplest ray that still fail.

use raykern::{Precision, PrimId, QueryOptions};

use super::run::complaint;
use super::score::Complaint;
use super::subject::Build;
use super::{Scenery, Shot};
use crate::model::{Model, TriangleMesh};
use crate::oracle::Place;

/// A scene and a ray that fail, at most as large as those given, failing in the same way.
///
/// Primitives are removed by halves and then one by one, then options and limits become defaults and
/// coordinates get fewer bits, again and again until nothing helps. Returns the argument when it does
/// not fail.
pub fn shrunk(scenery: &Scenery, shot: &Shot, wanted: &Complaint, build: Build) -> (Scenery, Shot) {
    let fails =
        |scenery: &Scenery, shot: &Shot| complaint(scenery, shot, build).0.as_ref() == Some(wanted);
    let mut search = Search { scenery: scenery.clone(), shot: *shot, fails: &fails };
    if !fails(scenery, shot) {
        return (search.scenery, search.shot);
    }
    for _ in 0..4 {
        let before = (format!("{:?}", search.scenery), format!("{:?}", search.shot));
        search.fewer_prims();
        search.tidier_scene();
        search.plainer_ray();
        search.fewer_bits();
        if before == (format!("{:?}", search.scenery), format!("{:?}", search.shot)) {
            break;
        }
    }
    (search.scenery, search.shot)
}

/// The smallest failing pair so far.
struct Search<'a> {
    scenery: Scenery,
    shot: Shot,
    fails: &'a dyn Fn(&Scenery, &Shot) -> bool,
}

impl Search<'_> {
    /// Takes the change if it still fails.
    fn attempt(&mut self, change: impl FnOnce(&mut Scenery, &mut Shot)) -> bool {
        let (mut scenery, mut shot) = (self.scenery.clone(), self.shot);
        change(&mut scenery, &mut shot);
        let fails = (self.fails)(&scenery, &shot);
        if fails {
            (self.scenery, self.shot) = (scenery, shot);
        }
        fails
    }

    /// Removes runs of primitives: half of them, a quarter, down to one.
    fn fewer_prims(&mut self) {
        let mut run = places(&self.scenery.model).len().div_ceil(2);
        while run > 0 {
            let mut first = 0;
            loop {
                let all = places(&self.scenery.model);
                let Some(rest) = all.get(first..).filter(|rest| !rest.is_empty()) else { break };
                let removed = &rest[..run.min(rest.len())];
                if !self.attempt(|scenery, shot| remove(scenery, shot, removed)) {
                    first += run;
                }
            }
            run /= 2;
        }
    }

    /// Drops vertices that no triangle names, geometries without primitives, and masks.
    fn tidier_scene(&mut self) {
        self.attempt(|scenery, _| scenery.masks.clear());
        self.attempt(|scenery, _| scenery.model.meshes.iter_mut().for_each(drop_unused));
        let geometries = self.scenery.model.meshes.len() + self.scenery.model.sphere_sets.len();
        for geometry in (0..geometries).rev() {
            if is_empty(&self.scenery.model, geometry) {
                self.attempt(|scenery, shot| drop_geometry(scenery, shot, geometry));
            }
        }
    }

    fn plainer_ray(&mut self) {
        let default = QueryOptions { precision: Precision::Exact, ..Default::default() };
        self.attempt(|_, shot| shot.options = default);
        self.attempt(|_, shot| shot.options.skip = None);
        self.attempt(|_, shot| shot.options.mask = 0);
        self.attempt(|_, shot| shot.options.facing = Default::default());
        self.attempt(|_, shot| shot.ray = shot.ray.with_limits(0.0, f32::INFINITY));
        self.attempt(|_, shot| shot.ray.t_max = f32::INFINITY);
        self.attempt(|_, shot| shot.ray.t_min = 0.0);
    }

    /// Rounds each number of the ray and of a small scene to as few bits as do.
    fn fewer_bits(&mut self) {
        for k in 0..3 {
            self.simpler(|_, shot| &mut shot.ray.origin[k]);
            self.simpler(|_, shot| &mut shot.ray.direction[k]);
        }
        self.simpler(|_, shot| &mut shot.ray.t_min);
        self.simpler(|_, shot| &mut shot.ray.t_max);
        if places(&self.scenery.model).len() > 8 {
            return;
        }
        for mesh in 0..self.scenery.model.meshes.len() {
            for vertex in 0..self.scenery.model.meshes[mesh].vertices.len() {
                for k in 0..3 {
                    self.simpler(|scenery, _| &mut scenery.model.meshes[mesh].vertices[vertex][k]);
                }
            }
        }
        for set in 0..self.scenery.model.sphere_sets.len() {
            for sphere in 0..self.scenery.model.sphere_sets[set].len() {
                for k in 0..4 {
                    self.simpler(|scenery, _| &mut scenery.model.sphere_sets[set][sphere][k]);
                }
            }
        }
    }

    /// Zero, else the fewest leading bits that still fail.
    fn simpler(&mut self, number: impl for<'b> Fn(&'b mut Scenery, &'b mut Shot) -> &'b mut f32) {
        let x = *number(&mut self.scenery, &mut self.shot);
        if !x.is_finite() || self.attempt(|scenery, shot| *number(scenery, shot) = 0.0) {
            return;
        }
        for dropped in (1..=23).rev() {
            let rounded = f32::from_bits(x.to_bits() >> dropped << dropped);
            if rounded == x || self.attempt(|scenery, shot| *number(scenery, shot) = rounded) {
                return;
            }
        }
    }
}

/// All primitives in order.
fn places(model: &Model) -> Vec<Place> {
    let sizes = model.meshes.iter().map(|mesh| mesh.indices.len());
    let sizes = sizes.chain(model.sphere_sets.iter().map(Vec::len));
    let place = |geometry, prim| Place { geometry: geometry as u32, prim: prim as u32 };
    sizes.enumerate().flat_map(|(g, count)| (0..count).map(move |prim| place(g, prim))).collect()
}

/// Removes primitives; the skipped one keeps being skipped while it is there.
fn remove(scenery: &mut Scenery, shot: &mut Shot, removed: &[Place]) {
    let gone = |geometry: usize, prim: usize| {
        removed.contains(&Place { geometry: geometry as u32, prim: prim as u32 })
    };
    if let Some(PrimId { prim, geometry, .. }) = shot.options.skip {
        let before = (0..prim).filter(|p| gone(geometry as usize, *p as usize)).count();
        shot.options.skip = shot.options.skip.filter(|_| !gone(geometry as usize, prim as usize));
        shot.options.skip.iter_mut().for_each(|id| id.prim -= before as u32);
    }
    let Model { meshes, sphere_sets } = &mut scenery.model;
    let first_set = meshes.len();
    for (geometry, mesh) in meshes.iter_mut().enumerate() {
        let mut prim = 0..;
        mesh.indices.retain(|_| !gone(geometry, prim.next().unwrap_or_default()));
    }
    for (set, spheres) in sphere_sets.iter_mut().enumerate() {
        let mut prim = 0..;
        spheres.retain(|_| !gone(first_set + set, prim.next().unwrap_or_default()));
    }
}

fn drop_unused(mesh: &mut TriangleMesh) {
    let mut numbers = vec![None; mesh.vertices.len()];
    let mut vertices = Vec::new();
    for v in mesh.indices.as_flattened_mut() {
        let vertex = mesh.vertices[*v as usize];
        *v = *numbers[*v as usize].get_or_insert_with(|| {
            vertices.push(vertex);
            vertices.len() as u32 - 1
        });
    }
    mesh.vertices = vertices;
}

fn is_empty(model: &Model, geometry: usize) -> bool {
    match geometry.checked_sub(model.meshes.len()) {
        None => model.meshes[geometry].indices.is_empty(),
        Some(set) => model.sphere_sets[set].is_empty(),
    }
}

fn drop_geometry(scenery: &mut Scenery, shot: &mut Shot, geometry: usize) {
    match geometry.checked_sub(scenery.model.meshes.len()) {
        None => drop(scenery.model.meshes.remove(geometry)),
        Some(set) => drop(scenery.model.sphere_sets.remove(set)),
    }
    if geometry < scenery.masks.len() {
        scenery.masks.remove(geometry);
    }
    if let Some(id) = shot.options.skip.as_mut().filter(|id| id.geometry as usize > geometry) {
        id.geometry -= 1;
    }
}
