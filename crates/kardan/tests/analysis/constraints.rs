//! The class of each constraint, Tables 4.1 and 4.2, and how it is decided.

use kardan::results::{Analysis, ConstraintClass};
use kardan::study::{self, AnalyzeSettings, Silent};

fn analysis(source: &str) -> Analysis {
    study::analyze(source, &AnalyzeSettings::default(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"))
}

fn class(source: &str, element: &str) -> ConstraintClass {
    let found = analysis(source).class.unwrap().constraints;
    found.into_iter().find(|class| class.element == element).unwrap()
}

const BODIES: &str = "[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"2 kg\"\n[shaft.h]\ninertia = \"0.3 kg m^2\"\n\
                      [shaft.k]\ninertia = \"1 kg m^2\"\n";

/// Holonomic, scleronomic, linear.
fn class_flags(class: &ConstraintClass) -> [bool; 3] {
    assert!(class.equality);
    [class.holonomic.unwrap(), class.scleronomic, class.linear]
}

/// A soft stop that is pressed where a model rests is part of it, with its stiffness and damping: modes of `s² + d s + (k + c)`; open, or just touched, it is
/// not; what it is, is told.
#[test]
fn pressed_stops_are_part_of_the_model() {
    let source = |law: &str, stop: &str| {
        format!(
            "[mass.a]\nmass = \"1 kg\"\n[torque.w]\nmass = \"a\"\nlaw = \"{law}\"\n[end_stop.e]\nmass_1 = \"a\"\nlower = \"-1 m\"\n{stop}"
        )
    };
    let soft = "stiffness = \"98 N/m\"\ndamping = \"4 N s/m\"\n";
    for (law, stop, pole, note) in [
        ("-10 N - 2 N/m * a.s", soft, [-2.0, 96f64.sqrt()], "`e` is pressed at the operating point"),
        ("-1 N - 2 N/m * a.s", soft, [0.0, 2f64.sqrt()], "`e` is open at the operating point"),
        ("-10 N - 2 N/m * a.s", "", [0.0, 2f64.sqrt()], "`e` is touched at the operating point"),
    ] {
        let found = analysis(&source(law, stop));
        let mode = found.modes.iter().find(|mode| mode.eigenvalue.im > 0.0).unwrap();
        let error = (mode.eigenvalue.re - pole[0]).abs() + (mode.eigenvalue.im - pole[1]).abs();
        assert!(error < 1e-12, "{law} {stop}: {:?}", mode.eigenvalue);
        let reported = found.notes.iter().any(|text| text.starts_with("`e` is "));
        let expected = found.notes.iter().any(|text| text.starts_with(note));
        assert!(reported && expected, "{:?}", found.notes);
    }
}

/// A law designed where a soft stop is pressed has it in its gain and in the loop alike: poles of `s² + (d + k₂) s + c + k₁` with the gains that it shows.
#[test]
fn laws_are_designed_with_pressed_stops() {
    let source = "[mass.a]\nmass = \"1 kg\"\n[end_stop.e]\nmass_1 = \"a\"\nlower = \"0 m\"\nstiffness = \"100 N/m\"\ndamping = \"1 N s/m\"\n\
                  [torque.w]\nmass = \"a\"\nlaw = \"-10 N\"\n[motor.m]\nmass = \"a\"\n[control.c]\nlaw = \"lqr\"\ninputs = [\"m\"]\n\
                  at = { \"a.s\" = \"-0.05 m\" }\nmax_acceptable = { m = \"10 N\", \"a.s\" = \"0.01 m\" }\n";
    let design = study::design(source, &Default::default(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    // Of s⁴ + (2·100 − 1) s² + 100² + 10⁶: the product and the sum of the two stable roots.
    let found = design.closed_loop_poles[0];
    let (product, sum) = (1.01e6f64.sqrt(), (2.0 * 1.01e6f64.sqrt() - 199.0).sqrt());
    let error = (found.re * found.re + found.im * found.im - product).abs() + (2.0 * found.re + sum).abs();
    assert!(error < 1e-6, "{found:?}");
}

/// Rows of speeds: a wheel is nonholonomic, with a witness; exact differentials, also times a factor, are not; constant ones are linear.
#[test]
fn frobenius_distinguishes_rolling_from_integrable_constraints() {
    for (rates, expected) in [
        ("x = \"-sin(h.phi)\", y = \"cos(h.phi)\"", [false, true, false]),
        ("x = 1, h = \"-0.3 m * cos(k.phi)\"", [false, true, false]),
        ("x = \"sin(2 * h.phi - k.phi)\", y = \"cos(2 * h.phi - k.phi)\"", [false, true, false]),
        // d(x + 0.2 m sin h), the same times a factor that is no derivative, and constant coefficients.
        ("x = 1, h = \"0.2 m * cos(h.phi)\"", [true, true, false]),
        ("x = \"2 + sin(k.phi)\", h = \"0.2 m * cos(h.phi) * (2 + sin(k.phi))\"", [true, true, false]),
        ("x = \"y.s / 1 m\", y = \"x.s / 1 m\"", [true, true, false]),
        ("x = 1, y = -2", [true, true, true]),
    ] {
        let initial = "[scenario]\nduration = \"1 s\"\ninitial = { \"x.s\" = \"1 m\", \"y.s\" = \"1 m\", \"h.phi\" = \"0.4 rad\" }\n";
        let source = format!("{BODIES}[constraint.row]\nrates = {{ {rates} }}\n{initial}");
        let found = class(&source, "row");
        assert_eq!(class_flags(&found), expected, "{rates}: {found:?}");
        // What holds at times beside it is no part of the row.
        let stop = "[end_stop.stop]\nshaft_1 = \"k\"\nupper = \"1 rad\"\n";
        assert_eq!(class_flags(&class(&(stop.to_string() + &source), "row")), expected, "{rates}");
        let reason = found.reason.unwrap();
        // d of a function as it stands, or with a factor that is no derivative: then points drawn tell.
        let witness = if expected[2] {
            "its coefficients are constant"
        } else if rates.contains("(2 + sin(k.phi))") {
            "is zero at 3 random points modulo random primes: it is a relation between positions; wrong with a probability below "
        } else if expected[0] {
            "the cross derivatives of its coefficients are equal, exactly"
        } else {
            "is not zero, exactly, at the generic point"
        };
        assert!(reason.contains(witness), "{reason}");
        // The verdict on the model is that of its rows.
        let verdict = analysis(&source).class.unwrap();
        let broken: Vec<_> = verdict.assumptions.iter().flat_map(|one| &one.violations).collect();
        assert_eq!((verdict.constant_linear, broken.is_empty()), (expected[2], expected[2]), "{rates}: {broken:?}");
    }
}

/// Whether one row of speeds of three masses is holonomic, and why.
fn row_of_three(rates: &str) -> (Option<bool>, String) {
    let start =
        "[scenario]\nduration = \"1 s\"\ninitial = { \"x.s\" = \"0.6 m\", \"y.s\" = \"0.7 m\", \"z.s\" = \"0.4 m\" }\n";
    let source = format!("{}[constraint.c]\nrates = {{ {rates} }}\n{start}", masses(&["x", "y", "z"]));
    let found = class(&source, "c");
    (found.holonomic, found.reason.unwrap())
}

/// No prime and no point can be foreseen: a coefficient that vanishes modulo a prime below 2^61, or modulo many, or at small fractions, is not zero.
#[test]
fn no_prime_and_no_point_is_known_before() {
    let primes: Vec<u64> =
        std::iter::successors(Some((1 << 61) - 1), |&p| Some(kardan::num::prime_below(p))).take(40).collect();
    for prime in primes.iter().take(6) {
        let (holonomic, reason) = row_of_three(&format!("x = 1, y = \"{prime} * z.s / (1 m)\""));
        assert_eq!(holonomic, Some(false), "{prime}: {reason}");
    }
    let product = primes.iter().take(8).map(ToString::to_string).collect::<Vec<_>>().join(" * ");
    assert_eq!(row_of_three(&format!("x = 1, y = \"{product} * z.s / (1 m)\"")).0, Some(false));
    let vanishes: Vec<String> = (0..5).map(|k| format!("(z.s / (1 m) - {} / 11)^2", 13 + 3 * k)).collect();
    let (holonomic, reason) = row_of_three(&format!("x = 1, y = \"{} * z.s / (1 m)\"", vanishes.join(" * ")));
    assert_eq!(holonomic, Some(false), "{reason}");
    assert!(reason.contains("generic point drawn modulo a prime"), "{reason}");
}

/// Numbers that are no fractions, but come to one: the coefficient is that number.
#[test]
fn roots_that_cancel_are_exact() {
    for rates in [
        "z = 1, x = \"2 + (sqrt(2)^2 - 2) * y.s / (1 m)\"",
        "z = 1, x = \"2 + (sqrt(8) - 2 * sqrt(2)) * y.s / (1 m)\"",
        "z = 1, x = \"2 + (sqrt(2) * sqrt(3) - sqrt(6)) * y.s / (1 m)\"",
        "z = 1, x = \"2 + (exp(1) * exp(-1) - 1) * y.s / (1 m)\"",
        "z = 1, x = \"2 + (ln(6) - ln(2) - ln(3)) * y.s / (1 m)\"",
        "z = 1, x = \"2 + (sin(1)^2 + cos(1)^2 - 1) * y.s / (1 m)\"",
    ] {
        let (holonomic, reason) = row_of_three(rates);
        assert_eq!(holonomic, Some(true), "{rates}: {reason}");
        assert!(reason.starts_with("its coefficients are constant"), "{rates}: {reason}");
    }
    // A difference that is there: 1e-60 is not what rounding leaves.
    assert_eq!(row_of_three("x = 1, y = \"(1 + 1e-60 - sqrt(2)^2 / 2) * 1e60 * x.s / (1 m)\"").0, Some(true));
}

/// Functions that are not algebraic: what has exact derivatives, or an integrating factor that any solution of their differential equation has, is a
/// relation of positions; where none is found it is not decided, and nothing else is said.
#[test]
fn functions_that_are_not_rational_are_not_guessed_at() {
    for (rates, proof) in [
        // d(x + e^y), d sqrt(x² + y²), d(x ln y).
        ("x = 1, y = \"exp(y.s / (1 m))\"", "cross derivatives"),
        ("x = \"x.s / sqrt(x.s^2 + y.s^2)\", y = \"y.s / sqrt(x.s^2 + y.s^2)\"", "cross derivatives"),
        ("x = \"ln(y.s / (1 m))\", y = \"x.s / y.s\"", "cross derivatives"),
        // The same times e^z, atan z and a root.
        ("x = \"exp(z.s / (1 m))\", y = \"exp(z.s / (1 m)) * exp(y.s / (1 m))\"", "random points"),
        ("x = \"2 + atan(z.s / (1 m))\", y = \"(2 + atan(z.s / (1 m))) * tan(y.s / (1 m))\"", "random points"),
        (
            "x = \"sqrt(1 + z.s^2 / (1 m^2))\", y = \"(1 + z.s^2 / (1 m^2)) / sqrt(1 + z.s^2 / (1 m^2)) * y.s / (1 m)\"",
            "random points",
        ),
        // e^z e^-z is one.
        ("x = 1, y = \"exp(z.s / (1 m)) * exp(-z.s / (1 m)) * x.s / (1 m)\"", ""),
    ] {
        let (holonomic, reason) = row_of_three(rates);
        assert_eq!(holonomic, Some(true), "{rates}: {reason}");
        assert!(reason.contains(proof), "{rates}: {reason}");
    }
    for rates in [
        "x = 1, y = \"exp(z.s / (1 m))\"",
        "x = 1, y = \"sqrt(1 + z.s^2 / (1 m^2))\"",
        // Rounded numbers: the factor of z is zero, which 16 digits do not show.
        "x = 1, y = \"2 + ((sqrt(2) * z.s)^2 - 2 * z.s^2) / (1 m^2)\"",
    ] {
        let (holonomic, reason) = row_of_three(rates);
        assert!(holonomic != Some(false), "{rates}: {reason}");
        assert!(reason.contains("not decided") && !reason.contains("exactly"), "{rates}: {reason}");
    }
    // Sines of several arguments, tangents of angles are algebraic in sines and cosines: decided.
    let wheel = format!("{BODIES}[constraint.row]\nrates = {{ x = 1, y = \"tan(h.phi)\" }}\n");
    assert_eq!(class(&wheel, "row").holonomic, Some(false));
}

/// A row that says what a linear constraint says, times a factor that depends on the position, is told as that: it is not flat.
#[test]
fn a_dependent_row_names_the_rows_it_follows_from() {
    for (row, linear_rows, message) in [
        (
            "x = \"1 + y.s^2 / (1 m^2)\", y = \"-1 - y.s^2 / (1 m^2)\"",
            "[constraint.c2]\ncoefficients = { x = 1, y = -1 }\n",
            "`c1` is a multiple of `c2`",
        ),
        (
            "x = \"exp(z.s / (1 m))\", y = \"-exp(z.s / (1 m))\"",
            "[constraint.c2]\ncoefficients = { x = 1, y = -1 }\n",
            "`c1` is a multiple of `c2`",
        ),
        (
            "x = \"z.s / (1 m)\", y = \"1 - z.s / (1 m)\", z = -1",
            "[constraint.c2]\ncoefficients = { x = 1, y = -1 }\n[constraint.c3]\ncoefficients = { y = 1, z = -1 }\n",
            "`c1` is a sum of multiples of `c2`, `c3`",
        ),
    ] {
        let bodies = masses(&["x", "y", "z", "w"]);
        let source =
            format!("{bodies}[constraint.c1]\nrates = {{ {row} }}\n{linear_rows}[scenario]\nduration = \"1 s\"\n");
        let reported = study::analyze(&source, &AnalyzeSettings::default(), &Silent).unwrap_err();
        assert!(reported.iter().any(|one| one.message.contains(message)), "{row}: {reported:?}");
        assert!(!reported.iter().any(|one| one.message.contains("slopes")), "{row}: {reported:?}");
    }
}

/// Two rows that hold a wheel: each may have an integral where the other holds and has none alone.
#[test]
fn rows_are_judged_jointly() {
    // With h held at its place by the second row the wheel runs on a line.
    let fixed_heading = format!(
        "{BODIES}[constraint.wheel]\nrates = {{ x = \"-sin(h.phi)\", y = \"cos(h.phi)\" }}\n[constraint.hold]\nrates = {{ h = 1 }}\n"
    );
    for element in ["wheel", "hold"] {
        assert_eq!(class(&fixed_heading, element).holonomic, Some(true), "{element}");
    }
}

fn masses(names: &[&str]) -> String {
    names.iter().map(|name| format!("[mass.{name}]\nmass = \"1 kg\"\n")).collect()
}

/// All rows of a model: holonomic or not, and what is said of the first.
fn all_rows(source: &str) -> (Vec<bool>, String) {
    let found = analysis(source).class.unwrap().constraints;
    (found.iter().map(|class| class.holonomic.unwrap()).collect(), found[0].reason.clone().unwrap())
}

/// Engel's system has no integral: `dω` of its second row vanishes beside both rows, but what that leaves is no system by itself.
#[test]
fn the_last_derived_system_decides() {
    let engel = masses(&["w", "x", "y", "z"])
        + "[constraint.c1]\nrates = { z = 1, x = \"-y.s / 1 m\" }\n[constraint.c2]\nrates = { w = 1, x = \"-z.s / 1 m\" }\n";
    let (holonomic, reason) = all_rows(&engel);
    assert_eq!(holonomic, [false; 2]);
    assert!(reason.contains("all 2 rows together imply no relation between positions"), "{reason}");
    // With y held the first is d(z - c x), and the second follows by it.
    let fixed_y = engel + "[constraint.c3]\nrates = { y = 1 }\n";
    assert_eq!(all_rows(&fixed_y).0, [true; 3]);
}

/// A unicycle with n trailers on arms of 1 m: no relation of positions, whatever n.
#[test]
fn trailers_have_no_relation_of_positions() {
    for n in [1, 2, 5, 11] {
        let mut source = masses(&["x", "y"]);
        for k in 0..=n {
            source += &format!(
                "[shaft.h{k}]\ninertia = \"1 kg m^2\"\n[constraint.c{k}]\nrates = {{ x = \"-sin(h{k}.phi)\", y = \"cos(h{k}.phi)\""
            );
            source += &(1..=k).map(|j| format!(", h{j} = \"-1 m * cos(h{k}.phi - h{j}.phi)\"")).collect::<String>();
            source += " }\n";
        }
        let (holonomic, reason) = all_rows(&source);
        assert_eq!(holonomic, vec![false; n + 1], "{n}");
        assert!(reason.contains("imply no relation between positions"), "{reason}");
    }
}

/// Two wheels on one axle: both roll, neither slides; their difference is the rate of `b h = r (p - q)`.
#[test]
fn the_heading_of_two_wheels_is_a_relation_of_positions() {
    let robot = masses(&["x", "y"])
        + "[parameters]\nr = \"0.1 m\"\nb = \"0.4 m\"\n[shaft.h]\ninertia = \"0.2 kg m^2\"\n[shaft.p]\ninertia = \"0.01 kg m^2\"\n\
           [shaft.q]\ninertia = \"0.01 kg m^2\"\n[constraint.side]\nrates = { x = \"-sin(h.phi)\", y = \"cos(h.phi)\" }\n\
           [constraint.right]\nrates = { x = \"cos(h.phi)\", y = \"sin(h.phi)\", h = \"b / 2\", p = \"-r\" }\n\
           [constraint.left]\nrates = { x = \"cos(h.phi)\", y = \"sin(h.phi)\", h = \"-b / 2\", q = \"-r\" }\n";
    let (holonomic, reason) = all_rows(&robot);
    assert_eq!(holonomic, [false; 3]);
    assert!(reason.contains("all 3 rows together imply one relation between positions ("), "{reason}");
    let relations = [
        "left - right gives -0.4 h' + 0.1 p' - 0.1 q' = 0",
        "right - left gives 0.4 h' - 0.1 p' + 0.1 q' = 0",
        "-right + left gives -0.4 h' + 0.1 p' - 0.1 q' = 0",
        "-left + right gives 0.4 h' - 0.1 p' + 0.1 q' = 0",
    ];
    assert!(relations.iter().any(|relation| reason.contains(relation)), "{reason}");
}

/// A heading that is prescribed is a function of the time: the row is rheonomic, and has no integral with the time as a variable. A ball on a line that
/// turns has one: `x cos ωt + y sin ωt`'s rate less what the turn adds is not in it, the angle of a rolling disk geared to its heading is.
#[test]
fn the_time_is_a_variable() {
    let bodies = masses(&["x", "y"]) + "[shaft.h]\ninertia = \"1 kg m^2\"\n";
    let edge = "[constraint.row]\nrates = { x = \"-sin(h.phi)\", y = \"cos(h.phi)\" }\n";
    for motion in [
        "angle = \"2 rad/s * t\"",
        "angle = \"1 rad * sin(2 pi t / 1 s)\"",
        "speed = \"2 rad/s\"",
        "acceleration = \"1 rad/s^2\"",
    ] {
        let source = format!("{bodies}{edge}[prescribed_motion.p]\nshaft = \"h\"\n{motion}\n");
        let found = class(&source, "row");
        let rheonomic = motion.starts_with("angle");
        // The sine of a sine is no algebraic function of sines: nothing is said of it.
        let decided = if motion.contains("sin(") { None } else { Some(false) };
        assert_eq!(found.holonomic, decided, "{motion}: {found:?}");
        assert_eq!([found.scleronomic, found.linear], [!rheonomic, false], "{motion}: {found:?}");
        assert_eq!(found.reason.unwrap().contains("depend on the time"), rheonomic);
    }
    // A disk that rolls and turns as a gear tells has relations: x = r/2 sin h, of angles in parts.
    let disk = format!(
        "{bodies}[shaft.roll]\ninertia = \"0.006 kg m^2\"\n[gear.g]\nshaft_1 = \"roll\"\nshaft_2 = \"h\"\nratio = 2\n\
         [constraint.rx]\nrates = {{ x = 1, roll = \"-0.1 m * cos(h.phi)\" }}\n[constraint.ry]\nrates = {{ y = 1, roll = \"-0.1 m * sin(h.phi)\" }}\n"
    );
    for element in ["rx", "ry"] {
        assert_eq!(class(&disk, element).holonomic, Some(true), "{element}");
    }
}

#[test]
fn relations_of_positions_and_prescribed_motions_have_their_class() {
    let row = |row: &str| format!("{BODIES}[constraint.row]\n{row}\n");
    for (source, expected) in [
        (row("expression = \"h.phi - 0.5 * sin(k.phi)\""), [true, true, false]),
        (row("expression = \"h.phi - k.phi / 2\""), [true, true, true]),
        (row("expression = \"h.phi - k.phi / 2 - 1 rad\""), [true, true, true]),
        (row("coefficients = { h = 1, k = -1 }\noffset = \"1 rad * sin(2 pi t / 1 s)\""), [true, false, true]),
        (row("coefficients = { h = 1, k = -1 }\noffset = \"1 rad\""), [true, true, true]),
        (
            format!("{BODIES}[prescribed_motion.row]\nshaft = \"h\"\nspeed = \"1 rad/s * sin(2 pi t / 1 s)\"\n"),
            [true, false, true],
        ),
        (
            format!("{BODIES}[prescribed_motion.row]\nshaft = \"h\"\nacceleration = \"1 rad/s^2\"\n"),
            [true, false, true],
        ),
    ] {
        let found = class(&source, "row");
        assert_eq!(class_flags(&found), expected, "{source}: {found:?}");
        let verdict = analysis(&source).class.unwrap();
        let is_linear = source.contains("h.phi - k.phi / 2\"");
        assert_eq!(verdict.constant_linear, is_linear, "{source}");
        let why = verdict.assumptions.iter().flat_map(|one| &one.violations).map(|breach| breach.reason.as_str());
        let why = why.collect::<Vec<_>>().join("; ");
        let explained = match expected {
            _ if is_linear => why.is_empty(),
            [_, false, _] => why.starts_with("it is rheonomic: "),
            [.., false] => why.starts_with("it is not linear with constant coefficients: "),
            _ if source.contains("expression") => why.starts_with("its expression is not zero at zero angles but -1: "),
            _ => why == "its offset of 1 rad is not zero",
        };
        assert!(explained, "{source}: {why}");
    }
}

/// Small motions around the start: of a slider-crank by hand those of its linear row there.
#[test]
fn an_analysis_sees_a_relation_as_its_row_at_the_start() {
    let spring = "[spring_damper.s]\nshaft_1 = \"h\"\nstiffness = \"8 N m/rad\"\n";
    let start = "[scenario]\nduration = \"1 s\"\n";
    let by_hand = format!("{BODIES}{spring}[constraint.row]\nexpression = \"h.phi - 0.5 * sin(k.phi)\"\n{start}");
    let linear = format!("{BODIES}{spring}[constraint.row]\ncoefficients = {{ h = 1, k = -0.5 }}\n{start}");
    let poles = |source: &str| -> Vec<String> {
        let found = analysis(source).modes;
        found.iter().map(|mode| format!("{:.9} {:.9}", mode.eigenvalue.re, mode.eigenvalue.im)).collect()
    };
    assert_eq!(poles(&by_hand), poles(&linear));
    assert!(poles(&linear).iter().any(|pole| !pole.ends_with(" 0.000000000")));
}

/// What holds one way is an inequality: of positions, or of speeds alone; a lock is an equation at times. Where they are in `stuck` they are equations, and
/// take a degree of freedom away.
#[test]
fn unilateral_constraints_are_inequalities() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
                  [end_stop.stop]\nshaft_1 = \"a\"\nupper = \"1 rad\"\n[one_way_clutch.free]\ndriving = \"a\"\ndriven = \"b\"\n\
                  [lock.dog]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nengaged = \"sin(t * 1 rad/s)\"\n\
                  [scenario]\nduration = \"1 s\"\n";
    let of = |source: &str, element: &str| {
        let found = class(source, element);
        [found.equality, found.holonomic.unwrap(), found.scleronomic, found.linear]
    };
    assert_eq!(of(source, "stop"), [false, true, true, true]);
    assert_eq!(of(source, "free"), [false, false, true, true]);
    assert_eq!(of(source, "dog"), [true, true, false, true]);
    assert_eq!(class(source, "stop").equation, "-a >= -1");
    assert!(class(source, "free").reason.unwrap().contains("stuck = [\"free\"]"));
    let stuck = format!("{source}[analysis]\nstuck = [\"dog\"]\n");
    assert_eq!(of(&stuck, "dog"), [true; 4]);
    let found = [source, stuck.as_str()].map(|source| analysis(source).class.unwrap());
    assert!(found.iter().all(|class| !class.constant_linear), "open ones are no part of the theory");
}

/// Teeth that lose a part of their load are a constraint like others; what is not linear is told of the loss.
#[test]
fn gear_loss_is_an_equality_and_not_linear() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
                  [gear.teeth]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\nefficiency = 0.9\n[scenario]\nduration = \"1 s\"\n";
    let found = class(source, "teeth");
    assert!(
        found.equality && found.holonomic == Some(true) && found.scleronomic && found.linear && found.reason.is_none()
    );
    let class = analysis(source).class.unwrap();
    let broken: Vec<_> = class.assumptions.iter().filter(|assumption| !assumption.satisfied).collect();
    assert_eq!(broken.len(), 1, "{broken:?}");
    assert!(format!("{:?}", broken[0]).contains("its load-dependent gear friction"), "{broken:?}");
}
