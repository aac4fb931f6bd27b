//! Tests of `src/tolerance.rs`.

use super::super::read;
use super::*;
use kardan_math::units::Exact;
use kardan_mechanics::equations::Term;
use kardan_schema::diagnostics::plain;

const SOURCE: &str = r#"
[parameters]
s = "100 N m/rad ± 10 %"
c = "0.2 N m [0.1, 0.5] 95 %"
plain = "1 N m s/rad"

[shaft.wg]
inertia = "50 kg mm^2 ± 20 %"
damping = "plain"

[shaft.rk]
inertia = "1 kg m^2"
friction = "c"

[gear.belt]
shaft_1 = "wg"
shaft_2 = "cs"
ratio = "2 ± 1/4"

[shaft.cs]

[spring_damper.bar]
shaft_1 = "cs"
shaft_2 = "rk"
stiffness = "s"
damping = "0.02 N m s/rad +- 50 %"
"#;

fn document() -> Document {
    let (document, diagnostics) = read(SOURCE);
    assert_eq!(plain(SOURCE, &diagnostics), "");
    document
}

fn set(name: &str, a: i64, b: i64) -> Setting {
    Setting { name: name.into(), value: Exact::from_ratio(a, b), text: format!("{a}/{b}") }
}

#[test]
fn tolerances_of_parameters_and_keys_are_listed_by_name() {
    let (model, diagnostics) = document().model(&[]);
    assert_eq!(diagnostics, []);
    let ratio = Exact::from_ratio;
    let expected = [
        ("bar.damping", ratio(1, 100), ratio(2, 100), ratio(3, 100), None, "N m s/rad"),
        ("belt.ratio", ratio(7, 4), ratio(2, 1), ratio(9, 4), None, ""),
        ("c", ratio(1, 10), ratio(2, 10), ratio(5, 10), Some(ratio(19, 20)), "N m"),
        ("s", ratio(90, 1), ratio(100, 1), ratio(110, 1), None, "N m/rad"),
        ("wg.inertia", ratio(40, 1_000_000), ratio(50, 1_000_000), ratio(60, 1_000_000), None, "kg m^2"),
    ];
    let found: Vec<_> = model
        .tolerances
        .iter()
        .map(|t| {
            let (lower, nominal, upper) = (t.lower.clone(), t.nominal.clone(), t.upper.clone());
            (t.parameter.as_str(), lower, nominal, upper, t.confidence.clone(), t.dimension.si())
        })
        .collect();
    let expected: Vec<_> = expected.into_iter().map(|(a, b, c, d, e, f)| (a, b, c, d, e, f.to_string())).collect();
    assert_eq!(found, expected);
    for tolerance in &model.tolerances {
        assert!(SOURCE[tolerance.place.span()].contains(['±', '[', '+']), "{tolerance:?}");
    }
}

/// The nominal values are used, and shown as without a tolerance.
#[test]
fn a_tolerance_changes_nothing_of_the_model() {
    let cut = |line: &str| [" ±", " +-", " [0"].iter().find_map(|mark| line.find(mark));
    let bare: Vec<String> =
        SOURCE.lines().map(|line| cut(line).map_or(line.into(), |at| format!("{}\"", &line[..at]))).collect();
    let bare = bare.join("\n");
    assert!(!bare.contains('±') && !bare.contains("[0.1"));
    let (document_bare, diagnostics) = read(&bare);
    assert_eq!(plain(&bare, &diagnostics), "");
    let ((with, _), (untoleranced, _)) = (document().model(&[]), document_bare.model(&[]));
    assert_eq!(untoleranced.tolerances, []);
    assert_eq!(with.parameters, untoleranced.parameters);
    assert_eq!(with.elements, untoleranced.elements);
    assert_eq!(format!("{:?}", with.terms), format!("{:?}", untoleranced.terms));
}

#[test]
fn settings_of_implicit_parameters_change_the_model() {
    let document = document();
    let (model, diagnostics) =
        document.model(&[set("wg.inertia", 7, 1), set("bar.damping", 3, 1), set("belt.ratio", -5, 1), set("s", 4, 1)]);
    assert_eq!(diagnostics, []);
    let of = |element: &str| -> Vec<&Term> {
        model.terms.iter().filter(|named| named.element == element).map(|named| &named.term).collect()
    };
    let integer = Exact::from_integer;
    assert!(matches!(of("wg")[0], Term::Inertia { inertia, .. } if *inertia == integer(7)));
    assert!(matches!(of("rk")[0], Term::Inertia { inertia, .. } if *inertia == integer(1)));
    assert!(matches!(of("bar")[0], Term::Spring { stiffness, .. } if *stiffness == integer(4)));
    assert!(matches!(of("bar")[1], Term::Damper { damping, .. } if *damping == integer(3)));
    let Term::Constraint { direction, .. } = of("belt")[0] else { panic!("a gear is a constraint") };
    assert!(direction.entries.iter().any(|(_, x)| *x == integer(5) || *x == integer(-5)), "{direction:?}");
    // `±` moves with the value, an interval does not; other keys are not parameters.
    let moved = document.tolerances(&[set("wg.inertia", 10, 1), set("c", 3, 10), set("belt.ratio", 0, 1)]);
    let ends = |name: &str| moved.iter().find(|t| t.parameter == name).map(|t| (t.lower.clone(), t.upper.clone()));
    assert_eq!(ends("wg.inertia"), Some((integer(8), integer(12))));
    assert_eq!(ends("c"), Some((Exact::from_ratio(1, 10), Exact::from_ratio(1, 2))));
    assert_eq!(ends("belt.ratio"), Some((Exact::from_ratio(-1, 4), Exact::from_ratio(1, 4))));
    let (same, _) = document.model(&[set("rk.inertia", 7, 1)]);
    assert_eq!(format!("{:?}", same.terms), format!("{:?}", document.model(&[]).0.terms));
}

#[test]
fn a_setting_that_violates_the_rule_of_its_key_is_reported() {
    let (_, diagnostics) = document().model(&[set("wg.inertia", -1, 1)]);
    assert_eq!(
        plain(SOURCE, &diagnostics),
        "error[number::sign] 8:11: `inertia` of shaft `wg` must be zero or more, but `wg.inertia` is -1/1 \
             | through this parameter | help: change `wg.inertia` under `[parameters]` or `[variants]`\n"
    );
}
