//! Sweeps: samples by number alone, rows that are single runs, probabilities with closed forms.

use kardan::export::{RowsError, read_sweep_rows, sweep_rows};
use kardan::project::Project;
use kardan::results::{RowAgain, SweepRow, SweepRows, SweptParameter};
use kardan::simulate::Method;
use kardan::study::{Progress, Settings, Silent, SweepSettings};
use std::sync::atomic::{AtomicUsize, Ordering};

const MODEL: &str = "\
[shaft.a]
inertia = \"2 kg m^2 ± 10 %\"

[motor.m]
shaft = \"a\"

[scenario]
duration = \"1 s\"

[[scenario.event]]
signal = \"m.tau\"
at = \"0 s\"
to = \"4 N m\"

[[requirement]]
signal = \"a.w\"
measure = \"final\"
above = \"2 rad/s\"

[[figure]]
name = \"way\"
signal = \"a.phi\"
measure = \"final\"
";

fn swept(project: &Project, settings: &SweepSettings) -> (Vec<SweepRow>, kardan::results::Sweep) {
    let plan = project.sweep_plan(settings).unwrap();
    let mut rows = Vec::new();
    let mut write = |_: u64, found: &[SweepRow]| {
        rows.extend_from_slice(found);
        Ok(())
    };
    let found = project.sweep(&plan, &settings.run, &mut SweepRows::default(), &Silent, &mut write).unwrap();
    (rows, found)
}

fn of(samples: u64) -> SweepSettings {
    SweepSettings { samples: Some(samples), ..SweepSettings::default() }
}

/// The way at time T under the torque M is M T²/2J, the speed M T/J: probabilities and ends follow from the distribution of J alone.
#[test]
fn probabilities_are_those_of_the_closed_form() {
    let wider = MODEL.replace("± 10 %", "").replace(
        "[scenario]\n",
        "[[sweep.vary]]\nparameter = \"j\"\nfrom = \"1 kg m^2\"\nto = \"3 kg m^2\"\n[scenario]\n",
    );
    let wider = format!("[parameters]\nj = \"2 kg m^2\"\n{}", wider.replace("\"2 kg m^2 \"", "\"j\""));
    let distributions = [
        ("distribution = \"uniform\"", 0.5),
        // Below the peak lies (2 - 1)²/((3 - 1)(2.5 - 1)) of a triangle.
        ("distribution = \"triangular\"\npeak = \"2.5 kg m^2\"", 1.0 / 3.0),
        // P(Z < 1).
        ("distribution = \"normal\"\nmean = \"1.8 kg m^2\"\ndeviation = \"0.2 kg m^2\"", 0.841_344_746),
    ];
    for (distribution, probability) in distributions {
        let text = wider.replace("parameter = \"j\"\n", &format!("parameter = \"j\"\n{distribution}\n"));
        let project = Project::open(text.as_str());
        assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
        let (rows, found) = swept(&project, &of(600));
        // One point in each of 600 strips: the part is known to one of them.
        let passed = found.requirements[0].probability.unwrap();
        assert!((passed - probability).abs() <= 1.0 / 600.0 + 1e-9, "{distribution}: {passed}");
        for row in &rows {
            assert!((row.figures[0] - 2.0 / row.values[0]).abs() < 1e-9, "{row:?}");
            assert_eq!(row.passed[0] == 1.0, row.measured[0] > 2.0);
        }
        let interval = found.requirements[0].interval.unwrap();
        assert!(interval[0] < passed && passed < interval[1]);
    }
}

/// The speed 4 N m · 1 s / J is above 2 rad/s up to J = 2 kg m²: the rule says so, and holds for each sample that it was not made of.
#[test]
fn where_it_fails_is_the_closed_form() {
    let (rows, found) = swept(&Project::open(MODEL), &of(600));
    let [rule] = &found.requirements[0].rules[..] else { panic!("{:?}", found.requirements[0].rules) };
    let all = rows.iter().filter(|row| row.values[0] > 2.0).count() as f64;
    let failed = rule.failed;
    assert_eq!((rule.inside, rule.coverage), (failed, 1.0));
    // Each is counted by lot: within five standard deviations of half of them.
    assert!((failed as f64 - 0.5 * all).abs() < 2.5 * all.sqrt(), "{failed} of {all}");
    // Halfway between neighbours it has as few digits as lie between them.
    let [bound] = &rule.bounds[..] else { panic!("{rule:?}") };
    assert_eq!((bound.parameter.as_str(), bound.unit.as_str()), ("a.inertia", "kg m^2"));
    assert_eq!((bound.above, bound.below), (Some(2.0), None));
    // All fail: what was seen least often is half of what the confidence leaves.
    assert!(
        (kardan_rt::functions::powi(rule.interval[0], failed as i32) - 0.025).abs() < 1e-9 && rule.interval[1] == 1.0
    );
    assert!(found.notes.iter().any(|note| note.contains("a random half of the samples")), "{:?}", found.notes);
}

/// A row is the run of its values, to the last bit; its file gives it back.
#[test]
fn rows_are_single_runs() {
    let project = Project::open(MODEL);
    let (rows, found) = swept(&project, &of(70));
    assert!(found.missing == 0 && found.rows == 70 && found.failures.is_empty());
    for row in rows.iter().step_by(23) {
        // The shortest text of a number gives it back.
        let (changed, _) = project.with(&[format!("a.inertia={:e} kg m^2", row.values[0])]).unwrap();
        let study = changed.run(&Settings { runs_only: true, ..Settings::default() }, &Silent).unwrap();
        assert_eq!(study.runs[0].figures[0].value, Some(row.figures[0]));
        assert_eq!(study.runs[0].requirements[0].measured, Some(row.measured[0]));
    }
    let plan = project.sweep_plan(&of(70)).unwrap();
    let bytes = sweep_rows(&plan.head, &rows).unwrap();
    assert_eq!(read_sweep_rows(&plan.head, bytes.clone()).unwrap(), rows);
    let other = project.sweep_plan(&SweepSettings { seed: Some(1), ..of(70) }).unwrap();
    let refused = read_sweep_rows(&other.head, bytes).unwrap_err();
    assert_eq!(refused, RowsError::SweepMismatch(plan.head.identity.clone()));
    let refused = read_sweep_rows(&plan.head, b"PAR1 and nothing else".to_vec()).unwrap_err();
    assert!(matches!(refused, RowsError::Damaged(why) if why.contains("no checksum")));
}

/// A sweep records what is measured alone, and its rows have the bits of runs that record all: of series, of linear segments, of samples and
/// blocks, of expressions of signals.
#[test]
fn what_is_not_measured_changes_no_bit() {
    let varied = |parameter: &str, from: &str, to: &str| {
        format!("\n[[sweep.vary]]\nparameter = \"{parameter}\"\nfrom = \"{from}\"\nto = \"{to}\"\n")
    };
    let more = "\n[[figure]]\nname = \"power\"\nsignal = \"wg_motor.tau * wg.w\"\nmeasure = \"max_abs\"\n\
                [[figure]]\nname = \"held\"\nsignal = \"cj.friction\"\nmeasure = \"max_abs\"\n";
    let cases = [
        ("sia-steering", more.to_string()),
        ("harmonic-drive-ecu", String::new()),
        ("rlc-ladder", varied("R", "4 Ohm", "6 Ohm")),
        ("robot-joint", varied("payload", "4 kg", "6 kg")),
        ("eps-column", varied("bar", "100 N m/rad", "130 N m/rad")),
    ];
    let whole = cases.map(|(name, more)| (name, kardan::model::builtin(name).unwrap().source.to_string() + &more));
    // Of angles and speeds alone rows would follow from series.
    let angles = kardan::model::builtin("sia-steering").unwrap().source.split("[[requirement]]").next().unwrap();
    let ends: String = (0..20)
        .map(|k| {
            let at = 1.013 + 0.1 * f64::from(k);
            format!("\n[[figure]]\nname = \"at_{k}\"\nsignal = \"wg.w\"\nmeasure = \"at\"\nat = \"{at} s\"\n")
        })
        .collect();
    for (name, text) in whole.into_iter().chain([("sia-steering", angles.to_string() + &ends)]) {
        let project = Project::open(text.as_str());
        let one = project.sweep_plan(&of(1)).unwrap_or_else(|why| panic!("{name}: {why:?}")).head.variants[0].clone();
        let run = Settings { tolerance: Some(1e-6), ..Settings::default() };
        let settings = SweepSettings { variants: vec![one], run: run.clone(), ..of(2) };
        let (rows, found) = swept(&project, &settings);
        assert!(found.failures.is_empty(), "{name}: {:?}", found.failures);
        let plan = project.sweep_plan(&settings).unwrap();
        let names = plan.head.varied.iter().map(|varied| varied.name.clone());
        let again: Vec<RowAgain> = rows
            .iter()
            .map(|row| RowAgain {
                sample: row.sample,
                variant: plan.head.variants[0].clone(),
                values: names.clone().zip(row.values.iter().copied()).collect(),
            })
            .collect();
        let whole = project.rows_again(&plan.head.identity, &again, &run).unwrap();
        let study = whole.run(&Settings { runs_only: true, ..run }, &Silent).unwrap();
        for (row, run) in rows.iter().zip(&study.runs) {
            let measured: Vec<Option<f64>> = run.requirements.iter().map(|one| one.measured).collect();
            let swept: Vec<Option<f64>> =
                row.measured.iter().zip(&row.passed).filter(|(_, x)| !x.is_nan()).map(|(x, _)| Some(*x)).collect();
            assert_eq!(measured, swept, "{name}");
            let figures: Vec<Option<f64>> = run.figures.iter().map(|one| one.value).collect();
            assert_eq!(figures, row.figures.iter().map(|x| Some(*x)).collect::<Vec<_>>(), "{name}");
            assert!(run.series.signals.len() > 4);
            // The values that it has are told.
            let reported =
                |one: &SweptParameter| run.parameters.iter().find(|two| two.name == one.name).map(|two| two.value);
            let reported: Vec<Option<f64>> = plan.head.varied.iter().map(reported).collect();
            assert_eq!(reported, row.values.iter().map(|x| Some(*x)).collect::<Vec<_>>(), "{name}");
        }
    }
}

/// The same bits on one thread and on several, and where a sweep goes on with blocks that are there.
#[test]
fn rows_do_not_depend_on_threads_or_interruptions() {
    let project = Project::open(MODEL);
    let settings = of(200);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| swept(&project, &settings))
    };
    let (rows, found) = on(1);
    assert_eq!(on(3), (rows.clone(), found.clone()));
    let plan = project.sweep_plan(&settings).unwrap();
    let mut existing: SweepRows = rows.iter().filter(|row| row.sample / plan.block() == 1).cloned().collect();
    let mut made = Vec::new();
    let mut write = |block: u64, _: &[SweepRow]| {
        made.push(block);
        Ok(())
    };
    let again = project.sweep(&plan, &settings.run, &mut existing, &Silent, &mut write).unwrap();
    assert_eq!((made, again), (vec![0, 2, 3], found));
    // It leaves all that the answers are of.
    assert_eq!(existing, rows.iter().cloned().collect());
    // What cannot be written ends it; what was written stays.
    let mut count = 0;
    let mut full = |_: u64, _: &[SweepRow]| {
        count += 1;
        if count < 3 { Ok(()) } else { Err("no space left on the device".to_string()) }
    };
    let ended = project.sweep(&plan, &settings.run, &mut SweepRows::default(), &Silent, &mut full).unwrap();
    assert_eq!((ended.rows, ended.missing), (128, 72));
    assert!(
        ended.warnings.iter().any(|reported| reported.starts_with("no space left on the device")),
        "{:?}",
        ended.warnings
    );
}

/// Asked for the end while a block runs: that one is finished, and no other is begun; no run is ended in its middle.
#[test]
fn a_block_that_is_begun_is_finished() {
    struct Ends(AtomicUsize);
    impl Progress for Ends {
        fn advance(&self, _: usize, _: &str, _: f64) {}

        fn stop(&self) -> Option<String> {
            (self.0.fetch_add(1, Ordering::Relaxed) > 0).then(|| "somebody asked".into())
        }
    }
    let project = Project::open(MODEL);
    let plan = project.sweep_plan(&of(200)).unwrap();
    let (mut computed, whole) = (Vec::new(), swept(&project, &of(200)).0);
    let mut write = |_: u64, rows: &[SweepRow]| {
        computed.extend(rows.to_vec());
        Ok(())
    };
    let ends = Ends(AtomicUsize::new(0));
    let found = project.sweep(&plan, &Default::default(), &mut SweepRows::default(), &ends, &mut write).unwrap();
    assert_eq!((found.rows, found.missing), (plan.block(), 200 - plan.block()));
    assert!(computed == whole[..plan.block() as usize] && found.failures.is_empty());
    assert!(found.warnings.iter().any(|reported| reported.starts_with("somebody asked")), "{:?}", found.warnings);
}

/// What a model cannot be at some values is a row with its reason, not the end.
#[test]
fn refused_samples_are_rows() {
    let text = MODEL.replace("inertia = \"2 kg m^2 ± 10 %\"", "inertia = \"j\"")
        + "\n[parameters]\nj = \"2 kg m^2\"\n[[sweep.vary]]\nparameter = \"j\"\nfrom = \"-1 kg m^2\"\nto = \"3 kg m^2\"\n";
    let project = Project::open(text.as_str());
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let (rows, found) = swept(&project, &of(80));
    let refused: Vec<&SweepRow> = rows.iter().filter(|row| !row.reason.is_empty()).collect();
    // A quarter of the strips lies below zero.
    assert_eq!(refused.len(), 20);
    assert!(refused.iter().all(|row| row.values[0] < 0.0 && row.passed[0] == 0.0 && row.figures[0].is_nan()));
    // They differ in a number alone: one reason, with the first one in full.
    let [failure] = &found.failures[..] else { panic!("{:?}", found.failures) };
    assert_eq!((failure.count, failure.first, failure.example.as_str()), (20, refused[0].sample, &*refused[0].reason));
    assert!(failure.reason.contains(" is … kg m^2"), "{}", failure.reason);
    assert_eq!((found.requirements[0].failed, found.figures[0].values.count), (20 + 20, 60));
}

/// A key that is there without a tolerance is told with how to write one, wherever it stands; one that follows from others with those.
#[test]
fn keys_with_no_tolerance_are_reported() {
    let more = "\n[shaft.b]\ninertia = \"2 * k\"\ndamping = \"0 N m s/rad\"\n[fault.weak]\nmotor = \"m\"\nkind = \"reduced\"\nvalue = 0.5\nat = \"0.8 s\"\n\
                [parameters]\nk = \"1 kg m^2\"\n";
    let model =
        MODEL.replace("duration = \"1 s\"\n", "duration = \"1 s\"\ninitial = { \"a.w\" = \"0.1 rad/s\" }\n") + more;
    for (name, reported) in [
        ("scenario.event.1.to", "\"4 N m ± 10 %\""),
        ("scenario.initial.a.w", "\"0.1 rad/s ± 10 %\""),
        ("fault.weak.value", "\"0.5 ± 10 %\""),
        ("b.damping", "\"0 N m s/rad ± 1 N m s/rad\""),
        ("a.damping", "\"0 N m s/rad ± 1 N m s/rad\""),
        ("b.inertia", "is computed from `2 * k`"),
        ("b.inertai", "there is no parameter"),
    ] {
        let text = format!("{model}[[sweep.vary]]\nparameter = \"{name}\"\nfrom = 0\nto = 1\n");
        let diagnostics = Project::open(text).diagnostics().to_vec();
        let own = diagnostics.iter().find(|one| one.message.starts_with("`[[sweep.vary]]`")).expect(name);
        let help = own.help.clone().unwrap_or_default();
        assert!(format!("{} {help}", own.message).contains(reported), "{name}: {} {help}", own.message);
    }
}

/// The tolerance with a confidence that the page on sweeps shows is one.
#[test]
fn a_tolerance_with_a_confidence_is_normal() {
    let shown = "\"1 N m [0.9, 1.2] 95 %\"";
    assert!(include_str!("../../../../docs/sweep.md").contains(shown));
    let project = Project::open(MODEL.replace("\"4 N m\"", shown).replace(" ± 10 %", ""));
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let plan = project.sweep_plan(&of(20)).unwrap();
    assert!(plan.head.varied[0].distribution.starts_with("split normal, peak 1,"), "{:?}", plan.head.varied);
    let even = Project::open(MODEL.replace("\"4 N m\"", "\"1 N m [0.9, 1.1] 95 %\"").replace(" ± 10 %", ""));
    let plan = even.sweep_plan(&of(20)).unwrap();
    assert!(plan.head.varied[0].distribution.starts_with("normal, mean 1,"), "{:?}", plan.head.varied);
}

/// Intervals of Halton's sequence in many dimensions are doubted, in few or of other points they are not.
#[test]
fn many_axes_of_halton_are_reported() {
    let reported = |axes: usize, points: &str| {
        let parameters: String = (0..axes).map(|k| format!("p{k} = \"1 ± 10 %\"\n")).collect();
        let text =
            format!("{}\n[parameters]\n{parameters}[sweep]\npoints = \"{points}\"\n", MODEL.replace(" ± 10 %", ""));
        let (_, found) = swept(&Project::open(text.as_str()), &of(8));
        found.warnings.iter().any(|one| one.contains("may be too narrow") && one.contains("axes unevenly"))
    };
    assert_eq!(
        [reported(9, "halton"), reported(8, "halton"), reported(9, "sobol"), reported(9, "random")],
        [true, false, false, false]
    );
}

/// Where nothing is measured nothing is compared; where something is, it is said by how much it differs. A list without values is told as such.
#[test]
fn nothing_is_compared_of_nothing() {
    let note = |text: &str| {
        let run = Settings { method: Method::Automatic, ..Settings::default() };
        let (_, found) = swept(&Project::open(text), &SweepSettings { run, ..of(8) });
        assert!(found.compared.is_some());
        found.notes.into_iter().find(|one| one.contains("SIMD ensemble"))
    };
    assert!(note(MODEL).is_some_and(|note| note.contains("differ") && !note.contains("0.0e0")));
    assert_eq!(note(MODEL.split("[[requirement]]").next().unwrap()), None);
    let empty = Project::open(format!("{MODEL}[sweep]\nlists = {{ \"a.inertia\" = [] }}\n"));
    let reported: Vec<&str> = empty.diagnostics().iter().map(|one| one.message.as_str()).collect();
    assert_eq!(reported, ["`a.inertia` in `lists` of `[sweep]`: a list needs at least one value"]);
}

/// Laws are those of the values in the file: a sample is the run of a variant whose `design` names them.
#[test]
fn laws_are_those_of_the_file() {
    let text = "\
[parameters]
j = \"2 kg m^2\"
[shaft.a]
inertia = \"j\"
[motor.m]
shaft = \"a\"
[control.hold]
law = \"position_loop\"
output = \"a.phi\"
input = \"m\"
reference = \"wish\"
DESIGN
[scenario]
duration = \"0.5 s\"
[[scenario.event]]
signal = \"wish\"
at = \"0 s\"
to = \"0.2 rad\"
[[figure]]
name = \"end\"
signal = \"a.phi\"
measure = \"final\"
[sweep]
lists = { j = [\"1.5 kg m^2\", \"3 kg m^2\"] }
";
    let project = Project::open(text.replace("DESIGN\n", ""));
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let (rows, _) = swept(&project, &of(2));
    let single = |j: f64, design: &str| {
        let text = text.replace("j = \"2 kg m^2\"", &format!("j = \"{j} kg m^2\"")).replace("DESIGN", design);
        let text = text.split("[sweep]").next().unwrap().to_string();
        let study = Project::open(text).run(&Settings { runs_only: true, ..Settings::default() }, &Silent).unwrap();
        study.runs[0].figures[0].value.unwrap()
    };
    for row in &rows {
        assert_eq!(row.figures[0], single(row.values[0], "design = { j = \"2 kg m^2\" }"));
        assert_ne!(row.figures[0], single(row.values[0], "# designed for each"));
    }
    assert_ne!(rows[0].values, rows[1].values);
}

/// A parameter that stands in laws alone is a choice of design: each sample has laws of its own value and of the plant in the file, `J φ̈ = J₀ (ω² (r − φ) − 2 ζ ω φ̇)`.
/// One that stands in the plant too varies there alone. Rows are whole runs again, with the same bits.
#[test]
fn parameters_of_laws_only_vary_the_laws() {
    let text = "\
[parameters]
wn = \"20 rad/s\"
twice = \"2 * wn\"
unit = \"1 kg m^2\"
[shaft.a]
inertia = \"unit\"
[motor.m]
shaft = \"a\"
[control.hold]
law = \"position_loop\"
output = \"a.phi\"
input = \"m\"
natural_frequency = \"twice\"
damping_ratio = \"0.5 * unit / 1 kg m^2\"
reference = \"wish\"
[scenario]
duration = \"0.1 s\"
[[scenario.event]]
signal = \"wish\"
at = \"0 s\"
to = \"0.2 rad\"
[[figure]]
name = \"end\"
signal = \"a.phi\"
measure = \"final\"
[sweep]
lists = { wn = [\"5 rad/s\", \"20 rad/s\", \"30 rad/s\"], unit = [\"0.8 kg m^2\", \"1 kg m^2\", \"1.3 kg m^2\"] }
";
    let project = Project::open(text);
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let (rows, found) = swept(&project, &of(9));
    for row in &rows {
        let [wn, inertia]: [f64; 2] = row.values.clone().try_into().expect("two values");
        let (frequency, damping) = (2.0 * wn / inertia.sqrt(), 0.5 / inertia.sqrt());
        let (decay, ringing) = (damping * frequency, frequency * (1.0 - damping * damping).sqrt());
        let at =
            |t: f64| 0.2 * (1.0 - (-decay * t).exp() * ((ringing * t).cos() + decay / ringing * (ringing * t).sin()));
        assert!((row.figures[0] - at(0.1)).abs() < 1e-9, "{:?}: {} {}", row.values, row.figures[0], at(0.1));
    }
    let names = |row: &SweepRow| {
        project
            .sweep_plan(&of(9))
            .expect("a plan")
            .head
            .varied
            .into_iter()
            .map(|one| one.name)
            .zip(row.values.clone())
            .collect()
    };
    let again: Vec<RowAgain> = rows[..3]
        .iter()
        .map(|row| RowAgain { sample: row.sample, variant: "model".into(), values: names(row) })
        .collect();
    let identity = project.sweep_plan(&of(9)).expect("a plan").head.identity;
    let again = project.rows_again(&identity, &again, &of(9).run).expect("rows of this model");
    let study = again.run(&Settings { runs_only: true, ..Settings::default() }, &Silent).expect("runs");
    for (run, row) in study.runs.iter().zip(&rows) {
        assert_eq!(run.figures[0].value, Some(row.figures[0]));
    }
    let reported: Vec<&String> = found.notes.iter().filter(|note| note.contains("occurs in laws only")).collect();
    assert_eq!(
        reported,
        [
            "`wn` occurs in laws only (`control.hold`): kardan redesigns them for each sample, with its value and otherwise the values in the file."
        ]
    );
}

/// Each sample draws the noise of its sensors by itself: what a law commands by it has a mean of zero, and no sample tells of the next one. In lanes and one by one they are
/// the same draws; rows again have their bits; samples that are compared with each other have the same noise.
#[test]
fn noise_is_drawn_anew_in_each_sample() {
    let text = |points: &str| {
        format!(
            "\
[shaft.a]
inertia = \"1 kg m^2 ± 20 %\"
[motor.m]
shaft = \"a\"
[sensor.e]
measures = \"angle\"
shaft = \"a\"
noise = \"0.01 rad\"
sample_time = \"10 ms\"
[control.hold]
law = \"sampled_noninteracting\"
sample_time = \"10 ms\"
[[control.hold.channels]]
output = \"a.phi\"
input = \"m\"
bandwidth = \"10 rad/s\"
reference = \"r\"
[control.hold.observer]
sensors = [\"e.phi\"]
[scenario]
duration = \"0.2 s\"
output_step = \"10 ms\"
[[figure]]
name = \"torque\"
signal = \"m.tau\"
measure = \"final\"
[[figure]]
name = \"end\"
signal = \"a.phi\"
measure = \"final\"
[sweep]
{points}
"
        )
    };
    let project = Project::open(text("points = \"random\"").as_str());
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let automatic = SweepSettings { run: Settings { method: Method::Automatic, ..Settings::default() }, ..of(400) };
    let (rows, found) = swept(&project, &automatic);
    assert!(
        found.compared.as_ref().is_some_and(|reported| reported.difference < 1e-9),
        "{:?} {:?}",
        found.compared,
        rows[0]
    );
    let torques: Vec<f64> = rows.iter().map(|row| row.figures[0]).collect();
    let count = torques.len() as f64;
    let size = (torques.iter().map(|x| x * x).sum::<f64>() / count).sqrt();
    let mean = torques.iter().sum::<f64>() / count;
    let next = torques.windows(2).map(|two| two[0] * two[1]).sum::<f64>() / count;
    assert!(size > 0.0 && mean.abs() < 4.0 * size / count.sqrt() && next.abs() < 4.0 * size * size / count.sqrt());
    let one = SweepSettings { run: Settings { method: Method::Taylor, ..of(400).run }, ..of(400) };
    let (single_runs, _) = swept(&project, &one);
    for (row, other) in rows.iter().zip(&single_runs) {
        assert!((row.figures[0] - other.figures[0]).abs() < 1e-9 * size, "{row:?} {other:?}");
    }
    let plan = project.sweep_plan(&automatic).expect("a plan");
    let values = vec![("a.inertia".to_string(), rows[17].values[0])];
    let row = RowAgain { sample: 17, variant: "model".into(), values };
    let again = project.rows_again(&plan.head.identity, &[row], &automatic.run).expect("a row of this model");
    let study = again.run(&Settings { runs_only: true, ..automatic.run }, &Silent).expect("a run");
    assert_eq!(study.runs[0].figures[0].value, Some(rows[17].figures[0]));
    let same = Project::open(text("points = \"grid\"\nlevels = 5").as_str());
    let (rows, found) = swept(&same, &SweepSettings::default());
    // The inertia changes little of it, and steadily.
    let torques: Vec<f64> = rows.iter().map(|row| row.figures[0]).collect();
    assert!(torques.windows(2).all(|two| (two[0] - two[1]).abs() < 0.2 * size), "{torques:?} of {size}");
    assert!(found.notes.iter().any(|note| note.contains("the same in all samples")), "{:?}", found.notes);
}

/// An interval with a confidence holds so much of the samples, also where its value is not in the middle.
#[test]
fn uneven_intervals_have_their_stated_coverage() {
    let text = MODEL.replace("2 kg m^2 ± 10 %", "2 kg m^2 [1.9, 2.4] 90 %");
    let (rows, found) = swept(&Project::open(text.as_str()), &of(2000));
    let inside = rows.iter().filter(|row| (1.9..2.4).contains(&row.values[0])).count();
    // A Latin hypercube has them to one of each end.
    assert!((1798..=1802).contains(&inside), "{inside}");
    let deviation = |far: f64| far / 1.644_853_626_951_472_2;
    let reported = &found.varied[0].distribution;
    assert!(
        reported.contains("split normal, peak 2") && reported.contains(&format!("{:.4}", deviation(0.4))[..5]),
        "{reported}"
    );
}
