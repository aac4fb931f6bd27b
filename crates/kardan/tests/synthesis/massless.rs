//! Laws beside motions without inertia: a motor without inductance, springs and dampers in series. Against closed forms, and against the limit of a small
//! inertia.

use crate::common;
use kardan::num::{Rational, rational_from_f64};
use kardan::results::{Design, Outcome, Run};
use kardan::study::{DesignSettings, Project, Settings, Silent};

#[track_caller]
fn close(value: f64, expected: f64, tolerance: f64) {
    common::close(value, expected, tolerance, "the closed form");
}

/// J, d, k, R.
const INERTIA: f64 = 0.02;
const DAMPING: f64 = 0.001;
const CONSTANT: f64 = 0.5;
const RESISTANCE: f64 = 2.0;

const DRIVE: &str = "[model]\nname = \"drive\"\n[shaft.arm]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.001 N m s/rad\"\n\
                     [voltage_source.supply]\nfrom = \"ground\"\nto = \"in\"\n\
                     [dc_motor.motor]\nfrom = \"in\"\nto = \"ground\"\nshaft = \"arm\"\ntorque_constant = \"0.5 N m/A\"\n\
                     resistance = \"2 Ohm\"\n";
const POLES: &str = "[control.c]\nlaw = \"pole_placement\"\ninputs = [\"supply\"]\npoles = [-10, -12]\n";
const LQR: &str = "[control.c]\nlaw = \"lqr\"\ninputs = [\"supply\"]\nmax_acceptable = { supply = \"10 V\" }\n";
const CHANNEL: &str = "[[control.c.channels]]\noutput = \"arm.phi\"\nreference = \"ref\"\n";
const STEP: &str = "[scenario]\nduration = \"0.5 s\"\noutput_step = \"10 ms\"\n\
                    [[scenario.event]]\nat = \"0 s\"\nsignal = \"ref\"\nto = \"1 rad\"\n";

fn design(source: &str) -> Design {
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    Project::open(source).design(&settings, &Silent).unwrap_or_else(|reported| panic!("{reported:?}"))
}

fn run(source: &str) -> Run {
    let run = common::run(source);
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

fn refused(source: &str) -> String {
    let reported = Project::open(source).run(&Settings::default(), &Silent).expect_err("a mistake");
    reported.iter().map(|one| format!("{}; {}", one.message, one.help.clone().unwrap_or_default())).collect::<String>()
}

/// What a law was designed to be, without what `design` says of its loop.
fn law(source: &str) -> Design {
    common::first(source).designed[0].describe()
}

/// Largest difference of a signal of two runs.
fn apart(a: &Run, b: &Run, name: &str) -> f64 {
    let (a, b) = (common::signal(a, name), common::signal(b, name));
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// With i = (u − k ω)/R the plant is J ω̇ + (d + k²/R) ω = (k/R) u: gains, poles, step, torque, current and energy follow.
#[test]
fn a_position_loop_of_a_motor_of_zero_inductance() {
    let source = format!("{DRIVE}{POLES}{CHANNEL}{STEP}");
    let found = design(&source);
    let (damping, input) = ((DAMPING + CONSTANT * CONSTANT / RESISTANCE) / INERTIA, CONSTANT / RESISTANCE / INERTIA);
    let [k, l] =
        ["K", "L"].map(|name| found.gains.iter().find(|gain| gain.name == name).expect("a gain").values.clone());
    close(k[0][0], 120.0 / input, 1e-12);
    close(k[0][1], (22.0 - damping) / input, 1e-12);
    close(l[0][0], 120.0 / input, 1e-12);
    assert_eq!(found.states, ["arm.phi", "arm.w"]);
    let poles: Vec<f64> = found.closed_loop_poles.iter().map(|pole| pole.re).collect();
    assert_eq!(poles.len(), 2, "the charge that counts is not listed");
    close(poles[0], -10.0, 1e-12);
    close(poles[1], -12.0, 1e-12);
    assert_eq!(found.integrals_without_effect, ["supply.q"]);
    let moves = run(&source);
    for t in [0.05_f64, 0.1, 0.3] {
        let (fast, slow) = ((-12.0 * t).exp(), (-10.0 * t).exp());
        let (angle, speed) = (1.0 - 6.0 * slow + 5.0 * fast, 60.0 * (slow - fast));
        let acceleration = -600.0 * slow + 720.0 * fast;
        close(common::at(&moves, "arm.phi", t), angle, 1e-9);
        close(common::at(&moves, "arm.w", t), speed, 1e-9);
        let torque = INERTIA * acceleration + DAMPING * speed;
        close(common::at(&moves, "motor.tau", t), torque, 1e-8);
        close(common::at(&moves, "supply.v", t), RESISTANCE * torque / CONSTANT + CONSTANT * speed, 1e-8);
        // The charge: the momentum and what the bearing took, over k.
        close(common::at(&moves, "supply.q", t), (INERTIA * speed + DAMPING * angle) / CONSTANT, 1e-9);
    }
    let kinetic = 0.5 * INERTIA * common::at(&moves, "arm.w", 0.5).powi(2);
    close(moves.energy.stored, kinetic, 1e-9);
    assert!(moves.energy.residual.abs() < 1e-10 * moves.energy.input, "{:?}", moves.energy);
    assert!(moves.energy.dissipated > 0.5);
}

/// The same law designed with an inductance tends to it: the difference is of the first order of L.
#[test]
fn a_small_inductance_converges_to_zero_inductance() {
    let with = |more: &str| run(&format!("{DRIVE}{more}{LQR}{CHANNEL}{STEP}"));
    let zero_inductance = with("");
    let mut before = None;
    for inductance in [4e-4, 4e-5] {
        let found = apart(&with(&format!("inductance = \"{inductance} H\"\n")), &zero_inductance, "arm.phi");
        assert!(found < 20.0 * inductance && found > 0.01 * inductance, "{inductance}: {found}");
        if let Some(before) = before {
            let ratio: f64 = before / found;
            assert!((ratio - 10.0).abs() < 1.0, "{ratio}");
        }
        before = Some(found);
    }
}

/// A law that names its operating point is held there by a current without inductance.
#[test]
fn zero_inductance_balances_a_weight() {
    let at = "at = { \"arm.phi\" = \"30 deg\" }\n";
    let weight = "[torque.weight]\nshaft = \"arm\"\nlaw = \"-2 N m * cos(arm.phi)\"\n";
    let scenario = "[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\nstart = \"operating_point\"\n";
    let rests = run(&format!("{DRIVE}{weight}{POLES}{at}{CHANNEL}{scenario}"));
    let point = (30.0_f64).to_radians();
    assert!(common::signal(&rests, "arm.phi").iter().all(|angle| (angle - point).abs() < 1e-12));
    let current = 2.0 * point.cos() / CONSTANT;
    close(common::at(&rests, "supply.i", 0.5), current, 1e-12);
    close(common::at(&rests, "supply.v", 0.5), current * RESISTANCE, 1e-12);
    // Without a law an equilibrium is found, and kept.
    let free = run(&format!("{DRIVE}{weight}[scenario]\nduration = \"1 s\"\nstart = \"equilibrium\"\n"));
    let angles = common::signal(&free, "arm.phi");
    assert!((angles[0].cos()).abs() < 1e-12 && (angles.last().expect("rows") - angles[0]).abs() < 1e-12);
}

/// A filter before the motor, with C = 20 mF behind R₁ = 0.5 Ω.
const FILTERED: &str = "[model]\nname = \"filtered\"\n[shaft.arm]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.001 N m s/rad\"\n\
                        [voltage_source.supply]\nfrom = \"ground\"\nto = \"in\"\n\
                        [resistor.r]\nfrom = \"in\"\nto = \"mid\"\nresistance = \"0.5 Ohm\"\n\
                        [capacitor.filter]\nfrom = \"mid\"\nto = \"ground\"\ncapacitance = \"20 mF\"\n\
                        [dc_motor.motor]\nfrom = \"mid\"\nto = \"ground\"\nshaft = \"arm\"\ntorque_constant = \"0.5 N m/A\"\n\
                        resistance = \"2 Ohm\"\n";

/// What flows past the capacitor only counts; three states are left, whose step follows from their poles, as the plant has no zero.
#[test]
fn what_flows_past_a_capacitor_only_counts() {
    let poles = [-10.0, -14.0, -40.0_f64];
    let law = POLES.replace("[-10, -12]", "[-10, -14, -40]");
    let source = format!("{FILTERED}{law}{CHANNEL}{STEP}");
    let found = design(&source);
    assert_eq!(
        (found.states.len(), found.integrals_without_effect.len()),
        (3, 1),
        "{:?} {:?}",
        found.states,
        found.integrals_without_effect
    );
    for (pole, expected) in found.closed_loop_poles.iter().zip(poles) {
        close(pole.re, expected, 1e-9);
    }
    // What the block makes of the two charges is exactly opposite.
    let data = &found.controller_data;
    let gains = &data.matrices.iter().find(|matrix| matrix.name == "D").expect("D").values[0];
    let of = |signal: &str| gains[data.reads.iter().position(|read| read.signal == signal).expect("a signal")];
    let charges: Vec<f64> =
        data.reads.iter().filter(|read| read.signal.ends_with(".q")).map(|read| of(&read.signal)).collect();
    assert_eq!(charges.len(), 2);
    assert!(charges[0] == -charges[1] && charges[0] != 0.0, "{charges:?}");
    let moves = run(&source);
    for t in [0.05_f64, 0.2, 0.4] {
        let share = |p: f64| {
            let product: f64 = poles.iter().filter(|q| **q != p).map(|q| q / (q - p)).product();
            -product * (p * t).exp()
        };
        close(common::at(&moves, "arm.phi", t), 1.0 + poles.iter().map(|p| share(*p)).sum::<f64>(), 1e-8);
    }
    // Behind an observer that measures the arm alone it is the same step, as both begin alike; with an inductance too.
    let observer = "[control.c.observer]\nsensors = [\"arm.phi\"]\ndisturbances = []\nmethod = \"kalman\"\n";
    for winding in ["", "inductance = \"5 mH\"\n"] {
        let of = |observer: &str| run(&format!("{FILTERED}{winding}{LQR}{CHANNEL}{observer}{STEP}"));
        assert!(apart(&of(""), &of(observer), "arm.phi") < 1e-8);
    }
    // Three charges that count together: gains that sum to zero exactly.
    let two_stage = FILTERED.replace("from = \"in\"\nto = \"mid\"", "from = \"between\"\nto = \"mid\"")
        + "[resistor.r0]\nfrom = \"in\"\nto = \"between\"\nresistance = \"2 Ohm\"\n\
           [capacitor.c0]\nfrom = \"between\"\nto = \"ground\"\ncapacitance = \"0.3 mF\"\n";
    for volts in [3, 5, 7, 10, 11, 13] {
        let law = LQR.replace("10 V", &format!("{volts} V"));
        let variant = common::first(&format!("{two_stage}{law}{CHANNEL}{STEP}"));
        let found = variant.designed[0].linear().on_angles;
        let arm = variant.design_models[0].coordinates().iter().position(|name| name == "arm").expect("the arm");
        let charges = (0..found.columns()).filter(|k| *k != arm && found[(0, *k)] != 0.0);
        let charges: Vec<_> = charges.map(|k| rational_from_f64(found[(0, k)]).expect("finite")).collect();
        assert_eq!(charges.len(), 3);
        assert_eq!(charges.iter().fold(Rational::ZERO, |sum, x| sum + x), Rational::ZERO, "{volts}: {charges:?}");
    }
    let design = design(&format!("{two_stage}{LQR}{CHANNEL}{STEP}"));
    assert_eq!((design.states.len(), design.integrals_without_effect.len(), design.closed_loop_poles.len()), (4, 1, 4));
    assert!(design.margins.expect("margins").uncontrolled_are_integrals, "exactly zero along what counts");
}

const ARM: &str = "[model]\nname = \"series\"\n[shaft.a]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.01 N m s/rad\"\n\
                   [shaft.b]\ninertia = \"0.05 kg m^2\"\n[motor.drive]\nshaft = \"a\"\n";
const TO_B: &str = "[control.c]\nlaw = \"lqr\"\ninputs = [\"drive\"]\nmax_acceptable = { drive = \"5 N m\" }\nKEYS\
                    [[control.c.channels]]\noutput = \"b.phi\"\nreference = \"ref\"\n";

fn spring(name: &str, ends: [&str; 2], law: &str) -> String {
    format!("[spring_damper.{name}]\nshaft_1 = \"{}\"\nshaft_2 = \"{}\"\n{law}\n", ends[0], ends[1])
}

/// Springs of 30 and 60 N m/rad in series are one of 20: gains, poles and run are the same.
#[test]
fn springs_in_series_are_one() {
    let series = "[shaft.n]\n".to_string()
        + &spring("k1", ["a", "n"], "stiffness = \"30 N m/rad\"")
        + &spring("k2", ["n", "b"], "stiffness = \"60 N m/rad\"");
    let joined = spring("k", ["a", "b"], "stiffness = \"20 N m/rad\"");
    for keys in ["", "sample_time = \"1 ms\"\n"] {
        let of = |springs: &str| format!("{ARM}{springs}{}{STEP}", TO_B.replace("KEYS", keys));
        let [one, other] = [&series, &joined].map(|springs| law(&of(springs)));
        assert_eq!(one.states, other.states);
        let gains = |design: &Design| design.gains[0].values.clone();
        for (x, y) in gains(&one).concat().iter().zip(gains(&other).concat()) {
            close(*x, y, 1e-9);
        }
        let [one, other] = [&series, &joined].map(|springs| run(&of(springs)));
        assert!(apart(&one, &other, "b.phi") < 1e-9);
        assert!(apart(&one, &other, "drive.tau") < 1e-7);
        // The node stands where both springs pull alike.
        let (a, b) = (common::at(&one, "a.phi", 0.1), common::at(&one, "b.phi", 0.1));
        close(common::at(&one, "n.phi", 0.1), (a + 2.0 * b) / 3.0, 1e-9);
    }
    // Design values that make one of them stiffer: 30 and 120 are 24.
    let keys = "design = { s = \"120 N m/rad\" }\n";
    let parameter = "[parameters]\ns = \"60 N m/rad\"\n";
    let of = |springs: &str| law(&format!("{ARM}{parameter}{springs}{}{STEP}", TO_B.replace("KEYS", keys)));
    let one = of(&series.replace("\"60 N m/rad\"", "\"s\""));
    let stiffer = law(&format!("{ARM}{}{}{STEP}", joined.replace("20", "24"), TO_B.replace("KEYS", "")));
    for (x, y) in one.gains[0].values.clone().concat().iter().zip(stiffer.gains[0].values.clone().concat()) {
        close(*x, y, 1e-9);
    }
}

/// A body on a Maxwell element: J ω̇ = u − s (φ − m), d ṁ = s (φ − m). Three states, whose gains and step follow by hand.
#[test]
fn a_body_on_a_maxwell_element() {
    let (inertia, stiffness, damping) = (0.05, 10.0, 2.0);
    let source =
        "[model]\nname = \"maxwell\"\n[shaft.b]\ninertia = \"0.05 kg m^2\"\n[shaft.m]\n[motor.u]\nshaft = \"b\"\n"
            .to_string()
            + &spring("s", ["b", "m"], "stiffness = \"10 N m/rad\"")
            + &spring("d", ["m", "ground"], "damping = \"2 N m s/rad\"")
            + "[control.c]\nlaw = \"pole_placement\"\ninputs = [\"u\"]\npoles = [-4, -8, -13]\n\
           [[control.c.channels]]\noutput = \"b.phi\"\nreference = \"ref\"\n"
            + STEP;
    let found = design(&source);
    assert_eq!(found.states, ["b.phi", "m.phi", "b.w"]);
    let poles = [-4.0, -8.0, -13.0];
    // λ (λ + a)(λ + c) + (λ + a)(s + k₁)/J − a (s − k₂)/J, with a = s/d and c = k₃/J.
    let (a, [p2, p1, p0]) = (stiffness / damping, [25.0, 4.0 * 8.0 + 4.0 * 13.0 + 8.0 * 13.0, 416.0]);
    let k3 = (p2 - a) * inertia;
    let k1 = (p1 - a * (p2 - a)) * inertia - stiffness;
    let k2 = p0 * inertia / a - k1;
    let k = found.gains[0].values.clone();
    close(k[0][0], k1, 1e-9);
    close(k[0][1], k2, 1e-9);
    close(k[0][2], k3, 1e-9);
    for (pole, expected) in found.closed_loop_poles.iter().zip(poles) {
        close(pole.re, expected, 1e-9);
    }
    // φ/r = l (λ + a)/J over Π(λ − p), with l = k₁ + k₂.
    let moves = run(&source);
    for t in [0.05_f64, 0.2, 0.4] {
        let share = |p: f64| {
            let product: f64 = poles.iter().filter(|q| **q != p).map(|q| p - q).product();
            (k1 + k2) * (p + a) / (inertia * p * product) * (p * t).exp()
        };
        close(common::at(&moves, "b.phi", t), 1.0 + poles.iter().map(|p| share(*p)).sum::<f64>(), 1e-9);
    }
    assert!(moves.energy.residual.abs() < 1e-9 * moves.energy.input.abs());
}

/// A motor that pushes the node itself: its angle answers in the first order, and every law tends to that of a small inertia.
#[test]
fn laws_are_the_limit_of_small_inertias() {
    let tree = |node: &str| {
        ARM.to_string()
            + &format!("[shaft.m]\n{node}[motor.push]\nshaft = \"m\"\n")
            + &spring("k", ["a", "b"], "stiffness = \"20 N m/rad\"")
            + &spring("s", ["a", "m"], "stiffness = \"10 N m/rad\"")
            + &spring("d", ["m", "b"], "damping = \"0.4 N m s/rad\"")
    };
    let channel = |output: &str, more: &str| {
        format!("[[control.c.channels]]\noutput = \"{output}\"\nreference = \"ref\"\n{more}")
    };
    let kalman =
        "[control.c.observer]\nsensors = [\"a.phi\", \"b.phi\"]\ndisturbances = [\"b\"]\nmethod = \"kalman\"\n";
    let lqr = |input: &str| {
        format!("[control.c]\nlaw = \"lqr\"\ninputs = [\"{input}\"]\nmax_acceptable = {{ {input} = \"2 N m\" }}\n")
    };
    let clock = "sample_time = \"2 ms\"\ndelay = \"1 ms\"\n";
    let sampled = "[control.c]\nlaw = \"sampled_noninteracting\"\nsample_time = \"2 ms\"\n";
    let laws = [
        lqr("drive") + &channel("b.phi", ""),
        lqr("push") + &channel("b.phi", ""),
        lqr("drive") + &channel("b.phi", "") + kalman,
        lqr("drive") + clock + &channel("b.phi", ""),
        lqr("drive") + clock + &channel("b.phi", "") + kalman,
        format!("[control.c]\nlaw = \"decoupling\"\ninputs = [\"drive\"]\n{}", channel("a.phi", "")),
        format!(
            "[control.c]\nlaw = \"noninteracting\"\n{}",
            channel("a.phi", "input = \"drive\"\nkind = \"position\"\n")
        ),
        "[control.c]\nlaw = \"position_loop\"\ninput = \"drive\"\noutput = \"a.phi\"\nreference = \"ref\"\n"
            .to_string()
            + "natural_frequency = \"20 rad/s\"\n",
        sampled.to_string() + &channel("b.phi", "input = \"drive\"\n"),
        sampled.to_string() + &channel("b.phi", "input = \"drive\"\n") + &kalman.replace("method = \"kalman\"\n", ""),
    ];
    for law in laws {
        let [massless, small] =
            ["", "inertia = \"1e-5 kg m^2\"\n"].map(|node| run(&format!("{}{law}{STEP}", tree(node))));
        let most = common::signal(&massless, "b.phi").iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(most > 0.1, "{law}");
        for name in ["a.phi", "b.phi", "m.phi"] {
            let apart = apart(&massless, &small, name);
            assert!(apart < 5e-3, "{name}: {apart}\n{law}");
        }
        assert!(massless.energy.residual.abs() < 1e-8 * massless.energy.input.abs(), "{law}: {:?}", massless.energy);
    }
}

/// What has no answer is refused by name.
#[test]
fn what_cannot_be_is_reported() {
    let kalman = |sensors: &str| format!("[control.c.observer]\nsensors = [{sensors}]\nmethod = \"kalman\"\n");
    let reported = refused(&format!("{DRIVE}{LQR}{CHANNEL}{}{STEP}", kalman("\"arm.phi\", \"motor.i\"")));
    assert!(
        reported.contains("reads `motor.i`, which has no inertia behind it") && reported.contains("`inductance`"),
        "{reported}"
    );
    let nonlinear = kalman("\"arm.phi\"") + "plant = \"nonlinear\"\n";
    let reported = refused(&format!("{DRIVE}{LQR}{CHANNEL}{nonlinear}{STEP}"));
    assert!(reported.contains("there are none for `supply`"), "{reported}");
    let chain = ARM.to_string()
        + &spring("joint", ["a", "b"], "stiffness = \"20 N m/rad\"")
        + "[shaft.m]\n[motor.push]\nshaft = \"m\"\n"
        + &spring("s", ["a", "m"], "stiffness = \"10 N m/rad\"");
    let damped = chain.clone() + &spring("d", ["m", "b"], "damping = \"0.4 N m s/rad\"");
    let law = "[control.c]\nlaw = \"noninteracting\"\n[[control.c.channels]]\noutput = \"m.phi\"\ninput = \"push\"\n\
               reference = \"ref\"\nkind = \"position\"\n";
    let reported = refused(&format!("{damped}{law}{STEP}"));
    assert!(reported.contains("`m.phi` moves without inertia") && reported.contains("`pole_placement`"), "{reported}");
    let observed = TO_B.replace("KEYS", "") + &kalman("\"a.phi\", \"m.w\"") + "disturbances = [\"a\"]\n";
    let reported = refused(&format!("{damped}{observed}{STEP}"));
    assert!(reported.contains("reads `m.w`"), "{reported}");
    // A spring alone: the node would jump with the torque of its motor.
    let sprung = chain + &spring("k", ["m", "b"], "stiffness = \"0.4 N m/rad\"");
    let reported = refused(&format!("{sprung}{}{STEP}", TO_B.replace("KEYS", "")));
    assert!(reported.contains("only springs resist `push`, so it would jump"), "{reported}");
    // A friction alone: for the design nothing holds it.
    let rubbed = sprung
        .replace("stiffness = \"0.4 N m/rad\"", "friction = \"1 N m\"")
        .replace("[motor.push]\nshaft = \"m\"\n", "");
    let reported = refused(&format!("{rubbed}{}{STEP}", TO_B.replace("KEYS", "")));
    assert!(
        reported.contains("it depends on the friction of `k`, and a controller is designed without friction"),
        "{reported}"
    );
    // Design values without the inertia that the model has.
    let parameter = "[parameters]\ni = \"0.001 kg m^2\"\n";
    let heavy = damped.replace("[shaft.m]\n", "[shaft.m]\ninertia = \"i\"\n") + parameter;
    let reported = refused(&format!("{heavy}{}{STEP}", TO_B.replace("KEYS", "design = { i = \"0 kg m^2\" }\n")));
    assert!(reported.contains("its design model and the model have different motions without inertia"), "{reported}");
}
