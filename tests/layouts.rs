//! Woven and constructed layouts on whole surfaces: topology of the field, descent, alignment, collapsed and rounded chords.

mod support;

use std::collections::{BTreeMap, HashMap};
use std::sync::{self, Mutex, OnceLock};

use glam::DVec3;
use plait_core::dual::{Mark, RefinedMesh};
use plait_core::embed::{
    ArcHeadings, EmbeddingError, EmbeddingTopology, Next, OptimisedEmbedding, Optimiser, Problem, Settings, Snapshot,
    Surface, arc_headings, optimise_embedding,
};
use plait_core::field::indices;
use plait_core::layout::{
    Arc, DualCurve, Embedding, Node, Patch, QuadLayout, map_patches, reembed, transfer_embedding,
};
use plait_core::mesh::{HalfedgeId, MeshSource, TriMesh, VertexId};
use plait_core::progress::Progress;
use plait_core::proxy::Proxy;
use plait_core::quad::{Spacing, integer_grid_counts, refine};
use plait_core::surface::{Metric, PrincipalCurvature, SurfaceIndex, SurfacePoint, principal_curvature};
use plait_core::weave::{Goal, InitialLayout, Options, Script, Session, initial_layout, replay};
use support::replay::script;

/// A woven layout.
struct Woven {
    session: Session,
    initial: InitialLayout,
}

/// A weave script replayed, once for all tests; `None` where its mesh is missing.
fn woven(name: &str) -> Option<sync::Arc<Woven>> {
    type Slot = sync::Arc<OnceLock<Option<sync::Arc<Woven>>>>;
    static SLOTS: Mutex<BTreeMap<String, Slot>> = Mutex::new(BTreeMap::new());
    let slot = sync::Arc::clone(SLOTS.lock().unwrap_or_else(|e| e.into_inner()).entry(name.to_owned()).or_default());
    let replay_once = || {
        let path = script(name);
        let script = Script::read(&path).unwrap();
        if let MeshSource::File(file) = MeshSource::from_name(&script.mesh) {
            support::mesh(&file.file_name()?.to_string_lossy())?;
        }
        let session = replay(&script, path.parent().unwrap(), &Progress::new()).unwrap();
        let initial = initial_layout(&session, &Progress::new()).unwrap();
        Some(sync::Arc::new(Woven { session, initial }))
    };
    slot.get_or_init(replay_once).clone()
}

/// The end of an arc: the corner at its node, and the heading of the arc away from the node in that triangle.
fn end(topology: &EmbeddingTopology, arc: u32, second: bool) -> (HalfedgeId, i32) {
    let arc = &topology.arcs[arc as usize];
    if !second {
        return (arc.start, i32::from(arc.heading));
    }
    let turns: i32 = arc.crossed.iter().map(|&h| topology.jump_across(h)).sum();
    (arc.end, i32::from(arc.heading) - turns + 2)
}

#[test]
fn the_field_has_the_topology_of_the_layout() {
    for name in ["cino_3holes", "pretzel", "fertility_13k", "vase_open", "sleeve", "aqua_center"] {
        let Some(woven) = woven(name) else { continue };
        let (session, InitialLayout { layout, embedding, .. }) = (&woven.session, &woven.initial);
        let surface = &session.model().mesh;
        let topology = EmbeddingTopology::new(surface, embedding, layout, &arc_headings(layout)).unwrap();
        // Nodes have the index of their valence, other vertices none.
        let metric = Metric::new(&topology.mesh);
        let found = indices(&topology.mesh, &metric, &topology.angle, &topology.jump);
        let mut wanted = vec![0; topology.mesh.n_vertices()];
        topology.nodes.iter().for_each(|n| wanted[n.vertex.index()] = n.index());
        for v in topology.mesh.vertices().filter(|&v| !topology.mesh.is_boundary_vertex(v)) {
            assert_eq!(found[v.index()], wanted[v.index()], "{name}: {v:?}");
        }
        let sum: i32 = topology.nodes.iter().map(|n| n.index()).sum();
        assert_eq!(i64::from(sum), 4 * surface.euler_characteristic(), "{name}");
        // At every corner of a patch by a quarter from one arc to the next, and along arcs not at all: so along every
        // cycle of arcs, around handles and boundaries, by the sum of its corners.
        for patch in &layout.patches {
            for i in 0..4 {
                let ((out, forward), (into, came)) = (patch.sides[i], patch.sides[(i + 3) % 4]);
                let (mut at, mut heading) = end(&topology, out, !forward);
                let (to, next) = end(&topology, into, came);
                while topology.mesh.face(at) != topology.mesh.face(to) {
                    let across = topology.mesh.prev(at);
                    heading -= topology.jump_across(across);
                    at = topology.mesh.twin(across).unwrap();
                }
                assert_eq!((next - heading).rem_euclid(4), 1, "{name}: arcs {out} and {into}");
            }
        }
    }
}

/// A surface with what an embedding needs of it.
struct Prepared {
    mesh: TriMesh,
    index: SurfaceIndex,
    curvature: Vec<PrincipalCurvature>,
    sharp: Vec<bool>,
}

impl Prepared {
    fn new(mesh: TriMesh) -> Self {
        let sharp = vec![false; mesh.n_edges()];
        let curvature = principal_curvature(&mesh, Options::default().curvature_radius, &sharp);
        Self { index: SurfaceIndex::new(&mesh), curvature, sharp, mesh }
    }

    fn problem<'a>(
        &'a self,
        layout: &'a QuadLayout,
        initial_embedding: &'a Embedding,
        arc_headings: &'a [ArcHeadings],
    ) -> Problem<'a> {
        let Self { mesh, index, curvature, sharp } = self;
        Problem {
            surface: Surface { mesh, index, curvature, sharp },
            layout,
            initial_embedding,
            arc_headings,
            pinned_nodes: &[],
            pinned_arcs: &[],
            settings: Settings::default(),
        }
    }
}

fn problem_of<'a>(session: &'a Session, initial: &'a InitialLayout, arc_headings: &'a [ArcHeadings]) -> Problem<'a> {
    let model = session.model();
    Problem {
        surface: Surface { mesh: &model.mesh, index: &model.index, curvature: &model.curvature, sharp: &model.sharp },
        layout: &initial.layout,
        initial_embedding: &initial.embedding,
        arc_headings,
        pinned_nodes: &[],
        pinned_arcs: &[],
        settings: Settings::default(),
    }
}

/// The same layout with arcs and nodes numbered backward, and patches that begin with their second side.
fn renumbered(InitialLayout { layout, embedding, mesh_role }: &InitialLayout) -> InitialLayout {
    let (a, n) = (layout.arcs.len() as u32 - 1, layout.nodes.len() as u32 - 1);
    let patch = |p: &Patch| Patch {
        corners: [1, 2, 3, 0].map(|i| n - p.corners[i]),
        sides: [1, 2, 3, 0].map(|i| (a - p.sides[i].0, p.sides[i].1)),
    };
    let arc = |arc: &Arc| Arc { nodes: arc.nodes.map(|k| n - k), ..*arc };
    let euler = layout.nodes.len() as i64 - layout.arcs.len() as i64 + layout.patches.len() as i64;
    let nodes = layout.nodes.iter().rev().cloned().collect();
    let arcs = layout.arcs.iter().rev().map(arc).collect();
    let turned = QuadLayout::new(nodes, arcs, layout.patches.iter().map(patch).collect(), euler).unwrap();
    let mut initial_embedding = embedding.clone();
    for h in 0..3 * initial_embedding.mesh.n_faces() as u32 {
        if let Mark::Arc(k) = embedding.mesh.mark(h) {
            initial_embedding.mesh.set_mark(h, Mark::Arc(a - k));
        }
    }
    initial_embedding.nodes.reverse();
    initial_embedding.arcs.reverse();
    initial_embedding.arc_parameters.reverse();
    InitialLayout { layout: turned, embedding: initial_embedding, mesh_role: *mesh_role }
}

#[test]
fn the_map_does_not_depend_on_how_parts_are_numbered() {
    let Some(woven) = woven("cino_3holes") else { return };
    let Woven { session, initial } = &*woven;
    let energy = |initial: &InitialLayout| {
        let arc_headings = arc_headings(&initial.layout);
        let optimiser = Optimiser::new(&problem_of(session, initial, &arc_headings), &Progress::new()).unwrap();
        optimiser.state().solution.energy
    };
    let (a, b) = (energy(initial), energy(&renumbered(initial)));
    assert!(a > 0.0 && (a - b).abs() < 1e-6 * a, "{a} and {b}");
}

#[test]
fn energy_falls_and_half_of_it_in_three_steps() {
    for name in ["cino_3holes", "pretzel"] {
        let Some(woven) = woven(name) else { continue };
        let Woven { session, initial } = &*woven;
        let arc_headings = arc_headings(&initial.layout);
        let mut optimiser = Optimiser::new(&problem_of(session, initial, &arc_headings), &Progress::new()).unwrap();
        let mut seen = vec![optimiser.state().solution.energy];
        while !optimiser.is_done() {
            let better = optimiser.step(&Progress::new()).unwrap();
            let (before, now) = (seen[seen.len() - 1], optimiser.state().solution.energy);
            assert!(if better { now < before } else { now == before }, "{name}: {before}, then {now}");
            seen.push(now);
        }
        let (first, last) = (seen[0], seen[seen.len() - 1]);
        assert!(first - seen[3] > 0.5 * (first - last), "{name}: {seen:?}");
    }
}

#[test]
fn a_boundary_is_an_isoline_edge_by_edge() {
    let Some(path) = support::mesh("lilium.obj") else { return };
    let source = MeshSource::File(path);
    let loaded = source.load(std::path::Path::new("")).unwrap();
    let mut session = Session::open(loaded, source, Options::default(), &Progress::new()).unwrap();
    session.weave_to(Goal::Valid, &Progress::new()).unwrap();
    let initial = initial_layout(&session, &Progress::new()).unwrap();
    let arc_headings = arc_headings(&initial.layout);
    let mut optimiser = Optimiser::new(&problem_of(&session, &initial, &arc_headings), &Progress::new()).unwrap();
    for _ in 0..3 {
        optimiser.step(&Progress::new()).unwrap();
    }
    optimiser.finalise(&Progress::new()).unwrap();
    let state = optimiser.state();
    let (mesh, map) = (&state.topology.mesh, &state.solution.map);
    let uv = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
    let mut edges = 0;
    for h in mesh.halfedges().filter(|&h| mesh.twin(h).is_none()) {
        let (heading, _) = state.topology.boundary[&h];
        let along = uv(mesh.next(h)) - uv(h);
        let (constant, way) = if heading % 2 == 0 { (along.y, along.x) } else { (along.x, along.y) };
        assert!(constant.abs() < 1e-9, "{constant} across edge of {way}");
        edges += 1;
    }
    assert!(edges > 100, "{edges}");
}

/// The layout of an icosahedron on a sphere of 1920 triangles, every face of the icosahedron divided into three patches around
/// its centre: 12 nodes of valence 5, 20 of valence 3, and 30 regular ones.
fn icosahedron() -> (Prepared, QuadLayout, Embedding) {
    icosahedron_of(2)
}

/// The same on a mesh of 120 triangles, each split in four `splits` times.
fn icosahedron_of(splits: u32) -> (Prepared, QuadLayout, Embedding) {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut points: Vec<DVec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        points.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let near = |i: usize, j: usize| (points[i].distance(points[j]) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for (i, j, k) in (0..12).flat_map(|i| (0..12).flat_map(move |j| (0..12).map(move |k| (i, j, k)))) {
        let outside = (points[j] - points[i]).cross(points[k] - points[i]).dot(points[i]) > 0.0;
        if i < j && i < k && near(i, j) && near(j, k) && near(k, i) && outside {
            triangles.push([i as u32, j as u32, k as u32]);
        }
    }
    assert_eq!(triangles.len(), 20);
    let mut ids: HashMap<[u32; 2], u32> = HashMap::new();
    let (mut nodes, mut arcs, mut patches) = (vec![5; 12], Vec::<Arc>::new(), Vec::new());
    let mut faces: Vec<[u32; 3]> = Vec::new();
    let arc = |arcs: &mut Vec<Arc>, nodes: [u32; 2]| {
        let known = arcs.iter().position(|a| a.nodes == nodes);
        known.unwrap_or_else(|| {
            arcs.push(Arc { nodes, boundary: false, chord: 0 });
            arcs.len() - 1
        }) as u32
    };
    for t in &triangles {
        let middle: Vec<u32> = (0..3)
            .map(|i| {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                *ids.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push(0.5 * (points[a as usize] + points[b as usize]));
                    nodes.push(4);
                    nodes.len() as u32 - 1
                })
            })
            .collect();
        let centre = nodes.len() as u32;
        points.push(t.iter().map(|&v| points[v as usize]).sum::<DVec3>() / 3.0);
        nodes.push(3);
        for i in 0..3 {
            let (on, back) = (middle[i], middle[(i + 2) % 3]);
            let corners = [t[i], on, centre, back];
            let sides = [
                (arc(&mut arcs, [t[i], on]), true),
                (arc(&mut arcs, [on, centre]), true),
                (arc(&mut arcs, [back, centre]), false),
                (arc(&mut arcs, [t[i], back]), false),
            ];
            patches.push(Patch { corners, sides });
            faces.extend([[t[i], on, centre], [t[i], centre, back]]);
        }
    }
    let nodes: Vec<Node> = nodes.into_iter().map(|valence| Node { valence, boundary: false }).collect();
    let mut paths: Vec<Vec<u32>> = arcs.iter().map(|a| a.nodes.to_vec()).collect();
    for _ in 0..splits {
        let mut middle: HashMap<[u32; 2], u32> = HashMap::new();
        let mut between = |a: u32, b: u32| {
            *middle.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push(0.5 * (points[a as usize] + points[b as usize]));
                points.len() as u32 - 1
            })
        };
        let part = |&[a, b, c]: &[u32; 3]| {
            let (d, e, f) = (between(a, b), between(b, c), between(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        faces = faces.iter().flat_map(part).collect();
        for path in &mut paths {
            let last = path[path.len() - 1];
            *path = path.windows(2).flat_map(|w| [w[0], between(w[0], w[1])]).chain([last]).collect();
        }
    }
    let positions = points.iter().map(|p| 0.3 * p.normalize()).collect();
    let mesh = TriMesh::from_faces(positions, &faces).unwrap();
    let mut refined = RefinedMesh::new(&mesh);
    for (a, path) in (0..).zip(&paths) {
        for w in path.windows(2) {
            let h = refined.find(w[0], w[1]).unwrap();
            refined.set_mark(h, Mark::Arc(a));
        }
    }
    let initial_embedding = Embedding {
        mesh: refined,
        base_face: (0..mesh.n_faces() as u32).collect(),
        nodes: (0..nodes.len() as u32).collect(),
        arc_parameters: paths.iter().map(|p| (0..p.len()).map(|i| i as f64).collect()).collect(),
        arcs: paths,
        // Every patch was two triangles.
        seeds: (0..patches.len() as u32).map(|p| (2 * p) << (2 * splits)).collect(),
    };
    (Prepared::new(mesh), QuadLayout::new(nodes, arcs, patches, 2).unwrap(), initial_embedding)
}

/// Checks that every arc runs from its first node to its second along edges marked as its own.
fn check_embedding(layout: &QuadLayout, initial_embedding: &Embedding) {
    for (a, (arc, path)) in (0..).zip(layout.arcs.iter().zip(&initial_embedding.arcs)) {
        let ends = [path[0], path[path.len() - 1]];
        assert_eq!(ends, arc.nodes.map(|n| initial_embedding.nodes[n as usize]), "arc {a}");
        for w in path.windows(2) {
            let h = initial_embedding.mesh.find(w[0], w[1]).unwrap();
            assert_eq!(initial_embedding.mesh.mark(h), Mark::Arc(a));
        }
    }
    assert_eq!(initial_embedding.seeds.len(), layout.patches.len());
    assert_eq!(map_patches(layout, initial_embedding, &Progress::new()).unwrap().len(), layout.patches.len());
}

#[test]
fn an_embedding_is_transferred_to_a_proxy_and_back() {
    let (prepared, layout, initial_embedding) = icosahedron_of(4);
    let proxy = Proxy::new(&prepared.mesh, &prepared.sharp, 6000, &Progress::new()).unwrap();
    let at = |v: VertexId| SurfacePoint {
        face: prepared.mesh.face(prepared.mesh.vertex_halfedge(v)),
        weights: [0, 1, 2].map(|i| {
            let corner = prepared.mesh.face_vertices(prepared.mesh.face(prepared.mesh.vertex_halfedge(v)))[i];
            if corner == v { 1.0 } else { 0.0 }
        }),
    };
    // Nodes are vertices of the mesh.
    let to = |n: usize| {
        Some(proxy.to_proxy(&prepared.mesh, at(VertexId(initial_embedding.nodes[n]))).nearest_vertex(proxy.mesh()))
    };
    let carried = |line: &DualCurve| proxy.polyline_to_proxy(&prepared.mesh, &line.points, line.closed).ok();
    let own = (&layout, &initial_embedding, prepared.mesh.n_vertices());
    let coarse = transfer_embedding(own, proxy.mesh(), carried, to, &Progress::new()).unwrap().unwrap();
    check_embedding(&layout, &coarse);
    let carried = |line: &DualCurve| proxy.polyline_to_original(&prepared.mesh, &line.points, line.closed).ok();
    let own = (&layout, &coarse, proxy.mesh().n_vertices());
    let back = transfer_embedding(
        own,
        &prepared.mesh,
        carried,
        |n| Some(VertexId(initial_embedding.nodes[n])),
        &Progress::new(),
    );
    let back = back.unwrap().unwrap();
    check_embedding(&layout, &back);
    // Every part has its number again: nodes have their positions, and arcs lie near theirs.
    assert_eq!(back.nodes, initial_embedding.nodes);
    let middle = |d: &Embedding, a: usize| d.mesh.positions[d.arcs[a][d.arcs[a].len() / 2] as usize];
    for a in 0..layout.arcs.len() {
        let off = middle(&back, a).distance(middle(&initial_embedding, a));
        assert!(off < 0.06, "arc {a} of a sphere of radius 0.3 is {off} off");
    }
}

#[test]
fn a_large_mesh_is_embedded_on_a_proxy_first() {
    let (prepared, layout, initial_embedding) = icosahedron_of(4);
    let arc_headings = arc_headings(&layout);
    let problem = prepared.problem(&layout, &initial_embedding, &arc_headings);
    let progress = Progress::new();
    let mut seen = 0;
    let mut on_surface = |s: &Snapshot| {
        let points = s.nodes.iter().chain(s.arcs.iter().flatten().flatten());
        assert!(points.clone().count() > 0);
        for p in points {
            assert!(prepared.index.nearest(*p).position(&prepared.mesh).distance(*p) < 1e-9);
        }
        seen += 1;
        Next::Continue
    };
    let done = optimise_embedding(&problem, &progress, &mut on_surface).unwrap();
    assert!(progress.stage_times().iter().any(|s| s.stage == "Simplifying the mesh"));
    assert!(seen > 1);
    assert_eq!(done.layout, layout);
    assert!(done.report.remaining_flips.is_empty());
    check_embedding(&layout, &done.embedding);
    // Thirds of an icosahedron's faces on a sphere cannot be without distortion, and need not have more than this.
    assert!(done.report.measures.conformal < 2.12, "{:?}", done.report.measures);
}

#[test]
fn an_optimisation_on_a_proxy_is_cancelled() {
    let (prepared, layout, initial_embedding) = icosahedron_of(4);
    let arc_headings = arc_headings(&layout);
    let progress = Progress::new();
    let mut stop = |_: &Snapshot| {
        progress.cancel();
        Next::Continue
    };
    let stopped =
        optimise_embedding(&prepared.problem(&layout, &initial_embedding, &arc_headings), &progress, &mut stop);
    assert!(matches!(stopped, Err(EmbeddingError::Cancelled(_))));
}

fn embedded(settings: Settings) -> (QuadLayout, OptimisedEmbedding) {
    let (prepared, layout, initial_embedding) = icosahedron();
    embedded_on(&prepared, layout, &initial_embedding, settings)
}

fn embedded_on(
    prepared: &Prepared,
    layout: QuadLayout,
    initial_embedding: &Embedding,
    settings: Settings,
) -> (QuadLayout, OptimisedEmbedding) {
    let arc_headings = arc_headings(&layout);
    let problem = Problem { settings, ..prepared.problem(&layout, initial_embedding, &arc_headings) };
    let done = optimise_embedding(&problem, &Progress::new(), &mut |_| Next::Continue).unwrap();
    done.layout.check(2).unwrap();
    let sum: i64 = done.layout.nodes.iter().map(|n| 4 - n.valence as i64).sum();
    assert_eq!(sum, 8);
    (layout, done)
}

#[test]
fn short_chords_are_collapsed() {
    let (_, plain) = embedded(Settings::default());
    assert!(plain.report.collapsed_chords.is_empty() && plain.initial_embedding.is_none());
    let shortest = plain.maps.iter().flat_map(|m| [m.size.x, m.size.y]).fold(f64::INFINITY, f64::min);
    let (given, done) = embedded(Settings { collapse: Some(1.2 * shortest), ..Settings::default() });
    let report = &done.report;
    assert!(!report.collapsed_chords.is_empty(), "{report:?}");
    assert_eq!(done.layout.chords, given.chords - report.collapsed_chords.len());
    assert!(done.layout.patches.len() < given.patches.len() && done.initial_embedding.is_some());
    assert!(done.maps.iter().all(|m| m.flipped == 0 && m.size.min_element() > 0.0));
}

#[test]
fn chords_are_removed_that_only_make_a_layout_irregular() {
    // The chords of the icosahedron go around its corners, and those of three corners of a triangle cross in it. Without
    // two of these the corners are one node, and without the third the middle of the triangle becomes a part of it.
    let (prepared, layout, initial_embedding) = icosahedron();
    let simpler = |layout: &QuadLayout| {
        let less = |c| layout.collapse(c).is_ok_and(|left| left.layout.irregularity() < layout.irregularity());
        (0..layout.chords as u32).any(less)
    };
    assert!(!simpler(&layout));
    let pairs = (0..layout.chords).flat_map(|a| (0..a).map(move |b| (a, b)));
    let mut gone = pairs.map(|(a, b)| (0..layout.chords).map(|c| c == a || c == b).collect::<Vec<bool>>());
    let gone = gone.find(|gone| layout.without_chords(gone).is_ok_and(|left| simpler(&left.layout))).unwrap();
    let left =
        reembed(&layout, &initial_embedding, &gone, |_| false, prepared.mesh.n_vertices(), &Progress::new()).unwrap();
    let settings = Settings { simplify: true, ..Settings::default() };
    let (given, done) = embedded_on(&prepared, left.layout, &left.embedding, settings);
    assert!(done.layout.irregularity() < given.irregularity(), "{:?}", done.report);
    assert_eq!(done.layout.chords, given.chords - done.report.collapsed_chords.len());
}

#[test]
fn sides_of_patches_are_integers() {
    let edge = 0.06;
    let (_, done) = embedded(Settings { integer: Some(edge), ..Settings::default() });
    let (counts, off) = integer_grid_counts(&done.layout, &done.maps, edge);
    assert!(off < 1e-9, "{off}");
    let quads = refine(&done.layout, &done.embedding, &done.maps, &Spacing::even(&done.layout, &counts));
    let whole: f64 = done.maps.iter().map(|m| m.size.x * m.size.y).sum();
    assert!((quads.quads.len() as f64 * edge * edge - whole).abs() < 1e-9, "all quads are unit squares");
    let triangles: Vec<[u32; 3]> = quads.quads.iter().flat_map(|c| [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).collect();
    assert_eq!(TriMesh::from_faces(quads.positions, &triangles).unwrap().euler_characteristic(), 2);

    for name in ["cino_3holes", "pretzel"] {
        let Some(woven) = woven(name) else { continue };
        let Woven { session, initial } = &*woven;
        let arc_headings = arc_headings(&initial.layout);
        let settings = Settings { integer: Some(0.05), steps: 3, ..Settings::default() };
        let problem = Problem { settings, ..problem_of(session, initial, &arc_headings) };
        let done = optimise_embedding(&problem, &Progress::new(), &mut |_| Next::Continue).unwrap();
        let (_, off) = integer_grid_counts(&done.layout, &done.maps, 0.05);
        assert!(off < 1e-8, "{name}: {off}");
    }
}
