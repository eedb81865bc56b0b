//! The `lumencast` program.
fn main() {}
