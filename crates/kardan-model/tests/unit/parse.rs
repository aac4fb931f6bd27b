//! Reading of tables and values, and the messages for errors.

use proptest::prelude::*;

use super::*;
use kardan_schema::diagnostics::plain;
use kardan_schema::file::syntax;

static EVENT: [Field; 2] = [
    Field::required("time", Kind::Quantity(Dimension::TIME, Sign::NonNegative), "When it happens."),
    Field::optional("set", Kind::Overrides, "What changes; nothing if left out."),
];

static ELEMENT: [Field; 16] = [
    Field::required("inertia", Kind::Quantity(Dimension::INERTIA, Sign::Positive), "Moment of inertia."),
    Field::optional("stiffness", Kind::Quantity(Dimension::STIFFNESS, Sign::NonNegative), "Stiffness."),
    Field::optional("damping", Kind::Quantity(Dimension::DAMPING, Sign::NonNegative), "Damping."),
    Field::optional("angle", Kind::Quantity(Dimension::ANGLE, Sign::Any), "Angle."),
    Field::optional("ratio", Kind::Number(Sign::NonZero), "Ratio."),
    Field::optional("shaft", Kind::Shaft, "Shaft."),
    Field::optional("shafts", Kind::Shafts(2), "Shafts."),
    Field::optional("any_shafts", Kind::Shafts(0), "Shafts."),
    Field::optional("law", Kind::Choice(&["linear", "quadratic"]), "Law."),
    Field::optional("motor", Kind::Element(&["motor"]), "Motor."),
    Field::optional("terms", Kind::Coefficients, "Terms."),
    Field::optional("outputs", Kind::Signals, "Outputs."),
    Field::optional("value", Kind::AnyQuantity, "Value."),
    Field::optional("name", Kind::Name, "Name."),
    Field::optional("text", Kind::Text, "Text."),
    Field::optional("event", Kind::Tables(&EVENT), "Events."),
];

/// Reads a file of one table, and renders its diagnostics.
fn read(source: &str) -> (Table, String) {
    let (document, mut out) = syntax(source);
    let table = table(&ELEMENT, &Node::root(&document), "shaft `wg`", &mut out);
    (table, plain(source, &out))
}

/// The diagnostics for one line; `inertia` is present.
fn diagnostics(line: &str) -> String {
    read(&format!("{line}\ninertia = \"1 kg m^2\"\n")).1
}

#[test]
fn a_valid_table_is_read() {
    let (table, diagnostics) = read(concat!(
        "inertia = \"130 kg mm^2\"\nstiffness = 's_wg'\nangle = \"30 deg\"\nratio = 1.02\nshaft = \"wg\"\n",
        "shafts = [\"wg\", \"cs\"]\nlaw = \"linear\"\nterms = { wg = 1, fs = \"50/51\", cs = \"k\" }\n",
        "outputs = [\"rk.phi\"]\nvalue = 3\ntext = '''\nmany\nlines'''\n",
        "event = [{ time = \"1 s\" }, { time = \"2 s\", set = { beta = \"0 deg\", n = -2 } }]\n",
    ));
    assert_eq!(diagnostics, "");
    let literal = |a, b, dimension| Scalar::Literal(Exact::from_ratio(a, b), dimension);
    let get = |key: &str| &table.values[key].value;
    assert_eq!(get("inertia"), &Value::Scalar(literal(130, 1_000_000, Dimension::INERTIA)));
    assert_eq!(table.values["inertia"].place.span(), 10..23);
    assert_eq!(get("stiffness"), &Value::Scalar(Scalar::Parameter("s_wg".to_string())));
    assert_eq!(get("ratio"), &Value::Scalar(literal(51, 50, Dimension::NONE)));
    assert_eq!(get("value"), &Value::Scalar(literal(3, 1, Dimension::NONE)));
    let Value::Map(terms) = get("terms") else { panic!("terms are a map") };
    let terms: Vec<_> = terms.iter().map(|(name, scalar)| (name.value.as_str(), scalar.value.clone())).collect();
    assert_eq!(
        terms,
        [
            ("wg", literal(1, 1, Dimension::NONE)),
            ("fs", literal(50, 51, Dimension::NONE)),
            ("cs", Scalar::Parameter("k".to_string())),
        ]
    );
    let Value::Tables(events) = get("event") else { panic!("events are tables") };
    assert_eq!(events.len(), 2);
    assert_eq!(events[1].values["time"].value, Value::Scalar(literal(2, 1, Dimension::TIME)));
    assert_eq!(table.values.len(), 12);
}

#[test]
fn all_errors_of_a_file_are_reported_at_once() {
    let source = concat!(
        "inerta = 0.05\n",
        "stiffness = \"100 N m\"\n",
        "damping = \"0.0081 N m s\"\n",
        "angle = \"30 dge\"\n",
        "ratio = 0\n",
        "zzz = \"red\"\n",
        "shafts = [\"wg\", \"wg\", \"cs\"]\n",
    );
    assert_eq!(
        read(source).1,
        concat!(
            "error[key::unknown] 1:1: shaft `wg` has no key `inerta` | unknown key | help: did you mean `inertia`?\n",
            "error[unit::dimension] 2:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a torque ",
            "| a torque | help: did you mean \"100 N m/rad\"?\n",
            "error[unit::dimension] 3:11: `damping` of shaft `wg`: expected a torsional damping, found an angular ",
            "momentum | an angular momentum | help: did you mean \"0.0081 N m s/rad\"?\n",
            "error[unit::unknown] 4:13: `angle` of shaft `wg`: unknown unit `dge` | help: did you mean `deg`?\n",
            "error[number::sign] 5:9: `ratio` of shaft `wg`: must not be zero, found 0 | must not be zero ",
            "| help: write a number other than zero\n",
            "error[key::unknown] 6:1: shaft `wg` has no key `zzz` | unknown key | help: known keys are `inertia`, ",
            "`stiffness`, `damping`, `angle`, `ratio`, `shaft`, `shafts`, `any_shafts`, `law`, `motor`, `terms`, ",
            "`outputs`, `value`, `name`, `text` and `event`\n",
            "error[name::duplicate] 7:17: `shafts` of shaft `wg`: `wg` is listed twice | again here | first here ",
            "| help: remove one of the two\n",
            "error[list::length] 7:10: `shafts` of shaft `wg`: expected a list of 2 shaft names, found 3 names ",
            "| 3 names | help: write it like `[\"wg\", \"cs\"]`\n",
        )
    );
}

#[test]
fn a_missing_key_is_shown_at_the_header() {
    let source = "[shaft.wg]\ndamping = \"d\"\n[shaft.cs]\ninertia = \"J\"";
    let (document, mut out) = syntax(source);
    let shafts = Node::root(&document).child("shaft", &mut out).expect("the table is there");
    let names: Vec<_> = shafts.children(&mut out).iter().map(|shaft| shaft.name.to_string()).collect();
    assert_eq!(names, ["wg", "cs"]);
    for shaft in shafts.children(&mut out) {
        table(&ELEMENT, &shaft, &format!("shaft `{}`", shaft.name), &mut out);
    }
    assert_eq!(
        plain(source, &out),
        "error[key::missing] 1:1: shaft `wg` needs the key `inertia` | `inertia` is missing \
         | help: add `inertia = \"130 kg mm^2\"`: Moment of inertia.\n"
    );
}

#[test]
fn each_kind_says_what_it_expects() {
    for (line, expected) in [
        (
            "stiffness = true",
            "error[type::wrong] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness such as \"100 N m/rad\", found a boolean | a boolean | help: write it like `\"100 N m/rad\"`\n",
        ),
        (
            "stiffness = 0.05",
            "error[unit::dimension] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a number without a unit | a number without a unit | help: write the unit too: \"0.05 N m/rad\"\n",
        ),
        (
            "stiffness = inf",
            "error[number::not-finite] 1:13: `stiffness` of shaft `wg`: `inf` is not a finite number | help: write a decimal number\n",
        ),
        (
            "stiffness = -nan",
            "error[number::not-finite] 1:14: `stiffness` of shaft `wg`: `nan` is not a finite number | help: write a decimal number\n",
        ),
        (
            "ratio = \"nan\"",
            "error[number::not-finite] 1:10: `ratio` of shaft `wg`: `nan` is not a finite number | help: write a decimal number\n",
        ),
        (
            "stiffness = \"-1 N m/rad\"",
            "error[number::sign] 1:13: `stiffness` of shaft `wg`: must not be negative, found -1 N m/rad | must not be negative | help: write zero or a number above zero\n",
        ),
        (
            "stiffness = \"\"",
            "error[type::wrong] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness such as \"100 N m/rad\", found an empty text | empty | help: write it like `\"100 N m/rad\"`\n",
        ),
        (
            "ratio = \"5 kg\"",
            "error[unit::dimension] 1:12: `ratio` of shaft `wg`: expected a number without a unit, found a unit | help: write \"5\"\n",
        ),
        (
            "ratio = 0x1F",
            "error[type::wrong] 1:9: `ratio` of shaft `wg`: expected a decimal number or the name of a parameter, found the number 0x1F | the number 0x1F | help: write it like `1.5`\n",
        ),
        (
            "ratio = 1e400",
            "error[number::range] 1:9: `ratio` of shaft `wg`: `1e400` is too large: a number must be below 1.8e308 in SI units | help: check the exponent and the unit\n",
        ),
        (
            "shaft = \" \"",
            "error[type::wrong] 1:9: `shaft` of shaft `wg`: expected the name of a shaft, found an empty text | empty | help: write it like `\"wg\"`\n",
        ),
        (
            "shaft = 1979-05-27",
            "error[type::wrong] 1:9: `shaft` of shaft `wg`: expected the name of a shaft, found a date or time | a date or time | help: write it like `\"wg\"`\n",
        ),
        (
            "shafts = \"wg\"",
            "error[type::wrong] 1:10: `shafts` of shaft `wg`: expected a list of 2 shaft names, found the text \"wg\" | the text \"wg\" | help: write it like `[\"wg\", \"cs\"]`\n",
        ),
        (
            "shafts = [\"wg\", 1]",
            "error[type::wrong] 1:17: `shafts` of shaft `wg`: expected a text, found the number 1 | the number 1 | help: write it like `[\"wg\", \"cs\"]`\n",
        ),
        (
            "any_shafts = []",
            "error[list::length] 1:14: `any_shafts` of shaft `wg`: expected a list of one or more shaft names, found 0 names | 0 names | help: write it like `[\"wg\", \"cs\"]`\n",
        ),
        (
            "law = \"liner\"",
            "error[choice::unknown] 1:7: `law` of shaft `wg`: unknown choice `liner` | unknown | help: did you mean \"linear\"?\n",
        ),
        (
            "law = \"cosine\"",
            "error[choice::unknown] 1:7: `law` of shaft `wg`: unknown choice `cosine` | unknown | help: choose one of `linear` or `quadratic`\n",
        ),
        (
            "motor = []",
            "error[type::wrong] 1:9: `motor` of shaft `wg`: expected the name of an element of the kind `motor`, found a list | a list | help: write it like `\"my_motor\"`\n",
        ),
        (
            "terms = { wg = \"1 kg\", cs = [1] }",
            "error[unit::dimension] 1:16: `wg` in `terms` of shaft `wg`: expected a number, or a length for each angle, found a mass | a mass | help: write `2`, or `\"7 mm/rad\"` for a shaft that moves a mass\nerror[type::wrong] 1:29: `cs` in `terms` of shaft `wg`: expected a number, or a length for each angle, found a list | a list | help: write it like `1.5`\n",
        ),
        (
            "terms = {}",
            "error[list::length] 1:9: `terms` of shaft `wg`: expected a table from names of shafts and masses to numbers, found an empty table | empty | help: write it like `{ wg = 1, cs = -51, fs = 50 }`\n",
        ),
        (
            "name = \"rk.phi\"",
            "error[name::invalid] 1:8: `name` of shaft `wg`: `rk.phi` cannot be a name | not a name | help: a name is a letter followed by letters (a to z), digits, `_` or `-`, at most 100 characters\n",
        ),
        (
            "value = \"5 N m/rad s\"",
            "error[unit::syntax] 1:20: `value` of shaft `wg`: it is not clear whether `/` also divides by `s` | help: write `N m/rad * s` or `N m/(rad s)`\n",
        ),
        (
            "value = \"\\u0035 kq\"",
            "error[unit::unknown] 1:9: `value` of shaft `wg`: unknown unit `kq` | help: did you mean `kg`?\n",
        ),
        (
            "event = [{ tme = \"1 s\" }, 3, {}]",
            "error[key::unknown] 1:12: entry 1 of `event` of shaft `wg` has no key `tme` | unknown key | help: did you mean `time`?\nerror[type::wrong] 1:27: entry 2 of `event` of shaft `wg`: expected a table, found the number 3 | the number 3 | help: write it like `[{ time = \"2 ms\" }]`\nerror[key::missing] 1:30: entry 3 of `event` of shaft `wg` needs the key `time` | `time` is missing | help: add `time = \"2 ms\"`: When it happens.\n",
        ),
        (
            "event = { time = \"1 kg\" }",
            "error[unit::dimension] 1:18: `time` of `event` of shaft `wg`: expected a time, found a mass | a mass | help: write it like \"2 ms\"\n",
        ),
    ] {
        assert_eq!(diagnostics(line), expected, "{line}");
    }
}

#[test]
fn invalid_toml_is_reported_once_and_the_valid_lines_are_read() {
    for (line, expected) in [
        (
            "stiffness = 100 N m/rad",
            "error[toml::syntax] 1:13: this is not TOML: text without quotes | help: write \"100 N m/rad\"\n",
        ),
        (
            "stiffness = 100 N m",
            "error[toml::syntax] 1:13: this is not TOML: text without quotes | help: write \"100 N m\"\nerror[unit::dimension] 1:13: `stiffness` of shaft `wg`: expected a torsional stiffness, found a torque | a torque | help: did you mean \"100 N m/rad\"?\n",
        ),
        (
            "stiffness = ",
            "error[toml::syntax] 1:13: this is not TOML: a key without a value | help: write a value after the `=`, or remove the key\n",
        ),
        (
            "ratio = 0.5.2",
            "error[toml::syntax] 1:12: this is not TOML: invalid float, expected nothing | help: see https://toml.io for how a file of keys and values is written\n",
        ),
        (
            "ratio = 1\nratio = 2",
            "error[toml::syntax] 2:1: this is not TOML: a duplicate key | help: remove one of the two\n",
        ),
        (
            "stiffness \"s\"",
            "error[toml::syntax] 1:11: this is not TOML: key with no value, expected `=` | help: write it as `key = value`\n",
        ),
    ] {
        assert_eq!(diagnostics(line), expected, "{line}");
    }
}

#[test]
fn nodes_lead_through_the_document() {
    let source = "model = 1\n[[scenario.event]]\na = 1\n[[scenario.event]]\n[study]\n";
    let (document, mut out) = syntax(source);
    let root = Node::root(&document);
    assert!(root.child("model", &mut out).is_none() && root.child("shaft", &mut out).is_none());
    let scenario = root.child("scenario", &mut out).expect("the table is there");
    assert_eq!(scenario.list("event", &mut out).len(), 2);
    assert_eq!(scenario.list("nothing", &mut out).len(), 0);
    assert_eq!(root.list("study", &mut out)[0].place.span(), source.find("[study]").map_or(0..0, |at| at..at + 7));
    assert_eq!(
        plain(source, &out),
        "error[type::wrong] 1:9: `model`: expected a table, found the number 1 | not a table \
         | help: write it as `[model]` with its keys below\n"
    );
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(
        text in any::<String>(),
        near in "((inertia|ratio|shafts|terms|event|law|name|x) ?= ?[\\[{\"'a-z0-9 ,=./]{0,12}[\\]}\"']?\n){0,6}",
    ) {
        for source in [text, near] {
            let (document, mut out) = syntax(&source);
            let root = Node::root(&document);
            table(&ELEMENT, &root, "shaft `wg`", &mut out);
            for node in root.children(&mut out) {
                table(&ELEMENT, &node, "shaft `wg`", &mut out);
            }
            for label in out.iter().flat_map(|diagnostic| &diagnostic.labels) {
                prop_assert!(source.get(label.place.span()).is_some(), "{label:?}");
            }
            prop_assert!(out.iter().all(|diagnostic| diagnostic.help.is_some() && !diagnostic.labels.is_empty()));
        }
    }

    #[test]
    fn values_read_equal_those_written(numerator in any::<i32>(), denominator in 1_i64..1000) {
        let source = format!("inertia = \"1 kg m^2\"\nratio = \"{numerator}/{denominator}\"\nvalue = {numerator}");
        let (table, diagnostics) = read(&source);
        prop_assert_eq!(diagnostics.is_empty(), numerator != 0);
        let expected = Value::Scalar(Scalar::Literal(Exact::from_integer(numerator.into()), Dimension::NONE));
        prop_assert_eq!(&table.values["value"].value, &expected);
    }
}
