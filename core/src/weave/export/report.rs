//! `report.json`: the strips, the layout, and the quality of its embedding.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use glam::DVec3;
use serde::Serialize;

use crate::dual::{Colour, RegionReport};
use crate::embed::{CollapsedChord, EmbeddingReport, Measures, PatchMeasures, UncollapsedChord, measure_patches};
use crate::mesh::{LoadedMesh, Topology, TriMesh};
use crate::output::{self, FileKind};
use crate::quad::{quality, resampling_error};
use crate::weave::design::Strip;
use crate::weave::error::WeaveError;
use crate::weave::export::result::{Export, Times};
use crate::weave::mesh_role::MeshRole;
use crate::weave::session::Session;

/// The subject of a report.
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
    layout: Option<LayoutSection>,
    /// Why there is no layout.
    error: Option<String>,
    valid: bool,
    seconds: Times,
}

#[derive(Serialize)]
struct Weaving<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    proxy: Option<ProxySection>,
    strips: Vec<StripSection>,
    crossings: usize,
    regions: &'a [RegionReport],
    colours: Colours,
}

/// The proxy that strips were woven on.
#[derive(Serialize)]
struct ProxySection {
    triangles: usize,
    /// Whether the layout is embedded on the proxy, and its quads are transferred to the design mesh.
    layout_on_proxy: bool,
}

/// Numbers of regions by colour.
#[derive(Serialize)]
struct Colours {
    red: usize,
    orange: usize,
    yellow: usize,
}

/// A strip. Its length is in units of the file.
#[derive(Serialize)]
struct StripSection {
    id: u32,
    closed: bool,
    length: f64,
    elastica_cost: f64,
    energy: Option<EnergySection>,
}

#[derive(Serialize)]
struct EnergySection {
    found: f64,
    relaxed: f64,
}

#[derive(Serialize)]
struct LayoutSection {
    nodes: usize,
    arcs: usize,
    patches: usize,
    chords: usize,
    irregular_nodes: usize,
    /// Number of irregular nodes of each valence.
    valences: BTreeMap<usize, usize>,
    euler_characteristic: i64,
    quads: usize,
    folded_quads: usize,
    mean_scaled_jacobian: f64,
    /// Distance between the quads and the surface, as a fraction of the diagonal of its bounding box.
    hausdorff_distance: f64,
    flipped_triangles: usize,
    embedding: EmbeddingSection,
    checks: Checks,
}

/// The quality of the embedding. Energies are relative to the area of the surface.
#[derive(Serialize)]
struct EmbeddingSection {
    /// Whether this is the optimised embedding, not the initial one.
    optimised: bool,
    /// Why the optimisation failed.
    error: Option<String>,
    #[serde(flatten)]
    optimisation: Option<OptimisationSection>,
    #[serde(flatten)]
    measures: MeasuresSection,
    /// The measures of the initial embedding.
    initial: Option<MeasuresSection>,
    patches: Vec<PatchSection>,
}

/// Results of the optimisation. Lengths and positions are in units of the file.
#[derive(Serialize)]
struct OptimisationSection {
    steps: usize,
    energy_before: f64,
    energy_after: f64,
    flipped_initially: usize,
    flipped_after_least_squares: usize,
    remaining_flipped_triangles: Vec<FlippedTriangle>,
    /// Chords that were collapsed, in order.
    collapsed_chords: Vec<CollapsedChord>,
    /// Chords that are shorter than the requested length and could not be collapsed.
    uncollapsed_chords: Vec<UncollapsedChord>,
    feature_edges: FeatureEdgesSection,
}

#[derive(Serialize)]
struct FlippedTriangle {
    at: [f64; 3],
    reason: String,
}

/// Sharp edges of the mesh that the layout is embedded on.
#[derive(Serialize)]
struct FeatureEdgesSection {
    total: usize,
    on_isolines: usize,
    /// The ends of the edges that are not on isolines.
    off_isolines: Vec<[[f64; 3]; 2]>,
}

/// The measures of Campen, section 6.8.1.
#[derive(Serialize)]
struct MeasuresSection {
    /// Mean conformal distortion, 2 at best.
    conformal: f64,
    /// Conjugacy error, 0 at best.
    planar: f64,
    /// Mean deviation from principal directions, in degrees.
    alignment: f64,
    /// Largest conformal distortion of a triangle.
    max_conformal: f64,
    /// Number of triangles that are flipped or have no area in the map.
    flipped: usize,
    /// Number of triangles whose distortion is clamped to the largest value that counts.
    clamped: usize,
}

#[derive(Serialize)]
struct PatchSection {
    aspect: f64,
    area: f64,
    #[serde(flatten)]
    measures: MeasuresSection,
}

/// Checks of a finished layout.
#[derive(Serialize)]
struct Checks {
    /// Nodes, arcs and patches add up to the Euler characteristic, and sides join corners.
    structure: bool,
    /// Every patch is a disc with four sides on the surface.
    patches_are_discs: bool,
    /// No patch map flips a triangle.
    maps_are_injective: bool,
    /// No quad of the refinement is folded.
    no_folded_quads: bool,
}

/// Writes `report.json` with the layout on `mesh`, or with the reason why there is none.
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
            (&session.model().loaded, &session.model().topology, Some(weaving(session, on_proxy)))
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
        layout: result.as_ref().ok().map(|e| layout_section(e, loaded)),
        error: result.as_ref().err().map(ToString::to_string),
        valid: result.is_ok(),
        seconds,
    };
    let text = serde_json::to_string_pretty(&report).unwrap_or_default();
    output::write(&folder.join("report.json"), FileKind::Report, |out| writeln!(out, "{text}"))?;
    Ok(())
}

fn weaving(session: &Session, layout_on_proxy: bool) -> Weaving<'_> {
    let (model, woven) = (session.model(), session.woven());
    let scale = model.loaded.units.scale;
    let strip = |s: &Strip| StripSection {
        id: s.id.0,
        closed: s.curve.closed,
        length: s.curve.length(&model.loaded.mesh) * scale,
        elastica_cost: s.cost,
        energy: s.energy.map(|e| EnergySection { found: e.found, relaxed: e.relaxed }),
    };
    Weaving {
        proxy: model.proxy.as_ref().map(|p| ProxySection { triangles: p.mesh().n_faces(), layout_on_proxy }),
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

fn layout_section(e: &Export, loaded: &LoadedMesh) -> LayoutSection {
    let euler_characteristic = loaded.mesh.euler_characteristic();
    let mut valences = BTreeMap::new();
    for n in e.layout.nodes.iter().filter(|n| !n.is_regular()) {
        *valences.entry(n.valence).or_insert(0) += 1;
    }
    let (folded_quads, mean_scaled_jacobian) = quality(&e.quads);
    let flipped_triangles = e.maps.iter().map(|m| m.flipped).sum();
    let checks = Checks {
        structure: e.layout.check(euler_characteristic).is_ok(),
        patches_are_discs: e.maps.iter().all(|m| m.mesh.euler_characteristic() == 1),
        maps_are_injective: flipped_triangles == 0,
        no_folded_quads: folded_quads == 0,
    };
    LayoutSection {
        nodes: e.layout.nodes.len(),
        arcs: e.layout.arcs.len(),
        patches: e.layout.patches.len(),
        chords: e.layout.chords,
        irregular_nodes: e.layout.n_irregular(),
        valences,
        euler_characteristic,
        quads: e.quads.quads.len(),
        folded_quads,
        mean_scaled_jacobian,
        hausdorff_distance: resampling_error(&e.quads, &loaded.mesh) / loaded.diagonal(),
        flipped_triangles,
        embedding: embedding_section(e, loaded),
        checks,
    }
}

fn embedding_section(e: &Export, loaded: &LoadedMesh) -> EmbeddingSection {
    let (all, patches, _) = measure_patches(&e.maps, &e.initial.face_curvature);
    let report = e.optimised.as_ref().and_then(|result| result.as_ref().ok());
    let patch = |p: &PatchMeasures| PatchSection {
        aspect: p.aspect,
        area: p.area * loaded.units.scale.powi(2),
        measures: measures(&p.measures),
    };
    EmbeddingSection {
        optimised: report.is_some(),
        error: e.optimised.as_ref().and_then(|result| result.as_ref().err().cloned()),
        optimisation: report.map(|r| optimisation(r, loaded)),
        measures: measures(&all),
        initial: e.initial.measures.as_ref().map(measures),
        patches: patches.iter().map(patch).collect(),
    }
}

fn optimisation(r: &EmbeddingReport, loaded: &LoadedMesh) -> OptimisationSection {
    let scale = loaded.units.scale;
    let in_file = |at: [f64; 3]| loaded.units.to_file(DVec3::from_array(at)).to_array();
    let flipped = r.remaining_flips.iter().map(|f| FlippedTriangle { at: in_file(f.at), reason: f.reason.clone() });
    OptimisationSection {
        steps: r.steps,
        energy_before: r.energy_before,
        energy_after: r.energy_after,
        flipped_initially: r.flipped_before,
        flipped_after_least_squares: r.flipped_after_least_squares,
        remaining_flipped_triangles: flipped.collect(),
        collapsed_chords: r
            .collapsed_chords
            .iter()
            .map(|c| CollapsedChord { length: c.length * scale, ..c.clone() })
            .collect(),
        uncollapsed_chords: r
            .uncollapsed_chords
            .iter()
            .map(|c| UncollapsedChord { length: c.length * scale, ..c.clone() })
            .collect(),
        feature_edges: FeatureEdgesSection {
            total: r.features.total,
            on_isolines: r.features.on_isolines,
            off_isolines: r.features.off_isolines.iter().map(|ends| ends.map(in_file)).collect(),
        },
    }
}

fn measures(m: &Measures) -> MeasuresSection {
    MeasuresSection {
        conformal: m.conformal,
        planar: m.planar,
        alignment: m.alignment,
        max_conformal: m.max_conformal,
        flipped: m.flipped,
        clamped: m.clamped,
    }
}
