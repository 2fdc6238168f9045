//! Tracing the curve on a mesh that follows a guide on the proxy.
//!
//! The vertices of the mesh have positions on the proxy, each with a signed distance from the guide. In a triangle the
//! signs of the corners differ along two edges or none. So the edges with different signs form a strip of triangles,
//! which is traced from triangle to triangle until it closes or reaches the boundary. Distances are taken from the part
//! of the guide near the current parameter, so that the guide may cross itself. The strip stays within an edge of the
//! guide, and the parameter is tracked; it makes exactly one turn, so the curve is homotopic to the guide.

use glam::DVec3;
use thiserror::Error;

use super::guide::{Guide, SignedDistance};
use super::map::Proxy;
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::{Crossing, CurveError, SurfaceCurve, SurfacePoint, nearest_in_triangle};

/// Least distance of crossings from vertices, in edge parameters; the same as for geodesics.
pub(super) const VERTEX_DISTANCE: f64 = 1e-3;
/// Maximum number of segments of the guide from which tracing is tried.
const STARTS: usize = 12;
/// Triangles around a start in which an edge with different signs is searched.
const START_FACES: usize = 200;
/// Crossings after the start at which a closing strip may join itself.
const JOIN: usize = 200;
/// Least and greatest ratio of the lengths of curve and guide: 1/1.6 and 1.6.
const LENGTH_FACTOR: f64 = 1.6;

/// Why a curve cannot be transferred to the other mesh.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CurveTransferError {
    /// The curve does not lie on the mesh that it is transferred from.
    #[error(transparent)]
    Curve(#[from] CurveError),
    /// On the other mesh no strip of triangles along the curve closes, or ends where the curve ends.
    #[error("no strip of triangles follows the curve on the other mesh (mesh or proxy)")]
    NoStrip,
    /// The curve found is much longer or shorter: the original is too rough there.
    #[error("the curve on the other mesh (mesh or proxy) would be {ratio:.1} times as long")]
    Length {
        /// Its length on the other mesh by its length on the first.
        ratio: f64,
    },
}

/// A mesh whose vertices have positions on the proxy, and a guide there.
pub(super) struct CurveWalk<'a> {
    pub mesh: &'a TriMesh,
    /// Position of each vertex of `mesh` on the proxy.
    pub positions: &'a [DVec3],
    pub guide: &'a Guide,
}

/// A vertex with its signed distance from the guide.
type SignedVertex = (VertexId, f64);

impl CurveWalk<'_> {
    /// The curve along the guide; `face_at` maps a point of the proxy to a face of the mesh.
    pub fn trace(
        &self,
        proxy: &Proxy,
        face_at: impl Fn(SurfacePoint) -> FaceId,
    ) -> Result<SurfaceCurve, CurveTransferError> {
        let (mesh, guide) = (self.mesh, self.guide);
        let n = guide.segments.len();
        let t = if guide.closed { 0.5 } else { 0.0 };
        let mut error = CurveTransferError::NoStrip;
        // Where the mesh is rough a trace may fail from one start and succeed from another.
        for i in 0..if guide.closed { STARTS.min(n) } else { 1 } {
            let k = i * n / STARTS.min(n);
            let s = &guide.segments[k];
            let corners = proxy.mesh().face_vertices(s.face).map(|v| proxy.mesh().position(v));
            let on_proxy = SurfacePoint { face: s.face, weights: nearest_in_triangle(s.from.lerp(s.to, t), &corners) };
            let Some(start) = self.start(face_at(on_proxy), k as f64 + t) else { continue };
            match self.trace_from(start, k as f64 + t) {
                Ok(curve) if curve.check(mesh).is_ok() => return Ok(curve),
                Ok(_) => {}
                Err(e) => error = e,
            }
        }
        Err(error)
    }

    /// A half-edge near a face through which the curve leaves a triangle, near the parameter `at` of the guide; for an
    /// open guide the boundary half-edge through which it enters.
    fn start(&self, face: FaceId, at: f64) -> Option<HalfedgeId> {
        let (mesh, guide) = (self.mesh, self.guide);
        let mut search: BreadthFirst<FaceId, HalfedgeId> = BreadthFirst::sparse();
        search.start(face);
        for _ in 0..START_FACES {
            let f = search.visit()?;
            for h in mesh.face_halfedges(f) {
                let ends = [mesh.origin(h), mesh.target(h)].map(|v| self.signed_distance(v, at));
                let crosses = if guide.closed {
                    ends[0].distance < 0.0 && ends[1].distance >= 0.0
                } else {
                    mesh.twin(h).is_none() && ends[0].distance >= 0.0 && ends[1].distance < 0.0
                };
                // Farther away the sign is meaningless, as the guide is considered within its reach only.
                let near = |e: &SignedDistance| e.distance.abs() < guide.reach;
                if crosses && ends.iter().all(near) && ends.iter().any(|e| guide.is_near(at, e.at)) {
                    return Some(h);
                }
            }
            for (h, g) in mesh.adjacent_faces(f) {
                search.reach(g, h);
            }
        }
        None
    }

    fn signed_distance(&self, v: VertexId, at: f64) -> SignedDistance {
        self.guide.signed_distance(self.positions[v.index()], at)
    }

    /// Traces from a half-edge, near the parameter `at` of the guide, until the curve closes or reaches the boundary.
    fn trace_from(&self, mut first: HalfedgeId, at: f64) -> Result<SurfaceCurve, CurveTransferError> {
        let (mesh, guide) = (self.mesh, self.guide);
        let n = guide.segments.len() as f64;
        let mut ends: [SignedVertex; 2] =
            [mesh.origin(first), mesh.target(first)].map(|v| (v, self.signed_distance(v, at).distance));
        let (mut h, mut at, mut advance, mut length) = (first, at, 0.0, 0.0);
        let mut crossings = Vec::new();
        // The advance along the guide at each of the first crossings.
        let mut advances = Vec::new();
        let mut last: Option<DVec3> = None;
        loop {
            let (t, position) = self.zero(ends);
            let now = guide.signed_distance(position, at).at;
            advance += guide.difference(at, now);
            at = now;
            length += last.map_or(0.0, |l| l.distance(position));
            last = Some(position);
            crossings.push(Crossing { halfedge: h, t });
            if advances.len() < JOIN {
                advances.push(advance);
            }
            let entered = if !guide.closed && crossings.len() == 1 { Some(h) } else { mesh.twin(h) };
            let Some(g) = entered else { break };
            (h, ends) = self.next_edge(h, g, ends, at);
            // The last two conditions are safeguards against a strip that leaves the guide.
            if guide.closed && h == first || crossings.len() > mesh.n_edges() || advance.abs() > 1.5 * n + 3.0 {
                break;
            }
            // Where the original is rough, the strip may close at a crossing a little after the start.
            if guide.closed && advance > n - 0.5 {
                let met =
                    crossings.iter().zip(&advances).position(|(c, &at)| c.halfedge == h && advance - at > 0.5 * n);
                if let Some(i) = met {
                    advance -= advances[i];
                    crossings.drain(..i);
                    first = h;
                    break;
                }
            }
        }
        let complete = if guide.closed { h == first } else { mesh.twin(h).is_none() };
        // A complete curve advances by one turn, or the whole guide, up to the size of an edge.
        if !complete || advance < 0.5 * n || advance > 1.5 * n {
            return Err(CurveTransferError::NoStrip);
        }
        let ratio = length / guide.length().max(f64::MIN_POSITIVE);
        if !(1.0 / LENGTH_FACTOR..LENGTH_FACTOR).contains(&ratio) {
            return Err(CurveTransferError::Length { ratio });
        }
        Ok(SurfaceCurve { crossings, closed: guide.closed })
    }

    /// Where the signed distance is 0 on an edge: parameter, kept off the vertices, and position on the proxy.
    fn zero(&self, [a, b]: [SignedVertex; 2]) -> (f64, DVec3) {
        let (p, q) = (self.positions[a.0.index()], self.positions[b.0.index()]);
        let t = (a.1 / (a.1 - b.1)).clamp(VERTEX_DISTANCE, 1.0 - VERTEX_DISTANCE);
        let t = if t.is_nan() { 0.5 } else { t };
        (t, p.lerp(q, t))
    }

    /// The half-edge through which the curve leaves the triangle that it entered through `g`, the twin of `h` (or `h`
    /// itself at the start of an open curve). `ends` are those of `h`, then those of the result.
    fn next_edge(
        &self,
        h: HalfedgeId,
        g: HalfedgeId,
        ends: [SignedVertex; 2],
        at: f64,
    ) -> (HalfedgeId, [SignedVertex; 2]) {
        let mesh = self.mesh;
        // The origin of `g` is to the left of the guide, its target to the right.
        let (left, right) = if g == h { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
        let v = mesh.opposite(g);
        let d = self.signed_distance(v, at).distance;
        if d >= 0.0 { (mesh.next(g), [right, (v, d)]) } else { (mesh.prev(g), [(v, d), left]) }
    }
}
