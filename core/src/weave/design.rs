//! The design, the document of the program: mesh, options, strips in order, pins.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::mesh::{MeshSource, TriMesh, fingerprint};
use crate::output::{self, FileKind, OutputError};
use crate::surface::SurfaceCurve;
use crate::weave::anchor::Anchor;
use crate::weave::options::Options;

/// Number of a strip, unique within a design and never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StripId(pub u32);

/// Elastic energy of a loop: its length plus weighted squared curvature (8.2), without alignment. Relaxation lowers it
/// within a tube around the loop found; alignment only steered the search.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ElasticEnergy {
    /// Energy of the loop as found in the elastica graph.
    pub found: f64,
    /// Energy of the relaxed curve on the surface; equal to `found` until the loop is relaxed.
    #[serde(rename = "now")]
    pub relaxed: f64,
}

/// A placed strip.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strip {
    /// Its number.
    pub id: StripId,
    /// Its spine on the design mesh.
    pub curve: SurfaceCurve,
    /// Its spine on the proxy, if it was woven on one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub on_proxy: Option<SurfaceCurve>,
    /// Elastica cost of the loop as it was found.
    pub cost: f64,
    /// Its elastic energy as placed, if it was a loop of the elastica graph.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<ElasticEnergy>,
    /// Whether it is drawn.
    pub visible: bool,
    /// The anchors that its spine passes in order; none if it was not placed by hand.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub anchors: Vec<Anchor>,
}

impl Strip {
    /// Its spine on the woven mesh.
    pub fn woven(&self) -> &SurfaceCurve {
        self.on_proxy.as_ref().unwrap_or(&self.curve)
    }
}

/// A part of the layout that keeps its position when the embedding is optimised. It is identified by a point of the initial
/// embedding, which is the same for the same strips; coordinates are those of the mesh
/// normalised as the options say.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Pin {
    /// The node at this point.
    Node([f64; 3]),
    /// The arc with this point in its middle.
    Arc([f64; 3]),
}

/// Why a design could not be read or written.
#[derive(Debug, Error)]
pub enum DesignError {
    /// The file could not be read.
    #[error("{path}: {source}")]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] OutputError),
    /// The file is not a design.
    #[error("{path} is not a Plait design: {source}")]
    Format {
        /// The file.
        path: PathBuf,
        /// The error of the parser, with line and column.
        source: serde_json::Error,
    },
    /// The design was written by a newer version of the program.
    #[error("the design has format version {0}; this program reads up to {VERSION}")]
    Version(u32),
    /// The mesh is not the one that the design was made on.
    #[error("the mesh {mesh} differs from the one that this design was made on")]
    OtherMesh {
        /// Where it was read.
        mesh: String,
    },
}

/// Version of the file format.
const VERSION: u32 = 1;

/// A design: a plain value that a session transforms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// Version of the format.
    pub version: u32,
    /// Where the mesh comes from.
    pub mesh: MeshSource,
    /// Fingerprint of the design mesh, to detect that it has changed.
    pub fingerprint: String,
    /// The options.
    pub options: Options,
    /// Fingerprint of the proxy that strips were woven on, to detect that another version builds another proxy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proxy: Option<String>,
    /// The strips in the order placed.
    pub strips: Vec<Strip>,
    /// Nodes and arcs of the layout that keep their positions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pins: Vec<Pin>,
}

impl Design {
    /// A design without strips.
    pub fn new(source: MeshSource, mesh: &TriMesh, options: Options) -> Self {
        let (proxy, strips, pins) = (None, Vec::new(), Vec::new());
        Self { version: VERSION, mesh: source, fingerprint: fingerprint(mesh), options, proxy, strips, pins }
    }

    /// Reads a design.
    ///
    /// # Errors
    ///
    /// When the file cannot be read, is not a design, or has a newer version.
    pub fn read(path: &Path) -> Result<Self, DesignError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| DesignError::File { path: path.to_owned(), source })?;
        let design: Self =
            serde_json::from_str(&text).map_err(|source| DesignError::Format { path: path.to_owned(), source })?;
        if design.version > VERSION {
            return Err(DesignError::Version(design.version));
        }
        Ok(design)
    }

    /// Writes the design. It replaces an older design, but no other file.
    ///
    /// # Errors
    ///
    /// [`DesignError::Write`].
    pub fn write(&self, path: &Path) -> Result<(), DesignError> {
        let text =
            serde_json::to_string(self).map_err(|source| DesignError::Format { path: path.to_owned(), source })?;
        Ok(output::write(path, FileKind::Design, |out| writeln!(out, "{text}"))?)
    }

    /// Checks that `mesh` is the one that the design was made on and that all strips lie on it.
    ///
    /// # Errors
    ///
    /// [`DesignError::OtherMesh`].
    pub fn check_mesh(&self, mesh: &TriMesh) -> Result<(), DesignError> {
        let fits = fingerprint(mesh) == self.fingerprint && self.strips.iter().all(|s| s.curve.check(mesh).is_ok());
        if fits { Ok(()) } else { Err(DesignError::OtherMesh { mesh: self.mesh.to_string() }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, torus};

    fn strip(curve: SurfaceCurve) -> Strip {
        let energy = Some(ElasticEnergy { found: 2.0, relaxed: 1.5 });
        Strip { id: StripId(3), curve, on_proxy: None, cost: 2.5, energy, visible: false, anchors: Vec::new() }
    }

    fn design() -> (TriMesh, Design) {
        let mesh = torus(8, 6);
        let mut design = Design::new(MeshSource::Builtin("torus".to_owned()), &mesh, Options::default());
        design.strips.push(strip(row(8, 2, true, 0.25)));
        design.pins.push(Pin::Node([0.0, 1.0, 2.0]));
        (mesh, design)
    }

    #[test]
    fn a_design_is_read_as_it_was_written() {
        let (_, design) = design();
        let text = serde_json::to_string(&design).unwrap();
        assert_eq!(serde_json::from_str::<Design>(&text).unwrap(), design);
        // Designs of before name the relaxed energy so.
        assert!(text.contains(r#""energy":{"found":2.0,"now":1.5}"#), "{text}");
    }

    #[test]
    fn a_design_fits_its_own_mesh_only() {
        let (mesh, mut design) = design();
        assert!(design.check_mesh(&mesh).is_ok());
        assert!(matches!(design.check_mesh(&torus(8, 7)), Err(DesignError::OtherMesh { .. })));
        // The fingerprint alone does not do: the curves must lie on the mesh.
        design.strips[0].curve.crossings.truncate(1);
        assert!(design.check_mesh(&mesh).is_err());
    }

    #[test]
    fn a_design_of_a_later_program_is_refused() {
        let (_, mut design) = design();
        design.version = VERSION + 1;
        let path = std::env::temp_dir().join(format!("plait-design-{}.plait", std::process::id()));
        design.write(&path).unwrap();
        let read = Design::read(&path);
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(read, Err(DesignError::Version(2))), "{read:?}");
    }

    #[test]
    fn a_strip_is_woven_on_the_proxy_if_it_has_a_curve_there() {
        let mut strip = strip(row(8, 2, true, 0.25));
        assert_eq!(strip.woven(), &strip.curve);
        strip.on_proxy = Some(row(8, 3, true, 0.25));
        assert_eq!(strip.woven(), &row(8, 3, true, 0.25));
    }
}
