//! Strips under improvement, on the mesh that they are tried on: what could be changed, and what a change is worth.
//!
//! In each round a point is drawn at random, the likelier the more the layout deviates there from principal directions, and
//! loops through it are candidates, of the elastica graph and of that of the smooth cross field. They are tried beside the
//! strips that are there, in place of one that goes much the same way or of any other; and it is tried to leave one out.
//! What splits a node often takes two strips that cross there, and what gives a knob its own nodes takes three, two across
//! its head and one around its neck: so some are tried together, among them loops through a point not far off.

use std::sync::Arc;

use rayon::prelude::*;

use crate::elastica::DirectionMask;
use crate::mesh::{FaceId, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::{RelaxOptions, SurfaceCurve, relax};
use crate::weave::design::{Design, Strip};
use crate::weave::error::WeaveError;
use crate::weave::model::Model;
use crate::weave::proposal::Proposal;
use crate::weave::search::alignment_loops::AlignmentGraph;
use crate::weave::search::candidates::{Query, around, loops};
use crate::weave::search::fit::{Fit, fit};
use crate::weave::session::Session;

/// Loops of each graph that are candidates in a round, at most, and among how many of the elastica graph they are chosen:
/// the cheapest are short, and it is not only those that are wanted.
const LOOPS: usize = 4;
const FOUND: usize = 16;
/// How many pairs and how many threes of candidates are tried together in a round.
const TOGETHER: [(usize, usize); 2] = [(2, 3), (3, 4)];
/// How far the other point of a round is, on a surface of bounding-box diagonal 1, at most: about across a limb; and how often
/// one is drawn.
const NOT_FAR: f64 = 0.12;
const DRAWS: usize = 20;
/// Rings of triangles around a strip in which others count as going its way.
const RINGS: usize = 2;
/// By how much the price has to be less, in degrees, for a layout to be better.
const LEAST_GAIN: f64 = 1e-3;
/// Steps of the nodes after which a layout is judged that is to be taken: after four of them a good one of Fertility has
/// still half a degree too much, after eight a third.
const STEPS: usize = 6;
/// How many changes of a round are judged so, the best before nodes move, and how much worse than the present layout these
/// may then be, in degrees.
const LOOKED_INTO: usize = 2;
const NEAR: f64 = 0.3;

/// A strip that is tried.
#[derive(Debug, Clone)]
pub(in crate::weave) struct Tried {
    pub proposal: Proposal,
    /// The strip of the session that it is, once it is one.
    pub known: Option<Strip>,
}

/// Strips that make a layout.
#[derive(Debug, Clone)]
pub(in crate::weave) struct Layout {
    pub strips: Vec<Tried>,
    /// The price before its nodes move.
    drawn: f64,
    /// How well it fits after they have.
    pub fit: Fit,
    /// What each triangle adds to its deviation.
    shares: Vec<f64>,
}

impl Layout {
    pub(in crate::weave) fn curves(&self) -> impl Iterator<Item = &SurfaceCurve> {
        self.strips.iter().map(|s| &s.proposal.curve)
    }
}

/// How well a layout fits, and what each triangle adds to its deviation; `None` for what makes no layout, or one that cannot
/// be drawn.
type Judged = Option<(Fit, Vec<f64>)>;

/// A change of the strips: one is left out, or candidates are added, or both.
#[derive(Debug, Clone)]
struct Change {
    out: Option<usize>,
    add: Vec<usize>,
}

/// Strips under improvement.
pub(in crate::weave) struct Trial {
    pub model: Arc<Model>,
    guidance: Option<AlignmentGraph>,
    pub now: Layout,
    pub best: Layout,
    random: Random,
}

impl Trial {
    /// The strips of a session, which weaves those of `design` on another mesh or is the same.
    pub(in crate::weave) fn new(session: &Session, design: &Design, progress: &Progress) -> Result<Self, WeaveError> {
        let model = Arc::clone(session.model());
        let tried = |(here, own): (&Strip, &Strip)| Tried {
            proposal: Proposal { curve: here.woven().clone(), cost: own.cost, energy: own.energy },
            known: Some(own.clone()),
        };
        let strips: Vec<Tried> = session.design().strips.iter().zip(&design.strips).map(tried).collect();
        let all: Vec<&SurfaceCurve> = strips.iter().map(|s| &s.proposal.curve).collect();
        let drawn = fit(&model, &all, 0, progress)?.0.objective;
        let (fit, shares) = fit(&model, &all, STEPS, progress)?;
        let now = Layout { strips, drawn, shares, fit };
        let guidance = AlignmentGraph::new(&model, progress)?;
        let random = Random(1);
        Ok(Self { model, guidance, best: now.clone(), now, random })
    }

    /// Whether the strips are tried on the mesh of this model.
    pub(in crate::weave) fn is_on(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(&self.model, model)
    }

    /// Makes a change after which the layout fits better, or worse by no more than so much; tells whether there was one.
    pub(in crate::weave) fn change(&mut self, tolerance: f64, progress: &Progress) -> Result<bool, WeaveError> {
        let (candidates, through) = self.candidates(progress)?;
        let changes = self.changes(&candidates, through);
        let drawn = self.fits(&changes, &candidates, 0, progress)?;
        let pairs = changes.into_iter().zip(drawn).filter_map(|(change, found)| Some((change, found?.0.objective)));
        let mut hopeful: Vec<(Change, f64)> =
            pairs.filter(|(_, objective)| *objective < self.now.drawn + NEAR).collect();
        hopeful.sort_by(|a, b| a.1.total_cmp(&b.1));
        hopeful.truncate(LOOKED_INTO);
        let (changes, drawn): (Vec<Change>, Vec<f64>) = hopeful.into_iter().unzip();
        let moved = self.fits(&changes, &candidates, STEPS, progress)?;
        // What is only left out is not to cost anything: else strips would become fewer and fewer.
        let most = |c: &Change| self.now.fit.objective + if c.add.is_empty() { 0.0 } else { tolerance };
        let found = changes.into_iter().zip(drawn).zip(moved).filter_map(|(pair, found)| Some((pair, found?)));
        let allowed = found.filter(|((change, _), (fit, _))| fit.objective < most(change));
        let Some(((change, drawn), (fit, shares))) = allowed.min_by(|a, b| a.1.0.objective.total_cmp(&b.1.0.objective))
        else {
            return Ok(false);
        };
        if let Some(out) = change.out {
            self.now.strips.remove(out);
        }
        let added = change.add.iter().map(|&c| Tried { proposal: candidates[c].clone(), known: None });
        self.now.strips.extend(added);
        (self.now.drawn, self.now.fit, self.now.shares) = (drawn, fit, shares);
        Ok(true)
    }

    /// How well the layouts fit that changes make, after so many steps of the nodes.
    fn fits(
        &self,
        changes: &[Change],
        candidates: &[Proposal],
        steps: usize,
        progress: &Progress,
    ) -> Result<Vec<Judged>, Cancelled> {
        let one = |change: &Change| {
            progress.check()?;
            Ok(fit(&self.model, &self.with(change, candidates), steps, progress).ok())
        };
        let found = changes.par_iter().map(one).collect::<Result<_, Cancelled>>()?;
        progress.check()?;
        Ok(found)
    }

    /// Whether the present layout fits better than the best so far.
    pub(in crate::weave) fn is_best(&self) -> bool {
        self.now.fit.objective < self.best.fit.objective - LEAST_GAIN
    }

    /// The present layout is the best so far, and these are its strips.
    pub(in crate::weave) fn keep(&mut self, strips: &[Strip]) {
        for (tried, strip) in self.now.strips.iter_mut().zip(strips) {
            tried.known = Some(strip.clone());
        }
        self.best = self.now.clone();
    }

    /// Goes back to the best layout so far.
    pub(in crate::weave) fn go_back(&mut self) {
        self.now = self.best.clone();
    }

    /// Loops through a point where the layout deviates from principal directions, then such through one not far off, smoothed;
    /// and how many the first are.
    fn candidates(&mut self, progress: &Progress) -> Result<(Vec<Proposal>, usize), WeaveError> {
        let v = self.point();
        let other = self.point_near(v);
        let model = &*self.model;
        let none = DirectionMask::none();
        let plain: Vec<Query> = std::iter::once((v, None)).chain(around(model, v)).collect();
        let mut found = loops(&model.graph, &plain, &none, FOUND, progress)?;
        let mut chosen = Vec::new();
        while chosen.len() < LOOPS && !found.is_empty() {
            chosen.push(found.swap_remove(self.random.below(found.len())));
        }
        let mut through = chosen.len();
        if let Some(guidance) = &self.guidance {
            chosen.extend(loops(&guidance.graph, &guidance.queries(v), &none, LOOPS, progress)?);
            through = chosen.len();
            if let Some(w) = other {
                chosen.extend(loops(&guidance.graph, &guidance.queries(w), &none, LOOPS, progress)?);
            }
        }
        let smooth = |p: Proposal| match relax(&model.mesh, &p.curve, &RelaxOptions::default(), progress) {
            Ok(relaxed) => p.relaxed(relaxed),
            Err(_) => p,
        };
        let smoothed = chosen.into_par_iter().map(smooth).collect();
        progress.check()?;
        Ok((smoothed, through))
    }

    /// A vertex at random, the likelier the more its triangles add to the deviation.
    fn point(&mut self) -> VertexId {
        let mut left = self.random.unit() * self.now.shares.iter().sum::<f64>();
        let beyond = |share: &f64| {
            left -= share;
            left < 0.0
        };
        let face = self.now.shares.iter().position(beyond).unwrap_or(0);
        self.model.mesh.face_vertices(FaceId::new(face))[self.random.below(3)]
    }

    /// Another such vertex not far off, if there is one.
    fn point_near(&mut self, v: VertexId) -> Option<VertexId> {
        let model = Arc::clone(&self.model);
        let at = |v| model.mesh.position(v);
        (0..DRAWS).map(|_| self.point()).find(|&w| w != v && at(w).distance(at(v)) < NOT_FAR)
    }

    /// What is to be tried in a round, with candidates of which the first so many go through its point.
    fn changes(&mut self, candidates: &[Proposal], through: usize) -> Vec<Change> {
        let n = self.now.strips.len();
        let mut list = vec![Change { out: Some(self.random.below(n)), add: Vec::new() }];
        let beside: Vec<Vec<bool>> = self.now.curves().map(|c| self.beside(c)).collect();
        for (c, candidate) in candidates[..through].iter().enumerate() {
            let shared = |&i: &usize| self.passed(&candidate.curve).filter(|f| beside[i][f.index()]).count();
            let alike = (0..n).max_by_key(shared);
            list.push(Change { out: None, add: vec![c] });
            list.extend([alike, Some(self.random.below(n))].map(|out| Change { out, add: vec![c] }));
        }
        for (size, count) in TOGETHER {
            for _ in 0..count {
                let mut add: Vec<usize> = (0..size).map(|_| self.random.below(candidates.len())).collect();
                add.sort_unstable();
                add.dedup();
                list.extend((add.len() == size).then_some(Change { out: None, add }));
            }
        }
        list
    }

    /// The triangles that a curve passes.
    fn passed(&self, curve: &SurfaceCurve) -> impl Iterator<Item = FaceId> {
        curve.crossings.iter().map(|c| self.model.mesh.face(c.halfedge))
    }

    /// For each triangle whether a curve passes near it.
    fn beside(&self, curve: &SurfaceCurve) -> Vec<bool> {
        let mesh = &self.model.mesh;
        let mut near = vec![false; mesh.n_faces()];
        self.passed(curve).for_each(|f| near[f.index()] = true);
        for _ in 0..RINGS {
            let corners: Vec<VertexId> =
                mesh.faces().filter(|f| near[f.index()]).flat_map(|f| mesh.face_vertices(f)).collect();
            corners.into_iter().flat_map(|v| mesh.outgoing(v)).for_each(|h| near[mesh.face(h).index()] = true);
        }
        near
    }

    /// The strips after a change.
    fn with<'a>(&'a self, change: &Change, candidates: &'a [Proposal]) -> Vec<&'a SurfaceCurve> {
        let kept = self.now.curves().enumerate().filter(|(i, _)| Some(*i) != change.out).map(|(_, curve)| curve);
        kept.chain(change.add.iter().map(|&c| &candidates[c].curve)).collect()
    }
}

/// Random numbers by SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Below `n`, which is not 0.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}
