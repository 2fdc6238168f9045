//! Where the triangles of the design mesh lie in the arrangement of strips on the proxy.

use glam::DVec3;
use rayon::prelude::*;

use crate::dual::RefinedMesh;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::{SurfacePoint, barycentric};
use crate::weave::model::Model;
use crate::weave::woven::Woven;

impl Model {
    /// The point of the woven mesh at the barycentre of each triangle of the design mesh.
    pub fn woven_face_points(&self) -> Vec<SurfacePoint> {
        let barycentre = |face| self.to_woven(SurfacePoint { face, weights: [1.0 / 3.0; 3] });
        (0..self.loaded.mesh.n_faces()).into_par_iter().map(|f| barycentre(FaceId::new(f))).collect()
    }
}

impl Woven {
    /// A point in the middle of a region: of the barycentres of its faces the one nearest to their mean.
    pub fn region_centre(&self, region: usize) -> Option<DVec3> {
        let arrangement = &self.arrangement;
        let faces = &arrangement.regions.get(region)?.faces;
        let middle = |f: u32| {
            arrangement.refined.corners(f).map(|v| arrangement.refined.positions[v as usize]).iter().sum::<DVec3>()
                / 3.0
        };
        let mean = faces.iter().map(|&f| middle(f)).sum::<DVec3>() / faces.len().max(1) as f64;
        let nearest = |&a: &DVec3, &b: &DVec3| a.distance_squared(mean).total_cmp(&b.distance_squared(mean));
        faces.iter().map(|&f| middle(f)).min_by(nearest)
    }
}

/// The faces of a refined mesh by the triangle of the base mesh that they are part of.
#[derive(Debug)]
pub struct FacePieces {
    /// First entry of `faces` for each base triangle, and one past the last.
    first: Vec<u32>,
    faces: Vec<u32>,
}

impl FacePieces {
    /// Sorts the faces of `refined`, a refinement of a mesh of `n_faces` triangles.
    pub fn new(refined: &RefinedMesh, n_faces: usize) -> Self {
        let mut first = vec![0u32; n_faces + 1];
        let all = 0..refined.n_faces() as u32;
        all.clone().for_each(|f| first[refined.base_face(f) as usize + 1] += 1);
        for f in 0..n_faces {
            first[f + 1] += first[f];
        }
        let mut next = first.clone();
        let mut faces = vec![0; refined.n_faces()];
        for f in all {
            let base = refined.base_face(f) as usize;
            faces[next[base] as usize] = f;
            next[base] += 1;
        }
        Self { first, faces }
    }

    /// The refined face that a point of the base `mesh` lies in; at a border, the one it lies deepest in.
    pub fn at(&self, refined: &RefinedMesh, mesh: &TriMesh, point: &SurfacePoint) -> u32 {
        let base = point.face.index();
        let pieces = &self.faces[self.first[base] as usize..self.first[base + 1] as usize];
        if let [only] = pieces {
            return *only;
        }
        let p = point.position(mesh);
        let depth = |f: u32| barycentric(refined_corners(refined, f), p).into_iter().fold(f64::INFINITY, f64::min);
        pieces.iter().copied().max_by(|&f, &g| depth(f).total_cmp(&depth(g))).unwrap_or(0)
    }
}

/// The positions of the corners of a refined face.
pub fn refined_corners(refined: &RefinedMesh, f: u32) -> [DVec3; 3] {
    refined.corners(f).map(|v| refined.positions[v as usize])
}
