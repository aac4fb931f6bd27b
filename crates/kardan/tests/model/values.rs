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
    for (variant, [inertia, tooth_count, other]) in prepared.variants.iter().zip([
        ["148 kg mm^2", "14", "-2"],
        ["401 kg mm^2", "20", "-3"],
        ["5 kg mm^2", "14", "-2"],
    ]) {
        let equations = &variant.reduced.equations;
        let inertia = exact(inertia);
        let sizes: Vec<Rational> = equations.inertias.iter().map(|term| term.value.to_rational()).collect();
        assert_eq!(sizes, [inertia.clone(), Rational::from(2) * &inertia], "{}", variant.name);
        let row: Vec<Rational> = equations.constraints[0].row.iter().map(|(_, x)| x.clone()).collect();
        assert_eq!(row, [exact(tooth_count), exact(other)], "{}", variant.name);
        let shown = variant.model.parameters.iter().find(|one| one.name == "J_pinion").unwrap();
        assert_eq!((shown.value, shown.unit.as_str()), (kardan::num::rational_to_f64(&inertia), "kg m^2"));
        // c = 200 N · r/5°, and d = √(c J)/10 is rounded once.
        let radius = exact(tooth_count) / Rational::from(2000);
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
        let (model, diagnostics) = document.model(&[]);
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
        assemble(&model.all_coordinates, &model.terms)
    };
    let (one, other) = (model("m * (3 cm)^2 / 2", "1/(1/k + 1/(600 N m/rad))"), model("900 kg mm^2", "200 N m/rad"));
    assert_eq!((one.inertia_matrix(), one.stiffness_matrix()), (other.inertia_matrix(), other.stiffness_matrix()));
}

/// Keys of elements are names: also of elements that stand later, of keys that are computed, and of those with a tolerance.
#[test]
fn keys_of_elements_are_names_in_expressions() {
    let source = r#"
[parameters]
mass = "3 kg"
half = "wheel.inertia / 2"

[variants]
mass = ["mass", "2 * mass", "twice * 3 kg"]

[shaft.wheel]
inertia = "'my-shaft.inertia' * 2"

[shaft.my-shaft]
inertia = "mass * (1 cm)^2"

[shaft.third]
inertia = "half + bar.stiffness * 1 s^2/rad / 100"

[spring_damper.bar]
shaft_1 = "wheel"
shaft_2 = "my-shaft"
stiffness = "100 N m/rad ± 10 %"
damping = "bar.stiffness * 1 ms"

[gear.belt]
shaft_1 = "wheel"
shaft_2 = "third"
ratio = "belt.offset / 1 rad + 2"
"#;
    let source = source.replace("half = ", "twice = 3\nhalf = ");
    let (prepared, diagnostics) = study::prepare(&source);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert_eq!(prepared.variants.len(), 3);
    for (variant, mass) in prepared.variants.iter().zip([3, 6, 9]) {
        let equations = &variant.reduced.equations;
        let own = |name: &str| equations.inertias.iter().find(|term| term.element == name).unwrap();
        let of = |name: &str| own(name).value.to_rational();
        let ratio = |a: i64, b: u64| Rational::from_parts(a.into(), b.into());
        assert_eq!(of("my-shaft"), ratio(mass, 10_000));
        assert_eq!(of("wheel"), ratio(2 * mass, 10_000));
        assert_eq!(of("third"), ratio(mass + 10_000, 10_000));
        assert_eq!(equations.dampers[0].value.to_rational(), ratio(1, 10));
        assert_eq!(variant.model.rounded, []);
    }
}

/// Each value that was rounded is told once, with the number that it became.
#[test]
fn rounded_values_are_reported() {
    let source = r#"
[parameters]
root = "sqrt(2)"
twice = "2 * root"
[shaft.a]
inertia = "sqrt(4) * 1 kg m^2"
damping = "sqrt(3) * 1 N m s/rad"
[shaft.b]
inertia = "sin(1) * 1 kg m^2"
[gear.g]
shaft_1 = "a"
shaft_2 = "b"
ratio = "twice"
"#;
    let (prepared, diagnostics) = study::prepare(source);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let reported: Vec<(String, String, f64)> =
        prepared.variants[0].model.rounded.iter().map(|one| (one.what.clone(), one.text.clone(), one.value)).collect();
    let expected = [
        ("`root`", "sqrt(2)", 2.0_f64.sqrt()),
        ("`damping` of shaft `a`", "sqrt(3) * 1 N m s/rad", 3.0_f64.sqrt()),
        ("`inertia` of shaft `b`", "sin(1) * 1 kg m^2", 1.0_f64.sin()),
    ];
    assert_eq!(reported.len(), expected.len(), "{reported:?}");
    for ((what, text, value), one) in reported.iter().zip(expected) {
        assert_eq!((what.as_str(), text.as_str()), (one.0, one.1));
        assert!((value - one.2).abs() <= 1e-15, "{value}");
    }
}

/// A control's keys are looked at over the interval of a parameter as those of elements are.
#[test]
fn tolerances_reach_keys_of_controls() {
    let source = |interval: &str, value: &str| {
        format!(
            r#"
[parameters]
x = "1 {interval}"
[shaft.a]
inertia = "x * 1 kg m^2"
[motor.m]
shaft = "a"
[control.c]
law = "position_loop"
input = "m"
output = "a.phi"
reference = "r"
damping_ratio = "{value}"
"#
        )
    };
    let reported = |interval: &str, value: &str| -> Vec<String> {
        let (_, diagnostics) = study::prepare(&source(interval, value));
        diagnostics
            .into_iter()
            .filter(|d| d.message.contains("damping_ratio") || d.message.contains("control `c`"))
            .map(|d| format!("{:?} {}", d.severity, d.message))
            .collect()
    };
    assert_eq!(reported("± 10 %", "1 / (x - 1/2)"), Vec::<String>::new());
    let at_end = reported("± 50 %", "1 / (x - 1/2)");
    assert!(
        at_end[0].contains("control `c`, at the lower end of the tolerance of `x` (0.5)")
            && at_end[0].contains("division by zero"),
        "{at_end:?}"
    );
    let inside = reported("± 60 %", "1 / (x - 1/2)^2");
    assert!(
        inside[0].starts_with("Warning") && inside[0].contains("division by `(x - 1/2)^2`, which may be zero"),
        "{inside:?}"
    );
    // Whose sign changes is zero; what is zero nowhere is proven so, though an interval alone would not tell; a choice keeps zero away.
    let crossed = reported("± 60 %", "2 + 0.1 / (x - 1/2)");
    assert!(
        crossed[0].starts_with("Error") && crossed[0].contains("`(x - 1/2)`, which is zero for a value"),
        "{crossed:?}"
    );
    assert_eq!(reported("± 60 %", "1 / (x * x - x + 0.26)"), Vec::<String>::new());
    assert_eq!(reported("± 60 %", "if(x < 0.9, 2, 1 / (x - 1/2))"), Vec::<String>::new());
}

/// Behind a quantity and a sign without spaces a name that is also a unit is the unit, which is reported.
#[test]
fn names_that_are_read_as_units_are_reported() {
    let source = |command: &str| {
        format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n[signal.h]\nkind = \"expression\"\nvalue = \"t\"\n\
             [control.c]\nlaw = \"program\"\ncommands = {{ m = \"{command}\" }}\n[scenario]\nduration = \"1 s\"\n"
        )
    };
    for (command, reported) in [
        ("3 N m/s*h", true),
        ("h*1 N m/s + 2 N m/s*h", true),
        ("1 N m*h/(1 s)", true),
        ("3 N m/s * h", false),
        ("h*3 N m/s", false),
        ("1e3*h*1 N m/s", false),
    ] {
        let found = study::check(&source(command));
        assert_eq!(found.iter().any(|one| one.code == "unit::name"), reported, "{command}: {found:?}");
    }
}

/// A parameter whose name a unit has too: behind a sign of multiplication it is the parameter, behind a number alone it is the unit.
#[test]
fn parameters_come_before_units_behind_a_sign() {
    let source = "[parameters]\nJ = \"3 kg m^2\"\nV = \"12 V\"\nhalf = \"0.5*V\"\nquarter = \"1/4*V\"\n\
                  [shaft.a]\ninertia = \"2*J\"\n[shaft.b]\ninertia = \"J*2\"\n[shaft.c]\ninertia = \"2 kg*m^2\"\n\
                  [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"2 N*m/rad * V / half\"\ndamping = \"1 N m s/rad * V / quarter\"\n\
                  [spring_damper.t]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nstiffness = \"1 N m/rad\"\n";
    let (prepared, reported) = study::prepare(source);
    assert!(reported.is_empty(), "{reported:?}");
    let equations = &prepared.variants[0].reduced.equations;
    let sizes: Vec<f64> = equations.inertias.iter().map(|term| term.value.to_f64()).collect();
    assert_eq!(sizes, [6.0, 6.0, 2.0]);
    assert_eq!(equations.springs[0].value.stiffness.to_f64(), 4.0);
    assert_eq!(equations.dampers[0].value.to_f64(), 4.0);
}
