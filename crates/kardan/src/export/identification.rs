//! An identification as one JSON object.

use schemars::JsonSchema;
use serde::Serialize;

use super::printed::printed;
use kardan_results::Identification;

/// Parameters identified from measured logs.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Identification")]
pub(super) struct IdentificationView<'a> {
    /// Name of the model.
    model: &'a str,
    /// From the file.
    description: &'a str,
    /// The result in one sentence.
    verdict: String,
    /// Whether every parameter is determined from whole logs without a warning.
    reliable: bool,
    #[serde(flatten)]
    found: &'a Identification,
}

/// Gives an identification as one JSON object on one line, in SI; a number that is not finite is `null`.
///
/// Its keys are described by [`schema`](super::schema()) of `identify`.
pub fn identification_json(found: &Identification) -> String {
    printed(IdentificationView::of(found))
}

impl<'a> IdentificationView<'a> {
    pub(super) fn of(found: &'a Identification) -> Self {
        let verdict = found.verdict();
        let (model, description) = (&found.model, &found.description);
        Self { model, description, verdict: verdict.text, reliable: verdict.sound, found }
    }
}
