//! Laws that are written as expressions and blocks, in the exact sampled map and its margins.

use kardan::results::Margins;
use kardan::study::{DesignSettings, Project, Silent};
use kardan_rt::{Manual, Pid};

const PLANT: &str = "\
[shaft.arm]
inertia = \"0.01 kg m^2\"
damping = \"0.002 N m s/rad\"
[motor.m]
shaft = \"arm\"
lag = \"0.4 ms\"
[sensor.enc]
measures = \"angle\"
shaft = \"arm\"
[scenario]
duration = \"1 s\"
";

fn margins(source: &str) -> Margins {
    let found = Project::open(source).design(&DesignSettings::default(), &Silent);
    let found = found.unwrap_or_else(|reported| panic!("{reported:#?}\n{source}"));
    found.margins.unwrap_or_else(|| panic!("no margins\n{source}"))
}

/// The law of a position loop, written as a formula, has its map and its margins.
#[test]
fn a_formula_has_the_margins_of_the_law_that_it_is() {
    let clock = "sample_time = \"1 ms\"\ndelay = \"0.7 ms\"\n";
    let law = format!(
        "{PLANT}[control.loop]\nlaw = \"position_loop\"\noutput = \"arm.phi\"\ninput = \"m\"\nreference = \"ref\"\nnatural_frequency = \"40 rad/s\"\n{clock}"
    );
    // 0.01 (1600 (ref − φ) − 2·0.7·40 ω)
    let program = format!(
        "{PLANT}[control.loop]\nlaw = \"program\"\ncommands = {{ m = \"0.01 kg m^2 * ((40 rad/s)^2 * (wish - enc) - 56 rad/s * arm.w)\" }}\n{clock}\
         [signal.wish]\nkind = \"ramp\"\nto = \"1 rad\"\nover = \"0.1 s\"\n"
    );
    let (law, program) = (margins(&law), margins(&program));
    let radius = |found: &Margins| found.spectral_radius.expect("a map");
    assert!((radius(&law) - radius(&program)).abs() < 1e-13, "{law:?} {program:?}");
    let (motor, own) = (&law.channels[0], &program.channels[0]);
    let near = |a: f64, b: f64| a == b || (a - b).abs() < 1e-9 * a.abs();
    assert!(near(motor.gain[0], own.gain[0]) && near(motor.gain[1], own.gain[1]), "{motor:?} {own:?}");
    assert!(near(motor.phase, own.phase) && near(motor.disk, own.disk) && motor.disk > 0.1, "{motor:?} {own:?}");
}

/// The slowest motion of a loop with a PID block decays as that of the recursion of plant and firmware: at each sample the same block, in
/// between the exact motion of a shaft under a torque that is held.
#[test]
fn the_map_of_a_block_is_what_the_firmware_does() {
    let source = format!(
        "{PLANT}[control.loop]\nlaw = \"program\"\ncommands = {{ m = \"controller\" }}\nsample_time = \"2 ms\"\n\
         [block.controller]\nkind = \"pid\"\nreference = \"0 rad\"\nmeasured = \"enc\"\nproportional = \"4 N m/rad\"\nintegral = \"6 N m/rad/s\"\n\
         derivative = \"0.3 N m s/rad\"\nfilter = \"3 ms\"\nsample_time = \"2 ms\"\n"
    )
    .replace("lag = \"0.4 ms\"\n", "");
    let found = margins(&source).spectral_radius.expect("a map");
    let (j, d, h) = (0.01f64, 0.002f64, 0.002f64);
    let pid = Pid {
        proportional: 4.0,
        integral: Some(6.0),
        derivative: 0.3,
        filter: 0.003,
        weights: [1.0, 0.0],
        bounds: [None; 2],
        tracking: 4.0 / 6.0,
        sample_time: h,
    };
    let (mut phi, mut w, mut state) = (1.0f64, 0.0f64, [0.0; 5]);
    let decay = (-d / j * h).exp();
    let mut sizes = Vec::new();
    for _ in 0..6000 {
        assert!(pid.step(0.0, phi, Manual { on: 1.0, value: 0.0 }, &mut state));
        let steady_speed = state[0] / d;
        phi += steady_speed * h + (w - steady_speed) * (1.0 - decay) * j / d;
        w = steady_speed + (w - steady_speed) * decay;
        sizes.push(phi.abs());
    }
    // The slowest motion alone is left: it does not swing.
    let expected = (sizes[5999] / sizes[4999]).powf(1e-3);
    assert!((found - expected).abs() < 1e-10, "{found} for {expected}");
}

/// A law that feeds back what an observer finds has the poles of both in the exact map, those of the law and those of the observer; so the
/// slowest motion of the loop is the slower one of them, as they were asked for.
#[test]
fn poles_of_an_observer_and_of_its_law_are_those_of_the_map() {
    let (j, h) = (0.01, 0.002);
    for (slow_law, slow_observer) in [(9.0_f64, 30.0_f64), (30.0, 7.0)] {
        // det(z − Φ + Γ K) = (z − z₀)² with Γ = [h²/2J, h/J]: k₁ g₁ + k₂ g₂ = 2 (1 − z₀), k₂ g₂ − k₁ g₁ = 1 − z₀².
        let z = (-slow_law * h).exp();
        let (g1, g2) = (h * h / (2.0 * j), h / j);
        let (k1, k2) = ((1.0 - z) * (1.0 - z) / (2.0 * g1), (3.0 - 2.0 * z - z * z) / (2.0 * g2));
        let source = format!(
            "{PLANT}[control.loop]\nlaw = \"program\"\ncommands = {{ m = \"command\" }}\nsample_time = \"2 ms\"\n\
             [signal.command]\nkind = \"expression\"\nvalue = \"-({k1} N m/rad * est.angle + {k2} N m s/rad * est.speed)\"\n\
             [block.est]\nkind = \"observer\"\nstates = {{ angle = \"0 rad\", speed = \"0 rad/s\" }}\n\
             rates = {{ angle = \"est.speed\", speed = \"command / arm.inertia\" }}\n\
             measured = {{ angle = \"enc\" }}\npoles = [-{slow_observer}, -60]\nsample_time = \"2 ms\"\n"
        )
        .replace("lag = \"0.4 ms\"\n", "")
        .replace("damping = \"0.002 N m s/rad\"\n", "");
        let found = margins(&source).spectral_radius.expect("a map");
        let expected = (-slow_observer.min(slow_law) * h).exp();
        // A double pole of the law is known to the root of the rounding.
        let tolerance = if slow_law < slow_observer { 1e-6 } else { 1e-10 };
        assert!((found - expected).abs() < tolerance, "{found} for {expected}");
    }
}

/// A block that stands at its limit where the loop is linearised passes nothing on there: the design says so, and names it; within its limits it does not.
#[test]
fn a_block_at_its_limit_is_reported() {
    let warnings = |reference: &str| {
        let source = format!(
            "{PLANT}[control.loop]\nlaw = \"program\"\ncommands = {{ m = \"sat\" }}\nsample_time = \"1 ms\"\ndelay = \"1 ms\"\n\
             [block.sat]\nkind = \"saturation\"\ninput = \"0.1 N m/rad * ({reference} - enc)\"\nhigh = \"0.1 N m\"\nsample_time = \"1 ms\"\n"
        );
        let found = Project::open(&source).design(&DesignSettings::default(), &Silent);
        found.unwrap_or_else(|reported| panic!("{reported:#?}\n{source}")).warnings
    };
    let at_limit = warnings("2 rad");
    assert!(
        at_limit.iter().any(|reported| reported.contains("`sat` has zero gain where the loop is linearised")),
        "{at_limit:?}"
    );
    let inside_limits = warnings("0.5 rad");
    assert!(inside_limits.iter().all(|reported| !reported.contains("zero gain")), "{inside_limits:?}");
}

/// A sensor of a signal in the loop: the map, and so all that is said of it, is that of the sensor of the same motion, also at a sample time of its own.
#[test]
fn a_sensor_of_a_signal_has_the_map_of_a_sensor_of_the_motion() {
    for period in ["", "sample_time = \"1 ms\"\n", "sample_time = \"4 ms\"\n"] {
        let of = |sensor: &str| {
            let plant = PLANT.replace("[scenario]", &format!("{period}[scenario]"));
            let plant = plant.replace("measures = \"angle\"\nshaft = \"arm\"", sensor);
            let law = "law = \"program\"\ncommands = { m = \"-(0.4 N m/rad) * enc - 0.02 N m s/rad * arm.w\" }\nsample_time = \"1 ms\"\n";
            let block = "[block.truth]\nkind = \"gain\"\ninput = \"arm.phi\"\ngain = 1\n";
            let source = format!("{plant}{block}[control.c]\n{law}");
            let found = Project::open(&source).design(&DesignSettings::default(), &Silent);
            found.unwrap_or_else(|reported| panic!("{reported:#?}\n{source}")).margins.expect("margins")
        };
        let [motion, signal] =
            ["measures = \"angle\"\nshaft = \"arm\"", "measures = \"signal\"\nsignal = \"truth\""].map(of);
        let close =
            |a: f64, b: f64, what: &str| assert!((a - b).abs() <= 1e-9 * a.abs().max(1.0), "{what}: {a} for {b}");
        close(signal.spectral_radius.expect("a map"), motion.spectral_radius.expect("a map"), "spectral radius");
        assert!(motion.spectral_radius.is_some_and(|radius| radius < 0.999));
    }
}

/// What a program remembers, and its commands do not follow from where the loop stands, closes no loop: what that reads is not among its blocks.
#[test]
fn what_commands_do_not_follow_from_is_not_in_the_loop() {
    let reported = |commands: &str| {
        let source = format!(
            "{PLANT}[block.truth]\nkind = \"gain\"\ninput = \"arm.phi * 1 N m\"\ngain = 1\n\
             [sensor.far]\nmeasures = \"signal\"\nsignal = \"truth\"\nsample_time = \"3 ms\"\n\
             [block.late]\nkind = \"low_pass\"\ninput = \"far\"\ntime_constant = \"20 ms\"\nsample_time = \"1 ms\"\n\
             [control.c]\nlaw = \"program\"\nsample_time = \"1 ms\"\ncommands = {{ m = \"{commands}\" }}\n"
        );
        let found = Project::open(&source).design(&DesignSettings::default(), &Silent);
        let found = found.unwrap_or_else(|reported| panic!("{reported:#?}\n{source}"));
        [found.notes, found.warnings].concat().join(" ")
    };
    let own = "-(0.4 N m/rad) * enc - 0.02 N m s/rad * arm.w";
    let beside = reported(&format!("if(arm.w > 100 rad/s, late, {own})"));
    assert!(!beside.contains("`far`"), "{beside}");
    let through = reported(&format!("{own} - 0.1 * late"));
    assert!(through.contains("`far`"), "{through}");
}
