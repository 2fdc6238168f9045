//! Repairs of a triangle list that are certain, each one listed.
//!
//! In this order: weld vertices where no face shares any, drop faces without three different corners, drop
//! copies of faces, split vertices where several fans of faces touch, orient each component consistently (and a
//! closed one outwards), drop vertices that no face uses. An edge of more than two faces and a surface
//! with one side are refused. Faces of zero area are kept: slivers are legal.

mod orient;
mod split;

use std::collections::HashMap;
use std::fmt;

use glam::DVec3;

use super::load::{FaceRef, LoadError, VertexRef};
use super::read::RawMesh;
use super::triangulate::Triangles;

/// A change made to a mesh on loading.
#[derive(Debug, Clone, PartialEq)]
pub enum Repair {
    /// Vertices at the same place were made one, since no two faces shared any.
    Welded {
        /// How many vertices became another one.
        count: usize,
    },
    /// Faces without three different corners were dropped.
    DroppedDegenerateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FaceRef,
    },
    /// Faces with the same corners as another were dropped.
    DroppedDuplicateFaces {
        /// How many.
        count: usize,
        /// The first.
        first: FaceRef,
    },
    /// Triangles were turned round so that their component has a consistent orientation.
    Reoriented {
        /// How many.
        count: usize,
        /// The face of the first.
        first: FaceRef,
    },
    /// A closed component that faced inwards was turned outwards.
    TurnedOutwards {
        /// How many triangles it has.
        count: usize,
        /// Its first face.
        first: FaceRef,
    },
    /// Vertices where several fans of faces touch were split, one vertex for each fan.
    SplitVertices {
        /// How many vertices.
        count: usize,
        /// The first.
        first: VertexRef,
    },
    /// Vertices that no face uses were dropped.
    DroppedUnusedVertices {
        /// How many.
        count: usize,
        /// The first.
        first: VertexRef,
    },
}

impl fmt::Display for Repair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |count: usize, singular: &str, plural: &str| match count {
            1 => format!("1 {singular}"),
            n => format!("{n} {plural}"),
        };
        let faces = |count: usize| one(count, "face", "faces");
        let vertices = |count: usize| one(count, "vertex", "vertices");
        match self {
            Self::Welded { count } => write!(f, "merged {} lying at the place of another", vertices(*count)),
            Self::DroppedDegenerateFaces { count, first } => {
                write!(f, "dropped {} without three different corners (first: {first})", faces(*count))
            }
            Self::DroppedDuplicateFaces { count, first } => {
                write!(f, "dropped {} with the corners of another face (first: {first})", faces(*count))
            }
            Self::Reoriented { count, first } => {
                write!(
                    f,
                    "turned round {} against their neighbours (first: {first})",
                    one(*count, "triangle", "triangles")
                )
            }
            Self::TurnedOutwards { count, first } => {
                let triangles = one(*count, "triangle", "triangles");
                write!(
                    f,
                    "turned a closed surface of {triangles} inside out, as it faced inwards (it begins with {first})"
                )
            }
            Self::SplitVertices { count, first } => {
                write!(f, "split {} where several sheets touch in a point (first: {first})", vertices(*count))
            }
            Self::DroppedUnusedVertices { count, first } => {
                write!(f, "dropped {} that no face uses (first: {first})", vertices(*count))
            }
        }
    }
}

/// The vertices and triangles after all repairs, and what was done.
pub(super) type Repaired = (Vec<DVec3>, Vec<[u32; 3]>, Vec<Repair>);

/// Makes the triangles of a file an oriented manifold.
pub(super) fn repair(raw: RawMesh, triangles: Triangles) -> Result<Repaired, LoadError> {
    let mut work = Work { faces: triangles.faces, source: triangles.source, repairs: Vec::new(), raw };
    work.weld();
    work.drop_degenerate(&triangles.dropped);
    work.drop_duplicates();
    if work.faces.is_empty() {
        return Err(LoadError::NoFaces { vertices: work.raw.positions.len() });
    }
    let pairs = work.pair_edges()?;
    work.split_vertices(&pairs);
    work.orient(&pairs)?;
    work.drop_unused();
    Ok((work.raw.positions, work.faces, work.repairs))
}

struct Work {
    raw: RawMesh,
    faces: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    source: Vec<u32>,
    repairs: Vec<Repair>,
}

/// "No neighbour" in a list of pairs.
const NONE: u32 = u32::MAX;

/// For each side `3 f + i` of triangle `f` the side of the neighbour, or `NONE`.
type Pairs = Vec<u32>;

impl Work {
    fn face_ref(&self, triangle: usize) -> FaceRef {
        self.raw.face_ref(self.source[triangle] as usize)
    }

    fn vertex_ref(&self, vertex: usize) -> VertexRef {
        VertexRef { number: vertex + self.raw.base, position: self.raw.positions[vertex] }
    }

    /// Welds by exact position where the format shares no vertices, or where each corner has a vertex of its own.
    fn weld(&mut self) {
        let unshared = self.faces.len() > 1 && self.is_unshared();
        if !self.raw.soup && !unshared {
            return;
        }
        let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.raw.positions.len());
        let mut kept: Vec<DVec3> = Vec::new();
        let mut welded = Vec::with_capacity(self.raw.positions.len());
        for &p in &self.raw.positions {
            // Adding zero makes −0 the same as 0.
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            let next = kept.len() as u32;
            let v = *known.entry(key).or_insert(next);
            if v == next {
                kept.push(p);
            }
            welded.push(v);
        }
        let count = welded.len() - kept.len();
        if count > 0 && !self.raw.soup {
            self.repairs.push(Repair::Welded { count });
        }
        self.raw.positions = kept;
        for v in self.faces.iter_mut().flatten() {
            *v = welded[*v as usize];
        }
    }

    /// Whether no two polygons share a vertex.
    fn is_unshared(&self) -> bool {
        let mut used_by = vec![NONE; self.raw.positions.len()];
        (0..self.raw.n_polygons()).all(|i| {
            self.raw.polygon(i).iter().all(|&v| {
                let user = std::mem::replace(&mut used_by[v as usize], i as u32);
                user == NONE || user == i as u32
            })
        })
    }

    fn drop_degenerate(&mut self, polygons: &[u32]) {
        let degenerate = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
        let triangles = (0..self.faces.len()).filter(|&f| degenerate(&self.faces[f])).map(|f| self.source[f]);
        let mut dropped: Vec<u32> = polygons.iter().copied().chain(triangles).collect();
        dropped.sort_unstable();
        dropped.dedup();
        if let Some(&first) = dropped.first() {
            let first = self.raw.face_ref(first as usize);
            self.repairs.push(Repair::DroppedDegenerateFaces { count: dropped.len(), first });
        }
        let drop: Vec<bool> = self.faces.iter().map(degenerate).collect();
        self.drop_triangles(&drop);
    }

    fn drop_duplicates(&mut self) {
        let sorted = |f: u32| {
            let mut corners = self.faces[f as usize];
            corners.sort_unstable();
            corners
        };
        let mut order: Vec<u32> = (0..self.faces.len() as u32).collect();
        order.sort_unstable_by_key(|&f| (sorted(f), f));
        let mut drop = vec![false; self.faces.len()];
        for w in order.windows(2) {
            drop[w[1] as usize] = sorted(w[0]) == sorted(w[1]);
        }
        if let Some(first) = drop.iter().position(|&d| d) {
            let count = drop.iter().filter(|&&d| d).count();
            self.repairs.push(Repair::DroppedDuplicateFaces { count, first: self.face_ref(first) });
        }
        self.drop_triangles(&drop);
    }

    fn drop_triangles(&mut self, drop: &[bool]) {
        let mut keep = drop.iter().map(|d| !d);
        self.faces.retain(|_| keep.next().unwrap_or(true));
        let mut keep = drop.iter().map(|d| !d);
        self.source.retain(|_| keep.next().unwrap_or(true));
    }

    /// The ends of side `h`, in its direction.
    fn side(&self, h: u32) -> (u32, u32) {
        let f = self.faces[h as usize / 3];
        (f[h as usize % 3], f[(h as usize + 1) % 3])
    }

    /// Pairs the sides of neighbouring triangles, whatever their directions.
    fn pair_edges(&self) -> Result<Pairs, LoadError> {
        let key = |h: u32| {
            let (a, b) = self.side(h);
            (a.min(b), a.max(b))
        };
        let mut sides: Vec<((u32, u32), u32)> = (0..3 * self.faces.len() as u32).map(|h| (key(h), h)).collect();
        sides.sort_unstable();
        let mut pairs = vec![NONE; sides.len()];
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            match *edge {
                [_] => {}
                [(_, h), (_, g)] => {
                    pairs[h as usize] = g;
                    pairs[g as usize] = h;
                }
                _ => {
                    let ((a, b), _) = edge[0];
                    return Err(LoadError::NonManifoldEdge {
                        from: self.vertex_ref(a as usize),
                        to: self.vertex_ref(b as usize),
                        count: edge.len(),
                        first: self.face_ref(edge[0].1 as usize / 3),
                        second: self.face_ref(edge[1].1 as usize / 3),
                    });
                }
            }
        }
        Ok(pairs)
    }

    fn drop_unused(&mut self) {
        let mut used = vec![false; self.raw.positions.len()];
        for &v in self.faces.iter().flatten() {
            used[v as usize] = true;
        }
        let Some(first) = used.iter().position(|u| !u) else { return };
        let count = used.iter().filter(|&&u| !u).count();
        self.repairs.push(Repair::DroppedUnusedVertices { count, first: self.vertex_ref(first) });
        let mut renamed = vec![NONE; used.len()];
        let mut kept = Vec::with_capacity(used.len() - count);
        for v in (0..used.len()).filter(|&v| used[v]) {
            renamed[v] = kept.len() as u32;
            kept.push(self.raw.positions[v]);
        }
        self.raw.positions = kept;
        for v in self.faces.iter_mut().flatten() {
            *v = renamed[*v as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::load::{LoadedMesh, parse};

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\n";

    fn obj(faces: &str) -> Result<LoadedMesh, LoadError> {
        parse(format!("{CORNERS}{faces}").as_bytes(), "test.obj")
    }

    #[test]
    fn each_repair_is_listed() {
        let good = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
        let unused = |m: &LoadedMesh| matches!(m.repairs.last(), Some(Repair::DroppedUnusedVertices { count: 1, .. }));
        let m = obj(good).unwrap();
        assert!(m.repairs.len() == 1 && unused(&m));

        let m = obj(&format!("{good}f 4 2 1\nf 1 1 2\n")).unwrap();
        let listed: Vec<String> = m.repairs.iter().map(ToString::to_string).collect();
        assert_eq!(listed[0], "dropped 1 face without three different corners (first: face 6 (line 11))");
        assert_eq!(listed[1], "dropped 1 face with the corners of another face (first: face 5 (line 10))");
        assert_eq!(listed[2], "dropped 1 vertex that no face uses (first: vertex 5 at (5, 5, 5))");

        let m = obj("f 1 3 2\nf 1 4 2\nf 2 3 4\nf 3 1 4\n").unwrap();
        assert!(matches!(m.repairs[0], Repair::Reoriented { count: 1, first: FaceRef { number: 2, .. } }));

        let m = obj("f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n").unwrap();
        assert!(matches!(m.repairs[0], Repair::TurnedOutwards { count: 4, .. }));
        let outwards = m.mesh.faces().all(|f| {
            let a = m.mesh.position(m.mesh.face_vertices(f)[0]);
            let middle = m.mesh.positions().iter().sum::<DVec3>() / 4.0;
            m.mesh.face_area_vector(f).dot(a - middle) > 0.0
        });
        assert!(outwards);
    }

    #[test]
    fn an_inner_surface_may_bound_a_cavity() {
        let shell = |scale: f64, shift: f64, from: usize, inward: bool| {
            let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(|p| p.map(|x| x * scale + shift));
            let vertices = p.map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).concat();
            let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|mut f| {
                if inward {
                    f.swap(1, 2);
                }
                let [a, b, c] = f.map(|v| v + from);
                format!("f {a} {b} {c}\n")
            });
            vertices + &faces.concat()
        };
        let nested = shell(10.0, 0.0, 1, false) + &shell(1.0, 1.0, 5, true);
        assert_eq!(parse(nested.as_bytes(), "a.obj").unwrap().repairs, []);
        let apart = shell(1.0, 5.0, 1, false) + &shell(1.0, 1.0, 5, true);
        assert!(matches!(parse(apart.as_bytes(), "a.obj").unwrap().repairs[..], [Repair::TurnedOutwards { .. }]));
    }

    #[test]
    fn touching_sheets_are_split() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
        let m = parse(text.as_bytes(), "a.obj").unwrap();
        assert_eq!(m.mesh.n_vertices(), 6);
        assert!(matches!(m.repairs[..], [Repair::SplitVertices { count: 1, .. }]));
    }

    #[test]
    fn what_is_not_certain_is_refused() {
        let message = |faces: &str| obj(faces).unwrap_err().to_string();
        assert_eq!(
            message("f 1 2 3\nf 2 1 4\nf 1 2 5\n"),
            "3 faces share the edge from vertex 1 at (0, 0, 0) to vertex 2 at (1, 0, 0) (among them face 1 (line 6) and \
             face 2 (line 7)); at most two may"
        );
        assert!(message("f 1 2 9\n").contains("face 1 (line 6) names vertex 9, but there are only 5"));
        assert!(message("").contains("no faces"));
        assert!(message("f 1 1 2\n").contains("no faces"));
        // A Moebius strip of five triangles.
        assert!(message("f 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2\n").contains("one side"));
        assert!(matches!(parse(b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "a.obj"), Err(LoadError::NoSize)));
    }
}
