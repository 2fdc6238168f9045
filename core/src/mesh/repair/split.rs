//! One vertex per fan of triangles.
//!
//! Where two triangles share an edge, their corners at both ends are joined; the resulting sets of corners are the fans.
//! This needs no orientation, so it comes before orientation.

use super::report::Repair;
use super::soup::{NONE, Pairs, TriangleSoup};
use crate::union_find::UnionFind;

impl TriangleSoup {
    /// Splits each vertex into one vertex per fan of triangles; the first fan keeps the vertex.
    pub(super) fn split_vertices(&mut self, pairs: &Pairs) {
        let mut fans = UnionFind::new(3 * self.faces.len());
        for (h, &g) in pairs.iter().enumerate().filter(|&(h, &g)| g != NONE && (h as u32) < g) {
            for (i, v) in self.faces[h / 3].into_iter().enumerate() {
                if let Some(j) = self.faces[g as usize / 3].iter().position(|&w| w == v)
                    && [self.side(g).0, self.side(g).1].contains(&v)
                {
                    fans.join(3 * (h as u32 / 3) + i as u32, 3 * (g / 3) + j as u32);
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
