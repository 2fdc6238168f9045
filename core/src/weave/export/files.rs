//! From a drawn layout to files: embedded, mapped patch by patch, refined to quads.
//!
//! What is written is the optimised embedding. Where that fails, the drawing it started from is written in its place,
//! with patches mapped one by one, and the report says why.

use std::io::Write;
use std::path::Path;
use std::time::Instant;

use crate::embed::{
    self, ArcHeadings, EmbeddingReport, Measures, Next, OptimisedEmbedding, Problem, Settings, Snapshot, Surface,
    arc_headings,
};
use crate::layout::{Embedding, LayoutFile, PatchMap, QuadLayout, map_patches};
use crate::mesh::{Normalisation, TriMesh, write_obj};
use crate::progress::Progress;
use crate::proxy::Proxy;
use crate::quad::{QuadMesh, Spacing, adaptive_spacing, integer_grid_counts};
use crate::surface::second_fundamental_form;
use crate::weave::PinnedParts;
use crate::weave::embedding::{InitialLayout, initial_layout};
use crate::weave::error::WeaveError;
use crate::weave::export::quads::quads;
use crate::weave::export::report::{Before, Subject, Times, write_report};
use crate::weave::mesh_role::MeshRole;
use crate::weave::session::Session;

/// How fine the quads are to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum QuadSize {
    /// This edge length, in units of the file.
    EdgeLength(f64),
    /// About so many quads.
    Count(u32),
}

/// What to export.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// How fine the quads are to be.
    pub size: QuadSize,
    /// How the embedding is optimised; `None`: the drawing is written.
    pub embedding: Option<Settings>,
    /// Whether patches are to be as wide and high as multiples of a quad's edge.
    pub integer: bool,
    /// Whether dual strips are to be left out that make the layout more irregular and the embedding no better.
    pub simplify: bool,
    /// Whether arcs that want to be shorter than this are to be collapsed.
    pub collapse: Option<CollapseLength>,
}

/// The length below which arcs are collapsed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CollapseLength {
    /// The edge length of the quads.
    Quad,
    /// This one, in units of the file.
    Length(f64),
}

impl Default for ExportOptions {
    fn default() -> Self {
        // Fine enough that the quads follow the surface to well below half a percent of its size.
        Self {
            size: QuadSize::Count(6000),
            embedding: Some(Settings::default()),
            integer: false,
            simplify: false,
            collapse: None,
        }
    }
}

/// Sees every step of an optimisation that made the embedding better, and says whether to go on.
pub type Watch<'a> = &'a mut dyn FnMut(&Snapshot) -> Next;

/// A drawn layout on a surface, as it comes from a session or from a layout file.
#[derive(Debug, Clone, Copy)]
pub struct EmbeddingInput<'a> {
    /// The surface.
    pub surface: Surface<'a>,
    /// Where the surface is a proxy: its maps, and the mesh that the quads are to lie on.
    pub proxy: Option<(&'a Proxy, &'a TriMesh)>,
    /// Its place and size in the file.
    pub units: Normalisation,
    /// The layout, without patches where arcs are missing, and its drawing.
    pub drawn: &'a InitialLayout,
    /// The headings of the arcs' sides in the charts of the regions between them.
    pub arc_headings: &'a [ArcHeadings],
    /// What is to stay where it is drawn.
    pub pinned: &'a PinnedParts,
}

/// A finished layout.
#[derive(Debug)]
pub struct Export {
    /// Its structure.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The mesh that layout, embedding and maps are on; the quads always lie on that of the design.
    pub mesh_role: MeshRole,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// Its refinement.
    pub quads: QuadMesh,
    /// What the optimisation achieved, or why it failed; `None` where none was asked for.
    pub optimised: Option<Result<EmbeddingReport, String>>,
    /// The drawing it started from.
    pub before: Before,
    /// Seconds that the parts of the work took.
    pub seconds: Times,
}

/// The layout of a session, embedded and refined.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions.
pub fn export(session: &Session, options: &ExportOptions, progress: &Progress) -> Result<Export, WeaveError> {
    export_session(session, None, options, progress, &mut |_| Next::Continue)
}

fn export_session(
    session: &Session,
    embedded: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    export_layout(session, &initial_layout(session, progress)?, embedded, options, progress, watch)
}

pub(in crate::weave) fn export_layout(
    session: &Session,
    drawn: &InitialLayout,
    embedded: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    let model = session.model();
    let sketch = EmbeddingInput {
        surface: model.surface(drawn.mesh_role),
        proxy: model.proxy.as_ref().map(|p| (p, &*model.loaded.mesh)).filter(|_| drawn.mesh_role == MeshRole::Proxy),
        units: model.loaded.units,
        arc_headings: &arc_headings(&drawn.layout),
        pinned: &drawn.pinned(&session.design().pins),
        drawn,
    };
    finish(&sketch, embedded, options, progress, watch)
}

/// Embeds a drawn layout, or takes it as `embedded` before, and refines it.
///
/// # Errors
///
/// When cancelled; when a layout with missing arcs cannot be optimised, since only the map completes it; or when the
/// patches of a drawing cannot be mapped.
pub fn finish(
    sketch: &EmbeddingInput<'_>,
    embedded: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    let EmbeddingInput { surface, drawn, arc_headings, pinned, .. } = *sketch;
    let InitialLayout { layout, embedding: initial_embedding, mesh_role } = drawn;
    let mut seconds = Times::new();
    let start = Instant::now();
    let edge = edge_length(options.size, sketch);
    let optimised = match (embedded, options.embedding) {
        (Some(embedded), _) => Some(Ok(embedded.clone())),
        (None, None) => None,
        (None, Some(settings)) => {
            let settings = Settings {
                integer: options.integer.then_some(edge),
                simplify: options.simplify,
                collapse: options.collapse.map(|shortest| match shortest {
                    CollapseLength::Quad => edge,
                    CollapseLength::Length(length) => length / sketch.units.scale,
                }),
                ..settings
            };
            let (pinned_nodes, pinned_arcs) = (&pinned.nodes[..], &pinned.arcs[..]);
            let job = Problem { surface, layout, initial_embedding, arc_headings, pinned_nodes, pinned_arcs, settings };
            Some(embed::optimise_embedding(&job, progress, watch))
        }
    };
    progress.check()?;
    seconds.insert("embed".to_owned(), start.elapsed().as_secs_f64());
    progress.report("Mapping patches", 0.95);
    let start = Instant::now();
    let rough = (!layout.patches.is_empty()).then(|| map_patches(layout, initial_embedding, progress));
    progress.check()?;
    let mut before = Before::new(initial_embedding, rough.as_ref().and_then(|maps| maps.as_deref().ok()), &surface);
    let kept = optimised.as_ref().and_then(|o| o.as_ref().ok()).filter(|_| embedded.is_none());
    let problem = kept.and_then(|e| no_better(&e.report, before.measures.as_ref()));
    let (layout, embedding, maps, optimised) = match (optimised, rough) {
        (Some(Ok(_)), Some(Ok(maps))) if problem.is_some() => {
            (layout.clone(), initial_embedding.clone(), maps, problem.map(Err))
        }
        (Some(Ok(e)), _) => {
            before.initial_embedding = e.initial_embedding.unwrap_or(before.initial_embedding);
            (e.layout, e.embedding, e.maps, Some(Ok(e.report)))
        }
        (Some(Err(error)), None) => return Err(error.into()),
        (None, None) => return Err(WeaveError::Incomplete),
        (failed, Some(maps)) => {
            let problem = failed.and_then(Result::err).map(|error| Err(error.to_string()));
            (layout.clone(), initial_embedding.clone(), maps?, problem)
        }
    };
    let done = matches!(optimised, Some(Ok(_)));
    let stops = if done && options.integer && embedded.is_none() {
        let (counts, off) = integer_grid_counts(&layout, &maps, edge);
        tracing::debug!(off, "patches of whole quads");
        Spacing::even(&layout, &counts)
    } else {
        let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
        let number = match options.size {
            QuadSize::EdgeLength(_) => area / (edge * edge),
            QuadSize::Count(n) => f64::from(n),
        };
        let bend = |base: u32, along| second_fundamental_form(&before.bending[base as usize], along, along).abs();
        let stops = Spacing::curvature_adapted(&layout, &maps, bend, number);
        adaptive_spacing(stops, (&layout, &embedding, &maps), surface.mesh, progress)?
    };
    let quads = quads(sketch, (&layout, &embedding, &maps), done, &stops, progress)?;
    seconds.insert("refine".to_owned(), start.elapsed().as_secs_f64());
    progress.report("Done", 1.0);
    Ok(Export { layout, embedding, mesh_role: *mesh_role, maps, quads, optimised, before, seconds })
}

/// Why an optimised embedding is no better than the drawing, if so.
fn no_better(report: &EmbeddingReport, drawn: Option<&Measures>) -> Option<String> {
    let (before, after) = (drawn?.conformal, report.measures.conformal);
    (after >= before)
        .then(|| format!("the optimised map distorts more than the drawing: {after:.2} instead of {before:.2}"))
}

/// The edge length of quads before patches are mapped, on a surface of bounding-box diagonal 1.
fn edge_length(size: QuadSize, sketch: &EmbeddingInput<'_>) -> f64 {
    let mesh = sketch.surface.mesh;
    match size {
        QuadSize::EdgeLength(length) => length / sketch.units.scale,
        QuadSize::Count(n) => (mesh.faces().map(|f| mesh.face_area(f)).sum::<f64>() / f64::from(n.max(1))).sqrt(),
    }
}

impl Export {
    /// Writes `layout.obj`, `quads.obj` and `patches.obj` to `folder`, in file units.
    ///
    /// # Errors
    ///
    /// The file that could not be written.
    pub fn write(&self, folder: &Path, units: &Normalisation) -> Result<(), WeaveError> {
        let in_file = |ps: &[glam::DVec3]| ps.iter().map(|&p| units.to_file(p)).collect::<Vec<_>>();
        let nodes = &self.quads.positions[..self.quads.n_nodes];
        let corners: Vec<[u32; 4]> = self.layout.patches.iter().map(|p| p.corners).collect();
        write_file(&folder.join("layout.obj"), |out| write_obj(out, &in_file(nodes), &corners))?;
        write_file(&folder.join("quads.obj"), |out| {
            write_obj(out, &in_file(&self.quads.positions), &self.quads.quads)
        })?;
        write_file(&folder.join("patches.obj"), |out| self.write_patches(out, units))
    }

    /// The triangle mesh with the map of every patch as texture coordinates and one group per patch.
    fn write_patches(&self, out: &mut impl Write, units: &Normalisation) -> std::io::Result<()> {
        let mut positions = self.embedding.mesh.positions.clone();
        let ids: Vec<Vec<u32>> = self
            .maps
            .iter()
            .map(|map| {
                let inner = map.mesh.positions()[map.whole.len()..].iter();
                let first = positions.len() as u32;
                positions.extend(inner);
                map.whole.iter().copied().chain(first..positions.len() as u32).collect()
            })
            .collect();
        for p in positions {
            let p = units.to_file(p);
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for map in &self.maps {
            for uv in &map.uv {
                let uv = *uv * units.scale;
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
        }
        let mut first_uv = 1;
        for (p, (map, ids)) in self.maps.iter().zip(&ids).enumerate() {
            writeln!(out, "g patch{p}")?;
            for f in map.mesh.faces() {
                let [a, b, c] = map.mesh.face_vertices(f).map(|v| (ids[v.index()] + 1, first_uv + v.0));
                writeln!(out, "f {}/{} {}/{} {}/{}", a.0, a.1, b.0, b.1, c.0, c.1)?;
            }
            first_uv += map.uv.len() as u32;
        }
        Ok(())
    }
}

/// Writes `design.plait` and `report.json`, and of a valid layout the meshes and, unless it is embedded on a proxy,
/// `layout.layout`; the inner result is the layout, or why there is none.
///
/// `embedded` is the optimised embedding, where there is one already; `seconds` are times to note in the report.
///
/// # Errors
///
/// The file that could not be written, or cancelled.
pub fn write_all(
    session: &Session,
    embedded: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    folder: &Path,
    seconds: Times,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Result<Export, WeaveError>, WeaveError> {
    make_folder(folder)?;
    session.design().write(&folder.join("design.plait"))?;
    let result = export_session(session, embedded, options, progress, watch);
    progress.check()?;
    let (model, design) = (session.model(), session.design());
    if let Ok(export) = &result {
        export.write(folder, &model.loaded.units)?;
    }
    // A layout file is about the mesh of the design.
    if let Ok(export) = &result
        && export.mesh_role == MeshRole::Design
    {
        let initial_embedding = &export.before.initial_embedding;
        let (layout, embedding) = (export.layout.clone(), initial_embedding.clone());
        let pinned = InitialLayout { layout, embedding, mesh_role: export.mesh_role }.pinned(&design.pins);
        let mesh = &model.loaded.mesh;
        let mut file = LayoutFile::from_embedding(design.mesh.clone(), mesh, &export.layout, initial_embedding)?;
        file.nodes.iter_mut().zip(pinned.nodes).for_each(|(node, pinned)| node.fixed = pinned);
        file.arcs.iter_mut().zip(pinned.arcs).for_each(|(arc, pinned)| arc.fixed = pinned);
        file.write(&folder.join("layout.layout"))?;
    }
    write_report(folder, Subject::Session(session), &result, seconds, &model.loaded.mesh)?;
    Ok(result)
}

pub(in crate::weave) fn make_folder(folder: &Path) -> Result<(), WeaveError> {
    std::fs::create_dir_all(folder).map_err(|source| WeaveError::Write { path: folder.to_owned(), source })
}

pub(in crate::weave) fn write_file(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> Result<(), WeaveError> {
    let open = std::fs::File::create(path).map(std::io::BufWriter::new);
    open.and_then(|mut out| {
        write(&mut out)?;
        out.flush()
    })
    .map_err(|source| WeaveError::Write { path: path.to_owned(), source })
}
