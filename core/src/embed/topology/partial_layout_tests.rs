//! The topology of embeddings of partial layouts.

use super::embedding_topology::EmbeddingTopology;
use crate::layout::file_testing::{cube, cube_file, square_grid, torus_grid};

#[test]
fn headings_of_partial_layouts_determine_period_jumps() {
    let cube = cube(4);
    let (torus, torus_file) = torus_grid();
    let (square, square_file) = square_grid();
    for (mesh, mut file) in [(&cube, cube_file(&cube, 4)), (&torus, torus_file), (&square, square_file)] {
        for _ in 0..3 {
            let partial = file.partial_embedding(mesh).unwrap();
            let (layout, embedding) = partial.to_embedding().unwrap();
            // The constructor checks the index of the field at every vertex.
            EmbeddingTopology::new(mesh, &embedding, &layout, &partial.arc_headings()).unwrap();
            let spare = (0..file.arcs.len()).find(|&a| {
                let mut fewer = file.clone();
                fewer.arcs.remove(a);
                fewer.partial_embedding(mesh).is_ok_and(|d| d.regions.len() < partial.regions.len())
            });
            file.arcs.remove(spare.unwrap());
        }
    }
}
