//! The `hemilux` command.
fn main() {}
