//! Two meshes for one design: the one that is shown and written, and the one that is woven on.
//!
//! Where a model has no proxy they are the same, and nothing here costs anything. A point of the designer's goes to the
//! proxy, a strip comes back to the mesh as a curve of the same class, and the layout is embedded on the mesh itself, if
//! the strips make the same layout there.

use glam::DVec3;

use crate::dual::{Arrangement, Region, Side, SideKind};
use crate::embed::Surface;
use crate::proxy::CurveTransferError;
use crate::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint, principal_curvature};
use crate::weave::model::Model;

/// The mesh that a layout is drawn and embedded on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshRole {
    /// That of the design.
    Design,
    /// The proxy that stands for it.
    Proxy,
}

impl Model {
    /// One of the two meshes with what the embedding needs of it; of a mesh with a proxy this is made when it is first
    /// asked for.
    pub fn surface(&self, mesh_role: MeshRole) -> Surface<'_> {
        let (mesh, curvature, sharp) = (&*self.mesh, &self.curvature[..], &self.sharp[..]);
        match (mesh_role, &self.proxy) {
            (_, None) => Surface { mesh, index: &self.index, curvature, sharp },
            (MeshRole::Proxy, Some(_)) => {
                let index = self.own.proxy_index.get_or_init(|| SurfaceIndex::new(mesh));
                Surface { mesh, index, curvature, sharp }
            }
            (MeshRole::Design, Some(_)) => {
                let (mesh, sharp) = (&*self.loaded.mesh, &self.own.sharp[..]);
                let radius = self.options.curvature_radius;
                let curvature = self.own.curvature.get_or_init(|| principal_curvature(mesh, radius, sharp));
                Surface { mesh, index: &self.index, curvature, sharp }
            }
        }
    }

    /// The point of the mesh that is woven on for a point of the design's mesh.
    pub fn to_woven(&self, at: SurfacePoint) -> SurfacePoint {
        self.proxy.as_ref().map_or(at, |proxy| proxy.to_proxy(&self.loaded.mesh, at))
    }

    /// The curve on the design's mesh for a curve on the one that is woven on.
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

    /// A curve on the mesh that is woven on as points in space on the design's mesh.
    pub fn on_design_mesh(&self, curve: &SurfaceCurve) -> Vec<DVec3> {
        let Some(proxy) = &self.proxy else { return curve.points(&self.mesh) };
        let original = &self.loaded.mesh;
        match proxy.curve_to_original(original, curve) {
            Ok(carried) => carried.points(original),
            // Where it has no counterpart, its points still have.
            Err(_) => {
                let point = |i| proxy.to_original(original, curve.surface_point(&self.mesh, i)).position(original);
                (0..curve.crossings.len()).map(point).collect()
            }
        }
    }
}

/// A side of a region, whatever mesh it is drawn on: the curve it belongs to, and whether it is passed forward.
type Name = (u8, u32);

/// Whether two arrangements of the same curves, on two meshes, have the same regions with the same sides in order.
pub(in crate::weave) fn alike(a: &Arrangement, b: &Arrangement) -> bool {
    a.crossings.len() == b.crossings.len() && a.regions.len() == b.regions.len() && names(a) == names(b)
}

/// Every region by its Euler characteristic and the names of the sides of its borders, in an order of their own.
fn names(arrangement: &Arrangement) -> Vec<(i64, Vec<Vec<Name>>)> {
    let side = |s: &Side| match s.kind {
        SideKind::Segment { segment, .. } => (0, arrangement.segments[segment as usize].curve),
        SideKind::Ring { segment } => (1, arrangement.segments[segment as usize].curve),
        SideKind::Boundary => (2, 0),
    };
    let region = |r: &Region| {
        let mut borders: Vec<Vec<Name>> = r.borders.iter().map(|b| first_turn(b.iter().map(side).collect())).collect();
        borders.sort_unstable();
        (r.euler, borders)
    };
    let mut all: Vec<_> = arrangement.regions.iter().map(region).collect();
    all.sort_unstable();
    all
}

/// Of all turns of a cycle the one that comes first.
fn first_turn(cycle: Vec<Name>) -> Vec<Name> {
    let turned = |k: usize| [&cycle[k..], &cycle[..k]].concat();
    (0..cycle.len()).map(turned).min().unwrap_or_default()
}
