//! Refinement of a layout to a quad mesh (Campen, section 6.7): `m × n` quads per patch.
//!
//! The isolines are those of the patch's two chords ([`Spacing`]), so patches agree along their common arcs.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::quad_mesh::QuadMesh;
use super::spacing::Spacing;
use crate::layout::{Embedding, PatchMap, QuadLayout};

/// Refines every patch to the grid of the isolines along its two chords.
pub fn refine(layout: &QuadLayout, embedding: &Embedding, maps: &[PatchMap], spacing: &Spacing) -> QuadMesh {
    let position = |v: u32| embedding.mesh.positions[v as usize];
    let face_at = |v: u32| embedding.base_face[(embedding.mesh.outgoing(v)[0] / 3) as usize];
    let mut out = QuadMesh {
        positions: embedding.nodes.iter().map(|&v| position(v)).collect(),
        base_face: embedding.nodes.iter().map(|&v| face_at(v)).collect(),
        boundary: layout.nodes.iter().map(|n| n.boundary).collect(),
        quads: Vec::new(),
        patch: Vec::new(),
        n_nodes: layout.nodes.len(),
        arcs: Vec::with_capacity(layout.arcs.len()),
    };
    let mut first_on_arc = Vec::with_capacity(layout.arcs.len());
    for (a, arc) in (0..).zip(&layout.arcs) {
        let (path, along) = (&embedding.arcs[a as usize], &embedding.arc_parameters[a as usize]);
        first_on_arc.push(out.positions.len() as u32);
        for (at, v) in points_on_path(path, along, &spacing.along(a, true), position) {
            out.positions.push(at);
            out.base_face.push(face_at(v));
            out.boundary.push(arc.boundary);
        }
        let inner = first_on_arc[first_on_arc.len() - 1]..out.positions.len() as u32;
        out.arcs.push([arc.nodes[0]].into_iter().chain(inner).chain([arc.nodes[1]]).collect());
    }
    for (p, map) in maps.iter().enumerate() {
        let isolines = [0, 1].map(|i| {
            let (arc, forward) = layout.patches[p].sides[i];
            spacing.along(arc, forward)
        });
        let [m, n] = isolines.each_ref().map(|lines| lines.len() as u32 + 1);
        let ids = grid_ids(layout, p, (m, n), &first_on_arc, out.positions.len() as u32);
        add_patch(&mut out, p, map, &isolines, &ids);
    }
    out
}

/// Adds the inner vertices and the quads of patch `p`; `ids` are the vertices of its grid, and `isolines` the
/// parameters of its inner columns and rows, as fractions.
fn add_patch(
    out: &mut QuadMesh,
    p: usize,
    map: &PatchMap,
    [across, up]: &[Vec<f64>; 2],
    ids: &HashMap<(u32, u32), u32>,
) {
    let inner: Vec<DVec2> = up.iter().flat_map(|&v| across.iter().map(move |&u| map.size * DVec2::new(u, v))).collect();
    for (at, f) in map.locate(&inner) {
        out.positions.push(at);
        out.base_face.push(f);
        out.boundary.push(false);
    }
    for j in 0..=up.len() as u32 {
        for i in 0..=across.len() as u32 {
            out.quads.push([(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|c| ids[&c]));
            out.patch.push(p as u32);
        }
    }
}

/// The points of a vertex path at some fractions of its total parameter, each with the nearer vertex of its edge.
/// `along` is the parameter at each vertex.
fn points_on_path(
    path: &[u32],
    along: &[f64],
    fractions: &[f64],
    position: impl Fn(u32) -> DVec3,
) -> Vec<(DVec3, u32)> {
    let total = along[along.len() - 1];
    let mut k = 0;
    fractions
        .iter()
        .map(|fraction| {
            let s = total * fraction;
            while k + 2 < path.len() && along[k + 1] < s {
                k += 1;
            }
            let t = ((s - along[k]) / (along[k + 1] - along[k])).clamp(0.0, 1.0);
            (position(path[k]).lerp(position(path[k + 1]), t), path[if t < 0.5 { k } else { k + 1 }])
        })
        .collect()
}

/// Vertex ids of the grid of patch `p`, by column and row. Inner vertices are numbered from `first_inner` on, row by
/// row.
fn grid_ids(
    layout: &QuadLayout,
    p: usize,
    (m, n): (u32, u32),
    first_on_arc: &[u32],
    first_inner: u32,
) -> HashMap<(u32, u32), u32> {
    let patch = &layout.patches[p];
    let mut ids = HashMap::new();
    for j in 1..n {
        for i in 1..m {
            ids.insert((i, j), first_inner + (j - 1) * (m - 1) + i - 1);
        }
    }
    for (k, &(arc, forward)) in patch.sides.iter().enumerate() {
        let count = if k % 2 == 0 { m } else { n };
        for s in 0..count {
            // The grid point at step `s` from corner `k`, counter-clockwise around the patch.
            let cell = [(s, 0), (m, s), (m - s.min(m), n), (0, n - s.min(n))][k];
            let id = if s == 0 {
                patch.corners[k]
            } else {
                first_on_arc[arc as usize] + if forward { s - 1 } else { count - 1 - s }
            };
            ids.insert(cell, id);
        }
    }
    ids
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::super::adaptive_spacing::resampling_error;
    use super::super::smooth::project;
    use super::*;
    use crate::dual::{Arrangement, Colour, assess, vertex_curvatures};
    use crate::layout::{initial_embedding, map_patches};
    use crate::mesh::TriMesh;
    use crate::progress::Progress;
    use crate::surface::SurfaceCurve;
    use crate::testing::{column, row, square, torus};

    fn quads(mesh: &TriMesh, curves: &[SurfaceCurve], target: f64) -> (QuadLayout, QuadMesh) {
        quads_for_curvature(mesh, curves, target, |_, _| 0.0)
    }

    fn quads_for_curvature(
        mesh: &TriMesh,
        curves: &[SurfaceCurve],
        target: f64,
        curvature: impl Fn(u32, DVec3) -> f64,
    ) -> (QuadLayout, QuadMesh) {
        let (layout, embedding, maps) = mapped(mesh, curves);
        let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
        let whole: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
        assert!((area - whole).abs() < 1e-9 * whole, "the patches cover the surface once");
        let spacing = Spacing::curvature_adapted(&layout, &maps, curvature, whole / (target * target));
        let mesh = refine(&layout, &embedding, &maps, &spacing);
        (layout, mesh)
    }

    /// The layout dual to some curves, with its initial embedding and patch maps.
    fn mapped(mesh: &TriMesh, curves: &[SurfaceCurve]) -> (QuadLayout, Embedding, Vec<PatchMap>) {
        let arrangement = Arrangement::new(mesh, curves).unwrap();
        let reports = assess(&arrangement, &vertex_curvatures(mesh), &[]);
        assert!(reports.iter().all(|r| r.colour != Colour::Red), "{reports:?}");
        let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
        let progress = Progress::new();
        let embedding = initial_embedding(&arrangement, &layout, &vec![None; layout.nodes.len()], &progress).unwrap();
        let maps = map_patches(&layout, &embedding, &progress).unwrap();
        assert!(maps.iter().all(|m| m.flipped == 0));
        (layout, embedding, maps)
    }

    /// Euler characteristic of an all-quad mesh; panics if it is not an oriented manifold.
    fn euler(q: &QuadMesh) -> i64 {
        let triangles: Vec<[u32; 3]> = q.quads.iter().flat_map(|c| [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).collect();
        TriMesh::from_faces(q.positions.clone(), &triangles).unwrap().euler_characteristic()
    }

    static TORUS: LazyLock<TriMesh> = LazyLock::new(|| torus(64, 32));
    static TORUS_PATCH: LazyLock<(QuadLayout, Embedding, Vec<PatchMap>)> =
        LazyLock::new(|| mapped(&TORUS, &[row(64, 8, true, 0.4), column(64, 32, 14, true, 0.7)]));

    /// A torus of one patch refined to `m × n` quads, projected onto it.
    fn resampled(counts: [u32; 2]) -> QuadMesh {
        let (layout, embedding, maps) = &*TORUS_PATCH;
        let mut quads = refine(layout, embedding, maps, &Spacing::even(layout, &counts));
        project(&mut quads, &TORUS);
        quads
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn resampling_gives_a_manifold_of_the_requested_size_and_refinement_halves_the_error(
            m in 6u32..14, n in 6u32..14,
        ) {
            let quads = resampled([m, n]);
            prop_assert_eq!(quads.quads.len() as u32, m * n);
            prop_assert_eq!(quads.positions.len(), quads.base_face.len());
            prop_assert_eq!(euler(&quads), 0);
            for (p, &f) in quads.positions.iter().zip(&quads.base_face) {
                let corners = TORUS.face_vertices(crate::mesh::FaceId(f)).map(|v| TORUS.position(v));
                let weights = crate::surface::nearest_in_triangle(*p, &corners);
                let nearest: DVec3 = corners.iter().zip(weights).map(|(&c, w)| c * w).sum();
                prop_assert!(nearest.distance(*p) < 1e-9);
            }
            // The error is quadratic in the edge length: with half of it a quarter in the limit, at most half here.
            let (coarse, fine) = (resampling_error(&quads, &TORUS), resampling_error(&resampled([2 * m, 2 * n]), &TORUS));
            prop_assert!(fine < 0.5 * coarse, "{} {}", coarse, fine);
        }
    }

    #[test]
    fn a_torus_with_two_loops_is_one_patch() {
        let (layout, q) = quads(&torus(24, 12), &[row(24, 3, true, 0.4), column(24, 12, 5, true, 0.7)], 0.05);
        assert_eq!((layout.nodes.len(), layout.arcs.len(), layout.patches.len()), (1, 2, 1));
        assert_eq!(layout.n_irregular(), 0);
        assert_eq!(euler(&q), 0);
    }

    #[test]
    fn a_square_with_two_curves_is_one_patch_with_its_corners() {
        let (layout, q) = quads(&square(8), &[row(8, 2, false, 0.5), column(8, 8, 3, false, 0.5)], 0.1);
        assert_eq!((layout.nodes.len(), layout.patches.len()), (4, 1));
        assert_eq!(euler(&q), 1);
        for corner in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y] {
            assert!(q.positions[..4].iter().any(|p| p.distance(corner) < 1e-12));
        }
        let side: f64 = 1.0 / (q.quads.len() as f64).sqrt();
        for c in &q.quads {
            let [a, b] = [0, 1].map(|i| q.positions[c[i] as usize]);
            assert!((a.distance(b) - side).abs() < 1e-6);
        }
    }

    #[test]
    fn many_loops_make_a_regular_grid() {
        let mut curves = Vec::new();
        for k in 0..3 {
            curves.push(row(24, 4 * k, true, 0.4));
            curves.push(column(24, 12, 7 * k, true, 0.6));
        }
        let (layout, q) = quads(&torus(24, 12), &curves, 0.03);
        assert_eq!((layout.nodes.len(), layout.patches.len(), layout.n_irregular()), (9, 9, 0));
        assert_eq!(euler(&q), 0);
    }

    #[test]
    fn quads_are_shorter_in_the_direction_of_curvature() {
        let curves = [row(8, 2, false, 0.5), column(8, 8, 3, false, 0.5)];
        let (_, even) = quads_for_curvature(&square(8), &curves, 0.05, |_, _| 2.0);
        let (_, adapted) = quads_for_curvature(&square(8), &curves, 0.05, |_, along| 2.0 * along.x.abs());
        // Mean extents of the quads along both axes.
        let sides = |mesh: &QuadMesh| {
            let extent = |axis: usize| {
                let of = |q: &[u32; 4]| {
                    let along = q.map(|v| mesh.positions[v as usize][axis]);
                    along.iter().fold(f64::MIN, |a, b| a.max(*b)) - along.iter().fold(f64::MAX, |a, b| a.min(*b))
                };
                mesh.quads.iter().map(of).sum::<f64>() / mesh.quads.len() as f64
            };
            (extent(0), extent(1))
        };
        let (x, y) = sides(&even);
        assert!((x - y).abs() < 1e-6, "constant curvature changes nothing: {x} {y}");
        let (x, y) = sides(&adapted);
        assert!(x < 0.8 * y, "{x} {y}");
        assert!((adapted.quads.len() as f64 / even.quads.len() as f64 - 1.0).abs() < 0.1);
    }
}
