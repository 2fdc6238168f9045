//! The structure of the source: no cycles between files or folders, no long functions, no long files.

use std::path::{Path, PathBuf};

use plait_structure::{Cycle, cycles, read};

/// Most lines of a function: what fits on a screen.
const FUNCTION: usize = 60;
/// Most lines of a file: one concept.
const FILE: usize = 500;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_path_buf()
}

fn crates() -> [PathBuf; 2] {
    ["core", "app"].map(|name| repository().join(name).join("src/lib.rs"))
}

fn listed(found: &[Cycle]) -> String {
    let one = |c: &Cycle| {
        let members: Vec<String> = c.members.iter().map(|m| m.display().to_string()).collect();
        format!("cycle of {}\n    {}", members.join(", "), c.uses.join("\n    "))
    };
    found.iter().map(one).collect::<Vec<_>>().join("\n")
}

#[test]
fn no_file_or_folder_uses_one_that_uses_it() {
    let mut found = Vec::new();
    for root in crates() {
        let sources = read(&root);
        assert!(sources.edges.len() > 50, "{}: hardly any uses were read", root.display());
        found.extend(cycles(&sources.edges));
    }
    assert!(found.is_empty(), "{}", listed(&found));
}

#[test]
fn functions_have_at_most_60_lines() {
    let mut long = Vec::new();
    for root in crates() {
        let sources = read(&root);
        assert!(sources.functions.len() > 100, "{}: hardly any functions were read", root.display());
        long.extend(sources.functions.into_iter().filter(|f| f.lines > FUNCTION));
    }
    assert!(long.is_empty(), "longer than {FUNCTION} lines: {long:#?}");
}

#[test]
fn files_have_at_most_500_lines() {
    let mut folders: Vec<PathBuf> = ["core", "app/src", "tests"].map(|f| repository().join(f)).into();
    let mut long = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let lines = std::fs::read_to_string(&path).unwrap().lines().count();
                if lines > FILE {
                    long.push(format!("{}: {lines}", path.display()));
                }
            }
        }
    }
    assert!(long.is_empty(), "longer than {FILE} lines: {long:#?}");
}

/// Writes a crate of some files and returns its cycles.
fn planted(files: &[(&str, &str)]) -> Vec<Cycle> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    cycles(&read(&folder.path().join("lib.rs")).edges)
}

#[test]
fn a_planted_cycle_is_found_however_it_is_written() {
    let top = ("lib.rs", "mod a;\nmod b;\n");
    let down = ("b.rs", "use crate::a::A;\npub struct B(A);\npub fn b() -> u8 { 0 }\n");
    for (way, text) in [
        ("use", "use super::b::B;\npub struct A;\nfn f(_: B) {}\n"),
        ("path in a body", "pub struct A;\nfn f() { let _ = super::b::b(); }\n"),
        ("path in a macro", "pub struct A;\nfn f() { assert_eq!(crate::b::b(), 0); }\n"),
        ("path in a nested module", "pub struct A;\nmod inner { fn f() { super::super::b::b(); } }\n"),
        ("use in a body", "pub struct A;\nfn f() { use crate::b::b; b(); }\n"),
    ] {
        let found = planted(&[top, down, ("a.rs", text)]);
        assert_eq!(found.len(), 1, "{way}");
        assert_eq!(found[0].members, [Path::new("a.rs"), Path::new("b.rs")], "{way}");
    }
    let one_way = planted(&[top, down, ("a.rs", "pub struct A;\n#[cfg(test)]\nmod tests { use crate::b::B; }\n")]);
    assert!(one_way.is_empty(), "{}", listed(&one_way));
}

#[test]
fn a_planted_cycle_is_found_through_reexports_and_between_folders() {
    // `high` re-exports what `high/part.rs` defines; `low` uses it by the short name.
    let files = [
        ("lib.rs", "pub mod low;\npub mod high;\n"),
        ("low/mod.rs", "mod shape;\nmod use_;\npub use shape::Shape;\n"),
        ("low/shape.rs", "pub struct Shape;\n"),
        ("low/use_.rs", "fn f(_: crate::high::Part) {}\n"),
        ("high/mod.rs", "mod part;\npub use part::Part;\n"),
        ("high/part.rs", "use crate::low::Shape;\npub struct Part(Shape);\n"),
    ];
    let found = planted(&files);
    // No two files use each other, but the folders do.
    assert_eq!(found.len(), 1, "{}", listed(&found));
    assert_eq!(found[0].members, [Path::new("high"), Path::new("low")]);
    assert!(found[0].uses.iter().any(|u| u.starts_with("low/use_.rs -> high/part.rs")), "{:?}", found[0].uses);
}
