//! The program `plait`; see the library `plait_app`.

use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    let filter = tracing_subscriber::EnvFilter::try_from_env("PLAIT_LOG").unwrap_or_else(|_| "error".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    plait_app::cli::run(std::env::args_os(), Arc::new(plait_app::session_engine::SessionOpener))
}
