//! Assessment of regions: what a region lacks to be a node of a quad layout (Campen, section 7.2).
//!
//! Red: the region cannot be a node of a quad layout. Orange: the region contains several pronounced corners of the shape,
//! which further strips could separate, or is a digon. Yellow: its valence differs from the valence that its curvature asks
//! for.

use std::f64::consts::PI;

use serde::Serialize;

use super::arrangement::Arrangement;
use super::regions::{Region, SideKind};
use crate::mesh::{TriMesh, VertexId};

/// Urgency of the findings of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// No finding.
    None,
    /// The valence differs by more than 1 from what the curvature asks for.
    Yellow,
    /// The region contains several pronounced corners, or is a digon.
    Orange,
    /// The region cannot be a node of a quad layout.
    Red,
}

/// A finding about a region.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Finding {
    /// The region is a whole component of the surface, without strips.
    Untouched,
    /// The region has no corner: no strips cross at its border.
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
    /// The border of the region has several stretches of the surface's boundary, or a whole boundary loop.
    Boundary {
        /// Number of whole boundary loops.
        whole: usize,
        /// Number of stretches, whole loops included.
        stretches: usize,
    },
    /// One corner: a single patch would meet itself at the node.
    Monogon,
    /// Two corners: valid, but the two patches at the node are degenerate.
    Digon,
    /// The region contains several pronounced corners of the shape.
    SeveralCorners {
        /// How many.
        corners: usize,
    },
    /// The valence differs from what the curvature asks for.
    Valence {
        /// Number of patches that meet at the node.
        valence: usize,
        /// The valence that the curvature asks for.
        ideal: f64,
    },
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::Untouched => write!(f, "no strip lies on this part of the surface"),
            Self::NoCorner => write!(f, "no two strips cross at its border"),
            Self::Handles { handles: 1 } => write!(f, "contains a handle: a strip must run through or around it"),
            Self::Handles { handles } => {
                write!(f, "contains {handles} handles: strips must run through or around them")
            }
            Self::Borders { borders: 2 } => write!(f, "is a ring: a strip must cross it"),
            Self::Borders { borders } => write!(f, "has {borders} borders: strips must join them"),
            Self::Boundary { whole: 1, .. } => write!(f, "contains a whole boundary loop: a strip must end there"),
            Self::Boundary { whole, .. } if whole > 1 => {
                write!(f, "contains {whole} whole boundary loops: strips must end there")
            }
            Self::Boundary { stretches, .. } => {
                write!(f, "meets the boundary in {stretches} places: a strip must separate them")
            }
            Self::Monogon => write!(f, "is bounded by one strip crossing itself: a second strip must cross it"),
            Self::Digon => write!(f, "has valence 2, so its two patches are degenerate: a strip should cross it"),
            Self::SeveralCorners { corners } => write!(f, "contains {corners} corners of the shape"),
            Self::Valence { valence, ideal } => {
                write!(f, "has valence {valence}; its curvature asks for {ideal:.1}")
            }
        }
    }
}

/// The assessment of one region.
#[derive(Debug, Clone, Serialize)]
pub struct RegionReport {
    /// Urgency.
    pub colour: Colour,
    /// The findings, the most urgent first.
    pub findings: Vec<Finding>,
    /// Number of patches that meet at the region's node.
    pub valence: usize,
    /// Integral of the Gaussian curvature over the region plus that of the boundary's geodesic curvature, in radians.
    pub curvature: f64,
    /// Area, in squared units of the mesh.
    pub area: f64,
    /// Pronounced corners of the shape in the region: vertex, and index of the cross field there in quarter turns.
    pub corners: Vec<(VertexId, i8)>,
}

/// Discrete Gaussian curvature at each vertex of `mesh`, in radians: the angle defect, on the boundary the turning angle.
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
/// `curvatures` are the [`vertex_curvatures`] of the mesh before refinement, `corners` its pronounced corners: vertex, and
/// index of the cross field there in quarter turns.
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
    // The index of a node of valence v corresponds to a curvature of ½π (4 − v), on the boundary ½π (2 − v).
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

/// Why a region cannot be a node of a quad layout; empty if it can.
fn red_findings(region: &Region) -> Vec<Finding> {
    let mut findings = Vec::new();
    let borders = region.borders.len();
    if region.borders.iter().flatten().all(|s| s.kind == SideKind::Boundary) {
        findings.push(Finding::Untouched);
    }
    // χ = 2 − 2 g − b for an open region of genus g with b borders, of curves or of the surface's boundary.
    let handles = (2 - borders as i64 - region.euler) / 2;
    if handles > 0 {
        findings.push(Finding::Handles { handles });
    }
    let whole_loops = region.borders.iter().filter(|b| b.len() == 1 && b[0].kind == SideKind::Boundary).count();
    let stretches = region.boundary_stretches();
    if whole_loops > 0 || stretches > 1 {
        findings.push(Finding::Boundary { whole: whole_loops, stretches });
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::SurfaceCurve;
    use crate::testing::{column, diagonal, row, square, torus};

    fn assessed(mesh: &TriMesh, curves: &[SurfaceCurve], corners: &[(VertexId, i8)]) -> Vec<RegionReport> {
        let arrangement = Arrangement::new(mesh, curves).unwrap();
        assess(&arrangement, &vertex_curvatures(mesh), corners)
    }

    #[test]
    fn vertex_curvatures_satisfy_gauss_bonnet() {
        for mesh in [torus(8, 6), square(4)] {
            let total: f64 = vertex_curvatures(&mesh).iter().sum();
            assert!((total - 2.0 * PI * mesh.euler_characteristic() as f64).abs() < 1e-9);
        }
    }

    #[test]
    fn a_torus_without_strips_is_red_for_its_handle() {
        let reports = assessed(&torus(8, 6), &[], &[]);
        assert_eq!(reports[0].colour, Colour::Red);
        assert_eq!(reports[0].findings, [Finding::Untouched, Finding::Handles { handles: 1 }]);
    }

    #[test]
    fn a_ring_between_strips_is_red_until_a_strip_crosses_it() {
        let mesh = torus(8, 6);
        let rows = [row(8, 1, true, 0.5), row(8, 4, true, 0.5)];
        let reports = assessed(&mesh, &rows, &[]);
        assert!(reports.iter().all(|r| r.findings == [Finding::Borders { borders: 2 }]));
        let [a, b] = rows;
        let reports = assessed(&mesh, &[a, b, column(8, 6, 2, true, 0.5)], &[]);
        assert!(reports.iter().all(|r| r.colour != Colour::Red && r.valence == 4));
    }

    #[test]
    fn a_whole_boundary_loop_asks_for_a_strip_to_end_there() {
        let reports = assessed(&square(4), &[], &[]);
        assert!(reports[0].findings.contains(&Finding::Boundary { whole: 1, stretches: 1 }));
        let reports = assessed(&square(4), &[row(4, 1, false, 0.5)], &[]);
        assert!(reports.iter().all(|r| r.findings == [Finding::NoCorner]));
    }

    #[test]
    fn corners_that_share_a_region_are_orange() {
        let mesh = square(6);
        let strips = [row(6, 2, false, 0.5), column(6, 6, 3, false, 0.5)];
        let near = [(VertexId(0), 1), (VertexId(1), 1)];
        let reports = assessed(&mesh, &strips, &near);
        let shared = reports.iter().find(|r| r.corners.len() == 2).unwrap();
        assert_eq!((shared.colour, shared.findings[0]), (Colour::Orange, Finding::SeveralCorners { corners: 2 }));
        let apart = [(VertexId(0), 1), (VertexId(48), 1)];
        assert!(assessed(&mesh, &strips, &apart).iter().all(|r| r.corners.len() < 2 && r.colour < Colour::Orange));
    }

    #[test]
    fn curvature_and_area_are_those_of_the_surface() {
        let mesh = torus(8, 8);
        let reports = assessed(&mesh, &[row(8, 1, true, 0.5), column(8, 8, 3, true, 0.5), diagonal(8)], &[]);
        let curvature: f64 = reports.iter().map(|r| r.curvature).sum();
        let (area, whole) =
            (reports.iter().map(|r| r.area).sum::<f64>(), mesh.faces().map(|f| mesh.face_area(f)).sum::<f64>());
        assert!(curvature.abs() < 1e-9 && (area - whole).abs() < 1e-9 * whole);
    }
}
