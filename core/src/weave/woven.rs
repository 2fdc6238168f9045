//! Data derived from the placed strips: their arrangement, the assessment of its regions, the strip map, and the
//! directions in which further strips may run.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::dual::{Arrangement, ArrangementError, Colour, Mark, RegionReport, assess};
use crate::elastica::{DirectionMask, HomologyClasses};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::{Cancelled, Progress};
use crate::strip::StripMap;
use crate::weave::design::Strip;
use crate::weave::error::WeaveError;
use crate::weave::model::Model;

/// Strips within this angle of the isolines of a placed one, in radians, are equivalent to it (Campen, section 8.2.2).
const EQUIVALENT: f64 = std::f64::consts::FRAC_PI_4;

/// Everything derived from a model and its placed strips.
#[derive(Debug)]
pub struct Woven {
    /// The arrangement of all strips' spines.
    pub arrangement: Arrangement,
    /// The assessment of every region.
    pub reports: Vec<RegionReport>,
    /// Directions in which no further strip may run.
    pub mask: DirectionMask,
    /// The same for directions along the spines of strips only.
    pub spine_mask: DirectionMask,
    /// Homology classes of loops on the surface punctured at corners of the shape and crossings of strips.
    pub classes: HomologyClasses,
    /// The refined mesh of the arrangement as a triangle mesh.
    pub mesh: TriMesh,
    /// The strip map on that mesh; `None` without strips, or where it cannot be computed.
    pub strip_map: Option<StripMap>,
}

impl Woven {
    /// Derives everything.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Arrangement`] for a strip that does not lie on the mesh, or [`WeaveError::Cancelled`].
    pub fn new(model: &Model, strips: &[Strip], progress: &Progress) -> Result<Self, WeaveError> {
        progress.report("Arranging strips", 0.0);
        let arrangement = Arrangement::new(&model.mesh, strips.iter().map(Strip::woven))?;
        let mesh = arrangement.refined.to_mesh().map_err(ArrangementError::from)?;
        progress.check()?;
        progress.report("Assessing regions", 0.1);
        let reports = assess(&arrangement, &model.vertex_curvatures, &model.corners);
        let strip_map = if strips.is_empty() { None } else { strip_map(&arrangement, &mesh, progress)? };
        progress.report("Excluding directions of strips", 0.95);
        let spine_mask = mask_spines(model, strips, |_| true);
        let mut mask = spine_mask.clone();
        if let Some(map) = &strip_map {
            mask_isolines(model, &arrangement, &mesh, map, |_| true, &mut mask);
        }
        let classes = homology_classes(model, &arrangement);
        progress.report("Ready", 1.0);
        Ok(Self { arrangement, reports, mask, spine_mask, classes, mesh, strip_map })
    }

    /// The directions in which no further strip may run because of some of the strips, given by their numbers in order.
    pub(in crate::weave) fn mask_of(
        &self,
        model: &Model,
        strips: &[Strip],
        closes: impl Fn(usize) -> bool,
    ) -> DirectionMask {
        let mut mask = mask_spines(model, strips, &closes);
        if let Some(map) = &self.strip_map {
            mask_isolines(model, &self.arrangement, &self.mesh, map, &closes, &mut mask);
        }
        mask
    }

    /// The red regions: those that cannot be nodes of a layout.
    pub fn red(&self) -> Vec<u32> {
        red_regions(&self.reports)
    }

    /// Number of regions of a colour.
    pub fn count(&self, colour: Colour) -> usize {
        self.reports.iter().filter(|r| r.colour == colour).count()
    }
}

/// The red regions of an assessment.
pub(in crate::weave) fn red_regions(reports: &[RegionReport]) -> Vec<u32> {
    (0..).zip(reports).filter(|(_, r)| r.colour == Colour::Red).map(|(i, _)| i).collect()
}

/// Homology classes of the surface punctured at corners and crossings: a strip on the other side of a corner separates other
/// corners, one on the other side of a crossing crosses strips in another order.
fn homology_classes(model: &Model, arrangement: &Arrangement) -> HomologyClasses {
    let mesh = &*model.mesh;
    let corners = model.corners.iter().map(|c| c.0);
    let crossings = arrangement.crossings.iter().map(|c| {
        let face = FaceId(arrangement.refined.base_face(c.spokes[0] / 3));
        mesh.face_vertices(face)[0]
    });
    HomologyClasses::new(mesh, corners.chain(crossings))
}

/// The directions along the spines of some of the strips, given by their numbers in order.
pub(in crate::weave) fn mask_spines(model: &Model, strips: &[Strip], closes: impl Fn(usize) -> bool) -> DirectionMask {
    let mut mask = DirectionMask::all_open();
    for (_, strip) in strips.iter().enumerate().filter(|(i, _)| closes(*i)) {
        mask_spine(model, strip, &mut mask);
    }
    mask
}

/// Masks the directions along a strip's spine in the triangles it passes.
fn mask_spine(model: &Model, strip: &Strip, mask: &mut DirectionMask) {
    let (mesh, curve) = (&model.mesh, strip.woven());
    let n = curve.crossings.len();
    for i in usize::from(!curve.closed)..n {
        let Some(face) = curve.face_before(mesh, i) else { continue };
        let direction = curve.point(mesh, i) - curve.point(mesh, (i + n - 1) % n);
        model.graph.close_near(mask, face, direction, EQUIVALENT);
    }
}

/// Masks the directions along the isolines of the strips that cover each triangle, of some of them.
fn mask_isolines(
    model: &Model,
    arrangement: &Arrangement,
    mesh: &TriMesh,
    map: &StripMap,
    closes: impl Fn(usize) -> bool,
    mask: &mut DirectionMask,
) {
    let mut largest: BTreeMap<(u32, u32), (f64, DVec3)> = BTreeMap::new();
    for f in mesh.faces() {
        for (axis, strip) in map.covered[f.index()].iter().enumerate() {
            let Some(strip) = strip.filter(|&s| closes(map.strips[s as usize].curve as usize)) else { continue };
            // The largest piece of a triangle of the woven mesh stands for all its pieces.
            let entry = largest.entry((arrangement.refined.base_face(f.0), strip)).or_insert((-1.0, DVec3::ZERO));
            let area = mesh.face_area(f);
            if area > entry.0 {
                *entry = (area, map.iso_direction(mesh, f, axis));
            }
        }
    }
    for ((face, _), (_, direction)) in largest {
        if direction != DVec3::ZERO {
            model.graph.close_near(mask, FaceId(face), direction, EQUIVALENT);
        }
    }
}

/// The strip map of an arrangement. Without one only the spines of strips are masked.
fn strip_map(arrangement: &Arrangement, mesh: &TriMesh, progress: &Progress) -> Result<Option<StripMap>, Cancelled> {
    let curve = |e| match arrangement.refined.mark(mesh.halfedge(e).0) {
        Mark::Curve(c) => Some(c),
        _ => None,
    };
    let curves: Vec<Option<u32>> = mesh.edges().map(curve).collect();
    match StripMap::new(mesh, &curves, progress) {
        Ok(map) => Ok(Some(map)),
        Err(error) => {
            progress.check()?;
            tracing::warn!(%error, "no strip map");
            Ok(None)
        }
    }
}
