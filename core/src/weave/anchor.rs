//! Anchors: points, with or without a direction, that a designer sets and that the spine of a strip passes in order.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::surface::SurfacePoint;

/// A point that the spine of a strip passes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Anchor {
    /// The point on the design mesh.
    pub at: SurfacePoint,
    /// The direction of the spine there, a vector in space of any length, or its opposite; `None`: any direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<DVec3>,
}

impl Anchor {
    /// An anchor without direction.
    pub fn point(at: SurfacePoint) -> Self {
        Self { at, direction: None }
    }
}
