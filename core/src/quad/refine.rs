//! Refining a layout to a quad mesh (Campen, section 6.7): `m × n` quads per patch, `m` and `n` from the
//! lengths of its chords, so that patches agree along their common arcs.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::spacing::Spacing;
use crate::layout::{Embedding, PatchMap, QuadLayout};

/// A quad mesh that refines a layout.
#[derive(Debug, Clone)]
pub struct QuadMesh {
    /// Vertex positions, in units of the mesh.
    pub positions: Vec<DVec3>,
    /// Corners of the quads, counter-clockwise.
    pub quads: Vec<[u32; 4]>,
    /// Layout patch of each quad.
    pub patch: Vec<u32>,
    /// Triangle of the original mesh that each vertex lies in (or touches).
    pub base_face: Vec<u32>,
    /// Whether each vertex lies on the boundary.
    pub boundary: Vec<bool>,
    /// Number of layout nodes; they are the first vertices, in order.
    pub n_nodes: usize,
    /// Vertices of each layout arc, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
}

/// Refines every patch to the grid of the lines along its two chords.
pub fn refine(layout: &QuadLayout, embedding: &Embedding, maps: &[PatchMap], stops: &Spacing) -> QuadMesh {
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
        for (at, v) in along_path(path, along, &stops.along(a, true), position) {
            out.positions.push(at);
            out.base_face.push(face_at(v));
            out.boundary.push(arc.boundary);
        }
        let inner = first_on_arc[first_on_arc.len() - 1]..out.positions.len() as u32;
        out.arcs.push([arc.nodes[0]].into_iter().chain(inner).chain([arc.nodes[1]]).collect());
    }
    for (p, map) in maps.iter().enumerate() {
        let [across, up] = [0, 1].map(|i| {
            let (arc, forward) = layout.patches[p].sides[i];
            stops.along(arc, forward)
        });
        let [m, n] = [&across, &up].map(|lines| lines.len() as u32 + 1);
        let ids = grid_ids(layout, p, (m, n), &first_on_arc, out.positions.len() as u32);
        let inner: Vec<DVec2> =
            up.iter().flat_map(|&v| across.iter().map(move |&u| map.size * DVec2::new(u, v))).collect();
        for (at, f) in map.locate(&inner) {
            out.positions.push(at);
            out.base_face.push(f);
            out.boundary.push(false);
        }
        for j in 0..n {
            for i in 0..m {
                out.quads.push([(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|c| ids[&c]));
                out.patch.push(p as u32);
            }
        }
    }
    out
}

/// The points of a vertex path at these shares of the parameter given `along` it, each with a vertex near it.
fn along_path(path: &[u32], along: &[f64], shares: &[f64], position: impl Fn(u32) -> DVec3) -> Vec<(DVec3, u32)> {
    let total = along[along.len() - 1];
    let mut k = 0;
    shares
        .iter()
        .map(|share| {
            let s = total * share;
            while k + 2 < path.len() && along[k + 1] < s {
                k += 1;
            }
            let t = ((s - along[k]) / (along[k + 1] - along[k])).clamp(0.0, 1.0);
            (position(path[k]).lerp(position(path[k + 1]), t), path[if t < 0.5 { k } else { k + 1 }])
        })
        .collect()
}

/// The vertex ids of the grid of patch `p`; inner ones are numbered from `first_inner` on, row by row.
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
            // Place on the grid, going around counter-clockwise from corner `k`.
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
    use super::*;
    use crate::dual::{Arrangement, Colour, assess, vertex_curvatures};
    use crate::layout::{embed, map_patches};
    use crate::mesh::TriMesh;
    use crate::progress::Progress;
    use crate::surface::SurfaceCurve;
    use crate::testing::{column, row, square, torus};

    fn quads(mesh: &TriMesh, curves: &[SurfaceCurve], target: f64) -> (QuadLayout, QuadMesh) {
        bent_quads(mesh, curves, target, |_, _| 0.0)
    }

    fn bent_quads(
        mesh: &TriMesh,
        curves: &[SurfaceCurve],
        target: f64,
        bend: impl Fn(u32, DVec3) -> f64,
    ) -> (QuadLayout, QuadMesh) {
        let arrangement = Arrangement::new(mesh, curves).unwrap();
        let reports = assess(&arrangement, &vertex_curvatures(mesh), &[]);
        assert!(reports.iter().all(|r| r.colour != Colour::Red), "{reports:?}");
        let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
        let progress = Progress::new();
        let embedding = embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &progress).unwrap();
        let maps = map_patches(&layout, &embedding, &progress).unwrap();
        assert!(maps.iter().all(|m| m.flipped == 0));
        let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
        let whole: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
        assert!((area - whole).abs() < 1e-9 * whole, "the patches cover the surface once");
        let mesh = refine(
            &layout,
            &embedding,
            &maps,
            &Spacing::curvature_adapted(&layout, &maps, bend, whole / (target * target)),
        );
        (layout, mesh)
    }

    /// Euler characteristic of an all-quad mesh; panics if it is not an oriented manifold.
    fn euler(q: &QuadMesh) -> i64 {
        let triangles: Vec<[u32; 3]> = q.quads.iter().flat_map(|c| [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).collect();
        TriMesh::from_faces(q.positions.clone(), &triangles).unwrap().euler_characteristic()
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
    fn quads_are_narrow_along_which_the_surface_bends() {
        let curves = [row(8, 2, false, 0.5), column(8, 8, 3, false, 0.5)];
        let (_, even) = bent_quads(&square(8), &curves, 0.05, |_, _| 2.0);
        let (_, bent) = bent_quads(&square(8), &curves, 0.05, |_, along| 2.0 * along.x.abs());
        let sides = |mesh: &QuadMesh| {
            let reach = |axis: usize| {
                let of = |q: &[u32; 4]| {
                    let along = q.map(|v| mesh.positions[v as usize][axis]);
                    along.iter().fold(f64::MIN, |a, b| a.max(*b)) - along.iter().fold(f64::MAX, |a, b| a.min(*b))
                };
                mesh.quads.iter().map(of).sum::<f64>() / mesh.quads.len() as f64
            };
            (reach(0), reach(1))
        };
        let (x, y) = sides(&even);
        assert!((x - y).abs() < 1e-6, "the same bend everywhere changes nothing: {x} {y}");
        let (x, y) = sides(&bent);
        assert!(x < 0.8 * y, "{x} {y}");
        assert!((bent.quads.len() as f64 / even.quads.len() as f64 - 1.0).abs() < 0.1);
    }
}
