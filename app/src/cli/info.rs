//! `plait info`: size, topology and repairs of a mesh, as text or JSON on standard output.

use std::io::Write as _;
use std::path::Path;

use anyhow::Context as _;
use plait_core::mesh::{LoadedMesh, SHARP_DIHEDRAL, Topology, sharp_edges};
use plait_core::weave::MeshSource;
use serde::Serialize;

use super::arguments::InfoArguments;

/// The facts of a mesh; the keys of the JSON output.
#[derive(Debug, Serialize)]
struct Facts {
    name: String,
    vertices: usize,
    edges: usize,
    faces: usize,
    components: usize,
    genus: usize,
    boundary_loops: usize,
    euler_characteristic: i64,
    /// Length of the bounding-box diagonal, in units of the file.
    diagonal: f64,
    sharp_edges: usize,
    repairs: Vec<String>,
}

impl Facts {
    fn of(loaded: &LoadedMesh) -> Self {
        let mesh = &loaded.mesh;
        let topology = Topology::new(mesh);
        Self {
            name: loaded.name.clone(),
            vertices: mesh.n_vertices(),
            edges: mesh.n_edges(),
            faces: mesh.n_faces(),
            components: topology.components.len(),
            genus: topology.genus,
            boundary_loops: topology.boundary_loops.len(),
            euler_characteristic: mesh.euler_characteristic(),
            diagonal: loaded.units.scale,
            sharp_edges: sharp_edges(mesh, SHARP_DIHEDRAL).iter().filter(|&&s| s).count(),
            repairs: loaded.repairs.iter().map(ToString::to_string).collect(),
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "{}\n  {} vertices, {} edges, {} triangles\n  components {}, genus {}, boundary loops {}\n  \
             bounding-box diagonal {}, sharp edges {}\n",
            self.name,
            self.vertices,
            self.edges,
            self.faces,
            self.components,
            self.genus,
            self.boundary_loops,
            self.diagonal,
            self.sharp_edges,
        );
        for repair in &self.repairs {
            text += &format!("  repaired: {repair}\n");
        }
        text
    }
}

/// Reads the mesh and prints its facts.
///
/// # Errors
///
/// When the mesh cannot be read.
pub fn run(arguments: &InfoArguments) -> anyhow::Result<()> {
    let source = MeshSource::from_name(&arguments.mesh.to_string_lossy());
    let loaded = source.load(Path::new("")).with_context(|| arguments.mesh.display().to_string())?;
    let facts = Facts::of(&loaded);
    let text = if arguments.json { serde_json::to_string_pretty(&facts)? + "\n" } else { facts.text() };
    std::io::stdout().write_all(text.as_bytes())?;
    Ok(())
}
