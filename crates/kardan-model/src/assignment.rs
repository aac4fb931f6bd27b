//! Replaces one value of a model, as on a command line: `beta=10 deg`, `wg.inertia=2 kg cm^2`.

use kardan_math::names::{did_you_mean, nearest, quoted, shortened, unknown_name};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::{Entries, Entry, Place, RawValue};
use kardan_schema::file::syntax;

/// Tables with keys of their own, without named subtables; they may be missing.
const OF_KEYS: [&str; 8] = ["model", "scenario", "analysis", "bench", "identification", "variants", "safety", "sweep"];

/// A part of a path: a key, or the number of an entry of a list.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Step {
    Key(String),
    Number(usize),
}

/// Replaces a value and returns a remark, if any.
///
/// The key is the name of a parameter (`beta`), a key of a named table (`wg.inertia`, `column.sample_time`), or a path from
/// the top of the file (`scenario.duration`, `requirement[0].below`). The value is written as in a file, a text with or without quotes.
///
/// # Errors
/// No `=`, no such table or parameter, an ambiguous key. Reading the model reports errors in the value.
pub fn assign(model: &mut Entries, text: &str) -> Result<Option<String>, Diagnostic> {
    let Some((path, value_text)) = text.split_once('=') else {
        let help = "write the key, `=` and the value, such as --set beta=\"10 deg\" or --set wg.inertia=\"2 kg cm^2\"";
        return Err(Diagnostic::error("set::no-value", format!("`--set {}` has no `=`", shortened(text))).help(help));
    };
    let (path, value_text) = (path.trim(), value_text.trim());
    if value_text.is_empty() {
        return Err(Diagnostic::error("set::no-value", format!("`--set {}=` has no value", shortened(path)))
            .help("write the value after the `=`, with its unit"));
    }
    let steps = from_the_top(model, steps(path)?, path)?;
    put(model, &steps, value(value_text), path)?;
    Ok(match steps.as_slice() {
        [Step::Key(table), Step::Key(name)] if table == "parameters" => unvary(model, name),
        [Step::Key(table), Step::Key(key)] if table == "scenario" && key == "duration" => {
            let own = manoeuvres(model, |_| true);
            let list = quoted(own.iter().map(String::as_str));
            (!own.is_empty()).then(|| format!("`{path}` is set; the manoeuvres {list} have a `duration` of their own"))
        }
        _ => None,
    })
}

/// The parts of a path: keys between dots, in quotes where they have dots themselves, with numbers in brackets after them.
fn steps(path: &str) -> Result<Vec<Step>, Diagnostic> {
    let wrong = || {
        Diagnostic::error("set::path", format!("`{}` is no key of a model", shortened(path)))
            .help("separate keys by dots and number list entries from 0: scenario.event[0].at")
    };
    let mut out = Vec::new();
    let mut rest = path;
    loop {
        let key = match rest.strip_prefix('"') {
            Some(quoted) => {
                let (key, behind) = quoted.split_once('"').ok_or_else(wrong)?;
                rest = behind;
                key
            }
            None => {
                let end = rest.find(['.', '[', '"', ']']).unwrap_or(rest.len());
                let key = rest[..end].trim();
                rest = &rest[end..];
                if key.is_empty() {
                    return Err(wrong());
                }
                key
            }
        };
        out.push(Step::Key(key.into()));
        while let Some(number) = rest.strip_prefix('[') {
            let (number, behind) = number.split_once(']').ok_or_else(wrong)?;
            out.push(Step::Number(number.trim().parse().map_err(|_| wrong())?));
            rest = behind;
        }
        match rest.strip_prefix('.') {
            Some(next) => rest = next,
            None if rest.is_empty() => return Ok(out),
            None => return Err(wrong()),
        }
    }
}

/// The path from the top of the file: of a parameter, and of a name without its table.
fn from_the_top(model: &Entries, steps: Vec<Step>, path: &str) -> Result<Vec<Step>, Diagnostic> {
    let below = |table: &str| [vec![Step::Key(table.into())], steps.clone()].concat();
    match steps.as_slice() {
        [Step::Key(table), Step::Key(name)] if table == "parameters" => {
            from_the_top(model, vec![Step::Key(name.clone())], path)
        }
        [Step::Key(name)] => {
            let parameters: Vec<&str> = keys(model.table("parameters"));
            if parameters.contains(&name.as_str()) {
                return Ok(below("parameters"));
            }
            let help = match parameters.is_empty() {
                true => "the model has no [parameters]; write a key of a named table with a dot: wg.inertia, column.sample_time"
                    .to_string(),
                false => unknown_name(name, parameters),
            };
            Err(Diagnostic::error("set::unknown", format!("the model has no parameter `{}`", shortened(name)))
                .help(help))
        }
        [Step::Key(first), ..] if model.get(first).is_some() || OF_KEYS.contains(&first.as_str()) => Ok(steps),
        [Step::Key(first), ..] => {
            let groups: Vec<&str> =
                model.iter().filter(|group| is_group(group.key.as_str())).map(|group| group.key.as_str()).collect();
            let has_table = |group: &str| model.table(group).is_some_and(|all| all.table(first).is_some());
            let having: Vec<&str> = groups.iter().copied().filter(|group| has_table(group)).collect();
            match having.as_slice() {
                [one] => Ok(below(one)),
                [] => {
                    let names = groups.iter().flat_map(|group| keys(model.table(group))).chain(keys(Some(model)));
                    let near = nearest(first, names);
                    let help = did_you_mean(near, || "`kardan models NAME` shows the names in a model".into());
                    Err(Diagnostic::error(
                        "set::unknown",
                        format!("the model has no entry named `{}`", shortened(first)),
                    )
                    .help(help))
                }
                several => {
                    let paths: Vec<String> = several.iter().map(|group| format!("{group}.{path}")).collect();
                    let message = format!("`{}` is ambiguous", shortened(path));
                    Err(Diagnostic::error("set::ambiguous", message)
                        .help(format!("write one of {}", quoted(paths.iter().map(String::as_str)))))
                }
            }
        }
        _ => Ok(steps),
    }
}

/// Whether a top-level table contains named tables.
fn is_group(table: &str) -> bool {
    table != "parameters" && !OF_KEYS.contains(&table)
}

fn keys(table: Option<&Entries>) -> Vec<&str> {
    table.map(|table| table.iter().map(|entry| entry.key.as_str()).collect()).unwrap_or_default()
}

/// Sets the value at the end of the path. Only the last key, and tables with keys alone, may be new.
fn put(model: &mut Entries, steps: &[Step], value: RawValue, path: &str) -> Result<(), Diagnostic> {
    let unknown = |step: &str, keys: Vec<&str>| {
        let help = if keys.is_empty() { "it is empty".to_string() } else { unknown_name(step, keys) };
        Diagnostic::error("set::unknown", format!("`{}`: there is no `{}`", shortened(path), shortened(step)))
            .help(help)
    };
    let whole = || {
        Diagnostic::error("set::table", format!("`{}` is a table, not a value", shortened(path)))
            .help("name one of its keys, after a dot")
    };
    let Some((Step::Key(first), rest)) = steps.split_first() else { return Err(whole()) };
    if rest.is_empty() {
        return Err(whole());
    }
    if model.get(first).is_none() {
        model.set(first, RawValue::Table(Entries::default()));
    }
    let mut table = model;
    let mut key = first.as_str();
    let mut rest = rest;
    while let Some((step, after)) = rest.split_first() {
        match step {
            Step::Number(number) => {
                let list = table.list_mut(key);
                let count = list.len();
                let Some(entry) = list.get_mut(*number) else {
                    let help = match count {
                        0 => "it is empty".to_string(),
                        1 => "it has one entry: write [0]".to_string(),
                        _ => format!("it has {count} entries: [0] to [{}]", count - 1),
                    };
                    let message = format!("`{}`: there is no entry [{number}]", shortened(path));
                    return Err(Diagnostic::error("set::unknown", message).help(help));
                };
                if after.is_empty() && !matches!(entry.value, RawValue::Table(_)) {
                    *entry = Entry::from(value);
                    return Ok(());
                }
                match (&mut entry.value, after.split_first()) {
                    (RawValue::Table(inner), Some((Step::Key(next), after))) => {
                        (table, key, rest) = (inner, next, after)
                    }
                    (RawValue::Table(_), None) => return Err(whole()),
                    _ => return Err(unknown("a table", Vec::new())),
                }
            }
            Step::Key(next) => {
                match table.get(key) {
                    Some(RawValue::Table(_)) => {}
                    Some(RawValue::List(_)) => {
                        let message = format!("`{}`: `{}` is a list", shortened(path), shortened(key));
                        return Err(Diagnostic::error("set::list", message)
                            .help(format!("give the entry: {}[0]", shortened(key))));
                    }
                    _ => return Err(unknown(key, keys(Some(table)))),
                }
                (table, key, rest) = (table.table_mut(key), next, after);
            }
        }
    }
    let is_new = table.get(key).is_none() && !matches!(value, RawValue::Table(_));
    let all_tables = !table.is_empty() && table.iter().all(|entry| matches!(entry.entry.value, RawValue::Table(_)));
    if is_new && steps.len() == 2 && is_group(first) && all_tables {
        return Err(unknown(key, keys(Some(table))));
    }
    if matches!(table.get(key), Some(RawValue::Table(inner)) if !matches!(value, RawValue::Table(_)) && !inner.is_empty())
    {
        return Err(whole());
    }
    table.set(key, value);
    Ok(())
}

/// A value as in a file; anything else is taken as a text without quotes.
fn value(value_text: &str) -> RawValue {
    let (entries, diagnostics) = syntax(&format!("value = {value_text}\n"));
    match entries.iter().next() {
        Some(only) if diagnostics.is_empty() && entries.iter().count() == 1 => {
            only.entry.value.placed(&Place::unsettled())
        }
        _ => RawValue::Text(value_text.into()),
    }
}

/// A parameter that is set has that value in all runs: the grid of variants omits it. Named variants override it, which is reported.
fn unvary(model: &mut Entries, name: &str) -> Option<String> {
    if model.table("variants").is_some_and(|grid| grid.get(name).is_some()) {
        let grid = model.table_mut("variants");
        grid.remove(name);
        if grid.is_empty() {
            model.remove("variants");
        }
        return Some(format!("`{name}` is set: [variants] no longer varies it"));
    }
    let sets = |table: &Entries| table.table("set").is_some_and(|set| set.get(name).is_some());
    let called = |entry: &Entry| {
        let variant = entry.value.as_table().filter(|variant| sets(variant))?;
        variant.text("name").map(str::to_string)
    };
    let variants: Vec<String> = match model.get("variant") {
        Some(RawValue::List(variants)) => variants.iter().filter_map(called).collect(),
        _ => Vec::new(),
    };
    let whose = [("variants", variants), ("manoeuvres", manoeuvres(model, sets))];
    let whose = whose.iter().filter(|(_, names)| !names.is_empty());
    let whose: Vec<String> =
        whose.map(|(what, names)| format!("the {what} {}", quoted(names.iter().map(String::as_str)))).collect();
    (!whose.is_empty()).then(|| format!("`{name}` is set; {} have values of their own for it", whose.join(" and ")))
}

/// The manoeuvres that satisfy a predicate.
fn manoeuvres(model: &Entries, is_so: impl Fn(&Entries) -> bool) -> Vec<String> {
    let own = model.tables_of("manoeuvre").filter(|(_, table)| is_so(table));
    own.map(|(one, _)| one.key.clone()).collect()
}

#[cfg(test)]
#[path = "../tests/unit/assignment.rs"]
mod tests;
