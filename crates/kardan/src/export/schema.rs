//! The schemas of the JSON outputs.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use schemars::transform::{Transform, transform_subschemas};
use serde::Serialize;
use serde_json::json;

use super::printed::{Printed, printed};
use super::{analysis, bench, identification, json as study, linear, reference};
use kardan_results::{Design, Safety, Sweep};

/// The name of an output, the command that prints it, and the schema.
type Output = (&'static str, &'static str, fn() -> schemars::Schema);

/// The outputs with a schema.
static SCHEMAS: [Output; 17] = [
    ("run", "`kardan run --json`: the result of a study", of::<study::StudyView>),
    ("analyze", "`kardan analyze --json`: the structure of a model", of::<analysis::AnalysisView>),
    ("design", "`kardan design --json`: a designed controller with its proofs", of::<Design>),
    ("identify", "`kardan identify --json`: parameters identified from logs", of::<identification::IdentificationView>),
    ("bench", "`kardan bench --json`: plan, true values and files of a virtual bench", of::<bench::BenchView>),
    ("bench-study", "`kardan bench --study --json`: a study on a virtual bench", of::<bench::StudyView>),
    ("safety", "`kardan safety --json`: the effects of faults, and their detection", of::<Safety>),
    ("sweep", "`kardan sweep --json`: the results of a model over many values of its parameters", of::<Sweep>),
    ("equations", "`kardan equations --json`: the equations of motion of a model", of::<reference::EquationsView>),
    ("linearise", "`kardan linearise`: the linear model of a model file", of::<linear::LinearView>),
    (
        "realisations",
        "`kardan analyze --export FILE.json`: minimal realisation, Kalman's decomposition, staircase form",
        of::<linear::RealisationsView>,
    ),
    ("check", "`kardan check --json`: a model file without errors, and its warnings", of::<reference::CheckView>),
    ("models", "`kardan models --json`: the built-in models", of::<reference::ModelsView>),
    ("elements", "`kardan elements --json`: the tables of a model file", of::<reference::ElementsView>),
    ("schemas", "`kardan schema --json`: the available schemas", of::<SchemasView>),
    ("completions", "`kardan completions --json`: a completion script", of::<reference::CompletionsView>),
    ("error", "any of them: why there is no result", of::<study::ErrorView>),
];

/// The outputs with a schema, and the command that prints each.
pub fn schemas() -> impl Iterator<Item = (&'static str, &'static str)> + Clone {
    SCHEMAS.iter().map(|(name, what, _)| (*name, *what))
}

/// The JSON schema (draft 2020-12) of an output by its name in [`schemas`].
///
/// ```
/// let schema = kardan::export::schema("error").expect("there is one");
/// assert!(schema.contains("https://json-schema.org/draft/2020-12/schema") && schema.contains("kardan/2"));
/// assert_eq!(kardan::export::schema("nothing"), None);
/// ```
pub fn schema(name: &str) -> Option<String> {
    let (name, what, of) = SCHEMAS.iter().find(|(candidate, ..)| *candidate == name)?;
    let mut schema = of();
    schema.insert("$id".into(), format!("kardan/2/{name}").into());
    schema.insert("title".into(), format!("kardan/2, {what}").into());
    serde_json::to_string_pretty(&schema).ok()
}

/// The available schemas.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Schemas")]
struct SchemasView {
    /// All of them.
    schemas: Vec<SchemaName>,
}

/// A schema.
#[derive(Serialize, JsonSchema)]
struct SchemaName {
    /// Its name.
    name: &'static str,
    /// What it describes.
    summary: &'static str,
}

/// Gives the list of schemas as one JSON object on one line.
pub fn schemas_json() -> String {
    printed(SchemasView { schemas: schemas().map(|(name, summary)| SchemaName { name, summary }).collect() })
}

fn of<T: JsonSchema>() -> schemars::Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize().with_transform(Strict);
    settings.into_generator().into_root_schema_for::<Printed<T>>()
}

/// No keys but those that are listed; a number that is not finite is `null`.
#[derive(Clone)]
struct Strict;

impl Transform for Strict {
    fn transform(&mut self, schema: &mut schemars::Schema) {
        transform_subschemas(self, schema);
        if schema.get("properties").is_some() && schema.get("additionalProperties").is_none() {
            schema.insert("additionalProperties".into(), false.into());
        }
        if schema.get("type").is_some_and(|kind| *kind == "number") {
            schema.insert("type".into(), json!(["number", "null"]));
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/export/schema.rs"]
mod tests;
