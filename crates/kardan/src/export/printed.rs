//! Common to all printed objects: one line, and the version of the format.

use schemars::JsonSchema;
use serde::Serialize;

/// The version of the format, first in each object.
#[derive(Serialize, JsonSchema)]
enum Version {
    /// Later versions may add keys; they remove none and change no meaning.
    #[serde(rename = "kardan/2")]
    One,
}

/// Numbers are in SI, where a key names a unit in that unit; a number that is not finite is `null`, a complex number is `[re, im]`, an
/// exact one a text (`"-3/2"`), an index counts from 0, and a part that does not apply is `null` or empty.
#[derive(Serialize, JsonSchema)]
pub(super) struct Printed<T> {
    /// The version of the format.
    schema: Version,
    #[serde(flatten)]
    body: T,
}

/// An object on one line, with the version of the format first.
pub(super) fn printed(body: impl Serialize) -> String {
    // Only non-text keys and a failing `Serialize` are errors; there are none.
    serde_json::to_string(&Printed { schema: Version::One, body }).unwrap_or_default()
}
