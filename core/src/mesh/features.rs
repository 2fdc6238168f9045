//! Sharp edges, by dihedral angle.
//!
//! The angle is that between the normals of the two faces. A sliver has a normal made of rounding errors only;
//! so a face too thin to have one borrows that of the neighbour across its longest edge, the face it lies
//! flat against. Then a crease next to a sliver is found on the sliver's other edges, and no false one inside.

use glam::DVec3;

use super::kernel::{FaceId, TriMesh};

/// Default threshold of [`sharp_edges`] in radians: 40°. A round tube of only twelve sides bends by 30° at each
/// edge and is meant smooth; the flattest crease common in machine parts is a 45° chamfer.
pub const SHARP_DIHEDRAL: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// A face of smaller height than this (in bounding-box diagonals) has no normal of its own. Files mostly hold six or
/// seven digits, so positions are off by up to 1e-6, and a height of 2e-5 leaves the normal uncertain by 3°.
const THIN: f64 = 2e-5;

/// For each edge whether its faces meet at an angle of more than `dihedral` radians away from flat; boundary edges
/// are not sharp. Expects a mesh normalised to bounding-box diagonal 1.
pub fn sharp_edges(mesh: &TriMesh, dihedral: f64) -> Vec<bool> {
    let normals = carried_normals(mesh);
    let is_sharp = |h| {
        let twin = mesh.twin(h)?;
        let (a, b) = (normals[mesh.face(h).index()], normals[mesh.face(twin).index()]);
        // The arc tangent is exact near flat and near folded, where the arc cosine is not.
        Some(a.cross(b).length().atan2(a.dot(b)) > dihedral)
    };
    mesh.edges().map(|e| is_sharp(mesh.halfedge(e)).unwrap_or(false)).collect()
}

/// The unit normal of each face; a thin face has that of the face it lies against, or zero if there is none.
fn carried_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let carrier: Vec<FaceId> = mesh.faces().map(|f| carrier(mesh, f)).collect();
    let normal = |mut f: FaceId| {
        // Thin faces may lie against each other in a ring: as many steps as there are faces lead out or never will.
        // Chains are short in practice, so a small bound serves.
        const STEPS: usize = 64;
        for _ in 0..STEPS {
            if carrier[f.index()] == f {
                break;
            }
            f = carrier[f.index()];
        }
        mesh.face_normal(f)
    };
    mesh.faces().map(normal).collect()
}

/// The face itself, or if it is thin the neighbour across its longest edge.
fn carrier(mesh: &TriMesh, f: FaceId) -> FaceId {
    let sides = mesh.face_halfedges(f);
    let length = sides.map(|h| mesh.vector(h).length());
    let longest = (1..3).fold(0, |best, i| if length[i] > length[best] { i } else { best });
    let height = mesh.face_area_vector(f).length() / length[longest];
    // A face of no extent at all has no height that compares.
    if height >= THIN { f } else { mesh.twin(sides[longest]).map_or(f, |t| mesh.face(t)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::parse;

    fn count(text: &str, degrees: f64) -> usize {
        let mesh = parse(text.as_bytes(), "test.obj").unwrap().mesh;
        sharp_edges(&mesh, degrees.to_radians()).iter().filter(|&&s| s).count()
    }

    const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                        f 4 3 2 1\nf 5 6 7 8\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    #[test]
    fn a_cube_has_its_twelve_edges() {
        let closed = format!("{CUBE}f 1 2 6 5\n");
        assert_eq!((count(&closed, 40.0), count(&closed, 91.0)), (12, 0));
        // Open, the four edges of the missing side are boundary.
        assert_eq!(count(CUBE, 40.0), 8);
    }

    #[test]
    fn slivers_make_no_false_features() {
        // A flat square whose diagonal is split by vertices off the plane by rounding only.
        let flat = |z: f64| {
            format!(
                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5000001 {z}\nv 0.5 0.4999999 {}\n\
                 f 1 2 6\nf 2 3 6\nf 1 6 5\nf 6 3 5\nf 3 4 5\nf 4 1 5\n",
                -z
            )
        };
        assert_eq!(count(&flat(1e-7), 20.0), 0);
        // The cube's edge 1-2 with a sliver on it: the crease is found once, on the way along either side.
        let sliver = format!("{CUBE}v 0.5 1e-7 -1e-7\nf 1 2 6 5\n").replace("f 4 3 2 1", "f 4 3 2 9 1\nf 1 9 2");
        let edges = count(&sliver, 40.0);
        assert!((12..=13).contains(&edges), "{edges}");
    }
}
