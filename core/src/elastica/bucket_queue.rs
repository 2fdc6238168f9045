//! The priority queue of a search: states by key.
//!
//! Most states that a search reaches are never settled, because their keys exceed the largest one it pops. So entries are
//! stored unsorted, in buckets by key, and only the bucket of the smallest keys is a heap (a calendar queue: Brown 1988).
//! Entries are popped in the same order as from one binary heap, for any sequence of keys. The states of a bucket are known
//! before the first of them is popped, so the memory that settling them reads can be prefetched.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::graph::State;

/// Number of mantissa bits of a key that select its bucket. With 128 buckets per doubling of the key a bucket holds some
/// hundred entries where an ordinary search ends; then the heap and most of what settling its states reads fit into the
/// processor's first caches.
const BUCKET_BITS: u32 = 7;

/// Keys up to this share the first bucket. A step on a surface of model size 1 costs more.
const LEAST_KEY: f32 = 1.0 / 1024.0;

/// States with non-negative keys. The smallest key is popped first; of equal keys, the smallest state.
#[derive(Debug, Default)]
pub(super) struct BucketQueue {
    /// The entries of all buckets up to `current`. An entry holds the bits of the key, which order like the key, above
    /// the state.
    near: BinaryHeap<Reverse<u64>>,
    /// The entries of each later bucket.
    far: Vec<Vec<u64>>,
    current: usize,
    /// Whether a bucket became the heap since [`Self::take_opened`] was last called.
    opened: bool,
}

/// The bucket of a key with the given bits.
#[inline]
fn bucket(key: u32) -> usize {
    const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - BUCKET_BITS;
    (key >> SHIFT).saturating_sub(LEAST_KEY.to_bits() >> SHIFT) as usize
}

impl BucketQueue {
    /// Removes all entries.
    pub(super) fn clear(&mut self) {
        self.near.clear();
        self.far.iter_mut().for_each(Vec::clear);
        (self.current, self.opened) = (0, false);
    }

    #[inline]
    pub(super) fn push(&mut self, key: f32, e: State) {
        let key = key.to_bits();
        let (entry, bucket) = (u64::from(key) << 32 | u64::from(e), bucket(key));
        if bucket <= self.current {
            self.near.push(Reverse(entry));
        } else if let Some(list) = self.far.get_mut(bucket) {
            list.push(entry);
        } else {
            self.extend(bucket, entry);
        }
    }

    #[cold]
    fn extend(&mut self, bucket: usize, entry: u64) {
        self.far.resize_with(bucket + 1, Vec::new);
        self.far[bucket].push(entry);
    }

    /// If the heap is empty, fills it with the next bucket that is not.
    #[inline]
    fn advance(&mut self) {
        while self.near.is_empty() && self.current + 1 < self.far.len() {
            self.current += 1;
            let list = &mut self.far[self.current];
            self.opened |= !list.is_empty();
            self.near.extend(list.drain(..).map(Reverse));
        }
    }

    /// The states of the bucket of the smallest keys, if it became the heap since the last call.
    #[inline]
    pub(super) fn take_opened(&mut self) -> Option<impl Iterator<Item = State>> {
        self.advance();
        let opened = std::mem::take(&mut self.opened);
        opened.then(|| self.near.iter().map(|Reverse(entry)| *entry as State))
    }

    /// Removes and returns the entry with the smallest key.
    #[inline]
    pub(super) fn pop(&mut self) -> Option<(f32, State)> {
        self.advance();
        let Reverse(entry) = self.near.pop()?;
        Some((f32::from_bits((entry >> 32) as u32), entry as State))
    }

    /// The entry with the smallest key.
    #[inline]
    pub(super) fn peek(&mut self) -> Option<(f32, State)> {
        self.advance();
        let Reverse(entry) = self.near.peek()?;
        Some((f32::from_bits((entry >> 32) as u32), *entry as State))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_popped_in_the_order_of_a_binary_heap() {
        let mut seed = 1u64;
        let mut random = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut queue = BucketQueue::default();
        for scale in [1e-6, 1.0, 300.0, f32::MAX / 2000.0] {
            queue.clear();
            let mut heap = BinaryHeap::new();
            for _ in 0..3000 {
                // Keys pushed need not increase, and many are equal.
                let (key, e) = (random(1000) as f32 * scale, random(50) as State);
                queue.push(key, e);
                heap.push(Reverse((key.to_bits(), e)));
                let Reverse((least, first)) = *heap.peek().unwrap();
                assert_eq!(queue.peek(), Some((f32::from_bits(least), first)));
                if random(3) == 0 {
                    let Reverse((key, e)) = heap.pop().unwrap();
                    assert_eq!(queue.pop(), Some((f32::from_bits(key), e)));
                }
            }
            while let Some(Reverse((key, e))) = heap.pop() {
                assert_eq!(queue.pop(), Some((f32::from_bits(key), e)));
            }
            assert_eq!((queue.pop(), queue.peek()), (None, None));
        }
    }

    #[test]
    fn a_bucket_is_reported_once_before_its_states_are_popped() {
        let mut queue = BucketQueue::default();
        let keys = [1.0, 1.001, 2.0, 5.0];
        (0..).zip(keys).for_each(|(e, key)| queue.push(key, e));
        let opened = |queue: &mut BucketQueue| queue.take_opened().map(|states| states.collect::<Vec<_>>());
        let mut first = opened(&mut queue).unwrap();
        first.sort_unstable();
        assert_eq!((first, opened(&mut queue)), (vec![0, 1], None));
        assert_eq!((queue.pop(), queue.pop()), (Some((1.0, 0)), Some((1.001, 1))));
        assert_eq!(opened(&mut queue), Some(vec![2]));
    }
}
