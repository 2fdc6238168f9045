//! The search for strips through anchors, and the replacement of a placed strip (Campen, sections 7.1 and 8.1.4).

use std::sync::Arc;

use rayon::prelude::*;

use crate::elastica::{
    Anchor as VertexAnchor, AnchorQuery, Certainty, DirectionMask, FoundLoop, ProposalQuery, SearchWorkspace,
};
use crate::progress::{Cancelled, Progress};
use crate::surface::{SurfaceCurve, Waypoint};
use crate::weave::anchor::Anchor;
use crate::weave::design::{Strip, StripId};
use crate::weave::error::{NoLoop, WeaveError};
use crate::weave::loop_contacts::LoopContacts;
use crate::weave::proposal::{Proposal, smoothed_proposal};
use crate::weave::session::Session;
use crate::weave::woven::mask_spines;

/// Distance from an anchor, in lengths of the edges around it, of the two points through which a relaxed curve also passes to
/// keep the direction of the anchor. Within the tube of the relaxation, and far enough that one edge does not turn the curve.
const DIRECTION_REACH: f64 = 1.5;

impl Session {
    /// Strips through all anchors in order, the cheapest first. `replaces` is a placed strip that is edited: it does not block
    /// directions. `first` is called with the cheapest, smoothed, before its alternatives are found.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoLoop`] where there is none; [`WeaveError::NoStrip`]; or when cancelled.
    pub fn proposals_through(
        &mut self,
        anchors: &[Anchor],
        replaces: Option<StripId>,
        progress: &Progress,
        mut first: impl FnMut(Proposal),
    ) -> Result<Vec<Proposal>, WeaveError> {
        let mask = self.mask_without(replaces)?;
        let mut work = std::mem::take(&mut self.recent.workspace);
        let found = self.search_and_smooth(anchors, replaces, &mask, &mut work, progress, &mut first);
        self.recent.workspace = work;
        match found? {
            found if found.is_empty() => Err(self.why_no_loop(anchors, replaces, progress)?.into()),
            found => Ok(found),
        }
    }

    fn search_and_smooth(
        &self,
        anchors: &[Anchor],
        replaces: Option<StripId>,
        mask: &DirectionMask,
        work: &mut SearchWorkspace,
        progress: &Progress,
        first: &mut dyn FnMut(Proposal),
    ) -> Result<Vec<Proposal>, WeaveError> {
        let (model, strips) = (self.model(), &self.design().strips);
        let waypoints = self.waypoints(anchors);
        let others = strips.iter().filter(|s| Some(s.id) != replaces).map(Strip::woven);
        let contacts = LoopContacts::new(&model.mesh, &model.sharp, others);
        let smooth = |l: &FoundLoop| {
            let tie = model.options.relaxation_tie();
            let smooth = smoothed_proposal(&model.graph, &contacts, l, &waypoints, tie, progress)?;
            Ok::<_, WeaveError>(Proposal { anchors: anchors.to_vec(), ..smooth })
        };
        let mut best: Option<(SurfaceCurve, Proposal)> = None;
        let mut watch = |l: &FoundLoop| {
            if let Ok(proposal) = smooth(l) {
                first(proposal.clone());
                best = Some((l.curve.clone(), proposal));
            }
        };
        let mut found = self.loops_through(anchors, mask, work, progress, &mut watch)?;
        if found.is_empty() {
            // Where strips cover every direction, loops avoid the directions of their spines only.
            let spines = mask_spines(model, strips, |i| Some(strips[i].id) != replaces);
            found = self.loops_through(anchors, &spines, work, progress, &mut watch)?;
        }
        let known = |l: &FoundLoop| best.as_ref().filter(|(curve, _)| *curve == l.curve).map(|(_, p)| p.clone());
        found.par_iter().map(|l| known(l).map_or_else(|| smooth(l), Ok)).collect()
    }

    /// Puts a strip in the place of another one, as one step of the history; it keeps the number and the position in order.
    ///
    /// # Errors
    ///
    /// As for [`Self::place`], and [`WeaveError::NoStrip`].
    pub fn replace(&mut self, id: StripId, proposal: Proposal, progress: &Progress) -> Result<(), WeaveError> {
        let mut strips = self.design().strips.clone();
        let old = strips.iter_mut().find(|s| s.id == id).ok_or(WeaveError::NoStrip(id))?;
        *old = Strip { visible: old.visible, ..self.strip_of(id, proposal)? };
        self.change(strips, progress)
    }

    /// The directions open to a new strip; without those that the strip `replaces` closes.
    fn mask_without(&mut self, replaces: Option<StripId>) -> Result<Arc<DirectionMask>, WeaveError> {
        let woven = Arc::clone(self.woven());
        let Some(strip) = replaces else { return Ok(Arc::new(woven.mask.clone())) };
        let left_out = self.design().strips.iter().position(|s| s.id == strip).ok_or(WeaveError::NoStrip(strip))?;
        let mut recent = std::mem::take(&mut self.recent);
        let mask = || woven.mask_of(self.model(), &self.design().strips, |i| i != left_out);
        let mask = recent.mask_without(&woven, strip, mask);
        self.recent = recent;
        Ok(mask)
    }

    /// The loops through anchors under a mask, on the woven mesh.
    fn loops_through(
        &self,
        anchors: &[Anchor],
        mask: &DirectionMask,
        work: &mut SearchWorkspace,
        progress: &Progress,
        mut watch: impl FnMut(&FoundLoop),
    ) -> Result<Vec<FoundLoop>, Cancelled> {
        let graph = &self.model().graph;
        let at_vertices = self.at_vertices(anchors);
        let found = match *at_vertices {
            // Of a single point all directions are alternatives, and bounds make the search faster.
            [VertexAnchor { vertex, direction: None }] => {
                let query = ProposalQuery::alternatives(vertex, mask);
                let watch = |certainty, l: &FoundLoop| {
                    if certainty == Certainty::Proved {
                        watch(l);
                    }
                };
                graph.proposals_with(&query, work, progress, watch)?
            }
            _ => graph.loops_through(&AnchorQuery::alternatives(&at_vertices, mask), work, progress, watch)?,
        };
        Ok(found.loops)
    }

    /// The anchors at vertices of the woven mesh.
    fn at_vertices(&self, anchors: &[Anchor]) -> Vec<VertexAnchor> {
        let model = self.model();
        let vertex = |at| model.to_woven(at).nearest_vertex(&model.mesh);
        anchors.iter().map(|a| VertexAnchor { vertex: vertex(a.at), direction: a.direction }).collect()
    }

    /// The points that a relaxed curve passes to hold anchors.
    fn waypoints(&self, anchors: &[Anchor]) -> Vec<Waypoint> {
        let model = self.model();
        let index = model.surface(model.woven_role()).index;
        let mut points = Vec::new();
        for anchor in anchors {
            let at = model.to_woven(anchor.at);
            points.push(Waypoint { at, direction: anchor.direction });
            let Some(direction) = anchor.direction else { continue };
            let p = at.position(&model.mesh);
            let edges = model.mesh.face_halfedges(at.face).map(|h| model.mesh.vector(h).length());
            let reach = DIRECTION_REACH * edges.iter().sum::<f64>() / 3.0;
            let step = direction.reject_from(model.mesh.face_normal(at.face)).normalize_or_zero() * reach;
            let beside = |q| Waypoint { at: index.nearest(q), direction: Some(direction) };
            points.extend([p + step, p - step].map(beside));
        }
        points
    }

    /// Why no strip passes the anchors.
    fn why_no_loop(
        &self,
        anchors: &[Anchor],
        replaces: Option<StripId>,
        progress: &Progress,
    ) -> Result<NoLoop, Cancelled> {
        let mut work = SearchWorkspace::new();
        let at_vertices = self.at_vertices(anchors);
        let mut passes = |mask: &DirectionMask| {
            let query = AnchorQuery::cheapest(&at_vertices, mask);
            let found = self.model().graph.loops_through(&query, &mut work, progress, |_| {})?;
            Ok(!found.loops.is_empty())
        };
        if !passes(&DirectionMask::all_open())? {
            let topology = &self.model().topology;
            let pieces: Vec<u32> = anchors.iter().map(|a| topology.component_of_face[a.at.face.index()]).collect();
            let apart = pieces.iter().any(|&p| p != pieces[0]);
            return Ok(if apart { NoLoop::Apart } else { NoLoop::Turns });
        }
        let strips = &self.design().strips;
        for i in (0..strips.len()).filter(|&i| Some(strips[i].id) != replaces) {
            let others = |j: usize| j != i && Some(strips[j].id) != replaces;
            if passes(&mask_spines(self.model(), strips, others))? {
                return Ok(NoLoop::Blocked(i));
            }
        }
        Ok(NoLoop::BlockedBySeveral)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::{MeshSource, builtin};
    use crate::surface::SurfacePoint;
    use crate::weave::Options;

    fn torus() -> Session {
        let source = MeshSource::Builtin("torus".into());
        Session::open(builtin("torus").unwrap(), source, Options::default(), &Progress::new()).unwrap()
    }

    fn at(session: &Session, p: DVec3) -> SurfacePoint {
        session.model().index.nearest(p)
    }

    fn through(session: &mut Session, anchors: &[Anchor], replaces: Option<StripId>) -> Vec<Proposal> {
        session.proposals_through(anchors, replaces, &Progress::new(), |_| {}).unwrap()
    }

    /// The distance of a proposal from a point, and the angle between them in degrees.
    fn passes(session: &Session, proposal: &Proposal, anchor: &Anchor) -> (f64, f64) {
        let mesh = &session.model().mesh;
        let (points, p) = (proposal.points(mesh), anchor.at.position(mesh));
        let n = points.len();
        let distance = |i: usize| {
            let (a, b) = (points[i], points[(i + 1) % n]);
            let s = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
            (a + (b - a) * s).distance(p)
        };
        let i = (0..n).min_by(|&i, &j| distance(i).total_cmp(&distance(j))).unwrap();
        // A chord over three edges: crossings beside a vertex lie close together.
        let away = |step: usize| (1..n).map(|k| points[(i + k * step) % n]).find(|q| q.distance(p) > 0.028).unwrap();
        let tangent = (away(1) - away(n - 1)).normalize();
        let angle = anchor.direction.map_or(0.0, |d| tangent.dot(d.normalize()).abs().min(1.0).acos().to_degrees());
        (distance(i), angle)
    }

    #[test]
    fn a_strip_holds_its_anchors_and_their_directions() {
        let mut session = torus();
        let mesh = Arc::clone(&session.model().mesh);
        let radius = mesh.positions().iter().map(|p| p.x).fold(0.0, f64::max);
        let outer = at(&session, DVec3::new(radius, 0.0, 0.0));
        let normal = mesh.face_normal(outer.face);
        // Two directions in the tangent plane, at right angles.
        let u = normal.any_orthonormal_vector();
        for direction in [u, normal.cross(u), (u + normal.cross(u)).normalize()] {
            let anchor = Anchor { at: outer, direction: Some(direction) };
            let found = through(&mut session, &[anchor], None);
            let (distance, angle) = passes(&session, &found[0], &anchor);
            assert!(distance < 0.003 && angle < 5.0, "{distance}, {angle}°");
        }
        let anchors = [DVec3::new(radius, 0.0, 0.0), DVec3::new(0.0, radius, 0.1), DVec3::new(-radius, 0.1, -0.1)];
        let anchors = anchors.map(|p| Anchor::point(at(&session, p)));
        let found = through(&mut session, &anchors, None);
        for proposal in &found {
            assert!(anchors.iter().all(|a| passes(&session, proposal, a).0 < 0.75 * mesh.mean_edge_length()));
            assert_eq!(proposal.anchors, anchors);
        }
        assert!(found.windows(2).all(|w| w[0].cost <= w[1].cost));
    }

    #[test]
    fn a_strip_is_replaced_in_place_and_does_not_block_itself() {
        let mut session = torus();
        let progress = Progress::new();
        let p = session.model().mesh.positions()[100];
        let anchor = Anchor::point(at(&session, p));
        let proposals = through(&mut session, &[anchor], None);
        let id = session.place(proposals[0].clone(), &progress).unwrap();
        // The same loop is found again only while it is edited.
        let again = through(&mut session, &[anchor], Some(id));
        assert!((again[0].cost - proposals[0].cost).abs() < 1e-6 * proposals[0].cost);
        let before = session.design().clone();
        session.replace(id, again[0].clone(), &progress).unwrap();
        assert_eq!(session.design().strips[0].id, id);
        assert_eq!(session.design().strips[0].anchors, [anchor]);
        session.undo(&progress).unwrap();
        assert_eq!(session.design(), &before);
    }

    #[test]
    fn the_strip_that_blocks_is_named_by_its_place_in_the_list() {
        let mut session = torus();
        let progress = Progress::new();
        let p = session.model().mesh.positions()[100];
        let anchor = Anchor::point(at(&session, p));
        let proposal = through(&mut session, &[anchor], None).remove(0);
        let first = session.place(proposal.clone(), &progress).unwrap();
        session.remove(first, &progress).unwrap();
        // Its identifier is no longer its place.
        let second = session.place(proposal, &progress).unwrap();
        assert_ne!(second, first);
        assert_eq!(session.woven().mask, session.woven().mask_of(session.model(), &session.design().strips, |_| true));
        let why = session.why_no_loop(&[anchor], None, &progress).unwrap();
        assert_eq!(why, NoLoop::Blocked(0));
        assert!(why.to_string().starts_with("strip 1 "), "{why}");
    }
}
