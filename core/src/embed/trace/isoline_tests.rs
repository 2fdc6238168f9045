use glam::{DVec2, DVec3};

use crate::embed::trace::error::TraceError;
use crate::embed::trace::isoline_points::{Point, isoline_points, snap_vertices};
use crate::embed::trace::isolines::{Isolines, Line, Step, Stop, map_rounding, nodes_at};
use crate::embed::trace::overlay::{Meeting, overlay};
use crate::embed::trace::samples::{self, Sample};
use crate::mesh::VertexId;

/// The isolines of a sample's map that end at the given nodes.
fn isolines<'a>(s: &'a Sample, node: &'a [u32]) -> Isolines<'a> {
    Isolines { mesh: &s.mesh, map: &s.map, node, rounding: map_rounding(&s.map), cross_flipped: false }
}

#[test]
fn a_trace_stops_at_its_limit_and_at_the_boundary() {
    let s = samples::square(8, 2, 0.2);
    let centre = samples::vertex_at(&s.mesh, DVec3::new(0.5, 0.5, 0.0));
    let node = nodes_at(&s.mesh, &[centre]);
    let isolines = isolines(&s, &node);
    let outgoing = isolines.outgoing(centre);
    assert_eq!(outgoing.len(), 4);
    for o in outgoing {
        assert!(matches!(isolines.trace(o, 0.2), Err(Stop::Length(_))));
        // On the boundary is a vertex, through which the isoline does not continue.
        assert!(matches!(isolines.trace(o, 1.0), Err(Stop::Boundary(_) | Stop::Vertex(_))));
    }
}

#[test]
fn the_trace_of_an_isoline_arrives_as_the_reverse_of_its_trace_back() {
    let s = samples::cube(5, 1, 0.2);
    let node = nodes_at(&s.mesh, &s.nodes);
    let isolines = isolines(&s, &node);
    for &v in &s.nodes {
        let outgoing = isolines.outgoing(v);
        for (i, &o) in outgoing.iter().enumerate() {
            let there = isolines.trace(o, 2.0).unwrap();
            let Some(&Step::Vertex(end, _)) = there.steps.last() else { panic!("ends at a node") };
            let others = isolines.outgoing(s.mesh.origin(end));
            let back = isolines.trace(others[isolines.arrival(&there.steps, &others).unwrap()], 2.0).unwrap();
            assert!((there.length - back.length).abs() < 1e-12);
            assert_eq!(isolines.arrival(&back.steps, &outgoing), Some(i));
        }
    }
}

#[test]
fn crossing_isolines_are_refused_or_share_one_vertex() {
    let s = samples::square(7, 1, 0.2);
    let on_side = |x: f64, y: f64| {
        let p = DVec3::new(x, y, 0.0);
        let away = |v: &VertexId| s.mesh.position(*v).distance(p);
        s.mesh.vertices().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap()
    };
    let starts = [on_side(0.43, 0.0), on_side(0.0, 0.43)];
    let node = nodes_at(&s.mesh, &starts);
    let isolines = isolines(&s, &node);
    let mut exact = s.map.clone();
    let traces = starts.map(|v| {
        let mut steps = Vec::new();
        // The first and the last run along the boundary.
        let stop = isolines.trace_into(&mut steps, isolines.outgoing(v)[1], 2.0).unwrap_err();
        assert!(matches!(stop, Stop::Boundary(_) | Stop::Vertex(_)));
        snap_vertices(&isolines, &mut exact, &steps[1..]);
        steps
    });
    let isolines = Isolines { map: &exact, ..isolines };
    let lines = traces.map(|steps| isoline_points(&isolines, &steps));
    let refused = overlay(&s.mesh, &exact, &lines, Meeting::Refuse).unwrap_err();
    assert!(matches!(refused, TraceError::Crossing { arcs, .. } if arcs.contains(&0) && arcs.contains(&1)));
    let shared = overlay(&s.mesh, &exact, &lines, Meeting::Vertex).unwrap();
    let common = shared.paths[0].iter().filter(|v| shared.paths[1].contains(v)).count();
    assert_eq!(common, 1);
}

#[test]
fn a_reversed_point_is_the_same_point() {
    let s = samples::cone(5, 4, 0.2);
    let node = nodes_at(&s.mesh, &s.nodes);
    let isolines = isolines(&s, &node);
    for o in isolines.outgoing(s.nodes[0]) {
        for point in isoline_points(&isolines, &isolines.trace(o, 2.0).unwrap().steps) {
            let reversed = point.reversed(&s.mesh, &s.map);
            assert!(reversed.position(&s.mesh).distance(point.position(&s.mesh)) < 1e-12);
            let (Point::Edge(h, t, line), Point::Edge(g, u, other)) = (point, reversed) else { continue };
            assert_eq!(s.mesh.twin(h), Some(g));
            assert!((t + u - 1.0).abs() < 1e-12 && t > 0.0 && t < 1.0);
            // The crossing computed from the other triangle: the line there has the origin of `g` on its right.
            assert!((isolines.crossing(g, &other) - u).abs() < 1e-9, "{line:?}");
        }
    }
}

#[test]
fn lines_meet_only_at_right_angles() {
    let line = |x: f64, y: f64, heading: u8| Line { start: DVec2::new(x, y), heading };
    let (along_u, along_v) = (line(1.0, 2.0, 2), line(5.0, 7.0, 1));
    assert_eq!(along_u.intersection(&along_v), Some(DVec2::new(5.0, 2.0)));
    assert_eq!(along_v.intersection(&along_u), Some(DVec2::new(5.0, 2.0)));
    assert_eq!(along_u.intersection(&line(0.0, 0.0, 0)), None);
    // Left of a line along −u is below it.
    assert_eq!(along_u.signed_distance(DVec2::new(0.0, -1.0)), 3.0);
    assert_eq!(along_u.along(DVec2::new(0.0, -1.0)), 1.0);
    assert_eq!(along_u.reversed().signed_distance(DVec2::new(0.0, -1.0)), -3.0);
}
