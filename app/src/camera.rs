//! The camera: a turntable around a target, with pan, zoom toward a point, and framing.
//!
//! World space is right-handed. The axis of the turntable is world y, or z with [`Camera::z_up`]. Angles are in
//! radians, lengths in world units (models have size 1), screen positions in points from the top
//! left corner.

use glam::{Mat4, Vec2, Vec3, Vec3Swizzles, Vec4Swizzles};

use crate::render::ViewUniforms;

/// Least and largest distance of the eye from the target, so that the model cannot get lost. Chosen by hand.
const DISTANCES: std::ops::RangeInclusive<f32> = 0.005..=20.0;
/// Largest pitch, just below π/2, where the up direction is not defined.
const MAX_PITCH: f32 = 1.55;
/// Share of the image that a framed model fills.
const FILLED: f32 = 0.86;
/// Rotation per point of drag, in radians: half a turn for 450 points.
const TURN: f32 = 0.007;

/// A turntable camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The point the camera turns about and looks at.
    pub target: Vec3,
    /// Distance from the target to the eye.
    pub distance: f32,
    /// Rotation about the up axis; 0 looks along −z.
    pub yaw: f32,
    /// Elevation of the eye above the target; positive looks down.
    pub pitch: f32,
    /// Whether the turntable's axis is world z instead of y.
    pub z_up: bool,
    /// Vertical field of view.
    pub vertical_fov: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self { target: Vec3::ZERO, distance: 1.9, yaw: 0.6, pitch: 0.35, z_up: false, vertical_fov: 0.60 }
    }
}

/// A ray in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// The eye.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

impl Camera {
    /// The rigid transformation from view space (looking along −z, y up) to world space.
    pub fn world_from_view(&self) -> Mat4 {
        let turn = Mat4::from_rotation_y(self.yaw) * Mat4::from_rotation_x(-self.pitch);
        let up = if self.z_up { Mat4::from_rotation_x(std::f32::consts::FRAC_PI_2) } else { Mat4::IDENTITY };
        Mat4::from_translation(self.target) * up * turn * Mat4::from_translation(Vec3::Z * self.distance)
    }

    /// The inverse of [`Self::world_from_view`].
    pub fn view_from_world(&self) -> Mat4 {
        self.world_from_view().inverse()
    }

    /// Distances of the near and the far clipping plane. The far plane is beyond the model wherever the target is.
    pub fn planes(&self) -> (f32, f32) {
        (self.distance * 0.02, self.distance + 8.0)
    }

    /// The projection for an image of this aspect ratio; depth from 0 (near) to 1 (far).
    pub fn clip_from_view(&self, aspect_ratio: f32) -> Mat4 {
        let (near, far) = self.planes();
        glam::camera::rh::proj::directx::perspective(self.vertical_fov, aspect_ratio, near, far)
    }

    /// The view for an image of `size`, for the shaders.
    pub fn uniforms(&self, size: Vec2) -> ViewUniforms {
        let (near, far) = self.planes();
        ViewUniforms::new(self.clip_from_view(aspect(size)), self.view_from_world(), [near, far], self.distance)
    }

    /// The ray through `at` in an image of `size`.
    pub fn ray(&self, at: Vec2, size: Vec2) -> Ray {
        let half = (self.vertical_fov * 0.5).tan();
        let ndc = Vec2::new(at.x / size.x.max(1.0) * 2.0 - 1.0, 1.0 - at.y / size.y.max(1.0) * 2.0);
        let in_view = Vec3::new(ndc.x * half * aspect(size), ndc.y * half, -1.0).normalize();
        let world_from_view = self.world_from_view();
        Ray {
            origin: world_from_view.transform_point3(Vec3::ZERO),
            direction: world_from_view.transform_vector3(in_view),
        }
    }

    /// Where `point` appears in an image of `size`; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: Vec2) -> Option<Vec2> {
        let clip = self.clip_from_view(aspect(size)) * self.view_from_world() * point.extend(1.0);
        let ndc = clip.xy() / clip.w;
        (clip.w > 0.0).then(|| (ndc * Vec2::new(0.5, -0.5) + 0.5) * size)
    }

    /// Rotates by a drag of `delta` points.
    pub fn orbit(&mut self, delta: Vec2) {
        self.yaw = (self.yaw - delta.x * TURN).rem_euclid(std::f32::consts::TAU);
        self.pitch = (self.pitch + delta.y * TURN).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// Moves parallel to the image by a drag of `delta` points, so that the target follows the pointer.
    pub fn pan(&mut self, delta: Vec2, size: Vec2) {
        let per_point = 2.0 * self.distance * (self.vertical_fov * 0.5).tan() / size.y.max(1.0);
        let world_from_view = self.world_from_view();
        self.target += world_from_view.transform_vector3(Vec3::new(-delta.x, delta.y, 0.0)) * per_point;
    }

    /// Scales the distance by `factor`: below 1 zooms in. The point `toward` keeps its place on the screen.
    pub fn zoom(&mut self, factor: f32, toward: Vec3) {
        let distance = (self.distance * factor).clamp(*DISTANCES.start(), *DISTANCES.end());
        let factor = distance / self.distance;
        self.target = toward + (self.target - toward) * factor;
        self.distance = distance;
    }

    /// The point under `at` at the depth of the target, to zoom to where there is no surface.
    pub fn point_at_target_depth(&self, at: Vec2, size: Vec2) -> Vec3 {
        let ray = self.ray(at, size);
        let forward = (self.target - ray.origin).normalize();
        ray.origin + ray.direction * (self.distance / ray.direction.dot(forward).max(1e-3))
    }

    /// Moves target and distance so that `points` fill the image up to a margin. The direction of view stays.
    pub fn frame(&mut self, points: &[Vec3], size: Vec2) {
        if points.is_empty() {
            return;
        }
        let sum: Vec3 = points.iter().sum();
        self.target = sum / points.len() as f32;
        let reach = points.iter().map(|p| p.distance(self.target)).fold(1e-3, f32::max);
        let half = (self.vertical_fov * 0.5).tan();
        let limits = Vec2::new(half * aspect(size), half) * FILLED;
        self.distance = 2.0 * reach / limits.min_element();
        // In perspective the fit is a fixed point of this iteration, which converges in a few steps.
        for _ in 0..6 {
            let view_from_world = self.view_from_world();
            let slope = |p: &Vec3| {
                let v = view_from_world.transform_point3(*p);
                v.xy() / (-v.z).max(1e-3 * self.distance)
            };
            let (low, high) =
                points.iter().map(slope).fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), s| (l.min(s), h.max(s)));
            let shift = (low + high) * 0.5 * self.distance;
            self.target += self.world_from_view().transform_vector3(shift.extend(0.0));
            let factor = ((high - low) * 0.5 / limits).max_element();
            self.distance = (self.distance * factor).clamp(*DISTANCES.start(), *DISTANCES.end());
        }
    }
}

fn aspect(size: Vec2) -> f32 {
    (size.x.max(1.0) / size.y.max(1.0)).clamp(0.01, 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Vec2 = Vec2::new(800.0, 500.0);

    #[test]
    fn the_target_is_in_the_middle() {
        for z_up in [false, true] {
            let camera = Camera { target: Vec3::new(0.1, 0.2, -0.3), z_up, ..Camera::default() };
            let middle = camera.project(camera.target, SIZE).unwrap();
            assert!(middle.distance(SIZE * 0.5) < 1e-2, "{middle}");
        }
    }

    #[test]
    fn rays_and_projection_are_inverse() {
        let camera = Camera { yaw: 2.0, pitch: -0.7, ..Camera::default() };
        let at = Vec2::new(123.0, 321.0);
        let ray = camera.ray(at, SIZE);
        assert!(camera.project(ray.origin + ray.direction * 1.7, SIZE).unwrap().distance(at) < 1e-2);
        assert_eq!(camera.project(ray.origin - ray.direction, SIZE), None);
    }

    #[test]
    fn zooming_keeps_the_point_under_the_pointer() {
        let mut camera = Camera::default();
        let at = Vec2::new(600.0, 100.0);
        let point = camera.point_at_target_depth(at, SIZE);
        for factor in [0.5, 0.5, 1.7] {
            camera.zoom(factor, point);
            assert!(camera.project(point, SIZE).unwrap().distance(at) < 0.1);
        }
        camera.zoom(1e9, point);
        assert_eq!(camera.distance, *DISTANCES.end());
    }

    #[test]
    fn panning_moves_the_picture_with_the_pointer() {
        let mut camera = Camera::default();
        let marked = camera.target;
        camera.pan(Vec2::new(40.0, -25.0), SIZE);
        let seen = camera.project(marked, SIZE).unwrap();
        assert!(seen.distance(SIZE * 0.5 + Vec2::new(40.0, -25.0)) < 0.5, "{seen}");
    }

    #[test]
    fn dragging_right_shows_the_left_side() {
        let mut camera = Camera { yaw: 0.0, pitch: 0.0, ..Camera::default() };
        camera.orbit(Vec2::new(100.0, 0.0));
        assert!(camera.ray(SIZE * 0.5, SIZE).origin.x < -0.1);
        camera.orbit(Vec2::new(0.0, 1e6));
        assert_eq!(camera.pitch, MAX_PITCH);
    }

    #[test]
    fn a_framed_model_fills_the_image_and_fits() {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32 * 0.3, (i >> 2 & 1) as f32 * 0.2) + 0.4;
        let points: Vec<Vec3> = (0..8).map(corner).collect();
        for size in [SIZE, Vec2::new(300.0, 900.0)] {
            for yaw in [0.0, 1.0, 4.0] {
                let mut camera = Camera { yaw, ..Camera::default() };
                camera.frame(&points, size);
                let seen: Vec<Vec2> = points.iter().map(|&p| camera.project(p, size).unwrap() / size).collect();
                let low = seen.iter().copied().fold(Vec2::INFINITY, Vec2::min);
                let high = seen.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max);
                assert!(low.min_element() > 0.03 && high.max_element() < 0.97, "{low} to {high} in {size}");
                assert!((high - low).max_element() > 0.8, "{low} to {high} in {size}");
            }
        }
    }

    #[test]
    fn nothing_to_frame_leaves_the_camera() {
        let mut camera = Camera::default();
        camera.frame(&[], SIZE);
        assert_eq!(camera, Camera::default());
    }
}
