//! What a build borrows from its caller: threads, and an ear for how far it is.

#![allow(unsafe_code, reason = "tasks take elements of one slice apart")]

use core::cell::Cell;
use core::ops::Range;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::kinds::THREADS;

/// The caller's threads, lent to a build.
pub trait Threads: Sync {
    /// How many tasks may run at once. With one, nothing is lent.
    fn worker_count(&self) -> usize;

    /// Calls `task(i)` for each `i` below `count`, in any order and on any thread, and returns when
    /// all are done. Tasks never block and never nest.
    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync));
}

/// Parts at most into which work is shared out.
pub(crate) const PARTS: usize = 64;

/// The caller, as a build in progress sees it.
pub(crate) struct Caller<'a> {
    threads: Option<&'a dyn Threads>,
    /// How many tasks run at once, at least one.
    worker_count: usize,
    progress: Option<&'a dyn Fn(f32) -> bool>,
    /// How much was said to be done.
    told: Cell<f32>,
    cancelled: Cell<bool>,
}

impl<'a> Caller<'a> {
    pub fn new(
        threads: Option<&'a dyn Threads>,
        progress: Option<&'a dyn Fn(f32) -> bool>,
    ) -> Caller<'a> {
        // Where a processor cannot tell which task was first, none are lent.
        let threads = threads.filter(|_| cfg!(target_has_atomic = "32"));
        // Asked once, as an answer may change.
        let worker_count = threads.map_or(1, |threads| threads.worker_count().clamp(1, PARTS));
        let threads = threads.filter(|_| worker_count > 1);
        Caller {
            threads,
            worker_count,
            progress,
            told: Cell::new(0.0),
            cancelled: Cell::new(false),
        }
    }

    /// Says how much is done, from 0 to 1, or no less than before; `None` when the caller wants no more.
    pub fn done(&self, part: f32) -> Option<()> {
        let part = if part > self.told.get() { part } else { self.told.get() };
        self.told.set(part);
        let goes_on = !self.cancelled() && self.progress.is_none_or(|progress| progress(part));
        self.cancelled.set(!goes_on);
        goes_on.then_some(())
    }

    /// Whether the caller wanted no more.
    pub fn cancelled(&self) -> bool {
        self.cancelled.get()
    }

    /// The size of the parts into which `count` things are shared out: a multiple of `grain`, and large enough
    /// for [`PARTS`] to be all. It depends on the threads, so what is made of the parts must not depend on it.
    pub fn part_size(&self, count: usize, grain: usize) -> usize {
        let (count, grain) = (count.div_ceil(self.part_count().max(1)), grain.max(1));
        count.next_multiple_of(grain).max(grain)
    }

    /// How many tasks run at once, at most [`PARTS`].
    pub fn worker_count(&self) -> usize {
        if THREADS { self.worker_count } else { 1 }
    }

    /// A good number of parts for the threads there are, at most [`PARTS`].
    pub fn part_count(&self) -> usize {
        if self.threads().is_some() { (4 * self.worker_count).min(PARTS) } else { 1 }
    }

    /// Gives `take` what `work` makes of each part of `0..count`, in order; at most [`PARTS`] of this size.
    pub fn for_parts<T: Send>(
        &self,
        count: usize,
        size: usize,
        work: impl Fn(Range<usize>) -> T + Sync,
        mut take: impl FnMut(T),
    ) {
        if self.threads().is_none() {
            let mut start = 0;
            while start < count {
                let end = count.min(start + size);
                take(work(start..end));
                start = end;
            }
            return;
        }
        let mut parts = [const { None }; PARTS];
        for (i, part) in parts.iter_mut().enumerate().take(count.div_ceil(size.max(1))) {
            *part = Some((i * size..count.min((i + 1) * size), None));
        }
        self.for_each(&mut parts, |part| {
            if let Some((range, made)) = part {
                *made = Some(work(range.clone()));
            }
        });
        parts.into_iter().flatten().filter_map(|(_, made)| made).for_each(take);
    }

    /// The threads that are lent.
    fn threads(&self) -> Option<&'a dyn Threads> {
        self.threads.filter(|_| THREADS)
    }

    /// Calls `work` with each item: on the caller's threads, if there are any.
    ///
    /// Neither what is called nor its result depends on how many threads there are.
    pub fn for_each<T: Send>(&self, items: &mut [T], work: impl Fn(&mut T) + Sync) {
        let Some(threads) = self.threads().filter(|_| items.len() > 1) else {
            return items.iter_mut().for_each(work);
        };
        for items in items.chunks_mut(Taken::MOST) {
            let count = items.len();
            let (taken, items) = (Taken::default(), Items(items.as_mut_ptr()));
            let task = |i: u32| {
                if (i as usize) < count && taken.take(i) {
                    // SAFETY: below `count`, so an element of the slice that `chunks_mut` lent; and
                    // taken just now, which happens once, so nobody else has it.
                    work(unsafe { &mut *items.at(i as usize) });
                }
            };
            threads.parallel_for(count as u32, &task);
            // What was left out, if anything was.
            (0..count as u32).for_each(task);
        }
    }
}

/// Elements that are handed out one by one.
struct Items<T>(*mut T);

// SAFETY: an element is handed to one thread at a time, which `T: Send` allows.
unsafe impl<T: Send> Sync for Items<T> {}

impl<T> Items<T> {
    fn at(&self, i: usize) -> *mut T {
        self.0.wrapping_add(i)
    }
}

/// Which elements are taken, one bit each.
#[derive(Default)]
struct Taken([AtomicU32; 4]);

impl Taken {
    const MOST: usize = 128;

    /// True for the first who asks for `i`, below [`MOST`](Self::MOST).
    fn take(&self, i: u32) -> bool {
        let bit = 1 << (i % 32);
        let word = self.0.get(i as usize / 32);
        word.is_some_and(|word| set(word, bit) & bit == 0)
    }
}

/// Sets a bit; returns what was there before.
#[cfg(target_has_atomic = "32")]
fn set(word: &AtomicU32, bit: u32) -> u32 {
    word.fetch_or(bit, Ordering::Relaxed)
}

/// The same on processors that cannot do that in one step, on which no threads are lent.
#[cfg(not(target_has_atomic = "32"))]
fn set(word: &AtomicU32, bit: u32) -> u32 {
    let before = word.load(Ordering::Relaxed);
    word.store(before | bit, Ordering::Relaxed);
    before
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// So many tasks at once, one after the other.
    pub(crate) struct Tasks(pub usize);

    impl Threads for Tasks {
        fn worker_count(&self) -> usize {
            self.0
        }

        fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
            (0..count).rev().for_each(task);
        }
    }

    /// Runs tasks in an order of its own: backwards, some twice, some not at all.
    struct Odd;

    impl Threads for Odd {
        fn worker_count(&self) -> usize {
            3
        }

        fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
            for i in (0..count + 5).rev().filter(|i| i % 7 != 3) {
                task(i);
                task(i);
            }
        }
    }

    #[test]
    fn each_item_is_worked_on_once_whatever_the_caller_does() {
        for count in [0, 1, 2, 127, 128, 129, 1000] {
            let mut items = std::vec![0; count];
            Caller::new(Some(&Odd), None).for_each(&mut items, |item| *item += 1);
            assert!(items.iter().all(|n| *n == 1), "{count}");
        }
    }

    /// Says every time that there are fewer.
    struct Fewer(AtomicU32);

    impl Threads for Fewer {
        fn worker_count(&self) -> usize {
            3 - self.0.fetch_add(1, Ordering::Relaxed).min(3) as usize
        }

        fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
            (0..count).for_each(task);
        }
    }

    #[test]
    fn threads_are_counted_once_and_progress_does_not_fall() {
        let fewer = Fewer(AtomicU32::new(0));
        let caller = Caller::new(Some(&fewer), None);
        assert_eq!([caller.worker_count(), caller.worker_count(), caller.part_count()], [3, 3, 12]);
        let told = Cell::new(0.0);
        let progress = |part| {
            assert!(part >= told.get());
            told.set(part);
            true
        };
        let caller = Caller::new(None, Some(&progress));
        assert!([0.1, 0.6, 0.1, 0.85].map(|part| caller.done(part)) == [Some(()); 4]);
        assert!(told.get() == 0.85);
    }

    #[test]
    fn who_cancels_is_asked_no_more() {
        let asked = Cell::new(0);
        let progress = |_: f32| {
            asked.set(asked.get() + 1);
            asked.get() < 2
        };
        let caller = Caller::new(None, Some(&progress));
        assert_eq!([0.1, 0.2, 0.3].map(|part| caller.done(part).is_some()), [true, false, false]);
        assert!(caller.cancelled() && asked.get() == 2);
    }

    #[test]
    fn parts_are_all_there_in_order() {
        for caller in [Caller::new(None, None), Caller::new(Some(&Odd), None)] {
            for count in [0, 1, 9, 10, 1000, 100_003] {
                let size = caller.part_size(count, 10);
                let mut end = 0;
                let take = |part: Range<usize>| {
                    assert!(part.start == end && (part.len() == size || part.end == count));
                    end = part.end;
                };
                caller.for_parts(count, size, |part| part, take);
                assert_eq!(end, count);
            }
        }
    }
}
