//! Features onto isolines, exactly.
//!
//! Made relations at once, features fold the map; pulled, they come near. So they are pulled harder and harder, each time
//! from the map before, which is without folds and stays so. Where something cannot follow, it shows: what lies between a
//! node and the feature that it belongs to is squeezed, and the node is brought there ([`crate::embed::optimise::attachment`]); an edge that
//! keeps slanting contradicts the layout and is let go. What is left is on isolines but for rounding, and to make it
//! relations moves nothing.

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::constraints::{self, WHOLE};
use crate::embed::parameterise::feature_axes;
use crate::embed::parameterise::solve::{Features, Folded};
use crate::embed::parameterise::state::State;
use crate::mesh::{FaceId, HalfedgeId};
use crate::param::{InjectiveEnergy, SeamlessSystem, Solution};
use crate::progress::Progress;

/// The part of the whole work that is done by then.
const FRACTION: f64 = 0.85;
/// How hard features are pulled, in multiples of what is usual, until nodes that belong to them show.
const GENTLY: [f64; 3] = [10.0, 100.0, 1e3];
/// How often nodes are looked for and the features pulled anew.
const ROUNDS: usize = 3;
/// How hard they are pulled then, and which slope against its isoline an edge may still have each time: the more it is
/// pulled the less is left of one that can follow.
const HARD: [(f64, f64); 3] = [(1e3, 0.2), (1e4, 0.1), (1e6, 0.02)];
/// Steps of Newton's method each time.
const STEPS: usize = 15;
/// The share of a line of features that, let go, breaks it.
const BROKEN: f64 = 0.2;
/// How often features are let go where the map would fold even so, each time a ring of triangles farther around.
const LOOSENINGS: usize = 6;

impl Optimiser<'_> {
    /// Makes features isolines that were pulled towards them, where the layout allows it.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn hold_features(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Features::Pulled(mut before) = self.features else { return Ok(()) };
        if !self.sharp.contains(&true) {
            return Ok(());
        }
        progress.report("Bringing features onto isolines", FRACTION);
        self.synchronise(progress)?;
        for _ in 0..ROUNDS {
            for pull in GENTLY.into_iter().filter(|&pull| pull >= before) {
                self.pull_harder(pull, progress)?;
            }
            self.features = Features::Pulled(GENTLY[0]);
            if self.attach(progress)? == 0 {
                break;
            }
            // All but what has just been brought there is near already.
            before = GENTLY[GENTLY.len() - 1];
        }
        let mut lost = self.pull_hard(progress)?;
        while lost > 0 {
            let before = (self.state.clone(), self.ground.hold.clone(), self.loose.clone());
            let brought = self.attach_at_steps(progress)?;
            if brought > 0 {
                self.loose.clear();
                let now = self.pull_hard(progress)?;
                tracing::debug!(before = lost, now, "edges of features let go");
                if now < lost {
                    lost = now;
                    continue;
                }
            }
            (self.state, self.ground.hold, self.loose) = before;
            break;
        }
        self.features = Features::Held;
        self.solve_loosening(progress)
    }

    /// Pulls features as hard as can be; returns how many edges had to be let go.
    fn pull_hard(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        for (pull, slope) in HARD {
            self.pull_harder(pull, progress)?;
            self.let_go(slope);
        }
        Ok(self.loose.iter().filter(|&&l| l).count())
    }

    /// Solves for field and map where the nodes are; where features fold the map these are let go.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::Folded`] if the map folds even with features only pulled; the state is then as before.
    pub(in crate::embed) fn solve_loosening(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        for round in 1..=LOOSENINGS {
            match self.attempt_here(progress)? {
                Ok(state) => {
                    self.state = state;
                    return Ok(());
                }
                Err(Folded(list)) if self.features == Features::Held && self.shape.is_some() => {
                    self.loosen(&list, round);
                }
                Err(_) => return Err(EmbeddingError::Folded),
            }
        }
        tracing::debug!("features are not isolines exactly");
        self.release_features();
        self.state = self.attempt_here(progress)?.map_err(|_| EmbeddingError::Folded)?;
        Ok(())
    }

    /// Lets features be pulled only, as usual.
    pub(in crate::embed) fn release_features(&mut self) {
        self.features = Features::Pulled(1.0);
        self.loose.clear();
    }

    /// Brings the system of the map in line with the state: attempts that failed leave that of another net.
    pub(in crate::embed) fn synchronise(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Solution { map, free, .. } = &self.state.solution;
        let is_own = |system: &SeamlessSystem| system.n_free() == free.len() && system.map(free).uv == map.uv;
        if !self.seamless.as_ref().is_some_and(is_own) {
            self.state = self.attempt_here(progress)?.map_err(|_| EmbeddingError::Folded)?;
        }
        Ok(())
    }

    /// Pulls features so many times as hard as usual, in the field at hand.
    fn pull_harder(&mut self, pull: f64, progress: &Progress) -> Result<(), EmbeddingError> {
        self.features = Features::Pulled(pull);
        tracing::debug!(pull, "features pulled");
        self.come_to_rest(progress)
    }

    /// Lets the map without folds come to rest in the field at hand: a few steps between moves do not get so far.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(in crate::embed) fn come_to_rest(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let pulled = self.pulled();
        let (Some(system), Some(shape)) = (&mut self.seamless, self.shape) else { return Ok(()) };
        let newton = system.newton()?;
        let State { metric, field, objective, anisotropy_share, solution, .. } = &self.state;
        let energy = InjectiveEnergy::new(metric, &field.angle, objective, (shape, anisotropy_share))
            .with_isoline_penalties(&pulled);
        let Some(mut at) = system.injective(&energy, solution.free.clone()) else { return Ok(()) };
        system.descend(&newton, &energy, &mut at, STEPS, progress)?;
        self.state.solution = Solution { map: at.map, free: at.free, energy: at.energy };
        Ok(())
    }

    /// The edges of features that are only pulled, towards isolines of which coordinate, and how hard.
    fn pulled(&self) -> Vec<(HalfedgeId, u8, f64)> {
        let pull = |(h, axis): (HalfedgeId, u8)| Some((h, axis, self.features.strength(self.is_loose(h))?));
        self.aligned().into_iter().filter_map(pull).collect()
    }

    /// The edges of features, and the isolines of which coordinate they are to follow, those let go as well.
    pub(in crate::embed) fn aligned(&self) -> Vec<(HalfedgeId, u8)> {
        let State { net, metric, field, .. } = &self.state;
        constraints::features(net, metric, &field.angle, &self.sharp, WHOLE)
    }

    fn is_loose(&self, h: HalfedgeId) -> bool {
        self.loose.get(self.state.net.mesh.edge(h).index()).copied().unwrap_or(false)
    }

    /// Lets edges go that slope more than so much against their isolines. Along a line that cannot keep to one the pull
    /// spreads what is amiss evenly from vertex to vertex: its shortest edges slope most, and without one or two of these
    /// the rest can follow.
    fn let_go(&mut self, slope: f64) {
        let mut list = self.aligned();
        list.retain(|&(h, _)| !self.is_loose(h));
        let State { net, solution, .. } = &self.state;
        self.loose.resize(net.mesh.n_edges(), false);
        let mut count = 0;
        for (h, axis) in list {
            let [p, q] = [h.index() % 3, (h.index() + 1) % 3].map(|k| solution.map.uv[h.index() / 3][k]);
            let d = q - p;
            if d[usize::from(axis)].abs() > slope * d.length() {
                self.loose[net.mesh.edge(h).index()] = true;
                count += 1;
            }
        }
        tracing::debug!(count, "edges of features let go that keep slanting");
        self.let_go_broken();
    }

    /// Lets lines go of which much has been let go: to hold the pieces left costs shape, and they make no line.
    fn let_go_broken(&mut self) {
        let State { net, .. } = &self.state;
        for line in feature_axes::lines(net, &self.sharp) {
            let edges = || line.iter().map(|&h| net.mesh.edge(h));
            let all: f64 = edges().map(|e| net.mesh.edge_length(e)).sum();
            let gone: f64 = edges().filter(|e| self.loose[e.index()]).map(|e| net.mesh.edge_length(e)).sum();
            if gone > BROKEN * all {
                edges().for_each(|e| self.loose[e.index()] = true);
            }
        }
    }

    /// Lets the features around triangles that fold, so many rings far, be pulled only.
    fn loosen(&mut self, folded: &[FaceId], rings: usize) {
        let mesh = &self.state.net.mesh;
        let mut near = vec![false; mesh.n_vertices()];
        let mut faces: Vec<FaceId> = folded.to_vec();
        for _ in 0..rings {
            faces.iter().flat_map(|&f| mesh.face_vertices(f)).for_each(|v| near[v.index()] = true);
            faces = mesh.faces().filter(|&f| mesh.face_vertices(f).iter().any(|v| near[v.index()])).collect();
        }
        self.loose.resize(mesh.n_edges(), false);
        for e in mesh.edges().filter(|e| self.sharp[e.index()]) {
            self.loose[e.index()] |= mesh.edge_vertices(e).iter().any(|v| near[v.index()]);
        }
        self.let_go_broken();
        tracing::debug!(loose = self.loose.iter().filter(|&&l| l).count(), "features let go where the map would fold");
    }
}
