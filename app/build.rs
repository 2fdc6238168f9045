//! Hands the optimisation level on to the program, which names it beside its benchmark figures.

fn main() {
    let level = std::env::var("OPT_LEVEL").unwrap_or_default();
    println!("cargo:rustc-env=PLAIT_OPT_LEVEL={level}");
    println!("cargo:rerun-if-changed=build.rs");
}
