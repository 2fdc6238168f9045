//! What remains to be done, in words, grouped by what is the matter.

use plait_core::dual::{Colour, Finding, RegionReport};
use plait_core::layout::QuadLayout;
use plait_core::weave::{Improvement, Session};

use super::region_place;
use crate::engine::{RegionColour, Remark};

/// The colour in the terms of the window.
pub fn color(colour: Colour) -> RegionColour {
    match colour {
        Colour::None => RegionColour::None,
        Colour::Yellow => RegionColour::Yellow,
        Colour::Orange => RegionColour::Orange,
        Colour::Red => RegionColour::Red,
    }
}

/// What came of trying other strips.
pub fn improved(i: &Improvement) -> String {
    if i.changes == 0 {
        return "no strips were found with which the layout follows the shape better".into();
    }
    let patches = |n: usize| format!("{n} {}", if n == 1 { "patch" } else { "patches" });
    format!(
        "the layout follows the shape within {:.1}° in {}, before within {:.1}° in {} (misfit {:.1}, before {:.1})",
        i.after.alignment,
        patches(i.after.patches),
        i.before.alignment,
        patches(i.before.patches),
        i.after.objective,
        i.before.objective,
    )
}

/// One remark for each kind of thing that is the matter, most urgent first, then most frequent.
pub fn remarks(session: &Session) -> Vec<Remark> {
    if session.design().strips.is_empty() {
        return vec![Remark { color: RegionColour::Red, text: "No strip is placed yet".into(), place: None }];
    }
    let woven = session.woven();
    let mut groups: Vec<(Colour, Kind, Vec<usize>)> = Vec::new();
    for (region, report) in woven.reports.iter().enumerate() {
        let Some(kind) = kind(report) else { continue };
        match groups.iter_mut().find(|(_, k, _)| *k == kind) {
            Some((_, _, regions)) => regions.push(region),
            None => groups.push((report.colour, kind, vec![region])),
        }
    }
    groups.sort_by(|a, b| b.0.cmp(&a.0).then(b.2.len().cmp(&a.2.len())));
    let remark = |(colour, kind, regions): (Colour, Kind, Vec<usize>)| Remark {
        color: color(colour),
        text: kind.text(regions.len()),
        place: regions.first().and_then(|&r| region_place(&woven.arrangement, r)),
    };
    groups.into_iter().map(remark).collect()
}

/// Where the design stands, and whether it can be exported.
pub fn summary(session: &Session) -> (String, bool) {
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

/// What is the matter with a region, for grouping.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Untouched,
    NoCrossing,
    Handles,
    Ring,
    Borders,
    BoundaryLoop,
    BoundaryStretches,
    Monogon,
    Digon,
    SeveralCorners,
    Valence,
}

/// The most urgent finding of a region with a colour.
fn kind(report: &RegionReport) -> Option<Kind> {
    if report.colour == Colour::None {
        return None;
    }
    Some(match *report.findings.first()? {
        Finding::Untouched => Kind::Untouched,
        Finding::NoCorner => Kind::NoCrossing,
        Finding::Handles { .. } => Kind::Handles,
        Finding::Borders { borders: 2 } => Kind::Ring,
        Finding::Borders { .. } => Kind::Borders,
        Finding::Boundary { whole: 0, .. } => Kind::BoundaryStretches,
        Finding::Boundary { .. } => Kind::BoundaryLoop,
        Finding::Monogon => Kind::Monogon,
        Finding::Digon => Kind::Digon,
        Finding::SeveralCorners { .. } => Kind::SeveralCorners,
        Finding::Valence { .. } => Kind::Valence,
    })
}

impl Kind {
    fn text(self, n: usize) -> String {
        let (one, many) = match self {
            Self::Untouched => ("part has no strip yet", "parts have no strip yet"),
            Self::NoCrossing => ("region has no corner: let strips cross", "regions have no corner: let strips cross"),
            Self::Handles => ("region holds a handle", "regions hold handles"),
            Self::Ring => ("region is a ring: cross it", "regions are rings: cross them"),
            Self::Borders => ("region has several borders", "regions have several borders"),
            Self::BoundaryLoop => ("region holds a boundary loop", "regions hold boundary loops"),
            Self::BoundaryStretches => {
                ("region meets the boundary several times", "regions meet the boundary several times")
            }
            Self::Monogon => ("region has a single corner", "regions have a single corner"),
            Self::Digon => ("region has only two corners", "regions have only two corners"),
            Self::SeveralCorners => ("region holds several corners", "regions hold several corners"),
            Self::Valence => ("region does not fit its curvature", "regions do not fit their curvature"),
        };
        count(n, one, many)
    }
}

fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}
