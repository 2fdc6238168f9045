//! `plait info` on every research mesh, and on files that are no meshes: an answer or a message, never a crash.

mod support;

use std::path::{Path, PathBuf};

use serde_json::Value;
use support::{errors, meshes, plait, root, text};

fn info(mesh: &str) -> Result<Value, String> {
    let output = plait(&["info", mesh, "--json"]);
    if output.status.success() {
        return Ok(serde_json::from_slice(&output.stdout).unwrap());
    }
    let message = errors(&output);
    assert!(!message.trim().is_empty(), "{mesh}: refused without a message");
    Err(message)
}

#[test]
fn built_in_models_are_described() {
    for (name, genus, loops) in
        [("creature", 0, 0), ("rounded-cube", 0, 0), ("pretzel", 3, 0), ("torus", 1, 0), ("sleeve", 0, 4)]
    {
        let facts = info(name).unwrap();
        assert_eq!((facts["genus"].as_u64(), facts["boundary_loops"].as_u64()), (Some(genus), Some(loops)), "{facts}");
    }
}

#[test]
fn every_research_mesh_is_described_or_refused_with_a_reason() {
    let Some(folder) = meshes() else { return };
    let manifest = std::fs::read_to_string(folder.join("MANIFEST.tsv")).unwrap();
    let mut seen = 0;
    for line in manifest.lines().skip(1) {
        let columns: Vec<&str> = line.split('\t').collect();
        let (file, genus, loops, components, manifold) = (columns[1], columns[5], columns[6], columns[7], columns[8]);
        let path = folder.join(file);
        if !path.is_file() {
            support::skip(&format!("there is no {}", path.display()));
            continue;
        }
        seen += 1;
        match info(text(&path)) {
            Ok(facts) if manifold == "yes" => {
                let found = ["genus", "boundary_loops", "components"].map(|k| facts[k].to_string());
                assert_eq!(found, [genus, loops, components], "{file}: {facts}");
            }
            Ok(facts) => assert!(facts["repairs"].as_array().is_some_and(|r| !r.is_empty()), "{file}: {facts}"),
            Err(message) => assert!(manifold != "yes", "{file}: {message}"),
        }
    }
    assert!(seen > 0, "the list of meshes names none that is there");
}

#[test]
fn a_surface_with_one_side_is_refused_and_the_reason_given() {
    // Seven quads around a ring with half a twist.
    let mut obj = String::new();
    for i in 0..7 {
        let (turn, twist) = (f64::from(i) / 7.0 * std::f64::consts::TAU, f64::from(i) / 14.0 * std::f64::consts::TAU);
        for side in [-0.3, 0.3] {
            let r = 1.0 + side * twist.cos();
            obj += &format!("v {} {} {}\n", r * turn.cos(), r * turn.sin(), side * twist.sin());
        }
    }
    for i in 0..7 {
        let (a, b) = (2 * i + 1, 2 * i + 2);
        let (c, d) = if i < 6 { (a + 2, b + 2) } else { (2, 1) };
        obj += &format!("f {a} {b} {d} {c}\n");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "moebius.obj", obj.as_bytes());
    let mut one_sided = vec![path];
    one_sided.extend(support::mesh("gc_moebius.obj"));
    for path in one_sided {
        let message = info(text(&path)).unwrap_err();
        assert!(message.contains("not orientable"), "{message}");
    }
}

#[test]
fn files_that_are_no_meshes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    // A small generator (xorshift), so that the bytes are the same every time.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |n: usize| -> Vec<u8> {
        let next = |_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 32) as u8
        };
        (0..n).map(next).collect()
    };
    for extension in ["obj", "off", "ply", "stl", "plait", "txt"] {
        for (what, bytes) in [
            ("empty", Vec::new()),
            ("random", random(3000)),
            ("header", [b"ply\nformat binary_little_endian 1.0\n".to_vec(), random(100)].concat()),
            ("counts", b"OFF\n4000000000 4000000000 0\n0 0 0\n".to_vec()),
            ("nan", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec()),
            ("beyond", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n".to_vec()),
            ("points", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec()),
        ] {
            let path = write(folder.path(), &format!("{what}.{extension}"), &bytes);
            let message = info(text(&path)).expect_err(&format!("{what}.{extension} was taken for a mesh"));
            assert!(message.contains(what), "the file is not named: {message}");
        }
    }
}

#[test]
fn truncated_files_are_refused_or_read_as_far_as_they_go() {
    let folder = tempfile::tempdir().unwrap();
    let whole = std::fs::read(root().join("assets/models/torus.obj")).unwrap();
    for (i, cut) in [1, 7, 100, 5000, whole.len() / 2, whole.len() - 3].into_iter().enumerate() {
        // Cutting between two lines of an OBJ file leaves an OBJ file, so only crashes count here.
        let path = write(folder.path(), &format!("cut{i}.obj"), &whole[..cut]);
        let _ = info(text(&path));
    }
    for file in ["vase_open.off", "rockerarm_1k.off"] {
        let Some(path) = support::mesh(file) else { continue };
        let whole = std::fs::read(&path).unwrap();
        for cut in [3, 20, whole.len() / 3, whole.len() - 40] {
            let path = write(folder.path(), file, &whole[..cut]);
            assert!(info(text(&path)).is_err(), "{file} cut after {cut} bytes was taken for whole");
        }
    }
}

fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}
