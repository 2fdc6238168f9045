//! What the acceptance tests share: calling the program, finding meshes, independent checks of what is written.

#![allow(dead_code, reason = "every test uses its own part")]

pub mod mesh_file;
pub mod patches_file;
pub mod replay;

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// Says that a test or a part of one is left out, and why.
///
/// # Panics
///
/// When the environment variable `PLAIT_TEST_ALL` is set: then everything a test needs has to be there.
pub fn skip(reason: &str) {
    assert!(std::env::var_os("PLAIT_TEST_ALL").is_none(), "PLAIT_TEST_ALL is set, but {reason}");
    eprintln!("skipped: {reason}");
}

/// A folder beside the repository; where it is missing, [`skip`].
fn beside(folder: &str) -> Option<PathBuf> {
    let path = root().join("..").join("shared").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    skip(&format!("there is no folder {}", path.display()));
    None
}

/// The folder of research meshes: `PLAIT_MESHES`, or `shared/meshes` beside the repository; else [`skip`].
pub fn meshes() -> Option<PathBuf> {
    match std::env::var_os("PLAIT_MESHES") {
        Some(folder) => Some(folder.into()),
        None => beside("meshes"),
    }
}

/// A research mesh; where it is missing, [`skip`].
pub fn mesh(file: &str) -> Option<PathBuf> {
    let path = meshes()?.join(file);
    if path.is_file() {
        return Some(path);
    }
    skip(&format!("there is no {}", path.display()));
    None
}

/// Calls the program without a display.
pub fn plait(arguments: &[&str]) -> Output {
    plait_with(arguments, &[])
}

/// Calls the program without a display and with some environment variables.
pub fn plait_with(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plait"));
    for name in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(name);
    }
    let output = command.envs(environment.iter().copied()).args(arguments).output().unwrap();
    let errors = errors(&output);
    assert!(output.status.code().is_some(), "plait {arguments:?} was ended by a signal: {errors}");
    assert!(!errors.contains("panicked"), "plait {arguments:?}: {errors}");
    output
}

/// What the program wrote to standard error.
pub fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A path as text.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The topology of an oriented manifold polygon mesh.
#[derive(Debug, PartialEq, Eq)]
pub struct Shape {
    /// `V − E + F`.
    pub euler: i64,
    /// Number of boundary loops.
    pub boundary_loops: usize,
}

/// The polygons of an OBJ file that the program wrote.
pub fn read_faces(path: &Path) -> Vec<Vec<u32>> {
    let number = |corner: &str| corner.split('/').next().unwrap().parse::<u32>().unwrap() - 1;
    let text = std::fs::read_to_string(path).unwrap();
    let faces = text.lines().filter_map(|l| l.strip_prefix("f "));
    faces.map(|l| l.split_whitespace().map(number).collect()).collect()
}

/// Checks that `faces` are oriented and manifold, edges and vertices.
///
/// # Panics
///
/// If they are not.
pub fn manifold(faces: &[Vec<u32>]) -> Shape {
    let mut half_edges = HashSet::new();
    // Around each vertex: the corner's next vertex leads to its previous one.
    let mut around: HashMap<u32, HashMap<u32, u32>> = HashMap::new();
    for (f, face) in faces.iter().enumerate() {
        let n = face.len();
        assert_eq!(face.iter().collect::<HashSet<_>>().len(), n, "face {f} repeats a vertex");
        for i in 0..n {
            let (before, at, after) = (face[(i + n - 1) % n], face[i], face[(i + 1) % n]);
            assert!(half_edges.insert((at, after)), "edge {at}-{after} is used twice in one direction");
            around.entry(at).or_default().insert(after, before);
        }
    }
    let mut boundary: HashMap<u32, u32> = HashMap::new();
    for &(a, b) in &half_edges {
        if !half_edges.contains(&(b, a)) {
            assert!(boundary.insert(b, a).is_none(), "vertex {b} lies on two boundary loops");
        }
    }
    for (v, fan) in &around {
        let ends: HashSet<u32> = fan.values().copied().collect();
        let first = fan.keys().find(|k| !ends.contains(k)).or_else(|| fan.keys().next()).copied().unwrap();
        let mut walked = 1;
        let mut at = fan[&first];
        while at != first && fan.contains_key(&at) {
            at = fan[&at];
            walked += 1;
        }
        assert_eq!(walked, fan.len(), "several fans of faces meet at vertex {v}");
    }
    let edges = half_edges.iter().filter(|&&(a, b)| a < b || !half_edges.contains(&(b, a))).count();
    let mut boundary_loops = 0;
    while let Some(&start) = boundary.keys().next() {
        boundary_loops += 1;
        let mut at = start;
        while let Some(next) = boundary.remove(&at) {
            at = next;
        }
    }
    Shape { euler: around.len() as i64 - edges as i64 + faces.len() as i64, boundary_loops }
}

/// The first Python on the path, and the system's, to which packages of the system belong.
const PYTHONS: [&str; 2] = ["python3", "/usr/bin/python3"];

/// Whether a Python can run a line of code.
fn runs(python: &str, code: &str) -> bool {
    Command::new(python).args(["-c", code]).output().is_ok_and(|o| o.status.success())
}

/// The figures of an independent check of quad meshes; where it or what it needs is missing, [`skip`].
///
/// # Panics
///
/// If the check fails.
pub fn independent_check(quads: &Path, source: &Path) -> Option<serde_json::Value> {
    let script = beside("check")?.join("check_quads.py");
    let Some(python) = PYTHONS.into_iter().find(|p| runs(p, "import numpy, scipy")) else {
        skip("the independent check needs python3 with numpy and scipy");
        return None;
    };
    let output = Command::new(python).arg(script).args([quads, source]).arg("--json").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{} against {}: {said} {}", quads.display(), source.display(), errors(&output));
    Some(serde_json::from_str(&said).unwrap())
}
