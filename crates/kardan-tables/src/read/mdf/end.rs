//! Whether a file contains all of its blocks.

use std::collections::HashSet;

use super::super::LogError;
use super::super::source::Source;
use super::blocks::{Header, MDF};

/// Largest number of examined blocks.
const MOST: usize = 1 << 20;

/// The first block found that the file truncates or lacks. The search follows links from the header, also to blocks that are not read; of a
/// list of records it examines only the last block.
pub(super) fn missing(source: &Source) -> Option<LogError> {
    let mut visited = HashSet::new();
    let mut open = vec![64];
    while let Some(at) = open.pop() {
        if at == 0 || visited.len() == MOST || !visited.insert(at) {
            continue;
        }
        let header = match Header::read(source, at) {
            Ok(header) => header,
            Err(error @ LogError::Truncated { .. }) => return Some(error),
            Err(_) => continue,
        };
        if header.end() > source.size {
            let what = format!("the block {} at byte {at} extends to byte {}", header.name(), header.end());
            return Some(LogError::Truncated { format: MDF, what, end: source.size });
        }
        let links = header.links(source).unwrap_or_default();
        match (&header.id, links.split_first()) {
            (b"##DL", Some((next, records))) => open.extend(records.iter().max().into_iter().chain([next])),
            _ => open.extend(links),
        }
    }
    None
}
