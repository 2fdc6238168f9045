//! Opening a mesh file: read, cut into triangles, repair, normalise.
//!
//! Afterwards the mesh is an oriented manifold (checked by [`TriMesh::from_faces`]) in a frame of its own, centred
//! and of bounding-box diagonal 1, so that every tolerance of the program has one meaning. What had to be
//! changed is listed; what cannot be repaired with certainty is refused with its place in the file.

use std::fmt;
use std::path::Path;

use glam::DVec3;
use thiserror::Error;

use super::kernel::{TriMesh, TriMeshError};
use super::read;
use super::repair::{Repair, repair};
use super::triangulate::triangulate;

/// A mesh read from a file.
#[derive(Debug, Clone)]
pub struct LoadedMesh {
    /// The mesh, centred at the origin and of bounding-box diagonal 1.
    pub mesh: TriMesh,
    /// The way back to the coordinates of the file.
    pub units: Normalization,
    /// What was changed to make it an oriented manifold, in the order done.
    pub repairs: Vec<Repair>,
    /// The file's name without folder and extension.
    pub name: String,
}

/// The similarity between file coordinates and the normalised frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Normalization {
    /// Centre of the bounding box, in file units.
    pub center: DVec3,
    /// Diagonal of the bounding box: file units per normalised unit.
    pub scale: f64,
}

impl Normalization {
    /// The frame in which `positions` have their bounding box centred and of diagonal 1; `None` where they have no
    /// extent that floating point can express.
    pub fn of(positions: &[DVec3]) -> Option<Self> {
        let min = positions.iter().copied().reduce(DVec3::min)?;
        let max = positions.iter().copied().reduce(DVec3::max)?;
        let scale = (max - min).length();
        let center = min + 0.5 * (max - min);
        (scale.is_normal() && center.is_finite()).then_some(Self { center, scale })
    }

    /// From the normalised frame to file coordinates.
    pub fn to_file(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.center
    }

    /// From file coordinates to the normalised frame.
    pub fn from_file(&self, p: DVec3) -> DVec3 {
        (p - self.center) / self.scale
    }
}

/// A face as the file numbers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceRef {
    /// Its number, counted as the format does: from 1 in OBJ, from 0 elsewhere.
    pub number: usize,
    /// Its line, for text formats.
    pub line: Option<usize>,
}

impl fmt::Display for FaceRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "face {} (line {line})", self.number),
            None => write!(f, "face {}", self.number),
        }
    }
}

/// A vertex as the file numbers it, and where it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexRef {
    /// Its number, counted as the format does: from 1 in OBJ, from 0 elsewhere. Where vertices were welded by
    /// position it is the number after welding.
    pub number: usize,
    /// Its position in file units.
    pub position: DVec3,
}

impl fmt::Display for VertexRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DVec3 { x, y, z } = self.position;
        write!(f, "vertex {} at ({x}, {y}, {z})", self.number)
    }
}

/// Why a file cannot be opened as a mesh.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// There is nothing in the file.
    #[error("the file is empty")]
    Empty,
    /// Neither content nor name tell a known format.
    #[error("this is no mesh file that can be read (OBJ, OFF, PLY or STL)")]
    UnknownFormat,
    /// The text does not follow the format.
    #[error("{}{message}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Syntax {
        /// The line, where there is one.
        line: Option<usize>,
        /// What is wrong.
        message: String,
    },
    /// More elements than 32-bit ids can name.
    #[error("the mesh is too large: more than a thousand million corners")]
    TooLarge,
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex, as the file numbers it.
        vertex: usize,
    },
    /// A face names a vertex that the file does not have.
    #[error("{face} names vertex {vertex}, but there are only {count} vertices")]
    UnknownVertex {
        /// The face.
        face: FaceRef,
        /// The vertex, as the file numbers it.
        vertex: usize,
        /// The number of vertices.
        count: usize,
    },
    /// A face has so many corners that it cannot be meant as one.
    #[error("{face} has {corners} corners; more than {limit} are not supported")]
    HugeFace {
        /// The face.
        face: FaceRef,
        /// Its corners.
        corners: usize,
        /// The most corners a face may have.
        limit: usize,
    },
    /// There is no face, or none that spans anything.
    #[error("the file has no faces ({vertices} vertices)")]
    NoFaces {
        /// The number of vertices.
        vertices: usize,
    },
    /// All vertices coincide, or are too far apart to be measured.
    #[error("the mesh has no measurable size")]
    NoSize,
    /// More than two faces share an edge.
    #[error("{count} faces share the edge from {from} to {to} (among them {first} and {second}); at most two may")]
    NonManifoldEdge {
        /// One end.
        from: VertexRef,
        /// The other end.
        to: VertexRef,
        /// How many faces share it.
        count: usize,
        /// The first of them.
        first: FaceRef,
        /// The second of them.
        second: FaceRef,
    },
    /// A component has only one side, like a Moebius strip.
    #[error("the surface has only one side, like a Möbius strip: it cannot be oriented at {face}, near {near}")]
    NonOrientable {
        /// A face where both orientations meet.
        face: FaceRef,
        /// A vertex of it.
        near: VertexRef,
    },
    /// The repaired mesh is still not a manifold.
    #[error("the mesh could not be repaired: {0}")]
    Mesh(#[from] TriMeshError),
}

/// Opens a mesh file: OBJ, OFF, PLY or STL, told by its content.
///
/// # Errors
///
/// The file cannot be read, or its content is refused; see [`LoadError`].
pub fn load(path: &Path) -> Result<LoadedMesh, LoadError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    parse(&std::fs::read(path)?, &name)
}

/// Reads a mesh from the bytes of a file called `name`.
///
/// # Errors
///
/// The content is refused; see [`LoadError`].
pub fn parse(bytes: &[u8], name: &str) -> Result<LoadedMesh, LoadError> {
    let raw = read::read(bytes, name)?;
    let triangles = triangulate(&raw)?;
    let (positions, faces, repairs) = repair(raw, triangles)?;
    let units = Normalization::of(&positions).ok_or(LoadError::NoSize)?;
    let mesh = TriMesh::from_faces(positions.into_iter().map(|p| units.from_file(p)).collect(), &faces)?;
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    Ok(LoadedMesh { mesh, units, repairs, name: stem.to_owned() })
}
