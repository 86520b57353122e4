//! Whether rays that are alike had better go together.

/// What packets cost, and what their rays would cost as a stream, by what one of them costs there at a bundle.
///
/// Where primitives are small, or many boxes overlap, rays that are alike have little in common but the way: then all are tested
/// against what one of them enters. The weights are measured: see `docs/METHODS.md`.
#[derive(Default)]
pub(super) struct Work {
    together: u64,
    apart: u64,
    /// Of sixteen rays, in the packet at hand.
    groups: u64,
}

/// A packet counts as long as so many follow it: one alone says little, as of rays past the edge of something few go on.
const PACKETS: u64 = 8;

/// Packets that cost less cannot be far too slow.
const LEAST: u64 = 240;

impl Work {
    /// A packet of so many rays sets out.
    #[inline(always)]
    pub fn set_out(&mut self, rays: usize) {
        let Work { together, apart, .. } = *self;
        let groups = rays.div_ceil(16) as u64;
        let (together, apart) = (together - together / PACKETS, apart - apart / PACKETS);
        // One by one it takes more to prepare them.
        *self = Work { together, apart: apart + rays as u64, groups };
    }

    /// All are tested against so many boxes, into which those of one group go so many times: a sample of all.
    #[inline(always)]
    pub fn at_bundle(&mut self, tests: u32, visits: u32) {
        self.together += 4 * u64::from(tests);
        self.apart += self.groups * u64::from(visits);
    }

    /// These rays of sixteen come to a leaf.
    #[inline(always)]
    pub fn at_leaf(&mut self, rays: u32) {
        self.together += 15;
        self.apart += 3 * u64::from(rays.count_ones()) / 2;
    }

    /// Whether a stream had better follow.
    #[inline(always)]
    pub fn is_thin(&self) -> bool {
        self.together > PACKETS * LEAST && 10 * self.together > 11 * self.apart
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet of 64 rays, by how many boxes it is tested against, how many of them a ray enters, how many groups come to leaves, and
    /// how many rays of each.
    fn packet(work: &mut Work, [tests, entered, looks, rays]: [u32; 4]) {
        work.set_out(64);
        work.at_bundle(tests, 16 * entered);
        (0..looks).for_each(|_| work.at_leaf((1 << rays) - 1));
    }

    #[test]
    fn packets_are_thin_together() {
        let (hair, building) = ([303, 20, 155, 4], [21, 8, 8, 12]);
        let mut work = Work::default();
        for _ in 0..20 {
            packet(&mut work, building);
            assert!(!work.is_thin());
        }
        // Past an edge: costly, but one among many.
        packet(&mut work, [100, 1, 20, 1]);
        assert!(!work.is_thin());
        for _ in 0..8 {
            packet(&mut work, hair);
        }
        assert!(work.is_thin());
        for _ in 0..20 {
            packet(&mut work, building);
        }
        assert!(!work.is_thin());
        // Cheap ones are let be, however thin.
        (0..20).for_each(|_| packet(&mut work, [40, 0, 0, 0]));
        assert!(!work.is_thin());
    }
}
