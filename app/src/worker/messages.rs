//! Jobs for the worker, and its replies.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use plait_core::progress::Progress;
use plait_core::weave::Improvement;

use crate::engine::{
    Detail, EmbeddingStep, EngineError, ExportOptions, ExportReport, LayoutPart, Proposal, Scene, Source, StripId,
};

/// A job, to be done in order.
#[derive(Debug, Clone)]
pub enum Job {
    /// Open a model or a design in place of the present one.
    Open(Source),
    /// Place a proposal, or put it in the place of a strip.
    Place(Proposal, Option<StripId>),
    /// Remove a strip.
    Remove(StripId),
    /// Show or hide a strip.
    SetVisible(StripId, bool),
    /// Undo the last change.
    Undo,
    /// Redo the change undone last.
    Redo,
    /// Find a strip that resolves the most urgent problem, and place it.
    Suggest,
    /// Search for strips with a lower objective.
    Improve,
    /// Change smoothing and curvature radius.
    SetDetail(Detail),
    /// Pin or unpin a node or an arc of the layout.
    SetPinned(LayoutPart, bool),
    /// Optimise the embedding of the layout.
    Optimise,
    /// Write the design to a file.
    Save(PathBuf),
    /// Write the layout to a folder.
    Export(PathBuf, ExportOptions),
}

impl Job {
    /// The name of the job, for the progress bar.
    pub fn label(&self) -> String {
        match self {
            Self::Open(source) => format!("Opening {}", source.name()),
            Self::Place(..) => "Placing the strip".into(),
            Self::Remove(_) => "Removing the strip".into(),
            Self::SetVisible(..) => "Updating the view".into(),
            Self::Undo => "Undoing".into(),
            Self::Redo => "Redoing".into(),
            Self::Suggest => "Searching for a strip".into(),
            Self::Improve => "Improving the layout".into(),
            Self::SetDetail(_) => "Recomputing curvature".into(),
            Self::SetPinned(..) => "Pinning".into(),
            Self::Optimise => "Optimising the embedding".into(),
            Self::Save(_) => "Saving the design".into(),
            Self::Export(..) => "Exporting the layout".into(),
        }
    }

    /// The kind of stoppable work, if the job is one.
    pub(super) fn stoppable_work(&self) -> Option<StoppableWork> {
        match self {
            Self::Improve => Some(StoppableWork::Strips),
            Self::Optimise => Some(StoppableWork::Embedding),
            _ => None,
        }
    }

    /// Whether the job makes work on the present layout obsolete.
    pub(super) fn changes_strips(&self) -> bool {
        matches!(
            self,
            Self::Open(_)
                | Self::Place(..)
                | Self::Remove(_)
                | Self::Undo
                | Self::Redo
                | Self::Suggest
                | Self::Improve
                | Self::SetDetail(_)
        )
    }
}

/// A reply of the worker.
#[derive(Debug)]
pub enum Reply {
    /// A model was opened.
    Opened {
        /// What was opened.
        source: Source,
        /// Its first scene.
        scene: Arc<Scene>,
    },
    /// The design changed.
    Changed(Arc<Scene>),
    /// The design is the same; a part of its scene was added that takes long to compute.
    Completed(Arc<Scene>),
    /// The proposals of a search request.
    Proposals {
        /// The generation of the request.
        generation: u64,
        /// The proposals, best first; while incomplete, one that was found early.
        proposals: Vec<Proposal>,
        /// Whether these are all proposals.
        complete: bool,
    },
    /// A search found no strip, for a reason.
    NoProposals {
        /// The generation of the request.
        generation: u64,
        /// The reason.
        error: EngineError,
    },
    /// The search found strips with a lower objective.
    StripsImproved {
        /// The scene of the new strips.
        scene: Arc<Scene>,
        /// The objective before and after.
        improvement: Improvement,
        /// Whether the search has ended.
        complete: bool,
    },
    /// A step of the optimisation of the embedding.
    EmbeddingStep(EmbeddingStep),
    /// The optimisation of the embedding has ended.
    Optimised(Arc<Scene>),
    /// The design was written.
    Saved(PathBuf),
    /// The layout was written.
    Exported(PathBuf, ExportReport),
    /// A job failed.
    Failed {
        /// The name of the job.
        label: String,
        /// The reason; never [`EngineError::Cancelled`] for a search request.
        error: EngineError,
    },
}

/// Work that can be stopped with its best result so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoppableWork {
    /// The search for better strips.
    Strips,
    /// The optimisation of the embedding.
    Embedding,
}

/// The stop flag of stoppable work.
#[derive(Debug, Clone)]
pub struct StopFlag {
    /// The work it stops.
    pub work: StoppableWork,
    /// Set to stop.
    pub stop: Arc<AtomicBool>,
}

impl StopFlag {
    /// Whether the work was asked to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// The running task.
#[derive(Debug, Clone)]
pub struct Running {
    /// Its name.
    pub label: String,
    /// When it started.
    pub since: Instant,
    /// Its progress, by which it can be cancelled.
    pub progress: Arc<Progress>,
    /// Whether any job precedes it: a search request, or the completion of the scene.
    pub yields: bool,
    /// The stop flag, if it can be stopped.
    pub stoppable: Option<StopFlag>,
}

impl Running {
    /// Whether the work continues after a step.
    pub(super) fn flow(&self) -> ControlFlow<()> {
        let stopped = self.stoppable.as_ref().is_some_and(StopFlag::is_stopped);
        if stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
