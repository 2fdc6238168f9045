//! The two meshes of a model: the design mesh, which is shown and written, and the woven mesh.
//!
//! Without a proxy they are the same mesh, and all maps are the identity. With a proxy, points picked on the design mesh map
//! to the proxy, strips map back as curves of the same homotopy class, and the layout is embedded on the design mesh if the
//! strips have the same layout there.

use glam::DVec3;

use crate::dual::{Arrangement, Region, Side, SideKind};
use crate::embed::Surface;
use crate::proxy::CurveTransferError;
use crate::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint, principal_curvature};
use crate::weave::model::Model;

/// The mesh that a layout is embedded on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshRole {
    /// The design mesh.
    Design,
    /// Its proxy.
    Proxy,
}

impl Model {
    /// One of the two meshes with the data that the embedding needs. For a design mesh with a proxy, and for the proxy's
    /// index, they are computed on first use.
    pub fn surface(&self, mesh_role: MeshRole) -> Surface<'_> {
        let (mesh, curvature, sharp) = (&*self.mesh, &self.curvature[..], &self.sharp[..]);
        match (mesh_role, &self.proxy) {
            (_, None) => Surface { mesh, index: &self.index, curvature, sharp },
            (MeshRole::Proxy, Some(_)) => {
                let index = self.design_data.proxy_index.get_or_init(|| SurfaceIndex::new(mesh));
                Surface { mesh, index, curvature, sharp }
            }
            (MeshRole::Design, Some(_)) => {
                let (mesh, sharp) = (&*self.loaded.mesh, &self.design_data.sharp[..]);
                let radius = self.options.curvature_radius;
                let curvature = self.design_data.curvature.get_or_init(|| principal_curvature(mesh, radius, sharp));
                Surface { mesh, index: &self.index, curvature, sharp }
            }
        }
    }

    /// The role of the woven mesh.
    pub fn woven_role(&self) -> MeshRole {
        if self.proxy.is_some() { MeshRole::Proxy } else { MeshRole::Design }
    }

    /// The point of the woven mesh for a point of the design mesh.
    pub fn to_woven(&self, at: SurfacePoint) -> SurfacePoint {
        self.proxy.as_ref().map_or(at, |proxy| proxy.to_proxy(&self.loaded.mesh, at))
    }

    /// The curve on the design mesh for a curve on the woven mesh.
    ///
    /// # Errors
    ///
    /// See [`CurveTransferError`].
    pub fn to_design(&self, curve: &SurfaceCurve) -> Result<SurfaceCurve, CurveTransferError> {
        match &self.proxy {
            Some(proxy) => proxy.curve_to_original(&self.loaded.mesh, curve),
            None => Ok(curve.clone()),
        }
    }

    /// Points on the design mesh along a curve on the woven mesh.
    pub fn on_design_mesh(&self, curve: &SurfaceCurve) -> Vec<DVec3> {
        let Some(proxy) = &self.proxy else { return curve.points(&self.mesh) };
        let original = &self.loaded.mesh;
        match proxy.curve_to_original(original, curve) {
            Ok(transferred) => transferred.points(original),
            // The curve may have no counterpart, but each of its points has.
            Err(_) => {
                let point = |i| proxy.to_original(original, curve.surface_point(&self.mesh, i)).position(original);
                (0..curve.crossings.len()).map(point).collect()
            }
        }
    }
}

/// A side of a region, described independently of the mesh: its kind (segment, ring, boundary) and its curve.
type SideLabel = (u8, u32);

/// Whether two arrangements of the same curves on two meshes have equally many crossings and the same regions: the same
/// Euler characteristics, and borders with the same sides in the same cyclic order.
pub(in crate::weave) fn same_regions(a: &Arrangement, b: &Arrangement) -> bool {
    a.crossings.len() == b.crossings.len() && a.regions.len() == b.regions.len() && region_labels(a) == region_labels(b)
}

/// The Euler characteristic of every region and the labels of the sides of its borders, sorted.
fn region_labels(arrangement: &Arrangement) -> Vec<(i64, Vec<Vec<SideLabel>>)> {
    let side = |s: &Side| match s.kind {
        SideKind::Segment { segment, .. } => (0, arrangement.segments[segment as usize].curve),
        SideKind::Ring { segment } => (1, arrangement.segments[segment as usize].curve),
        SideKind::Boundary => (2, 0),
    };
    let region = |r: &Region| {
        let mut borders: Vec<Vec<SideLabel>> =
            r.borders.iter().map(|b| least_rotation(b.iter().map(side).collect())).collect();
        borders.sort_unstable();
        (r.euler, borders)
    };
    let mut all: Vec<_> = arrangement.regions.iter().map(region).collect();
    all.sort_unstable();
    all
}

/// The lexicographically least rotation of a cycle.
fn least_rotation(cycle: Vec<SideLabel>) -> Vec<SideLabel> {
    let rotated = |k: usize| [&cycle[k..], &cycle[..k]].concat();
    (0..cycle.len()).map(rotated).min().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{column, row, torus};

    #[test]
    fn borders_are_compared_by_their_cyclic_order() {
        assert_eq!(least_rotation(vec![(1, 2), (0, 5), (0, 3)]), [(0, 3), (1, 2), (0, 5)]);
        assert_eq!(least_rotation(Vec::new()), []);
    }

    #[test]
    fn the_same_curves_on_another_mesh_have_the_same_regions_and_others_have_not() {
        let on = |n: u32, m: u32, rows: &[u32]| {
            let mut curves: Vec<_> = rows.iter().map(|&j| row(n, j, true, 0.4)).collect();
            curves.push(column(n, m, 1, true, 0.6));
            Arrangement::new(&torus(n, m), &curves).unwrap()
        };
        assert!(same_regions(&on(8, 6, &[1, 4]), &on(10, 9, &[2, 6])));
        assert!(!same_regions(&on(8, 6, &[1, 4]), &on(8, 6, &[1])));
    }
}
