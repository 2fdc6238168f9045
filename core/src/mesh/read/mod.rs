//! Readers of mesh files, one per format.
//!
//! A reader takes bytes and returns a [`RawMesh`]: the polygons of the file, indices checked, nothing repaired. The format
//! is recognised by the content, and by the file name only if the content is ambiguous. Readers do not trust counts in
//! headers: memory grows with the bytes that are there.

mod obj;
mod off;
mod ply;
mod raw_mesh;
mod stl;
mod text;

use super::error::LoadError;

pub(super) use raw_mesh::RawMesh;

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
    let raw = match format_of_content(bytes).or_else(|| format_of_name(name)) {
        Some(Format::Obj) => obj::read(bytes)?,
        Some(Format::Off) => off::read(bytes)?,
        Some(Format::Ply) => ply::read(bytes)?,
        Some(Format::Stl) => stl::read(bytes)?,
        None => return Err(LoadError::UnknownFormat),
    };
    check(&raw)?;
    Ok(raw)
}

/// Checks what all formats require: finite coordinates, known indices, counts that 32-bit ids can number.
fn check(raw: &RawMesh) -> Result<(), LoadError> {
    if let Some(vertex) = raw.positions.iter().position(|p| !p.is_finite()) {
        return Err(LoadError::NotFinite { vertex: vertex + raw.base });
    }
    // A polygon of n corners becomes n − 2 triangles of three half-edges each. A quarter of the range leaves space for
    // vertices that are split.
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

/// The format recognised by the content.
fn format_of_content(bytes: &[u8]) -> Option<Format> {
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

/// The format of the extension of a file name.
fn format_of_name(name: &str) -> Option<Format> {
    let (_, extension) = name.rsplit_once('.')?;
    match extension.to_ascii_lowercase().as_str() {
        "obj" => Some(Format::Obj),
        "off" => Some(Format::Off),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}
