//! Meshing of an implicit function by surface nets, and cuts at planes.

use std::collections::HashMap;

use fast_surface_nets::ndshape::{RuntimeShape, Shape as _};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::{DVec3, UVec3};

use super::shapes::Shape;

/// A triangle soup with shared vertices; each boundary vertex has the plane it lies on.
#[derive(Default)]
pub struct Soup {
    pub positions: Vec<DVec3>,
    pub plane: Vec<Option<usize>>,
    pub faces: Vec<[u32; 3]>,
}

/// Meshes the zero set of a shape with about its edge length, and cuts it.
pub fn extract(shape: &Shape) -> Soup {
    let n = ((shape.max - shape.min) / shape.edge).ceil().as_uvec3() + UVec3::splat(3);
    let grid = RuntimeShape::<u32, 3>::new(n.to_array());
    let at = |p: DVec3| shape.min + (p - 1.0) * shape.edge;
    let samples: Vec<f32> =
        (0..grid.size()).map(|i| (shape.field)(at(UVec3::from(grid.delinearize(i)).as_dvec3())) as f32).collect();
    let mut net = SurfaceNetsBuffer::default();
    surface_nets(&samples, &grid, [0; 3], (n - 1).to_array(), &mut net);

    let positions = net.positions.iter().map(|&p| shape.project(at(glam::Vec3::from(p).as_dvec3()), None));
    let mut soup = Soup { positions: positions.collect(), plane: vec![None; net.positions.len()], faces: Vec::new() };
    soup.faces = net.indices.chunks_exact(3).map(|f| [f[0], f[1], f[2]]).collect();
    face_outwards(shape, &mut soup);
    for plane in 0..shape.cuts.len() {
        cut(shape, &mut soup, plane);
    }
    soup
}

/// Reverses all faces if their normals point against the gradient.
fn face_outwards(shape: &Shape, soup: &mut Soup) {
    let along: f64 =
        soup.faces.iter().map(|&f| normal(&soup.positions, f).dot(shape.gradient(soup.positions[f[0] as usize]))).sum();
    if along < 0.0 {
        soup.faces.iter_mut().for_each(|f| f.swap(1, 2));
    }
}

/// The unit normal of a face times twice its area.
pub fn normal(positions: &[DVec3], face: [u32; 3]) -> DVec3 {
    let [a, b, c] = face.map(|v| positions[v as usize]);
    (b - a).cross(c - a)
}

/// Cuts off the part beyond a plane; the new boundary lies in the plane.
fn cut(shape: &Shape, soup: &mut Soup, plane: usize) {
    let (direction, offset) = shape.cuts[plane];
    let beyond: Vec<f64> = soup.positions.iter().map(|p| direction.dot(*p) - offset).collect();
    let mut cut_vertex: HashMap<(u32, u32), u32> = HashMap::new();
    let mut kept = Vec::new();
    for face in std::mem::take(&mut soup.faces) {
        let mut outline = Vec::new();
        for i in 0..3 {
            let (a, b) = (face[i], face[(i + 1) % 3]);
            let (da, db) = (beyond[a as usize], beyond[b as usize]);
            if da <= 0.0 {
                outline.push(a);
            }
            if (da <= 0.0) != (db <= 0.0) {
                outline.push(*cut_vertex.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let (pa, pb) = (soup.positions[a as usize], soup.positions[b as usize]);
                    soup.positions.push(shape.project(pa.lerp(pb, da / (da - db)), Some(plane)));
                    soup.plane.push(Some(plane));
                    soup.positions.len() as u32 - 1
                }));
            }
        }
        for i in 2..outline.len() {
            kept.push([outline[0], outline[i - 1], outline[i]]);
        }
    }
    soup.faces = kept;
}
