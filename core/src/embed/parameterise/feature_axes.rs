//! Which coordinate stays constant along a feature.
//!
//! One edge cannot tell: beside a node the field turns within a few triangles, and an edge there may be nearer to the
//! wrong one of its directions. So a whole line decides, from corner to corner or node to node. It goes straight on in the
//! map, but for places where it is plain that it does not: of all ways to give its edges headings, that is taken for
//! which deviations from the field, squared and weighed by length, and a price for every change of heading are least.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

use crate::embed::topology::embedding_topology::{EmbeddingTopology, jump_across};
use crate::mesh::{HalfedgeId, VertexId};
use crate::surface::Metric;

/// The price of a change of heading: that of so many edges that run across the field.
const CHANGE: f64 = 20.0;
/// Cosine between the ends at a vertex above which a feature has a corner there: half way to a right angle.
const STRAIGHT: f64 = -FRAC_1_SQRT_2;

/// An edge of a feature: a half-edge, the direction of its triangle's cross along which it runs, and by how many quarter
/// turns the field deviates from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::embed) struct Headed {
    pub halfedge: HalfedgeId,
    pub heading: i32,
    pub off: f64,
}

/// The headings of all edges that are `sharp`, in the frames of a field of these angles; those on the boundary have none.
pub(in crate::embed) fn arc_headings(
    net: &EmbeddingTopology,
    metric: &Metric,
    angle: &[f64],
    sharp: &[bool],
) -> Vec<Headed> {
    let lines = Lines::new(net, sharp);
    let mut all = Vec::new();
    for line in lines.all() {
        all.extend(headed(net, metric, angle, &line));
    }
    all
}

/// The lines of all features, each as half-edges from corner to corner or node to node, or once around.
pub(in crate::embed) fn lines(net: &EmbeddingTopology, sharp: &[bool]) -> Vec<Vec<HalfedgeId>> {
    Lines::new(net, sharp).all()
}

/// The features of a mesh as a graph.
struct Lines<'a> {
    net: &'a EmbeddingTopology,
    feature: Vec<bool>,
    /// Whether a line ends at each vertex.
    ends: Vec<bool>,
}

impl<'a> Lines<'a> {
    fn new(net: &'a EmbeddingTopology, sharp: &[bool]) -> Self {
        let mesh = &net.mesh;
        let feature: Vec<bool> = mesh.edges().map(|e| sharp[e.index()] && !mesh.is_boundary_edge(e)).collect();
        let rays = |v: VertexId| mesh.outgoing(v).filter(|&h| feature[mesh.edge(h).index()]);
        let ends_at = |v: VertexId| {
            let list: Vec<_> = rays(v).map(|h| mesh.vector(h).normalize_or_zero()).collect();
            mesh.is_boundary_vertex(v) || list.len() != 2 || list[0].dot(list[1]) > STRAIGHT
        };
        let mut ends: Vec<bool> = mesh.vertices().map(ends_at).collect();
        for n in net.nodes.iter().filter(|n| !n.is_regular()) {
            ends[n.vertex.index()] = true;
        }
        Self { net, feature, ends }
    }

    /// All lines, each as half-edges from end to end, or once around.
    fn all(&self) -> Vec<Vec<HalfedgeId>> {
        let mesh = &self.net.mesh;
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

/// The headings along one line.
fn headed(net: &EmbeddingTopology, metric: &Metric, angle: &[f64], line: &[HalfedgeId]) -> Vec<Headed> {
    let mesh = &net.mesh;
    // The frame of the first triangle, carried along to the left of the line.
    let mut turned = vec![0];
    for w in line.windows(2) {
        let before = turned[turned.len() - 1];
        turned.push(before + turns_between(net, w[0], w[1]).unwrap_or(0));
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
    let chosen = cheapest(line.len(), |i, k| lengths[i] / mean * off(i, k).powi(2));
    let each = |(i, &h): (usize, &HalfedgeId)| {
        let k = chosen[i];
        // The boundary apart every edge has two half-edges: the one that stands for it is named.
        let own = (k - turned[i]).rem_euclid(4);
        let first = mesh.halfedge(mesh.edge(h));
        let heading = if first == h { own } else { (own - jump_across(mesh, &net.jump, h) + 2).rem_euclid(4) };
        Headed { halfedge: first, heading, off: off(i, k).abs() }
    };
    line.iter().enumerate().map(each).collect()
}

/// By how many quarters the frame of the triangle of `a` is to be turned to become that of `b`, around the vertex between
/// them and to their left: direction `k` of the first is direction `k − turns` of the second.
fn turns_between(net: &EmbeddingTopology, a: HalfedgeId, b: HalfedgeId) -> Option<i32> {
    let mesh = &net.mesh;
    let mut turns = 0;
    let mut at = b;
    // Counter-clockwise from the triangle of `b` to that of `a`.
    while mesh.prev(at) != a {
        let across = mesh.prev(at);
        at = mesh.twin(across)?;
        turns += jump_across(mesh, &net.jump, at);
        if at == b {
            return None;
        }
    }
    Some(turns)
}

/// For each of `n` places in a row the heading such that the sum of their costs and of the price of changes is least.
fn cheapest(n: usize, cost: impl Fn(usize, i32) -> f64) -> Vec<i32> {
    let mut total = [0, 1, 2, 3].map(|k| cost(0, k));
    let mut came: Vec<[i32; 4]> = vec![[0; 4]];
    for i in 1..n {
        let best = |k: i32| {
            let with_change = |j: i32| total[j as usize] + if j == k { 0.0 } else { CHANGE };
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

/// The heading along a side in its own triangle, from that of its edge's half-edge in that one's triangle.
pub(in crate::embed) fn heading_in(net: &EmbeddingTopology, side: HalfedgeId, of: &Headed) -> i32 {
    if of.halfedge == side {
        return of.heading;
    }
    (of.heading - jump_across(&net.mesh, &net.jump, of.halfedge) + 2).rem_euclid(4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::net;

    #[test]
    fn a_few_edges_across_the_field_do_not_change_the_heading_and_many_do() {
        // Edges that follow heading 1, but for some in between that run along heading 2.
        let line = |n: usize, from: usize, to: usize| {
            let along = move |i: usize| if (from..to).contains(&i) { 2 } else { 1 };
            cheapest(n, move |i, k| if k == along(i) { 0.0 } else { 1.0 })
        };
        assert_eq!(line(100, 40, 50), vec![1; 100]);
        assert_eq!(line(60, 56, 60), vec![1; 60]);
        let turned = line(100, 40, 100);
        assert!(turned[..40].iter().all(|&k| k == 1) && turned[40..].iter().all(|&k| k == 2));
    }

    #[test]
    fn lines_go_from_end_to_end_and_every_edge_is_on_one() {
        let net = net();
        let sharp: Vec<bool> = net.mesh.edges().map(|e| e.0 % 5 == 0).collect();
        let lines = Lines::new(&net, &sharp);
        let mut seen = vec![0; net.mesh.n_edges()];
        for line in lines.all() {
            for &h in &line {
                seen[net.mesh.edge(h).index()] += 1;
            }
            for pair in line.windows(2) {
                let v = net.mesh.target(pair[0]);
                assert_eq!(v, net.mesh.origin(pair[1]));
                assert!(!lines.ends[v.index()]);
            }
        }
        for e in net.mesh.edges() {
            assert_eq!(seen[e.index()], u32::from(sharp[e.index()] && !net.mesh.is_boundary_edge(e)));
        }
    }

    #[test]
    fn the_heading_is_the_direction_that_the_edge_follows() {
        let net = net();
        let metric = Metric::new(&net.mesh);
        let sharp = vec![true; net.mesh.n_edges()];
        for headed in arc_headings(&net, &metric, &net.angle, &sharp) {
            let h = headed.halfedge;
            let turns = (metric.direction(h) - net.angle[net.mesh.face(h).index()]) / FRAC_PI_2;
            let off = turns - f64::from(headed.heading);
            assert!(((off - 4.0 * (off / 4.0).round()).abs() - headed.off).abs() < 1e-9, "{headed:?}");
            if let Some(t) = net.mesh.twin(h) {
                // Against the edge its heading is the opposite one, in the frame of the other triangle.
                let back = heading_in(&net, t, &headed);
                assert_eq!((back + jump_across(&net.mesh, &net.jump, h) + 2).rem_euclid(4), headed.heading);
            }
        }
    }
}
