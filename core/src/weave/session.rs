//! A session: a model, the design woven on it, and its history.

use std::sync::Arc;

use crate::dual::{Arrangement, ArrangementError};
use crate::elastica::{Certainty, FoundLoop};
use crate::mesh::{LoadedMesh, MeshSource, fingerprint};
use crate::progress::Progress;
use crate::surface::{SurfaceCurve, SurfacePoint};
use crate::weave::design::{Design, Pin, Strip, StripId};
use crate::weave::error::WeaveError;
use crate::weave::loop_contacts::LoopContacts;
use crate::weave::mesh_role::alike;
use crate::weave::model::{Model, Options};
use crate::weave::proposal::{Proposal, smoothed_proposal};
use crate::weave::recent::RecentSearches;
use crate::weave::woven::Woven;
use rayon::prelude::*;

/// A state of the history: strips, and the pins that were set while they were there.
#[derive(Debug, Clone)]
pub(in crate::weave) struct Step {
    strips: Vec<Strip>,
    pins: Vec<Pin>,
}

/// A model, the design woven on it, and its history.
#[derive(Debug)]
pub struct Session {
    model: Arc<Model>,
    design: Design,
    woven: Arc<Woven>,
    /// Earlier and later states.
    undo: Vec<Step>,
    redo: Vec<Step>,
    next_id: u32,
    recent: RecentSearches,
}

impl Session {
    /// Makes `loaded` ready and starts an empty design on it.
    ///
    /// # Errors
    ///
    /// See [`Model::prepare`].
    pub fn open(
        loaded: LoadedMesh,
        source: MeshSource,
        options: Options,
        progress: &Progress,
    ) -> Result<Self, WeaveError> {
        let design = Design::new(source, &loaded.mesh, options);
        Self::resume(loaded, design, progress)
    }

    /// Makes `loaded` ready and continues `design` on it.
    ///
    /// # Errors
    ///
    /// See [`Model::prepare`]; [`DesignError::OtherMesh`] when the design was made on another mesh.
    pub fn resume(loaded: LoadedMesh, mut design: Design, progress: &Progress) -> Result<Self, WeaveError> {
        design.check_mesh(&loaded.mesh)?;
        let mut model = Model::prepare(loaded, design.options, progress)?;
        if !on_proxy(&model, &mut design)? {
            tracing::warn!("the strips do not fit the proxy: woven without one");
            let options = Options { proxy: 0, smoothing: 0.0, ..design.options };
            model = Model::prepare(model.loaded, options, progress)?;
            on_proxy(&model, &mut design)?;
        }
        let model = Arc::new(model);
        let woven = Arc::new(Woven::new(&model, &design.strips, progress)?);
        let next_id = design.strips.iter().map(|s| s.id.0 + 1).max().unwrap_or(0);
        let (undo, redo, recent) = (Vec::new(), Vec::new(), RecentSearches::default());
        Ok(Self { model, design, woven, undo, redo, next_id, recent })
    }

    /// The same design woven under other options. Strips stay where they are; of the history there is as much as fits.
    ///
    /// # Errors
    ///
    /// See [`Model::prepare`]; [`WeaveError::Options`] if the strips make something else of the mesh that would be woven
    /// on.
    pub fn with_options(&self, options: Options, progress: &Progress) -> Result<Self, WeaveError> {
        let design = Design { options, ..self.design.clone() };
        let mut new = Self::resume(self.model.loaded.clone(), design, progress)?;
        if new.model.options != options {
            return Err(WeaveError::Options);
        }
        let fits = |step: &Step| {
            let mut design = Design { strips: step.strips.clone(), ..new.design.clone() };
            let fits = on_proxy(&new.model, &mut design).unwrap_or(false);
            fits.then(|| Step { strips: design.strips, pins: step.pins.clone() })
        };
        let history = |steps: &[Step]| {
            let mut kept: Vec<Step> = steps.iter().rev().map_while(fits).collect();
            kept.reverse();
            kept
        };
        let (undo, redo) = (history(&self.undo), history(&self.redo));
        (new.undo, new.redo, new.next_id) = (undo, redo, self.next_id);
        Ok(new)
    }

    /// The mesh made ready.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The document.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Says where the mesh of the design is to be found from now on.
    pub fn set_source(&mut self, source: MeshSource) {
        self.design.mesh = source;
    }

    /// What the strips make of the surface.
    pub fn woven(&self) -> &Arc<Woven> {
        &self.woven
    }

    /// The strips that could be placed through a point of the design's mesh, the best first.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn proposals(&mut self, at: SurfacePoint, progress: &Progress) -> Result<Vec<Proposal>, WeaveError> {
        self.proposals_with(at, progress, |_| {})
    }

    /// As [`Self::proposals`]; hands the first loop found to `first` before it is proved to be the best, and the best
    /// when it is, before alternatives are there.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn proposals_with(
        &mut self,
        at: SurfacePoint,
        progress: &Progress,
        mut first: impl FnMut(Proposal),
    ) -> Result<Vec<Proposal>, WeaveError> {
        let at = self.model.to_woven(at);
        let graph = &self.model.graph;
        let vertex = at.nearest_vertex(&self.model.mesh);
        let placed = self.design.strips.iter().map(Strip::woven);
        let company = LoopContacts::new(&self.model.mesh, &self.model.sharp, placed);
        let smoothed_proposal = |l: &FoundLoop| smoothed_proposal(graph, &company, l, at, progress);
        let mut best: Option<(SurfaceCurve, Result<Proposal, WeaveError>)> = None;
        let mut watch = |certainty: Certainty, l: &FoundLoop| match certainty {
            Certainty::Found => first(Proposal::found(l)),
            Certainty::Proved => {
                let smooth = smoothed_proposal(l);
                if let Ok(smooth) = &smooth {
                    first(smooth.clone());
                }
                best = Some((l.curve.clone(), smooth));
            }
        };
        let found = self.recent.proposals(graph, &self.woven, vertex, progress, &mut watch)?;
        // What was handed out already is not smoothed again.
        let (known, smooth) = best.map_or((None, None), |(curve, smooth)| (Some(curve), Some(smooth)));
        let done = found.first().is_some_and(|l| known.as_ref() == Some(&l.curve));
        let rest: Vec<_> = found.par_iter().skip(usize::from(done)).map(smoothed_proposal).collect();
        smooth.filter(|_| done).into_iter().chain(rest).collect()
    }

    /// Places a strip.
    ///
    /// # Errors
    ///
    /// When its curve does not lie on the mesh, or cancelled; the design is then as before.
    pub fn place(&mut self, proposal: Proposal, progress: &Progress) -> Result<StripId, WeaveError> {
        let id = self.free_id();
        let mut strips = self.design.strips.clone();
        let curve = self.model.to_design(&proposal.curve)?;
        let on_proxy = self.model.proxy.is_some().then_some(proposal.curve);
        strips.push(Strip { id, curve, on_proxy, cost: proposal.cost, energy: proposal.energy, visible: true });
        self.change(strips, progress)?;
        self.next_id += 1;
        Ok(id)
    }

    /// Removes a strip.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoStrip`], or cancelled; the design is then as before.
    pub fn remove(&mut self, id: StripId, progress: &Progress) -> Result<(), WeaveError> {
        let strips: Vec<Strip> = self.design.strips.iter().filter(|s| s.id != id).cloned().collect();
        if strips.len() == self.design.strips.len() {
            return Err(WeaveError::NoStrip(id));
        }
        self.change(strips, progress)
    }

    /// Shows or hides a strip; not a step of the history.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoStrip`].
    pub fn set_visible(&mut self, id: StripId, visible: bool) -> Result<(), WeaveError> {
        let strip = self.design.strips.iter_mut().find(|s| s.id == id).ok_or(WeaveError::NoStrip(id))?;
        strip.visible = visible;
        Ok(())
    }

    /// Whether there is a step to take back.
    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    /// Whether there is a step to take again.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Takes the last step back; does nothing when there is none.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn undo(&mut self, progress: &Progress) -> Result<(), WeaveError> {
        let Some(step) = self.undo.last().cloned() else { return Ok(()) };
        let now = self.turn_to(step, progress)?;
        self.undo.pop();
        self.redo.push(now);
        Ok(())
    }

    /// Takes a step again; does nothing when there is none.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn redo(&mut self, progress: &Progress) -> Result<(), WeaveError> {
        let Some(step) = self.redo.last().cloned() else { return Ok(()) };
        let now = self.turn_to(step, progress)?;
        self.redo.pop();
        self.undo.push(now);
        Ok(())
    }

    /// Says which parts of the present layout are to stay where they are; not a step of the history. Other strips make
    /// another layout, which starts without pins.
    pub fn set_pins(&mut self, pins: Vec<Pin>) {
        self.design.pins = pins;
    }

    fn change(&mut self, strips: Vec<Strip>, progress: &Progress) -> Result<(), WeaveError> {
        let now = self.turn_to(Step { strips, pins: Vec::new() }, progress)?;
        self.remember(now);
        Ok(())
    }

    /// Makes a state that has been left the last one of the history.
    pub(in crate::weave) fn remember(&mut self, before: Step) {
        self.undo.push(before);
        self.redo.clear();
    }

    /// The present state.
    pub(in crate::weave) fn step(&self) -> Step {
        Step { strips: self.design.strips.clone(), pins: self.design.pins.clone() }
    }

    /// Weaves other strips; what was before is for the caller to remember.
    pub(in crate::weave) fn weave(&mut self, strips: Vec<Strip>, progress: &Progress) -> Result<(), WeaveError> {
        let newest = strips.iter().map(|s| s.id.0 + 1).max().unwrap_or(0);
        self.turn_to(Step { strips, pins: Vec::new() }, progress)?;
        self.next_id = self.next_id.max(newest);
        Ok(())
    }

    /// Goes back to a state that was woven before.
    pub(in crate::weave) fn restore(&mut self, step: Step, woven: Arc<Woven>) {
        (self.design.strips, self.design.pins, self.woven) = (step.strips, step.pins, woven);
    }

    /// The number that the next strip gets.
    pub(in crate::weave) fn free_id(&self) -> StripId {
        StripId(self.next_id)
    }

    /// Weaves another state in place of the present one, which is returned.
    fn turn_to(&mut self, step: Step, progress: &Progress) -> Result<Step, WeaveError> {
        self.woven = Arc::new(Woven::new(&self.model, &step.strips, progress)?);
        let strips = std::mem::replace(&mut self.design.strips, step.strips);
        let pins = std::mem::replace(&mut self.design.pins, step.pins);
        Ok(Step { strips, pins })
    }

    /// What the surface would look like with `proposal` added; for suggestions.
    pub(in crate::weave) fn arranged_with(&self, curve: &SurfaceCurve) -> Result<Arrangement, ArrangementError> {
        let placed = self.design.strips.iter().map(Strip::woven);
        Arrangement::unsubdivided(&self.model.mesh, placed.chain([curve]))
    }
}

/// Puts the strips of a design on the proxy of a model, if it has one: as they were woven, or else as they lie on the
/// mesh. Tells whether they make the same of both meshes.
fn on_proxy(model: &Model, design: &mut Design) -> Result<bool, ArrangementError> {
    let Some(proxy) = &model.proxy else {
        design.proxy = None;
        design.strips.iter_mut().for_each(|s| s.on_proxy = None);
        return Ok(true);
    };
    let made_on = design.proxy.replace(fingerprint(&model.mesh));
    let lies = |s: &Strip| s.on_proxy.as_ref().is_some_and(|c| c.check(&model.mesh).is_ok());
    if made_on == design.proxy && design.strips.iter().all(lies) {
        return Ok(true);
    }
    let original = &model.loaded.mesh;
    for strip in &mut design.strips {
        match proxy.curve_to_proxy(original, &strip.curve) {
            Ok(curve) => strip.on_proxy = Some(curve),
            Err(error) => {
                tracing::debug!(%error, strip = strip.id.0, "not on the proxy");
                return Ok(false);
            }
        }
    }
    let here = Arrangement::unsubdivided(&model.mesh, design.strips.iter().map(Strip::woven))?;
    let there = Arrangement::unsubdivided(original, design.strips.iter().map(|s| &s.curve))?;
    Ok(alike(&here, &there))
}
