//! Feature edges, by dihedral angle.
//!
//! The angle is that between the normals of the two faces. The normal of a sliver is rounding error; a face below a least
//! height therefore takes the normal of the neighbour across its longest edge. A crease beside a sliver is then found at
//! the sliver's other edges, and the edges between coplanar slivers are not sharp.

use glam::DVec3;

use super::ids::{EdgeId, FaceId};
use super::kernel::TriMesh;
use super::traversal::BreadthFirst;

/// Default threshold of [`sharp_edges`] in radians: 40°. It lies between the 30° of a smooth tube tessellated with twelve
/// sides and the 45° of a chamfer, the flattest crease common in machine parts.
pub const SHARP_DIHEDRAL: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Default least length of features for [`drop_short_features`], in model sizes. Of the models tried, machine
/// parts keep all their creases at this value; animals and statues lose nearly all edges sharper than 40°, which there are
/// noise and coarse tessellation. Zero keeps all sharp edges.
pub const SHORT_FEATURE: f64 = 0.2;

/// Least height of a face whose own normal is used, in model sizes. Files mostly hold six or seven digits:
/// positions are off by up to 1e-6, and at this height the normal by up to 3°.
const MIN_HEIGHT: f64 = 2e-5;

/// For each edge, whether the normals of its faces differ by more than `dihedral` radians. Boundary edges are not sharp.
/// The mesh must be normalised.
pub fn sharp_edges(mesh: &TriMesh, dihedral: f64) -> Vec<bool> {
    let normals = robust_normals(mesh);
    let is_sharp = |h| {
        let twin = mesh.twin(h)?;
        let (a, b) = (normals[mesh.face(h).index()], normals[mesh.face(twin).index()]);
        // The arc tangent is accurate near 0 and π, the arc cosine is not.
        Some(a.cross(b).length().atan2(a.dot(b)) > dihedral)
    };
    mesh.edges().map(|e| is_sharp(mesh.halfedge(e)).unwrap_or(false)).collect()
}

/// The unit normal of each face; for a thin face that of the face found by following [`support`]. Zero if that face is
/// degenerate as well.
fn robust_normals(mesh: &TriMesh) -> Vec<DVec3> {
    let support: Vec<FaceId> = mesh.faces().map(|f| support(mesh, f)).collect();
    let normal = |mut f: FaceId| {
        // Longest chain of thin faces followed. Chains are short, unless thin faces support each other in a cycle; then
        // the last one's own normal is taken.
        const MAX_CHAIN: usize = 64;
        for _ in 0..MAX_CHAIN {
            if support[f.index()] == f {
                break;
            }
            f = support[f.index()];
        }
        mesh.face_normal(f)
    };
    mesh.faces().map(normal).collect()
}

/// The face itself, or if it is thin the neighbour across its longest edge.
fn support(mesh: &TriMesh, f: FaceId) -> FaceId {
    let sides = mesh.face_halfedges(f);
    let length = sides.map(|h| mesh.vector(h).length());
    let longest = (1..3).fold(0, |best, i| if length[i] > length[best] { i } else { best });
    let height = mesh.face_area_vector(f).length() / length[longest];
    // NaN for a face whose corners coincide: it counts as thin.
    if height >= MIN_HEIGHT { f } else { mesh.twin(sides[longest]).map_or(f, |t| mesh.face(t)) }
}

/// Unmarks every connected set of sharp edges whose total length is below `length` (in model sizes): on scanned
/// and organic surfaces single edges are sharp by noise alone, while intended creases are long.
pub fn drop_short_features(mesh: &TriMesh, sharp: &mut [bool], length: f64) {
    let mut search: BreadthFirst<EdgeId, ()> = BreadthFirst::new(mesh.n_edges());
    for seed in mesh.edges() {
        let before = search.reached().len();
        if !sharp[seed.index()] || !search.start(seed) {
            continue;
        }
        while let Some(e) = search.visit() {
            // The last edge of a boundary fan is left out: a boundary edge is not sharp.
            for h in mesh.edge_vertices(e).into_iter().flat_map(|v| mesh.outgoing(v)) {
                let next = mesh.edge(h);
                if sharp[next.index()] {
                    search.reach(next, ());
                }
            }
        }
        let connected = &search.reached()[before..];
        if connected.iter().map(|&e| mesh.edge_length(e)).sum::<f64>() < length {
            connected.iter().for_each(|e| sharp[e.index()] = false);
        }
    }
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
    fn connected_features_are_dropped_by_total_length() {
        let mesh = parse(format!("{CUBE}f 1 2 6 5\n").as_bytes(), "cube.obj").unwrap().mesh;
        // The twelve edges are connected and 12 / √3 = 6.93 diagonals long.
        for (length, kept) in [(SHORT_FEATURE, 12), (6.9, 12), (7.0, 0)] {
            let mut sharp = sharp_edges(&mesh, SHARP_DIHEDRAL);
            drop_short_features(&mesh, &mut sharp, length);
            assert_eq!(sharp.iter().filter(|&&s| s).count(), kept);
        }
    }

    #[test]
    fn slivers_have_no_sharp_edges_of_their_own() {
        // A flat square whose diagonal is split by vertices off the plane by rounding only.
        let flat = |z: f64| {
            format!(
                "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5000001 {z}\nv 0.5 0.4999999 {}\n\
                 f 1 2 6\nf 2 3 6\nf 1 6 5\nf 6 3 5\nf 3 4 5\nf 4 1 5\n",
                -z
            )
        };
        assert_eq!(count(&flat(1e-7), 20.0), 0);
        // The cube's edge 1-2 with a sliver on it: the crease is found once, along either side of the sliver.
        let sliver = format!("{CUBE}v 0.5 1e-7 -1e-7\nf 1 2 6 5\n").replace("f 4 3 2 1", "f 4 3 2 9 1\nf 1 9 2");
        let edges = count(&sliver, 40.0);
        assert!((12..=13).contains(&edges), "{edges}");
    }
}
