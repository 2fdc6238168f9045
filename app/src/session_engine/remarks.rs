//! The state of a design in words: one remark for each kind of problem, and a summary.

use plait_core::dual::{Colour, Finding, RegionReport};
use plait_core::layout::QuadLayout;
use plait_core::weave::Session;

use crate::engine::{RegionColour, Remark};
use crate::texts::count;

/// The colour of a region, as the engine names it.
pub(super) fn region_colour(colour: Colour) -> RegionColour {
    match colour {
        Colour::None => RegionColour::None,
        Colour::Yellow => RegionColour::Yellow,
        Colour::Orange => RegionColour::Orange,
        Colour::Red => RegionColour::Red,
    }
}

/// One remark for each kind of problem, most urgent first, then most frequent first.
pub(super) fn remarks(session: &Session) -> Vec<Remark> {
    if session.design().strips.is_empty() {
        return vec![Remark { colour: RegionColour::Red, text: "No strips placed yet".into(), place: None }];
    }
    let woven = session.woven();
    let mut groups: Vec<(Colour, Problem, Vec<usize>)> = Vec::new();
    for (region, report) in woven.reports.iter().enumerate() {
        let Some(problem) = problem(report) else { continue };
        match groups.iter_mut().find(|(_, p, _)| *p == problem) {
            Some((_, _, regions)) => regions.push(region),
            None => groups.push((report.colour, problem, vec![region])),
        }
    }
    groups.sort_by(|a, b| b.0.cmp(&a.0).then(b.2.len().cmp(&a.2.len())));
    let remark = |(colour, problem, regions): (Colour, Problem, Vec<usize>)| Remark {
        colour: region_colour(colour),
        text: problem.text(regions.len()),
        place: regions.first().and_then(|&r| woven.region_centre(r)),
    };
    groups.into_iter().map(remark).collect()
}

/// The size of the layout and whether it can be exported. The text is empty while the layout is not valid.
pub(super) fn summary(session: &Session) -> (String, bool) {
    let (model, woven) = (session.model(), session.woven());
    match QuadLayout::dual(&woven.arrangement, &woven.red(), model.mesh.euler_characteristic()) {
        Ok(layout) => {
            let (patches, nodes) = (layout.patches.len(), layout.nodes.len());
            let irregular = layout.n_irregular();
            let patches = count(patches, "patch", "patches");
            let nodes = count(nodes, "node", "nodes");
            (format!("Ready to export: {patches}, {nodes} ({irregular} irregular)"), true)
        }
        Err(_) => (String::new(), false),
    }
}

/// The kind of problem of a region, without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Problem {
    Untouched,
    NoCorner,
    Handles,
    Annulus,
    Borders,
    BoundaryLoop,
    BoundaryStretches,
    Monogon,
    Digon,
    SeveralCorners,
    Valence,
}

/// The most urgent finding of a region; `None` for a region without a colour.
fn problem(report: &RegionReport) -> Option<Problem> {
    if report.colour == Colour::None {
        return None;
    }
    Some(match *report.findings.first()? {
        Finding::Untouched => Problem::Untouched,
        Finding::NoCorner => Problem::NoCorner,
        Finding::Handles { .. } => Problem::Handles,
        Finding::Borders { borders: 2 } => Problem::Annulus,
        Finding::Borders { .. } => Problem::Borders,
        Finding::Boundary { whole: 0, .. } => Problem::BoundaryStretches,
        Finding::Boundary { .. } => Problem::BoundaryLoop,
        Finding::Monogon => Problem::Monogon,
        Finding::Digon => Problem::Digon,
        Finding::SeveralCorners { .. } => Problem::SeveralCorners,
        Finding::Valence { .. } => Problem::Valence,
    })
}

impl Problem {
    fn text(self, n: usize) -> String {
        let (one, many) = match self {
            Self::Untouched => ("component has no strip", "components have no strip"),
            Self::NoCorner => ("region has no corner: strips must cross", "regions have no corner: strips must cross"),
            Self::Handles => ("region contains a handle", "regions contain handles"),
            Self::Annulus => {
                ("region is an annulus: a strip must cross it", "regions are annuli: strips must cross them")
            }
            Self::Borders => ("region has several borders", "regions have several borders"),
            Self::BoundaryLoop => ("region contains a boundary loop", "regions contain boundary loops"),
            Self::BoundaryStretches => {
                ("region meets the boundary several times", "regions meet the boundary several times")
            }
            Self::Monogon => ("region has only one corner", "regions have only one corner"),
            Self::Digon => ("region has only two corners", "regions have only two corners"),
            Self::SeveralCorners => {
                ("region contains several corners of the shape", "regions contain several corners of the shape")
            }
            Self::Valence => ("node valence does not match the curvature", "node valences do not match the curvature"),
        };
        count(n, one, many)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(colour: Colour, findings: Vec<Finding>) -> RegionReport {
        RegionReport { colour, findings, valence: 2, curvature: 0.0, area: 1.0, corners: Vec::new() }
    }

    #[test]
    fn problems_are_counted_in_singular_and_plural() {
        assert_eq!(Problem::Handles.text(1), "1 region contains a handle");
        assert_eq!(Problem::Handles.text(2), "2 regions contain handles");
    }

    #[test]
    fn a_region_without_a_colour_has_no_problem() {
        assert_eq!(problem(&report(Colour::None, vec![Finding::Digon])), None);
        assert_eq!(problem(&report(Colour::Orange, vec![Finding::Digon])), Some(Problem::Digon));
    }

    #[test]
    fn the_first_finding_decides() {
        let findings = vec![Finding::Borders { borders: 2 }, Finding::Handles { handles: 1 }];
        assert_eq!(problem(&report(Colour::Red, findings)), Some(Problem::Annulus));
        let findings = vec![Finding::Borders { borders: 3 }];
        assert_eq!(problem(&report(Colour::Red, findings)), Some(Problem::Borders));
    }
}
