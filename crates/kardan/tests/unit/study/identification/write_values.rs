//! Tests of `src/study/identification/write_values.rs`.

use super::*;

/// An entry that is not alone in its line stays, and that is said: the law of a torque has taken its place.
#[test]
fn an_entry_that_cannot_be_removed_stays() {
    let source = |line: &str| {
        format!(
            "[shaft.s]\ninertia = \"1 kg m^2\"\n[identification]\nparameters = [\"s.friction_asymmetry\"]\n\
                 [[identification.extra]]\nkind = \"friction_asymmetry\"\nfriction = \"s\"{line}\n"
        )
    };
    let coefficient = FileValue { name: "s.friction_asymmetry".into(), value: 0.05, interval: None };
    let term = FileTerm {
        term: "s.friction_asymmetry".into(),
        element: "s".into(),
        law: FileLaw::FrictionAsymmetry,
        unit: "N m".into(),
        coefficients: vec![coefficient],
    };
    let put = |text: &str| {
        let (document, _) = kardan_model::read(text);
        TermEdit::new(&document, &term).expect("a law of a torque says it").put(text, &document, &term)
    };
    let (text, warning) = put(&source(" # a comment"));
    assert!(warning.is_none() && !text.contains("identification.extra"), "{warning:?} {text}");
    let (text, warning) = put(&source(" and more"));
    let warning = warning.expect("it stays");
    assert!(
        warning.starts_with("s.friction_asymmetry: ") && warning.contains("remove it before you identify again"),
        "{warning}"
    );
    assert!(text.contains("and more") && text.contains("[torque.s_friction_asymmetry_law]"), "{text}");
}
