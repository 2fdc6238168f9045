//! The render pipelines and their bind group layouts, made once per device and output format.

use super::scene::{SurfaceVertex, ViewUniforms};
use super::target;

/// A segment of a line as `overlay.wgsl` reads it, one instance each. `style`: width in points, visibility when hidden.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SegmentInstance {
    pub before: [f32; 3],
    pub start: [f32; 3],
    pub end: [f32; 3],
    pub after: [f32; 3],
    pub colour: [u8; 4],
    pub style: [f32; 2],
}

/// A marker as `overlay.wgsl` reads it, one instance each. `style`: radius in points, visibility when hidden, 1 if
/// square.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MarkerInstance {
    pub position: [f32; 3],
    pub colour: [u8; 4],
    pub style: [f32; 3],
}

/// The pipelines and the layouts of their bind groups.
pub struct Pipelines {
    pub view_layout: wgpu::BindGroupLayout,
    pub target_layout: wgpu::BindGroupLayout,
    pub surface: wgpu::RenderPipeline,
    /// Stripe patterns alone, over the surface.
    pub bands: wgpu::RenderPipeline,
    pub image: wgpu::RenderPipeline,
    pub line: wgpu::RenderPipeline,
    pub marker: wgpu::RenderPipeline,
}

const SURFACE_ATTRIBUTES: [wgpu::VertexAttribute; 9] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4,
    3 => Float32, 4 => Snorm16x4, 5 => Unorm8x4,
    6 => Float32, 7 => Snorm16x4, 8 => Unorm8x4];
const SEGMENT_ATTRIBUTES: [wgpu::VertexAttribute; 6] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Float32x3, 4 => Unorm8x4, 5 => Float32x2];
const MARKER_ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4, 2 => Float32x3];

impl Pipelines {
    pub fn new(device: &wgpu::Device, output: wgpu::TextureFormat) -> Self {
        let view_layout = view_layout(device);
        let target_layout = target_layout(device);
        let surface_shader = device.create_shader_module(wgpu::include_wgsl!("../../../shaders/surface.wgsl"));
        let overlay_shader = device.create_shader_module(wgpu::include_wgsl!("../../../shaders/overlay.wgsl"));
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let offscreen = |label, entries, blend| {
            pipeline(
                device,
                &PipelineConfig {
                    label,
                    shader: &surface_shader,
                    entries,
                    layouts: &[Some(&view_layout)],
                    buffer: Some(buffer::<SurfaceVertex>(wgpu::VertexStepMode::Vertex, &SURFACE_ATTRIBUTES)),
                    topology: wgpu::PrimitiveTopology::TriangleList,
                    colour: target::COLOUR,
                    blend,
                    offscreen: true,
                },
            )
        };
        let surface = offscreen("surface", ["vertex_main", "fragment_main"], None);
        let bands = offscreen("bands", ["band_vertex", "band_fragment"], over);
        let overlay = |label, entries, buffer: Option<wgpu::VertexBufferLayout<'static>>, blend, topology| {
            pipeline(
                device,
                &PipelineConfig {
                    label,
                    shader: &overlay_shader,
                    entries,
                    layouts: &[Some(&view_layout), Some(&target_layout)],
                    buffer,
                    topology,
                    colour: output,
                    blend,
                    offscreen: false,
                },
            )
        };
        let strip = wgpu::PrimitiveTopology::TriangleStrip;
        let segments = buffer::<SegmentInstance>(wgpu::VertexStepMode::Instance, &SEGMENT_ATTRIBUTES);
        let markers = buffer::<MarkerInstance>(wgpu::VertexStepMode::Instance, &MARKER_ATTRIBUTES);
        let image = overlay(
            "surface image",
            ["image_vertex", "image_fragment"],
            None,
            None,
            wgpu::PrimitiveTopology::TriangleList,
        );
        let line = overlay("lines", ["line_vertex", "line_fragment"], Some(segments), over, strip);
        let marker = overlay("markers", ["marker_vertex", "marker_fragment"], Some(markers), over, strip);
        Self { view_layout, target_layout, surface, bands, image, line, marker }
    }
}

fn buffer<T>(
    step_mode: wgpu::VertexStepMode,
    attributes: &'static [wgpu::VertexAttribute],
) -> wgpu::VertexBufferLayout<'static> {
    wgpu::VertexBufferLayout { array_stride: size_of::<T>() as u64, step_mode, attributes }
}

fn view_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("view"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: std::num::NonZeroU64::new(size_of::<ViewUniforms>() as u64),
            },
            count: None,
        }],
    })
}

fn target_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let texture = |binding, sample_type, multisampled| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("surface image and depth"),
        entries: &[
            texture(0, wgpu::TextureSampleType::Float { filterable: false }, false),
            texture(1, wgpu::TextureSampleType::Depth, true),
        ],
    })
}

/// What distinguishes one pipeline from another.
struct PipelineConfig<'a> {
    label: &'a str,
    shader: &'a wgpu::ShaderModule,
    entries: [&'a str; 2],
    layouts: &'a [Option<&'a wgpu::BindGroupLayout>],
    buffer: Option<wgpu::VertexBufferLayout<'static>>,
    topology: wgpu::PrimitiveTopology,
    colour: wgpu::TextureFormat,
    blend: Option<wgpu::BlendState>,
    /// Whether it draws to the multisampled target with depth, or to the output.
    offscreen: bool,
}

fn pipeline(device: &wgpu::Device, config: &PipelineConfig<'_>) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(config.label),
        bind_group_layouts: config.layouts,
        ..Default::default()
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(config.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: config.shader,
            entry_point: Some(config.entries[0]),
            compilation_options: Default::default(),
            buffers: config.buffer.as_ref().map(|b| [Some(b.clone())]).as_ref().map_or(&[], |b| b.as_slice()),
        },
        fragment: Some(wgpu::FragmentState {
            module: config.shader,
            entry_point: Some(config.entries[1]),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: config.colour,
                blend: config.blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        primitive: wgpu::PrimitiveState { topology: config.topology, ..Default::default() },
        depth_stencil: config.offscreen.then(|| wgpu::DepthStencilState {
            format: target::DEPTH,
            // What is blended over the surface hides nothing.
            depth_write_enabled: Some(config.blend.is_none()),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: if config.offscreen { target::SAMPLES } else { 1 },
            ..Default::default()
        },
        multiview_mask: None,
        cache: None,
    })
}
