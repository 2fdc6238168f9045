// Composes the image of the surface with the backdrop, and draws lines and markers of constant width on the screen.
// Lines and markers compare the depth at their centre line with that of the surface. So a wide line is visible or
// hidden across its whole width, with a smooth transition.

struct View {
    clip_from_world: mat4x4f,
    view_axes: array<vec4f, 3>,
    eye: vec4f,
    size_and_planes: vec4f,
    toggles: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(1) @binding(0) var surface_image: texture_2d<f32>;
@group(1) @binding(1) var surface_depth: texture_depth_multisampled_2d;

// ---- backdrop and surface image ----

struct ImageVarying {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn image_vertex(@builtin(vertex_index) index: u32) -> ImageVarying {
    var out: ImageVarying;
    out.uv = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    out.clip = vec4f(out.uv.x * 2.0 - 1.0, 1.0 - out.uv.y * 2.0, 0.0, 1.0);
    return out;
}

const BACKDROP_TOP = vec3f(0.965, 0.967, 0.965);
const BACKDROP_BOTTOM = vec3f(0.845, 0.852, 0.857);

@fragment
fn image_fragment(in: ImageVarying) -> @location(0) vec4f {
    let pixel = vec2i(in.uv * view.size_and_planes.xy);
    let surface = textureLoad(surface_image, pixel, 0);
    let across = (in.uv.x - 0.5) * 0.35;
    var backdrop = mix(BACKDROP_TOP, BACKDROP_BOTTOM, smoothstep(0.0, 1.0, in.uv.y + across * across));
    // Noise of half a colour step prevents banding of the gradient.
    let noise = fract(52.9829189 * fract(dot(vec2f(pixel), vec2f(0.06711056, 0.00583715)))) - 0.5;
    backdrop += noise / 255.0;
    return vec4f(surface.rgb + backdrop * (1.0 - surface.a), 1.0);
}

// ---- shared by lines and markers ----

// Distance from the eye along the view direction, from a depth between 0 and 1.
fn view_distance(depth: f32) -> f32 {
    let near = view.size_and_planes.z;
    let far = view.size_and_planes.w;
    return near * far / max(far - depth * (far - near), 1e-9);
}

// The share of samples at `pixel` where a point of this `depth` is in front of the surface.
fn visible(pixel: vec2f, depth: f32) -> f32 {
    let last = vec2i(view.size_and_planes.xy) - vec2i(1);
    let at = clamp(vec2i(pixel), vec2i(0), last);
    let distance = view_distance(depth);
    // Lines and triangles approximate curved shapes, so a line may lie a little below the surface.
    let tolerance = 0.0015 + 0.004 * distance;
    var sum = 0.0;
    for (var sample = 0; sample < 4; sample++) {
        let surface = view_distance(textureLoad(surface_depth, at, sample));
        sum += 1.0 - smoothstep(tolerance, 2.0 * tolerance, distance - surface);
    }
    return 0.25 * sum;
}

fn to_pixel(clip: vec4f) -> vec2f {
    let ndc = clip.xy / clip.w;
    return (ndc * vec2f(0.5, -0.5) + 0.5) * view.size_and_planes.xy;
}

fn to_clip(pixel: vec2f) -> vec4f {
    let ndc = (pixel / view.size_and_planes.xy - 0.5) * vec2f(2.0, -2.0);
    return vec4f(ndc, 0.0, 1.0);
}

// ---- lines ----

struct Segment {
    // The points before, at the start, at the end and after; a missing neighbour repeats the end.
    @location(0) before: vec3f,
    @location(1) start: vec3f,
    @location(2) end: vec3f,
    @location(3) after: vec3f,
    @location(4) colour: vec4f,
    // Width in points; relative opacity of hidden parts.
    @location(5) style: vec2f,
}

struct LineVarying {
    @builtin(position) clip: vec4f,
    @location(0) pixel: vec2f,
    @location(1) @interpolate(flat) start: vec3f,
    @location(2) @interpolate(flat) end: vec3f,
    @location(3) @interpolate(flat) neighbours: vec4f,
    @location(4) @interpolate(flat) colour: vec4f,
    @location(5) @interpolate(flat) style: vec2f,
}

@vertex
fn line_vertex(in: Segment, @builtin(vertex_index) index: u32) -> LineVarying {
    let near = view.size_and_planes.z;
    var a = view.clip_from_world * vec4f(in.start, 1.0);
    var b = view.clip_from_world * vec4f(in.end, 1.0);
    var out: LineVarying;
    if a.w < near && b.w < near {
        // Behind the eye: a degenerate triangle, which is not drawn.
        out.clip = vec4f(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    if a.w < near { a = mix(b, a, (b.w - near) / (b.w - a.w)); }
    if b.w < near { b = mix(a, b, (a.w - near) / (a.w - b.w)); }
    var p = view.clip_from_world * vec4f(in.before, 1.0);
    var n = view.clip_from_world * vec4f(in.after, 1.0);
    if p.w < near { p = a; }
    if n.w < near { n = b; }
    let start = to_pixel(a);
    let end = to_pixel(b);
    let along_raw = end - start;
    let along = select(vec2f(1.0, 0.0), along_raw / max(length(along_raw), 1e-6), length(along_raw) > 1e-4);
    let across = vec2f(-along.y, along.x);
    let reach = 0.5 * in.style.x * view.toggles.w + 1.0;
    let is_end = (index & 1u) == 1u;
    let side = select(-1.0, 1.0, (index & 2u) == 2u);
    let base = select(start - along * reach, end + along * reach, is_end);
    out.pixel = base + across * side * reach;
    out.clip = to_clip(out.pixel);
    out.start = vec3f(start, a.z / a.w);
    out.end = vec3f(end, b.z / b.w);
    out.neighbours = vec4f(to_pixel(p), to_pixel(n));
    out.colour = in.colour;
    out.style = in.style;
    return out;
}

// The parameter (0 to 1) of the point of a segment nearest to `p`, and its distance.
fn nearest(p: vec2f, a: vec2f, b: vec2f) -> vec2f {
    let ab = b - a;
    let t = clamp(dot(p - a, ab) / max(dot(ab, ab), 1e-6), 0.0, 1.0);
    return vec2f(t, distance(p, a + t * ab));
}

@fragment
fn line_fragment(in: LineVarying) -> @location(0) vec4f {
    let here = nearest(in.pixel, in.start.xy, in.end.xy);
    // Each pixel belongs to the nearest segment, so that transparent joints are not drawn twice.
    let before = nearest(in.pixel, in.neighbours.xy, in.start.xy);
    let after = nearest(in.pixel, in.end.xy, in.neighbours.zw);
    let has_before = distance(in.neighbours.xy, in.start.xy) > 1e-3;
    let has_after = distance(in.neighbours.zw, in.end.xy) > 1e-3;
    // At equal distance, around an outer corner, the later segment draws the pixel.
    let later_nearer = after.y < here.y - 1e-4 || (after.y < here.y + 1e-4 && here.x >= 1.0);
    if (has_before && before.y < here.y - 1e-4) || (has_after && later_nearer) {
        discard;
    }
    let cover = clamp(0.5 * in.style.x * view.toggles.w + 0.5 - here.y, 0.0, 1.0);
    let centre = mix(in.start, in.end, here.x);
    let seen = visible(centre.xy, centre.z);
    let alpha = in.colour.a * cover * mix(in.style.y, 1.0, seen);
    return vec4f(in.colour.rgb * alpha, alpha);
}

// ---- markers ----

struct Marker {
    @location(0) position: vec3f,
    @location(1) colour: vec4f,
    // Radius in points; relative opacity when hidden; 1 for a square with a light core, else 0.
    @location(2) style: vec3f,
}

struct MarkerVarying {
    @builtin(position) clip: vec4f,
    @location(0) offset: vec2f,
    @location(1) @interpolate(flat) centre: vec3f,
    @location(2) @interpolate(flat) colour: vec4f,
    @location(3) @interpolate(flat) style: vec3f,
}

@vertex
fn marker_vertex(in: Marker, @builtin(vertex_index) index: u32) -> MarkerVarying {
    let centre = view.clip_from_world * vec4f(in.position, 1.0);
    var out: MarkerVarying;
    if centre.w < view.size_and_planes.z {
        out.clip = vec4f(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    let reach = in.style.x * view.toggles.w + 1.5;
    let corner = vec2f(select(-1.0, 1.0, (index & 1u) == 1u), select(-1.0, 1.0, (index & 2u) == 2u));
    out.offset = corner * reach;
    out.centre = vec3f(to_pixel(centre), centre.z / centre.w);
    out.clip = to_clip(out.centre.xy + out.offset);
    out.colour = in.colour;
    out.style = in.style;
    return out;
}

@fragment
fn marker_fragment(in: MarkerVarying) -> @location(0) vec4f {
    let radius = in.style.x * view.toggles.w;
    let round = length(in.offset);
    let square = in.style.z > 0.5;
    let distance = select(round, max(abs(in.offset.x), abs(in.offset.y)), square);
    let outer = clamp(radius + 0.5 - distance, 0.0, 1.0);
    // A light ring separates the disc from the lines that meet there.
    let inner = clamp(radius - 1.25 * view.toggles.w + 0.5 - distance, 0.0, 1.0);
    let core = select(0.0, clamp(0.34 * radius + 0.5 - round, 0.0, 1.0), square);
    let rgb = mix(vec3f(1.0), in.colour.rgb, inner * (1.0 - core));
    let alpha = in.colour.a * outer * mix(in.style.y, 1.0, visible(in.centre.xy, in.centre.z));
    return vec4f(rgb * alpha, alpha);
}
