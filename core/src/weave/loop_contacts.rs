//! Counts of the crossings of a loop with placed strips and features.
//!
//! Relaxation moves a loop within a tube regardless of features and strips there. A loop beside one of them may then cross
//! it and return, which adds a strip across a corner or a two-sided patch. Comparing the crossings before and after detects
//! this.

use std::collections::HashMap;

use crate::mesh::{FaceId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};

/// The part of a curve in a triangle: where it enters and leaves on the border, as the number of the side, 0 to 2, plus the
/// fraction along it.
type TriangleSegment = [f64; 2];

/// Placed strips and features of a mesh.
pub(in crate::weave) struct LoopContacts<'a> {
    mesh: &'a TriMesh,
    sharp: &'a [bool],
    /// For each triangle the segments of placed strips in it, each with the number of its strip.
    segments: HashMap<FaceId, Vec<(u32, TriangleSegment)>>,
    n_strips: usize,
}

/// How often a curve crosses each placed strip, and features.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::weave) struct ContactCounts {
    strips: Vec<u32>,
    features: u32,
}

impl<'a> LoopContacts<'a> {
    pub(in crate::weave) fn new<'s>(
        mesh: &'a TriMesh,
        sharp: &'a [bool],
        placed: impl IntoIterator<Item = &'s SurfaceCurve>,
    ) -> Self {
        let mut contacts = Self { mesh, sharp, segments: HashMap::new(), n_strips: 0 };
        for (i, curve) in (0..).zip(placed) {
            for (face, segment) in segments(mesh, curve) {
                contacts.segments.entry(face).or_default().push((i, segment));
            }
            contacts.n_strips += 1;
        }
        contacts
    }

    /// How often a curve crosses each strip and the features.
    pub(in crate::weave) fn count(&self, curve: &SurfaceCurve) -> ContactCounts {
        let mut strips = vec![0; self.n_strips];
        for (face, segment) in segments(self.mesh, curve) {
            for &(i, other) in self.segments.get(&face).into_iter().flatten() {
                strips[i as usize] += u32::from(interleave(segment, other));
            }
        }
        let sharp = |c: &&Crossing| self.sharp[self.mesh.edge(c.halfedge).index()];
        ContactCounts { strips, features: curve.crossings.iter().filter(sharp).count() as u32 }
    }
}

impl ContactCounts {
    /// Whether neither any strip nor the features together are crossed more often than in `before`.
    pub(in crate::weave) fn at_most(&self, before: &Self) -> bool {
        self.features <= before.features && self.strips.iter().zip(&before.strips).all(|(now, then)| now <= then)
    }
}

/// The segments of a curve, each with its triangle.
fn segments<'c>(mesh: &'c TriMesh, curve: &'c SurfaceCurve) -> impl Iterator<Item = (FaceId, TriangleSegment)> + 'c {
    let n = curve.crossings.len();
    (usize::from(!curve.closed)..n).filter_map(move |i| {
        let (from, to) = (curve.crossings[(i + n - 1) % n], curve.crossings[i]);
        let enters = if mesh.face(from.halfedge) == mesh.face(to.halfedge) {
            // The start of an open curve is given in the triangle that the curve enters.
            border_parameter(from)
        } else {
            border_parameter(Crossing { halfedge: mesh.twin(from.halfedge)?, t: 1.0 - from.t })
        };
        Some((mesh.face(to.halfedge), [enters, border_parameter(to)]))
    })
}

/// The position of a crossing on the border of its half-edge's triangle.
fn border_parameter(c: Crossing) -> f64 {
    (c.halfedge.index() % 3) as f64 + c.t
}

/// Whether two segments of a triangle cross: exactly one end of one segment lies between the ends of the other.
fn interleave([a, b]: TriangleSegment, [c, d]: TriangleSegment) -> bool {
    let between = |x: f64| (a.min(b) < x) && (x < a.max(b));
    between(c) != between(d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::testing::{cylinder, ring, upright};

    #[test]
    fn rings_cross_uprights_once_and_other_rings_an_even_number_of_times() {
        let mesh = cylinder(24, 12, 0.0);
        let none = vec![false; mesh.n_edges()];
        let (low, high, up) = (ring(&mesh, 24, 3, 0.0), ring(&mesh, 24, 5, 0.0), upright(&mesh, 24, 12, 7));
        let contacts = LoopContacts::new(&mesh, &none, [&low, &up]);
        assert_eq!(contacts.count(&high), ContactCounts { strips: vec![0, 1], features: 0 });
        // A perturbed ring crosses the straight one back and forth.
        let shaken = contacts.count(&ring(&mesh, 24, 3, 0.3));
        assert!(shaken.strips[0] > 0 && shaken.strips[0].is_multiple_of(2), "{shaken:?}");
        assert_eq!(shaken.strips[1] % 2, 1);
        assert!(!shaken.at_most(&contacts.count(&high)) && contacts.count(&high).at_most(&shaken));
    }

    #[test]
    fn an_upright_crosses_each_ring_of_features_once() {
        let mesh = cylinder(24, 12, 0.0);
        // The sharp edges are the horizontal ones between the rows.
        let level = |h| {
            let (p, q) = (mesh.position(mesh.origin(h)), mesh.position(mesh.target(h)));
            (p.z - q.z).abs() < 1e-9
        };
        let sharp: Vec<bool> = mesh.edges().map(|e| level(mesh.halfedge(e)) && !mesh.is_boundary_edge(e)).collect();
        let contacts = LoopContacts::new(&mesh, &sharp, []);
        assert_eq!(contacts.count(&upright(&mesh, 24, 12, 7)).features, 11);
        assert_eq!(contacts.count(&ring(&mesh, 24, 5, 0.0)).features, 0);
    }
}
