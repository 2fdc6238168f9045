//! Homology classes of closed curves on a surface punctured at marks.
//!
//! Each edge has a number, whose sign depends on the side from which the edge is crossed (a cocycle). Around each vertex
//! that is not a mark the numbers sum to zero. Then homologous curves have equal sums over the edges they cross. The numbers
//! are drawn at random from all 64-bit numbers with this property, so different classes have equal sums with probability
//! 2⁻⁶⁴ only.
//!
//! The numbers are found with a spanning tree of the edges and a spanning tree of the triangles that crosses only edges
//! outside the first (Eppstein, *Dynamic generators of topologically embedded graphs*). Edges in neither tree are free: two
//! per handle. Edges crossed by the second tree have the number zero. The numbers in the first tree follow from the leaves
//! to the root.

use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::SurfaceCurve;

/// The homology classes of closed curves on a mesh punctured at marks and holes.
#[derive(Debug)]
pub struct HomologyClasses {
    /// Per edge, the number that a curve adds when it leaves the triangle of the edge's half-edge. Sums wrap.
    cocycle: Vec<u64>,
}

impl HomologyClasses {
    /// The classes on `mesh`, punctured at `marks` and at its holes.
    pub fn new(mesh: &TriMesh, marks: impl IntoIterator<Item = VertexId>) -> Self {
        // Per vertex, the sum of the numbers around it.
        let mut charge = vec![0; mesh.n_vertices()];
        for v in marks {
            charge[v.index()] = random(u64::from(v.0));
        }
        let tree = vertex_tree(mesh, &charge);
        let mut in_tree: Vec<bool> = mesh.edges().map(|e| mesh.is_boundary_edge(e)).collect();
        for &(_, h) in &tree {
            in_tree[mesh.edge(h).index()] = true;
        }
        add_dual_tree(mesh, &mut in_tree);
        let free = |(i, &in_tree): (usize, &bool)| if in_tree { 0 } else { random(!(i as u64)) };
        let mut classes = Self { cocycle: in_tree.iter().enumerate().map(free).collect() };
        for &(v, h) in tree.iter().rev() {
            // The edge to the parent is still zero: it completes the sum of the others.
            let others = mesh.outgoing(v).filter_map(|s| mesh.twin(s)).map(|s| classes.leaving(mesh, s));
            let missing = charge[v.index()].wrapping_sub(others.fold(0, u64::wrapping_add));
            let inwards = mesh.twin(h) == Some(mesh.halfedge(mesh.edge(h)));
            classes.cocycle[mesh.edge(h).index()] = if inwards { missing } else { missing.wrapping_neg() };
        }
        classes
    }

    /// The number that a curve adds when it crosses a half-edge out of its triangle.
    fn leaving(&self, mesh: &TriMesh, h: HalfedgeId) -> u64 {
        let e = mesh.edge(h);
        let number = self.cocycle[e.index()];
        if mesh.halfedge(e) == h { number } else { number.wrapping_neg() }
    }

    /// The class of a curve, the same for both directions. `None` if the curve is open, or bounds a part of the surface
    /// without marks and holes, which can be a disc or have handles.
    pub fn of(&self, mesh: &TriMesh, curve: &SurfaceCurve) -> Option<u64> {
        let sum = curve.crossings.iter().fold(0u64, |sum, c| sum.wrapping_add(self.leaving(mesh, c.halfedge)));
        (curve.closed && sum != 0).then(|| sum.min(sum.wrapping_neg()))
    }
}

/// A spanning tree of the vertices of each component: each vertex with the half-edge to its parent, parents first. The sum
/// around the root is not prescribed. So the root is all holes together, or else a mark; on a closed surface without marks
/// it is any vertex, whose sum is then zero.
fn vertex_tree(mesh: &TriMesh, charge: &[u64]) -> Vec<(VertexId, HalfedgeId)> {
    let mut tree = Vec::new();
    let mut search = BreadthFirst::new(mesh.n_vertices());
    for hole in mesh.vertices().filter(|&v| mesh.is_boundary_vertex(v)) {
        search.start(hole);
    }
    let marks = mesh.vertices().filter(|v| charge[v.index()] != 0);
    for root in [None].into_iter().chain(marks.chain(mesh.vertices()).map(Some)) {
        if let Some(root) = root {
            search.start(root);
        }
        while let Some(v) = search.visit() {
            for h in mesh.outgoing(v) {
                let w = mesh.target(h);
                if let Some(back) = mesh.twin(h)
                    && search.reach(w, back)
                {
                    tree.push((w, back));
                }
            }
        }
    }
    tree
}

/// Marks the edges that a spanning tree of the triangles of each component crosses; it crosses no edge already marked.
fn add_dual_tree(mesh: &TriMesh, in_tree: &mut [bool]) {
    let mut seen = vec![false; mesh.n_faces()];
    for first in mesh.faces() {
        let mut stack: Vec<FaceId> = if seen[first.index()] { Vec::new() } else { vec![first] };
        seen[first.index()] = true;
        while let Some(f) = stack.pop() {
            for h in mesh.face_halfedges(f) {
                let Some(g) = mesh.twin(h).map(|t| mesh.face(t)) else { continue };
                if !in_tree[mesh.edge(h).index()] && !seen[g.index()] {
                    in_tree[mesh.edge(h).index()] = true;
                    seen[g.index()] = true;
                    stack.push(g);
                }
            }
        }
    }
}

/// Random number of an index (SplitMix64).
fn random(i: u64) -> u64 {
    let mut z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::builtin;
    use crate::surface::testing::{cylinder, ring, upright};

    #[test]
    fn the_cocycle_sums_to_zero_around_vertices_that_are_not_marks() {
        for name in ["torus", "creature", "sleeve"] {
            let mesh = builtin(name).unwrap().mesh;
            let inside = |v: &VertexId| !mesh.is_boundary_vertex(*v);
            let marks: Vec<VertexId> = mesh.vertices().filter(inside).step_by(50).take(5).collect();
            let classes = HomologyClasses::new(&mesh, marks.iter().copied());
            for v in mesh.vertices().filter(inside) {
                let spokes = mesh.outgoing(v).filter_map(|h| mesh.twin(h));
                let sum = spokes.map(|h| classes.leaving(&mesh, h)).fold(0, u64::wrapping_add);
                assert_eq!(sum != 0, marks.contains(&v), "{name} {v:?}");
            }
        }
    }

    #[test]
    fn rings_of_a_cylinder_are_homologous_unless_a_mark_separates_them() {
        let mesh = cylinder(24, 12, 0.0);
        let rings = [3, 5, 9].map(|row| ring(&mesh, 24, row, 0.0));
        let of = |classes: &HomologyClasses| rings.each_ref().map(|r| classes.of(&mesh, r).unwrap());
        let [low, middle, high] = of(&HomologyClasses::new(&mesh, []));
        assert_eq!((low, low), (middle, high));
        // On a row of vertices between the last two.
        let z = 0.8 * 7.0 / 12.0;
        let mark = mesh.vertices().find(|&v| (mesh.position(v).z - z).abs() < 1e-9);
        assert!(mark.is_some());
        let [low, middle, high] = of(&HomologyClasses::new(&mesh, mark));
        assert!(low == middle && middle != high);
        assert_eq!(HomologyClasses::new(&mesh, []).of(&mesh, &upright(&mesh, 24, 12, 7)), None);
    }
}
