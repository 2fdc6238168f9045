//! Median times of several reports against mesh size, on logarithmic axes, as SVG.

use std::fmt::Write as _;

use super::hover::{ALTERNATIVES, PROVED, SHOWN, group};
use super::report::Report;
use super::{embed, open, reference, strips};

/// Width and height of the picture, in pixels.
const SIZE: [f64; 2] = [900.0, 600.0];
/// Sides of the plotting area, in pixels.
const LEFT: f64 = 80.0;
const RIGHT: f64 = 660.0;
const TOP: f64 = 24.0;
const BOTTOM: f64 = 540.0;
/// Minimum distance of two labels beside the curves, in pixels.
const LINE: f64 = 17.0;

/// One curve: label, colour, whether it is a reference measurement, and the row of the reports it shows.
struct Curve<'a> {
    name: &'a str,
    colour: &'a str,
    is_reference: bool,
    group: &'a str,
    what: &'a str,
}

impl Curve<'_> {
    /// Triangles and milliseconds (medians), by size.
    fn values(&self, reports: &[Report]) -> Vec<[f64; 2]> {
        let value = |r: &Report| Some([r.mesh.triangles as f64, r.row(self.group, self.what)?.median]);
        let mut list: Vec<[f64; 2]> = reports.iter().filter_map(value).filter(|v| v[0] > 0.0 && v[1] > 0.0).collect();
        list.sort_by(|a, b| a[0].total_cmp(&b[0]));
        list
    }
}

/// A logarithmic axis; its ends are 1, 2 or 5 times a power of ten.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Self {
        let (least, most) = values.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| (l.min(v), h.max(v)));
        let round = |v: f64| [1.0, 2.0, 5.0, 10.0].map(|k| k * 10f64.powf(v.log10().floor()));
        let low = round(least).into_iter().rfind(|&r| r <= least).unwrap_or(least);
        let high = round(most).into_iter().find(|&r| r >= most).unwrap_or(most);
        Self { low, high: high.max(2.0 * low), from, to }
    }

    fn at(&self, value: f64) -> f64 {
        self.from + (value / self.low).ln() / (self.high / self.low).ln() * (self.to - self.from)
    }

    /// Ticks at 1 to 9 times each power of ten, and whether the tick is the power itself.
    fn ticks(&self) -> impl Iterator<Item = (f64, bool)> {
        let [first, last] = [self.low, self.high].map(|v| v.log10().floor() as i32);
        let range = 0.999 * self.low..1.001 * self.high;
        let all = (first..=last).flat_map(|e| (1..10).map(move |k| (10f64.powi(e) * f64::from(k), k == 1)));
        all.filter(move |t| range.contains(&t.0))
    }
}

/// The plot as SVG.
///
/// # Errors
///
/// When the reports hold no row that is plotted.
pub(super) fn svg(reports: &[Report]) -> anyhow::Result<String> {
    let bare = group(0);
    let curve = |name, colour, is_reference, group, what| Curve { name, colour, is_reference, group, what };
    let curves = [
        curve("opened and ready", "#7b4fa3", false, open::GROUP, open::READY),
        curve("a loop shown", "#1b7f3b", false, &bare, SHOWN),
        curve("proved best", "#2060c0", false, &bare, PROVED),
        curve("alternatives to 1.5 × best", "#1593a5", false, &bare, ALTERNATIVES),
        curve("after a placement", "#d07010", false, strips::GROUP, strips::PLACED),
        curve("layout embedded", "#c02050", false, embed::GROUP, embed::EMBEDDED),
        curve("plain Dijkstra", "#555555", true, reference::GROUP, reference::DIJKSTRA),
        curve("Laplacian factored", "#999999", true, reference::GROUP, reference::FACTORED),
    ];
    let drawn: Vec<(&Curve, Vec<[f64; 2]>)> =
        curves.iter().map(|c| (c, c.values(reports))).filter(|c| !c.1.is_empty()).collect();
    anyhow::ensure!(!drawn.is_empty(), "the reports hold nothing to plot; write them with `plait bench all … --json`");
    let all = drawn.iter().flat_map(|c| &c.1);
    let x = Axis::over(all.clone().map(|v| v[0]), LEFT, RIGHT);
    let y = Axis::over(all.map(|v| v[1]), BOTTOM, TOP);
    let [width, height] = SIZE;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"14\">\n<title>Cost against size</title>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    axes(&mut out, &x, &y);
    lines(&mut out, &drawn, &x, &y);
    out += "</svg>\n";
    Ok(out)
}

fn axes(out: &mut String, x: &Axis, y: &Axis) {
    let mut line = |x1: f64, y1: f64, x2: f64, y2: f64, whole: bool| {
        let colour = if whole { "#c4c4c4" } else { "#eeeeee" };
        let _ =
            writeln!(out, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\"/>");
    };
    for (value, whole) in x.ticks() {
        line(x.at(value), TOP, x.at(value), BOTTOM, whole);
    }
    for (value, whole) in y.ticks() {
        line(LEFT, y.at(value), RIGHT, y.at(value), whole);
    }
    let mut label = |x: f64, y: f64, anchor: &str, text: &str| {
        let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"#222\">{text}</text>");
    };
    for (value, _) in x.ticks().filter(|t| t.1) {
        label(x.at(value), BOTTOM + 20.0, "middle", &short(value, ["", "k", "M"]));
    }
    for (value, _) in y.ticks().filter(|t| t.1) {
        label(LEFT - 8.0, y.at(value) + 5.0, "end", &short(value, [" ms", " s", " ks"]));
    }
    label(0.5 * (LEFT + RIGHT), BOTTOM + 44.0, "middle", "triangles");
    let (x, y) = (18.0, 0.5 * (TOP + BOTTOM));
    let _ = writeln!(
        out,
        "<text text-anchor=\"middle\" fill=\"#222\" transform=\"translate({x} {y}) rotate(-90)\">\
         median time</text>"
    );
}

/// A power of ten with a unit for thousands or millions.
fn short(value: f64, units: [&str; 3]) -> String {
    let (scale, unit) = match value {
        v if v > 0.999e6 => (1e6, units[2]),
        v if v > 0.999e3 => (1e3, units[1]),
        _ => (1.0, units[0]),
    };
    // Rounded, since powers of ten are not exact in floating point.
    let value = value / scale;
    let text = if value < 0.999 { format!("{value:.3}") } else { format!("{value:.0}") };
    let text = if text.contains('.') { text.trim_end_matches('0') } else { &text };
    format!("{text}{unit}")
}

fn lines(out: &mut String, drawn: &[(&Curve, Vec<[f64; 2]>)], x: &Axis, y: &Axis) {
    let mut names: Vec<(f64, f64, &Curve)> = Vec::new();
    for (curve, values) in drawn {
        let points: Vec<[f64; 2]> = values.iter().map(|v| [x.at(v[0]), y.at(v[1])]).collect();
        let path: Vec<String> = points.iter().map(|p| format!("{:.1},{:.1}", p[0], p[1])).collect();
        let colour = curve.colour;
        let dash = if curve.is_reference { " stroke-dasharray=\"6 4\"" } else { "" };
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>",
            path.join(" ")
        );
        for [cx, cy] in &points {
            let _ = writeln!(out, "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3.5\" fill=\"{colour}\"/>");
        }
        if let Some(end) = points.last() {
            names.push((end[0], end[1], curve));
        }
    }
    // Labels stand at the ends of their curves, in order from top to bottom, moved apart where they would overlap.
    names.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut places: Vec<f64> = names.iter().map(|n| n.1).collect();
    for i in 1..places.len() {
        places[i] = places[i].max(places[i - 1] + LINE);
    }
    let overrun = places.last().map_or(0.0, |l| (l - BOTTOM).max(0.0));
    for i in (0..places.len()).rev() {
        let room = places.get(i + 1).map_or(BOTTOM, |next| next - LINE);
        places[i] = if overrun > 0.0 { places[i].min(room) } else { places[i] };
    }
    for ((from_x, from_y, curve), at) in names.into_iter().zip(places) {
        let (colour, name, text_x) = (curve.colour, curve.name, RIGHT + 24.0);
        let _ = writeln!(
            out,
            "<path d=\"M{:.1} {from_y:.1} L{:.1} {at:.1}\" stroke=\"{colour}\" stroke-width=\"0.8\" fill=\"none\"/>\n\
             <text x=\"{text_x:.1}\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>",
            from_x + 5.0,
            text_x - 4.0,
            at + 5.0,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::report::Unit;
    use super::*;

    #[test]
    fn every_curve_lies_within_the_axes() {
        let mut reports = Vec::new();
        for (triangles, time) in [(1250, 0.02), (20_000, 4.0), (1_280_000, 3500.0)] {
            let mut report = Report::new(1);
            report.mesh.triangles = triangles;
            report.add(&group(0), SHOWN, Unit::Milliseconds, vec![time]);
            report.add(open::GROUP, open::READY, Unit::Milliseconds, vec![10.0 * time]);
            reports.push(report);
        }
        let picture = svg(&reports).unwrap();
        assert_eq!((picture.matches("<polyline").count(), picture.matches("<circle").count()), (2, 6));
        for text in ["a loop shown", ">1k<", ">1M<", "0.1 ms", "10 s"] {
            assert!(picture.contains(text), "{text} is missing in {picture}");
        }
        let coordinate = |part: &str| part.split('"').next().and_then(|n| n.parse::<f64>().ok()).unwrap();
        assert!(picture.split("cx=\"").skip(1).map(coordinate).all(|x| (LEFT..=RIGHT).contains(&x)));
        assert!(picture.split("cy=\"").skip(1).map(coordinate).all(|y| (TOP..=BOTTOM).contains(&y)));
        assert!(svg(&[Report::new(1)]).is_err());
    }

    #[test]
    fn axes_end_at_round_values() {
        let axis = Axis::over([3.0, 700.0].into_iter(), 0.0, 100.0);
        assert_eq!((axis.low, axis.high), (2.0, 1000.0));
        assert!(axis.at(2.0).abs() < 1e-9 && (axis.at(1000.0) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_single_value_has_an_axis() {
        let axis = Axis::over([5.0].into_iter(), 0.0, 1.0);
        assert!(axis.high > axis.low && axis.at(5.0).is_finite());
    }
}
