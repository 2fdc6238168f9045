//! The weave scripts and designs of the repository: their layouts, quads and maps, and figures of docs/benchmarks.md.
//!
//! Every script is replayed once; all tests look at the same files.

mod support;

use std::sync::Arc;

use serde_json::{Value, json};
use support::mesh_file::{MeshFile, QuadFile};
use support::patches_file::PatchesFile;
use support::replay::{Replay, replayed, script};
use support::{Shape, independent_check, manifold, read_faces, root};

/// Scripts of which only the structure is looked at: their optimisation takes long, and no figure of it is claimed.
const STRUCTURE_ONLY: [&str; 3] = ["botijo", "elephant_12k_aligned", "elephant_12k_neck"];

/// Scripts whose layouts have boundary nodes where just one patch meets a smooth boundary: its corner is flat, so that its
/// quad is neither folded nor not.
const FLAT_CORNERS: [&str; 2] = ["aqua_center", "vase_open"];

fn optimised(name: &str) -> Option<Arc<Replay>> {
    replayed(&script(name), true)
}

/// The stored structure of every script.
fn expected() -> serde_json::Map<String, Value> {
    let text = std::fs::read_to_string(root().join("tests/expected.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The names of all scripts, but for those of which only the structure is looked at.
fn optimised_scripts() -> Vec<String> {
    expected().into_iter().map(|(name, _)| name).filter(|n| !STRUCTURE_ONLY.contains(&n.as_str())).collect()
}

#[test]
fn the_structure_of_every_script_is_stored() {
    let folder = std::fs::read_dir(root().join("tests/scripts")).unwrap();
    let mut scripts: Vec<String> =
        folder.map(|e| e.unwrap().path().file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    scripts.sort();
    let mut stored: Vec<String> = expected().into_iter().map(|(name, _)| name).collect();
    stored.sort();
    assert_eq!(scripts, stored);
}

#[test]
fn every_script_has_its_stored_structure() {
    let mut problems = Vec::new();
    for (name, wanted) in expected() {
        let Some(replay) = replayed(&script(&name), !STRUCTURE_ONLY.contains(&name.as_str())) else { continue };
        let (report, layout) = (&replay.report, replay.layout());
        assert_eq!((&report["valid"], &report["colours"]["red"]), (&json!(true), &json!(0)), "{name}");
        for check in ["structure", "patches_are_discs"] {
            assert_eq!(layout["checks"][check], true, "{name}: {check}");
        }
        let found = json!({
            "strips": report["strips"].as_array().unwrap().len(),
            "crossings": report["crossings"],
            "nodes": layout["nodes"],
            "patches": layout["patches"],
            "valences": layout["valences"],
        });
        if found != wanted {
            problems.push(format!("{name}: {found}, stored is {wanted}"));
        }
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn quads_are_manifold_near_the_surface_and_not_folded() {
    for name in optimised_scripts() {
        let Some(replay) = optimised(&name) else { continue };
        let loaded = plait_core::mesh::load(&replay.source).unwrap();
        let boundary_loops = plait_core::mesh::Topology::new(&loaded.mesh).boundary_loops.len();
        let quads = read_faces(&replay.file("quads.obj"));
        assert!(quads.iter().all(|q| q.len() == 4), "{name}: not only quads");
        assert_eq!(quads.len() as u64, replay.layout()["quads"].as_u64().unwrap(), "{name}");
        let shape = Shape { euler: loaded.mesh.euler_characteristic(), boundary_loops };
        assert_eq!(manifold(&quads), shape, "{name}: quads.obj");
        let layout = read_faces(&replay.file("layout.obj"));
        assert_eq!(layout.len() as u64, replay.layout()["patches"].as_u64().unwrap(), "{name}: layout.obj");
        if let Some(figures) = independent_check(&replay.file("quads.obj"), &replay.source) {
            let distance = figures["distance_mean"].as_f64().unwrap();
            assert!(distance < 0.005, "{name}: the mean distance of quads and surface is {distance}");
            if !FLAT_CORNERS.contains(&name.as_str()) {
                assert_eq!(figures["folded"], 0, "{name}: folded quads");
            }
        }
    }
}

#[test]
fn texture_coordinates_map_patches_to_rectangles() {
    for name in optimised_scripts() {
        let Some(replay) = optimised(&name) else { continue };
        let patches = PatchesFile::read(&replay.file("patches.obj"));
        assert_eq!(patches.n_patches() as u64, replay.layout()["patches"].as_u64().unwrap(), "{name}");
        let faces = replay.report["faces"].as_u64().unwrap() as usize;
        assert!(patches.n_triangles() >= faces, "{name}: patches.obj lacks triangles");
        let problems = patches.problems();
        assert!(problems.is_empty(), "{name}: {}", problems.join("\n"));
    }
}

/// A place where quads do not cover sharp edges: centre and radius of a ball in coordinates of the file, and why.
struct Exception {
    centre: [f64; 3],
    radius: f64,
    reason: &'static str,
}

const INSIDE_A_PATCH: &str = "the feature is an isoline inside a patch, not an arc, and no line of the quads is on it";
const NOT_KEPT: &str = "the feature is an arc, but vertices beside nearly flat quads were released from it";
const COARSE: &str = "one edge of a quad spans the bend of the feature";

/// Sharp edges that quads do not cover, by script.
const UNCOVERED: [(&str, &[Exception]); 3] = [
    ("od_cube", &[]),
    (
        "joint_42k",
        &[
            Exception { centre: [0.061, 0.5, -0.163], radius: 0.23, reason: INSIDE_A_PATCH },
            Exception { centre: [0.061, -0.5, -0.163], radius: 0.23, reason: INSIDE_A_PATCH },
        ],
    ),
    (
        "fandisk_14k_fine",
        &[
            Exception { centre: [2.386, 12.966, 0.0], radius: 0.16, reason: COARSE },
            Exception { centre: [1.365, 13.015, 0.0], radius: 0.2, reason: COARSE },
            Exception { centre: [3.001, 15.725, -0.983], radius: 0.45, reason: INSIDE_A_PATCH },
            Exception { centre: [0.985, 15.607, -0.993], radius: 0.16, reason: NOT_KEPT },
            Exception { centre: [3.3, 17.487, -0.542], radius: 0.2, reason: NOT_KEPT },
            Exception { centre: [3.395, 17.54, 0.0], radius: 0.16, reason: NOT_KEPT },
            Exception { centre: [0.536, 14.571, 0.0], radius: 0.5, reason: NOT_KEPT },
        ],
    ),
];

#[test]
fn sharp_edges_are_covered_by_quads_but_for_known_exceptions() {
    for (name, exceptions) in UNCOVERED {
        let Some(replay) = optimised(name) else { continue };
        let mesh = MeshFile::read(&replay.source);
        let sharp = mesh.sharp_edges();
        assert!(sharp.len() > 20, "{name}: {} sharp edges", sharp.len());
        let uncovered = QuadFile::read(&replay.file("quads.obj")).uncovered(&sharp);
        let middle = |[a, b]: &[glam::DVec3; 2]| a.midpoint(*b);
        let is_in = |e: &Exception, p: glam::DVec3| p.distance(glam::DVec3::from_array(e.centre)) < e.radius;
        for segment in &uncovered {
            let p = middle(segment);
            assert!(exceptions.iter().any(|e| is_in(e, p)), "{name}: no quads cover the sharp edge at {p}");
        }
        for e in exceptions {
            let known = uncovered.iter().any(|s| is_in(e, middle(s)));
            assert!(known, "{name}: quads cover all sharp edges at {:?}; no longer true: {}", e.centre, e.reason);
        }
    }
}

#[test]
fn features_are_isolines_exactly() {
    for (name, edges) in [("fandisk_14k_fine", 863), ("joint_42k", 952)] {
        let Some(replay) = optimised(name) else { continue };
        let features = &replay.embedding()["feature_edges"];
        assert_eq!(*features, json!({"total": edges, "on_isolines": edges, "off_isolines": []}), "{name}");
    }
}

fn number(value: &Value, name: &str) -> f64 {
    value[name].as_f64().unwrap_or_else(|| panic!("{name} is no number in {value}"))
}

/// Rows of the table of optimised embeddings in docs/benchmarks.md: conformal distortion, planarity, deviation in degrees.
const EMBEDDINGS: [(&str, [f64; 3]); 11] = [
    ("scripts/rounded-cube.json", [2.000, 0.10, 0.7]),
    ("scripts/pretzel.json", [2.014, 0.39, 1.4]),
    ("scripts/cino_3holes.json", [2.033, 0.60, 2.6]),
    ("scripts/c3d_rocker-arm.json", [2.058, 1.29, 4.1]),
    ("scripts/rockerarm_5k_fine.json", [2.139, 1.57, 5.2]),
    ("scripts/fertility_28k.json", [2.051, 1.34, 3.5]),
    ("scripts/elephant_12k.json", [2.118, 1.72, 4.9]),
    ("scripts/fandisk_14k_fine.json", [2.236, 1.00, 2.9]),
    ("scripts/joint_42k.json", [2.015, 0.27, 1.1]),
    ("designs/fertility_28k.plait", [2.039, 1.16, 2.9]),
    ("designs/botijo.plait", [2.055, 1.46, 3.3]),
];

/// By how much figures differ from the table: half a unit of its last digit, and what rounding changes. The page says 0.003
/// and 0.1°; planarity changes with the deviation.
const NOISE: [f64; 3] = [0.0035, 0.055, 0.15];

fn replay_of(input: &str) -> Option<Arc<Replay>> {
    replayed(&root().join("tests").join(input), true)
}

#[test]
fn embeddings_are_as_good_as_the_benchmarks_say() {
    for (input, claimed) in EMBEDDINGS {
        let Some(replay) = replay_of(input) else { continue };
        let embedding = replay.embedding();
        assert_eq!((&embedding["optimised"], &embedding["error"]), (&json!(true), &Value::Null), "{input}");
        assert_eq!(
            (&embedding["flipped"], &embedding["remaining_flipped_triangles"]),
            (&json!(0), &json!([])),
            "{input}"
        );
        let found = ["conformal", "planar", "alignment"].map(|name| number(embedding, name));
        for i in 0..3 {
            assert!(found[i] <= claimed[i] + NOISE[i], "{input}: {found:?}, claimed is {claimed:?}");
        }
    }
}

/// Rows of the table of quads in docs/benchmarks.md, after the optimisation: least and mean scaled Jacobian, standard
/// deviation of angles in degrees, Hausdorff distance.
const QUADS: [(&str, [f64; 4]); 8] = [
    ("scripts/cino_3holes.json", [0.905, 0.997, 2.4, 0.0023]),
    ("scripts/c3d_rocker-arm.json", [0.811, 0.991, 4.5, 0.0078]),
    ("scripts/rockerarm_5k_fine.json", [0.809, 0.989, 5.2, 0.0081]),
    ("scripts/fertility_28k.json", [0.800, 0.992, 4.3, 0.0046]),
    ("scripts/elephant_12k.json", [0.785, 0.988, 5.8, 0.0037]),
    ("scripts/joint_42k.json", [0.815, 0.998, 2.7, 0.0067]),
    ("designs/fertility_28k.plait", [0.754, 0.992, 4.6, 0.0037]),
    ("designs/botijo.plait", [0.803, 0.987, 5.8, 0.0184]),
];

/// Share of a figure by which the least scaled Jacobian and distances may be worse than claimed: both are of a single quad.
const SINGLE: f64 = 0.05;

#[test]
fn quads_are_as_good_as_the_benchmarks_say() {
    for (input, [least, mean, deviation, distance]) in QUADS {
        let Some(replay) = replay_of(input) else { continue };
        let found = number(replay.layout(), "hausdorff_distance");
        assert!(found <= (1.0 + SINGLE) * distance, "{input}: the Hausdorff distance is {found}");
        let Some(figures) = independent_check(&replay.file("quads.obj"), &replay.source) else { continue };
        let found = ["scaled_jacobian_min", "scaled_jacobian_mean", "angle_std_deg"].map(|name| number(&figures, name));
        assert!(found[0] >= (1.0 - SINGLE) * least, "{input}: {found:?}");
        assert!(found[1] >= mean - 0.0015 && found[2] <= deviation + 0.15, "{input}: {found:?}");
    }
}

#[test]
fn quads_of_the_optimised_embedding_are_better_than_those_of_the_initial_one() {
    for name in ["cino_3holes", "fertility_28k", "elephant_12k"] {
        let replays = (replayed(&script(name), false), optimised(name));
        let (Some(initial), Some(optimised)) = replays else { continue };
        let [far, near] = [&initial, &optimised].map(|r| number(r.layout(), "hausdorff_distance"));
        assert!(near < far, "{name}: {far} {near}");
        let check = |r: &Replay| independent_check(&r.file("quads.obj"), &r.source);
        let (Some(before), Some(after)) = (check(&initial), check(&optimised)) else { continue };
        for figure in ["scaled_jacobian_min", "scaled_jacobian_mean"] {
            assert!(number(&after, figure) > number(&before, figure), "{name}: {figure} {before} {after}");
        }
        for figure in ["angle_std_deg", "distance_mean", "distance_max"] {
            assert!(number(&after, figure) < number(&before, figure), "{name}: {figure} {before} {after}");
        }
    }
}
