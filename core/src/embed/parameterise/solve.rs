//! Field and map of a net whose nodes stay where they are: linear solves (Campen, sections 6.3 and 6.4).

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use crate::embed::EmbeddingError;
use crate::embed::optimise::finalise::raise;
use crate::embed::parameterise::chord_lengths::Spacing;
use crate::embed::parameterise::constraints;
use crate::embed::parameterise::state::State;
use crate::embed::problem::Settings;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::ThroughArcs;
use crate::field::{self, CrossField, GuidingFieldSystem};
use crate::field::{SizingSystem, residual_rotations};
use crate::field::{feature_direction_penalties, principal_direction_penalties};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{
    CoordinateConstraint, DistortionWeights, Effort, InjectiveEnergy, InjectiveMap, Objective, ParamError,
    SeamlessSystem, Solution, folds, gradients,
};
use crate::progress::Progress;
use crate::solve::{SolveError, SpdSymbolic};
use crate::surface::Metric;
use crate::surface::PrincipalCurvature;

/// Deviation, in quarter turns, up to which a principal direction fully guides the field, and from which on not at all:
/// beyond an eighth of a turn it would be another direction's.
const AGREES: f64 = 0.15;
const DISAGREES: f64 = 0.35;
/// Pull of the rough drawing, in inverse squared lengths on a surface of bounding-box diagonal 1: it tells how the
/// field as a whole is turned where nothing else does, and prevails in less than the whole surface nowhere.
const DRAWN: f64 = 0.5;
/// Rounds of guiding the first field, in each of which more directions come to agree.
const FIRST_ROUNDS: usize = 4;

/// What map a net is solved for.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum Aim<'s> {
    /// That of least squares.
    LeastSquares,
    /// One without folds.
    InjectiveMap {
        /// What it is to be like.
        shape: DistortionWeights,
        /// Where it starts.
        start: Start<'s>,
        /// Steps of Newton's method at most.
        steps: usize,
    },
}

/// What a map is to do about the features of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::embed) enum Features {
    /// They are pulled towards isolines, in a map without folds, so many times as hard as usual.
    Pulled(f64),
    /// They are isolines wherever nothing contradicts that.
    Held,
}

impl Features {
    /// How hard an edge is pulled, in multiples of what is usual; `None` if it is held.
    pub(in crate::embed) fn strength(self, is_loose: bool) -> Option<f64> {
        match self {
            _ if is_loose => Some(1.0),
            Self::Pulled(pull) => Some(pull),
            Self::Held => None,
        }
    }
}

/// Where a map without folds starts.
#[derive(Debug, Clone, Copy)]
pub(in crate::embed) enum Start<'s> {
    /// From a map without folds: the coordinates of the corners of each triangle.
    Map(&'s [[DVec2; 3]]),
    /// From a map that need not satisfy the relations, nor be in the chart of each triangle: as [`Self::Map`], up to
    /// translations and quarter turns.
    Turned(&'s [[DVec2; 3]]),
    /// From a map without folds on the same net, which need not satisfy what is demanded now.
    Here(&'s [[DVec2; 3]]),
    /// From the map before nodes moved. Where a node has left its vertex or come to another the field turns with it, and
    /// the gradients as they were in its frame are the better guess.
    Moved {
        /// The coordinates of the corners of each triangle before.
        uv: &'s [[DVec2; 3]],
        /// The gradients in the frame of the field before.
        gradients: &'s [[f64; 4]],
        /// Whether the field turns in a triangle.
        turned: &'s [bool],
    },
}

/// The most that directions may count in a triangle, as a multiple of the anisotropy: angles suffer where it is more.
const FIRMEST: f64 = 4.0;
/// Up to how many folds of the first guess of a map are worth removing one by one: after a step, to which there is an
/// alternative, and at first.
const FEW: usize = 50;
const FEW_AT_FIRST: usize = 2000;
/// How often a first guess is fitted again with more weight on the triangles that fold, and by how much more.
const REFITS: usize = 2;
const FIRMER: f64 = 9.0;

/// The triangles that fold in the first guess of a map that is to have none; empty if some are only flat.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::embed) struct Folded(pub Vec<FaceId>);

/// What field and map are solved with.
pub(in crate::embed) struct Solver<'s> {
    pub curvature: &'s [PrincipalCurvature],
    pub sharp: &'s [bool],
    pub through_arcs: &'s ThroughArcs,
    pub spacing: &'s Spacing,
    pub guided: &'s GuidingFieldSystem,
    pub seamless: Option<SeamlessSystem>,
    pub sizes: Option<SpdSymbolic>,
    pub settings: Settings,
    /// What is done about features.
    pub features: Features,
    /// Edges of features that are only pulled even so; empty: none.
    pub loose: &'s [bool],
}

impl Solver<'_> {
    /// Solves for field and map of a net; with the angles of a field before, guides follow those. [`Folded`] if there is
    /// to be a map without folds and none was found.
    pub(in crate::embed) fn solve(
        &mut self,
        net: EmbeddingTopology,
        metric: Metric,
        previous: Option<&[f64]>,
        aim: Aim<'_>,
        progress: &Progress,
    ) -> Result<Result<State, Folded>, EmbeddingError> {
        let mesh = &net.mesh;
        let guessed = match aim {
            Aim::InjectiveMap { start: Start::Turned(uv), .. } => Some(directions(&net, &metric, uv)),
            _ => None,
        };
        // A map of least squares is torn by what contradicts it; one without folds shows what can be followed.
        let whole = matches!(aim, Aim::InjectiveMap { .. });
        let shape = principal_direction_penalties(mesh, &metric, self.curvature, self.sharp, whole);
        let angle = self.angles((&net, &metric), &shape, previous.or(guessed.as_deref()), progress)?;
        let field = field::cross_field(mesh, &metric, &angle, &net.jump);
        let anisotropy_share = anisotropy_share(mesh, self.curvature);
        let nodes: Vec<VertexId> = net.nodes.iter().filter(|n| !n.boundary).map(|n| n.vertex).collect();
        let slant = if whole { constraints::WHOLE } else { constraints::SLANT };
        let features = constraints::features(&net, &metric, &field.angle, self.sharp, slant);
        let is_loose = |h: HalfedgeId| self.loose.get(mesh.edge(h).index()).copied().unwrap_or(false);
        let (pulled, features): (Vec<_>, Vec<_>) =
            features.into_iter().partition(|f| self.features.strength(is_loose(f.0)).is_some());
        let pull = |(h, axis): (HalfedgeId, u8)| Some((h, axis, self.features.strength(is_loose(h))?));
        let pulled: Vec<_> = pulled.into_iter().filter_map(pull).collect();
        let (sizing, sizes) = (self.settings.sizing, self.sizes.take());
        let (lengths, built) = rayon::join(
            || if sizing { lengths((mesh, &metric), &angle, &net.jump, sizes) } else { Ok((Vec::new(), sizes)) },
            || self.build(&net, &field, &nodes, &features),
        );
        let (lengths, sizes) = lengths?;
        self.sizes = sizes;
        let mut system = built?;
        let objective = Objective { anisotropy: self.settings.anisotropy, lengths, stiffness: Vec::new() };
        progress.check()?;
        let solution = match aim {
            Aim::LeastSquares => Ok(system.solve(&metric, &field, &objective, progress)?),
            Aim::InjectiveMap { shape, start, steps } => {
                let anisotropy_share = &anisotropy_share;
                let pulled = &pulled;
                let setting = Setting {
                    net: &net,
                    metric: &metric,
                    field: &field,
                    objective: &objective,
                    anisotropy_share,
                    pulled,
                };
                setting.injective(&mut system, shape, start, steps, progress)?
            }
        };
        self.seamless = Some(system);
        Ok(solution.map(|solution| State { net, metric, field, objective, anisotropy_share, solution }))
    }

    /// Sets up the system of the map. Features and spacing that contradict what the layout demands are left out.
    fn build(
        &mut self,
        net: &EmbeddingTopology,
        field: &CrossField,
        nodes: &[VertexId],
        features: &[(HalfedgeId, u8)],
    ) -> Result<SeamlessSystem, EmbeddingError> {
        let demanded = constraints::demanded(net, self.through_arcs);
        let mut features: Vec<CoordinateConstraint> = features.iter().map(|&f| constraints::on_edge(net, f)).collect();
        let mut spacing = self.spacing.relations(net, self.through_arcs);
        let mut system = self.seamless.take();
        loop {
            let relations: Vec<_> = demanded.iter().chain(&spacing).chain(&features).cloned().collect();
            let built = match &mut system {
                Some(old) => old.rebuild(&net.mesh, field, nodes, &relations),
                None => SeamlessSystem::new(&net.mesh, field, nodes, &relations).map(|new| system = Some(new)),
            };
            match (built, system) {
                (Ok(()), Some(done)) => return Ok(done),
                (Err(ParamError::Conflict { relation, .. }), kept) if !(spacing.is_empty() && features.is_empty()) => {
                    tracing::debug!(relation, demanded = demanded.len(), "a wish contradicts the layout");
                    match relation.checked_sub(demanded.len() + spacing.len()) {
                        Some(feature) => drop(features.remove(feature)),
                        // Named is what was eliminated last, which need not be to blame: first those features give way
                        // that the field follows least.
                        None if !features.is_empty() => features.truncate(features.len() * 3 / 4),
                        None => drop(spacing.pop()),
                    }
                    system = kept;
                }
                (Err(error), _) => return Err(error.into()),
                (Ok(()), None) => system = None,
            }
        }
    }

    /// The angles of the field that principal directions guide; at first, without those of a field before, in several
    /// rounds.
    fn angles(
        &self,
        (net, metric): (&EmbeddingTopology, &Metric),
        shape: &[field::DirectionPenalty],
        previous: Option<&[f64]>,
        progress: &Progress,
    ) -> Result<Vec<f64>, EmbeddingError> {
        let mesh = &net.mesh;
        let held = self.held_directions(net, metric);
        let (mut angle, rounds) = match previous {
            Some(angle) => (angle.to_vec(), 1),
            None => (net.angle.clone(), FIRST_ROUNDS),
        };
        for round in 0..rounds {
            // At first features draw the field towards them; those that it still contradicts do not bend it.
            let convinced = previous.is_some() || round >= FIRST_ROUNDS / 2;
            let keep = |g: &field::DirectionPenalty| match g.branch {
                None if convinced => agreeing(g, angle[g.face.index()]),
                _ => Some(*g),
            };
            let mut guides: Vec<field::DirectionPenalty> = held.iter().filter_map(keep).collect();
            guides.extend(shape.iter().filter_map(|g| agreeing(g, angle[g.face.index()])));
            angle = self.guided.solve(mesh, metric, &net.jump, &guides, Some(&angle), progress)?.angle;
        }
        Ok(angle)
    }

    /// Directions that hold whatever the field: those of features, of which it is open which direction of a cross
    /// follows them, those of the boundary, of which the layout tells, and weakly those of the drawing.
    fn held_directions(&self, net: &EmbeddingTopology, metric: &Metric) -> Vec<field::DirectionPenalty> {
        let mesh = &net.mesh;
        let mut guides = feature_direction_penalties(mesh, metric, self.sharp);
        guides.extend(mesh.faces().map(|face| field::DirectionPenalty {
            face,
            angle: net.angle[face.index()],
            weight: DRAWN * metric.area(face),
            branch: Some(0),
        }));
        for h in mesh.halfedges().filter(|h| mesh.twin(*h).is_none()) {
            if let Some(&(k, _)) = net.boundary.get(&h) {
                let (face, angle) = (mesh.face(h), metric.direction(h));
                guides.push(field::DirectionPenalty {
                    face,
                    angle,
                    weight: field::RELIABLE_PENALTY,
                    branch: Some(i32::from(k)),
                });
            }
        }
        guides
    }
}

/// All that a map depends on besides its system.
struct Setting<'s> {
    net: &'s EmbeddingTopology,
    metric: &'s Metric,
    field: &'s CrossField,
    objective: &'s Objective,
    anisotropy_share: &'s [f64],
    pulled: &'s [(HalfedgeId, u8, f64)],
}

impl Setting<'_> {
    fn injective(
        &self,
        system: &mut SeamlessSystem,
        shape: DistortionWeights,
        start: Start<'_>,
        steps: usize,
        progress: &Progress,
    ) -> Result<Result<Solution, Folded>, EmbeddingError> {
        let Self { net, metric, field, objective, anisotropy_share, pulled } = *self;
        let wanted = match start {
            Start::Map(uv) | Start::Here(uv) => gradients(metric, &field.angle, uv),
            Start::Turned(uv) => gradients(metric, &field.angle, uv).into_iter().map(along_field).collect(),
            Start::Moved { uv, gradients: before, turned } => {
                let mut list = gradients(metric, &field.angle, uv);
                for (f, g) in list.iter_mut().enumerate().filter(|(f, _)| turned[*f]) {
                    *g = before[f];
                }
                list
            }
        };
        let energy = InjectiveEnergy::new(metric, &field.angle, objective, (shape, anisotropy_share))
            .with_isoline_penalties(pulled);
        let newton = system.newton()?;
        let few = match start {
            Start::Map(_) | Start::Turned(_) => FEW_AT_FIRST,
            Start::Moved { .. } => FEW,
            Start::Here(_) => 0,
        };
        let (free, mut folded) = self.fitted(system, &wanted, few, progress)?;
        let mut found = system.injective(&energy, free.clone());
        if let (None, Start::Here(uv)) = (&found, start) {
            let by = (&*newton, &energy);
            match system.approach((&net.mesh, metric), by, (&field.angle, uv), progress)? {
                Ok(reached) => found = Some(reached),
                Err(ahead) if ahead.is_empty() => {}
                Err(ahead) => folded = ahead,
            }
        } else if found.is_none() && folded.len() <= few {
            let quarters = net.quarters();
            let triangles = system.triangles(&net.mesh, metric, field, objective)?;
            let unfolded = system.unfold(&triangles, (&free, &quarters), Effort::Quick, progress)?;
            tracing::debug!(folds = folded.len(), left = unfolded.folds.len(), "folds of the first guess");
            found = system.injective(&energy, unfolded.y.clone());
            // Of a step there are others; of a first map there is only one that is much worse.
            if found.is_none() && matches!(start, Start::Map(_) | Start::Turned(_)) {
                let whole = (&net.mesh, &quarters[..]);
                found = system.untangle(&newton, &energy, unfolded.y, whole, progress)?;
            }
        }
        let Some(mut at) = found else {
            tracing::debug!(folds = folded.len(), "the first guess folds");
            return Ok(Err(Folded(folded)));
        };
        system.descend(&newton, &energy, &mut at, steps, progress)?;
        let InjectiveMap { map, free, energy } = at;
        Ok(Ok(Solution { map, free, energy }))
    }

    /// The map whose gradients come nearest to those wanted, as far as can be without folds, and the triangles that fold.
    fn fitted(
        &self,
        system: &mut SeamlessSystem,
        wanted: &[[f64; 4]],
        few: usize,
        progress: &Progress,
    ) -> Result<(Vec<f64>, Vec<FaceId>), EmbeddingError> {
        let Self { net, metric, field, .. } = *self;
        let mut free = system.fit(metric, &field.angle, wanted, &[])?;
        let mut folded = folds(&system.map(&free).uv);
        let mut weight = vec![1.0; wanted.len()];
        for _ in 0..REFITS {
            progress.check()?;
            if folded.is_empty() || folded.len() > few {
                break;
            }
            let mut list = vec![false; wanted.len()];
            folded.iter().for_each(|f| list[f.index()] = true);
            raise(&net.mesh, &list, FIRMER, &mut weight);
            let again = system.fit(metric, &field.angle, wanted, &weight)?;
            let left = folds(&system.map(&again).uv);
            tracing::debug!(folds = folded.len(), left = left.len(), "fitted again");
            if left.len() >= folded.len() {
                break;
            }
            (free, folded) = (again, left);
        }
        Ok((free, folded))
    }
}

/// The gradients `∇u` and `∇v` in the frame of the field after that number of quarter turns with which they follow it best.
fn along_field([a, b, c, d]: [f64; 4]) -> [f64; 4] {
    let turned = [[a, b, c, d], [c, d, -a, -b], [-a, -b, -c, -d], [-c, -d, a, b]];
    turned.into_iter().max_by(|g, h| (g[0] + g[3]).total_cmp(&(h[0] + h[3]))).unwrap_or([a, b, c, d])
}

/// The angles of the field nearest to that of the drawing that a map follows which is given up to quarter turns.
fn directions(net: &EmbeddingTopology, metric: &Metric, uv: &[[DVec2; 3]]) -> Vec<f64> {
    let turned = |g: [f64; 4]| {
        let [a, b, c, d] = along_field(g);
        (b - c).atan2(a + d)
    };
    let off = gradients(metric, &net.angle, uv).into_iter().map(turned);
    net.angle.iter().zip(off).map(|(angle, off)| angle + off).collect()
}

/// The lengths that the field asks for, and the analysis of the system that they solve.
fn lengths(
    (mesh, metric): (&TriMesh, &Metric),
    angle: &[f64],
    jump: &[i32],
    symbolic: Option<SpdSymbolic>,
) -> Result<(Vec<[f64; 2]>, Option<SpdSymbolic>), SolveError> {
    let system = SizingSystem::new(mesh, metric, symbolic)?;
    let rest = residual_rotations(mesh, metric, angle, jump);
    Ok((system.lengths(mesh, metric, &rest)?, Some(system.symbolic())))
}

/// By what factor the anisotropy counts in each triangle: 0 where the surface bends alike in all directions, 1
/// where principal curvatures differ by as much as either is on average, and more where they differ more. It is
/// this difference, squared, by which the deviation from principal directions is measured.
fn anisotropy_share(mesh: &TriMesh, curvature: &[PrincipalCurvature]) -> Vec<f64> {
    let mean_at = |f: FaceId, of: fn(&PrincipalCurvature) -> f64| {
        mesh.face_vertices(f).iter().map(|v| of(&curvature[v.index()])).sum::<f64>() / 3.0
    };
    let (sum, area) = mesh.faces().fold((0.0, 0.0), |(sum, area), f| {
        let a = mesh.face_area(f);
        (sum + a * mean_at(f, |c| c.k_max * c.k_max + c.k_min * c.k_min), area + a)
    });
    let mean = (0.5 * sum / area).max(f64::MIN_POSITIVE);
    mesh.faces().map(|f| (mean_at(f, |c| (c.k_max - c.k_min).powi(2)) / mean).min(FIRMEST)).collect()
}

/// A guide as strong as it agrees with the field at hand; `None` where it does not.
///
/// The layout's structure prevails over principal directions: where both contradict each other, or a direction is
/// wrongly taken for its neighbour a quarter turn away, the field would turn by a quarter within a few triangles and
/// tear the map.
fn agreeing(guide: &field::DirectionPenalty, angle: f64) -> Option<field::DirectionPenalty> {
    let off = (guide.angle - angle) / FRAC_PI_2;
    let off = (off - off.round()).abs();
    let share = ((DISAGREES - off) / (DISAGREES - AGREES)).clamp(0.0, 1.0);
    (share > 0.0).then_some(field::DirectionPenalty { weight: guide.weight * share, ..*guide })
}
