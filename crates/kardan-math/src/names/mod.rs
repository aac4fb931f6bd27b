//! Names in sentences, and the messages for unknown ones.

mod list;

use std::borrow::Cow;

pub use list::{HasName, NamedList};

/// A term of a sum as text: whether it is subtracted, and the text without its sign.
pub type SignedTerm = (bool, String);

/// A sum as text; `0` without terms.
///
/// ```
/// use kardan_math::names::signed_sum;
/// assert_eq!(signed_sum([(true, "a".into()), (false, "2 b".into())]), "-a + 2 b");
/// ```
pub fn signed_sum(terms: impl IntoIterator<Item = SignedTerm>) -> String {
    let mut out = String::new();
    for (is_negative, term) in terms {
        out += sign(out.is_empty(), is_negative);
        out += &term;
    }
    if out.is_empty() { "0".into() } else { out }
}

/// What is before a term of a sum.
pub fn sign(is_first: bool, is_negative: bool) -> &'static str {
    match (is_first, is_negative) {
        (true, false) => "",
        (true, true) => "-",
        (false, false) => " + ",
        (false, true) => " - ",
    }
}

/// The candidate nearest to a misspelt word, if one is near enough.
///
/// Letters are compared without case; a single letter has no other letter near it. Among equally near
/// candidates the one with the same letters in upper and lower case wins, then the one with the same first letter.
///
/// ```
/// use kardan_math::names::nearest;
/// assert_eq!(nearest("inerta", ["damping", "inertia"]), Some("inertia"));
/// assert_eq!(nearest("q", ["a", "b"]), None);
/// assert_eq!(nearest("Q", ["a", "q"]), Some("q"));
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 100; // the distance takes the product of both lengths
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    let tolerance = if length < 2 { 0 } else { 1 + length / 3 };
    let lower = word.to_lowercase();
    let letters_of_word = letters(word);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= 4 * LONGEST)
        // The distance itself costs a hundred times as much, and thousands of names may be compared with thousands.
        .filter(|candidate| least_distance(letters_of_word, letters(candidate)) <= tolerance)
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= tolerance && (*distance < length || *distance == 0))
        .min_by_key(|(distance, candidate)| {
            let exact = strsim::damerau_levenshtein(word, candidate);
            (*distance, exact, candidate.chars().next() != word.chars().next(), candidate.len())
        })
        .map(|(_, candidate)| candidate)
}

/// The candidate nearest to a misspelt word; else the only one that shares a whole word of four letters or more with it.
///
/// ```
/// use kardan_math::names::nearest_or_similar;
/// assert_eq!(nearest_or_similar("max_torque", ["torque_limit", "rate_limit"]), Some("torque_limit"));
/// assert_eq!(nearest_or_similar("harmonic", ["harmonic_drive", "gear"]), Some("harmonic_drive"));
/// assert_eq!(nearest_or_similar("limit", ["torque_limit", "rate_limit"]), None);
/// ```
pub fn nearest_or_similar<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> Option<&'a str> {
    let parts = |name: &str| name.split(['_', '-']).map(str::to_lowercase).collect::<Vec<_>>();
    let own: Vec<String> = parts(word).into_iter().filter(|part| part.chars().count() >= 4).collect();
    let similar = || {
        let mut found =
            candidates.clone().into_iter().filter(|candidate| parts(candidate).iter().any(|part| own.contains(part)));
        let first = found.next();
        if found.next().is_none() { first } else { None }
    };
    nearest(word, candidates.clone()).or_else(similar)
}

/// Which letters are in a word, in lower case and in 64 classes: one bit each.
fn letters(word: &str) -> u64 {
    if word.is_ascii() {
        return word.bytes().fold(0, |set, byte| set | 1 << (byte.to_ascii_lowercase() % 64));
    }
    word.chars().flat_map(char::to_lowercase).fold(0, |set, c| set | 1 << (u32::from(c) % 64))
}

/// Lower bound of the edit distance between two words: insertions, deletions and substitutions.
fn least_distance(one: u64, other: u64) -> usize {
    (one & !other).count_ones().max((other & !one).count_ones()) as usize
}

/// Names in backquotes for a sentence, at most a dozen of them: `` `a`, `b` and 3 more ``.
pub fn quoted(names: impl IntoIterator<Item: AsRef<str>>) -> String {
    const MOST: usize = 12;
    let names: Vec<String> = names.into_iter().map(|name| format!("`{}`", shortened(name.as_ref()))).collect();
    match names.len() {
        0..=MOST => names.join(", "),
        count => format!("{} and {} more", names[..MOST].join(", "), count - MOST),
    }
}

/// All names in backquotes: `` `a`, `b` ``.
pub fn backquoted<S: AsRef<str>>(names: &[S]) -> String {
    names.iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
}

/// A text whose characters are shown in their order: those that change the direction of the following text (Unicode, bidirectional formatting)
/// are written as escapes, for with them a name looks like another one.
///
/// ```
/// use kardan_math::names::bidi_escaped;
/// assert_eq!(bidi_escaped("wheel\u{202e}tfahs"), "wheel\\u{202e}tfahs");
/// ```
pub fn bidi_escaped(text: &str) -> Cow<'_, str> {
    let turns =
        |c: char| matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if !text.contains(turns) {
        return text.into();
    }
    let mut out = String::new();
    for c in text.chars() {
        if turns(c) { out.extend(c.escape_unicode()) } else { out.push(c) }
    }
    out.into()
}

/// A text of the file inside a message: cut off if it is long.
pub fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    if text.chars().count() <= MOST {
        return text.to_string();
    }
    text.chars().take(MOST).chain(['…']).collect()
}

/// A cycle of names for a sentence, with the first one repeated at its end; of very many the first and the last ones.
///
/// ```
/// use kardan_math::names::circle;
/// assert_eq!(circle(&["a", "b"]), "a from b from a");
/// ```
pub fn circle(names: &[&str]) -> String {
    const MOST: usize = 20;
    let all: Vec<&str> = names.iter().chain(names.first()).copied().collect();
    if all.len() <= MOST {
        return all.join(" from ");
    }
    format!("{} from ... from {}", all[..MOST / 2].join(" from "), all[all.len() - MOST / 2..].join(" from "))
}

/// The help for an unknown name: the nearest one, or the existing ones.
///
/// ```
/// use kardan_math::names::unknown_name;
/// assert_eq!(unknown_name("rk.ph", ["rk.phi", "rk.w"]), "did you mean `rk.phi`?");
/// assert_eq!(unknown_name("x", ["rk.phi", "rk.w"]), "there are `rk.phi`, `rk.w`");
/// ```
pub fn unknown_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    did_you_mean(nearest(name, candidates.clone()), || format!("there are {}", quoted(candidates)))
}

/// Whether a word means a fixed frame: a name for the housing, or for a fixed shaft.
///
/// ```
/// use kardan_math::names::{how_to_fix_shaft, is_fixed_name};
/// assert!(is_fixed_name("ground") && is_fixed_name("Fixed") && !is_fixed_name("rk"));
/// assert_eq!(how_to_fix_shaft("rk"), "to fix a shaft, add `[constraint.hold]` with `coefficients = { rk = 1 }`");
/// ```
pub fn is_fixed_name(word: &str) -> bool {
    const GROUND_NAMES: [&str; 16] = [
        "ground", "gnd", "housing", "frame", "earth", "world", "base", "fixed", "fix", "clamp", "clamped", "locked",
        "lock", "held", "hold", "chassis",
    ];
    let word = word.to_lowercase();
    GROUND_NAMES.contains(&word.as_str()) || word.strip_suffix('s').is_some_and(|one| GROUND_NAMES.contains(&one))
}

/// The help for fixing a shaft.
pub fn how_to_fix_shaft(shaft: &str) -> String {
    let shaft = shortened(shaft);
    format!("to fix a shaft, add `[constraint.hold]` with `coefficients = {{ {shaft} = 1 }}`")
}

/// The same where the suggestion is made elsewhere, or the help is another.
pub fn did_you_mean(near: Option<&str>, otherwise: impl FnOnce() -> String) -> String {
    near.map_or_else(otherwise, |near| format!("did you mean `{near}`?"))
}

/// The name, with the first free number behind it if it is used: `K`, `K_2`.
pub fn unused(name: &str, first: usize, is_used: impl Fn(&str) -> bool) -> String {
    let numbered = (first..).map(|number| format!("{name}_{number}"));
    std::iter::once(name.to_string()).chain(numbered).find(|name| !is_used(name)).unwrap_or_default()
}

#[cfg(test)]
#[path = "../../tests/unit/names.rs"]
mod tests;
