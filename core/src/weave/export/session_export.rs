//! The export of a session: its layout, embedded, refined and written.

use std::path::Path;

use crate::embed::{Next, OptimisedEmbedding, arc_headings};
use crate::layout::LayoutFile;
use crate::progress::Progress;
use crate::weave::embedding::{InitialLayout, initial_layout};
use crate::weave::error::WeaveError;
use crate::weave::export::files::prepare_folder;
use crate::weave::export::input::{EmbeddingInput, ExportOptions, Watch};
use crate::weave::export::refine::embed_and_refine;
use crate::weave::export::report::{Subject, write_report};
use crate::weave::export::result::{Export, Times};
use crate::weave::mesh_role::MeshRole;
use crate::weave::session::Session;

/// The layout of a session, embedded and refined to quads.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions; see also [`embed_and_refine`].
pub fn export(session: &Session, options: &ExportOptions, progress: &Progress) -> Result<Export, WeaveError> {
    export_session(session, None, options, progress, &mut |_| Next::Continue)
}

fn export_session(
    session: &Session,
    optimised: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    export_layout(session, &initial_layout(session, progress)?, optimised, options, progress, watch)
}

/// A layout of a session, embedded and refined to quads.
pub(in crate::weave) fn export_layout(
    session: &Session,
    initial: &InitialLayout,
    optimised: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Export, WeaveError> {
    let model = session.model();
    let input = EmbeddingInput {
        surface: model.surface(initial.mesh_role),
        proxy: model.proxy.as_ref().map(|p| (p, &*model.loaded.mesh)).filter(|_| initial.mesh_role == MeshRole::Proxy),
        units: model.loaded.units,
        arc_headings: &arc_headings(&initial.layout),
        pinned: &initial.pinned(&session.design().pins),
        initial,
    };
    embed_and_refine(&input, optimised, options, progress, watch)
}

/// Writes `design.plait` and `report.json`, and for a valid layout its meshes and, unless it is embedded on a proxy,
/// `layout.layout`. The inner result is the exported layout, or the reason why there is none.
///
/// `optimised` is the optimised embedding, if there is one already. `seconds` are added to the durations of the report.
///
/// # Errors
///
/// [`WeaveError::Write`] or another error of writing, or when cancelled.
pub fn write_all(
    session: &Session,
    optimised: Option<&OptimisedEmbedding>,
    options: &ExportOptions,
    folder: &Path,
    seconds: Times,
    progress: &Progress,
    watch: Watch<'_>,
) -> Result<Result<Export, WeaveError>, WeaveError> {
    prepare_folder(folder, &session.design().mesh)?;
    session.design().write(&folder.join("design.plait"))?;
    let result = export_session(session, optimised, options, progress, watch);
    progress.check()?;
    let model = session.model();
    if let Ok(export) = &result {
        export.write(folder, &model.loaded.units)?;
        // A layout file describes a layout on the design mesh.
        if export.mesh_role == MeshRole::Design {
            layout_file(session, export)?.write(&folder.join("layout.layout"))?;
        }
    }
    write_report(folder, Subject::Session(session), &result, seconds, &model.loaded.mesh)?;
    Ok(result)
}

/// The layout file of an export on the design mesh; pinned parts are fixed in it.
fn layout_file(session: &Session, export: &Export) -> Result<LayoutFile, WeaveError> {
    let design = session.design();
    let embedding = &export.initial.initial_embedding;
    let initial =
        InitialLayout { layout: export.layout.clone(), embedding: embedding.clone(), mesh_role: export.mesh_role };
    let pinned = initial.pinned(&design.pins);
    let mesh = &session.model().loaded.mesh;
    let mut file = LayoutFile::from_embedding(design.mesh.clone(), mesh, &export.layout, embedding)?;
    file.normalised_by = design.options.normalised_by;
    file.nodes.iter_mut().zip(pinned.nodes).for_each(|(node, pinned)| node.fixed = pinned);
    file.arcs.iter_mut().zip(pinned.arcs).for_each(|(arc, pinned)| arc.fixed = pinned);
    Ok(file)
}
