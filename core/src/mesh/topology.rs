//! Components, boundary loops, Euler characteristic and genus.
//!
//! Triangles that share an edge are of one component. On an oriented component with `b` boundary loops the genus `g`
//! follows from the Euler characteristic: `V − E + F = 2 − 2g − b`.

use super::ids::{FaceId, HalfedgeId};
use super::kernel::TriMesh;
use super::traversal;

/// The topology of a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topology {
    /// The connected components, in the order of their first faces.
    pub components: Vec<Component>,
    /// The component of each face.
    pub component_of_face: Vec<u32>,
    /// The boundary loops: half-edges without twin, each ending where the next begins.
    pub boundary_loops: Vec<Vec<HalfedgeId>>,
    /// Euler characteristic `V − E + F` of the whole mesh.
    pub euler: i64,
    /// Sum of the genera of all components.
    pub genus: usize,
}

/// One connected component.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Component {
    /// Its first face.
    pub first_face: FaceId,
    /// Number of triangles.
    pub n_faces: usize,
    /// Number of vertices.
    pub n_vertices: usize,
    /// Number of edges.
    pub n_edges: usize,
    /// Its boundary loops, as indices into [`Topology::boundary_loops`].
    pub boundary_loops: Vec<usize>,
}

impl Component {
    /// Euler characteristic `V − E + F`.
    pub fn euler(&self) -> i64 {
        self.n_vertices as i64 - self.n_edges as i64 + self.n_faces as i64
    }

    /// Genus: the number of handles.
    pub fn genus(&self) -> usize {
        ((2 - self.boundary_loops.len() as i64 - self.euler()) / 2).max(0) as usize
    }
}

impl Topology {
    /// The topology of `mesh`.
    pub fn new(mesh: &TriMesh) -> Self {
        let (mut components, component_of_face) = components(mesh);
        let of = |h: HalfedgeId| component_of_face[mesh.face(h).index()] as usize;
        for v in mesh.vertices() {
            components[of(mesh.vertex_halfedge(v))].n_vertices += 1;
        }
        for e in mesh.edges() {
            components[of(mesh.halfedge(e))].n_edges += 1;
        }
        let boundary_loops = boundary_loops(mesh);
        for (i, boundary) in boundary_loops.iter().enumerate() {
            components[of(boundary[0])].boundary_loops.push(i);
        }
        let genus = components.iter().map(Component::genus).sum();
        Self { components, component_of_face, boundary_loops, euler: mesh.euler_characteristic(), genus }
    }
}

/// The components with their faces counted, and the component of each face.
fn components(mesh: &TriMesh) -> (Vec<Component>, Vec<u32>) {
    let (of_face, count) = traversal::components(mesh.n_faces(), |f| mesh.adjacent_faces(f).map(|(_, g)| g));
    let empty =
        Component { first_face: FaceId(u32::MAX), n_faces: 0, n_vertices: 0, n_edges: 0, boundary_loops: Vec::new() };
    let mut components = vec![empty; count];
    for f in mesh.faces().rev() {
        let component = &mut components[of_face[f.index()] as usize];
        component.first_face = f;
        component.n_faces += 1;
    }
    (components, of_face)
}

/// The half-edges without twin, chained to loops.
fn boundary_loops(mesh: &TriMesh) -> Vec<Vec<HalfedgeId>> {
    let mut seen = vec![false; mesh.n_halfedges()];
    let mut loops = Vec::new();
    for start in mesh.halfedges().filter(|&h| mesh.twin(h).is_none()) {
        let mut boundary = Vec::new();
        let mut h = start;
        while !seen[h.index()] {
            seen[h.index()] = true;
            boundary.push(h);
            // `vertex_halfedge` of a boundary vertex is its only outgoing half-edge without twin.
            h = mesh.vertex_halfedge(mesh.target(h));
        }
        if !boundary.is_empty() {
            loops.push(boundary);
        }
    }
    loops
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn components_boundary_loops_and_genus_are_found() {
        // Triangles between an inner and an outer triangle, and a tetrahedron apart.
        let p: Vec<DVec3> = (0..10).map(|i| DVec3::new(f64::from(i), f64::from(i * i), f64::from(i % 3))).collect();
        let mut faces = Vec::new();
        for i in 0..3 {
            let j = (i + 1) % 3;
            faces.extend([[i, j, i + 3], [j, j + 3, i + 3]]);
        }
        faces.extend([[6, 8, 7], [6, 7, 9], [7, 8, 9], [8, 6, 9]]);
        let mesh = TriMesh::from_faces(p, &faces).unwrap();
        let t = Topology::new(&mesh);
        assert_eq!((t.components.len(), t.boundary_loops.len(), t.euler, t.genus), (2, 2, 2, 0));
        assert_eq!(t.components[0].boundary_loops, [0, 1]);
        assert_eq!((t.components[0].euler(), t.components[1].euler()), (0, 2));
        assert_eq!(t.component_of_face[..], [0, 0, 0, 0, 0, 0, 1, 1, 1, 1]);
        for boundary in &t.boundary_loops {
            assert_eq!(boundary.len(), 3);
            for (i, &h) in boundary.iter().enumerate() {
                assert_eq!(mesh.target(h), mesh.origin(boundary[(i + 1) % 3]));
            }
        }
    }
}
