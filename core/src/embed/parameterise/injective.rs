//! The injective map for nodes at given vertices: an initial guess without flipped triangles, then a descent.
//!
//! The guess is the map of least squares to given gradients; it satisfies the constraints but may flip triangles. A few
//! flipped triangles are removed, in this order: by more weight on them, by a constraint homotopy or local confinement,
//! by untangling. Whatever starts without flipped triangles stays so, since the energy is infinite on them
//! ([`crate::param`]).

use glam::DVec2;

use crate::embed::error::EmbeddingError;
use crate::embed::parameterise::stiffen::stiffening;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::field::CrossField;
use crate::mesh::{FaceId, HalfedgeId};
use crate::param::{
    DistortionWeights, Effort, InjectiveEnergy, InjectiveMap, Objective, SeamlessSystem, Solution, flipped_triangles,
    gradients,
};
use crate::progress::Progress;
use crate::surface::Metric;

/// Largest number of flipped triangles of a guess that are worth removing. After a node step there is the alternative
/// of a shorter step; for a first map there is only a much worse start, so more effort pays.
const FEW_AFTER_STEP: usize = 50;
const FEW_AT_FIRST: usize = 2000;
/// Rounds of fitting a guess again with more weight on its flipped triangles, and the growth of their weights in each;
/// see [`stiffen`]. Both chosen by hand.
const REFITS: usize = 2;
const REFIT_GROWTH: f64 = 9.0;

/// Where the descent of an injective map starts.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum InitialMap<'s> {
    /// An injective map: the coordinates of the corners of each triangle.
    Injective(&'s [[DVec2; 3]]),
    /// A map of each triangle up to translations and quarter turns. It need neither satisfy the constraints nor be
    /// injective.
    UpToQuarterTurns(&'s [[DVec2; 3]]),
    /// An injective map of the same topology, which need not satisfy the present constraints.
    InPlace(&'s [[DVec2; 3]]),
    /// The map before a node step.
    BeforeStep {
        /// The coordinates of the corners of each triangle.
        uv: &'s [[DVec2; 3]],
        /// The gradients in the frame of the field before the step.
        gradients: &'s [[f64; 4]],
        /// Whether each triangle lies at a vertex that a node has left or come to. The field turns there with the node,
        /// so that the gradients relative to the field are a better guess than the coordinates.
        turning: &'s [bool],
    },
}

/// The triangles that are flipped in a guess from which no injective map was found; empty if some are only flat.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::embed) struct Flipped(pub Vec<FaceId>);

/// The inputs of an injective map besides its constraints.
pub(super) struct MapInputs<'s> {
    pub topology: &'s EmbeddingTopology,
    pub metric: &'s Metric,
    pub field: &'s CrossField,
    pub objective: &'s Objective,
    pub distortion: DistortionWeights,
    pub anisotropy_share: &'s [f64],
    /// Feature edges with a penalty: the half-edge, the coordinate that is to be constant, the penalty weight.
    pub penalised: &'s [(HalfedgeId, u8, f64)],
}

impl MapInputs<'_> {
    /// Finds an injective map near the initial one and descends its energy by at most `steps` Newton steps.
    pub(super) fn solve(
        &self,
        system: &mut SeamlessSystem,
        initial: InitialMap<'_>,
        steps: usize,
        progress: &Progress,
    ) -> Result<Result<Solution, Flipped>, EmbeddingError> {
        let Self { topology, metric, field, objective, distortion, anisotropy_share, penalised } = *self;
        let energy = InjectiveEnergy::new(metric, &field.angle, objective, (distortion, anisotropy_share))
            .with_isoline_penalties(penalised);
        let newton = system.newton_system()?;
        let few = match initial {
            InitialMap::Injective(_) | InitialMap::UpToQuarterTurns(_) => FEW_AT_FIRST,
            InitialMap::BeforeStep { .. } => FEW_AFTER_STEP,
            InitialMap::InPlace(_) => 0,
        };
        let (free, mut flipped) = self.fit(system, &self.target_gradients(initial), few, progress)?;
        let mut found = system.injective_map(&energy, free.clone());
        if let (None, InitialMap::InPlace(uv)) = (&found, initial) {
            let by = (&*newton, &energy);
            match system.enforce_constraints((&topology.mesh, metric), by, (&field.angle, uv), progress)? {
                Ok(reached) => found = Some(reached),
                // The initial map is not one of this system: the flips of the guess are all that is known.
                Err(ahead) if ahead.is_empty() => {}
                Err(ahead) => flipped = ahead,
            }
        } else if found.is_none() && flipped.len() <= few {
            let quarters = topology.quarters();
            let triangles = system.triangles(&topology.mesh, metric, field, objective)?;
            let repaired = system.remove_flips(&triangles, (&free, &quarters), Effort::Quick, progress)?;
            tracing::debug!(flipped = flipped.len(), left = repaired.flipped.len(), "flipped triangles of the guess");
            found = system.injective_map(&energy, repaired.y.clone());
            // Untangling is expensive. After a node step a shorter step is the better way out; a first map has no
            // other.
            if found.is_none() && matches!(initial, InitialMap::Injective(_) | InitialMap::UpToQuarterTurns(_)) {
                let whole = (&topology.mesh, &quarters[..]);
                found = system.untangle(&newton, &energy, repaired.y, whole, progress)?;
            }
        }
        let Some(mut at) = found else {
            tracing::debug!(flipped = flipped.len(), "no injective map near the guess");
            return Ok(Err(Flipped(flipped)));
        };
        system.descend(&newton, &energy, &mut at, steps, progress)?;
        let InjectiveMap { map, free, energy } = at;
        Ok(Ok(Solution { map, free, energy }))
    }

    /// The gradients, in the frame of the field, that the guess is fitted to.
    fn target_gradients(&self, initial: InitialMap<'_>) -> Vec<[f64; 4]> {
        let (metric, angle) = (self.metric, &self.field.angle);
        match initial {
            InitialMap::Injective(uv) | InitialMap::InPlace(uv) => gradients(metric, angle, uv),
            InitialMap::UpToQuarterTurns(uv) => gradients(metric, angle, uv).into_iter().map(turned_to_field).collect(),
            InitialMap::BeforeStep { uv, gradients: before, turning } => {
                let mut list = gradients(metric, angle, uv);
                for (f, g) in list.iter_mut().enumerate().filter(|(f, _)| turning[*f]) {
                    *g = before[f];
                }
                list
            }
        }
    }

    /// The free variables of the map whose gradients are nearest to those given, and its flipped triangles.
    fn fit(
        &self,
        system: &mut SeamlessSystem,
        wanted: &[[f64; 4]],
        few: usize,
        progress: &Progress,
    ) -> Result<(Vec<f64>, Vec<FaceId>), EmbeddingError> {
        let Self { topology, metric, field, .. } = *self;
        let mut free = system.fit(metric, &field.angle, wanted, &[])?;
        let mut flipped = flipped_triangles(&system.map(&free).uv);
        let mut weight = vec![1.0; wanted.len()];
        for _ in 0..REFITS {
            progress.check()?;
            if flipped.is_empty() || flipped.len() > few {
                break;
            }
            let mut list = vec![false; wanted.len()];
            flipped.iter().for_each(|f| list[f.index()] = true);
            stiffening(REFIT_GROWTH).raise_around(&topology.mesh, &list, &mut weight);
            let again = system.fit(metric, &field.angle, wanted, &weight)?;
            let left = flipped_triangles(&system.map(&again).uv);
            tracing::debug!(flipped = flipped.len(), left = left.len(), "fitted again");
            if left.len() >= flipped.len() {
                break;
            }
            (free, flipped) = (again, left);
        }
        Ok((free, flipped))
    }
}

/// The gradients `∇u` and `∇v` in the frame of the field, rotated by the number of quarter turns that aligns them best
/// with it.
fn turned_to_field([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    let turned = [[a, b, c, d], [c, d, -a, -b], [-a, -b, -c, -d], [-c, -d, a, b]];
    turned.into_iter().max_by(|g, h| (g[0] + g[3]).total_cmp(&(h[0] + h[3]))).unwrap_or([a, b, c, d])
}

/// The angles of the field that a map up to quarter turns follows, on the branch nearest to the initial field of the
/// topology.
pub(super) fn angles_along_map(topology: &EmbeddingTopology, metric: &Metric, uv: &[[DVec2; 3]]) -> Vec<f64> {
    // The rotation part of the 2×2 matrix of the map.
    let rotation = |g: [f64; 4]| {
        let [a, b, c, d] = turned_to_field(g);
        (b - c).atan2(a + d)
    };
    let off = gradients(metric, &topology.angle, uv).into_iter().map(rotation);
    topology.angle.iter().zip(off).map(|(angle, off)| angle + off).collect()
}
