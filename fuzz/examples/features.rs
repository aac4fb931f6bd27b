//! Nothing: with an example, cargo chooses the features of all dependencies as for tests, so that fuzzing uses what these have built.

fn main() {}
