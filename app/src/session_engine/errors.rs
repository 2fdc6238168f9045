//! Errors of the library as errors of the engine.

use plait_core::layout::LayoutError;
use plait_core::weave::{NoSuggestion, Session, WeaveError};

use super::remarks;
use crate::engine::EngineError;

/// The error, without a place on the model.
pub(super) fn without_place(error: impl Into<WeaveError>) -> EngineError {
    engine_error(error.into(), None)
}

/// The error, with the centre of the region it names.
pub(super) fn with_place(error: WeaveError, session: &Session) -> EngineError {
    engine_error(error, Some(session))
}

fn engine_error(error: WeaveError, session: Option<&Session>) -> EngineError {
    let region = match &error {
        WeaveError::Cancelled(_) => return EngineError::Cancelled,
        WeaveError::Layout(LayoutError::RedRegions(red)) => red.first().copied(),
        WeaveError::NoSuggestion(NoSuggestion::NoHelp { region, .. }) => Some(*region),
        _ => None,
    };
    let place = region.zip(session).and_then(|(r, s)| s.woven().region_centre(r as usize));
    let message = match (&error, session) {
        (WeaveError::Layout(LayoutError::RedRegions(_)), Some(s)) => {
            let reasons: Vec<_> = remarks::remarks(s).into_iter().map(|r| r.text).collect();
            format!("the layout is not valid yet: {}", reasons.join("; "))
        }
        _ => error.to_string(),
    };
    EngineError::Failed { message, place }
}
