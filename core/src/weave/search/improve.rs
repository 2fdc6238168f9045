//! Improves a valid layout by a stochastic local search over its strips.
//!
//! The objective is the predicted fit of a layout ([`super::fit`]), which takes a tenth of a second without optimising the
//! embedding. In each round some changes of the strips are evaluated ([`super::trial`]), the best of them again after some
//! steps of the nodes. The best change is made even if it raises the objective a little, by a tolerance that decreases to
//! zero, as in threshold accepting. The best layout of all rounds is kept. Random numbers are the same in every run.
//!
//! The fit hardly depends on triangles much smaller than patches, so a mesh of many triangles is improved on a coarse proxy.
//! A layout is transferred only if the strips have the same arrangement on the woven mesh of the session.

use std::ops::ControlFlow;
use std::sync::Arc;

use serde::Serialize;

use crate::dual::Arrangement;
use crate::progress::Progress;
use crate::surface::{RelaxOptions, relax};
use crate::weave::design::{Strip, StripId};
use crate::weave::error::WeaveError;
use crate::weave::mesh_role::same_regions;
use crate::weave::options::Options;
use crate::weave::proposal::Proposal;
use crate::weave::search::fit::Fit;
use crate::weave::search::trial::Trial;
use crate::weave::session::Session;

/// Default number of rounds: further ones usually gain little.
pub const IMPROVEMENT_ROUNDS: usize = 200;
/// Number of consecutive rounds without a change after which the search stops. Chosen by hand.
const IDLE: usize = 40;
/// Number of triangles of the coarsest proxy that layouts are tried on. Chosen by hand.
const COARSEST: u32 = 6000;
/// A mesh is improved on a proxy if it has more than this many times the proxy's triangles. Chosen by hand.
const LEAST_SIMPLIFICATION: usize = 2;
/// Factor between the sizes of the proxies tried in turn, until the strips have the same arrangement on one. Chosen by hand.
const REFINEMENT: u32 = 2;
/// By how much the objective may rise in the first round, in degrees: about the contribution of a strip that does not
/// improve the layout yet. It decreases to zero quadratically.
const TOLERANCE: f64 = 0.3;
/// Radius of the tube in which a strip from a proxy is relaxed on a finer mesh, in mean edge lengths. Larger than for loops,
/// since edges of the proxy are longer. Chosen by hand.
const TUBE: f64 = 5.0;

/// The gain of an improvement.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Improvement {
    /// Fit of the layout before.
    pub before: Fit,
    /// Fit of the best layout so far.
    pub after: Fit,
    /// Number of times that a better layout was found.
    pub changes: usize,
}

impl Session {
    /// Improves the layout, in at most `rounds` rounds. `watch` sees every better layout, with the session that has it, and may
    /// stop the search. All changes together are one step of the history.
    ///
    /// # Errors
    ///
    /// [`crate::layout::LayoutError::RedRegions`] while there is no layout, or when cancelled; the session is then unchanged.
    pub fn improve(
        &mut self,
        rounds: usize,
        progress: &Progress,
        watch: &mut dyn FnMut(&Self, &Improvement) -> ControlFlow<()>,
    ) -> Result<Improvement, WeaveError> {
        progress.report("Preparing to try other strips", 0.0);
        let coarse = self.on_coarse_proxy(progress)?;
        let mut trial = Trial::new(coarse.as_ref().unwrap_or(self), self.design(), progress)?;
        let before = self.state();
        let woven = Arc::clone(self.woven());
        let done = self.run_trial(&mut trial, rounds, progress, watch);
        match &done {
            Ok(improvement) if improvement.changes > 0 => self.remember(before),
            Ok(_) => {}
            Err(_) => self.restore(before, woven),
        }
        done
    }

    /// The rounds of the search; sets the strips of each better layout.
    fn run_trial(
        &mut self,
        trial: &mut Trial,
        rounds: usize,
        progress: &Progress,
        watch: &mut dyn FnMut(&Self, &Improvement) -> ControlFlow<()>,
    ) -> Result<Improvement, WeaveError> {
        let mut improvement = Improvement { before: trial.best.fit, after: trial.best.fit, changes: 0 };
        let mut idle = 0;
        for round in 0..rounds {
            let remaining = 1.0 - round as f64 / rounds as f64;
            progress.report("Trying other strips", 1.0 - remaining);
            let changed = trial.change(TOLERANCE * remaining * remaining, progress)?;
            idle = if changed { 0 } else { idle + 1 };
            if idle == IDLE {
                break;
            }
            if !changed || !trial.is_best() {
                continue;
            }
            let Some(strips) = self.transferred(trial, progress)? else {
                tracing::debug!(round, "a better layout has another arrangement on the woven mesh");
                trial.revert();
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

    /// This session on the coarsest proxy with the same arrangement; `None` if the mesh is small or there is none.
    fn on_coarse_proxy(&self, progress: &Progress) -> Result<Option<Self>, WeaveError> {
        let mut proxy = COARSEST;
        while self.model().mesh.n_faces() > LEAST_SIMPLIFICATION * proxy as usize {
            match self.with_options(Options { proxy, ..self.model().options }, progress) {
                Ok(session) => return Ok(Some(session)),
                Err(WeaveError::Cancelled(cancelled)) => return Err(cancelled.into()),
                Err(error) => tracing::debug!(%error, proxy, "not improved on a proxy"),
            }
            proxy *= REFINEMENT;
        }
        Ok(None)
    }

    /// The strips of a trial as strips of this session, relaxed if they come from another mesh. If the relaxed strips have
    /// another arrangement they are not relaxed; `None` if the arrangement then differs as well.
    fn transferred(&self, trial: &Trial, progress: &Progress) -> Result<Option<Vec<Strip>>, WeaveError> {
        for smooth in [true, false] {
            let strips: Option<Vec<Strip>> = (self.free_id().0..)
                .zip(&trial.now.strips)
                .map(|(id, s)| {
                    s.placed.clone().or_else(|| self.strip(trial, &s.proposal, StripId(id), smooth, progress))
                })
                .collect();
            progress.check()?;
            if let Some(strips) = strips.filter(|s| trial.is_on(self.model()) || self.has_same_regions(trial, s)) {
                return Ok(Some(strips));
            }
        }
        Ok(None)
    }

    /// Whether strips have the same regions on the woven mesh of this session as those of a trial on its mesh.
    fn has_same_regions(&self, trial: &Trial, strips: &[Strip]) -> bool {
        let here = Arrangement::unsubdivided(&self.model().mesh, strips.iter().map(Strip::woven));
        let there = Arrangement::unsubdivided(&trial.model.mesh, trial.now.curves());
        // Strips that cannot be arranged are not transferred; the best layout before stays.
        here.ok().zip(there.ok()).is_some_and(|(here, there)| same_regions(&here, &there))
    }

    /// A candidate as a strip of this session, relaxed on the design mesh if `smooth` and it comes from another mesh.
    fn strip(&self, trial: &Trial, tried: &Proposal, id: StripId, smooth: bool, progress: &Progress) -> Option<Strip> {
        let (model, own) = (self.model(), trial.is_on(self.model()));
        let mesh = &*model.loaded.mesh;
        let mut curve = trial.model.to_design(&tried.curve).ok()?;
        if smooth && !own {
            let options = RelaxOptions { tube: TUBE, tie: model.options.relaxation_tie(), ..Default::default() };
            curve = relax(mesh, &curve, &options, progress).ok()?.curve;
        }
        let on_proxy = match &model.proxy {
            None => None,
            Some(_) if own => Some(tried.curve.clone()),
            Some(proxy) => Some(proxy.curve_to_proxy(mesh, &curve).ok()?),
        };
        let Proposal { cost, energy, .. } = *tried;
        Some(Strip { id, curve, on_proxy, cost, energy, visible: true, anchors: tried.anchors.clone() })
    }
}
