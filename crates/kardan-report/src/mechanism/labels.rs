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
mod tests {
    use super::*;

    #[test]
    fn long_names_show_begin_and_end() {
        let name = format!("shaft_{}_17", "x".repeat(80));
        let short = shorten(&name, 100.0);
        assert!(short.starts_with("shaft_") && short.ends_with("17") && short.contains('…'), "{short}");
        assert!(width(&short) <= 100.0);
        assert_eq!(shorten("rk", 100.0), "rk");
        assert_eq!(shorten("漢字漢字漢字漢字", 30.0).chars().count(), 2);
    }
}
