//! A stand-in engine: reads OBJ and OFF, proposes plane cuts. TO BE DELETED when the real one is plugged in.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use plait_core::mesh::{HalfedgeId, TriMesh};
use plait_core::progress::Progress;
use plait_core::surface::{Crossing, SurfaceCurve, SurfacePoint};

use crate::engine::*;
use crate::shading::corner_normals;

/// Opens [`Demo`] engines.
pub struct DemoOpener;

impl Opener for DemoOpener {
    fn built_ins(&self) -> Vec<BuiltIn> {
        [("Torus", "genus 1"), ("Sphere", "genus 0")].map(|(n, h)| BuiltIn { name: n.into(), hint: h.into() }).to_vec()
    }

    fn open(&self, source: &Source, progress: &Progress) -> Result<Box<dyn Engine>, EngineError> {
        let (positions, faces) = match source {
            Source::BuiltIn(name) if name == "Torus" => torus(),
            Source::BuiltIn(_) => sphere(),
            Source::File(path) => read(path)?,
        };
        progress.check()?;
        let (positions, scale) = normalise(positions);
        let mesh = TriMesh::from_faces(positions, &faces).map_err(|e| EngineError::failed(e.to_string()))?;
        let normals = corner_normals(mesh.positions(), &faces, 0.8);
        let facts = vec![
            ("Vertices".to_string(), mesh.n_vertices().to_string()),
            ("Triangles".to_string(), mesh.n_faces().to_string()),
            ("Euler characteristic".to_string(), mesh.euler_characteristic().to_string()),
        ];
        let model = Arc::new(ModelFacts { name: source.name(), facts, repairs: vec![] });
        Ok(Box::new(Demo { mesh: Arc::new(mesh), faces, normals, model, scale, done: vec![], undone: vec![], next: 0 }))
    }
}

#[derive(Clone)]
struct Placed {
    id: StripId,
    curve: SurfaceCurve,
    polyline: Vec<DVec3>,
    origin: DVec3,
    normal: DVec3,
    visible: bool,
}

struct Demo {
    mesh: Arc<TriMesh>,
    faces: Vec<[u32; 3]>,
    normals: Vec<[DVec3; 3]>,
    model: Arc<ModelFacts>,
    scale: f64,
    done: Vec<Placed>,
    undone: Vec<Placed>,
    next: u32,
}

impl Demo {
    fn cut(&self, at: SurfacePoint, normal: DVec3) -> Option<SurfaceCurve> {
        let m = &*self.mesh;
        let o = at.position(m);
        let d = |v| {
            let x = (m.position(v) - o).dot(normal);
            if x.abs() < 1e-9 { 1e-9 } else { x }
        };
        let up = |h: HalfedgeId| d(m.origin(h)) < 0.0 && d(m.target(h)) > 0.0;
        let down = |h: HalfedgeId| d(m.origin(h)) > 0.0 && d(m.target(h)) < 0.0;
        let crossing = |h: HalfedgeId| {
            let (a, b) = (d(m.origin(h)), d(m.target(h)));
            Crossing { halfedge: h, t: (a / (a - b)).clamp(1e-6, 1.0 - 1e-6) }
        };
        let start = m.face_halfedges(at.face).into_iter().find(|&h| up(h))?;
        let mut list = vec![crossing(start)];
        let mut h = start;
        loop {
            let Some(t) = m.twin(h) else { break };
            h = m.face_halfedges(m.face(t)).into_iter().find(|&h| up(h))?;
            if h == start {
                return Some(SurfaceCurve { crossings: list, closed: true });
            }
            list.push(crossing(h));
        }
        let mut front = vec![];
        let mut f = at.face;
        loop {
            let back = m.face_halfedges(f).into_iter().find(|&h| down(h))?;
            match m.twin(back) {
                Some(t) => {
                    front.push(crossing(t));
                    f = m.face(t);
                }
                None => {
                    front.push(crossing(back));
                    break;
                }
            }
        }
        front.reverse();
        front.extend(list);
        Some(SurfaceCurve { crossings: front, closed: false })
    }

    fn directions(&self, at: SurfacePoint) -> Vec<DVec3> {
        let n = self.mesh.face_normal(at.face);
        let a = n.any_orthonormal_vector();
        let b = n.cross(a);
        (0..9).map(|i| f64::from(i) * 0.35).map(|t| a * t.cos() + b * t.sin()).collect()
    }
}

impl Engine for Demo {
    fn proposals(&mut self, at: SurfacePoint, progress: &Progress) -> Result<Vec<Proposal>, EngineError> {
        let mut out = vec![];
        for n in self.directions(at) {
            progress.check()?;
            if let Some(curve) = self.cut(at, n) {
                let polyline = curve.points(&self.mesh);
                out.push(Proposal { cost: curve.length(&self.mesh), curve, polyline });
            }
        }
        out.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(out)
    }

    fn place(&mut self, p: &Proposal, progress: &Progress) -> Result<StripId, EngineError> {
        if let Ok(s) = std::env::var("PLAIT_DEMO_DELAY") {
            let n: u32 = s.parse().unwrap_or(0);
            for i in 0..n {
                progress.check()?;
                progress.report("Solving the strip map", f64::from(i) / f64::from(n));
                std::thread::sleep(std::time::Duration::from_millis(100));
            }
        }
        let origin = p.polyline[0];
        let k = p.polyline.len();
        let normal = (p.polyline[k / 3] - origin).cross(p.polyline[2 * k / 3] - origin).normalize_or_zero();
        let id = StripId(self.next);
        self.next += 1;
        let (curve, polyline) = (p.curve.clone(), p.polyline.clone());
        self.done.push(Placed { id, curve, polyline, origin, normal, visible: true });
        self.undone.clear();
        Ok(id)
    }

    fn remove(&mut self, strip: StripId, _: &Progress) -> Result<(), EngineError> {
        self.done.retain(|s| s.id != strip);
        Ok(())
    }

    fn undo(&mut self, _: &Progress) -> Result<(), EngineError> {
        self.undone.extend(self.done.pop());
        Ok(())
    }

    fn redo(&mut self, _: &Progress) -> Result<(), EngineError> {
        self.done.extend(self.undone.pop());
        Ok(())
    }

    fn set_visible(&mut self, strip: StripId, visible: bool) -> Result<(), EngineError> {
        self.done.iter_mut().filter(|s| s.id == strip).for_each(|s| s.visible = visible);
        Ok(())
    }

    fn suggest(&mut self, progress: &Progress) -> Result<Proposal, EngineError> {
        let f = (self.done.len() * 7919 + 13) % self.mesh.n_faces();
        let at = SurfacePoint { face: plait_core::mesh::FaceId::new(f), weights: [1.0 / 3.0; 3] };
        self.proposals(at, progress)?.into_iter().next().ok_or_else(|| EngineError::failed("nothing to suggest"))
    }

    fn scene(&self) -> Arc<Scene> {
        let n = self.faces.len();
        let family = |k: usize| self.done.iter().enumerate().filter(move |(i, s)| s.visible && i % 2 == k).map(|x| x.1);
        let nearest = |p: DVec3, k: usize| {
            family(k).map(|s| (p - s.origin).dot(s.normal)).min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(9.0)
        };
        let mut stripes = Vec::with_capacity(n);
        let mut covered = Vec::with_capacity(n);
        let mut regions = vec![];
        for f in &self.faces {
            let c = f.map(|v| self.mesh.positions()[v as usize]);
            let mid = (c[0] + c[1] + c[2]) / 3.0;
            stripes.push(c.map(|p| [nearest(p, 0) / 0.012, nearest(p, 1) / 0.012]));
            covered.push([nearest(mid, 0).abs() < 0.075, nearest(mid, 1).abs() < 0.075]);
            regions.push(match (self.done.len(), mid.x > 0.0, mid.y > 0.0) {
                (1, _, _) => RegionColor::Red,
                (2, true, _) => RegionColor::Red,
                (2..=3, _, true) => RegionColor::Orange,
                (3, _, _) => RegionColor::Yellow,
                _ => RegionColor::None,
            });
        }
        let display = DisplaySurface {
            positions: self.mesh.positions().to_vec(),
            faces: self.faces.clone(),
            normals: self.normals.clone(),
            regions,
            stripes,
            covered,
        };
        let strips = self.done.iter().map(|s| Strip {
            id: s.id,
            polyline: s.polyline.clone(),
            closed: s.curve.closed,
            length: s.curve.length(&self.mesh) * self.scale,
            visible: s.visible,
        });
        let remains = match self.done.len() {
            0 => vec![(RegionColor::Red, "No strip is placed yet")],
            1 => vec![(RegionColor::Red, "1 region is not a disc")],
            2 => vec![
                (RegionColor::Red, "1 region is not a disc"),
                (RegionColor::Orange, "2 regions have several corners"),
            ],
            3 => vec![
                (RegionColor::Orange, "1 region has several corners"),
                (RegionColor::Yellow, "1 region does not fit its curvature"),
            ],
            _ => vec![],
        };
        let ready = self.done.len() > 3;
        Arc::new(Scene {
            model: Arc::clone(&self.model),
            design_mesh: Arc::clone(&self.mesh),
            surface: Arc::new(display),
            strips: strips.collect(),
            remains: remains
                .into_iter()
                .map(|(color, text)| Remark { color, text: text.into(), place: Some(self.mesh.positions()[0]) })
                .collect(),
            summary: if ready { "Ready to export: 14 patches, 16 nodes (8 irregular)".into() } else { String::new() },
            exportable: ready,
            layout: ready.then(|| {
                let arcs: Vec<_> = self.done.iter().map(|s| s.polyline.clone()).collect();
                let nodes = arcs.iter().enumerate().map(|(i, a)| LayoutNode {
                    position: a[0],
                    valence: 3 + i as u32 % 3,
                    irregular: i % 3 != 1,
                });
                Arc::new(LayoutPreview { nodes: nodes.collect(), arcs })
            }),
            can_undo: !self.done.is_empty(),
            can_redo: !self.undone.is_empty(),
        })
    }

    fn save(&self, path: &Path) -> Result<(), EngineError> {
        std::fs::write(path, "{}\n").map_err(|e| EngineError::failed(format!("cannot write {}: {e}", path.display())))
    }

    fn export(&mut self, folder: &Path, _: &ExportOptions, _: &Progress) -> Result<ExportReport, EngineError> {
        if self.done.len() < 4 {
            let place = Some(self.mesh.positions()[0]);
            return Err(EngineError::Failed { message: "1 region is still red: it is not a disc".into(), place });
        }
        Ok(ExportReport { files: vec![folder.join("layout.obj")], summary: "14 patches, 1 204 quads".into() })
    }
}

fn normalise(mut p: Vec<DVec3>) -> (Vec<DVec3>, f64) {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    p.iter().for_each(|&x| (lo, hi) = (lo.min(x), hi.max(x)));
    let s = (hi - lo).length();
    p.iter_mut().for_each(|x| *x = (*x - (lo + hi) / 2.0) / s);
    (p, s)
}

type Soup = (Vec<DVec3>, Vec<[u32; 3]>);

fn read(path: &Path) -> Result<Soup, EngineError> {
    let fail = |e: String| EngineError::failed(format!("{} cannot be read: {e}", path.display()));
    if path.extension().is_some_and(|e| e == "off") {
        let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
        let mut w = text.split_ascii_whitespace().skip(1).filter_map(|t| t.parse::<f64>().ok());
        let (nv, nf, _) = (w.next().unwrap_or(0.0), w.next().unwrap_or(0.0), w.next());
        let mut num = || w.next().unwrap_or(0.0);
        let p = (0..nv as usize).map(|_| DVec3::new(num(), num(), num())).collect();
        let f =
            (0..nf as usize).map(|_| [num(), num(), num(), num()]).map(|[_, a, b, c]| [a as u32, b as u32, c as u32]);
        return Ok((p, f.collect()));
    }
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options).map_err(|e| fail(e.to_string()))?;
    let mesh = &models.first().ok_or_else(|| fail("it is empty".into()))?.mesh;
    let p = mesh.positions.chunks(3).map(|c| DVec3::new(c[0].into(), c[1].into(), c[2].into())).collect();
    Ok((p, mesh.indices.chunks(3).map(|c| [c[0], c[1], c[2]]).collect()))
}

fn torus() -> Soup {
    let (n, m) = (96u32, 40u32);
    let at = |i: u32, j: u32| {
        let (a, b) =
            (f64::from(i) / f64::from(n) * std::f64::consts::TAU, f64::from(j) / f64::from(m) * std::f64::consts::TAU);
        let r = 1.0 + 0.4 * b.cos();
        DVec3::new(r * a.cos(), 0.4 * b.sin(), -r * a.sin())
    };
    let id = |i: u32, j: u32| (i % n) * m + j % m;
    let p = (0..n * m).map(|k| at(k / m, k % m)).collect();
    let quads = (0..n * m).map(|k| (k / m, k % m));
    let f = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    (p, f.collect())
}

fn sphere() -> Soup {
    let n = 24i32;
    let mut p: Vec<DVec3> = vec![];
    let mut index = std::collections::BTreeMap::new();
    let mut f = vec![];
    for axis in 0..3 {
        for side in [-1i32, 1] {
            let mut id = |i: i32, j: i32| {
                let mut c = [0; 3];
                c[axis] = side * n;
                c[(axis + 1) % 3] = (2 * i - n) * side;
                c[(axis + 2) % 3] = 2 * j - n;
                *index.entry(c).or_insert_with(|| {
                    p.push(DVec3::from(c.map(|x| (f64::from(x) / f64::from(n) * 0.7853981).tan())).normalize());
                    p.len() as u32 - 1
                })
            };
            for i in 0..n {
                for j in 0..n {
                    let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                    f.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    (p, f)
}
