//! What a model file can contain: elements, signals, signal blocks and manoeuvres, one file each, and one registry for each kind.
//!
//! An element is a list of terms; it knows no file and no other element. Begin with [`element::REGISTRY`], [`element::Element`] and
//! [`signal::SignalKind`].
//!
//! ```
//! let gear = kardan_elements::element::find("gear").unwrap();
//! assert!(gear.fields.iter().any(|field| field.name == "ratio"));
//! ```
#![deny(clippy::disallowed_methods)]

pub mod block;
pub mod element;
pub mod manoeuvre;
pub mod signal;
