//! Isotropic remeshing of a zero set (Botsch and Kobbelt 2004): edge splits, collapses and flips, and tangential smoothing,
//! each followed by projection onto the zero set.

use std::collections::HashSet;

use glam::DVec3;

use super::net::{Soup, normal};
use super::shapes::Shape;

/// Rounds of all four steps; angles no longer change after about ten.
const ROUNDS: usize = 14;

/// Rounds of flips for angle and smoothing at the end; chosen by hand.
const ANGLE_ROUNDS: usize = 4;

/// Passes of flips. Each touches a face at most once; a few reach all.
const FLIP_PASSES: usize = 6;

/// An undirected edge and the faces at it.
struct Edge {
    ends: (u32, u32),
    faces: Vec<u32>,
}

/// Remeshes to the edge length of the shape.
pub fn remesh(shape: &Shape, soup: Soup) -> Soup {
    let mut work = Work { shape, soup };
    for _ in 0..ROUNDS {
        while work.split() > 0 {}
        while work.collapse() > 0 {}
        work.flip(Work::improves_valence);
        work.smooth();
    }
    // At the end flips improve angles instead of valences.
    for _ in 0..ANGLE_ROUNDS {
        work.flip(Work::improves_angle);
        work.smooth();
    }
    work.flip(Work::improves_angle);
    work.compact()
}

struct Work<'a> {
    shape: &'a Shape,
    soup: Soup,
}

impl Work<'_> {
    fn at(&self, v: u32) -> DVec3 {
        self.soup.positions[v as usize]
    }

    fn length(&self, (a, b): (u32, u32)) -> f64 {
        self.at(a).distance(self.at(b))
    }

    /// All edges, in the order of their ends.
    fn edges(&self) -> Vec<Edge> {
        let mut sides: Vec<((u32, u32), u32)> = Vec::with_capacity(3 * self.soup.faces.len());
        for (f, face) in self.soup.faces.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (face[i], face[(i + 1) % 3]);
                sides.push(((a.min(b), a.max(b)), f as u32));
            }
        }
        sides.sort_unstable();
        let edge = |group: &[((u32, u32), u32)]| Edge { ends: group[0].0, faces: group.iter().map(|g| g.1).collect() };
        sides.chunk_by(|a, b| a.0 == b.0).map(edge).collect()
    }

    /// The faces at each vertex.
    fn stars(&self) -> Vec<Vec<u32>> {
        let mut stars = vec![Vec::new(); self.soup.positions.len()];
        for (f, face) in self.soup.faces.iter().enumerate() {
            for &v in face {
                stars[v as usize].push(f as u32);
            }
        }
        stars
    }

    fn neighbours(&self, stars: &[Vec<u32>], v: u32) -> Vec<u32> {
        let corners = stars[v as usize].iter().flat_map(|&f| self.soup.faces[f as usize]);
        let mut list: Vec<u32> = corners.filter(|&w| w != v).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// The midpoint of an edge, projected onto the zero set; of a boundary edge, within its plane.
    fn middle(&self, edge: &Edge) -> (DVec3, Option<usize>) {
        let (a, b) = edge.ends;
        let plane = if edge.faces.len() == 1 { self.soup.plane[a as usize] } else { None };
        (self.shape.project(0.5 * (self.at(a) + self.at(b)), plane), plane)
    }

    /// Splits edges longer than 4/3 of the wanted length, longest first, at most one per face; returns how many.
    fn split(&mut self) -> usize {
        let mut edges = self.edges();
        edges.retain(|e| self.length(e.ends) > 4.0 / 3.0 * self.shape.edge);
        edges.sort_by(|e, f| self.length(f.ends).total_cmp(&self.length(e.ends)));
        let mut touched = vec![false; self.soup.faces.len()];
        let mut n = 0;
        for edge in &edges {
            if edge.faces.iter().any(|&f| touched[f as usize]) {
                continue;
            }
            let (position, plane) = self.middle(edge);
            let middle = self.soup.positions.len() as u32;
            self.soup.positions.push(position);
            self.soup.plane.push(plane);
            for &f in &edge.faces {
                touched[f as usize] = true;
                let face = self.soup.faces[f as usize];
                let put = |v: u32| face.map(|w| if w == v { middle } else { w });
                self.soup.faces[f as usize] = put(edge.ends.0);
                self.soup.faces.push(put(edge.ends.1));
            }
            n += 1;
        }
        n
    }

    /// Collapses edges shorter than 4/5 of the wanted length, shortest first, with disjoint neighbourhoods; returns how
    /// many.
    fn collapse(&mut self) -> usize {
        let stars = self.stars();
        let mut edges = self.edges();
        edges.retain(|e| self.length(e.ends) < 4.0 / 5.0 * self.shape.edge);
        edges.sort_by(|e, f| self.length(e.ends).total_cmp(&self.length(f.ends)));
        let mut locked = vec![false; self.soup.positions.len()];
        let mut n = 0;
        for edge in &edges {
            let (a, b) = edge.ends;
            let (near_a, near_b) = (self.neighbours(&stars, a), self.neighbours(&stars, b));
            let near: Vec<u32> = near_a.iter().chain(&near_b).copied().collect();
            let common = near_a.iter().filter(|v| near_b.contains(v)).count();
            let on_boundary = |v: u32| self.soup.plane[v as usize].is_some();
            let inner_chord = on_boundary(a) && on_boundary(b) && edge.faces.len() == 2;
            if inner_chord || common != edge.faces.len() || near.iter().any(|&v| locked[v as usize]) {
                continue;
            }
            let (position, plane) = match (on_boundary(a), on_boundary(b)) {
                (true, false) => (self.at(a), self.soup.plane[a as usize]),
                (false, true) => (self.at(b), self.soup.plane[b as usize]),
                _ => self.middle(edge),
            };
            if !self.may_collapse(&stars, edge, &near, position) {
                continue;
            }
            self.soup.positions[a as usize] = position;
            self.soup.plane[a as usize] = plane;
            for &f in &stars[b as usize] {
                let face = &mut self.soup.faces[f as usize];
                *face = face.map(|v| if v == b { a } else { v });
            }
            near.iter().for_each(|&v| locked[v as usize] = true);
            n += 1;
        }
        self.soup.faces.retain(|&[a, b, c]| a != b && b != c && c != a);
        n
    }

    /// Whether a collapse makes no edge too long and no face turn by more than 60°.
    fn may_collapse(&self, stars: &[Vec<u32>], edge: &Edge, near: &[u32], position: DVec3) -> bool {
        let (a, b) = edge.ends;
        let reach = 4.0 / 3.0 * self.shape.edge;
        let others = near.iter().filter(|&&v| v != a && v != b);
        let turns = |v: u32| {
            let faces = stars[v as usize].iter().map(|&f| self.soup.faces[f as usize]);
            faces.filter(|f| !(f.contains(&a) && f.contains(&b))).any(|face| {
                let before = normal(&self.soup.positions, face);
                let [p, q, r] = face.map(|w| if w == v { position } else { self.at(w) });
                let after = (q - p).cross(r - p);
                after.dot(before) <= 0.5 * after.length() * before.length()
            })
        };
        others.clone().all(|&v| self.at(v).distance(position) < reach) && !turns(a) && !turns(b)
    }

    /// Flips the edges for which `better` holds, until there are none or the passes are used up.
    fn flip(&mut self, better: fn(&Self, &[i32], [u32; 4]) -> bool) {
        for _ in 0..FLIP_PASSES {
            let edges = self.edges();
            let mut exists: HashSet<(u32, u32)> = edges.iter().map(|e| e.ends).collect();
            let mut excess = self.valence_excess(&edges);
            let mut touched = vec![false; self.soup.faces.len()];
            let mut n = 0;
            for edge in &edges {
                let &[f, g] = edge.faces.as_slice() else { continue };
                if touched[f as usize] || touched[g as usize] {
                    continue;
                }
                let quad = self.quad(edge.ends, f, g);
                let [a, b, c, d] = quad;
                if exists.contains(&(c.min(d), c.max(d))) || !self.stays_flat(quad) || !better(self, &excess, quad) {
                    continue;
                }
                self.soup.faces[f as usize] = [c, d, b];
                self.soup.faces[g as usize] = [d, c, a];
                touched[f as usize] = true;
                touched[g as usize] = true;
                exists.insert((c.min(d), c.max(d)));
                for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
                    excess[v as usize] += change;
                }
                n += 1;
            }
            if n == 0 {
                break;
            }
        }
    }

    /// The corners of the two faces at an edge: face `f` is `a b c`, face `g` is `b a d`.
    fn quad(&self, (a, b): (u32, u32), f: u32, g: u32) -> [u32; 4] {
        let face = self.soup.faces[f as usize];
        let forward = (0..3).any(|i| face[i] == a && face[(i + 1) % 3] == b);
        let (a, b) = if forward { (a, b) } else { (b, a) };
        let other = |f: u32| self.soup.faces[f as usize].into_iter().find(|&v| v != a && v != b).unwrap_or(a);
        [a, b, other(f), other(g)]
    }

    /// Whether the normals of both faces after a flip are within 45° of the mean normal before.
    fn stays_flat(&self, [a, b, c, d]: [u32; 4]) -> bool {
        let n = |f: [u32; 3]| normal(&self.soup.positions, f);
        let before = (n([a, b, c]) + n([b, a, d])).normalize_or_zero();
        [n([c, d, b]), n([d, c, a])].iter().all(|m| m.dot(before) > 0.7 * m.length())
    }

    /// The valence of each vertex less the regular one, 6 inside and 4 on the boundary.
    fn valence_excess(&self, edges: &[Edge]) -> Vec<i32> {
        let mut excess: Vec<i32> = self.soup.plane.iter().map(|p| if p.is_some() { -4 } else { -6 }).collect();
        for e in edges {
            excess[e.ends.0 as usize] += 1;
            excess[e.ends.1 as usize] += 1;
        }
        excess
    }

    fn improves_valence(&self, excess: &[i32], [a, b, c, d]: [u32; 4]) -> bool {
        let cost = |v: u32, change: i32| (excess[v as usize] + change).pow(2);
        let before = cost(a, 0) + cost(b, 0) + cost(c, 0) + cost(d, 0);
        cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1) < before
    }

    fn improves_angle(&self, _: &[i32], [a, b, c, d]: [u32; 4]) -> bool {
        let angle = |v: u32| (self.at(a) - self.at(v)).angle_between(self.at(b) - self.at(v));
        // The Delaunay condition; the slack keeps squares from flipping back and forth.
        angle(c) + angle(d) > std::f64::consts::PI + 1e-3
    }

    /// Moves each vertex tangentially towards the mean of its neighbours; a boundary vertex along the boundary.
    fn smooth(&mut self) {
        let edges = self.edges();
        let mut sum = vec![DVec3::ZERO; self.soup.positions.len()];
        let mut count = vec![0.0; self.soup.positions.len()];
        for e in &edges {
            for (v, w) in [e.ends, (e.ends.1, e.ends.0)] {
                if self.soup.plane[v as usize].is_none() || e.faces.len() == 1 {
                    sum[v as usize] += self.at(w);
                    count[v as usize] += 1.0;
                }
            }
        }
        for v in (0..sum.len()).filter(|&v| count[v] > 0.0) {
            let p = self.soup.positions[v];
            let normal = self.shape.gradient(p).normalize_or_zero();
            let step = sum[v] / count[v] - p;
            self.soup.positions[v] =
                self.shape.project(p + 0.7 * (step - normal * normal.dot(step)), self.soup.plane[v]);
        }
    }

    /// Drops unused vertices and numbers the others in the order in which faces use them.
    fn compact(self) -> Soup {
        let mut new_index = vec![u32::MAX; self.soup.positions.len()];
        let mut out = Soup::default();
        for face in &self.soup.faces {
            for &v in face {
                if new_index[v as usize] == u32::MAX {
                    new_index[v as usize] = out.positions.len() as u32;
                    out.positions.push(self.soup.positions[v as usize]);
                    out.plane.push(self.soup.plane[v as usize]);
                }
            }
            out.faces.push(face.map(|v| new_index[v as usize]));
        }
        out
    }
}
