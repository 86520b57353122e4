//! How to spend a scene's share of the time.

/// What each round does.
#[derive(Debug, PartialEq)]
pub struct Plan {
    /// How often every structure is measured.
    pub rounds: usize,
    /// For each structure how many pixels a round renders; `None` is the whole picture.
    pub pixels: Vec<Option<usize>>,
}

/// The fewest rounds whose spread is worth an interval.
const FEWEST: f64 = 3.0;

/// Plans for structures that need `seconds[i]` for a whole picture of `pixel_count` pixels.
///
/// As many whole pictures as wanted, if `share` seconds allow it; else fewer, but at least three;
/// else the slow structures render a sample of the pixels, another in each round, in half the
/// time, and the fast ones whole pictures in the other half.
pub fn plan(seconds: &[f64], pixel_count: usize, wanted: u32, share: f64) -> Plan {
    let all: f64 = seconds.iter().sum();
    let affordable = (share / all).floor();
    if affordable >= FEWEST.min(f64::from(wanted)) {
        let rounds = affordable.min(f64::from(wanted)) as usize;
        return Plan { rounds, pixels: vec![None; seconds.len()] };
    }
    let allowance = 0.5 * share / seconds.len() as f64;
    let is_fast = |&s: &f64| FEWEST.min(f64::from(wanted)) * s <= allowance;
    let fast: f64 = seconds.iter().filter(|s| is_fast(s)).sum();
    let slow = all - fast;
    let (rounds, slow_share) = if fast > 0.0 {
        ((0.5 * share / fast).floor().min(f64::from(wanted)), 0.5 * share)
    } else {
        (f64::from(wanted), share)
    };
    let fraction = slow_share / (rounds * slow);
    let sample = ((pixel_count as f64 * fraction) as usize).clamp(1, pixel_count);
    let pixels = seconds.iter().map(|s| (!is_fast(s)).then_some(sample)).collect();
    Plan { rounds: rounds as usize, pixels }
}

/// All pixels in an order of which every stretch is spread evenly over the picture.
pub fn scattered(pixel_count: usize) -> Vec<u32> {
    // Steps near the golden section spread best; coprime ones come past every pixel once.
    let mut step = (pixel_count as f64 * 0.618_033_988_75) as usize;
    while step > 1 && gcd(step, pixel_count) != 1 {
        step -= 1;
    }
    let step = step.max(1);
    let mut at = 0;
    (0..pixel_count)
        .map(|_| {
            let pixel = at as u32;
            at = (at + step) % pixel_count;
            pixel
        })
        .collect()
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_decides_what_is_shortened() {
        let whole = |rounds| Plan { rounds, pixels: vec![None, None] };
        assert_eq!(plan(&[1.0, 1.0], 100, 10, 60.0), whole(10));
        assert_eq!(plan(&[9.0, 1.0], 100, 10, 60.0), whole(6));
        let sampled = plan(&[300.0, 1.0], 1000, 10, 60.0);
        assert_eq!(sampled, Plan { rounds: 10, pixels: vec![Some(10), None] });
        let both = plan(&[600.0, 600.0], 1000, 10, 60.0);
        assert_eq!(both.pixels, [Some(5), Some(5)]);
        assert_eq!(plan(&[50.0, 1.0], 100, 1, 60.0).rounds, 1);
    }

    #[test]
    fn a_scattered_order_has_every_pixel_once() {
        for count in [1, 2, 3, 10, 640, 1920 * 1080] {
            let mut order = scattered(count);
            order.sort_unstable();
            assert!(order.iter().enumerate().all(|(i, &p)| i == p as usize), "{count}");
        }
    }
}
