//! Long tests by all processors.

use rayon::prelude::*;

/// What `task` makes of each of `items`, several at once, in their order. A panic is passed on.
pub fn map<T: Send, R: Send>(
    items: impl IntoIterator<Item = T>,
    task: impl Fn(T) -> R + Sync + Send,
) -> Vec<R> {
    let items: Vec<_> = items.into_iter().collect();
    // One by one, as a few take much longer than others.
    items.into_par_iter().with_max_len(1).map(task).collect()
}

/// Calls `task` for each of `items`, several at once.
pub fn each<T: Send>(items: impl IntoIterator<Item = T>, task: impl Fn(T) + Sync + Send) {
    map(items, task);
}
