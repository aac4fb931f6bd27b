//! The text of a model, and its origin.

use std::fmt;

/// The text of a model and its origin.
#[derive(Debug, Clone)]
pub struct Source {
    pub name: String,
    pub text: String,
    pub origin: Origin,
    /// The model with the values of `--set`, as a file.
    pub changed: Option<String>,
}

impl Source {
    pub fn new(name: String, text: String, origin: Origin) -> Self {
        Self { name, text, origin, changed: None }
    }

    /// The model file that a copy with other values is made of.
    pub fn model(&self) -> &str {
        self.changed.as_deref().unwrap_or(&self.text)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    Builtin,
    File,
    Stdin,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.origin {
            Origin::Builtin => write!(f, "built-in model {}", self.name),
            Origin::File => write!(f, "{}", self.name),
            Origin::Stdin => write!(f, "standard input"),
        }
    }
}
