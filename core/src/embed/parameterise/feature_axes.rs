//! The axis of every feature edge: along which direction of the field it runs, hence which coordinate is constant on
//! it.
//!
//! Method: a feature line from corner to corner or node to node is assigned its directions as a whole, by dynamic
//! programming over its edges. The cost of an edge is its squared deviation from the field, weighted by length; every
//! change of direction along the line has a fixed cost. Single edges cannot decide: beside a node the field turns
//! within a few triangles, and an edge there may be nearer to the wrong direction.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::{HalfedgeId, VertexId};
use crate::surface::Metric;

/// Cost of a change of direction along a line, in edges of mean length that run across the field. Measured: 8 left more
/// feature edges off isolines, 60 as well.
const CHANGE_COST: f64 = 20.0;
/// Cosine between the two edges at a vertex above which a feature has a corner there: half way from straight to a right
/// angle.
const CORNER_COSINE: f64 = -FRAC_1_SQRT_2;

/// A feature edge with its direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DirectedEdge {
    /// The half-edge that stands for the edge.
    pub halfedge: HalfedgeId,
    /// The direction (0 to 3) of its triangle's cross along which it runs.
    pub heading: i32,
    /// Deviation of the field from the half-edge, in quarter turns, not negative.
    pub off: f64,
}

/// The directions of all `sharp` edges inside the surface, for a field of the given angles.
pub(super) fn feature_directions(
    topology: &EmbeddingTopology,
    metric: &Metric,
    angle: &[f64],
    sharp: &[bool],
) -> Vec<DirectedEdge> {
    let lines = Lines::new(topology, sharp);
    let mut all = Vec::new();
    for line in lines.all() {
        all.extend(line_directions(topology, metric, angle, &line));
    }
    all
}

/// All feature lines, each as half-edges from corner to corner or node to node, or once around.
pub(in crate::embed) fn lines(topology: &EmbeddingTopology, sharp: &[bool]) -> Vec<Vec<HalfedgeId>> {
    Lines::new(topology, sharp).all()
}

/// The features of a mesh as a graph.
struct Lines<'a> {
    topology: &'a EmbeddingTopology,
    /// Whether each edge is a feature edge inside the surface.
    feature: Vec<bool>,
    /// Whether a line ends at each vertex.
    ends: Vec<bool>,
}

impl<'a> Lines<'a> {
    fn new(topology: &'a EmbeddingTopology, sharp: &[bool]) -> Self {
        let mesh = &topology.mesh;
        let feature: Vec<bool> = mesh.edges().map(|e| sharp[e.index()] && !mesh.is_boundary_edge(e)).collect();
        let rays = |v: VertexId| mesh.outgoing(v).filter(|&h| feature[mesh.edge(h).index()]);
        let ends_at = |v: VertexId| {
            let list: Vec<_> = rays(v).map(|h| mesh.vector(h).normalize_or_zero()).collect();
            mesh.is_boundary_vertex(v) || list.len() != 2 || list[0].dot(list[1]) > CORNER_COSINE
        };
        let mut ends: Vec<bool> = mesh.vertices().map(ends_at).collect();
        for n in topology.nodes.iter().filter(|n| !n.is_regular()) {
            ends[n.vertex.index()] = true;
        }
        Self { topology, feature, ends }
    }

    /// All lines, each as half-edges from end to end, or once around.
    fn all(&self) -> Vec<Vec<HalfedgeId>> {
        let mesh = &self.topology.mesh;
        let mut done = vec![false; mesh.n_edges()];
        let mut lines = Vec::new();
        let from_ends = mesh.halfedges().filter(|&h| self.ends[mesh.origin(h).index()]);
        for first in from_ends.chain(mesh.halfedges()) {
            let mut line = Vec::new();
            let mut at = first;
            while self.feature[mesh.edge(at).index()] && !done[mesh.edge(at).index()] {
                done[mesh.edge(at).index()] = true;
                line.push(at);
                let end = mesh.target(at);
                let onward = |&h: &HalfedgeId| self.feature[mesh.edge(h).index()] && mesh.target(h) != mesh.origin(at);
                let Some(next) = mesh.outgoing(end).find(onward).filter(|_| !self.ends[end.index()]) else { break };
                at = next;
            }
            if !line.is_empty() {
                lines.push(line);
            }
        }
        lines
    }
}

/// The directions of the edges of one line.
fn line_directions(
    topology: &EmbeddingTopology,
    metric: &Metric,
    angle: &[f64],
    line: &[HalfedgeId],
) -> Vec<DirectedEdge> {
    let mesh = &topology.mesh;
    // Rotation of each triangle's frame against that of the first, transported along the left side of the line.
    let mut turned = vec![0];
    for w in line.windows(2) {
        let before = turned[turned.len() - 1];
        turned.push(before + turns_between(topology, w[0], w[1]).unwrap_or(0));
    }
    let lengths: Vec<f64> = line.iter().map(|&h| mesh.vector(h).length()).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let measured: Vec<f64> = line
        .iter()
        .zip(&turned)
        .map(|(&h, &t)| (metric.direction(h) - angle[mesh.face(h).index()]) / FRAC_PI_2 + f64::from(t))
        .collect();
    let off = |i: usize, k: i32| {
        let d = measured[i] - f64::from(k);
        d - 4.0 * (d / 4.0).round()
    };
    let chosen = cheapest_labels(line.len(), |i, k| lengths[i] / mean * off(i, k).powi(2));
    let each = |(i, &h): (usize, &HalfedgeId)| {
        let k = chosen[i];
        // An edge is named by one of its two half-edges, whose triangle need not be the one to the left of the line.
        let own = (k - turned[i]).rem_euclid(4);
        let first = mesh.halfedge(mesh.edge(h));
        let heading = if first == h { own } else { (own - topology.jump_across(h) + 2).rem_euclid(4) };
        DirectedEdge { halfedge: first, heading, off: off(i, k).abs() }
    };
    line.iter().enumerate().map(each).collect()
}

/// The quarter turns from the frame of the triangle of `a` to that of `b`, around the vertex between both half-edges on
/// their left side: direction `k` of the first is direction `k − turns` of the second. `None` across the boundary.
fn turns_between(topology: &EmbeddingTopology, a: HalfedgeId, b: HalfedgeId) -> Option<i32> {
    let mesh = &topology.mesh;
    let mut turns = 0;
    let mut at = b;
    // Counter-clockwise from the triangle of `b` to that of `a`.
    while mesh.prev(at) != a {
        let across = mesh.prev(at);
        at = mesh.twin(across)?;
        turns += topology.jump_across(at);
        if at == b {
            return None;
        }
    }
    Some(turns)
}

/// The labels 0 to 3 of `n` places in a row with the least sum of label costs and [`CHANGE_COST`] for every change.
fn cheapest_labels(n: usize, cost: impl Fn(usize, i32) -> f64) -> Vec<i32> {
    let mut total = [0, 1, 2, 3].map(|k| cost(0, k));
    let mut came: Vec<[i32; 4]> = vec![[0; 4]];
    for i in 1..n {
        let best = |k: i32| {
            let with_change = |j: i32| total[j as usize] + if j == k { 0.0 } else { CHANGE_COST };
            let from = (0..4).min_by(|&a, &b| with_change(a).total_cmp(&with_change(b))).unwrap_or(k);
            (with_change(from) + cost(i, k), from)
        };
        let next = [0, 1, 2, 3].map(best);
        total = next.map(|x| x.0);
        came.push(next.map(|x| x.1));
    }
    let mut at = (0..4).min_by(|&a, &b| total[a as usize].total_cmp(&total[b as usize])).unwrap_or(0);
    let mut chosen = vec![at; n];
    for i in (1..n).rev() {
        at = came[i][at as usize];
        chosen[i - 1] = at;
    }
    chosen
}

/// The direction of a half-edge in its own triangle, from that of either half-edge of its edge.
pub(super) fn heading_in(topology: &EmbeddingTopology, side: HalfedgeId, of: &DirectedEdge) -> i32 {
    if of.halfedge == side {
        return of.heading;
    }
    (of.heading - topology.jump_across(of.halfedge) + 2).rem_euclid(4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::sample_topology;

    #[test]
    fn a_change_of_direction_takes_more_than_a_few_edges_across_the_field() {
        // Edges that follow heading 1, but for some in between that run along heading 2.
        let line = |n: usize, from: usize, to: usize| {
            let along = move |i: usize| if (from..to).contains(&i) { 2 } else { 1 };
            cheapest_labels(n, move |i, k| if k == along(i) { 0.0 } else { 1.0 })
        };
        assert_eq!(line(100, 40, 50), vec![1; 100]);
        assert_eq!(line(60, 56, 60), vec![1; 60]);
        let turned = line(100, 40, 100);
        assert!(turned[..40].iter().all(|&k| k == 1) && turned[40..].iter().all(|&k| k == 2));
    }

    #[test]
    fn lines_partition_the_feature_edges_and_have_no_ends_inside() {
        let topology = sample_topology();
        let sharp: Vec<bool> = topology.mesh.edges().map(|e| e.0 % 5 == 0).collect();
        let lines = Lines::new(&topology, &sharp);
        let mut seen = vec![0; topology.mesh.n_edges()];
        for line in lines.all() {
            for &h in &line {
                seen[topology.mesh.edge(h).index()] += 1;
            }
            for pair in line.windows(2) {
                let v = topology.mesh.target(pair[0]);
                assert_eq!(v, topology.mesh.origin(pair[1]));
                assert!(!lines.ends[v.index()]);
            }
        }
        for e in topology.mesh.edges() {
            assert_eq!(seen[e.index()], u32::from(sharp[e.index()] && !topology.mesh.is_boundary_edge(e)));
        }
    }

    #[test]
    fn directions_agree_with_the_field_from_both_sides_of_an_edge() {
        let topology = sample_topology();
        let metric = Metric::new(&topology.mesh);
        let sharp = vec![true; topology.mesh.n_edges()];
        for headed in feature_directions(&topology, &metric, &topology.angle, &sharp) {
            let h = headed.halfedge;
            let turns = (metric.direction(h) - topology.angle[topology.mesh.face(h).index()]) / FRAC_PI_2;
            let off = turns - f64::from(headed.heading);
            assert!(((off - 4.0 * (off / 4.0).round()).abs() - headed.off).abs() < 1e-9, "{headed:?}");
            if let Some(t) = topology.mesh.twin(h) {
                // Against the edge its heading is the opposite one, in the frame of the other triangle.
                let back = heading_in(&topology, t, &headed);
                assert_eq!((back + topology.jump_across(h) + 2).rem_euclid(4), headed.heading);
            }
        }
    }
}
