//! Where runs begin: angles and speeds that are given of shafts, whether these are coordinates or follow from others.

use crate::common::*;
use kardan::diagnostics::Severity;
use kardan::results::Run;
use kardan::study;

fn shafts(names: &[&str]) -> String {
    names.iter().map(|name| format!("[shaft.{name}]\ninertia = \"1 kg m^2\"\n")).collect()
}

fn begins(model: &str, initial: &str) -> Run {
    run(&format!("{model}[scenario]\nduration = \"1 ms\"\ninitial = {{ {initial} }}\n"))
}

fn reported(model: &str, initial: &str) -> String {
    let source = format!("{model}[scenario]\nduration = \"1 ms\"\ninitial = {{ {initial} }}\n");
    let (_, diagnostics) = study::prepare(&source);
    let wrong: Vec<_> = diagnostics.iter().filter(|one| one.severity == Severity::Error).collect();
    assert!(wrong.len() == 1 && wrong[0].code == "scenario::inconsistent-initial", "{wrong:?}");
    wrong[0].message.clone()
}

#[track_caller]
fn is_at(run: &Run, values: &[(&str, f64)]) {
    for (name, value) in values {
        close(signal(run, name)[0], *value, 1e-15 * value.abs(), name);
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Two gears in a row, whichever shaft is the coordinate: all follow from any of them, and from all that agree, in fractions and powers of π.
#[test]
fn any_shaft_of_a_train_may_have_an_initial_value() {
    let model = shafts(&["a", "b", "c"])
        + "[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = \"10/3\"\n[gear.h]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nratio = -7\n";
    for coordinate in
        ["", "[model]\ncoordinates = [\"a\"]\n", "[model]\ncoordinates = [\"b\"]\n", "[model]\ncoordinates = [\"c\"]\n"]
    {
        let model = format!("{coordinate}{model}");
        for initial in [
            "\"a.phi\" = \"70 deg\", \"c.w\" = \"-3 rad/s\"",
            "\"b.phi\" = \"21 deg\", \"a.w\" = \"70 rad/s\"",
            "\"c.phi\" = \"-3 deg\", \"b.w\" = \"21 rad/s\"",
            "\"c.phi\" = \"-3 deg\", \"a.phi\" = \"70 deg\", \"b.w\" = \"21 rad/s\", \"b.phi\" = \"21 deg\", \"a.w\" = \"70 rad/s\"",
        ] {
            let run = begins(&model, initial);
            is_at(&run, &[("a.phi", 70.0 * DEGREE), ("b.phi", 21.0 * DEGREE), ("c.phi", -3.0 * DEGREE)]);
            is_at(&run, &[("a.w", 70.0), ("b.w", 21.0), ("c.w", -3.0)]);
        }
        // One unit in the last place is a contradiction.
        let message = reported(&model, "\"a.phi\" = \"70 deg\", \"c.phi\" = \"-3.0000000000000000001 deg\"");
        assert!(
            message.contains("`a.phi`") && message.contains("`c.phi`") && message.contains("contradicts"),
            "{message}"
        );
    }
}

/// (z_s + z_r) φ_c = z_s φ_s + z_r φ_r: two of the three give the third; one alone leaves the first coordinate at zero.
#[test]
fn two_shafts_of_a_planetary_gear_give_the_third() {
    let gear =
        "[planetary.p]\nsun = \"sun\"\ncarrier = \"carrier\"\nring = \"ring\"\nsun_teeth = 30\nring_teeth = 90\n";
    let model = shafts(&["sun", "ring", "carrier"]) + gear;
    for coordinates in ["[\"sun\", \"ring\"]", "[\"carrier\", \"ring\"]", "[\"sun\", \"carrier\"]"] {
        let model = format!("[model]\ncoordinates = {coordinates}\n{model}");
        for initial in [
            "\"sun.phi\" = \"8 rad\", \"ring.phi\" = \"4 rad\"",
            "\"carrier.phi\" = \"5 rad\", \"ring.phi\" = \"4 rad\"",
            "\"carrier.phi\" = \"5 rad\", \"sun.phi\" = \"8 rad\"",
        ] {
            is_at(&begins(&model, initial), &[("sun.phi", 8.0), ("ring.phi", 4.0), ("carrier.phi", 5.0)]);
        }
        let message =
            reported(&model, "\"sun.w\" = \"8 rad/s\", \"ring.w\" = \"4 rad/s\", \"carrier.w\" = \"6 rad/s\"");
        assert!(
            message.contains(
                "`carrier.w` = 6 rad/s contradicts `sun.w` = 8 rad/s, `ring.w` = 4 rad/s, from which 5 rad/s"
            ),
            "{message}"
        );
    }
    let model = format!("[model]\ncoordinates = [\"sun\", \"ring\"]\n{model}");
    is_at(&begins(&model, "\"carrier.phi\" = \"3 rad\""), &[("sun.phi", 0.0), ("ring.phi", 4.0)]);
}

/// tan y = tan x / cos β from either end, and ẏ = γ′ ẋ there; both ends given must agree, to 1e-9.
#[test]
fn joints_start_at_the_end_that_has_an_initial_value() {
    let model = shafts(&["x", "y", "load"])
        + "[universal_joint.u]\nshaft_1 = \"x\"\nshaft_2 = \"y\"\nangle = \"60 deg\"\n[gear.g]\nshaft_1 = \"y\"\nshaft_2 = \"load\"\nratio = 2\n";
    let (x, y) = ((0.5f64).atan(), std::f64::consts::FRAC_PI_4);
    // dy/dx = (1 + tan² x)/(1 + tan² y)/cos β
    let slope = 2.0 * 1.25 / 2.0;
    for initial in [
        format!("\"x.phi\" = \"{x:?} rad\", \"load.w\" = \"1 rad/s\""),
        "\"y.phi\" = \"45 deg\", \"y.w\" = \"2 rad/s\"".into(),
        format!("\"load.phi\" = \"22.5 deg\", \"x.w\" = \"{:?} rad/s\", \"x.phi\" = \"{x:?} rad\"", 2.0 / slope),
    ] {
        let run = begins(&model, &initial);
        for (name, value) in
            [("x.phi", x), ("y.phi", y), ("load.phi", 0.5 * y), ("y.w", 2.0), ("x.w", 2.0 / slope), ("load.w", 1.0)]
        {
            close(signal(&run, name)[0], value, 1e-14, name);
        }
    }
    let message = reported(&model, "\"x.phi\" = \"1 rad\", \"load.phi\" = \"1 rad\"");
    assert!(message.contains("ratio of `u`"), "{message}");
}

/// The charge of a capacitor that follows from others; constraints that hold or move something at the start.
#[test]
fn dependent_initial_values_in_circuits_and_beside_constraints() {
    let circuit = "[inductor.L]\nfrom = \"a\"\nto = \"ground\"\ninductance = \"1 mH\"\n[capacitor.C]\nfrom = \"a\"\nto = \"ground\"\n\
                   capacitance = \"1 uF\"\n";
    let run = begins(circuit, "\"C.q\" = \"5 uC\", \"C.i\" = \"2 A\"");
    is_at(&run, &[("C.v", 5.0), ("L.q", -5e-6), ("L.i", -2.0)]);
    let moved =
        shafts(&["a", "b"]) + "[constraint.c]\ncoefficients = { a = 1, b = -2 }\noffset = \"0.25 rad + 3 rad/s * t\"\n";
    let run = begins(&moved, "\"a.phi\" = \"1 rad\", \"b.w\" = \"1 rad/s\"");
    is_at(&run, &[("a.phi", 1.0), ("b.phi", 0.375), ("a.w", 5.0), ("b.w", 1.0)]);
    let message = reported(&moved, "\"a.w\" = \"1 rad/s\", \"b.w\" = \"1 rad/s\"");
    assert!(message.contains("from which -1 rad/s follows"), "{message}");
    let fixed = shafts(&["a", "b"]) + "[constraint.h]\ncoefficients = { b = 1 }\noffset = \"20 deg\"\n";
    is_at(&begins(&fixed, "\"b.phi\" = \"20 deg\", \"b.w\" = \"0 rad/s\""), &[("b.phi", 20.0 * DEGREE)]);
    let message = reported(&fixed, "\"b.w\" = \"1 rad/s\"");
    assert!(message.contains("the constraints of the model fix it at 0 rad/s"), "{message}");
}

fn wrong(source: &str) -> Vec<kardan::diagnostics::Diagnostic> {
    study::prepare(source).1.into_iter().filter(|one| one.severity == Severity::Error).collect()
}

const PENDULUM: &str = "[parameters]\nl = \"0.7 m\"\n[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"3 kg\"\n\
                        [constraint.rod]\nexpression = \"(x.s^2 + y.s^2 - l^2) / l\"\n";

const CRANK: &str = "[parameters]\nr = \"0.1 m\"\nl = \"0.3 m\"\n[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[shaft.rod]\ninertia = \"0.004 kg m^2\"\n\
                     [mass.p]\nmass = \"1.5 kg\"\n[constraint.a]\nexpression = \"p.s - r * cos(crank.phi) - l * cos(rod.phi)\"\n\
                     [constraint.b]\nexpression = \"r * sin(crank.phi) - l * sin(rod.phi)\"\n";

const DISK: &str = "[parameters]\nr = \"0.1 m\"\n[mass.x]\nmass = \"1 kg\"\n[mass.y]\nmass = \"1 kg\"\n[shaft.roll]\ninertia = \"0.01 kg m^2\"\n\
                    [shaft.h]\ninertia = \"0.02 kg m^2\"\n[constraint.rx]\nrates = { x = 1, roll = \"-r * cos(h.phi)\" }\n\
                    [constraint.ry]\nrates = { y = 1, roll = \"-r * sin(h.phi)\" }\n";

/// Beside rows that are kept, what is given stays and the others follow from the rows.
#[test]
fn initial_values_are_respected_beside_multiplier_constraints() {
    let is_near = |run: &Run, values: &[(&str, f64)]| {
        for (name, value) in values {
            close(signal(run, name)[0], *value, 1e-12, name);
        }
    };
    let run = begins(DISK, "\"x.v\" = \"0.5 m/s\", \"h.phi\" = \"30 deg\"");
    let roll = 5.0 / (30.0 * DEGREE).cos();
    is_near(&run, &[("x.v", 0.5), ("roll.w", roll), ("y.v", 0.1 * roll * 0.5), ("h.w", 0.0)]);
    // Of two places as near as each other the one ahead.
    let height = (0.7f64 * 0.7 - 0.35 * 0.35).sqrt();
    let run = begins(PENDULUM, "\"x.s\" = \"0.35 m\", \"x.v\" = \"1 m/s\"");
    is_near(&run, &[("x.s", 0.35), ("x.v", 1.0), ("y.s", height), ("y.v", -0.35 / height)]);
    let run = begins(PENDULUM, "\"x.s\" = \"0.35 m\", \"y.s\" = \"-sqrt(0.7^2 - 0.35^2) * 1 m\", \"y.v\" = \"1 m/s\"");
    is_near(&run, &[("x.s", 0.35), ("y.s", -height), ("y.v", 1.0), ("x.v", height / 0.35)]);
    let run = begins(CRANK, "\"crank.w\" = \"10 rad/s\"");
    is_near(&run, &[("crank.w", 10.0), ("rod.w", 10.0 / 3.0), ("p.s", 0.4), ("p.v", 0.0), ("crank.phi", 0.0)]);
    let run = begins(CRANK, "\"crank.phi\" = \"50 deg\", \"crank.w\" = \"10 rad/s\"");
    let angle = ((50.0 * DEGREE).sin() / 3.0).asin();
    is_near(
        &run,
        &[
            ("crank.phi", 50.0 * DEGREE),
            ("rod.phi", angle),
            ("rod.w", 10.0 * (50.0 * DEGREE).cos() / 3.0 / angle.cos()),
        ],
    );
}

/// What is given and has no place on the rows is a mistake that names the row and what contradicts it, and nothing else.
#[test]
fn initial_values_may_contradict_multiplier_constraints() {
    for (model, initial, message) in [
        (PENDULUM, "\"x.s\" = \"3 m\", \"y.s\" = \"4 m\"", "`x.s` = 3 m, `y.s` = 4 m contradict `rod`"),
        (PENDULUM, "\"x.s\" = \"0.7 m\", \"x.v\" = \"1 m/s\"", "`x.v` = 1 m/s contradicts `rod`"),
        (
            CRANK,
            "\"p.s\" = \"0.4 m\", \"crank.w\" = \"10 rad/s\", \"rod.w\" = \"3 rad/s\"",
            "`crank.w` = 10 rad/s, `rod.w` = 3 rad/s contradict `b`",
        ),
        (
            DISK,
            "\"x.v\" = \"1 m/s\", \"roll.w\" = \"11 rad/s\", \"h.w\" = \"2 rad/s\"",
            "`x.v` = 1 m/s, `roll.w` = 11 rad/s contradict `rx`",
        ),
        (PENDULUM, "\"x.s\" = \"3 m\"", "`x.s` = 3 m contradicts `rod`"),
    ] {
        let found = wrong(&format!("{model}[scenario]\nduration = \"1 ms\"\ninitial = {{ {initial} }}\n"));
        assert!(found.len() == 1 && found[0].code == "constraint::initial-position", "{initial}: {found:?}");
        assert!(found[0].message.contains(message), "{initial}: {}", found[0].message);
    }
}

/// What is no number, has no slopes or says the same twice at the start is told as what it is.
#[test]
fn constraints_with_no_start_are_reported_by_their_cause() {
    let bodies = "[mass.x]\nmass = \"1 kg\"\n[mass.y]\nmass = \"1 kg\"\n";
    for (expression, message) in [
        ("1 m^2 / x.s - y.s", "`c` has no finite value or slopes at the start"),
        ("1 m * ln(x.s / 1 m) - y.s", "`c` has no finite value or slopes at the start"),
        ("1 m * asin(x.s / 1 m + 2) - y.s", "`c` has no finite value or slopes at the start"),
        ("(x.s^2 + y.s^2 + 1 m^2) / 1 m", "all slopes of `c` are zero at the start"),
    ] {
        let found =
            wrong(&format!("{bodies}[constraint.c]\nexpression = \"{expression}\"\n[scenario]\nduration = \"1 ms\"\n"));
        assert!(found.len() == 1 && found[0].message.contains(message), "{expression}: {found:?}");
    }
    let dependent = format!(
        "{bodies}[constraint.c]\nexpression = \"(x.s^2 + y.s^2 - 1 m^2) / 1 m\"\n[constraint.d]\nexpression = \"sqrt(x.s^2 + y.s^2) - 1 m\"\n\
         [scenario]\nduration = \"1 ms\"\ninitial = {{ \"x.s\" = \"1 m\" }}\n"
    );
    let found = wrong(&dependent);
    assert!(found.len() == 1 && found[0].message.contains("at every position `d` is a multiple of `c`"), "{found:?}");
    let empty = wrong(&format!("{bodies}[constraint.c]\nrates = {{}}\n[scenario]\nduration = \"1 ms\"\n"));
    assert!(empty.len() == 1 && empty[0].message.contains("nothing is constrained"), "{empty:?}");
}
