//! A mesh woven on a proxy: the strips, the layout and its quads are those of the mesh itself.

mod support;

use plait_core::mesh::{LoadedMesh, builtin, load, loop_subdivision, sharp_edges, write_mesh_obj};
use plait_core::progress::Progress;
use plait_core::surface::SurfaceIndex;
use plait_core::weave::{Design, Session};
use serde_json::Value;
use support::{Shape, errors, manifold, plait, read_faces, text};

/// A built-in model with every triangle cut in four.
fn finer(name: &str) -> LoadedMesh {
    let mut loaded = builtin(name).unwrap();
    let crease = sharp_edges(&loaded.mesh, 0.7);
    loaded.mesh = loop_subdivision(&loaded.mesh, &crease).unwrap().0.into();
    loaded
}

#[test]
fn suggestions_on_a_proxy_become_quads_on_the_mesh() {
    for (name, proxy) in [("pretzel", 6000), ("sleeve", 5000)] {
        let folder = tempfile::tempdir().unwrap();
        let (source, out) = (folder.path().join("mesh.obj"), folder.path().join("out"));
        let model = finer(name);
        let mut file = std::fs::File::create(&source).unwrap();
        write_mesh_obj(&mut file, &model.mesh, &model.units).unwrap();
        let size = proxy.to_string();
        let output = plait(&["weave", text(&source), "--suggest", "--proxy", &size, "--out", text(&out)]);
        assert!(output.status.success(), "{name}: {}", errors(&output));
        assert!(errors(&output).contains("woven on a proxy"), "{name}: {}", errors(&output));

        let report: Value = serde_json::from_str(&std::fs::read_to_string(out.join("report.json")).unwrap()).unwrap();
        let loaded = load(&source).unwrap();
        let mesh = &loaded.mesh;
        assert_eq!(report["faces"], mesh.n_faces(), "{report}");
        let n = report["proxy"]["triangles"].as_u64().unwrap();
        assert!(n <= proxy && n + 10 > proxy, "{report}");
        assert_eq!(report["proxy"]["layout_on_proxy"], false, "{report}");
        assert_eq!(report["valid"], true, "{report}");

        let quads = read_faces(&out.join("quads.obj"));
        assert!(quads.iter().all(|q| q.len() == 4), "{name}");
        let boundary_loops = report["boundary_loops"].as_u64().unwrap() as usize;
        assert_eq!(manifold(&quads), Shape { euler: mesh.euler_characteristic(), boundary_loops }, "{name}");
        let index = SurfaceIndex::new(mesh);
        let written = std::fs::read_to_string(out.join("quads.obj")).unwrap();
        for line in written.lines().filter_map(|l| l.strip_prefix("v ")) {
            let p: Vec<f64> = line.split_whitespace().map(|x| x.parse().unwrap()).collect();
            let p = loaded.units.from_file(glam::DVec3::new(p[0], p[1], p[2]));
            let off = index.nearest(p).position(mesh).distance(p);
            assert!(off < 1e-6, "{name}: a vertex is {off} off the mesh");
        }

        let design = Design::read(&out.join("design.plait")).unwrap();
        assert!(!design.strips.is_empty() && design.strips.iter().all(|s| s.curve.check(mesh).is_ok()), "{name}");
        let session = Session::resume(loaded, design.clone(), &Progress::new()).unwrap();
        assert_eq!((session.design(), session.woven().red()), (&design, Vec::new()), "{name}");
    }
}
