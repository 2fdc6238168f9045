//! Properties of the embedding of random partial and corrupted layouts.

use std::sync::OnceLock;

use proptest::prelude::*;

use super::*;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::Crossing;

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn layouts_with_dropped_arcs_are_embedded_or_refused(
        dropped in prop::collection::vec(0.0..1.0f64, 24), share in 0.0..0.6f64, which in 0..3usize
    ) {
        static LAYOUTS: OnceLock<[(TriMesh, LayoutFile); 3]> = OnceLock::new();
        let cube = || (cube(4), cube_file(&cube(4), 4));
        let (mesh, whole) = &LAYOUTS.get_or_init(|| [torus_grid(), square_grid(), cube()])[which];
        let mut file = whole.clone();
        let mut keep = dropped.iter().map(|x| *x >= share);
        file.arcs.retain(|_| keep.next().unwrap());
        match file.partial_embedding(mesh) {
            Ok(partial) => {
                check(&partial);
                // Boundary arcs are added again.
                prop_assert_eq!(partial.is_complete(), partial.arcs.len() == whole.arcs.len());
                let again = LayoutFile::from_partial_embedding(source(), mesh, &partial).unwrap();
                let second = again.partial_embedding(mesh).unwrap();
                check(&second);
                prop_assert_eq!(second.regions.len(), partial.regions.len());
            }
            Err(e) => {
                use PartialEmbeddingError::{Isolated, NotADisc};
                prop_assert!(matches!(e, NotADisc { .. } | Isolated { .. }), "{e}");
            }
        }
    }

    #[test]
    fn corrupted_files_are_embedded_or_refused(
        changes in prop::collection::vec((0..7u32, any::<u32>(), any::<u32>(), -0.1..1.1f64), 1..4), which in 0..3usize
    ) {
        static LAYOUTS: OnceLock<[(TriMesh, LayoutFile); 3]> = OnceLock::new();
        let cube = || (cube(4), cube_file(&cube(4), 4));
        let (mesh, whole) = &LAYOUTS.get_or_init(|| [torus_grid(), square_grid(), cube()])[which];
        let mut file = whole.clone();
        for (kind, i, j, t) in changes {
            let (n_arcs, n_nodes) = (file.arcs.len(), file.nodes.len());
            let arc = &mut file.arcs[i as usize % n_arcs];
            let at = j as usize % (arc.path.len() + 1);
            match kind {
                0 => arc.ends[i as usize % 2].slot = j % 5,
                1 => arc.ends[i as usize % 2].node = j % (n_nodes as u32 + 1),
                2 => arc.path.insert(at, PathPoint::Vertex { vertex: VertexId(j % (mesh.n_vertices() as u32 + 1)) }),
                3 => {
                    let halfedge = HalfedgeId(j % (mesh.n_halfedges() as u32 + 1));
                    arc.path.insert(at, PathPoint::Crossing(Crossing { halfedge, t }));
                }
                4 => match arc.path.get_mut(at) {
                    Some(PathPoint::Crossing(c)) => c.t = t,
                    Some(place) => *place = PathPoint::Vertex { vertex: VertexId(j % mesh.n_vertices() as u32) },
                    None => arc.path.clear(),
                },
                5 => file.nodes[i as usize % n_nodes].at.weights = [t, 1.0 - t, 0.0],
                _ => file.nodes[i as usize % n_nodes].valence = j % 6,
            }
        }
        if let Ok(partial) = file.partial_embedding(mesh) {
            check(&partial);
            partial.to_embedding().unwrap();
        }
    }
}
