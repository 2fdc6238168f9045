//! `report.json`: what was woven, what layout came of it, how good its embedding is.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;
use serde::Serialize;

use crate::dual::{Colour, RegionReport};
use crate::embed::{CollapsedChord, FeatureEdges, Measures, Surface, UncollapsedChord, measure_patches};
use crate::layout::{Embedding, PatchMap};
use crate::mesh::{LoadedMesh, Topology, TriMesh};
use crate::quad::{quality, resampling_error};
use crate::surface::PrincipalCurvature;
use crate::surface::face_curvature;
use crate::weave::design::Strip;
use crate::weave::error::WeaveError;
use crate::weave::export::files::{Export, write_file};
use crate::weave::mesh_role::MeshRole;
use crate::weave::proposal::ElasticEnergy;
use crate::weave::session::Session;

/// Seconds by the name of what took them.
pub type Times = BTreeMap<String, f64>;

/// A drawing before it was optimised.
#[derive(Debug, Clone)]
pub struct Before {
    /// The drawing.
    pub initial_embedding: Embedding,
    /// Its measures, with patches mapped one by one; `None` where that cannot be done.
    pub measures: Option<Measures>,
    /// Principal curvatures of the triangles of the surface.
    pub(in crate::weave) bending: Vec<PrincipalCurvature>,
}

impl Before {
    pub(in crate::weave) fn new(
        initial_embedding: &Embedding,
        maps: Option<&[PatchMap]>,
        surface: &Surface<'_>,
    ) -> Self {
        let bending = face_curvature(surface.mesh, surface.curvature, |_| true);
        let measures = maps.map(|maps| measure_patches(maps, &bending).0);
        Self { initial_embedding: initial_embedding.clone(), measures, bending }
    }
}

/// What a report is about.
#[derive(Clone, Copy)]
pub(in crate::weave) enum Subject<'a> {
    /// A session with its design.
    Session(&'a Session),
    /// A layout file on this mesh.
    File(&'a LoadedMesh, &'a Topology),
}

#[derive(Serialize)]
struct Report<'a> {
    mesh: &'a str,
    faces: usize,
    genus: usize,
    boundary_loops: usize,
    components: usize,
    #[serde(flatten)]
    weaving: Option<Weaving<'a>>,
    layout: Option<LayoutReport>,
    problem: Option<String>,
    valid: bool,
    seconds: Times,
}

#[derive(Serialize)]
struct Weaving<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    proxy: Option<ProxySection>,
    strips: Vec<StripReport>,
    crossings: usize,
    regions: &'a [RegionReport],
    colours: Colours,
}

/// The proxy that strips were woven on.
#[derive(Serialize)]
struct ProxySection {
    triangles: usize,
    /// Whether the layout, too, is embedded on the proxy, and its quads were then carried to the mesh.
    embedded: bool,
}

/// Counts of one colour.
#[derive(Serialize)]
struct Colours {
    red: usize,
    orange: usize,
    yellow: usize,
}

#[derive(Serialize)]
struct StripReport {
    id: u32,
    closed: bool,
    length: f64,
    cost: f64,
    energy: Option<ElasticEnergy>,
}

#[derive(Serialize)]
struct LayoutReport {
    nodes: usize,
    arcs: usize,
    patches: usize,
    chords: usize,
    irregular: usize,
    valences: BTreeMap<usize, usize>,
    euler: i64,
    quads: usize,
    folded_quads: usize,
    mean_scaled_jacobian: f64,
    /// How far quads are from the surface at most, as a fraction of the diagonal of its bounding box.
    farthest_quad: f64,
    flipped_triangles: usize,
    embedding: EmbeddingSection,
    checks: Checks,
}

/// How good the embedding is. Energies are relative to the surface's area, and so to its size.
#[derive(Serialize)]
struct EmbeddingSection {
    /// Whether this is the optimised embedding, not the drawing.
    optimised: bool,
    /// Why the optimisation failed.
    problem: Option<String>,
    #[serde(flatten)]
    course: Option<Course>,
    #[serde(flatten)]
    measures: Measures,
    /// The measures of the drawing.
    before: Option<Measures>,
    patches: Vec<PatchSection>,
}

/// The course of the optimisation.
#[derive(Serialize)]
struct Course {
    steps: usize,
    energy_before: f64,
    energy_after: f64,
    flipped_before: usize,
    flipped_at_rest: usize,
    folds: Vec<FoldSection>,
    /// Chords that were collapsed, in order, and those that were to be and could not be.
    collapsed: Vec<CollapsedChord>,
    short: Vec<UncollapsedChord>,
    /// Edges of features, and which of them do not lie on isolines.
    features: FeatureEdges,
}

#[derive(Serialize)]
struct FoldSection {
    at: [f64; 3],
    reason: String,
}

#[derive(Serialize)]
struct PatchSection {
    aspect: f64,
    area: f64,
    #[serde(flatten)]
    measures: Measures,
}

/// What was checked of a finished layout.
#[derive(Serialize)]
struct Checks {
    /// Nodes, arcs and patches add up to the Euler characteristic, and sides join corners.
    structure: bool,
    /// Every patch is a disc with four sides on the surface.
    patches_are_discs: bool,
    /// No map of a patch turns a triangle over.
    maps_are_one_to_one: bool,
    /// No quad of the refinement is folded.
    quads_are_unfolded: bool,
}

/// Writes `report.json` of a layout on `mesh`, or of why there is none.
pub(in crate::weave) fn write_report(
    folder: &Path,
    subject: Subject<'_>,
    result: &Result<Export, WeaveError>,
    mut seconds: Times,
    mesh: &TriMesh,
) -> Result<(), WeaveError> {
    let (loaded, topology, weaving) = match subject {
        Subject::Session(session) => {
            let on_proxy = result.as_ref().is_ok_and(|e| e.mesh_role == MeshRole::Proxy);
            (&session.model().loaded, &session.model().topology, Some(weaving_report(session, on_proxy)))
        }
        Subject::File(loaded, topology) => (loaded, topology, None),
    };
    if let Ok(export) = result {
        seconds.extend(export.seconds.clone());
    }
    let report = Report {
        mesh: &loaded.name,
        faces: mesh.n_faces(),
        genus: topology.genus,
        boundary_loops: topology.boundary_loops.len(),
        components: topology.components.len(),
        weaving,
        layout: result.as_ref().ok().map(|e| layout_report(e, loaded)),
        problem: result.as_ref().err().map(ToString::to_string),
        valid: result.is_ok(),
        seconds,
    };
    let text = serde_json::to_string_pretty(&report).unwrap_or_default();
    write_file(&folder.join("report.json"), |out| writeln!(out, "{text}"))
}

fn weaving_report(session: &Session, embedded: bool) -> Weaving<'_> {
    let (model, woven) = (session.model(), session.woven());
    let scale = model.loaded.units.scale;
    let strip = |s: &Strip| StripReport {
        id: s.id.0,
        closed: s.curve.closed,
        length: s.curve.length(&model.loaded.mesh) * scale,
        cost: s.cost,
        energy: s.energy,
    };
    Weaving {
        proxy: model.proxy.as_ref().map(|p| ProxySection { triangles: p.mesh().n_faces(), embedded }),
        strips: session.design().strips.iter().map(strip).collect(),
        crossings: woven.arrangement.crossings.len(),
        regions: &woven.reports,
        colours: Colours {
            red: woven.count(Colour::Red),
            orange: woven.count(Colour::Orange),
            yellow: woven.count(Colour::Yellow),
        },
    }
}

fn layout_report(e: &Export, loaded: &LoadedMesh) -> LayoutReport {
    let euler = loaded.mesh.euler_characteristic();
    let mut valences = BTreeMap::new();
    for n in e.layout.nodes.iter().filter(|n| !n.is_regular()) {
        *valences.entry(n.valence).or_insert(0) += 1;
    }
    let (folded_quads, mean_scaled_jacobian) = quality(&e.quads);
    let flipped_triangles = e.maps.iter().map(|m| m.flipped).sum();
    let checks = Checks {
        structure: e.layout.check(euler).is_ok(),
        patches_are_discs: e.maps.iter().all(|m| m.mesh.euler_characteristic() == 1),
        maps_are_one_to_one: flipped_triangles == 0,
        quads_are_unfolded: folded_quads == 0,
    };
    LayoutReport {
        nodes: e.layout.nodes.len(),
        arcs: e.layout.arcs.len(),
        patches: e.layout.patches.len(),
        chords: e.layout.chords,
        irregular: e.layout.n_irregular(),
        valences,
        euler,
        quads: e.quads.quads.len(),
        folded_quads,
        mean_scaled_jacobian,
        farthest_quad: resampling_error(&e.quads, &loaded.mesh),
        flipped_triangles,
        embedding: embedding_section(e, loaded),
        checks,
    }
}

fn embedding_section(e: &Export, loaded: &LoadedMesh) -> EmbeddingSection {
    let (measures, patches, _) = measure_patches(&e.maps, &e.before.bending);
    let done = e.optimised.as_ref().and_then(|result| result.as_ref().ok());
    let scale = loaded.units.scale;
    let in_file = |at: [f64; 3]| loaded.units.to_file(DVec3::from_array(at)).to_array();
    let course = done.map(|r| Course {
        steps: r.steps,
        energy_before: r.energy_before,
        energy_after: r.energy_after,
        flipped_before: r.flipped_before,
        flipped_at_rest: r.flipped_after_least_squares,
        folds: r.remaining_flips.iter().map(|f| FoldSection { at: in_file(f.at), reason: f.reason.clone() }).collect(),
        collapsed: r
            .collapsed_chords
            .iter()
            .map(|c| CollapsedChord { length: c.length * scale, ..c.clone() })
            .collect(),
        short: r
            .uncollapsed_chords
            .iter()
            .map(|c| UncollapsedChord { length: c.length * scale, ..c.clone() })
            .collect(),
        features: FeatureEdges {
            off_isolines: r.features.off_isolines.iter().map(|ends| ends.map(in_file)).collect(),
            ..r.features
        },
    });
    let patch = |p: &crate::embed::PatchMeasures| PatchSection {
        aspect: p.aspect,
        area: p.area * loaded.units.scale.powi(2),
        measures: p.measures,
    };
    EmbeddingSection {
        optimised: done.is_some(),
        problem: e.optimised.as_ref().and_then(|result| result.as_ref().err().cloned()),
        course,
        measures,
        before: e.before.measures,
        patches: patches.iter().map(patch).collect(),
    }
}

impl Export {
    /// Whether chords of the layout were collapsed.
    pub fn has_collapsed(&self) -> bool {
        matches!(&self.optimised, Some(Ok(report)) if !report.collapsed_chords.is_empty())
    }

    /// The measures of the embedding that is written.
    pub fn measures(&self) -> Measures {
        measure_patches(&self.maps, &self.before.bending).0
    }
}
