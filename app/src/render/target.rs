//! The offscreen target of the surface: multisampled colour and depth, and the resolved image.

/// Samples per pixel; every backend supports four.
pub const SAMPLES: u32 = 4;
/// Format of the surface image: colour in display space, coverage in alpha.
pub const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Format of the depth buffer, which lines and markers are tested against.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The textures, and the bind group by which the overlay reads them.
pub struct Target {
    /// Width and height in pixels.
    pub size: [u32; 2],
    multisampled: wgpu::TextureView,
    resolved: wgpu::TextureView,
    depth: wgpu::TextureView,
    /// Resolved image and depth.
    pub bind_group: wgpu::BindGroup,
}

impl Target {
    pub fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: [u32; 2]) -> Self {
        let view = |label, format, samples, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let multisampled = view("surface samples", COLOUR, SAMPLES, wgpu::TextureUsages::empty());
        let resolved = view("surface image", COLOUR, 1, wgpu::TextureUsages::TEXTURE_BINDING);
        let depth = view("surface depth", DEPTH, SAMPLES, wgpu::TextureUsages::TEXTURE_BINDING);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surface image and depth"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&resolved) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&depth) },
            ],
        });
        Self { size, multisampled, resolved, depth, bind_group }
    }

    /// A render pass that clears colour and depth, and stores both.
    pub fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surface"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.multisampled,
                depth_slice: None,
                resolve_target: Some(&self.resolved),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }
}
