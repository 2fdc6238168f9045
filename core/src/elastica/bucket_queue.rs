//! The queue of a search: states in the order of a key.
//!
//! Of the states that a search reaches, most are never settled: their keys lie beyond where it ends. So entries wait
//! unsorted, in buckets by key, and only the nearest bucket is a heap (a calendar queue: Brown 1988). Entries come in
//! the order of one heap over all of them, whatever their keys are. Besides, the states of a bucket are known before the
//! first of them is settled, and what settling them will read can be asked for at once.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::graph::State;

/// Bits of a key's mantissa that tell buckets apart. With 128 buckets to each doubling of a key, a bucket holds some
/// hundred entries where an ordinary search ends: the heap, and most of what settling them reads, then fit the fastest
/// memories.
const BUCKET_BITS: u32 = 7;

/// Smaller keys share the first bucket; a step on a surface of diagonal 1 costs more.
const LEAST_KEY: f32 = 1.0 / 1024.0;

/// States with keys that are not negative. The smallest key comes first, and of equal ones the smallest state.
#[derive(Debug, Default)]
pub(super) struct Queue {
    /// The entries of all buckets up to `current`: keys as bits, which order like them, above states.
    near: BinaryHeap<Reverse<u64>>,
    /// The entries of each later bucket.
    far: Vec<Vec<u64>>,
    current: usize,
    /// Whether the heap holds a bucket that nobody was told of.
    opened: bool,
}

/// The bucket of a key with the given bits.
#[inline]
fn bucket(key: u32) -> usize {
    const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - BUCKET_BITS;
    (key >> SHIFT).saturating_sub(LEAST_KEY.to_bits() >> SHIFT) as usize
}

impl Queue {
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

    /// Turns the next bucket that holds something into the heap, if that is empty.
    #[inline]
    fn advance(&mut self) {
        while self.near.is_empty() && self.current + 1 < self.far.len() {
            self.current += 1;
            let list = &mut self.far[self.current];
            self.opened |= !list.is_empty();
            self.near.extend(list.drain(..).map(Reverse));
        }
    }

    /// The states of the nearest bucket, once after it became that.
    #[inline]
    pub(super) fn opened(&mut self) -> Option<impl Iterator<Item = State>> {
        self.advance();
        let opened = std::mem::take(&mut self.opened);
        opened.then(|| self.near.iter().map(|Reverse(entry)| *entry as State))
    }

    /// Takes the first entry out.
    #[inline]
    pub(super) fn pop(&mut self) -> Option<(f32, State)> {
        self.advance();
        let Reverse(entry) = self.near.pop()?;
        Some((f32::from_bits((entry >> 32) as u32), entry as State))
    }

    /// Smallest key, infinite if there is none.
    #[inline]
    pub(super) fn top(&mut self) -> f32 {
        self.advance();
        self.near.peek().map_or(f32::INFINITY, |Reverse(entry)| f32::from_bits((entry >> 32) as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_come_in_the_order_of_one_heap() {
        let mut seed = 1u64;
        let mut random = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut queue = Queue::default();
        for scale in [1e-6, 1.0, 300.0, f32::MAX / 2000.0] {
            queue.clear();
            let mut heap = BinaryHeap::new();
            for _ in 0..3000 {
                // Keys need not grow, and many are equal.
                let (key, e) = (random(1000) as f32 * scale, random(50) as State);
                queue.push(key, e);
                heap.push(Reverse((key.to_bits(), e)));
                assert_eq!(queue.top().to_bits(), heap.peek().unwrap().0.0);
                if random(3) == 0 {
                    let Reverse((key, e)) = heap.pop().unwrap();
                    assert_eq!(queue.pop(), Some((f32::from_bits(key), e)));
                }
            }
            while let Some(Reverse((key, e))) = heap.pop() {
                assert_eq!(queue.pop(), Some((f32::from_bits(key), e)));
            }
            assert_eq!((queue.pop(), queue.top()), (None, f32::INFINITY));
        }
    }

    #[test]
    fn a_bucket_is_shown_once_before_its_states_come() {
        let mut queue = Queue::default();
        let keys = [1.0, 1.001, 2.0, 5.0];
        (0..).zip(keys).for_each(|(e, key)| queue.push(key, e));
        let shown = |queue: &mut Queue| queue.opened().map(|states| states.collect::<Vec<_>>());
        let mut first = shown(&mut queue).unwrap();
        first.sort_unstable();
        assert_eq!((first, shown(&mut queue)), (vec![0, 1], None));
        assert_eq!((queue.pop(), queue.pop()), (Some((1.0, 0)), Some((1.001, 1))));
        assert_eq!(shown(&mut queue), Some(vec![2]));
    }
}
