//! What is told of expressions, tables and the ground: exact words, the place, and what is right and told nothing of.

use kardan::diagnostics::Diagnostic;
use kardan::study::{AnalyzeSettings, Project, Silent, analyze, check};

use crate::common::{at, close, run};

/// Code, message, what is underlined, the words beneath it, help.
fn reported(source: &str, one: &Diagnostic) -> [String; 5] {
    let label = one.labels.first();
    let under = label.map_or(String::new(), |label| source[label.place.span()].to_string());
    let annotation = label.map_or(String::new(), |label| label.text.clone());
    [one.code.to_string(), one.message.clone(), under, annotation, one.help.clone().unwrap_or_default()]
}

fn only(source: &str) -> [String; 5] {
    let found = check(source);
    assert_eq!(found.len(), 1, "{found:?}\n{source}");
    reported(source, &found[0])
}

fn right(source: &str) {
    assert_eq!(check(source), [], "{source}");
}

const SHAFT: &str = "[shaft.a]\ninertia = \"1 kg m^2\"\n";
const CAR: &str = "[mass.car]\nmass = \"1 kg\"\n[motor.m]\nmass = \"car\"\n";

fn law(law: &str) -> String {
    format!("{SHAFT}[torque.l]\nshaft = \"a\"\nlaw = \"{law}\"\n")
}

/// The part that bends is underlined, the innermost one, with where it does.
#[test]
fn kinks_are_named_where_they_stand() {
    let surface = |text: &str| {
        format!(
            "{SHAFT}{CAR}[constraint.rod]\nexpression = \"{text}\"\n[scenario]\ninitial = {{ \"car.s\" = \"0.2 m\" }}\n"
        )
    };
    let offset = |text: &str| {
        format!(
            "{SHAFT}[shaft.b]\ninertia = \"1 kg m^2\"\n[constraint.c]\ncoefficients = {{ a = 1, b = -2 }}\noffset = \"{text}\"\n"
        )
    };
    for (source, under, annotation) in [
        (
            surface("car.s - abs(50 mm * cos(a.phi)) - 15 cm"),
            "abs(50 mm * cos(a.phi))",
            "`abs` has a kink where this is zero",
        ),
        (
            surface("car.s - max(50 mm * cos(a.phi), abs(-1 mm)) - 15 cm"),
            "max(50 mm * cos(a.phi), abs(-1 mm))",
            "`max` has a kink where both are equal",
        ),
        (offset("1 deg * abs(sin(2 pi t / 1 s))"), "abs(sin(2 pi t / 1 s))", "`abs` has a kink where this is zero"),
        (
            offset("1 deg * if(t > 1 s, 1, 2) + abs(-1 deg)"),
            "if(t > 1 s, 1, 2)",
            "`if` may have a kink or a jump where the comparison changes",
        ),
    ] {
        let [code, _, found, beneath, _] = only(&source);
        assert_eq!([code.as_str(), &found, &beneath], ["motion::not-smooth", under, annotation], "{source}");
    }
    right(&surface("car.s - 50 mm * cos(a.phi) - abs(-15 cm)"));
    right(&offset("1 deg * sin(2 pi t / 1 s) + abs(-1 deg)"));
}

/// A sign of a speed is friction only where the law jumps there: `v² sign(v)` has a derivative.
#[test]
fn a_sign_that_makes_no_jump_is_no_friction() {
    for smooth in [
        "-1 N m s^2/rad^2 * a.w^2 * sign(a.w)",
        "-1 N m s/rad * abs(a.w) * sign(a.w)",
        "-1 N m s^2/rad^2 * (a.w - 1 rad/s)^2 * sign(2 * a.w - 2 rad/s)",
        "-1 N m * sin(a.w / (1 rad/s)) * sign(a.w)",
    ] {
        right(&law(smooth));
    }
    for (jumps, sign) in [
        ("-1 N m * sign(a.w)", "sign(a.w)"),
        ("-1 N m * cos(a.w / (1 rad/s)) * sign(a.w)", "sign(a.w)"),
        ("-1 N m s^2/rad^2 * a.w^2 * sign(a.w) - 1 N m * sign(a.w - 1 rad/s)", "sign(a.w - 1 rad/s)"),
    ] {
        let [code, _, under, ..] = only(&law(jumps));
        assert_eq!([code.as_str(), &under], ["law::discontinuous", sign], "{jumps}");
    }
}

/// Of a law with a kink at the operating point both sides are analysed, and only what has it there is named; a jump is refused, and underlined.
#[test]
fn both_sides_of_a_kink_are_analysed() {
    // The eigenvalue without oscillation, or the stiffness, on both sides; the inertia is one.
    let sides = |source: &str| {
        let found = analyze(source, &AnalyzeSettings::default(), &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"));
        let squared = |modes: &[kardan::results::Mode]| {
            let value = modes.last().expect("a mode").eigenvalue;
            value.re * value.re + value.im * value.im
        };
        let opposite = found.opposite_side.expect("a kink");
        ([opposite.reference_side, opposite.side], [squared(&found.modes), squared(&opposite.modes)])
    };
    // abs(w) sign(w) is smooth; -phi and phi are one place.
    let one =
        "if(a.phi > 0 rad, -3 N m/rad * a.phi, max(-1 N m, -2 N m/rad*a.phi)) - 0.1 N m s/rad * abs(a.w) * sign(a.w)";
    let (names, stiffness) = sides(&law(one));
    assert_eq!(names, ["`a.phi` > 0", "`a.phi` < 0"]);
    stiffness.into_iter().zip([3.0, 2.0]).for_each(|(found, expected)| close(found, expected, 1e-12, one));
    // What stands still has no place: the signal is zero at the beginning, on a point of the table.
    let map = "[table.map]\npoints = { x = [\"-1 rad/s\", \"0 rad/s\", \"1 rad/s\"], y = [0, 1], \
               value = [\"1 N m\", \"0 N m\", \"-2 N m\", \"1 N m\", \"0 N m\", \"-2 N m\"] }\n";
    let spring = "[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"1 N m/rad\"\n";
    let source = format!("{}{map}{spring}", law("map(a.w, t / 1 s)"));
    assert_eq!(sides(&source).0, ["`a.w` > 0", "`a.w` < 0"]);
    let smooth = format!("{}{map}{spring}", law("map(0 rad/s, t / 1 s) - 1 N m/rad * a.phi"));
    let smooth = analyze(&smooth, &AnalyzeSettings::default(), &Silent).expect("smooth");
    assert_eq!(smooth.opposite_side, None);
    let jump = "-1 N m * sign(a.phi) - 1 N m/rad * abs(a.phi)";
    let source = law(jump);
    let wrong = analyze(&source, &AnalyzeSettings::default(), &Silent).expect_err("a jump");
    assert_eq!(wrong.len(), 1, "{wrong:?}");
    let [code, message, under, ..] = reported(&source, &wrong[0]);
    let expected =
        "`l` has no slope at the operating point, so the model has no linearisation there: it jumps where `a.phi` = 0";
    assert_eq!(
        (code.as_str(), message.as_str(), under),
        ("analysis::not-differentiable", expected, format!("\"{jump}\""))
    );
}

/// A relation, and a row of speeds, may be of any unit; the terms of a row are one quantity all the same.
#[test]
fn a_relation_may_be_of_any_unit() {
    let circle = "(car.s - 5 cm * cos(a.phi))^2 + (5 cm * sin(a.phi))^2 - (15 cm)^2";
    let start = "[scenario]\ninitial = { \"car.s\" = \"0.2 m\" }\n";
    let source = format!("{SHAFT}{CAR}[constraint.rod]\nexpression = \"{circle}\"\n{start}");
    right(&source);
    right(&source.replace(circle, &format!("({circle}) * 3 kg / 1 s")));
    let rates = "[mass.b]\nmass = \"1 kg\"\n[constraint.r]\nrates = { car = \"1 m + b.s\", b = \"car.s\" }\n";
    right(&format!("{CAR}{rates}"));
    let [code, message, ..] = only(&format!("{CAR}{}", rates.replace("\"car.s\"", "1")));
    assert_eq!(code, "unit::dimension");
    assert!(message.contains("but the term of `car` is a quantity in m^2/s"), "{message}");
}

/// The ground stands still: in rows it has no share, in expressions its motion is zero, and what names it alone acts on nothing.
#[test]
fn the_ground_never_moves() {
    let pair = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n";
    let rolls = |more: &str| format!("{pair}[constraint.c]\nrates = {{ a = 1, b = \"cos(a.phi)\"{more} }}\n");
    right(&rolls(", ground = -3"));
    let swings = |place: &str| {
        format!(
            "{}[scenario]\nduration = \"1 s\"\ninitial = {{ \"a.phi\" = \"1 rad\" }}\n",
            law(&format!("-4 N m/rad * {place}"))
        )
    };
    let found = run(&swings("(a.phi - ground.phi) - 3 N m s/rad * ground.w - 1 N s/m * 0 m * ground.v"));
    close(at(&found, "a.phi", 1.0), 2.0_f64.cos(), 1e-9, "an oscillation at 2 rad/s");
    for (element, key) in [
        ("[brake.x]\nshaft = \"ground\"\ntorque = \"1 N m\"\n", "brake"),
        ("[motor.x]\nshaft = \"ground\"\n", "motor"),
        ("[disturbance.x]\nshaft = \"ground\"\n", "disturbance"),
        ("[end_stop.x]\nshaft_1 = \"ground\"\nlower = \"-1 rad\"\n", "end_stop"),
    ] {
        let source = format!("{SHAFT}{element}");
        let found = check(&source);
        let [code, message, under, ..] = reported(&source, &found[0]);
        let expected = match key {
            "motor" | "disturbance" => ["element::invalid".into(), format!("{key} `x`: the ground does not move")],
            _ => ["name::ground".to_string(), format!("{key} `x` acts on the ground alone, which does not move")],
        };
        assert_eq!(([code, message], under.as_str()), (expected, "\"ground\""), "{found:?}");
    }
    let still = |row: &str| only(&format!("{SHAFT}[constraint.c]\nrates = {{ {row} }}\n"));
    assert_eq!(still("ground = 1")[1], "`rates` of constraint `c`: it names nothing that can move");
    right(&format!(
        "{SHAFT}[brake.x]\nshaft = \"a\"\ntorque = \"1 N m\"\n[end_stop.y]\nshaft_1 = \"ground\"\nshaft_2 = \"a\"\nlower = \"-1 rad\"\n"
    ));
}

/// Each kind of element with the ground at each of its ends: supported, or refused with a place; nothing panics.
#[test]
fn no_element_breaks_on_the_ground() {
    let bodies = "[shaft.a]\ninertia = \"1 kg m^2\"\n[mass.n]\nmass = \"1 kg\"\n";
    let elements = [
        "[universal_joint.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nangle = \"20 deg\"\n",
        "[universal_joint.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nangle = \"20 deg\"\nbacklash = \"1 deg\"\n",
        "[universal_joint.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nangle_1 = \"20 deg\"\nangle_2 = \"20 deg\"\n",
        "[gear.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nratio = 2\nbacklash = \"1 deg\"\nefficiency = 0.9\n",
        "[harmonic_drive.x]\nwave_generator = \"A\"\nflexspline = \"G\"\ncircular_spline = \"A\"\nratio = 50\n",
        "[rack_and_pinion.x]\npinion = \"A\"\nrack = \"G\"\nradius = \"7 mm\"\n",
        "[rack_and_pinion.x]\npinion = \"A\"\nrack = \"G\"\ncurve = [{ angle = \"-1 rad\", position = \"-7 mm\" }, { angle = \"0 rad\", position = \"0 mm\" }, { angle = \"1 rad\", position = \"9 mm\" }]\n",
        "[screw.x]\nshaft = \"A\"\nnut = \"G\"\nlead = \"5 mm/rev\"\nefficiency = 0.5\n",
        "[pulley.x]\nshaft = \"A\"\nmass = \"G\"\nradius = \"5 mm\"\n",
        "[planetary.x]\nsun = \"A\"\nring = \"G\"\ncarrier = \"A\"\nsun_teeth = 20\nring_teeth = 60\n",
        "[spring_damper.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nstiffness = \"1 N m/rad\"\nbacklash = \"1 deg\"\n",
        "[clutch.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\ntorque = \"1 N m\"\n",
        "[one_way_clutch.x]\ndriving = \"A\"\ndriven = \"G\"\n",
        "[lock.x]\nshaft_1 = \"A\"\nshaft_2 = \"G\"\nengaged = \"1\"\n",
        "[prescribed_motion.x]\nshaft = \"G\"\nspeed = \"1 rad/s\"\n",
        "[sensor.x]\nmeasures = \"angle\"\nshaft = \"G\"\n",
        "[torque.x]\nshaft = \"G\"\nreaction = \"A\"\nlaw = \"1 N m * a.phi / (1 rad)\"\n",
    ];
    for element in elements {
        for [first, second] in [["a", "ground"], ["ground", "a"], ["ground", "ground"], ["n", "ground"]] {
            let source = format!(
                "{bodies}{}",
                element.replace("\"A\"", &format!("\"{first}\"")).replace("\"G\"", &format!("\"{second}\""))
            );
            let found = check(&source);
            assert!(found.iter().all(|one| !one.labels.is_empty()), "{found:?}\n{source}");
            let _ = analyze(&source, &AnalyzeSettings::default(), &Silent);
        }
    }
    let joint = format!("{SHAFT}{}", elements[0].replace("\"A\"", "\"a\"").replace("\"G\"", "\"ground\""));
    let [code, message, ..] = only(&joint);
    assert_eq!([code.as_str(), &message], ["element::invalid", "universal_joint `x`: the ground does not move"]);
}

/// What rubs is never negative: a number is looked at before a run, and zero is one.
#[test]
fn what_rubs_is_not_negative() {
    let pair = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[parameters]\nc = \"2 N m\"\n";
    for (element, key) in [
        ("[gear.x]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\nloss = \"VALUE\"\n", "gear"),
        (
            "[brake.x]\nshaft = \"a\"\ntorque = \"VALUE\"\n[gear.y]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\n",
            "brake",
        ),
        ("[clutch.x]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ntorque = \"VALUE\"\n", "clutch"),
    ] {
        let source = |value: &str| format!("{pair}{}", element.replace("VALUE", value));
        let [code, message, ..] = only(&source("1 N m - c"));
        let expected = format!("{key} `x`: it is negative, so friction would drive");
        assert_eq!([code, message], ["element::invalid".to_string(), expected]);
        right(&source("2 N m - c"));
        right(&source("c - 1 N m"));
    }
}

/// A stop that an operating point lies beyond is open in an analysis, and that is told; within it nothing is.
#[test]
fn a_point_past_a_stop_is_reported() {
    let noted = |angle: &str| {
        let source = format!(
            "{SHAFT}[end_stop.s]\nshaft_1 = \"a\"\nupper = \"10 deg\"\n[motor.m]\nshaft = \"a\"\n[analysis]\nat = {{ \"a.phi\" = \"{angle}\" }}\n"
        );
        let found = analyze(&source, &AnalyzeSettings::default(), &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"));
        found.notes.into_iter().filter(|note| note.contains("beyond")).collect::<Vec<_>>()
    };
    let reported = "the operating point lies 0.174533 rad beyond the stop of `s`: the model cannot be there; the analysis treats the stop as open";
    assert_eq!(noted("20 deg"), [reported]);
    assert!(noted("10 deg").is_empty() && noted("-1 rad").is_empty());
}

/// A grid of a file without one of its points names it, and a unit is written as "1" for a number.
#[test]
fn tables_show_which_place_is_missing() {
    let source = |units: &str| format!("{}[table.map]\nfile = \"map.csv\"\nunits = [{units}]\n", law("map(a.w, 0.5)"));
    let open = |rows: &str, units: &str| {
        let source = source(units);
        let project = Project::open(&source)
            .with_files([("map.csv".into(), Ok(format!("speed,part,torque\n{rows}").into_bytes().into()))]);
        let found = project.diagnostics();
        found.iter().map(|one| reported(&source, one)).collect::<Vec<_>>()
    };
    let units = "\"rpm\", \"1\", \"N m\"";
    assert!(open("0,0,0\n30,0,1\n0,1,2\n30,1,3\n", units).is_empty());
    let [[code, message, .., help]] = &open("0,0,0\n30,0,1\n30,1,3\n", units)[..] else { panic!() };
    assert_eq!(
        [code.as_str(), message],
        ["table::points", "table `map`: the grid has no value where the first column is 0 rad/s and the second 1"]
    );
    assert_eq!(help, "give one row for each point of the grid");
    let [[_, message, .., help]] = &open("0,0,0\n30,0,1\n0,1,2\n30,1,3\n", "\"rpm\", \"part\", \"N m\"")[..] else {
        panic!()
    };
    assert_eq!(message, "table `map`: `map.csv`: the unit `part` is not known");
    assert_eq!(help, "write a unit such as \"N m\" for each column, and \"1\" for a number without");
}

/// A parameter may be another one's value; per cent and kilowatt hours are units.
#[test]
fn parameters_follow_and_shares_have_units() {
    let with =
        |parameters: &str, value: &str| format!("[parameters]\n{parameters}\n[shaft.s]\ninertia = \"{value}\"\n");
    right(&with("a = \"2 kg m^2\"\nb = \"a\"\nc = \"b\"", "c"));
    let [code, message, ..] = only(&with("b = \"a\"", "b"));
    assert_eq!([code.as_str(), &message], ["unit::unknown", "parameter `b`: there is no parameter and no unit `a`"]);
    let [code, message, ..] = only(&with("b = \"b\"", "1 kg m^2 * b / b"));
    assert_eq!(
        [code.as_str(), &message],
        ["parameter::cyclic-definition", "parameter `b` depends on itself: b from b"]
    );
    let pair = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n";
    let gear =
        |value: &str| format!("{pair}[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\nefficiency = {value}\n");
    right(&gear("\"90 %\""));
    let [_, message, ..] = only(&gear("\"110 %\""));
    assert_eq!(message, "gear `g`: above 1 the gear would add power");
    let [code, ..] = only(&gear("\"90 deg\""));
    assert_eq!(code, "unit::dimension");
    let found = run(&format!(
        "[parameters]\npart = \"5 %\"\nstored = \"2 kWh\"\n{}[scenario]\nduration = \"1 s\"\n",
        law("part * stored / 360000")
    ));
    close(at(&found, "a.w", 1.0), 1.0, 1e-12, "5 % of 7.2 MJ");
}

/// What is missing in an expression is told at its place.
#[test]
fn expressions_show_what_is_missing() {
    let inertia = |text: &str| only(&format!("[shaft.a]\ninertia = \"{text}\"\n"));
    let [_, message, ..] = inertia("1 kg m^2 + ");
    assert_eq!(message, "`inertia` of shaft `a`: expected a number, a name or `(`, found the end of the text");
    let [_, message, ..] = inertia("1 kg m^2 / ");
    assert_eq!(message, "`inertia` of shaft `a`: expected a unit, found the end of the text");
    let [.., help] = inertia("2 kg m^2 * t");
    assert_eq!(help, "write it like \"130 kg mm^2\"; `t` is a tonne here, not a time");
    let [.., help] = inertia("2 kg m");
    assert_eq!(help, "write it like \"130 kg mm^2\"");
    let [_, message, .., help] = only(&law("1 N m * sin(2 pi 50 t)"));
    assert_eq!(message, "`law` of torque `l`: expected an operator or `)`, found `5`");
    assert_eq!(help, "write `*` between two factors");
    let [_, message, ..] = only(&law("1 N m * sin(2 pi"));
    assert_eq!(message, "`law` of torque `l`: a `(` without its `)`: found the end of the text");
}
