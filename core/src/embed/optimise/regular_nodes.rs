//! Regular nodes at the crossings of their isolines, exactly.
//!
//! Where four patches meet, two isolines cross; the node is whatever point that is, inside some triangle. A corner of the
//! triangle is put there, and the map is read off anew at what has moved, so that the node has the coordinates of the
//! crossing and all else keeps its own: holding it there then moves nothing.

use std::collections::{HashMap, VecDeque};

use glam::{DVec2, DVec3};

use crate::embed::EmbeddingError;
use crate::embed::optimise::isoline_crossing::crossing;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::optimise::relocation::NodeConstraint;
use crate::embed::parameterise::chord_lengths::transition;
use crate::embed::parameterise::solve::{Features, Folded};
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::around;
use crate::mesh::{FaceId, HalfedgeId, VertexId};
use crate::param::SeamlessMap;
use crate::progress::Progress;
use crate::surface::nearest_in_triangle;

/// How many triangles far crossings and features are looked for.
const REACH: usize = 24;
/// Weight of a corner up to which a point lies on the opposite side.
const ON_SIDE: f64 = 1e-6;
/// How often it is tried with those nodes left where they are in whose cells the map folds.
const TRIALS: usize = 6;

/// Where two isolines cross.
pub(in crate::embed) struct Crossing {
    pub face: FaceId,
    pub weights: [f64; 3],
    /// The point in space.
    pub place: DVec3,
    /// The triangles on the way back from there to the node.
    pub strip: Vec<FaceId>,
}

impl Optimiser<'_> {
    /// Brings regular nodes to the crossings of their isolines without changing the map but near them.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn settle_exactly(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let cell = self.cells();
        let mut stays = vec![false; self.pace.len()];
        for _ in 0..TRIALS {
            let (net, on_feature) = self.at_crossings(&stays);
            let uv = self.read_off(&net);
            match self.attempt_at(net, &uv, progress)? {
                Ok(state) => {
                    self.state = state;
                    for i in on_feature {
                        self.ground.hold[i] = NodeConstraint::Curve;
                    }
                    return Ok(());
                }
                Err(Folded(list)) => {
                    let before = stays.clone();
                    for v in list.iter().flat_map(|&f| self.state.net.mesh.face_vertices(f)) {
                        stays.get_mut(cell[v.index()] as usize).into_iter().for_each(|s| *s = true);
                    }
                    if stays == before {
                        break;
                    }
                    tracing::debug!(nodes = stays.iter().filter(|&&s| s).count(), "nodes stay off their crossings");
                }
            }
        }
        Ok(())
    }

    /// The net with regular nodes at their crossings but for those that stay, and which of them came onto features.
    fn at_crossings(&self, stays: &[bool]) -> (EmbeddingTopology, Vec<usize>) {
        let mut net = self.state.net.clone();
        let mut on_feature = Vec::new();
        for (i, &stays) in stays.iter().enumerate() {
            if self.through_arcs.constrained[i]
                || stays
                || self.ground.hold[i] == NodeConstraint::Fixed
                || net.nodes[i].boundary
            {
                continue;
            }
            let Some(crossing) = self.crossing_of(i) else { continue };
            let exact = self.features == Features::Held;
            let sharp = |h: HalfedgeId| exact && self.sharp[net.mesh.edge(h).index()];
            let from = net.nodes[i].vertex;
            let found = self.ground.put_at(&net, i, &crossing, sharp).find(|moved| self.fits(moved, from, i));
            if let Some(moved) = found {
                net = moved;
                if self.ground.on_curve[net.nodes[i].vertex.index()] {
                    on_feature.push(i);
                }
            }
        }
        (net, on_feature)
    }

    /// Whether the map read off anew has no folds around the vertex that a node has left and the one it has come to.
    fn fits(&self, moved: &EmbeddingTopology, from: VertexId, node: usize) -> bool {
        let around = |v: VertexId| moved.mesh.outgoing(v).map(|h| moved.mesh.face(h));
        around(from).chain(around(moved.nodes[node].vertex)).all(|f| {
            let [a, b, c] = moved.mesh.face_halfedges(f).map(|h| self.corner_of(moved, h));
            (b - a).perp_dot(c - a) > 0.0
        })
    }

    fn crossing_of(&self, i: usize) -> Option<Crossing> {
        let State { net, solution, .. } = &self.state;
        let (h, target) = crossing(net, &self.through_arcs, &solution.map, &self.ends[i])?;
        locate(net, &solution.map, net.mesh.face(h), target)
    }

    /// The coordinates of the corners of each triangle of a net whose vertices have partly moved: those of the present map
    /// at the same places of the surface.
    fn read_off(&self, moved: &EmbeddingTopology) -> Vec<[DVec2; 3]> {
        let mesh = &moved.mesh;
        mesh.faces().map(|f| mesh.face_halfedges(f).map(|h| self.corner_of(moved, h))).collect()
    }

    /// The coordinates of one corner.
    fn corner_of(&self, moved: &EmbeddingTopology, h: HalfedgeId) -> DVec2 {
        let State { net, solution, .. } = &self.state;
        let (mesh, map, v) = (&net.mesh, &solution.map, net.mesh.origin(h));
        let read = || {
            let (from, at) = read_at(net, map, v, moved.mesh.position(v))?;
            let crossed = around(mesh, from, h)?;
            Some(transition(mesh, map, &crossed)?.apply(at))
        };
        let stays = mesh.position(v) == moved.mesh.position(v) || mesh.is_boundary_vertex(v);
        (if stays { None } else { read() }).unwrap_or(map.uv[h.index() / 3][h.index() % 3])
    }
}

/// The coordinates of the point nearest to `place` in the triangles around a vertex, in the frame of that of the corner
/// returned.
fn read_at(net: &EmbeddingTopology, map: &SeamlessMap, v: VertexId, place: DVec3) -> Option<(HalfedgeId, DVec2)> {
    let mesh = &net.mesh;
    let point = |h: HalfedgeId| {
        let f = mesh.face(h);
        let corners = mesh.face_vertices(f).map(|w| mesh.position(w));
        let weights = nearest_in_triangle(place, &corners);
        let nearest: DVec3 = corners.iter().zip(weights).map(|(p, w)| *p * w).sum();
        let at: DVec2 = map.uv[f.index()].iter().zip(weights).map(|(p, w)| *p * w).sum();
        (nearest.distance_squared(place), h, at)
    };
    let best = mesh.outgoing(v).map(point).min_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((best.1, best.2))
}

/// The point with coordinates `target` in the frame of triangle `from`, as near as can be to that.
fn locate(net: &EmbeddingTopology, map: &SeamlessMap, from: FaceId, target: DVec2) -> Option<Crossing> {
    let mesh = &net.mesh;
    let inside = |f: FaceId, at: DVec2| Some((f, weights(&map.uv[f.index()], at)?));
    let ((face, weights), strip) = outward(net, map, [(from, target)], inside)?;
    let corners = mesh.face_vertices(face).map(|v| mesh.position(v));
    let place = corners.iter().zip(weights).map(|(p, w)| *p * w).sum();
    Some(Crossing { face, weights, place, strip })
}

/// Goes outward from triangles, each given with the coordinates of one and the same point in its frame, from triangle to
/// triangle with what these coordinates become there, until something is `found`. Returned with it is the way back, from
/// the triangle where it was found to one of the first.
pub(in crate::embed) fn outward<T>(
    net: &EmbeddingTopology,
    map: &SeamlessMap,
    first: impl IntoIterator<Item = (FaceId, DVec2)>,
    mut found: impl FnMut(FaceId, DVec2) -> Option<T>,
) -> Option<(T, Vec<FaceId>)> {
    let mesh = &net.mesh;
    let mut queue: VecDeque<(FaceId, DVec2, usize)> = first.into_iter().map(|(f, at)| (f, at, 0)).collect();
    let mut before: HashMap<FaceId, Option<FaceId>> = queue.iter().map(|&(f, ..)| (f, None)).collect();
    while let Some((f, at, far)) = queue.pop_front() {
        if let Some(found) = found(f, at) {
            return Some((found, std::iter::successors(Some(f), |f| before[f]).collect()));
        }
        for h in mesh.face_halfedges(f).into_iter().filter(|_| far < REACH) {
            let Some(change) = map.transition(mesh, h) else { continue };
            let Some(g) = mesh.twin(h).map(|t| mesh.face(t)).filter(|g| !before.contains_key(g)) else { continue };
            before.insert(g, Some(f));
            queue.push_back((g, change.apply(at), far + 1));
        }
    }
    None
}

/// The weights of the corners at a point of a triangle of the plane; `None` outside. Points next to a side lie on it.
fn weights(corners: &[DVec2; 3], at: DVec2) -> Option<[f64; 3]> {
    let [a, b, c] = *corners;
    let area = (b - a).perp_dot(c - a);
    let weights = [(b - at).perp_dot(c - at), (c - at).perp_dot(a - at), (a - at).perp_dot(b - at)].map(|w| w / area);
    if !weights.iter().all(|w| *w >= -ON_SIDE) {
        return None;
    }
    let cut = weights.map(|w| if w < ON_SIDE { 0.0 } else { w });
    let sum: f64 = cut.iter().sum();
    Some(cut.map(|w| w / sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_next_to_a_side_lie_on_it_and_those_outside_nowhere() {
        let corners = [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(0.0, 1.0)];
        let inside = weights(&corners, DVec2::new(0.5, 0.25)).unwrap();
        let at: DVec2 = corners.iter().zip(inside).map(|(p, w)| *p * w).sum();
        assert!(at.distance(DVec2::new(0.5, 0.25)) < 1e-12);
        let beside = weights(&corners, DVec2::new(1.0, -1e-9)).unwrap();
        assert_eq!(beside[2], 0.0);
        assert!((beside.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(weights(&corners, DVec2::new(1.0, -1e-3)).is_none());
    }
}
