//! Transfer of curves from the proxy to the original and back.
//!
//! The curve, or its image on the proxy, is a guide; the result is traced along it on the other mesh ([`CurveWalk`]).
//! Where that fails for a closed polyline, the triangles at its points are joined by shortest dual paths
//! ([`face_path_curve`]).

use glam::DVec3;

use super::curve_walk::{CurveTransferError, CurveWalk};
use super::face_path::{face_path_curve, subdivided};
use super::guide::Guide;
use super::map::Proxy;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::{SurfaceCurve, SurfacePoint, nearest_in_triangle};

impl Proxy {
    /// The curve on the original that corresponds to `curve` on the proxy. It is homotopic to it, and closed or from
    /// boundary to boundary like it. It turns at the proxy's edges; [`relax`](crate::surface::relax) smooths it.
    ///
    /// # Errors
    ///
    /// [`CurveTransferError`]: the curve does not lie on the proxy, or the original is too rough along it.
    pub fn curve_to_original(
        &self,
        original: &TriMesh,
        curve: &SurfaceCurve,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        curve.check(self.mesh())?;
        self.trace_on_original(original, &Guide::of_curve(self.mesh(), curve))
    }

    /// As [`Self::curve_to_original`] for a polyline on the proxy: its points, each with the face of the segment to the
    /// next one, from boundary to boundary unless it is closed.
    ///
    /// # Errors
    ///
    /// [`CurveTransferError`]: the original is too rough along the polyline, or the polyline has fewer than two points.
    pub fn polyline_to_original(
        &self,
        original: &TriMesh,
        line: &[(DVec3, FaceId)],
        closed: bool,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        if line.len() < 2 {
            return Err(CurveTransferError::NoStrip);
        }
        let guide = Guide::of_polyline(self.mesh(), line, closed);
        self.trace_on_original(original, &guide).or_else(|error| {
            let images: Vec<SurfacePoint> =
                subdivided(self.mesh(), line).map(|p| self.to_original(original, p)).collect();
            if closed { face_path_curve(original, &images).ok_or(error) } else { Err(error) }
        })
    }

    /// The curve on the proxy that corresponds to `curve` on the original; the inverse of [`Self::curve_to_original`].
    ///
    /// # Errors
    ///
    /// [`CurveTransferError`]: the curve does not lie on the original, or is smaller than the triangles of the proxy.
    pub fn curve_to_proxy(&self, original: &TriMesh, curve: &SurfaceCurve) -> Result<SurfaceCurve, CurveTransferError> {
        curve.check(original)?;
        let points = (0..curve.crossings.len()).map(|i| curve.surface_point(original, i));
        self.trace_on_proxy(&Guide::of_image(self, original, points, curve.closed))
    }

    /// As [`Self::curve_to_proxy`] for a polyline on the original, given as for [`Self::polyline_to_original`].
    ///
    /// # Errors
    ///
    /// [`CurveTransferError`]: the polyline is smaller than the triangles of the proxy, or has fewer than two points.
    pub fn polyline_to_proxy(
        &self,
        original: &TriMesh,
        line: &[(DVec3, FaceId)],
        closed: bool,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        if line.len() < 2 {
            return Err(CurveTransferError::NoStrip);
        }
        let point = |&(p, face): &(DVec3, FaceId)| {
            let corners = original.face_vertices(face).map(|v| original.position(v));
            SurfacePoint { face, weights: nearest_in_triangle(p, &corners) }
        };
        let guide = Guide::of_image(self, original, line.iter().map(point), closed);
        self.trace_on_proxy(&guide).or_else(|error| {
            let images: Vec<SurfacePoint> = line.iter().map(|p| self.to_proxy(original, point(p))).collect();
            if closed { face_path_curve(self.mesh(), &images).ok_or(error) } else { Err(error) }
        })
    }

    fn trace_on_original(&self, original: &TriMesh, guide: &Guide) -> Result<SurfaceCurve, CurveTransferError> {
        let walk = CurveWalk { mesh: original, positions: self.image_positions(), guide };
        walk.trace(self, |point| self.to_original(original, point).face)
    }

    fn trace_on_proxy(&self, guide: &Guide) -> Result<SurfaceCurve, CurveTransferError> {
        let walk = CurveWalk { mesh: self.mesh(), positions: self.mesh().positions(), guide };
        walk.trace(self, |point| point.face)
    }
}
