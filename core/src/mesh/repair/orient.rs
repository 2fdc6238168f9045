//! Consistent orientation of each component.
//!
//! A walk over edges from a component's first triangle finds which triangles are oriented against it; if a triangle is
//! reached with both orientations, the surface is not orientable. A closed component is oriented so that its volume is
//! positive, an open one as most of its triangles are.

use glam::DVec3;

use super::report::Repair;
use super::soup::{NONE, Pairs, TriangleSoup};
use crate::mesh::error::LoadError;

impl TriangleSoup {
    /// Orients each component consistently, closed ones outwards. A closed component inside another one, consistently
    /// oriented inwards, is kept: it may bound a cavity.
    ///
    /// # Errors
    ///
    /// [`LoadError::NonOrientable`].
    pub(super) fn orient(&mut self, pairs: &Pairs) -> Result<(), LoadError> {
        let components = self.components(pairs)?;
        let boxes: Vec<Option<[DVec3; 2]>> = components.iter().map(|c| self.closed_box(c, pairs)).collect();
        let mut first_reversed = None;
        let mut n_reversed = 0;
        let mut flip = vec![false; self.faces.len()];
        for (i, component) in components.iter().enumerate() {
            let n = component.len();
            let against = component.iter().filter(|&&(_, turned)| turned).count();
            let volume = if boxes[i].is_some() { self.volume(component) } else { 0.0 };
            // Whether the first triangle is to be reversed: against the majority if the component is open, or may bound a
            // cavity; else if the volume is negative.
            let flip_first = if volume == 0.0 || (volume < 0.0 || against > 0) && is_enclosed(&boxes, i) {
                2 * against > n
            } else {
                volume < 0.0
            };
            let reversed = |&&(f, turned): &&(u32, bool)| (turned != flip_first).then_some(f as usize);
            if against == 0 && flip_first {
                let first = component.iter().map(|&(f, _)| f as usize).min().unwrap_or(0);
                self.repairs.push(Repair::TurnedOutwards { count: n, first: self.face_ref(first) });
            } else {
                let least = component.iter().filter_map(|c| reversed(&c)).min();
                first_reversed = first_reversed.into_iter().chain(least).min();
                n_reversed += component.iter().filter_map(|c| reversed(&c)).count();
            }
            for f in component.iter().filter_map(|c| reversed(&c)) {
                flip[f] = true;
            }
        }
        if let Some(first) = first_reversed {
            self.repairs.push(Repair::Reoriented { count: n_reversed, first: self.face_ref(first) });
        }
        for (face, _) in self.faces.iter_mut().zip(flip).filter(|(_, flip)| *flip) {
            face.swap(1, 2);
        }
        Ok(())
    }

    /// The triangles of each component, each with whether it is oriented against the component's first.
    fn components(&self, pairs: &Pairs) -> Result<Vec<Vec<(u32, bool)>>, LoadError> {
        let mut turned: Vec<Option<bool>> = vec![None; self.faces.len()];
        let mut components = Vec::new();
        for seed in 0..self.faces.len() as u32 {
            if turned[seed as usize].is_some() {
                continue;
            }
            turned[seed as usize] = Some(false);
            let mut component = vec![(seed, false)];
            let mut next = 0;
            while next < component.len() {
                let (f, f_turned) = component[next];
                next += 1;
                for h in 3 * f..3 * f + 3 {
                    let g = pairs[h as usize];
                    if g == NONE {
                        continue;
                    }
                    let g_turned = f_turned ^ (self.side(h) == self.side(g));
                    match turned[g as usize / 3] {
                        None => {
                            turned[g as usize / 3] = Some(g_turned);
                            component.push((g / 3, g_turned));
                        }
                        Some(known) if known != g_turned => {
                            let near = self.vertex_ref(self.side(h).0 as usize);
                            return Err(LoadError::NonOrientable { face: self.face_ref(f as usize), near });
                        }
                        Some(_) => {}
                    }
                }
            }
            components.push(component);
        }
        Ok(components)
    }

    /// Bounding box of a component; `None` if it has a boundary.
    fn closed_box(&self, component: &[(u32, bool)], pairs: &Pairs) -> Option<[DVec3; 2]> {
        let closed = component.iter().all(|&(f, _)| (3 * f..3 * f + 3).all(|h| pairs[h as usize] != NONE));
        let vertices = component.iter().flat_map(|&(f, _)| self.faces[f as usize]);
        let points = vertices.map(|v| self.raw.positions[v as usize]);
        let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        closed.then(|| points.fold(start, |[min, max], p| [min.min(p), max.max(p)]))
    }

    /// Six times the volume inside a closed component, as oriented by its first triangle.
    fn volume(&self, component: &[(u32, bool)]) -> f64 {
        let position = |v: u32| self.raw.positions[v as usize];
        let centre = component.first().map_or(DVec3::ZERO, |&(f, _)| position(self.faces[f as usize][0]));
        let signed = component.iter().map(|&(f, turned)| {
            let [a, b, c] = self.faces[f as usize].map(|v| position(v) - centre);
            let six = a.dot(b.cross(c));
            if turned { -six } else { six }
        });
        signed.sum()
    }
}

/// Whether the bounding box of a closed component lies inside that of another one, of which it may bound a cavity.
fn is_enclosed(boxes: &[Option<[DVec3; 2]>], component: usize) -> bool {
    boxes[component].is_some_and(|inner| {
        let encloses = |outer: &[DVec3; 2]| outer[0].cmplt(inner[0]).all() && outer[1].cmpgt(inner[1]).all();
        boxes.iter().flatten().any(encloses)
    })
}
