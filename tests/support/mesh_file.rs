//! Meshes and sharp edges read from files without the code under test.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::DVec3;

/// Dihedral angle above which an edge is sharp, in degrees (docs/decisions.md, "Sharp edges by dihedral angle alone").
const SHARP_DEGREES: f64 = 40.0;
/// Total length below which a connected group of sharp edges is dropped, as a fraction of the bounding-box diagonal.
const SHORT: f64 = 0.2;
/// Height below which a triangle takes the normal of the triangle across its longest edge, as a fraction of the diagonal.
const THIN: f64 = 2e-5;

/// A triangle mesh. Vertices at equal positions are one vertex.
pub struct MeshFile {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[usize; 3]>,
}

/// The two ends of a line segment.
pub type Segment = [DVec3; 2];

impl MeshFile {
    /// Reads an OBJ or OFF file; polygons are cut into fans.
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let off = path.extension().is_some_and(|e| e == "off");
        let (points, polygons) = if off { read_off(&text) } else { read_obj(&text) };
        let mut first = HashMap::new();
        let mut positions = Vec::new();
        let welded: Vec<usize> = points
            .iter()
            .map(|p| {
                // Adding zero turns -0 into 0.
                *first.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
                    positions.push(*p);
                    positions.len() - 1
                })
            })
            .collect();
        let fan =
            |p: &Vec<usize>| (1..p.len() - 1).map(|i| [p[0], p[i], p[i + 1]].map(|v| welded[v])).collect::<Vec<_>>();
        Self { triangles: polygons.iter().flat_map(fan).collect(), positions }
    }

    /// Length of the bounding box's diagonal.
    pub fn diagonal(&self) -> f64 {
        let low = self.positions.iter().copied().reduce(DVec3::min).unwrap();
        let high = self.positions.iter().copied().reduce(DVec3::max).unwrap();
        low.distance(high)
    }

    /// The edges between triangles whose normals differ by more than [`SHARP_DEGREES`], without short groups.
    pub fn sharp_edges(&self) -> Vec<Segment> {
        let diagonal = self.diagonal();
        let mut sides: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        for (t, triangle) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                sides.entry([a.min(b), a.max(b)]).or_default().push(t);
            }
        }
        let normals: Vec<DVec3> = (0..self.triangles.len()).map(|t| self.normal(t, &sides, THIN * diagonal)).collect();
        let bend = |of: &Vec<usize>| normals[of[0]].angle_between(normals[of[1]]).to_degrees();
        let sharp = sides.iter().filter(|(_, of)| of.len() == 2 && bend(of) > SHARP_DEGREES).map(|(ends, _)| *ends);
        self.without_short_groups(&sharp.collect::<Vec<_>>(), SHORT * diagonal)
    }

    /// The unit normal of a triangle; of a thin one that of the triangle across its longest edge.
    fn normal(&self, mut t: usize, sides: &BTreeMap<[usize; 2], Vec<usize>>, thin: f64) -> DVec3 {
        // Thin triangles may lead to each other in a cycle; the number of steps is bounded for that case.
        for _ in 0..64 {
            let corners = self.triangles[t];
            let [a, b, c] = corners.map(|v| self.positions[v]);
            let area = (b - a).cross(c - a);
            let length = |k: usize| self.positions[corners[k]].distance(self.positions[corners[(k + 1) % 3]]);
            let longest = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j))).unwrap();
            if area.length() >= thin * length(longest) {
                return area.normalize();
            }
            let (p, q) = (corners[longest], corners[(longest + 1) % 3]);
            let across = sides[&[p.min(q), p.max(q)]].iter().find(|&&s| s != t);
            t = *across.unwrap_or(&t);
        }
        let [a, b, c] = self.triangles[t].map(|v| self.positions[v]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The edges of groups joined at vertices that are at least `shortest` long in all.
    fn without_short_groups(&self, edges: &[[usize; 2]], shortest: f64) -> Vec<Segment> {
        let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
        for (e, ends) in edges.iter().enumerate() {
            ends.iter().for_each(|&v| at.entry(v).or_default().push(e));
        }
        let segment = |e: usize| edges[e].map(|v| self.positions[v]);
        let mut seen = vec![false; edges.len()];
        let mut kept = Vec::new();
        for seed in 0..edges.len() {
            if std::mem::replace(&mut seen[seed], true) {
                continue;
            }
            let mut group = vec![seed];
            let mut next = 0;
            while let Some(&e) = group.get(next) {
                next += 1;
                let joined = edges[e].iter().flat_map(|v| &at[v]);
                group.extend(joined.filter(|&&f| !std::mem::replace(&mut seen[f], true)));
            }
            if group.iter().map(|&e| segment(e)[0].distance(segment(e)[1])).sum::<f64>() >= shortest {
                kept.extend(group.into_iter().map(segment));
            }
        }
        kept
    }
}

type Polygons = (Vec<DVec3>, Vec<Vec<usize>>);

fn read_obj(text: &str) -> Polygons {
    let (mut points, mut polygons) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => points.push(point(&words[1..4])),
            Some(&"f") => {
                let index = |w: &&str| w.split('/').next().unwrap().parse::<usize>().unwrap() - 1;
                polygons.push(words[1..].iter().map(index).collect());
            }
            _ => {}
        }
    }
    (points, polygons)
}

fn read_off(text: &str) -> Polygons {
    let words = text.lines().flat_map(|l| l.split('#').next().unwrap_or("").split_whitespace());
    let words: Vec<&str> = words.skip_while(|w| *w == "OFF").collect();
    let number = |i: usize| words[i].parse::<usize>().unwrap();
    let (n_points, n_polygons) = (number(0), number(1));
    let points = (0..n_points).map(|i| point(&words[3 + 3 * i..6 + 3 * i])).collect();
    let mut at = 3 + 3 * n_points;
    let polygon = |_| {
        let n = number(at);
        at += n + 1;
        (at - n..at).map(number).collect()
    };
    (points, (0..n_polygons).map(polygon).collect())
}

fn point(words: &[&str]) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|i| words[i].parse().unwrap()))
}

/// A quad mesh as the program writes it.
pub struct QuadFile {
    pub positions: Vec<DVec3>,
    pub quads: Vec<[usize; 4]>,
}

impl QuadFile {
    pub fn read(path: &Path) -> Self {
        let (positions, polygons) = read_obj(&std::fs::read_to_string(path).unwrap());
        let quad = |p: &Vec<usize>| <[usize; 4]>::try_from(&p[..]).expect("a quad");
        Self { quads: polygons.iter().map(quad).collect(), positions }
    }

    /// Every edge once, as the numbers of its ends.
    pub fn edges(&self) -> Vec<[usize; 2]> {
        let sides = |q: &[usize; 4]| {
            let q = *q;
            (0..4).map(move |k| [q[k].min(q[(k + 1) % 4]), q[k].max(q[(k + 1) % 4])])
        };
        let mut edges: Vec<[usize; 2]> = self.quads.iter().flat_map(sides).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Mean length of the edges.
    pub fn mean_edge(&self) -> f64 {
        let edges = self.edges();
        edges.iter().map(|e| self.positions[e[0]].distance(self.positions[e[1]])).sum::<f64>() / edges.len() as f64
    }

    /// Those of `segments` that no chain of edges covers. A segment is covered if all its samples lie near edges that are
    /// nearly parallel to it, within [`NEAR`] and [`SLANT_DEGREES`], and the edges of consecutive samples are the same or
    /// share a vertex.
    pub fn uncovered(&self, segments: &[Segment]) -> Vec<Segment> {
        let (edges, mean) = (self.edges(), self.mean_edge());
        let tolerance = NEAR * mean;
        let ends = |e: usize| edges[e].map(|v| self.positions[v]);
        let covers = |e: usize, p: DVec3, along: DVec3| {
            let [a, b] = ends(e);
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let slant = (b - a).normalize_or_zero().dot(along).abs();
            a.lerp(b, t).distance(p) <= tolerance && slant >= SLANT_DEGREES.to_radians().cos()
        };
        let touch = |e: usize, f: usize| edges[e].iter().any(|v| edges[f].contains(v));
        let is_covered = |[p, q]: &Segment| {
            let along = (*q - *p).normalize_or_zero();
            let mut reached: Option<Vec<usize>> = None;
            let samples = (p.distance(*q) / (SPACING * mean)).ceil().max(LEAST_SAMPLES) as usize;
            for i in 0..samples {
                let sample = p.lerp(*q, (i as f64 + 0.5) / samples as f64);
                let near = (0..edges.len()).filter(|&e| covers(e, sample, along));
                let joined = |e: &usize| reached.as_ref().is_none_or(|r| r.iter().any(|&f| touch(*e, f)));
                let now: Vec<usize> = near.filter(joined).collect();
                reached = Some(now);
            }
            reached.is_some_and(|r| !r.is_empty())
        };
        segments.iter().filter(|s| !is_covered(s)).copied().collect()
    }
}

/// Largest distance of a sample from an edge that covers it, in mean edge lengths.
const NEAR: f64 = 0.1;
/// Largest angle between a segment and an edge that covers it.
const SLANT_DEGREES: f64 = 30.0;
/// Distance of samples, in mean edge lengths: less than the shortest edges, so that no edge of a chain is skipped.
const SPACING: f64 = 0.2;
/// Least number of samples of a segment.
const LEAST_SAMPLES: f64 = 5.0;
