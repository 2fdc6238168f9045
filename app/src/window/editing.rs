//! The strip that is being edited: its anchors, set by clicks and drags, and what can be taken back.

use glam::DVec3;
use plait_core::weave::Anchor;

use crate::engine::{Search, StripId};

/// A strip in the making, or a placed one that is edited.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Editing {
    /// The anchors in order.
    anchors: Vec<Anchor>,
    /// The placed strip that is edited.
    replaces: Option<StripId>,
    /// The elastica cost of that strip, until its anchors are changed: of the strips through its anchors it is the one to be
    /// shown.
    placed_cost: Option<f64>,
    /// The anchors before each change, the last one on top.
    former: Vec<Vec<Anchor>>,
    /// The anchor selected.
    pub selected: Option<usize>,
    /// Why no strip passes the anchors, if none does.
    pub problem: Option<String>,
}

impl Editing {
    /// A new strip through one anchor.
    pub fn new(anchor: Anchor) -> Self {
        Self { anchors: vec![anchor], selected: Some(0), ..Self::default() }
    }

    /// A placed strip with its anchors and its elastica cost.
    pub fn of_strip(strip: StripId, anchors: Vec<Anchor>, cost: f64) -> Self {
        Self { anchors, replaces: Some(strip), placed_cost: Some(cost), ..Self::default() }
    }

    /// The elastica cost of the placed strip, while its anchors are as they were.
    pub fn placed_cost(&self) -> Option<f64> {
        self.placed_cost
    }

    /// The anchors in order.
    pub fn anchors(&self) -> &[Anchor] {
        &self.anchors
    }

    /// The placed strip that is edited.
    pub fn replaces(&self) -> Option<StripId> {
        self.replaces
    }

    /// The search for strips through the anchors.
    pub fn search(&self) -> Search {
        Search::Anchors { anchors: self.anchors.clone(), replaces: self.replaces }
    }

    /// Begins a change that can be taken back.
    pub fn begin_change(&mut self) {
        self.placed_cost = None;
        self.former.push(self.anchors.clone());
    }

    /// Adds an anchor behind the others, and selects it.
    pub fn add(&mut self, anchor: Anchor) {
        self.insert(self.anchors.len(), anchor);
    }

    /// Inserts an anchor, and selects it.
    pub fn insert(&mut self, index: usize, anchor: Anchor) {
        let index = index.min(self.anchors.len());
        self.anchors.insert(index, anchor);
        self.selected = Some(index);
    }

    /// Moves or turns an anchor.
    pub fn set(&mut self, index: usize, anchor: Anchor) {
        if let Some(old) = self.anchors.get_mut(index) {
            *old = anchor;
        }
    }

    /// Removes an anchor. Returns false, and removes nothing, if it is the last one.
    pub fn remove(&mut self, index: usize) -> bool {
        if self.anchors.len() < 2 || index >= self.anchors.len() {
            return false;
        }
        self.begin_change();
        self.anchors.remove(index);
        self.selected = None;
        true
    }

    /// Takes back the last change. Returns false if there is none.
    pub fn take_back(&mut self) -> bool {
        let Some(former) = self.former.pop() else { return false };
        self.anchors = former;
        self.selected = self.selected.filter(|&i| i < self.anchors.len());
        true
    }

    /// Where an anchor at point `at` of the spine belongs among the anchors, by the order along the spine.
    ///
    /// `position` maps an anchor to its place in space; `spine` has the points of the loop in order.
    pub fn index_along(&self, spine: &[DVec3], at: DVec3, position: impl Fn(&Anchor) -> DVec3) -> usize {
        let nearest = |p: DVec3| {
            let distance = |i: &usize| spine[*i].distance_squared(p);
            (0..spine.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
        };
        let Some(first) = self.anchors.first().map(|a| nearest(position(a))) else { return 0 };
        // Steps along the loop from the first anchor; the anchors come in this order or in the opposite one.
        let n = spine.len().max(1);
        let along = |p: DVec3| (nearest(p) + n - first) % n;
        let places: Vec<usize> = self.anchors.iter().map(|a| along(position(a))).collect();
        let here = along(at);
        let backwards = places.len() > 2 && places[1] > places[2];
        let before = |place: usize| if backwards { (n - place) % n <= (n - here) % n } else { place <= here };
        places.iter().take_while(|&&place| before(place)).count().max(1)
    }
}

#[cfg(test)]
mod tests {
    use plait_core::mesh::FaceId;
    use plait_core::surface::SurfacePoint;

    use super::*;

    fn anchor(i: u32) -> Anchor {
        Anchor::point(SurfacePoint { face: FaceId(i), weights: [1.0, 0.0, 0.0] })
    }

    /// Points around a circle; anchor `i` is at `i` tenths of it.
    fn circle() -> Vec<DVec3> {
        (0..100).map(|i| DVec3::new((0.0628 * f64::from(i)).cos(), (0.0628 * f64::from(i)).sin(), 0.0)).collect()
    }

    #[test]
    fn changes_are_taken_back_one_by_one() {
        let mut editing = Editing::new(anchor(0));
        editing.begin_change();
        editing.add(anchor(1));
        editing.begin_change();
        editing.set(0, anchor(7));
        assert!(editing.remove(1));
        assert_eq!(editing.anchors(), [anchor(7)]);
        assert!(!editing.remove(0), "the last anchor stays");
        for expected in [vec![anchor(7), anchor(1)], vec![anchor(0), anchor(1)], vec![anchor(0)]] {
            assert!(editing.take_back());
            assert_eq!(editing.anchors(), expected);
        }
        assert!(!editing.take_back());
    }

    #[test]
    fn a_grabbed_point_comes_between_its_neighbours_in_either_direction() {
        let spine = circle();
        let place = |a: &Anchor| spine[10 * a.at.face.index()];
        for (order, at, expected) in [
            (vec![0, 3, 6], 45, 2),
            (vec![0, 3, 6], 80, 3),
            (vec![0, 3, 6], 12, 1),
            (vec![0, 6, 3], 45, 2),
            (vec![0, 6, 3], 80, 1),
            (vec![2], 90, 1),
        ] {
            let mut editing = Editing::new(anchor(order[0]));
            order[1..].iter().for_each(|&i| editing.add(anchor(i)));
            assert_eq!(editing.index_along(&spine, spine[at], place), expected, "{order:?} {at}");
        }
    }
}
