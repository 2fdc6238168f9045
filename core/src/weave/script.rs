//! Weave scripts: steps of a designer in a file, replayed without a window.
//!
//! `{"mesh": "path or built-in name", "steps": [{"hover": [x, y, z]}, {"browse": 1}, {"place": true}]}`. Points are in
//! coordinates of the mesh file and snap to the nearest point of the surface. In place of a mesh there may be a saved
//! design, which the script continues.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::mesh::{LoadError, MeshSource};
use crate::progress::Progress;
use crate::surface::SurfacePoint;
use crate::weave::anchor::Anchor;
use crate::weave::design::{Design, DesignError, StripId};
use crate::weave::error::NoSuggestion;
use crate::weave::error::WeaveError;
use crate::weave::options::Options;
use crate::weave::proposal::Proposal;
use crate::weave::search::suggest::Goal;
use crate::weave::session::Session;

/// One step of a designer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// Point at the surface: proposals through the nearest point of the surface, the cheapest first.
    Hover([f64; 3]),
    /// Set an anchor after those set so far: proposals through all of them, the cheapest first. The first one begins a new
    /// strip, unless a strip is edited.
    Anchor(ScriptAnchor),
    /// Edit the `n`-th of the present strips in the order placed, from 0: proposals through its anchors. Placing replaces
    /// it.
    Edit(usize),
    /// Turn the wheel: this many proposals forward, or back if negative, cyclically.
    Browse(i64),
    /// Click: place the current proposal. `false` does nothing.
    Place(bool),
    /// Press "Suggest" and place the suggestion; does nothing when the goal is reached. `false` does nothing.
    Suggest(bool),
    /// Press "Improve", with at most this many rounds.
    Improve(usize),
    /// Remove the `n`-th of the present strips in the order placed, from 0.
    Delete(usize),
    /// Undo the last change. `false` does nothing.
    Undo(bool),
    /// Redo the change undone last. `false` does nothing.
    Redo(bool),
}

/// An anchor in a script.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScriptAnchor {
    /// A point, which snaps to the nearest point of the surface.
    pub at: [f64; 3],
    /// The direction of the strip; any if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
}

/// A weave script.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Script {
    /// Name of a built-in model, or path of a mesh or of a design relative to the script.
    pub mesh: String,
    /// The options; if left out, [`Options::unnamed`]. A design has its own.
    #[serde(default = "Options::unnamed")]
    pub options: Options,
    /// The steps in order.
    pub steps: Vec<Step>,
}

/// Why a script could not be replayed.
#[derive(Debug, Error)]
pub enum ScriptError {
    /// The file could not be read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a script.
    #[error("{path} is not a weave script: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// The error of the parser, with line and column.
        source: serde_json::Error,
    },
    /// The mesh could not be read.
    #[error(transparent)]
    Mesh(#[from] LoadError),
    /// The design could not be read.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A step failed.
    #[error("step {step}: {source}")]
    Step {
        /// Number of the step, from 1.
        step: usize,
        /// Why.
        source: Box<WeaveError>,
    },
    /// A step that cannot be taken at its place in the script.
    #[error("step {step}: {reason}")]
    NotApplicable {
        /// Number of the step, from 1.
        step: usize,
        /// Why.
        reason: &'static str,
    },
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    ///
    /// When the file cannot be read or is not a script.
    pub fn read(path: &Path) -> Result<Self, ScriptError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| ScriptError::File { path: path.to_owned(), source })?;
        serde_json::from_str(&text).map_err(|source| ScriptError::Format { path: path.to_owned(), source })
    }
}

/// Replays a script; the path of its mesh is relative to `folder`.
///
/// # Errors
///
/// The first step that fails or cannot be taken.
pub fn replay(script: &Script, folder: &Path, progress: &Progress) -> Result<Session, ScriptError> {
    let mut session = open(script, folder, progress)?;
    let mut shown = Shown::default();
    for (i, step) in script.steps.iter().enumerate() {
        shown.apply(step, &mut session, progress).map_err(|e| match e {
            StepError::Weave(source) => ScriptError::Step { step: i + 1, source },
            StepError::NotApplicable(reason) => ScriptError::NotApplicable { step: i + 1, reason },
        })?;
    }
    Ok(session)
}

/// The session that a script starts with.
fn open(script: &Script, folder: &Path, progress: &Progress) -> Result<Session, ScriptError> {
    let opening = |source| ScriptError::Step { step: 0, source: Box::new(source) };
    let path = folder.join(&script.mesh);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("plait")) {
        let design = Design::read(&path)?;
        let loaded = design.mesh.load(path.parent().unwrap_or(folder))?;
        return Session::resume(loaded, design, progress).map_err(opening);
    }
    let source = MeshSource::from_name(&script.mesh);
    let loaded = source.load(folder)?;
    let source = match source {
        MeshSource::File(path) => {
            let path = folder.join(path);
            MeshSource::File(path.canonicalize().unwrap_or(path))
        }
        builtin @ MeshSource::Builtin(_) => builtin,
    };
    Session::open(loaded, source, script.options, progress).map_err(opening)
}

/// The proposals that are shown and the number of the current one.
#[derive(Default)]
struct Shown {
    proposals: Vec<Proposal>,
    current: usize,
    /// The anchors set so far.
    anchors: Vec<Anchor>,
    /// The strip that is edited.
    replaces: Option<StripId>,
}

enum StepError {
    Weave(Box<WeaveError>),
    NotApplicable(&'static str),
}

impl From<WeaveError> for StepError {
    fn from(error: WeaveError) -> Self {
        Self::Weave(Box::new(error))
    }
}

/// The point of the surface nearest to a point in coordinates of the file.
fn nearest(session: &Session, at: [f64; 3]) -> Result<SurfacePoint, StepError> {
    let at = session.model().loaded.units.from_file(DVec3::from(at));
    if !at.is_finite() {
        return Err(StepError::NotApplicable("a coordinate of the point is not a finite number"));
    }
    Ok(session.model().index.nearest(at))
}

impl Shown {
    /// Searches through the anchors.
    fn search(&mut self, session: &mut Session, progress: &Progress) -> Result<(), StepError> {
        self.proposals = session.proposals_through(&self.anchors, self.replaces, progress, |_| {})?;
        self.current = 0;
        Ok(())
    }

    fn add_anchor(
        &mut self,
        ScriptAnchor { at, direction }: ScriptAnchor,
        session: &mut Session,
        progress: &Progress,
    ) -> Result<(), StepError> {
        let direction = direction.map(DVec3::from);
        if direction.is_some_and(|d| !d.is_finite() || d == DVec3::ZERO) {
            return Err(StepError::NotApplicable("the direction is not a finite vector"));
        }
        self.anchors.push(Anchor { at: nearest(session, at)?, direction });
        self.search(session, progress)
    }

    fn edit(&mut self, n: usize, session: &mut Session, progress: &Progress) -> Result<(), StepError> {
        let strip = session.design().strips.get(n).ok_or(StepError::NotApplicable("there is no such strip"))?;
        if strip.anchors.is_empty() {
            return Err(StepError::NotApplicable("the strip has no anchors"));
        }
        *self = Self { anchors: strip.anchors.clone(), replaces: Some(strip.id), ..Self::default() };
        self.search(session, progress)
    }

    fn place(&self, session: &mut Session, progress: &Progress) -> Result<(), StepError> {
        let proposal = self.proposals.get(self.current).cloned();
        let proposal = proposal.ok_or(StepError::NotApplicable("nothing to place: hover first"))?;
        match self.replaces {
            Some(id) => session.replace(id, proposal, progress)?,
            None => drop(session.place(proposal, progress)?),
        }
        Ok(())
    }

    fn apply(&mut self, step: &Step, session: &mut Session, progress: &Progress) -> Result<(), StepError> {
        match *step {
            Step::Hover(at) => {
                let at = nearest(session, at)?;
                *self = Self { proposals: session.proposals(at, progress)?, ..Self::default() };
                if self.proposals.is_empty() {
                    return Err(StepError::NotApplicable("no strip passes this point"));
                }
            }
            Step::Anchor(anchor) => self.add_anchor(anchor, session, progress)?,
            Step::Edit(n) => self.edit(n, session, progress)?,
            Step::Browse(by) => {
                let n = self.proposals.len() as i64;
                if n == 0 {
                    return Err(StepError::NotApplicable("nothing to browse: hover first"));
                }
                self.current = (self.current as i64 + by).rem_euclid(n) as usize;
            }
            Step::Place(true) => {
                self.place(session, progress)?;
                *self = Self::default();
            }
            Step::Suggest(true) => {
                match session.suggest(Goal::Separated, progress) {
                    Ok(proposal) => {
                        session.place(proposal, progress)?;
                    }
                    Err(WeaveError::NoSuggestion(NoSuggestion::Done)) => {}
                    Err(error) => return Err(error.into()),
                }
                *self = Self::default();
            }
            Step::Improve(rounds) => {
                session.improve(rounds, progress, &mut |_, _| ControlFlow::Continue(()))?;
                *self = Self::default();
            }
            Step::Delete(n) => {
                let id = session.design().strips.get(n).map(|s| s.id);
                session.remove(id.ok_or(StepError::NotApplicable("there is no such strip"))?, progress)?;
            }
            Step::Undo(true) => session.undo(progress)?,
            Step::Redo(true) => session.redo(progress)?,
            Step::Place(false) | Step::Suggest(false) | Step::Undo(false) | Step::Redo(false) => {}
        }
        Ok(())
    }
}
