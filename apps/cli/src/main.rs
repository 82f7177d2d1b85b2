//! The `radiosity` program.
fn main() {}
