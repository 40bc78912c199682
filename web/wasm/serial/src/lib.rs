//! The calls of rayon that the core makes, carried out one after the other.
//!
//! A module of WebAssembly has one thread, and the core's results do not depend on how many there are: rayon would only be half a
//! megabyte of queues and of code that splits work. `par_iter` and its kin give std's own iterators here, whose `map`, `zip`,
//! `enumerate`, `collect` … do what rayon's do; the traits below add the calls that std has not. A call that is missing does
//! not compile.

/// Both, the first first.
#[inline(always)]
pub fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    (a(), b())
}

/// What `use rayon::prelude::*` brings.
pub mod prelude {
    pub use crate::{
        IntoParallelIterator, IntoParallelRefIterator, IntoParallelRefMutIterator, ParallelExtend,
        ParallelIterator, ParallelSlice, ParallelSliceMut,
    };
}

/// `into_par_iter` of what std can iterate over.
pub trait IntoParallelIterator: IntoIterator + Sized {
    /// std's iterator.
    #[inline(always)]
    fn into_par_iter(self) -> Self::IntoIter {
        self.into_iter()
    }
}

impl<T: IntoIterator> IntoParallelIterator for T {}

/// `par_iter` of slices.
pub trait IntoParallelRefIterator<T> {
    /// std's iterator.
    fn par_iter(&self) -> std::slice::Iter<'_, T>;
}

impl<T> IntoParallelRefIterator<T> for [T] {
    #[inline(always)]
    fn par_iter(&self) -> std::slice::Iter<'_, T> {
        self.iter()
    }
}

/// `par_iter_mut` of slices.
pub trait IntoParallelRefMutIterator<T> {
    /// std's iterator.
    fn par_iter_mut(&mut self) -> std::slice::IterMut<'_, T>;
}

impl<T> IntoParallelRefMutIterator<T> for [T] {
    #[inline(always)]
    fn par_iter_mut(&mut self) -> std::slice::IterMut<'_, T> {
        self.iter_mut()
    }
}

/// What rayon's iterators have and std's have not.
pub trait ParallelIterator: Iterator + Sized {
    /// How finely to split: not at all.
    #[inline(always)]
    fn with_min_len(self, _: usize) -> Self {
        self
    }

    /// `flat_map`.
    #[inline(always)]
    fn flat_map_iter<U: IntoIterator, F: FnMut(Self::Item) -> U>(
        self,
        f: F,
    ) -> std::iter::FlatMap<Self, U, F> {
        self.flat_map(f)
    }

    /// `map` with something to work in, which all items share.
    #[inline(always)]
    fn map_init<T, R>(
        self,
        init: impl FnOnce() -> T,
        mut f: impl FnMut(&mut T, Self::Item) -> R,
    ) -> impl Iterator<Item = R> {
        let mut desk = init();
        self.map(move |item| f(&mut desk, item))
    }

    /// `for_each` with something to work in, which all items share.
    #[inline(always)]
    fn for_each_init<T>(self, init: impl FnOnce() -> T, mut f: impl FnMut(&mut T, Self::Item)) {
        let mut desk = init();
        self.for_each(|item| f(&mut desk, item));
    }
}

impl<I: Iterator> ParallelIterator for I {}

/// `par_extend` of vectors.
pub trait ParallelExtend<T> {
    /// `extend`.
    fn par_extend(&mut self, items: impl IntoIterator<Item = T>);
}

impl<T> ParallelExtend<T> for Vec<T> {
    #[inline(always)]
    fn par_extend(&mut self, items: impl IntoIterator<Item = T>) {
        self.extend(items);
    }
}

/// `par_chunks` of slices.
pub trait ParallelSlice<T> {
    /// `chunks`.
    fn par_chunks(&self, size: usize) -> std::slice::Chunks<'_, T>;
}

impl<T> ParallelSlice<T> for [T] {
    #[inline(always)]
    fn par_chunks(&self, size: usize) -> std::slice::Chunks<'_, T> {
        self.chunks(size)
    }
}

/// `par_chunks_mut` and the sorts of slices.
pub trait ParallelSliceMut<T> {
    /// `chunks_mut`.
    fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T>;

    /// `sort_unstable`.
    fn par_sort_unstable(&mut self)
    where
        T: Ord;

    /// `sort_unstable_by`.
    fn par_sort_unstable_by(&mut self, compare: impl FnMut(&T, &T) -> std::cmp::Ordering);
}

impl<T> ParallelSliceMut<T> for [T] {
    #[inline(always)]
    fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T> {
        self.chunks_mut(size)
    }

    #[inline(always)]
    fn par_sort_unstable(&mut self)
    where
        T: Ord,
    {
        self.sort_unstable();
    }

    #[inline(always)]
    fn par_sort_unstable_by(&mut self, compare: impl FnMut(&T, &T) -> std::cmp::Ordering) {
        self.sort_unstable_by(compare);
    }
}
