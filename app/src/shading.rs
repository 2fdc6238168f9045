//! Converts a scene of the engine to what the renderer draws: coloured and striped triangles, lines, markers.

use glam::{DVec3, Vec3};

use crate::engine::{DisplaySurface, LayoutPart, LayoutPreview, Proposal, RegionColour, Scene, StripId, Stripes};
use crate::palette::{strip_rgb, strip_rgba};
use crate::render::{Marker, Polyline, SurfaceMesh, SurfaceStripes, SurfaceVertex};

/// Opacity of placed strips while a layout is shown.
const FAINT: u8 = 0x80;
/// Colour of the selected anchor of the edited strip.
const SELECTED: [u8; 4] = [0x0a, 0x2f, 0x8c, 0xff];
/// Colour of the proposal that a click would place.
pub const PROPOSED: [u8; 4] = [0x0f, 0x9d, 0x4a, 0xff];
/// Colour of arcs.
pub const ARC: [u8; 4] = [0x24, 0x26, 0x2a, 0xff];
/// Colour of arcs that are approximate, see [`crate::engine::LayoutArc`].
const APPROXIMATE: [u8; 4] = [0x24, 0x26, 0x2a, 0x78];
/// Colour of the inner line of pinned arcs.
const PINNED_CORE: [u8; 4] = [0xff, 0xff, 0xff, 0xff];
/// Colour of regular nodes.
pub const NODE: [u8; 4] = [0x5a, 0x5e, 0x66, 0xff];
/// Colours of irregular nodes of lower and of higher valence.
pub const IRREGULAR: [[u8; 4]; 2] = [[0xd2, 0x3c, 0x3c, 0xff], [0x25, 0x63, 0xc9, 0xff]];
/// Colour of the outline that separates a line from the stripes around it.
const OUTLINE: [u8; 4] = [0xff, 0xff, 0xff, 0xb4];

/// The colour of a region in the panels.
pub fn region_rgb(colour: RegionColour) -> [u8; 3] {
    match colour {
        RegionColour::None => [0x3d, 0x9b, 0x5f],
        RegionColour::Yellow => [0xe3, 0xc0, 0x1c],
        RegionColour::Orange => [0xee, 0x8a, 0x1d],
        RegionColour::Red => [0xd9, 0x3b, 0x36],
    }
}

/// The colour of a region on the surface; alpha is the strength over the material.
fn tint(colour: RegionColour) -> [u8; 4] {
    let [r, g, b] = region_rgb(colour);
    match colour {
        RegionColour::None => [0; 4],
        RegionColour::Yellow => [r, g, b, 0x70],
        RegionColour::Orange => [r, g, b, 0x80],
        RegionColour::Red => [r, g, b, 0x80],
    }
}

/// The surface as triangles. `tints` are colours for the triangles of the design mesh; without, those of the regions.
pub fn surface(display: &DisplaySurface, tints: Option<&[[u8; 4]]>) -> SurfaceMesh {
    let mut vertices = Vec::with_capacity(display.faces.len() * 3);
    let region = |f: usize| display.regions.get(f).map(|&c| tint(c));
    for (f, face) in display.faces.iter().enumerate() {
        let tint = match tints {
            Some(tints) => display.base.get(f).and_then(|&b| tints.get(b as usize).copied()),
            None => region(f),
        };
        let tint = tint.unwrap_or_default();
        vertices.extend(triangle(display, f, *face, tint, strip_rgb));
    }
    SurfaceMesh { vertices }
}

/// The stripes of a surface alone, in one colour, to be drawn over another surface: for a proposal.
pub fn bands(display: &DisplaySurface, rgb: [u8; 3]) -> SurfaceMesh {
    let striped = |f: usize| display.stripes.get(f).is_some_and(|s| s.iter().any(Option::is_some));
    let faces = display.faces.iter().enumerate().filter(|&(f, _)| striped(f));
    SurfaceMesh { vertices: faces.flat_map(|(f, &face)| triangle(display, f, face, [0; 4], |_| rgb)).collect() }
}

/// The three corners of face `f`. `rgb` are the colours of strips.
fn triangle(
    display: &DisplaySurface,
    f: usize,
    face: [u32; 3],
    tint: [u8; 4],
    rgb: impl Fn(StripId) -> [u8; 3],
) -> [SurfaceVertex; 3] {
    let stripes = display.stripes.get(f).copied().unwrap_or_default();
    [0, 1, 2].map(|corner: usize| {
        let position = display.positions.get(face[corner] as usize).copied().unwrap_or_default();
        let normal = display.normals.get(f).map_or(DVec3::Z, |n| n[corner]);
        let pattern = |s: Stripes| {
            let [r, g, b] = rgb(s.strip);
            let strength = (s.strength[corner] * 255.0).round() as u8;
            SurfaceStripes::new(s.at[corner], s.bulge, s.reach, [r, g, b, strength])
        };
        SurfaceVertex {
            position: position.as_vec3().to_array(),
            normal: normal.as_vec3().to_array(),
            tint,
            stripes: stripes.map(|s| s.map(pattern).unwrap_or_default()),
        }
    })
}

/// Points of the surface by which the camera frames it; a sample of large surfaces.
pub fn framing_points(display: &DisplaySurface) -> Vec<Vec3> {
    /// Points that suffice.
    const ENOUGH: usize = 20_000;
    let step = display.positions.len() / ENOUGH + 1;
    display.positions.iter().step_by(step).map(|p| p.as_vec3()).collect()
}

/// Normals at the corners of each face: the mean of the adjacent face normals, weighted by angle. Faces whose normals
/// differ by `crease` (radians) or more are left out, so that sharp edges stay sharp.
pub fn corner_normals(positions: &[DVec3], faces: &[[u32; 3]], crease: f64) -> Vec<[DVec3; 3]> {
    let normal = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| positions[v as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let normals: Vec<DVec3> = faces.iter().map(normal).collect();
    let mut starts = vec![0u32; positions.len() + 1];
    faces.iter().flatten().for_each(|&v| starts[v as usize + 1] += 1);
    for v in 0..positions.len() {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut adjacent = vec![(0u32, 0.0f64); faces.len() * 3];
    for (f, face) in faces.iter().enumerate() {
        for i in 0..3 {
            let [p, q, r] = [0, 1, 2].map(|k| positions[face[(i + k) % 3] as usize]);
            let v = face[i] as usize;
            let angle = (q - p).angle_between(r - p);
            adjacent[next[v] as usize] = (f as u32, if angle.is_finite() { angle } else { 0.0 });
            next[v] += 1;
        }
    }
    let limit = crease.cos();
    let at = |f: usize, v: u32| {
        let list = &adjacent[starts[v as usize] as usize..starts[v as usize + 1] as usize];
        let smooth = list.iter().filter(|(g, _)| normals[f].dot(normals[*g as usize]) > limit);
        let sum: DVec3 = smooth.map(|&(g, angle)| normals[g as usize] * angle).sum();
        sum.try_normalize().unwrap_or(normals[f])
    };
    faces.iter().enumerate().map(|(f, face)| face.map(|v| at(f, v))).collect()
}

/// The handle of an anchor.
#[derive(Debug, Clone, PartialEq)]
pub struct Handle {
    /// Where the anchor is.
    pub position: DVec3,
    /// The ends of its direction; `None` for an anchor without direction.
    pub tips: Option<[DVec3; 2]>,
    /// Whether it is selected.
    pub selected: bool,
    /// Whether the pointer is over it.
    pub pointed: bool,
}

/// Everything that is drawn over the surface.
#[derive(Debug, Clone, Copy)]
pub struct Overlay<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The proposal that a click would place.
    pub proposal: Option<&'a Proposal>,
    /// The strip selected in the list.
    pub selected: Option<StripId>,
    /// Nodes and arcs.
    pub layout: Option<&'a LayoutPreview>,
    /// The node or arc that a click would pin or unpin.
    pub part: Option<LayoutPart>,
    /// The handles of the edited strip.
    pub handles: &'a [Handle],
    /// The placed strip under the pointer.
    pub pointed: Option<StripId>,
    /// Whether placed strips are shown.
    pub strips: bool,
    /// The place of a message.
    pub place: Option<DVec3>,
}

/// The lines and markers of an overlay.
pub fn overlay(overlay: &Overlay<'_>) -> (Vec<Polyline>, Vec<Marker>) {
    let mut lines = Vec::new();
    let mut markers = Vec::new();
    let layout = overlay.layout;
    if overlay.strips {
        for strip in overlay.scene.strips.iter().filter(|s| s.visible) {
            let selected = overlay.selected == Some(strip.id) || overlay.pointed == Some(strip.id);
            let (points, colour) = (points(&strip.polyline), strip_rgba(strip.id));
            match (selected, layout) {
                (true, _) => outlined(&mut lines, points, strip.closed, colour, 5.0),
                (false, None) => outlined(&mut lines, points, strip.closed, colour, 2.8),
                // Strips are faint while a layout is shown.
                (false, Some(_)) => {
                    let colour = [colour[0], colour[1], colour[2], FAINT];
                    lines.push(Polyline { points, closed: strip.closed, colour, width: 1.8, hidden: 0.0 });
                }
            }
        }
    }
    if let Some(layout) = layout {
        draw_layout(layout, overlay.part, &mut lines, &mut markers);
    }
    if let Some(proposal) = overlay.proposal {
        outlined(&mut lines, points(&proposal.polyline), proposal.curve.closed, PROPOSED, 3.6);
    }
    overlay.handles.iter().for_each(|h| draw_handle(h, &mut lines, &mut markers));
    if let Some(place) = overlay.place {
        let position = place.as_vec3().to_array();
        markers.push(Marker { position, colour: [0xd9, 0x3b, 0x36, 0xff], radius: 7.0, hidden: 0.5, square: false });
    }
    (lines, markers)
}

fn draw_layout(layout: &LayoutPreview, part: Option<LayoutPart>, lines: &mut Vec<Polyline>, markers: &mut Vec<Marker>) {
    let line =
        |arc: &[DVec3], colour, width, hidden| Polyline { points: points(arc), closed: false, colour, width, hidden };
    if let Some(LayoutPart::Arc(i)) = part
        && let Some(arc) = layout.arcs.get(i)
    {
        lines.push(line(&arc.points, PROPOSED, 8.0, 0.0));
    }
    for arc in layout.arcs.iter().filter(|a| a.points.len() > 1) {
        let colour = if arc.approximate { APPROXIMATE } else { ARC };
        lines.push(line(&arc.points, colour, if arc.pinned { 5.4 } else { 2.2 }, 0.10));
        if arc.pinned {
            lines.push(line(&arc.points, PINNED_CORE, 2.0, 0.0));
        }
    }
    for (i, node) in layout.nodes.iter().enumerate() {
        let (colour, radius): (_, f32) = match (node.irregular, node.valence < 4) {
            (false, _) => (NODE, 3.4),
            (true, low) => (IRREGULAR[usize::from(!low)], 5.6),
        };
        let position = node.position.as_vec3().to_array();
        // Large enough to show the core of the square.
        let radius = if node.pinned { 6.6 } else { radius };
        let marker = Marker { position, colour, radius, hidden: 0.12, square: node.pinned };
        if part == Some(LayoutPart::Node(i)) {
            markers.push(Marker { colour: PROPOSED, radius: radius + 4.0, ..marker.clone() });
        }
        markers.push(marker);
    }
}

/// A disc, with a line and two smaller discs along the direction if there is one.
fn draw_handle(handle: &Handle, lines: &mut Vec<Polyline>, markers: &mut Vec<Marker>) {
    let colour = if handle.selected { SELECTED } else { PROPOSED };
    let grow = if handle.pointed { 1.5 } else { 0.0 };
    let mut disc = |position: DVec3, radius: f32| {
        let position = position.as_vec3().to_array();
        let outer = Marker { position, colour: PINNED_CORE, radius: radius + 2.0, hidden: 0.25, square: false };
        markers.push(outer.clone());
        markers.push(Marker { colour, radius, ..outer });
    };
    if let Some(tips) = handle.tips {
        let colour = if handle.selected { SELECTED } else { PROPOSED };
        outlined(lines, points(&tips), false, colour, 2.0);
        tips.into_iter().for_each(|tip| disc(tip, 4.0 + grow));
    }
    disc(handle.position, 6.0 + grow);
}

/// A line with its outline.
fn outlined(lines: &mut Vec<Polyline>, points: Vec<[f32; 3]>, closed: bool, colour: [u8; 4], width: f32) {
    lines.push(Polyline { points: points.clone(), closed, colour: OUTLINE, width: width + 2.4, hidden: 0.0 });
    lines.push(Polyline { points, closed, colour, width, hidden: 0.13 });
}

fn points(line: &[DVec3]) -> Vec<[f32; 3]> {
    line.iter().map(|p| p.as_vec3().to_array()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{LayoutArc, LayoutNode};

    #[test]
    fn only_smooth_edges_share_normals() {
        let up = |z: f64| vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(-1.0, 0.0, z)];
        let faces = [[0, 1, 2], [0, 2, 3]];
        let soft = corner_normals(&up(0.1), &faces, 0.7);
        assert!(soft[0][0].distance(soft[1][0]) < 1e-12 && soft[0][1] == DVec3::Z);
        let sharp = corner_normals(&up(-2.0), &faces, 0.7);
        assert_eq!(sharp[0][0], DVec3::Z);
        assert!(sharp[1][0].dot(DVec3::Z) < 0.6);
    }

    fn triangle() -> DisplaySurface {
        DisplaySurface {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y].into(),
            faces: vec![[0, 1, 2]].into(),
            normals: vec![[DVec3::Z; 3]].into(),
            base: vec![1].into(),
            regions: vec![RegionColour::Red],
            ..DisplaySurface::default()
        }
    }

    #[test]
    fn given_tints_replace_the_colours_of_regions() {
        let [r, g, b] = region_rgb(RegionColour::Red);
        assert_eq!(surface(&triangle(), None).vertices[0].tint, [r, g, b, 0x80]);
        // The tint is that of the triangle of the design mesh, number 1.
        assert_eq!(surface(&triangle(), Some(&[[1; 4], [2; 4]])).vertices[0].tint, [2; 4]);
    }

    #[test]
    fn large_surfaces_are_framed_by_a_sample() {
        let display = DisplaySurface { positions: vec![DVec3::X; 100_000].into(), ..DisplaySurface::default() };
        assert!((10_000..=20_000).contains(&framing_points(&display).len()));
        assert_eq!(framing_points(&triangle()).len(), 3);
    }

    #[test]
    fn a_pinned_arc_is_a_double_line_and_a_pinned_node_a_square() {
        let node = |pinned| LayoutNode { position: DVec3::ZERO, valence: 4, irregular: false, pinned };
        for pinned in [false, true] {
            let arc = LayoutArc { points: vec![DVec3::ZERO, DVec3::X], approximate: false, pinned };
            let layout = LayoutPreview { arcs: vec![arc], nodes: vec![node(pinned)] };
            let (mut lines, mut markers) = (Vec::new(), Vec::new());
            draw_layout(&layout, None, &mut lines, &mut markers);
            assert_eq!((lines.len(), markers[0].square), (1 + usize::from(pinned), pinned));
        }
    }

    /// A square in the plane z = 0 whose left half lies in a yellow region, seen from the front.
    fn half_yellow() -> crate::render::Frame {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let column = |x: f64| [corner(x, -0.3), corner(x, 0.3)];
        let display = DisplaySurface {
            positions: [column(-0.4), column(0.0), column(0.4)].concat().into(),
            faces: vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]].into(),
            normals: vec![[DVec3::Z; 3]; 4].into(),
            base: vec![0, 1, 2, 3].into(),
            regions: vec![RegionColour::Yellow, RegionColour::Yellow, RegionColour::None, RegionColour::None],
            ..DisplaySurface::default()
        };
        let camera = crate::camera::Camera { yaw: 0.0, pitch: 0.0, ..Default::default() };
        crate::render::Frame {
            scene: crate::render::SceneInput { surface: surface(&display, None).into(), ..Default::default() },
            view: camera.uniforms(glam::Vec2::new(160.0, 120.0)),
            toggles: Default::default(),
            size: [160, 120],
            pixels_per_point: 1.0,
        }
    }

    #[test]
    fn a_yellow_region_is_drawn_in_yellow() {
        let picture = crate::render::Headless::new().unwrap().render(&half_yellow()).unwrap();
        let [r, g, b] = [0, 1, 2].map(|i| i32::from(picture.get_pixel(60, 60)[i]));
        // Red and green, little blue: neither orange, which has much less green than red, nor the material.
        assert!(r > b + 50 && g > b + 40 && (r - g).abs() < 35, "{r} {g} {b}");
        let [r, _, b] = [0, 1, 2].map(|i| i32::from(picture.get_pixel(100, 60)[i]));
        assert!(r < b + 30, "{r} {b}");
    }

    #[test]
    fn bands_are_the_striped_triangles_in_one_colour() {
        let stripes =
            |strength| Stripes { strip: StripId(4), at: [0.0, 0.1, 0.2], bulge: [0.0; 3], reach: 0.3, strength };
        let display = DisplaySurface {
            faces: vec![[0, 1, 2], [0, 2, 1]].into(),
            stripes: vec![[None, None], [None, Some(stripes([1.0, 0.0, 0.5]))]],
            ..triangle()
        };
        let band = bands(&display, [1, 2, 3]);
        assert_eq!(band.vertices.len(), 3);
        assert_eq!(
            [0, 1, 2].map(|i| band.vertices[i].stripes[1].colour),
            [[1, 2, 3, 255], [1, 2, 3, 0], [1, 2, 3, 128]]
        );
        let [r, g, b] = strip_rgb(StripId(4));
        assert_eq!(surface(&display, None).vertices[3].stripes[1].colour, [r, g, b, 255]);
    }
}
