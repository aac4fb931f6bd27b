//! What no state feels until it happens: loads on bodies at rest, gaps to what is moved, laws that jump or bend. All methods, against closed forms.

use std::f64::consts::PI;

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;

use crate::common::{run_by, signal};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method) -> Run {
    let run = run_by(source, method, Some(1e-10));
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

fn ends(run: &Run, name: &str, expected: f64, tolerance: f64, what: &str) {
    let last = *signal(run, name).last().expect("rows");
    assert!((last - expected).abs() <= tolerance, "{what}: {name} ends at {last} instead of {expected}");
}

/// Where a function becomes positive first behind a time, by steps of 1e-4 s and halving.
fn first_positive(from: f64, f: impl Fn(f64) -> f64) -> f64 {
    let mut low = from;
    while f(low + 1e-4) <= 0.0 {
        low += 1e-4;
    }
    let mut high = low + 1e-4;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { high = middle } else { low = middle }
    }
    high
}

/// A mass of 1 kg under A sin ωt with friction c sticks until the force reaches c, and slips with `v = (A/ω)(cos ωt₀ − cos ωt) ∓ c (t − t₀)` until
/// it stands, where the force is less than c or drives it back.
#[test]
fn a_load_at_rest_is_felt() {
    for (hertz, duration) in [(10.0, 1.0), (1.0, 7.3)] {
        let source = format!(
            "[mass.b]\nmass = \"1 kg\"\nfriction = \"3 N\"\n[disturbance.e]\nmass = \"b\"\n[scenario]\nduration = \"{duration} s\"\n\
             signals = {{ e = \"12 N * sin(2 pi t * {hertz} Hz)\" }}\n"
        );
        let (omega, a, c) = (2.0 * PI * hertz, 12.0, 3.0);
        let (mut t, mut x) = (0.0, 0.0);
        let v = loop {
            t = if a * f64::abs(f64::sin(omega * t)) > c * (1.0 + 1e-12) {
                t
            } else {
                first_positive(t, |t| a * (omega * t).sin().abs() - c)
            };
            if t >= duration {
                break 0.0;
            }
            let sign = (omega * (t + 1e-7)).sin().signum();
            let v = |later: f64| sign * a / omega * ((omega * t).cos() - (omega * later).cos()) - c * (later - t);
            let stop_time = first_positive(t + 1e-6, |later| -v(later));
            let end = stop_time.min(duration);
            let wave = (omega * t).cos() * (end - t) - ((omega * end).sin() - (omega * t).sin()) / omega;
            x += sign * (sign * a / omega * wave - 0.5 * c * (end - t) * (end - t));
            if stop_time >= duration {
                break sign * v(duration);
            }
            t = stop_time;
        };
        for method in METHODS {
            let run = by(&source, method);
            ends(&run, "b.s", x, 1e-8, &format!("{method:?} at {hertz} Hz"));
            ends(&run, "b.v", v, 1e-7, &format!("{method:?} at {hertz} Hz"));
        }
    }
}

/// A free mass between two walls that swing: it coasts from blow to blow, each with half the relative speed.
#[test]
fn what_coasts_meets_what_is_moved() {
    let source = "[mass.box]\n[mass.b]\nmass = \"1 kg\"\n[prescribed_motion.p]\nmass = \"box\"\nposition = \"10 mm * sin(2 pi t / 0.5 s)\"\n\
         [end_stop.e]\nmass_1 = \"b\"\nmass_2 = \"box\"\nlower = \"-5 mm\"\nupper = \"5 mm\"\nrestitution = 0.5\n\
         [scenario]\nduration = \"1.1 s\"\n";
    let wall = |t: f64| 0.01 * (4.0 * PI * t).sin();
    let speed = |t: f64| 0.04 * PI * (4.0 * PI * t).cos();
    let (mut t, mut x, mut v) = (0.0, 0.0, 0.0);
    loop {
        let hit = first_positive(t + 1e-9, |later| (x + v * (later - t) - wall(later)).abs() - 0.005);
        if hit >= 1.1 {
            break;
        }
        x += v * (hit - t);
        v = speed(hit) - 0.5 * (v - speed(hit));
        t = hit;
    }
    for method in METHODS {
        let run = by(source, method);
        ends(&run, "b.s", x + v * (1.1 - t), 1e-9, &format!("{method:?}"));
        ends(&run, "b.v", v, 1e-8, &format!("{method:?}"));
    }
}

/// Two equal shafts, one of which turns with 20 rad/s: a lock that sin(φ)⁸ > 1/2 engages first joins them at asin 2^(−1/8), both at 10 rad/s.
#[test]
fn a_lock_engages_where_its_signal_says() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n[lock.l]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
         engaged = \"sin(a.phi)^8\"\n[scenario]\nduration = \"3 s\"\ninitial = { \"a.w\" = \"20 rad/s\" }\n";
    let angle = 0.5_f64.powf(0.125).asin();
    for method in METHODS {
        let run = by(source, method);
        ends(&run, "a.phi", angle + 10.0 * (3.0 - angle / 20.0), 1e-8, &format!("{method:?}"));
        ends(&run, "b.w", 10.0, 1e-10, &format!("{method:?}"));
    }
}

fn torque(law: &str, more: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"1 kg m^2\"\n[torque.l]\nshaft = \"a\"\nlaw = \"{law}\"\n{more}[scenario]\nduration = \"3 s\"\n"
    )
}

/// Pulses of torque, by conditions, tables and waves of the time: each gives its integral, wherever steps would have ended.
#[test]
fn pulses_of_the_time_are_not_passed() {
    let table = "[table.p]\npoints = { x = [\"0 s\", \"1 s\", \"1.005 s\", \"1.01 s\", \"3 s\"], \
                 value = [\"0 N m\", \"0 N m\", \"10 N m\", \"0 N m\", \"0 N m\"] }\n";
    let wide = (PI - 2.0 * 0.95_f64.asin()) / (2.0 * PI) * 0.2;
    let cases = [
        (torque("if(t > 1 s, if(t < 1.01 s, 5 N m, 0 N m), 0 N m)", ""), 0.05),
        (torque("p(t)", table), 0.05),
        (torque("if(sin(2 pi t / 0.2 s) > 0.95, 5 N m, 0 N m)", ""), 75.0 * wide),
        (torque("max(0 N m, 1 N m - abs(t - 2.3 s) * 1000 N m/s)", ""), 1e-3),
    ];
    for (source, speed) in cases {
        for method in METHODS {
            ends(&by(&source, method), "a.w", speed, 1e-8, &format!("{method:?}: {source}"));
        }
    }
}

/// The work of a torque over the angle is that of the angles passed, however fast: `w² = w₀² + 2 ∫ τ dφ`.
#[test]
fn peaks_over_the_angle_are_not_passed() {
    let peak = "[table.p]\npoints = { x = [\"0 rad\", \"10 rad\", \"10.05 rad\", \"10.1 rad\", \"30 rad\"], \
                value = [\"0 N m\", \"0 N m\", \"100 N m\", \"0 N m\", \"0 N m\"] }\n";
    let start = "initial = { \"a.w\" = \"7 rad/s\" }\n";
    let from = "initial = { \"a.w\" = \"20 rad/s\" }\n";
    let wave = "max(0 N m, 5 N m * (sin(a.phi) - 0.95))";
    // Of each turn: 5 (2 cos asin 0.95 − 0.95 (π − 2 asin 0.95)) J; of 60 rad, ten peaks, the last one at 58.1 rad.
    let half = 0.95_f64.asin();
    let revolution_work = 5.0 * (2.0 * half.cos() - 0.95 * (PI - 2.0 * half));
    let cases = [
        (torque("p(a.phi)", peak) + start, (49.0_f64 + 2.0 * 5.0).sqrt()),
        (torque("if(abs(a.phi - 12 rad) < 0.01 rad, 100 N m, 0 N m)", "") + start, (49.0_f64 + 4.0).sqrt()),
        (torque(wave, "") + from, (400.0 + 20.0 * revolution_work).sqrt()),
    ];
    for (source, speed) in cases {
        for method in METHODS {
            ends(&by(&source, method), "a.w", speed, 1e-7, &format!("{method:?}: {source}"));
        }
    }
}

/// A torque that jumps where the motion begins, into which it goes at once, comes back after 1 s and is there again after 3 s.
#[test]
fn a_jump_where_the_motion_begins() {
    for law in ["if(a.phi < 0 rad, 2 N m, -1 N m)", "if(a.phi >= 0 rad, -1 N m, 2 N m)"] {
        let source = torque(law, "") + "initial = { \"a.w\" = \"-1 rad/s\" }\n";
        for method in METHODS {
            let run = by(&source, method);
            ends(&run, "a.w", -1.0, 1e-8, &format!("{method:?}: {law}"));
            ends(&run, "a.phi", 0.0, 1e-8, &format!("{method:?}: {law}"));
        }
    }
}

/// Both sides of a bend have the same value: a spring by its angle's size, `w = w₀ cos t`, and a torque of 1 N m with a damping by `w |w|`, both
/// from where they bend: `w = tanh t`.
#[test]
fn non_smooth_points_at_the_start() {
    let spring = torque("-1 N m * max(a.phi / (1 rad), -a.phi / (1 rad)) * if(a.phi > 0 rad, 1, -1)", "");
    let drag = torque("1 N m - 1 N m s^2 * a.w * abs(a.w)", "");
    for method in METHODS {
        let run = by(&(spring.clone() + "initial = { \"a.w\" = \"-1 rad/s\" }\n"), method);
        ends(&run, "a.w", -(3.0_f64.cos()), 1e-8, &format!("{method:?}"));
        ends(&by(&drag, method), "a.w", 3.0_f64.tanh(), 1e-8, &format!("{method:?}"));
    }
}

/// A body at rest where its torque jumps, at 1 rad: it goes where the torque of that place drives it, `φ = 1 - t²/2`, and then with twice as much.
/// Series know that instant, but for the 1e-8 s in which the angle does not move by a bit.
#[test]
fn a_jump_at_rest_away_from_zero() {
    let source = torque("if(a.phi < 1 rad, -2 N m, -1 N m)", "") + "initial = { \"a.phi\" = \"1 rad\" }\n";
    for method in [Method::Taylor, Method::Automatic] {
        let run = by(&source, method);
        ends(&run, "a.w", -6.0, 1e-7, &format!("{method:?}"));
        assert!(run.effort.steps < 1000, "{method:?}: {:?}", run.effort);
    }
}

/// Pulses by a condition that is no polynomial, of a torque that is one: each turn gives 5 N m over the angle for which the sine is above 0.95.
#[test]
fn conditions_are_located_as_precisely_as_states() {
    let width = PI - 2.0 * 0.95_f64.asin();
    let source = torque("if(sin(a.phi) > 0.95, 5 N m, 0 N m)", "") + "initial = { \"a.w\" = \"20 rad/s\" }\n";
    for method in METHODS {
        let run = by(&source, method);
        let angle = signal(&run, "a.phi").last().expect("rows").to_owned();
        let peaks = ((angle - 0.95_f64.asin()) / (2.0 * PI)).ceil();
        ends(&run, "a.w", (400.0 + 10.0 * peaks * width).sqrt(), 1e-7, &format!("{method:?}"));
    }
}

/// Series of these conditions reach as far as their poles, or hardly so far: of a pulse over the angle, from afar, `w² = w₀² + 2·5·width`.
#[test]
fn conditions_whose_series_do_not_reach() {
    let cases = [("1 / (1 + x^2)", 2.0), ("exp(-x^2)", 2.0 * 2.0_f64.ln().sqrt()), ("1 / (1 + x^4)", 2.0)];
    for (condition, width) in cases {
        let condition = condition.replace('x', "(a.phi / (1 rad))").replace("e(a.phi / (1 rad))p", "exp");
        for start in ["-10 rad", "-6 rad", "-3.3 rad"] {
            let law = torque(&format!("if({condition} > 0.5, 5 N m, 0 N m)"), "");
            let source = law + &format!("initial = {{ \"a.phi\" = \"{start}\", \"a.w\" = \"20 rad/s\" }}\n");
            for method in [Method::Taylor, Method::Automatic] {
                let speed = (400.0 + 10.0 * width).sqrt();
                ends(&by(&source, method), "a.w", speed, 1e-8, &format!("{method:?}: {condition} from {start}"));
            }
        }
    }
}

/// A root of what is zero for a while has no series: `w² = w₀² + 4 φ^(3/2)`.
#[test]
fn motions_that_have_no_series_continue() {
    let law = torque("3 N m * sqrt(max(0, a.phi / (1 rad)))", "");
    let source = law + "initial = { \"a.phi\" = \"-1 rad\", \"a.w\" = \"1 rad/s\" }\n";
    for method in METHODS {
        let run = by(&source, method);
        let angle = signal(&run, "a.phi").last().expect("rows").to_owned();
        assert!(angle > 2.0, "{method:?}: {angle}");
        ends(&run, "a.w", (1.0 + 4.0 * angle.powf(1.5)).sqrt(), 1e-7, &format!("{method:?}"));
    }
}

/// A power of the time that is no whole one has no series where it begins: the angle is `4/35` and the speed `2/5` at one second, times powers of the end.
#[test]
fn a_fractional_power_of_time_has_no_series_at_the_start() {
    let source = torque("1 N m * (t / (1 s))^1.5", "");
    for method in METHODS {
        let run = by(&source, method);
        ends(&run, "a.w", 0.4 * 3.0_f64.powf(2.5), 1e-8, &format!("{method:?}"));
        ends(&run, "a.phi", 4.0 / 35.0 * 3.0_f64.powf(3.5), 1e-8, &format!("{method:?}"));
    }
}

/// A lock that joins two shafts while their speeds differ by less than 0.1 rad/s, which lasts 0.2 s: they pass through it together.
#[test]
fn a_short_engagement_is_not_passed() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n[lock.l]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
         engaged = \"if(abs(a.w - b.w) < 0.1 rad/s, 1, 0)\"\n[torque.t]\nshaft = \"a\"\nlaw = \"1 N m\"\n\
         [scenario]\nduration = \"10 s\"\ninitial = { \"b.w\" = \"3 rad/s\" }\n";
    for method in METHODS {
        ends(&by(source, method), "a.w", 8.9 / 3.0 + 7.1 / 3.0, 1e-8, &format!("{method:?}"));
    }
}
