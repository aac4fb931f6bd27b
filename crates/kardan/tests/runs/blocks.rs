//! Blocks of signals in runs: against those of `kardan-rt`, closed forms and exact recursions.

use kardan::diagnostics::Severity;
use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, Project, Settings, Silent};

use crate::common::{at, run, run_by};

/// A free shaft with the blocks of a text, and a signal `u` that steps and swings; rows at the samples of 10 ms.
fn beside(blocks: &str) -> String {
    format!(
        "[shaft.arm]\ninertia = \"1 kg m^2\"\n[signal.u]\nkind = \"expression\"\nvalue = \"1.5 * sin(7 t / 1 s) + gate\"\n\
         [signal.gate]\nkind = \"pulses\"\nhigh = 1\nperiod = \"0.31 s\"\nwidth = \"0.13 s\"\nstart = \"0.0501 s\"\n{blocks}\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n"
    )
}

/// Values of a column at the samples k h, of 10 ms.
fn samples(run: &Run, name: &str) -> Vec<f64> {
    (0..100).map(|k| at(run, name, f64::from(k) / 100.0)).collect()
}

/// Each block does in a run what that of `kardan-rt` does with the same samples.
#[test]
fn blocks_are_those_of_the_firmware() {
    let source = beside(
        "[block.held]\nkind = \"hold\"\ninput = \"u\"\nsample_time = \"10 ms\"\n\
         [block.saturated]\nkind = \"saturation\"\ninput = \"held\"\nlow = -0.4\nhigh = 0.9\nsample_time = \"10 ms\"\n\
         [block.dead]\nkind = \"dead_zone\"\ninput = \"held\"\nhigh = 0.5\nsample_time = \"10 ms\"\n\
         [block.switch]\nkind = \"hysteresis\"\ninput = \"held\"\nupper = 1\nlower = 0\non = 3\noff = -1\nsample_time = \"10 ms\"\n\
         [block.slow]\nkind = \"rate_limit\"\ninput = \"held\"\nrise = \"4 / 1 s\"\nfall = \"9 / 1 s\"\nsample_time = \"10 ms\"\n\
         [block.late]\nkind = \"delay\"\ninput = \"held\"\ntime = \"30 ms\"\ninitial = 0.25\nsample_time = \"10 ms\"\n\
         [block.sum]\nkind = \"integrator\"\ninput = \"held\"\nhigh = \"0.2 s\"\nreset = \"switch\"\nreset_to = \"0.05 s\"\nsample_time = \"10 ms\"\n\
         [block.sum2]\nkind = \"integrator\"\ninput = \"held\"\nrule = \"trapezoidal\"\nsample_time = \"10 ms\"\n\
         [block.watch]\nkind = \"monitor\"\nresidual = \"held\"\nthreshold = 1\ndebounce = \"25 ms\"\nhold = \"50 ms\"\nsample_time = \"10 ms\"\n\
         [block.loop]\nkind = \"pid\"\nreference = \"held\"\nmeasured = \"late\"\nproportional = 2\nintegral = \"5 / 1 s\"\nderivative = \"0.1 s\"\nfilter = \"20 ms\"\n\
         reference_weight = 0.7\nrate_weight = 0.2\nhigh = 1.5\nlow = -1\ntracking_time = \"0.1 s\"\non = \"watch\"\nmanual = \"dead\"\nsample_time = \"10 ms\"\n\
         [block.filter]\nkind = \"low_pass\"\ninput = \"held\"\ntime_constant = \"40 ms\"\nsample_time = \"10 ms\"\n\
         [block.mode]\nkind = \"state_machine\"\nstates = [\"calm\", \"wild\"]\ntransitions = [{ from = \"calm\", to = \"wild\", when = \"watch\" }, { from = \"wild\", to = \"calm\", when = \"if(mode.since > 95 ms, 1, 0)\" }]\n\
         outputs = { gain = [\"2 N m\", \"5 N m\"] }\nsample_time = \"10 ms\"\n",
    );
    let run = run(&source);
    let inputs = samples(&run, "held");
    let (mut states, zero): ([[f64; 2]; 6], f64) = ([[0.0; 2]; 6], 0.0);
    let (mut line, mut pid, mut filter, mut one) = ([0.25; 4], [0.0; 5], [0.0; 2], [0.0; 1]);
    let mut mode = [0.0, -1.0];
    for (k, &input) in inputs.iter().enumerate() {
        let (t, h) = (k as f64 / 100.0, 0.01);
        let expected = 1.5 * (7.0 * t).sin() + f64::from(u8::from(t > 0.0501 && (t - 0.0501) % 0.31 < 0.13));
        assert!((input - expected).abs() < 1e-12, "{input} for {expected} at {t}");
        let same = |name: &str, expected: f64| {
            let found = at(&run, name, t);
            assert!((found - expected).abs() < 1e-12, "{name}: {found} for {expected} at {t} s");
        };
        let [switch, slow, sum, sum2, watch, _] = &mut states;
        assert!(kardan_rt::Saturation { low: Some(-0.4), high: Some(0.9) }.step(input, &mut one));
        same("saturated", one[0]);
        assert!(kardan_rt::DeadZone { low: -0.5, high: 0.5 }.step(input, &mut one));
        let dead = one[0];
        same("dead", dead);
        assert!(kardan_rt::Hysteresis { upper: 1.0, lower: 0.0, levels: [-1.0, 3.0] }.step(input, switch));
        same("switch", switch[0]);
        assert!(kardan_rt::RateLimit { rise: 4.0 * h, fall: 9.0 * h }.step(input, slow));
        same("slow", slow[0]);
        assert!(kardan_rt::Delay.step(input, &mut line));
        same("late", line[0]);
        let integrator = kardan_rt::Integrator { sample_time: h, low: Some(-0.2), high: Some(0.2) };
        assert!(integrator.step(input, switch[0], 0.05, sum));
        same("sum", sum[0]);
        let integrator = kardan_rt::Integrator { sample_time: h, low: None, high: None };
        assert!(integrator.step_trapezoidal(input, zero, zero, sum2));
        same("sum2", sum2[0]);
        assert!(kardan_rt::Monitor { threshold: 1.0, debounce: 3.0, hold: 5.0 }.step(input, watch));
        same("watch", watch[0]);
        let controller = kardan_rt::Pid {
            proportional: 2.0,
            integral: Some(5.0),
            derivative: 0.1,
            filter: 0.02,
            weights: [0.7, 0.2],
            bounds: [Some(-1.0), Some(1.5)],
            tracking: 0.1,
            sample_time: h,
        };
        assert!(controller.step(input, line[0], kardan_rt::Manual { on: watch[0], value: dead }, &mut pid));
        same("loop", pid[0]);
        // (1 + z⁻¹)/(1 + 2T/h + (1 − 2T/h) z⁻¹)
        let (numerator, denominator) = ([1.0 / 9.0, 1.0 / 9.0], [-7.0 / 9.0]);
        assert!(
            kardan_rt::TransferFunction { numerator: &numerator, denominator: &denominator }.step(input, &mut filter)
        );
        same("filter", filter[0]);
        let since = (mode[1] + 1.0) * h;
        same("mode.since", since);
        let transitions = [kardan_rt::Transition { from: 0, to: 1 }, kardan_rt::Transition { from: 1, to: 0 }];
        let guards = [watch[0], f64::from(u8::from(since > 0.095))];
        assert!(kardan_rt::StateMachine { transitions: &transitions }.step(&guards, &mut mode));
        same("mode", mode[0]);
        same("mode.wild", mode[0]);
        same("mode.gain", if mode[0] > 0.5 { 5.0 } else { 2.0 });
    }
    let all = |name: &str| samples(&run, name);
    for (name, both) in [("switch", [-1.0, 3.0]), ("watch", [0.0, 1.0]), ("mode", [0.0, 1.0]), ("sum", [-0.2, 0.05])] {
        assert!(
            both.iter().all(|value| all(name).contains(value)),
            "{name} does not do all that it can: {:?}",
            all(name)
        );
    }
}

/// At every instant filters, integrators and controllers are differential equations with closed forms.
#[test]
fn continuous_blocks_are_differential_equations() {
    let source = "\
[shaft.arm]
inertia = \"1 kg m^2\"
[signal.u]
kind = \"expression\"
value = \"1 N m\"
[block.first]
kind = \"low_pass\"
input = \"u\"
time_constant = \"0.2 s\"
[block.second]
kind = \"low_pass\"
input = \"u\"
time_constant = \"0.1 s\"
damping_ratio = 0.5
[block.lead]
kind = \"lead_lag\"
input = \"u\"
lead = \"0.5 s\"
lag = \"0.2 s\"
[block.sum]
kind = \"integrator\"
input = \"first\"
initial = \"0.25 N m s\"
[block.rational]
kind = \"transfer_function\"
input = \"u\"
zeros = [-4]
poles = [\"-3 ± 4j\", -10]
gain = 2
[block.still]
kind = \"low_pass\"
input = \"u\"
time_constant = \"0.2 s\"
initial = \"1 N m\"
[scenario]
duration = \"1 s\"
output_step = \"10 ms\"
";
    for method in [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic] {
        let run = run_by(source, method, Some(1e-11));
        assert_eq!(run.outcome, Outcome::Completed, "{method:?}");
        for &t in &run.series.time {
            let near = |name: &str, expected: f64| {
                let found = at(&run, name, t);
                assert!((found - expected).abs() < 1e-9, "{method:?}, {name}: {found} for {expected} at {t} s");
            };
            near("first", 1.0 - (-t / 0.2).exp());
            let w = 10.0 * 0.75f64.sqrt();
            near("second", 1.0 - (-5.0 * t).exp() * ((w * t).cos() + 5.0 / w * (w * t).sin()));
            near("lead", 1.0 + 1.5 * (-t / 0.2).exp());
            near("sum", 0.25 + t - 0.2 * (1.0 - (-t / 0.2).exp()));
            near("still", 1.0);
            // 2 (1 + s/4) · 25 · 10/((s² + 6 s + 25)(s + 10)) of a step: partial fractions 2 + A e^{−10t} + e^{−3t}(B cos 4t + C sin 4t).
            let a = 2.0 * (1.0 - 10.0 / 4.0) * 250.0 / ((100.0 - 60.0 + 25.0) * -10.0);
            let b = -2.0 - a;
            // It starts without a slope: one pole more than there are zeros would give one of 0.
            let c = (10.0 * a + 3.0 * b) / 4.0;
            near(
                "rational",
                2.0 + a * (-10.0 * t).exp() + (-3.0 * t).exp() * (b * (4.0 * t).cos() + c * (4.0 * t).sin()),
            );
        }
    }
}

/// A sampled controller on a double integrator: between two samples it moves by exact formulas, so the whole loop is a recursion.
#[test]
fn a_program_closes_a_loop_as_the_recursion_says() {
    let source = "\
[shaft.arm]
inertia = \"0.5 kg m^2\"
[motor.m]
shaft = \"arm\"
[signal.wish]
kind = \"ramp\"
to = \"1 rad\"
over = \"0.2 s\"
start = \"0.1 s\"
[block.speed]
kind = \"transfer_function\"
input = \"arm.phi\"
zeros = [0]
poles = [-100]
sample_time = \"5 ms\"
[control.loop]
law = \"program\"
commands = { m = \"20 N m/rad * (wish - arm.phi) - 3 N m s/rad * speed\" }
sample_time = \"5 ms\"
delay = \"2 ms\"
[scenario]
duration = \"1 s\"
output_step = \"5 ms\"
";
    let run = run_by(source, Method::Automatic, Some(1e-11));
    let (j, h, d) = (0.5, 0.005, 0.002);
    let (mut phi, mut w, mut before) = (0.0f64, 0.0f64, 0.0f64);
    let mut filter_state = [0.0; 2];
    // s/(1 + s/100) by the bilinear rule.
    let scale = 1.0 + 2.0 / (100.0 * h);
    let (numerator, denominator) = ([2.0 / h / scale, -2.0 / h / scale], [(1.0 - 2.0 / (100.0 * h)) / scale]);
    let filter = kardan_rt::TransferFunction { numerator: &numerator, denominator: &denominator };
    for k in 0..200 {
        let t = f64::from(k) * h;
        assert!((at(&run, "arm.phi", t) - phi).abs() < 1e-10, "{} for {phi} at {t} s", at(&run, "arm.phi", t));
        assert!(filter.step(phi, &mut filter_state));
        let reference = ((t - 0.1) / 0.2).clamp(0.0, 1.0);
        let command = 20.0 * (reference - phi) - 3.0 * filter_state[0];
        for (torque, time) in [(before, d), (command, h - d)] {
            phi += w * time + torque / j * time * time / 2.0;
            w += torque / j * time;
        }
        before = command;
    }
    assert!((phi - 1.0).abs() < 0.1, "{phi}");
}

/// What blocks answer is the torque of a clutch, opens a lock, and drives a shaft as a law; between samples it stands still.
#[test]
fn block_outputs_drive_clutches_locks_and_shafts() {
    let source = "\
[shaft.a]
inertia = \"1 kg m^2\"
[shaft.b]
inertia = \"3 kg m^2\"
[clutch.c]
shaft_1 = \"a\"
shaft_2 = \"b\"
torque = \"grip\"
[shaft.d]
inertia = \"2 kg m^2\"
[torque.push]
shaft = \"d\"
law = \"pushed\"
[lock.l]
shaft_1 = \"d\"
shaft_2 = \"ground\"
engaged = \"caught\"
[block.grip]
kind = \"rate_limit\"
input = \"6 N m * begins\"
rise = \"600 N m/s\"
sample_time = \"10 ms\"
[signal.begins]
kind = \"pulses\"
high = 1
period = \"10 s\"
width = \"5 s\"
start = \"0.1 s\"
[block.pushed]
kind = \"gain\"
input = \"a.w\"
gain = \"0.5 N m s/rad\"
sample_time = \"0.1 s\"
[block.caught]
kind = \"hysteresis\"
input = \"d.phi\"
upper = \"1 rad\"
lower = \"-1 rad\"
sample_time = \"0.1 s\"
[scenario]
duration = \"2 s\"
output_step = \"10 ms\"
initial = { \"a.w\" = \"8 rad/s\" }
";
    let run = run_by(source, Method::Automatic, Some(1e-11));
    // The clutch takes 6 N m from 0.1 s on: 8 − 6 t against 2 t, until both turn with 2 rad/s, one second later.
    assert!((at(&run, "a.w", 0.6) - 5.0).abs() < 1e-9 && (at(&run, "b.w", 0.6) - 1.0).abs() < 1e-9);
    assert!((at(&run, "a.w", 1.5) - 2.0).abs() < 1e-9 && (at(&run, "b.w", 1.5) - 2.0).abs() < 1e-9);
    // The shaft is pushed by half the speed of a at the last sample, until it has turned by 1 rad at one, and is caught.
    let speeds = |t: f64| if t < 0.1 { 8.0 } else { f64::max(8.0 - 6.0 * (t - 0.1), 2.0) };
    let (mut phi, mut w) = (0.0f64, 0.0f64);
    for k in 0..20 {
        let t = f64::from(k) * 0.1;
        assert!((at(&run, "d.phi", t) - phi).abs() < 1e-9, "{} for {phi} at {t} s", at(&run, "d.phi", t));
        if phi >= 1.0 {
            w = 0.0;
        } else {
            let rate = 0.5 * speeds(t) / 2.0;
            (phi, w) = (phi + 0.1 * w + 0.005 * rate, w + 0.1 * rate);
        }
    }
    assert!(phi > 1.0 && phi < 1.5 && w == 0.0, "{phi}");
    let energy = &run.energy;
    assert!(energy.residual.abs() < 1e-9, "{energy:?}");
}

/// Blocks of shorter sample times compute first: a faster one is read as it is now, a slower one as it was before.
#[test]
fn sample_times_meet_in_a_stated_order() {
    let source = beside(
        "[block.fast]\nkind = \"gain\"\ninput = \"t\"\ngain = 1\nsample_time = \"10 ms\"\n\
         [block.slow]\nkind = \"gain\"\ninput = \"t\"\ngain = 1\nsample_time = \"20 ms\"\n\
         [block.fast_for_slow]\nkind = \"hold\"\ninput = \"fast\"\nsample_time = \"20 ms\"\n\
         [block.slow_for_fast]\nkind = \"hold\"\ninput = \"slow\"\nsample_time = \"10 ms\"\n",
    );
    let run = run(&source);
    for k in 0..100 {
        let t = f64::from(k) / 100.0;
        let slow = f64::from(k - k % 2) / 100.0;
        let before = if k % 2 == 1 { slow } else { f64::max(slow - 0.02, 0.0) };
        for (name, expected) in [("fast", t), ("slow", slow), ("fast_for_slow", slow), ("slow_for_fast", before)] {
            assert!(
                (at(&run, name, t) - expected).abs() < 1e-12,
                "{name}: {} for {expected} at {t} s",
                at(&run, name, t)
            );
        }
    }
}

/// A program that reads a slower block by way of a `hold` commands what the columns show, and a sensor that fails is seen by blocks: the last
/// answer stays, and a monitor counts what is no number as beyond its threshold.
#[test]
fn programs_and_columns_are_one_and_sensors_fail_for_blocks_too() {
    let source = "\
[shaft.arm]
inertia = \"1 kg m^2\"
[motor.m]
shaft = \"arm\"
[sensor.enc]
measures = \"angle\"
shaft = \"arm\"
[block.outer]
kind = \"gain\"
input = \"1 rad - arm.phi\"
gain = \"2 N m/rad\"
sample_time = \"20 ms\"
[block.held]
kind = \"hold\"
input = \"outer\"
sample_time = \"10 ms\"
[block.told]
kind = \"gain\"
input = \"held - 1 N m s/rad * arm.w\"
gain = 1
sample_time = \"10 ms\"
[block.seen]
kind = \"gain\"
input = \"enc\"
gain = 1
sample_time = \"10 ms\"
[block.lost]
kind = \"monitor\"
residual = \"enc - arm.phi\"
threshold = \"0.1 rad\"
debounce = \"30 ms\"
hold = \"20 ms\"
sample_time = \"10 ms\"
[control.loop]
law = \"program\"
commands = { m = \"told\" }
sample_time = \"10 ms\"
[scenario]
duration = \"1 s\"
output_step = \"10 ms\"
[[scenario.fault]]
sensor = \"enc\"
kind = \"lost\"
at = \"0.5 s\"
until = \"0.7 s\"
";
    let run = run(source);
    let before = at(&run, "arm.phi", 0.49);
    for k in 0..100 {
        let t = f64::from(k) / 100.0;
        assert_eq!(at(&run, "m.tau", t), at(&run, "told", t), "at {t} s");
        let lost = (0.5..0.7).contains(&t);
        let expected = if lost { before } else { at(&run, "arm.phi", t) };
        assert!((at(&run, "seen", t) - expected).abs() < 1e-12, "at {t} s");
        // The third sample that is no number raises the alarm, the second good one ends it.
        let alarm = (0.519..0.709).contains(&t);
        assert_eq!(at(&run, "lost", t), f64::from(u8::from(alarm)), "at {t} s");
    }
    assert!(at(&run, "m.tau", 0.0) == 0.0 && at(&run, "m.tau", 0.02) > 1.0);
    let reported = "The blocks at 0.01 s: in 20 of 101 samples a reading was not a number, and the controller used the last valid one";
    assert!(run.notes.iter().any(|note| note.starts_with(reported)), "{:?}", run.notes);
    assert!(run.notes.iter().all(|note| !note.contains("estimate")), "{:?}", run.notes);
}

/// A loop that is stopped, kept and put into another one goes on bit for bit, with what its blocks remember.
#[test]
fn block_states_are_part_of_a_snapshot() {
    let source = beside(
        "[block.filter]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"40 ms\"\nsample_time = \"10 ms\"\n\
         [block.flow]\nkind = \"low_pass\"\ninput = \"filter\"\ntime_constant = \"40 ms\"\n\
         [block.late]\nkind = \"delay\"\ninput = \"filter\"\ntime = \"50 ms\"\nsample_time = \"10 ms\"\n\
         [torque.push]\nshaft = \"arm\"\nlaw = \"2 N m * late\"\n",
    );
    let prepared = crate::common::prepared(&source);
    let variant = prepared.all().next().expect("a variant");
    let setup = || kardan::simulate::Setup {
        reduced: &variant.reduced,
        laws: &variant.implemented,
        scenario: &variant.scenario,
    };
    let start = || kardan::simulate::Simulation::new(setup(), prepared.tolerance);
    let (mut one, mut other) = (start(), start());
    one.advance(0.437).expect("goes on");
    other.restore(&one.snapshot()).expect("fits");
    for simulation in [&mut one, &mut other] {
        simulation.advance(0.9).expect("goes on");
    }
    for name in ["arm.phi", "filter", "flow", "late"] {
        let id = one.signal(name).expect("a signal");
        assert_eq!(one.get(id).to_bits(), other.get(id).to_bits(), "{name}");
        assert!(one.get(id) != 0.0, "{name}");
    }
    assert!(
        one.inputs().all(|(_, name, _)| name != "filter" && name != "u"),
        "what blocks answer is not set from outside"
    );
}

/// What is wrong with blocks is told with its place and what to do.
#[test]
fn errors_of_blocks_are_reported() {
    let cases = [
        (
            "[block.a]\nkind = \"gain\"\ninput = \"b\"\ngain = 2\nunit = \"rad\"\nsample_time = \"1 ms\"\n[block.b]\nkind = \"gain\"\ninput = \"a\"\ngain = 1\nsample_time = \"1 ms\"\n",
            "blocks depend on each other at the same sample: a from b from a",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"y\"\ngain = 2\nunit = \"rad\"\nsample_time = \"1 ms\"\n\
             [signal.y]\nkind = \"expression\"\nvalue = \"z + 1 rad * b\"\n[signal.z]\nkind = \"expression\"\nvalue = \"a * 0.5\"\n\
             [block.b]\nkind = \"gain\"\ninput = \"3 * u\"\ngain = 1\nsample_time = \"1 ms\"\n",
            "blocks depend on each other at the same sample: a from y from z from a",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"a\"\ngain = 2\nsample_time = \"1 ms\"\n",
            "`input` of block `a`: `a` depends on itself, so its unit is unknown",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"u\"\ngain = 2\nsample_time = \"1 ms\"\n[block.b]\nkind = \"gain\"\ninput = \"a\"\ngain = 1\nsample_time = \"2 ms\"\n",
            "block `b` computes every 0.002 s and reads `a`, which computes every 0.001 s",
        ),
        (
            "[block.a]\nkind = \"saturation\"\ninput = \"u\"\nlow = 2\nhigh = 1\n",
            "block `a`: `low` is above `high`: 2 and 1 in SI units",
        ),
        (
            "[block.a]\nkind = \"saturation\"\ninput = \"u\"\nhigh = \"1 N m\"\n",
            "block `a`: `high`: expected a number without a unit, found a torque",
        ),
        (
            "[block.a]\nkind = \"rate_limit\"\ninput = \"u\"\nrise = \"1 / 1 s\"\n",
            "block `a`: it needs a `sample_time`: it defines the largest change between two samples",
        ),
        (
            "[block.a]\nkind = \"delay\"\ninput = \"u\"\ntime = \"2.5 ms\"\nsample_time = \"1 ms\"\n",
            "block `a`: `time` is not a multiple of the sample time",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"arm.fi\"\ngain = 1\n",
            "`input` of block `a`: there is no `arm.fi` that a block can read",
        ),
        (
            "[block.a]\nkind = \"transfer_function\"\ninput = \"u\"\nzeros = [-1, -2]\npoles = [-3]\n",
            "block `a`: there are 2 zeros and 1 poles: the output would depend on derivatives of the input",
        ),
        (
            "[block.a]\nkind = \"transfer_function\"\ninput = \"u\"\npoles = [\"-3 + 2j\"]\n",
            "block `a`: `poles`: a complex value has no conjugate",
        ),
        (
            "[block.a]\nkind = \"state_machine\"\nstates = [\"x\", \"y\"]\ntransitions = [{ from = \"x\", to = \"z\", when = \"u\" }]\nsample_time = \"1 ms\"\n",
            "`to` of transition 1 of block `a`: there is no state `z`",
        ),
        (
            "[block.a]\nkind = \"state_machine\"\nstates = [\"x\"]\ntransitions = [{ from = \"x\", to = \"x\", when = \"a.y\" }]\nsample_time = \"1 ms\"\n",
            "`when` of transition 1 of block `a`: there is no `a.y` that a block can read",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"b.y\"\ngain = 1\n[block.b]\nkind = \"gain\"\ninput = \"a.x\"\ngain = 1\n",
            "`input` of block `b`: there is no `a.x` that a block can read",
        ),
        ("[block.arm]\nkind = \"gain\"\ninput = \"u\"\ngain = 1\n", "the name `arm` has two uses, for shaft and block"),
        ("[block.u]\nkind = \"gain\"\ninput = \"t\"\ngain = 1\n", "`u` cannot be the name of a block: a signal has it"),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"arm.w\"\nproportional = 1\n",
            "block `a`: `reference`: expected an angular velocity, found a number without a unit",
        ),
        (
            "[sensor.n]\nmeasures = \"net_torque\"\nshaft = \"arm\"\n[signal.s]\nkind = \"expression\"\nvalue = \"2 * n\"\n[torque.x]\nshaft = \"arm\"\nlaw = \"s\"\n",
            "`law` of torque `x`: the signal `s` depends on coordinates, a sensor or a block, so it is not a function of time",
        ),
        (
            "[control.c]\nlaw = \"program\"\ncommands = { m = \"1 N m\" }\n",
            "`m` in `commands` of control `c`: there is no motor and no voltage source of that name",
        ),
        (
            "[motor.m]\nshaft = \"arm\"\n[control.c]\nlaw = \"program\"\ncommands = { m = \"arm.phi\" }\n",
            "`m` in `commands` of control `c`: expected a torque, found an angle",
        ),
    ];
    for (blocks, message) in cases.into_iter().chain(invalid_constants()) {
        let found = Project::open(beside(blocks)).run(&Settings::default(), &Silent);
        let reported: Vec<String> = match found {
            Ok(_) => Vec::new(),
            Err(reported) => reported.iter().map(|one| one.message.clone()).collect(),
        };
        assert!(reported.iter().any(|one| one == message), "{blocks}: {reported:#?} for {message}");
    }
}

/// Keys whose values make no sense, and those that do nothing.
fn invalid_constants() -> Vec<(&'static str, &'static str)> {
    vec![
        (
            "[block.a]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"-5 ms\"\n",
            "block `a`: `time_constant` is below zero: the output would grow without bound, or equal the input",
        ),
        (
            "[block.a]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"5 ms - 5 ms\"\nsample_time = \"1 ms\"\n",
            "block `a`: `time_constant` is zero: the output would grow without bound, or equal the input",
        ),
        (
            "[block.a]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"5 ms\"\ndamping_ratio = -1\n",
            "block `a`: `damping_ratio` is below zero: it would oscillate with growing amplitude",
        ),
        (
            "[block.a]\nkind = \"lead_lag\"\ninput = \"u\"\nlead = \"5 ms\"\nlag = \"0 ms\"\n",
            "block `a`: `lag` is zero: the output would grow without bound, or be a derivative",
        ),
        (
            "[block.a]\nkind = \"rate_limit\"\ninput = \"u\"\nrise = \"1 / 1 s\"\nfall = \"-1 / 1 s\"\nsample_time = \"1 ms\"\n",
            "block `a`: `fall` is below zero: it is the magnitude of the fastest fall, without a sign",
        ),
        (
            "[block.a]\nkind = \"monitor\"\nresidual = \"u\"\nthreshold = -1\nsample_time = \"1 ms\"\n",
            "block `a`: `threshold` is below zero: every residual exceeds that, so there always is an alarm",
        ),
        (
            "[block.a]\nkind = \"monitor\"\nresidual = \"u - u\"\nthreshold = 1\nsample_time = \"1 ms\"\n",
            "block `a`: `residual` is constant: it is always 0 in SI units",
        ),
        (
            "[block.a]\nkind = \"monitor\"\nresidual = \"u\"\nthreshold = 1\ndebounce = \"-5 ms\"\nsample_time = \"1 ms\"\n",
            "`debounce` of block `a`: must not be negative, found -5 ms",
        ),
        (
            "[block.a]\nkind = \"delay\"\ninput = \"u\"\ntime = \"-5 ms\"\nsample_time = \"1 ms\"\n",
            "`time` of block `a`: must be more than zero, found -5 ms",
        ),
        (
            "[block.a]\nkind = \"delay\"\ninput = \"u\"\nsample_time = \"0 ms\"\n",
            "`sample_time` of block `a`: must be more than zero, found 0 ms",
        ),
        (
            "[block.a]\nkind = \"delay\"\ninput = \"u\"\nsample_time = \"999 ns\"\n",
            "`sample_time` of block `a`: must be at least 1 us, found 999 ns",
        ),
        (
            "[block.a]\nkind = \"dead_zone\"\ninput = \"u\"\nhigh = -1\n",
            "block `a`: `high` is below zero, and `low`, which is left out, is its opposite",
        ),
        (
            "[block.a]\nkind = \"integrator\"\ninput = \"u\"\nrule = \"trapezoidal\"\n",
            "block `a`: `rule` has no effect: without a sample time it is a differential equation",
        ),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"u\"\nproportional = 1\nfilter = \"1 ms\"\nsample_time = \"1 ms\"\n",
            "block `a`: `filter` has no effect: there is no `derivative`",
        ),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"u\"\nproportional = 1\nrate_weight = 1\nsample_time = \"1 ms\"\n",
            "block `a`: `rate_weight` has no effect: there is no `derivative`",
        ),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"u\"\nproportional = 1\nintegral = \"1 / 1 s\"\ntracking_time = \"1 s\"\nsample_time = \"1 ms\"\n",
            "block `a`: `tracking_time` has no effect: the output has no bound",
        ),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"u\"\nproportional = -1\nintegral = \"1 / 1 s\"\nhigh = 1\nsample_time = \"1 ms\"\n",
            "block `a`: `proportional`/`integral`, the default of `tracking_time`, is -1 s, not above half of the sample time: at a bound the integral would oscillate with growing amplitude",
        ),
        (
            "[block.a]\nkind = \"pid\"\nreference = \"u\"\nmeasured = \"u\"\nproportional = 1\non = \"u\"\nmanual = 1\nsample_time = \"1 ms\"\n",
            "block `a`: without an `integral` the offset after a switch from `manual` would never decay",
        ),
        (
            "[block.a]\nkind = \"gain\"\ninput = \"u / (2 - 2)\"\ngain = 1\n",
            "`input` of block `a`: division by zero: this part is 0",
        ),
        (
            "[block.a]\nkind = \"state_machine\"\nstates = [\"x\", \"since\"]\ntransitions = [{ from = \"x\", to = \"since\", when = \"u\" }]\nsample_time = \"1 ms\"\n",
            "block `a`: `states`: `since` is the time in a state, so no state can have that name",
        ),
        (
            "[block.a]\nkind = \"state_machine\"\nstates = [\"x\", \"y\"]\ntransitions = [{ from = \"x\", to = \"y\", when = \"u > 1 and arm.w > 2\" }]\nsample_time = \"1 ms\"\n",
            "`when` of transition 1 of block `a`: expected an angular velocity, found a number without a unit",
        ),
        (
            "[block.a]\nkind = \"state_machine\"\nstates = [\"x\", \"y\"]\ntransitions = [{ from = \"x\", to = \"y\", when = \"u && 1\" }]\nsample_time = \"1 ms\"\n",
            "`when` of entry 1 of `transitions` of block `a`: unexpected `&` in an expression",
        ),
    ]
}

/// A machine with two ways out of its first state and one back, with what is told about it.
fn state_machine_messages(first: &str, second: &str) -> Vec<String> {
    let source = beside(&format!(
        "[block.lost]\nkind = \"monitor\"\nresidual = \"u\"\nthreshold = 1\nsample_time = \"10 ms\"\n\
         [block.other]\nkind = \"state_machine\"\nstates = [\"a\", \"b\", \"c\"]\ntransitions = [{{ from = \"a\", to = \"b\", when = \"lost\" }}, {{ from = \"b\", to = \"c\", when = \"lost\" }}]\nsample_time = \"10 ms\"\n\
         [block.mode]\nkind = \"state_machine\"\nstates = [\"calm\", \"wild\", \"off\"]\nsample_time = \"10 ms\"\n\
         transitions = [{{ from = \"calm\", to = \"wild\", when = \"{first}\" }}, {{ from = \"calm\", to = \"off\", when = \"{second}\" }}, {{ from = \"wild\", to = \"calm\", when = \"mode.since > 95 ms\" }}]\n"
    ));
    Project::open(source).diagnostics().iter().map(|one| one.message.clone()).collect()
}

/// Monitors whose residual is never or always beyond the threshold by the bounds of what it is of, and those that wait longer than the run, are told;
/// transfer functions that grow without end too.
#[test]
fn monitors_that_have_no_effect_are_reported() {
    const NEVER: &str = "`residual` can never exceed `threshold`";
    let monitor = |keys: &str| {
        beside(&format!(
            "[block.w]\nkind = \"monitor\"\n{keys}\nsample_time = \"1 ms\"\n\
             [block.sat]\nkind = \"saturation\"\ninput = \"arm.phi\"\nhigh = \"2 rad\"\nsample_time = \"1 ms\"\n\
             [block.mode]\nkind = \"state_machine\"\nstates = [\"x\", \"y\"]\n\
             transitions = [{{ from = \"x\", to = \"y\", when = \"arm.phi > 1 rad\" }}]\nsample_time = \"1 ms\"\n"
        ))
    };
    let reported = |source: &str| -> Vec<String> {
        let all = study::prepare(source).1;
        let own = all.into_iter().filter(|one| matches!(one.code, "block::monitor" | "block::unstable"));
        own.map(|one| {
            assert!(one.severity == Severity::Warning && one.help.is_some() && !one.labels.is_empty(), "{one:?}");
            one.message
        })
        .collect()
    };
    for (keys, message) in [
        ("residual = \"sat\"\nthreshold = \"3 rad\"", NEVER),
        ("residual = \"sat\"\nthreshold = \"2 rad\"", NEVER),
        ("residual = \"sat\"\nthreshold = \"1.9 rad\"", ""),
        ("residual = \"abs(arm.phi) + 2 rad\"\nthreshold = \"1 rad\"", "`residual` always exceeds `threshold`"),
        ("residual = \"min(1 rad, max(-1 rad, arm.phi))\"\nthreshold = \"2 rad\"", NEVER),
        ("residual = \"if(arm.phi > 0 rad, 1, 0)\"\nthreshold = 1.5", NEVER),
        ("residual = \"sin(arm.phi)\"\nthreshold = 1.5", NEVER),
        ("residual = \"mode\"\nthreshold = 1.5", NEVER),
        ("residual = \"mode\"\nthreshold = 0.5", ""),
        ("residual = \"arm.phi\"\nthreshold = \"0.1 rad\"", ""),
        ("residual = \"arm.phi\"\nthreshold = \"0.1 rad\"\ndebounce = \"2000 s\"", "and the longest run ends at"),
    ] {
        let found = reported(&monitor(keys));
        assert!(found.len() == usize::from(!message.is_empty()), "{keys}: {found:?}");
        assert!(found.iter().all(|one| one.contains(message)), "{keys}: {found:?}");
    }
    let grows = |poles: &str| {
        reported(&beside(&format!("[block.a]\nkind = \"transfer_function\"\ninput = \"arm.phi\"\npoles = [{poles}]\n")))
    };
    assert!(grows("-3, 0").is_empty());
    let found = grows("-3, 3");
    assert!(found.len() == 1 && found[0].contains("its pole at 3 1/s") && found[0].contains("grows"), "{found:?}");
    let found = grows("\"2 ± 5j\"");
    assert!(found.len() == 1 && found[0].contains("its pole at 2 ± 5j 1/s"), "{found:?}");
}

/// A threshold that noise alone leaves often is told, where nothing waits: the difference of two sensors has √2 of the noise of one; one of zero always is.
#[test]
fn thresholds_below_the_noise_are_reported() {
    let reported = |keys: &str| -> Vec<String> {
        let source = beside(&format!(
            "[sensor.n]\nmeasures = \"angle\"\nshaft = \"arm\"\nnoise = \"0.01 rad\"\nsample_time = \"1 ms\"\n\
             [sensor.o]\nmeasures = \"angle\"\nshaft = \"arm\"\nnoise = \"0.01 rad\"\nsample_time = \"1 ms\"\n\
             [block.half]\nkind = \"gain\"\ninput = \"n - o\"\ngain = 0.5\nsample_time = \"1 ms\"\n\
             [block.w]\nkind = \"monitor\"\n{keys}\nsample_time = \"1 ms\"\n"
        ));
        let all = study::prepare(&source).1;
        all.into_iter().filter(|one| one.code == "block::monitor").map(|one| one.message).collect()
    };
    // Two deviations are 0.02 √2 = 0.02828 rad.
    for (residual, threshold, more, message) in [
        ("n - o", "0.0283 rad", "", ""),
        ("n - o", "0.0282 rad", "", "standard deviation of 1.414e-2"),
        ("n - o", "0.0282 rad", "debounce = \"5 ms\"", ""),
        ("half", "0.0142 rad", "", ""),
        ("half", "0.0141 rad", "", "standard deviation of 7.071e-3"),
        ("arm.phi", "0.001 rad", "", ""),
        ("arm.phi", "0 rad", "", "its `threshold` is zero"),
    ] {
        let found = reported(&format!("residual = \"{residual}\"\nthreshold = \"{threshold}\"\n{more}"));
        assert!(found.len() == usize::from(!message.is_empty()), "{residual} {threshold}: {found:?}");
        assert!(found.iter().all(|one| one.contains(message)), "{residual} {threshold}: {found:?}");
    }
}

/// Of two transitions out of one state it is decided whether they exclude each other, and a place is shown where they do not.
#[test]
fn transitions_that_overlap_are_reported() {
    let apart = [
        ("lost", "not lost"),
        ("u > 1", "u <= 1"),
        ("u > 1 and lost", "u < 0 or not lost"),
        ("2 * u + arm.phi / 1 rad > 3", "u + arm.phi / 2 rad <= 1.5"),
        ("abs(u) > 1", "max(u, -u) < 0.5"),
        ("if(arm.w > 1 rad/s, u, 0)", "arm.w < 0 rad/s and lost"),
        ("other.a and lost", "other.b and lost"),
        ("u^2 > 4 and arm.phi > 1 rad", "u^2 < 3"),
        ("u == 2", "u != 2"),
    ];
    for (first, second) in apart {
        assert_eq!(state_machine_messages(first, second), Vec::<String>::new(), "{first} | {second}");
    }
    let both = "block `mode`: the transitions from `calm` to `wild` and to `off` are both enabled where";
    let end = ": the first in the list is taken";
    let overlap = [
        ("lost", "mode.since > 0.2 s", "`lost` = 1, `mode.since` = 1 s"),
        ("u > 1", "u >= 1", "`u` = 2"),
        ("u > 1 and u < 2", "u < 1.5", "`u` = 1.25"),
        ("arm.phi > 90 deg", "arm.w < -1 rad/s", "`arm.phi` = 3.141592653589793 rad, `arm.w` = -2 rad/s"),
    ];
    for (first, second, at) in overlap {
        let reported = state_machine_messages(first, second);
        let [one] = &reported[..] else { panic!("{first} | {second}: {reported:?}") };
        let place = one.strip_prefix(both).and_then(|tail| tail.strip_suffix(end)).map(str::trim);
        let sorted = |text: &str| text.split(", ").map(str::to_string).collect::<std::collections::BTreeSet<_>>();
        assert_eq!(place.map(sorted), Some(sorted(at)), "{first} | {second}: {one}");
    }
    for (first, second, message) in [
        (
            "u > 1 and u < 0",
            "lost",
            "block `mode`: `when` of the transition from `calm` to `wild` is never true, so it is never taken",
        ),
        (
            "lost",
            "mode.since < 0 s",
            "block `mode`: no transitions lead from its initial state `calm` to its state `off`",
        ),
        (
            "sin(arm.phi) > 2",
            "u > 1",
            "block `mode`: it is not decided whether the transitions from `calm` to `wild` and to `off` are ever enabled together, as they compare more than sums of signals times constants: where both are, the first in the list is taken",
        ),
    ] {
        let reported = state_machine_messages(first, second);
        assert!(reported.iter().any(|one| one == message), "{first} | {second}: {reported:#?}");
    }
}

/// A formula of what moves has a column of its own, is required and followed, without a block that reads it.
#[test]
fn formulas_are_columns() {
    let source = "\
[shaft.arm]
inertia = \"1 kg m^2\"
[motor.m]
shaft = \"arm\"
[torque.spring]
shaft = \"arm\"
law = \"-damp\"
[signal.half]
kind = \"expression\"
value = \"2 N m/rad * arm.phi\"
[signal.damp]
kind = \"expression\"
value = \"half + 0.4 N m s/rad * arm.w * (1 + (arm.w / 1 rad/s)^2)\"
[scenario]
duration = \"2 s\"
output_step = \"10 ms\"
initial = { \"arm.phi\" = \"1 rad\" }
[[requirement]]
signal = \"half\"
measure = \"final\"
above = \"-2.1 N m\"
below = \"2.1 N m\"
";
    let plain = source.replace(
        "law = \"-damp\"",
        "law = \"-(2 N m/rad * arm.phi + 0.4 N m s/rad * arm.w * (1 + (arm.w / 1 rad/s)^2))\"",
    );
    for method in [Method::Taylor, Method::Dop853, Method::Radau] {
        let (run, same) = (run_by(source, method, None), run_by(&plain, method, None));
        for k in 0..=200 {
            let t = f64::from(k) / 100.0;
            let [phi, w] = ["arm.phi", "arm.w"].map(|name| at(&run, name, t));
            assert!((at(&run, "half", t) - 2.0 * phi).abs() < 1e-12, "at {t} s");
            assert!((at(&run, "damp", t) - 2.0 * phi - 0.4 * w * (1.0 + w * w)).abs() < 1e-12, "at {t} s");
            assert!((at(&run, "spring.tau", t) + at(&run, "damp", t)).abs() < 1e-12, "at {t} s");
            assert!((at(&same, "arm.phi", t) - phi).abs() < 1e-8, "at {t} s");
        }
    }
}

/// A torque, and what a clutch can hold, follow blocks at every instant: the same as where the block is written as a shaft of its own
/// differential equation.
#[test]
fn torques_and_clutch_limits_read_blocks_at_every_instant() {
    let source = "\
[shaft.arm]
inertia = \"1 kg m^2\"
[shaft.fly]
inertia = \"2 kg m^2\"
[torque.back]
shaft = \"arm\"
law = \"-6 N m/rad * late\"
[clutch.c]
shaft_1 = \"arm\"
shaft_2 = \"fly\"
torque = \"0.1 N m + grip\"
[block.late]
kind = \"low_pass\"
input = \"arm.phi\"
time_constant = \"50 ms\"
[block.grip]
kind = \"gain\"
input = \"abs(late)\"
gain = \"0.5 N m/rad\"
[scenario]
duration = \"1 s\"
output_step = \"5 ms\"
initial = { \"arm.phi\" = \"1 rad\", \"fly.w\" = \"3 rad/s\" }
";
    for method in [Method::Taylor, Method::Dop853] {
        let run = run_by(source, method, None);
        assert_eq!(run.outcome, Outcome::Completed);
        // The arm at 1e5 steps of the midpoint rule while the clutch slips forward, which it does until the speeds meet.
        let (mut x, h) = ([1.0, 0.0, 0.0, 3.0], 1e-5);
        let rates = |x: &[f64; 4]| {
            let grip = 0.1 + 0.5 * x[2].abs();
            [x[1], -6.0 * x[2] + grip, (x[0] - x[2]) / 0.05, -grip / 2.0]
        };
        for k in 1..=50_000 {
            let first = rates(&x);
            let middle = std::array::from_fn(|i| x[i] + 0.5 * h * first[i]);
            let slope = rates(&middle);
            x = std::array::from_fn(|i| x[i] + h * slope[i]);
            if k % 5000 == 0 {
                let t = f64::from(k) * h;
                for (name, expected) in [("arm.phi", x[0]), ("arm.w", x[1]), ("late", x[2]), ("fly.w", x[3])] {
                    let found = at(&run, name, t);
                    assert!((found - expected).abs() < 1e-6, "{name}: {found} for {expected} at {t} s");
                }
            }
        }
    }
}

/// The last row shows what blocks answer then, like all rows at samples.
#[test]
fn the_last_row_is_a_sample() {
    let run = run(&beside(
        "[block.held]\nkind = \"hold\"\ninput = \"u\"\nsample_time = \"10 ms\"\n\
         [block.coarse]\nkind = \"hold\"\ninput = \"u\"\nsample_time = \"40 ms\"\n",
    ));
    let u = |t: f64| 1.5 * (7.0 * t).sin() + f64::from(u8::from((t - 0.0501) % 0.31 < 0.13));
    assert!((at(&run, "held", 1.0) - u(1.0)).abs() < 1e-12 && (at(&run, "held", 0.99) - u(0.99)).abs() < 1e-12);
    assert!((at(&run, "coarse", 1.0) - u(1.0)).abs() < 1e-12 && (at(&run, "coarse", 0.99) - u(0.96)).abs() < 1e-12);
}

/// Without an integral part what bridges a switching fades with the tracking time, and a bound leaves nothing behind.
#[test]
fn proportional_control_forgets_its_switching() {
    let run = run(&beside(
        "[block.switch]\nkind = \"hold\"\ninput = \"t > 0.095 s\"\nsample_time = \"10 ms\"\n\
         [block.p]\nkind = \"pid\"\nreference = 1\nmeasured = 0.25\nproportional = 2\non = \"switch\"\nmanual = 4\ntracking_time = \"0.1 s\"\nsample_time = \"10 ms\"\n\
         [block.held]\nkind = \"hold\"\ninput = \"u\"\nsample_time = \"10 ms\"\n\
         [block.bounded]\nkind = \"pid\"\nreference = \"held\"\nmeasured = 0\nproportional = 2\nhigh = 1\nsample_time = \"10 ms\"\n",
    ));
    for k in 0..100 {
        let t = f64::from(k) / 100.0;
        // From 4 to 1.5, a tenth less of what is left at each sample.
        let expected = if k < 10 { 4.0 } else { 1.5 + 2.5 * 0.9_f64.powi(k - 10) };
        assert!((at(&run, "p", t) - expected).abs() < 1e-12, "{} for {expected} at {t} s", at(&run, "p", t));
        let expected = (2.0 * at(&run, "held", t)).clamp(-1.0, 1.0);
        assert!(
            (at(&run, "bounded", t) - expected).abs() < 1e-12,
            "{} for {expected} at {t} s",
            at(&run, "bounded", t)
        );
    }
}

/// Keys that are expressions are told where they leave the range that numbers in their place must keep, from when on and by how much; those that stay in it are not.
#[test]
fn keys_that_leave_their_range_are_reported() {
    let run = run(&beside(
        "[block.late]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"0.5 s - t\"\nsample_time = \"10 ms\"\n\
         [block.zone]\nkind = \"dead_zone\"\ninput = \"u\"\nlow = \"t / 1 s\"\nhigh = 0.2\nsample_time = \"10 ms\"\n\
         [block.one_sided]\nkind = \"saturation\"\ninput = \"u\"\nhigh = \"0.9 - t / 1 s\"\nsample_time = \"10 ms\"\n\
         [block.fine]\nkind = \"low_pass\"\ninput = \"u\"\ntime_constant = \"0.1 s + t\"\nsample_time = \"10 ms\"\n",
    ));
    let reported: Vec<&String> = run.notes.iter().filter(|note| note.contains("in block `")).collect();
    let begins = [
        "`time_constant` is zero or less in block `late` from 0.500000 s on, by up to 0.500000 s,",
        "`low` is above `high` in block `zone` from 0.210000 s on, by up to 0.800000,",
        "`high` is below zero, and `low` its opposite in block `one_sided` from 0.910000 s on, by up to 0.200000,",
    ];
    assert_eq!(reported.len(), begins.len(), "{reported:?}");
    for begin in begins {
        assert!(reported.iter().any(|note| note.starts_with(begin)), "{begin}: {reported:?}");
    }
}

/// An arm that follows a reference, which events set to 10 degrees; with a law as one line, or with a block.
fn follows(parts: &str) -> String {
    format!(
        "[shaft.arm]\ninertia = \"0.02 kg m^2\"\ndamping = \"0.05 N m s/rad\"\n[motor.m]\nshaft = \"arm\"\n{parts}\n[scenario]\nduration = \"0.5 s\"\n\
         [[scenario.event]]\nat = \"0.1 s\"\nsignal = \"ref\"\nto = \"10 deg\"\n"
    )
}

const PID: &str = "[block.position]\nkind = \"pid\"\nreference = \"ref\"\nmeasured = \"arm.phi\"\nproportional = \"2 N m/rad\"\nsample_time = \"1 ms\"\n";

/// A reference is introduced in one way: by the table that follows it. Who else reads it reads the same.
#[test]
fn references_are_introduced_by_what_follows_them() {
    let law = |command: &str, more: &str| {
        format!("[control.c]\nlaw = \"program\"\nsample_time = \"1 ms\"\ncommands = {{ m = \"{command}\" }}\n{more}")
    };
    let listed = "references = [{ name = \"ref\", unit = \"mrad\" }]\n";
    let formula = "[signal.error]\nkind = \"expression\"\nvalue = \"ref - arm.phi\"\n";
    let by_hand = law("2 N m/rad * (ref - arm.phi)", listed);
    let expected = run(&follows(&by_hand));
    for parts in [
        format!("{PID}{}", law("position", "")),
        format!("{PID}{}", law("position", listed)),
        format!("{PID}{formula}{}", law("2 N m/rad * error + 0 * position", "")),
        format!("{formula}{}", law("2 N m/rad * error", listed)),
    ] {
        let found = run(&follows(&parts));
        assert_eq!(at(&found, "ref", 0.2), 10f64.to_radians(), "{parts}");
        for time in [0.1, 0.2, 0.5] {
            let difference = at(&found, "arm.phi", time) - at(&expected, "arm.phi", time);
            assert!(difference.abs() < 1e-12, "{parts} at {time} s: {difference}");
        }
    }
    assert!(at(&expected, "arm.phi", 0.5) > 0.05);
}

/// What is wrong with a reference is told where it stands.
#[test]
fn errors_of_references_are_reported() {
    let law = "[control.c]\nlaw = \"program\"\ncommands = { m = \"2 N m/rad * (ref - arm.phi)\" }\n";
    let reported = |parts: &str| {
        let out = study::check(&follows(parts));
        out.into_iter()
            .filter(|reported| reported.severity == Severity::Error)
            .map(|reported| format!("{} ({})", reported.message, reported.help.unwrap_or_default()))
            .collect::<Vec<_>>()
            .join("; ")
    };
    let unknown = reported(law);
    assert!(unknown.contains("there is no `ref`"), "{unknown}");
    assert!(unknown.contains("references = [{ name = \"ref\", unit = \"rad\" }]"), "{unknown}");
    let unit = reported(&format!("{law}references = [{{ name = \"ref\", unit = \"raad\" }}]\n"));
    assert!(unit.starts_with("`unit` of entry 1 of `references` of control `c`") && !unit.contains(';'), "{unit}");
    let missing = reported(&format!("{law}references = [{{ name = \"ref\" }}]\n"));
    assert!(missing.contains("needs the key `unit`") && !missing.contains(';'), "{missing}");
    let other = reported(&format!("{law}references = [{{ name = \"ref\", unit = \"N m\" }}]\n"));
    assert!(other.contains("torque"), "{other}");
    let duplicate = reported(&format!("{law}references = [{{ name = \"arm\", unit = \"rad\" }}]\n"));
    assert!(duplicate.contains("the name `arm` is already that of a shaft"), "{duplicate}");
    let second = format!(
        "{PID}[block.rate]\nkind = \"pid\"\nreference = \"ref\"\nmeasured = \"arm.w\"\nproportional = \"1 N m s/rad\"\nsample_time = \"1 ms\"\n"
    );
    let second = reported(&second);
    assert!(second.starts_with("block `rate`: `reference`: expected an angular velocity"), "{second}");
    assert!(!second.contains(';'), "{second}");
}
