//! An engine with a layout whose optimisation runs until it is stopped, for tests of the window alone.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;
use plait_app::engine::{
    BuiltIn, Detail, DisplaySurface, EmbeddingStep, EmbeddingSummary, Engine, EngineError, ExportOptions, ExportReport,
    LayoutArc, LayoutNode, LayoutPart, LayoutPreview, Opener, Proposal, Scene, Search, Source, Strip, StripId,
};
use plait_core::mesh::{TriMesh, builtin};
use plait_core::progress::Progress;
use plait_core::surface::{SurfaceCurve, SurfaceIndex};
use plait_core::weave::{FaceDistortion, Fit, Improvement};

/// Opens a rounded cube, whatever is asked for. With one strip it has a layout; every strip is the same.
pub struct StandIn;

struct Session {
    mesh: Arc<TriMesh>,
    index: Arc<SurfaceIndex>,
    surface: Arc<DisplaySurface>,
    strips: u32,
    layout: LayoutPreview,
    embedding: Option<Arc<EmbeddingSummary>>,
}

impl Opener for StandIn {
    fn built_ins(&self) -> Vec<BuiltIn> {
        Vec::new()
    }

    fn open(&self, _: &Source, _: &Progress) -> Result<Box<dyn Engine>, EngineError> {
        let mesh = builtin("rounded-cube").unwrap().mesh;
        let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
        let surface = DisplaySurface {
            positions: Arc::new(mesh.positions().to_vec()),
            normals: Arc::new(faces.iter().map(|f| f.map(|v| mesh.positions()[v as usize])).collect()),
            base: Arc::new((0..faces.len() as u32).collect()),
            faces: Arc::new(faces),
            ..DisplaySurface::default()
        };
        let index = SurfaceIndex::new(&mesh);
        let height = |x, y| index.nearest(DVec3::new(x, y, 1.0)).position(&mesh).z;
        let on_surface = |x: f64, y: f64| DVec3::new(x, y, height(x, y));
        let node = |at: DVec3| LayoutNode { position: at, valence: 3, irregular: true, pinned: false };
        let along = (0..=20).map(|i| on_surface(-0.1 + 0.01 * f64::from(i), 0.0)).collect();
        let layout = LayoutPreview {
            nodes: vec![node(on_surface(-0.1, 0.0)), node(on_surface(0.1, 0.0))],
            arcs: vec![LayoutArc { points: along, ..LayoutArc::default() }],
        };
        let (index, surface) = (Arc::new(index), Arc::new(surface));
        Ok(Box::new(Session { mesh, index, surface, strips: 0, layout, embedding: None }))
    }
}

impl Session {
    fn change(&mut self, strips: u32) {
        self.strips = strips;
        self.embedding = None;
    }
}

/// The x coordinate of the first node after `step` steps.
pub fn moved(step: usize) -> f64 {
    -0.1 + 0.002 * step.min(20) as f64
}

impl Engine for Session {
    fn proposals(
        &mut self,
        _: &Search,
        _: &mut dyn FnMut(Proposal),
        _: &Progress,
    ) -> Result<Vec<Proposal>, EngineError> {
        Ok(vec![self.suggest(&Progress::new())?])
    }
    fn place(&mut self, _: &Proposal, _: Option<StripId>, _: &Progress) -> Result<StripId, EngineError> {
        self.change(self.strips + 1);
        Ok(StripId(self.strips))
    }
    fn remove(&mut self, _: StripId, _: &Progress) -> Result<(), EngineError> {
        self.change(self.strips - 1);
        Ok(())
    }
    fn undo(&mut self, _: &Progress) -> Result<(), EngineError> {
        self.change(self.strips.saturating_sub(1));
        Ok(())
    }
    fn redo(&mut self, _: &Progress) -> Result<(), EngineError> {
        Ok(())
    }
    fn set_visible(&mut self, _: StripId, _: bool) -> Result<(), EngineError> {
        Ok(())
    }
    fn suggest(&mut self, _: &Progress) -> Result<Proposal, EngineError> {
        let curve = SurfaceCurve { crossings: Vec::new(), closed: true };
        Ok(Proposal {
            curve,
            energy: None,
            cost: 1.0,
            polyline: vec![DVec3::new(0.0, 0.3, 0.3); 2],
            anchors: Vec::new(),
        })
    }
    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError> {
        let fit = |patches| Fit { patches, alignment: 0.5 * patches as f64, ..Fit::default() };
        let before = self.strips;
        let mut improvement = Improvement { before: fit(20), after: fit(20), changes: 0 };
        while improvement.changes < 9 {
            if let Err(cancelled) = progress.check() {
                self.strips = before;
                return Err(cancelled.into());
            }
            improvement.changes += 1;
            improvement.after = fit(20 - improvement.changes);
            self.change(self.strips + 1);
            if watch(self.scene(), improvement).is_break() {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(improvement)
    }
    fn set_detail(&mut self, _: Detail, _: &Progress) -> Result<(), EngineError> {
        Ok(())
    }
    fn set_pinned(&mut self, part: LayoutPart, pinned: bool) -> Result<(), EngineError> {
        match part {
            LayoutPart::Node(i) => self.layout.nodes[i].pinned = pinned,
            LayoutPart::Arc(i) => self.layout.arcs[i].pinned = pinned,
        }
        Ok(())
    }
    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError> {
        let mut layout = self.layout.clone();
        for step in 0.. {
            progress.check()?;
            progress.report("Moving nodes", 0.5);
            layout.nodes[0].position.x = moved(step);
            let energy = 1.0 / (1.0 + step as f64);
            if watch(EmbeddingStep { step, energy, flipped: 3, layout: layout.clone() }).is_break() {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        self.layout = layout;
        let good = FaceDistortion { conformal: 2.0, deviation: 5.0, anisotropy: 1.0, flipped: false };
        let bad = FaceDistortion { conformal: 9.0, deviation: 44.0, anisotropy: 1.0, flipped: false };
        let triangles = (0..self.mesh.n_faces()).map(|f| if f % 2 == 0 { good } else { bad }).collect();
        let summary = EmbeddingSummary {
            energy: [0.5, 0.25],
            flipped: [3, 0],
            conformal: 2.125,
            alignment: 7.5,
            aspect: (3.0, DVec3::X),
            triangles,
            ..EmbeddingSummary::default()
        };
        self.embedding = Some(Arc::new(summary));
        Ok(())
    }
    fn scene(&self) -> Arc<Scene> {
        let valid = self.strips > 0;
        let strip = |i| Strip {
            id: StripId(i),
            polyline: Vec::new(),
            closed: true,
            length: 1.0,
            cost: 1.0,
            visible: true,
            anchors: Vec::new(),
        };
        Arc::new(Scene {
            model: Arc::default(),
            design_mesh: Arc::clone(&self.mesh),
            index: Arc::clone(&self.index),
            surface: Arc::clone(&self.surface),
            strips: (0..self.strips).map(strip).collect(),
            remarks: Vec::new(),
            summary: String::new(),
            exportable: valid,
            layout: valid.then(|| Arc::new(self.layout.clone())),
            embedding: self.embedding.clone(),
            detail: Detail::default(),
            can_undo: valid,
            can_redo: false,
        })
    }
    fn complete(&mut self, _: &Progress) -> Result<bool, EngineError> {
        Ok(false)
    }
    fn save(&self, _: &Path) -> Result<(), EngineError> {
        Ok(())
    }
    fn export(&mut self, _: &Path, _: &ExportOptions, _: &Progress) -> Result<ExportReport, EngineError> {
        Ok(ExportReport::default())
    }
}
