//! Display of a design whose strips are woven on a proxy.
//!
//! The barycentre of each triangle of the design mesh is mapped to the proxy. The triangle takes the region and the
//! stripes of the refined face that contains this point. Borders of regions are therefore as fine as the triangles of
//! the design mesh; these are smaller than those of the proxy. The distances of its corners from a spine are those of
//! their own images, so that lines continue from triangle to triangle.

use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::RefinedMesh;
use plait_core::mesh::VertexId;
use plait_core::proxy::Proxy;
use plait_core::surface::{SurfacePoint, barycentric};
use plait_core::weave::{FacePieces, Model, Session, refined_corners};
use rayon::prelude::*;

use super::remarks;
use super::stripes::{Pattern, transferred};
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
        if let Some(pattern) = Pattern::of(session) {
            let images = |v: usize| pieces.at(refined, &model.mesh, &proxy.image(VertexId::new(v)));
            let corner_piece: Vec<u32> = (0..surface.positions.len()).into_par_iter().map(images).collect();
            let pattern = Transfer { pattern, refined, proxy, corner_piece };
            let faces = piece.par_iter().zip(self.surface.faces.par_iter());
            surface.stripes = faces.map(|(&f, &corners)| pattern.on_triangle(f, corners)).collect();
        }
        surface
    }
}

/// The pattern on the refined mesh, and what transfers it to the design mesh.
struct Transfer<'a> {
    pattern: Pattern,
    refined: &'a RefinedMesh,
    proxy: &'a Proxy,
    /// The refined face under each vertex of the design mesh.
    corner_piece: Vec<u32>,
}

impl Transfer<'_> {
    /// The stripes of a triangle of the design mesh with these `corners`, whose middle lies over the refined face `f`.
    fn on_triangle(&self, f: u32, corners: [u32; 3]) -> [Option<Stripes>; 2] {
        let weights = |f: u32, i: usize| {
            let image = self.proxy.image_positions()[corners[i] as usize];
            barycentric(refined_corners(self.refined, f), image)
        };
        let corner = |i: usize| {
            let piece = self.corner_piece[corners[i] as usize];
            (self.pattern.stripes[piece as usize], weights(piece, i))
        };
        self.pattern.stripes[f as usize].map(|s| Some(transferred(&s?, corner, |i| weights(f, i))))
    }
}
