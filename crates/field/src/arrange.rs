//! Sorting. The standard library's sorts are compiled anew, in some ten kilobytes, for each type and each order that is asked for; a module
//! that is downloaded has one for all of them, of which only the comparison and the exchange are compiled anew. The order is the same.

use std::cmp::Ordering;

use rayon::prelude::*;

use crate::SMALL;

/// Slices that can be put in order.
pub trait Arrange<T> {
    /// In ascending order. Items that compare as equal must be the same: they may change places.
    fn arrange(&mut self)
    where
        T: Ord;

    /// In this order, by all threads. Items that compare as equal must be the same.
    fn arrange_together(&mut self, order: impl Fn(&T, &T) -> Ordering + Sync)
    where
        T: Send;

    /// In this order; items that compare as equal stay in theirs.
    fn arrange_by(&mut self, order: impl FnMut(&T, &T) -> Ordering);

    /// In ascending order of a key; items with equal keys stay in theirs.
    fn arrange_by_key<K: Ord>(&mut self, mut key: impl FnMut(&T) -> K) {
        self.arrange_by(|a, b| key(a).cmp(&key(b)));
    }
}

impl<T> Arrange<T> for [T] {
    fn arrange(&mut self)
    where
        T: Ord,
    {
        if SMALL { small(self, &mut T::cmp) } else { self.sort_unstable() }
    }

    fn arrange_together(&mut self, order: impl Fn(&T, &T) -> Ordering + Sync)
    where
        T: Send,
    {
        if SMALL { small(self, &mut |a, b| order(a, b)) } else { self.par_sort_unstable_by(order) }
    }

    fn arrange_by(&mut self, mut order: impl FnMut(&T, &T) -> Ordering) {
        if SMALL { small(self, &mut order) } else { self.sort_by(order) }
    }
}

/// The number in the middle, or the upper of two.
pub fn median(numbers: &mut [f64]) -> Option<f64> {
    let middle = numbers.len() / 2;
    if numbers.is_empty() {
        None
    } else if SMALL {
        numbers.arrange_by(f64::total_cmp);
        Some(numbers[middle])
    } else {
        Some(*numbers.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}

/// Up to so many items are inserted one by one, without working memory.
const FEW: usize = 16;

fn small<T>(items: &mut [T], order: &mut dyn FnMut(&T, &T) -> Ordering) {
    if items.len() <= FEW {
        for end in 1..items.len() {
            let mut at = end;
            while at > 0 && order(&items[at], &items[at - 1]) == Ordering::Less {
                items.swap(at, at - 1);
                at -= 1;
            }
        }
        return;
    }
    let mut from =
        merged(items.len(), &mut |a, b| order(&items[a as usize], &items[b as usize]) != Ordering::Greater);
    // Around each cycle of places.
    for start in 0..from.len() {
        let mut at = start;
        loop {
            let next = std::mem::replace(&mut from[at], at as u32) as usize;
            if next == start {
                break;
            }
            items.swap(at, next);
            at = next;
        }
    }
}

/// The present places of `n` items in ascending order, given whether one may stand before another.
#[inline(never)]
fn merged(n: usize, before: &mut dyn FnMut(u32, u32) -> bool) -> Vec<u32> {
    let mut places: Vec<u32> = (0..n as u32).collect();
    let mut other = places.clone();
    let mut width = 1;
    while width < n {
        for lo in (0..n).step_by(2 * width) {
            let (middle, hi) = ((lo + width).min(n), (lo + 2 * width).min(n));
            let (mut a, mut b) = (lo, middle);
            for out in &mut other[lo..hi] {
                let first = b == hi || (a < middle && before(places[a], places[b]));
                let taken = if first { &mut a } else { &mut b };
                *out = places[*taken];
                *taken += 1;
            }
        }
        std::mem::swap(&mut places, &mut other);
        width *= 2;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::{merged, small};

    /// Keys with many ties, and where each was.
    fn items(n: u64) -> Vec<(u64, u64)> {
        (0..n).map(|i| (i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 58, i)).collect()
    }

    #[test]
    fn the_small_sort_gives_the_order_of_the_standard_one() {
        for n in [0, 1, 2, 3, 15, 16, 17, 31, 32, 33, 100, 1000] {
            let mut expected = items(n);
            expected.sort_by_key(|v| v.0);
            let mut given = items(n);
            small(&mut given, &mut |a, b| a.0.cmp(&b.0));
            assert_eq!(given, expected, "{n} items");
        }
    }

    #[test]
    fn places_in_order_are_kept() {
        assert_eq!(merged(20, &mut |_, _| true), (0..20).collect::<Vec<u32>>());
    }
}
