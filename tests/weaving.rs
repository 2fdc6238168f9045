//! Weave scripts replayed by `plait weave`: finished layouts on models of every kind, the same every time.

mod support;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plait_core::weave::{MeshSource, Script};
use serde_json::Value;
use support::{errors, independent_check, manifold, plait, plait_with, read_faces, root, text};
use tempfile::TempDir;

/// A layout that a script has woven.
struct Woven {
    folder: TempDir,
    report: Value,
}

impl Woven {
    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn strips(&self) -> usize {
        self.report["strips"].as_array().unwrap().len()
    }

    fn patches(&self) -> u64 {
        self.report["layout"]["patches"].as_u64().unwrap()
    }

    /// Number of irregular nodes of each valence.
    fn valences(&self) -> BTreeMap<u64, u64> {
        let valences = self.report["layout"]["valences"].as_object().unwrap();
        valences.iter().map(|(valence, n)| (valence.parse().unwrap(), n.as_u64().unwrap())).collect()
    }
}

fn script(name: &str) -> PathBuf {
    root().join("tests/scripts").join(name).with_extension("json")
}

fn report(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("report.json")).unwrap()).unwrap()
}

/// Replays a script and checks all that it wrote against the mesh; `None` with a note where the mesh is missing.
fn weave(name: &str) -> Option<Woven> {
    let path = script(name);
    let source = match MeshSource::from_name(&Script::read(&path).unwrap().mesh) {
        MeshSource::Builtin(name) => root().join("assets/models").join(name).with_extension("obj"),
        MeshSource::File(file) => path.parent().unwrap().join(file),
    };
    if !source.is_file() {
        eprintln!("note: {name} is skipped, there is no {}", source.display());
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = plait(&["weave", text(&path), "--out", text(folder.path())]);
    assert!(output.status.success(), "{name}: {}", errors(&output));

    let report = report(folder.path());
    assert_eq!(report["valid"], true, "{report}");
    assert_eq!(report["colours"]["red"], 0, "{report}");
    assert!(folder.path().join("design.plait").is_file());

    let mesh = plait_core::mesh::load(&source).unwrap().mesh;
    let topology = plait_core::mesh::Topology::new(&mesh);
    let expected = support::Shape { euler: mesh.euler_characteristic(), boundary_loops: topology.boundary_loops.len() };
    let quads = read_faces(&folder.path().join("quads.obj"));
    assert!(quads.iter().all(|q| q.len() == 4), "{name}: not only quads");
    assert_eq!(quads.len() as u64, report["layout"]["quads"].as_u64().unwrap(), "{name}");
    assert_eq!(manifold(&quads), expected, "{name}: quads.obj");
    // Its corners differ per patch, so that only counts can be compared.
    let triangles = read_faces(&folder.path().join("patches.obj"));
    assert!(triangles.len() >= mesh.n_faces(), "{name}: patches.obj lacks triangles");
    let layout = read_faces(&folder.path().join("layout.obj"));
    assert_eq!(layout.len() as u64, report["layout"]["patches"].as_u64().unwrap(), "{name}: layout.obj");

    if let Some(figures) = independent_check(&folder.path().join("quads.obj"), &source) {
        let distance = figures["distance_mean"].as_f64().unwrap();
        assert!(distance < 0.005, "{name}: the quads stray from the surface by {distance}");
        // A boundary node of one patch on a smooth boundary has a flat corner: its quad is neither folded nor not.
        if !FLAT_CORNERS.contains(&name) {
            assert_eq!(figures["folded"], 0, "{name}: folded quads");
        }
    }
    Some(Woven { folder, report })
}

/// Scripts whose layouts have boundary nodes where just one patch meets a smooth boundary.
const FLAT_CORNERS: [&str; 2] = ["aqua_center", "vase_open"];

#[test]
fn a_rounded_cube_takes_three_strips_for_its_eight_corners() {
    let woven = weave("rounded-cube").unwrap();
    assert_eq!((woven.strips(), woven.patches()), (3, 6));
    assert_eq!(woven.valences(), BTreeMap::from([(3, 8)]));
}

#[test]
fn a_sharp_cube_takes_three_strips_for_its_eight_corners() {
    let Some(woven) = weave("od_cube") else { return };
    assert_eq!((woven.strips(), woven.patches()), (3, 6));
    assert_eq!(woven.valences(), BTreeMap::from([(3, 8)]));
}

#[test]
fn a_torus_takes_two_loops_for_its_one_patch() {
    let woven = weave("torus").unwrap();
    assert_eq!((woven.strips(), woven.patches()), (2, 1));
    assert!(woven.valences().is_empty());
}

/// Weaves and asserts that there are no more patches than `patches`, and that the valences of irregular nodes are
/// among those given: what a designer would call few and well placed.
fn finishes(name: &str, patches: u64, valences: std::ops::RangeInclusive<u64>) {
    let Some(woven) = weave(name) else { return };
    assert!(woven.patches() <= patches, "{name}: {} patches", woven.patches());
    let found = woven.valences();
    assert!(found.keys().all(|v| valences.contains(v)), "{name}: irregular nodes of valence {found:?}");
}

#[test]
fn creature_is_woven() {
    finishes("creature", 14, 3..=5);
}

#[test]
fn pretzel_is_woven() {
    finishes("pretzel", 24, 3..=6);
}

#[test]
fn sleeve_is_woven() {
    finishes("sleeve", 16, 3..=6);
}

#[test]
fn bunny_is_woven() {
    finishes("bunny_7k", 6, 3..=3);
    finishes("bunny_7k_fine", 36, 3..=6);
}

#[test]
fn rocker_arm_is_woven() {
    finishes("rockerarm_5k", 14, 3..=6);
}

#[test]
fn three_holes_are_woven() {
    finishes("cino_3holes", 24, 5..=5);
}

#[test]
fn fertility_is_woven() {
    finishes("fertility_13k", 24, 3..=8);
}

#[test]
fn fandisk_is_woven() {
    finishes("fandisk_14k", 12, 3..=5);
}

#[test]
fn an_open_vase_is_woven() {
    let Some(woven) = weave("vase_open") else { return };
    // One patch, its corners at those of the boundary.
    assert_eq!(woven.patches(), 1);
    assert_eq!(woven.valences(), BTreeMap::from([(1, 4)]));
}

#[test]
fn a_plate_with_holes_is_woven() {
    finishes("aqua_center", 30, 1..=6);
}

/// A script on the torus, written to a file.
fn torus_script(folder: &Path, steps: &str) -> PathBuf {
    let path = folder.join("script.json");
    std::fs::write(&path, format!(r#"{{"mesh": "torus", "steps": [{steps}]}}"#)).unwrap();
    path
}

/// The first loop of the torus.
const MERIDIAN: &str = r#"{"hover": [1.07, 0, 0]}, {"place": true}"#;
/// Through the same point, where the meridian is no longer proposed.
const EQUATOR: &str = MERIDIAN;

#[test]
fn steps_are_taken_back_and_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let design = |name: &str, steps: &str| {
        let out = folder.path().join(name);
        let output = plait(&["weave", text(&torus_script(folder.path(), steps)), "--out", text(&out)]);
        assert!(output.status.success(), "{name}: {}", errors(&output));
        std::fs::read(out.join("design.plait")).unwrap()
    };
    let straight = design("straight", &format!("{MERIDIAN}, {EQUATOR}"));
    let history = r#"{"undo": true}, {"redo": true}, {"delete": 0}, {"delete": 0}, {"undo": true}, {"undo": true}"#;
    let around = design("around", &format!("{MERIDIAN}, {EQUATOR}, {history}"));
    assert!(straight == around, "undo and redo have changed the design");
    // Only the equator is left, so that the meridian is proposed again.
    let replaced = design("replaced", &format!("{MERIDIAN}, {EQUATOR}, {{\"delete\": 0}}, {MERIDIAN}"));
    assert!(straight != replaced, "the order of the strips is lost");
}

#[test]
fn a_script_goes_on_with_a_saved_design() {
    let folder = tempfile::tempdir().unwrap();
    let weave = |script: &Path, name: &str| {
        let out = folder.path().join(name);
        let output = plait(&["weave", text(script), "--no-optimise", "--out", text(&out)]);
        assert!(output.status.success(), "{name}: {}", errors(&output));
        out.join("design.plait")
    };
    let first = weave(&torus_script(folder.path(), &format!("{MERIDIAN}, {EQUATOR}")), "first");
    let again = folder.path().join("again.json");
    let history = format!(r#"{{"delete": 0}}, {MERIDIAN}"#);
    std::fs::write(&again, format!(r#"{{"mesh": "first/design.plait", "steps": [{history}]}}"#)).unwrap();
    let at_once = weave(&torus_script(folder.path(), &format!("{MERIDIAN}, {EQUATOR}, {history}")), "at-once");
    let strips = |path: &Path| {
        let design: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let curves = design["strips"].as_array().unwrap().iter().map(|s| s["curve"].clone());
        curves.collect::<Vec<_>>()
    };
    assert_eq!(strips(&weave(&again, "again")), strips(&at_once));
    assert_ne!(strips(&at_once), strips(&first));
    // What is no design is refused by its name.
    std::fs::write(folder.path().join("none.plait"), "{}").unwrap();
    std::fs::write(&again, r#"{"mesh": "none.plait", "steps": []}"#).unwrap();
    let output = plait(&["weave", text(&again), "--out", text(folder.path())]);
    assert!(!output.status.success() && errors(&output).contains("none.plait is not a Plait design"));
}

#[test]
fn other_strips_are_tried_by_a_script_and_by_the_command_line_alike() {
    let folder = tempfile::tempdir().unwrap();
    let [scripted, asked] = ["scripted", "asked"].map(|n| folder.path().join(n));
    let script = torus_script(folder.path(), &format!(r#"{MERIDIAN}, {EQUATOR}, {{"improve": 3}}"#));
    let output = plait(&["weave", text(&script), "--no-optimise", "--out", text(&scripted)]);
    assert!(output.status.success(), "{}", errors(&output));
    let script = torus_script(folder.path(), &format!("{MERIDIAN}, {EQUATOR}"));
    let output = plait(&["weave", text(&script), "--improve", "3", "--no-optimise", "--out", text(&asked)]);
    assert!(output.status.success(), "{}", errors(&output));
    assert!(errors(&output).contains("objective"), "{}", errors(&output));
    let [a, b] = [scripted, asked].map(|f| std::fs::read(f.join("design.plait")).unwrap());
    assert!(a == b, "the designs differ");
}

#[test]
fn a_mistake_in_a_script_is_named_with_its_step() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for (steps, part) in [
        (r#"{"browse": 1}"#.to_owned(), "step 1"),
        (r#"{"place": true}"#.to_owned(), "step 1"),
        (format!(r#"{MERIDIAN}, {{"delete": 1}}"#), "step 3"),
        (format!(r#"{MERIDIAN}, {{"place": true}}"#), "step 3"),
        (r#"{"hover": [1, 2]}"#.to_owned(), "not a weave script"),
        (r#"{"jump": true}"#.to_owned(), "not a weave script"),
    ] {
        let output = plait(&["weave", text(&torus_script(folder.path(), &steps)), "--out", text(&out)]);
        assert!(!output.status.success(), "{steps}");
        assert!(errors(&output).contains(part), "{steps}: {}", errors(&output));
    }
}

#[test]
fn an_unfinished_layout_is_reported_and_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = plait(&["weave", text(&torus_script(folder.path(), MERIDIAN)), "--out", text(&out)]);
    assert!(!output.status.success());
    assert!(!errors(&output).is_empty());
    let report = report(&out);
    assert_eq!((&report["valid"], &report["layout"]), (&Value::Bool(false), &Value::Null));
    assert!(report["colours"]["red"].as_u64().unwrap() > 0, "{report}");
    assert!(report["problem"].as_str().is_some_and(|p| !p.is_empty()), "{report}");
    assert!(out.join("design.plait").is_file() && !out.join("quads.obj").exists());
}

/// All files of a folder but the times in the report.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        files.insert(entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap());
    }
    let mut report = report(folder);
    report.as_object_mut().unwrap().remove("seconds").unwrap();
    files.insert("report.json".into(), report.to_string().into_bytes());
    files
}

#[test]
fn one_thread_and_two_write_the_same_bytes() {
    for name in ["creature", "sleeve"] {
        let [one, two, again] = [("one", "1"), ("two", "2"), ("again", "2")].map(|(folder, threads)| {
            let out = tempfile::tempdir().unwrap();
            let path = out.path().join(folder);
            let script = script(name);
            let arguments = ["weave", text(&script), "--out", text(&path)];
            let output = plait_with(&arguments, &[("RAYON_NUM_THREADS", threads)]);
            assert!(output.status.success(), "{name}: {}", errors(&output));
            files(&path)
        });
        assert!(one.len() >= 5, "{:?}", one.keys());
        for (file, bytes) in &one {
            assert!(two[file] == *bytes, "{name}: {file} differs between one thread and two");
            assert!(again[file] == *bytes, "{name}: {file} differs between two runs");
        }
    }
}

#[test]
fn a_saved_design_opens_to_the_same_layout() {
    let woven = weave("rounded-cube").unwrap();
    let design = woven.file("design.plait");
    let again = tempfile::tempdir().unwrap();
    let output = plait(&["weave", text(&design), "--out", text(again.path())]);
    assert!(output.status.success(), "{}", errors(&output));
    for name in ["design.plait", "layout.obj", "quads.obj", "patches.obj"] {
        let [before, after] = [woven.folder.path(), again.path()].map(|f| std::fs::read(f.join(name)).unwrap());
        assert!(before == after, "{name} has changed");
    }
    let picture = woven.file("picture.png");
    let output = plait(&["render", text(&design), "--out", text(&picture), "--size", "320x240"]);
    assert!(output.status.success(), "{}", errors(&output));
    let bare = woven.file("bare.png");
    let output = plait(&["render", "rounded-cube", "--out", text(&bare), "--size", "320x240"]);
    assert!(output.status.success(), "{}", errors(&output));
    let [picture, bare] = [picture, bare].map(|p| image::open(p).unwrap().to_rgb8());
    let different = picture.pixels().zip(bare.pixels()).filter(|(a, b)| a != b).count();
    assert!(different > 1000, "the picture of the design shows no layout ({different} pixels differ)");
}
