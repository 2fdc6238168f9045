//! [`Engine`] over a session, with the scene of its present state.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use plait_core::dual::Colour;
use plait_core::embed::{Next, Snapshot};
use plait_core::progress::Progress;
use plait_core::weave::{
    self, Export, Goal, IMPROVEMENT_ROUNDS, Improvement, MeshRole, Options, QuadSize, Session, WeaveError,
};

use super::embedding::{self, InitialPreview};
use super::errors::{with_place, without_place};
use super::layout_state::LayoutState;
use super::snapshot::ModelSnapshot;
use crate::engine::{
    Detail, EmbeddingStep, Engine, EngineError, ExportOptions, ExportReport, LayoutPart, Proposal, Refinement, Scene,
    Search, StripId,
};
use crate::texts;

/// A session and its present scene.
pub(super) struct SessionEngine {
    session: Session,
    scene: Arc<Scene>,
    model: ModelSnapshot,
    layout: LayoutState,
}

impl SessionEngine {
    pub(super) fn new(session: Session) -> Self {
        let model = ModelSnapshot::new(&session);
        let layout = LayoutState::new(&session);
        let scene = Arc::new(model.scene(&session, &layout));
        Self { session, scene, model, layout }
    }

    fn refresh(&mut self) {
        self.layout.update(&self.session);
        self.scene = Arc::new(self.model.scene(&self.session, &self.layout));
    }

    /// The result of a change of the session, after which the scene is made anew.
    fn changed<T>(&mut self, result: Result<T, WeaveError>) -> Result<T, EngineError> {
        let value = result.map_err(|e| with_place(e, &self.session))?;
        self.refresh();
        Ok(value)
    }
}

impl Engine for SessionEngine {
    fn proposals(
        &mut self,
        search: &Search,
        first: &mut dyn FnMut(Proposal),
        progress: &Progress,
    ) -> Result<Vec<Proposal>, EngineError> {
        let model = Arc::clone(self.session.model());
        let first = |p| first(shown_proposal(&model, p));
        let found = match search {
            Search::Point(at) => self.session.proposals_with(*at, progress, first),
            Search::Anchors { anchors, replaces } => {
                self.session.proposals_through(anchors, replaces.map(|s| weave::StripId(s.0)), progress, first)
            }
        };
        let found = found.map_err(|e| with_place(e, &self.session))?;
        Ok(found.into_iter().map(|p| shown_proposal(&model, p)).collect())
    }

    fn place(
        &mut self,
        proposal: &Proposal,
        replaces: Option<StripId>,
        progress: &Progress,
    ) -> Result<StripId, EngineError> {
        let Proposal { curve, cost, energy, anchors, .. } = proposal.clone();
        let proposal = weave::Proposal { curve, cost, energy, anchors };
        let placed = match replaces.map(|s| weave::StripId(s.0)) {
            None => self.session.place(proposal, progress),
            Some(id) => self.session.replace(id, proposal, progress).map(|()| id),
        };
        self.changed(placed).map(|id| StripId(id.0))
    }

    fn remove(&mut self, strip: StripId, progress: &Progress) -> Result<(), EngineError> {
        let removed = self.session.remove(weave::StripId(strip.0), progress);
        self.changed(removed)
    }

    fn undo(&mut self, progress: &Progress) -> Result<(), EngineError> {
        let done = self.session.undo(progress);
        self.changed(done)
    }

    fn redo(&mut self, progress: &Progress) -> Result<(), EngineError> {
        let done = self.session.redo(progress);
        self.changed(done)
    }

    fn set_visible(&mut self, strip: StripId, visible: bool) -> Result<(), EngineError> {
        let set = self.session.set_visible(weave::StripId(strip.0), visible);
        self.changed(set)
    }

    fn suggest(&mut self, progress: &Progress) -> Result<Proposal, EngineError> {
        // First a valid layout, then one node for each corner of the shape.
        let goal = if self.session.woven().count(Colour::Red) > 0 { Goal::Valid } else { Goal::Separated };
        let found = self.session.suggest(goal, progress).map_err(|e| with_place(e, &self.session))?;
        Ok(shown_proposal(self.session.model(), found))
    }

    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError> {
        let Self { session, model, .. } = self;
        let mut show = |s: &Session, i: &Improvement| watch(Arc::new(model.scene(s, &LayoutState::default())), *i);
        let done = session.improve(IMPROVEMENT_ROUNDS, progress, &mut show);
        self.changed(done)
    }

    fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }

    fn complete(&mut self, progress: &Progress) -> Result<bool, EngineError> {
        if self.layout.initial.is_some() {
            return Ok(false);
        }
        let initial = InitialPreview::new(&self.session, progress);
        progress.check()?;
        if let Err(error) = &initial {
            // The layout is shown only when it is valid; until then the remarks say what is missing.
            tracing::debug!(%error, "there is no initial embedding to show");
        }
        self.layout.initial = Some(initial.ok());
        self.refresh();
        Ok(true)
    }

    fn set_detail(&mut self, detail: Detail, progress: &Progress) -> Result<(), EngineError> {
        let Detail { curvature_radius, smoothing } = detail;
        let options = Options { curvature_radius, smoothing, ..self.session.model().options };
        let session = self.session.with_options(options, progress).map_err(|e| with_place(e, &self.session))?;
        *self = Self::new(session);
        Ok(())
    }

    fn set_pinned(&mut self, part: LayoutPart, pinned: bool) -> Result<(), EngineError> {
        let Some(Some(initial)) = &self.layout.initial else { return Err(no_layout()) };
        let mut parts = initial.layout.pinned(&self.session.design().pins);
        let flag = match part {
            LayoutPart::Node(i) => parts.nodes.get_mut(i),
            LayoutPart::Arc(i) => parts.arcs.get_mut(i),
        };
        *flag.ok_or_else(|| EngineError::failed("the layout has no such node or arc"))? = pinned;
        let pins = initial.layout.pins(&parts);
        self.session.set_pins(pins);
        self.refresh();
        Ok(())
    }

    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError> {
        if !matches!(self.layout.initial, Some(Some(_))) {
            let initial = InitialPreview::new(&self.session, progress);
            self.layout.initial = Some(Some(initial.map_err(|e| with_place(e, &self.session))?));
        }
        let Some(Some(initial)) = &self.layout.initial else { return Err(no_layout()) };
        let last = self.layout.optimised.as_ref();
        let optimised = embedding::optimise(&self.session, initial, last, watch, progress)?;
        self.layout.optimised = Some(optimised);
        self.refresh();
        Ok(())
    }

    fn save(&self, path: &Path) -> Result<(), EngineError> {
        self.session.design().write(path).map_err(without_place)
    }

    fn export(
        &mut self,
        folder: &Path,
        options: &ExportOptions,
        progress: &Progress,
    ) -> Result<ExportReport, EngineError> {
        let size = match options.refinement {
            Refinement::Quads(count) => QuadSize::Count(u32::try_from(count).unwrap_or(u32::MAX)),
            Refinement::EdgeLength(length) => QuadSize::EdgeLength(length),
        };
        let optimised = self.layout.optimised.as_ref().map(|o| &o.embedding);
        let options = weave::ExportOptions { size, ..Default::default() };
        let mut watch = |_: &Snapshot| Next::Continue;
        let seconds = weave::Times::new();
        let written = weave::write_all(&self.session, optimised, &options, folder, seconds, progress, &mut watch);
        let export = written.and_then(|result| result).map_err(|e| with_place(e, &self.session))?;
        Ok(export_report(&export, folder))
    }
}

fn no_layout() -> EngineError {
    EngineError::failed("there is no valid layout yet")
}

/// A proposal as the window shows it, on the design mesh.
fn shown_proposal(model: &weave::Model, proposal: weave::Proposal) -> Proposal {
    let polyline = model.on_design_mesh(&proposal.curve);
    let weave::Proposal { curve, cost, energy, anchors } = proposal;
    Proposal { curve, cost, energy, polyline, anchors }
}

fn export_report(export: &Export, folder: &Path) -> ExportReport {
    let (nodes, patches) = (export.layout.nodes.len(), export.layout.patches.len());
    let summary = format!(
        "{}, {} ({} irregular), {}",
        texts::count(patches, "patch", "patches"),
        texts::count(nodes, "node", "nodes"),
        export.layout.n_irregular(),
        texts::count(export.quads.quads.len(), "quad", "quads"),
    );
    let mut files = vec!["design.plait", "layout.obj", "quads.obj", "patches.obj", "report.json"];
    // A layout file is written only for an embedding on the design mesh.
    if export.mesh_role == MeshRole::Design {
        files.insert(1, "layout.layout");
    }
    ExportReport { files: files.into_iter().map(|f| folder.join(f)).collect(), summary }
}
