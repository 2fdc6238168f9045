//! The polygons of a file, as a reader returns them.

use glam::DVec3;

use crate::mesh::error::FaceRef;

/// The polygons of a file as written there; a reader checks syntax only.
#[derive(Debug, Default)]
pub(in crate::mesh) struct RawMesh {
    /// Vertex positions in file units.
    pub positions: Vec<DVec3>,
    /// The corners of all polygons, one after the other.
    pub corners: Vec<u32>,
    /// The end of each polygon in `corners`.
    pub ends: Vec<u32>,
    /// Line of each polygon; empty for binary formats.
    pub lines: Vec<u32>,
    /// Number of the first vertex and of the first face: 1 in OBJ, 0 in other formats.
    pub base: usize,
    /// Whether the format is a triangle soup: vertices must be welded by position.
    pub soup: bool,
}

impl RawMesh {
    /// Ends the polygon whose corners were pushed last.
    pub(super) fn close_polygon(&mut self, line: Option<usize>) {
        self.ends.push(self.corners.len() as u32);
        if let Some(line) = line {
            self.lines.push(line as u32);
        }
    }

    /// Number of polygons.
    pub fn n_polygons(&self) -> usize {
        self.ends.len()
    }

    /// The corners of a polygon.
    pub fn polygon(&self, i: usize) -> &[u32] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] as usize };
        &self.corners[start..self.ends[i] as usize]
    }

    /// A polygon, for messages.
    pub fn face_ref(&self, polygon: usize) -> FaceRef {
        FaceRef { number: polygon + self.base, line: self.lines.get(polygon).map(|&l| l as usize) }
    }
}
