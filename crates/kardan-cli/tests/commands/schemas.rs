//! What commands print as JSON against the schemas that `kardan schema` prints.

use std::process::Command;
use std::sync::OnceLock;

use boon::{Compiler, Schemas};
use kardan::export::schemas;
use serde_json::{Value, json};

/// The schema that `kardan schema` prints.
fn schema(name: &str) -> Value {
    let got = Command::new(env!("CARGO_BIN_EXE_kardan")).args(["schema", name]).output().unwrap();
    assert!(got.status.success(), "{name}");
    serde_json::from_slice(&got.stdout).unwrap()
}

/// What is wrong with an object under the schema of that name, which must be one.
fn wrong(name: &str, object: &Value) -> Vec<String> {
    static ALL: OnceLock<Vec<Value>> = OnceLock::new();
    let all = ALL.get_or_init(|| schemas().map(|(name, _)| schema(name)).collect());
    let number = schemas().position(|(other, _)| other == name).expect("a schema of that name");
    let (mut schemas, mut compiler) = (Schemas::new(), Compiler::new());
    compiler.add_resource("http://localhost/schema.json", all[number].clone()).expect("a document");
    let index =
        compiler.compile("http://localhost/schema.json", &mut schemas).unwrap_or_else(|why| panic!("{name}: {why:#}"));
    schemas.validate(object, index).err().map(|why| format!("{why:#}")).into_iter().collect()
}

/// Which schema an object is to be valid under, told by a key that no other has.
fn kind(object: &Value) -> &'static str {
    let keys = [
        ("varied", "sweep"),
        ("variants", "run"),
        ("certificate", "analyze"),
        ("controller_data", "design"),
        ("experiments", "bench-study"),
        ("plan", "bench"),
        ("verdict", "identify"),
        ("equations", "equations"),
        ("file", "check"),
        ("operating_point", "linearise"),
        ("staircase", "realisations"),
        ("models", "models"),
        ("tables", "elements"),
        ("schemas", "schemas"),
        ("monitors", "safety"),
        ("script", "completions"),
    ];
    keys.iter().find(|(key, _)| object.get(key).is_some()).map_or("error", |(_, name)| name)
}

/// The one object that a command has printed, valid under its schema.
#[track_caller]
pub fn printed(bytes: &[u8]) -> Value {
    let object: Value = serde_json::from_slice(bytes)
        .unwrap_or_else(|why| panic!("not one JSON object: {why}: {}", String::from_utf8_lossy(bytes)));
    let (name, found) = (kind(&object), wrong(kind(&object), &object));
    assert!(found.is_empty(), "not valid under `kardan schema {name}`: {}", found.join("; "));
    object
}

/// Schemas are valid themselves; what is none of them, a key that is not listed, one that is missing, and a value of another type
/// are found.
#[test]
fn schemas_show_what_is_wrong() {
    for (name, _) in schemas() {
        let schema = schema(name);
        assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        assert!(schema["title"].as_str().unwrap().starts_with("kardan/2"), "{name}");
        assert!(!wrong(name, &json!({})).is_empty(), "{name}");
    }
    let good = Command::new(env!("CARGO_BIN_EXE_kardan")).args(["analyze", "two-bodies", "--json"]).output().unwrap();
    let good = printed(&good.stdout);
    let modes = good["modes"].as_array().unwrap().len();
    assert!(modes > 0);
    type Change = fn(&mut Value);
    let changes: [Change; 7] = [
        |all| all["modes"][0]["speed"] = json!(1.0),
        |all| all["more"] = json!(1.0),
        |all| drop(all.as_object_mut().unwrap().remove("zeros")),
        |all| drop(all["modes"][0].as_object_mut().unwrap().remove("factor")),
        |all| all["states"] = json!("4"),
        |all| all["modes"][0]["eigenvalue_per_s"] = json!([1.0]),
        |all| all["schema"] = json!("kardan/1"),
    ];
    for (number, change) in changes.iter().enumerate() {
        let mut bad = good.clone();
        change(&mut bad);
        assert!(!wrong("analyze", &bad).is_empty(), "change {number}");
    }
    // A number that is not finite is `null`.
    let mut open = good.clone();
    open["modes"][0]["damping_ratio"] = Value::Null;
    assert_eq!(wrong("analyze", &open), Vec::<String>::new());
}

/// The linear model of each built-in model, and the forms that `--export` writes.
#[test]
fn linear_models_are_valid() {
    let kardan = |arguments: &[&str]| {
        let got = Command::new(env!("CARGO_BIN_EXE_kardan")).args(arguments).output().unwrap();
        assert!(got.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&got.stderr));
        got.stdout
    };
    for model in ["two-bodies", "sia-steering", "rlc-ladder"] {
        for arguments in [vec!["linearise", model], vec!["linearise", model, "--descriptor"]] {
            let found = printed(&kardan(&arguments));
            assert_eq!(found["states"].as_array().unwrap().len(), found["A"].as_array().unwrap().len());
            assert_eq!(kind(&found), "linearise");
        }
    }
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("forms-of-two-bodies.json");
    kardan(&["analyze", "two-bodies", "--export", file.to_str().unwrap()]);
    let found = printed(&std::fs::read(&file).unwrap());
    assert_eq!(kind(&found), "realisations");
    let singular = file.with_file_name("singular-e.json");
    for text in [r#"{"E": [[1, 0], [0, 0]], "A": [[0, 1], [1, 0]], "B": [0, -1], "C": [0, 1]}"#, r#"{"E": 0, "A": 1}"#]
    {
        std::fs::write(&singular, text).unwrap();
        let apart = printed(&kardan(&["analyze", "--state-space", singular.to_str().unwrap(), "--json"]));
        assert!(apart["descriptor"]["index"].as_u64() > Some(0));
    }
    let mut bad = found.clone();
    bad["minimal"]["A"] = json!("1");
    assert!(!wrong("realisations", &bad).is_empty());
}
