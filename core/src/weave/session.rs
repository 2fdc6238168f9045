//! A session: a model, the design woven on it, and its history.

use std::sync::Arc;

use rayon::prelude::*;

use crate::dual::{Arrangement, ArrangementError};
use crate::elastica::{Certainty, FoundLoop};
use crate::mesh::{LoadedMesh, MeshSource, fingerprint};
use crate::progress::Progress;
use crate::surface::{SurfaceCurve, SurfacePoint};
use crate::weave::anchor::Anchor;
use crate::weave::design::{Design, Pin, Strip, StripId};
use crate::weave::error::WeaveError;
use crate::weave::loop_contacts::LoopContacts;
use crate::weave::mesh_role::same_regions;
use crate::weave::model::Model;
use crate::weave::options::Options;
use crate::weave::proposal::{Proposal, smoothed_proposal};
use crate::weave::recent::RecentSearches;
use crate::weave::woven::Woven;

/// A state of the history: strips, and the pins that were set while they were there.
#[derive(Debug, Clone)]
pub(in crate::weave) struct HistoryState {
    strips: Vec<Strip>,
    pins: Vec<Pin>,
}

/// A model, the design woven on it, and its history.
#[derive(Debug)]
pub struct Session {
    model: Arc<Model>,
    design: Design,
    woven: Arc<Woven>,
    /// Earlier states, the last one on top, and states that were undone.
    undo: Vec<HistoryState>,
    redo: Vec<HistoryState>,
    next_id: u32,
    pub(in crate::weave) recent: RecentSearches,
}

impl Session {
    /// Prepares a mesh and starts an empty design on it.
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
        let loaded = loaded.normalised_by(options.normalised_by);
        let design = Design::new(source, &loaded.mesh, options);
        Self::resume(loaded, design, progress)
    }

    /// Prepares a mesh, normalised as the design says, and continues the design on it.
    ///
    /// # Errors
    ///
    /// See [`Model::prepare`]; [`WeaveError::Design`] when the design was made on another mesh.
    pub fn resume(loaded: LoadedMesh, mut design: Design, progress: &Progress) -> Result<Self, WeaveError> {
        let loaded = loaded.normalised_by(design.options.normalised_by);
        design.check_mesh(&loaded.mesh)?;
        let mut model = Model::prepare(loaded, design.options, progress)?;
        if !transfer_to_proxy(&model, &mut design)? {
            tracing::warn!("the strips have another layout on the proxy: woven on the design mesh");
            let options = Options { proxy: 0, smoothing: 0.0, ..design.options };
            model = Model::prepare(model.loaded, options, progress)?;
            transfer_to_proxy(&model, &mut design)?;
        }
        let model = Arc::new(model);
        let woven = Arc::new(Woven::new(&model, &design.strips, progress)?);
        let next_id = design.strips.iter().map(|s| s.id.0 + 1).max().unwrap_or(0);
        let (undo, redo, recent) = (Vec::new(), Vec::new(), RecentSearches::default());
        Ok(Self { model, design, woven, undo, redo, next_id, recent })
    }

    /// The same design under other options. It stays normalised as it is, since its costs, energies and pins are. Strips keep
    /// their curves on the design mesh. The history is cut where its strips have another arrangement on the new woven mesh.
    ///
    /// # Errors
    ///
    /// See [`Model::prepare`]; [`WeaveError::Options`] if the strips have another arrangement on the new woven mesh.
    pub fn with_options(&self, options: Options, progress: &Progress) -> Result<Self, WeaveError> {
        let options = Options { normalised_by: self.design.options.normalised_by, ..options };
        let design = Design { options, ..self.design.clone() };
        let mut new = Self::resume(self.model.loaded.clone(), design, progress)?;
        if new.model.options != options {
            return Err(WeaveError::Options);
        }
        let fits = |step: &HistoryState| {
            let mut design = Design { strips: step.strips.clone(), ..new.design.clone() };
            let fits = transfer_to_proxy(&new.model, &mut design).unwrap_or(false);
            fits.then(|| HistoryState { strips: design.strips, pins: step.pins.clone() })
        };
        let history = |steps: &[HistoryState]| {
            let mut kept: Vec<HistoryState> = steps.iter().rev().map_while(fits).collect();
            kept.reverse();
            kept
        };
        let (undo, redo) = (history(&self.undo), history(&self.redo));
        (new.undo, new.redo, new.next_id) = (undo, redo, self.next_id);
        Ok(new)
    }

    /// The prepared mesh.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The document.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Sets where the mesh of the design is found.
    pub fn set_source(&mut self, source: MeshSource) {
        self.design.mesh = source;
    }

    /// The arrangement of the strips and the data derived from it.
    pub fn woven(&self) -> &Arc<Woven> {
        &self.woven
    }

    /// Strips that can be placed through a point of the design mesh, the cheapest first.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn proposals(&mut self, at: SurfacePoint, progress: &Progress) -> Result<Vec<Proposal>, WeaveError> {
        self.proposals_with(at, progress, |_| {})
    }

    /// As [`Self::proposals`]; also calls `first` with the first loop found, before it is proved to be the best, and with the
    /// best one, smoothed, before its alternatives are found.
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
        let anchor = Anchor::point(at);
        let at = self.model.to_woven(at);
        let graph = &self.model.graph;
        let vertex = at.nearest_vertex(&self.model.mesh);
        let placed = self.design.strips.iter().map(Strip::woven);
        let contacts = LoopContacts::new(&self.model.mesh, &self.model.sharp, placed);
        let tie = self.model.options.relaxation_tie();
        let smoothed_proposal = |l: &FoundLoop| {
            let smooth = smoothed_proposal(graph, &contacts, l, &[at.into()], tie, progress)?;
            Ok(Proposal { anchors: vec![anchor], ..smooth })
        };
        let mut best: Option<(SurfaceCurve, Result<Proposal, WeaveError>)> = None;
        let mut watch = |certainty: Certainty, l: &FoundLoop| match certainty {
            Certainty::Found => first(Proposal { anchors: vec![anchor], ..Proposal::found(l) }),
            Certainty::Proved => {
                let smooth = smoothed_proposal(l);
                if let Ok(smooth) = &smooth {
                    first(smooth.clone());
                }
                best = Some((l.curve.clone(), smooth));
            }
        };
        let found = self.recent.proposals(graph, &self.woven, vertex, progress, &mut watch)?;
        // The best loop is smoothed already if the search has proved it.
        let (known, smooth) = best.map_or((None, None), |(curve, smooth)| (Some(curve), Some(smooth)));
        let done = found.first().is_some_and(|l| known.as_ref() == Some(&l.curve));
        let rest: Vec<_> = found.par_iter().skip(usize::from(done)).map(smoothed_proposal).collect();
        smooth.filter(|_| done).into_iter().chain(rest).collect()
    }

    /// Places a strip.
    ///
    /// # Errors
    ///
    /// When its curve does not lie on the mesh or has no counterpart on the design mesh, or when cancelled; the session is
    /// then unchanged.
    pub fn place(&mut self, proposal: Proposal, progress: &Progress) -> Result<StripId, WeaveError> {
        let id = self.free_id();
        let mut strips = self.design.strips.clone();
        strips.push(self.strip_of(id, proposal)?);
        self.change(strips, progress)?;
        self.next_id += 1;
        Ok(id)
    }

    /// The strip of a proposal.
    pub(in crate::weave) fn strip_of(&self, id: StripId, proposal: Proposal) -> Result<Strip, WeaveError> {
        let Proposal { curve: woven, cost, energy, anchors } = proposal;
        let curve = self.model.to_design(&woven)?;
        let on_proxy = self.model.proxy.is_some().then_some(woven);
        Ok(Strip { id, curve, on_proxy, cost, energy, visible: true, anchors })
    }

    /// Removes a strip.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoStrip`], or when cancelled; the session is then unchanged.
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

    /// Whether there is a change to undo.
    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    /// Whether there is a change to redo.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Undoes the last change; does nothing when there is none.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn undo(&mut self, progress: &Progress) -> Result<(), WeaveError> {
        let Some(step) = self.undo.last().cloned() else { return Ok(()) };
        let now = self.replace_state(step, progress)?;
        self.undo.pop();
        self.redo.push(now);
        Ok(())
    }

    /// Redoes the change undone last; does nothing when there is none.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn redo(&mut self, progress: &Progress) -> Result<(), WeaveError> {
        let Some(step) = self.redo.last().cloned() else { return Ok(()) };
        let now = self.replace_state(step, progress)?;
        self.redo.pop();
        self.undo.push(now);
        Ok(())
    }

    /// Sets which parts of the present layout keep their positions; not a step of the history. Pins belong to one layout: a
    /// change of the strips removes them.
    pub fn set_pins(&mut self, pins: Vec<Pin>) {
        self.design.pins = pins;
    }

    /// Replaces the strips, as a step of the history.
    pub(in crate::weave) fn change(&mut self, strips: Vec<Strip>, progress: &Progress) -> Result<(), WeaveError> {
        let now = self.replace_state(HistoryState { strips, pins: Vec::new() }, progress)?;
        self.remember(now);
        Ok(())
    }

    /// Pushes a former state to the history and drops the states that could be redone.
    pub(in crate::weave) fn remember(&mut self, before: HistoryState) {
        self.undo.push(before);
        self.redo.clear();
    }

    /// The present state.
    pub(in crate::weave) fn state(&self) -> HistoryState {
        HistoryState { strips: self.design.strips.clone(), pins: self.design.pins.clone() }
    }

    /// Replaces the strips without a step of the history; the caller remembers the former state.
    pub(in crate::weave) fn weave(&mut self, strips: Vec<Strip>, progress: &Progress) -> Result<(), WeaveError> {
        let newest = strips.iter().map(|s| s.id.0 + 1).max().unwrap_or(0);
        self.replace_state(HistoryState { strips, pins: Vec::new() }, progress)?;
        self.next_id = self.next_id.max(newest);
        Ok(())
    }

    /// Returns to a former state with the data derived from it.
    pub(in crate::weave) fn restore(&mut self, step: HistoryState, woven: Arc<Woven>) {
        (self.design.strips, self.design.pins, self.woven) = (step.strips, step.pins, woven);
    }

    /// The number of the next strip.
    pub(in crate::weave) fn free_id(&self) -> StripId {
        StripId(self.next_id)
    }

    /// Replaces the present state, which is returned; on an error the session is unchanged.
    fn replace_state(&mut self, step: HistoryState, progress: &Progress) -> Result<HistoryState, WeaveError> {
        self.woven = Arc::new(Woven::new(&self.model, &step.strips, progress)?);
        let strips = std::mem::replace(&mut self.design.strips, step.strips);
        let pins = std::mem::replace(&mut self.design.pins, step.pins);
        Ok(HistoryState { strips, pins })
    }

    /// The arrangement of the placed strips and one more curve on the woven mesh.
    pub(in crate::weave) fn arranged_with(&self, curve: &SurfaceCurve) -> Result<Arrangement, ArrangementError> {
        let placed = self.design.strips.iter().map(Strip::woven);
        Arrangement::unsubdivided(&self.model.mesh, placed.chain([curve]))
    }
}

/// Sets the curves of a design's strips on the proxy of a model, if it has one: those stored in the design if they were made
/// on the same proxy, else the projections of the curves on the design mesh. Returns whether both meshes have the same
/// arrangement.
fn transfer_to_proxy(model: &Model, design: &mut Design) -> Result<bool, ArrangementError> {
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
                tracing::debug!(%error, strip = strip.id.0, "the strip has no curve on the proxy");
                return Ok(false);
            }
        }
    }
    let on_proxy = Arrangement::unsubdivided(&model.mesh, design.strips.iter().map(Strip::woven))?;
    let on_design = Arrangement::unsubdivided(original, design.strips.iter().map(|s| &s.curve))?;
    Ok(same_regions(&on_proxy, &on_design))
}
