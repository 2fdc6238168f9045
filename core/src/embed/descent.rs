//! Optimising an embedding: field, map and nodes in turn (Campen, sections 6.3 to 6.5).
//!
//! With the nodes where they are, the guiding field and the seamless map in which all arcs are isolines are linear
//! solves. What remains of the energy tells every node where to go. If the step made the energy less it stands, and
//! another follows; if not, it is taken back and tried at half the length.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::cross::step_to_crossing;
use super::gradient::descent;
use super::net::Net;
use super::pipeline::Job;
use super::relocate::{Ground, Hold};
use super::setup::{ground, mean_edge, sharp_edges};
use super::snap::snap;
use super::solver::{Solver, State};
use super::spacing::{Spacing, lengths};
use super::straight::{ArcEnd, Crossroads};
use super::{EmbeddingError, voronoi};
use crate::field::{GuidedSystem, Metric};
use crate::mesh::{TriMesh, VertexId};
use crate::param::{Fold, SeamlessSystem};
use crate::progress::Progress;
use crate::solve::SpdSymbolic;
use crate::surface::{PolarMap, PrincipalCurvature, SurfaceIndex};

/// Length of a step over the length of the gradient: the estimator is half as long again as the gradient itself, and
/// three quarters of the way to a parabola's minimum are safe (section 6.6.2).
const STEP: f64 = 0.75 * 2.0 / 3.0;

/// Rounds of stiffening; by what a folded triangle's weight grows in each, and up to what; over how many rings of
/// triangles that fades out, and by what factor in each.
const STIFFENINGS: usize = 15;
const STIFFER: f64 = 1.5;
const STIFFEST: f64 = 1e4;
const FADING: usize = 5;
const FADE: f64 = 0.7;
/// Cosine between two steps of a node above which it keeps its direction, and below whose negative it turns back.
const ALIKE: f64 = 0.3;
/// By what a step is then lengthened, and how far at most.
const LONGER: f64 = 1.4;
const LONGEST: f64 = 6.0;
/// Rounds of bringing regular nodes to their crossings before they are held there: every round is a Newton step.
const SETTLING: usize = 3;

/// The surface a layout is embedded on.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Its mesh, of bounding-box diagonal 1.
    pub mesh: &'a TriMesh,
    /// Its points by nearness.
    pub index: &'a SurfaceIndex,
    /// Principal curvatures at its vertices.
    pub curvature: &'a [PrincipalCurvature],
    /// Whether each edge is sharp.
    pub sharp: &'a [bool],
}

/// How an embedding is optimised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Steps of the nodes at most.
    pub steps: usize,
    /// Halvings of the step at most.
    pub halvings: usize,
    /// By how much an error of direction counts more than one of length.
    pub anisotropy: f64,
    /// Whether lengths may vary over the surface as the field wants it.
    pub sizing: bool,
    /// Least length of an arc in the map, in mean edges of the mesh.
    pub spacing: f64,
    /// The length below which chords are collapsed, on a surface of bounding-box diagonal 1; `None`: they are held apart.
    pub collapse: Option<f64>,
    /// Whether chords are collapsed, one by one, as long as that makes the layout less irregular and the energy no more.
    pub simplify: bool,
    /// The edge length that all chords are to be multiples of in the end, likewise; `None`: lengths are free.
    pub integer: Option<f64>,
}

impl Default for Settings {
    /// Those of the thesis (sections 6.4.3 and 6.5.1); arcs are long enough that triangles can resolve the patches.
    fn default() -> Self {
        Self {
            steps: 25,
            halvings: 5,
            anisotropy: 10.0,
            sizing: true,
            spacing: 1.5,
            collapse: None,
            simplify: false,
            integer: None,
        }
    }
}

/// An embedding under optimisation.
pub struct Optimizer<'a> {
    pub(super) ground: Ground<'a>,
    settings: Settings,
    curvature: Vec<PrincipalCurvature>,
    sharp: Vec<bool>,
    pub(super) roads: Crossroads,
    /// Chords held at lengths, the chord of every arc, the least length and the fewest quads across every chord.
    pub(super) spacing: Spacing,
    pub(super) chord_of: Vec<u32>,
    pub(super) least: f64,
    pub(super) fewest: Vec<u32>,
    /// The ends of arcs at each node.
    ends: Vec<Vec<ArcEnd>>,
    guided: GuidedSystem,
    seamless: Option<SeamlessSystem>,
    sizes: Option<SpdSymbolic>,
    pub(super) state: State,
    /// Factor of the steps of every node.
    pace: Vec<f64>,
    /// Where every node was headed when it last moved.
    heading: Vec<DVec3>,
    /// Steps taken back since one was made.
    halved: usize,
    steps: usize,
}

impl<'a> Optimizer<'a> {
    /// Sets up the optimisation of a drawn layout and solves for its first field and map.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn new(job: &Job<'a>, progress: &Progress) -> Result<Self, EmbeddingError> {
        let Job { surface, layout, settings, .. } = *job;
        let mut held = job.pinned_nodes.to_vec();
        held.resize(layout.nodes.len(), false);
        for (arc, _) in layout.arcs.iter().zip(job.pinned_arcs).filter(|pair| *pair.1) {
            arc.nodes.iter().for_each(|&n| held[n as usize] = true);
        }
        let pinned = |i: usize| held[i];
        let mut net = Net::new(surface.mesh, job.drawing, layout, job.headings)?;
        progress.check()?;
        let sharp = sharp_edges(&surface, &net);
        snap(&mut net, &sharp, pinned);
        let roads = Crossroads::new(layout, pinned);
        let mut ends = vec![Vec::new(); layout.nodes.len()];
        for (a, arc) in (0..).zip(&layout.arcs) {
            ends[arc.nodes[0] as usize].push((a, false));
            ends[arc.nodes[1] as usize].push((a, true));
        }
        let ground = ground(&surface, &net, &sharp, pinned, settings);
        let nearest = |v: usize| {
            if v < surface.mesh.n_vertices() {
                return surface.curvature[v];
            }
            let at = surface.index.nearest(net.mesh.position(VertexId::new(v)));
            surface.curvature[at.nearest_vertex(surface.mesh).index()]
        };
        let curvature: Vec<PrincipalCurvature> = (0..net.mesh.n_vertices()).map(nearest).collect();
        let spacing = Spacing::none(layout.chords);
        let least = settings.spacing * mean_edge(&net.mesh);
        let guided = GuidedSystem::new(&net.mesh)?;
        let metric = Metric::new(&net.mesh);
        let mut solver = Solver {
            curvature: &curvature,
            sharp: &sharp,
            roads: &roads,
            spacing: &spacing,
            guided: &guided,
            seamless: None,
            sizes: None,
            settings,
        };
        let state = solver.solve(net, metric, None, progress)?;
        let (seamless, sizes) = (solver.seamless, solver.sizes);
        Ok(Self {
            ground,
            settings,
            curvature,
            sharp,
            roads,
            spacing,
            chord_of: layout.arcs.iter().map(|a| a.chord).collect(),
            least,
            fewest: layout.least_quads(),
            ends,
            guided,
            seamless,
            sizes,
            state,
            pace: vec![1.0; layout.nodes.len()],
            heading: vec![DVec3::ZERO; layout.nodes.len()],
            halved: 0,
            steps: 0,
        })
    }

    /// The best so far.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether no further step is to be made.
    pub fn is_done(&self) -> bool {
        self.steps >= self.settings.steps || self.halved > self.settings.halvings
    }

    /// The share of the steps at most that are made.
    pub(super) fn share_done(&self) -> f64 {
        self.steps as f64 / self.settings.steps.max(1) as f64
    }

    /// Begins anew with steps of usual length, as many as at first.
    pub(super) fn restart(&mut self) {
        self.pace.fill(1.0);
        (self.halved, self.steps) = (0, 0);
    }

    /// For each node whether it stays where it is.
    pub fn stays(&self) -> Vec<bool> {
        self.ground.hold.iter().map(|&hold| hold == Hold::Fixed).collect()
    }

    /// The chords that are shorter than `least`, or would be shorter than triangles resolve, with their lengths.
    pub fn short_chords(&self, least: f64) -> Vec<(u32, f64)> {
        let (net, map) = (&self.state.net, &self.state.solution.map);
        let found = lengths(net, &self.roads, &self.chord_of, map, self.spacing.held.len());
        let short = |chord: u32, length: f64| self.spacing.held[chord as usize].is_some() || length < least;
        (0..).zip(found).filter_map(|(c, l)| Some((c, l?.1))).filter(|&(c, l)| short(c, l)).collect()
    }

    /// Moves the nodes once; tells whether that made the energy less. If not, they are where they were, and the next
    /// step is shorter.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`]; the state is then as before.
    pub fn step(&mut self, progress: &Progress) -> Result<bool, EmbeddingError> {
        self.steps += 1;
        let State { net, solution, .. } = &self.state;
        let held = self.spacing.extend(net, &self.roads, &self.chord_of, &solution.map, self.least);
        if held > 0 {
            tracing::debug!(held, "chords held apart");
            self.state = self.solve(self.state.net.clone(), progress)?;
        }
        let net = self.moved();
        let next = self.solve(net, progress)?;
        let better = next.solution.energy < self.state.solution.energy;
        tracing::debug!(step = self.steps, energy = next.solution.energy, better, "nodes moved");
        if better {
            self.state = next;
            self.halved = 0;
            self.adapt();
        } else {
            self.pace.iter_mut().for_each(|p| *p *= 0.5);
            self.halved += 1;
        }
        Ok(better)
    }

    /// Lengthens the steps of nodes that keep their direction and shortens those of nodes that turn back.
    fn adapt(&mut self) {
        for i in 0..self.pace.len() {
            let heading = self.heading_of(i);
            let turn = heading.dot(self.heading[i]);
            if turn > ALIKE {
                self.pace[i] = (self.pace[i] * LONGER).min(LONGEST);
            } else if turn < -ALIKE {
                self.pace[i] *= 0.5;
            }
            self.heading[i] = heading;
        }
    }

    /// The direction in space in which a node is to move.
    fn heading_of(&self, i: usize) -> DVec3 {
        let State { net, metric, field, objective, solution } = &self.state;
        let v = net.nodes[i].vertex;
        if !self.roads.held[i] || self.ground.hold[i] == Hold::Fixed {
            return DVec3::ZERO;
        }
        let d = descent(&net.mesh, metric, &field.angle, &solution.map.uv, objective, v);
        if d.is_finite() { self.in_space(&net.mesh, metric, v, d).normalize_or_zero() } else { DVec3::ZERO }
    }

    /// The net with every node moved by one step.
    fn moved(&self) -> Net {
        let State { net, metric, field, objective, solution } = &self.state;
        let mut moved = net.clone();
        let cell = self.cells();
        // Error weights of 1 and ρ instead of 1 and 1 make the energy steeper, but its minimum no farther.
        let steep = 0.5 * (1.0 + self.settings.anisotropy);
        for (i, node) in net.nodes.iter().enumerate() {
            let v = node.vertex;
            if self.ground.hold[i] == Hold::Fixed {
                continue;
            }
            if !self.roads.held[i] {
                self.cross(&mut moved, i, &cell);
                continue;
            }
            let d = descent(&net.mesh, metric, &field.angle, &solution.map.uv, objective, v);
            let step = d * (STEP * self.pace[i] / steep);
            if !(step.length() > 0.0 && step.is_finite()) {
                continue;
            }
            match self.ground.hold[i] {
                Hold::Free => {
                    // The polar map is that of the mesh before any node moved: close by nothing else changes.
                    self.ground.glide(&mut moved, metric, i, step, &cell);
                }
                Hold::Curve => {
                    let along = self.in_space(&net.mesh, metric, v, step);
                    self.ground.slide(&mut moved, i, along, along.length());
                }
                Hold::Fixed => {}
            }
        }
        moved
    }

    /// Brings a regular node towards the crossing of its isolines.
    fn cross(&self, moved: &mut Net, i: usize, cell: &[u32]) {
        let State { net, metric, solution, .. } = &self.state;
        let found = step_to_crossing(net, &self.roads, metric, &solution.map, &self.ends[i]);
        let Some((corner, step)) = found.filter(|(_, step)| step.is_finite() && step.length() > 0.0) else { return };
        let mesh = &net.mesh;
        let v = net.nodes[i].vertex;
        match self.ground.hold[i] {
            Hold::Free => {
                let polar = PolarMap::new(mesh, metric, v);
                let from = polar.spokes.iter().find(|s| s.0 == corner).map_or(0.0, |s| s.1);
                let turn = step.to_angle() - metric.direction(corner);
                let turn = turn - (turn / TAU).round() * TAU;
                let step = DVec2::from_angle(from + polar.scale * turn) * step.length();
                self.ground.glide(moved, metric, i, step, cell);
            }
            Hold::Curve => {
                let along = metric.tangent(mesh, mesh.face(corner), step.to_angle()) * step.length();
                self.ground.slide(moved, i, along, along.length());
            }
            Hold::Fixed => {}
        }
    }

    /// A vector of the polar map of `v` in space.
    fn in_space(&self, mesh: &TriMesh, metric: &Metric, v: VertexId, step: DVec2) -> DVec3 {
        let polar = PolarMap::new(mesh, metric, v);
        let (h, turn) = polar.wedge(step.to_angle().rem_euclid(TAU));
        metric.tangent(mesh, mesh.face(h), metric.direction(h) + turn) * step.length()
    }

    /// Ends the optimisation: brings regular nodes onto their isolines and holds them there, and removes folds. What is
    /// returned besides the final state are the folds that remain.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn finish(mut self, progress: &Progress) -> Result<(State, Vec<Fold>), EmbeddingError> {
        for _ in 0..SETTLING {
            let net = self.settled();
            self.state = self.solve(net, progress)?;
        }
        self.roads.hold_all();
        loop {
            self.state = self.solve(self.state.net.clone(), progress)?;
            let State { net, solution, .. } = &self.state;
            if self.spacing.extend(net, &self.roads, &self.chord_of, &solution.map, self.least) == 0 {
                break;
            }
        }
        if let Some(edge) = self.settings.integer {
            self.round(edge, progress)?;
        }
        self.stiffen(progress)?;
        let State { net, metric, field, objective, solution } = &mut self.state;
        let Some(system) = &self.seamless else { return Ok((self.state, Vec::new())) };
        objective.stiffness.clear();
        let mut quarters = vec![4; net.mesh.n_vertices()];
        for v in net.mesh.vertices().filter(|&v| net.mesh.is_boundary_vertex(v)) {
            quarters[v.index()] = 0;
        }
        for n in net.nodes.iter().filter(|n| !n.boundary) {
            quarters[n.vertex.index()] = n.valence as u32;
        }
        let unfolded = system.unfold(&net.mesh, metric, field, objective, (&solution.free, &quarters), progress)?;
        tracing::debug!(before = unfolded.folds_before, after = unfolded.folds.len(), "folds removed");
        solution.map = system.map(&unfolded.y);
        solution.energy = unfolded.energy;
        solution.free = unfolded.y;
        Ok((self.state, unfolded.folds))
    }

    /// Makes triangles at folds count more, and again, until none is left or it helps no more (Bommes, Zimmer and Kobbelt,
    /// Mixed-Integer Quadrangulation, section 5.4): what that leaves is few and local.
    fn stiffen(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Some(mut system) = self.seamless.take() else { return Ok(()) };
        let mut weight = vec![1.0; self.state.net.mesh.n_faces()];
        let mut work = self.state.clone();
        let mut least = work.flipped();
        for _ in 0..STIFFENINGS {
            if least == 0 {
                break;
            }
            raise(&work.net.mesh, &work.folded(), &mut weight);
            work.objective.stiffness = weight.clone();
            work.solution = system.solve(&work.metric, &work.field, &work.objective, progress)?;
            let now = work.flipped();
            tracing::debug!(folds = now, "stiffened");
            if now < least {
                least = now;
                self.state = work.clone();
            }
        }
        self.seamless = Some(system);
        Ok(())
    }

    /// Field and map of a net, with the field at hand as the one before.
    pub(super) fn solve(&mut self, net: Net, progress: &Progress) -> Result<State, EmbeddingError> {
        let metric = Metric::new(&net.mesh);
        let mut solver = Solver {
            curvature: &self.curvature,
            sharp: &self.sharp,
            roads: &self.roads,
            spacing: &self.spacing,
            guided: &self.guided,
            seamless: self.seamless.take(),
            sizes: self.sizes.take(),
            settings: self.settings,
        };
        let next = solver.solve(net, metric, Some(&self.state.field.angle), progress);
        (self.seamless, self.sizes) = (solver.seamless, solver.sizes);
        next
    }

    /// The net with regular nodes, and only these, brought to the crossings of their isolines.
    fn settled(&self) -> Net {
        let mut moved = self.state.net.clone();
        let cell = self.cells();
        for i in 0..moved.nodes.len() {
            if !self.roads.held[i] {
                self.cross(&mut moved, i, &cell);
            }
        }
        moved
    }

    fn cells(&self) -> Vec<u32> {
        let net = &self.state.net;
        voronoi::cells(&net.mesh, &net.nodes.iter().map(|n| n.vertex).collect::<Vec<_>>())
    }
}

/// Raises the weights of folded triangles, less in the rings around them.
fn raise(mesh: &TriMesh, folded: &[bool], weight: &mut [f64]) {
    let mut share: Vec<f64> = folded.iter().map(|&f| if f { 1.0 } else { 0.0 }).collect();
    for _ in 0..FADING {
        let wider = |f: crate::mesh::FaceId| {
            let sides = mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h));
            let around = sides.map(|t| share[t.index() / 3]).fold(0.0, f64::max);
            share[f.index()].max(FADE * around)
        };
        share = mesh.faces().map(wider).collect();
    }
    for (w, s) in weight.iter_mut().zip(share) {
        *w = (*w * (1.0 + STIFFER * s)).min(STIFFEST);
    }
}
