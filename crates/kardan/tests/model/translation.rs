//! What moves straight: masses, and what joins them to shafts.

use crate::common::{run, signal};

/// A pinion with a rack, and the same as inertias alone: the rack's values times r².
const RACK: &str = r#"
[shaft.wheel]
inertia = "0.04 kg m^2"
[shaft.pinion]
inertia = "1e-4 kg m^2"
[spring_damper.bar]
shaft_1 = "wheel"
shaft_2 = "pinion"
stiffness = "100 N m/rad"
damping = "0.2 N m s/rad"
[mass.rack]
mass = "2.5 kg"
damping = "50 N s/m"
friction = "20 N"
[rack_and_pinion.teeth]
pinion = "pinion"
rack = "rack"
radius = "8 mm"
[spring_damper.tyre]
mass_1 = "rack"
stiffness = "40 N/mm"
damping = "200 N s/m"
rest = "2 mm"
[motor.assist]
mass = "rack"
[disturbance.road]
mass = "rack"
[scenario]
duration = "0.8 s"
output_step = "10 ms"
event = [
  { at = "0.1 s", signal = "assist.f", to = "500 N", over = "0.1 s" },
  { at = "0.4 s", signal = "road", to = "-300 N" },
]
"#;

const ROTATIONAL: &str = r#"
[parameters]
r = "8 mm"
[shaft.wheel]
inertia = "0.04 kg m^2"
[shaft.pinion]
inertia = "1e-4 kg m^2"
[shaft.rack]
inertia = "2.5 kg * r^2"
damping = "50 N s/m * r^2"
friction = "20 N * r"
[spring_damper.bar]
shaft_1 = "wheel"
shaft_2 = "pinion"
stiffness = "100 N m/rad"
damping = "0.2 N m s/rad"
[gear.teeth]
shaft_1 = "pinion"
shaft_2 = "rack"
ratio = 1
[spring_damper.tyre]
shaft_1 = "rack"
stiffness = "40 N/mm * r^2"
damping = "200 N s/m * r^2"
rest = "2 mm / r"
[motor.assist]
shaft = "rack"
[disturbance.road]
shaft = "rack"
[scenario]
duration = "0.8 s"
output_step = "10 ms"
event = [
  { at = "0.1 s", signal = "assist.tau", to = "500 N * r", over = "0.1 s" },
  { at = "0.4 s", signal = "road", to = "-300 N * r" },
]
"#;

/// Masses are inertias in other units: every signal is the same but for powers of the radius, to the tolerance of the integrator.
#[test]
fn a_rack_is_an_inertia_at_its_radius() {
    let straight = run(RACK);
    let rotational = run(ROTATIONAL);
    let r = 0.008;
    for (one, other, factor) in [
        ("rack.s", "rack.phi", r),
        ("rack.v", "rack.w", r),
        ("pinion.phi", "pinion.phi", 1.0),
        ("wheel.w", "wheel.w", 1.0),
        ("bar.tau", "bar.tau", 1.0),
        ("tyre.f", "tyre.tau", 1.0 / r),
        ("rack.friction", "rack.friction", 1.0 / r),
        ("assist.f", "assist.tau", 1.0 / r),
        ("teeth.pinion.tau", "teeth.pinion.tau", 1.0),
        ("teeth.rack.f", "teeth.rack.tau", 1.0 / r),
        ("teeth.f", "teeth.rack.tau", 1.0 / r),
    ] {
        let (one, other) = (signal(&straight, one), signal(&rotational, other));
        let size = one.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        assert!(size > 0.0);
        for (a, b) in one.iter().zip(other) {
            assert!((a - factor * b).abs() <= 1e-8 * size, "{a} {}", factor * b);
        }
    }
    assert!((straight.energy.input - rotational.energy.input).abs() <= 1e-8 * straight.energy.input.abs());
}

/// A mass on a spring that is released: s = s0 exp(-d t/2m) (cos wt + d/(2mw) sin wt), to 1e-9 of the amplitude.
#[test]
fn a_mass_on_a_spring_swings_as_it_must() {
    let source = "[mass.m]\nmass = \"2 kg\"\n[spring_damper.s]\nmass_1 = \"m\"\nmass_2 = \"ground\"\nstiffness = \"50 N/m\"\n\
                  damping = \"3 N s/m\"\n[scenario]\nduration = \"5 s\"\noutput_step = \"0.05 s\"\ninitial = { \"m.s\" = \"20 cm\" }\n";
    let found = run(source);
    let (m, c, d) = (2.0f64, 50.0, 3.0);
    let decay = d / (2.0 * m);
    let w = (c / m - decay * decay).sqrt();
    for (t, s) in found.series.time.iter().zip(signal(&found, "m.s")) {
        let expected = 0.2 * (-decay * t).exp() * ((w * t).cos() + decay / w * (w * t).sin());
        assert!((s - expected).abs() <= 1e-9 * 0.2, "{s} {expected} at {t}");
    }
}

/// Atwood's machine: two masses on a rope over a drum, a = (m1 - m2) g r²/(J + (m1 + m2) r²), and the forces of the rope.
#[test]
fn two_masses_hang_on_a_drum() {
    let source = "[shaft.drum]\ninertia = \"0.5 kg m^2\"\n[mass.a]\nmass = \"8 kg\"\n[mass.b]\nmass = \"5 kg\"\n\
                  [pulley.left]\nshaft = \"drum\"\nmass = \"a\"\nradius = \"0.2 m\"\n\
                  [pulley.right]\nshaft = \"drum\"\nmass = \"b\"\nradius = \"-0.2 m\"\n\
                  [disturbance.weight_a]\nmass = \"a\"\n[disturbance.weight_b]\nmass = \"b\"\n\
                  [scenario]\nduration = \"1 s\"\noutput_step = \"0.1 s\"\nevent = [\n\
                  { at = \"0 s\", signal = \"weight_a\", to = \"8 kg * 9.81 m/s^2\" },\n\
                  { at = \"0 s\", signal = \"weight_b\", to = \"5 kg * 9.81 m/s^2\" }]\n";
    let found = run(source);
    let acceleration = 3.0 * 9.81 * 0.04 / (0.5 + 13.0 * 0.04);
    for (k, t) in found.series.time.iter().enumerate() {
        let near = |name: &str, value: f64| {
            let read = signal(&found, name)[k];
            assert!((read - value).abs() <= 1e-9, "{name}: {read} {value}");
        };
        near("a.s", 0.5 * acceleration * t * t);
        near("b.v", -acceleration * t);
        near("drum.w", acceleration * t / 0.2);
        near("left.f", 8.0 * (acceleration - 9.81));
        near("right.f", 5.0 * (-acceleration - 9.81));
        near("left.drum.tau", -0.2 * 8.0 * (acceleration - 9.81));
    }
}

/// A screw moves its nut by its lead in a turn, from where it stands at zero; its thread pushes with the torque over the lead.
#[test]
fn a_screw_moves_its_nut_by_its_lead() {
    let source = "[shaft.motor]\ninertia = \"1e-4 kg m^2\"\n[mass.table]\nmass = \"40 kg\"\n[motor.drive]\nshaft = \"motor\"\n\
                  [screw.ball]\nshaft = \"motor\"\nnut = \"table\"\nlead = \"5 mm/rev\"\noffset = \"3 mm\"\n\
                  [scenario]\nduration = \"0.5 s\"\nevent = [{ at = \"0 s\", signal = \"drive.tau\", to = \"0.1 N m\" }]\n";
    let found = run(source);
    let lead = 0.005 / std::f64::consts::TAU;
    let acceleration = 0.1 / (1e-4 + 40.0 * lead * lead);
    for (k, t) in found.series.time.iter().enumerate() {
        let near = |name: &str, value: f64| {
            let read = signal(&found, name)[k];
            assert!((read - value).abs() <= 1e-10 * (1.0 + value.abs()), "{name}: {read} {value}");
        };
        near("motor.phi", 0.5 * acceleration * t * t);
        near("table.s", 0.003 + lead * 0.5 * acceleration * t * t);
        near("ball.f", 40.0 * lead * acceleration);
        near("ball.motor.tau", -40.0 * lead * lead * acceleration);
    }
}

/// Rows that mix shafts and masses are lengths; belts over two pulleys too.
#[test]
fn rows_of_lengths_have_forces_as_multipliers() {
    let source = "[shaft.p]\ninertia = \"1 kg m^2\"\n[shaft.q]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"p\"\n\
                  [constraint.belt]\ncoefficients = { p = \"30 mm\", q = \"-50 mm/rad\" }\noffset = \"3 mm\"\n\
                  [scenario]\nduration = \"1 s\"\nevent = [{ at = \"0 s\", signal = \"m.tau\", to = \"1 N m\" }]\n";
    let found = run(source);
    // 1 = J_p w_p' + r_p F, 0 = J_q w_q' - r_q F, r_p w_p' = r_q w_q'; the multiplier pulls p back by r_p times it.
    let p = 1.0 / (1.0 + 2.0 * 0.36);
    let force = -(1.0 - p) / 0.03;
    let belt = found.series.signal("belt.f").expect("a force");
    assert_eq!(belt.physical.unit(), "N");
    assert!(belt.values.iter().all(|f| (f - force).abs() < 1e-9), "{:?} {force}", belt.values.first());
    assert!(found.series.signal("belt.p.tau").is_some());
}

/// A law controls the position of a mass by a force, in metres.
#[test]
fn laws_control_positions_by_forces() {
    let source = RACK.to_string()
        + "[control.place]\nlaw = \"position_loop\"\noutput = \"rack.s\"\ninput = \"assist\"\nreference = \"ref\"\n\
           natural_frequency = \"60 rad/s\"\ndamping_ratio = 1\n";
    let source = source.replace("signal = \"assist.f\", to = \"500 N\"", "signal = \"ref\", to = \"5 mm\"");
    let found = run(&source);
    assert_eq!(found.series.signal("ref").map(|reference| reference.physical.unit()), Some("m"));
    // The law is f = J (w² (r - s) - 2 v w) with damping ratio 1; J along the rack is its mass and the pinion's inertia at the radius.
    let (inertia, w) = (2.5 + 1e-4 / 64e-6, 60.0);
    let [s, v, f, reference] = ["rack.s", "rack.v", "assist.f", "ref"].map(|name| signal(&found, name));
    for k in 0..s.len() {
        let expected = inertia * (w * w * (reference[k] - s[k]) - 2.0 * w * v[k]);
        assert!((f[k] - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{} {expected}", f[k]);
    }
}

/// A rack whose ratio varies follows its points, does no work in its teeth, and keeps the energy; with points on a line it is the rack with
/// one ratio.
#[test]
fn the_ratio_of_a_rack_may_vary() {
    let curved = |points: &str| {
        RACK.replace("radius = \"8 mm\"", &format!("curve = [{points}]")).replace("\"500 N\"", "\"4 kN\"")
    };
    let point = |(angle, position): (f64, f64)| format!("{{ angle = \"{angle} rad\", position = \"{position} mm\" }}");
    let list = |points: &[(f64, f64)]| points.iter().copied().map(point).collect::<Vec<_>>().join(", ");
    let line = run(&curved(&list(&[(-3.0, -24.0), (0.0, 0.0), (1.0, 8.0), (4.0, 32.0)])));
    let straight = run(&RACK.replace("\"500 N\"", "\"4 kN\""));
    for name in ["rack.s", "pinion.w", "teeth.f", "teeth.pinion.tau", "tyre.f"] {
        let (one, other) = (signal(&line, name), signal(&straight, name));
        let size = one.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        // Tables run by DOP853, whose rows between steps hold speeds to 1e-7 of their size.
        assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() <= 1e-6 * size), "{name}");
    }
    let points = [(-8.0, -80.0), (-3.0, -27.0), (0.0, 0.0), (3.0, 27.0), (8.0, 80.0), (20.0, 215.0)];
    let found = run(&curved(&list(&points)));
    let [s, v, phi, w, f, tau] =
        ["rack.s", "rack.v", "pinion.phi", "pinion.w", "teeth.f", "teeth.pinion.tau"].map(|name| signal(&found, name));
    let mut far = 0.0f64;
    for k in 0..s.len() {
        // Between two points the rack is between theirs; power goes through unchanged.
        let pair = points.windows(2).find(|pair| (pair[0].0..pair[1].0).contains(&phi[k])).expect("within the points");
        assert!(s[k] >= 1e-3 * pair[0].1 - 1e-12 && s[k] <= 1e-3 * pair[1].1 + 1e-12, "{} at {}", s[k], phi[k]);
        let power = [f[k] * v[k], tau[k] * w[k]];
        assert!((power[0] + power[1]).abs() <= 1e-9 * (1e-9 + power[0].abs()), "{power:?}");
        far = far.max(phi[k].abs());
    }
    assert!(far > 3.0, "only {far} rad were seen");
    let e = found.energy;
    assert!(e.residual.abs() <= 1e-8 * (e.input.abs() + e.stored.abs() + e.dissipated.abs()), "{e:?}");
}
