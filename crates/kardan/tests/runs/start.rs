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

fn told(model: &str, initial: &str) -> String {
    let source = format!("{model}[scenario]\nduration = \"1 ms\"\ninitial = {{ {initial} }}\n");
    let (_, diagnostics) = study::prepare(&source);
    let wrong: Vec<_> = diagnostics.iter().filter(|one| one.severity == Severity::Error).collect();
    assert!(wrong.len() == 1 && wrong[0].code == "scenario::contradiction", "{wrong:?}");
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
fn any_shaft_of_a_train_may_be_given() {
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
        let message = told(&model, "\"a.phi\" = \"70 deg\", \"c.phi\" = \"-3.0000000000000000001 deg\"");
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
        let message = told(&model, "\"sun.w\" = \"8 rad/s\", \"ring.w\" = \"4 rad/s\", \"carrier.w\" = \"6 rad/s\"");
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
fn joints_are_taken_at_the_end_that_is_given() {
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
    let message = told(&model, "\"x.phi\" = \"1 rad\", \"load.phi\" = \"1 rad\"");
    assert!(message.contains("ratio of `u`"), "{message}");
}

/// The charge of a capacitor that follows from others; constraints that hold or move something at the start.
#[test]
fn what_follows_may_be_given_in_circuits_and_beside_constraints() {
    let circuit = "[inductor.L]\nfrom = \"a\"\nto = \"ground\"\ninductance = \"1 mH\"\n[capacitor.C]\nfrom = \"a\"\nto = \"ground\"\n\
                   capacitance = \"1 uF\"\n";
    let run = begins(circuit, "\"C.q\" = \"5 uC\", \"C.i\" = \"2 A\"");
    is_at(&run, &[("C.v", 5.0), ("L.q", -5e-6), ("L.i", -2.0)]);
    let moved =
        shafts(&["a", "b"]) + "[constraint.c]\ncoefficients = { a = 1, b = -2 }\noffset = \"0.25 rad + 3 rad/s * t\"\n";
    let run = begins(&moved, "\"a.phi\" = \"1 rad\", \"b.w\" = \"1 rad/s\"");
    is_at(&run, &[("a.phi", 1.0), ("b.phi", 0.375), ("a.w", 5.0), ("b.w", 1.0)]);
    let message = told(&moved, "\"a.w\" = \"1 rad/s\", \"b.w\" = \"1 rad/s\"");
    assert!(message.contains("from which -1 rad/s follows"), "{message}");
    let held = shafts(&["a", "b"]) + "[constraint.h]\ncoefficients = { b = 1 }\noffset = \"20 deg\"\n";
    is_at(&begins(&held, "\"b.phi\" = \"20 deg\", \"b.w\" = \"0 rad/s\""), &[("b.phi", 20.0 * DEGREE)]);
    let message = told(&held, "\"b.w\" = \"1 rad/s\"");
    assert!(message.contains("the constraints of the model hold it at 0 rad/s"), "{message}");
}
