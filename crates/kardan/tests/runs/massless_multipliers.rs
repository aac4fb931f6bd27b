//! Motions without inertia beside constraints that are kept with their multipliers, and sliders beside prescribed motions.

use crate::common::{close, run_by, signal};
use kardan::diagnostics::Severity;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study::{self, Project};

const METHODS: [Method; 4] = [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau];

fn scenario(duration: f64, rows: u32, more: &str) -> String {
    format!(
        "[scenario]\nduration = \"{duration} s\"\noutput_step = \"{} s\"\nrelative_tolerance = 1e-11\n{more}\n",
        duration / f64::from(rows)
    )
}

fn balances(run: &Run, what: &str) {
    let flows = run.energy.dissipated.abs().max(run.energy.input.abs()).max(run.energy.stored.abs());
    assert!(run.energy.residual.abs() <= 1e-9 * flows.max(1.0), "{what}: {:?}", run.energy);
}

/// `J ẍ = τ − s (x − m)`, `d ṁ = s (x − m)`: state (x, ẋ, m) by its series.
fn maxwell(inertia: f64, (s, d): (f64, f64), torque: f64, [x, v, m]: [f64; 3], t: f64) -> [f64; 3] {
    let parts = 64.0;
    let h = t / parts;
    let mut state = [x, v, m];
    for _ in 0..64 {
        let (mut term, mut sum) = (state, state);
        for k in 1..24 {
            let push = if k == 1 { torque } else { 0.0 };
            let pull = s * (term[0] - term[2]);
            term = [term[1], (push - pull) / inertia, pull / d].map(|rate| rate * h / f64::from(k));
            (0..3).for_each(|i| sum[i] += term[i]);
        }
        state = sum;
    }
    state
}

/// A wheel that rolls without slipping, with Maxwell elements (spring, node without inertia, damper) on its axle and on its heading.
#[test]
fn maxwell_elements_beside_a_rolling_wheel() {
    let (radius, mass, own, turning) = (0.3, 3.0, 0.2, 0.1);
    let (axle, steering) = ((6.0, 2.0), (1.5, 0.4));
    let element = |name: &str, shaft: &str, (s, d): (f64, f64)| {
        format!(
            "[shaft.{name}]\n[spring_damper.s_{name}]\nshaft_1 = \"{shaft}\"\nshaft_2 = \"{name}\"\nstiffness = \"{s} N m/rad\"\n\
             [spring_damper.d_{name}]\nshaft_1 = \"{name}\"\ndamping = \"{d} N m s/rad\"\n"
        )
    };
    let model = format!(
        "[shaft.wheel]\ninertia = \"{own} kg m^2\"\n[shaft.heading]\ninertia = \"{turning} kg m^2\"\n\
         [mass.x]\nmass = \"{mass} kg\"\n[mass.y]\nmass = \"{mass} kg\"\n\
         [constraint.along]\nrates = {{ x = 1, wheel = \"-{radius} m * cos(heading.phi)\" }}\n\
         [constraint.across]\nrates = {{ y = 1, wheel = \"-{radius} m * sin(heading.phi)\" }}\n\
         [torque.drive]\nshaft = \"wheel\"\nlaw = \"0.5 N m\"\n"
    ) + &element("n", "wheel", axle)
        + &element("o", "heading", steering)
        + &scenario(3.0, 30, "initial = { \"heading.w\" = \"2 rad/s\", \"o.phi\" = \"0.1 rad\" }");
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (row, &t) in run.series.time.iter().enumerate() {
            let [phi, w, n] = maxwell(own + mass * radius * radius, axle, 0.5, [0.0; 3], t);
            let [psi, yaw_rate, o] = maxwell(turning, steering, 0.0, [0.0, 2.0, 0.1], t);
            let pull = axle.0 * (phi - n);
            let expected = [
                ("wheel.phi", phi),
                ("wheel.w", w),
                ("n.phi", n),
                ("n.w", pull / axle.1),
                ("heading.phi", psi),
                ("heading.w", yaw_rate),
                ("o.phi", o),
                ("x.v", radius * w * psi.cos()),
                ("y.v", radius * w * psi.sin()),
                // m ẍ, in which ẇ follows from the torques.
                (
                    "along.f",
                    mass * radius
                        * ((0.5 - pull) / (own + mass * radius * radius) * psi.cos() - w * yaw_rate * psi.sin()),
                ),
            ];
            for (name, value) in expected {
                close(signal(&run, name)[row], value, 1e-8, &format!("{method:?} {name} at {t}"));
            }
        }
        balances(&run, &format!("{method:?}"));
    }
}

/// A Scotch yoke whose crank is held by two springs in series: `½ (J + m r² cos² φ) φ̇² + ½ s φ²` is kept; then with a slider between the two.
#[test]
fn series_springs_and_friction_elements_on_the_crank_of_a_yoke() {
    let (j, m, r, s1, s2, c) = (0.02, 3.0, 0.1, 0.8, 0.5, 0.05);
    let model = format!(
        "[shaft.crank]\ninertia = \"{j} kg m^2\"\n[mass.slide]\nmass = \"{m} kg\"\n[shaft.n]\n\
         [constraint.yoke]\nexpression = \"slide.s - {r} m * sin(crank.phi)\"\n\
         [spring_damper.s1]\nshaft_1 = \"crank\"\nshaft_2 = \"n\"\nstiffness = \"{s1} N m/rad\"\n\
         [spring_damper.s2]\nshaft_1 = \"n\"\nstiffness = \"{s2} N m/rad\"\nFRICTION\n"
    ) + &scenario(4.0, 80, "initial = { \"crank.w\" = \"5 rad/s\", \"slide.v\" = \"0.5 m/s\" }");
    let stored = |phi: f64, w: f64| 0.5 * (j + m * r * r * phi.cos().powi(2)) * w * w;
    for method in METHODS {
        let what = format!("{method:?}");
        let run = run_by(&model.replace("FRICTION", ""), method, None);
        let s = 1.0 / (1.0 / s1 + 1.0 / s2);
        let [phi, w, n] = ["crank.phi", "crank.w", "n.phi"].map(|name| signal(&run, name));
        for row in 0..phi.len() {
            close(stored(phi[row], w[row]) + 0.5 * s * phi[row] * phi[row], stored(0.0, 5.0), 1e-9, &what);
            close(n[row], s / s2 * phi[row], 1e-12, &what);
        }
        balances(&run, &what);

        let run = run_by(&model.replace("FRICTION", &format!("friction = \"{c} N m\"")), method, None);
        let names = ["crank.phi", "crank.w", "n.phi", "n.w", "s1.tau", "s2.friction"];
        let [phi, w, n, speed, tau, friction] = names.map(|name| signal(&run, name));
        let mut sticking = 0.0;
        for row in 0..phi.len() {
            close(tau[row], friction[row] + s2 * n[row], 1e-10, &what);
            assert!(friction[row].abs() <= c * (1.0 + 1e-9), "{what}");
            if speed[row] != 0.0 {
                close(friction[row], c * speed[row].signum(), 1e-10, &what);
            }
            sticking += f64::from(u8::from(speed[row] == 0.0));
        }
        let last = phi.len() - 1;
        let remaining =
            stored(phi[last], w[last]) + 0.5 * s1 * (phi[last] - n[last]).powi(2) + 0.5 * s2 * n[last].powi(2);
        close(run.energy.dissipated, stored(0.0, 5.0) - remaining, 1e-9, "what is lost is friction times slip");
        assert!(sticking > 3.0 && run.energy.dissipated > 0.1, "{what}: {:?}", run.energy);
        balances(&run, &what);
    }
}

/// ```text
///   p ~~s~~ n --d--[ b ]      p turns with a prescribed speed or acceleration, n has no inertia: b follows as by its angle
/// ```
#[test]
fn a_shaft_whose_speed_is_prescribed_drives_through_a_massless_node() {
    let (own, j, s, d) = (0.2, 0.5, 30.0, 1.5);
    let model = |motion: &str| {
        format!(
            "[shaft.p]\ninertia = \"{own} kg m^2\"\n[shaft.n]\n[shaft.b]\ninertia = \"{j} kg m^2\"\n\
             [prescribed_motion.drive]\nshaft = \"p\"\n{motion}\n\
             [spring_damper.s]\nshaft_1 = \"p\"\nshaft_2 = \"n\"\nstiffness = \"{s} N m/rad\"\n\
             [spring_damper.d]\nshaft_1 = \"n\"\nshaft_2 = \"b\"\ndamping = \"{d} N m s/rad\"\n"
        ) + &scenario(3.0, 30, "initial = { \"p.w\" = \"1.2 rad/s\" }")
    };
    let motions = [
        "angle = \"0.4 rad * sin(3 rad/s * t)\"",
        "speed = \"1.2 rad/s * cos(3 rad/s * t)\"",
        "acceleration = \"-3.6 rad/s^2 * sin(3 rad/s * t)\"",
    ];
    for method in METHODS {
        let runs = motions.map(|motion| {
            let model = model(motion);
            let model = if motion.starts_with("angle") {
                model.replace("initial = { \"p.w\" = \"1.2 rad/s\" }", "")
            } else {
                model
            };
            run_by(&model, method, None)
        });
        for (run, motion) in runs.iter().zip(motions) {
            for (row, t) in run.series.time.iter().enumerate() {
                // The damper passes on what the spring has: τ = s (p − n) = d (ṅ − ḃ) = J b̈.
                let [tau, spring, damper] = ["drive.tau", "s.tau", "d.tau"].map(|name| signal(run, name)[row]);
                close(spring, damper, 1e-10, motion);
                close(tau, spring - own * 3.6 * (3.0 * t).sin(), 1e-8, &format!("{motion} at {t}"));
                for name in ["p.phi", "n.phi", "b.phi", "b.w", "d.tau"] {
                    close(
                        signal(run, name)[row],
                        signal(&runs[0], name)[row],
                        1e-8,
                        &format!("{motion} {name} at {t}"),
                    );
                }
            }
            balances(run, motion);
        }
    }
}

/// A slider that rubs on the prescribed shaft itself, its node held by a spring to the ground: it sticks to the shaft until its spring asks for more.
#[test]
fn a_friction_element_is_carried_by_a_prescribed_shaft() {
    let (s, c, top) = (10.0, 0.4, 0.1);
    let model = format!(
        "[shaft.p]\ninertia = \"0.1 kg m^2\"\n[shaft.m]\n\
         [prescribed_motion.drive]\nshaft = \"p\"\nMOTION\n\
         [spring_damper.f]\nshaft_1 = \"m\"\nshaft_2 = \"p\"\nfriction = \"{c} N m\"\n\
         [spring_damper.s]\nshaft_1 = \"m\"\nstiffness = \"{s} N m/rad\"\n"
    );
    let motions = [
        (format!("angle = \"{top} rad * sin(pi * t / 1 s)\""), ""),
        (
            format!("speed = \"{} rad/s * cos(pi * t / 1 s)\"", top * std::f64::consts::PI),
            "initial = { \"p.w\" = \"0.3141592653589793 rad/s\" }",
        ),
    ];
    for ((motion, start), method) in motions.iter().flat_map(|motion| METHODS.map(|method| (motion, method))) {
        let run = run_by(&(model.replace("MOTION", motion) + &scenario(1.0, 50, start)), method, None);
        for (row, t) in run.series.time.iter().enumerate() {
            let p = top * (std::f64::consts::PI * t).sin();
            // Out with the shaft to c/s, back with it from the turning point on.
            let m = if *t <= 0.5 { p.min(c / s) } else { c / s - (top - p).min(2.0 * c / s) };
            for (name, value) in [("p.phi", p), ("m.phi", m), ("s.tau", s * m), ("f.friction", -s * m)] {
                close(signal(&run, name)[row], value, 1e-9, &format!("{motion} {method:?} {name} at {t}"));
            }
        }
        // It slips by what is left of the way: out, and back after 2 c/s.
        let slip = (top - c / s) + (top - 2.0 * c / s);
        close(run.energy.dissipated, c * slip, 1e-9, "friction times slip");
        assert!(run.energy.residual.abs() <= 1e-9 * c * slip, "{motion} {method:?} {:?}", run.energy);
    }
}

/// What moves a shaft of a kept row is refused by name.
#[test]
fn massless_shafts_of_multiplier_constraints_are_refused() {
    let refused = |model: &str, fragments: &[&str]| {
        let found = study::check(model);
        let errors: Vec<_> = found.iter().filter(|one| one.severity == Severity::Error).collect();
        assert_eq!(errors.len(), 1, "{found:#?}");
        for fragment in fragments {
            assert!(errors[0].message.contains(fragment), "{fragment}: {}", errors[0].message);
        }
        assert!(errors[0].help.is_some() && errors[0].labels.len() > 1, "{found:#?}");
    };
    let wheel = "[shaft.wheel]\ninertia = \"0.2 kg m^2\"\n[mass.x]\nmass = \"1 kg\"\n[shaft.h]\n\
        [constraint.along]\nrates = { x = 1, wheel = \"-0.3 m * cos(h.phi)\" }\n";
    // The heading has no inertia: springs hold it, or a damper does.
    let sprung = "[spring_damper.s]\nshaft_1 = \"h\"\nshaft_2 = \"wheel\"\nstiffness = \"1 N m/rad\"\n";
    refused(&(wheel.to_string() + sprung), &["`h`", "cannot be simulated with `along`"]);
    let damped = sprung.replace("stiffness = \"1 N m/rad\"", "damping = \"1 N m s/rad\"");
    refused(&(wheel.to_string() + &damped), &["`h`", "cannot be simulated with `along`"]);
    let driven = "[shaft.p]\n[shaft.b]\ninertia = \"1 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"p\"\nspeed = \"1 rad/s\"\n\
        [spring_damper.d]\nshaft_1 = \"p\"\nshaft_2 = \"b\"\ndamping = \"1 N m s/rad\"\n";
    refused(driven, &["`p`", "cannot be simulated with `drive`"]);
    // What helps is said, and helps: an angle takes no inertia.
    let found = Project::open(driven).diagnostics().to_vec();
    assert!(
        found[0]
            .help
            .as_deref()
            .is_some_and(|help| help.contains("prescribe `angle` or `position` in place of the speed")),
        "{found:#?}"
    );
    let angle = driven.replace("speed = \"1 rad/s\"", "angle = \"1 rad * sin(t / 1 s)\"");
    assert!(Project::open(&angle).diagnostics().is_empty(), "{:#?}", Project::open(&angle).diagnostics());
}

/// A bead on a cycloid, whose angle has no inertia of its own: it swings in the same time from everywhere, `sin(ϑ/2) = sin(A/2) cos(√(g/4R) t)`
/// (Huygens). What the rows carry is the weight and the inertia of the bead.
#[test]
fn a_massless_coordinate_follows_from_constraints() {
    let source = "[parameters]\nR = \"0.5 m\"\nm = \"1 kg\"\ng = \"9.81 m/s^2\"\n[mass.x]\nmass = \"m\"\n[mass.y]\nmass = \"m\"\n[shaft.th]\n\
                  [constraint.cx]\nexpression = \"x.s - R * (th.phi + sin(th.phi))\"\n[constraint.cy]\nexpression = \"y.s - R * (1 - cos(th.phi))\"\n\
                  [torque.w]\nmass = \"y\"\nlaw = \"-m * g\"\n"
        .to_string()
        + &scenario(10.0, 100, "initial = { \"th.phi\" = \"2 rad\" }");
    for method in METHODS {
        let run = run_by(&source, method, None);
        for (row, &t) in run.series.time.iter().enumerate() {
            let half = (signal(&run, "th.phi")[row] / 2.0).sin();
            close(half, 1f64.sin() * ((9.81f64 / 2.0).sqrt() * t).cos(), 1e-7, "the half angle");
        }
        balances(&run, "cycloid");
    }
}

/// The distance from the origin as a coordinate of its own, on which a spring acts, is the same as the spring's law over both coordinates.
#[test]
fn a_massless_distance_is_a_coordinate() {
    let bodies = "[mass.x]\nmass = \"2 kg\"\n[mass.y]\nmass = \"2 kg\"\n";
    let end = scenario(
        2.0,
        20,
        "initial = { \"x.s\" = \"0.4 m\", \"y.s\" = \"0.3 m\", \"x.v\" = \"1 m/s\", \"y.v\" = \"2 m/s\" }",
    );
    let with = format!(
        "{bodies}[mass.r]\n[constraint.c]\nexpression = \"r.s - sqrt(x.s^2 + y.s^2)\"\n\
         [spring_damper.k]\nmass_1 = \"r\"\nmass_2 = \"ground\"\nstiffness = \"50 N/m\"\n{end}"
    );
    for method in METHODS {
        let run = run_by(&with, method, None);
        // A plane oscillator: x = x₀ cos ωt + v₀/ω sin ωt, ω = 5 rad/s.
        for (row, &t) in run.series.time.iter().enumerate() {
            let of = |x: f64, v: f64| x * (5.0 * t).cos() + v / 5.0 * (5.0 * t).sin();
            let (x, y) = (of(0.4, 1.0), of(0.3, 2.0));
            close(signal(&run, "x.s")[row], x, 1e-8, "x");
            close(signal(&run, "r.s")[row], x.hypot(y), 1e-8, "r");
            close(signal(&run, "c.f")[row].abs(), 50.0 * x.hypot(y), 1e-6, "what the row carries");
        }
    }
}
