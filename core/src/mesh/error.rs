//! Errors of loading, and how they name faces and vertices of the file.

use std::fmt;

use glam::DVec3;
use thiserror::Error;

use super::kernel::TriMeshError;

/// A face of a file, for messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceRef {
    /// Its number, from 1 in OBJ, from 0 in other formats.
    pub number: usize,
    /// Its line, in text formats.
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

/// A vertex of a file, for messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexRef {
    /// Its number, from 1 in OBJ, from 0 in other formats; if vertices were welded, the number after welding.
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

/// Why a file cannot be loaded as a mesh.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// No built-in model of this name.
    #[error("there is no built-in model named “{0}”")]
    UnknownModel(String),
    /// A folder, a pipe or a device.
    #[error("this is not a regular file")]
    NotAFile,
    /// The file has no content but white space.
    #[error("the file is empty")]
    Empty,
    /// Neither content nor name belong to a known format.
    #[error("the file format is unknown (OBJ, OFF, PLY and STL can be read)")]
    UnknownFormat,
    /// The text does not follow the format.
    #[error("{}{message}", line.map(|l| format!("line {l}: ")).unwrap_or_default())]
    Syntax {
        /// The line, where there is one.
        line: Option<usize>,
        /// What is wrong.
        message: String,
    },
    /// More elements than 32-bit ids can number.
    #[error("the mesh is too large: more than 2^30 vertices or face corners")]
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
    /// A face has more corners than the triangulation accepts.
    #[error("{face} has {corners} corners; more than {limit} are not supported")]
    HugeFace {
        /// The face.
        face: FaceRef,
        /// Number of its corners.
        corners: usize,
        /// The most corners a face may have.
        limit: usize,
    },
    /// There is no face with three different corners.
    #[error("the file has no faces ({vertices} vertices)")]
    NoFaces {
        /// The number of vertices.
        vertices: usize,
    },
    /// All vertices coincide, or the diagonal of the bounding box overflows.
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
    /// A component is not orientable.
    #[error("the surface is not orientable (a Möbius strip): no orientation is consistent at {face}, near {near}")]
    NonOrientable {
        /// A face that both orientations reach.
        face: FaceRef,
        /// A vertex of it.
        near: VertexRef,
    },
    /// The repaired mesh is still not a manifold.
    #[error("the mesh could not be repaired: {0}")]
    Mesh(#[from] TriMeshError),
}
