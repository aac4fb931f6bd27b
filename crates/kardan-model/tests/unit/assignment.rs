//! Tests of `src/assignment.rs`.

use super::*;
use kardan_schema::file::to_toml;

const MODEL: &str = "\
[parameters]
beta = \"10 deg\"

[variants]
beta = \"[0, 10] deg\"

[shaft.wg]
inertia = \"1 kg m^2\"

[spring_damper.wg]
shaft_1 = \"wg\"
stiffness = \"2 N m/rad\"

[control.column]
law = \"decoupling\"

[[control.column.channels]]
output = \"wg.phi\"

[[requirement]]
signal = \"wg.phi\"
below = \"1 rad\"
";

fn set(text: &str) -> Result<(String, Option<String>), String> {
    let (mut entries, _) = syntax(MODEL);
    let note = assign(&mut entries, text).map_err(|wrong| wrong.to_string())?;
    Ok((to_toml(&entries), note))
}

#[test]
fn values_are_written_where_they_belong() {
    for (text, old, new) in [
        ("shaft.wg.inertia=3 kg m^2", "inertia = \"1 kg m^2\"", "inertia = \"3 kg m^2\""),
        ("wg.inertia = \"3 kg m^2\"", "", ""),
        ("column.law=lqr", "law = \"decoupling\"", "law = \"lqr\""),
        ("control.column.channels[0].output=wg.w", "output = \"wg.phi\"", "output = \"wg.w\""),
        ("requirement[0].below=2 rad", "below = \"1 rad\"", "below = \"2 rad\""),
    ] {
        match set(text) {
            Ok((model, None)) => assert_eq!(model, MODEL.replace(old, new), "{text}"),
            Ok(note) => panic!("{text}: {note:?}"),
            // Two entries are named wg.
            Err(wrong) => assert!(old.is_empty() && wrong.contains("shaft.wg.inertia"), "{text}: {wrong}"),
        }
    }
    let (model, _) = set("scenario.duration=2").unwrap();
    assert_eq!(model, format!("{MODEL}\n[scenario]\nduration = 2\n"));
    let (model, _) = set("column.poles=[-1, \"-2 ± 1j\"]").unwrap();
    assert!(model.contains("poles = [-1, \"-2 ± 1j\"]"), "{model}");
}

#[test]
fn a_parameter_that_is_set_is_not_varied() {
    let (model, note) = set("beta=20 deg").unwrap();
    assert!(model.starts_with("[parameters]\nbeta = \"20 deg\"\n\n[shaft.wg]"), "{model}");
    assert_eq!(note.as_deref(), Some("`beta` is set: [variants] no longer varies it"));
}

/// Values of variants and of manoeuvres override one that is set, which is reported.
#[test]
fn what_goes_before_a_value_is_reported() {
    let own = "[[variant]]\nname = \"soft\"\nset = { beta = \"1 deg\" }\n[[variant]]\nname = \"hard\"\n\
                   [manoeuvre.weave]\nset = { beta = \"2 deg\" }\n[manoeuvre.park]\nset = { gamma = 1 }\n";
    let model = MODEL.replace("[variants]\nbeta = \"[0, 10] deg\"\n", own);
    let note = |text: &str| assign(&mut syntax(&model).0, text).unwrap();
    let expected = "`beta` is set; the variants `soft` and the manoeuvres `weave` have values of their own for it";
    assert_eq!(note("beta=20 deg").as_deref(), Some(expected));
    let expected = "`scenario.duration` is set; the manoeuvres `weave`, `park` have a `duration` of their own";
    assert_eq!(note("scenario.duration=2 s").as_deref(), Some(expected));
    assert_eq!(note("column.law=lqr"), None);
}

#[test]
fn errors_suggest_the_nearest_name() {
    for (text, expected) in [
        ("beta", "has no `=`"),
        ("beta=", "has no value"),
        ("bta=1", "did you mean `beta`?"),
        ("colum.law=lqr", "did you mean `column`?"),
        ("shaft.wh.inertia=1", "did you mean `wg`?"),
        ("shaft.wg=1", "is a table"),
        ("shaft.wh=1", "`shaft.wh`: there is no `wh`"),
        ("parameters.gamma=1", "the model has no parameter `gamma`"),
        ("shaft=1", "no parameter `shaft`"),
        ("requirement[1].below=1", "it has one entry: write [0]"),
        ("requirement[0]=1", "is a table"),
        ("requirement[x].below=1", "is no key of a model"),
        ("requirement.below=1", "is a list"),
        (".=1", "is no key of a model"),
        ("\"a=1", "is no key of a model"),
        ("shaft.wg.inertia.more=1", "there is no `inertia`"),
    ] {
        let wrong = set(text).expect_err(text);
        assert!(wrong.contains(expected), "{text}: {wrong}");
    }
}
