//! Layout files: writing, reading and embedding of complete and partial layouts.

use std::path::PathBuf;

use glam::DVec3;

use super::testing::*;
use super::*;
use crate::dual::Mark;
use crate::layout::{Embedding, QuadLayout, map_patches};
use crate::mesh::{FaceId, VertexId};
use crate::progress::Progress;
use crate::surface::{SurfaceCurve, SurfacePoint};
use crate::testing::{column, row, square, torus};

mod errors;
mod properties;

/// The sides of all patches, independent of numbering and rotation.
fn patches(layout: &QuadLayout) -> Vec<[(u32, bool); 4]> {
    let turned = |s: [(u32, bool); 4]| (0..4).map(|k| [0, 1, 2, 3].map(|i| s[(i + k) % 4])).min().unwrap();
    let mut list: Vec<_> = layout.patches.iter().map(|p| turned(p.sides)).collect();
    list.sort_unstable();
    list
}

/// Writes, reads and embeds a layout; checks that it is unchanged and that its patches can be mapped.
fn round_trip(mesh: &TriMesh, layout: &QuadLayout, embedding: &Embedding) {
    let file = LayoutFile::from_embedding(source(), mesh, layout, embedding).unwrap();
    let folder = temporary_folder();
    let path = folder.join("a.layout");
    file.write(&path).unwrap();
    let read = LayoutFile::read(&path).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    assert_eq!(read, file);
    read.check_mesh(mesh).unwrap();
    let partial = read.partial_embedding(mesh).unwrap();
    assert!(partial.is_complete());
    let (again, embedded) = partial.to_embedding().unwrap();
    assert_eq!(again.nodes, layout.nodes);
    assert_eq!(again.chords, layout.chords);
    for (a, b) in again.arcs.iter().zip(&layout.arcs) {
        assert_eq!((a.nodes, a.boundary), (b.nodes, b.boundary));
    }
    assert_eq!(patches(&again), patches(layout));
    for (a, b) in embedded.nodes.iter().zip(&embedding.nodes) {
        let distance = embedded.mesh.positions[*a as usize].distance(embedding.mesh.positions[*b as usize]);
        assert!(distance < 1e-8, "node moved by {distance}");
    }
    let maps = map_patches(&again, &embedded, &Progress::new()).unwrap();
    assert!(maps.iter().all(|m| m.flipped == 0));
    let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
    let whole: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    assert!((area - whole).abs() < 1e-6 * whole, "area of patches {area}, of the surface {whole}");
    // Written from the partial embedding it is still the same layout.
    let second = LayoutFile::from_partial_embedding(source(), mesh, &partial).unwrap();
    let (third, _) = second.partial_embedding(mesh).unwrap().to_embedding().unwrap();
    assert_eq!(patches(&third), patches(layout));
}

/// A new temporary folder.
fn temporary_folder() -> PathBuf {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = format!("plait-layout-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let path = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Checks a partial embedding: the turns of each region sum to four quarters, headings change at corners only and by
/// their turn, and the sectors at every node sum to its valence.
fn check(partial: &PartialEmbedding) {
    let mut sectors = vec![0; partial.nodes.len()];
    for region in &partial.regions {
        assert_eq!(region.corners.iter().map(PartialCorner::turn).sum::<i64>(), 4);
        let heading = |i: usize| i64::from(partial.headings[region.border[i] as usize].unwrap());
        assert_eq!(heading(0), 0);
        let n = region.border.len();
        for i in 0..n {
            let (before, after) = (region.border[(i + n - 1) % n], region.border[i]);
            assert_eq!(partial.mesh.target(before), partial.mesh.origin(after));
            let corner = region.corners.iter().find(|c| c.at == i);
            let turn = corner.map_or(0, PartialCorner::turn);
            assert_eq!((heading(i) - heading((i + n - 1) % n) - turn).rem_euclid(4), 0);
            if let Some(c) = corner {
                assert_eq!(partial.mesh.origin(after), partial.nodes[c.node as usize]);
                sectors[c.node as usize] += c.sectors as usize;
            }
        }
    }
    for (path, headings) in partial.arcs.iter().zip(partial.arc_headings()) {
        let boundary =
            path.windows(2).all(|w| partial.mesh.find(w[0], w[1]).is_some_and(|h| partial.mesh.is_boundary(h)));
        assert_eq!(headings.iter().flatten().count(), if boundary { 1 } else { 2 });
    }
    for (n, kind) in partial.layout_nodes.iter().enumerate() {
        assert_eq!(sectors[n], kind.valence);
    }
    for h in 0..3 * partial.mesh.n_faces() as u32 {
        let on_border = partial.mesh.mark(h) != Mark::Free || partial.mesh.is_boundary(h);
        assert_eq!(partial.headings[h as usize].is_some(), on_border);
    }
}

#[test]
fn layouts_dual_to_loops_survive_writing_and_reading() {
    for curves in [1, 3] {
        let mesh = torus(24, 12);
        let list: Vec<SurfaceCurve> =
            (0..curves).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
        let (layout, embedding) = dual_layout(&mesh, &list);
        round_trip(&mesh, &layout, &embedding);
    }
}

#[test]
fn layouts_with_boundary_survive_writing_and_reading() {
    for curves in [1, 2, 3] {
        let mesh = square(8);
        let list: Vec<SurfaceCurve> =
            (0..curves).flat_map(|k| [row(8, 2 * k, false, 0.5), column(8, 8, 1 + 2 * k, false, 0.5)]).collect();
        let (layout, embedding) = dual_layout(&mesh, &list);
        round_trip(&mesh, &layout, &embedding);
    }
}

#[test]
fn edges_of_a_cube_form_six_patches() {
    let mesh = cube(4);
    let partial = cube_file(&mesh, 4).partial_embedding(&mesh).unwrap();
    check(&partial);
    let (layout, embedding) = partial.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.arcs.len(), layout.patches.len(), layout.chords), (8, 12, 6, 3));
    assert!(layout.nodes.iter().all(|n| n.valence == 3 && !n.boundary));
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn cube_of_single_edges_is_embedded() {
    let mesh = cube(1);
    let partial = cube_file(&mesh, 1).partial_embedding(&mesh).unwrap();
    let (layout, embedding) = partial.to_embedding().unwrap();
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn partial_cube_is_embedded_while_its_regions_are_discs() {
    let mesh = cube(4);
    let mut file = cube_file(&mesh, 4);
    file.arcs.remove(0);
    let partial = file.partial_embedding(&mesh).unwrap();
    check(&partial);
    assert!(!partial.is_complete() && partial.to_embedding().unwrap().0.patches.is_empty());
    assert_eq!(partial.regions.len(), 5);
    // The joined sides have four right angles and two straight corners at the ends of the removed arc.
    let larger = partial.regions.iter().find(|r| r.corners.len() == 6).unwrap();
    let mut turns: Vec<i64> = larger.corners.iter().map(PartialCorner::turn).collect();
    turns.sort_unstable();
    assert_eq!(turns, [0, 0, 1, 1, 1, 1]);
    let again = LayoutFile::from_partial_embedding(source(), &mesh, &partial).unwrap();
    check(&again.partial_embedding(&mesh).unwrap());
}

#[test]
fn omitted_boundary_arcs_are_added() {
    let (mesh, whole) = square_grid();
    let (layout, _) = whole.partial_embedding(&mesh).unwrap().to_embedding().unwrap();
    let mut file = whole.clone();
    let mut arcs = layout.arcs.iter();
    file.arcs.retain(|_| !arcs.next().unwrap().boundary);
    assert_eq!(file.arcs.len(), 12);
    let partial = file.partial_embedding(&mesh).unwrap();
    check(&partial);
    assert!(partial.is_complete());
    let (again, _) = partial.to_embedding().unwrap();
    assert_eq!((again.nodes, again.chords, again.arcs.len()), (layout.nodes, layout.chords, layout.arcs.len()));
    // Without inner arcs one region remains, with the corners of the square.
    file.arcs.clear();
    file.nodes.retain(|n| n.valence < 4);
    let partial = file.partial_embedding(&mesh).unwrap();
    check(&partial);
    assert_eq!((partial.regions.len(), partial.arcs.len()), (1, 12));
    assert!(!partial.is_complete());
}

#[test]
fn nodes_inside_a_triangle_and_on_edges_are_embedded() {
    // Two triangles: a quad of four nodes in one triangle, inside the boundary quad.
    let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let mesh = TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let mut file = LayoutFile::new(source(), &mesh);
    for v in 0..4 {
        file.nodes.push(FileNode { at: at_vertex(&mesh, VertexId(v)), valence: 1, fixed: false });
    }
    let inside = |weights| FileNode { at: SurfacePoint { face: FaceId(0), weights }, valence: 3, fixed: false };
    file.nodes.push(inside([0.6, 0.25, 0.15]));
    file.nodes.push(inside([0.25, 0.6, 0.15]));
    file.nodes.push(inside([0.15, 0.35, 0.5]));
    file.nodes.push(inside([0.5, 0.0, 0.5]));
    let mut arc = |a: (u32, u32), b: (u32, u32)| {
        let ends = [a, b].map(|(node, slot)| ArcEnd { node, slot });
        file.arcs.push(FileArc { ends, fixed: false, path: Vec::new() });
    };
    for i in 0..4 {
        let j = (i + 1) % 4;
        // Along the boundary; from the inner quad to the boundary; around the inner quad.
        arc((i, 0), (j, 2));
        arc((4 + i, 0), (i, 1));
        arc((4 + i, 1), (4 + j, 2));
    }
    // A boundary corner with an arc has two sectors.
    file.nodes[..4].iter_mut().for_each(|n| n.valence = 2);
    let partial = file.partial_embedding(&mesh).unwrap();
    check(&partial);
    let (layout, embedding) = partial.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.arcs.len(), layout.patches.len()), (8, 12, 5));
    assert_eq!(layout.arcs.iter().filter(|a| a.boundary).count(), 4);
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn patches_smaller_than_triangles_survive_writing_and_reading() {
    for (n, m, count) in [(3, 3, 4), (4, 4, 7), (6, 4, 9)] {
        let mesh = torus(n, m);
        let fraction = |i: u32| (f64::from(i) + 0.5 + 0.4 * f64::from(3 * i).sin()) / f64::from(count);
        let curves: Vec<SurfaceCurve> = (0..count)
            .flat_map(|i| [row(n, (i / 4) % m, true, fraction(i)), column(n, m, (i / 3) % n, true, 1.0 - fraction(i))])
            .collect();
        let (layout, embedding) = dual_layout(&mesh, &curves);
        let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
        let partial = file.partial_embedding(&mesh).unwrap();
        check(&partial);
        assert_eq!(patches(&partial.to_embedding().unwrap().0), patches(&layout));
    }
}

#[test]
fn example_of_the_documentation_is_valid() {
    let text = include_str!("../../../../../docs/layout-file.md");
    let json = text.split("```json").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let file: LayoutFile = serde_json::from_str(json).unwrap();
    let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let mesh = TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let partial = file.partial_embedding(&mesh).unwrap();
    check(&partial);
    let (layout, embedding) = partial.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.patches.len(), layout.chords), (6, 2, 3));
    round_trip(&mesh, &layout, &embedding);
}
