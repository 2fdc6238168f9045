//! From a woven design to files: layout, quad mesh, patch maps, report.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::embedding::{Drawn, draw};
use super::session::{Session, WeaveError};
use crate::dual::Colour;
use crate::embed::Embedded;
use crate::layout::{Embedding, PatchMap, QuadLayout, map_patches};
use crate::mesh::{Normalization, write_obj};
use crate::progress::Progress;
use crate::quad::{QuadMesh, chord_counts, quality, refine, smooth};

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
}

impl Default for ExportOptions {
    fn default() -> Self {
        // Fine enough that the quads follow the surface to well below half a percent of its size.
        Self { size: QuadSize::Count(6000) }
    }
}

/// A finished layout.
#[derive(Debug)]
pub struct Export {
    /// Its structure.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The maps of its patches.
    pub maps: Vec<PatchMap>,
    /// Its refinement.
    pub quads: QuadMesh,
}

/// The layout of a session, embedded and refined.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions.
pub fn export(session: &Session, options: &ExportOptions, progress: &Progress) -> Result<Export, WeaveError> {
    let Drawn { layout, embedding } = draw(session, progress)?;
    progress.report("Mapping patches", 0.4);
    let maps = map_patches(&layout, &embedding, progress)?;
    export_embedded(session, layout, embedding, maps, options, progress)
}

/// The layout of a session as it was embedded before, refined.
///
/// # Errors
///
/// When cancelled.
pub fn export_embedded(
    session: &Session,
    layout: QuadLayout,
    embedding: Embedding,
    maps: Vec<PatchMap>,
    options: &ExportOptions,
    progress: &Progress,
) -> Result<Export, WeaveError> {
    let model = session.model();
    progress.report("Refining to quads", 0.7);
    let target = match options.size {
        QuadSize::EdgeLength(length) => length / model.loaded.units.scale,
        QuadSize::Count(n) => edge_for_count(&maps, n),
    };
    let counts = chord_counts(&layout, &maps, target);
    let mut quads = refine(&layout, &embedding, &maps, &counts);
    smooth(&mut quads, &model.mesh, progress)?;
    progress.report("Done", 1.0);
    Ok(Export { layout, embedding, maps, quads })
}

/// The edge length at which the patches' rectangles hold about `n` quads.
fn edge_for_count(maps: &[PatchMap], n: u32) -> f64 {
    let area: f64 = maps.iter().map(|m| m.size.x * m.size.y).sum();
    (area / f64::from(n.max(1))).sqrt()
}

/// Counts of one colour.
#[derive(Debug, Serialize)]
struct Colours {
    red: usize,
    orange: usize,
    yellow: usize,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    mesh: String,
    faces: usize,
    genus: usize,
    boundary_loops: usize,
    components: usize,
    strips: Vec<StripReport>,
    crossings: usize,
    regions: &'a [crate::dual::RegionReport],
    colours: Colours,
    layout: Option<LayoutReport>,
    problem: Option<String>,
    valid: bool,
    seconds: std::collections::BTreeMap<String, f64>,
}

#[derive(Debug, Serialize)]
struct StripReport {
    id: u32,
    closed: bool,
    length: f64,
    cost: f64,
}

#[derive(Debug, Serialize)]
struct LayoutReport {
    nodes: usize,
    arcs: usize,
    patches: usize,
    chords: usize,
    irregular: usize,
    valences: std::collections::BTreeMap<usize, usize>,
    euler: i64,
    quads: usize,
    folded_quads: usize,
    mean_scaled_jacobian: f64,
    flipped_triangles: usize,
    checks: Checks,
}

/// What was checked of a finished layout.
#[derive(Debug, Serialize)]
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

impl Export {
    /// Writes `layout.obj`, `quads.obj` and `patches.obj` to `folder`, in file units.
    ///
    /// # Errors
    ///
    /// The file that could not be written.
    pub fn write(&self, folder: &Path, units: &Normalization) -> Result<(), WeaveError> {
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
    fn write_patches(&self, out: &mut impl Write, units: &Normalization) -> std::io::Result<()> {
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

/// Writes `design.plait` and `report.json`, and of a valid layout the meshes; returns whether it is valid.
///
/// `embedded` is the layout with its optimised embedding, where there is one; `seconds` are times to note in the report.
///
/// # Errors
///
/// The file that could not be written, or cancelled.
pub fn write_all(
    session: &Session,
    embedded: Option<(&QuadLayout, &Embedded)>,
    options: &ExportOptions,
    folder: &Path,
    seconds: std::collections::BTreeMap<String, f64>,
    progress: &Progress,
) -> Result<Result<Export, WeaveError>, WeaveError> {
    std::fs::create_dir_all(folder).map_err(|source| WeaveError::Write { path: folder.to_owned(), source })?;
    session.design().write(&folder.join("design.plait"))?;
    let result = match embedded {
        Some((layout, e)) => {
            export_embedded(session, layout.clone(), e.embedding.clone(), e.maps.clone(), options, progress)
        }
        None => export(session, options, progress),
    };
    progress.check()?;
    if let Ok(export) = &result {
        export.write(folder, &session.model().loaded.units)?;
    }
    let report = report(session, &result, seconds);
    let text = serde_json::to_string_pretty(&report).unwrap_or_default();
    write_file(&folder.join("report.json"), |out| writeln!(out, "{text}"))?;
    Ok(result)
}

fn report<'a>(
    session: &'a Session,
    result: &Result<Export, WeaveError>,
    seconds: std::collections::BTreeMap<String, f64>,
) -> Report<'a> {
    let (model, woven) = (session.model(), session.woven());
    let scale = model.loaded.units.scale;
    let strip = |s: &super::design::Strip| StripReport {
        id: s.id.0,
        closed: s.curve.closed,
        length: s.curve.length(&model.mesh) * scale,
        cost: s.cost,
    };
    Report {
        mesh: model.loaded.name.clone(),
        faces: model.mesh.n_faces(),
        genus: model.topology.genus,
        boundary_loops: model.topology.boundary_loops.len(),
        components: model.topology.components.len(),
        strips: session.design().strips.iter().map(strip).collect(),
        crossings: woven.arrangement.crossings.len(),
        regions: &woven.reports,
        colours: Colours {
            red: woven.count(Colour::Red),
            orange: woven.count(Colour::Orange),
            yellow: woven.count(Colour::Yellow),
        },
        layout: result.as_ref().ok().map(|e| layout_report(e, model.mesh.euler_characteristic())),
        problem: result.as_ref().err().map(ToString::to_string),
        valid: result.is_ok(),
        seconds,
    }
}

fn layout_report(e: &Export, euler: i64) -> LayoutReport {
    let mut valences = std::collections::BTreeMap::new();
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
        flipped_triangles,
        checks,
    }
}

fn write_file(
    path: &PathBuf,
    write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> Result<(), WeaveError> {
    let open = std::fs::File::create(path).map(std::io::BufWriter::new);
    open.and_then(|mut out| {
        write(&mut out)?;
        out.flush()
    })
    .map_err(|source| WeaveError::Write { path: path.clone(), source })
}
