//! Rendering without a window or a display, to a texture that is read back.

use std::io::Write as _;
use std::path::Path;

use plait_core::output::{self, FileKind, OutputError};
use thiserror::Error;

use super::renderer::{Frame, Renderer};

/// Why rendering without a display failed.
#[derive(Debug, Error)]
pub enum HeadlessError {
    /// No Vulkan or OpenGL driver.
    #[error("no graphics driver was found (on Debian, mesa-vulkan-drivers brings a software one): {0}")]
    NoAdapter(String),
    /// The driver failed.
    #[error("the graphics driver failed: {0}")]
    Device(String),
    /// The picture could not be encoded.
    #[error("the picture cannot be encoded: {0}")]
    Encode(#[from] image::ImageError),
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] OutputError),
}

/// A graphics device without a display, and a renderer on it.
pub struct Headless {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
}

/// Format of the image.
const OUTPUT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl Headless {
    /// Opens the default graphics driver, which may be a software renderer.
    ///
    /// # Errors
    ///
    /// When no driver works.
    pub fn new() -> Result<Self, HeadlessError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|e| HeadlessError::NoAdapter(e.to_string()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))
            .map_err(|e| HeadlessError::Device(e.to_string()))?;
        let renderer = Renderer::new(&device, OUTPUT);
        Ok(Self { device, queue, renderer })
    }

    /// Renders one frame.
    ///
    /// # Errors
    ///
    /// When the driver fails.
    pub fn render(&mut self, frame: &Frame) -> Result<image::RgbaImage, HeadlessError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        let [width, height] = frame.size.map(|s| s.clamp(1, limit));
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: OUTPUT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer.prepare(&self.device, &self.queue, &mut encoder, frame);
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("picture"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &texture.create_view(&wgpu::TextureViewDescriptor::default()),
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            });
            self.renderer.paint(&mut pass);
        }
        self.read_back(encoder, &texture, width, height)
    }

    fn read_back(
        &self,
        mut encoder: wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        width: u32,
        height: u32,
    ) -> Result<image::RgbaImage, HeadlessError> {
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| HeadlessError::Device(e.to_string()))?;
        let mapped = receiver.recv().map_err(|e| HeadlessError::Device(e.to_string()))?;
        mapped.map_err(|e| HeadlessError::Device(e.to_string()))?;
        let view = buffer.get_mapped_range(..).map_err(|e| HeadlessError::Device(e.to_string()))?;
        let pixels: Vec<u8> = view.chunks(row as usize).flat_map(|r| &r[..width as usize * 4]).copied().collect();
        image::RgbaImage::from_raw(width, height, pixels)
            .ok_or_else(|| HeadlessError::Device("the image read back has the wrong size".into()))
    }
}

/// Renders one frame to a PNG file.
///
/// # Errors
///
/// When no driver works or the file cannot be written.
pub fn render_to_png(frame: &Frame, path: &Path) -> Result<(), HeadlessError> {
    let picture = Headless::new()?.render(frame)?;
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png)?;
    Ok(output::write(path, FileKind::Png, |out| out.write_all(png.get_ref()))?)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec2;

    use super::*;
    use crate::camera::Camera;
    use crate::render::{Marker, Polyline, SceneInput, SurfaceMesh, SurfaceStripes, SurfaceVertex, Toggles};

    const SIZE: [u32; 2] = [200, 160];
    const BLUE: [u8; 4] = [20, 60, 220, 255];

    /// A square in the plane z = 0, with lines and markers.
    fn frame(stripes: bool, lines: Vec<Polyline>, markers: Vec<Marker>) -> Frame {
        let corner = |x: f32, y: f32| SurfaceVertex {
            position: [x, y, 0.0],
            normal: [0.0, 0.0, 1.0],
            tint: [0; 4],
            stripes: [SurfaceStripes::new(f64::from(x), [0.0; 3], 0.3, BLUE), SurfaceStripes::default()],
        };
        let [a, b, c, d] = [corner(-0.4, -0.4), corner(0.4, -0.4), corner(0.4, 0.4), corner(-0.4, 0.4)];
        let camera = Camera { yaw: 0.0, pitch: 0.0, ..Camera::default() };
        Frame {
            scene: SceneInput {
                surface: Arc::new(SurfaceMesh { vertices: vec![a, b, c, a, c, d] }),
                lines: Arc::new(lines),
                markers: Arc::new(markers),
                ..SceneInput::default()
            },
            view: camera.uniforms(Vec2::new(SIZE[0] as f32, SIZE[1] as f32)),
            toggles: Toggles { stripes, ..Toggles::default() },
            size: SIZE,
            pixels_per_point: 1.0,
        }
    }

    fn line(z: f32, hidden: f32) -> Polyline {
        let points = vec![[-0.3, 0.0, z], [0.0, 0.0, z], [0.3, 0.0, z]];
        Polyline { points, closed: false, colour: [0, 255, 0, 255], width: 4.0, hidden }
    }

    fn greens(picture: &image::RgbaImage) -> usize {
        picture.pixels().filter(|p| p[1] > 200 && p[0] < 60).count()
    }

    #[test]
    fn lines_are_visible_in_front_of_the_surface_only() {
        let mut gpu = Headless::new().unwrap();
        let front = gpu.render(&frame(false, vec![line(0.0, 0.0)], vec![])).unwrap();
        // 0.6 units of a width of about 1.47 units on 200 pixels, four pixels wide.
        assert!((200..600).contains(&greens(&front)), "{}", greens(&front));
        let behind = gpu.render(&frame(false, vec![line(-0.3, 0.0)], vec![])).unwrap();
        assert_eq!(greens(&behind), 0);
        let faint = gpu.render(&frame(false, vec![line(-0.3, 0.3)], vec![])).unwrap();
        assert_ne!(faint, behind);
    }

    #[test]
    fn joints_of_transparent_lines_are_not_drawn_twice() {
        let mut gpu = Headless::new().unwrap();
        let mut half = line(0.01, 0.0);
        half.colour[3] = 128;
        let whole = Polyline { points: vec![half.points[0], half.points[2]], ..half.clone() };
        let (jointed, whole) =
            (gpu.render(&frame(false, vec![half], vec![])), gpu.render(&frame(false, vec![whole], vec![])));
        let (jointed, whole) = (jointed.unwrap(), whole.unwrap());
        let worst = jointed.pixels().zip(whole.pixels()).map(|(a, b)| a[1].abs_diff(b[1])).max();
        assert!(worst.is_some_and(|w| w < 12), "{worst:?}");
    }

    #[test]
    fn a_square_marker_covers_more_than_a_disc_but_not_its_core() {
        let mut gpu = Headless::new().unwrap();
        let marker =
            Marker { position: [0.1, 0.1, 0.0], colour: [0, 255, 0, 255], radius: 6.0, hidden: 0.0, square: false };
        let disc = greens(&gpu.render(&frame(false, vec![], vec![marker.clone()])).unwrap());
        assert!((50..130).contains(&disc), "{disc}");
        let square = Marker { square: true, radius: 9.0, ..marker };
        let square = greens(&gpu.render(&frame(false, vec![], vec![square])).unwrap());
        assert!(square > disc && square < 15 * 15, "{square}");
    }

    #[test]
    fn stripes_are_drawn_only_when_they_are_on() {
        let mut gpu = Headless::new().unwrap();
        let blue = |p: &image::RgbaImage| p.pixels().filter(|p| p[2] > p[0].saturating_add(40)).count();
        assert_eq!(blue(&gpu.render(&frame(false, vec![], vec![])).unwrap()), 0);
        assert!(blue(&gpu.render(&frame(true, vec![], vec![])).unwrap()) > 300);
    }

    /// How blue the pixels of the middle row are.
    fn blueness(picture: &image::RgbaImage) -> Vec<i32> {
        let pixel = |x| picture.get_pixel(x, picture.height() / 2);
        (0..picture.width()).map(|x| i32::from(pixel(x)[2]) - i32::from(pixel(x)[0])).collect()
    }

    /// Widths of the lines of a row, in pixels: the blueness of each in units of the largest, summed over the line.
    fn line_widths(row: &[i32]) -> Vec<f64> {
        let (fill, line) = (row[row.len() / 2 + 4], row.iter().copied().max().unwrap());
        let part = |b: i32| (f64::from(b - fill) / f64::from(line - fill)).max(0.0);
        let inside = row.iter().map(|&b| if 2 * (b - fill) > (line - fill) / 4 { part(b) } else { 0.0 });
        let sums = inside.fold(vec![0.0], |mut sums: Vec<f64>, p| {
            match (p > 0.0, sums.last().copied()) {
                (true, _) => *sums.last_mut().unwrap() += p,
                (false, Some(last)) if last > 0.0 => sums.push(0.0),
                _ => {}
            }
            sums
        });
        sums.into_iter().filter(|&s| s > 0.0).collect()
    }

    /// The frame with the camera at this distance.
    fn from_distance(distance: f32) -> Frame {
        let camera = Camera { yaw: 0.0, pitch: 0.0, distance, ..Camera::default() };
        Frame { view: camera.uniforms(Vec2::new(SIZE[0] as f32, SIZE[1] as f32)), ..frame(true, vec![], vec![]) }
    }

    #[test]
    fn lines_of_stripes_have_the_same_width_and_about_the_same_distance_however_near_the_eye_is() {
        let mut gpu = Headless::new().unwrap();
        for distance in [0.35, 0.5, 0.8] {
            let widths = line_widths(&blueness(&gpu.render(&from_distance(distance)).unwrap()));
            // The whole row is covered by the strip; lines are 9 to 14 pixels apart.
            assert!((12..=26).contains(&widths.len()), "{distance}: {widths:?}");
            let inner = &widths[1..widths.len() - 1];
            assert!(inner.iter().all(|w| (1.0..2.6).contains(w)), "{distance}: {widths:?}");
        }
    }

    #[test]
    fn a_strip_fades_towards_its_end() {
        let mut gpu = Headless::new().unwrap();
        let mut far = from_distance(0.5);
        // The strip ends at x = 0.05. There are 517 pixels per unit of length.
        let mut surface = (*far.scene.surface).clone();
        for v in &mut surface.vertices {
            v.stripes[0] = SurfaceStripes::new(f64::from(v.position[0]), [0.0; 3], 0.05, BLUE);
        }
        far.scene.surface = Arc::new(surface);
        let row = blueness(&gpu.render(&far).unwrap());
        let middle = row[100 + 4];
        let bare = row[100 + 30];
        assert!(middle > bare + 8, "{middle} {bare}");
        // Between the lines, the fill gets weaker over several pixels.
        let between: Vec<i32> = (20..=28).map(|x| row[100 + x]).collect();
        assert!(between.iter().any(|b| (bare + 2..middle - 1).contains(b)), "{between:?}");
    }

    #[test]
    fn bulges_bend_lines_and_a_strength_of_zero_hides_them() {
        let mut gpu = Headless::new().unwrap();
        let changed = |stripes: fn(f32) -> SurfaceStripes| {
            let mut frame = from_distance(0.5);
            let mut surface = (*frame.scene.surface).clone();
            surface.vertices.iter_mut().for_each(|v| v.stripes[0] = stripes(v.position[0]));
            frame.scene.surface = Arc::new(surface);
            frame
        };
        let straight = gpu.render(&from_distance(0.5)).unwrap();
        let bent = changed(|x| SurfaceStripes::new(f64::from(x), [0.02, 0.0, 0.0], 0.3, BLUE));
        assert_ne!(gpu.render(&bent).unwrap(), straight);
        let hidden = changed(|x| SurfaceStripes::new(f64::from(x), [0.0; 3], 0.3, [20, 60, 220, 0]));
        let without = Frame { toggles: Toggles { stripes: false, ..Toggles::default() }, ..from_distance(0.5) };
        assert_eq!(gpu.render(&hidden).unwrap(), gpu.render(&without).unwrap());
    }

    #[test]
    fn bands_are_drawn_over_the_surface_without_hiding_its_stripes() {
        let mut gpu = Headless::new().unwrap();
        let green = |p: &image::RgbaImage| p.pixels().filter(|p| p[1] > p[0].saturating_add(30) && p[1] > p[2]).count();
        let plain = frame(true, vec![], vec![]);
        let mut bands = (*plain.scene.surface).clone();
        for v in &mut bands.vertices {
            let across = f64::from(v.position[1]);
            v.stripes = [SurfaceStripes::default(), SurfaceStripes::new(across, [0.0; 3], 0.1, [10, 160, 70, 255])];
        }
        let with = SceneInput { bands: Arc::new(bands), ..plain.scene.clone() };
        let (before, after) = (gpu.render(&plain).unwrap(), gpu.render(&Frame { scene: with, ..plain }).unwrap());
        assert_eq!(green(&before), 0);
        assert!(green(&after) > 200, "{}", green(&after));
        // Rows beyond the band are as they were.
        let row = |p: &image::RgbaImage, y| (0..SIZE[0]).map(|x| *p.get_pixel(x, y)).collect::<Vec<_>>();
        assert_eq!(row(&before, 45), row(&after, 45));
        assert_ne!(row(&before, 80), row(&after, 80));
    }

    #[test]
    fn the_surface_is_redrawn_only_when_it_changed() {
        let mut gpu = Headless::new().unwrap();
        let first = frame(false, vec![], vec![]);
        gpu.render(&first).unwrap();
        gpu.render(&first).unwrap();
        let lines = SceneInput { lines: Arc::new(vec![line(0.0, 0.0)]), ..first.scene.clone() };
        gpu.render(&Frame { scene: lines, ..first.clone() }).unwrap();
        assert_eq!(gpu.renderer.redraws(), 1);
        gpu.render(&Frame { toggles: Toggles { wireframe: true, ..first.toggles }, ..first }).unwrap();
        assert_eq!(gpu.renderer.redraws(), 2);
    }
}
