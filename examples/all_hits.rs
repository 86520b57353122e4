//! Light through coloured glass: all hits along a ray, and how much of it each pane lets through.
//!
//! ```sh
//! cargo run --example all_hits
//! ```

use raykern::{BuildError, BuildOptions, Hit, Mesh, OwnedAccel, QueryOptions, Ray, Scene};

fn main() -> Result<(), BuildError> {
    // Five panes of two triangles each, one behind the other.
    let pane = |z: f32| {
        let [a, b, c, d] = [[-1.0, -1.0, z], [1.0, -1.0, z], [1.0, 1.0, z], [-1.0, 1.0, z]];
        [[a, b, c], [a, c, d]]
    };
    let triangles: Vec<_> = (0..5u8).flat_map(|i| pane(f32::from(i))).collect();
    let meshes = [Mesh::soup(&triangles)];
    let built = OwnedAccel::bvh(&Scene::new(&meshes, &[]), &BuildOptions::default())?;
    let accel = built.accel();

    let ray = Ray::new([0.5, 0.25, -1.0], [0.0, 0.0, 1.0]);
    let mut light = 1.0;
    for hit in accel.hits(&ray, &QueryOptions::default()) {
        light *= 0.8;
        println!(
            "t = {}: triangle {}, {:.0} % of the light is left",
            hit.t,
            hit.prim,
            100.0 * light
        );
    }

    // The nearest two in one search, which does not look beyond them.
    let mut nearest = [Hit::MISS; 2];
    assert_eq!(accel.nearest_hits(&ray, &QueryOptions::default(), &mut nearest), 2);
    assert_eq!(nearest.map(|hit| hit.t), [1.0, 2.0]);

    // Along the diagonals both triangles of each pane are met.
    let diagonal = Ray::new([0.25, 0.25, -1.0], [0.0, 0.0, 1.0]);
    assert_eq!(accel.hits(&diagonal, &QueryOptions::default()).count(), 10);
    Ok(())
}
