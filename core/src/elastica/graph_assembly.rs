//! Building the elastica graph of a mesh.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::alignment_cost::AlignmentCost;
use super::geodesics::{Geodesic, geodesics};
use super::graph::{DirectedGeodesic, ElasticaGraph, NO_STATE, State};
use super::options::{ElasticaError, ElasticaOptions};
use super::unfold::Corners;
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::surface::PrincipalCurvature;

impl ElasticaGraph {
    /// Joins the vertices of `mesh` by straight geodesics and weights them by `curvature` (per vertex) and `sharp` (per
    /// edge). The mesh must be normalised.
    ///
    /// # Errors
    ///
    /// See [`ElasticaError`].
    pub fn build(
        mesh: Arc<TriMesh>,
        curvature: &[PrincipalCurvature],
        sharp: &[bool],
        options: &ElasticaOptions,
        progress: &Progress,
    ) -> Result<Self, ElasticaError> {
        check_length(curvature.len(), mesh.n_vertices())?;
        check_length(sharp.len(), mesh.n_edges())?;
        options.check()?;
        progress.report("Elastica graph", 0.0);
        let corners = Corners::new(&mesh);
        let alignment = AlignmentCost::new(&mesh, curvature, sharp, options);
        let all = geodesics(&mesh, &corners, &alignment, options.rings, progress)?;
        progress.report("Elastica graph", 0.8);
        if all.len() >= (NO_STATE / 2) as usize {
            return Err(ElasticaError::TooLarge);
        }
        let mut graph = Self::assemble(mesh, corners, *options, &all);
        graph.find_steps()?;
        Ok(graph)
    }

    /// Numbers the directed geodesics as states. Steps are not found yet.
    fn assemble(mesh: Arc<TriMesh>, corners: Corners, options: ElasticaOptions, all: &[Geodesic]) -> Self {
        let (first, ways) = sorted_around_vertices(mesh.n_vertices(), all);
        let mut state_of_way = vec![0u32; ways.len()];
        for (state, &way) in ways.iter().enumerate() {
            state_of_way[way as usize] = state as u32;
        }
        let directed = |&way: &u32| {
            let g = &all[way as usize / 2];
            let (out_angle, back_angle) = (out_angle(all, way), out_angle(all, way ^ 1));
            DirectedGeodesic { out_angle, back_angle, length: g.length, alignment: g.alignment }
        };
        let geodesics: Vec<DirectedGeodesic> = ways.par_iter().map(directed).collect();
        let target: Vec<u32> = ways.iter().map(|&w| all[w as usize / 2].ends[1 - w as usize % 2]).collect();
        let reverse = ways.iter().map(|&w| state_of_way[w as usize ^ 1]).collect();
        let (first_midpoint, midpoints) = by_midpoint(mesh.n_faces(), all, &state_of_way);
        let has_boundary = mesh.edges().any(|e| mesh.is_boundary_edge(e));
        Self {
            mesh,
            corners,
            options,
            has_boundary,
            first,
            geodesics,
            target,
            reverse,
            successors: Vec::new(),
            step_costs: Vec::new(),
            first_midpoint,
            midpoints,
            boundary_costs: OnceLock::new(),
        }
    }
}

fn check_length(given: usize, expected: usize) -> Result<(), ElasticaError> {
    if given == expected { Ok(()) } else { Err(ElasticaError::WrongLength { given, expected }) }
}

/// The tangent angle at which a way leaves its first vertex. A way is a directed geodesic before states are numbered: way
/// `2 i` is geodesic `i` from its first end, way `2 i + 1` from its second.
fn out_angle(all: &[Geodesic], way: u32) -> f32 {
    all[way as usize / 2].angles[way as usize % 2]
}

/// The ways that leave each vertex, sorted by angle: first way of each vertex (and the number of ways), and the ways.
fn sorted_around_vertices(n_vertices: usize, all: &[Geodesic]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0u32; n_vertices + 1];
    for end in all.iter().flat_map(|g| g.ends) {
        first[end as usize + 1] += 1;
    }
    prefix_sum(&mut first);
    let mut fill = first.clone();
    let mut ways = vec![0u32; 2 * all.len()];
    for (i, g) in all.iter().enumerate() {
        for side in 0..2 {
            let slot = &mut fill[g.ends[side] as usize];
            ways[*slot as usize] = (2 * i + side) as u32;
            *slot += 1;
        }
    }
    let mut around = Vec::with_capacity(n_vertices);
    let mut rest = &mut ways[..];
    for v in 0..n_vertices {
        let (here, after) = rest.split_at_mut((first[v + 1] - first[v]) as usize);
        around.push(here);
        rest = after;
    }
    around.into_par_iter().for_each(|here| {
        here.sort_unstable_by(|&a, &b| out_angle(all, a).total_cmp(&out_angle(all, b)).then(a.cmp(&b)));
    });
    (first, ways)
}

fn prefix_sum(counts: &mut [u32]) {
    for i in 1..counts.len() {
        counts[i] += counts[i - 1];
    }
}

/// The geodesics by the face that holds their midpoint: first entry of each face (and the number of entries), and entries
/// of state and angle.
fn by_midpoint(n_faces: usize, all: &[Geodesic], state_of_way: &[u32]) -> (Vec<u32>, Vec<(State, f32)>) {
    let mut first = vec![0u32; n_faces + 1];
    for g in all {
        first[g.midpoint_face as usize + 1] += 1;
    }
    prefix_sum(&mut first);
    let mut fill = first.clone();
    let mut midpoints = vec![(0, 0.0); all.len()];
    for (i, g) in all.iter().enumerate() {
        let slot = &mut fill[g.midpoint_face as usize];
        midpoints[*slot as usize] = (state_of_way[2 * i], g.midpoint_angle);
        *slot += 1;
    }
    (first, midpoints)
}
