//! Widths of labels, and shortening of long names.

/// Height of a line of a label, px.
pub(super) const HEIGHT: f64 = 12.0;

/// Width of a character of a label in px, generously for fonts without serifs.
fn width_of(character: char) -> f64 {
    match character {
        ' ' | 'i' | 'j' | 'l' | '\'' | '|' | '.' | ',' | ':' | ';' | '!' => 4.5,
        'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '-' => 5.5,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 12.0,
        'A'..='Z' => 9.0,
        character if character.is_ascii() => 7.6,
        _ => 12.5,
    }
}

/// Width of a label, px.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(width_of).sum()
}

/// The text if it is no wider than this, else its begin and its end with an ellipsis between: names in a row differ at their ends.
pub(super) fn shorten(text: &str, widest: f64) -> String {
    if width(text) <= widest {
        return text.to_owned();
    }
    let characters: Vec<char> = text.chars().collect();
    let of = |length: usize| -> String {
        let tail = length / 3;
        let head = characters[..length - tail].iter();
        head.chain(&['…']).chain(&characters[characters.len() - tail..]).collect()
    };
    (1..characters.len()).rev().map(of).find(|short| width(short) <= widest).unwrap_or_else(|| "…".into())
}

#[cfg(test)]
#[path = "../../tests/unit/mechanism/labels.rs"]
mod tests;
