//! Sorting in little code.

/// Sorts in place; equal ones are not told apart. For where there is little room: a fraction of the code of the standard library's,
/// which is faster, but has a panic for orders that are none.
pub(crate) fn heap_sort<T: Ord>(items: &mut [T]) {
    for place in (0..items.len() / 2).rev() {
        sink(items, place);
    }
    let mut heap = items;
    while let Some((last, rest)) = heap.split_last_mut() {
        if let Some(largest) = rest.first_mut() {
            core::mem::swap(largest, last);
        }
        sink(rest, 0);
        heap = rest;
    }
}

/// Restores the order of a heap, in which none is less than the two at twice its place and one or two more, for the one at `place`.
fn sink<T: Ord>(heap: &mut [T], mut place: usize) {
    loop {
        let first = 2 * place + 1;
        let child = first + usize::from(heap.get(first) < heap.get(first + 1));
        let Ok([parent, larger]) = heap.get_disjoint_mut([place, child]) else { return };
        if *larger <= *parent {
            return;
        }
        core::mem::swap(parent, larger);
        place = child;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn heaps_sort() {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            state >> 16
        };
        for count in (0..40).chain([1000, 1023, 1024]) {
            for range in [1, 3, 1 << 16] {
                let mut items: Vec<u32> = (0..count).map(|_| next() % range).collect();
                let mut sorted = items.clone();
                sorted.sort_unstable();
                heap_sort(&mut items);
                assert_eq!(items, sorted);
            }
        }
    }
}
