//! A session's layout on the surface: its first drawing, what of it is pinned, and its optimisation.

use glam::DVec3;

use super::design::Pin;
use super::session::{Session, WeaveError};
use crate::dual::RegionReport;
use crate::embed::{Embedded, EmbeddingError, Job, Next, Settings, Snapshot, Surface, headings};
use crate::layout::{Embedding, Part, QuadLayout, embed};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::Progress;

/// A layout and a drawing of it.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its structure.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
}

/// Which nodes and arcs are pinned.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PinnedParts {
    /// One for each node.
    pub nodes: Vec<bool>,
    /// One for each arc.
    pub arcs: Vec<bool>,
}

impl PinnedParts {
    /// Pins these nodes and arcs too.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoPart`] if there is no such node or arc.
    pub fn pin(&mut self, nodes: &[usize], arcs: &[usize]) -> Result<(), WeaveError> {
        for &i in nodes {
            *self.nodes.get_mut(i).ok_or(WeaveError::NoPart(Part::Node(i as u32)))? = true;
        }
        for &i in arcs {
            *self.arcs.get_mut(i).ok_or(WeaveError::NoPart(Part::Arc(i as u32)))? = true;
        }
        Ok(())
    }
}

/// The layout of a session in its first drawing.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions.
pub fn draw(session: &Session, progress: &Progress) -> Result<Drawn, WeaveError> {
    let (model, woven) = (session.model(), session.woven());
    let layout = QuadLayout::dual(&woven.arrangement, &woven.red(), model.mesh.euler_characteristic())?;
    progress.report("Drawing nodes and arcs", 0.1);
    let embedding = embed(&woven.arrangement, &layout, &preferred_nodes(session, &layout), progress)?;
    Ok(Drawn { layout, embedding })
}

/// Where the node of each region is to lie: at its only pronounced corner, or where there is none, at that corner of its
/// features which is curved most in the sense of the node.
fn preferred_nodes(session: &Session, layout: &QuadLayout) -> Vec<Option<VertexId>> {
    let (model, woven) = (session.model(), session.woven());
    let sharp_corner = feature_corners(&model.mesh, &model.sharp);
    let of_features = |r: usize| {
        let sense = 4.0 - layout.nodes[r].valence as f64;
        let curved = |v: &VertexId| sense * model.vertex_curvatures[v.index()];
        let faces = woven.arrangement.regions[r].faces.iter();
        let corners = faces.flat_map(|&f| woven.arrangement.refined.corners(f)).map(VertexId);
        let candidates = corners.filter(|v| sharp_corner.get(v.index()).copied().unwrap_or(false));
        let best = candidates.max_by(|a, b| curved(a).total_cmp(&curved(b)).then(b.cmp(a)));
        best.filter(|v| curved(v) > 0.0)
    };
    let of = |(r, report): (usize, &RegionReport)| match report.corners[..] {
        [(only, _)] => Some(only),
        [] if !layout.nodes[r].boundary => of_features(r),
        _ => None,
    };
    woven.reports.iter().enumerate().map(of).collect()
}

/// Whether three or more sharp edges meet at each vertex.
fn feature_corners(mesh: &TriMesh, sharp: &[bool]) -> Vec<bool> {
    let mut degree = vec![0; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    degree.into_iter().map(|d| d > 2).collect()
}

impl Drawn {
    /// The pin that stands for a node; this must be the first drawing.
    pub fn node_pin(&self, node: usize) -> Option<Pin> {
        self.embedding.nodes.get(node).map(|&v| Pin::Node(self.position(v).to_array()))
    }

    /// The pin that stands for an arc; this must be the first drawing.
    pub fn arc_pin(&self, arc: usize) -> Option<Pin> {
        let middle = |path: &Vec<u32>| path.get(path.len() / 2).map(|&v| Pin::Arc(self.position(v).to_array()));
        self.embedding.arcs.get(arc).and_then(middle)
    }

    /// The nodes and arcs that `pins` stand for: the nearest to each; this must be the first drawing.
    pub fn pinned(&self, pins: &[Pin]) -> PinnedParts {
        let place = |pin: Option<Pin>| match pin {
            Some(Pin::Node(p) | Pin::Arc(p)) => DVec3::from_array(p),
            None => DVec3::INFINITY,
        };
        let nodes: Vec<DVec3> = (0..self.layout.nodes.len()).map(|i| place(self.node_pin(i))).collect();
        let arcs: Vec<DVec3> = (0..self.layout.arcs.len()).map(|i| place(self.arc_pin(i))).collect();
        let mut parts = PinnedParts { nodes: vec![false; nodes.len()], arcs: vec![false; arcs.len()] };
        for pin in pins {
            let (places, pinned) = match pin {
                Pin::Node(_) => (&nodes, &mut parts.nodes),
                Pin::Arc(_) => (&arcs, &mut parts.arcs),
            };
            let distance = |i: usize| places[i].distance_squared(place(Some(*pin)));
            if let Some(i) = (0..places.len()).min_by(|&i, &j| distance(i).total_cmp(&distance(j))) {
                pinned[i] = true;
            }
        }
        parts
    }

    /// The pins that stand for these parts; this must be the first drawing.
    pub fn pins(&self, parts: &PinnedParts) -> Vec<Pin> {
        let set = |list: &[bool]| (0..list.len()).filter(|&i| list[i]).collect::<Vec<_>>();
        let nodes = set(&parts.nodes).into_iter().filter_map(|i| self.node_pin(i));
        let arcs = set(&parts.arcs).into_iter().filter_map(|i| self.arc_pin(i));
        nodes.chain(arcs).collect()
    }

    fn position(&self, v: u32) -> DVec3 {
        self.embedding.mesh.positions[v as usize]
    }
}

/// Optimises the embedding of a session's layout from a drawing of it on.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    session: &Session,
    drawn: &Drawn,
    pinned: &PinnedParts,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<Embedded, EmbeddingError> {
    let model = session.model();
    let surface = Surface { mesh: &model.mesh, index: &model.index, curvature: &model.curvature, sharp: &model.sharp };
    let headings = headings(&drawn.layout);
    let job = Job {
        surface,
        layout: &drawn.layout,
        drawing: &drawn.embedding,
        headings: &headings,
        pinned_nodes: &pinned.nodes,
        pinned_arcs: &pinned.arcs,
        settings: Settings::default(),
    };
    crate::embed::optimise(&job, progress, watch)
}
