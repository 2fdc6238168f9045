//! Weaving on small models, step by step.

mod editing;
mod improving;
mod turning;

use std::path::Path;

use glam::DVec3;

use super::embedding::initial_layout_as_woven;
use super::export::session_export::export_layout;
use super::search::detour;
use super::*;
use crate::dual::Colour;
use crate::embed::Next;
use crate::layout::LayoutFile;
use crate::mesh::{LoadedMesh, Normalisation, TriMesh, builtin};
use crate::progress::Progress;
use crate::testing::{grid, square, torus};

fn loaded(mesh: TriMesh) -> LoadedMesh {
    let units = Normalisation { by: Options::default().normalised_by, centre: DVec3::ZERO, scale: 1.0 };
    LoadedMesh { mesh: mesh.into(), units, repairs: Vec::new(), name: "test".into() }
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
    let file = LayoutFile::from_embedding(source, mesh, &export.layout, &export.initial.initial_embedding).unwrap();
    let (again, _) = file.partial_embedding(mesh).unwrap().to_embedding().unwrap();
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
fn undo_redo_and_removal_restore_former_states() {
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
fn red_regions_are_named_and_prevent_the_export() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    assert_eq!(s.woven().count(Colour::Red), 1);
    let error = export(&s, &ExportOptions::default(), &Progress::new()).unwrap_err();
    assert!(matches!(error, WeaveError::Layout(crate::layout::LayoutError::RedRegions(ref r)) if r == &[0]));
}

#[test]
fn detours_cut_regions_that_are_not_discs() {
    // On a torus without strips and on one with a single strip some detour does not separate.
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
fn cancelled_work_leaves_the_design_unchanged() {
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
fn a_design_is_read_as_written_and_refused_on_another_mesh() {
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
fn errors_of_scripts_name_the_step() {
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
        assert!(matches!(run(steps), Err(ScriptError::NotApplicable { step, .. }) if step == wrong));
    }
}

#[test]
fn pins_identify_their_parts_and_follow_undo() {
    let source = MeshSource::Builtin("rounded-cube".into());
    let progress = Progress::new();
    let mut s = Session::open(builtin("rounded-cube").unwrap(), source, Options::default(), &progress).unwrap();
    s.weave_to(Goal::Separated, &progress).unwrap();
    let initial = initial_layout(&s, &progress).unwrap();
    let pins = vec![initial.node_pin(5).unwrap(), initial.arc_pin(3).unwrap()];
    s.set_pins(pins.clone());
    let text = serde_json::to_string(s.design()).unwrap();
    let read: Design = serde_json::from_str(&text).unwrap();
    assert_eq!(read.pins, pins);
    let parts = initial.pinned(&read.pins);
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

/// A session that weaves a mesh on a proxy of `proxy` triangles.
fn on_proxy(mesh: TriMesh, proxy: u32) -> Session {
    let source = MeshSource::File("test.obj".into());
    let options = Options { proxy, ..Options::default() };
    Session::open(loaded(mesh), source, options, &Progress::new()).unwrap()
}

#[test]
fn a_large_mesh_is_woven_on_its_proxy() {
    let progress = Progress::new();
    let mut s = on_proxy(torus(96, 48), 2000);
    assert_eq!((s.model().mesh.n_faces(), s.model().loaded.mesh.n_faces()), (2000, 9216));
    for p in [DVec3::new(0.4, 0.0, 0.0), DVec3::new(0.0, 0.4, 0.0)] {
        let at = s.model().index.nearest(p);
        let best = s.proposals(at, &progress).unwrap().swap_remove(0);
        let (mesh, on_design_mesh) = (&s.model().loaded.mesh, s.model().on_design_mesh(&best.curve));
        let passes = on_design_mesh.iter().map(|q| q.distance(at.position(mesh))).fold(f64::MAX, f64::min);
        assert!(passes < 0.02, "{passes}");
        assert!(on_design_mesh.iter().all(|q| s.model().index.nearest(*q).position(mesh).distance(*q) < 1e-9));
        s.place(best, &progress).unwrap();
    }
    let (design, mesh) = (s.design().clone(), s.model().loaded.mesh.clone());
    for strip in &design.strips {
        strip.curve.check(&mesh).unwrap();
        strip.woven().check(&s.model().mesh).unwrap();
        assert!((strip.curve.length(&mesh) / strip.woven().length(&s.model().mesh) - 1.0).abs() < 0.05);
    }
    // A design that is written and read again is the same to the last bit.
    let text = serde_json::to_string(&design).unwrap();
    let again: Design = serde_json::from_str(&text).unwrap();
    assert_eq!(again, design);
    let again = Session::resume(loaded(torus(96, 48)), again, &progress).unwrap();
    assert_eq!(*again.design(), design);
    assert_eq!(again.woven().arrangement.region_of_face, s.woven().arrangement.region_of_face);
}

#[test]
fn a_design_opens_with_and_without_a_proxy() {
    let progress = Progress::new();
    let mut s = on_proxy(torus(96, 48), 2000);
    assert_eq!(s.weave_to(Goal::Valid, &progress).unwrap(), None);
    let design = s.design().clone();
    let curves = |d: &Design| d.strips.iter().map(|s| s.curve.clone()).collect::<Vec<_>>();
    for proxy in [0, 1500, 3000, 40] {
        let changed = Options { proxy, ..design.options };
        let other =
            Session::resume(loaded(torus(96, 48)), Design { options: changed, ..design.clone() }, &progress).unwrap();
        assert_eq!(curves(other.design()), curves(&design), "{proxy}");
        assert_eq!(other.design().proxy.is_some(), other.model().proxy.is_some());
        assert_eq!(other.woven().arrangement.crossings.len(), s.woven().arrangement.crossings.len(), "{proxy}");
        let options = ExportOptions { embedding: None, ..ExportOptions::default() };
        assert!(export(&other, &options, &progress).is_ok(), "{proxy}");
    }
    assert_eq!(Session::resume(loaded(torus(96, 48)), design, &progress).unwrap().model().mesh.n_faces(), 2000);
}

#[test]
fn a_design_without_a_proxy_does_not_mention_one() {
    let mut s = session(torus(32, 16));
    place(&mut s, DVec3::new(0.4, 0.0, 0.0));
    let text = serde_json::to_string(s.design()).unwrap();
    assert!(!text.contains("proxy") && !text.contains("smoothing"), "{text}");
}

#[test]
fn a_layout_embedded_on_the_proxy_has_its_quads_on_the_mesh() {
    let progress = Progress::new();
    for mesh in [torus(96, 48), grid(64, 64, [false, false], |u, v| DVec3::new(u, v, 0.1 * (6.0 * u).sin() * v))] {
        let mut s = on_proxy(mesh, 1500);
        assert_eq!(s.weave_to(Goal::Valid, &progress).unwrap(), None);
        let mesh = s.model().loaded.mesh.clone();
        let far = |e: &Export| {
            let off = |p: &DVec3| s.model().index.nearest(*p).position(&mesh).distance(*p);
            e.quads.positions.iter().map(off).fold(0.0, f64::max)
        };
        let on_mesh = export(&s, &ExportOptions::default(), &progress).unwrap();
        assert_eq!(on_mesh.mesh_role, MeshRole::Design);
        let initial = initial_layout_as_woven(&s, &progress).unwrap();
        assert_eq!(initial.mesh_role, MeshRole::Proxy);
        let mut watch = |_: &_| Next::Continue;
        let on_proxy = export_layout(&s, &initial, None, &ExportOptions::default(), &progress, &mut watch).unwrap();
        let count = |e: &Export| (e.layout.patches.len(), e.layout.nodes.len(), e.layout.n_irregular());
        assert_eq!(count(&on_mesh), count(&on_proxy));
        assert!(far(&on_mesh) < 1e-9 && far(&on_proxy) < 1e-9, "{} {}", far(&on_mesh), far(&on_proxy));
        for (e, name) in [(on_mesh, "mesh"), (on_proxy, "proxy")] {
            assert_eq!(crate::quad::quality(&e.quads).0, 0, "folded on the {name}");
        }
    }
}
