//! The program as a user calls it, without a display.

use std::process::{Command, Output};

fn plait(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plait"));
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    command.args(arguments).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn without_a_display_the_window_names_the_commands() {
    let output = plait(&[]);
    assert_eq!(output.status.code(), Some(1));
    let text = errors(&output);
    assert!(text.lines().count() == 1 && text.contains("no display") && text.contains("plait weave"), "{text}");
}

#[test]
fn a_picture_is_drawn_without_a_display() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torus.png");
    let output = plait(&["render", "torus", "--out", path.to_str().unwrap(), "--size", "320x240"]);
    assert!(output.status.success(), "{}", errors(&output));
    let picture = image::open(&path).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (320, 240));
    let (low, high) = picture.pixels().fold((255, 0), |(l, h), p| (l.min(p[0]), h.max(p[0])));
    assert!(high - low > 80, "{low} to {high}");
}

#[test]
fn an_error_names_the_file_that_cannot_be_opened() {
    let output = plait(&["render", "no-such-mesh.obj", "--out", "x.png"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("no-such-mesh.obj"), "{}", errors(&output));
}

#[test]
fn a_benchmark_is_written_as_json_table_and_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let output = plait(&["bench", "hover", "torus", "--points", "2", "--strips", "0", "--seed", "3", "--json"]);
    assert!(output.status.success(), "{}", errors(&output));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["mesh"]["triangles"], &report["seed"]), (&6828.into(), &3.into()));
    let number = |value: &serde_json::Value| value.as_f64().is_some_and(|n| n >= 0.0);
    assert!(report["machine"]["cores"].as_u64().is_some_and(|n| n > 0) && number(&report["graph"]["states"]));
    let rows = report["rows"].as_array().unwrap();
    assert!(rows.len() > 8 && rows.iter().all(|r| ["median", "p95", "worst", "count"].iter().all(|k| number(&r[k]))));
    std::fs::write(file("report.json"), &output.stdout).unwrap();
    let table = plait(&["bench", "table", &file("report.json")]);
    assert!(table.status.success() && String::from_utf8_lossy(&table.stdout).contains("| torus | 6828 |"));
    let drawn = plait(&["bench", "plot", &file("report.json"), "--out", &file("plot.svg")]);
    assert!(drawn.status.success() && std::fs::read_to_string(file("plot.svg")).unwrap().starts_with("<svg"));
    let wrong = plait(&["bench", "table", &file("plot.svg")]);
    assert!(wrong.status.code() == Some(1) && errors(&wrong).contains("is not a benchmark report"));
}

#[test]
fn an_export_keeps_files_of_others_and_the_mesh_it_is_made_from() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let weave =
        |mesh: &str| plait(&["weave", mesh, "--suggest", "--no-optimise", "--quads", "100", "--out", &at("out")]);
    // Its own files are replaced.
    for _ in 0..2 {
        let output = weave("torus");
        assert!(output.status.success(), "{}", errors(&output));
    }
    let quads = at("out/quads.obj");
    let written = std::fs::read_to_string(&quads).unwrap();
    // A mesh of that name is not, and nothing else is written.
    std::fs::write(&quads, "v 0 0 0\n").unwrap();
    std::fs::remove_file(at("out/design.plait")).unwrap();
    let output = weave("torus");
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("quads.obj is no mesh written by Plait"), "{}", errors(&output));
    assert_eq!(std::fs::read_to_string(&quads).unwrap(), "v 0 0 0\n");
    assert!(!std::fs::exists(at("out/design.plait")).unwrap());
    // Nor is the mesh that the layout is made from.
    std::fs::write(&quads, &written).unwrap();
    let output = weave(&quads);
    assert!(errors(&output).contains("is the mesh of this layout"), "{}", errors(&output));
    assert_eq!(std::fs::read_to_string(&quads).unwrap(), written);
}

#[test]
fn a_picture_replaces_pictures_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("torus.png");
    std::fs::write(&path, "v 0 0 0\n").unwrap();
    let output = plait(&["render", "torus", "--out", path.to_str().unwrap(), "--size", "64x64"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("torus.png is no PNG picture"), "{}", errors(&output));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "v 0 0 0\n");
}
