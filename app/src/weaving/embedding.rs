//! The layout on the surface for the window: its first drawing, its optimisation, and what that achieved.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;
use plait_core::embed::{
    EmbeddingError, FeatureEdges, Next, OptimisedEmbedding, PatchMeasures, Snapshot, TriangleMeasure, measure_patches,
};
use plait_core::layout::{Embedding, Node, PatchMap, QuadLayout};
use plait_core::mesh::TriMesh;
use plait_core::progress::Progress;
use plait_core::surface::SurfaceIndex;
use plait_core::surface::face_curvature;
use plait_core::weave::{self, InitialLayout, MeshRole, PinnedParts, Session, WeaveError};

use super::cover;
use crate::engine::{
    EmbeddingStep, EmbeddingSummary, EngineError, LayoutArc, LayoutNode, LayoutPreview, RegionColour, Remark,
    TriangleDistortion,
};

/// Difference of the principal curvatures, as a fraction of its root mean square over the surface, from which on
/// principal directions count as fully pronounced.
const PRONOUNCED: f64 = 0.5;

/// Arcs of the first drawing bend where they cross strips; for show they are divided into so many parts,
const FAIRED_PARTS: usize = 48;
/// each point is drawn to its neighbours so often that kinks spread over a quarter of the arc,
const FAIRING_ROUNDS: usize = 120;
/// and put back on the surface whenever so many rounds have led it off.
const ROUNDS_OFF_SURFACE: usize = 15;

/// The first drawing of a layout, and how it is shown.
pub struct Shown {
    pub drawn: InitialLayout,
    pub preview: LayoutPreview,
}

/// An optimised embedding, and how it is shown.
pub struct Optimised {
    pub embedded: OptimisedEmbedding,
    pub preview: LayoutPreview,
    pub summary: Arc<EmbeddingSummary>,
}

impl Shown {
    /// Draws the layout of a session.
    pub fn new(session: &Session, progress: &Progress) -> Result<Self, WeaveError> {
        let drawn = weave::initial_layout(session, progress)?;
        let (nodes, arcs) = drawing(&drawn.embedding);
        let model = session.model();
        let on_surface = |p| model.index.nearest(p).position(&model.loaded.mesh);
        // Along the boundary arcs already are as they will be.
        let boundary = |i: usize| drawn.layout.arcs[i].boundary;
        let arcs = arcs.into_iter().enumerate();
        let arcs = arcs.map(|(i, arc)| if boundary(i) { arc } else { faired(&arc, on_surface) });
        Ok(Self { preview: preview(&drawn.layout, &nodes, arcs), drawn })
    }
}

/// A line without the kinks of the first drawing, from the same start to the same end.
fn faired(line: &[DVec3], on_surface: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    let mut points = divided(line, FAIRED_PARTS);
    for round in 1..=FAIRING_ROUNDS {
        let before = points.clone();
        for (p, around) in points[1..].iter_mut().zip(before.windows(3)) {
            *p = 0.25 * (around[0] + 2.0 * around[1] + around[2]);
        }
        if round % ROUNDS_OFF_SURFACE == 0 {
            let inner = points.len().saturating_sub(1);
            points[1..inner].iter_mut().for_each(|p| *p = on_surface(*p));
        }
    }
    points
}

/// Points at equal distances along a line, with both ends.
fn divided(line: &[DVec3], parts: usize) -> Vec<DVec3> {
    let length: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
    let mut points = Vec::with_capacity(parts + 1);
    let mut passed = 0.0;
    for w in line.windows(2) {
        let step = w[0].distance(w[1]);
        while points.len() < parts && length * points.len() as f64 / parts as f64 <= passed + step {
            let t = (length * points.len() as f64 / parts as f64 - passed) / step.max(f64::MIN_POSITIVE);
            points.push(w[0].lerp(w[1], t.clamp(0.0, 1.0)));
        }
        passed += step;
    }
    points.extend(line.last());
    points
}

fn preview(layout: &QuadLayout, nodes: &[DVec3], arcs: impl Iterator<Item = Vec<DVec3>>) -> LayoutPreview {
    let node = |(node, &position): (&Node, &DVec3)| LayoutNode {
        position,
        valence: node.valence as u32,
        irregular: !node.is_regular(),
        pinned: false,
    };
    LayoutPreview {
        arcs: arcs.map(|points| LayoutArc { points, ..LayoutArc::default() }).collect(),
        nodes: layout.nodes.iter().zip(nodes).map(node).collect(),
    }
}

/// A preview with the parts marked that are pinned.
pub fn with_pins(preview: &LayoutPreview, pinned: &PinnedParts) -> LayoutPreview {
    let mut preview = preview.clone();
    for (node, &pinned) in preview.nodes.iter_mut().zip(&pinned.nodes) {
        node.pinned = pinned;
    }
    for (arc, &pinned) in preview.arcs.iter_mut().zip(&pinned.arcs) {
        arc.pinned = pinned;
    }
    preview
}

/// Optimises the embedding, from that of last time on where there is one.
pub fn optimise(
    session: &Session,
    shown: &Shown,
    last: Option<&Optimised>,
    watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
    progress: &Progress,
) -> Result<Optimised, EngineError> {
    let pinned = shown.drawn.pinned(&session.design().pins);
    let start = last.map_or(&shown.preview, |l| &l.preview);
    let layout = with_pins(start, &pinned);
    let mut from = |drawn: &InitialLayout| {
        let model = session.model();
        let ends = drawn.layout.arcs.iter().map(|a| a.nodes).collect();
        let layout = layout.clone();
        let mut steps = Steps { index: &model.index, mesh: &model.loaded.mesh, ends, layout };
        let mut relay = |snapshot: &Snapshot| match watch(steps.next(snapshot)) {
            ControlFlow::Continue(()) => Next::Continue,
            ControlFlow::Break(()) => Next::Finish,
        };
        weave::optimise(session, drawn, &pinned, progress, &mut relay).map_err(|error| failed(&error, progress))
    };
    let again = last.map(|l| InitialLayout {
        layout: shown.drawn.layout.clone(),
        embedding: l.embedded.embedding.clone(),
        mesh_role: shown.drawn.mesh_role,
    });
    let embedded = match again.as_ref().map(&mut from) {
        // Pinned parts are to stay where they are now, not where the first drawing had them.
        Some(Ok(embedded)) => embedded,
        Some(Err(EngineError::Cancelled)) => return Err(EngineError::Cancelled),
        Some(Err(error)) => {
            tracing::debug!(%error, "the optimisation starts again from the first drawing");
            from(&shown.drawn)?
        }
        None => from(&shown.drawn)?,
    };
    Ok(finished(session, &shown.drawn, embedded))
}

fn failed(error: &EmbeddingError, progress: &Progress) -> EngineError {
    if progress.is_cancelled() { EngineError::Cancelled } else { EngineError::failed(error.to_string()) }
}

/// The layout as it was shown last.
struct Steps<'a> {
    index: &'a SurfaceIndex,
    mesh: &'a TriMesh,
    /// The nodes at the ends of each arc.
    ends: Vec<[u32; 2]>,
    layout: LayoutPreview,
}

impl Steps<'_> {
    fn next(&mut self, snapshot: &Snapshot) -> EmbeddingStep {
        for (node, &position) in self.layout.nodes.iter_mut().zip(&snapshot.nodes) {
            node.position = position;
        }
        for (i, arc) in self.layout.arcs.iter_mut().enumerate() {
            match snapshot.arcs.get(i).and_then(Option::as_ref) {
                Some(points) => arc.points.clone_from(points),
                None => {
                    let ends = self.ends[i].map(|n| snapshot.nodes[n as usize]);
                    drag(&mut arc.points, ends, |p| self.index.nearest(p).position(self.mesh));
                }
            }
            arc.sketched = snapshot.arcs.get(i).is_none_or(Option::is_none);
        }
        EmbeddingStep {
            step: snapshot.step,
            energy: snapshot.energy,
            flipped: snapshot.flipped,
            layout: self.layout.clone(),
        }
    }
}

/// Moves a line with its ends, in between by as much as its length is divided, and puts it back on the surface.
fn drag(points: &mut [DVec3], ends: [DVec3; 2], on_surface: impl Fn(DVec3) -> DVec3) {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return };
    let moves = [ends[0] - first, ends[1] - last];
    if moves == [DVec3::ZERO; 2] {
        return;
    }
    let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
    let (mut along, mut before, n) = (0.0, first, points.len());
    for (k, p) in points.iter_mut().enumerate() {
        along += p.distance(before);
        before = *p;
        let moved = *p + moves[0].lerp(moves[1], if length > 0.0 { along / length } else { 0.0 });
        *p = if k == 0 || k == n - 1 { moved } else { on_surface(moved) };
    }
}

fn finished(session: &Session, drawn: &InitialLayout, embedded: OptimisedEmbedding) -> Optimised {
    let model = session.model();
    let surface = model.surface(drawn.mesh_role);
    let bending = face_curvature(surface.mesh, surface.curvature, |_| true);
    let (_, patches, triangles) = measure_patches(&embedded.maps, &bending);
    let report = &embedded.report;
    let mut distortion = on_surface(surface.mesh.n_faces(), &embedded.maps, &triangles);
    if drawn.mesh_role == MeshRole::Proxy {
        distortion = cover::faces(model).iter().map(|p| distortion[p.face.index()]).collect();
    }
    let summary = EmbeddingSummary {
        steps: report.steps,
        energy: [report.energy_before, report.energy_after],
        flipped: [report.flipped_before, report.remaining_flips.len()],
        conformal: report.measures.conformal,
        alignment: report.measures.alignment,
        planar: report.measures.planar,
        aspect: most_oblong(&embedded.maps, &patches),
        features: features(&report.features),
        folds: folds(report.remaining_flips.iter().map(|f| (f.reason.as_str(), DVec3::from_array(f.at)))),
        triangles: distortion,
    };
    let (nodes, arcs) = drawing(&embedded.embedding);
    Optimised { preview: preview(&drawn.layout, &nodes, arcs.into_iter()), summary: Arc::new(summary), embedded }
}

fn drawing(embedding: &Embedding) -> (Vec<DVec3>, Vec<Vec<DVec3>>) {
    let position = |&v: &u32| embedding.mesh.positions[v as usize];
    let arcs = embedding.arcs.iter().map(|a| a.iter().map(position).collect());
    (embedding.nodes.iter().map(position).collect(), arcs.collect())
}

/// The aspect of the most oblong patch, and the triangle corner in its middle.
fn most_oblong(maps: &[PatchMap], patches: &[PatchMeasures]) -> (f64, DVec3) {
    let worst = (0..patches.len()).max_by(|&i, &j| patches[i].aspect.total_cmp(&patches[j].aspect));
    let Some(worst) = worst else { return (1.0, DVec3::ZERO) };
    let (map, aspect) = (&maps[worst], patches[worst].aspect);
    let from_middle = |v: usize| map.uv[v].distance_squared(0.5 * map.size);
    let middle = (0..map.uv.len()).min_by(|&a, &b| from_middle(a).total_cmp(&from_middle(b)));
    (aspect, middle.map_or(DVec3::ZERO, |v| map.mesh.positions()[v]))
}

/// Sharp edges on isolines, in all, and the middle of the first that is not on one.
fn features(edges: &FeatureEdges) -> (usize, usize, Option<DVec3>) {
    let middle = |ends: &[[f64; 3]; 2]| ends.iter().map(|&p| DVec3::from_array(p)).sum::<DVec3>() / 2.0;
    (edges.on_isolines, edges.total, edges.off_isolines.first().map(middle))
}

/// One remark for each reason, with the first place.
fn folds<'a>(all: impl Iterator<Item = (&'a str, DVec3)>) -> Vec<Remark> {
    let mut groups: Vec<(&str, usize, DVec3)> = Vec::new();
    for (reason, place) in all {
        match groups.iter_mut().find(|g| g.0 == reason) {
            Some(group) => group.1 += 1,
            None => groups.push((reason, 1, place)),
        }
    }
    let remark = |(reason, n, place): (&str, usize, DVec3)| {
        let triangles = if n == 1 { "triangle is" } else { "triangles are" };
        Remark { color: RegionColour::Red, text: format!("{n} {triangles} folded: {reason}"), place: Some(place) }
    };
    groups.into_iter().map(remark).collect()
}

/// The means over the parts of each triangle of the surface, weighted by area.
fn on_surface(n_faces: usize, maps: &[PatchMap], triangles: &[Vec<TriangleMeasure>]) -> Vec<TriangleDistortion> {
    let none = TriangleDistortion { conformal: 0.0, deviation: 0.0, anisotropy: 0.0, flipped: false };
    let mut sums = vec![(0.0, none); n_faces];
    let (mut total, mut square) = (0.0, 0.0);
    for (map, measures) in maps.iter().zip(triangles) {
        for (&base, m) in map.base_face.iter().zip(measures) {
            let (area, sum) = &mut sums[base as usize];
            *area += m.area;
            sum.conformal += m.area * m.conformal;
            sum.deviation += m.area * m.deviation;
            // The measure is the square of the difference of curvatures.
            sum.anisotropy += m.area * m.anisotropy.sqrt();
            sum.flipped |= m.flipped;
            total += m.area;
            square += m.area * m.anisotropy;
        }
    }
    let full = PRONOUNCED * (square / f64::max(total, f64::MIN_POSITIVE)).sqrt();
    let mean = |(area, sum): (f64, TriangleDistortion)| {
        let over = |x: f64| if area > 0.0 { x / area } else { 0.0 };
        TriangleDistortion {
            conformal: over(sum.conformal).max(2.0),
            deviation: over(sum.deviation),
            anisotropy: if full > 0.0 { (over(sum.anisotropy) / full).min(1.0) } else { 0.0 },
            flipped: sum.flipped,
        }
    };
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    #[test]
    fn triangles_of_the_surface_take_the_mean_of_their_parts() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, 0.0)];
        let mesh = TriMesh::from_faces(points.to_vec(), &[[0, 1, 3], [0, 3, 2]]).unwrap();
        let map = PatchMap {
            whole: vec![0, 1, 2, 3],
            base_face: vec![1, 1],
            uv: points.iter().map(|p| DVec2::new(p.x, p.y)).collect(),
            size: DVec2::ONE,
            flipped: 0,
            mesh,
        };
        let part = |area, conformal, flipped| TriangleMeasure {
            area,
            conformal,
            deviation: 10.0,
            torsion: 0.0,
            anisotropy: 4.0,
            flipped,
        };
        let on = on_surface(2, &[map], &[vec![part(1.0, 2.0, false), part(3.0, 4.0, true)]]);
        assert_eq!(on[1], TriangleDistortion { conformal: 3.5, deviation: 10.0, anisotropy: 1.0, flipped: true });
        assert_eq!((on[0].conformal, on[0].flipped), (2.0, false));
    }

    #[test]
    fn fairing_keeps_the_ends_and_takes_away_kinks() {
        let kinked = [DVec3::ZERO, DVec3::new(1.0, 0.4, 0.0), DVec3::new(2.0, 0.0, 0.0)];
        let line = faired(&kinked, |p| p);
        assert_eq!((line.len(), line[0], line[48]), (49, kinked[0], kinked[2]));
        let turn = |l: &[DVec3]| l.windows(3).map(|w| (w[1] - w[0]).angle_between(w[2] - w[1])).fold(0.0, f64::max);
        assert!(turn(&line) < 0.1 && turn(&kinked) > 0.7, "{}", turn(&line));
    }

    #[test]
    fn a_sketched_arc_keeps_its_ends_at_the_nodes() {
        let mut line: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        drag(&mut line, [DVec3::Y, DVec3::new(4.0, 0.0, 0.0)], |p| p.with_z(7.0));
        assert_eq!((line[0], line[2]), (DVec3::Y, DVec3::new(2.0, 0.5, 7.0)));
        assert_eq!(line[4], DVec3::new(4.0, 0.0, 0.0));
    }

    #[test]
    fn folds_are_counted_by_reason() {
        let all = [("too narrow", DVec3::X), ("fixed", DVec3::Y), ("too narrow", DVec3::Z)];
        let remarks = folds(all.into_iter());
        let texts: Vec<_> = remarks.iter().map(|r| r.text.as_str()).collect();
        assert_eq!(texts, ["2 triangles are folded: too narrow", "1 triangle is folded: fixed"]);
        assert_eq!(remarks[0].place, Some(DVec3::X));
    }
}
