//! The kardan command.
fn main() {}
