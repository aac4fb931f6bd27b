//! Friction, stops, clutches and locks beside constraints that are kept with their multipliers, and along what is prescribed: closed forms.

use std::f64::consts::PI;

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, EquationsForm, Project, Silent};

use crate::common::{at, run_by, runs_only, signal, time_of};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method) -> Run {
    let run = run_by(source, method, Some(1e-11));
    let energy = &run.energy;
    let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated);
    assert!(energy.residual.abs() <= 1e-9 * size, "{method:?}: {energy:?}");
    run
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value} instead of {expected}");
}

/// Where a function vanishes that has different signs at the two ends.
fn zero(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) * f(low) > 0.0 { low = middle } else { high = middle }
    }
    low
}

/// A block on a belt that moves as prescribed, by its position or by its speed: it slips with 3 m/s² until it has the speed of the belt and
/// then stays with it, as that never asks for more.
#[test]
fn a_block_comes_to_rest_on_a_moving_belt() {
    let omega = 2.0 * PI;
    let sticks = zero(|t| 3.0 * t - 0.05 * omega * (omega * t).cos(), 0.0, 0.25);
    let dissipated = 3.0 * (0.05 * (omega * sticks).sin() - 1.5 * sticks * sticks);
    for moves in ["position = \"50 mm * sin(2 pi t / 1 s)\"", "speed = \"50 mm * 2 pi / 1 s * cos(2 pi t / 1 s)\""] {
        let source = format!(
            "[mass.block]\nmass = \"1 kg\"\n[mass.belt]\nmass = \"2 kg\"\n[prescribed_motion.drive]\nmass = \"belt\"\n{moves}\n\
             [spring_damper.rub]\nmass_1 = \"block\"\nmass_2 = \"belt\"\nfriction = \"3 N\"\n\
             [scenario]\nduration = \"2 s\"\noutput_step = \"1 ms\"\n"
        );
        for method in METHODS {
            let (run, what) = (by(&source, method), format!("{method:?} {moves}"));
            near(time_of(&run, "rub sticks"), sticks, 1e-9, &what);
            near(run.energy.dissipated, dissipated, 1e-9, &what);
            for t in [0.5, 1.2, 2.0] {
                near(at(&run, "block.v", t), 0.05 * omega * (omega * t).cos(), 1e-9, &what);
                // The drive then moves both, before the belt against the friction.
                near(at(&run, "drive.f", t), -3.0 * 0.05 * omega * omega * (omega * t).sin(), 1e-8, &what);
            }
            near(at(&run, "drive.f", 0.05), 3.0 - 2.0 * 0.05 * omega * omega * (omega * 0.05).sin(), 1e-8, &what);
        }
    }
}

/// A shaft whose speed is prescribed takes its friction with it: the drive pays for it either way, and not while it stands.
#[test]
fn the_drive_pays_for_the_friction_of_what_it_moves() {
    for moves in ["angle = \"0.5 rad * sin(2 pi t / 1 s)\"", "speed = \"pi * 1 rad/s * cos(2 pi t / 1 s)\""] {
        let source = format!(
            "[shaft.p]\ninertia = \"2 kg m^2\"\nfriction = \"0.3 N m\"\n[prescribed_motion.drive]\nshaft = \"p\"\n{moves}\n\
             [shaft.q]\ninertia = \"1 kg m^2\"\n[spring_damper.s]\nshaft_1 = \"p\"\nshaft_2 = \"q\"\ndamping = \"0.1 N m s/rad\"\n\
             [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n"
        );
        for method in METHODS {
            let run = by(&source, method);
            for t in [0.1, 0.4, 0.6, 0.9] {
                let [rate, acceleration] = [PI * (2.0 * PI * t).cos(), -2.0 * PI * PI * (2.0 * PI * t).sin()];
                let damper = 0.1 * (rate - at(&run, "q.w", t));
                let expected = 2.0 * acceleration + 0.3 * rate.signum() + damper;
                near(at(&run, "drive.tau", t), expected, 1e-8, &format!("{method:?} {moves} {t}"));
            }
        }
    }
}

/// A ball between walls that move: it leaves each with `v_w − e (v − v_w)`, and what the drive gives in the blow counts.
#[test]
fn an_impact_with_a_moving_wall_exchanges_energy() {
    let source = "[mass.ball]\nmass = \"1 kg\"\n[mass.wall]\nmass = \"3 kg\"\n[prescribed_motion.drive]\nmass = \"wall\"\n\
                  MOVES\n[end_stop.hit]\nmass_1 = \"ball\"\nmass_2 = \"wall\"\nupper = \"100 mm\"\nrestitution = 0.5\n\
                  [scenario]\nduration = \"0.6 s\"\noutput_step = \"1 ms\"\ninitial = { \"ball.v\" = \"0.3 m/s\" }\n";
    let wall = |t: f64| 0.05 * (2.0 * PI * t).sin();
    let hits = zero(|t| 0.3 * t - wall(t) - 0.1, 0.3, 0.6);
    let speed = 0.1 * PI * (2.0 * PI * hits).cos();
    let after = speed - 0.5 * (0.3 - speed);
    for moves in ["position = \"50 mm * sin(2 pi t / 1 s)\"", "speed = \"50 mm * 2 pi / 1 s * cos(2 pi t / 1 s)\""] {
        let source = source.replace("MOVES", moves);
        for method in METHODS {
            let (run, what) = (by(&source, method), format!("{method:?} {moves}"));
            let hit = run.events.iter().find(|event| event.description.starts_with("hit meets")).expect("a blow");
            near(hit.time, hits, 1e-9, &what);
            near(at(&run, "ball.v", 0.5), after, 1e-8, &what);
            near(run.energy.dissipated, 0.5 * 0.75 * (0.3 - speed) * (0.3 - speed), 1e-8, &what);
        }
    }
}

/// A unicycle that rolls out on a curve: its speed along the path does not depend on how it turns, and what rests rests to the last bit.
#[test]
fn a_unicycle_rolls_out_and_rests() {
    let source = "[mass.x]\nmass = \"4 kg\"\n[mass.y]\nmass = \"4 kg\"\n[shaft.roll]\ninertia = \"0.01 kg m^2\"\nfriction = \"0.1 N m\"\n\
                  [shaft.heading]\ninertia = \"0.02 kg m^2\"\nfriction = \"0.02 N m\"\n\
                  [constraint.rolls_x]\nrates = { x = 1, roll = \"-0.1 m * cos(heading.phi)\" }\n\
                  [constraint.rolls_y]\nrates = { y = 1, roll = \"-0.1 m * sin(heading.phi)\" }\n\
                  [scenario]\nduration = \"10 h\"\noutput_step = \"10 s\"\n\
                  initial = { \"roll.w\" = \"8 rad/s\", \"heading.w\" = \"3 rad/s\", \"x.v\" = \"0.8 m/s\" }\n";
    // 0.05 kg m² seen by the wheel.
    let (stop_time, straight) = (8.0 * 0.05 / 0.1, 3.0);
    // Simpson's rule over the path: heading 3 t − t²/2 until 3 s, then it stays.
    let heading = |t: f64| if t < straight { 3.0 * t - 0.5 * t * t } else { 4.5 };
    let path = |direction: fn(f64) -> f64| -> f64 {
        let (count, f) = (4000, |t: f64| 0.1 * (8.0 - 2.0 * t) * direction(heading(t)));
        let step = stop_time / f64::from(count);
        let weight = |k: i32| if k == 0 || k == count { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
        (0..=count).map(|k| weight(k) * f(f64::from(k) * step)).sum::<f64>() * step / 3.0
    };
    for method in METHODS {
        let (run, what) = (by(source, method), format!("{method:?}"));
        near(time_of(&run, "roll sticks"), stop_time, 1e-8, &what);
        near(time_of(&run, "heading sticks"), straight, 1e-8, &what);
        near(at(&run, "x.s", 10.0), path(f64::cos), 1e-8, &what);
        near(at(&run, "y.s", 10.0), path(f64::sin), 1e-8, &what);
        near(run.energy.dissipated, 0.5 * (0.05 * 64.0 + 0.02 * 9.0), 1e-8, &what);
        for name in ["x.s", "y.s", "roll.phi", "heading.phi"] {
            let rows = signal(&run, name);
            assert!(rows[1..].iter().all(|angle| angle.to_bits() == rows[1].to_bits()), "{method:?}: {name} creeps");
        }
    }
}

/// A Scotch yoke with a stop for its slide: `(J + m r² cos² φ) φ̇²` is kept between the blows, and each turns the crank back with e times its speed.
/// Friction of the slide changes its sense at the dead centre while the crank turns on.
#[test]
fn a_yoke_knocks_and_passes_its_dead_centre() {
    let source = "[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[mass.slide]\nmass = \"3 kg\"\nMORE\
                  [constraint.yoke]\nexpression = \"slide.s - 0.1 m * sin(crank.phi)\"\n\
                  [scenario]\nduration = \"0.4 s\"\noutput_step = \"1 ms\"\ninitial = { \"crank.w\" = \"5 rad/s\", \"slide.v\" = \"0.5 m/s\" }\n";
    let inertia = |angle: f64| 0.02 + 0.03 * angle.cos() * angle.cos();
    let stop = f64::asin(0.5);
    let knocks = source.replace("MORE", "[end_stop.stop]\nshaft_1 = \"slide\"\nupper = \"50 mm\"\nrestitution = 0.6\n");
    let passes = source.replace("MORE", "friction = \"1 N\"\n");
    for method in METHODS {
        let (run, what) = (by(&knocks, method), format!("{method:?}"));
        let energy = 0.5 * inertia(0.0) * 25.0;
        near(run.energy.dissipated, (1.0 - 0.36) * energy, 1e-9, &what);
        // Where the crank comes back through the middle it has 0.6 of its speed.
        let back = signal(&run, "crank.phi").iter().zip(signal(&run, "crank.w")).rev().find(|(angle, _)| **angle > 0.0);
        let (angle, speed) = back.expect("it comes back");
        near(*speed, -(0.36 * 2.0 * energy / inertia(*angle)).sqrt(), 1e-8, &what);
        assert!(signal(&run, "crank.phi").iter().all(|angle| *angle <= stop + 1e-9), "{what}");
        // What the yoke carries is what moves the slide, until it touches: m s̈ with φ̇² = 2 E/(J + m r² cos² φ).
        let rows = ["crank.phi", "crank.w", "yoke.f"].map(|name| signal(&run, name));
        let until = rows[1].iter().position(|speed| *speed < 0.0).expect("it is turned back");
        assert!(until > 10, "{until}");
        for row in 0..until {
            let (angle, speed) = (rows[0][row], rows[1][row]);
            let acceleration = energy * 0.06 * angle.cos() * angle.sin() / inertia(angle).powi(2);
            near(rows[2][row], 0.3 * (angle.cos() * acceleration - angle.sin() * speed * speed), 1e-7, &what);
        }

        let run = by(&passes, method);
        let last = signal(&run, "crank.phi").last().copied().expect("rows");
        assert!(last > 0.5 * PI + 0.2, "{what}: the crank came to {last}");
        // The friction has taken 1 N over the way of the slide, out and back.
        let way = 0.2 - 0.1 * last.sin();
        near(run.energy.dissipated, way, 1e-8, &what);
        let speed = signal(&run, "crank.w").last().copied().expect("rows");
        near(0.5 * inertia(last) * speed * speed, energy - way, 1e-8, &what);
    }
}

/// What is driven into a rigid stop by a lock to a prescribed motion cannot go on: the run ends there, names the three, and keeps what was before.
#[test]
fn what_cannot_both_hold_is_named() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.p]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"p\"\nspeed = \"1 rad/s\"\n\
                  [lock.joined]\nshaft_1 = \"a\"\nshaft_2 = \"p\"\nengaged = \"1\"\n[end_stop.wall]\nshaft_1 = \"a\"\nupper = \"0.5 rad\"\n\
                  [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = { \"a.w\" = \"1 rad/s\" }\n";
    let reported =
        study::run(source, &runs_only(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}")).runs.remove(0);
    let Outcome::Failed { time, cause } = &reported.outcome else { panic!("{:?}", reported.outcome) };
    assert!(
        (time - 0.5).abs() < 1e-9 && cause.contains("`drive`, `joined`, `wall` constrain one motion rigidly"),
        "{cause}"
    );
    assert_eq!(reported.series.time.len(), 51);
    assert!(reported.energy.residual.abs() < 1e-9, "{:?}", reported.energy);
}

/// Kept rows stand in the written equations with their multipliers, at every position, and in the plan with what their coefficients change by.
#[test]
fn equations_have_the_multipliers_of_their_constraints() {
    let source = "[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[mass.slide]\nmass = \"3 kg\"\nfriction = \"1 N\"\n\
                  [constraint.yoke]\nexpression = \"slide.s - 0.5 m * sin(crank.phi)\"\n\
                  [shaft.p]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"p\"\nspeed = \"1 rad/s * sin(3 rad/s * t)\"\n\
                  [spring_damper.s]\nshaft_1 = \"p\"\nshaft_2 = \"crank\"\nstiffness = \"3 N m/rad\"\n[scenario]\nduration = \"1 s\"\n";
    let rendered =
        |form: EquationsForm| Project::open(source).equations(form).unwrap_or_else(|reported| panic!("{reported:?}")).0;
    let text = rendered(EquationsForm::Text);
    for line in [
        "  0.02 crank'' + 3 crank - 3 p = -1/2*cos(crank) yoke.f\n",
        "  p'' - 3 crank + 3 p = drive.tau\n",
        "  3 slide'' + sgn(slide') = yoke.f\n",
        "  drive: p' = sin(3*t)\n",
        "  yoke: slide - 1/2*sin(crank) = 0\n",
    ] {
        assert!(text.contains(line), "{line}{text}");
    }
    let latex = rendered(EquationsForm::Latex);
    assert!(latex.contains(r"&= -\frac{1}{2}\cos(\varphi_{\mathrm{crank}}) f_{\mathrm{yoke}} \\"), "{latex}");
    // Half of sin φ, times the square of the speed, is what the row of accelerations has besides.
    let plan = kardan::plan::parse(&rendered(EquationsForm::Plan)).expect("a plan");
    let mut workspace = plan.memory();
    let values = [("crank.phi", 0.7), ("crank.w", 3.0)];
    for (k, name) in plan.inputs.iter().enumerate() {
        workspace[k] = values.iter().find(|(other, _)| other == name).map_or(0.0, |(_, value)| *value);
    }
    assert!(plan.block().evaluate(&mut workspace));
    let found = |name: &str| {
        let k = plan.outputs.iter().position(|output| output == name).unwrap_or_else(|| panic!("no {name}"));
        workspace[plan.place(k)]
    };
    near(found("kept[yoke,crank]"), -0.5 * f64::cos(0.7), 1e-15, "row");
    near(found("kept[yoke]"), 0.5 * f64::sin(0.7) * 9.0, 1e-15, "bias");
}

/// A wheel that heads along x carries nothing aside, so a friction aside rests there though the wheel rolls; as it turns, it slips, and takes its
/// force times the way. The same for a slide at its dead centre, from which a crank sets out.
#[test]
fn constraints_rotate_away_from_the_forces_that_they_carried() {
    let wheel = "[mass.x]\nmass = \"1 kg\"\n[mass.y]\nmass = \"1 kg\"\nfriction = \"1 N\"\n[shaft.h]\ninertia = \"0.1 kg m^2\"\n[motor.m]\nshaft = \"h\"\n\
                 [constraint.rolls]\nrates = { x = \"-sin(h.phi)\", y = \"cos(h.phi)\" }\n\
                 [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = { \"x.v\" = \"1 m/s\" }\n\
                 [[scenario.event]]\nat = \"0 s\"\nsignal = \"m.tau\"\nto = \"0.3 N m\"\n";
    let crank = "[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[mass.slide]\nmass = \"3 kg\"\nfriction = \"1 N\"\n[motor.m]\nshaft = \"crank\"\n\
                 [constraint.yoke]\nexpression = \"slide.s - 0.1 m * cos(crank.phi)\"\n\
                 [scenario]\nduration = \"0.3 s\"\noutput_step = \"10 ms\"\ninitial = { \"slide.s\" = \"0.1 m\" }\n\
                 [[scenario.event]]\nat = \"0 s\"\nsignal = \"m.tau\"\nto = \"0.3 N m\"\n";
    for method in METHODS {
        let (run, what) = (by(wheel, method), format!("{method:?}"));
        let last = |name: &str| *signal(&run, name).last().expect("rows");
        near(last("h.phi"), 1.5, 1e-9, &what);
        near(last("y.v"), last("x.v") * f64::tan(1.5), 1e-9, &what);
        near(run.energy.dissipated, last("y.s"), 1e-9, &what);
        assert!(last("y.s") > 0.3, "{what}");

        let run = by(crank, method);
        let last = |name: &str| *signal(&run, name).last().expect("rows");
        assert!((0.5..PI).contains(&last("crank.phi")), "{what}: {}", last("crank.phi"));
        near(last("slide.s"), 0.1 * last("crank.phi").cos(), 1e-10, &what);
        near(run.energy.dissipated, 0.1 - last("slide.s"), 1e-9, &what);
    }
}
