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
    let expected = support::Shape {
        euler: mesh.euler_characteristic(),
        boundary_loops: topology.boundary_loops.len(),
    };
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
    }
    Some(Woven { folder, report })
}

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
