//! Poly-chord collapse: deletion of chords of a layout (Campen, section 6.9).
//!
//! Setting the length of a chord to zero merges the two nodes of each of its arcs, removes its patches, and merges the
//! two other sides of each of these patches into one arc. Dually, a curve is removed from an arrangement: the regions
//! beside it merge, its crossings vanish, and the segments of other curves continue through them. The result is a
//! layout if every merged region is an open disc that touches the boundary at most once and has an admissible valence,
//! and every remaining curve still crosses another.

use thiserror::Error;

use super::structure::{Arc, LayoutError, Node, Patch, QuadLayout};
use crate::union_find::UnionFind;

/// Admissible valences of a merged inner node; the upper bound is raised to the largest valence of the nodes merged.
/// Two patches at a node of valence 2 would be degenerate, and the few triangles at a vertex of a usual mesh can hardly
/// span seven or more quarter turns without flips.
const INNER_VALENCES: std::ops::RangeInclusive<usize> = 3..=6;
/// Admissible valences of a merged boundary node, with the same exception.
const BOUNDARY_VALENCES: std::ops::RangeInclusive<usize> = 1..=3;

/// A layout after deletion of chords, with maps from the nodes, arcs, patches and chords before.
#[derive(Debug, Clone, PartialEq)]
pub struct CollapsedLayout {
    /// The remaining layout.
    pub layout: QuadLayout,
    /// For each node before, the node it is merged into.
    pub nodes: Vec<u32>,
    /// For each arc before, the arc it is merged into and whether both have the same direction; `None` for arcs of
    /// deleted chords.
    pub arcs: Vec<Option<(u32, bool)>>,
    /// For each patch before, its new index; `None` if it is deleted.
    pub patches: Vec<Option<u32>>,
    /// For each chord before, its new index; `None` if it is deleted.
    pub chords: Vec<Option<u32>>,
}

/// Why chords cannot be deleted. The field `nodes` lists the nodes that would merge.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CollapseError {
    /// There is no such chord.
    #[error("there is no chord {0}")]
    Unknown(u32),
    /// A merged region would not be a disc: nodes would merge along a closed curve.
    #[error("nodes {} would merge to a region that is not a disc", list(nodes))]
    NoDisc {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// A merged region would touch the boundary more than once.
    #[error("nodes {} would merge to a region that touches the boundary more than once", list(nodes))]
    Boundary {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// A merged node would have an inadmissible valence.
    #[error("nodes {} would merge to a node of valence {valence}", list(nodes))]
    Valence {
        /// The nodes.
        nodes: Vec<u32>,
        /// The valence.
        valence: usize,
    },
    /// A remaining chord would cross no other.
    #[error("chord {chord} would cross no other chord")]
    Uncrossed {
        /// The chord.
        chord: u32,
    },
    /// The result is not a layout. This is a defect of this module.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

fn list(nodes: &[u32]) -> String {
    nodes.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

impl QuadLayout {
    /// This layout without one of its chords.
    ///
    /// # Errors
    ///
    /// See [`CollapseError`].
    pub fn collapse(&self, chord: u32) -> Result<CollapsedLayout, CollapseError> {
        if chord as usize >= self.chords {
            return Err(CollapseError::Unknown(chord));
        }
        let mut deleted = vec![false; self.chords];
        deleted[chord as usize] = true;
        self.without_chords(&deleted)
    }

    /// This complete layout without the chords marked in `deleted`, which may cross each other.
    ///
    /// # Errors
    ///
    /// See [`CollapseError`].
    pub fn without_chords(&self, deleted: &[bool]) -> Result<CollapsedLayout, CollapseError> {
        let is_deleted = |arc: u32| deleted[self.arcs[arc as usize].chord as usize];
        let (nodes, merged) = self.merged_nodes(&is_deleted);
        self.check_discs(&is_deleted, &nodes, &merged)?;
        let arcs = self.merged_arcs(&is_deleted)?;
        let mut list: Vec<Arc> = Vec::new();
        for (a, target) in arcs.iter().enumerate() {
            let Some((arc, forward)) = *target else { continue };
            let ends = self.arcs[a].nodes.map(|n| nodes[n as usize]);
            let ends = if forward { ends } else { [ends[1], ends[0]] };
            match list.get_mut(arc as usize) {
                Some(known) => known.boundary |= self.arcs[a].boundary,
                None => list.push(Arc { nodes: ends, boundary: self.arcs[a].boundary, chord: 0 }),
            }
        }
        let mut kinds: Vec<Node> = merged
            .iter()
            .map(|old| Node { valence: 0, boundary: old.iter().any(|&n| self.nodes[n as usize].boundary) })
            .collect();
        let mut patches = vec![None; self.patches.len()];
        let mut kept: Vec<Patch> = Vec::new();
        for (p, patch) in self.patches.iter().enumerate() {
            let sides: Option<Vec<(u32, bool)>> =
                patch.sides.iter().map(|&(a, f)| arcs[a as usize].map(|(b, same)| (b, f == same))).collect();
            let Some(Ok(sides)) = sides.map(<[(u32, bool); 4]>::try_from) else { continue };
            let corners = patch.corners.map(|n| nodes[n as usize]);
            corners.iter().for_each(|&n| kinds[n as usize].valence += 1);
            patches[p] = Some(kept.len() as u32);
            kept.push(Patch { corners, sides });
        }
        let fits = |n: usize| {
            let usual = if kinds[n].boundary { BOUNDARY_VALENCES } else { INNER_VALENCES };
            let most = merged[n].iter().map(|&old| self.nodes[old as usize].valence).fold(*usual.end(), usize::max);
            (*usual.start()..=most).contains(&kinds[n].valence)
        };
        if let Some(bad) = (0..kinds.len()).find(|&n| merged[n].len() > 1 && !fits(n)) {
            return Err(CollapseError::Valence { nodes: merged[bad].clone(), valence: kinds[bad].valence });
        }
        let layout = Self::new(kinds, list, kept, self.euler())?;
        let mut chords = vec![None; self.chords];
        for (a, target) in arcs.iter().enumerate() {
            if let Some((arc, _)) = *target {
                chords[self.arcs[a].chord as usize] = Some(layout.arcs[arc as usize].chord);
            }
        }
        Ok(CollapsedLayout { layout, nodes, arcs, patches, chords })
    }

    /// The new index of every node, and the nodes merged into each new one.
    fn merged_nodes(&self, is_deleted: &impl Fn(u32) -> bool) -> (Vec<u32>, Vec<Vec<u32>>) {
        let mut sets = UnionFind::new(self.nodes.len());
        for (_, arc) in (0..).zip(&self.arcs).filter(|&(a, _)| is_deleted(a)) {
            sets.join(arc.nodes[0], arc.nodes[1]);
        }
        let mut number = vec![u32::MAX; self.nodes.len()];
        let mut merged: Vec<Vec<u32>> = Vec::new();
        for n in 0..self.nodes.len() as u32 {
            let root = sets.root(n) as usize;
            if number[root] == u32::MAX {
                number[root] = merged.len() as u32;
                merged.push(Vec::new());
            }
            number[n as usize] = number[root];
            merged[number[root] as usize].push(n);
        }
        (number, merged)
    }

    /// Checks that merged regions are open discs that touch the boundary at most once. The Euler characteristic of a
    /// merged region must be 1, and so must the number of its boundary stretches less the curve ends between them.
    fn check_discs(
        &self,
        is_deleted: &impl Fn(u32) -> bool,
        number: &[u32],
        merged: &[Vec<u32>],
    ) -> Result<(), CollapseError> {
        let mut euler: Vec<i64> = merged.iter().map(|old| old.len() as i64).collect();
        let on_boundary = |n: &&u32| self.nodes[**n as usize].boundary;
        let mut stretches: Vec<i64> = merged.iter().map(|old| old.iter().filter(on_boundary).count() as i64).collect();
        let touches: Vec<bool> = stretches.iter().map(|&s| s > 0).collect();
        for (_, arc) in (0..).zip(&self.arcs).filter(|&(a, _)| is_deleted(a)) {
            let n = number[arc.nodes[0] as usize] as usize;
            euler[n] -= 1;
            stretches[n] -= i64::from(arc.boundary);
        }
        for patch in self.patches.iter().filter(|p| p.sides.iter().all(|&(a, _)| is_deleted(a))) {
            euler[number[patch.corners[0] as usize] as usize] += 1;
        }
        for (n, nodes) in merged.iter().enumerate() {
            if euler[n] != 1 {
                return Err(CollapseError::NoDisc { nodes: nodes.clone() });
            }
            if touches[n] && stretches[n] != 1 {
                return Err(CollapseError::Boundary { nodes: nodes.clone() });
            }
        }
        Ok(())
    }

    /// For every remaining arc the new arc and whether both have the same direction: opposite sides of a patch merge if
    /// the sides between them are deleted. Every new arc must be a side of a remaining patch.
    fn merged_arcs(&self, is_deleted: &impl Fn(u32) -> bool) -> Result<Vec<Option<(u32, bool)>>, CollapseError> {
        let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); self.arcs.len()];
        let mut is_side_of_patch = vec![false; self.arcs.len()];
        for patch in &self.patches {
            for i in 0..2 {
                let ((a, f), (b, g)) = (patch.sides[i], patch.sides[i + 2]);
                let across = is_deleted(patch.sides[i + 1].0);
                if !is_deleted(a) && across {
                    // Opposite sides of a patch run in opposite directions.
                    beside[a as usize].push((b, f != g));
                    beside[b as usize].push((a, f != g));
                } else if !is_deleted(a) {
                    (is_side_of_patch[a as usize], is_side_of_patch[b as usize]) = (true, true);
                }
            }
        }
        let mut target: Vec<Option<(u32, bool)>> = vec![None; self.arcs.len()];
        let mut count = 0;
        for first in 0..self.arcs.len() as u32 {
            if is_deleted(first) || target[first as usize].is_some() {
                continue;
            }
            target[first as usize] = Some((count, true));
            let (mut stack, mut is_side) = (vec![(first, true)], false);
            while let Some((a, forward)) = stack.pop() {
                is_side |= is_side_of_patch[a as usize];
                for &(b, same) in &beside[a as usize] {
                    if target[b as usize].is_none() {
                        target[b as usize] = Some((count, forward == same));
                        stack.push((b, forward == same));
                    }
                }
            }
            if !is_side {
                return Err(CollapseError::Uncrossed { chord: self.arcs[first as usize].chord });
            }
            count += 1;
        }
        Ok(target)
    }
}
