//! Field and map for nodes at given vertices (Campen, sections 6.3 and 6.4): one linear solve for the guiding field,
//! one for target lengths, and one for the least-squares map or several for an injective one.
//!
//! Constraints of chord lengths and features that contradict the layout are left out, so that the layout is always
//! satisfied.

use std::f64::consts::FRAC_PI_2;

use crate::embed::error::EmbeddingError;
use crate::embed::parameterise::chord_lengths::ChordLengths;
use crate::embed::parameterise::constraints::{self, IsolineEdge};
use crate::embed::parameterise::injective::{Flipped, InitialMap, MapInputs, angles_along_map};
use crate::embed::parameterise::state::State;
use crate::embed::problem::Settings;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::ThroughArcs;
use crate::field::{
    self, CrossField, DirectionPenalty, GuidingFieldSystem, SizingSystem, feature_direction_penalties,
    principal_direction_penalties, residual_rotations,
};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{CoordinateConstraint, DistortionWeights, Objective, ParamError, SeamlessSystem};
use crate::progress::Progress;
use crate::solve::{SolveError, SpdSymbolic};
use crate::surface::{Metric, PrincipalCurvature};

/// Deviation of the field from a principal direction, in quarter turns, up to which the direction has its full penalty
/// weight: 14°.
const FULL_AGREEMENT: f64 = 0.15;
/// Deviation from which on it has none: 32°. Beyond an eighth of a turn it would agree with another direction of the
/// cross.
const NO_AGREEMENT: f64 = 0.35;
/// Penalty weight of the directions of the initial embedding per area, in inverse squared lengths on a surface of
/// model size 1. They decide how the field as a whole is turned where nothing else does, and are too weak to
/// decide anything local.
const INITIAL_DIRECTIONS: f64 = 0.5;
/// Rounds of solving for the first field: in each one more principal directions agree with it.
const FIRST_FIELD_ROUNDS: usize = 4;
/// Largest share of the anisotropy in a triangle: with a larger one angles are distorted.
const MAX_ANISOTROPY_SHARE: f64 = 4.0;

/// Which map is solved for.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum MapKind<'s> {
    /// The least-squares map (equation 6.1), which may flip triangles.
    LeastSquares,
    /// An injective map.
    Injective {
        /// Weights of its energy.
        distortion: DistortionWeights,
        /// Where the descent starts.
        initial: InitialMap<'s>,
        /// Largest number of Newton steps.
        steps: usize,
    },
}

/// How feature edges are constrained to isolines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::embed) enum FeatureConstraint {
    /// By a penalty in the energy of injective maps; the penalty weight is a multiple of
    /// [`with_isoline_penalties`](crate::param::InjectiveEnergy::with_isoline_penalties)' own. Least squares ignore it.
    Penalty(f64),
    /// By hard constraints, unless these contradict the layout.
    Hard,
}

impl FeatureConstraint {
    /// The penalty weight of an edge; `None` if it has a hard constraint. A relaxed edge has a weight of 1.
    pub(in crate::embed) fn penalty(self, is_relaxed: bool) -> Option<f64> {
        match self {
            _ if is_relaxed => Some(1.0),
            Self::Penalty(weight) => Some(weight),
            Self::Hard => None,
        }
    }
}

/// The linear systems of a working mesh, with what can be kept from one solve to the next.
pub(in crate::embed) struct Systems {
    /// The system of the guiding field.
    pub field: GuidingFieldSystem,
    /// The system of the map, as of the last solve; `None` before the first.
    pub map: Option<SeamlessSystem>,
    /// The symbolic factorisation of the system of target lengths.
    sizing: Option<SpdSymbolic>,
}

impl Systems {
    /// The systems of a mesh, before the first solve.
    pub(in crate::embed) fn new(mesh: &TriMesh) -> Result<Self, EmbeddingError> {
        Ok(Self { field: GuidingFieldSystem::new(mesh)?, map: None, sizing: None })
    }
}

/// The inputs of a solve that do not depend on where nodes are.
pub(in crate::embed) struct Solver<'s> {
    pub curvature: &'s [PrincipalCurvature],
    pub sharp: &'s [bool],
    pub through_arcs: &'s ThroughArcs,
    pub chord_lengths: &'s ChordLengths,
    pub systems: &'s mut Systems,
    pub settings: Settings,
    pub features: FeatureConstraint,
    /// Feature edges that have a unit penalty even if others have a hard constraint; empty: none.
    pub relaxed: &'s [bool],
}

impl Solver<'_> {
    /// Solves for field and map. Principal directions are compared with the field of the angles `previous`, if given.
    /// The result is [`Flipped`] if an injective map was asked for and none was found.
    pub(in crate::embed) fn solve(
        &mut self,
        topology: EmbeddingTopology,
        metric: Metric,
        previous: Option<&[f64]>,
        kind: MapKind<'_>,
        progress: &Progress,
    ) -> Result<Result<State, Flipped>, EmbeddingError> {
        let mesh = &topology.mesh;
        let guessed = match kind {
            MapKind::Injective { initial: InitialMap::UpToQuarterTurns(uv), .. } => {
                Some(angles_along_map(&topology, &metric, uv))
            }
            _ => None,
        };
        // Contradicting directions and features flip triangles of a least-squares map. An injective map follows them as
        // far as it can, so that all are taken.
        let injective = matches!(kind, MapKind::Injective { .. });
        let principal = principal_direction_penalties(mesh, &metric, self.curvature, self.sharp, injective);
        let angle = self.field_angles((&topology, &metric), &principal, previous.or(guessed.as_deref()), progress)?;
        let field = field::cross_field(mesh, &metric, &angle, &topology.jump);
        let anisotropy_share = anisotropy_share(mesh, self.curvature);
        let nodes: Vec<VertexId> = topology.nodes.iter().filter(|n| !n.boundary).map(|n| n.vertex).collect();
        let slant = if injective { constraints::NO_SLANT_LIMIT } else { constraints::SLANT_LIMIT };
        let features = constraints::feature_edges(&topology, &metric, &field.angle, self.sharp, slant);
        let is_relaxed = |h: HalfedgeId| self.relaxed.get(mesh.edge(h).index()).copied().unwrap_or(false);
        let (penalised, hard): (Vec<_>, Vec<_>) =
            features.into_iter().partition(|f| self.features.penalty(is_relaxed(f.0)).is_some());
        let penalty = |(h, axis): IsolineEdge| Some((h, axis, self.features.penalty(is_relaxed(h))?));
        let penalised: Vec<_> = penalised.into_iter().filter_map(penalty).collect();
        let (sizing, analysis) = (self.settings.sizing, self.systems.sizing.take());
        let (lengths, built) = rayon::join(
            || match sizing {
                true => target_lengths((mesh, &metric), &angle, &topology.jump, analysis),
                false => Ok((Vec::new(), analysis)),
            },
            || self.map_system(&topology, &field, &nodes, &hard),
        );
        let (lengths, analysis) = lengths?;
        self.systems.sizing = analysis;
        let mut system = built?;
        let objective = Objective { anisotropy: self.settings.anisotropy, lengths, stiffness: Vec::new() };
        progress.check()?;
        let solution = match kind {
            MapKind::LeastSquares => Ok(system.solve(&metric, &field, &objective, progress)?),
            MapKind::Injective { distortion, initial, steps } => MapInputs {
                topology: &topology,
                metric: &metric,
                field: &field,
                objective: &objective,
                distortion,
                anisotropy_share: &anisotropy_share,
                penalised: &penalised,
            }
            .solve(&mut system, initial, steps, progress)?,
        };
        self.systems.map = Some(system);
        Ok(solution.map(|solution| State { topology, metric, field, objective, anisotropy_share, solution }))
    }

    /// Sets up the system of the map. Where constraints contradict each other, those of features and chord lengths are
    /// dropped until none contradicts the layout.
    fn map_system(
        &mut self,
        topology: &EmbeddingTopology,
        field: &CrossField,
        nodes: &[VertexId],
        features: &[IsolineEdge],
    ) -> Result<SeamlessSystem, EmbeddingError> {
        let layout = constraints::layout_constraints(topology, self.through_arcs);
        let mut features: Vec<CoordinateConstraint> =
            features.iter().map(|&f| constraints::edge_constraint(topology, f)).collect();
        let mut lengths = self.chord_lengths.constraints(topology, self.through_arcs);
        let mut system = self.systems.map.take();
        loop {
            let all: Vec<_> = layout.iter().chain(&lengths).chain(&features).cloned().collect();
            let built = match &mut system {
                Some(old) => old.rebuild(&topology.mesh, field, nodes, &all),
                None => SeamlessSystem::new(&topology.mesh, field, nodes, &all).map(|new| system = Some(new)),
            };
            match (built, system) {
                (Ok(()), Some(done)) => return Ok(done),
                (Err(ParamError::Conflict { constraint, .. }), kept)
                    if !(lengths.is_empty() && features.is_empty()) =>
                {
                    tracing::debug!(constraint, layout = layout.len(), "a constraint contradicts the layout");
                    match constraint.checked_sub(layout.len() + lengths.len()) {
                        Some(feature) => drop(features.remove(feature)),
                        // The error names the constraint eliminated last, which need not be the one to blame. The
                        // features that deviate most from the field are the likeliest.
                        None if !features.is_empty() => features.truncate(features.len() * 3 / 4),
                        None => drop(lengths.pop()),
                    }
                    system = kept;
                }
                (Err(error), _) => return Err(error.into()),
                (Ok(()), None) => system = None,
            }
        }
    }

    /// The angles of the guiding field. Which principal directions agree with it is only known once there is a field,
    /// so that the first one is solved for in several rounds.
    fn field_angles(
        &self,
        (topology, metric): (&EmbeddingTopology, &Metric),
        principal: &[DirectionPenalty],
        previous: Option<&[f64]>,
        progress: &Progress,
    ) -> Result<Vec<f64>, EmbeddingError> {
        let mesh = &topology.mesh;
        let given = self.given_directions(topology, metric);
        let (mut angle, rounds) = match previous {
            Some(angle) => (angle.to_vec(), 1),
            None => (topology.angle.clone(), FIRST_FIELD_ROUNDS),
        };
        for round in 0..rounds {
            // In the first half of the rounds features turn the field towards them; those that contradict it after that
            // do not bend it further.
            let selective = previous.is_some() || round >= FIRST_FIELD_ROUNDS / 2;
            let keep = |g: &DirectionPenalty| match g.branch {
                None if selective => weighted_by_agreement(g, angle[g.face.index()]),
                _ => Some(*g),
            };
            let mut penalties: Vec<DirectionPenalty> = given.iter().filter_map(keep).collect();
            penalties.extend(principal.iter().filter_map(|g| weighted_by_agreement(g, angle[g.face.index()])));
            angle = self.systems.field.solve(mesh, metric, &topology.jump, &penalties, Some(&angle), progress)?.angle;
        }
        Ok(angle)
    }

    /// Directions that do not depend on the field: those of features, where it is open which direction of the cross
    /// follows them; those of the boundary, which the layout determines; weakly those of the initial embedding.
    fn given_directions(&self, topology: &EmbeddingTopology, metric: &Metric) -> Vec<DirectionPenalty> {
        let mesh = &topology.mesh;
        let mut penalties = feature_direction_penalties(mesh, metric, self.sharp);
        penalties.extend(mesh.faces().map(|face| DirectionPenalty {
            face,
            angle: topology.angle[face.index()],
            weight: INITIAL_DIRECTIONS * metric.area(face),
            branch: Some(0),
        }));
        for h in mesh.halfedges().filter(|h| mesh.twin(*h).is_none()) {
            if let Some(&(k, _)) = topology.boundary.get(&h) {
                let (face, angle) = (mesh.face(h), metric.direction(h));
                let branch = Some(i32::from(k));
                penalties.push(DirectionPenalty { face, angle, weight: field::RELIABLE_PENALTY, branch });
            }
        }
        penalties
    }
}

/// The target lengths along both directions of a field, and the symbolic factorisation of their system.
fn target_lengths(
    (mesh, metric): (&TriMesh, &Metric),
    angle: &[f64],
    jump: &[i32],
    symbolic: Option<SpdSymbolic>,
) -> Result<(Vec<[f64; 2]>, Option<SpdSymbolic>), SolveError> {
    let system = SizingSystem::new(mesh, metric, symbolic)?;
    let rest = residual_rotations(mesh, metric, angle, jump);
    Ok((system.lengths(mesh, metric, &rest)?, Some(system.symbolic())))
}

/// The share of the anisotropy in each triangle: `(κ₁ − κ₂)²` over the mean of `½ (κ₁² + κ₂²)` on the surface, at most
/// [`MAX_ANISOTROPY_SHARE`]. It is 0 where curvature is the same in all directions. The alignment measure of section
/// 6.8.1 weighs deviations by the same `(κ₁ − κ₂)²`.
fn anisotropy_share(mesh: &TriMesh, curvature: &[PrincipalCurvature]) -> Vec<f64> {
    let mean_at = |f: FaceId, of: fn(&PrincipalCurvature) -> f64| {
        mesh.face_vertices(f).iter().map(|v| of(&curvature[v.index()])).sum::<f64>() / 3.0
    };
    let (sum, area) = mesh.faces().fold((0.0, 0.0), |(sum, area), f| {
        let a = mesh.face_area(f);
        (sum + a * mean_at(f, |c| c.k_max * c.k_max + c.k_min * c.k_min), area + a)
    });
    let mean = (0.5 * sum / area).max(f64::MIN_POSITIVE);
    mesh.faces().map(|f| (mean_at(f, |c| (c.k_max - c.k_min).powi(2)) / mean).min(MAX_ANISOTROPY_SHARE)).collect()
}

/// A direction penalty weighted by its agreement with the angle of the field; `None` where it does not agree.
///
/// The layout prevails over principal directions. Where both contradict each other, or a direction is taken for its
/// neighbour a quarter turn away, the field would turn by a quarter within a few triangles and the map would flip.
fn weighted_by_agreement(penalty: &DirectionPenalty, angle: f64) -> Option<DirectionPenalty> {
    let off = (penalty.angle - angle) / FRAC_PI_2;
    let off = (off - off.round()).abs();
    let share = ((NO_AGREEMENT - off) / (NO_AGREEMENT - FULL_AGREEMENT)).clamp(0.0, 1.0);
    (share > 0.0).then_some(DirectionPenalty { weight: penalty.weight * share, ..*penalty })
}
