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

/// Default length for [`drop_short_features`]: a fifth of the bounding-box diagonal. Of the models tried, those of
/// machine parts keep all their creases at this length and those of animals and statues lose nearly all
/// they have at 40°, which are noise and coarse tessellation.
pub const SHORT_FEATURE: f64 = 0.2;

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
        // Chains of thin faces are short; thin faces that lie against each other in a ring have no end.
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

/// Unmarks the sharp edges of every connected group shorter than `length` in all (in bounding-box diagonals).
///
/// On a scanned or organic surface single edges bend sharply by noise alone; a crease that is meant goes on.
pub fn drop_short_features(mesh: &TriMesh, sharp: &mut [bool], length: f64) {
    let mut group = vec![u32::MAX; mesh.n_edges()];
    let mut members = Vec::new();
    for seed in mesh.edges() {
        if !sharp[seed.index()] || group[seed.index()] != u32::MAX {
            continue;
        }
        members.clear();
        members.push(seed);
        group[seed.index()] = seed.0;
        let mut next = 0;
        while let Some(&e) = members.get(next) {
            next += 1;
            let spokes = mesh.edge_vertices(e).map(|v| mesh.outgoing(v));
            // The last spoke of a boundary fan is left out here: it is a boundary edge and not sharp.
            for f in spokes.into_iter().flatten().map(|h| mesh.edge(h)) {
                if sharp[f.index()] && group[f.index()] == u32::MAX {
                    group[f.index()] = seed.0;
                    members.push(f);
                }
            }
        }
        if members.iter().map(|&e| mesh.edge_length(e)).sum::<f64>() < length {
            members.iter().for_each(|e| sharp[e.index()] = false);
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
    fn a_group_is_dropped_when_it_is_short_in_all() {
        let mesh = parse(format!("{CUBE}f 1 2 6 5\n").as_bytes(), "cube.obj").unwrap().mesh;
        // The twelve edges are connected and 12 / √3 = 6.93 diagonals long.
        for (length, kept) in [(SHORT_FEATURE, 12), (6.9, 12), (7.0, 0)] {
            let mut sharp = sharp_edges(&mesh, SHARP_DIHEDRAL);
            drop_short_features(&mesh, &mut sharp, length);
            assert_eq!(sharp.iter().filter(|&&s| s).count(), kept);
        }
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
