//! The mesh files of an export.

use std::io::Write;
use std::path::Path;

use crate::mesh::{Normalisation, write_obj};
use crate::weave::error::WeaveError;
use crate::weave::export::result::Export;

impl Export {
    /// Writes `layout.obj`, `quads.obj` and `patches.obj` to `folder`, in units of the file.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Write`].
    pub fn write(&self, folder: &Path, units: &Normalisation) -> Result<(), WeaveError> {
        let in_file = |ps: &[glam::DVec3]| ps.iter().map(|&p| units.to_file(p)).collect::<Vec<_>>();
        let nodes = &self.quads.positions[..self.quads.n_nodes];
        let corners: Vec<[u32; 4]> = self.layout.patches.iter().map(|p| p.corners).collect();
        write_file(&folder.join("layout.obj"), |out| write_obj(out, &in_file(nodes), &corners))?;
        write_file(&folder.join("quads.obj"), |out| {
            write_obj(out, &in_file(&self.quads.positions), &self.quads.quads)
        })?;
        write_file(&folder.join("patches.obj"), |out| self.write_patches(out, units))
    }

    /// The triangle mesh, with one group for each patch and the map of the patch as texture coordinates. Vertices of the
    /// embedding come first, then those that only a map has.
    fn write_patches(&self, out: &mut impl Write, units: &Normalisation) -> std::io::Result<()> {
        let mut positions = self.embedding.mesh.positions.clone();
        let ids: Vec<Vec<u32>> = self
            .maps
            .iter()
            .map(|map| {
                let inner = map.mesh.positions()[map.parent.len()..].iter();
                let first = positions.len() as u32;
                positions.extend(inner);
                map.parent.iter().copied().chain(first..positions.len() as u32).collect()
            })
            .collect();
        for p in positions {
            let p = units.to_file(p);
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for map in &self.maps {
            for uv in &map.uv {
                let uv = *uv * units.scale;
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
        }
        let mut first_uv = 1;
        for (p, (map, ids)) in self.maps.iter().zip(&ids).enumerate() {
            writeln!(out, "g patch{p}")?;
            for f in map.mesh.faces() {
                let [a, b, c] = map.mesh.face_vertices(f).map(|v| (ids[v.index()] + 1, first_uv + v.0));
                writeln!(out, "f {}/{} {}/{} {}/{}", a.0, a.1, b.0, b.1, c.0, c.1)?;
            }
            first_uv += map.uv.len() as u32;
        }
        Ok(())
    }
}

/// Creates a folder and those above it.
pub(in crate::weave) fn make_folder(folder: &Path) -> Result<(), WeaveError> {
    std::fs::create_dir_all(folder).map_err(|source| WeaveError::Write { path: folder.to_owned(), source })
}

/// Writes a file with a buffer.
pub(in crate::weave) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> Result<(), WeaveError> {
    let open = std::fs::File::create(path).map(std::io::BufWriter::new);
    open.and_then(|mut out| {
        write(&mut out)?;
        out.flush()
    })
    .map_err(|source| WeaveError::Write { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let folder = std::env::temp_dir().join(format!("plait-no-such-folder-{}", std::process::id()));
        let path = folder.join("layout.obj");
        let error = write_file(&path, |_| Ok(())).unwrap_err();
        assert!(matches!(&error, WeaveError::Write { path: named, .. } if *named == path), "{error}");
        assert!(error.to_string().contains("layout.obj"));
    }
}
