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

/// The list of all kinds of a folder, each with its module and its public tables.
macro_rules! registry {
    ($(#[$doc:meta])* $kind:ty: $($module:ident::{$($table:ident),+} => $constant:ident,)+) => {
        $(pub use $module::{$($table),+};)+
        $(#[$doc])*
        pub const REGISTRY: &[$kind] = &[$($module::$constant),+];

        /// The kind with that keyword.
        pub fn find(keyword: &str) -> Option<&'static $kind> {
            REGISTRY.iter().find(|kind| kind.keyword == keyword)
        }
    };
}

pub mod block;
pub mod element;
pub mod manoeuvre;
pub mod signal;
