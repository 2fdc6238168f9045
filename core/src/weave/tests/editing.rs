//! Random edits of a design: every state keeps the invariants of the session and of the arrangement.

use proptest::prelude::*;

use super::*;
use crate::dual::{Arrangement, Colour, SideKind};
use crate::surface::SurfaceCurve;
use crate::testing::{column, diagonal, row};

/// Cells of a grid in each direction.
const N: u32 = 8;

/// One edit of a designer.
#[derive(Debug, Clone, Copy)]
enum Edit {
    /// Places the curve along this row, column or diagonal.
    Row(u32),
    Column(u32),
    Diagonal,
    /// Removes the strip with this number modulo the number of strips, if there is any.
    Remove(usize),
    Undo,
    Redo,
}

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let one = prop_oneof![
        3 => (0..N).prop_map(Edit::Row),
        3 => (0..N).prop_map(Edit::Column),
        1 => Just(Edit::Diagonal),
        2 => any::<usize>().prop_map(Edit::Remove),
        2 => Just(Edit::Undo),
        1 => Just(Edit::Redo),
    ];
    prop::collection::vec(one, 1..12)
}

/// The kind of a strip, by which crossings are counted.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Row,
    Column,
    Diagonal,
}

/// A session beside what it should hold: strips with their kinds, and the states before and after.
struct Checked {
    session: Session,
    closed: bool,
    strips: Vec<(StripId, Kind)>,
    past: Vec<Vec<(StripId, Kind)>>,
    future: Vec<Vec<(StripId, Kind)>>,
    placed: u32,
}

impl Checked {
    fn new(closed: bool) -> Self {
        let session = session(if closed { torus(N, N) } else { square(N) });
        Self { session, closed, strips: Vec::new(), past: Vec::new(), future: Vec::new(), placed: 0 }
    }

    fn curve(&self, edit: Edit) -> Option<(Kind, SurfaceCurve)> {
        // Distinct fractions, none of them 1/2, where the diagonal crosses: straight lines that cross each other once.
        let t = 0.1 + 0.37 * (f64::from(self.placed) * 0.618_034).fract();
        match edit {
            Edit::Row(j) => Some((Kind::Row, row(N, j, self.closed, t))),
            Edit::Column(i) => Some((Kind::Column, column(N, N, i, self.closed, t))),
            Edit::Diagonal if self.closed && self.count(Kind::Diagonal) == 0 => Some((Kind::Diagonal, diagonal(N))),
            _ => None,
        }
    }

    fn count(&self, kind: Kind) -> usize {
        self.strips.iter().filter(|s| s.1 == kind).count()
    }

    fn apply(&mut self, edit: Edit) {
        let progress = Progress::new();
        match edit {
            Edit::Row(_) | Edit::Column(_) | Edit::Diagonal => {
                let Some((kind, curve)) = self.curve(edit) else { return };
                let id = self
                    .session
                    .place(Proposal { curve, cost: 1.0, energy: None, anchors: Vec::new() }, &progress)
                    .unwrap();
                assert_eq!(id, StripId(self.placed), "numbers are not reused");
                self.placed += 1;
                self.change(|strips| strips.push((id, kind)));
            }
            Edit::Remove(_) if self.strips.is_empty() => {}
            Edit::Remove(k) => {
                let k = k % self.strips.len();
                self.session.remove(self.strips[k].0, &progress).unwrap();
                self.change(|strips| {
                    strips.remove(k);
                });
            }
            Edit::Undo => {
                self.session.undo(&progress).unwrap();
                if let Some(before) = self.past.pop() {
                    self.future.push(std::mem::replace(&mut self.strips, before));
                }
            }
            Edit::Redo => {
                self.session.redo(&progress).unwrap();
                if let Some(after) = self.future.pop() {
                    self.past.push(std::mem::replace(&mut self.strips, after));
                }
            }
        }
    }

    fn change(&mut self, change: impl FnOnce(&mut Vec<(StripId, Kind)>)) {
        self.past.push(self.strips.clone());
        self.future.clear();
        change(&mut self.strips);
    }

    /// The design holds the expected strips, and everything derived from them is what a new session derives.
    fn check_session(&self) {
        let (session, design) = (&self.session, self.session.design());
        let found: Vec<StripId> = design.strips.iter().map(|s| s.id).collect();
        let wanted: Vec<StripId> = self.strips.iter().map(|s| s.0).collect();
        assert_eq!(found, wanted);
        assert_eq!((session.can_undo(), session.can_redo()), (!self.past.is_empty(), !self.future.is_empty()));
        let again = Woven::new(session.model(), &design.strips, &Progress::new()).unwrap();
        let woven = session.woven();
        assert_eq!(again.arrangement.region_of_face, woven.arrangement.region_of_face);
        assert_eq!(again.arrangement.crossings, woven.arrangement.crossings);
        assert_eq!(woven.reports.len(), woven.arrangement.regions.len());
        assert_eq!(woven.red().len(), woven.count(Colour::Red));
    }

    /// Lines cross as often as straight lines do, regions partition the surface, and Euler's formula holds.
    fn check_arrangement(&self) {
        let a: &Arrangement = &self.session.woven().arrangement;
        let [rows, columns, diagonals] = [Kind::Row, Kind::Column, Kind::Diagonal].map(|k| self.count(k));
        assert_eq!(a.crossings.len(), rows * columns + diagonals * (rows + columns));
        assert_eq!(a.ends.len(), if self.closed { 0 } else { 2 * self.strips.len() });
        let mut seen = vec![false; a.refined.n_faces()];
        for (r, region) in a.regions.iter().enumerate() {
            for &f in &region.faces {
                assert!(!std::mem::replace(&mut seen[f as usize], true), "face {f} is in two regions");
                assert_eq!(a.region_of_face[f as usize] as usize, r);
            }
        }
        assert!(seen.into_iter().all(|s| s), "a face is in no region");
        // Every segment borders a region on either side; rings have no vertices.
        let sides = a.regions.iter().flat_map(|r| r.borders.iter().flatten());
        let sides = sides.filter(|s| s.kind != SideKind::Boundary).count();
        assert_eq!(sides, 2 * a.segments.len());
        let chains = a.segments.iter().filter(|s| !s.ring).count();
        if self.closed {
            assert_eq!(2 * a.crossings.len(), chains);
            let faces: i64 = a.regions.iter().map(|r| r.euler).sum();
            assert_eq!(a.crossings.len() as i64 - chains as i64 + faces, 0, "the Euler characteristic of a torus");
        } else {
            assert_eq!(2 * a.crossings.len() + self.strips.len(), chains);
            assert_eq!(a.regions.len(), (rows + 1) * (columns + 1));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_edits_keep_session_and_arrangement_consistent(closed in any::<bool>(), edits in edits()) {
        let mut checked = Checked::new(closed);
        for edit in edits {
            checked.apply(edit);
            checked.check_session();
            checked.check_arrangement();
        }
    }
}
