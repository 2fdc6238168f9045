//! Curves from boundary to boundary.

use super::reference::compare_open_curves;
use super::samples::{close_along, graph, research, sample, tube};
use crate::elastica::DirectionMask;

#[test]
fn open_curves_are_exact() {
    for mesh in [Some(tube(16, 24)), research("half_torus.obj")].into_iter().flatten() {
        let g = graph(mesh);
        let v = sample(&g, 8).find(|&v| !g.mesh().is_boundary_vertex(v)).unwrap();
        let open = DirectionMask::all_open();
        let cheapest = compare_open_curves(&g, &open, v).unwrap();
        // Once a strip lies there, the costs without closed directions are only bounds.
        let mut mask = open.clone();
        close_along(&g, &g.found_loop(&cheapest).unwrap().curve, &mut mask);
        assert!(mask.n_closed() > 0);
        for w in sample(&g, 4).filter(|&w| !g.mesh().is_boundary_vertex(w)).chain([v]) {
            compare_open_curves(&g, &mask, w);
        }
    }
}
