//! Suggests the strip that improves the arrangement most.
//!
//! Candidates are loops through well-spread points of the most urgent region. Each is tried in the arrangement; the one of
//! least elastica cost per gain is suggested. The gain is measured by the *deficit* of an arrangement, a weighted count of
//! the findings that keep regions from being good nodes. It is zero exactly when the goal is reached.

use crate::dual::{Colour, Finding, RegionReport, assess};
use crate::elastica::DirectionMask;
use crate::mesh::VertexId;
use crate::progress::{Cancelled, Progress};
use crate::surface::{RelaxOptions, SurfaceCurve, relax};
use crate::weave::error::NoSuggestion;
use crate::weave::error::WeaveError;
use crate::weave::proposal::Proposal;
use crate::weave::search::candidates::{Query, around, loops};
use crate::weave::search::detour::detours;
use crate::weave::session::Session;
use glam::DVec3;
use rayon::prelude::*;

/// The goal of suggestions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// No region is red.
    Valid,
    /// No region is red or orange.
    Separated,
}

/// Number of points tried in a region: enough for some to lie on each of its limbs. Chosen by hand.
const POINTS: usize = 10;
/// Number of candidates tried in the arrangement, the cheapest first. Chosen by hand.
const TRIED: usize = 32;
/// Number of classes of curves tried per region when no elastica loop helps. Chosen by hand.
const DETOURS: usize = 200;
/// Radius of the tube in which a curve found by connectivity alone is relaxed, in mean edge lengths. Larger than for loops,
/// since such curves are jagged.
const WIDE_TUBE: f64 = 6.0;

/// Which loops are searched at each point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Search {
    /// The cheapest and its alternatives.
    Cheapest,
    /// The cheapest in each of four directions.
    Around,
}

impl Session {
    /// The strip that brings the arrangement nearest to `goal`.
    ///
    /// # Errors
    ///
    /// [`NoSuggestion`], or when cancelled.
    pub fn suggest(&mut self, goal: Goal, progress: &Progress) -> Result<Proposal, WeaveError> {
        let woven = self.woven();
        let before = deficit(&woven.reports, goal);
        let urgent = urgent_regions(&woven.reports, goal);
        let Some(&first) = urgent.first() else { return Err(NoSuggestion::Done.into()) };
        let open = DirectionMask::all_open();
        // First the cheapest loops in the most urgent region; then loops in four directions, in three regions; then the
        // same without the mask of placed strips; at last curves by connectivity alone.
        let stages = [(Search::Cheapest, &woven.mask, 1), (Search::Around, &woven.mask, 3), (Search::Around, &open, 3)];
        for (stage, (search, mask, regions)) in stages.into_iter().enumerate() {
            progress.report("Searching for the strip that helps most", 0.25 * stage as f64 + 0.05);
            for &region in urgent.iter().take(regions) {
                let candidates = self.candidates(region, search, mask, progress)?;
                if let Some(best) = self.best_of(candidates, before, goal, progress)? {
                    return Ok(self.smoothed(best, RelaxOptions::default().tube, before, goal, progress)?);
                }
            }
        }
        for &region in &urgent {
            let root = woven.arrangement.regions[region as usize].faces[0];
            let curves = detours(&woven.arrangement, &self.model().mesh, root, DETOURS);
            if let Some(best) = self.best_of(curves, before, goal, progress)? {
                return Ok(self.smoothed(best, WIDE_TUBE, before, goal, progress)?);
            }
        }
        let reason = woven.reports[first as usize].findings.first().map(ToString::to_string).unwrap_or_default();
        Err(NoSuggestion::NoHelp { region: first, reason }.into())
    }

    /// Places suggestions until `goal` is reached. If no further strip can be suggested before, the reason is returned.
    ///
    /// # Errors
    ///
    /// When cancelled.
    pub fn weave_to(&mut self, goal: Goal, progress: &Progress) -> Result<Option<NoSuggestion>, WeaveError> {
        loop {
            match self.suggest(goal, progress) {
                Ok(proposal) => self.place(proposal, progress)?,
                Err(WeaveError::NoSuggestion(NoSuggestion::Done)) => return Ok(None),
                Err(WeaveError::NoSuggestion(reason)) => return Ok(Some(reason)),
                Err(error) => return Err(error),
            };
        }
    }

    /// A proposal relaxed within a tube of radius `tube`, in mean edge lengths, if the relaxed curve still has a gain; else the
    /// proposal as it is.
    fn smoothed(
        &self,
        proposal: Proposal,
        tube: f64,
        before: f64,
        goal: Goal,
        progress: &Progress,
    ) -> Result<Proposal, Cancelled> {
        let model = self.model();
        let options = RelaxOptions { tube, tie: model.options.relaxation_tie(), ..Default::default() };
        let relaxed = relax(&model.mesh, &proposal.curve, &options, progress);
        progress.check()?;
        let Ok(relaxed) = relaxed else { return Ok(proposal) };
        let helps = self.gain(&relaxed.curve, before, goal).is_some();
        Ok(if helps { proposal.relaxed(relaxed) } else { proposal })
    }

    /// The gain of a curve, the reduction of the deficit; `None` if it has none or cannot be placed.
    fn gain(&self, curve: &SurfaceCurve, before: f64, goal: Goal) -> Option<f64> {
        let model = self.model();
        if model.proxy.is_some() && model.to_design(curve).is_err() {
            return None;
        }
        let arrangement = self.arranged_with(curve).ok()?;
        let reports = assess(&arrangement, &model.vertex_curvatures, &model.corners);
        let gain = before - deficit(&reports, goal);
        (gain > 1e-9).then_some(gain)
    }

    /// Loops through well-spread points of a region, the cheapest first.
    fn candidates(
        &self,
        region: u32,
        search: Search,
        mask: &DirectionMask,
        progress: &Progress,
    ) -> Result<Vec<Proposal>, WeaveError> {
        let points = spread_points(self, region).into_iter();
        let queries: Vec<Query> = points
            .flat_map(|v| match search {
                Search::Cheapest => vec![(v, None)],
                Search::Around => around(self.model(), v).to_vec(),
            })
            .collect();
        loops(&self.model().graph, &queries, mask, TRIED, progress)
    }

    /// The candidate of least elastica cost per gain, if any has a gain.
    fn best_of(
        &self,
        candidates: Vec<Proposal>,
        before: f64,
        goal: Goal,
        progress: &Progress,
    ) -> Result<Option<Proposal>, Cancelled> {
        let ratios: Vec<Option<f64>> = candidates
            .par_iter()
            .map(|c| {
                progress.check()?;
                Ok(self.gain(&c.curve, before, goal).map(|gain| c.cost / gain))
            })
            .collect::<Result<_, Cancelled>>()?;
        tracing::debug!(candidates = candidates.len(), helpful = ratios.iter().flatten().count(), "tried");
        let best = ratios
            .iter()
            .enumerate()
            .filter_map(|(i, p)| p.map(|p| (i, p)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(i, _)| candidates[i].clone());
        Ok(best)
    }
}

/// The deficit of an assessment: the weighted count of findings. Weights are chosen by hand.
fn deficit(reports: &[RegionReport], goal: Goal) -> f64 {
    let one = |finding: &Finding| match *finding {
        Finding::Untouched => 4.0,
        Finding::Handles { handles } => 2.0 * handles as f64,
        Finding::Borders { borders } => borders as f64 - 1.0,
        Finding::Boundary { whole, stretches } => 2.0 * whole as f64 + stretches.saturating_sub(1 + whole) as f64,
        Finding::NoCorner | Finding::Monogon => 1.0,
        Finding::Digon => 0.5,
        Finding::SeveralCorners { corners } => {
            (if goal == Goal::Separated { 0.5 } else { 0.02 }) * (corners as f64 - 1.0)
        }
        Finding::Valence { .. } => 0.0,
    };
    reports.iter().flat_map(|r| &r.findings).map(one).sum()
}

/// Regions that do not reach the goal, by urgency, then by area, the largest first.
fn urgent_regions(reports: &[RegionReport], goal: Goal) -> Vec<u32> {
    let matters = |r: &RegionReport| {
        r.colour == Colour::Red
            || r.findings.contains(&Finding::Digon)
            || (goal == Goal::Separated && r.colour == Colour::Orange)
    };
    let mut list: Vec<u32> = (0..reports.len() as u32).filter(|&i| matters(&reports[i as usize])).collect();
    list.sort_by(|&a, &b| {
        let (a, b) = (&reports[a as usize], &reports[b as usize]);
        b.colour.cmp(&a.colour).then(b.area.total_cmp(&a.area))
    });
    list
}

/// Vertices of a region by farthest-point sampling.
fn spread_points(session: &Session, region: u32) -> Vec<VertexId> {
    let (woven, mesh) = (session.woven(), &session.model().mesh);
    let mut inside: Vec<u32> = woven.arrangement.regions[region as usize]
        .faces
        .iter()
        .flat_map(|&f| woven.arrangement.refined.corners(f))
        .filter(|&v| (v as usize) < mesh.n_vertices())
        .collect();
    inside.sort_unstable();
    inside.dedup();
    if inside.is_empty() {
        return woven.arrangement.regions[region as usize]
            .faces
            .first()
            .map(|&f| mesh.face_vertices(crate::mesh::FaceId(woven.arrangement.refined.base_face(f)))[0])
            .into_iter()
            .collect();
    }
    let mean = inside.iter().map(|&v| mesh.positions()[v as usize]).sum::<DVec3>() / inside.len() as f64;
    let mut distance: Vec<f64> = inside.iter().map(|&v| mesh.positions()[v as usize].distance(mean)).collect();
    let mut picked = Vec::new();
    while picked.len() < POINTS.min(inside.len()) {
        let far = (0..inside.len()).max_by(|&i, &j| distance[i].total_cmp(&distance[j])).unwrap_or(0);
        let at = mesh.positions()[inside[far] as usize];
        picked.push(VertexId(inside[far]));
        for (d, &v) in distance.iter_mut().zip(&inside) {
            *d = d.min(mesh.positions()[v as usize].distance(at));
        }
    }
    picked
}
