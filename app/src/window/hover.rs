//! The proposals and the node or arc under the pointer.

use glam::Vec2;
use plait_core::surface::SurfacePoint;

use super::editing::Editing;
use crate::engine::{LayoutPart, Proposal, StripId};

/// Relative difference up to which two elastica costs are those of one loop: both sum the same single-precision numbers, but
/// in another order.
const SAME_COST: f64 = 1e-5;

/// A part of the edited strip that can be dragged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grip {
    /// The anchor of this index.
    Anchor(usize),
    /// An end of the direction of an anchor: 1 the one it points to, -1 the other.
    Tip(usize, f32),
    /// A point of the spine.
    Spine(SurfacePoint),
}

/// What is under the pointer.
#[derive(Debug, Default)]
pub struct Hover {
    /// The surface point under the pointer, picked anew whenever the pointer or the view moves.
    pub point: Option<SurfacePoint>,
    /// The node or arc under the pointer, if it can be pinned.
    pub part: Option<LayoutPart>,
    /// The part of the edited strip under the pointer.
    pub grip: Option<Grip>,
    /// The placed strip under the pointer.
    pub strip: Option<StripId>,
    /// The generation of the latest request, while a reply is expected.
    pub generation: Option<u64>,
    /// The proposals through the point, best first.
    pub proposals: Vec<Proposal>,
    /// The index of the proposal shown.
    pub chosen: usize,
    /// The position of the latest placement or choice. Small movements from there request no new proposals.
    pub calm_at: Option<Vec2>,
    /// Whether the proposal shown can be placed: it answers the latest request and is known to be the best.
    pub placeable: bool,
    /// Whether a click came before the reply: the best proposal is then placed when it arrives.
    pub place_on_arrival: bool,
    /// The position of the latest request.
    pub asked_at: Option<Vec2>,
}

impl Hover {
    /// The proposal that a click would place.
    pub fn shown(&self) -> Option<&Proposal> {
        self.proposals.get(self.chosen)
    }

    /// Takes in a reply, and shows the best proposal, or that of a placed strip which is edited. Returns the proposal that is to
    /// be placed at once, if a click came before the reply.
    pub fn arrived(
        &mut self,
        generation: u64,
        proposals: Vec<Proposal>,
        complete: bool,
        editing: Option<&Editing>,
    ) -> Option<Proposal> {
        let placed = editing.and_then(Editing::placed_cost);
        // The best one comes first, and would be shown for a moment in place of the placed one.
        if self.generation != Some(generation) || (placed.is_some() && !complete) {
            return None;
        }
        let is_placed = |p: &Proposal| placed.is_some_and(|cost| (p.cost - cost).abs() <= SAME_COST * cost);
        self.chosen = proposals.iter().position(is_placed).unwrap_or(0);
        self.proposals = proposals;
        if complete {
            self.generation = None;
        }
        // The first of the strips through anchors is known to be the best; the first through a point need not be.
        self.placeable = complete || editing.is_some();
        if !self.placeable {
            return None;
        }
        let place = std::mem::take(&mut self.place_on_arrival);
        self.shown().filter(|_| place).cloned()
    }

    /// Drops the proposals and the request.
    pub fn clear(&mut self) {
        let Self { calm_at, point, part, grip, strip, .. } = *self;
        *self = Self { calm_at, point, part, grip, strip, ..Self::default() };
    }

    /// Shows the proposal `by` places further on, clamped to the first and the last.
    pub fn browse(&mut self, by: i32) {
        let last = self.proposals.len().saturating_sub(1);
        self.chosen = self.chosen.saturating_add_signed(by as isize).min(last);
    }
}

#[cfg(test)]
mod tests {
    use plait_core::surface::SurfaceCurve;

    use super::*;

    fn proposal(cost: f64) -> Proposal {
        let curve = SurfaceCurve { crossings: Vec::new(), closed: true };
        Proposal { curve, cost, energy: None, polyline: Vec::new(), anchors: Vec::new() }
    }

    #[test]
    fn replies_to_older_requests_are_ignored() {
        let mut hover = Hover { generation: Some(2), ..Hover::default() };
        assert!(hover.arrived(1, vec![proposal(1.0)], true, None).is_none() && hover.proposals.is_empty());
        hover.arrived(2, vec![proposal(1.0)], true, None);
        assert_eq!(hover.proposals.len(), 1);
    }

    #[test]
    fn an_early_click_places_the_best_proposal_once_it_is_known() {
        let mut hover = Hover { generation: Some(1), place_on_arrival: true, ..Hover::default() };
        assert_eq!(hover.arrived(1, vec![proposal(2.0)], false, None), None);
        assert_eq!(hover.arrived(1, vec![proposal(1.0)], true, None).map(|p| p.cost), Some(1.0));
        assert!(!hover.place_on_arrival);
    }

    #[test]
    fn of_the_proposals_through_the_anchors_of_a_strip_the_placed_one_is_shown() {
        let of_cost = |cost| Editing::of_strip(StripId(0), Vec::new(), cost);
        let mut hover = Hover { generation: Some(1), ..Hover::default() };
        hover.arrived(1, vec![proposal(1.0)], false, Some(&of_cost(2.0)));
        assert!(hover.shown().is_none(), "the best is not shown meanwhile");
        hover.arrived(1, vec![proposal(1.0), proposal(2.000_001)], true, Some(&of_cost(2.0)));
        assert_eq!(hover.chosen, 1);
        hover.generation = Some(2);
        hover.arrived(2, vec![proposal(1.0), proposal(2.0)], true, Some(&of_cost(1.5)));
        assert_eq!(hover.chosen, 0);
    }

    #[test]
    fn the_first_strip_through_anchors_is_placed_without_waiting_for_alternatives() {
        let editing = Editing::default();
        let mut hover = Hover { generation: Some(1), place_on_arrival: true, ..Hover::default() };
        assert_eq!(hover.arrived(1, vec![proposal(1.0)], false, Some(&editing)).map(|p| p.cost), Some(1.0));
    }

    #[test]
    fn browsing_ends_at_the_first_and_the_last_proposal() {
        let mut hover = Hover { proposals: vec![proposal(1.0), proposal(2.0)], ..Hover::default() };
        hover.browse(5);
        assert_eq!(hover.shown().map(|p| p.cost), Some(2.0));
        hover.browse(-9);
        assert_eq!(hover.chosen, 0);
    }
}
