//! Tests of `src/diagnostics.rs`.

use super::*;

/// Line and column by reading from the start, as defined.
fn read(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..text.floor_char_boundary(offset)];
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.split('\n').count(), line.chars().count() + 1)
}

#[test]
fn places_are_those_of_reading_from_the_start() {
    let long = "aβ🙂\t".repeat(300);
    let texts = ["", "\n", "a", "a\n", "\n\nβ\r\nc", &long, &format!("β\n{long}\n{long}x\n\n")];
    for text in texts {
        let lines = Lines::new(text);
        for offset in 0..text.len() + 3 {
            assert_eq!(lines.line_column(text, offset), read(text, offset), "{offset} of {text:?}");
            let line = lines.line(offset);
            assert!(lines.start(line) <= offset && lines.start(line + 1) >= offset.min(text.len()));
        }
    }
}
