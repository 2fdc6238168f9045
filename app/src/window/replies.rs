//! What the window does with the replies of the worker.

use std::sync::Arc;

use plait_core::weave::Improvement;

use super::editing::Editing;
use super::hover::Hover;
use super::messages::Tone;
use super::state::PlaitApp;
use crate::camera::Camera;
use crate::distortion::ColourMode;
use crate::engine::{EngineError, Scene, Source};
use crate::texts;
use crate::worker::{Job, Reply};

impl PlaitApp {
    /// Takes in all replies that have arrived.
    pub(super) fn take_replies(&mut self) {
        while let Some(reply) = self.worker.reply() {
            match reply {
                Reply::Opened { source, scene } => self.opened(&source, scene),
                Reply::Changed(scene) => self.changed(scene),
                Reply::Completed(scene) => self.scene = Some(scene),
                Reply::StripsImproved { scene, improvement, complete } => {
                    self.strips_improved(scene, improvement, complete);
                }
                Reply::EmbeddingStep(step) => self.step = Some(step),
                Reply::Optimised(scene) => {
                    self.step = None;
                    self.scene = Some(scene);
                }
                Reply::Proposals { generation, proposals, complete } => {
                    let editing = self.editing.as_ref();
                    if let Some(proposal) = self.hover.arrived(generation, proposals, complete, editing) {
                        let replaces = self.editing.as_ref().and_then(Editing::replaces);
                        self.stop_editing();
                        self.worker.request(Job::Place(proposal, replaces));
                    }
                }
                Reply::NoProposals { generation, error } => self.found_nothing(generation, &error),
                Reply::Saved(path) => self.messages.add(Tone::Done, format!("Saved {}", path.display()), None),
                Reply::Exported(folder, report) => {
                    let text = format!("Exported to {}: {}", folder.display(), report.summary);
                    self.messages.add(Tone::Done, text, None);
                }
                Reply::Failed { label, error } => {
                    // A search or optimisation that failed leaves no intermediate result.
                    (self.step, self.improvement) = (None, None);
                    self.failed(&label, error);
                }
            }
        }
    }

    fn found_nothing(&mut self, generation: u64, error: &EngineError) {
        if self.hover.generation != Some(generation) {
            return;
        }
        self.hover.generation = None;
        self.hover.place_on_arrival = false;
        match &mut self.editing {
            Some(editing) => editing.problem = Some(error.to_string()),
            None => self.hover.proposals.clear(),
        }
    }

    fn failed(&mut self, label: &str, error: EngineError) {
        match error {
            EngineError::Cancelled => self.messages.add(Tone::Note, format!("{label}: cancelled"), None),
            EngineError::Failed { message, place } => {
                self.messages.add(Tone::Failed, format!("{label} failed: {message}"), place);
            }
        }
    }

    fn opened(&mut self, source: &Source, scene: Arc<Scene>) {
        self.messages.clear();
        if !scene.model.repairs.is_empty() {
            let text = format!("{} was repaired: {}", source.name(), scene.model.repairs.join("; "));
            self.messages.add(Tone::Note, text, None);
        }
        self.selected = None;
        self.detail = None;
        self.step = None;
        self.chosen_colours = ColourMode::default();
        self.stop_editing();
        self.hover = Hover::default();
        self.scene = Some(scene);
        self.camera = Camera { z_up: self.options.z_up, ..Camera::default() };
        self.frame_pending = true;
    }

    fn changed(&mut self, scene: Arc<Scene>) {
        if self.selected.is_some_and(|s| scene.strips.iter().all(|strip| strip.id != s)) {
            self.selected = None;
        }
        // The proposals were computed for the old strips.
        self.hover.clear();
        self.hover.strip = None;
        let edited = self.editing.as_ref().and_then(Editing::replaces);
        if edited.is_some_and(|s| scene.strips.iter().all(|strip| strip.id != s)) {
            self.stop_editing();
        }
        self.search_edited();
        if scene.embedding.is_none() && self.scene.as_ref().is_some_and(|s| s.embedding.is_some()) {
            let text = "The strips have changed. The optimised embedding was discarded.";
            self.messages.add(Tone::Note, text.into(), None);
        }
        self.scene = Some(scene);
    }

    fn strips_improved(&mut self, scene: Arc<Scene>, improvement: Improvement, complete: bool) {
        self.improvement = Some(improvement).filter(|_| !complete);
        if improvement.changes > 0 {
            self.changed(scene);
        }
        if complete {
            let heading = if improvement.changes > 0 { "Layout improved" } else { "Layout unchanged" };
            let text = format!("{heading}: {}", texts::improvement(&improvement));
            self.messages.add(Tone::Done, text, None);
        }
    }
}
