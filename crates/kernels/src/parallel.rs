//! Work on several threads: those of rayon's current pool with the feature `parallel`, the calling one alone without it.
//!
//! Fork and join by halves (Blumofe and Leiserson 1999). Which thread does what changes no bit of what comes of it.

/// Threads that can share work; 1 without the feature `parallel`.
pub fn threads() -> usize {
    #[cfg(feature = "parallel")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    1
}

/// Does both, side by side where a thread is free.
pub fn join<A: Send, B: Send>(one: impl FnOnce() -> A + Send, other: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    return rayon::join(one, other);
    #[cfg(not(feature = "parallel"))]
    (one(), other())
}

/// Works on all items, each with its index. Threads share them in pieces of up to `grain` items; with `None` the calling thread
/// does all of them, in order.
pub fn each<T: Send>(items: &mut [T], grain: Option<usize>, work: impl Fn(usize, &mut T) + Sync) {
    reduce(items, grain, work, |(), ()| ());
}

/// [`each`], with what comes of each item combined in order; `None` where there is none.
pub fn reduce<T: Send, R: Send>(
    items: &mut [T],
    grain: Option<usize>,
    work: impl Fn(usize, &mut T) -> R + Sync,
    combine: impl Fn(R, R) -> R + Sync,
) -> Option<R> {
    let grain = grain.filter(|_| threads() > 1).unwrap_or(usize::MAX).max(1);
    piece(0, items, grain, &work, &combine)
}

fn piece<T: Send, R: Send>(
    first: usize,
    items: &mut [T],
    grain: usize,
    work: &(impl Fn(usize, &mut T) -> R + Sync),
    combine: &(impl Fn(R, R) -> R + Sync),
) -> Option<R> {
    if items.len() <= grain {
        return items.iter_mut().enumerate().map(|(k, item)| work(first + k, item)).reduce(combine);
    }
    let half = items.len() / 2;
    let (items, others) = items.split_at_mut(half);
    match join(|| piece(first, items, grain, work, combine), || piece(first + half, others, grain, work, combine)) {
        (Some(one), Some(other)) => Some(combine(one, other)),
        (one, other) => one.or(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_item_is_worked_on_once_with_its_index_and_results_stay_in_order() {
        for (count, grain) in [(0, None), (1, Some(1)), (10, None), (100, Some(1)), (101, Some(8)), (7, Some(0))] {
            let mut items = vec![0; count];
            each(&mut items, grain, |index, item| *item += index + 1);
            assert!(items.iter().copied().eq(1..=count));
            let joined = reduce(&mut items, grain, |index, _| index.to_string(), |one, other| one + "," + &other);
            let expected = (0..count).map(|index| index.to_string()).collect::<Vec<_>>().join(",");
            assert_eq!(joined.unwrap_or_default(), expected);
        }
    }

    #[cfg(not(feature = "parallel"))]
    #[test]
    fn without_the_feature_there_is_one_thread() {
        assert_eq!(threads(), 1);
    }
}
