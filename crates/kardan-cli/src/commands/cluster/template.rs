//! Templates: text in which `{{word}}` is replaced.

use kardan::diagnostics::{Diagnostic, nearest};

/// The values of words in double braces.
pub type Values<'a> = [(&'a str, String)];

/// The text with all words replaced.
///
/// # Errors
/// An unknown word, or braces that do not close, with their line in `name`.
pub fn fill(name: &str, text: &str, values: &Values<'_>) -> Result<String, Diagnostic> {
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    let placeholders = || values.iter().map(|(word, _)| *word);
    let all = || placeholders().map(|word| format!("{{{{{word}}}}}")).collect::<Vec<_>>().join(", ");
    while let Some(at) = rest.find("{{") {
        let line = text[..text.len() - rest.len() + at].matches('\n').count() + 1;
        let wrong = |message: String, help: String| {
            Err(Diagnostic::error("sweep::template", format!("`{name}`, line {line}: {message}")).help(help))
        };
        out.push_str(&rest[..at]);
        let inside = &rest[at + 2..];
        let Some(end) = inside.find("}}").filter(|end| !inside[..*end].contains('\n')) else {
            return wrong("`{{` without `}}` in the same line".into(), format!("the words are {}", all()));
        };
        let word = inside[..end].trim();
        let Some((_, value)) = values.iter().find(|(candidate, _)| *candidate == word) else {
            let near =
                nearest(word, placeholders()).map_or(String::new(), |near| format!("did you mean `{{{{{near}}}}}`? "));
            return wrong(format!("there is no `{{{{{word}}}}}`"), format!("{near}The words are {}", all()));
        };
        out.push_str(value);
        rest = &inside[end + 2..];
    }
    out.push_str(rest);
    Ok(out)
}

/// Whether the template has the words that every job needs: the command of a shard, and which shards.
///
/// # Errors
/// The missing words.
pub fn check(name: &str, text: &str) -> Result<(), Diagnostic> {
    let has = |word: &str| text.split("{{").skip(1).any(|rest| rest.split("}}").next().map(str::trim) == Some(word));
    let missing = match (has("shard"), has("array") || has("list")) {
        (false, _) => "`{{shard}}`, the command that runs a shard, followed by its number",
        (true, false) => "`{{array}}` or `{{list}}`, the numbers of the shards to run: 1-3,7 or 1 2 3 7",
        (true, true) => return Ok(()),
    };
    let message = format!("the template `{name}` has no {missing}");
    let help = "start from kardan's template: `kardan sweep template slurm` prints one";
    Err(Diagnostic::error("sweep::template", message).help(help))
}

/// Numbers in order as ranges: `1-3,7`.
pub fn ranges(numbers: &[u64]) -> String {
    let mut out: Vec<(u64, u64)> = Vec::new();
    for &number in numbers {
        match out.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => out.push((number, number)),
        }
    }
    let range = |(first, last): &(u64, u64)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    out.iter().map(range).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
#[path = "../../../tests/unit/commands/cluster/template.rs"]
mod tests;
