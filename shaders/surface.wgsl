// Draws the surface with lighting, the colours of its regions and the stripes of its strips. The output is in display
// (gamma) space, with alpha 0 where there is no surface.

struct View {
    clip_from_world: mat4x4f,
    // The axes of the view (right, up, toward the viewer) in world space. First w: image heights per unit of length, at the
    // distance of what is looked at.
    view_axes: array<vec4f, 3>,
    eye: vec4f,
    // Width and height in pixels, distance of the near and of the far plane.
    size_and_planes: vec4f,
    // 1 or 0 for stripes, wireframe and tint; pixels per point.
    toggles: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Colour over the material; alpha is its strength.
    @location(2) tint: vec4f,
    // The stripe patterns of two strips, see `SurfaceStripes`: distance from the spine; excess of the distance over linear
    // interpolation on each side, and distance of the end; colour and strength.
    @location(3) distance_u: f32,
    @location(4) shape_u: vec4f,
    @location(5) colour_u: vec4f,
    @location(6) distance_v: f32,
    @location(7) shape_v: vec4f,
    @location(8) colour_v: vec4f,
}

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    @location(3) distance: vec2f,
    @location(4) @interpolate(flat) shape_u: vec4f,
    @location(5) @interpolate(flat) shape_v: vec4f,
    @location(6) colour_u: vec4f,
    @location(7) colour_v: vec4f,
    @location(8) corner: vec3f,
}

fn corner(in: Vertex, index: u32) -> Varying {
    var out: Varying;
    out.clip = view.clip_from_world * vec4f(in.position, 1.0);
    out.world = in.position;
    out.normal = in.normal;
    out.tint = in.tint;
    out.distance = vec2f(in.distance_u, in.distance_v);
    out.shape_u = in.shape_u * SHAPE;
    out.shape_v = in.shape_v * SHAPE;
    out.colour_u = in.colour_u;
    out.colour_v = in.colour_v;
    out.corner = vec3f(f32(index % 3u == 0u), f32(index % 3u == 1u), f32(index % 3u == 2u));
    return out;
}

@vertex
fn vertex_main(in: Vertex, @builtin(vertex_index) index: u32) -> Varying {
    return corner(in, index);
}

// Bands lie on the surface, but their triangles are others: they are drawn a little nearer to the eye.
@vertex
fn band_vertex(in: Vertex, @builtin(vertex_index) index: u32) -> Varying {
    var out = corner(in, index);
    out.clip = view.clip_from_world * vec4f(mix(in.position, view.eye.xyz, 0.0007), 1.0);
    return out;
}

// The units of a stripe shape, `SurfaceStripes::LARGEST`.
const SHAPE = vec4f(0.05, 0.05, 0.05, 2.0);
// Distance of two lines on the screen, in points; from 0.8 to 1.25 times that, as the view is zoomed.
const LINE_DISTANCE = 11.0;
// Width of a line, in points.
const LINE_WIDTH = 1.6;
// Opacity of the lines, and of the colour between them.
const LINE_OPACITY = 0.92;
const FILL_OPACITY = 0.22;
// Over this length a strip fades towards its end; narrow strips over a part of their width.
const SOFT_END = 0.010;
const SOFT_PART = 0.4;

const MATERIAL = vec3f(0.66, 0.635, 0.60);
const BACK_MATERIAL = vec3f(0.46, 0.44, 0.47);
const SKY = vec3f(0.98, 0.99, 1.04);
const GROUND = vec3f(0.50, 0.46, 0.43);

fn view_direction(x: f32, y: f32, z: f32) -> vec3f {
    return normalize(x * view.view_axes[0].xyz + y * view.view_axes[1].xyz + z * view.view_axes[2].xyz);
}

// Coverage of a pixel by lines at the multiples of `period`, all in lengths of which a pixel has `per_pixel`. Lines too
// dense for the screen fade to their mean.
fn lines(distance: f32, period: f32, per_pixel: f32, width: f32) -> f32 {
    let from_line = abs(fract(distance / period + 0.5) - 0.5) * period / per_pixel;
    let line = clamp(0.5 * width + 0.5 - from_line, 0.0, 1.0);
    let pixels = period / per_pixel;
    return mix(line, min(width / pixels, 1.0), 1.0 - smoothstep(1.2 * width, 2.2 * width, pixels));
}

// The colour of a pixel in the pattern of a strip (not premultiplied) and its opacity.
fn stripes(linear_distance: f32, shape: vec4f, colour: vec4f, corner: vec3f) -> vec4f {
    let distance = linear_distance + 2.0 * dot(shape.xyz, corner * corner.yzx);
    let per_pixel = max(length(vec2f(dpdx(distance), dpdy(distance))), 1e-9);
    let width = LINE_WIDTH * view.toggles.w;
    // Every other line appears or vanishes as the view is zoomed.
    let points_per_length = view.view_axes[0].w * view.size_and_planes.y / view.toggles.w;
    let level = log2(LINE_DISTANCE / points_per_length);
    let dense = exp2(floor(level));
    let all = 1.0 - smoothstep(0.4, 0.6, fract(level));
    let line = mix(lines(distance, 2.0 * dense, per_pixel, width), lines(distance, dense, per_pixel, width), all);
    let soft = min(SOFT_END, SOFT_PART * shape.w);
    let end = smoothstep(0.0, 1.0, (shape.w - abs(distance)) / max(soft, 1e-6));
    let strength = end * smoothstep(0.0, 1.0, colour.a) * view.toggles.x;
    return vec4f(decode(colour.rgb), strength * mix(FILL_OPACITY, LINE_OPACITY, line));
}

fn over(below: vec3f, above: vec4f) -> vec3f {
    return mix(below, above.rgb, above.a);
}

fn encode(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c < vec3f(0.0031308));
}

fn decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c < vec3f(0.04045));
}

// The colour of a lit point of the surface, linear.
fn lit(albedo: vec3f, in: Varying, front: bool) -> vec3f {
    let toward_eye = normalize(view.eye.xyz - in.world);
    var normal = normalize(in.normal);
    if !front { normal = -normal; }
    // Hemisphere light, key light from the upper left, fill light from the right, rim light from behind.
    let up = view.view_axes[1].xyz;
    let hemisphere = mix(GROUND, SKY, 0.5 + 0.5 * dot(normal, up)) * 0.44;
    let key = max(dot(normal, view_direction(-0.45, 0.65, 0.75)), 0.0) * 0.68;
    let fill = max(dot(normal, view_direction(0.80, 0.05, 0.45)), 0.0) * 0.17;
    let facing = max(dot(normal, toward_eye), 0.0);
    let rim = pow(1.0 - facing, 3.5) * max(dot(normal, view_direction(0.35, 0.75, -0.35)) + 0.25, 0.0) * 0.30;
    let half_way = normalize(view_direction(-0.45, 0.65, 0.75) + toward_eye);
    let gloss = pow(max(dot(normal, half_way), 0.0), 42.0) * 0.09;
    // Surfaces at grazing angles are darker, which separates parts that overlap on the screen.
    let shade = mix(0.74, 1.0, smoothstep(0.0, 0.55, facing));
    let diffuse = hemisphere + (key + fill) * vec3f(1.03, 1.0, 0.96);
    return albedo * diffuse * shade + rim * vec3f(0.9, 0.95, 1.0) + gloss;
}

@fragment
fn fragment_main(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    // Derivatives must be taken in uniform control flow.
    let stripes_u = stripes(in.distance.x, in.shape_u, in.colour_u, in.corner);
    let stripes_v = stripes(in.distance.y, in.shape_v, in.colour_v, in.corner);
    let edge_width = fwidth(in.corner);

    // The material, under the colour of the region and that of the strips.
    var albedo = select(BACK_MATERIAL, MATERIAL, front);
    albedo = mix(albedo, decode(in.tint.rgb), in.tint.a * view.toggles.z);
    // Neither of two strips is on top: which is the first differs from triangle to triangle.
    albedo = 0.5 * (over(over(albedo, stripes_u), stripes_v) + over(over(albedo, stripes_v), stripes_u));
    var colour = lit(albedo, in, front);

    let near_edge = clamp(1.2 - in.corner / max(edge_width, vec3f(1e-6)), vec3f(0.0), vec3f(1.0));
    let wire = max(near_edge.x, max(near_edge.y, near_edge.z)) * view.toggles.y;
    colour = mix(colour, colour * 0.35, wire * 0.55);
    return vec4f(encode(colour), 1.0);
}

// The stripe patterns alone, premultiplied: a band over the surface.
@fragment
fn band_fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let u = stripes(in.distance.x, in.shape_u, in.colour_u, in.corner);
    let v = stripes(in.distance.y, in.shape_v, in.colour_v, in.corner);
    let alpha = 1.0 - (1.0 - u.a) * (1.0 - v.a);
    let albedo = (u.rgb * u.a * (1.0 - 0.5 * v.a) + v.rgb * v.a * (1.0 - 0.5 * u.a)) / max(alpha, 1e-6);
    return vec4f(encode(lit(albedo, in, front)) * alpha, alpha);
}
