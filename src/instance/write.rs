//! Writes the parts of a block that belong to its instances.

use super::boxes::{Placed, Placing};
use crate::block::level::{InstanceRecord, LevelHead, LevelMut, LevelOffsets};
use crate::block::seal_level;
use crate::math::{Aabb, heap_sort};
use crate::scene::Boxes;
use crate::simd::SMALL;

/// The bytes that head, records and children take at most.
pub(crate) fn fixed_size(instances: usize) -> Option<usize> {
    LevelOffsets::new(0, instances, instances).map(|at| at.index)
}

/// Writes what belongs to the instances behind the own primitives, which end at byte `own`: records and children, and the
/// index by `build_index` over the boxes of these, which returns its size. Returns the size of the whole block. `None` when it
/// does not fit, or when `build_index` fails.
pub(crate) fn write(
    placed: &Placed,
    own: usize,
    bytes: &mut [u8],
    build_index: impl FnOnce(&Recorded, &mut [u8]) -> Option<usize>,
) -> Option<usize> {
    let instances = placed.count();
    // Until it is known how many are the same there is a child for each.
    let widest = LevelOffsets::new(own, instances, instances)?;
    let LevelMut { children, .. } = widest.parts_mut(bytes, instances, instances)?;
    let child_count = list_children(placed, children);
    let at = LevelOffsets::new(own, instances, child_count)?;
    let LevelMut { head, instances: records, children, rest } =
        at.parts_mut(bytes, instances, child_count)?;
    *head = LevelHead {
        bounds: placed.bounds,
        instance_count: instances as u32,
        child_count: child_count as u32,
        is_linked: 1,
        calm: placed.calm,
        spread: placed.spread,
        reserved: [0; 5],
    };
    for (i, record) in records.iter_mut().enumerate() {
        let placing = placed.get(i)?;
        let child = children.binary_search(&address(&placing)).ok()?;
        *record = InstanceRecord {
            world_to_object: placing.map.columns(),
            child: child as u32,
            mask: placing.mask,
            object_to_world: placing.map.object_to_world,
            bounds: placed.aabb_of(&placing),
        };
    }
    rest.fill(0);
    let size = at.index + build_index(&Recorded(records), rest)?;
    zero_gaps(&at, instances, child_count, bytes)?;
    seal_level(bytes, size)?;
    Some(size)
}

/// Boxes that stand in records: those of maps take a while to compute, and a builder asks for each several times.
pub(crate) struct Recorded<'b>(&'b [InstanceRecord]);

impl Boxes for Recorded<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn aabb(&self, i: usize) -> Aabb {
        self.0.get(i).map_or(Aabb::EMPTY, |record| record.bounds)
    }
}

/// Writes the addresses of the children, rising, each once; returns their number.
fn list_children(placed: &Placed, children: &mut [u64]) -> usize {
    for (i, child) in children.iter_mut().enumerate() {
        *child = placed.child(i).map_or(0, |child| child.expose_provenance() as u64);
    }
    if SMALL {
        heap_sort(children)
    } else {
        children.sort_unstable()
    }
    let (mut count, mut last) = (0, None);
    for i in 0..children.len() {
        let child = children.get(i).copied();
        if child != last
            && let (Some(child), Some(place)) = (child, children.get_mut(count))
        {
            *place = child;
            count += 1;
        }
        last = child;
    }
    count
}

fn address(placing: &Placing) -> u64 {
    placing.bytes().expose_provenance() as u64
}

/// The bytes between the parts are zero in every block.
fn zero_gaps(at: &LevelOffsets, instances: usize, children: usize, bytes: &mut [u8]) -> Option<()> {
    let ends = [
        (at.instances + instances * size_of::<InstanceRecord>(), at.children),
        (at.children + children * size_of::<u64>(), at.index),
    ];
    for (end, next) in ends {
        bytes.get_mut(end..next)?.fill(0);
    }
    Some(())
}
