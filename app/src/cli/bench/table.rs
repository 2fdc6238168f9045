//! Reports as text: one in full, or the main results of several as a Markdown table.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::hover::{ALTERNATIVES, PROVED, SHOWN, group};
use super::report::{Report, Row, Unit};
use super::{embed, open, reference, strips};

/// All results of a report, for a terminal.
pub(super) fn text(report: &Report) -> String {
    let (mesh, graph) = (&report.mesh, &report.graph);
    let mut text = format!(
        "{}: {} triangles, {} vertices, genus {}, boundary loops {}{}\nsearch graph: {} states, {} steps, {}\n{}\nseed {}",
        mesh.name,
        mesh.triangles,
        mesh.vertices,
        mesh.genus,
        mesh.boundary_loops,
        mesh.proxy.map(|n| format!(", woven on a proxy of {n} triangles")).unwrap_or_default(),
        graph.states,
        graph.steps,
        megabytes(Some(graph.bytes as u64)),
        machine(report),
        report.seed,
    );
    if let Some(bytes) = report.peak_memory {
        let _ = write!(text, ", peak memory {}", megabytes(Some(bytes)));
    }
    let _ = writeln!(text, "\n\n{:<44}{:>10}{:>10}{:>10}{:>7}", "milliseconds", "median", "p95", "worst", "count");
    let mut last = "";
    for row in &report.rows {
        if row.group != last {
            let _ = writeln!(text, "{}", row.group);
            last = &row.group;
        }
        let sign = if row.unit == Unit::Milliseconds { "" } else { " (number)" };
        let name = format!("  {}{sign}", row.what);
        let [median, p95, worst] = [row.median, row.p95, row.worst].map(figure);
        let _ = writeln!(text, "{name:<44}{median:>10}{p95:>10}{worst:>10}{:>7}", row.count);
    }
    text
}

/// The main results, one line per report.
pub(super) fn markdown(reports: &[Report]) -> String {
    let bare = group(0);
    let both = |r: &Row| format!("{} / {}", figure(r.median), figure(r.p95));
    let median = |r: &Row| figure(r.median);
    type Cell<'a> = (&'a str, &'a str, &'a str, &'a dyn Fn(&Row) -> String);
    let columns: [Cell; 10] = [
        ("opened and ready", open::GROUP, open::READY, &median),
        ("a loop shown, median / p95", &bare, SHOWN, &both),
        ("proved best, median / p95", &bare, PROVED, &both),
        ("alternatives to 1.5 × best, median", &bare, ALTERNATIVES, &median),
        ("cross field after a placement, median", strips::GROUP, "Cross field", &median),
        ("strip map, median", strips::GROUP, "Strip map", &median),
        ("all that follows a placement, median", strips::GROUP, strips::PLACED, &median),
        ("embedded", embed::GROUP, embed::EMBEDDED, &median),
        ("plain Dijkstra over the graph", reference::GROUP, reference::DIJKSTRA, &median),
        ("Laplacian factored", reference::GROUP, reference::FACTORED, &median),
    ];
    let machines: BTreeSet<String> = reports.iter().map(machine).collect();
    let mut text: String = machines.iter().map(|m| format!("{m}.\n")).collect();
    let names: Vec<&str> = columns.iter().map(|c| c.0).collect();
    let _ = writeln!(text, "\n| milliseconds | triangles | {} | peak memory |", names.join(" | "));
    text += &"|---".repeat(columns.len() + 3);
    text += "|\n";
    for report in reports {
        let cells = columns.iter().map(|(_, group, what, show)| report.row(group, what).map(show).unwrap_or_default());
        let cells: Vec<String> = cells.collect();
        let mesh = &report.mesh;
        let levels = if mesh.subdivided > 0 { format!(", subdivided {}×", mesh.subdivided) } else { String::new() };
        let (name, memory) = (format!("{}{levels}", mesh.name), megabytes(report.peak_memory));
        let proxy = mesh.proxy.map(|n| format!(" (proxy {n})")).unwrap_or_default();
        let _ = writeln!(text, "| {name} | {}{proxy} | {} | {memory} |", mesh.triangles, cells.join(" | "));
    }
    text
}

fn machine(report: &Report) -> String {
    let machine = &report.machine;
    format!(
        "{}, {} cores, {}, {}; {}; {} threads",
        machine.processor.as_deref().unwrap_or("an unknown processor"),
        machine.cores,
        megabytes(machine.memory),
        machine.system,
        report.program,
        report.threads,
    )
}

fn megabytes(bytes: Option<u64>) -> String {
    bytes.map(|b| format!("{} MB", figure(b as f64 / 1e6))).unwrap_or_default()
}

/// At least three significant digits, and all digits before the point.
fn figure(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        v if v < 1.0 => format!("{value:.3}"),
        v if v < 10.0 => format!("{value:.2}"),
        v if v < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_as_many_cells_everywhere() {
        let mut report = Report::new(1);
        report.add(&group(0), SHOWN, Unit::Milliseconds, vec![1.234, 56.78, 901.2]);
        let table = markdown(&[report.clone(), report.clone()]);
        assert!(table.contains("| 56.8 / 901 |"), "{table}");
        let lines: Vec<usize> = table.lines().filter(|l| l.starts_with('|')).map(|l| l.matches('|').count()).collect();
        assert_eq!(lines, [lines[0]; 4]);
        assert_eq!(table.lines().filter(|l| l.contains("threads")).count(), 1);
        assert!(text(&report).contains("a loop shown"));
    }

    #[test]
    fn numbers_have_three_digits_or_all_before_the_point() {
        let texts = [0.0, 0.1234, 1.234, 12.34, 12345.6].map(figure);
        assert_eq!(texts, ["0", "0.123", "1.23", "12.3", "12346"]);
    }
}
