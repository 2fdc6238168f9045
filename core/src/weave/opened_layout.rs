//! A layout from a layout file, prepared for its embedding.

use std::path::Path;

use crate::embed::{ArcHeadings, Surface};
use crate::layout::LayoutFile;
use crate::mesh::{LoadedMesh, MeshSource, Topology};
use crate::progress::Progress;
use crate::surface::{PrincipalCurvature, SurfaceIndex, principal_curvature};
use crate::weave::embedding::{InitialLayout, PinnedElements};
use crate::weave::error::WeaveError;
use crate::weave::export::files::prepare_folder;
use crate::weave::export::input::{EmbeddingInput, ExportOptions, Watch};
use crate::weave::export::refine::embed_and_refine;
use crate::weave::export::report::{Subject, write_report};
use crate::weave::export::result::{Export, Times};
use crate::weave::mesh_role::MeshRole;
use crate::weave::model::features;
use crate::weave::options::Options;

/// A layout from a file, with its mesh and initial embedding. The layout may lack arcs.
#[derive(Debug)]
pub struct OpenedLayout {
    file: LayoutFile,
    loaded: LoadedMesh,
    topology: Topology,
    index: SurfaceIndex,
    curvature: Vec<PrincipalCurvature>,
    sharp: Vec<bool>,
    initial: InitialLayout,
    arc_headings: Vec<ArcHeadings>,
    pinned: PinnedElements,
}

impl OpenedLayout {
    /// Reads a layout file and its mesh, and embeds the layout on the mesh by the positions in the file.
    ///
    /// # Errors
    ///
    /// When the file or the mesh cannot be read, or the layout does not fit the mesh.
    pub fn read(path: &Path, progress: &Progress) -> Result<Self, WeaveError> {
        progress.report("Reading the layout", 0.0);
        let mut file = LayoutFile::read(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let loaded = file.mesh.load(folder)?.normalised_by(file.normalised_by);
        file.check_mesh(&loaded.mesh)?;
        if let MeshSource::File(mesh) = &mut file.mesh {
            let full = folder.join(&*mesh);
            *mesh = full.canonicalize().unwrap_or(full);
        }
        let initial_embedding = file.partial_embedding(&loaded.mesh)?;
        progress.check()?;
        let (layout, embedding) = initial_embedding.to_embedding()?;
        let mut pinned = PinnedElements {
            nodes: file.nodes.iter().map(|n| n.fixed).collect(),
            arcs: file.arcs.iter().map(|a| a.fixed).collect(),
        };
        // Boundary arcs that are not in the file come after those that are; they are not pinned.
        pinned.arcs.resize(layout.arcs.len(), false);
        let options = Options::default();
        let sharp = features(&loaded.mesh, &options);
        let index = SurfaceIndex::new(&loaded.mesh);
        progress.report("Measuring curvature", 0.1);
        let curvature = principal_curvature(&loaded.mesh, options.curvature_radius, &sharp);
        progress.check()?;
        let (topology, arc_headings) = (Topology::new(&loaded.mesh), initial_embedding.arc_headings());
        let initial = InitialLayout { layout, embedding, mesh_role: MeshRole::Design };
        Ok(Self { file, loaded, topology, index, curvature, sharp, initial, arc_headings, pinned })
    }

    /// The mesh.
    pub fn mesh(&self) -> &LoadedMesh {
        &self.loaded
    }

    /// Pins further nodes and arcs; those that are fixed in the file are pinned already.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoElement`] if there is no such node or arc.
    pub fn pin(&mut self, nodes: &[usize], arcs: &[usize]) -> Result<(), WeaveError> {
        self.pinned.pin(nodes, arcs)?;
        self.file.nodes.iter_mut().zip(&self.pinned.nodes).for_each(|(node, &pinned)| node.fixed = pinned);
        self.file.arcs.iter_mut().zip(&self.pinned.arcs).for_each(|(arc, &pinned)| arc.fixed = pinned);
        Ok(())
    }

    /// Embeds the layout and writes `layout.layout` (the layout as it was given, without collapsed chords), the meshes and
    /// `report.json`. The inner result is the exported layout, or the reason why there is none.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Write`] or another error of writing, or when cancelled.
    pub fn write_all(
        &self,
        options: &ExportOptions,
        folder: &Path,
        seconds: Times,
        progress: &Progress,
        watch: Watch<'_>,
    ) -> Result<Result<Export, WeaveError>, WeaveError> {
        prepare_folder(folder, &self.file.mesh)?;
        let mesh = &*self.loaded.mesh;
        let input = EmbeddingInput {
            surface: Surface { mesh, index: &self.index, curvature: &self.curvature, sharp: &self.sharp },
            proxy: None,
            units: self.loaded.units,
            initial: &self.initial,
            arc_headings: &self.arc_headings,
            pinned: &self.pinned,
        };
        let result = embed_and_refine(&input, None, options, progress, watch);
        progress.check()?;
        let mut file = self.file.clone();
        if let Ok(export) = &result {
            export.write(folder, &self.loaded.units)?;
            if export.has_collapsed() {
                let (by, embedding) = (file.normalised_by, &export.initial.initial_embedding);
                file = LayoutFile::from_embedding(file.mesh, mesh, &export.layout, embedding)?;
                file.normalised_by = by;
            }
        }
        file.write(&folder.join("layout.layout"))?;
        write_report(folder, Subject::File(&self.loaded, &self.topology), &result, seconds, mesh)?;
        Ok(result)
    }
}
