//! Improving a valid layout: other strips, with which patches follow the shape better and are fewer.
//!
//! What field and map of a layout show where its nodes are drawn (`super::fit`) is enough to choose between layouts, and is
//! there in a tenth of a second. So many are tried. In each round some points are drawn at random from where the layout
//! deviates most from principal directions, and the loops through these are candidates. Each is tried beside the strips that
//! are there and in place of some of them; now and then it is tried to leave strips out. The change that lowers the price
//! most is made, if it still does after some steps of the nodes, and the next round begins, until nothing was found for a
//! while. Random numbers are the same every time.
//!
//! What matters does not depend on triangles much smaller than patches: a mesh of many triangles is improved on a
//! proxy. A change is made only if the strips make the same layout on the mesh that the session weaves on.

use std::ops::ControlFlow;
use std::sync::Arc;

use rayon::prelude::*;
use serde::Serialize;

use super::candidates::{Query, around, loops};
use super::design::Strip;
use super::fit::{Fit, fit};
use super::ground::alike;
use super::model::{Model, Options};
use super::proposal::Proposal;
use super::session::{Session, WeaveError};
use crate::dual::Arrangement;
use crate::elastica::DirectionMask;
use crate::mesh::{FaceId, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::{RelaxOptions, SurfaceCurve, relax};

/// Rounds that usually lead to where further ones gain little.
pub const ROUNDS: usize = 60;
/// Rounds in a row without a change after which no better layout is expected.
const IDLE: usize = 16;
/// Triangles of the mesh that layouts are tried on, and how many times as many a mesh has that is given such a proxy.
const ROUGH: u32 = 6000;
const WORTH: usize = 2;
/// Points whose loops are candidates in a round, and how many loops of all are tried.
const POINTS: usize = 4;
const TRIED: usize = 16;
/// Strips in place of which each candidate is tried.
const SWAPS: usize = 3;
/// Every how many rounds it is tried to leave strips out.
const SPARING: usize = 4;
/// By how much a change has to lower the price, in degrees.
const LEAST_GAIN: f64 = 1e-3;
/// Changes of a round that are looked into, the best first.
const LOOKED_INTO: usize = 4;
/// Steps of the nodes after which a layout is judged that is to be taken.
const STEPS: usize = 4;
/// Radius of the tube in which a strip is smoothed that was carried from a proxy, in mean edges: the proxy's are longer.
const TUBE: f64 = 5.0;

/// How much better a layout has become.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Improvement {
    /// How well it fitted before.
    pub before: Fit,
    /// How well it fits now.
    pub after: Fit,
    /// Changes made.
    pub changes: usize,
}

/// A change of the strips: one is left out, or a candidate added, or both.
#[derive(Debug, Clone, Copy)]
struct Change {
    out: Option<usize>,
    add: Option<usize>,
}

/// A change that makes the layout better.
struct Better {
    change: Change,
    fit: Fit,
    shares: Vec<f64>,
    /// The price before the nodes move.
    drawn: f64,
}

impl Session {
    /// Makes the layout fit the shape better, in at most so many rounds. Every change is shown to `watch`, with the session
    /// as it is by then; it may break off. All changes together are one step of the history.
    ///
    /// # Errors
    ///
    /// [`crate::layout::LayoutError::RedRegions`] while there is no layout, or cancelled; the design is then as before.
    pub fn improve(
        &mut self,
        rounds: usize,
        progress: &Progress,
        watch: &mut dyn FnMut(&Self, &Improvement) -> ControlFlow<()>,
    ) -> Result<Improvement, WeaveError> {
        progress.report("Preparing to try other strips", 0.0);
        let rough = self.rough(progress)?;
        let mut trial = Trial::new(rough.as_ref().unwrap_or(self), progress)?;
        let before = self.step();
        let woven = Arc::clone(self.woven());
        let done = self.improve_by(&mut trial, rounds, progress, watch);
        match &done {
            Ok(improvement) if improvement.changes > 0 => self.remember(before),
            Ok(_) => {}
            Err(_) => self.restore(before, woven),
        }
        done
    }

    fn improve_by(
        &mut self,
        trial: &mut Trial,
        rounds: usize,
        progress: &Progress,
        watch: &mut dyn FnMut(&Self, &Improvement) -> ControlFlow<()>,
    ) -> Result<Improvement, WeaveError> {
        let mut improvement = Improvement { before: trial.fit, after: trial.fit, changes: 0 };
        let mut idle = 0;
        for round in 0..rounds {
            progress.report("Trying other strips", round as f64 / rounds as f64);
            let candidates = trial.candidates(progress)?;
            let changes = trial.changes(round, candidates.len());
            let better = trial.better(&changes, &candidates, progress)?;
            let mut made = None;
            for (change, price) in better.into_iter().take(LOOKED_INTO) {
                let Some(better) = trial.looked_into(change, price, &candidates, progress)? else { continue };
                if let Some(strips) = self.changed(trial, change, &candidates, progress)? {
                    made = Some((better, strips));
                    break;
                }
            }
            let Some((better, strips)) = made else {
                idle += 1;
                if idle == IDLE {
                    break;
                }
                continue;
            };
            idle = 0;
            trial.make(better, &candidates);
            self.weave(strips, progress)?;
            improvement.after = trial.fit;
            improvement.changes += 1;
            tracing::debug!(round, after = ?trial.fit, "a better layout");
            if watch(self, &improvement).is_break() {
                break;
            }
        }
        Ok(improvement)
    }

    /// This session on a proxy, if that is worth while and the strips fit it.
    fn rough(&self, progress: &Progress) -> Result<Option<Self>, WeaveError> {
        if self.model().mesh.n_faces() <= WORTH * ROUGH as usize {
            return Ok(None);
        }
        match self.with_options(Options { proxy: ROUGH, ..self.model().options }, progress) {
            Ok(session) => Ok(Some(session)),
            Err(WeaveError::Cancelled(cancelled)) => Err(cancelled.into()),
            Err(error) => {
                tracing::debug!(%error, "improved without a proxy");
                Ok(None)
            }
        }
    }

    /// The strips of this session after a change; `None` if they do not make the same layout on its mesh as on that of the
    /// trial.
    fn changed(
        &self,
        trial: &Trial,
        change: Change,
        candidates: &[Proposal],
        progress: &Progress,
    ) -> Result<Option<Vec<Strip>>, WeaveError> {
        let mut strips = self.design().strips.clone();
        if let Some(out) = change.out {
            strips.remove(out);
        }
        let Some(candidate) = change.add.map(|c| &candidates[c]) else { return Ok(Some(strips)) };
        let wanted = trial.with(change, candidates);
        let smooth = [true, false].into_iter().filter_map(|smooth| self.carried(trial, candidate, smooth, progress));
        for strip in smooth {
            progress.check()?;
            if Arc::ptr_eq(&trial.model, self.model()) || self.is_like(trial, &wanted, strips.iter().chain([&strip])) {
                strips.push(strip);
                return Ok(Some(strips));
            }
        }
        Ok(None)
    }

    /// Whether strips make the same of the mesh that the session weaves on as curves of that of the trial.
    fn is_like<'s>(&self, trial: &Trial, curves: &[&SurfaceCurve], strips: impl Iterator<Item = &'s Strip>) -> bool {
        let here = Arrangement::sketch(&self.model().mesh, strips.map(Strip::woven));
        let there = Arrangement::sketch(&trial.model.mesh, curves.iter().copied());
        // What cannot be arranged is like nothing: the change is not made, and what was found before stays.
        here.ok().zip(there.ok()).is_some_and(|(here, there)| alike(&here, &there))
    }

    /// A candidate as a strip of this session, smoothed on its mesh if it comes from another and that is asked for.
    fn carried(&self, trial: &Trial, candidate: &Proposal, smooth: bool, progress: &Progress) -> Option<Strip> {
        let (model, own) = (self.model(), Arc::ptr_eq(&trial.model, self.model()));
        let mesh = &*model.loaded.mesh;
        let mut curve = trial.model.to_design(&candidate.curve).ok()?;
        if smooth && !own {
            let options = RelaxOptions { tube: TUBE, ..Default::default() };
            curve = relax(mesh, &curve, &options, progress).ok()?.curve;
        }
        let on_proxy = match &model.proxy {
            None => None,
            Some(_) if own => Some(candidate.curve.clone()),
            Some(proxy) => Some(proxy.curve_to_proxy(mesh, &curve).ok()?),
        };
        let Proposal { cost, energy, .. } = *candidate;
        Some(Strip { id: self.free_id(), curve, on_proxy, cost, energy, visible: true })
    }
}

/// Strips under improvement on the mesh that they are tried on.
struct Trial {
    model: Arc<Model>,
    /// The strips, in the order of those of the session.
    curves: Vec<SurfaceCurve>,
    fit: Fit,
    /// The price before the nodes move.
    drawn: f64,
    /// What each triangle adds to the deviation.
    shares: Vec<f64>,
    random: Random,
}

impl Trial {
    fn new(session: &Session, progress: &Progress) -> Result<Self, WeaveError> {
        let model = Arc::clone(session.model());
        let curves: Vec<SurfaceCurve> = session.design().strips.iter().map(|s| s.woven().clone()).collect();
        let all: Vec<&SurfaceCurve> = curves.iter().collect();
        let drawn = fit(&model, &all, 0, progress)?.0.price;
        let (fit, shares) = fit(&model, &all, STEPS, progress)?;
        Ok(Self { model, curves, fit, drawn, shares, random: Random(1) })
    }

    /// Loops through points where the layout deviates from principal directions, smoothed.
    fn candidates(&mut self, progress: &Progress) -> Result<Vec<Proposal>, WeaveError> {
        let points: Vec<VertexId> = (0..POINTS).map(|_| self.point()).collect();
        let model = &*self.model;
        let all_around = |&v: &VertexId| std::iter::once((v, None)).chain(around(model, v));
        let queries: Vec<Query> = points.iter().flat_map(all_around).collect();
        let found = loops(model, &queries, &DirectionMask::none(), TRIED, progress)?;
        let smooth = |p: Proposal| match relax(&model.mesh, &p.curve, &RelaxOptions::default(), progress) {
            Ok(relaxed) => p.relaxed(relaxed),
            Err(_) => p,
        };
        let smoothed = found.into_par_iter().map(smooth).collect();
        progress.check()?;
        Ok(smoothed)
    }

    /// A vertex at random, the likelier the more its triangles add to the deviation.
    fn point(&mut self) -> VertexId {
        let mut left = self.random.unit() * self.shares.iter().sum::<f64>();
        let beyond = |share: &f64| {
            left -= share;
            left < 0.0
        };
        let face = self.shares.iter().position(beyond).unwrap_or(0);
        self.model.mesh.face_vertices(FaceId::new(face))[self.random.below(3)]
    }

    /// What is to be tried in a round.
    fn changes(&mut self, round: usize, candidates: usize) -> Vec<Change> {
        let mut list = Vec::new();
        if round.is_multiple_of(SPARING) {
            list.extend((0..self.curves.len()).map(|i| Change { out: Some(i), add: None }));
        }
        for add in (0..candidates).map(Some) {
            list.push(Change { out: None, add });
            list.extend((0..SWAPS).map(|_| Change { out: Some(self.random.below(self.curves.len())), add }));
        }
        list
    }

    /// The changes that lower the price before the nodes move, and what it is then; the best first.
    fn better(
        &self,
        changes: &[Change],
        candidates: &[Proposal],
        progress: &Progress,
    ) -> Result<Vec<(Change, f64)>, Cancelled> {
        let prices: Vec<Option<f64>> = changes
            .par_iter()
            .map(|&change| {
                progress.check()?;
                // What makes no layout, or one that cannot be drawn, is no improvement.
                let found = fit(&self.model, &self.with(change, candidates), 0, progress).ok();
                Ok(found.map(|(fit, _)| fit.price).filter(|price| *price < self.drawn - LEAST_GAIN))
            })
            .collect::<Result<_, Cancelled>>()?;
        progress.check()?;
        let pairs = changes.iter().zip(prices);
        let mut better: Vec<(Change, f64)> = pairs.filter_map(|(change, price)| Some((*change, price?))).collect();
        better.sort_by(|a, b| a.1.total_cmp(&b.1));
        Ok(better)
    }

    /// A change of such a price before the nodes move, if it lowers that after they have, too.
    fn looked_into(
        &self,
        change: Change,
        drawn: f64,
        candidates: &[Proposal],
        progress: &Progress,
    ) -> Result<Option<Better>, Cancelled> {
        let found = fit(&self.model, &self.with(change, candidates), STEPS, progress).ok();
        progress.check()?;
        let found = found.filter(|(fit, _)| fit.price < self.fit.price - LEAST_GAIN);
        Ok(found.map(|(fit, shares)| Better { change, fit, shares, drawn }))
    }

    /// The strips after a change.
    fn with<'a>(&'a self, change: Change, candidates: &'a [Proposal]) -> Vec<&'a SurfaceCurve> {
        let stays = |i: &usize| Some(*i) != change.out;
        let kept = (0..self.curves.len()).filter(stays).map(|i| &self.curves[i]);
        kept.chain(change.add.map(|c| &candidates[c].curve)).collect()
    }

    fn make(&mut self, better: Better, candidates: &[Proposal]) {
        self.curves = self.with(better.change, candidates).into_iter().cloned().collect();
        (self.fit, self.drawn, self.shares) = (better.fit, better.drawn, better.shares);
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
