//! Inserting paths into a refined mesh.
//!
//! A path from vertex `p` to vertex `q` is inserted by splitting, in order, the edges that it crosses. Splitting an edge joins
//! the new vertex to the two opposite vertices: `p` or the vertex inserted before, and the next one or `q`. So an inserted
//! path never passes through an older vertex, two paths meet only where one crosses an edge of the other, and each meeting is
//! a transversal crossing of exactly two (D1 and D2 of Campen, section 5.1).
//!
//! The edges crossed are those of a shortest path over triangles, in which crossing an older path costs more than everything
//! else. Coordinates only decide between routes with equally many crossings, so rounding can make a path longer, not wrong.

use glam::DVec2;

use super::refined_mesh::{Mark, NONE, RefinedMesh};
use crate::mesh::Dijkstra;

/// Cost of crossing a marked edge on a route: above the sum of everything else that a route costs.
const CROSSING: f64 = 1e9;
/// Cost of one more triangle on a route: small compared with the deviation from the straight line, so that it only decides
/// between equal ones. Chosen by hand.
const STEP: f64 = 1e-3;
/// Upper bound of the deviation of an edge from the straight line, relative to the length of the line. Chosen by hand, so
/// that the sum stays below [`CROSSING`].
const MAX_DEVIATION: f64 = 1e3;
/// Least distance of a path from the ends of an edge that it crosses, as a fraction of the edge. Chosen by hand.
const MARGIN: f64 = 0.02;

/// A path could not be inserted: the triangles that it may use do not join its ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no path from vertex {from} to vertex {to} through the triangles allowed")]
pub struct NoPath {
    /// Start vertex.
    pub from: u32,
    /// End vertex.
    pub to: u32,
}

impl RefinedMesh {
    /// Inserts a path from `p` to `q` and marks its edges with `mark`; returns its vertices.
    ///
    /// The path uses only triangles for which `allowed` holds, and no edge whose mark `barrier` holds for. It crosses as few
    /// marked edges as possible and otherwise stays close to the straight segment in the plane of the coordinates `plane`.
    ///
    /// # Errors
    ///
    /// [`NoPath`] if the triangles allowed do not join the ends.
    pub fn insert_path(
        &mut self,
        (p, q): (u32, u32),
        mark: Mark,
        allowed: impl Fn(&Self, u32) -> bool,
        barrier: impl Fn(Mark) -> bool,
        plane: impl Fn(&Self, u32) -> DVec2,
    ) -> Result<Vec<u32>, NoPath> {
        if let Some(h) = self.find(p, q)
            && self.mark(h) == Mark::Free
            && (allowed(self, h / 3) || self.twin(h).is_some_and(|t| allowed(self, t / 3)))
        {
            self.set_mark(h, mark);
            return Ok(vec![p, q]);
        }
        let crossed = self.route((p, q), allowed, barrier, &plane).ok_or(NoPath { from: p, to: q })?;
        let (start, end) = (plane(self, p), plane(self, q));
        let mut path = vec![p];
        for h in crossed {
            let (a, b) = (plane(self, self.origin(h)), plane(self, self.target(h)));
            let x = self.split_edge(h, meeting_point(start, end, a, b));
            path.push(x);
        }
        path.push(q);
        for w in path.windows(2) {
            let h = self.find(w[0], w[1]).ok_or(NoPath { from: w[0], to: w[1] })?;
            self.set_mark(h, mark);
        }
        Ok(path)
    }

    /// The half-edges that the path from `p` to `q` crosses, each in the triangle that is entered. Insertion splits the
    /// triangle that is left first, so only the half-edges of the triangles entered keep their numbers.
    fn route(
        &self,
        (p, q): (u32, u32),
        allowed: impl Fn(&Self, u32) -> bool,
        barrier: impl Fn(Mark) -> bool,
        plane: &impl Fn(&Self, u32) -> DVec2,
    ) -> Option<Vec<u32>> {
        let (start, end) = (plane(self, p), plane(self, q));
        let scale = start.distance(end).max(f64::MIN_POSITIVE);
        let mut search = Dijkstra::sparse();
        for f in self.outgoing(p).into_iter().map(|h| h / 3).filter(|&f| allowed(self, f)) {
            search.start(f, 0.0);
        }
        while let Some((f, cost)) = search.settle() {
            if self.corners(f).contains(&q) {
                return search.path_to(f, |&h| self.twin(h).map_or(NONE, |t| t / 3));
            }
            for h in 3 * f..3 * f + 3 {
                let Some(entered) = self.twin(h) else { continue };
                // The path leaves its first triangle by the edge opposite to its start, and enters the last one likewise.
                let at_end = [self.origin(h), self.target(h)].iter().any(|&v| v == p || v == q);
                let mark = self.mark(h);
                if at_end || !allowed(self, entered / 3) || (mark != Mark::Free && barrier(mark)) {
                    continue;
                }
                let (a, b) = (plane(self, self.origin(h)), plane(self, self.target(h)));
                let deviation = distance_to_segment(start, end, a, b) / scale;
                let crossing = if mark == Mark::Free { 0.0 } else { CROSSING };
                search.reach(entered / 3, cost + crossing + STEP + deviation.min(MAX_DEVIATION), entered);
            }
        }
        None
    }
}

/// Where the line `p q` meets the segment `a b`, as a fraction from `a` to `b`, at least [`MARGIN`] from the ends.
fn meeting_point(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (d, e) = (q - p, b - a);
    let t = (p - a).perp_dot(d) / e.perp_dot(d);
    if t.is_finite() { t.clamp(MARGIN, 1.0 - MARGIN) } else { 0.5 }
}

/// Distance of the segment `a b` from the line `p q`: zero if they meet.
fn distance_to_segment(p: DVec2, q: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = q - p;
    let (sa, sb) = (d.perp_dot(a - p), d.perp_dot(b - p));
    let length = d.length().max(f64::MIN_POSITIVE);
    if sa * sb <= 0.0 { 0.0 } else { sa.abs().min(sb.abs()) / length }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    fn xy(mesh: &RefinedMesh, v: u32) -> DVec2 {
        mesh.positions[v as usize].truncate()
    }

    /// A square of 2 by 2 cells, in which the two halves of the middle column of edges are marked as curve 0.
    fn with_column() -> RefinedMesh {
        let mut mesh = RefinedMesh::new(&square(2));
        for (a, b) in [(1, 4), (4, 7)] {
            let h = mesh.find(a, b).unwrap();
            mesh.set_mark(h, Mark::Curve(0));
        }
        mesh
    }

    #[test]
    fn an_edge_that_joins_the_ends_is_the_path() {
        let mut mesh = RefinedMesh::new(&square(2));
        let path = mesh.insert_path((0, 4), Mark::Arc(3), |_, _| true, |_| true, xy).unwrap();
        assert_eq!((path, mesh.n_vertices()), (vec![0, 4], 9));
        assert_eq!(mesh.mark(mesh.find(4, 0).unwrap()), Mark::Arc(3));
    }

    #[test]
    fn a_path_crosses_a_marked_edge_once_where_it_must() {
        let mut mesh = with_column();
        let path = mesh.insert_path((3, 5), Mark::Curve(1), |_, _| true, |_| false, xy).unwrap();
        let crossings = path.iter().filter(|&&v| mesh.marked_degree(v) == 4).count();
        assert_eq!(crossings, 1);
        assert!(path[1..path.len() - 1].iter().all(|&v| v >= 9), "older vertices are not passed: {path:?}");
        assert!(mesh.to_mesh().is_ok());
    }

    #[test]
    fn a_barrier_that_separates_the_ends_leaves_no_path() {
        let mut mesh = with_column();
        let error = mesh.insert_path((3, 5), Mark::Curve(1), |_, _| true, |m| m == Mark::Curve(0), xy).unwrap_err();
        assert_eq!(error, NoPath { from: 3, to: 5 });
        assert_eq!(error.to_string(), "no path from vertex 3 to vertex 5 through the triangles allowed");
        assert_eq!(mesh.n_vertices(), 9, "nothing is inserted");
    }
}
