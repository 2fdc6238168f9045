//! A model that is turned in space has the same strips at the same cost.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use proptest::prelude::*;

use crate::mesh::{FaceId, builtin, parse, write_mesh_obj};
use crate::progress::Progress;
use crate::surface::SurfacePoint;
use crate::weave::{MeshSource, Options, Session};

/// Largest relative differences of elastica cost, energy as found, energy as relaxed, and length of the relaxed curve.
/// Relaxation stops when a step gains less than 1e-5, and now and then stops one step earlier.
const SAME: [f64; 4] = [1e-4, 1e-4, 1e-3, 1e-4];

/// A session on a built-in model, turned and moved.
fn turned(name: &str, turn: DQuat, by: DVec3) -> Session {
    let loaded = builtin(name).unwrap();
    let mut obj = Vec::new();
    write_mesh_obj(&mut obj, &loaded.mesh.mapped(|p| turn * p + by), &loaded.units).unwrap();
    let (loaded, source) = (parse(&obj, "turned.obj").unwrap(), MeshSource::File("turned.obj".into()));
    Session::open(loaded, source, Options::default(), &Progress::new()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn a_turned_model_has_the_same_proposals(
        name in prop_oneof![Just("torus"), Just("sleeve"), Just("rounded-cube")],
        (axis, angle) in ([-1.0f64..1.0, -1.0..1.0, -1.0..1.0], 0.0..TAU),
        by in [-9.0f64..9.0, -9.0..9.0, -9.0..9.0],
        faces in prop::collection::vec(0u32..4900, 3),
    ) {
        let turn = DQuat::from_axis_angle(DVec3::from(axis).try_normalize().unwrap_or(DVec3::X), angle);
        let mut still = turned(name, DQuat::IDENTITY, DVec3::ZERO);
        let mut moved = turned(name, turn, DVec3::from(by));
        prop_assert_eq!(still.model().corners.len(), moved.model().corners.len());
        for face in faces {
            let at = SurfacePoint { face: FaceId(face), weights: [0.5, 0.3, 0.2] };
            let [a, b] = [&mut still, &mut moved].map(|s| s.proposals(at, &Progress::new()).unwrap());
            prop_assert_eq!(a.len(), b.len(), "{} at {}", name, face);
            for (rank, (a, b)) in a.iter().zip(&b).enumerate() {
                let [x, y] = [(a, &still), (b, &moved)].map(|(p, s)| {
                    let energy = p.energy.unwrap();
                    [p.cost, energy.found, energy.relaxed, p.curve.length(&s.model().mesh)]
                });
                let same = (0..4).all(|i| (x[i] - y[i]).abs() <= SAME[i] * x[i]);
                prop_assert!(same, "{} at {}, rank {}: {:?} {:?}", name, face, rank, x, y);
            }
        }
    }
}
