//! Long tests by all processors.

use std::sync::Mutex;
use std::thread;

/// What `task` makes of each of `items`, several at once, in their order. The first panic is passed on.
pub fn map<T, R, I>(items: I, task: impl Fn(T) -> R + Sync) -> Vec<R>
where
    R: Send,
    I: IntoIterator<Item = T>,
    I::IntoIter: Send,
{
    let items = Mutex::new(items.into_iter().enumerate());
    let next = || items.lock().expect("items that can be listed").next();
    let work = || -> Vec<_> {
        std::iter::from_fn(next).map(|(place, item)| (place, task(item))).collect()
    };
    let count = thread::available_parallelism().map_or(1, |n| n.get());
    let mut made = thread::scope(|scope| {
        let workers: Vec<_> = (0..count).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().flat_map(|worker| {
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        done.collect::<Vec<_>>()
    });
    made.sort_by_key(|(place, _)| *place);
    made.into_iter().map(|(_, result)| result).collect()
}

/// Calls `task` for each of `items`, several at once.
pub fn each<T, I>(items: I, task: impl Fn(T) + Sync)
where
    I: IntoIterator<Item = T>,
    I::IntoIter: Send,
{
    map(items, task);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_in_order() {
        let tripled = map(0..10_000, |i| {
            thread::yield_now();
            3 * i
        });
        assert!(tripled.into_iter().eq((0..10_000).map(|i| 3 * i)));
    }

    #[test]
    #[should_panic(expected = "seven")]
    fn panics_are_passed_on() {
        each(0..100, |i| assert!(i != 7, "seven"));
    }
}
