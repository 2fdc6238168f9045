//! The built-in models, made by the example `make_models`.

use super::load::{LoadedMesh, parse};

/// Name and OBJ file of each model; the first is opened by default.
const MODELS: [(&str, &[u8]); 5] = [
    ("creature", include_bytes!("../../../assets/models/creature.obj")),
    ("rounded-cube", include_bytes!("../../../assets/models/rounded-cube.obj")),
    ("pretzel", include_bytes!("../../../assets/models/pretzel.obj")),
    ("torus", include_bytes!("../../../assets/models/torus.obj")),
    ("sleeve", include_bytes!("../../../assets/models/sleeve.obj")),
];

/// The names of the built-in models; the first is the one to open by default.
pub fn builtin_names() -> impl ExactSizeIterator<Item = &'static str> + Clone {
    MODELS.iter().map(|(name, _)| *name)
}

/// The built-in model of this name; `None` if there is no such model.
pub fn builtin(name: &str) -> Option<LoadedMesh> {
    let (name, bytes) = MODELS.iter().find(|(known, _)| *known == name)?;
    parse(bytes, name).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    #[test]
    fn models_have_their_genus_boundary_and_quality() {
        let expected =
            [("creature", 0, 0), ("rounded-cube", 0, 0), ("pretzel", 3, 0), ("torus", 1, 0), ("sleeve", 0, 4)];
        assert!(builtin_names().eq(expected.iter().map(|e| e.0)));
        for (name, genus, boundary_loops) in expected {
            let LoadedMesh { mesh, repairs, name: loaded, .. } = builtin(name).unwrap();
            let t = Topology::new(&mesh);
            assert_eq!((t.components.len(), t.genus, t.boundary_loops.len()), (1, genus, boundary_loops), "{name}");
            assert!(repairs.is_empty() && loaded == name, "{name}: {repairs:?}");
            assert!((4000..=9000).contains(&mesh.n_faces()), "{name}: {} faces", mesh.n_faces());
            let smallest = mesh.halfedges().map(|h| mesh.corner_angle(h).to_degrees()).fold(180.0, f64::min);
            assert!(smallest > 25.0, "{name}: smallest angle {smallest:.1}°");
        }
        assert!(builtin("nothing").is_none());
    }
}
