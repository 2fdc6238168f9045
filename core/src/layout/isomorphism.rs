//! Isomorphisms of layouts: corresponding nodes, arcs and patches of two layouts with the same structure.
//!
//! A pair of corresponding patches determines the isomorphism of their connected component, since patches are followed
//! across arcs. For a symmetric layout several isomorphisms exist; the one with the smallest sum of distances between
//! corresponding patches is chosen. The correspondence of chords is given.

use super::structure::QuadLayout;

/// For each node, arc and patch of a layout the corresponding one of another layout.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Isomorphism {
    pub nodes: Vec<u32>,
    /// With each arc, whether both have the same direction.
    pub arcs: Vec<(u32, bool)>,
    pub patches: Vec<u32>,
}

/// The isomorphism from `ours` to `theirs` with the smallest sum of `distance` between corresponding patches. `chords`
/// gives for each chord of `ours` the chord of `theirs`. `None` if the layouts are not isomorphic.
pub(super) fn isomorphism(
    ours: &QuadLayout,
    theirs: &QuadLayout,
    chords: &[u32],
    distance: impl Fn(usize, usize) -> f64,
) -> Option<Isomorphism> {
    let count = |l: &QuadLayout| (l.nodes.len(), l.arcs.len(), l.patches.len());
    if count(ours) != count(theirs) {
        return None;
    }
    let pair = Pair { ours, theirs, chords, ours_at: directed_arcs(ours), theirs_at: directed_arcs(theirs) };
    let mut found = PartialIsomorphism {
        nodes: vec![None; ours.nodes.len()],
        arcs: vec![None; ours.arcs.len()],
        patches: vec![None; ours.patches.len()],
        taken: vec![false; ours.patches.len()],
    };
    // One iteration per connected component.
    while let Some(first) = found.patches.iter().position(Option::is_none) {
        let starts = (0..theirs.patches.len() as u32).flat_map(|q| (0..4).map(move |turn| (q, turn)));
        let candidates = starts.filter_map(|(q, turn)| {
            let mut candidate = found.clone();
            let added = candidate.extend(&pair, first as u32, q, turn)?;
            Some((added.iter().map(|&(p, q)| distance(p as usize, q as usize)).sum::<f64>(), candidate))
        });
        found = candidates.min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    }
    Some(Isomorphism {
        nodes: found.nodes.into_iter().collect::<Option<_>>()?,
        arcs: found.arcs.into_iter().collect::<Option<_>>()?,
        patches: found.patches.into_iter().map(|p| Some(p?.0)).collect::<Option<_>>()?,
    })
}

/// The patch to the left of a directed arc, and its side.
type Side = Option<(u32, usize)>;

/// The two layouts, their corresponding chords, and the patches beside their arcs, run through backward and forward.
struct Pair<'l> {
    ours: &'l QuadLayout,
    theirs: &'l QuadLayout,
    chords: &'l [u32],
    ours_at: Vec<[Side; 2]>,
    theirs_at: Vec<[Side; 2]>,
}

/// For each arc, run through backward and forward, the patch to the left.
fn directed_arcs(layout: &QuadLayout) -> Vec<[Side; 2]> {
    let mut found = vec![[None; 2]; layout.arcs.len()];
    for (p, patch) in (0..).zip(&layout.patches) {
        for (i, &(arc, forward)) in patch.sides.iter().enumerate() {
            found[arc as usize][usize::from(forward)] = Some((p, i));
        }
    }
    found
}

/// A partial isomorphism.
#[derive(Clone)]
struct PartialIsomorphism {
    nodes: Vec<Option<u32>>,
    arcs: Vec<Option<(u32, bool)>>,
    /// With each patch, the side that corresponds to its first side.
    patches: Vec<Option<(u32, usize)>>,
    /// Which patches of the other layout correspond to one.
    taken: Vec<bool>,
}

impl PartialIsomorphism {
    /// Maps patch `p` to patch `q`, its first side to side `turn`, and extends the map to the connected component.
    /// Returns the pairs of patches added; `None` on a contradiction.
    fn extend(&mut self, pair: &Pair<'_>, p: u32, q: u32, turn: usize) -> Option<Vec<(u32, u32)>> {
        let mut added = Vec::new();
        let mut stack = vec![(p, q, turn)];
        while let Some((p, q, turn)) = stack.pop() {
            match self.patches[p as usize] {
                Some(known) if known == (q, turn) => continue,
                None if !self.taken[q as usize] => {}
                _ => return None,
            }
            self.patches[p as usize] = Some((q, turn));
            self.taken[q as usize] = true;
            added.push((p, q));
            let (ours, theirs) = (&pair.ours.patches[p as usize], &pair.theirs.patches[q as usize]);
            for i in 0..4 {
                let j = (i + turn) % 4;
                let (node, other) = (ours.corners[i], theirs.corners[j]);
                let same_kind = pair.ours.nodes[node as usize] == pair.theirs.nodes[other as usize];
                if !same_kind || *self.nodes[node as usize].get_or_insert(other) != other {
                    return None;
                }
                let ((a, forward), (b, other_forward)) = (ours.sides[i], theirs.sides[j]);
                let arc = (b, forward == other_forward);
                let chord = pair.chords[pair.ours.arcs[a as usize].chord as usize];
                let same_chord = chord == pair.theirs.arcs[b as usize].chord;
                if !same_chord || *self.arcs[a as usize].get_or_insert(arc) != arc {
                    return None;
                }
                let beyond = pair.ours_at[a as usize][usize::from(!forward)];
                match (beyond, pair.theirs_at[b as usize][usize::from(!other_forward)]) {
                    (Some((p, i)), Some((q, j))) => stack.push((p, q, (j + 4 - i) % 4)),
                    (None, None) => {}
                    _ => return None,
                }
            }
        }
        Some(added)
    }
}

#[cfg(test)]
mod tests {
    use super::super::structure::{Arc, Node, Patch};
    use super::*;

    /// A torus of `m` by `n` patches; patch `(i, j)` is at `i + m j`.
    fn torus(m: u32, n: u32) -> QuadLayout {
        let at = |i: u32, j: u32| i % m + m * (j % n);
        let mut arcs = vec![Arc { nodes: [0; 2], boundary: false, chord: 0 }; 2 * (m * n) as usize];
        let mut patches = Vec::new();
        for (i, j) in (0..n).flat_map(|j| (0..m).map(move |i| (i, j))) {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            arcs[2 * at(i, j) as usize].nodes = [corners[0], corners[1]];
            arcs[2 * at(i, j) as usize + 1].nodes = [corners[0], corners[3]];
            let (right, up) = (2 * at(i + 1, j) + 1, 2 * at(i, j + 1));
            let sides = [(2 * at(i, j), true), (right, true), (up, false), (2 * at(i, j) + 1, false)];
            patches.push(Patch { corners, sides });
        }
        let nodes = vec![Node { valence: 4, boundary: false }; (m * n) as usize];
        QuadLayout::new(nodes, arcs, patches, 0).expect("valid")
    }

    /// The layout with its elements in reverse order, every second arc reversed and the sides of patches rotated.
    fn renumbered(layout: &QuadLayout) -> QuadLayout {
        let (n, m) = (layout.nodes.len() as u32, layout.arcs.len() as u32);
        let turned = |a: u32| a % 2 == 1;
        let mut arcs: Vec<Arc> = layout.arcs.clone();
        for (a, arc) in (0..).zip(&mut arcs) {
            arc.nodes = arc.nodes.map(|v| n - 1 - v);
            if turned(a) {
                arc.nodes.reverse();
            }
        }
        arcs.reverse();
        let patch = |p: &Patch| {
            let mut corners = p.corners.map(|v| n - 1 - v);
            let mut sides = p.sides.map(|(a, forward)| (m - 1 - a, forward != turned(a)));
            corners.rotate_left(1);
            sides.rotate_left(1);
            Patch { corners, sides }
        };
        let patches = layout.patches.iter().rev().map(patch).collect();
        QuadLayout::new(layout.nodes.clone(), arcs, patches, 0).expect("valid")
    }

    fn chords(ours: &QuadLayout, theirs: &QuadLayout) -> Vec<u32> {
        let last = ours.arcs.len() - 1;
        let of = |c: usize| ours.arcs.iter().position(|a| a.chord as usize == c).expect("an arc");
        (0..ours.chords).map(|c| theirs.arcs[last - of(c)].chord).collect()
    }

    #[test]
    fn renumbered_layout_is_matched_despite_symmetries() {
        let ours = torus(3, 5);
        let theirs = renumbered(&ours);
        let last = ours.patches.len() - 1;
        let found = isomorphism(&ours, &theirs, &chords(&ours, &theirs), |p, q| p.abs_diff(last - q) as f64);
        let found = found.expect("the same layout");
        assert!(found.patches.iter().enumerate().all(|(p, &q)| q as usize == last - p));
        assert!(found.nodes.iter().enumerate().all(|(n, &v)| v as usize == last - n));
        let last = ours.arcs.len() - 1;
        let arcs = found.arcs.iter().enumerate();
        assert!(arcs.clone().all(|(a, &(b, same))| b as usize == last - a && same == (a % 2 == 0)), "{found:?}");
    }

    #[test]
    fn different_layouts_are_not_isomorphic() {
        let (ours, theirs) = (torus(3, 4), torus(2, 6));
        let all = vec![0; ours.chords];
        assert_eq!(isomorphism(&ours, &theirs, &all, |_, _| 0.0), None);
        let turned = torus(4, 3);
        let chords: Vec<u32> = (0..ours.chords as u32).collect();
        assert_eq!(isomorphism(&ours, &turned, &chords, |_, _| 0.0), None);
    }
}
