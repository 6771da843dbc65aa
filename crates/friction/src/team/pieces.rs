//! Arrays of which several threads change pieces at once.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Range};
use std::sync::atomic::{AtomicBool, Ordering};

/// A slice that is cut into pieces. Threads take runs of neighbouring pieces, and give them back.
pub struct Pieces<'a, T> {
    data: *mut T,
    /// Where each piece begins, and the end.
    cuts: &'a [usize],
    taken: &'a [AtomicBool],
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: `data` is a slice that this borrows alone, and a piece of it is given to one thread at a time (`take`), as if the
// slice were split between them: that needs elements which may be sent to other threads, no more.
unsafe impl<T: Send> Sync for Pieces<'_, T> {}
unsafe impl<T: Send> Send for Pieces<'_, T> {}

impl<'a, T> Pieces<'a, T> {
    /// Cuts `slice` at `cuts`, ascending from 0 to its length. `taken`, with an entry a piece at least, says which are in use.
    pub fn new(slice: &'a mut [T], cuts: &'a [usize], taken: &'a mut [AtomicBool]) -> Self {
        assert!(cuts.is_sorted() && cuts.first() == Some(&0) && cuts.last() == Some(&slice.len()));
        assert!(taken.len() + 1 >= cuts.len());
        taken.iter_mut().for_each(|taken| *taken.get_mut() = false);
        Self { data: slice.as_mut_ptr(), cuts, taken, slice: PhantomData }
    }

    /// Takes neighbouring pieces.
    ///
    /// # Panics
    /// If any of them is in use.
    pub fn take(&self, pieces: Range<usize>) -> Taken<'_, T> {
        let (first, end) = (self.cuts[pieces.start], self.cuts[pieces.end]);
        let taken = &self.taken[pieces];
        for (k, flag) in taken.iter().enumerate() {
            if flag.swap(true, Ordering::Acquire) {
                // Those that it has got are given back.
                taken[..k].iter().for_each(|flag| flag.store(false, Ordering::Release));
                panic!("a piece is in use");
            }
        }
        // SAFETY: `first..end` lies within the slice, as the cuts ascend from 0 to its length (`new`). No other reference to it
        // exists: the slice is borrowed by `self` alone, runs with a piece in common are not taken at the same time (the flags
        // above, given back only when `Taken` is dropped), and pieces do not overlap. What another thread wrote to them is seen, as
        // it gave them back with `Release` and they are taken with `Acquire`.
        let slice = unsafe { std::slice::from_raw_parts_mut(self.data.add(first), end - first) };
        Taken { slice, first, taken }
    }
}

/// Neighbouring pieces of an array; dropped, they are given back.
pub struct Taken<'a, T> {
    slice: &'a mut [T],
    /// Their place in the array.
    pub(crate) first: usize,
    taken: &'a [AtomicBool],
}

impl<T> Drop for Taken<'_, T> {
    fn drop(&mut self) {
        self.taken.iter().for_each(|flag| flag.store(false, Ordering::Release));
    }
}

impl<T> Deref for Taken<'_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.slice
    }
}

impl<T> DerefMut for Taken<'_, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.slice
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_given_once_at_a_time() {
        let mut numbers = [0, 1, 2, 3, 4];
        let mut taken = [const { AtomicBool::new(false) }; 3];
        let pieces = Pieces::new(&mut numbers, &[0, 2, 2, 5], &mut taken);
        let mut last = pieces.take(2..3);
        last[0] = 7;
        assert_eq!(&*pieces.take(0..2), [0, 1]);
        let again = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| pieces.take(0..3).len()));
        assert!(again.is_err());
        drop(last);
        let all = pieces.take(0..3);
        assert_eq!((&*all, all.first), (&[0, 1, 7, 3, 4][..], 0));
    }
}
