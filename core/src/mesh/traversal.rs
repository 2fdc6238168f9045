//! Traversals of a mesh: shortest paths, breadth-first search, connected components, dilation by rings.
//!
//! A search keeps labels and a queue, and the caller's loop drives it:
//!
//! ```text
//! let mut search = Dijkstra::new(mesh.n_vertices());
//! search.start(from, 0.0);
//! while let Some((v, distance)) = search.settle() {
//!     for (h, w) in mesh.spokes(v) {
//!         search.reach(w, distance + mesh.vector(h).length(), h);
//!     }
//! }
//! ```
//!
//! So the kind of element (vertices, faces, half-edges, or elements of another mesh by their numbers), the filter, the
//! length and the end of the search are the caller's own code. Results do not depend on the machine or on hash seeds:
//! elements at equal distance are settled by ascending id, a label is replaced by a strictly smaller distance only,
//! and of equally short paths the one found first stays.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use super::kernel::TriMesh;

/// An element that flat arrays are indexed by.
pub trait Element: Copy + Ord {
    /// The element at `index` of a flat array.
    fn from_index(index: usize) -> Self;
    /// Its position in flat arrays.
    fn index(self) -> usize;
}

macro_rules! element {
    ($($id:ty),*) => {$(
        impl Element for $id {
            #[inline]
            fn from_index(index: usize) -> Self {
                Self::new(index)
            }
            #[inline]
            fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}
element!(VertexId, EdgeId, HalfedgeId, FaceId);

impl Element for u32 {
    #[inline]
    fn from_index(index: usize) -> Self {
        index as u32
    }
    #[inline]
    fn index(self) -> usize {
        self as usize
    }
}

/// A queue of items by ascending distance; items at equal distance by their own order.
#[derive(Debug, Clone)]
pub struct DistanceQueue<T> {
    /// Distances as bits: those of floating-point numbers that are not negative order as the numbers do.
    heap: BinaryHeap<Reverse<(u64, T)>>,
}

impl<T: Ord> DistanceQueue<T> {
    /// An empty queue.
    pub fn new() -> Self {
        Self { heap: BinaryHeap::new() }
    }

    /// Adds an item; `distance` must be neither negative nor NaN.
    #[inline]
    pub fn push(&mut self, distance: f64, item: T) {
        self.heap.push(Reverse((distance.to_bits(), item)));
    }

    /// Removes the item of smallest distance, and returns both.
    #[inline]
    pub fn pop(&mut self) -> Option<(f64, T)> {
        self.heap.pop().map(|Reverse((bits, item))| (f64::from_bits(bits), item))
    }

    /// Removes all items.
    pub fn clear(&mut self) {
        self.heap.clear();
    }
}

impl<T: Ord> Default for DistanceQueue<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// One label per element: in an array over all elements, or in a map over those that were reached.
#[derive(Debug, Clone)]
enum Labels<T> {
    Dense(Vec<Option<T>>),
    Sparse(HashMap<usize, T>),
}

impl<T: Copy> Labels<T> {
    fn dense(n: usize) -> Self {
        Self::Dense(vec![None; n])
    }

    #[inline]
    fn get(&self, i: usize) -> Option<T> {
        match self {
            Self::Dense(labels) => labels[i],
            Self::Sparse(labels) => labels.get(&i).copied(),
        }
    }

    #[inline]
    fn set(&mut self, i: usize, label: T) {
        match self {
            Self::Dense(labels) => labels[i] = Some(label),
            Self::Sparse(labels) => {
                labels.insert(i, label);
            }
        }
    }

    fn clear(&mut self, reached: impl Iterator<Item = usize>) {
        match self {
            Self::Dense(labels) => reached.for_each(|i| labels[i] = None),
            Self::Sparse(labels) => labels.clear(),
        }
    }
}

/// The steps from a start to `to`, read backwards from the label of `to`; `None` where it has none.
fn path<N: Copy, V>(to: N, step: impl Fn(N) -> Option<Option<V>>, before: impl Fn(&V) -> N) -> Option<Vec<V>> {
    let mut steps = Vec::new();
    let mut last = step(to)?;
    while let Some(via) = last {
        last = step(before(&via))?;
        steps.push(via);
    }
    steps.reverse();
    Some(steps)
}

/// Dijkstra's algorithm from one or several starts. `N` are the elements, `V` is the step by which one was reached, for
/// instance the half-edge that was followed or crossed.
///
/// Lengths must not be negative. Elements are settled by ascending distance, those at equal distance by ascending id,
/// each once. The label of an element changes only where a strictly smaller distance is found.
#[derive(Debug, Clone)]
pub struct Dijkstra<N, V> {
    labels: Labels<(f64, Option<V>)>,
    reached: Vec<N>,
    queue: DistanceQueue<N>,
}

impl<N: Element, V: Copy> Dijkstra<N, V> {
    /// A search over `n` elements that may reach most of them.
    pub fn new(n: usize) -> Self {
        Self { labels: Labels::dense(n), reached: Vec::new(), queue: DistanceQueue::new() }
    }

    /// A search that reaches few elements of many: its memory grows with those.
    pub fn sparse() -> Self {
        Self { labels: Labels::Sparse(HashMap::new()), reached: Vec::new(), queue: DistanceQueue::new() }
    }

    /// Starts from an element at a distance; returns whether that is less than its present distance. Also allowed once
    /// elements are settled, for instance to go on with another component.
    pub fn start(&mut self, at: N, distance: f64) -> bool {
        self.label(at, distance, None)
    }

    /// Offers a path to an element; returns whether it is shorter than the one known.
    #[inline]
    pub fn reach(&mut self, at: N, distance: f64, via: V) -> bool {
        self.label(at, distance, Some(via))
    }

    #[inline]
    fn label(&mut self, at: N, distance: f64, via: Option<V>) -> bool {
        match self.labels.get(at.index()) {
            Some((known, _)) if known <= distance => return false,
            Some(_) => {}
            None => self.reached.push(at),
        }
        self.labels.set(at.index(), (distance, via));
        self.queue.push(distance, at);
        true
    }

    /// The next element and its final distance; `None` once all that were reached are settled.
    #[inline]
    pub fn settle(&mut self) -> Option<(N, f64)> {
        loop {
            let (distance, at) = self.queue.pop()?;
            // An entry with a larger distance belongs to a path that was replaced since.
            if self.labels.get(at.index()).is_some_and(|(known, _)| distance <= known) {
                return Some((at, distance));
            }
        }
    }

    /// The smallest distance found so far; infinite where the element was not reached.
    #[inline]
    pub fn distance(&self, at: N) -> f64 {
        self.labels.get(at.index()).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// The step by which an element was reached; `None` at a start and where it was not reached.
    #[inline]
    pub fn via(&self, at: N) -> Option<V> {
        self.labels.get(at.index()).and_then(|(_, via)| via)
    }

    /// The elements reached, settled or not, in the order in which they first were.
    pub fn reached(&self) -> &[N] {
        &self.reached
    }

    /// The steps of the shortest path known to an element, from a start on; `None` where it was not reached. `before` is
    /// the element that a step leaves.
    pub fn path_to(&self, to: N, before: impl Fn(&V) -> N) -> Option<Vec<V>> {
        path(to, |at| self.labels.get(at.index()).map(|(_, via)| via), before)
    }

    /// Forgets all labels and starts, and keeps the memory; takes time for the elements reached only.
    pub fn clear(&mut self) {
        self.labels.clear(self.reached.drain(..).map(N::index));
        self.queue.clear();
    }
}

/// Breadth-first search from one or several starts: elements are visited in the order in which they were reached, hence
/// by ascending number of steps from the starts. `V` is the step by which an element was reached.
#[derive(Debug, Clone)]
pub struct BreadthFirst<N, V> {
    labels: Labels<(u32, Option<V>)>,
    reached: Vec<N>,
    /// How many of `reached` are visited.
    visited: usize,
    /// Steps from the starts to the element visited last.
    depth: u32,
}

impl<N: Element, V: Copy> BreadthFirst<N, V> {
    /// A search over `n` elements that may reach most of them.
    pub fn new(n: usize) -> Self {
        Self { labels: Labels::dense(n), reached: Vec::new(), visited: 0, depth: 0 }
    }

    /// A search that reaches few elements of many: its memory grows with those.
    pub fn sparse() -> Self {
        Self { labels: Labels::Sparse(HashMap::new()), reached: Vec::new(), visited: 0, depth: 0 }
    }

    /// Starts from an element; returns whether it had not been reached before. Also allowed once elements are visited, for
    /// instance to go on with another component.
    pub fn start(&mut self, at: N) -> bool {
        self.label(at, 0, None)
    }

    /// Reaches an element from the one visited last; returns whether it had not been reached before.
    #[inline]
    pub fn reach(&mut self, at: N, via: V) -> bool {
        self.label(at, self.depth + 1, Some(via))
    }

    #[inline]
    fn label(&mut self, at: N, depth: u32, via: Option<V>) -> bool {
        if self.labels.get(at.index()).is_some() {
            return false;
        }
        self.labels.set(at.index(), (depth, via));
        self.reached.push(at);
        true
    }

    /// The next element; `None` once all that were reached are visited.
    #[inline]
    pub fn visit(&mut self) -> Option<N> {
        let &at = self.reached.get(self.visited)?;
        self.visited += 1;
        self.depth = self.depth(at).unwrap_or(0);
        Some(at)
    }

    /// Whether an element was reached.
    #[inline]
    pub fn is_reached(&self, at: N) -> bool {
        self.labels.get(at.index()).is_some()
    }

    /// The number of steps from the starts to an element; `None` where it was not reached.
    #[inline]
    pub fn depth(&self, at: N) -> Option<u32> {
        self.labels.get(at.index()).map(|(depth, _)| depth)
    }

    /// The step by which an element was reached; `None` at a start and where it was not reached.
    #[inline]
    pub fn via(&self, at: N) -> Option<V> {
        self.labels.get(at.index()).and_then(|(_, via)| via)
    }

    /// The elements reached, visited or not, in order.
    pub fn reached(&self) -> &[N] {
        &self.reached
    }

    /// The steps of a path of fewest steps to an element, from a start on; `None` where it was not reached. `before` is
    /// the element that a step leaves.
    pub fn path_to(&self, to: N, before: impl Fn(&V) -> N) -> Option<Vec<V>> {
        path(to, |at| self.labels.get(at.index()).map(|(_, via)| via), before)
    }

    /// Forgets all labels and starts, and keeps the memory; takes time for the elements reached only.
    pub fn clear(&mut self) {
        self.labels.clear(self.reached.drain(..).map(N::index));
        (self.visited, self.depth) = (0, 0);
    }
}

/// The connected component of each of `n` elements, numbered in the order of their smallest elements, and how many there
/// are. `neighbours` must be symmetric.
pub fn components<N: Element, I: IntoIterator<Item = N>>(n: usize, neighbours: impl Fn(N) -> I) -> (Vec<u32>, usize) {
    let mut component = vec![u32::MAX; n];
    let mut count = 0;
    let mut stack = Vec::new();
    for seed in 0..n {
        if component[seed] != u32::MAX {
            continue;
        }
        component[seed] = count;
        stack.push(N::from_index(seed));
        while let Some(at) = stack.pop() {
            for next in neighbours(at) {
                if component[next.index()] == u32::MAX {
                    component[next.index()] = count;
                    stack.push(next);
                }
            }
        }
        count += 1;
    }
    (component, count as usize)
}

/// Dilates a set of vertices by `rings`: each ring adds the vertices that share a cell (a triangle or a quad, given by its
/// corners) with a vertex of the set.
pub fn dilate<N: Element, const K: usize>(
    marked: &mut [bool],
    rings: usize,
    cells: impl Iterator<Item = [N; K]> + Clone,
) {
    for _ in 0..rings {
        let touching = cells.clone().filter(|cell| cell.iter().any(|v| marked[v.index()]));
        let ring: Vec<N> = touching.flatten().collect();
        for v in ring {
            marked[v.index()] = true;
        }
    }
}

impl TriMesh {
    /// The edges at a vertex counter-clockwise, each with the vertex at its other end and given by its outgoing
    /// half-edge; at a boundary vertex the last edge has none, and is given by its incoming half-edge.
    pub fn spokes(&self, v: VertexId) -> impl Iterator<Item = (HalfedgeId, VertexId)> + '_ {
        self.outgoing(v).flat_map(move |h| {
            let back = self.prev(h);
            let last = self.twin(back).is_none().then(|| (back, self.origin(back)));
            std::iter::once((h, self.target(h))).chain(last)
        })
    }

    /// The triangles across the sides of a triangle, each with the half-edge of `f` that is crossed.
    pub fn adjacent_faces(&self, f: FaceId) -> impl Iterator<Item = (HalfedgeId, FaceId)> + '_ {
        self.face_halfedges(f).into_iter().filter_map(|h| Some((h, self.face(self.twin(h)?))))
    }

    /// Marks the corners of the marked triangles.
    pub fn vertices_of_faces(&self, faces: &[bool]) -> Vec<bool> {
        let mut corners = vec![false; self.n_vertices()];
        for v in self.faces().filter(|f| faces[f.index()]).flat_map(|f| self.face_vertices(f)) {
            corners[v.index()] = true;
        }
        corners
    }

    /// Marks the triangles that have a marked vertex as a corner.
    pub fn faces_touching(&self, vertices: &[bool]) -> Vec<bool> {
        self.faces().map(|f| self.face_vertices(f).iter().any(|v| vertices[v.index()])).collect()
    }

    /// Dilates a set of vertices by `rings` of triangles; see [`dilate`].
    pub fn dilate_vertices(&self, marked: &mut [bool], rings: usize) {
        dilate(marked, rings, self.faces().map(|f| self.face_vertices(f)));
    }
}

#[cfg(test)]
mod tests;
