//! `plait weave`: the steps of scripts, saved designs, mistakes, and the same bytes in every run.

mod support;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use plait_core::weave::Design;
use serde_json::Value;
use support::replay::{replayed, report, script};
use support::{errors, plait, plait_with, text};

/// A script on the torus, written to a file.
fn torus_script(folder: &Path, steps: &str) -> PathBuf {
    let path = folder.join("script.json");
    std::fs::write(&path, format!(r#"{{"mesh": "torus", "steps": [{steps}]}}"#)).unwrap();
    path
}

/// Places the first loop of the torus.
const MERIDIAN: &str = r#"{"hover": [1.07, 0, 0]}, {"place": true}"#;
/// At the same point, where the meridian is no longer proposed.
const EQUATOR: &str = MERIDIAN;

#[test]
fn steps_are_undone_and_redone() {
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
    // Without its meridian the torus has the meridian proposed again.
    let replaced = design("replaced", &format!("{MERIDIAN}, {EQUATOR}, {{\"delete\": 0}}, {MERIDIAN}"));
    assert!(straight != replaced, "the order of the strips is lost");
}

#[test]
fn a_script_sets_anchors_and_edits_a_strip() {
    let folder = tempfile::tempdir().unwrap();
    let design = |steps: &str| {
        let out = folder.path().join("out");
        let output = plait(&["weave", text(&torus_script(folder.path(), steps)), "--no-optimise", "--out", text(&out)]);
        (Design::read(&out.join("design.plait")), errors(&output))
    };
    let along = r#"{"anchor": {"at": [1.07, 0, 0], "direction": [0, 1, 0]}}, {"place": true}"#;
    let across = r#"{"anchor": {"at": [1.07, 0, 0], "direction": [0, 0, 1]}}, {"place": true}"#;
    let two = design(&format!("{along}, {across}")).0.unwrap();
    assert!(two.strips.iter().all(|s| s.anchors.len() == 1) && two.strips[0].cost != two.strips[1].cost);
    let edit = r#"{"edit": 0}, {"anchor": {"at": [-1.07, 0, 0]}}, {"place": true}"#;
    let edited = design(&format!("{along}, {across}, {edit}")).0.unwrap();
    assert_eq!(edited.strips.iter().map(|s| s.anchors.len()).collect::<Vec<_>>(), [2, 1]);
    assert!(edited.strips[0].id == two.strips[0].id && edited.strips[1] == two.strips[1]);
    for (steps, message) in [
        (r#"{"anchor": {"at": [1, 0, 0], "direction": [0, 0, 0]}}"#, "the direction is not a finite vector"),
        (r#"{"suggest": true}, {"edit": 0}"#, "the strip has no anchors"),
        (r#"{"edit": 3}"#, "there is no such strip"),
    ] {
        let (_, errors) = design(steps);
        assert!(errors.contains(message), "{steps}: {errors}");
    }
}

#[test]
fn a_script_continues_a_saved_design() {
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
    // A file that is no design is refused with its name.
    std::fs::write(folder.path().join("none.plait"), "{}").unwrap();
    std::fs::write(&again, r#"{"mesh": "none.plait", "steps": []}"#).unwrap();
    let output = plait(&["weave", text(&again), "--out", text(folder.path())]);
    assert!(!output.status.success() && errors(&output).contains("none.plait is not a Plait design"));
}

#[test]
fn a_script_and_the_command_line_improve_alike() {
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
    assert!(report["error"].as_str().is_some_and(|p| !p.is_empty()), "{report}");
    assert!(out.join("design.plait").is_file() && !out.join("quads.obj").exists());
}

/// All files of a folder, without the times in the report.
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
    let woven = replayed(&script("rounded-cube"), true).unwrap();
    let design = woven.file("design.plait");
    let again = tempfile::tempdir().unwrap();
    let output = plait(&["weave", text(&design), "--out", text(again.path())]);
    assert!(output.status.success(), "{}", errors(&output));
    for name in ["design.plait", "layout.obj", "quads.obj", "patches.obj"] {
        let [before, after] = [woven.folder.as_path(), again.path()].map(|f| std::fs::read(f.join(name)).unwrap());
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
