//! Differences to the identity of rows of another sweep.

use crate::study::Project;
use kardan_schema::diagnostics::shortened;
use kardan_schema::entries::{Entries, RawValue};
use kardan_schema::file::value_to_toml;

/// Most listed values of the model.
const MAX_LISTED: usize = 3;
/// Parts of the identity of rows, by their first words.
const KINDS: [&str; 8] = ["kardan", "model", "samples", "seed", "--", "limit of steps", "method", "tolerance"];

impl Project {
    /// The differences between a sweep of this model and another one, as text, from the identities of their rows. `was` is the other model, if known.
    ///
    /// ```
    /// use kardan::project::Project;
    ///
    /// let open = |inertia: &str| Project::open(format!("[shaft.a]\ninertia = \"{inertia}\"\n[scenario]\n"));
    /// let identity = |project: &Project| project.sweep_plan(&Default::default()).unwrap().head.identity;
    /// let (one, other) = (open("2 kg m^2 ± 10 %"), open("3 kg m^2 ± 10 %"));
    /// assert_eq!(
    ///     one.sweep_mismatch(&identity(&one), &identity(&other), Some(&other.to_toml())),
    ///     "`shaft.a.inertia` \"3 kg m^2 ± 10 %\", here \"2 kg m^2 ± 10 %\""
    /// );
    /// ```
    pub fn sweep_mismatch(&self, here: &str, other_identity: &str, was: Option<&str>) -> String {
        let mut differences = Vec::new();
        for kind in KINDS {
            let [own, other] = [here, other_identity].map(|identity| part(identity, kind));
            match (own, other) {
                (own, other) if own == other => {}
                (Some(own), Some(other)) => differences.push(match was.filter(|_| kind == "model") {
                    Some(was) => changed(Self::open(was).entries(), self.entries()),
                    None => format!("{other}, here {own}"),
                }),
                (Some(own), None) => differences.push(format!("{own} only here")),
                (None, other) => differences.extend(other.map(|other| format!("{other} not here"))),
            }
        }
        differences.join("; ")
    }

    /// The same for repeated rows: the differences between this model and theirs; `None` if there are none.
    pub fn other_model(&self, other_identity: &str, was: Option<&str>) -> Option<String> {
        let here = self.origin();
        let other_identity =
            KINDS[..2].iter().filter_map(|kind| part(other_identity, kind)).collect::<Vec<_>>().join(", ");
        (here != other_identity).then(|| self.sweep_mismatch(&here, &other_identity, was))
    }
}

/// Values that differ from those of another model.
fn changed(was: &Entries, now: &Entries) -> String {
    let mut all = Vec::new();
    compare("", was, now, &mut all);
    match all.len() {
        0 => "the order of the model's keys, or a file that it names".into(),
        count @ 1..=MAX_LISTED => all[..count].join("; "),
        count => format!("{}; and {} more", all[..MAX_LISTED].join("; "), count - MAX_LISTED),
    }
}

/// The checksum of the model of rows.
pub fn swept_model(identity: &str) -> Option<&str> {
    part(identity, "model")?.strip_prefix("model ")
}

/// A part of the identity of rows.
fn part<'i>(identity: &'i str, kind: &str) -> Option<&'i str> {
    // Names of variants are in backticks, separated by commas.
    let samples = identity.find(" samples of ");
    if kind == "samples" {
        let (start, end) = (identity[..samples?].rfind(", ")? + 2, identity.rfind("`")? + 1);
        return identity.get(start..end);
    }
    let is_kind = |text: &&str| text.starts_with(kind);
    let ends = samples.map_or((identity, ""), |at| (&identity[..at], &identity[identity.rfind("`").unwrap_or(at)..]));
    ends.0.split(", ").chain(ends.1.split(", ").skip(1)).find(is_kind)
}

/// Reports the differences between two tables.
fn compare(path: &str, was: &Entries, now: &Entries, out: &mut Vec<String>) {
    let path_of = |key: &str| if path.is_empty() { key.to_string() } else { format!("{path}.{key}") };
    for one in was.iter() {
        compare_values(&path_of(&one.key), &one.entry.value, now.get(&one.key), out);
    }
    let new = now.iter().filter(|one| was.get(&one.key).is_none());
    out.extend(new.map(|one| format!("`{}` is only here", path_of(&one.key))));
}

fn compare_values(path: &str, was: &RawValue, now: Option<&RawValue>, out: &mut Vec<String>) {
    let tables =
        |list: &[kardan_schema::entries::Entry]| list.iter().all(|one| matches!(one.value, RawValue::Table(_)));
    match (was, now) {
        (_, None) => out.push(format!("`{path}` is not here")),
        (RawValue::Table(was), Some(RawValue::Table(now))) => compare(path, was, now, out),
        (RawValue::List(was), Some(RawValue::List(now))) if tables(was) && tables(now) => {
            for (k, one) in was.iter().enumerate() {
                compare_values(&format!("{path}[{k}]"), &one.value, now.get(k).map(|now| &now.value), out);
            }
            out.extend((was.len()..now.len()).map(|k| format!("`{path}[{k}]` is only here")));
        }
        (was, Some(now)) => {
            let [was, now] = [was, now].map(value_to_toml);
            if was != now {
                out.push(format!("`{path}` {}, here {}", shortened(&was), shortened(&now)));
            }
        }
    }
}
