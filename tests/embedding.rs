//! `plait embed`: optimised embeddings of woven layouts and of layout files.

mod support;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use support::replay::script;
use support::{errors, plait, read_faces, text};

fn json_file(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Embeds a layout, checks that all files are there, and returns the report.
fn embed(input: &Path, out: &Path, more: &[&str]) -> Value {
    let arguments = [&["embed", text(input), "--out", text(out), "--quads", "800"], more].concat();
    let output = plait(&arguments);
    assert!(output.status.success(), "{input:?}: {}", errors(&output));
    for name in ["layout.layout", "layout.obj", "quads.obj", "patches.obj"] {
        assert!(out.join(name).is_file(), "{name} is missing");
    }
    let report = json_file(&out.join("report.json"));
    assert_eq!(report["valid"], true, "{report}");
    assert_eq!(read_faces(&out.join("quads.obj")).len() as u64, report["layout"]["quads"].as_u64().unwrap());
    report
}

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().unwrap_or_else(|| panic!("{name} is no number in {value}"))
}

#[test]
fn the_embedding_of_a_woven_layout_is_optimised_without_flipped_triangles() {
    for name in ["pretzel", "rounded-cube"] {
        let folder = tempfile::tempdir().unwrap();
        let report = embed(&script(name), folder.path(), &["--quiet"]);
        assert!(folder.path().join("design.plait").is_file());
        let embedding = &report["layout"]["embedding"];
        assert_eq!((&embedding["optimised"], &embedding["error"]), (&json!(true), &Value::Null), "{embedding}");
        assert!(number(embedding, "energy_after") <= number(embedding, "energy_before"), "{name}: {embedding}");
        assert_eq!(embedding["flipped"], 0, "{name}");
        assert_eq!(embedding["remaining_flipped_triangles"], json!([]), "{name}");
        assert!(report["layout"]["checks"].as_object().unwrap().values().all(|v| v == true), "{name}: {report}");
        let patches = embedding["patches"].as_array().unwrap();
        assert_eq!(patches.len() as u64, report["layout"]["patches"].as_u64().unwrap());
        assert!(patches.iter().all(|p| number(p, "aspect") >= 1.0 && number(p, "area") > 0.0));
        assert!(number(embedding, "conformal") >= 2.0 && number(&embedding["initial"], "conformal") >= 2.0);
        assert!(number(&report["seconds"], "embed") > 0.0);
    }
}

#[test]
fn a_layout_file_is_embedded_like_the_design_it_was_written_from() {
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    let woven = embed(&script("rounded-cube"), &first, &["--quiet"]);
    let read = embed(&first.join("layout.layout"), &second, &["--quiet"]);
    for name in ["nodes", "arcs", "patches", "irregular_nodes", "valences"] {
        assert_eq!(woven["layout"][name], read["layout"][name], "{name}");
    }
    let [a, b] = [&woven, &read].map(|r| number(&r["layout"]["embedding"], "energy_after"));
    assert!((a - b).abs() < 0.1 * a, "{a} and {b}");
    assert_eq!(read["layout"]["embedding"]["flipped"], 0);
    assert!(read.get("strips").is_none() && !second.join("design.plait").exists());
}

#[test]
fn missing_arcs_are_completed() {
    let folder = tempfile::tempdir().unwrap();
    let (full, out) = (folder.path().join("full"), folder.path().join("out"));
    let woven = embed(&script("rounded-cube"), &full, &["--quiet", "--steps", "0"]);
    let mut layout = json_file(&full.join("layout.layout"));
    layout["arcs"].as_array_mut().unwrap().pop();
    let path = folder.path().join("partial.layout");
    std::fs::write(&path, layout.to_string()).unwrap();
    let report = embed(&path, &out, &["--quiet"]);
    assert_eq!(report["layout"]["valences"], woven["layout"]["valences"]);
    assert!(report["layout"]["patches"].as_u64() >= woven["layout"]["patches"].as_u64());
}

#[test]
fn pinned_nodes_stay_and_are_written_as_fixed() {
    let folder = tempfile::tempdir().unwrap();
    let report = embed(&script("rounded-cube"), folder.path(), &["--quiet", "--steps", "2", "--pin-nodes", "0,3"]);
    // Two with least squares and two with an injective map.
    assert!(number(&report["layout"]["embedding"], "steps") <= 4.0);
    let layout = json_file(&folder.path().join("layout.layout"));
    let fixed: Vec<usize> = (0..8).filter(|&i| layout["nodes"][i]["fixed"] == true).collect();
    assert_eq!(fixed, [0, 3]);
}

#[test]
fn with_integer_sides_whole_quads_fill_every_patch() {
    let folder = tempfile::tempdir().unwrap();
    let report = embed(&script("rounded-cube"), folder.path(), &["--quiet", "--steps", "3", "--integer", "--collapse"]);
    let layout = &report["layout"];
    assert_eq!((&layout["patches"], &layout["embedding"]["collapsed_chords"]), (&json!(6), &json!([])));
    // Opposite patches of a cube have equal sides: as many quads.
    assert_eq!(layout["quads"].as_u64().unwrap() % 2, 0);
    assert_eq!((&layout["folded_quads"], &layout["flipped_triangles"]), (&json!(0), &json!(0)));
}

#[test]
fn every_step_is_reported_unless_quiet_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let input = script("rounded-cube");
    let arguments = ["embed", text(&input), "--out", text(folder.path()), "--steps", "1"];
    let output = plait(&arguments);
    let loud = errors(&output);
    assert!(output.status.success() && loud.contains("step 0: energy"), "{loud}");
    assert!(loud.contains("conformal") && loud.contains("flipped"), "{loud}");
    let quiet = errors(&plait(&[&arguments[..], &["--quiet"]].concat()));
    assert_eq!(quiet.lines().count(), 1, "{quiet}");
}

#[test]
fn without_optimisation_the_initial_embedding_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let input = script("rounded-cube");
    let output = plait(&["weave", text(&input), "--out", text(folder.path()), "--no-optimise"]);
    assert!(output.status.success(), "{}", errors(&output));
    let embedding = &json_file(&folder.path().join("report.json"))["layout"]["embedding"];
    assert_eq!(embedding["optimised"], false);
    assert_eq!(number(embedding, "conformal"), number(&embedding["initial"], "conformal"));
}

#[test]
fn mistakes_in_the_input_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    };
    let cube = script("rounded-cube");
    let no_node = r#"{"version": 1, "mesh": {"builtin": "torus"}, "nodes": [], "arcs": []}"#;
    let cases: [(PathBuf, &[&str], &str); 8] = [
        (folder.path().join("none.layout"), &[], "none.layout"),
        (file("broken.layout", "{"), &[], "is not a Plait layout"),
        (file("later.layout", r#"{"version": 99}"#), &[], "version 99"),
        (file("empty.layout", no_node), &[], "arcs are missing"),
        (cube.clone(), &["--pin-nodes", "99"], "no node 99"),
        (cube.clone(), &["--anisotropy", "0"], "anisotropy"),
        (cube.clone(), &["--collapse", "0"], "--collapse needs a positive length"),
        (cube, &["--edge-length", "0"], "--edge-length must be positive"),
    ];
    for (input, more, part) in cases {
        let out = folder.path().join("out");
        let output = plait(&[&["embed", text(&input), "--out", text(&out)], more].concat());
        assert_eq!(output.status.code(), Some(1), "{input:?}");
        assert!(errors(&output).contains(part), "{input:?}: {}", errors(&output));
    }
}
