//! One vertex for each fan of triangles.
//!
//! Corners of triangles that share an edge are united at both ends of it; the classes are the fans. This depends on
//! no orientation, so it can be done before there is one.

use super::{NONE, Pairs, Repair, Work};

impl Work {
    /// Gives each fan of triangles at a vertex a vertex of its own.
    pub(super) fn split_vertices(&mut self, pairs: &Pairs) {
        let mut fans = Fans::new(3 * self.faces.len());
        for (h, &g) in pairs.iter().enumerate().filter(|&(h, &g)| g != NONE && (h as u32) < g) {
            for (i, v) in self.faces[h / 3].into_iter().enumerate() {
                if let Some(j) = self.faces[g as usize / 3].iter().position(|&w| w == v)
                    && [self.side(g).0, self.side(g).1].contains(&v)
                {
                    fans.unite(3 * (h as u32 / 3) + i as u32, 3 * (g / 3) + j as u32);
                }
            }
        }
        let mut first_fan = vec![NONE; self.raw.positions.len()];
        let mut vertex_of_fan = vec![NONE; 3 * self.faces.len()];
        let mut split = Vec::new();
        for corner in 0..3 * self.faces.len() {
            let fan = fans.root(corner as u32);
            let v = &mut self.faces[corner / 3][corner % 3];
            let first = &mut first_fan[*v as usize];
            if *first == NONE {
                *first = fan;
                vertex_of_fan[fan as usize] = *v;
            } else if vertex_of_fan[fan as usize] == NONE {
                vertex_of_fan[fan as usize] = self.raw.positions.len() as u32;
                self.raw.positions.push(self.raw.positions[*v as usize]);
                split.push(*v);
            }
            *v = vertex_of_fan[fan as usize];
        }
        split.sort_unstable();
        split.dedup();
        if let Some(&first) = split.first() {
            self.repairs.push(Repair::SplitVertices { count: split.len(), first: self.vertex_ref(first as usize) });
        }
    }
}

/// Corners of triangles, united to the fans they form around their vertices.
struct Fans(Vec<u32>);

impl Fans {
    fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    /// The smaller root stays a root.
    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
