//! A car on a road: against closed forms and against CommonRoad's vehicle models.

use kardan::results::{Complex, Run};
use kardan::simulate::Method;
use kardan::study::{AnalyzeSettings, Project, Silent};

use crate::common::{close, run_by, signal};

/// Wheels at an angle of the time, with more keys of the car and more of the model.
fn car(angle: &str, keys: &str, more: &str) -> String {
    format!(
        "[shaft.hand]\n[prescribed_motion.driver]\nshaft = \"hand\"\nangle = \"{angle}\"\n\
         [vehicle.car]\nsteered_by = \"hand\"\nsteering_ratio = 1\n{keys}\n{more}\n"
    )
}

/// A car that understeers, at a speed.
fn plain(speed: &str) -> String {
    format!(
        "mass = \"1500 kg\"\nyaw_inertia = \"2500 kg m^2\"\nfront_axle = \"1.2 m\"\nrear_axle = \"1.5 m\"\n\
         front_stiffness = \"90 kN/rad\"\nrear_stiffness = \"110 kN/rad\"\nspeed = \"{speed}\""
    )
}

fn by(source: &str, tolerance: f64) -> Run {
    run_by(source, Method::Automatic, Some(tolerance))
}

fn last(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("a row")
}

/// Rows of numbers, and their names.
fn table(text: &str) -> (Vec<&str>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().expect("a header").split(',').collect();
    (names, lines.map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect()).collect())
}

/// Car 2 of CommonRoad; its tyres' stiffness follows from the loads with g = 9.81 m/s^2.
fn commonroad(angle: &str, more: &str) -> String {
    let numbers = "[parameters]\nm = \"1093.2952334674046 kg\"\na = \"1.1561957064 m\"\nb = \"1.4227170936 m\"\n\
                   front = \"21.92 * m * 9.81 m/s^2 * b / (a + b) / 1 rad\"\nrear = \"21.92 * m * 9.81 m/s^2 * a / (a + b) / 1 rad\"\n";
    let keys = "mass = \"m\"\nyaw_inertia = \"1791.5995300122856 kg m^2\"\nfront_axle = \"a\"\nrear_axle = \"b\"\n\
                front_stiffness = \"front\"\nrear_stiffness = \"rear\"\nspeed = \"20 m/s\"\n";
    let scenario = "[scenario]\nduration = \"4 s\"\noutput_step = \"0.1 s\"\n";
    numbers.to_string() + &car(angle, &format!("{keys}{more}"), scenario)
}

/// The linear single-track model of CommonRoad (`st`): lateral velocity over speed, yaw rate and heading.
#[test]
fn the_linear_model_of_commonroad() {
    let run = by(&commonroad("0.05 rad * sin(pi * t / 1 s)", ""), 1e-12);
    let (names, rows) = table(include_str!("../vehicle/st.csv"));
    assert_eq!(names, ["t", "heading", "yaw_rate", "beta"]);
    assert_eq!(rows.len(), run.series.time.len());
    for (k, row) in rows.iter().enumerate() {
        close(signal(&run, "car.heading")[k], row[1], 1e-8, "heading");
        close(signal(&run, "car.yaw_rate")[k], row[2], 1e-8, "yaw rate");
        close(signal(&run, "car.v_y")[k] / 20.0, row[3], 1e-8, "slip angle of the car");
    }
    assert!(rows.iter().any(|row| row[2].abs() > 0.2));
}

/// The tyre law of its drift model (`std`) without forces along the wheels, far beyond the linear range.
#[test]
fn the_tyres_of_commonroads_drift_model() {
    // Their loads are those of g = 9.81 m/s^2.
    let tyres = "tyre = \"magic_formula\"\nshape = 1.3507\ncurvature = -0.0074722\nmu = \"1.0489 * 9.81 / 9.80665\"";
    let run = by(&commonroad("0.12 rad * sin(pi * t / 1 s)", tyres), 1e-12);
    let (names, rows) = table(include_str!("../vehicle/magic.csv"));
    assert_eq!(names, ["t", "heading", "yaw_rate", "v_y", "x", "y"]);
    assert_eq!(rows.len(), run.series.time.len());
    for (k, row) in rows.iter().enumerate() {
        for (name, value) in names.iter().zip(row).skip(1) {
            close(signal(&run, &format!("car.{name}"))[k], *value, 1e-8, name);
        }
    }
    assert!(rows.iter().any(|row| row[2].abs() > 0.6));
}

/// On a steady circle `r = u δ / (L + K u²)` with `K = m/L (b/C_f − a/C_r)`, the acceleration is u r, the way a circle, and on the wheels acts the front
/// axle's share of the force times both trails.
#[test]
fn a_steady_circle_has_the_understeer_gradient_of_its_closed_form() {
    let (m, a, b, front, rear, delta) = (1500.0, 1.2, 1.5, 90e3, 110e3, 0.02);
    for (u, trails) in [(5.0, [0.0, 0.0]), (20.0, [0.0, 0.0]), (40.0, [0.025, 0.0]), (30.0, [0.02, 0.04])] {
        let keys = format!(
            "{}\nrelaxation_length = \"0.5 m\"\ncaster_trail = \"{} m\"\npneumatic_trail = \"{} m\"\ntrack = \"1.5 m\"",
            plain(&format!("{u} m/s")),
            trails[0],
            trails[1]
        );
        let run = by(&car("0.02 rad", &keys, "[scenario]\nduration = \"30 s\"\n"), 1e-11);
        let r = last(&run, "car.yaw_rate");
        // The force of the front tyres acts behind their axle by the pneumatic trail.
        let (arm, whole) = (a - trails[1], a - trails[1] + b);
        let gradient = m / whole * (b / front - arm / rear);
        let exact = u * delta / (a + b + gradient * u * u);
        close(r, exact, 1e-9, "yaw rate");
        close(last(&run, "car.a_y"), u * r, 1e-9, "lateral acceleration");
        close(last(&run, "car.v_rr"), u + 0.75 * r, 1e-12, "speed of a wheel");
        let force = m * u * r * b / whole;
        close(last(&run, "car_steering.tau"), -force * (trails[0] + trails[1]), 1e-7, "aligning torque");
        let v = last(&run, "car.v_y");
        let [heading, x, y] = ["heading", "x", "y"].map(|name| signal(&run, &format!("car.{name}")));
        let n = heading.len() - 1;
        // Rates of a circle between two late rows.
        let half_angle = (heading[n] - heading[n - 1]) / 2.0;
        let chord = (x[n] - x[n - 1]).hypot(y[n] - y[n - 1]);
        close(chord, 2.0 * (u * u + v * v).sqrt() / r * half_angle.sin(), 1e-8, "chord");
    }
}

/// Eigenvalues of a car whose wheels are held.
fn eigenvalues(speed: &str, keys: &str) -> Vec<Complex> {
    let numbers = "mass = \"2000 kg\"\nyaw_inertia = \"3000 kg m^2\"\nfront_axle = \"1.3 m\"\nrear_axle = \"1.2 m\"\n\
                   front_stiffness = \"80 kN/rad\"\nrear_stiffness = \"80 kN/rad\"\n";
    let source = format!(
        "[shaft.hand]\n[constraint.held]\ncoefficients = {{ hand = 1 }}\n\
         [vehicle.car]\nsteered_by = \"hand\"\nsteering_ratio = 1\n{numbers}speed = \"{speed}\"\n{keys}\n"
    );
    let project = Project::open(&source);
    let analysis = project
        .analyze(&AnalyzeSettings::default(), &Silent)
        .unwrap_or_else(|diagnostics| panic!("{}\n---\n{source}", kardan::diagnostics::plain(&source, &diagnostics)));
    analysis.modes.iter().map(|mode| mode.eigenvalue).collect()
}

/// A car that oversteers is stable below `u² = C_f C_r L² / (m (a C_f − b C_r))`, here 50 m/s, and not above; there it has one more eigenvalue at zero,
/// exactly. A relaxation length moves others, not this one.
#[test]
fn the_critical_speed_is_exact() {
    for keys in ["", "relaxation_length = \"0.5 m\""] {
        let zeros = |all: &[Complex]| all.iter().filter(|one| one.re == 0.0 && one.im == 0.0).count();
        let [below, critical, above] =
            ["49.999999 m/s", "50 m/s", "50.000001 m/s"].map(|speed| eigenvalues(speed, keys));
        assert_eq!(zeros(&critical), zeros(&below) + 1, "{keys} {below:?} {critical:?}");
        assert_eq!(zeros(&below), zeros(&above), "{keys}");
        assert!(below.iter().all(|one| one.re <= 0.0), "{below:?}");
        assert!(critical.iter().all(|one| one.re <= 0.0), "{critical:?}");
        let grows: Vec<f64> = above.iter().map(|one| one.re).filter(|re| *re > 0.0).collect();
        assert!(grows.len() == 1 && grows[0] < 1e-5, "{grows:?}");
    }
}

const ROLL: &str = "height = \"0.55 m\"\ntrack = \"1.5 m\"\nroll_stiffness = \"60 kN m/rad\"\nroll_damping = \"3500 N m s/rad\"\n\
                    roll_inertia = \"500 kg m^2\"\nroll_height = \"0.1 m\"\n";

/// On a steady circle a car rolls by `φ = m e a_y / (k − m g e)`, and what that and its links move from wheel to wheel holds the moment of all forces; it turns as a
/// car that does not roll.
#[test]
fn a_car_rolls_by_its_closed_form() {
    let (m, g, e, u) = (1500.0, 9.80665, 0.45, 20.0);
    for share in ["", "roll_share = 0.6\n"] {
        let keys = format!("{}\nrelaxation_length = \"0.5 m\"\n{ROLL}{share}", plain(&format!("{u} m/s")));
        let run = by(&car("0.02 rad", &keys, "[scenario]\nduration = \"30 s\"\n"), 1e-11);
        let (r, a_y) = (last(&run, "car.yaw_rate"), last(&run, "car.a_y"));
        let gradient = m / 2.7 * (1.5 / 90e3 - 1.2 / 110e3);
        close(r, u * 0.02 / (2.7 + gradient * u * u), 1e-9, "yaw rate");
        close(a_y, u * r, 1e-8, "lateral acceleration");
        let roll = m * e * a_y / (60e3 - m * g * e);
        close(last(&run, "car.roll"), roll, 1e-8, "roll");
        let load = |wheel: &str| last(&run, &format!("car.load_{wheel}"));
        let [front, rear] = [["fl", "fr"], ["rl", "rr"]].map(|[left, right]| (load(right) - load(left)) / 2.0);
        // About the road: forces of the tyres act there, inertia and weight at the centre of gravity.
        close((front + rear) * 1.5, m * (a_y * 0.55 + g * e * roll), 1e-4, "moment");
        let share = if share.is_empty() { 1.5 / 2.7 } else { 0.6 };
        close(front * 1.5, share * 60e3 * roll + 1.5 / 2.7 * m * a_y * 0.1, 1e-4, "front");
        close(load("fl") + load("fr") + load("rl") + load("rr"), m * g, 1e-9, "weight");
    }
}

/// Eigenvalues of a car that rolls are those of the equations with the lateral velocity of the axis of roll, where inertia couples both:
/// `m (v̇ − e φ̈ + u r) = F_f + F_r`, `I_z ṙ = a F_f − b F_r`, `(I_x + m e²) φ̈ − m e (v̇ + u r) = −(k − m g e) φ − c φ̇`.
#[test]
fn a_car_that_rolls_has_the_eigenvalues_of_its_equations() {
    let (m, iz, a, b, cf, cr, e, ix) = (2000.0, 3000.0, 1.3, 1.2, 80e3, 80e3, 0.45, 500.0);
    let (k, c): (f64, f64) = (60e3 - m * 9.80665 * e, 3500.0);
    for u in [10.0, 40.0] {
        let found = eigenvalues(&format!("{u} m/s"), ROLL);
        // Rows over v, r, φ, φ̇ of `M λ − B`.
        let determinant = |re: f64, im: f64| -> f64 {
            let l = (re, im);
            let one = |x: f64| (x, 0.0);
            let rows = [
                [add(scale(l, m), one((cf + cr) / u)), one(m * u + (cf * a - cr * b) / u), one(0.0), scale(l, -m * e)],
                [one((a * cf - b * cr) / u), add(scale(l, iz), one((a * a * cf + b * b * cr) / u)), one(0.0), one(0.0)],
                [one(0.0), one(0.0), l, one(-1.0)],
                [scale(l, -m * e), one(-m * e * u), one(k), add(scale(l, ix + m * e * e), one(c))],
            ];
            size(determinant_of(rows)) / (m * iz * (ix + m * e * e) * (1.0 + size(l)).powi(4))
        };
        let moving: Vec<&Complex> = found.iter().filter(|one| one.re != 0.0 || one.im != 0.0).collect();
        assert_eq!(moving.iter().map(|one| if one.im == 0.0 { 1 } else { 2 }).sum::<usize>(), 4, "{found:?}");
        for one in moving {
            assert!(determinant(one.re, one.im) < 1e-9, "{one:?} at {u} m/s: {}", determinant(one.re, one.im));
            assert!(determinant(one.re * 1.001 + 0.01, one.im) > 1e-7, "the test sees nothing");
        }
    }
}

type C = (f64, f64);

fn add(a: C, b: C) -> C {
    (a.0 + b.0, a.1 + b.1)
}

fn scale(a: C, x: f64) -> C {
    (a.0 * x, a.1 * x)
}

fn times(a: C, b: C) -> C {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

fn size(a: C) -> f64 {
    a.0.hypot(a.1)
}

/// By the first row.
fn determinant_of<const N: usize>(rows: [[C; N]; N]) -> C {
    fn minor(rows: &[Vec<C>]) -> C {
        if rows.len() == 1 {
            return rows[0][0];
        }
        (0..rows.len()).fold((0.0, 0.0), |sum, k| {
            let submatrix: Vec<Vec<C>> = rows[1..]
                .iter()
                .map(|row| row.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, x)| *x).collect())
                .collect();
            add(sum, scale(times(rows[0][k], minor(&submatrix)), if k % 2 == 0 { 1.0 } else { -1.0 }))
        })
    }
    minor(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
}

/// The stiffer its springs, the less a car rolls, in a manoeuvre at the limit, with loads that cost friction. One that does not roll at all moves its loads by u r in place
/// of the acceleration: that is what is left. The energy balance closes.
#[test]
fn a_stiff_car_does_not_roll() {
    let run = |more: &str| {
        let keys = format!(
            "{}\nrelaxation_length = \"0.5 m\"\ntyre = \"tmeasy\"\nmu = 0.9\nload_sensitivity = 0.2\nheight = \"0.55 m\"\ntrack = \"1.5 m\"\n{more}",
            plain("25 m/s")
        );
        by(&car("0.06 rad * sin(2 pi t * 0.7 Hz)", &keys, "[scenario]\nduration = \"1.5 s\"\n"), 1e-9)
    };
    let rolling = |k: f64| {
        let c = 2.0 * (500.0 * k).sqrt();
        let run = run(&format!(
            "roll_stiffness = \"{k} N m/rad\"\nroll_damping = \"{c} N m s/rad\"\nroll_inertia = \"500 kg m^2\"\nroll_height = \"0.1 m\"\n"
        ));
        assert!(run.energy.residual.abs() < 1e-6 * run.energy.exchanged, "{:?}", run.energy);
        run
    };
    let apart = |one: &Run, other: &Run| {
        let pairs = signal(one, "car.yaw_rate").iter().zip(signal(other, "car.yaw_rate"));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let [soft, firm, stiff] = [6e4, 6e6, 6e8].map(rolling);
    let most = |run: &Run| signal(run, "car.roll").iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(most(&soft) > 0.05 && most(&stiff) < 1e-5, "{} {}", most(&soft), most(&stiff));
    let [soft, firm] = [apart(&soft, &stiff), apart(&firm, &stiff)];
    assert!(soft > 5e-3 && firm < soft / 50.0, "{soft} {firm}");
    assert!(apart(&stiff, &run("")) < 2e-3);
}

/// On the spot the tyres twist, and slide at their limit: `M = μ M₀ (1 − exp(−c δ / (μ M₀)))` on the way out, and on the way back from M₁
/// `−μ M₀ + (M₁ + μ M₀) exp(−c (δ₁ − δ) / (μ M₀))`.
#[test]
fn parking_takes_the_bore_torque() {
    let keys = format!(
        "{}\nrelaxation_length = \"0.5 m\"\nbore_torque = \"300 N m\"\nbore_stiffness = \"4000 N m/rad\"\nmu = 0.8",
        plain("0 m/s")
    );
    let still = "[constraint.still]\ncoefficients = { car_yaw = 1 }\n[scenario]\nduration = \"2 s\"\noutput_step = \"0.01 s\"\n";
    let run = by(&car("0.3 rad * sin(pi * t / 2 s)", &keys, still), 1e-11);
    let most = 240.0_f64;
    let peak = most * (1.0 - (-4000.0 * 0.3 / most).exp());
    for (k, t) in run.series.time.iter().enumerate() {
        let angle = 0.3 * (std::f64::consts::FRAC_PI_2 * t).sin();
        let exact = match *t <= 1.0 {
            true => most * (1.0 - (-4000.0 * angle / most).exp()),
            false => -most + (peak + most) * (-4000.0 * (0.3 - angle) / most).exp(),
        };
        close(signal(&run, "car_steering.tau")[k], -exact, 1e-7, &format!("torque at {t}"));
    }
    assert!(run.energy.residual_share().is_some_and(|part| part < 1e-7), "{:?}", run.energy);
}

/// From standstill on, over a road that gets slippery, with wind and a slope: nothing is singular, and the energy balance closes.
#[test]
fn a_car_drives_off_from_standstill() {
    let keys = format!(
        "{}\nrelaxation_length = \"0.5 m\"\ntyre = \"magic_formula\"\nmu = \"grip\"\ncaster_trail = \"25 mm\"\npneumatic_trail = \"35 mm\"\n\
         bore_torque = \"300 N m\"\nbore_stiffness = \"4000 N m/rad\"\nwind = \"gust\"\nwind_arm = \"0.3 m\"\ncross_slope = 0.02",
        plain("pace")
    );
    let more = "[signal.pace]\nkind = \"ramp\"\nto = \"20 m/s\"\nstart = \"1 s\"\nover = \"5 s\"\n\
                [signal.grip]\nkind = \"ramp\"\nfrom = 1\nto = 0.3\nstart = \"6 s\"\nover = \"0.5 s\"\n\
                [signal.gust]\nkind = \"pulses\"\nhigh = \"500 N\"\nlow = \"0 N\"\nperiod = \"20 s\"\nwidth = \"2 s\"\nstart = \"3 s\"\n\
                [scenario]\nduration = \"10 s\"\n";
    let run = by(&car("0.05 rad * sin(pi * t / 2 s)", &keys, more), 1e-10);
    assert!(run.series.signals.iter().flat_map(|signal| &signal.values).all(|x| x.is_finite()));
    assert!(run.energy.residual_share().is_some_and(|part| part < 1e-7), "{:?}", run.energy);
    assert!(last(&run, "car.x") > 90.0 && last(&run, "car.yaw_rate").abs() < 2.0);
}

/// A car whose speed falls below zero in a run is told, from when on; one that stops is not.
#[test]
fn a_car_that_drives_backwards_is_reported() {
    let notes = |speed: &str| {
        let keys = format!("{}\nrelaxation_length = \"0.5 m\"", plain(speed));
        by(&car("0.01 rad * t / 1 s", &keys, "[scenario]\nduration = \"2.5 s\"\noutput_step = \"10 ms\"\n"), 1e-9)
            .warnings
    };
    let reported = notes("2 m/s - 1 m/s^2 * t");
    let note = reported.iter().find(|note| note.contains("drives backwards")).unwrap_or_else(|| panic!("{reported:?}"));
    assert!(note.starts_with("`car` drives backwards from 2.0100 s on, at up to 0.5000 m/s"), "{note}");
    let stopping = notes("max(0 m/s, 2 m/s - 1 m/s^2 * t)");
    assert!(stopping.iter().all(|note| !note.contains("backwards")), "{stopping:?}");
}

/// A car that spins while its speed along itself is given gains speed on its way, which is told, from when on; one that holds is not.
#[test]
fn a_car_that_slides_sideways_is_reported() {
    let ran = |rear: f64| {
        let keys = format!("{}\ntyre = \"magic_formula\"\nmu = 0.8\nmu_rear = {rear}", plain("25 m/s"));
        by(&car("0.05 rad", &keys, "[scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\n"), 1e-8)
    };
    let spins = ran(0.05);
    let note = spins.warnings.iter().find(|note| note.contains("slides sideways")).expect("it spins");
    let [direction, across] = ["car.v_x", "car.v_y"].map(|name| signal(&spins, name));
    let way: Vec<f64> = direction.iter().zip(across).map(|(x, y)| (x * x + y * y).sqrt()).collect();
    let first = (0..way.len()).find(|row| way[*row] > 1.1 * 25.0).expect("it gains speed");
    assert!(note.starts_with(&format!("`car` slides sideways from {:.4} s on", spins.series.time[first])), "{note}");
    let most = way.iter().copied().fold(0.0, f64::max);
    assert!(
        note.contains(&format!("at a total speed of up to {most:.4} m/s with 25.0000 m/s along its longitudinal axis")),
        "{note}"
    );
    let stable = ran(0.8);
    assert!(stable.warnings.is_empty(), "{:?}", stable.warnings);
}

/// A formula that divides by what is zero where a run begins ends the run there, and says by what; a car whose speed begins there is refused, if its tyres follow at once.
#[test]
fn what_divides_by_zero_where_a_run_begins_is_reported() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\n[torque.x]\nshaft = \"a\"\nlaw = \"1 N m s / t\"\n[scenario]\nduration = \"1 s\"\n";
    let project = Project::open(source);
    let study = project.run(&crate::common::runs_only(), &Silent).expect("it is prepared");
    let text = format!("{:?}", study.runs[0].outcome);
    assert!(text.contains("1.0/t = 1.0/0.0 is inf"), "{text}");
    let keys = plain("v");
    let source = car("0.02 rad", &keys, "[signal.v]\nkind = \"ramp\"\nto = \"20 m/s\"\nover = \"1 s\"\n");
    let (_, found) = kardan::study::prepare(&source);
    let reported = kardan::diagnostics::plain(&source, &found);
    assert!(
        reported.contains("the signal `v` at 0 s is 0 m/s") && reported.contains("relaxation_length"),
        "{reported}"
    );
}

/// A road whose friction falls below zero in a run is told, from when on, and the run goes on; one that stays above is not told.
#[test]
fn zero_road_friction_is_reported() {
    let of = |mu: &str| {
        let keys = format!("{}\nrelaxation_length = \"0.5 m\"\ntyre = \"tmeasy\"\nmu = \"{mu}\"", plain("20 m/s"));
        by(&car("0.02 rad", &keys, "[scenario]\nduration = \"3 s\"\noutput_step = \"10 ms\"\n"), 1e-8).warnings
    };
    let reported = of("0.5 - t / (4 s)");
    assert!(
        reported.iter().any(|note| note.contains("`car.friction` is zero or less from 2.0000 s on")),
        "{reported:?}"
    );
    assert!(of("0.5 - t / (7 s)").iter().all(|note| !note.contains("friction")));
}

/// The model of the page on cars runs, and its requirement holds.
#[test]
fn the_page_runs() {
    let page = include_str!("../../../../docs/vehicle.md");
    let model = page.split("```toml\n").nth(1).and_then(|tail| tail.split("```").next()).expect("a model");
    let run = run_by(model, Method::Automatic, None);
    assert!(run.requirements.iter().all(|one| one.passed), "{:?}", run.requirements);
    assert!(last(&run, "car.x") > 100.0);
    assert!(signal(&run, "car_steering.f").iter().any(|force| force.abs() > 100.0));
}

/// A curve through points on a line is an arm: the same way, and the same force on the rack.
#[test]
fn a_straight_curve_is_an_arm() {
    let by = |steering: &str| {
        let keys = plain("20 m/s")
            + "\nrelaxation_length = \"0.5 m\"\ncaster_trail = \"25 mm\"\nwheel_inertia = \"2 kg m^2\"\n";
        let source = format!(
            "[mass.rack]\nmass = \"3 kg\"\ndamping = \"800 N s/m\"\n[motor.push]\nmass = \"rack\"\n[vehicle.car]\nsteered_by = \"rack\"\n{steering}\n{keys}\
             [scenario]\nduration = \"2 s\"\nsignals = {{ \"push.f\" = \"300 N * sin(pi * t / 1 s)\" }}\n"
        );
        by(&source, 1e-11)
    };
    let arm = by("steering_arm = \"140 mm\"");
    let point = |angle: f64| format!("{{ angle = \"{angle} rad\", position = \"{} mm\" }}", 140.0 * angle);
    let curve = by(&format!("curve = [{}, {}, {}]", point(-0.5), point(0.25), point(0.5)));
    assert!(last(&arm, "car.y").abs() > 0.1);
    for name in ["rack.s", "car.y", "car.heading", "car_steering.f"] {
        for (one, other) in signal(&arm, name).iter().zip(signal(&curve, name)) {
            close(*one, *other, 1e-6, name);
        }
    }
}

/// Without roll the inner wheels of both axles leave the ground where `a_y = g T/(2 h)`: a car that goes on turning is told to roll over there, on the
/// side that the bend is on; one that stays below is not.
#[test]
fn a_car_whose_inner_wheels_lift_is_reported_as_rolling_over() {
    let (height, track, g, u) = (0.9, 1.2, 9.80665, 20.0);
    for side in [1.0, -1.0] {
        for (most, tips) in [(0.1, true), (0.01, false)] {
            let keys = format!(
                "{}\nheight = \"{height} m\"\ntrack = \"{track} m\"\nrelaxation_length = \"0.5 m\"\n",
                plain(&format!("{u} m/s"))
            );
            let turns = format!(
                "[signal.turns]\nkind = \"smooth_step\"\nto = \"{} rad\"\nover = \"4 s\"\n[scenario]\nduration = \"6 s\"\noutput_step = \"1 ms\"\n",
                side * most
            );
            let run = by(&car("turns", &keys, &turns), 1e-9);
            let limit = g * track / (2.0 * height) / u;
            let first = signal(&run, "car.yaw_rate").iter().position(|rate| rate.abs() >= limit);
            assert_eq!(first.is_some(), tips);
            let place = if side > 0.0 { "left" } else { "right" };
            let reported: Vec<&String> = run.warnings.iter().filter(|note| note.contains("rolls over")).collect();
            assert_eq!(reported.len(), usize::from(tips), "{:?}", run.notes);
            if let (Some(row), [reported]) = (first, &reported[..]) {
                let expected = format!(
                    "Both wheels of `car` on its {place} are off the ground from {:.4} s on",
                    run.series.time[row]
                );
                assert!(reported.starts_with(&expected), "{expected}: {reported}");
            }
        }
    }
}
