//! Relations of any unit, rows that say the same twice, positions behind a curve: against closed forms.

use std::f64::consts::PI;

use kardan::diagnostics::Severity;
use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, EquationsForm, Project};

use crate::common::{close, run, run_by, signal};

fn unit<'a>(run: &'a Run, name: &str) -> &'a str {
    run.series.signals.iter().find(|signal| signal.name == name).unwrap_or_else(|| panic!("no {name}")).physical.unit()
}

/// A mass on a circle, `x² + y² − l² = 0` in m²: it goes round at a constant speed, and `2 λ x = m ẍ` gives λ = −m ω²/2 in N/m, whatever the
/// length. As rates, `x ẋ + y ẏ = 0` in m²/s, it is −m ω²; as a length, `(x² + y² − l²)/l`, the force −m ω² l/2.
#[test]
fn a_circle_in_square_metres_has_a_multiplier_in_newtons_per_metre() {
    let (mass, omega) = (2.0, 3.0_f64);
    for length in [1e-3_f64, 1.0, 1e5] {
        let circle = format!("x.s^2 + y.s^2 - ({length} m)^2");
        for (row, name, its_unit, multiplier) in [
            (format!("expression = \"{circle}\""), "ring.lambda", "N/m", -0.5 * mass * omega * omega),
            (format!("expression = \"({circle}) / {length} m\""), "ring.f", "N", -0.5 * mass * omega * omega * length),
            ("rates = { x = \"x.s\", y = \"y.s\" }".into(), "ring.lambda", "N/m", -mass * omega * omega),
        ] {
            let source = format!(
                "[mass.x]\nmass = \"{mass} kg\"\n[mass.y]\nmass = \"{mass} kg\"\n[constraint.ring]\n{row}\n[scenario]\n\
                 duration = \"2 s\"\noutput_step = \"10 ms\"\n\
                 initial = {{ \"x.s\" = \"{length} m\", \"y.v\" = \"{} m/s\" }}\n",
                omega * length
            );
            for method in [Method::Taylor, Method::Dop853, Method::Radau] {
                let run = run_by(&source, method, Some(1e-11));
                assert_eq!((run.outcome.clone(), unit(&run, name)), (Outcome::Completed, its_unit), "{row}");
                let [x, y, found] = ["x.s", "y.s", name].map(|name| signal(&run, name));
                for (k, t) in run.series.time.iter().enumerate() {
                    let bound = 1e-7 * length.max(1.0);
                    close(x[k], length * (omega * t).cos(), bound, "x");
                    close(y[k], length * (omega * t).sin(), bound, "y");
                    if length >= 1.0 {
                        close(found[k], multiplier, 1e-6 * multiplier.abs(), name);
                    }
                }
            }
        }
    }
    let source = "[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"2 kg\"\n[constraint.ring]\nexpression = \"x.s^2 + y.s^2 - (1 m)^2\"\n\
                  [scenario]\ninitial = { \"x.s\" = \"1 m\" }\n";
    let project = Project::open(source);
    let (text, _) = project.equations(EquationsForm::Text).unwrap();
    assert!(text.contains("ring.lambda"), "{text}");
    let symbols = project.symbolic_equations().unwrap().0;
    let text = format!("{symbols:?}");
    assert!(text.contains("ring.lambda") && text.contains(r"\lambda_{"), "{text}");
}

const SKATE: &str = "[mass.x]\nmass = \"3 kg\"\n[mass.y]\nmass = \"3 kg\"\n[shaft.heading]\ninertia = \"2 kg m^2\"\n\
                     [constraint.blade]\nrates = { x = \"-sin(heading.phi)\", y = \"cos(heading.phi)\" }\n\
                     [scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\nrelative_tolerance = 1e-10\n\
                     initial = { \"x.v\" = \"2 m/s\", \"heading.w\" = \"0.7 rad/s\" }\n";

/// A blade written twice, the second time as −2 times the first: the motion to the last bit, and the force shared by least squares,
/// `λ = λ₀/(1 + 4)`, `μ = −2 λ₀/5`, of which each part acts along its own row.
#[test]
fn a_repeated_row_of_speeds_is_enforced_once() {
    let again = "[constraint.twin]\nrates = { x = \"2 * sin(heading.phi)\", y = \"-cos(heading.phi) * 2\" }\n";
    let (one, two) = (run(SKATE), run(&format!("{SKATE}{again}")));
    for name in ["x.s", "y.s", "x.v", "heading.phi"] {
        assert_eq!(signal(&one, name), signal(&two, name), "{name}");
    }
    let [single, across] = ["blade.f", "blade.x.f"].map(|name| signal(&one, name));
    let [own, twin, own_x, twin_x] = ["blade.f", "twin.f", "blade.x.f", "twin.x.f"].map(|name| signal(&two, name));
    for k in 0..single.len() {
        close(own[k], single[k] / 5.0, 1e-13, "blade");
        close(twin[k], -2.0 * single[k] / 5.0, 1e-13, "twin");
        close(own_x[k] + twin_x[k], across[k], 1e-13, "both along x");
        close(twin_x[k], 4.0 * own_x[k], 1e-13, "each along its row");
    }
    assert!(single.iter().any(|force| force.abs() > 1.0));
    assert!(two.notes.iter().any(|note| note.contains("`blade`, `twin`")), "{:?}", two.notes);
}

/// Of rolling in two rows a third one is a sum; a row that is the first one times what varies is no sum with constant numbers.
#[test]
fn only_sums_with_constant_numbers_are_found() {
    let wheel = "[mass.x]\nmass = \"3 kg\"\n[mass.y]\nmass = \"3 kg\"\n[shaft.heading]\ninertia = \"2 kg m^2\"\n[shaft.roll]\ninertia = \"1 kg m^2\"\n\
                 [constraint.a]\nrates = { x = 1, roll = \"-0.1 m * cos(heading.phi)\" }\n\
                 [constraint.b]\nrates = { y = 1, roll = \"-0.1 m * sin(heading.phi)\" }\n\
                 [scenario]\nduration = \"1 s\"\ninitial = { \"roll.w\" = \"3 rad/s\", \"heading.w\" = \"1 rad/s\" }\n";
    let sum = "[constraint.c]\nrates = { x = 3, y = \"1/3\", roll = \"-0.3 m * cos(heading.phi) - 0.1 m / 3 * sin(heading.phi)\" }\n";
    let (one, two) = (run(wheel), run(&format!("{wheel}{sum}")));
    assert_eq!(signal(&one, "x.s"), signal(&two, "x.s"));
    for body in ["x", "y"] {
        let of =
            |run: &Run, row: &str| run.series.signal(&format!("{row}.{body}.f")).map(|signal| signal.values.clone());
        let rows = ["a", "b", "c"].map(|row| of(&two, row).unwrap_or_default());
        let before = of(&one, if body == "x" { "a" } else { "b" }).unwrap();
        for k in 0..before.len() {
            let sum: f64 = rows.iter().map(|row| row.get(k).copied().unwrap_or(0.0)).sum();
            close(sum, before[k], 1e-12, body);
        }
    }
    let bent = "[constraint.c]\nrates = { x = \"2 + sin(heading.phi)\", roll = \"-0.1 m * cos(heading.phi) * (2 + sin(heading.phi))\" }\n";
    let found = diagnostics(&format!("{wheel}{bent}"));
    assert!(found.contains("`a`") && found.contains("`c`") && found.contains("depend"), "{found}");
}

fn diagnostics(source: &str) -> String {
    let diagnostics: Vec<String> = (study::check(source).iter())
        .filter(|diagnostic| diagnostic.severity == Severity::Error)
        .map(|diagnostic| diagnostic.message.clone())
        .collect();
    diagnostics.join("; ")
}

/// A rack with a curve whose position is prescribed, `s = 20 mm sin 2t`: the pinion is where the curve, a natural spline through three points,
/// has that position; `φ̇ = ṡ/γ′`, `φ̈ = (s̈ − γ″ φ̇²)/γ′`, and the force that it takes is `m s̈ + J φ̈/γ′`.
#[test]
fn a_position_prescribed_behind_a_curve_moves_the_pinion() {
    let source = "[shaft.pinion]\ninertia = \"0.002 kg m^2\"\n[mass.rack]\nmass = \"4 kg\"\n\
                  [rack_and_pinion.teeth]\npinion = \"pinion\"\nrack = \"rack\"\n\
                  curve = [{ angle = \"-1 rad\", position = \"-40 mm\" }, { angle = \"0 rad\", position = \"0 mm\" }, { angle = \"1 rad\", position = \"60 mm\" }]\n\
                  [prescribed_motion.drive]\nmass = \"rack\"\nposition = \"20 mm * sin(2 rad/s * t)\"\n\
                  [scenario]\nduration = \"4 s\"\noutput_step = \"10 ms\"\n";
    // Second derivatives 0, M, 0 at the points: M = 3/2 (y₋₁ − 2 y₀ + y₁).
    let middle_curvature = 1.5 * (-0.04 + 0.06);
    let curve = |x: f64| {
        let (slope, sign) = (0.06 - middle_curvature / 3.0, if x < 0.0 { 1.0 } else { -1.0 });
        [
            slope * x + middle_curvature / 2.0 * x * x + sign * middle_curvature / 6.0 * x * x * x,
            slope + middle_curvature * x + sign * middle_curvature / 2.0 * x * x,
            middle_curvature + sign * middle_curvature * x,
        ]
    };
    assert!((curve(-1.0)[0] + 0.04).abs() < 1e-15 && (curve(1.0)[0] - 0.06).abs() < 1e-15);
    for method in [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau] {
        let run = run_by(source, method, Some(1e-11));
        assert_eq!(run.outcome, Outcome::Completed);
        let [phi, w, s, f] = ["pinion.phi", "pinion.w", "rack.s", "drive.f"].map(|name| signal(&run, name));
        for (k, t) in run.series.time.iter().enumerate() {
            let place = [0.02 * (2.0 * t).sin(), 0.04 * (2.0 * t).cos(), -0.08 * (2.0 * t).sin()];
            let [value, slope, curvature] = curve(phi[k]);
            close(value, place[0], 1e-11, "on the curve");
            close(s[k], place[0], 1e-11, "as prescribed");
            close(w[k], place[1] / slope, 1e-8, "speed");
            let acceleration = (place[2] - curvature * w[k] * w[k]) / slope;
            close(f[k], 4.0 * place[2] + 0.002 * acceleration / slope, 1e-7, "force");
        }
        assert!(run.energy.residual.abs() < 1e-8, "{:?}", run.energy);
    }
}

/// `4 pi^2` is 4·π²: a spring of that stiffness on 1 kg m² swings once a second, also as an expression of the angle.
#[test]
fn a_number_beside_pi_is_no_part_of_its_power() {
    let body = "[shaft.a]\ninertia = \"1 kg m^2\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"50 ms\"\nrelative_tolerance = 1e-12\n\
                initial = { \"a.phi\" = \"1 rad\" }\n";
    let spring = "[spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"ground\"\nstiffness = \"4 pi^2 N m/rad\"\n";
    let law = "[torque.s]\nshaft = \"a\"\nlaw = \"-4 pi^2 N m/rad * a.phi\"\n";
    for what in [spring, law] {
        let run = run(&format!("{body}{what}"));
        for (t, phi) in run.series.time.iter().zip(signal(&run, "a.phi")) {
            close(*phi, (2.0 * PI * t).cos(), 1e-9, what);
        }
    }
}
