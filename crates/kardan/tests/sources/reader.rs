//! Sources as the tests of this folder read them: without comments, text and tests.

use std::fs;
use std::path::{Path, PathBuf};

/// The sources of a folder, in order.
pub fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut out = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                out.push(path);
            }
        }
    }
    out.sort();
    out
}

/// A folder beside the manifest.
pub fn crate_folder(relative: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(relative)
}

/// All crates beside this one, with their sources.
pub fn crates() -> Vec<(String, PathBuf)> {
    let entries = fs::read_dir(crate_folder("..")).expect("the crates");
    let mut out: Vec<(String, PathBuf)> = entries
        .map(|entry| entry.expect("an entry"))
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), entry.path().join("src")))
        .filter(|(_, src)| src.is_dir())
        .collect();
    out.sort();
    out
}

/// The code of a file: comments and the contents of text literals blanked, items under `#[cfg(test)]` cut out.
pub fn code(source: &str) -> String {
    let blank = blank(source);
    let mut out = String::new();
    let mut tail = blank.as_str();
    while let Some(at) = tail.find("#[cfg(test)]") {
        out.push_str(&tail[..at]);
        tail = after_item(&tail[at..]);
    }
    out + tail
}

/// The text literals of a file, without those of its module of tests; lines that go on are joined as the compiler does.
pub fn texts(source: &str) -> Vec<String> {
    let source = source.split("#[cfg(test)]\n").next().unwrap_or_default();
    let bytes: Vec<char> = source.chars().collect();
    let (mut out, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let tail = &bytes[at..];
        let length = token(&bytes, at);
        if matches!(tail[0], '"' | 'r') && length > 1 {
            let text: String = tail[..length].iter().collect();
            let mut joined = String::new();
            for (k, part) in text.split("\\\n").enumerate() {
                joined += if k == 0 { part } else { part.trim_start() };
            }
            out.push(joined.trim_start_matches(['r', '#']).trim_end_matches('#').trim_matches('"').to_string());
        }
        at += length.max(1);
    }
    out
}

/// The length of the comment or of the literal that begins at a place, or 0.
fn token(bytes: &[char], at: usize) -> usize {
    let tail = &bytes[at..];
    match tail {
        ['/', '/', ..] => tail.iter().position(|c| *c == '\n').unwrap_or(tail.len()),
        ['/', '*', ..] => block_comment(tail),
        ['"', ..] => quoted(tail),
        ['r', '"' | '#', ..] if at == 0 || !(bytes[at - 1].is_alphanumeric() || bytes[at - 1] == '_') => raw(tail),
        ['\'', '\\', ..] => 3 + tail[3..].iter().position(|c| *c == '\'').unwrap_or(0),
        ['\'', _, '\'', ..] => 3,
        _ => 0,
    }
}

/// What follows an item: after its closing brace, or after its semicolon if that comes first.
fn after_item(item: &str) -> &str {
    let mut depth = 0;
    for (at, c) in item.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return &item[at + 1..],
            _ => continue,
        }
        if depth == 0 {
            return &item[at + 1..];
        }
    }
    ""
}

/// Comments gone, text and character literals empty; lines keep their numbers.
fn blank(source: &str) -> String {
    let bytes: Vec<char> = source.chars().collect();
    let mut out = String::new();
    let mut at = 0;
    let newlines = |text: &[char]| text.iter().filter(|c| **c == '\n').collect::<String>();
    while at < bytes.len() {
        let tail = &bytes[at..];
        let length = token(&bytes, at);
        if length == 0 {
            out.push(tail[0]);
            at += 1;
        } else {
            if !matches!(tail, ['/', ..]) {
                out.push_str("\"\"");
            }
            out.push_str(&newlines(&tail[..length]));
            at += length;
        }
    }
    out
}

fn block_comment(tail: &[char]) -> usize {
    (2..tail.len()).find(|&k| tail[k - 1] == '*' && tail[k] == '/').map_or(tail.len(), |k| k + 1)
}

fn quoted(tail: &[char]) -> usize {
    let mut at = 1;
    while at < tail.len() && tail[at] != '"' {
        at += if tail[at] == '\\' { 2 } else { 1 };
    }
    (at + 1).min(tail.len())
}

/// The length of a raw text literal, or 0 if this is a raw identifier.
fn raw(tail: &[char]) -> usize {
    let hashes = tail[1..].iter().take_while(|c| **c == '#').count();
    if tail.get(1 + hashes) != Some(&'"') {
        return 0;
    }
    let closing: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
    let start = 2 + hashes;
    (start..tail.len()).find(|&k| tail[k..].starts_with(&closing)).map_or(tail.len(), |k| k + closing.len())
}

/// Whether the character before a byte can belong to a longer name.
pub fn inside_name(code: &str, at: usize) -> bool {
    code[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || c == '_')
}

/// The name that a code begins with.
pub fn name_at(code: &str) -> String {
    code.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}
