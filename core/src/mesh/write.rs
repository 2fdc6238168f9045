//! Writing meshes as Wavefront OBJ.
//!
//! Coordinates have as many digits as needed to read back the same number.

use std::io::{self, Write};

use glam::DVec3;

use super::kernel::TriMesh;
use super::normalisation::Normalisation;

/// Writes polygons (vertex indices from 0) over `positions` (in file units) as OBJ.
///
/// # Errors
///
/// Those of writing to `out`.
pub fn write_obj<P: AsRef<[u32]>>(out: &mut impl Write, positions: &[DVec3], polygons: &[P]) -> io::Result<()> {
    for DVec3 { x, y, z } in positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for polygon in polygons {
        write!(out, "f")?;
        for v in polygon.as_ref() {
            write!(out, " {}", v + 1)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes a normalised triangle mesh as OBJ, in the coordinates of its file.
///
/// # Errors
///
/// Those of writing to `out`.
pub fn write_mesh_obj(out: &mut impl Write, mesh: &TriMesh, units: &Normalisation) -> io::Result<()> {
    let positions: Vec<DVec3> = mesh.positions().iter().map(|&p| units.to_file(p)).collect();
    let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
    write_obj(out, &positions, &faces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::parse;

    #[test]
    fn written_meshes_read_back_equal() {
        let positions = [DVec3::ZERO, DVec3::X / 3.0, DVec3::new(1.0 / 3.0, 0.1, 1e-9), DVec3::Y * 0.7];
        let mut bytes = Vec::new();
        write_obj(&mut bytes, &positions, &[[0u32, 1, 2, 3]]).unwrap();
        let loaded = parse(&bytes, "quad.obj").unwrap();
        assert_eq!((loaded.mesh.n_faces(), loaded.name.as_str(), loaded.repairs.len()), (2, "quad", 0));
        for (v, p) in loaded.mesh.vertices().zip(positions) {
            assert!(loaded.units.to_file(loaded.mesh.position(v)).distance(p) < 1e-15);
        }
        let mut again = Vec::new();
        write_mesh_obj(&mut again, &loaded.mesh, &loaded.units).unwrap();
        assert_eq!(parse(&again, "quad.obj").unwrap().mesh.n_vertices(), 4);
    }
}
