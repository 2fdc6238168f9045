//! Spokes of the triangle fan around a vertex, on the two sides of a curve.
//!
//! A curve that passes a vertex crosses the spokes on one side of it. These functions list the spokes on the other
//! side, in the order in which the curve crosses them there.

use crate::mesh::{FaceId, HalfedgeId, TriMesh};

/// A side of a curve, seen along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// To the right: parameter 0 on a crossed edge.
    Right,
    /// To the left: parameter 1 on a crossed edge.
    Left,
}

/// The spokes from the triangle of `first` to the triangle `to` around the vertex at the `side` end of `first`, in the
/// rotational direction that does not cross `first`. `None` where the boundary interrupts the fan.
pub(super) fn spokes_across(mesh: &TriMesh, first: HalfedgeId, to: FaceId, side: Side) -> Option<Vec<HalfedgeId>> {
    let mut spokes = Vec::new();
    let mut inside = first;
    while mesh.face(inside) != to {
        let out = turn(mesh, inside, side);
        spokes.push(out);
        inside = mesh.twin(out)?;
    }
    Some(spokes)
}

/// As [`spokes_across`], from the triangle of `first` to the boundary. The last spoke is a boundary half-edge.
pub(super) fn spokes_to_boundary(mesh: &TriMesh, first: HalfedgeId, side: Side) -> Vec<HalfedgeId> {
    let mut spokes = vec![turn(mesh, first, side)];
    while let Some(inside) = spokes.last().and_then(|&h| mesh.twin(h)) {
        spokes.push(turn(mesh, inside, side));
    }
    spokes
}

/// As [`spokes_across`], from the boundary to the triangle of `entered`. The first spoke is a boundary half-edge.
pub(super) fn spokes_from_boundary(mesh: &TriMesh, entered: HalfedgeId, side: Side) -> Vec<HalfedgeId> {
    let back = |h| if side == Side::Left { mesh.prev(h) } else { mesh.next(h) };
    let mut spokes = Vec::new();
    let mut inside = back(entered);
    while let Some(from) = mesh.twin(inside) {
        spokes.push(from);
        inside = back(from);
    }
    spokes.push(inside);
    spokes.reverse();
    spokes
}

/// The side of the triangle of `h` through which the fan is left, when it was entered through `h`.
fn turn(mesh: &TriMesh, h: HalfedgeId, side: Side) -> HalfedgeId {
    if side == Side::Left { mesh.next(h) } else { mesh.prev(h) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::VertexId;
    use crate::testing::square;

    #[test]
    fn spokes_of_both_sides_are_all_spokes_of_an_inner_vertex() {
        let mesh = square(4);
        let centre = VertexId(12);
        let first = mesh.outgoing(centre).next().unwrap();
        let to = mesh.face(mesh.outgoing(centre).nth(3).unwrap());
        // `first` starts at the vertex, so that it is on the right.
        let there = spokes_across(&mesh, first, to, Side::Right).unwrap();
        let edges = |spokes: &[HalfedgeId]| spokes.iter().map(|&h| mesh.edge(h)).collect::<Vec<_>>();
        let at_centre = |h: &HalfedgeId| mesh.edge_vertices(mesh.edge(*h)).contains(&centre);
        assert!(there.iter().all(at_centre) && !edges(&there).contains(&mesh.edge(first)));
        assert!(there.len() < mesh.outgoing(centre).count());
    }

    #[test]
    fn a_fan_at_the_boundary_ends_there() {
        let mesh = square(4);
        let side = VertexId(2);
        let first = mesh.outgoing(side).find(|&h| mesh.twin(h).is_some()).unwrap();
        let spokes = spokes_to_boundary(&mesh, first, Side::Right);
        assert_eq!(mesh.twin(*spokes.last().unwrap()), None);
        assert!(spokes[..spokes.len() - 1].iter().all(|&h| mesh.twin(h).is_some()));
        // No triangle is reached beyond the boundary.
        assert_eq!(spokes_across(&mesh, first, FaceId(mesh.n_faces() as u32 - 1), Side::Right), None);
    }
}
