//! Errors of reading a log.

use std::io;

use thiserror::Error;

/// Why a log cannot be read, or only in part.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LogError {
    /// There are no bytes.
    #[error("the file is empty (0 bytes): the recording or the copy stopped before it wrote anything")]
    Empty,
    /// The bytes end too early.
    #[error(
        "the {format} file is truncated: {what} (the file ends at byte {end}); \
         copy it again or repair it with the tool that wrote it"
    )]
    Truncated {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// What is missing.
        what: String,
        /// The size of the file in bytes.
        end: u64,
    },
    /// The bytes violate the format.
    #[error("the {format} file is damaged {place}: {what}; copy it again or repair it with the tool that wrote it")]
    Damaged {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// Where: byte, or row and column.
        place: String,
        /// The error.
        what: String,
    },
    /// The bytes are valid, but not supported.
    #[error("{what}; {help}")]
    Unsupported {
        /// The contents found.
        what: String,
        /// How to correct it.
        help: String,
    },
    /// The file contains no series of numbers.
    #[error("the {format} file has no channel: {why}")]
    NoChannels {
        /// `CSV`, `MAT`, `MDF` or `Parquet`.
        format: &'static str,
        /// What was searched, and how to correct it.
        why: String,
    },
    /// [`Log::choose`](super::Log::choose) had an unknown channel.
    #[error("there is no channel {channel} in group {group} (both counted from 0); choose from the listed groups")]
    UnknownChannel {
        /// The requested group.
        group: usize,
        /// The requested channel.
        channel: usize,
    },
    /// The system could not read.
    #[error("the file cannot be read: {0}")]
    Read(String),
}

impl LogError {
    pub(super) fn damaged(format: &'static str, place: impl Into<String>, what: impl Into<String>) -> Self {
        Self::Damaged { format, place: place.into(), what: what.into() }
    }

    pub(super) fn unsupported(what: impl Into<String>, help: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), help: help.into() }
    }
}

impl From<io::Error> for LogError {
    fn from(error: io::Error) -> Self {
        Self::Read(error.to_string())
    }
}
