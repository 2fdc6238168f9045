//! Geomview OFF, with its variants that add colours, normals or texture coordinates to vertices.
//!
//! One vertex or face per line; what follows the coordinates or the corners on a line is ignored.

use glam::DVec3;

use super::raw_mesh::RawMesh;
use super::text::{coordinate, lines, number, show, syntax, tokens};
use crate::mesh::error::LoadError;

/// Whether a word is the keyword of an OFF file of three-dimensional points.
pub(super) fn is_header(word: &[u8]) -> bool {
    word.strip_suffix(b"OFF")
        .is_some_and(|prefix| matches!(prefix, b"" | b"C" | b"N" | b"CN" | b"ST" | b"STC" | b"STN" | b"STCN"))
}

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let mut rows = lines(bytes).filter(|(_, l)| tokens(l).next().is_some()).peekable();
    let Some(&(line, content)) = rows.peek() else { return Err(LoadError::Empty) };
    let mut words = tokens(content).peekable();
    let mut line = line;
    if words.peek().is_some_and(|w| is_header(w)) {
        words.next();
        if words.peek().is_none() {
            rows.next();
            let Some(&(next, content)) = rows.peek() else {
                return Err(syntax(line, "the file ends after its header"));
            };
            words = tokens(content).peekable();
            line = next;
        }
    }
    if words.peek() == Some(&b"BINARY".as_slice()) {
        return Err(syntax(line, "binary OFF files are not supported"));
    }
    let mut count = |what: &str| -> Result<usize, LoadError> {
        words.next().and_then(number).ok_or_else(|| syntax(line, format!("the number of {what} is missing")))
    };
    let (n_vertices, n_faces) = (count("vertices")?, count("faces")?);
    rows.next();

    let mut raw = RawMesh::default();
    let ends_early = |got: usize, of: usize, what: &str| LoadError::Syntax {
        line: None,
        message: format!("the file ends after {got} of {of} {what}"),
    };
    for i in 0..n_vertices {
        let (line, content) = rows.next().ok_or_else(|| ends_early(i, n_vertices, "vertices"))?;
        let mut words = tokens(content);
        let mut xyz = || coordinate(&mut words, line);
        raw.positions.push(DVec3::new(xyz()?, xyz()?, xyz()?));
    }
    for i in 0..n_faces {
        let (line, content) = rows.next().ok_or_else(|| ends_early(i, n_faces, "faces"))?;
        read_face(&mut raw, line, content)?;
    }
    Ok(raw)
}

fn read_face(raw: &mut RawMesh, line: usize, content: &[u8]) -> Result<(), LoadError> {
    let mut words = tokens(content);
    let n: usize = words.next().and_then(number).ok_or_else(|| syntax(line, "the number of corners is missing"))?;
    for i in 0..n {
        let word = words.next().ok_or_else(|| syntax(line, format!("the face has only {i} of its {n} corners")))?;
        let v = number(word).ok_or_else(|| syntax(line, format!("“{}” is not a vertex number", show(word))))?;
        raw.corners.push(v);
    }
    raw.close_polygon(Some(line));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_read_in_all_variants() {
        let body = "0 0 0 255 0 0\n1 0 0 255 0 0 # red\n\n0 1 0 9 9 9\n3 0 1 2 255 255 255\n";
        for head in ["OFF\n3 1 0\n", "OFF 3 1\n", "# by hand\nCOFF\r\n# c\n3 1 0\r\n", "3 1 0\n"] {
            let raw = read(format!("{head}{body}").as_bytes()).unwrap();
            assert_eq!((raw.positions.len(), raw.corners.as_slice()), (3, [0, 1, 2].as_slice()));
        }
    }

    #[test]
    fn an_error_names_its_line() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(message("OFF\n3 1 0\n0 0 0\n").contains("after 1 of 3 vertices"));
        assert!(message("OFF\n1 1 0\n0 0 0\n4 0 0\n").contains("line 4"));
        assert!(message("OFF\n18446744073709551615 1 0\n0 0 0\n").contains("vertices"));
        assert!(message("OFF BINARY\n").contains("binary"));
    }
}
