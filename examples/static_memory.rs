//! Without an allocator: the structure is built into a static array, and rays take nothing but stack.
//!
//! What is used of the library is there without std as well. On a microcontroller the array would be handed out by whatever
//! guards the program's other variables, in place of the mutex; `targets/programs` has such programs, in C.
//!
//! ```text
//! cargo run --example static_memory
//! ```

use std::mem::MaybeUninit;
use std::sync::Mutex;

use raykern::{Accel, BuildError, BuildOptions, Layout, Mesh, Ray, Scene, build_bvh, bvh_needs};

/// Blocks begin at multiples of 64 bytes.
#[repr(align(64))]
struct Room([MaybeUninit<u8>; 4096]);

static ROOM: Mutex<Room> = Mutex::new(Room([MaybeUninit::uninit(); 4096]));

static VERTICES: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 1.0, 1.5]];
static PYRAMID: [[u32; 3]; 6] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 2, 1], [0, 3, 2]];

fn main() -> Result<(), BuildError> {
    let meshes = [Mesh::indexed(&VERTICES, &PYRAMID)];
    let scene = Scene::new(&meshes, &[]);
    // Binary nodes take the least memory and the least stack.
    let options = BuildOptions { layout: Layout::Compact, ..BuildOptions::default() };
    println!("{} bytes are needed", bvh_needs(&scene, &options)?.size);

    let mut room = ROOM.lock().expect("nobody else has it");
    let accel = build_bvh(&scene, &options, &mut room.0)?;
    println!("{} bytes are the structure", accel.block().len());
    draw(&accel);
    Ok(())
}

/// The pyramid from above: a digit for each pixel, higher where the surface is.
fn draw(accel: &Accel) {
    for y in 0..12 {
        let line = (0..24).map(|x| {
            let from = [x as f32 / 8.0 - 0.45, y as f32 / 4.0 - 0.45, 2.0];
            let hit = accel.intersect(&Ray::new(from, [0.0, 0.0, -1.0]));
            hit.map_or('.', |hit| char::from(b'0' + ((2.0 - hit.t) * 6.0) as u8))
        });
        println!("{}", line.collect::<String>());
    }
}
