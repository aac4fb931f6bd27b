//! The record of the jobs submitted from a folder, `jobs.txt`: the sweep, the number of shards, the jobs. Its last line is a checksum of those before it, so
//! that kardan accepts only numbers that it wrote.

use std::fmt::Write as _;

use kardan::num::Random;

/// Shards of a sweep, at most.
pub const MOST_SHARDS: u64 = 1000;

/// The submitted jobs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Record {
    /// Description of the sweep.
    pub sweep: String,
    pub shards: u64,
    /// Jobs in queues: name of the queue, and number.
    pub jobs: Vec<String>,
}

impl Record {
    /// The text of the file.
    pub fn to_text(&self) -> String {
        let mut text = format!("sweep {}\nshards {}\n", self.sweep, self.shards);
        self.jobs.iter().for_each(|job| {
            let _ = writeln!(text, "job {job}");
        });
        let sum = checksum(&text);
        text + &sum
    }

    /// Parses the text of the file.
    ///
    /// # Errors
    /// The error in the text.
    pub fn read(bytes: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(bytes).map_err(|_| "it is not text")?;
        if !text.starts_with("sweep kardan ") {
            return Err("it does not start with `sweep kardan `".into());
        }
        let at = text.rfind("checksum ").ok_or("it has no checksum in its last line")?;
        let (lines, sum) = text.split_at(at);
        if sum != checksum(lines) {
            return Err("its checksum is wrong".into());
        }
        let of = |key: &'static str| lines.lines().filter_map(move |line| line.strip_prefix(key)?.strip_prefix(' '));
        let shards = of("shards").next().unwrap_or_default();
        let number = shards.parse().ok().filter(|number| (1..=MOST_SHARDS).contains(number));
        Ok(Self {
            sweep: of("sweep").next().unwrap_or_default().into(),
            shards: number.ok_or_else(|| format!("`shards {shards}` is not a number from 1 to {MOST_SHARDS}"))?,
            jobs: of("job").map(String::from).collect(),
        })
    }
}

/// The last line.
fn checksum(lines: &str) -> String {
    format!("checksum {:016x}\n", Random::fnv(Random::FNV, lines.as_bytes()))
}

#[cfg(test)]
#[path = "../../../tests/unit/commands/cluster/record.rs"]
mod tests;
