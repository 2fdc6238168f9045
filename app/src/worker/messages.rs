//! What goes to the worker and what comes back.

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

/// Something to be done, in order.
#[derive(Debug, Clone)]
pub enum Job {
    /// Open a model or a design in place of the present one.
    Open(Source),
    /// Place a proposal.
    Place(Proposal),
    /// Remove a strip.
    Remove(StripId),
    /// Show or hide a strip.
    SetVisible(StripId, bool),
    /// Take back.
    Undo,
    /// Make again.
    Redo,
    /// Find the strip that helps most and place it.
    Suggest,
    /// Try other strips.
    Improve,
    /// Weave with so much detail.
    SetDetail(Detail),
    /// Pin a part of the layout, or let it go.
    SetPinned(LayoutPart, bool),
    /// Optimise the embedding of the layout.
    Optimise,
    /// Write the design.
    Save(PathBuf),
    /// Write the finished layout into a folder.
    Export(PathBuf, ExportOptions),
}

impl Job {
    /// What is being done, for the progress bar.
    pub fn label(&self) -> String {
        match self {
            Self::Open(source) => format!("Opening {}", source.name()),
            Self::Place(_) => "Placing the strip".into(),
            Self::Remove(_) => "Removing the strip".into(),
            Self::SetVisible(..) => "Updating the view".into(),
            Self::Undo => "Undoing".into(),
            Self::Redo => "Redoing".into(),
            Self::Suggest => "Looking for the strip that helps most".into(),
            Self::Improve => "Improving the layout".into(),
            Self::SetDetail(_) => "Setting the detail".into(),
            Self::SetPinned(..) => "Pinning".into(),
            Self::Optimise => "Optimising the embedding".into(),
            Self::Save(_) => "Saving the design".into(),
            Self::Export(..) => "Exporting the layout".into(),
        }
    }

    /// What it makes better step by step, if it does.
    pub(super) fn betters(&self) -> Option<StoppableWork> {
        match self {
            Self::Improve => Some(StoppableWork::Strips),
            Self::Optimise => Some(StoppableWork::Embedding),
            _ => None,
        }
    }

    /// Whether it makes any work on the present layout useless.
    pub(super) fn changes_strips(&self) -> bool {
        matches!(
            self,
            Self::Open(_)
                | Self::Place(_)
                | Self::Remove(_)
                | Self::Undo
                | Self::Redo
                | Self::Suggest
                | Self::Improve
                | Self::SetDetail(_)
        )
    }
}

/// What comes back.
#[derive(Debug)]
pub enum Reply {
    /// A model was opened.
    Opened {
        /// What was asked for.
        source: Source,
        /// Its first snapshot.
        scene: Arc<Scene>,
    },
    /// The design changed.
    Changed(Arc<Scene>),
    /// The design is the same, the scene says more of it.
    Completed(Arc<Scene>),
    /// The strips for a hover request.
    Proposals {
        /// Which request.
        generation: u64,
        /// Best first; of an answer that is not final, one that was found early.
        proposals: Vec<Proposal>,
        /// Whether this is all.
        complete: bool,
    },
    /// Other strips make a better layout.
    Refitted {
        /// The snapshot of them.
        scene: Arc<Scene>,
        /// How much better.
        improvement: Improvement,
        /// Whether this is the end of it.
        complete: bool,
    },
    /// The embedding became better; more may follow.
    Improved(EmbeddingStep),
    /// The embedding was optimised.
    Optimised(Arc<Scene>),
    /// The design was written.
    Saved(PathBuf),
    /// The layout was written.
    Exported(PathBuf, ExportReport),
    /// It could not be done.
    Failed {
        /// What.
        label: String,
        /// Why; never [`EngineError::Cancelled`] for a hover request.
        error: EngineError,
    },
}

/// What is made better step by step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoppableWork {
    /// The strips.
    Strips,
    /// The embedding of their layout.
    Embedding,
}

/// Work that makes something better step by step and can be stopped.
#[derive(Debug, Clone)]
pub struct Steps {
    /// What it makes better.
    pub of: StoppableWork,
    /// To be set in order to stop it and keep the best so far.
    pub stop: Arc<AtomicBool>,
}

impl Steps {
    /// Whether it has been asked to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// What the worker is busy with.
#[derive(Debug, Clone)]
pub struct Running {
    /// In words.
    pub label: String,
    /// Since when.
    pub since: Instant,
    /// How far; may be cancelled.
    pub progress: Arc<Progress>,
    /// Whether anything else goes before it: a hover request, or what was left for later.
    pub yields: bool,
    /// Of what makes something better step by step.
    pub steps: Option<Steps>,
}

impl Running {
    /// Whether the work goes on after a step.
    pub(super) fn flow(&self) -> ControlFlow<()> {
        let stopped = self.steps.as_ref().is_some_and(Steps::is_stopped);
        if stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
