//! The repairs that were made, for the user.

use std::fmt;

use crate::mesh::error::{FaceRef, VertexRef};

/// A repair made to a mesh on loading.
#[derive(Debug, Clone, PartialEq)]
pub enum Repair {
    /// Vertices at equal positions were welded, since no two faces shared any.
    Welded {
        /// Number of vertices removed.
        count: usize,
    },
    /// Faces without three different corners were dropped.
    DroppedDegenerateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FaceRef,
    },
    /// Faces with the same corners as another were dropped.
    DroppedDuplicateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FaceRef,
    },
    /// Triangles were reversed so that their component is consistently oriented.
    Reoriented {
        /// How many.
        count: usize,
        /// The polygon of the first.
        first: FaceRef,
    },
    /// A closed component oriented inwards was reversed.
    TurnedOutwards {
        /// Number of its triangles.
        count: usize,
        /// Its first face.
        first: FaceRef,
    },
    /// Vertices where several fans of faces touch were split into one vertex per fan.
    SplitVertices {
        /// How many vertices.
        count: usize,
        /// The first.
        first: VertexRef,
    },
    /// Vertices that no face uses were dropped.
    DroppedUnusedVertices {
        /// How many.
        count: usize,
        /// The first.
        first: VertexRef,
    },
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counted = |count: usize, singular: &str, plural: &str| match count {
            1 => format!("1 {singular}"),
            n => format!("{n} {plural}"),
        };
        let faces = |count: usize| counted(count, "face", "faces");
        let vertices = |count: usize| counted(count, "vertex", "vertices");
        match self {
            Self::Welded { count } => write!(f, "welded {} at the position of another", vertices(*count)),
            Self::DroppedDegenerateFaces { count, first } => {
                write!(f, "dropped {} without three different corners (first: {first})", faces(*count))
            }
            Self::DroppedDuplicateFaces { count, first } => {
                write!(f, "dropped {} with the corners of another face (first: {first})", faces(*count))
            }
            Self::Reoriented { count, first } => {
                write!(
                    f,
                    "reversed {} oriented against their neighbours (first: {first})",
                    counted(*count, "triangle", "triangles")
                )
            }
            Self::TurnedOutwards { count, first } => {
                let triangles = counted(*count, "triangle", "triangles");
                write!(f, "reversed a closed surface of {triangles} that was oriented inwards (first: {first})")
            }
            Self::SplitVertices { count, first } => {
                write!(f, "split {} where several fans of faces touch (first: {first})", vertices(*count))
            }
            Self::DroppedUnusedVertices { count, first } => {
                write!(f, "dropped {} that no face uses (first: {first})", vertices(*count))
            }
        }
    }
}
