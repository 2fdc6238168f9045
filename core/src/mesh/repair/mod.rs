//! Repairs of a triangle list that are certain; each one is listed.
//!
//! In this order: weld vertices if no two faces share any, drop faces without three different corners, drop duplicate
//! faces, split vertices where several fans of faces touch, orient each component consistently and closed ones outwards,
//! drop vertices without face. Edges of more than two faces and surfaces that are not orientable are errors. Faces of zero
//! area are kept.

mod orient;
mod report;
mod soup;
mod split;
#[cfg(test)]
mod tests;

use glam::DVec3;

pub use report::Repair;
use soup::TriangleSoup;

use super::error::LoadError;
use super::read::RawMesh;
use super::triangulate::Triangles;

/// The vertices and triangles after all repairs, and the repairs.
pub(super) type Repaired = (Vec<DVec3>, Vec<[u32; 3]>, Vec<Repair>);

/// Turns the triangles of a file into an oriented manifold.
pub(super) fn repair(raw: RawMesh, triangles: Triangles) -> Result<Repaired, LoadError> {
    let dropped = triangles.dropped.clone();
    let mut soup = TriangleSoup::new(raw, triangles);
    soup.weld();
    soup.drop_degenerate(&dropped);
    soup.drop_duplicates();
    if soup.faces.is_empty() {
        return Err(LoadError::NoFaces { vertices: soup.raw.positions.len() });
    }
    let pairs = soup.pair_edges()?;
    soup.split_vertices(&pairs);
    soup.orient(&pairs)?;
    soup.drop_unused();
    Ok((soup.raw.positions, soup.faces, soup.repairs))
}
