//! Smooth noise in space, without tables.

/// Value noise in `-1 ..= 1`: random values at the points of the integer lattice, blended by a
/// quintic in between, so that normals are continuous.
pub fn noise(p: [f64; 3], seed: u64) -> f64 {
    let cell = p.map(f64::floor);
    let weight: [f64; 3] = std::array::from_fn(|k| fade(p[k] - cell[k]));
    let mut sum = 0.0;
    for corner in 0..8usize {
        let side: [usize; 3] = std::array::from_fn(|k| corner >> k & 1);
        let mut share = 1.0;
        for k in 0..3 {
            share *= if side[k] == 1 { weight[k] } else { 1.0 - weight[k] };
        }
        sum += share * lattice(std::array::from_fn(|k| cell[k] as i64 + side[k] as i64), seed);
    }
    sum
}

/// `octaves` layers of [`noise`], each twice as fine and half as strong as the one before.
pub fn fractal(p: [f64; 3], octaves: u32, seed: u64) -> f64 {
    (0..octaves)
        .map(|i| {
            let scale = f64::from(1u32 << i);
            noise(p.map(|x| x * scale), seed + u64::from(i)) / scale
        })
        .sum()
}

fn fade(x: f64) -> f64 {
    x * x * x * (x * (x * 6.0 - 15.0) + 10.0)
}

fn lattice(cell: [i64; 3], seed: u64) -> f64 {
    let mut hash = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for x in cell {
        hash = (hash ^ x as u64).wrapping_mul(0xd6e8_feb8_6659_fd93);
        hash ^= hash >> 32;
    }
    (hash >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
