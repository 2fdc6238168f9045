//! What the placed strips make of the surface: arrangement, assessment, strip map, directions still open.

use super::design::Strip;
use super::model::Model;
use super::session::WeaveError;
use crate::dual::{Arrangement, Colour, RegionReport, assess};
use crate::elastica::DirectionMask;
use crate::progress::Progress;

/// Strips within this angle of a placed one's isolines are equivalent to it (Campen, section 8.2.2).
const COMPATIBLE: f64 = std::f64::consts::FRAC_PI_4;

/// Everything derived from a model and its placed strips.
#[derive(Debug)]
pub struct Woven {
    /// The arrangement of all strips' spines.
    pub arrangement: Arrangement,
    /// The assessment of every region.
    pub reports: Vec<RegionReport>,
    /// Directions in which no further strip may run.
    pub mask: DirectionMask,
}

impl Woven {
    /// Derives everything.
    ///
    /// # Errors
    ///
    /// A strip that does not lie on the mesh, or [`WeaveError::Cancelled`].
    pub fn new(model: &Model, strips: &[Strip], progress: &Progress) -> Result<Self, WeaveError> {
        let arrangement = Arrangement::new(&model.mesh, strips.iter().map(|s| &s.curve))?;
        progress.check()?;
        let reports = assess(&arrangement, &model.mesh, &model.corners);
        let mut mask = DirectionMask::none();
        for strip in strips {
            close_along(model, strip, &mut mask);
        }
        Ok(Self { arrangement, reports, mask })
    }

    /// The regions that cannot be nodes yet.
    pub fn red(&self) -> Vec<u32> {
        let red = |r: &(usize, &RegionReport)| r.1.colour == Colour::Red;
        self.reports.iter().enumerate().filter(red).map(|(i, _)| i as u32).collect()
    }

    /// Number of regions of a colour.
    pub fn count(&self, colour: Colour) -> usize {
        self.reports.iter().filter(|r| r.colour == colour).count()
    }
}

/// Closes the directions along a strip's spine in the triangles it passes.
fn close_along(model: &Model, strip: &Strip, mask: &mut DirectionMask) {
    let (mesh, curve) = (&model.mesh, &strip.curve);
    let n = curve.crossings.len();
    for i in usize::from(!curve.closed)..n {
        let Some(face) = curve.face_before(mesh, i) else { continue };
        let direction = curve.point(mesh, i) - curve.point(mesh, (i + n - 1) % n);
        model.graph.disable_near(mask, face, direction, COMPATIBLE);
    }
}
