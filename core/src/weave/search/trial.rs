//! The state and the moves of the search for better strips.
//!
//! In each round a vertex is drawn with probability proportional to the local deviation from principal directions. Loops
//! of the elastica graph and of the alignment graph through it are candidates. Moves add a candidate, replace a strip by
//! one (a parallel strip or a random one), or remove a strip. To split a node, two strips that cross there are often
//! needed; to give a protrusion nodes of its own, three: two across its top and one around its base. So groups of
//! candidates, also through a second vertex nearby, are added together.

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

/// Number of candidates from each graph in a round. Chosen by hand.
const LOOPS: usize = 4;
/// Number of loops of the elastica graph that candidates are drawn from. The cheapest are short, but longer ones are
/// needed as well. Chosen by hand.
const POOL: usize = 16;
/// Groups of candidates tried together in a round, as size and number: pairs and triples. Chosen by hand.
const GROUPS: [(usize, usize); 2] = [(2, 3), (3, 4)];
/// Largest distance of the second point of a round from the first, on a surface of model size 1: about the width
/// of a limb. Chosen by hand.
const NEARBY: f64 = 0.12;
/// Number of draws for a second point. Chosen by hand.
const DRAWS: usize = 20;
/// Rings of triangles around a strip in which other curves count as parallel to it. Chosen by hand.
const RINGS: usize = 2;
/// Decrease of the objective from which on a layout is better, in degrees.
const LEAST_GAIN: f64 = 1e-3;
/// Steps of the nodes before a layout is judged for acceptance: after four, the deviation of a good layout of Fertility is
/// still half a degree too large, after eight a third of a degree.
const STEPS: usize = 6;
/// Number of changes of a round that are judged after steps of the nodes. Chosen by hand.
const SHORTLISTED: usize = 2;
/// By how much the objective of a shortlisted change may exceed that of the present layout before nodes move, in degrees.
/// Chosen by hand.
const SHORTLIST_TOLERANCE: f64 = 0.3;

/// A strip of a layout under trial.
#[derive(Debug, Clone)]
pub(in crate::weave) struct TrialStrip {
    pub proposal: Proposal,
    /// The strip of the session, once it is placed there.
    pub placed: Option<Strip>,
}

/// A layout under trial.
#[derive(Debug, Clone)]
pub(in crate::weave) struct Layout {
    pub strips: Vec<TrialStrip>,
    /// The objective before its nodes move.
    initial_objective: f64,
    /// Its fit after [`STEPS`] steps of the nodes.
    pub fit: Fit,
    /// Contribution of each triangle to the deviation.
    shares: Vec<f64>,
}

impl Layout {
    pub(in crate::weave) fn curves(&self) -> impl Iterator<Item = &SurfaceCurve> {
        self.strips.iter().map(|s| &s.proposal.curve)
    }
}

/// The fit of a layout and the contributions of triangles to its deviation; `None` if the strips have no valid layout, or it
/// has no embedding.
type Evaluated = Option<(Fit, Vec<f64>)>;

/// A move: removes a strip, adds candidates, or both.
#[derive(Debug, Clone)]
struct Change {
    /// The strip that is removed.
    out: Option<usize>,
    /// The candidates that are added.
    add: Vec<usize>,
}

/// The state of the search.
pub(in crate::weave) struct Trial {
    pub model: Arc<Model>,
    alignment: Option<AlignmentGraph>,
    pub now: Layout,
    pub best: Layout,
    random: Random,
}

impl Trial {
    /// Starts with the strips of a session. `design` is the design to be improved, whose strips the session has on its own
    /// woven mesh.
    pub(in crate::weave) fn new(session: &Session, design: &Design, progress: &Progress) -> Result<Self, WeaveError> {
        let model = Arc::clone(session.model());
        let tried = |(here, own): (&Strip, &Strip)| TrialStrip {
            proposal: Proposal {
                curve: here.woven().clone(),
                cost: own.cost,
                energy: own.energy,
                anchors: own.anchors.clone(),
            },
            placed: Some(own.clone()),
        };
        let strips: Vec<TrialStrip> = session.design().strips.iter().zip(&design.strips).map(tried).collect();
        let all: Vec<&SurfaceCurve> = strips.iter().map(|s| &s.proposal.curve).collect();
        let initial_objective = fit(&model, &all, 0, progress)?.0.objective;
        let (fit, shares) = fit(&model, &all, STEPS, progress)?;
        let now = Layout { strips, initial_objective, shares, fit };
        let alignment = AlignmentGraph::new(&model, progress)?;
        let random = Random(1);
        Ok(Self { model, alignment, best: now.clone(), now, random })
    }

    /// Whether the strips are tried on the mesh of this model.
    pub(in crate::weave) fn is_on(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(&self.model, model)
    }

    /// Makes the best move of a round that raises the objective by less than `tolerance`; returns whether there is one.
    pub(in crate::weave) fn change(&mut self, tolerance: f64, progress: &Progress) -> Result<bool, WeaveError> {
        let (candidates, through) = self.candidates(progress)?;
        let changes = self.changes(&candidates, through);
        let initial = self.fits(&changes, &candidates, 0, progress)?;
        let pairs = changes.into_iter().zip(initial).filter_map(|(change, found)| Some((change, found?.0.objective)));
        let mut shortlist: Vec<(Change, f64)> =
            pairs.filter(|(_, objective)| *objective < self.now.initial_objective + SHORTLIST_TOLERANCE).collect();
        shortlist.sort_by(|a, b| a.1.total_cmp(&b.1));
        shortlist.truncate(SHORTLISTED);
        let (changes, initial): (Vec<Change>, Vec<f64>) = shortlist.into_iter().unzip();
        let moved = self.fits(&changes, &candidates, STEPS, progress)?;
        // A removal alone must not raise the objective; otherwise the number of strips would decrease steadily.
        let most = |c: &Change| self.now.fit.objective + if c.add.is_empty() { 0.0 } else { tolerance };
        let found = changes.into_iter().zip(initial).zip(moved).filter_map(|(pair, found)| Some((pair, found?)));
        let allowed = found.filter(|((change, _), (fit, _))| fit.objective < most(change));
        let Some(((change, initial_objective), (fit, shares))) =
            allowed.min_by(|a, b| a.1.0.objective.total_cmp(&b.1.0.objective))
        else {
            return Ok(false);
        };
        if let Some(out) = change.out {
            self.now.strips.remove(out);
        }
        let added = change.add.iter().map(|&c| TrialStrip { proposal: candidates[c].clone(), placed: None });
        self.now.strips.extend(added);
        (self.now.initial_objective, self.now.fit, self.now.shares) = (initial_objective, fit, shares);
        Ok(true)
    }

    /// The fits of the layouts after each of the moves and `steps` steps of the nodes.
    fn fits(
        &self,
        changes: &[Change],
        candidates: &[Proposal],
        steps: usize,
        progress: &Progress,
    ) -> Result<Vec<Evaluated>, Cancelled> {
        let one = |change: &Change| {
            progress.check()?;
            Ok(fit(&self.model, &self.with(change, candidates), steps, progress).ok())
        };
        let found = changes.par_iter().map(one).collect::<Result<_, Cancelled>>()?;
        progress.check()?;
        Ok(found)
    }

    /// Whether the present layout is better than the best one before.
    pub(in crate::weave) fn is_best(&self) -> bool {
        self.now.fit.objective < self.best.fit.objective - LEAST_GAIN
    }

    /// Makes the present layout the best one; `strips` are its strips in the session.
    pub(in crate::weave) fn keep(&mut self, strips: &[Strip]) {
        for (tried, strip) in self.now.strips.iter_mut().zip(strips) {
            tried.placed = Some(strip.clone());
        }
        self.best = self.now.clone();
    }

    /// Returns to the best layout.
    pub(in crate::weave) fn revert(&mut self) {
        self.now = self.best.clone();
    }

    /// The candidates of a round, smoothed: loops through the first vertex, then through the second. Also returns the number of
    /// the former.
    fn candidates(&mut self, progress: &Progress) -> Result<(Vec<Proposal>, usize), WeaveError> {
        let v = self.point();
        let other = self.point_near(v);
        let model = &*self.model;
        let none = DirectionMask::all_open();
        let plain: Vec<Query> = std::iter::once((v, None)).chain(around(model, v)).collect();
        let mut found = loops(&model.graph, &plain, &none, POOL, progress)?;
        let mut chosen = Vec::new();
        while chosen.len() < LOOPS && !found.is_empty() {
            chosen.push(found.swap_remove(self.random.below(found.len())));
        }
        let mut through = chosen.len();
        if let Some(alignment) = &self.alignment {
            chosen.extend(loops(&alignment.graph, &alignment.queries(v), &none, LOOPS, progress)?);
            through = chosen.len();
            if let Some(w) = other {
                chosen.extend(loops(&alignment.graph, &alignment.queries(w), &none, LOOPS, progress)?);
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

    /// A random vertex of a triangle drawn with probability proportional to its contribution to the deviation.
    fn point(&mut self) -> VertexId {
        let mut left = self.random.unit() * self.now.shares.iter().sum::<f64>();
        let beyond = |share: &f64| {
            left -= share;
            left < 0.0
        };
        let face = self.now.shares.iter().position(beyond).unwrap_or(0);
        self.model.mesh.face_vertices(FaceId::new(face))[self.random.below(3)]
    }

    /// Another vertex drawn like [`Self::point`], within [`NEARBY`] of `v`; `None` if none is found in [`DRAWS`] draws.
    fn point_near(&mut self, v: VertexId) -> Option<VertexId> {
        let model = Arc::clone(&self.model);
        let at = |v| model.mesh.position(v);
        (0..DRAWS).map(|_| self.point()).find(|&w| w != v && at(w).distance(at(v)) < NEARBY)
    }

    /// The moves of a round; the first `through` candidates pass its first vertex.
    fn changes(&mut self, candidates: &[Proposal], through: usize) -> Vec<Change> {
        let n = self.now.strips.len();
        let mut list = vec![Change { out: Some(self.random.below(n)), add: Vec::new() }];
        let beside: Vec<Vec<bool>> = self.now.curves().map(|c| self.beside(c)).collect();
        for (c, candidate) in candidates[..through].iter().enumerate() {
            let shared = |&i: &usize| self.passed(&candidate.curve).filter(|f| beside[i][f.index()]).count();
            let parallel = (0..n).max_by_key(shared);
            list.push(Change { out: None, add: vec![c] });
            list.extend([parallel, Some(self.random.below(n))].map(|out| Change { out, add: vec![c] }));
        }
        for (size, count) in GROUPS {
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

    /// For each triangle whether a curve passes within [`RINGS`] rings of it.
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

    /// The strips after a move.
    fn with<'a>(&'a self, change: &Change, candidates: &'a [Proposal]) -> Vec<&'a SurfaceCurve> {
        let kept = self.now.curves().enumerate().filter(|(i, _)| Some(*i) != change.out).map(|(_, curve)| curve);
        kept.chain(change.add.iter().map(|&c| &candidates[c].curve)).collect()
    }
}

/// Pseudo-random numbers by SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `[0, 1)`.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `0..n`; 0 if `n` is 0.
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}
