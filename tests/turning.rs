//! A model that is turned in space has the same strips: the same costs, in the same order.

mod support;

use std::fmt::Write as _;

use glam::{DQuat, DVec3, EulerRot};
use plait_core::mesh::parse;
use plait_core::progress::Progress;
use plait_core::weave::{MeshSource, Options, Proposal, Session};

/// Largest relative difference of elastica costs, and of lengths with bending as found.
const SAME: f64 = 1e-4;
/// The same for the lengths of relaxed curves.
const EQUIVALENT: f64 = 2e-3;

/// Points of the bracket, inside its triangles.
const POINTS: [[f64; 3]; 12] = [
    [6.516667, 4.593333, 0.000000],
    [0.000000, 0.110000, 2.483333],
    [0.150000, 0.000000, 5.443333],
    [3.073333, 5.000000, 0.516667],
    [1.850000, 0.740000, 6.000000],
    [1.516667, 5.000000, 3.110000],
    [2.000000, 1.850000, 2.073333],
    [8.406667, 5.000000, 0.183333],
    [5.000000, 3.776667, 2.483333],
    [6.073333, 5.000000, 0.850000],
    [2.443333, 4.850000, 2.000000],
    [5.850000, 1.593333, 0.000000],
];

/// A motion in space.
#[derive(Debug, Clone, Copy)]
struct Motion {
    turn: DQuat,
    by: DVec3,
}

impl Motion {
    fn apply(&self, p: DVec3) -> DVec3 {
        self.turn * p + self.by
    }

    /// An OBJ file of the moved model, with nine digits as other programs write it.
    fn moved(&self, obj: &str) -> String {
        let mut text = String::new();
        for line in obj.lines() {
            match line.strip_prefix("v ") {
                Some(numbers) => {
                    let p = self.apply(point(numbers));
                    writeln!(text, "v {:.8} {:.8} {:.8}", p.x, p.y, p.z).unwrap();
                }
                None => writeln!(text, "{line}").unwrap(),
            }
        }
        text
    }
}

fn point(numbers: &str) -> DVec3 {
    let numbers: Vec<f64> = numbers.split_whitespace().map(|x| x.parse().unwrap()).collect();
    DVec3::new(numbers[0], numbers[1], numbers[2])
}

/// The strips through a point, given in coordinates of the file.
fn proposals(session: &mut Session, p: DVec3) -> Vec<Proposal> {
    let at = session.model().index.nearest(session.model().loaded.units.from_file(p));
    session.proposals(at, &Progress::new()).unwrap()
}

/// Elastica cost, length with bending as found, and length of the relaxed curve in units of the file.
fn costs(p: &Proposal, session: &Session) -> [f64; 3] {
    let model = session.model();
    [p.cost, p.energy.unwrap().found, p.curve.length(&model.mesh) * model.loaded.units.scale]
}

fn open(obj: &str) -> Session {
    let loaded = parse(obj.as_bytes(), "model.obj").unwrap();
    Session::open(loaded, MeshSource::File("model.obj".into()), Options::default(), &Progress::new()).unwrap()
}

#[test]
fn a_turned_bracket_has_the_same_strips() {
    let obj = std::fs::read_to_string(support::root().join("tests/models/bracket.obj")).unwrap();
    let [x, y, z] = [30f64, 45.0, 20.0].map(f64::to_radians);
    let motion = Motion { turn: DQuat::from_euler(EulerRot::XYZ, x, y, z), by: DVec3::new(4.0, -7.0, 11.0) };
    let (mut still, mut turned) = (open(&obj), open(&motion.moved(&obj)));
    for p in POINTS.map(DVec3::from) {
        let (a, b) = (proposals(&mut still, p), proposals(&mut turned, motion.apply(p)));
        assert!(!a.is_empty() && a.len() == b.len(), "{p}: {} and {} strips", a.len(), b.len());
        for (rank, (a, b)) in a.iter().zip(&b).enumerate() {
            let (x, y) = (costs(a, &still), costs(b, &turned));
            // The flats of the bracket are a regular grid. Of the loops straight along a line of the grid several have the
            // same cost, and rounding decides which is found. Relaxed, they differ in how they pass the vertices.
            let differs = |i: usize, by: f64| (x[i] - y[i]).abs() > by * x[i];
            assert!(!differs(0, SAME) && !differs(1, SAME) && !differs(2, EQUIVALENT), "{p}, rank {rank}: {x:?} {y:?}");
        }
    }
}
