//! The engine of the window: a session of the library behind [`Engine`], with its snapshots.

mod cover;
mod embedding;
mod snapshot;
mod stripes;
mod words;

pub use words::improved;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::{Arrangement, Colour};
use plait_core::layout::LayoutError;
use plait_core::mesh::builtin_names;
use plait_core::progress::Progress;
use plait_core::surface::SurfacePoint;
use plait_core::weave::{
    self, Design, Goal, Improvement, MeshRole, MeshSource, NoSuggestion, Options, QuadSize, Session, WeaveError, Woven,
};

use crate::engine::{
    BuiltIn, Detail, EmbeddingStep, Engine, EngineError, ExportOptions, ExportReport, LayoutPart, LayoutPreview,
    Opener, Proposal, Refinement, Scene, Source, StripId,
};

/// File name ending of designs.
const DESIGN: &str = "plait";

/// Opens sessions.
#[derive(Debug, Clone, Copy, Default)]
pub struct SessionOpener;

impl Opener for SessionOpener {
    fn built_ins(&self) -> Vec<BuiltIn> {
        builtin_names().map(|name| BuiltIn { name: name.into(), hint: hint(name).into() }).collect()
    }

    fn open(&self, source: &Source, progress: &Progress) -> Result<Box<dyn Engine>, EngineError> {
        progress.report("Reading", 0.0);
        let session = match source {
            Source::BuiltIn(name) => start(MeshSource::Builtin(name.clone()), progress)?,
            Source::File(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case(DESIGN)) => {
                let design = Design::read(path).map_err(plain)?;
                let folder = path.parent().unwrap_or(Path::new("."));
                let loaded = design.mesh.load(folder).map_err(plain)?;
                progress.check()?;
                let mut session = Session::resume(loaded, design, progress).map_err(plain)?;
                if let MeshSource::File(mesh) = &session.design().mesh {
                    let mesh = absolute(&folder.join(mesh));
                    session.set_source(MeshSource::File(mesh));
                }
                session
            }
            Source::File(path) => start(MeshSource::File(absolute(path)), progress)?,
        };
        Ok(Box::new(SessionEngine::new(session)))
    }
}

/// What a built-in model is good to try.
fn hint(name: &str) -> &'static str {
    match name {
        "creature" => "limbs",
        "rounded-cube" => "eight corners",
        "torus" => "one handle",
        "pretzel" => "three handles",
        "sleeve" => "open, with boundaries",
        _ => "",
    }
}

fn start(source: MeshSource, progress: &Progress) -> Result<Session, EngineError> {
    let loaded = source.load(Path::new("")).map_err(plain)?;
    progress.check()?;
    Session::open(loaded, source, Options::default(), progress).map_err(plain)
}

/// A path that stays valid when the program runs in another folder.
fn absolute(path: &Path) -> std::path::PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

/// A proposal as the window shows it.
fn proposal(model: &weave::Model, proposal: weave::Proposal) -> Proposal {
    let polyline = model.on_design_mesh(&proposal.curve);
    Proposal { curve: proposal.curve, cost: proposal.cost, energy: proposal.energy, polyline }
}

fn plain(error: impl Into<WeaveError>) -> EngineError {
    failed(error.into(), None)
}

/// The error in the terms of the window; a region it names becomes a place.
fn failed(error: WeaveError, session: Option<&Session>) -> EngineError {
    let region = match &error {
        WeaveError::Cancelled(_) => return EngineError::Cancelled,
        WeaveError::Layout(LayoutError::RedRegions(red)) => red.first().copied(),
        WeaveError::NoSuggestion(NoSuggestion::NoHelp { region, .. }) => Some(*region),
        _ => None,
    };
    let place = region.zip(session).and_then(|(r, s)| region_place(&s.woven().arrangement, r as usize));
    let message = match (&error, session) {
        (WeaveError::Layout(LayoutError::RedRegions(_)), Some(s)) => {
            let reasons: Vec<_> = words::remarks(s).into_iter().map(|r| r.text).collect();
            format!("there is no layout yet: {}", reasons.join("; "))
        }
        _ => error.to_string(),
    };
    EngineError::Failed { message, place }
}

/// A point in the middle of a region's surface: of its face nearest to the mean.
fn region_place(arrangement: &Arrangement, region: usize) -> Option<DVec3> {
    let faces = &arrangement.regions.get(region)?.faces;
    let middle = |f: u32| {
        arrangement.refined.corners(f).map(|v| arrangement.refined.positions[v as usize]).iter().sum::<DVec3>() / 3.0
    };
    let mean = faces.iter().map(|&f| middle(f)).sum::<DVec3>() / faces.len().max(1) as f64;
    let nearest = |&a: &DVec3, &b: &DVec3| a.distance_squared(mean).total_cmp(&b.distance_squared(mean));
    faces.iter().map(|&f| middle(f)).min_by(nearest)
}

/// A session and its present snapshot.
struct SessionEngine {
    session: Session,
    scene: Arc<Scene>,
    model: snapshot::ModelSnapshot,
    later: Later,
}

/// What is computed after a change, while nothing else is asked or on request, of the strips it was computed for.
#[derive(Default)]
pub struct Later {
    woven: Option<Arc<Woven>>,
    /// The first drawing of the layout: not yet there (outer `None`), or in vain (inner `None`).
    drawn: Option<Option<embedding::Shown>>,
    /// Its optimised embedding.
    embedded: Option<embedding::Optimised>,
}

impl Later {
    /// The layout as it is shown, with its pins.
    fn preview(&self, session: &Session) -> Option<LayoutPreview> {
        let shown = self.drawn.as_ref()?.as_ref()?;
        let preview = self.embedded.as_ref().map_or(&shown.preview, |e| &e.preview);
        Some(embedding::with_pins(preview, &shown.drawn.pinned(&session.design().pins)))
    }
}

impl SessionEngine {
    fn new(session: Session) -> Self {
        let model = snapshot::ModelSnapshot::new(&session);
        let later = Later { woven: Some(Arc::clone(session.woven())), ..Later::default() };
        let scene = Arc::new(model.scene(&session, &later));
        Self { session, scene, model, later }
    }

    fn refresh(&mut self) {
        let woven = self.session.woven();
        if !self.later.woven.as_ref().is_some_and(|w| Arc::ptr_eq(w, woven)) {
            self.later = Later { woven: Some(Arc::clone(woven)), ..Later::default() };
        }
        self.scene = Arc::new(self.model.scene(&self.session, &self.later));
    }

    fn changed<T>(&mut self, result: Result<T, WeaveError>) -> Result<T, EngineError> {
        let value = result.map_err(|e| failed(e, Some(&self.session)))?;
        self.refresh();
        Ok(value)
    }
}

impl Engine for SessionEngine {
    fn proposals(
        &mut self,
        at: SurfacePoint,
        first: &mut dyn FnMut(Proposal),
        progress: &Progress,
    ) -> Result<Vec<Proposal>, EngineError> {
        let model = Arc::clone(self.session.model());
        let found = self.session.proposals_with(at, progress, |p| first(proposal(&model, p)));
        Ok(found.map_err(plain)?.into_iter().map(|p| proposal(&model, p)).collect())
    }

    fn place(&mut self, proposal: &Proposal, progress: &Progress) -> Result<StripId, EngineError> {
        let Proposal { curve, cost, energy, .. } = proposal.clone();
        let proposal = weave::Proposal { curve, cost, energy };
        let placed = self.session.place(proposal, progress);
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
        // A valid layout first; then corners of the shape are told apart.
        let goal = if self.session.woven().count(Colour::Red) > 0 { Goal::Valid } else { Goal::Separated };
        let found = self.session.suggest(goal, progress).map_err(|e| failed(e, Some(&self.session)))?;
        Ok(proposal(self.session.model(), found))
    }

    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError> {
        let Self { session, model, .. } = self;
        let mut show = |s: &Session, i: &Improvement| watch(Arc::new(model.scene(s, &Later::default())), *i);
        let done = session.improve(weave::IMPROVEMENT_ROUNDS, progress, &mut show);
        self.changed(done)
    }

    fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }

    fn complete(&mut self, progress: &Progress) -> Result<bool, EngineError> {
        if self.later.drawn.is_some() {
            return Ok(false);
        }
        self.later.drawn = Some(or_nothing(embedding::Shown::new(&self.session, progress), progress)?);
        self.refresh();
        Ok(true)
    }

    fn set_detail(&mut self, detail: Detail, progress: &Progress) -> Result<(), EngineError> {
        let Detail { curvature_radius, smoothing } = detail;
        let options = Options { curvature_radius, smoothing, ..self.session.model().options };
        let session = self.session.with_options(options, progress).map_err(|e| failed(e, Some(&self.session)))?;
        *self = Self::new(session);
        Ok(())
    }

    fn set_pinned(&mut self, part: LayoutPart, pinned: bool) -> Result<(), EngineError> {
        let Some(Some(shown)) = &self.later.drawn else { return Err(EngineError::failed("there is no layout yet")) };
        let mut parts = shown.drawn.pinned(&self.session.design().pins);
        let place = match part {
            LayoutPart::Node(i) => parts.nodes.get_mut(i),
            LayoutPart::Arc(i) => parts.arcs.get_mut(i),
        };
        *place.ok_or_else(|| EngineError::failed("the layout has no such part"))? = pinned;
        let pins = shown.drawn.pins(&parts);
        self.session.set_pins(pins);
        self.refresh();
        Ok(())
    }

    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError> {
        if !matches!(self.later.drawn, Some(Some(_))) {
            let shown = embedding::Shown::new(&self.session, progress);
            self.later.drawn = Some(Some(shown.map_err(|e| failed(e, Some(&self.session)))?));
        }
        let Some(Some(shown)) = &self.later.drawn else { return Err(EngineError::failed("there is no layout yet")) };
        let optimised = embedding::optimise(&self.session, shown, self.later.embedded.as_ref(), watch, progress)?;
        self.later.embedded = Some(optimised);
        self.refresh();
        Ok(())
    }

    fn save(&self, path: &Path) -> Result<(), EngineError> {
        self.session.design().write(path).map_err(plain)
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
        let optimised = self.later.embedded.as_ref().map(|o| &o.embedded);
        let options = weave::ExportOptions { size, ..Default::default() };
        let mut watch = |_: &plait_core::embed::Snapshot| plait_core::embed::Next::Continue;
        let seconds = weave::Times::new();
        let written = weave::write_all(&self.session, optimised, &options, folder, seconds, progress, &mut watch);
        let export = written.and_then(|result| result).map_err(|e| failed(e, Some(&self.session)))?;
        let (nodes, patches) = (&export.layout.nodes, &export.layout.patches);
        let summary = format!(
            "{} patches, {} nodes ({} irregular), {} quads",
            patches.len(),
            nodes.len(),
            export.layout.n_irregular(),
            export.quads.quads.len()
        );
        let mut files = vec!["design.plait", "layout.obj", "quads.obj", "patches.obj", "report.json"];
        if export.mesh_role == MeshRole::Design {
            files.insert(1, "layout.layout");
        }
        Ok(ExportReport { files: files.into_iter().map(|f| folder.join(f)).collect(), summary })
    }
}

/// What can do without is left out when it fails.
fn or_nothing<T>(result: Result<T, impl std::fmt::Display>, progress: &Progress) -> Result<Option<T>, EngineError> {
    progress.check()?;
    result.map_or_else(
        |error| {
            tracing::debug!(%error, "something is not shown");
            Ok(None)
        },
        |value| Ok(Some(value)),
    )
}
