//! The syntax of model files, in this module only: TOML to [`Entries`](crate::entries::Entries) with their places, and back.

mod syntax;
mod toml;

pub use self::syntax::syntax;
pub use self::toml::{to_toml, value_to_toml};
