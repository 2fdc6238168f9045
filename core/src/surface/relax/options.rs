//! The options, the result and the errors of [`relax`](super::relax).

use glam::DVec3;
use thiserror::Error;

use crate::mesh::FaceId;
use crate::progress::Cancelled;
use crate::surface::curve::{CurveError, SurfaceCurve};
use crate::surface::point::SurfacePoint;

/// Penalty `q` of (8.1): maps a triangle and a unit tangent in it to a number that is not negative.
pub type Alignment<'a> = dyn Fn(FaceId, DVec3) -> f64 + Sync + 'a;

/// The objective of [`relax`](super::relax), and how far the curve may move.
#[derive(Clone)]
pub struct RelaxOptions<'a> {
    /// Weight `α` of the alignment in (8.1); 1 in the thesis.
    pub alpha: f64,
    /// Weight `β` of the squared curvature in (8.1); 0.25 in the thesis, for models of size 1.
    pub beta: f64,
    /// The alignment `q`; `None` for 0.
    pub alignment: Option<&'a Alignment<'a>>,
    /// Weight of the squared distance to the original curve in units of the tube's radius.
    pub fidelity: f64,
    /// Radius of the tube around the original curve, in mean lengths of the edges that the curve crosses.
    pub tube: f64,
    /// Crossings stay in `[t_min, 1 − t_min]` of their edges; between 0 and 0.5.
    pub t_min: f64,
    /// Points that the curve passes at a distance of at most a fraction of an edge.
    pub waypoints: Vec<Waypoint>,
    /// Fraction by which distances and forces must differ for the smaller or larger one to be taken; else the first is. 0: any
    /// difference counts, also one by rounding. Then the result depends on the position of the mesh in space.
    pub tie: f64,
    /// Most rounds of sliding and passing over vertices.
    pub rounds: usize,
    /// Most rounds in which the vertices that still block the curve are tried one by one. 0 takes about half the time
    /// and leaves a curve of higher cost.
    pub trials: usize,
}

impl Default for RelaxOptions<'_> {
    fn default() -> Self {
        Self {
            alpha: 1.0,
            beta: 0.25,
            alignment: None,
            fidelity: 1.0,
            tube: 2.5,
            t_min: 0.03,
            waypoints: Vec::new(),
            tie: 0.0,
            rounds: 8,
            trials: 10,
        }
    }
}

/// A point that a relaxed curve passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// The point.
    pub at: SurfacePoint,
    /// The direction of the curve there, of any length; `None`: that of the original curve. The distance of the curve from
    /// the point is measured across it. The curve need not follow it at this point alone.
    pub direction: Option<DVec3>,
}

impl From<SurfacePoint> for Waypoint {
    fn from(at: SurfacePoint) -> Self {
        Self { at, direction: None }
    }
}

/// The parts of the cost (8.1) of a curve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CurveCost {
    /// Length on the mesh, in units of the mesh.
    pub length: f64,
    /// Integral of the alignment along the curve.
    pub alignment: f64,
    /// Integral of the squared geodesic curvature.
    pub bending: f64,
    /// `length + α alignment + β bending`.
    pub total: f64,
}

/// A relaxed curve.
#[derive(Debug, Clone)]
pub struct Relaxed {
    /// The curve; a closed one starts near the start of the original.
    pub curve: SurfaceCurve,
    /// Cost of the original curve.
    pub before: CurveCost,
    /// Cost of the relaxed curve.
    pub after: CurveCost,
    /// Largest distance of a crossing from the original curve, in units of the mesh.
    pub max_displacement: f64,
    /// Number of passes over vertices.
    pub passed: usize,
    /// Whether the curve differs from the original.
    pub improved: bool,
}

/// Why a curve cannot be relaxed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RelaxError {
    /// The curve does not lie on this mesh.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// `t_min` is not strictly between 0 and 0.5.
    #[error("the distance of crossings from vertices is {t_min} of an edge; it must be between 0 and 0.5")]
    VertexDistance {
        /// The value of [`RelaxOptions::t_min`].
        t_min: f64,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
