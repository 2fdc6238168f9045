//! What the renderer draws, as plain data. Positions are in world space, colours in display (gamma) space.

use std::sync::Arc;

use glam::{Mat4, Vec3};

/// A corner of a triangle as `surface.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SurfaceVertex {
    /// Position in world space.
    pub position: [f32; 3],
    /// Normal; need not have unit length.
    pub normal: [f32; 3],
    /// Colour over the material; alpha is its strength.
    pub tint: [u8; 4],
    /// The stripe patterns of up to two strips.
    pub stripes: [SurfaceStripes; 2],
}

/// A corner of a triangle in the stripe pattern of one strip. All zero: no pattern.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SurfaceStripes {
    /// Signed distance of the corner from the spine. Lengths are those of world space.
    pub distance: f32,
    /// For each side of the triangle, the excess of the distance over linear interpolation: the distance
    /// at barycentric coordinates `w` is `Σ w_i distance_i + 2 Σ w_i w_{i+1} excess_i`. Then the distance at which the strip ends. The same at all corners of a triangle.
    /// Stored as fractions of [`Self::LARGEST`].
    shape: [i16; 4],
    /// Colour of the strip, the same at all corners; alpha is the strength of the pattern at this corner.
    pub colour: [u8; 4],
}

impl SurfaceStripes {
    /// The largest excess and the largest end that can be stored; `surface.wgsl` has the same numbers.
    const LARGEST: [f64; 2] = [0.05, 2.0];

    /// A corner with `distance` from the spine.
    pub fn new(distance: f64, bulge: [f64; 3], reach: f64, colour: [u8; 4]) -> Self {
        let packed =
            |value: f64, largest: f64| ((value / largest).clamp(-1.0, 1.0) * f64::from(i16::MAX)).round() as i16;
        let [a, b, c] = bulge.map(|b| packed(b, Self::LARGEST[0]));
        Self { distance: distance as f32, shape: [a, b, c, packed(reach, Self::LARGEST[1])], colour }
    }
}

/// Triangles, each with three corners of its own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Three per triangle.
    pub vertices: Vec<SurfaceVertex>,
}

/// A polyline of constant width on the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    /// The points; a closed line does not repeat its first point.
    pub points: Vec<[f32; 3]>,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// Red, green, blue, alpha; not premultiplied.
    pub colour: [u8; 4],
    /// Width in points.
    pub width: f32,
    /// Opacity of the parts behind the surface, relative to those in front, 0 to 1.
    pub hidden: f32,
}

/// A disc or a square of constant size on the screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Centre in world space.
    pub position: [f32; 3],
    /// Red, green, blue, alpha; not premultiplied.
    pub colour: [u8; 4],
    /// Radius in points.
    pub radius: f32,
    /// Opacity behind the surface, relative to that in front, 0 to 1.
    pub hidden: f32,
    /// Whether it is a square with a pale core instead of a disc.
    pub square: bool,
}

/// Everything in a picture except the view. A part is uploaded again only if its `Arc` is another.
#[derive(Debug, Clone, Default)]
pub struct SceneInput {
    /// The surface.
    pub surface: Arc<SurfaceMesh>,
    /// Triangles on the surface of which only the stripe patterns are drawn, over those of the surface: for a proposal, which
    /// changes more often than the surface. They need not be triangles of `surface`.
    pub bands: Arc<SurfaceMesh>,
    /// Lines, later ones over earlier ones.
    pub lines: Arc<Vec<Polyline>>,
    /// Markers, over all lines.
    pub markers: Arc<Vec<Marker>>,
}

/// Options of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Toggles {
    /// The stripe pattern of the strips.
    pub stripes: bool,
    /// The edges of the triangles.
    pub wireframe: bool,
    /// The colours of the regions.
    pub tint: bool,
}

impl Default for Toggles {
    fn default() -> Self {
        Self { stripes: true, wireframe: false, tint: true }
    }
}

/// The view as the shaders read it (`View` in both files).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ViewUniforms {
    clip_from_world: [[f32; 4]; 4],
    /// Fourth component of the first: image heights per unit of length, at the distance of what is looked at.
    axes: [[f32; 4]; 3],
    eye: [f32; 4],
    size_and_planes: [f32; 4],
    toggles: [f32; 4],
}

impl ViewUniforms {
    /// A perspective view. `clip_from_view` maps depth to 0 (near) .. 1 (far); `view_from_world` is rigid; `near` and
    /// `far` are the distances of the clipping planes, `focus` that of what is looked at. The renderer fills in size and
    /// toggles.
    pub fn new(clip_from_view: Mat4, view_from_world: Mat4, [near, far]: [f32; 2], focus: f32) -> Self {
        let world_from_view = view_from_world.inverse();
        let axis = |i: usize| world_from_view.col(i).to_array();
        let [mut right, up, toward] = [axis(0), axis(1), axis(2)];
        right[3] = clip_from_view.y_axis.y / (2.0 * focus);
        Self {
            clip_from_world: (clip_from_view * view_from_world).to_cols_array_2d(),
            axes: [right, up, toward],
            eye: world_from_view.transform_point3(Vec3::ZERO).extend(1.0).to_array(),
            size_and_planes: [1.0, 1.0, near, far],
            toggles: [0.0; 4],
        }
    }

    pub(super) fn with_frame(mut self, size: [u32; 2], toggles: Toggles, pixels_per_point: f32) -> Self {
        self.size_and_planes[0] = size[0] as f32;
        self.size_and_planes[1] = size[1] as f32;
        let on = |b: bool| f32::from(u8::from(b));
        self.toggles = [on(toggles.stripes), on(toggles.wireframe), on(toggles.tint), pixels_per_point];
        self
    }
}
