//! What a loop meets on its way: placed strips and features.
//!
//! Relaxing moves a loop within a tube, and knows nothing of what else lies there. A loop that keeps beside a feature or
//! a placed strip may so come to cross it and return: a strip more across a corner, or a two-sided patch. Comparing what it
//! meets before and after tells.

use std::collections::HashMap;

use crate::mesh::{FaceId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};

/// A stretch of a curve through a triangle: where on its border it enters and leaves, as the number of the side and the
/// share of it.
type Chord = [f64; 2];

/// Placed strips and features of a mesh.
pub(in crate::weave) struct LoopContacts<'a> {
    mesh: &'a TriMesh,
    sharp: &'a [bool],
    /// For each triangle the chords of placed strips in it, with the numbers of these.
    chords: HashMap<FaceId, Vec<(u32, Chord)>>,
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
        let mut company = Self { mesh, sharp, chords: HashMap::new(), n_strips: 0 };
        for (i, curve) in (0..).zip(placed) {
            for (face, chord) in chords(mesh, curve) {
                company.chords.entry(face).or_default().push((i, chord));
            }
            company.n_strips += 1;
        }
        company
    }

    /// What a curve meets.
    pub(in crate::weave) fn met(&self, curve: &SurfaceCurve) -> ContactCounts {
        let mut strips = vec![0; self.n_strips];
        for (face, chord) in chords(self.mesh, curve) {
            for &(i, other) in self.chords.get(&face).into_iter().flatten() {
                strips[i as usize] += u32::from(interleave(chord, other));
            }
        }
        let sharp = |c: &&Crossing| self.sharp[self.mesh.edge(c.halfedge).index()];
        ContactCounts { strips, features: curve.crossings.iter().filter(sharp).count() as u32 }
    }
}

impl ContactCounts {
    /// Whether nothing is crossed more often than before.
    pub(in crate::weave) fn no_more_than(&self, before: &Self) -> bool {
        self.features <= before.features && self.strips.iter().zip(&before.strips).all(|(now, then)| now <= then)
    }
}

/// The chords of a curve and their triangles.
fn chords<'c>(mesh: &'c TriMesh, curve: &'c SurfaceCurve) -> impl Iterator<Item = (FaceId, Chord)> + 'c {
    let n = curve.crossings.len();
    (usize::from(!curve.closed)..n).filter_map(move |i| {
        let (from, to) = (curve.crossings[(i + n - 1) % n], curve.crossings[i]);
        let enters = if mesh.face(from.halfedge) == mesh.face(to.halfedge) {
            // The start of an open curve, seen from the triangle entered.
            place(from)
        } else {
            place(Crossing { halfedge: mesh.twin(from.halfedge)?, t: 1.0 - from.t })
        };
        Some((mesh.face(to.halfedge), [enters, place(to)]))
    })
}

fn place(c: Crossing) -> f64 {
    (c.halfedge.index() % 3) as f64 + c.t
}

/// Whether two chords of a triangle cross: one end of the one lies between the ends of the other, and one does not.
fn interleave([a, b]: Chord, [c, d]: Chord) -> bool {
    let between = |x: f64| (a.min(b) < x) && (x < a.max(b));
    between(c) != between(d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::testing::{cylinder, ring, upright};

    #[test]
    fn rings_meet_uprights_once_and_other_rings_only_where_they_cross() {
        let mesh = cylinder(24, 12, 0.0);
        let none = vec![false; mesh.n_edges()];
        let (low, high, up) = (ring(&mesh, 24, 3, 0.0), ring(&mesh, 24, 5, 0.0), upright(&mesh, 24, 12, 7));
        let company = LoopContacts::new(&mesh, &none, [&low, &up]);
        assert_eq!(company.met(&high), ContactCounts { strips: vec![0, 1], features: 0 });
        // Shaken, a ring crosses the one it was to and fro, always as often there as back.
        let shaken = company.met(&ring(&mesh, 24, 3, 0.3));
        assert!(shaken.strips[0] > 0 && shaken.strips[0].is_multiple_of(2), "{shaken:?}");
        assert_eq!(shaken.strips[1] % 2, 1);
        assert!(!shaken.no_more_than(&company.met(&high)) && company.met(&high).no_more_than(&shaken));
    }

    #[test]
    fn an_upright_meets_each_ring_of_features_once() {
        let mesh = cylinder(24, 12, 0.0);
        // The rings of edges between the rows.
        let level = |h| {
            let (p, q) = (mesh.position(mesh.origin(h)), mesh.position(mesh.target(h)));
            (p.z - q.z).abs() < 1e-9
        };
        let sharp: Vec<bool> = mesh.edges().map(|e| level(mesh.halfedge(e)) && !mesh.is_boundary_edge(e)).collect();
        let company = LoopContacts::new(&mesh, &sharp, []);
        assert_eq!(company.met(&upright(&mesh, 24, 12, 7)).features, 11);
        assert_eq!(company.met(&ring(&mesh, 24, 5, 0.0)).features, 0);
    }
}
