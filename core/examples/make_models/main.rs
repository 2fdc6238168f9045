//! Makes the built-in models: `cargo run -p plait-core --example make_models [NAME…]`.
//!
//! Each model is the zero set of a smooth function, meshed by surface nets, cut at planes where it is open, and remeshed
//! isotropically with vertices on the zero set.

mod field;
mod net;
mod remesh;
mod shapes;

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use plait_core::mesh::{Topology, parse, write_obj};

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/models");
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    for shape in shapes::all() {
        if !wanted.is_empty() && !wanted.iter().any(|w| w == shape.name) {
            continue;
        }
        let soup = net::extract(&shape);
        let mesh = remesh::remesh(&shape, soup);
        // Five decimals, for models about two units wide: small files, and rounding that is not visible in the normals.
        let rounded: Vec<_> = mesh.positions.iter().map(|p| (p * 1e5).round() / 1e5).collect();
        let mut bytes = Vec::new();
        write_obj(&mut bytes, &rounded, &mesh.faces)?;
        let path = folder.join(format!("{}.obj", shape.name));
        let mut file = BufWriter::new(File::create(&path)?);
        writeln!(file, "# {}: made by the example make_models", shape.name)?;
        file.write_all(&bytes)?;
        report(shape.name, &bytes);
    }
    Ok(())
}

/// Prints topology and quality of a model as loaded.
fn report(name: &str, bytes: &[u8]) {
    match parse(bytes, name) {
        Ok(loaded) => {
            let mesh = &loaded.mesh;
            let t = Topology::new(mesh);
            let angles = || mesh.halfedges().map(|h| mesh.corner_angle(h).to_degrees());
            eprintln!(
                "{name}: {} faces, genus {}, {} components, {} boundary loops, angles {:.1}° to {:.1}°, {} kB, {:?}",
                mesh.n_faces(),
                t.genus,
                t.components.len(),
                t.boundary_loops.len(),
                angles().fold(180.0, f64::min),
                angles().fold(0.0, f64::max),
                bytes.len() / 1000,
                loaded.repairs,
            );
        }
        Err(e) => eprintln!("{name}: {e}"),
    }
}
