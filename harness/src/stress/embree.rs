//! Embree, default and robust, behind a program of its own: it aborts on what it does not like.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use raykern::{Hit, NONE, QueryOptions, Ray};

use super::{Case, Scenery, Shot};

/// Compiles `c_tests/stress_embree.c` into `folder`, with the C compiler `CC` or `cc`.
pub fn compiled(folder: &Path) -> Result<PathBuf, String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../c_tests/stress_embree.c");
    let program = folder.join("stress_embree");
    let compiler = std::env::var_os("CC").unwrap_or_else(|| "cc".into());
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut command = Command::new(&compiler);
    command.args(["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror"]).arg(source);
    command.args(["-lembree3", "-lm", "-o"]).arg(&program);
    match command.status() {
        Ok(status) if status.success() => Ok(program),
        Ok(status) => Err(format!("{command:?}: {status}; is libembree-dev installed?")),
        Err(error) => Err(format!("{}: {error}", compiler.display())),
    }
}

/// Components above this are refused by Embree (`FLT_LARGE` in its sources).
const LARGEST: f32 = 1.844e18;

/// Asks one process after the other; each lives until it aborts.
pub struct Embree<'a> {
    program: &'a Path,
    child: Option<Child>,
}

impl<'a> Embree<'a> {
    /// Nothing is started yet.
    pub fn new(program: &'a Path) -> Self {
        Embree { program, child: None }
    }

    /// The default and the robust answer to each ray, `None` to those that Embree may not be asked:
    /// rays with options, with negative limits, and whatever has a component that is not finite or
    /// beyond 1.8e18. It aborts on a few scenes within these bounds as well, and then none of the
    /// scene's rays count as asked.
    pub fn answers(&mut self, case: &Case) -> Vec<Option<[Option<Hit>; 2]>> {
        let none = vec![None; case.shots.len()];
        let asked: Vec<usize> =
            (0..case.shots.len()).filter(|i| may_be_asked(&case.shots[*i])).collect();
        if asked.is_empty() || !may_be_built(&case.scenery) {
            return none;
        }
        let rays: Vec<Ray> = asked.iter().map(|i| case.shots[*i].ray).collect();
        let Some(words) = self.exchange(&block(&case.scenery, &rays), 6 * rays.len()) else {
            eprintln!("Embree gave up on a scene");
            self.child = None;
            return none;
        };
        let mut answers = none;
        for (i, words) in asked.into_iter().zip(words.as_chunks::<6>().0) {
            answers[i] = Some([hit(&words[..3]), hit(&words[3..])]);
        }
        answers
    }

    /// Sends a block and reads as many words.
    fn exchange(&mut self, block: &[u8], words: usize) -> Option<Vec<u32>> {
        if self.child.is_none() {
            let mut command = Command::new(self.program);
            self.child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().ok();
        }
        let child = self.child.as_mut()?;
        let mut bytes = vec![0; 4 * words];
        // The program reads all of a block before it answers.
        let input = child.stdin.as_mut()?;
        input.write_all(block).and_then(|()| input.flush()).ok()?;
        child.stdout.as_mut()?.read_exact(&mut bytes).ok()?;
        Some(bytes.as_chunks::<4>().0.iter().map(|word| u32::from_ne_bytes(*word)).collect())
    }
}

impl Drop for Embree<'_> {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // It ends with its input.
            drop(child.stdin.take());
            let _ = child.wait();
        }
    }
}

fn within_range(numbers: &[f32]) -> bool {
    numbers.iter().all(|x| x.abs() <= LARGEST)
}

/// Whether Embree takes the ray: no options, nothing that is not finite or beyond 1.8e18, no negative limits.
pub fn may_be_asked(shot: &Shot) -> bool {
    let Ray { origin, t_min, direction, t_max } = shot.ray;
    let plain = shot.options == QueryOptions::default();
    let limits = (0.0..f32::INFINITY).contains(&t_min) && t_min <= t_max;
    plain && limits && direction != [0.0; 3] && within_range(&origin) && within_range(&direction)
}

/// Whether Embree takes the scene: likewise, and no sphere without a radius.
pub fn may_be_built(scenery: &Scenery) -> bool {
    let mut meshes = scenery.model.meshes.iter();
    let mut spheres = scenery.model.sphere_sets.iter().flatten();
    meshes.all(|mesh| within_range(mesh.vertices.as_flattened()))
        && spheres.all(|sphere| within_range(sphere) && sphere[3] > 0.0)
}

/// A block of words as the program reads it.
fn block(scenery: &Scenery, rays: &[Ray]) -> Vec<u8> {
    let model = &scenery.model;
    let counts = [model.meshes.len(), model.sphere_sets.len(), rays.len()];
    let mut words: Vec<u32> = counts.map(|n| n as u32).to_vec();
    for mesh in &model.meshes {
        words.extend([mesh.vertices.len() as u32, mesh.indices.len() as u32]);
        words.extend(mesh.vertices.as_flattened().iter().map(|x| x.to_bits()));
        words.extend(mesh.indices.as_flattened());
    }
    for set in &model.sphere_sets {
        words.push(set.len() as u32);
        words.extend(set.as_flattened().iter().map(|x| x.to_bits()));
    }
    for Ray { origin: [a, b, c], t_min, direction: [d, e, f], t_max } in rays {
        words.extend([a, b, c, t_min, d, e, f, t_max].map(|x| x.to_bits()));
    }
    words.into_iter().flat_map(u32::to_ne_bytes).collect()
}

/// From t, prim and geometry.
fn hit(words: &[u32]) -> Option<Hit> {
    let (t, prim, geometry) = (f32::from_bits(words[0]), words[1], words[2]);
    (geometry != NONE).then_some(Hit { t, u: 0.0, v: 0.0, prim, geometry, instance: NONE })
}
