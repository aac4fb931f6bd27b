//! Tests of `src/export/schema.rs`.

use serde_json::Value;

use super::*;

#[test]
fn every_key_is_described_and_no_other_is_allowed() {
    fn check_keys(value: &Value, at: &str) {
        if let Some(properties) = value.get("properties").and_then(Value::as_object) {
            assert_eq!(value["additionalProperties"], false, "{at}");
            for (key, property) in properties {
                assert!(property["description"].is_string(), "{at}/{key} is not described");
            }
        }
        let parts: Vec<(String, &Value)> = match value {
            // The names of keys are no schemas; what they name are.
            Value::Object(map) => map
                .iter()
                .flat_map(|(key, part)| match (key.as_str(), part) {
                    ("properties" | "$defs", Value::Object(inner)) => inner.iter().collect::<Vec<_>>(),
                    _ => vec![(key, part)],
                })
                .map(|(key, part)| (format!("{at}/{key}"), part))
                .collect(),
            Value::Array(list) => list.iter().map(|part| (at.to_string(), part)).collect(),
            _ => Vec::new(),
        };
        parts.iter().for_each(|(at, part)| check_keys(part, at));
    }
    for (name, _) in schemas() {
        let schema: Value = serde_json::from_str(&schema(name).unwrap()).unwrap();
        check_keys(&schema, name);
    }
}
