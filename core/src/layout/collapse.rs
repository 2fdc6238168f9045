//! Deleting chords of a layout: poly-chord collapse (Campen, section 6.9).
//!
//! A chord is the dual strip of arcs that all have one length. Where that is zero the nodes at both ends of each of its
//! arcs are one, the patches of the strip are gone, and what their other sides were is one arc. Dually, a curve is taken
//! out of an arrangement: the regions beside it become one region each, its crossings vanish, and the segments of other
//! curves go on through them. What comes of it is a layout if every merged region is an open disc that touches the
//! boundary once at most, has enough corners, and every curve left still crosses another.

use thiserror::Error;

use super::structure::{Arc, LayoutError, Node, Patch, QuadLayout};
use crate::union_find::UnionFind;

/// Valences that a merged node may have inside the surface, unless one of those it is made of has more: two patches at a
/// node would be folded onto each other, and triangles hardly span seven and more quarters without folds.
const INNER: std::ops::RangeInclusive<usize> = 3..=6;
/// The same on the boundary.
const BOUNDARY: std::ops::RangeInclusive<usize> = 1..=3;

/// A layout without some of its chords, and what became of the parts of the one before.
#[derive(Debug, Clone, PartialEq)]
pub struct CollapsedLayout {
    /// What is left.
    pub layout: QuadLayout,
    /// For each node before the one that it has become.
    pub nodes: Vec<u32>,
    /// For each arc before the one that it has become, and whether that runs in its direction; none for arcs of a chord
    /// that is gone.
    pub arcs: Vec<Option<(u32, bool)>>,
    /// For each patch before its number, unless it is gone.
    pub patches: Vec<Option<u32>>,
    /// For each chord before its number, unless it is gone.
    pub chords: Vec<Option<u32>>,
}

/// Why chords cannot be deleted.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CollapseError {
    /// There is no such chord.
    #[error("there is no chord {0}")]
    Unknown(u32),
    /// Nodes would be merged along a closed way, or a node with itself.
    #[error("nodes {} would merge to what is no disc", list(nodes))]
    NoDisc {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// Nodes would be merged that lie on different boundaries, or at different places of one.
    #[error("nodes {} would bring several places of the boundary together", list(nodes))]
    Boundary {
        /// The nodes.
        nodes: Vec<u32>,
    },
    /// A merged node would have too few or too many patches.
    #[error("nodes {} would merge to one of valence {valence}", list(nodes))]
    Valence {
        /// The nodes.
        nodes: Vec<u32>,
        /// The valence.
        valence: usize,
    },
    /// A chord that is left would cross no other.
    #[error("chord {chord} would be crossed by no other")]
    Uncrossed {
        /// The chord.
        chord: u32,
    },
    /// What is left is no layout, which would be a defect of this module.
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
        let mut gone = vec![false; self.chords];
        gone[chord as usize] = true;
        self.without(&gone)
    }

    /// This complete layout without those chords that are `gone`, however they cross each other.
    ///
    /// # Errors
    ///
    /// See [`CollapseError`].
    pub fn without(&self, gone: &[bool]) -> Result<CollapsedLayout, CollapseError> {
        let is_gone = |arc: u32| gone[self.arcs[arc as usize].chord as usize];
        let euler = self.nodes.len() as i64 - self.arcs.len() as i64 + self.patches.len() as i64;
        let (nodes, merged) = self.merged_nodes(&is_gone);
        self.check_discs(&is_gone, &nodes, &merged)?;
        let arcs = self.merged_arcs(&is_gone)?;
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
            let usual = if kinds[n].boundary { BOUNDARY } else { INNER };
            let most = merged[n].iter().map(|&old| self.nodes[old as usize].valence).fold(*usual.end(), usize::max);
            (*usual.start()..=most).contains(&kinds[n].valence)
        };
        if let Some(bad) = (0..kinds.len()).find(|&n| merged[n].len() > 1 && !fits(n)) {
            return Err(CollapseError::Valence { nodes: merged[bad].clone(), valence: kinds[bad].valence });
        }
        let layout = Self::new(kinds, list, kept, euler)?;
        let mut chords = vec![None; self.chords];
        for (a, target) in arcs.iter().enumerate() {
            if let Some((arc, _)) = *target {
                chords[self.arcs[a].chord as usize] = Some(layout.arcs[arc as usize].chord);
            }
        }
        Ok(CollapsedLayout { layout, nodes, arcs, patches, chords })
    }

    /// The new number of every node, and the nodes that become each new one.
    fn merged_nodes(&self, is_gone: &impl Fn(u32) -> bool) -> (Vec<u32>, Vec<Vec<u32>>) {
        let mut sets = UnionFind::new(self.nodes.len());
        for (_, arc) in (0..).zip(&self.arcs).filter(|&(a, _)| is_gone(a)) {
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

    /// Checks that what nodes merge to are open discs that touch the boundary once at most: dually, cells of all
    /// dimensions add up to one, as do stretches of the boundary less the ends of curves between them.
    fn check_discs(
        &self,
        is_gone: &impl Fn(u32) -> bool,
        number: &[u32],
        merged: &[Vec<u32>],
    ) -> Result<(), CollapseError> {
        let mut euler: Vec<i64> = merged.iter().map(|old| old.len() as i64).collect();
        let on_boundary = |n: &&u32| self.nodes[**n as usize].boundary;
        let mut stretches: Vec<i64> = merged.iter().map(|old| old.iter().filter(on_boundary).count() as i64).collect();
        let touches: Vec<bool> = stretches.iter().map(|&s| s > 0).collect();
        for (_, arc) in (0..).zip(&self.arcs).filter(|&(a, _)| is_gone(a)) {
            let n = number[arc.nodes[0] as usize] as usize;
            euler[n] -= 1;
            stretches[n] -= i64::from(arc.boundary);
        }
        for patch in self.patches.iter().filter(|p| p.sides.iter().all(|&(a, _)| is_gone(a))) {
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

    /// For every arc that is not gone the new one, and whether that runs in its direction: the two sides that a patch
    /// loses between them are one. Every new arc must be the side of a patch that is left.
    fn merged_arcs(&self, is_gone: &impl Fn(u32) -> bool) -> Result<Vec<Option<(u32, bool)>>, CollapseError> {
        let mut beside: Vec<Vec<(u32, bool)>> = vec![Vec::new(); self.arcs.len()];
        let mut bears = vec![false; self.arcs.len()];
        for patch in &self.patches {
            for i in 0..2 {
                let ((a, f), (b, g)) = (patch.sides[i], patch.sides[i + 2]);
                let across = is_gone(patch.sides[i + 1].0);
                if !is_gone(a) && across {
                    // Opposite sides of a patch are passed in opposite directions.
                    beside[a as usize].push((b, f != g));
                    beside[b as usize].push((a, f != g));
                } else if !is_gone(a) {
                    (bears[a as usize], bears[b as usize]) = (true, true);
                }
            }
        }
        let mut target: Vec<Option<(u32, bool)>> = vec![None; self.arcs.len()];
        let mut count = 0;
        for first in 0..self.arcs.len() as u32 {
            if is_gone(first) || target[first as usize].is_some() {
                continue;
            }
            target[first as usize] = Some((count, true));
            let (mut stack, mut borne) = (vec![(first, true)], false);
            while let Some((a, forward)) = stack.pop() {
                borne |= bears[a as usize];
                for &(b, same) in &beside[a as usize] {
                    if target[b as usize].is_none() {
                        target[b as usize] = Some((count, forward == same));
                        stack.push((b, forward == same));
                    }
                }
            }
            if !borne {
                return Err(CollapseError::Uncrossed { chord: self.arcs[first as usize].chord });
            }
            count += 1;
        }
        Ok(target)
    }
}
