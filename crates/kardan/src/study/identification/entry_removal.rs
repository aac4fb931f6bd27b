//! Removes one entry of a list of tables from the text of a model file and leaves the rest unchanged.

use std::ops::Range;

use kardan_schema::entries::{Entries, Entry, RawValue};
use kardan_schema::file::syntax;

/// The text without the table of a list that begins at a place; `None` if the remaining text would not have the same content otherwise.
pub(super) fn remove_entry(text: &str, [table, key]: [&str; 2], start: usize) -> Option<String> {
    let (before, _) = syntax(text);
    let list = listed(&before, [table, key])?;
    let number = list.iter().position(|entry| entry.place.start() == start)?;
    let spans = match text[start..].starts_with("[[") {
        true => one_span(of_header(text, &list[number])?),
        false => of_line(text, list, number)?,
    };
    let mut out = text.to_string();
    // From the end, so that positions stay valid.
    spans.into_iter().rev().for_each(|span| out.replace_range(span, ""));
    let (after, diagnostics) = syntax(&out);
    let rest: Vec<&Entry> = list.iter().enumerate().filter(|(k, _)| *k != number).map(|(_, entry)| entry).collect();
    let remaining = listed(&after, [table, key]).unwrap_or_default();
    let same = rest.len() == remaining.len() && rest.iter().zip(remaining).all(|(a, b)| same_value(&a.value, &b.value));
    let same_rest = same_table(&before, &after, &[table, key]);
    (diagnostics.is_empty() && same && same_rest).then_some(out)
}

fn listed<'a>(entries: &'a Entries, [table, key]: [&str; 2]) -> Option<&'a [Entry]> {
    match entries.table(table)?.get(key)? {
        RawValue::List(list) => Some(list),
        _ => None,
    }
}

/// From the line of the header to the end of the line of the last value, and one of the empty lines around it.
fn of_header(text: &str, entry: &Entry) -> Option<Range<usize>> {
    let RawValue::Table(keys) = &entry.value else { return None };
    let begin = line_start(text, entry.place.start());
    let last = keys.iter().map(|one| one.entry.place.span().end).max().unwrap_or(0).max(entry.place.span().end);
    let behind = &text[last..];
    let end = last + behind.find('\n').map_or(behind.len(), |at| at + 1);
    let rest = text[last..end].trim();
    // A line with further content does not belong to the entry only.
    let own = text[begin..entry.place.start()].trim().is_empty() && (rest.is_empty() || rest.starts_with('#'));
    let empty = |line: &str| line.trim().is_empty();
    let above_empty = begin == 0 || empty(&text[line_start(text, begin - 1)..begin]);
    let next = text[end..].find('\n').map(|at| end + at + 1).filter(|next| above_empty && empty(&text[end..*next]));
    own.then_some(begin..next.unwrap_or(end))
}

/// An item of a list in brackets, and its comma: the one after it, or before it for the last item.
fn of_line(text: &str, list: &[Entry], number: usize) -> Option<[Range<usize>; 2]> {
    let own = list[number].place.span();
    let Some(comma) = comma(text, own.end) else {
        let before = number.checked_sub(1).map(|k| comma(text, list[k].place.span().end));
        return match before {
            None => Some(one_span(own)),
            Some(None) => None,
            Some(Some(at)) if text[at + 1..own.start].trim().is_empty() => Some(one_span(at..own.end)),
            Some(Some(at)) => Some([at..at + 1, own]),
        };
    };
    if !text[own.end..comma].trim().is_empty() {
        return Some([own, comma..comma + 1]);
    }
    let blanks = text[comma + 1..].len() - text[comma + 1..].trim_start_matches([' ', '\t']).len();
    let (begin, end) = (line_start(text, own.start), comma + 1 + blanks);
    let ends = ["\n", "\r\n"].into_iter().find(|it| text[end..].starts_with(it));
    match ends.filter(|_| text[begin..own.start].trim().is_empty()) {
        Some(line) => Some(one_span(begin..end + line.len())),
        None => Some(one_span(own.start..end)),
    }
}

/// A span with no text after it.
fn one_span(span: Range<usize>) -> [Range<usize>; 2] {
    let end = span.end;
    [span, end..end]
}

fn line_start(text: &str, at: usize) -> usize {
    text[..at].rfind('\n').map_or(0, |line| line + 1)
}

/// The comma after an item of a list, past blanks and comments.
fn comma(text: &str, mut at: usize) -> Option<usize> {
    loop {
        at = text.len() - text[at..].trim_start().len();
        match text[at..].chars().next()? {
            ',' => return Some(at),
            '#' => at += text[at..].find('\n')?,
            _ => return None,
        }
    }
}

/// Whether two tables are equal, except for the value at a path of keys and for tables that are empty without it.
fn same_table(a: &Entries, b: &Entries, apart: &[&str]) -> bool {
    let empty = RawValue::Table(Entries::default());
    let keys = a.iter().chain(b.iter()).map(|one| one.key.as_str());
    keys.into_iter().all(|key| match apart.split_first() {
        Some((first, [])) if *first == key => true,
        Some((first, rest)) if *first == key => match [a, b].map(|table| table.get(key).unwrap_or(&empty)) {
            [RawValue::Table(a), RawValue::Table(b)] => same_table(a, b, rest),
            _ => false,
        },
        _ => a.get(key).zip(b.get(key)).is_some_and(|(a, b)| same_value(a, b)),
    })
}

/// Whether two values are equal, independent of their positions.
fn same_value(a: &RawValue, b: &RawValue) -> bool {
    match (a, b) {
        (RawValue::List(a), RawValue::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same_value(&a.value, &b.value))
        }
        (RawValue::Table(a), RawValue::Table(b)) => same_table(a, b, &[]),
        _ => a == b,
    }
}
