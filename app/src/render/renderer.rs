//! Keeps buffers on the GPU, and redraws the surface only when something has changed.

use std::sync::Arc;

use super::pipelines::{MarkerInstance, Pipelines, SegmentInstance};
use super::scene::{Marker, Polyline, SceneInput, SurfaceMesh, Toggles, ViewUniforms};
use super::target::Target;

/// One image to draw.
#[derive(Debug, Clone)]
pub struct Frame {
    /// What to draw.
    pub scene: SceneInput,
    /// The view.
    pub view: ViewUniforms,
    /// How to draw the surface.
    pub toggles: Toggles,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Pixels per point: scale of line widths and marker radii.
    pub pixels_per_point: f32,
}

/// Draws [`Frame`]s: [`Self::prepare`], then [`Self::paint`] in a pass of the output format.
pub struct Renderer {
    pipelines: Pipelines,
    uniforms: wgpu::Buffer,
    view_group: wgpu::BindGroup,
    target: Option<Target>,
    surface: Option<(Arc<SurfaceMesh>, Instances)>,
    bands: Option<(Arc<SurfaceMesh>, Instances)>,
    lines: Option<(Arc<Vec<Polyline>>, Instances)>,
    markers: Option<(Arc<Vec<Marker>>, Instances)>,
    /// The view that the target shows.
    drawn: Option<ViewUniforms>,
    redraws: u64,
}

/// A buffer of vertices or instances, and the number in use.
struct Instances {
    buffer: wgpu::Buffer,
    count: u32,
}

impl Instances {
    /// Writes `data` to the buffer of `old` if it fits, else to a new one with a quarter more room.
    fn write<T: bytemuck::Pod>(old: Option<Self>, device: &wgpu::Device, queue: &wgpu::Queue, data: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let needed = bytes.len() as u64;
        let fits = |i: &Self| i.buffer.size() >= needed && i.buffer.size() / 4 <= needed.max(4096);
        let buffer = match old.filter(fits) {
            Some(old) => old.buffer,
            None => device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: (needed + needed / 4).next_multiple_of(256).max(256),
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
        };
        queue.write_buffer(&buffer, 0, bytes);
        Self { buffer, count: data.len() as u32 }
    }
}

impl Renderer {
    /// A renderer whose [`Self::paint`] goes into passes of format `output` (display-encoded, not sRGB).
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat) -> Self {
        let pipelines = Pipelines::new(device, output);
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<ViewUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &pipelines.view_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() }],
        });
        Self {
            pipelines,
            uniforms,
            view_group,
            target: None,
            surface: None,
            bands: None,
            lines: None,
            markers: None,
            drawn: None,
            redraws: 0,
        }
    }

    /// How often the surface was drawn.
    pub fn redraws(&self) -> u64 {
        self.redraws
    }

    /// Uploads what has changed, and redraws the surface if necessary.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame,
    ) {
        let limit = device.limits().max_texture_dimension_2d;
        let size = frame.size.map(|s| s.clamp(1, limit));
        let view = frame.view.with_frame(size, frame.toggles, frame.pixels_per_point);
        let mut dirty = self.drawn != Some(view);
        if dirty {
            queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&view));
        }
        if self.target.as_ref().is_none_or(|t| t.size != size) {
            self.target = Some(Target::new(device, &self.pipelines.target_layout, size));
            dirty = true;
        }
        for (slot, mesh) in [(&mut self.surface, &frame.scene.surface), (&mut self.bands, &frame.scene.bands)] {
            dirty |= upload(slot, mesh, |old, mesh| Instances::write(old, device, queue, &mesh.vertices));
        }
        upload(&mut self.lines, &frame.scene.lines, |old, lines| {
            let segments: Vec<_> = lines.iter().flat_map(segments).collect();
            Instances::write(old, device, queue, &segments)
        });
        upload(&mut self.markers, &frame.scene.markers, |old, markers| {
            let instances: Vec<_> = markers.iter().map(marker).collect();
            Instances::write(old, device, queue, &instances)
        });
        if dirty {
            self.draw_surface(encoder);
            self.drawn = Some(view);
        }
    }

    fn draw_surface(&mut self, encoder: &mut wgpu::CommandEncoder) {
        let Some(target) = &self.target else { return };
        let mut pass = target.begin(encoder);
        self.redraws += 1;
        pass.set_bind_group(0, &self.view_group, &[]);
        for (pipeline, mesh) in [(&self.pipelines.surface, &self.surface), (&self.pipelines.bands, &self.bands)] {
            if let Some((_, mesh)) = mesh.as_ref().filter(|(_, m)| m.count > 0) {
                pass.set_pipeline(pipeline);
                pass.set_vertex_buffer(0, mesh.buffer.slice(..));
                pass.draw(0..mesh.count, 0..1);
            }
        }
    }

    /// Draws the prepared image in `pass`, whose viewport has the size of the frame.
    pub fn paint(&self, pass: &mut wgpu::RenderPass<'_>) {
        let Some(target) = &self.target else { return };
        pass.set_bind_group(0, &self.view_group, &[]);
        pass.set_bind_group(1, &target.bind_group, &[]);
        pass.set_pipeline(&self.pipelines.image);
        pass.draw(0..3, 0..1);
        let mut instances = |pipeline, instances: Option<&Instances>| {
            if let Some(i) = instances.filter(|i| i.count > 0) {
                pass.set_pipeline(pipeline);
                pass.set_vertex_buffer(0, i.buffer.slice(..));
                pass.draw(0..4, 0..i.count);
            }
        };
        instances(&self.pipelines.line, self.lines.as_ref().map(|l| &l.1));
        instances(&self.pipelines.marker, self.markers.as_ref().map(|m| &m.1));
    }
}

/// Uploads `new` to `slot` unless it holds the same `Arc`. Returns whether it was uploaded.
fn upload<T>(
    slot: &mut Option<(Arc<T>, Instances)>,
    new: &Arc<T>,
    write: impl FnOnce(Option<Instances>, &T) -> Instances,
) -> bool {
    if slot.as_ref().is_some_and(|(held, _)| Arc::ptr_eq(held, new)) {
        return false;
    }
    let old = slot.take().map(|(_, instances)| instances);
    *slot = Some((Arc::clone(new), write(old, new)));
    true
}

fn segments(line: &Polyline) -> impl Iterator<Item = SegmentInstance> {
    let n = line.points.len();
    let count = if n < 2 { 0 } else { n - usize::from(!line.closed) };
    (0..count).map(move |i| {
        let before = if line.closed { (i + n - 1) % n } else { i.saturating_sub(1) };
        let after = if line.closed { (i + 2) % n } else { (i + 2).min(n - 1) };
        SegmentInstance {
            before: line.points[before],
            start: line.points[i],
            end: line.points[(i + 1) % n],
            after: line.points[after],
            colour: line.colour,
            style: [line.width, line.hidden],
        }
    })
}

fn marker(m: &Marker) -> MarkerInstance {
    MarkerInstance {
        position: m.position,
        colour: m.colour,
        style: [m.radius, m.hidden, f32::from(u8::from(m.square))],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_closed_line_has_a_segment_more_than_an_open_one() {
        let points = vec![[0.0; 3], [1.0; 3], [2.0; 3]];
        let line = |points, closed| Polyline { points, closed, colour: [0; 4], width: 1.0, hidden: 0.0 };
        assert_eq!(segments(&line(points.clone(), false)).count(), 2);
        let last = segments(&line(points, true)).last().unwrap();
        assert_eq!((last.before, last.start, last.end, last.after), ([1.0; 3], [2.0; 3], [0.0; 3], [1.0; 3]));
    }

    #[test]
    fn a_single_point_is_no_line() {
        let line = Polyline { points: vec![[0.0; 3]], closed: true, colour: [0; 4], width: 1.0, hidden: 0.0 };
        assert_eq!(segments(&line).count(), 0);
    }
}
