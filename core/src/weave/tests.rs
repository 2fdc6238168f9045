//! A designer's steps on small models.

use std::path::Path;

use glam::DVec3;

use super::*;
use crate::dual::Colour;
use crate::layout::LayoutFile;
use crate::mesh::{LoadedMesh, Normalization, TriMesh, builtin};
use crate::progress::Progress;
use crate::testing::{grid, square, torus};

fn loaded(mesh: TriMesh) -> LoadedMesh {
    let units = Normalization { center: DVec3::ZERO, scale: 1.0 };
    LoadedMesh { mesh, units, repairs: Vec::new(), name: "test".into() }
}

fn session(mesh: TriMesh) -> Session {
    let source = MeshSource::File("test.obj".into());
    Session::open(loaded(mesh), source, Options::default(), &Progress::new()).unwrap()
}

/// The best strip through the point of the surface nearest to `p`, placed.
fn place(session: &mut Session, p: DVec3) -> StripId {
    let at = session.model().index.nearest(p);
    let best = session.proposals(at, &Progress::new()).unwrap().swap_remove(0);
    best.curve.check(&session.model().mesh).unwrap();
    session.place(best, &Progress::new()).unwrap()
}

#[test]
fn two_suggestions_weave_a_torus() {
    let mut s = session(torus(32, 16));
    assert_eq!(s.weave_to(Goal::Separated, &Progress::new()).unwrap(), None);
    assert_eq!(s.design().strips.len(), 2);
    let export = export(&s, &ExportOptions::default(), &Progress::new()).unwrap();
    assert_eq!((export.layout.nodes.len(), export.layout.patches.len()), (1, 1));
    assert!(export.maps.iter().all(|m| m.flipped == 0));
}

#[test]
fn three_suggestions_separate_the_corners_of_a_cube() {
    let source = MeshSource::Builtin("rounded-cube".into());
    let progress = Progress::new();
    let mut s = Session::open(builtin("rounded-cube").unwrap(), source, Options::default(), &progress).unwrap();
    assert_eq!(s.model().corners.len(), 8);
    assert_eq!(s.weave_to(Goal::Separated, &progress).unwrap(), None);
    assert_eq!(s.design().strips.len(), 3);
    let export = export(&s, &ExportOptions::default(), &progress).unwrap();
    assert_eq!((export.layout.nodes.len(), export.layout.patches.len()), (8, 6));
    assert!(export.layout.nodes.iter().all(|n| n.valence == 3));

    let mesh = &s.model().mesh;
    let source = s.design().mesh.clone();
    let file = LayoutFile::from_embedding(source, mesh, &export.layout, &export.before.drawing).unwrap();
    let (again, _) = file.draw(mesh).unwrap().to_embedding().unwrap();
    assert_eq!((again.nodes, again.patches.len()), (export.layout.nodes, 6));
}

#[test]
fn a_sheet_is_woven_from_boundary_to_boundary() {
    let mut s = session(square(16));
    assert_eq!(s.weave_to(Goal::Valid, &Progress::new()).unwrap(), None);
    assert!(s.design().strips.iter().all(|strip| !strip.curve.closed));
    assert!(export(&s, &ExportOptions::default(), &Progress::new()).is_ok());
}

#[test]
fn several_components_are_woven_one_after_the_other() {
    let (a, b) = (torus(24, 12), torus(20, 10));
    let mut positions = a.positions().to_vec();
    positions.extend(b.positions().iter().map(|p| *p + DVec3::Z));
    let shift = a.n_vertices() as u32;
    let triangles = |m: &TriMesh, by| m.faces().map(|f| m.face_vertices(f).map(|v| v.0 + by)).collect::<Vec<_>>();
    let faces = [triangles(&a, 0), triangles(&b, shift)].concat();
    let mut s = session(TriMesh::from_faces(positions, &faces).unwrap());
    assert_eq!(s.weave_to(Goal::Valid, &Progress::new()).unwrap(), None);
    let export = export(&s, &ExportOptions::default(), &Progress::new()).unwrap();
    assert_eq!(export.layout.patches.len(), 2);
}

#[test]
fn undo_redo_and_removal_restore_what_was() {
    let progress = Progress::new();
    let mut s = session(torus(32, 16));
    let first = place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    let one = s.design().clone();
    let second = place(&mut s, DVec3::new(0.0, 0.4, 0.0));
    assert_ne!(first, second);
    let two = s.design().clone();

    s.undo(&progress).unwrap();
    assert_eq!(*s.design(), one);
    assert!(s.can_undo() && s.can_redo());
    s.redo(&progress).unwrap();
    assert_eq!(*s.design(), two);

    s.remove(first, &progress).unwrap();
    assert_eq!(s.design().strips.len(), 1);
    assert!(!s.can_redo());
    assert!(matches!(s.remove(first, &progress), Err(WeaveError::NoStrip(_))));
    s.undo(&progress).unwrap();
    assert_eq!(*s.design(), two);
}

#[test]
fn a_placed_strip_is_not_proposed_again() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    let placed = s.design().strips[0].curve.clone();
    let mesh = s.model().mesh.clone();
    // On the strip itself every further strip must cross it.
    let h = placed.crossings[5].halfedge;
    let at = s.model().index.nearest(mesh.position(mesh.origin(h)));
    for p in s.proposals(at, &Progress::new()).unwrap() {
        let a = s.arranged_with(&p.curve).unwrap();
        assert!(!a.crossings.is_empty());
    }
}

#[test]
fn red_regions_are_named_and_refuse_the_export() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    assert_eq!(s.woven().count(Colour::Red), 1);
    let error = export(&s, &ExportOptions::default(), &Progress::new()).unwrap_err();
    assert!(matches!(error, WeaveError::Layout(crate::layout::LayoutError::RedRegions(ref r)) if r == &[0]));
}

#[test]
fn connectivity_alone_finds_what_separates() {
    // A bare torus and one with a ring: some detour makes progress on each, without any elastica loop.
    let mut s = session(torus(24, 12));
    for wanted in [0, 1] {
        let (woven, mesh) = (s.woven().clone(), s.model().mesh.clone());
        let found = detour::detours(&woven.arrangement, &mesh, 0, 100);
        assert!(!found.is_empty());
        let good = found.into_iter().find(|p| {
            p.curve.check(&mesh).unwrap();
            let a = s.arranged_with(&p.curve).unwrap();
            a.regions.len() == 1 && a.crossings.len() == wanted
        });
        s.place(good.expect("a detour that does not separate"), &Progress::new()).unwrap();
    }
    assert_eq!(s.woven().count(Colour::Red), 0);
}

#[test]
fn cancelled_work_leaves_the_design_as_it_was() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    let before = s.design().clone();
    let cancelled = Progress::new();
    cancelled.cancel();
    assert!(matches!(s.suggest(Goal::Valid, &cancelled), Err(WeaveError::Cancelled(_))));
    assert!(s.undo(&cancelled).is_err());
    assert_eq!(*s.design(), before);
}

#[test]
fn a_design_is_read_as_written_and_only_on_its_mesh() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    let text = serde_json::to_string(s.design()).unwrap();
    let read: Design = serde_json::from_str(&text).unwrap();
    assert_eq!(read, *s.design());
    let again = Session::resume(loaded(torus(32, 16)), read.clone(), &Progress::new()).unwrap();
    assert_eq!(again.woven().reports.len(), s.woven().reports.len());
    let other = grid(32, 16, [true, true], |u, v| DVec3::new(u.cos(), v.sin(), u * v));
    let error = Session::resume(loaded(other), read, &Progress::new()).unwrap_err();
    assert!(matches!(error, WeaveError::Design(DesignError::OtherMesh { .. })));
}

#[test]
fn scripts_name_the_step_that_fails() {
    let script = |steps: &str| -> Script {
        serde_json::from_str(&format!(r#"{{"mesh": "torus", "steps": [{steps}]}}"#)).unwrap()
    };
    let run = |steps: &str| replay(&script(steps), Path::new(""), &Progress::new());
    let s =
        run(r#"{"hover": [1.0, 0.0, 0.0]}, {"browse": 1}, {"place": true}, {"undo": true}, {"redo": true}"#).unwrap();
    assert_eq!(s.design().strips.len(), 1);
    for (steps, wrong) in [
        (r#"{"place": true}"#, 1),
        (r#"{"hover": [1.0, 0.0, 0.0]}, {"place": true}, {"browse": 1}"#, 3),
        (r#"{"undo": true}, {"delete": 3}"#, 2),
    ] {
        assert!(matches!(run(steps), Err(ScriptError::Senseless { step, .. }) if step == wrong));
    }
}

#[test]
fn pins_find_their_parts_again_and_follow_undo() {
    let source = MeshSource::Builtin("rounded-cube".into());
    let progress = Progress::new();
    let mut s = Session::open(builtin("rounded-cube").unwrap(), source, Options::default(), &progress).unwrap();
    s.weave_to(Goal::Separated, &progress).unwrap();
    let drawn = draw(&s, &progress).unwrap();
    let pins = vec![drawn.node_pin(5).unwrap(), drawn.arc_pin(3).unwrap()];
    s.set_pins(pins.clone());
    let text = serde_json::to_string(s.design()).unwrap();
    let read: Design = serde_json::from_str(&text).unwrap();
    assert_eq!(read.pins, pins);
    let parts = drawn.pinned(&read.pins);
    let set = |list: &[bool]| (0..list.len()).filter(|&i| list[i]).collect::<Vec<_>>();
    assert_eq!((set(&parts.nodes), set(&parts.arcs)), (vec![5], vec![3]));

    let last = s.design().strips[2].id;
    s.remove(last, &progress).unwrap();
    assert!(s.design().pins.is_empty());
    s.undo(&progress).unwrap();
    assert_eq!(s.design().pins, pins);
    s.redo(&progress).unwrap();
    assert!(s.design().pins.is_empty());
}
