//! The structure of a quad layout: nodes, arcs, patches and chords (Campen, sections 2.1 and 5.2.3).
//!
//! A layout is dual to an arrangement of loops: it has one node per region, one arc per segment and one patch per
//! crossing. A segment that ends on the boundary separates two regions with nodes on the boundary, and its arc runs
//! along the boundary.

use serde::Serialize;
use thiserror::Error;

use crate::dual::{Arrangement, SideKind};
use crate::union_find::UnionFind;

/// A node, dual to the region of the same index.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Node {
    /// Number of patch corners that meet here.
    pub valence: usize,
    /// Whether it lies on the boundary of the surface.
    pub boundary: bool,
}

impl Node {
    /// Whether its valence is 4, or 2 on the boundary.
    pub fn is_regular(&self) -> bool {
        self.valence == if self.boundary { 2 } else { 4 }
    }
}

/// An arc, dual to the segment of the same index.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Arc {
    /// Its two nodes, dual to the regions left and right of the segment.
    pub nodes: [u32; 2],
    /// Whether it runs along the boundary of the surface.
    pub boundary: bool,
    /// Its chord: the class of arcs joined by being opposite in a patch. All arcs of a chord have equal length in a
    /// map.
    pub chord: u32,
}

/// A patch, dual to the crossing of the same index.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Patch {
    /// Its four corners, counter-clockwise.
    pub corners: [u32; 4],
    /// Its four sides: the arc, and whether the side runs in the direction of the arc. Side `i` joins corner `i` to
    /// corner `i + 1`.
    pub sides: [(u32, bool); 4],
}

/// Why an arrangement has no dual layout, or a layout is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LayoutError {
    /// Regions that cannot be nodes.
    #[error("{} of the regions cannot be nodes yet (the first is region {})", .0.len(), .0[0])]
    RedRegions(Vec<u32>),
    /// The arrangement has no crossing.
    #[error("no two loops cross: the layout has no patch")]
    Empty,
    /// The Euler characteristic differs from that of the surface.
    #[error("{nodes} nodes, {arcs} arcs and {patches} patches have Euler characteristic {found} instead of {expected}")]
    Euler {
        /// Number of nodes.
        nodes: usize,
        /// Number of arcs.
        arcs: usize,
        /// Number of patches.
        patches: usize,
        /// The Euler characteristic of the layout.
        found: i64,
        /// The Euler characteristic of the surface.
        expected: i64,
    },
    /// The sides of a patch do not join its corners.
    #[error("the sides of patch {patch} do not join its corners")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// A node's valence differs from the number of patch corners there.
    #[error("node {node} has valence {valence} but {corners} patch corners")]
    Valence {
        /// The node.
        node: usize,
        /// Its valence.
        valence: usize,
        /// The number of patch corners there.
        corners: usize,
    },
}

/// A quad layout: nodes, arcs and four-sided patches.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct QuadLayout {
    /// The nodes.
    pub nodes: Vec<Node>,
    /// The arcs.
    pub arcs: Vec<Arc>,
    /// The patches.
    pub patches: Vec<Patch>,
    /// Number of chords.
    pub chords: usize,
}

impl QuadLayout {
    /// The layout dual to `arrangement` on a surface of Euler characteristic `euler`. `red` lists the regions that
    /// cannot be nodes.
    ///
    /// # Errors
    ///
    /// [`LayoutError::RedRegions`] if `red` is not empty, [`LayoutError::Empty`] without crossings. Other errors are
    /// defects of the arrangement.
    pub fn dual(arrangement: &Arrangement, red: &[u32], euler: i64) -> Result<Self, LayoutError> {
        if !red.is_empty() {
            return Err(LayoutError::RedRegions(red.to_vec()));
        }
        if arrangement.crossings.is_empty() {
            return Err(LayoutError::Empty);
        }
        let nodes = arrangement
            .regions
            .iter()
            .map(|r| Node { valence: r.corners(), boundary: r.boundary_stretches() > 0 })
            .collect();
        let mut arcs = vec![Arc { nodes: [u32::MAX; 2], boundary: false, chord: 0 }; arrangement.segments.len()];
        for (r, region) in arrangement.regions.iter().enumerate() {
            for side in region.borders.iter().flatten() {
                if let SideKind::Segment { segment, forward } = side.kind {
                    arcs[segment as usize].nodes[usize::from(!forward)] = r as u32;
                }
            }
        }
        for end in &arrangement.ends {
            arcs[end.segment as usize].boundary = true;
        }
        let mut patches = Vec::with_capacity(arrangement.crossings.len());
        for (p, crossing) in arrangement.crossings.iter().enumerate() {
            let corners = crossing.spokes.map(|h| arrangement.region_left_of(h));
            let mut sides = [(0, false); 4];
            for (i, side) in sides.iter_mut().enumerate() {
                let spoke = crossing.spokes[(i + 1) % 4];
                let (segment, forward) = arrangement.segment_at(spoke).ok_or(LayoutError::Patch { patch: p })?;
                // Counter-clockwise around the crossing, the side passes from the right of the spoke to its left.
                *side = (segment, !forward);
            }
            patches.push(Patch { corners, sides });
        }
        Self::new(nodes, arcs, patches, euler)
    }

    /// The layout of given nodes, arcs and patches on a surface of Euler characteristic `euler`; computes the chords.
    ///
    /// # Errors
    ///
    /// As [`Self::check`].
    pub fn new(nodes: Vec<Node>, arcs: Vec<Arc>, patches: Vec<Patch>, euler: i64) -> Result<Self, LayoutError> {
        let mut layout = Self { nodes, arcs, patches, chords: 0 };
        layout.find_chords();
        layout.check(euler)?;
        Ok(layout)
    }

    /// Numbers the chords.
    pub(crate) fn find_chords(&mut self) {
        let mut sets = UnionFind::new(self.arcs.len());
        for p in &self.patches {
            for i in 0..2 {
                sets.join(p.sides[i].0, p.sides[i + 2].0);
            }
        }
        let mut number = vec![u32::MAX; self.arcs.len()];
        for a in 0..self.arcs.len() {
            let r = sets.root(a as u32) as usize;
            if number[r] == u32::MAX {
                number[r] = self.chords as u32;
                self.chords += 1;
            }
            self.arcs[a].chord = number[r];
        }
    }

    /// Checks that every side joins its corners, that valences equal numbers of corners, and that `|N| − |A| + |P| =
    /// χ`.
    ///
    /// # Errors
    ///
    /// The first violation.
    pub fn check(&self, euler: i64) -> Result<(), LayoutError> {
        let mut corners = vec![0; self.nodes.len()];
        for (patch, p) in self.patches.iter().enumerate() {
            for i in 0..4 {
                corners[p.corners[i] as usize] += 1;
                let (arc, forward) = p.sides[i];
                let [a, b] = self.arcs[arc as usize].nodes;
                let (from, to) = if forward { (a, b) } else { (b, a) };
                if (from, to) != (p.corners[i], p.corners[(i + 1) % 4]) {
                    return Err(LayoutError::Patch { patch });
                }
            }
        }
        for (node, (n, &corners)) in self.nodes.iter().zip(&corners).enumerate() {
            if n.valence != corners {
                return Err(LayoutError::Valence { node, valence: n.valence, corners });
            }
        }
        let found = self.euler();
        if found != euler {
            let (nodes, arcs, patches) = (self.nodes.len(), self.arcs.len(), self.patches.len());
            return Err(LayoutError::Euler { nodes, arcs, patches, found, expected: euler });
        }
        Ok(())
    }

    /// The Euler characteristic `|N| − |A| + |P|`.
    pub fn euler(&self) -> i64 {
        self.nodes.len() as i64 - self.arcs.len() as i64 + self.patches.len() as i64
    }

    /// For each chord the least number of quads across it with which the subdivided layout is a polygonal mesh without
    /// loops, double edges and quads that have a vertex twice.
    pub fn min_quads_per_chord(&self) -> Vec<u32> {
        let mut least = vec![1; self.chords];
        let mut raise = |arc: u32, to: u32| {
            let least = &mut least[self.arcs[arc as usize].chord as usize];
            *least = to.max(*least);
        };
        let mut between = std::collections::HashMap::new();
        for (a, arc) in (0..).zip(&self.arcs) {
            let [p, q] = arc.nodes;
            if p == q {
                raise(a, 3);
            } else if let Some(other) = between.insert([p.min(q), p.max(q)], a) {
                raise(a, 2);
                raise(other, 2);
            }
        }
        for patch in self.patches.iter().filter(|p| p.corners[0] == p.corners[2] || p.corners[1] == p.corners[3]) {
            raise(patch.sides[0].0, 2);
            raise(patch.sides[1].0, 2);
        }
        least
    }

    /// The sum over all nodes of the difference between the valence and that of a regular node.
    pub fn irregularity(&self) -> usize {
        self.nodes.iter().map(|n| n.valence.abs_diff(if n.boundary { 2 } else { 4 })).sum()
    }

    /// Number of irregular nodes.
    pub fn n_irregular(&self) -> usize {
        self.nodes.iter().filter(|n| !n.is_regular()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{column, row, torus};

    /// The layout dual to `m` rows and `n` columns of a torus.
    fn torus_layout(m: u32, n: u32) -> QuadLayout {
        let mesh = torus(12, 12);
        let rows = (0..m).map(|k| row(12, 4 * k, true, 0.4));
        let curves: Vec<_> = rows.chain((0..n).map(|k| column(12, 12, 4 * k, true, 0.6))).collect();
        QuadLayout::dual(&Arrangement::new(&mesh, &curves).unwrap(), &[], 0).unwrap()
    }

    #[test]
    fn arrangement_without_crossing_has_no_layout() {
        let arrangement = Arrangement::new(&torus(6, 6), &[row(6, 2, true, 0.5)]).unwrap();
        assert_eq!(QuadLayout::dual(&arrangement, &[], 0), Err(LayoutError::Empty));
    }

    #[test]
    fn regions_that_cannot_be_nodes_are_reported() {
        let arrangement = Arrangement::new(&torus(6, 6), &[row(6, 2, true, 0.5)]).unwrap();
        let error = QuadLayout::dual(&arrangement, &[3, 5], 0).unwrap_err();
        assert_eq!(error, LayoutError::RedRegions(vec![3, 5]));
        assert!(error.to_string().contains("2 of the regions"), "{error}");
    }

    #[test]
    fn layouts_of_another_euler_characteristic_are_refused() {
        let layout = torus_layout(2, 3);
        assert_eq!((layout.euler(), layout.check(0)), (0, Ok(())));
        assert!(matches!(layout.check(2), Err(LayoutError::Euler { found: 0, expected: 2, .. })));
    }

    #[test]
    fn sides_that_do_not_join_corners_are_refused() {
        let mut layout = torus_layout(2, 3);
        let (arc, forward) = layout.patches[4].sides[2];
        layout.patches[4].sides[2] = (arc, !forward);
        assert_eq!(layout.check(0), Err(LayoutError::Patch { patch: 4 }));
    }

    #[test]
    fn wrong_valences_are_refused() {
        let mut layout = torus_layout(2, 3);
        layout.nodes[1].valence = 5;
        assert_eq!(layout.check(0), Err(LayoutError::Valence { node: 1, valence: 5, corners: 4 }));
        assert_eq!((layout.irregularity(), layout.n_irregular()), (1, 1));
    }

    #[test]
    fn valence_two_is_regular_on_the_boundary_only() {
        assert!(Node { valence: 2, boundary: true }.is_regular() && Node { valence: 4, boundary: false }.is_regular());
        assert!(
            !Node { valence: 2, boundary: false }.is_regular() && !Node { valence: 4, boundary: true }.is_regular()
        );
    }

    #[test]
    fn loops_and_double_arcs_need_more_quads() {
        // Around one patch every arc is a loop; around two, arcs come in pairs with the same ends; three are enough.
        for (n, least) in [(1, 3), (2, 2), (3, 1)] {
            assert_eq!(torus_layout(n, n).min_quads_per_chord(), vec![least; 2 * n as usize]);
        }
    }
}
