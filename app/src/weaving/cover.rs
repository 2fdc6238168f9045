//! The mesh of a design, in the colours of what is woven on its proxy.
//!
//! Each triangle is laid onto the proxy and takes the region and the stripes of the piece of the arrangement that its
//! middle falls into. The mesh is finer than the proxy, so its own triangles draw the borders finely enough.

use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::RefinedMesh;
use plait_core::mesh::{FaceId, TriMesh};
use plait_core::proxy::Proxy;
use plait_core::strip::StripMap;
use plait_core::surface::SurfacePoint;
use plait_core::weave::{Model, Session};
use rayon::prelude::*;

use super::{stripes, words};
use crate::engine::{DisplaySurface, RegionColour, Stripes};

/// What of the display stays the same while strips come and go.
pub struct Cover {
    /// The mesh as it is drawn, without colours.
    plain: DisplaySurface,
    /// Where the middle of each triangle lies on the proxy.
    middles: Vec<SurfacePoint>,
}

/// Where the middle of each triangle of the design's mesh lies on the mesh that is woven on.
pub fn faces(model: &Model) -> Vec<SurfacePoint> {
    let middle = |face| model.to_woven(SurfacePoint { face, weights: [1.0 / 3.0; 3] });
    (0..model.loaded.mesh.n_faces()).into_par_iter().map(|f| middle(FaceId::new(f))).collect()
}

impl Cover {
    /// `normals` are those at the corners of the triangles of the design's mesh.
    pub fn new(model: &Model, triangles: Vec<[u32; 3]>, normals: Vec<[DVec3; 3]>) -> Self {
        let plain = DisplaySurface {
            positions: Arc::new(model.loaded.mesh.positions().to_vec()),
            base: Arc::new((0..triangles.len() as u32).collect()),
            faces: Arc::new(triangles),
            normals: Arc::new(normals),
            ..DisplaySurface::default()
        };
        Self { plain, middles: faces(model) }
    }

    /// The mesh in the present colours.
    pub fn surface(&self, session: &Session, proxy: &Proxy) -> DisplaySurface {
        let (model, woven, strips) = (session.model(), session.woven(), &session.design().strips);
        let mut surface = self.plain.clone();
        if strips.is_empty() {
            return surface;
        }
        let refined = &woven.arrangement.refined;
        let pieces = Pieces::new(refined, model.mesh.n_faces());
        let piece: Vec<u32> = self.middles.par_iter().map(|p| pieces.at(refined, &model.mesh, p)).collect();
        let colors: Vec<RegionColour> = woven.reports.iter().map(|r| words::color(r.colour)).collect();
        let color = |&f: &u32| colors[woven.arrangement.region_of_face[f as usize] as usize];
        surface.regions = piece.par_iter().map(color).collect();
        if let Some(map) = &woven.strip_map {
            let visible = |curve: u32| strips.get(curve as usize).is_some_and(|s| s.visible);
            let pattern = |(&f, corners): (&u32, &[u32; 3])| {
                pattern(map, refined, f, corners.map(|v| proxy.image_positions()[v as usize]), visible)
            };
            surface.stripes = piece.par_iter().zip(self.plain.faces.par_iter()).map(pattern).collect();
        }
        surface
    }
}

/// The pieces that the arrangement cuts each triangle of the proxy into.
struct Pieces {
    first: Vec<u32>,
    list: Vec<u32>,
}

impl Pieces {
    fn new(refined: &RefinedMesh, n_faces: usize) -> Self {
        let mut first = vec![0u32; n_faces + 1];
        let faces = 0..refined.n_faces() as u32;
        faces.clone().for_each(|f| first[refined.base_face(f) as usize + 1] += 1);
        for f in 0..n_faces {
            first[f + 1] += first[f];
        }
        let mut next = first.clone();
        let mut list = vec![0; refined.n_faces()];
        for f in faces {
            let base = refined.base_face(f) as usize;
            list[next[base] as usize] = f;
            next[base] += 1;
        }
        Self { first, list }
    }

    /// The piece that a point of the proxy lies in.
    fn at(&self, refined: &RefinedMesh, mesh: &TriMesh, point: &SurfacePoint) -> u32 {
        let base = point.face.index();
        let pieces = &self.list[self.first[base] as usize..self.first[base + 1] as usize];
        if let [only] = pieces {
            return *only;
        }
        let p = point.position(mesh);
        let inside = |f: u32| barycentric(corners(refined, f), p).into_iter().fold(f64::INFINITY, f64::min);
        pieces.iter().copied().max_by(|&f, &g| inside(f).total_cmp(&inside(g))).unwrap_or(0)
    }
}

fn corners(refined: &RefinedMesh, f: u32) -> [DVec3; 3] {
    refined.corners(f).map(|v| refined.positions[v as usize])
}

/// The stripes of a piece continued to a triangle of the design's mesh with these places on the proxy.
fn pattern(
    map: &StripMap,
    refined: &RefinedMesh,
    f: u32,
    places: [DVec3; 3],
    visible: impl Fn(u32) -> bool,
) -> [Option<Stripes>; 2] {
    [0, 1].map(|k| {
        let (strip, distance) = stripes::covering(map, f as usize, k, &visible)?;
        let piece = corners(refined, f);
        let at = |p: DVec3| barycentric(piece, p).into_iter().zip(distance).map(|(w, d)| w * d).sum();
        Some(stripes::stripes(strip, places.map(at)))
    })
}

/// The barycentric coordinates of the point of a triangle's plane nearest to `p`, negative outside the triangle.
fn barycentric(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let whole = normal.length_squared();
    if whole <= 0.0 {
        return [1.0 / 3.0; 3];
    }
    let part = |i: usize| (corners[(i + 1) % 3] - p).cross(corners[(i + 2) % 3] - p).dot(normal) / whole;
    [part(0), part(1), part(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_go_on_beyond_the_triangle() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 0.9, 0.4)];
        let wanted = [0.7, 0.6, -0.3];
        let p: DVec3 = corners.into_iter().zip(wanted).map(|(c, w)| c * w).sum();
        let found = barycentric(corners, p);
        assert!((0..3).all(|i| (found[i] - wanted[i]).abs() < 1e-12), "{found:?}");
    }
}
