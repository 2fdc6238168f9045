//! Improving layouts of small models.

use std::ops::ControlFlow;

use super::*;
use crate::layout::LayoutError;
use crate::surface::SurfaceCurve;
use crate::testing::{column, diagonal, row};

const N: u32 = 16;
/// Rounds; enough for layouts of a few strips.
const ROUNDS: usize = 6;

fn with_strips(mesh: TriMesh, curves: impl IntoIterator<Item = SurfaceCurve>) -> Session {
    let mut s = session(mesh);
    for curve in curves {
        s.place(Proposal { curve, cost: 1.0, energy: None, anchors: Vec::new() }, &Progress::new()).unwrap();
    }
    s
}

/// A torus with more strips than it needs.
fn redundant() -> Session {
    let rows = [2, 12].map(|j| row(N, j, true, 0.4));
    let columns = [3, 13].map(|i| column(N, N, i, true, 0.4));
    with_strips(torus(N, N), rows.into_iter().chain(columns))
}

fn improve(s: &mut Session, rounds: usize) -> Improvement {
    s.improve(rounds, &Progress::new(), &mut |_, _| ControlFlow::Continue(())).unwrap()
}

#[test]
fn redundant_strips_are_removed_in_one_step_of_the_history() {
    let mut s = redundant();
    let before = s.design().strips.clone();
    let found = improve(&mut s, ROUNDS);
    let now = found.after.patches;
    assert!((found.before.patches, s.design().strips.len() < 4) == (4, true) && now < 4, "{found:?}");
    assert!(
        found.after.objective < found.before.objective && s.woven().arrangement.crossings.len() == now,
        "{found:?}"
    );
    let after = s.design().strips.clone();
    s.undo(&Progress::new()).unwrap();
    assert_eq!(s.design().strips, before);
    s.redo(&Progress::new()).unwrap();
    assert_eq!(s.design().strips, after);
}

#[test]
fn winding_strips_are_replaced_by_aligned_ones() {
    let mut s = with_strips(torus(N, N), [column(N, N, 3, true, 0.4), diagonal(N)]);
    let found = improve(&mut s, ROUNDS);
    // Fields of both windings are parallel; only the map shows which of them is aligned.
    assert!(found.after.objective < 0.7 * found.before.objective && found.after.alignment < 4.0, "{found:?}");
    assert!(s.woven().red().is_empty() && found.after.irregular == 0);
    // The optimised embedding has the predicted alignment.
    let export = export(&s, &ExportOptions::default(), &Progress::new()).unwrap();
    assert!(export.measures().alignment < 4.0, "{:?}", export.measures());
}

#[test]
fn a_stopped_improvement_is_kept_and_a_cancelled_one_dropped() {
    let mut s = redundant();
    let before = s.design().clone();
    let progress = Progress::new();
    let mut seen = 0;
    let cancelled = s.improve(ROUNDS, &progress, &mut |_, _| {
        seen += 1;
        progress.cancel();
        ControlFlow::Continue(())
    });
    assert!(matches!(cancelled, Err(WeaveError::Cancelled(_))) && seen == 1);
    assert_eq!(*s.design(), before);
    assert_eq!(s.woven().arrangement.crossings.len(), 4);

    let mut shown = 0;
    let stopped = s.improve(ROUNDS, &Progress::new(), &mut |s, i| {
        shown = s.design().strips.len();
        assert_eq!(i.changes, 1);
        ControlFlow::Break(())
    });
    assert_eq!((stopped.unwrap().changes, shown), (1, s.design().strips.len()));
    assert_ne!(s.design().strips, before.strips);
}

#[test]
fn improvements_do_not_depend_on_the_number_of_threads() {
    let designs = [1, 2].map(|n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| {
            let mut s = with_strips(torus(N, N), [column(N, N, 3, true, 0.4), diagonal(N)]);
            improve(&mut s, 2);
            s.design().clone()
        })
    });
    assert_eq!(designs[0], designs[1]);
}

#[test]
fn without_a_layout_there_is_nothing_to_improve() {
    let mut s = with_strips(torus(N, N), [row(N, 2, true, 0.4)]);
    let error = s.improve(ROUNDS, &Progress::new(), &mut |_, _| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, WeaveError::Layout(LayoutError::RedRegions(_))), "{error}");
    assert_eq!(s.design().strips.len(), 1);
}

#[test]
fn a_large_mesh_is_improved_on_a_proxy() {
    let n = 80;
    let rows = [8, 48].map(|j| row(n, j, true, 0.4));
    let mut s = with_strips(torus(n, n), rows.into_iter().chain([column(n, n, 3, true, 0.4), diagonal(n)]));
    assert!(s.model().mesh.n_faces() > 12_000 && s.model().proxy.is_none());
    let found = improve(&mut s, 2);
    assert!(found.changes > 0 && found.after.objective < found.before.objective, "{found:?}");
    for strip in &s.design().strips {
        strip.curve.check(&s.model().mesh).unwrap();
        assert!(strip.on_proxy.is_none());
    }
    let layout = initial_layout(&s, &Progress::new()).unwrap().layout;
    assert_eq!(layout.patches.len(), found.after.patches);
}
