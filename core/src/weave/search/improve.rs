//! Improving a valid layout: other strips, with which patches follow the shape better and are fewer.
//!
//! What field and map of a layout show where its nodes are drawn (`crate::weave::search::fit`) is enough to choose between layouts, and is
//! there in a tenth of a second. So many are tried. In each round a few changes of the strips are (`crate::weave::search::trial`); those that
//! make the price least are looked into after some steps of the nodes. The best of them is made, even if it makes the price a
//! little higher: the less so the more rounds have gone by. The best layout of all is kept. Random numbers are the same every
//! time.
//!
//! What matters does not depend on triangles much smaller than patches: a mesh of many triangles is improved on a
//! proxy. A layout is taken over only if the strips make the same of the mesh that the session weaves on.

use std::ops::ControlFlow;
use std::sync::Arc;

use serde::Serialize;

use crate::dual::Arrangement;
use crate::progress::Progress;
use crate::surface::{RelaxOptions, relax};
use crate::weave::design::{Strip, StripId};
use crate::weave::error::WeaveError;
use crate::weave::mesh_role::alike;
use crate::weave::model::Options;
use crate::weave::proposal::Proposal;
use crate::weave::search::fit::Fit;
use crate::weave::search::trial::Trial;
use crate::weave::session::Session;

/// Rounds that usually lead to where further ones gain little.
pub const IMPROVEMENT_ROUNDS: usize = 200;
/// Rounds in a row without a change after which no better layout is expected.
const IDLE: usize = 40;
/// Triangles of the mesh that layouts are tried on, and how many times as many a mesh has that is given such a proxy; by what
/// factor there are more where the strips do not fit it.
const ROUGH: u32 = 6000;
const WORTH: usize = 2;
const FINER: u32 = 2;
/// By how much the price may rise in a round at first, in degrees: about what a strip is worth that is of no use yet. It
/// falls to nothing.
const TOLERANCE: f64 = 0.3;
/// Radius of the tube in which a strip is smoothed that was carried from a proxy, in mean edges: the proxy's are longer.
const TUBE: f64 = 5.0;

/// How much better a layout has become.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Improvement {
    /// How well it fitted before.
    pub before: Fit,
    /// How well it fits now.
    pub after: Fit,
    /// How often a better one was found.
    pub changes: usize,
}

impl Session {
    /// Makes the layout fit the shape better, in so many rounds. Every better layout is shown to `watch`, with the session
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
        let mut trial = Trial::new(rough.as_ref().unwrap_or(self), self.design(), progress)?;
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
        let mut improvement = Improvement { before: trial.best.fit, after: trial.best.fit, changes: 0 };
        let mut idle = 0;
        for round in 0..rounds {
            let left = 1.0 - round as f64 / rounds as f64;
            progress.report("Trying other strips", 1.0 - left);
            let changed = trial.change(TOLERANCE * left * left, progress)?;
            idle = if changed { 0 } else { idle + 1 };
            if idle == IDLE {
                break;
            }
            if !changed || !trial.is_best() {
                continue;
            }
            let Some(strips) = self.carried(trial, progress)? else {
                tracing::debug!(round, "a better layout is another one on the mesh");
                trial.go_back();
                continue;
            };
            trial.keep(&strips);
            self.weave(strips, progress)?;
            improvement.after = trial.best.fit;
            improvement.changes += 1;
            tracing::debug!(round, after = ?trial.best.fit, "a better layout");
            if watch(self, &improvement).is_break() {
                break;
            }
        }
        Ok(improvement)
    }

    /// This session on a proxy, if that is worth while: the smallest that the strips fit.
    fn rough(&self, progress: &Progress) -> Result<Option<Self>, WeaveError> {
        let mut proxy = ROUGH;
        while self.model().mesh.n_faces() > WORTH * proxy as usize {
            match self.with_options(Options { proxy, ..self.model().options }, progress) {
                Ok(session) => return Ok(Some(session)),
                Err(WeaveError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(error) => tracing::debug!(%error, proxy, "not improved on a proxy"),
            }
            proxy *= FINER;
        }
        Ok(None)
    }

    /// The strips of a trial as strips of this session; `None` if they do not make the same layout on its mesh as on that
    /// of the trial.
    fn carried(&self, trial: &Trial, progress: &Progress) -> Result<Option<Vec<Strip>>, WeaveError> {
        for smooth in [true, false] {
            let strips: Option<Vec<Strip>> = (self.free_id().0..)
                .zip(&trial.now.strips)
                .map(|(id, s)| {
                    s.known.clone().or_else(|| self.strip(trial, &s.proposal, StripId(id), smooth, progress))
                })
                .collect();
            progress.check()?;
            if let Some(strips) = strips.filter(|s| trial.is_on(self.model()) || self.is_like(trial, s)) {
                return Ok(Some(strips));
            }
        }
        Ok(None)
    }

    /// Whether strips make the same of the mesh that the session weaves on as those of a trial of its mesh.
    fn is_like(&self, trial: &Trial, strips: &[Strip]) -> bool {
        let here = Arrangement::unsubdivided(&self.model().mesh, strips.iter().map(Strip::woven));
        let there = Arrangement::unsubdivided(&trial.model.mesh, trial.now.curves());
        // What cannot be arranged is like nothing: the layout is not taken over, and what was found before stays.
        here.ok().zip(there.ok()).is_some_and(|(here, there)| alike(&here, &there))
    }

    /// What was tried as a strip of this session, smoothed on its mesh if it comes from another and that is asked for.
    fn strip(&self, trial: &Trial, tried: &Proposal, id: StripId, smooth: bool, progress: &Progress) -> Option<Strip> {
        let (model, own) = (self.model(), trial.is_on(self.model()));
        let mesh = &*model.loaded.mesh;
        let mut curve = trial.model.to_design(&tried.curve).ok()?;
        if smooth && !own {
            let options = RelaxOptions { tube: TUBE, ..Default::default() };
            curve = relax(mesh, &curve, &options, progress).ok()?.curve;
        }
        let on_proxy = match &model.proxy {
            None => None,
            Some(_) if own => Some(tried.curve.clone()),
            Some(proxy) => Some(proxy.curve_to_proxy(mesh, &curve).ok()?),
        };
        let Proposal { cost, energy, .. } = *tried;
        Some(Strip { id, curve, on_proxy, cost, energy, visible: true })
    }
}
