//! Optimising the shape of all quads on the surface.
//!
//! Vertices move one at a time by Newton's method in the surface's tangent plane, with a line search on the
//! energy of the corners around them ([`super::shape`]) at the place on the surface itself. No two vertices of
//! one quad move at once: a colouring of the vertices says who moves when, so the result does not depend on
//! threads. Area is signed by the normal of the *surface*, so a folded quad unfolds.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::ground::Ground;
use super::rail::Rail;
use super::refine::QuadMesh;
use super::shape::{Corner, Ideal, Moving, newton};
use crate::progress::{Cancelled, Progress};

/// Halvings of a step before it is given up.
const HALVINGS: usize = 6;
/// Least distance from zero at which area begins to bend, as a fraction of a quad; with it no quad that is
/// worth a thousandth of its ideal area is felt to be folded.
const LEAST_BEND: f64 = 1e-3;
/// The bend of a vertex with folded corners, as a fraction of its most negative area.
const BEND: f64 = 0.3;
/// Bounds of the angle at a corner: nodes of very low or high valence cannot be perfect.
const ANGLES: (f64, f64) = (0.5, 2.4);
/// How much of a side's length is its quad's own; the rest is the mean of its patch.
const OWN: f64 = 0.6;
/// Longest step in mean sides of the quads around.
const LONGEST: f64 = 1.0;

/// A corner of a quad as its vertex sees it: quad and place in it.
type CornerOf = (u32, u8);

/// The structure around each vertex, which never changes.
pub(super) struct Around {
    corners: Vec<Vec<CornerOf>>,
    /// Vertices that may move at once.
    colours: Vec<Vec<u32>>,
    /// Side lengths of the quads at the start.
    given: Vec<[f64; 2]>,
}

impl Around {
    /// Vertices of which `held` is true never move; those beyond its end are free.
    pub(super) fn new(mesh: &QuadMesh, held: &[bool]) -> Self {
        let n = mesh.positions.len();
        let mut corners = vec![Vec::new(); n];
        for (q, quad) in (0u32..).zip(&mesh.quads) {
            for (k, &v) in (0u8..).zip(quad) {
                corners[v as usize].push((q, k));
            }
        }
        let mut colour = vec![usize::MAX; n];
        let mut colours: Vec<Vec<u32>> = Vec::new();
        for v in 0..n {
            let taken = |c: usize| {
                corners[v].iter().flat_map(|&(q, _)| mesh.quads[q as usize]).any(|w| colour[w as usize] == c)
            };
            let c = (0..).find(|&c| !taken(c)).unwrap_or(0);
            colour[v] = c;
            if c == colours.len() {
                colours.push(Vec::new());
            }
            if !held.get(v).is_some_and(|&h| h) {
                colours[c].push(v as u32);
            }
        }
        let given = mesh.quads.iter().map(|q| own_lengths(mesh, q)).collect();
        Self { corners, colours, given }
    }
}

/// What holds throughout a round: how every quad should be, and along which normal it is seen.
struct Aims {
    normals: Vec<DVec3>,
    lengths: Vec<[f64; 2]>,
    /// Angle of the corners at each vertex.
    angles: Vec<DVec2>,
}

/// Rounds of the optimisation. `kept` is how much of the side lengths aimed at are those at the start.
///
/// # Errors
///
/// When cancelled; `mesh` is then somewhere on the way.
pub(super) fn optimise(
    mesh: &mut QuadMesh,
    ground: &Ground,
    around: &Around,
    rail: &mut Rail,
    (rounds, kept): (usize, f64),
    progress: &Progress,
) -> Result<(), Cancelled> {
    for _ in 0..rounds {
        progress.check()?;
        let aims = Aims::new(mesh, ground, around, rail, kept);
        for colour in &around.colours {
            let moves: Vec<Option<Move>> =
                colour.par_iter().map(|&v| Local { mesh, ground, around, rail, aims: &aims, v }.improve()).collect();
            for (&v, to) in colour.iter().zip(moves) {
                let Some(to) = to else { continue };
                mesh.positions[v as usize] = to.at;
                mesh.base_face[v as usize] = to.face;
                if let Some(s) = to.along {
                    rail.put(v, s);
                }
            }
        }
    }
    Ok(())
}

impl Aims {
    fn new(mesh: &QuadMesh, ground: &Ground, around: &Around, rail: &Rail, kept: f64) -> Self {
        let at: Vec<DVec3> =
            mesh.positions.par_iter().zip(&mesh.base_face).map(|(&p, &f)| ground.normal(p, f)).collect();
        let normals =
            mesh.quads.iter().map(|q| q.iter().map(|&v| at[v as usize]).sum::<DVec3>().normalize_or(DVec3::Z));
        let angles = (0..mesh.positions.len()).map(|v| {
            let n = around.corners[v].len() as f64;
            let angle = match (rail.holds(v as u32), around.corners[v].len()) {
                (false, 4) | (true, 1) => std::f64::consts::FRAC_PI_2,
                (true, _) => std::f64::consts::PI / n,
                (false, _) => std::f64::consts::TAU / n,
            };
            DVec2::from_angle(angle.clamp(ANGLES.0, ANGLES.1))
        });
        Self { normals: normals.collect(), lengths: lengths(mesh, &around.given, kept), angles: angles.collect() }
    }
}

/// The side lengths that quads should have: their own mean sides, drawn towards the mean of their patch and to the
/// lengths `given` before the optimisation.
fn lengths(mesh: &QuadMesh, given: &[[f64; 2]], kept: f64) -> Vec<[f64; 2]> {
    let n_patches = mesh.patch.iter().max().map_or(0, |&p| p as usize + 1);
    let mut sum = vec![[0.0; 3]; n_patches];
    let own: Vec<[f64; 2]> = mesh.quads.iter().map(|q| own_lengths(mesh, q)).collect();
    for (s, &p) in own.iter().zip(&mesh.patch) {
        for (total, x) in sum[p as usize].iter_mut().zip([s[0], s[1], 1.0]) {
            *total += x;
        }
    }
    let mean = |p: u32, i: usize| sum[p as usize][i] / sum[p as usize][2];
    let drawn = |(s, &p): (&[f64; 2], &u32)| [0, 1].map(|i| (OWN * s[i] + (1.0 - OWN) * mean(p, i)).max(1e-12));
    let blend = |(now, given): ([f64; 2], &[f64; 2])| [0, 1].map(|i| (1.0 - kept) * now[i] + kept * given[i]);
    own.iter().zip(&mesh.patch).map(drawn).zip(given).map(blend).collect()
}

/// Mean lengths of the two pairs of opposite sides.
fn own_lengths(mesh: &QuadMesh, q: &[u32; 4]) -> [f64; 2] {
    let d = |i: usize, j: usize| mesh.positions[q[i] as usize].distance(mesh.positions[q[j] as usize]);
    [0.5 * (d(0, 1) + d(3, 2)), 0.5 * (d(1, 2) + d(0, 3))]
}

struct Move {
    at: DVec3,
    face: u32,
    /// Arc length on the boundary.
    along: Option<f64>,
}

/// One vertex and what it can see.
struct Local<'a> {
    mesh: &'a QuadMesh,
    ground: &'a Ground<'a>,
    around: &'a Around,
    rail: &'a Rail,
    aims: &'a Aims,
    v: u32,
}

impl Local<'_> {
    /// The corners that depend on the vertex when it is at `p`.
    fn corners(&self, p: DVec3) -> impl Iterator<Item = (Corner, Moving)> + '_ {
        self.around.corners[self.v as usize].iter().flat_map(move |&(q, k)| {
            let quad = &self.mesh.quads[q as usize];
            [(0, Moving::Own), (1, Moving::Previous), (3, Moving::Next)].map(|(step, moving)| {
                let at = |i: usize| {
                    let w = quad[i % 4];
                    if i % 4 == k as usize { p } else { self.mesh.positions[w as usize] }
                };
                let i = k as usize + step;
                let [a, b] = self.aims.lengths[q as usize];
                let lengths = if i.is_multiple_of(2) { [a, b] } else { [b, a] };
                let ideal = Ideal { lengths, angle: self.aims.angles[quad[i % 4] as usize] };
                (Corner::new([at(i), at(i + 1), at(i + 3)], self.aims.normals[q as usize], ideal), moving)
            })
        })
    }

    fn energy(&self, p: DVec3, bend: f64) -> f64 {
        self.corners(p).map(|(c, _)| c.energy(bend)).sum()
    }

    /// A better place for the vertex, if there is one along Newton's direction.
    fn improve(&self) -> Option<Move> {
        if self.rail.is_fixed(self.v) {
            return None;
        }
        let (p, f) = (self.mesh.positions[self.v as usize], self.mesh.base_face[self.v as usize]);
        let worst = self.corners(p).map(|(c, _)| c.area).fold(0.0, f64::min);
        let bend = LEAST_BEND.hypot(BEND * worst);
        let n = self.ground.normal(p, f);
        let x = n.any_orthonormal_vector();
        let frame = [x, n.cross(x)];
        let (mut gradient, mut hessian) = Default::default();
        for (c, moving) in self.corners(p) {
            let (g, h) = c.derivatives(bend, moving, frame);
            gradient += g;
            hessian += h;
        }
        let mut step = newton(gradient, hessian);
        let longest = LONGEST * self.reach();
        if !step.is_finite() || step.length() < 1e-6 * longest {
            return None;
        }
        step *= (longest / step.length()).min(1.0);
        let old = self.energy(p, bend);
        for _ in 0..HALVINGS {
            let wanted = p + frame[0] * step.x + frame[1] * step.y;
            let to = match self.rail.slide(self.v, wanted) {
                Some((s, at, face)) => Move { at, face, along: Some(s) },
                None => {
                    let (at, face) = self.ground.follow(wanted, f);
                    Move { at, face, along: None }
                }
            };
            if self.energy(to.at, bend) < old {
                return Some(to);
            }
            step *= 0.5;
        }
        None
    }

    /// Mean side of the quads around.
    fn reach(&self) -> f64 {
        let list = &self.around.corners[self.v as usize];
        let sum: f64 = list.iter().map(|&(q, _)| self.aims.lengths[q as usize].iter().sum::<f64>()).sum();
        0.5 * sum / list.len().max(1) as f64
    }
}
