//! The layout of a session and its embedding, which are computed after a change of the strips, or on request.

use std::sync::Arc;

use plait_core::weave::{Session, Woven};

use super::embedding::{self, InitialPreview, OptimisedPreview};
use crate::engine::LayoutPreview;

/// Layout and embedding of the strips they were computed for.
#[derive(Default)]
pub(super) struct LayoutState {
    woven: Option<Arc<Woven>>,
    /// The initial embedding. The outer `None`: not computed yet; the inner `None`: there is none.
    pub(super) initial: Option<Option<InitialPreview>>,
    /// The optimised embedding, if it was asked for.
    pub(super) optimised: Option<OptimisedPreview>,
}

impl LayoutState {
    /// Nothing computed yet for the present strips.
    pub(super) fn new(session: &Session) -> Self {
        Self { woven: Some(Arc::clone(session.woven())), ..Self::default() }
    }

    /// Drops everything if the strips have changed.
    pub(super) fn update(&mut self, session: &Session) {
        if !self.woven.as_ref().is_some_and(|w| Arc::ptr_eq(w, session.woven())) {
            *self = Self::new(session);
        }
    }

    /// Nodes and arcs to show, with the pins of the design.
    pub(super) fn preview(&self, session: &Session) -> Option<LayoutPreview> {
        let initial = self.initial.as_ref()?.as_ref()?;
        let preview = self.optimised.as_ref().map_or(&initial.preview, |o| &o.preview);
        Some(embedding::with_pins(preview, &initial.layout.pinned(&session.design().pins)))
    }
}
