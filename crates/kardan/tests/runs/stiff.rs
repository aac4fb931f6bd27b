//! The method for stiff loops: its exact Jacobian against differences, its runs against the reference on every model that comes with kardan and
//! on random ones.

use std::fmt::Write;

use kardan::results::{IntegrationMethod, Outcome, Physical, Run};
use kardan::simulate::{Machine, Method, Setup};
use kardan::study::PreparedVariant;

use super::common::{Dice, at, first, run_by, signal, variants};
use super::taylor::{builtin, difference, runs};

/// A number of ten to a power between two.
fn power_of_ten(dice: &mut Dice, low: f64, high: f64) -> f64 {
    10f64.powf(low + (high - low) * dice.below(1001) as f64 / 1000.0)
}

/// Shafts in a row: springs from soft to stiff, gears, bent joints, friction with and without breakaway, motors with lag and limits.
fn random_model(seed: u64) -> String {
    let mut dice = Dice(seed);
    let shafts = 2 + dice.below(4);
    let mut text = String::from("[model]\nname = \"random\"\n");
    for k in 0..shafts {
        let (inertia, damping) = (power_of_ten(&mut dice, -3.0, -1.0), power_of_ten(&mut dice, -3.0, -1.0));
        write!(text, "[shaft.s{k}]\ninertia = \"{inertia:.3e} kg m^2\"\ndamping = \"{damping:.3e} N m s/rad\"\n")
            .unwrap();
        if dice.below(2) == 0 {
            let friction = power_of_ten(&mut dice, -2.0, -0.3);
            writeln!(text, "friction = \"{friction:.3e} N m\"").unwrap();
            if dice.below(4) == 0 {
                writeln!(text, "breakaway = \"{:.3e} N m\"\nstribeck_speed = \"0.5 rad/s\"", 1.3 * friction).unwrap();
            }
        }
    }
    for k in 1..shafts {
        let ends = format!("shaft_1 = \"s{}\"\nshaft_2 = \"s{k}\"\n", k - 1);
        match dice.below(4) {
            0 => write!(text, "[gear.c{k}]\n{ends}ratio = \"{}/7\"\n", 5 + dice.below(20)),
            1 => write!(text, "[universal_joint.c{k}]\n{ends}angle = \"{} deg\"\n", 5 + dice.below(30)),
            _ => {
                let stiffness = power_of_ten(&mut dice, 1.0, 4.0);
                let damping = power_of_ten(&mut dice, -2.0, 1.5);
                write!(
                    text,
                    "[spring_damper.c{k}]\n{ends}stiffness = \"{stiffness:.3e} N m/rad\"\ndamping = \"{damping:.3e} N m s/rad\"\n"
                )
            }
        }
        .unwrap();
    }
    let motor = ["", "lag = \"0.5 ms\"\n", "torque_limit = \"1.7 N m\"\n"][dice.below(3)];
    write!(
        text,
        "[motor.m]\nshaft = \"s0\"\n{motor}[scenario]\nduration = \"0.6 s\"\noutput_step = \"1 ms\"\n\
         [[scenario.event]]\nat = \"0.05 s\"\nsignal = \"m.tau\"\nto = \"2 N m\"\n\
         [[scenario.event]]\nat = \"0.3 s\"\nsignal = \"m.tau\"\nto = \"-1.5 N m\"\nover = \"0.1 s\"\n"
    )
    .unwrap();
    text
}

/// The largest entry of the Jacobian less central differences, in parts of what the differences are known to.
fn jacobian_error(variant: &PreparedVariant, seed: u64) -> Option<f64> {
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
    let mut machine = Machine::new(setup);
    if !machine.prepare_jacobian(&variant.reduced) {
        return None;
    }
    let (size, r) = (machine.size(), machine.degrees_of_freedom());
    let states = size - 2;
    let mut dice = Dice(seed);
    let mut number = || 0.001 * (dice.below(2001) as f64 - 1000.0);
    let mut state: Vec<f64> = (0..size).map(|_| number()).collect();
    // Some stand still.
    (0..r).filter(|k| (k + seed as usize).is_multiple_of(3)).for_each(|k| state[r + k] = 0.0);
    machine.enter_segment(0.0);
    machine.select_modes(0.0, &mut state, &[], true);
    let mut jacobian = vec![0.0; states * states];
    machine.find_jacobian(0.0, &state, &mut jacobian);
    let mut rates = |state: &[f64]| {
        let mut out = vec![0.0; size];
        machine.derivative(0.0, state, &mut out);
        out
    };
    let mut worst = 0.0f64;
    for column in 0..states {
        let mut slope = |step: f64| -> Vec<f64> {
            let mut shifted = state.clone();
            shifted[column] = state[column] + step;
            let plus = rates(&shifted);
            shifted[column] = state[column] - step;
            plus.iter().zip(rates(&shifted)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
        };
        // Extrapolated: errors of the fourth order.
        let (wide, narrow) = (slope(2e-3), slope(1e-3));
        let sizes = slope(1e-3);
        let largest = sizes[..states].iter().fold(0.0f64, |most, x| most.max(x.abs())).max(1.0);
        for row in 0..states {
            let found = (4.0 * narrow[row] - wide[row]) / 3.0;
            worst = worst.max((jacobian[row * states + column] - found).abs() / largest);
        }
    }
    Some(worst)
}

#[test]
fn the_jacobian_is_that_of_the_rates() {
    let mut found = 0;
    for model in kardan::model::BUILTIN {
        let variants = variants(model.source);
        for (variant, seed) in variants.iter().take(4).flat_map(|variant| [(variant, 3), (variant, 7)]) {
            let Some(error) = jacobian_error(variant, seed) else { continue };
            assert!(error < 1e-7, "{} {}: {error:e}", model.name, variant.name);
            found += 1;
        }
    }
    for seed in 0..60 {
        let source = random_model(seed);
        let error = jacobian_error(&first(&source), seed).unwrap();
        assert!(error < 1e-7, "{seed}: {error:e}\n{source}");
    }
    assert!(found > 20, "{found}");
}

fn worst(one: &Run, other: &Run) -> f64 {
    let kinds = [Physical::Angle, Physical::Speed, Physical::Charge, Physical::Current];
    kinds.into_iter().map(|physical| difference(one, other, physical)).fold(0.0, f64::max)
}

/// Within ten times the tolerance of the reference on every model that comes with kardan.
#[test]
fn stiff_runs_of_all_models_are_those_of_the_reference() {
    let mut found = 0;
    for model in kardan::model::BUILTIN {
        // Sampled loops amplify rounding; they have a test of their own.
        if model.source.contains("\nsample_time = ") {
            continue;
        }
        let reference = runs(model.source, Method::Dop853, 1e-11, &[]);
        let stiff = runs(model.source, Method::Radau, 1e-7, &[]);
        for (one, other) in reference.iter().zip(&stiff) {
            assert_eq!(other.outcome, one.outcome, "{} {}", model.name, one.name);
            if other.effort.method == IntegrationMethod::Radau {
                let worst = worst(one, other);
                assert!(worst < 1e-6, "{} {}: {worst:e}", model.name, one.name);
                found += 1;
            }
        }
    }
    assert!(found >= 10, "{found}");
}

fn method(source: &str, variants: &[&str], method: Method) -> Vec<IntegrationMethod> {
    runs(source, method, 1e-7, variants).iter().map(|run| run.effort.method).collect()
}

/// By itself the method is chosen where what decays at once would cost steps, exponentials where nothing bends; and what ran is told.
#[test]
fn the_method_is_chosen_for_the_model() {
    let stiff = |friction: &str| {
        format!(
            "[model]\nname = \"stiff\"\n[shaft.a]\ninertia = \"0.01 kg m^2\"\n{friction}[shaft.b]\ninertia = \"0.02 kg m^2\"\n\
             [spring_damper.c]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1000 N m/rad\"\ndamping = \"1000 N m s/rad\"\n\
             [disturbance.T]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n\
             [[scenario.event]]\nat = \"0.1 s\"\nsignal = \"T\"\nto = \"1 N m\"\n"
        )
    };
    let (rough, smooth) = (stiff("friction = \"0.1 N m\"\n"), stiff(""));
    use IntegrationMethod::{Dop853, Exponential, Radau, Taylor};
    for (source, variants, requested, ran) in [
        (rough.as_str(), &[][..], Method::Automatic, Radau),
        (&rough, &[], Method::Taylor, Taylor),
        (&smooth, &[], Method::Automatic, Exponential),
        (&smooth, &[], Method::Stepping, Radau),
        (builtin("sia-steering"), &["beta-30deg"], Method::Automatic, Taylor),
        (builtin("two-bodies"), &[], Method::Stepping, Taylor),
        // Its law computes by itself.
        (builtin("sia-joint-angle"), &["nonlinear-10deg"], Method::Radau, Dop853),
    ] {
        let found = method(source, variants, requested);
        assert!(!found.is_empty() && found.iter().all(|method| *method == ran), "{requested:?}: {found:?}\n{source}");
    }
}

/// The same for random models.
#[test]
fn stiff_runs_of_random_models_are_those_of_the_reference() {
    let mut steps = [0, 0];
    for seed in 0..200 {
        let source = random_model(seed);
        let one = runs(&source, Method::Dop853, 1e-11, &[]).remove(0);
        let other = runs(&source, Method::Radau, 1e-7, &[]).remove(0);
        assert_eq!((&one.outcome, &other.outcome), (&Outcome::Completed, &Outcome::Completed), "{seed}\n{source}");
        let worst = worst(&one, &other);
        assert!(worst < 1e-6, "{seed}: {worst:e}\n{source}");
        let named = |run: &Run| run.events.iter().map(|event| event.description.clone()).collect::<Vec<_>>();
        assert_eq!(named(&one), named(&other), "{seed}\n{source}");
        steps[0] += one.effort.steps;
        steps[1] += other.effort.steps;
    }
    println!("{steps:?}");
}

/// Loops with a clock, delays and quantised sensors too.
#[test]
fn stiff_runs_of_sampled_loops() {
    let [one, other] = [Method::Dop853, Method::Radau]
        .map(|method| runs(builtin("sia-steering-ecu"), method, 1e-9, &["rack-30deg"]).remove(0));
    assert_eq!(other.outcome, Outcome::Completed);
    let worst = difference(&one, &other, Physical::Angle);
    assert!(worst < 1e-6, "{worst:e}");
}

/// A motion that decays within a microsecond costs the reference steps in proportion, and this method none.
#[test]
fn steps_do_not_depend_on_what_decays_at_once() {
    let source = |damping: &str| {
        format!(
            "[model]\nname = \"stiff\"\n[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.02 kg m^2\"\nfriction = \"0.1 N m\"\n\
             [spring_damper.c]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1000 N m/rad\"\ndamping = \"{damping} N m s/rad\"\n\
             [motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n\
             [[scenario.event]]\nat = \"0.1 s\"\nsignal = \"m.tau\"\nto = \"0.5 N m\"\n"
        )
    };
    let run = |damping: &str| {
        let run = runs(&source(damping), Method::Radau, 1e-8, &[]).remove(0);
        assert_eq!(run.outcome, Outcome::Completed);
        run
    };
    let (soft, stiff) = (run("10"), run("100000"));
    assert!(stiff.effort.steps < 2 * soft.effort.steps, "{:?} {:?}", soft.effort, stiff.effort);
    let residual = stiff.energy.residual.abs();
    assert!(residual < 1e-7 * stiff.energy.input, "{:?}", stiff.energy);
}

/// Shafts behind springs, every fifth one behind a bent joint, with friction on every seventh.
fn long_chain(shafts: usize, stiffness: f64, damping: f64) -> String {
    let mut text = String::from("[model]\nname = \"chain\"\n");
    for k in 0..shafts {
        let friction = if k % 7 == 3 { "friction = \"0.02 N m\"\n" } else { "" };
        write!(text, "[shaft.s{k}]\ninertia = \"0.001 kg m^2\"\ndamping = \"0.002 N m s/rad\"\n{friction}").unwrap();
    }
    for k in 1..shafts {
        let mut from = format!("s{}", k - 1);
        if k % 5 == 0 {
            let joint = format!("shaft_1 = \"{from}\"\nshaft_2 = \"j{k}\"\nangle = \"20 deg\"\n");
            write!(text, "[shaft.j{k}]\n[universal_joint.u{k}]\n{joint}").unwrap();
            from = format!("j{k}");
        }
        let ends = format!("shaft_1 = \"{from}\"\nshaft_2 = \"s{k}\"\n");
        let law = format!("stiffness = \"{stiffness} N m/rad\"\ndamping = \"{damping} N m s/rad\"\n");
        write!(text, "[spring_damper.c{k}]\n{ends}{law}").unwrap();
    }
    text + "[motor.m]\nshaft = \"s0\"\n[scenario]\nduration = \"0.4 s\"\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"m.tau\"\nto = \"1 N m\"\n"
}

/// Many states: the same motion as the reference's, and the method is chosen from the fastest motions alone.
#[test]
fn stiff_runs_of_long_chains_are_those_of_the_reference() {
    let (stiff, soft) = (long_chain(60, 1e4, 100.0), long_chain(60, 100.0, 0.01));
    let one = runs(&stiff, Method::Taylor, 1e-10, &[]).remove(0);
    let other = runs(&stiff, Method::Radau, 1e-7, &[]).remove(0);
    assert_eq!((&one.outcome, &other.outcome), (&Outcome::Completed, &Outcome::Completed));
    assert_eq!((one.effort.method, other.effort.method), (IntegrationMethod::Taylor, IntegrationMethod::Radau));
    let worst = worst(&one, &other);
    assert!(worst < 1e-6, "{worst:e}");
    assert!(20 * other.effort.steps < one.effort.steps, "{} {}", other.effort.steps, one.effort.steps);
    assert_eq!(method(&stiff, &[], Method::Automatic), [IntegrationMethod::Radau]);
    assert_eq!(method(&soft, &[], Method::Automatic), [IntegrationMethod::Taylor]);
}

/// Two wheels of 1 kg m² with 1e-6 kg m² between them are braked by `−10 tanh(w/0.05)` N m, which is written with an exponential whose derivative overflows at
/// 100 rad/s, `exp(4000)`, where the torque does not: 10 N m take 100 of 200 N m s in 10 s, and all in 20 s, however the law is written.
#[test]
fn a_jacobian_that_is_not_finite_does_not_stand_still() {
    let source = |law: &str| {
        format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-6 kg m^2\"\n[shaft.c]\ninertia = \"1 kg m^2\"\n\
             [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"1e3 N m/rad\"\ndamping = \"100 N m s/rad\"\n\
             [spring_damper.s2]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nstiffness = \"1e3 N m/rad\"\ndamping = \"100 N m s/rad\"\n\
             [torque.ta]\nshaft = \"a\"\nlaw = \"{law}\"\n[scenario]\nduration = \"20 s\"\noutput_step = \"10 ms\"\n\
             initial = {{ \"a.w\" = \"100 rad/s\", \"b.w\" = \"100 rad/s\", \"c.w\" = \"100 rad/s\" }}\n"
        )
    };
    let laws = [
        "-10 N m * (1 - 2/(exp(2 * a.w/(0.05 rad/s)) + 1))",
        "-10 N m * (2/(exp(-2 * a.w/(0.05 rad/s)) + 1) - 1)",
        "-10 N m * (1 - 2/(exp(min(2 * a.w/(0.05 rad/s), 600)) + 1))",
    ];
    let all = laws.map(|law| {
        let run = run_by(&source(law), Method::Radau, Some(1e-10));
        assert_eq!(run.outcome, Outcome::Completed, "{law}");
        let momentum = 2.0 * (100.0 - 5.0 * 10.0);
        let at = |name: &str| at(&run, name, 10.0);
        assert!((at("a.w") + at("c.w") + 1e-6 * at("b.w") - momentum).abs() < 1e-3, "{law}: {}", at("a.w"));
        assert!(signal(&run, "a.w").last().unwrap().abs() < 0.1, "{law}");
        assert!(run.energy.residual.abs() < 1e-5, "{law}: {:?}", run.energy);
        run
    });
    for run in &all {
        let speed = |run: &Run| *signal(run, "a.w").last().unwrap();
        assert!((speed(run) - speed(&all[2])).abs() < 1e-6, "{} {}", speed(run), speed(&all[2]));
    }
}
