//! What is still missing, region by region (Campen, section 7.2).
//!
//! Red: the region cannot be a node of a quad layout. Orange: it holds several pronounced corners of the
//! shape, which more strips could tell apart. Yellow: its valence is far from what its curvature asks for.

use std::f64::consts::PI;

use serde::Serialize;

use super::arrangement::{Arrangement, Region, SideKind};
use crate::mesh::{TriMesh, VertexId};

/// Urgency of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// Nothing to do.
    None,
    /// Valence and curvature disagree by more than one.
    Yellow,
    /// Several pronounced corners share the region.
    Orange,
    /// Not a node of a valid layout.
    Red,
}

/// What is remarkable about a region.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Finding {
    /// No strip touches this component of the surface.
    Untouched,
    /// No strip crosses here: the region has no corner.
    NoCorner,
    /// The region has handles.
    Handles {
        /// How many.
        handles: i64,
    },
    /// The region has several borders.
    Borders {
        /// How many.
        borders: usize,
    },
    /// The region touches the boundary of the surface in several places, or along a whole boundary loop.
    Boundary {
        /// Number of whole boundary loops.
        whole: usize,
        /// Number of stretches, whole loops included.
        stretches: usize,
    },
    /// Only one patch would meet at the node, folded onto itself.
    Monogon,
    /// Only two patches meet at the node: valid, but flat.
    Digon,
    /// Several pronounced corners of the shape.
    SeveralCorners {
        /// How many.
        corners: usize,
    },
    /// Valence and curvature disagree.
    Valence {
        /// Patches that meet at the node.
        valence: usize,
        /// What the curvature asks for.
        ideal: f64,
    },
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Untouched => write!(f, "no strip has been placed here yet"),
            Self::NoCorner => write!(f, "no two strips cross at its border"),
            Self::Handles { handles: 1 } => write!(f, "holds a handle: a strip must go through or around it"),
            Self::Handles { handles } => write!(f, "holds {handles} handles: strips must go through or around them"),
            Self::Borders { borders: 2 } => write!(f, "is a ring: a strip must cross it"),
            Self::Borders { borders } => write!(f, "has {borders} borders: strips must join them"),
            Self::Boundary { whole: 1, .. } => write!(f, "holds a whole boundary loop: a strip must end there"),
            Self::Boundary { whole, .. } if whole > 1 => {
                write!(f, "holds {whole} whole boundary loops: strips must end there")
            }
            Self::Boundary { stretches, .. } => {
                write!(f, "touches the boundary in {stretches} places: a strip must separate them")
            }
            Self::Monogon => write!(f, "a strip crosses itself around it: a second strip must cross it"),
            Self::Digon => write!(f, "only two patches meet here, so they are folded flat: a strip should cross"),
            Self::SeveralCorners { corners } => write!(f, "holds {corners} corners of the shape"),
            Self::Valence { valence, ideal } => {
                write!(f, "{valence} patches meet here, its curvature asks for {ideal:.1}")
            }
        }
    }
}

/// The assessment of one region.
#[derive(Debug, Clone, Serialize)]
pub struct RegionReport {
    /// Urgency.
    pub colour: Colour,
    /// Reasons, the most urgent first.
    pub findings: Vec<Finding>,
    /// Patches that meet at the region's node.
    pub valence: usize,
    /// Integral of the Gaussian curvature, and of the boundary's geodesic curvature, in radians.
    pub curvature: f64,
    /// Area, in units of the mesh.
    pub area: f64,
    /// Pronounced corners of the shape inside: vertex and index in quarters.
    pub corners: Vec<(VertexId, i8)>,
}

/// What each vertex of `mesh` adds to the curvature of its region, in radians: its angle defect, or the turning
/// of the boundary.
pub fn vertex_curvatures(mesh: &TriMesh) -> Vec<f64> {
    let one = |v| {
        let angle: f64 = mesh.outgoing(v).map(|h| mesh.corner_angle(h)).sum();
        let flat = if mesh.is_boundary_vertex(v) { PI } else { 2.0 * PI };
        flat - angle
    };
    mesh.vertices().map(one).collect()
}

/// Assesses every region of `arrangement`.
///
/// `curvatures` are those of [`vertex_curvatures`] of the mesh before refinement, `corners` its pronounced
/// corners (vertex, index in quarters).
pub fn assess(arrangement: &Arrangement, curvatures: &[f64], corners: &[(VertexId, i8)]) -> Vec<RegionReport> {
    let region_of_vertex = |v: VertexId| {
        let h = arrangement.refined.vertex_halfedge(v.0);
        arrangement.region_left_of(h) as usize
    };
    let mut curvature = vec![0.0; arrangement.regions.len()];
    for (v, k) in curvatures.iter().enumerate() {
        curvature[region_of_vertex(VertexId::new(v))] += k;
    }
    let mut inside: Vec<Vec<(VertexId, i8)>> = vec![Vec::new(); arrangement.regions.len()];
    for &(v, index) in corners {
        inside[region_of_vertex(v)].push((v, index));
    }
    arrangement
        .regions
        .iter()
        .zip(curvature)
        .zip(inside)
        .map(|((region, curvature), corners)| assess_region(arrangement, region, curvature, corners))
        .collect()
}

fn assess_region(
    arrangement: &Arrangement,
    region: &Region,
    curvature: f64,
    corners: Vec<(VertexId, i8)>,
) -> RegionReport {
    let valence = region.corners();
    let mut findings = red_findings(region);
    let red = !findings.is_empty();
    if corners.len() > 1 {
        findings.push(Finding::SeveralCorners { corners: corners.len() });
    }
    if !red && valence == 2 && region.boundary_stretches() == 0 {
        findings.push(Finding::Digon);
    }
    let flat = if region.boundary_stretches() > 0 { 2.0 } else { 4.0 };
    let ideal = flat - 2.0 * curvature / PI;
    if !red && (valence as f64 - ideal).abs() > 1.0 {
        findings.push(Finding::Valence { valence, ideal });
    }
    let colour = match findings.first() {
        _ if red => Colour::Red,
        Some(Finding::SeveralCorners { .. } | Finding::Digon) => Colour::Orange,
        Some(_) => Colour::Yellow,
        None => Colour::None,
    };
    let area = region.faces.iter().map(|&f| face_area(arrangement, f)).sum();
    RegionReport { colour, findings, valence, curvature, area, corners }
}

/// Why a region cannot be a node; empty where it can.
fn red_findings(region: &Region) -> Vec<Finding> {
    let mut findings = Vec::new();
    let borders = region.borders.len();
    if region.borders.iter().flatten().all(|s| s.kind == SideKind::Boundary) {
        findings.push(Finding::Untouched);
    }
    // χ = 2 − 2 g − b for the open region, its borders counted whether curve or boundary.
    let handles = (2 - borders as i64 - region.euler) / 2;
    if handles > 0 {
        findings.push(Finding::Handles { handles });
    }
    let whole_loops = region.borders.iter().filter(|b| b.len() == 1 && b[0].kind == SideKind::Boundary).count();
    let stretches = region.boundary_stretches();
    if whole_loops > 0 || stretches > 1 {
        findings.push(Finding::Boundary { whole: whole_loops, stretches });
    }
    // Handles and boundary loops are borders' causes of their own; what is left is borders of curves.
    if borders > 1 {
        findings.push(Finding::Borders { borders });
    }
    if findings.is_empty() {
        match region.corners() {
            0 => findings.push(Finding::NoCorner),
            1 if stretches == 0 => findings.push(Finding::Monogon),
            _ => {}
        }
    }
    findings
}

fn face_area(arrangement: &Arrangement, f: u32) -> f64 {
    let [a, b, c] = arrangement.refined.corners(f).map(|v| arrangement.refined.positions[v as usize]);
    0.5 * (b - a).cross(c - a).length()
}
