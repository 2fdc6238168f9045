// Draws the surface with lighting, the colours of its regions and the stripes of its strips. The output is in display
// (gamma) space, with alpha 0 where there is no surface.

struct View {
    clip_from_world: mat4x4f,
    // Rows 0..2: the axes of the view (right, up, toward the viewer) in world space; w unused.
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
    // Stripe coordinates of both families; lines are drawn at integers.
    @location(3) stripe: vec2f,
    // Largest coordinate of the strip and negated smallest, for the first and the second family.
    @location(4) reach: vec4u,
}

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) tint: vec4f,
    @location(3) stripe: vec2f,
    @location(4) @interpolate(flat) reach: vec4f,
    @location(5) corner: vec3f,
}

@vertex
fn vertex_main(in: Vertex, @builtin(vertex_index) index: u32) -> Varying {
    var out: Varying;
    out.clip = view.clip_from_world * vec4f(in.position, 1.0);
    out.world = in.position;
    out.normal = in.normal;
    out.tint = in.tint;
    out.stripe = in.stripe;
    out.reach = vec4f(in.reach);
    out.corner = vec3f(f32(index % 3u == 0u), f32(index % 3u == 1u), f32(index % 3u == 2u));
    return out;
}

const MATERIAL = vec3f(0.66, 0.635, 0.60);
const BACK_MATERIAL = vec3f(0.46, 0.44, 0.47);
const SKY = vec3f(0.98, 0.99, 1.04);
const GROUND = vec3f(0.50, 0.46, 0.43);
const STRIPE = vec3f(0.045, 0.21, 0.60);

fn view_direction(x: f32, y: f32, z: f32) -> vec3f {
    return normalize(x * view.view_axes[0].xyz + y * view.view_axes[1].xyz + z * view.view_axes[2].xyz);
}

// Coverage of a pixel by a strip (x) and by its lines (y). Lines of `width` pixels lie at integers of `coordinate`,
// both ends of the strip included. Lines too dense for the screen fade to their mean.
fn stripes(coordinate: f32, reach: vec2f, width: f32) -> vec2f {
    let per_pixel = max(length(vec2f(dpdx(coordinate), dpdy(coordinate))), 1e-6);
    let to_end = min(reach.x - coordinate, coordinate + reach.y) / per_pixel;
    let inside = clamp(to_end + 0.5 * width + 0.5, 0.0, 1.0) * f32(reach.x + reach.y > 0.0);
    let distance = abs(fract(coordinate + 0.5) - 0.5) / per_pixel;
    let line = clamp(0.5 * width + 0.5 - distance, 0.0, 1.0);
    let dense = smoothstep(0.18, 0.40, per_pixel);
    return inside * vec2f(1.0, mix(line, min(width * per_pixel, 0.6), dense));
}

fn encode(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c < vec3f(0.0031308));
}

fn decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c < vec3f(0.04045));
}

@fragment
fn fragment_main(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    // Derivatives must be taken in uniform control flow.
    let width = 1.15 * view.toggles.w;
    let stripes_u = stripes(in.stripe.x, in.reach.xy, width) * view.toggles.x;
    let stripes_v = stripes(in.stripe.y, in.reach.zw, width) * view.toggles.x;
    let edge_width = fwidth(in.corner);

    let toward_eye = normalize(view.eye.xyz - in.world);
    var normal = normalize(in.normal);
    if !front { normal = -normal; }

    // The material, under the colour of the region and that of the strips.
    var albedo = select(BACK_MATERIAL, MATERIAL, front);
    albedo = mix(albedo, decode(in.tint.rgb), in.tint.a * view.toggles.z);
    albedo = mix(albedo, STRIPE, 0.10 * (stripes_u.x + stripes_v.x));
    albedo = mix(albedo, STRIPE, 0.72 * (1.0 - (1.0 - stripes_u.y) * (1.0 - stripes_v.y)));

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
    var colour = albedo * (hemisphere + (key + fill) * vec3f(1.03, 1.0, 0.96)) * shade + rim * vec3f(0.9, 0.95, 1.0) + gloss;

    let near_edge = clamp(1.2 - in.corner / max(edge_width, vec3f(1e-6)), vec3f(0.0), vec3f(1.0));
    let wire = max(near_edge.x, max(near_edge.y, near_edge.z)) * view.toggles.y;
    colour = mix(colour, colour * 0.35, wire * 0.55);
    return vec4f(encode(colour), 1.0);
}
