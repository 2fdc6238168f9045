//! The distortion of patch maps, for each triangle of the surface.

use glam::DVec3;

use crate::embed::{PatchMeasures, TriangleMeasure};
use crate::layout::PatchMap;

/// Difference of the principal curvatures, as a fraction of its root mean square over the surface, above which principal
/// directions count as fully pronounced. Chosen by hand.
const PRONOUNCED: f64 = 0.5;

/// Distortion of a triangle: the mean over its parts in the patches, weighted by area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceDistortion {
    /// Conformal distortion, 2 at best.
    pub conformal: f64,
    /// Deviation of the gradients from the nearest principal direction, in degrees, 0 to 45.
    pub deviation: f64,
    /// How pronounced the principal directions are, 0 to 1.
    pub anisotropy: f64,
    /// Whether a part of the triangle is flipped.
    pub flipped: bool,
}

/// The distortion of each of `n_faces` triangles, from the maps of all patches and the measures of their triangles.
pub fn face_distortion(n_faces: usize, maps: &[PatchMap], triangles: &[Vec<TriangleMeasure>]) -> Vec<FaceDistortion> {
    let none = FaceDistortion { conformal: 0.0, deviation: 0.0, anisotropy: 0.0, flipped: false };
    let mut sums = vec![(0.0, none); n_faces];
    let (mut total, mut square) = (0.0, 0.0);
    for (map, measures) in maps.iter().zip(triangles) {
        for (&base, m) in map.base_face.iter().zip(measures) {
            let (area, sum) = &mut sums[base as usize];
            *area += m.area;
            sum.conformal += m.area * m.conformal;
            sum.deviation += m.area * m.deviation;
            // The measure is the square of the difference of curvatures.
            sum.anisotropy += m.area * m.anisotropy.sqrt();
            sum.flipped |= m.flipped;
            total += m.area;
            square += m.area * m.anisotropy;
        }
    }
    let full = PRONOUNCED * (square / f64::max(total, f64::MIN_POSITIVE)).sqrt();
    let mean = |(area, sum): (f64, FaceDistortion)| {
        let over = |x: f64| if area > 0.0 { x / area } else { 0.0 };
        FaceDistortion {
            conformal: over(sum.conformal).max(2.0),
            deviation: over(sum.deviation),
            anisotropy: if full > 0.0 { (over(sum.anisotropy) / full).min(1.0) } else { 0.0 },
            flipped: sum.flipped,
        }
    };
    sums.into_iter().map(mean).collect()
}

/// The largest aspect ratio of a patch, and the vertex of that patch whose image is nearest to the rectangle's centre.
pub fn largest_aspect(maps: &[PatchMap], patches: &[PatchMeasures]) -> (f64, DVec3) {
    let largest = (0..patches.len()).max_by(|&i, &j| patches[i].aspect.total_cmp(&patches[j].aspect));
    let Some(largest) = largest else { return (1.0, DVec3::ZERO) };
    let (map, aspect) = (&maps[largest], patches[largest].aspect);
    let from_centre = |v: usize| map.uv[v].distance_squared(0.5 * map.size);
    let centre = (0..map.uv.len()).min_by(|&a, &b| from_centre(a).total_cmp(&from_centre(b)));
    (aspect, centre.map_or(DVec3::ZERO, |v| map.mesh.positions()[v]))
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::mesh::TriMesh;

    #[test]
    fn a_triangle_takes_the_mean_of_its_parts() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.5, 0.5, 0.0)];
        let mesh = TriMesh::from_faces(points.to_vec(), &[[0, 1, 3], [0, 3, 2]]).unwrap();
        let map = PatchMap {
            parent: vec![0, 1, 2, 3],
            base_face: vec![1, 1],
            uv: points.iter().map(|p| DVec2::new(p.x, p.y)).collect(),
            size: DVec2::ONE,
            flipped: 0,
            mesh,
        };
        let part = |area, conformal, flipped| TriangleMeasure {
            area,
            conformal,
            deviation: 10.0,
            torsion: 0.0,
            anisotropy: 4.0,
            flipped,
        };
        let found = face_distortion(2, &[map], &[vec![part(1.0, 2.0, false), part(3.0, 4.0, true)]]);
        assert_eq!(found[1], FaceDistortion { conformal: 3.5, deviation: 10.0, anisotropy: 1.0, flipped: true });
        assert_eq!((found[0].conformal, found[0].flipped), (2.0, false));
    }
}
