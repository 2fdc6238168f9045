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
fn what_cannot_be_opened_is_named() {
    let output = plait(&["render", "no-such-mesh.obj", "--out", "x.png"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("no-such-mesh.obj"), "{}", errors(&output));
}
