//! Pictures without a window or a display: the same renderer into a texture that is read back.

use std::path::Path;

use thiserror::Error;

use super::renderer::{Frame, Renderer};

/// Why no picture came out.
#[derive(Debug, Error)]
pub enum HeadlessError {
    /// No Vulkan or OpenGL driver.
    #[error("no graphics driver was found (on Debian, mesa-vulkan-drivers brings a software one): {0}")]
    NoAdapter(String),
    /// The driver failed.
    #[error("the graphics driver failed: {0}")]
    Device(String),
    /// The file could not be written.
    #[error("cannot write the picture: {0}")]
    Write(#[from] image::ImageError),
}

/// A device without a display, and a renderer on it.
pub struct Headless {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
}

const OUTPUT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

impl Headless {
    /// Opens the first driver there is, a software one if need be.
    ///
    /// # Errors
    ///
    /// When the machine has none that works.
    pub fn new() -> Result<Self, HeadlessError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle().with_env());
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .map_err(|e| HeadlessError::NoAdapter(e.to_string()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))
            .map_err(|e| HeadlessError::Device(e.to_string()))?;
        let renderer = Renderer::new(&device, OUTPUT);
        Ok(Self { device, queue, renderer })
    }

    /// Draws one frame.
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
            .ok_or_else(|| HeadlessError::Device("the picture read back has the wrong size".into()))
    }
}

/// Draws one frame into a PNG file, without a display.
///
/// # Errors
///
/// When no driver works or the file cannot be written.
pub fn render_to_png(frame: &Frame, path: &Path) -> Result<(), HeadlessError> {
    let picture = Headless::new()?.render(frame)?;
    picture.save_with_format(path, image::ImageFormat::Png)?;
    Ok(())
}
