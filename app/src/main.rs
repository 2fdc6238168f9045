//! Plait.
fn main() {}
