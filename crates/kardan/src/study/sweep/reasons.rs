//! Reasons of incomplete runs, merged for all that differ only in numbers.

use std::collections::BTreeMap;

use kardan_results::{SweepRowOf, SweptFailure};

/// Most separate reasons.
const MOST_REASONS: usize = 20;
/// Placeholder for a number that differs.
const DIFFERS: &str = "…";
/// All reasons after the last separate one.
const OTHER_REASONS: &str = "other reasons";

/// The text before each number of a reason, and after the last one; and its numbers.
fn split(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (mut parts, mut numbers) = (Vec::new(), Vec::new());
    let (mut from, mut at) = (0, 0);
    while at < text.len() {
        let before = text[from..at].chars().next_back();
        match number(before, &text[at..]) {
            Some(length) => {
                parts.push(&text[from..at]);
                numbers.push(&text[at..at + length]);
                at += length;
                from = at;
            }
            None => at += text[at..].chars().next().map_or(1, char::len_utf8),
        }
    }
    parts.push(&text[from..]);
    (parts, numbers)
}

/// The length of the number that a text begins with, with its sign, its divisor, and `…` after omitted digits; digits of names and of
/// powers are no numbers.
fn number(before: Option<char>, text: &str) -> Option<usize> {
    let sign = text.chars().next().filter(|c| matches!(c, '-' | '−')).map_or(0, char::len_utf8);
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let of_name = before.is_some_and(|c| c.is_alphanumeric() || matches!(c, '_' | '.' | '^'));
    if of_name || digits(sign) == 0 {
        return None;
    }
    let mut end = sign + digits(sign);
    for (mark, signed) in [('.', false), ('e', true), ('/', false)] {
        if text[end..].starts_with(mark) {
            let sign = usize::from(signed && text[end + 1..].starts_with(['-', '+']));
            let more = digits(end + 1 + sign);
            end += if more > 0 { 1 + sign + more } else { 0 };
        }
    }
    if text[end..].starts_with(DIFFERS) {
        end += DIFFERS.len();
    }
    Some(end)
}

/// Rows of the same reason.
struct Group<'r> {
    parts: Vec<&'r str>,
    /// The numbers between the parts; none where they differ.
    numbers: Vec<Option<&'r str>>,
    failure: SweptFailure,
}

impl Group<'_> {
    fn failure(self) -> SweptFailure {
        let numbers = self.numbers.into_iter().map(|number| number.unwrap_or(DIFFERS));
        let reason =
            self.parts.into_iter().zip(numbers.chain([""])).flat_map(|(word, number)| [word, number]).collect();
        SweptFailure { reason, ..self.failure }
    }
}

/// The reasons of rows, the most frequent first, each with that of its first row in full.
pub(super) fn reasons<'r>(rows: impl Iterator<Item = SweepRowOf<'r>>, variants: &[String]) -> Vec<SweptFailure> {
    let mut found: Vec<Group<'r>> = Vec::new();
    let mut indices: BTreeMap<Vec<&'r str>, usize> = BTreeMap::new();
    for row in rows.filter(|row| !row.reason.is_empty()) {
        let (own_parts, own_numbers) = split(row.reason);
        if let Some(&number) = indices.get(&own_parts) {
            let group = &mut found[number];
            for (number, other) in group.numbers.iter_mut().zip(own_numbers) {
                *number = number.filter(|number| *number == other);
            }
            group.failure.count += 1;
            continue;
        }
        let is_other = found.len() >= MOST_REASONS;
        let (parts, numbers) = if is_other { split(OTHER_REASONS) } else { (own_parts.clone(), own_numbers) };
        let number = indices.get(&parts).copied().unwrap_or(found.len());
        indices.insert(own_parts, number);
        indices.insert(parts.clone(), number);
        match found.get_mut(number) {
            Some(group) => group.failure.count += 1,
            None => found.push(Group {
                parts,
                numbers: numbers.into_iter().map(Some).collect(),
                failure: SweptFailure {
                    reason: String::new(),
                    example: row.reason.to_string(),
                    count: 1,
                    first: row.sample,
                    variant: variants[row.variant].clone(),
                },
            }),
        }
    }
    let mut found: Vec<SweptFailure> = found.into_iter().map(Group::failure).collect();
    found.sort_by_key(|one| std::cmp::Reverse(one.count));
    found
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/reasons.rs"]
mod tests;
