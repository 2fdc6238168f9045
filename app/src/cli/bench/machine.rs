//! The machine and the program that run times depend on.

use serde::{Deserialize, Serialize};

/// The machine of a measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Machine {
    /// Name of the processor; `None` if the system does not tell.
    pub(super) processor: Option<String>,
    /// Number of cores available to the program.
    pub(super) cores: usize,
    /// Memory in bytes; `None` if the system does not tell.
    pub(super) memory: Option<u64>,
    /// Operating system and architecture.
    pub(super) system: String,
}

impl Machine {
    /// This machine.
    pub(super) fn here() -> Self {
        let processor = field("/proc/cpuinfo", "model name");
        Self {
            processor,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            memory: field("/proc/meminfo", "MemTotal").and_then(|t| kilobytes(&t)),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }
}

/// Version of the program, and its optimisation level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Program {
    version: String,
    optimisation: String,
}

impl Program {
    /// This program.
    pub(super) fn here() -> Self {
        Self { version: env!("CARGO_PKG_VERSION").into(), optimisation: env!("PLAIT_OPT_LEVEL").into() }
    }
}

impl std::fmt::Display for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "plait {}, optimisation level {}", self.version, self.optimisation)
    }
}

/// Peak memory of this process in bytes; `None` if the system does not tell.
pub(super) fn peak_memory() -> Option<u64> {
    field("/proc/self/status", "VmHWM").and_then(|t| kilobytes(&t))
}

/// The value of the first line `name: value` of a file.
fn field(path: &str, name: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    let value = |line: &str| line.split_once(':').filter(|(n, _)| n.trim() == name).map(|(_, v)| v.trim().to_owned());
    text.lines().find_map(value)
}

fn kilobytes(text: &str) -> Option<u64> {
    text.strip_suffix("kB")?.trim().parse::<u64>().ok().map(|n| n * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_in_kilobytes() {
        assert_eq!((kilobytes("2 kB"), kilobytes("2 MB"), kilobytes("kB")), (Some(2048), None, None));
    }
}
