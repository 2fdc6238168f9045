//! Which closed curves are one another shifted over the surface.
//!
//! Two curves are of one class if one is the other shifted without passing a mark: homologous on the surface punctured
//! at its marks. A number for each edge, with a sign for the side it is crossed from, tells: where the numbers around
//! each vertex that is no mark sum to zero, curves of one class have equal sums over the edges they cross. Numbers drawn
//! at random among all of 64 bits with this property have different sums for different classes, but for odds of 2⁻⁶⁴.
//! They are found with a tree of edges and a tree of triangles over the edges left (Eppstein, *Dynamic generators of
//! topologically embedded graphs*): edges in neither are free, as many as there are handles, twice over; edges of the
//! second have zero; those of the first follow from the leaves inwards.

use std::collections::VecDeque;

use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::SurfaceCurve;

/// The classes of closed curves on a mesh with marks.
#[derive(Debug)]
pub struct HomologyClasses {
    /// Per edge, for crossing it out of the triangle of its half-edge. Sums wrap.
    weights: Vec<u64>,
}

impl HomologyClasses {
    /// The classes on `mesh`, where no curve may be shifted past one of `marks` or a hole.
    pub fn new(mesh: &TriMesh, marks: impl IntoIterator<Item = VertexId>) -> Self {
        let mut charge = vec![0; mesh.n_vertices()];
        for v in marks {
            charge[v.index()] = random(u64::from(v.0));
        }
        let tree = vertex_tree(mesh, &charge);
        let mut used: Vec<bool> = mesh.edges().map(|e| mesh.is_boundary_edge(e)).collect();
        for &(_, h) in &tree {
            used[mesh.edge(h).index()] = true;
        }
        cross(mesh, &mut used);
        let free = |(i, &used): (usize, &bool)| if used { 0 } else { random(!(i as u64)) };
        let mut classes = Self { weights: used.iter().enumerate().map(free).collect() };
        for &(v, h) in tree.iter().rev() {
            // So far the edge to the parent is zero: it makes up for the others.
            let others = mesh.outgoing(v).filter_map(|s| mesh.twin(s)).map(|s| classes.weight(mesh, s));
            let missing = charge[v.index()].wrapping_sub(others.fold(0, u64::wrapping_add));
            let inwards = mesh.twin(h) == Some(mesh.halfedge(mesh.edge(h)));
            classes.weights[mesh.edge(h).index()] = if inwards { missing } else { missing.wrapping_neg() };
        }
        classes
    }

    /// What crossing a half-edge out of its triangle adds.
    fn weight(&self, mesh: &TriMesh, h: HalfedgeId) -> u64 {
        let e = mesh.edge(h);
        let weight = self.weights[e.index()];
        if mesh.halfedge(e) == h { weight } else { weight.wrapping_neg() }
    }

    /// The class of a curve, whichever way it runs. `None` if it is open, or bounds a piece of the surface without marks:
    /// that can be a disc, or have handles.
    pub fn of(&self, mesh: &TriMesh, curve: &SurfaceCurve) -> Option<u64> {
        let sum = curve.crossings.iter().fold(0u64, |sum, c| sum.wrapping_add(self.weight(mesh, c.halfedge)));
        (curve.closed && sum != 0).then(|| sum.min(sum.wrapping_neg()))
    }
}

/// A tree over the vertices of each component, with the half-edge from each vertex to its parent, parents first. Its root
/// is what need not sum to zero: a hole with all vertices on it, or else a mark, if there is one.
fn vertex_tree(mesh: &TriMesh, charge: &[u64]) -> Vec<(VertexId, HalfedgeId)> {
    let (mut tree, mut seen) = (Vec::new(), vec![false; mesh.n_vertices()]);
    let holes = mesh.vertices().filter(|&v| mesh.is_boundary_vertex(v));
    let marks = mesh.vertices().filter(|v| charge[v.index()] != 0);
    let mut queue: VecDeque<VertexId> = holes.collect();
    queue.iter().for_each(|v| seen[v.index()] = true);
    for root in [None].into_iter().chain(marks.chain(mesh.vertices()).map(Some)) {
        if let Some(root) = root.filter(|r| !seen[r.index()]) {
            seen[root.index()] = true;
            queue.push_back(root);
        }
        while let Some(v) = queue.pop_front() {
            for h in mesh.outgoing(v) {
                let w = mesh.target(h);
                if let Some(back) = mesh.twin(h).filter(|_| !seen[w.index()]) {
                    seen[w.index()] = true;
                    tree.push((w, back));
                    queue.push_back(w);
                }
            }
        }
    }
    tree
}

/// Marks the edges of a tree over the triangles of each component as used, which crosses none that is.
fn cross(mesh: &TriMesh, used: &mut [bool]) {
    let mut seen = vec![false; mesh.n_faces()];
    for first in mesh.faces() {
        let mut stack: Vec<FaceId> = if seen[first.index()] { Vec::new() } else { vec![first] };
        seen[first.index()] = true;
        while let Some(f) = stack.pop() {
            for h in mesh.face_halfedges(f) {
                let Some(g) = mesh.twin(h).map(|t| mesh.face(t)) else { continue };
                if !used[mesh.edge(h).index()] && !seen[g.index()] {
                    used[mesh.edge(h).index()] = true;
                    seen[g.index()] = true;
                    stack.push(g);
                }
            }
        }
    }
}

/// A random number that is always the same (SplitMix64).
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
    fn a_point_can_be_gone_round_if_it_is_no_mark() {
        for name in ["torus", "creature", "sleeve"] {
            let mesh = builtin(name).unwrap().mesh;
            let inside = |v: &VertexId| !mesh.is_boundary_vertex(*v);
            let marks: Vec<VertexId> = mesh.vertices().filter(inside).step_by(50).take(5).collect();
            let classes = HomologyClasses::new(&mesh, marks.iter().copied());
            for v in mesh.vertices().filter(inside) {
                let spokes = mesh.outgoing(v).filter_map(|h| mesh.twin(h));
                let sum = spokes.map(|h| classes.weight(&mesh, h)).fold(0, u64::wrapping_add);
                assert_eq!(sum != 0, marks.contains(&v), "{name} {v:?}");
            }
        }
    }

    #[test]
    fn rings_of_a_cylinder_are_one_unless_a_mark_lies_between() {
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
