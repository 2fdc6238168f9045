//! `patches.obj` read back: triangles with texture coordinates, one group per patch.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::DVec2;

/// A corner: its vertex and its texture coordinates, by number.
type Corner = (usize, usize);

/// The patches of a layout with their maps.
pub struct PatchesFile {
    uv: Vec<DVec2>,
    patches: Vec<Vec<[Corner; 3]>>,
}

/// How exactly numbers of the file agree, relative to the larger side of a patch: they are written in full.
const EXACT: f64 = 1e-9;

impl PatchesFile {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let mut file = Self { uv: Vec::new(), patches: Vec::new() };
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[0] {
                "vt" => file.uv.push(DVec2::new(words[1].parse().unwrap(), words[2].parse().unwrap())),
                "g" => file.patches.push(Vec::new()),
                "f" => {
                    let corner = |i: usize| {
                        let (v, vt) = words[i].split_once('/').unwrap();
                        (v.parse::<usize>().unwrap() - 1, vt.parse::<usize>().unwrap() - 1)
                    };
                    file.patches.last_mut().unwrap().push([corner(1), corner(2), corner(3)]);
                }
                _ => {}
            }
        }
        file
    }

    pub fn n_patches(&self) -> usize {
        self.patches.len()
    }

    pub fn n_triangles(&self) -> usize {
        self.patches.iter().map(Vec::len).sum()
    }

    /// What is wrong with the maps: every triangle is positively oriented, the triangles of a patch fill a rectangle
    /// whose sides its border lies on, and edges shared by two patches are equally long in both.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = Vec::new();
        let mut shared: HashMap<[usize; 2], Vec<f64>> = HashMap::new();
        let mut largest = 0.0f64;
        for (p, patch) in self.patches.iter().enumerate() {
            let border = self.border(patch);
            let size = self.judge(patch, &border).unwrap_or_else(|problem| {
                problems.push(format!("patch {p}: {problem}"));
                0.0
            });
            largest = largest.max(size);
            for [(v, a), (w, b)] in border {
                shared.entry([v.min(w), v.max(w)]).or_default().push(self.uv[a].distance(self.uv[b]));
            }
        }
        for (edge, lengths) in shared {
            match lengths[..] {
                [_] => {}
                [a, b] if (a - b).abs() <= EXACT * largest => {}
                _ => problems.push(format!("edge {edge:?} has the lengths {lengths:?} in its patches")),
            }
        }
        problems
    }

    /// The sides of triangles that no other triangle of the patch has.
    fn border(&self, patch: &[[Corner; 3]]) -> Vec<[Corner; 2]> {
        let sides = || patch.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]);
        let all: HashSet<[usize; 2]> = sides().map(|[a, b]| [a.1, b.1]).collect();
        sides().filter(|[a, b]| !all.contains(&[b.1, a.1])).collect()
    }

    /// The larger side of the rectangle that a patch fills.
    fn judge(&self, patch: &[[Corner; 3]], border: &[[Corner; 2]]) -> Result<f64, String> {
        let uv = |c: Corner| self.uv[c.1];
        let area = |t: &[Corner; 3]| 0.5 * (uv(t[1]) - uv(t[0])).perp_dot(uv(t[2]) - uv(t[0]));
        let flipped = patch.iter().filter(|t| area(t) <= 0.0).count();
        if flipped > 0 {
            return Err(format!("{flipped} of {} triangles are not positively oriented", patch.len()));
        }
        let corners = || patch.iter().flatten().map(|&c| uv(c));
        let (low, high) = (corners().reduce(DVec2::min).unwrap(), corners().reduce(DVec2::max).unwrap());
        let (size, exact) = (high - low, EXACT * (high - low).max_element());
        let filled: f64 = patch.iter().map(area).sum();
        if (filled - size.x * size.y).abs() > EXACT * size.x * size.y {
            return Err(format!("its triangles cover {filled} of a rectangle of {}", size.x * size.y));
        }
        let on_side = |a: DVec2, b: DVec2| {
            let on = |k: usize, at: f64| (a[k] - at).abs() <= exact && (b[k] - at).abs() <= exact;
            on(0, low.x) || on(0, high.x) || on(1, low.y) || on(1, high.y)
        };
        match border.iter().find(|[a, b]| !on_side(uv(*a), uv(*b))) {
            Some([a, b]) => Err(format!("the border edge {} to {} lies on no side of its rectangle", uv(*a), uv(*b))),
            None => Ok(size.max_element()),
        }
    }
}
