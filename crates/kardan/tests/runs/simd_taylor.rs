//! Sweeps whose runs go side by side in lanes: closed forms, the same bits in any lanes, and how far they are from runs one by one.

use kardan::model::builtin;
use kardan::project::Project;
use kardan::results::{RowAgain, Sweep, SweepRow, SweepRows};
use kardan::simulate::Method;
use kardan::study::{Progress, Settings, Silent, SweepSettings};

/// A body that a ramp breaks away from its friction, and one that its friction brings to rest.
const BODIES: &str = "\
[shaft.a]
inertia = \"2 kg m^2 ± 10 %\"
friction = \"1 N m ± 20 %\"

[shaft.b]
inertia = \"2 kg m^2 ± 10 %\"
friction = \"1 N m ± 20 %\"

[motor.m]
shaft = \"a\"

[scenario]
duration = \"3 s\"
initial = { \"b.w\" = \"1 rad/s\" }

[[scenario.event]]
signal = \"m.tau\"
at = \"0 s\"
to = \"3 N m\"
over = \"3 s\"

[[figure]]
name = \"driven\"
signal = \"a.phi\"
measure = \"final\"

[[figure]]
name = \"stopped\"
signal = \"b.phi\"
measure = \"final\"
";

fn settings(samples: u64, method: Method, tolerance: f64) -> SweepSettings {
    let run = Settings { method, tolerance: Some(tolerance), ..Settings::default() };
    SweepSettings { samples: Some(samples), run, ..SweepSettings::default() }
}

fn swept(project: &Project, settings: &SweepSettings) -> (Vec<SweepRow>, Sweep) {
    let plan = project.sweep_plan(settings).unwrap();
    let mut rows = SweepRows::default();
    let found = project.sweep(&plan, &settings.run, &mut rows, &Silent, &mut |_, _| Ok(())).unwrap();
    (rows.iter().map(|row| row.to_row()).collect(), found)
}

/// With the joint bent most.
fn bent(settings: SweepSettings) -> SweepSettings {
    SweepSettings { variants: vec!["beta-30deg".into()], ..settings }
}

/// The built-in steering system, with figures of what moves fast.
fn steering() -> Project {
    let figure = |name: &str, signal: &str, measure: &str| {
        format!("[[figure]]\nname = \"{name}\"\nsignal = \"{signal}\"\nmeasure = \"{measure}\"\n")
    };
    let source = builtin("sia-steering").unwrap().source;
    let figures = [
        figure("fastest", "wg.w", "max_abs"),
        figure("twist", "torsion_bar.tau", "max_abs"),
        figure("hand", "driver.tau", "rms"),
        figure("end", "fs.phi", "final"),
    ];
    Project::open(format!("{source}\n{}", figures.concat()))
}

/// A coefficient may be a multiple of what varies.
#[test]
fn multiples_go_side_by_side_too() {
    let multiplied = BODIES.replace(
        "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"",
        "[parameters]\nm = \"2 kg ± 10 %\"\n[shaft.a]\ninertia = \"3*m*(1 m)^2\"",
    );
    let (rows, found) = swept(&Project::open(multiplied.as_str()), &settings(20, Method::Automatic, 1e-10));
    assert!(found.compared.is_some_and(|compared| compared.difference < 1e-9));
    let place = |name: &str| found.varied.iter().position(|one| one.name == name).unwrap();
    for row in &rows {
        let (slip_time, inertia) = (3.0 - row.values[place("a.friction")], 3.0 * row.values[place("m")]);
        let driven = slip_time * slip_time * slip_time / (6.0 * inertia);
        assert!((row.figures[0] - driven).abs() < 1e-9 * driven, "{row:?}: {driven}");
    }
}

/// What has a list of values is seen to matter, also where two places in it have the same one.
#[test]
fn values_of_lists_count() {
    let listed = BODIES.replace(
        "inertia = \"2 kg m^2 ± 10 %\"\nfriction = \"1 N m ± 20 %\"\n\n[motor",
        "inertia = \"j\"\nfriction = \"1 N m ± 20 %\"\n\n[motor",
    );
    let text = format!(
        "[parameters]\nj = \"2 kg m^2\"\n[sweep]\nlists = {{ j = [\"2 kg m^2\", \"2 kg m^2\", \"3 kg m^2\"] }}\n{listed}"
    );
    let (rows, found) = swept(&Project::open(text.as_str()), &settings(30, Method::Automatic, 1e-10));
    assert!(found.compared.is_some_and(|compared| compared.difference < 1e-9));
    let place = |name: &str| found.varied.iter().position(|one| one.name == name).unwrap();
    let mut counts = [0; 2];
    for row in &rows {
        // With a table the list alone varies, with the tolerances that it names.
        let inertia = row.values[place("j")];
        counts[usize::from(inertia == 3.0)] += 1;
        let stopped =
            inertia / 2.0 / found.varied.iter().position(|one| one.name == "b.friction").map_or(1.0, |k| row.values[k]);
        assert!((row.figures[1] - stopped).abs() < 1e-9 * stopped, "{row:?}: {stopped}");
    }
    assert!(counts[0] > 0 && counts[1] > 0, "{counts:?}");
}

/// A ramp k t breaks away at c/k: the way is then k (T − c/k)³/6J. What slides with ω comes to rest after J ω²/2c.
#[test]
fn breaking_away_and_coming_to_rest_have_their_closed_forms() {
    let (rows, found) = swept(&Project::open(BODIES), &settings(100, Method::Automatic, 1e-10));
    assert!(found.compared.as_ref().is_some_and(|compared| compared.rows == 4), "{:?}", found.compared);
    let names: Vec<&str> = found.varied.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["a.friction", "a.inertia", "b.friction", "b.inertia"]);
    for row in &rows {
        let [ca, ja, cb, jb] = row.values[..] else { panic!("{row:?}") };
        let slip_time = 3.0 - ca;
        let (driven, stopped) = (slip_time * slip_time * slip_time / (6.0 * ja), jb / (2.0 * cb));
        assert!((row.figures[0] - driven).abs() < 1e-9 * driven, "{row:?}: {driven}");
        assert!((row.figures[1] - stopped).abs() < 1e-9 * stopped, "{row:?}: {stopped}");
    }
}

/// A run has the same bits in one lane, in four and in eight, in any company, on any threads.
#[test]
fn bits_do_not_depend_on_lanes_nor_threads() {
    let project = steering();
    let of = |lanes: Option<usize>, samples: u64| SweepSettings {
        lanes,
        ..bent(settings(samples, Method::Automatic, 1e-6))
    };
    let (rows, found) = swept(&project, &of(None, 32));
    let bits = |rows: &[SweepRow]| -> Vec<u64> {
        let numbers = |row: &SweepRow| [&row.values[..], &row.measured, &row.passed, &row.figures].concat();
        rows.iter().flat_map(numbers).map(f64::to_bits).collect()
    };
    assert!(found.compared.is_some());
    for lanes in [1, 4, 8] {
        assert!(bits(&swept(&project, &of(Some(lanes), 32)).0) == bits(&rows), "{lanes} lanes");
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let other = pool.install(|| swept(&project, &of(None, 32)).0);
        assert!(bits(&other) == bits(&rows), "{threads} threads");
    }
    // A row again as a whole run has its figures and verdicts.
    let plan = project.sweep_plan(&of(None, 32)).unwrap();
    let row = &rows[11];
    let values = plan.head.varied.iter().zip(&row.values).map(|(one, value)| (one.name.clone(), *value)).collect();
    let again = RowAgain { sample: row.sample, variant: plan.head.variants[row.variant].clone(), values };
    let run = Settings { runs_only: true, ..of(None, 32).run };
    let study = project.rows_again(&plan.head.identity, &[again], &run).unwrap().run(&run, &Silent).unwrap();
    let figures: Vec<Option<f64>> = study.runs[0].figures.iter().map(|figure| figure.value).collect();
    assert_eq!(figures, row.figures.iter().map(|value| Some(*value)).collect::<Vec<_>>());
    assert_eq!(study.runs[0].requirements[1].measured, Some(row.measured[1]));
    assert!(study.runs[0].series.signal("cs.w").is_some());
}

/// Runs in lanes against runs one by one by another method with a tighter tolerance; what the sweep says of it covers the difference.
#[test]
fn lanes_are_near_the_reference() {
    let project = steering();
    let (rows, found) = swept(&project, &bent(settings(12, Method::Automatic, 1e-9)));
    let (reference_rows, reference) = swept(&project, &bent(settings(12, Method::Dop853, 1e-11)));
    assert!(reference.compared.is_none() && reference_rows.iter().all(|row| row.difference.is_none()));
    let mut most = 0.0f64;
    for (row, other) in rows.iter().zip(&reference_rows) {
        for (a, b) in row.figures.iter().zip(&other.figures) {
            most = most.max((a - b).abs() / b.abs());
        }
    }
    // The speed of the wave generator has edges that rows cut.
    assert!(most < 1e-7, "{most:e}");
    let reported = found.compared.unwrap();
    assert!(reported.rows == 4 && reported.difference < 1e-7, "{reported:?}");
}

/// Where what varies is more than a coefficient of the equations, or a loop is more than its plan, runs go one by one.
#[test]
fn unsupported_sweeps_run_one_by_one() {
    let initial = BODIES.replace("\"1 rad/s\"", "\"1 rad/s ± 10 %\"");
    let follows = BODIES.replace(
        "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"",
        "[parameters]\nm = \"2 kg ± 10 %\"\n[shaft.a]\ninertia = \"m*m*1 m^2/kg\"",
    );
    let limited =
        BODIES.replace("shaft = \"a\"\n\n[scenario]", "shaft = \"a\"\ntorque_limit = \"2 N m\"\n\n[scenario]");
    let rate = BODIES.replace("shaft = \"a\"\n\n[scenario]", "shaft = \"a\"\nrate_limit = \"2 N m/s\"\n\n[scenario]");
    let sensor = "[sensor.s]\nmeasures = \"angle\"\nshaft = \"b\"\nlines = 100\n\n[scenario]";
    let read = BODIES.replace("[scenario]", sensor).replace("signal = \"b.phi\"", "signal = \"s.phi\"");
    let events = BODIES.replace("signal = \"b.phi\"\nmeasure = \"final\"", "signal = \"b.phi\"\nmeasure = \"events\"");
    for (text, why) in [
        (initial, "`scenario.initial.b.w` affects more than inertias"),
        (follows, "`m` affects more than inertias"),
        (limited, "a torque limit applies to a ramp, a time function or a law without sample time"),
        (rate, "a motor has a rate limit"),
        (read, "a figure or a requirement reads a signal that SIMD lanes do not compute"),
        (events, "figures or requirements count events"),
    ] {
        let project = Project::open(text.as_str());
        let (settings, messages) = (settings(4, Method::Automatic, 1e-8), Messages::default());
        let (plan, mut rows) = (project.sweep_plan(&settings).unwrap(), SweepRows::default());
        let found = project.sweep(&plan, &settings.run, &mut rows, &messages, &mut |_, _| Ok(())).unwrap();
        assert!(
            found.compared.is_none() && rows.iter().all(|row| row.reason.is_empty()),
            "{text}: {:?} {rows:?}",
            found.compared
        );
        let messages = messages.0.into_inner().unwrap();
        assert!(
            messages.len() == 1
                && messages[0].starts_with("kardan runs samples one by one")
                && messages[0].contains(why),
            "{messages:?}"
        );
    }
}

/// What is said in a run.
#[derive(Default)]
struct Messages(std::sync::Mutex<Vec<String>>);

impl Progress for Messages {
    fn advance(&self, _: usize, _: &str, _: f64) {}

    fn message(&self, text: &str) {
        self.0.lock().unwrap().push(text.into());
    }
}

/// Numbers from 0 to 1 that follow from a seed.
struct Lots(u64);

impl Lots {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    /// Even in its logarithm, with four digits.
    fn size(&mut self, from: f64, to: f64) -> String {
        let (low, high) = (kardan_rt::functions::ln(from), kardan_rt::functions::ln(to));
        format!("{:.3e}", kardan_rt::functions::exp(self.between(low, high)))
    }
}

/// Shafts with frictions behind springs, gears and bent joints, some of them stiffly joined, so that frictions depend on each other; a motor with steps and ramps.
fn drivetrain(seed: u64) -> String {
    let (mut lots, mut text) = (Lots(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1), String::new());
    let shafts = 1 + (lots.unit() * 6.0) as usize;
    for k in 0..shafts {
        text += &format!("[shaft.s{k}]\ninertia = \"{} kg m^2 ± 10 %\"\n", lots.size(1e-3, 1.0));
        if lots.unit() < 0.8 {
            text += &format!("friction = \"{} N m ± 20 %\"\n", lots.size(1e-2, 3.0));
        }
        if lots.unit() < 0.6 {
            text += &format!("damping = \"{} N m s/rad ± 20 %\"\n", lots.size(1e-3, 0.3));
        }
        text += &format!("[[figure]]\nname = \"p{k}\"\nsignal = \"s{k}.phi\"\nmeasure = \"final\"\n");
        text += &format!("[[figure]]\nname = \"w{k}\"\nsignal = \"s{k}.w\"\nmeasure = \"max_abs\"\n");
    }
    for k in 1..shafts {
        let ends = format!("shaft_1 = \"s{}\"\nshaft_2 = \"s{k}\"\n", (lots.unit() * k as f64) as usize);
        let kind = lots.unit();
        if kind < 0.6 {
            let (stiffness, damping) = (lots.size(1.0, 1e3), lots.size(1e-3, 0.1));
            text += &format!(
                "[spring_damper.c{k}]\n{ends}stiffness = \"{stiffness} N m/rad ± 15 %\"\ndamping = \"{damping} N m s/rad ± 20 %\"\n"
            );
        } else if kind < 0.84 {
            text += &format!("[gear.g{k}]\n{ends}ratio = {:.1}\n", lots.between(0.5, 4.0));
        } else {
            text += &format!("[universal_joint.u{k}]\n{ends}angle = \"{:.0} deg\"\n", lots.between(5.0, 35.0));
        }
    }
    text += "[motor.m]\nshaft = \"s0\"\n[scenario]\nduration = \"2 s\"\noutput_step = \"5 ms\"\n";
    if lots.unit() < 0.5 {
        text += &format!("initial = {{ \"s0.w\" = \"{:.3} rad/s\" }}\n", lots.between(-5.0, 5.0));
    }
    let mut at = 0.0;
    for _ in 0..1 + (lots.unit() * 4.0) as usize {
        at += lots.between(0.05, 0.5);
        let to = lots.between(-4.0, 4.0);
        text += &format!("[[scenario.event]]\nat = \"{at:.3} s\"\nsignal = \"m.tau\"\nto = \"{to:.3} N m\"\n");
        if lots.unit() < 0.6 {
            text += &format!("over = \"{:.3} s\"\n", lots.between(0.05, 0.8));
        }
    }
    text
}

/// Random drivetrains come to what the reference finds, those whose frictions hold together among them. `KARDAN_MODELS` asks for more of them.
#[test]
fn random_drivetrains_are_near_the_reference() {
    let count = std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(60);
    for seed in 0..count {
        let text = drivetrain(seed);
        let (_, found) = swept(&Project::open(text.as_str()), &settings(4, Method::Automatic, 1e-8));
        let reported = found.compared.unwrap_or_else(|| panic!("{seed} has no lanes:\n{text}"));
        assert!(reported.difference < 1e-4, "{seed}: {reported:?}\n{text}");
    }
}

/// What a motor follows, and a torque of the time: `A sin ω t` breaks away at `ω t₀ = asin c/A`, and `J φ = A/ω ((t − t₀) cos ω t₀ − (sin ω t − sin ω t₀)/ω) − c (t − t₀)²/2` then.
/// Where nothing moves the torques that hold tell how long steps are.
#[test]
fn functions_of_time_go_side_by_side() {
    let sine = |t: &str| format!("3 N m * sin(2 pi {t} / 6 s)");
    let events = &BODIES[BODIES.find("[[scenario.event]]").unwrap()..BODIES.find("[[figure]]").unwrap()];
    let no_events = BODIES.replace(events, "");
    let signals = format!("[scenario]\nsignals = {{ \"m.tau\" = \"{}\" }}", sine("t"));
    let torque = format!("[torque.t]\nshaft = \"a\"\nlaw = \"{}\"\n\n[scenario]", sine("t"));
    for more in [signals, torque] {
        let text = no_events.replace("[scenario]", &more);
        let (rows, found) = swept(&Project::open(text.as_str()), &settings(20, Method::Automatic, 1e-10));
        assert!(found.compared.as_ref().is_some_and(|reported| reported.difference < 1e-8), "{:?}", found.compared);
        let frequency = std::f64::consts::PI / 3.0;
        for row in &rows {
            let [ca, ja, cb, jb] = row.values[..] else { panic!("{row:?}") };
            let begin = (ca / 3.0).asin() / frequency;
            let slip_time = 3.0 - begin;
            let swung = ((frequency * 3.0).sin() - (frequency * begin).sin()) / frequency;
            let driven = (3.0 / frequency * (slip_time * (frequency * begin).cos() - swung)
                - ca * slip_time * slip_time / 2.0)
                / ja;
            let stopped = jb / (2.0 * cb);
            assert!((row.figures[0] - driven).abs() < 1e-8 * driven, "{row:?}: {driven}");
            assert!((row.figures[1] - stopped).abs() < 1e-9 * stopped, "{row:?}: {stopped}");
        }
    }
}

/// The torques that hold tell how long steps are also where nothing is read but by the machines of the lanes.
#[test]
fn static_friction_against_a_function_of_time_breaks_away() {
    let begin = BODIES.find("[[scenario.event]]").unwrap();
    let torque = "[torque.t]\nshaft = \"a\"\nlaw = \"1.3 N m * sin(2 pi t / 50 ms)\"\n\n[scenario]";
    let figure = "[[figure]]\nname = \"held\"\nsignal = \"a.friction\"\nmeasure = \"rms\"\n";
    let text = BODIES[..begin].replace("[scenario]", torque) + figure;
    let (_, found) = swept(&Project::open(text.as_str()), &settings(8, Method::Automatic, 1e-8));
    assert!(found.compared.as_ref().is_some_and(|reported| reported.difference < 1e-6), "{:?}", found.compared);
}

/// Random drivetrains with torques and signals that follow the time come to what the reference finds, as those with steps and ramps.
#[test]
fn random_drivetrains_follow_the_time() {
    let count: u64 = std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(40);
    for seed in 0..count {
        let mut lots = Lots(seed.wrapping_mul(0xd134_2543_de82_ef95) + 3);
        let wave = |lots: &mut Lots| {
            let (size, period) = (lots.size(0.3, 6.0), lots.size(0.05, 3.0));
            format!("{size} N m * sin(2 pi t / {period} s)")
        };
        let mut more = match seed % 3 {
            0 => String::new(),
            _ => format!("[torque.wave]\nshaft = \"s0\"\nlaw = \"{}\"\n", wave(&mut lots)),
        };
        if seed % 3 != 1 {
            more += "[disturbance.load]\nshaft = \"s0\"\n";
            let mut points: Vec<[String; 2]> = Vec::new();
            for k in 0..5 {
                points
                    .push([format!("\"{} s\"", 0.5 * f64::from(k)), format!("\"{:.3} N m\"", lots.between(-3.0, 3.0))]);
            }
            let column = |k: usize| points.iter().map(|point| point[k].as_str()).collect::<Vec<_>>().join(", ");
            more += &format!(
                "[signal.bump]\nkind = \"table\"\ninterpolation = \"cubic\"\npoints = {{ time = [{}], value = [{}] }}\n",
                column(0),
                column(1)
            );
        }
        let text = drivetrain(seed).replace("[motor.m]", &format!("{more}[motor.m]"));
        let text = match seed % 3 {
            1 => text,
            _ => text.replace("[scenario]\n", "[scenario]\nsignals = { \"load\" = \"bump\" }\n"),
        };
        let (_, found) = swept(&Project::open(text.as_str()), &settings(4, Method::Automatic, 1e-8));
        let reported = found.compared.unwrap_or_else(|| panic!("{seed} has no lanes:\n{text}"));
        assert!(reported.difference < 1e-4, "{seed}: {reported:?}\n{text}");
    }
}

/// Behind a bent joint a wave generator rubs and rests while the others turn with a ratio that changes: what holds is a coordinate, or has a bias of every order. Series of
/// the joint's angle have terms that are small by accident.
#[test]
fn sticking_behind_a_bent_joint_moves_as_by_the_reference() {
    let model = "\
[shaft.wg]\ninertia = \"0.02 kg m^2 ± 10 %\"\nfriction = \"50 N m ± 10 %\"\n\
[shaft.cs]\ninertia = \"0.05 kg m^2 ± 10 %\"\n\
[shaft.fs]\ninertia = \"0.2 kg m^2 ± 10 %\"\nfriction = \"0.1 N m ± 20 %\"\n\
[shaft.in]\ninertia = \"0.1 kg m^2 ± 10 %\"\n\
[harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = 5\n\
[universal_joint.u]\nshaft_1 = \"in\"\nshaft_2 = \"cs\"\nangle = \"35 deg\"\n\
[motor.m]\nshaft = \"in\"\n\
[scenario]\nduration = \"2 s\"\n\
[[scenario.event]]\nsignal = \"m.tau\"\nat = \"0.1 s\"\nto = \"1 N m\"\n\
[[figure]]\nname = \"fastest\"\nsignal = \"fs.w\"\nmeasure = \"max_abs\"\n\
[[figure]]\nname = \"end\"\nsignal = \"fs.phi\"\nmeasure = \"final\"\n\
[[figure]]\nname = \"held\"\nsignal = \"wg.w\"\nmeasure = \"max_abs\"\n";
    for coordinates in ["", "[model]\ncoordinates = [\"fs\", \"in\"]\n"] {
        let text = format!("{coordinates}{model}");
        let text = text.as_str();
        let (rows, found) = swept(&Project::open(text), &settings(8, Method::Automatic, 1e-9));
        let (reference_rows, _) = swept(&Project::open(text), &settings(8, Method::Dop853, 1e-12));
        assert!(found.compared.is_some());
        for (row, other) in rows.iter().zip(&reference_rows) {
            // It turns, and the wave generator stands: to a tolerance of the speeds that cancel in its own, 20 rad/s.
            assert!(other.figures[1] > 3.0 && other.figures[2] < 1e-9 && row.figures[2] < 2e-8, "{row:?} {other:?}");
            for (a, b) in row.figures[..2].iter().zip(&other.figures) {
                assert!((a - b).abs() < 1e-7 * b.abs(), "{row:?}: {b}");
            }
        }
    }
}

/// A body whose motor is told a torque at each sample moves from one to the next as `φ + h ω + h² u/2J` and `ω + h u/J`, within the limit of its motor and at it.
#[test]
fn a_sampled_law_steps_as_its_map_does() {
    let text = "\
[parameters]\nj = \"2 kg m^2 ± 30 %\"\n\
[shaft.a]\ninertia = \"j\"\n\
[motor.m]\nshaft = \"a\"\ntorque_limit = \"3 N m\"\n\
[control.p]\nlaw = \"position_loop\"\ndesign = { j = \"2 kg m^2\" }\noutput = \"a.phi\"\ninput = \"m\"\nnatural_frequency = \"4 rad/s\"\n\
damping_ratio = 0.5\nreference = \"r\"\nsample_time = \"20 ms\"\n\
[scenario]\nduration = \"1 s\"\n\
[[scenario.event]]\nat = \"0.1 s\"\nsignal = \"r\"\nto = \"1 rad\"\n\
[[figure]]\nname = \"angle\"\nsignal = \"a.phi\"\nmeasure = \"final\"\n\
[[figure]]\nname = \"speed\"\nsignal = \"a.w\"\nmeasure = \"final\"\n\
[[figure]]\nname = \"torque\"\nsignal = \"m.tau\"\nmeasure = \"min\"\n";
    let (rows, found) = swept(&Project::open(text), &settings(20, Method::Automatic, 1e-10));
    assert!(found.compared.is_some_and(|compared| compared.difference < 1e-9));
    for row in &rows {
        let (inertia, [mut angle, mut speed, mut least]) = (row.values[0], [0.0f64; 3]);
        // The last sample falls on the end.
        for sample in 0..=50 {
            let reference = if sample >= 5 { 1.0 } else { 0.0 };
            let command = 2.0 * (16.0 * (reference - angle) - 4.0 * speed);
            let (torque, h) = (command.clamp(-3.0, 3.0), if sample < 50 { 0.02 } else { 0.0 });
            angle += h * speed + 0.5 * h * h * torque / inertia;
            speed += h * torque / inertia;
            least = least.min(torque);
        }
        for (is, expected) in row.figures.iter().zip([angle, speed, least]) {
            assert!((is - expected).abs() < 1e-9, "{row:?}: {expected}");
        }
    }
}

/// Two bodies on a spring with frictions, on a control unit: encoder, counted and noisy twist, delay, lag, a motor at its limit, an observer.
fn drive() -> String {
    let text = "\
[shaft.a]\ninertia = \"0.01 kg m^2 ± 10 %\"\nfriction = \"0.05 N m ± 20 %\"\n\
[shaft.b]\ninertia = \"0.02 kg m^2 ± 10 %\"\nfriction = \"0.03 N m ± 20 %\"\ndamping = \"0.002 N m s/rad ± 20 %\"\n\
[spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"50 N m/rad ± 10 %\"\ndamping = \"0.02 N m s/rad ± 20 %\"\n\
[motor.m]\nshaft = \"a\"\ntorque_limit = \"0.6 N m\"\nlag = \"0.7 ms\"\n\
[sensor.e]\nmeasures = \"angle\"\nshaft = \"a\"\nlines = 2000\n\
[sensor.bar]\nmeasures = \"torque\"\nelement = \"k\"\nresolution = \"0.01 mrad\"\nnoise = \"2 mN m\"\nsample_time = \"0.5 ms\"\n\
[control.c]\nlaw = \"sampled_noninteracting\"\nsample_time = \"1 ms\"\ndelay = \"1.4 ms\"\n\
[[control.c.channels]]\noutput = \"a.phi\"\ninput = \"m\"\nbandwidth = \"30 rad/s\"\nreference = \"r\"\n\
[control.c.observer]\nsensors = [\"e.phi\", \"bar.tau\"]\n\
[scenario]\nduration = \"0.5 s\"\noutput_step = \"0.7 ms\"\n\
[[scenario.event]]\nat = \"0.05 s\"\nsignal = \"r\"\nto = \"1 rad\"\nover = \"0.2 s\"\n";
    let figures = [
        ("b.phi", "final"),
        ("b.w", "max_abs"),
        ("b.friction", "max"),
        ("a.friction", "rms"),
        ("m.tau", "max"),
        ("k.tau", "max_abs"),
    ];
    let figure = |(number, (signal, measure))| {
        format!("[[figure]]\nname = \"f{number}\"\nsignal = \"{signal}\"\nmeasure = \"{measure}\"\n")
    };
    figures.into_iter().enumerate().map(figure).fold(text.to_owned(), |text, figure| text + &figure)
}

/// What samples read and command is what the reference reads and commands; friction that holds is a signal like others.
#[test]
fn control_units_go_side_by_side() {
    let project = Project::open(drive().as_str());
    let (rows, found) = swept(&project, &settings(8, Method::Automatic, 1e-9));
    let (reference_rows, reference) = swept(&project, &settings(8, Method::Dop853, 1e-11));
    let reported = found.compared.expect("lanes");
    assert!(reference.compared.is_none() && reported.difference < 1e-6, "{reported:?}");
    for (row, other) in rows.iter().zip(&reference_rows) {
        assert!(row.figures[0] > 0.5 && row.figures[4] > 0.5 && row.figures[2] > 0.02, "{row:?}");
        for (a, b) in row.figures.iter().zip(&other.figures) {
            assert!((a - b).abs() <= 1e-6 * b.abs(), "{row:?}: {other:?}");
        }
    }
    let bits = |rows: &[SweepRow]| -> Vec<u64> {
        rows.iter().flat_map(|row| row.figures.iter().map(|x| x.to_bits())).collect()
    };
    for lanes in [1, 4] {
        let settings = SweepSettings { lanes: Some(lanes), ..settings(8, Method::Automatic, 1e-9) };
        assert!(bits(&swept(&project, &settings).0) == bits(&rows), "{lanes} lanes");
    }
}

/// The same with the first shaft under a law that computes at samples, behind a motor with a lag and, in every second one, a limit.
#[test]
fn random_drivetrains_under_sampled_laws_are_near_the_reference() {
    let count = std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(30);
    for seed in 0..count {
        let limit = if seed % 2 == 0 { "torque_limit = \"2 N m\"\n" } else { "" };
        let angle = |line: &str| if line.starts_with("to = ") { line.replace(" N m", " rad") } else { line.to_owned() };
        let text = drivetrain(seed).lines().map(|line| angle(line) + "\n").collect::<String>();
        let text = text
            .replace("signal = \"m.tau\"", "signal = \"r\"")
            .replace("[motor.m]\nshaft = \"s0\"\n", &format!("[motor.m]\nshaft = \"s0\"\nlag = \"3 ms\"\n{limit}"))
            + "[control.p]\nlaw = \"position_loop\"\noutput = \"s0.phi\"\ninput = \"m\"\nnatural_frequency = \"3 rad/s\"\ndamping_ratio = 0.7\nreference = \"r\"\n\
               sample_time = \"10 ms\"\n";
        let (rows, found) = swept(&Project::open(text.as_str()), &settings(4, Method::Automatic, 1e-8));
        let reported = found.compared.unwrap_or_else(|| panic!("{seed} has no lanes:\n{text}"));
        assert!(reported.difference < 1e-4, "{seed}: {reported:?}\n{rows:?}\n{text}");
    }
}
