//! What the sources of all crates keep to: the order of the layers and of the rooms of `study`, no circles between files, functions that can be read, evidence behind each promise.
//!
//! A test binary of its own: it reads files and links nothing of the library.

mod circles;
mod layers;
mod lengths;
mod reader;
mod study_rooms;
mod verdicts;
