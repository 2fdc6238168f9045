//! Stripe patterns of a flat plate, whose strip map is the identity up to a quarter turn.

use glam::DVec3;
use plait_core::progress::Progress;

use super::*;

/// Squares along each side of the plate.
const N: usize = 20;
/// Side of a square. The plate is 0.8 wide.
const SIDE: f64 = 0.04;

fn plate() -> TriMesh {
    let at = |i: usize, j: usize| (i * (N + 1) + j) as u32;
    let half = 0.5 * N as f64 * SIDE;
    let position = |k: usize| DVec3::new((k / (N + 1)) as f64 * SIDE - half, (k % (N + 1)) as f64 * SIDE - half, 0.0);
    let squares = (0..N * N).map(|k| (k / N, k % N));
    let faces = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh::from_faces((0..(N + 1) * (N + 1)).map(position).collect(), &faces.collect::<Vec<_>>()).unwrap()
}

/// The map with the line x = 0 as the spine of curve 7.
fn map(mesh: &TriMesh) -> StripMap {
    let on = |v: &plait_core::mesh::VertexId| mesh.position(*v).x.abs() < 1e-9;
    let curve = mesh.edges().map(|e| mesh.edge_vertices(e).iter().all(on).then_some(7)).collect::<Vec<_>>();
    StripMap::new(mesh, &curve, &Progress::new()).unwrap()
}

fn centre(mesh: &TriMesh, f: usize) -> DVec3 {
    mesh.face_vertices(plait_core::mesh::FaceId::new(f)).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0
}

/// The stripes of a face, which has those of one strip at most.
fn only(pattern: &Pattern, f: usize) -> Option<Stripes> {
    pattern.stripes[f].into_iter().flatten().next()
}

fn pattern(mesh: &TriMesh, map: &StripMap) -> Pattern {
    Pattern::new(mesh, map, |curve| Some(StripId(curve)))
}

#[test]
fn a_strip_without_an_end_is_drawn_at_full_strength_with_straight_lines() {
    let mesh = plate();
    let pattern = pattern(&mesh, &map(&mesh));
    for (f, corners) in mesh.faces().map(|f| mesh.face_vertices(f)).enumerate() {
        let stripes = only(&pattern, f).unwrap();
        assert_eq!((stripes.strip, stripes.strength), (StripId(7), [1.0; 3]));
        for (i, v) in corners.into_iter().enumerate() {
            assert!((stripes.at[i].abs() - mesh.position(v).x.abs()).abs() < 1e-6, "{stripes:?}");
            assert!(stripes.bulge[i].abs() < 1e-6);
        }
    }
}

#[test]
fn a_hidden_strip_has_no_stripes() {
    let mesh = plate();
    let hidden = Pattern::new(&mesh, &map(&mesh), |_| None);
    assert!(hidden.stripes.iter().all(|s| s.iter().all(Option::is_none)));
}

#[test]
fn a_strip_fades_towards_a_cut_and_its_splinters_are_not_drawn() {
    let mesh = plate();
    let mut map = map(&mesh);
    // The strip is cut at y = 0.2. Beyond it a splinter is left, one square wide.
    for f in 0..mesh.n_faces() {
        let at = centre(&mesh, f);
        if at.y > 0.2 && !(0.08..0.12).contains(&at.x) {
            map.covered[f] = [None; 2];
        }
    }
    let pattern = pattern(&mesh, &map);
    for f in 0..mesh.n_faces() {
        let at = centre(&mesh, f);
        let strength = only(&pattern, f).map_or(0.0, |s| s.strength.iter().sum::<f64>() / 3.0);
        match at.y {
            y if y < 0.08 => assert!(strength > 0.99, "{at} {strength}"),
            y if y > 0.28 => assert!(strength < 0.01, "{at} {strength}"),
            _ => {}
        }
    }
}

#[test]
fn holes_of_single_triangles_are_closed() {
    let mesh = plate();
    let mut map = map(&mesh);
    let hole = (0..mesh.n_faces()).find(|&f| centre(&mesh, f).x > 0.1 && centre(&mesh, f).y > 0.1).unwrap();
    map.covered[hole] = [None; 2];
    let stripes = only(&pattern(&mesh, &map), hole).unwrap();
    assert_eq!(stripes.strength, [1.0; 3]);
    let mean = stripes.at.iter().sum::<f64>() / 3.0;
    assert!((mean.abs() - centre(&mesh, hole).x).abs() < 1e-6, "{mean}");
}

#[test]
fn triangles_of_a_strip_that_is_not_drawn_there_go_to_the_strip_around_them() {
    let mesh = plate();
    let mut map = map(&mesh);
    let mut thief = map.strips[0].clone();
    thief.curve = 8;
    map.strips.push(thief);
    // Part of another strip, far from its spine.
    let stolen = |f: &usize| centre(&mesh, *f).distance(DVec3::new(0.2, 0.2, 0.0)) < 0.08;
    for f in (0..mesh.n_faces()).filter(stolen) {
        map.covered[f] = map.covered[f].map(|s| s.map(|_| 1));
        map.spine_distance[f] = [[0.02; 3]; 2];
    }
    let pattern = pattern(&mesh, &map);
    for f in (0..mesh.n_faces()).filter(stolen) {
        let stripes = only(&pattern, f).unwrap();
        assert_eq!((stripes.strip, stripes.strength), (StripId(7), [1.0; 3]));
    }
}

#[test]
fn smoothing_removes_noise_but_keeps_the_spine() {
    let mesh = plate();
    let mut map = map(&mesh);
    // Noise at the vertices, the same in all triangles around each.
    let noise = |v: plait_core::mesh::VertexId| {
        if mesh.position(v).x.abs() < 1e-9 { 0.0 } else { 0.004 * (f64::from(v.0) * 7.3).sin() }
    };
    for f in mesh.faces() {
        for (i, v) in mesh.face_vertices(f).into_iter().enumerate() {
            for distances in &mut map.spine_distance[f.index()] {
                distances[i] += noise(v) as f32;
            }
        }
    }
    let pattern = pattern(&mesh, &map);
    let (mut before, mut after) = (0.0, 0.0);
    for f in mesh.faces() {
        let Some(stripes) = only(&pattern, f.index()) else { continue };
        for (i, v) in mesh.face_vertices(f).into_iter().enumerate() {
            let exact = mesh.position(v).x.abs();
            if exact < 1e-9 {
                assert!(stripes.at[i].abs() < 1e-6);
            }
            before += noise(v).abs();
            after += (stripes.at[i].abs() - exact).abs();
        }
    }
    assert!(after < 0.5 * before, "{after} {before}");
}

#[test]
fn stripes_continue_over_the_corners_of_another_triangle() {
    let stripes = |at| Stripes { strip: StripId(1), at, bulge: [0.0; 3], reach: 0.5, strength: [1.0; 3] };
    let middle = stripes([0.0, 0.1, 0.1]);
    // Under corner 0 is a face of the same strip, with slightly other distances; under corner 1 one of another strip; under
    // corner 2 a part of the same strip that is far away.
    let other = Stripes { strip: StripId(2), ..stripes([0.3; 3]) };
    let under = |i: usize| ([Some([stripes([0.002; 3]), other, stripes([0.4; 3])][i]), None], [1.0 / 3.0; 3]);
    let corner = |i: usize| [0, 1, 2].map(|k| f64::from(u8::from(k == i)));
    let got = transferred(&middle, under, corner);
    assert!((got.at[0] - 0.002).abs() < 1e-12);
    assert_eq!(got.at[1..], [0.1, 0.1]);
}
