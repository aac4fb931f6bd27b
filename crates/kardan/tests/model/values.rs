//! Values that are computed from parameters: exact, and computed anew for each variant.

use kardan::assemble::assemble;
use kardan::num::Rational;
use kardan::study;
use kardan::units::parse_quantity;

const RACK: &str = r#"
[model]
name = "rack"

[parameters]
J_pinion = "m_rack * r^2 + 1 kg mm^2"   # before what it follows from
m_rack = "3 kg"
r = "1 mm * teeth / 2"
teeth = 14
c = "200 N * r / 5 deg"

[[variant]]
name = "as_drawn"

[[variant]]
name = "larger"
set = { teeth = 20, m_rack = "2 * 2 kg" }

[[variant]]
name = "given"
set = { J_pinion = "5 kg mm^2" }

[shaft.pinion]
inertia = "J_pinion"
damping = "sqrt(c * J_pinion) / 10"

[shaft.wheel]
inertia = "2 * J_pinion"

[spring_damper.column]
shaft_1 = "pinion"
shaft_2 = "wheel"
stiffness = "c"
damping = "c * 1 ms"

[constraint.belt]
coefficients = { pinion = "teeth", wheel = "-if(r < 1 cm, 2, 3)" }
"#;

#[test]
fn values_follow_from_parameters_in_every_variant() {
    let (prepared, diagnostics) = study::prepare(RACK);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let exact = |text: &str| parse_quantity(text).unwrap().0.to_rational();
    for (variant, [inertia, teeth, other]) in prepared.variants.iter().zip([
        ["148 kg mm^2", "14", "-2"],
        ["401 kg mm^2", "20", "-3"],
        ["5 kg mm^2", "14", "-2"],
    ]) {
        let equations = &variant.reduced.equations;
        let inertia = exact(inertia);
        let sizes: Vec<Rational> = equations.inertias.iter().map(|term| term.value.to_rational()).collect();
        assert_eq!(sizes, [inertia.clone(), Rational::from(2) * &inertia], "{}", variant.name);
        let row: Vec<Rational> = equations.constraints[0].row.iter().map(|(_, x)| x.clone()).collect();
        assert_eq!(row, [exact(teeth), exact(other)], "{}", variant.name);
        let shown = variant.model.parameters.iter().find(|one| one.name == "J_pinion").unwrap();
        assert_eq!((shown.value, shown.unit.as_str()), (kardan::num::rational_to_f64(&inertia), "kg m^2"));
        // c = 200 N · r/5°, and d = √(c J)/10 is rounded once.
        let radius = exact(teeth) / Rational::from(2000);
        let stiffness = 200.0 * kardan::num::rational_to_f64(&radius) / 5f64.to_radians();
        let found = equations.springs[0].value.stiffness.to_f64();
        assert!((found / stiffness - 1.0).abs() < 1e-15, "{found} {stiffness}");
        let damping = (stiffness * kardan::num::rational_to_f64(&inertia)).sqrt() / 10.0;
        let own = equations.dampers.iter().find(|damper| damper.element == "pinion").unwrap().value.to_f64();
        assert!((own / damping - 1.0).abs() < 1e-15, "{own} {damping}");
    }
    assert_eq!(prepared.variants.len(), 3);
}

/// The same model with numbers in place of the expressions has the same equations.
#[test]
fn an_expression_is_the_number_that_it_gives() {
    let model = |inertia: &str, stiffness: &str| {
        let text = format!(
            "[model]\nname = \"a\"\n[parameters]\nm = \"2 kg\"\nk = \"300 N m/rad\"\n[shaft.a]\ninertia = \"{inertia}\"\n\
             [spring_damper.b]\nshaft_1 = \"a\"\nstiffness = \"{stiffness}\"\n"
        );
        let (document, diagnostics) = kardan::model::read(&text);
        assert!(diagnostics.iter().all(|one| one.code == "parameter::unused"), "{diagnostics:?}");
        let (model, mistakes) = document.model(&[]);
        assert!(mistakes.is_empty(), "{mistakes:?}");
        assemble(&model.all_coordinates, &model.terms)
    };
    let (one, other) = (model("m * (3 cm)^2 / 2", "1/(1/k + 1/(600 N m/rad))"), model("900 kg mm^2", "200 N m/rad"));
    assert_eq!((one.inertia_matrix(), one.stiffness_matrix()), (other.inertia_matrix(), other.stiffness_matrix()));
}
