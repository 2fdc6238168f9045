//! Reading mesh files into polygons, one reader per format.
//!
//! A reader takes bytes and returns a [`RawMesh`]: what the file says, indices checked, nothing repaired. The
//! format is told by the content; the file name decides only where the content is silent. No reader trusts a
//! count in a header: memory grows with the bytes that are really there.

mod obj;
mod off;
mod ply;
mod stl;
mod text;

use glam::DVec3;

use super::load::{FaceRef, LoadError};

/// The polygons of a file, not yet checked for anything but their indices.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    /// Vertex positions in file units.
    pub positions: Vec<DVec3>,
    /// The corners of all polygons, one after the other.
    pub corners: Vec<u32>,
    /// Where each polygon ends in `corners`.
    pub ends: Vec<u32>,
    /// Line of each polygon; empty for binary files.
    pub lines: Vec<u32>,
    /// Number of the first vertex and of the first face, as the format counts: 1 in OBJ, 0 elsewhere.
    pub base: usize,
    /// Whether the format has no shared vertices, so that they must be welded by position.
    pub soup: bool,
}

impl RawMesh {
    /// Ends the polygon whose corners were pushed last.
    fn close_polygon(&mut self, line: Option<usize>) {
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

    /// How to name a polygon to the user.
    pub fn face_ref(&self, polygon: usize) -> FaceRef {
        FaceRef { number: polygon + self.base, line: self.lines.get(polygon).map(|&l| l as usize) }
    }
}

/// The file formats that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Obj,
    Off,
    Ply,
    Stl,
}

/// Reads a file of any known format; `name` is its file name.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<RawMesh, LoadError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(LoadError::Empty);
    }
    let raw = match sniff(bytes).or_else(|| by_extension(name)) {
        Some(Format::Obj) => obj::read(bytes)?,
        Some(Format::Off) => off::read(bytes)?,
        Some(Format::Ply) => ply::read(bytes)?,
        Some(Format::Stl) => stl::read(bytes)?,
        None => return Err(LoadError::UnknownFormat),
    };
    check(&raw)?;
    Ok(raw)
}

/// Checks what every format needs: finite coordinates, known indices, counts that ids can hold.
fn check(raw: &RawMesh) -> Result<(), LoadError> {
    if let Some(vertex) = raw.positions.iter().position(|p| !p.is_finite()) {
        return Err(LoadError::NotFinite { vertex: vertex + raw.base });
    }
    // Half-edge ids are 32 bits; a polygon of n corners becomes n − 2 triangles of three half-edges.
    if raw.corners.len() > u32::MAX as usize / 4 || raw.positions.len() > u32::MAX as usize / 4 {
        return Err(LoadError::TooLarge);
    }
    for i in 0..raw.n_polygons() {
        if let Some(&v) = raw.polygon(i).iter().find(|&&v| v as usize >= raw.positions.len()) {
            return Err(LoadError::UnknownVertex {
                face: raw.face_ref(i),
                vertex: v as usize + raw.base,
                count: raw.positions.len(),
            });
        }
    }
    Ok(())
}

/// The format that the content itself tells.
fn sniff(bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    if stl::is_binary(bytes) {
        return Some(Format::Stl);
    }
    let first = text::lines(bytes).find_map(|(_, line)| text::tokens(line).next())?;
    if off::is_header(first) {
        return Some(Format::Off);
    }
    if first.eq_ignore_ascii_case(b"solid") {
        return Some(Format::Stl);
    }
    let is_obj = |line| matches!(text::tokens(line).next(), Some(b"v" | b"f"));
    text::lines(bytes).any(|(_, line)| is_obj(line)).then_some(Format::Obj)
}

fn by_extension(name: &str) -> Option<Format> {
    let (_, extension) = name.rsplit_once('.')?;
    match extension.to_ascii_lowercase().as_str() {
        "obj" => Some(Format::Obj),
        "off" => Some(Format::Off),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}
