//! Weave scripts and designs as the program writes them, replayed once in each test program.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

use plait_core::weave::{Design, MeshSource, Script};
use serde_json::Value;

use super::{errors, plait, root, skip, text};

/// The output of a script or a design.
pub struct Replay {
    /// The folder with all files.
    pub folder: PathBuf,
    /// The mesh file.
    pub source: PathBuf,
    /// `report.json`.
    pub report: Value,
}

impl Replay {
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub fn layout(&self) -> &Value {
        &self.report["layout"]
    }

    pub fn embedding(&self) -> &Value {
        &self.report["layout"]["embedding"]
    }
}

/// A weave script of the repository.
pub fn script(name: &str) -> PathBuf {
    root().join("tests/scripts").join(name).with_extension("json")
}

/// A design of the repository.
pub fn design(name: &str) -> PathBuf {
    root().join("tests/designs").join(name).with_extension("plait")
}

/// The report in a folder.
pub fn report(folder: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("report.json")).unwrap()).unwrap()
}

/// Calls `plait weave` on a script or design; `None` where its mesh is missing. Each input and choice of optimisation
/// is replayed once, whichever test asks first.
pub fn replayed(input: &Path, optimise: bool) -> Option<Arc<Replay>> {
    type Slot = Arc<OnceLock<Option<Arc<Replay>>>>;
    static SLOTS: OnceLock<Mutex<HashMap<(PathBuf, bool), Slot>>> = OnceLock::new();
    let slot = {
        let mut slots = SLOTS.get_or_init(Mutex::default).lock().unwrap_or_else(|e| e.into_inner());
        Arc::clone(slots.entry((input.to_owned(), optimise)).or_default())
    };
    slot.get_or_init(|| run(input, optimise).map(Arc::new)).clone()
}

fn run(input: &Path, optimise: bool) -> Option<Replay> {
    let source = mesh_file(input);
    if !source.is_file() {
        skip(&format!("{}: there is no {}", input.display(), source.display()));
        return None;
    }
    let kind = if optimise { "optimised" } else { "initial" };
    let place = input.file_name().unwrap().to_string_lossy().replace('.', "-");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME")).join(kind).join(place);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).unwrap();
    }
    let more: &[&str] = if optimise { &[] } else { &["--no-optimise"] };
    let output = plait(&[&["weave", text(input), "--out", text(&folder)], more].concat());
    assert!(output.status.success(), "{}: {}", input.display(), errors(&output));
    let report = report(&folder);
    Some(Replay { folder, source, report })
}

/// The mesh file of a script or a design.
fn mesh_file(input: &Path) -> PathBuf {
    let source = if input.extension().is_some_and(|e| e == "plait") {
        Design::read(input).unwrap().mesh
    } else {
        MeshSource::from_name(&Script::read(input).unwrap().mesh)
    };
    match source {
        MeshSource::Builtin(name) => root().join("assets/models").join(name).with_extension("obj"),
        MeshSource::File(file) => input.parent().unwrap().join(file),
    }
}
