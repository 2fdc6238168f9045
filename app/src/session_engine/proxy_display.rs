//! Display of a design whose strips are woven on a proxy.
//!
//! The barycentre of each triangle of the design mesh is mapped to the proxy. The triangle takes the region and the
//! stripes of the refined face that contains this point. Borders of regions are therefore as fine as the triangles of
//! the design mesh; these are smaller than those of the proxy.

use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::RefinedMesh;
use plait_core::proxy::Proxy;
use plait_core::strip::StripMap;
use plait_core::surface::{SurfacePoint, barycentric};
use plait_core::weave::{FacePieces, Model, Session, refined_corners};
use rayon::prelude::*;

use super::{remarks, stripes};
use crate::engine::{DisplaySurface, RegionColour, Stripes};

/// The part of the display that does not depend on the strips.
pub(super) struct ProxyDisplay {
    /// The design mesh without colours and stripes.
    surface: DisplaySurface,
    /// The point of the proxy under the barycentre of each triangle.
    proxy_points: Vec<SurfacePoint>,
}

impl ProxyDisplay {
    /// Triangles of the design mesh, with normals at their corners.
    pub(super) fn new(model: &Model, triangles: Vec<[u32; 3]>, normals: Vec<[DVec3; 3]>) -> Self {
        let surface = DisplaySurface {
            positions: Arc::new(model.loaded.mesh.positions().to_vec()),
            base: Arc::new((0..triangles.len() as u32).collect()),
            faces: Arc::new(triangles),
            normals: Arc::new(normals),
            ..DisplaySurface::default()
        };
        Self { surface, proxy_points: model.woven_face_points() }
    }

    /// The design mesh with the colours and stripes of the present strips.
    pub(super) fn surface(&self, session: &Session, proxy: &Proxy) -> DisplaySurface {
        let (model, woven, strips) = (session.model(), session.woven(), &session.design().strips);
        let mut surface = self.surface.clone();
        if strips.is_empty() {
            return surface;
        }
        let refined = &woven.arrangement.refined;
        let pieces = FacePieces::new(refined, model.mesh.n_faces());
        let piece: Vec<u32> = self.proxy_points.par_iter().map(|p| pieces.at(refined, &model.mesh, p)).collect();
        let colours: Vec<RegionColour> = woven.reports.iter().map(|r| remarks::region_colour(r.colour)).collect();
        let colour = |&f: &u32| colours[woven.arrangement.region_of_face[f as usize] as usize];
        surface.regions = piece.par_iter().map(colour).collect();
        if let Some(map) = &woven.strip_map {
            let visible = |curve: u32| strips.get(curve as usize).is_some_and(|s| s.visible);
            let pattern = |(&f, corners): (&u32, &[u32; 3])| {
                extended_stripes(map, refined, f, corners.map(|v| proxy.image_positions()[v as usize]), visible)
            };
            surface.stripes = piece.par_iter().zip(self.surface.faces.par_iter()).map(pattern).collect();
        }
        surface
    }
}

/// The stripes of a refined face, extended linearly to a triangle of the design mesh whose corners have these `images`
/// on the proxy.
fn extended_stripes(
    map: &StripMap,
    refined: &RefinedMesh,
    f: u32,
    images: [DVec3; 3],
    visible: impl Fn(u32) -> bool,
) -> [Option<Stripes>; 2] {
    [0, 1].map(|k| {
        let (strip, distance) = stripes::covering_strip(map, f as usize, k, &visible)?;
        let corners = refined_corners(refined, f);
        let at = |p: DVec3| barycentric(corners, p).into_iter().zip(distance).map(|(w, d)| w * d).sum();
        Some(stripes::stripes(strip, images.map(at)))
    })
}
