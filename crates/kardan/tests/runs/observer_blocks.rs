//! Blocks that estimate: against closed forms of their error and against the recursion of `kardan-rt`.

use kardan::simulate::Method;
use kardan::study::{Project, Settings, Silent};

use crate::common::{at, run_by};

/// A shaft of 0.5 kg m² under a torque of a program and an unknown load of 0.8 N m, with the speed read.
const PLANT: &str = "\
[parameters]
J = \"0.5 kg m^2\"
[shaft.arm]
inertia = \"J\"
[motor.m]
shaft = \"arm\"
[disturbance.load]
shaft = \"arm\"
[signal.wave]
kind = \"expression\"
value = \"1.5 N m * sin(7 t / 1 s)\"
[scenario]
duration = \"1 s\"
output_step = \"10 ms\"
[[scenario.event]]
signal = \"load\"
at = \"0 s\"
to = \"-0.8 N m\"
";

/// The load of a plant with a held torque is found as the poles say: as the estimate foretells exactly from sample to sample, its error is
/// `Fᵏ e₀` with the double pole z = e^{−p h}, `zᵏ (1 + k (F − z)/z) e₀`.
#[test]
fn a_sampled_observer_error_follows_its_poles() {
    let source = format!(
        "{PLANT}[block.u]\nkind = \"hold\"\ninput = \"wave\"\nsample_time = \"10 ms\"\n\
         [control.c]\nlaw = \"program\"\ncommands = {{ m = \"u\" }}\nsample_time = \"10 ms\"\n\
         [block.est]\nkind = \"observer\"\nstates = {{ speed = \"0 rad/s\", load = \"0 N m\" }}\n\
         rates = {{ speed = \"(u - est.load) / J\" }}\nmeasured = {{ speed = \"arm.w\" }}\npoles = [-12, -12]\nsample_time = \"10 ms\"\n"
    );
    let run = run_by(&source, Method::Automatic, Some(1e-12));
    let (j, h) = (0.5, 0.01);
    let z = (-12.0_f64 * h).exp();
    // det(z − F) = (z − z₀)² with F = [1 − l₁, −h/J; −l₂, 1].
    let (l1, l2) = (2.0 * (1.0 - z), -(1.0 - z) * (1.0 - z) * j / h);
    let f = [[1.0 - l1, -h / j], [-l2, 1.0]];
    // The error, truth less estimate, begins with the load alone.
    let start = [0.0, 0.8];
    for k in 0..100 {
        let (t, count) = (f64::from(k) * h, f64::from(k));
        let grown = |i: usize| {
            let increment: f64 = (0..2).map(|n| (f[i][n] - if i == n { z } else { 0.0 }) / z * start[n]).sum();
            z.powi(k) * (start[i] + count * increment)
        };
        let found = [at(&run, "arm.w", t) - at(&run, "est.speed", t), 0.8 - at(&run, "est.load", t)];
        for i in 0..2 {
            assert!((found[i] - grown(i)).abs() < 1e-9, "{found:?} for [{}, {}] at {t} s", grown(0), grown(1));
        }
        let residual = at(&run, "est.residual_speed", t);
        assert!((residual - found[0]).abs() < 1e-12, "{residual} for {} at {t} s", found[0]);
    }
}

/// At every instant the error is the solution of its differential equation: with poles a ± b j of the speed's one, `−d/(b J) e^{a t} sin b t`.
#[test]
fn a_continuous_observer_error_follows_its_poles() {
    let source = format!(
        "{PLANT}[torque.drive]\nshaft = \"arm\"\nlaw = \"wave\"\n\
         [block.est]\nkind = \"observer\"\nstates = {{ speed = \"0 rpm\", load = \"0.3 N m\" }}\n\
         rates = {{ speed = \"(wave - est.load) / J\" }}\nmeasured = {{ speed = \"arm.w\" }}\npoles = [\"-6 ± 9j\"]\n"
    );
    let run = run_by(&source, Method::Automatic, Some(1e-11));
    let (a, b, j, off) = (-6.0, 9.0, 0.5, 0.8 - 0.3);
    for k in 0..100 {
        let t = f64::from(k) / 100.0;
        let expected = -off / (b * j) * (a * t).exp() * (b * t).sin();
        let found = at(&run, "arm.w", t) - at(&run, "est.speed", t);
        assert!((found - expected).abs() < 1e-8, "{found} for {expected} at {t} s");
        // J ė = −(d − d̂) − J l₁ e, l₁ = −2 a
        let rate = -off / (b * j) * (a * t).exp() * (a * (b * t).sin() + b * (b * t).cos());
        let load = 0.8 - at(&run, "est.load", t);
        assert!((load + j * (rate - 2.0 * a * expected)).abs() < 1e-8, "{load} at {t} s");
    }
}

/// Gains as they are given, of two measurements, one of which is no state: what the block of `kardan-rt` does.
#[test]
fn explicit_gains_are_those_of_the_block() {
    let source = format!(
        "{PLANT}[torque.drive]\nshaft = \"arm\"\nlaw = \"wave\"\n[block.u]\nkind = \"hold\"\ninput = \"wave\"\nsample_time = \"10 ms\"\n\
         [block.est]\nkind = \"observer\"\nstates = {{ angle = \"0.2 rad\", speed = \"0 rad/s\" }}\n\
         rates = {{ angle = \"est.speed\", speed = \"u / J\" }}\n\
         predicted = {{ mix = \"2 * est.angle + 0.1 s * est.speed - 0.3 rad\" }}\n\
         measured = {{ mix = \"2 * arm.phi + 0.1 s * arm.w\", speed = \"arm.w\" }}\n\
         gains = {{ angle = [0.1, \"0.05 s\"], speed = [\"0.3 rad/s/rad\", 0.2] }}\nsample_time = \"10 ms\"\n"
    );
    let run = run_by(&source, Method::Automatic, Some(1e-11));
    let h = 0.01;
    let (a, b) = ([1.0, h, 0.0, 1.0], [h * h / 2.0 / 0.5, h / 0.5]);
    let block = kardan_rt::Observer { a: &a, b: &b, c: &[2.0, 0.1, 0.0, 1.0], gain: &[0.1, 0.05, 0.3, 0.2] };
    let mut state = [0.0, 0.0, 0.2, 0.0];
    for k in 0..100 {
        let t = f64::from(k) * h;
        let [phi, w] = ["arm.phi", "arm.w"].map(|name| at(&run, name, t));
        // What is said of the mixture has an offset, which is no state.
        assert!(block.step(&[at(&run, "u", t)], &[2.0 * phi + 0.1 * w + 0.3, w], &mut state));
        for (name, expected) in [("est.angle", state[0]), ("est.speed", state[1])] {
            let found = at(&run, name, t);
            assert!((found - expected).abs() < 1e-11, "{name}: {found} for {expected} at {t} s");
        }
        let residual = 2.0 * phi + 0.1 * w + 0.3 - 2.0 * state[0] - 0.1 * state[1];
        assert!((at(&run, "est.residual_mix", t) - residual).abs() < 1e-11, "at {t} s");
    }
}

/// What cannot be an observer is told with its reason and what to do.
#[test]
fn errors_of_observers_are_reported() {
    let observer =
        |keys: &str| format!("kind = \"observer\"\nstates = {{ speed = \"0 rad/s\", load = \"0 N m\" }}\n{keys}");
    let rates = "rates = { speed = \"-a.load / J\" }\n";
    let measured = "measured = { speed = \"arm.w\" }\n";
    let both = format!("{rates}{measured}");
    let cases = [
        (observer(measured) + "poles = [-5, -6]\n", "not observable: no measurement depends on `load`"),
        (
            "kind = \"observer\"\nstates = { x = \"0 rad/s\", y = \"0 rad/s\" }\npredicted = { sum = \"2 * a.x + a.y\" }\n\
             measured = { sum = \"arm.w\" }\npoles = [-5, -6]\n"
                .into(),
            "not observable: `x` by -0.5 rad/s, `y` by 1 rad/s can change together without effect on any measurement",
        ),
        (observer(&both) + "poles = [-5]\n", "1 `poles` for 2 states"),
        (observer(&both) + "poles = [-5, 0]\n", "`poles`: the error of the estimate does not decay at a pole with the real part 0 1/s"),
        (observer(&both) + "poles = [\"-5 + 2j\", -3]\n", "`poles`: a complex value has no conjugate"),
        (
            observer(&both) + "poles = [\"-5 ± 400j\"]\nsample_time = \"10 ms\"\n",
            "`poles`: 400 1/s is not below half the sampling rate (Nyquist), 314.1592653589793 1/s: samples cannot represent it",
        ),
        (observer(&both), "the speed of the estimate is not defined: there are neither `poles` nor `gains`"),
        (
            observer(&both) + "poles = [-5, -6]\ngains = { speed = \"3 /s\", load = \"-3 N m/rad\" }\n",
            "`gains` and `poles` are given: only one of them may define the speed of the estimate",
        ),
        (observer(&both) + "gains = { speed = \"3 /s\" }\n", "`gains`: there are none for `load`"),
        (
            observer(&both) + "gains = { speed = [\"3 /s\", \"3 /s\"], load = \"-3 N m/rad\" }\n",
            "`gains`: `speed` has 2 for 1 measurements",
        ),
        (
            observer(&both) + "gains = { speed = \"3 /s\", load = \"3 N m/rad\" }\n",
            "the error of the estimate does not decay: the pole 1.3722813232690143 1/s has no negative real part",
        ),
        (
            observer(&both) + "gains = { speed = 0.3, load = \"0 N m s/rad\" }\nsample_time = \"10 ms\"\n",
            "the error of the estimate does not decay: z = 1 is not within the unit circle",
        ),
        (
            observer(&both) + "gains = { speed = 3, load = \"-3 N m/rad\" }\n",
            "`gains`: that of `speed` for `speed`: expected a frequency, found a number without a unit",
        ),
        (
            observer(&format!("rates = {{ speed = \"-a.load\" }}\n{measured}poles = [-5, -6]\n")),
            "`rates`: that of `speed`: expected an angular acceleration, found a torque",
        ),
        (
            observer(&format!("rates = {{ sped = \"-a.load / J\" }}\n{measured}poles = [-5, -6]\n")),
            "`rates`: `sped` is not a state",
        ),
        (
            observer(&format!("rates = {{ speed = \"-a.load * abs(a.load) / J / 1 N m\" }}\n{measured}poles = [-5, -6]\n")),
            "`rates`: the rate of `speed` is not linear in `load` with a constant coefficient",
        ),
        (
            observer(&format!("rates = {{ speed = \"-a.load * t / 1 s / J\" }}\n{measured}poles = [-5, -6]\n")),
            "`rates`: the rate of `speed` is not linear in `load` with a constant coefficient",
        ),
        (
            observer(&format!("{rates}measured = {{ twist = \"arm.w\" }}\npoles = [-5, -6]\n")),
            "`measured`: `twist` is not a state, and `predicted` does not contain it",
        ),
        (
            observer(&format!("{rates}measured = {{ speed = \"arm.phi\" }}\npoles = [-5, -6]\n")),
            "`measured`: `speed`: expected an angular velocity, found an angle",
        ),
        (
            observer(&format!("{rates}measured = {{ speed = \"arm.w - a.speed\" }}\npoles = [-5, -6]\n")),
            "`measured`: `speed` follows from the estimate of `speed` itself",
        ),
        (
            observer(&format!("{both}predicted = {{ twist = \"a.load\" }}\npoles = [-5, -6]\n")),
            "`predicted`: `twist` is not measured, so nothing is compared with it",
        ),
        (
            observer(&format!("{rates}measured = {{ speed = \"arm.w\", load = \"wave\" }}\npoles = [-5, -6]\n")),
            "`poles` need exactly one measurement, and there are several: `speed`, `load`",
        ),
        (observer(&both) + "poles = [-5, -6]\nunit = \"rad\"\n", "`unit` has no effect: each state has the unit of its initial value"),
        (
            format!("kind = \"observer\"\nstates = {{ speed = [\"0 rad/s\", \"1 rad/s\"] }}\n{measured}poles = [-5]\n"),
            "`states`: `speed` has 2 values, and it needs one initial value",
        ),
        (
            observer("rates = { speed = \"a.speed * 1e9 / 1 s - a.load / J\" }\n") + measured + "poles = [-5, -6]\nsample_time = \"1 s\"\n",
            "within one sample the states grow or decay beyond the range of floating point",
        ),
        // π/ω apart the samples of an oscillation do not show its speed.
        (
            "kind = \"observer\"\nstates = { x = \"0 rad\", v = \"0 rad/s\" }\n\
                 rates = { x = \"a.v\", v = \"-(pi / 1 s)^2 * a.x\" }\nmeasured = { x = \"arm.phi\" }\npoles = [-1, -2]\nsample_time = \"1 s\"\n"
                .to_string(),
            "at this sample time all samples of two motions are equal, so no gain distinguishes them",
        ),
    ];
    for (block, message) in cases {
        let source = format!("{PLANT}[block.a]\n{block}");
        let found = Project::open(source).run(&Settings::default(), &Silent);
        let reported: Vec<_> = found.err().into_iter().flat_map(|reported| reported.to_vec()).collect();
        let expected = format!("block `a`: {message}");
        let one = reported.iter().find(|one| one.message == expected);
        let one = one.unwrap_or_else(|| panic!("{block}: {reported:#?} for {message}"));
        assert!(one.help.is_some() && !one.labels.is_empty(), "{one:?}");
    }
}
