//! What sweeps answer beyond probabilities: correlated values, indices, effects, samples until they are enough, worst cases and rare failures.

use std::collections::BTreeMap;
use std::sync::Arc;

use kardan::export::identification_json;
use kardan::project::Project;
use kardan::results::{Correlation, Identification, IdentifiedParameter, Sweep, SweepRow, SweepRows};
use kardan::study::{Shard, Silent, SweepGoal, SweepPlan, SweepSettings};

/// A model that takes no time, and figures that are its parameters' functions.
const PLAIN: &str = "\
[shaft.s]
inertia = \"1 kg m^2\"
[motor.m]
shaft = \"s\"
[scenario]
duration = \"0.01 s\"
initial = { \"s.w\" = \"1 rad/s\" }
";

fn project(text: &str) -> Project {
    let project = Project::open(text);
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    project
}

fn normal(names: &[&str]) -> String {
    let parameters: String = names.iter().map(|name| format!("{name} = 0\n")).collect();
    let vary =
        |name: &&str| format!("[[sweep.vary]]\nparameter = \"{name}\"\ndistribution = \"normal\"\ndeviation = 1\n");
    format!("[parameters]\n{parameters}{PLAIN}{}", names.iter().map(vary).collect::<String>())
}

fn sweep_settings(samples: u64, goal: SweepGoal) -> SweepSettings {
    SweepSettings { samples: Some(samples), goal, ..SweepSettings::default() }
}

fn swept(project: &Project, settings: &SweepSettings, existing: &[SweepRow]) -> (BTreeMap<u64, Vec<SweepRow>>, Sweep) {
    let plan = project.sweep_plan(settings).unwrap();
    let mut blocks = BTreeMap::new();
    let mut write = |block: u64, found: &[SweepRow]| {
        blocks.insert(block, found.to_vec());
        Ok(())
    };
    let mut existing = existing.iter().cloned().collect();
    let found = project.sweep(&plan, &settings.run, &mut existing, &Silent, &mut write).unwrap();
    (blocks, found)
}

/// One thread and three, from the begin and from the first half of the blocks: the same rows, to the last bit, and the same answers.
fn always_the_same(project: &Project, settings: &SweepSettings) -> (Vec<SweepRow>, Sweep) {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| swept(project, settings, &[]))
    };
    let (blocks, found) = on(1);
    assert!(on(3) == (blocks.clone(), found.clone()));
    let half = blocks.len() as u64 / 2;
    let existing: Vec<SweepRow> = blocks.range(..half).flat_map(|(_, rows)| rows.clone()).collect();
    let (remaining, again) = swept(project, settings, &existing);
    assert!(again == found && remaining.keys().eq(blocks.range(half..).map(|(block, _)| block)));
    assert!(remaining.iter().all(|(block, rows)| *rows == blocks[block]));
    (blocks.into_values().flatten().collect(), found)
}

/// Pearson's correlation of two columns, with their means and deviations.
fn moments(rows: &[Vec<f64>], i: usize, j: usize) -> ([f64; 2], [f64; 2], f64) {
    let n = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>() / n;
    let (a, b) = (mean(i), mean(j));
    let of =
        |x: usize, y: usize, at: f64, to: f64| rows.iter().map(|row| (row[x] - at) * (row[y] - to)).sum::<f64>() / n;
    let deviations = [of(i, i, a, a).sqrt(), of(j, j, b, b).sqrt()];
    ([a, b], deviations, of(i, j, a, b) / (deviations[0] * deviations[1]))
}

/// Normal values have the correlations of the matrix, uniform ones 6/π asin(ρ/2); a singular matrix leaves no freedom.
#[test]
fn correlations_are_those_of_the_matrix() {
    let correlated =
        |names: &str, matrix: &str| format!("[[sweep.correlated]]\nparameters = {names}\ncorrelation = \"{matrix}\"\n");
    let values = |text: &str| {
        let plan = project(text).sweep_plan(&sweep_settings(4000, SweepGoal::Samples)).unwrap();
        (0..4000).map(|sample| plan.values(sample)).collect::<Vec<_>>()
    };
    let figure = "[[figure]]\nname = \"f\"\nvalue = \"x + y + z\"\n";
    let rows = values(&(normal(&["x", "y", "z"]) + figure + &correlated("[\"y\", \"x\"]", "1, 0.8; 0.8, 1")));
    // The standard error of a correlation is (1 − ρ²)/√n.
    let (means, deviations, correlation) = moments(&rows, 0, 1);
    assert!((correlation - 0.8).abs() < 4.0 * 0.36 / 4000f64.sqrt(), "{correlation}");
    assert!(means.iter().all(|x| x.abs() < 0.05) && deviations.iter().all(|x| (x - 1.0).abs() < 0.05));
    assert!(moments(&rows, 0, 2).2.abs() < 4.0 / 4000f64.sqrt());
    let rows = values(
        &(normal(&["x", "y", "z"]) + figure + &correlated("[\"x\", \"y\", \"z\"]", "1 -1 .6; -1 1 -.6; .6 -.6 1")),
    );
    assert!(rows.iter().all(|row| (row[0] + row[1]).abs() < 1e-15));
    assert!((moments(&rows, 0, 2).2 - 0.6).abs() < 4.0 * 0.64 / 4000f64.sqrt());
    let uniform = normal(&["x", "y", "z"]).replace("distribution = \"normal\"\ndeviation = 1", "from = 0\nto = 1");
    let rows = values(&(uniform + figure + &correlated("[\"x\", \"y\"]", "1 .8; .8 1")));
    let exact = 6.0 / std::f64::consts::PI * 0.4f64.asin();
    assert!((moments(&rows, 0, 1).2 - exact).abs() < 4.0 * 0.4 / 4000f64.sqrt());
    assert!(rows.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
}

/// What `kardan identify --json` has written is drawn as it says: values, errors and correlations, in place of tolerances.
#[test]
fn an_identification_is_drawn() {
    let parameter = |name: &str, value: f64, error: f64| IdentifiedParameter {
        name: name.into(),
        value: Some(value),
        standard_error: Some(error),
        ..IdentifiedParameter::default()
    };
    let names = ["s.damping", "s.inertia", "lost.damping"].map(String::from).to_vec();
    let found = Identification {
        parameters: vec![
            parameter("s.inertia", 2.0, 0.1),
            parameter("s.damping", 0.5, 0.02),
            parameter("lost.damping", 0.0, f64::INFINITY),
        ],
        correlation: Correlation {
            names,
            values: vec![vec![1.0, -0.7, 0.0], vec![-0.7, 1.0, 0.0], vec![0.0, 0.0, 1.0]],
        },
        ..Identification::default()
    };
    let json = |text: &str| [("found.json".to_string(), Ok(Arc::from(text.as_bytes())))];
    let text = PLAIN.replace("\"1 kg m^2\"", "\"1.9 kg m^2 ± 20 %\"\ndamping = \"0.4 N m s/rad ± 50 %\"")
        + "[[sweep.correlated]]\nfile = \"found.json\"\nparameters = [\"s.inertia\", \"s.damping\"]\n";
    let json_text = identification_json(&found);
    let open = |text: &str, file: &str| Project::open(text).with_files(json(file));
    assert_eq!(Project::open(text.as_str()).files(), ["found.json"]);
    let project = open(&text, &json_text);
    assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
    let plan = project.sweep_plan(&sweep_settings(4000, SweepGoal::Samples)).unwrap();
    assert_eq!(plan.head.varied.len(), 2);
    let rows: Vec<Vec<f64>> = (0..4000).map(|sample| plan.values(sample)).collect();
    let (means, deviations, correlation) = moments(&rows, 0, 1);
    assert!((means[0] - 2.0).abs() < 0.01 && (means[1] - 0.5).abs() < 0.002);
    assert!((deviations[0] / 0.1 - 1.0).abs() < 0.05 && (deviations[1] / 0.02 - 1.0).abs() < 0.05);
    assert!((correlation + 0.7).abs() < 4.0 * 0.51 / 4000f64.sqrt());
    // Another file is another sweep.
    let other =
        open(&text, &json_text.replace("-0.7", "-0.6")).sweep_plan(&sweep_settings(4000, SweepGoal::Samples)).unwrap();
    assert_ne!(other.head.identity, plan.head.identity);
    let refused = |text: &str, file: &str| {
        let diagnostics = open(text, file).diagnostics().to_vec();
        diagnostics.first().map(|one| format!("{} {}", one.code, one.message)).unwrap_or_default()
    };
    let all = text.replace("parameters = [\"s.inertia\", \"s.damping\"]\n", "");
    for (text, file, reported) in [
        (&all, json_text.as_str(), "`lost.damping` has no standard deviation"),
        (&text, "{\"names\": [\"s.inertia\"], \"covariance\": [[1]]}", "it has no `s.damping`"),
        (&text, "nothing", "it is not valid JSON"),
        (&text, "{}", "it has no list `names`"),
        (&text, "{\"correlation\": {\"names\": []}}", "no rows of numbers"),
        (&all, "{\"names\": [], \"covariance\": []}", "`names` are empty"),
        (&all, "{\"correlation\": {\"names\": [], \"values\": []}, \"parameters\": []}", "`names` are empty"),
        (
            &text,
            "{\"names\": [\"s.inertia\", \"s.damping\", \"s.inertia\"], \"covariance\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}",
            "`s.inertia` more than once",
        ),
        (&all, "{\"names\": [\"s.inertia\", \"s.damping\"], \"covariance\": [[1, 0]]}", "not square"),
        (&all, "{\"names\": [\"s.inertia\", \"s.damping\"], \"covariance\": [[1, 0], [0]]}", "not square"),
        (&all, "{\"names\": [\"s.inertia\", \"s.damping\"], \"covariance\": [[1, 2], [2, 1]]}", "negative variance"),
        (&all, "{\"names\": [\"s.inertia\", \"s.damping\"], \"covariance\": [[1, 0.5], [0.4, 1]]}", "not symmetric"),
        (
            &all,
            "{\"names\": [\"s.inertia\", \"s.damping\"], \"covariance\": [[-1, 0], [0, 1]]}",
            "no standard deviation",
        ),
        (
            &all,
            "{\"names\": [\"s.inertia\", \"x.damping\"], \"covariance\": [[1, 0], [0, 1]]}",
            "no parameter `x.damping`",
        ),
        (&all, "{\"names\": [\"s.inertia\"], \"means\": [1, 2], \"covariance\": [[1]]}", "`means`"),
    ] {
        assert!(refused(text, file).contains(reported), "{file}: {}", refused(text, file));
    }
}

/// Where a run begins, when a torque comes and how large it is, and when a motor fails, vary: w = w₀ + M (t_f − t_e + r (T − t_f))/J.
#[test]
fn what_happens_in_a_run_varies() {
    let text = "\
[shaft.a]
inertia = \"2 kg m^2 ± 10 %\"
[motor.m]
shaft = \"a\"
[scenario]
duration = \"1 s\"
initial = { \"a.w\" = \"1 rad/s ± 0.2 rad/s\" }
[[scenario.event]]
signal = \"m.tau\"
at = \"0.4 s ± 0.1 s\"
to = \"4 N m ± 1 N m\"
[fault.weak]
motor = \"m\"
kind = \"reduced\"
value = \"0.5 ± 0.2\"
at = \"0.8 s ± 0.05 s\"
[[variant]]
name = \"sound\"
[[variant]]
name = \"failing\"
faults = [\"weak\"]
[[figure]]
name = \"end\"
signal = \"a.w\"
measure = \"final\"
";
    let project = project(text);
    let (blocks, found) = swept(&project, &sweep_settings(30, SweepGoal::Samples), &[]);
    let names: Vec<&str> = found.varied.iter().map(|one| one.name.as_str()).collect();
    let expected = [
        "a.inertia",
        "fault.weak.at",
        "fault.weak.value",
        "scenario.event.1.at",
        "scenario.event.1.to",
        "scenario.initial.a.w",
    ];
    assert_eq!(names, expected);
    let rows: Vec<&SweepRow> = blocks.values().flatten().collect();
    assert_eq!(rows.len(), 60);
    for row in rows {
        let [j, fails, remaining, at, torque, w] = row.values[..] else { panic!("{row:?}") };
        let time = if row.variant == 0 { 1.0 - at } else { fails - at + remaining * (1.0 - fails) };
        assert!((row.figures[0] - (w + torque * time / j)).abs() < 1e-9, "{row:?}");
    }
    // A time that would come before the start is told at its place.
    let early = Project::open(text.replace("0.4 s ± 0.1 s", "0.1 s ± 0.2 s"));
    assert!(early.diagnostics().iter().any(|one| one.code == "number::sign"), "{:?}", early.diagnostics());
}

/// The speed M T/J has the parts of its variance in closed form: alone those of M and of 1/J, with each other the product of both.
#[test]
fn indices_of_a_run_are_those_of_its_closed_form() {
    let text = "\
[shaft.a]
inertia = \"2 kg m^2 ± 50 %\"
[motor.m]
shaft = \"a\"
[scenario]
duration = \"0.1 s\"
[[scenario.event]]
signal = \"m.tau\"
at = \"0 s\"
to = \"3 N m ± 2 N m\"
[[requirement]]
signal = \"a.w\"
measure = \"final\"
below = \"0.1 rad/s\"
[sweep]
points = \"saltelli\"
";
    let project = project(text);
    // 251 groups of four, for 1001.
    let (_, found) = swept(&project, &sweep_settings(1001, SweepGoal::Samples), &[]);
    assert_eq!((found.samples, found.rows, found.points.as_str()), (1004, 1004, "saltelli"));
    let values = &found.requirements[0].measured;
    // Probabilities are those of A and B.
    assert_eq!((values.count, found.requirements[0].passed + found.requirements[0].failed), (502, 502));
    let (torque, torque_2) = (3.0, 9.0 + 4.0 / 3.0);
    // E(1/J) = ln 3/2, E(1/J²) = 1/3 for J from 1 to 3.
    let (slow, slow_2) = (0.5 * kardan_rt::functions::ln(3.0), 1.0 / 3.0);
    let all = torque_2 * slow_2 - torque * torque * slow * slow;
    let own = [torque * torque * (slow_2 - slow * slow) / all, (torque_2 - torque * torque) * slow * slow / all];
    for one in &values.indices {
        let (own, other) = if one.parameter == "a.inertia" { (own[0], own[1]) } else { (own[1], own[0]) };
        for (value, interval, exact) in
            [(one.first, one.first_interval, own), (one.total, one.total_interval, 1.0 - other)]
        {
            assert!(interval[0] <= exact && exact <= interval[1] && (value - exact).abs() < 0.05, "{one:?} {exact}");
        }
    }
    assert_eq!(values.indices.len(), 2);
    // The regression beside it explains what is straight: less than the whole.
    assert!(values.shares.len() == 2 && values.r_squared.is_some_and(|part| part > 0.8 && part < 1.0));
    // Effects of paths: that of the torque is the range 4 N m times T/J, for some J.
    let paths = Project::open(text.replace("saltelli", "morris"));
    let (_, found) = swept(&paths, &sweep_settings(60, SweepGoal::Samples), &[]);
    let torque =
        found.requirements[0].measured.effects.iter().find(|one| one.parameter == "scenario.event.1.to").unwrap();
    assert!((0.4 / 3.0..0.4).contains(&torque.mean) && torque.size == torque.mean && torque.count == 20, "{torque:?}");
    assert!(
        found.requirements[0].probability.is_none()
            && found.notes.iter().any(|note| note.contains("not drawn at random"))
    );
}

/// Of x + y + z the parts of the variance are (2 + 2ρ)/(3 + 2ρ) of x and y together and 1/(3 + 2ρ) of z, alone and in all.
#[test]
fn jointly_varied_parameters_have_one_index() {
    let text = normal(&["x", "z", "y"]).replacen("[[sweep.vary]]", "[sweep]\npoints = \"saltelli\"\n[[sweep.vary]]", 1)
        + "[[sweep.correlated]]\nparameters = [\"y\", \"x\"]\ncorrelation = \"1 0.5; 0.5 1\"\n\
           [[figure]]\nname = \"f\"\nvalue = \"x + y + z\"\n";
    let project = project(&text);
    // Two that move by themselves: A, B, and two mixed.
    let plan = project.sweep_plan(&sweep_settings(4001, SweepGoal::Samples)).unwrap();
    assert_eq!(plan.head.samples, 4004);
    for group in
        (0..12).collect::<Vec<u64>>().chunks(4).map(|group| group.iter().map(|k| plan.values(*k)).collect::<Vec<_>>())
    {
        let [a, b, first, second] = &group[..] else { panic!("{group:?}") };
        assert!(first[1] == a[1] && first[0] == b[0] && first[2] == b[2] && second[1] == b[1] && second[0] == a[0]);
        assert!(second[2] == a[2]);
    }
    let (_, found) = swept(&project, &sweep_settings(4001, SweepGoal::Samples), &[]);
    let indices = &found.figures[0].values.indices;
    assert_eq!([&indices[0].parameter, &indices[1].parameter], ["x with y", "z"]);
    for (one, exact) in indices.iter().zip([0.75, 0.25]) {
        assert!((one.first - exact).abs() < 0.02 && (one.total - exact).abs() < 0.02, "{one:?}");
    }
}

/// Samples until they are enough are the first ones of all, whatever the threads; the interval is as narrow as asked for.
#[test]
fn samples_end_when_they_are_enough() {
    let text =
        normal(&["x"]) + "[[figure]]\nname = \"f\"\nvalue = \"x\"\n[[requirement]]\nfigure = \"f\"\nbelow = 1.5\n";
    let project = project(&text);
    let until = sweep_settings(1500, SweepGoal::Until(0.05));
    let (rows, found) = always_the_same(&project, &until);
    let rule = found.stopping_rule.clone().unwrap();
    assert!(rule.converged && found.missing == 0 && (128..900).contains(&rule.samples), "{rule:?}");
    assert_eq!((found.rows, rows.len() as u64), (rule.samples, rule.samples));
    let [low, high] = found.requirements[0].interval.unwrap();
    // P(Z < 1.5).
    assert!(0.5 * (high - low) <= 0.05 && low <= 0.933_192_8 && 0.933_192_8 <= high);
    assert!(rule.confidence > 0.99 && found.notes.iter().any(|note| note.contains("analyses in advance")));
    // The same identity: rows of one are rows of the other.
    let all = project.sweep_plan(&sweep_settings(1500, SweepGoal::Samples)).unwrap();
    assert!(rows.iter().all(|row| row.values == all.values(row.sample)));
    assert_eq!(all.head.identity, project.sweep_plan(&until).unwrap().head.identity);
    // Rows behind the end change nothing.
    let (_, whole) = swept(&project, &sweep_settings(1500, SweepGoal::Samples), &rows);
    assert_eq!((whole.rows, whole.stopping_rule), (1500, None));
    let (blocks, all_rows) = (whole.rows, swept(&project, &sweep_settings(1500, SweepGoal::Samples), &[]).0);
    let existing: Vec<SweepRow> = all_rows.into_values().flatten().collect();
    let (made, again) = swept(&project, &until, &existing);
    assert!(made.is_empty() && again == found && blocks == 1500);
    // Not narrow enough after all of them: told.
    let (_, found) = swept(&project, &sweep_settings(200, SweepGoal::Until(0.001)), &[]);
    assert!(found.rows == 200 && found.notes.iter().any(|note| note.contains("still wider")), "{:?}", found.notes);
}

/// Where a part of the samples cannot be run, a search goes on among the others: here a shaft without inertia is refused, and f is least at 0.2.
#[test]
fn what_cannot_be_run_is_no_worst_case() {
    let uniform = normal(&["x"]).replace("distribution = \"normal\"\ndeviation = 1", "from = -1\nto = 1");
    let text = uniform.replace("x = 0\n", "x = 1\n").replace("\"1 kg m^2\"", "\"x*1 kg m^2\"")
        + "[[figure]]\nname = \"f\"\nvalue = \"(x - 0.2)^2\"\n[[requirement]]\nfigure = \"f\"\nabove = 0.001\n";
    let (blocks, found) = swept(&project(&text), &sweep_settings(300, SweepGoal::Worst("1".into())), &[]);
    let rows: Vec<SweepRow> = blocks.into_values().flatten().collect();
    let refused = rows.iter().filter(|row| row.values[0] <= 0.0).count();
    assert!(rows.iter().all(|row| row.reason.is_empty() == (row.values[0] > 0.0)), "{:?}", rows[0]);
    let worst = found.worst.unwrap();
    assert!((worst.values[0].value - 0.2).abs() < 1e-3 && (worst.margin.unwrap() + 0.001).abs() < 1e-6, "{worst:?}");
    // Half of the first ones, which fill the space, and few of those that were sought.
    assert!((60..140).contains(&refused), "{refused}");
    // Where none can be run, there is no worst case.
    let (_, found) = swept(
        &project(&text.replace("from = -1\nto = 1", "from = -1\nto = -0.5")),
        &sweep_settings(100, SweepGoal::Worst("1".into())),
        &[],
    );
    assert!(found.worst.is_none() && found.failures[0].count == 100, "{found:?}");
}

/// Least margins at a corner, and where a hollow is.
#[test]
fn worst_cases_are_found() {
    let uniform = normal(&["x", "y"]).replace("distribution = \"normal\"\ndeviation = 1", "from = 0\nto = 1");
    let text = uniform
        + "[[figure]]\nname = \"f\"\nvalue = \"(x - 0.3)^2 + (y - 0.7)^2\"\n[[requirement]]\nfigure = \"f\"\nabove = 0.001\n\
                          [[requirement]]\nfigure = \"f\"\nbelow = 0.99\n";
    let project = project(&text);
    let (rows, found) = always_the_same(&project, &sweep_settings(600, SweepGoal::Worst("1".into())));
    let worst = found.worst.unwrap();
    assert!(worst.fails && (worst.margin.unwrap() + 0.001).abs() < 1e-6, "{worst:?}");
    assert!((worst.values[0].value - 0.3).abs() < 1e-3 && (worst.values[1].value - 0.7).abs() < 1e-3);
    assert!(worst.margin_before_search.unwrap() > worst.margin.unwrap() && rows.len() == 600);
    assert_eq!(rows[worst.sample as usize].measured[0], worst.measured.unwrap());
    assert!(found.requirements.is_empty() && found.notes.iter().any(|note| note.contains("without proof")));
    let (_, found) = swept(&project, &sweep_settings(400, SweepGoal::Worst("f < 0.99".into())), &[]);
    let worst = found.worst.unwrap();
    // At the corner (1, 0) it is 0.49 + 0.49.
    assert!((worst.margin.unwrap() - 0.01).abs() < 1e-12 && !worst.fails, "{worst:?}");
    assert_eq!([worst.values[0].value, worst.values[1].value], [1.0, 0.0]);
    // Of two variants the least margin, wherever it is; variants that the requirement is not of do not run.
    let text = text
        .replace("(x - 0.3)^2 + (y - 0.7)^2", "(x - 0.3)^2 + (y - 0.7)^2 + c")
        .replace("[parameters]\n", "[parameters]\nc = 0\n")
        + "variants = [\"near\", \"far\"]\n[[variant]]\nname = \"near\"\n[[variant]]\nname = \"far\"\nset = { c = 0.001 }\n[[variant]]\nname = \"other\"\nset = { c = 1 }\n";
    let project = self::project(&text);
    let (rows, found) = always_the_same(&project, &sweep_settings(200, SweepGoal::Worst("2".into())));
    let worst = found.worst.unwrap();
    assert!(
        (worst.margin.unwrap() - 0.009).abs() < 1e-12 && worst.variant == "far" && worst.exploration_samples <= 200,
        "{worst:?}"
    );
    assert!(found.variants == ["near", "far"] && rows.len() == 400 && found.missing == 0);
}

/// A straight line of normal numbers beyond four deviations: Φ(−4) = 3.167e-5 lies in the interval, and correlations count.
#[test]
fn rare_failures_have_their_probability() {
    let text = normal(&["x", "y"])
        + "[[figure]]\nname = \"f\"\nvalue = \"0.6*x + 0.8*y\"\n[[requirement]]\nfigure = \"f\"\nbelow = 4\n";
    let model = project(&text);
    let settings = sweep_settings(300, SweepGoal::Rare("f".into()));
    let (rows, found) = always_the_same(&model, &settings);
    let rare = found.rare.unwrap();
    let covers = |rare: &kardan::results::SweptRare, exact: f64| {
        rare.interval.is_some_and(|[low, high]| low <= exact && exact <= high)
    };
    assert!(covers(&rare, 3.167e-5), "{rare:?}");
    assert!(rare.levels.len() >= 4 && rare.deviation.unwrap() < 0.8 && rare.deviation <= rare.deviation_upper_bound);
    assert_eq!(
        (found.missing, found.rows, rows.len() as u64),
        (0, 300 + 270 * (rare.levels.len() as u64 - 1), found.rows)
    );
    // With the correlation −1/2 the variance is 1 − 0.48: Φ(−4/√0.52) = 1.45e-8 is out of reach of few levels, Φ(−3/√0.52) = 1.59e-5 is not.
    let correlation = "[[sweep.correlated]]\nparameters = [\"x\", \"y\"]\ncorrelation = \"1 -0.5; -0.5 1\"\n";
    let nearer = text.replace("below = 4", "below = 3") + correlation;
    let (_, found) = swept(&project(&nearer), &settings, &[]);
    assert!(covers(&found.rare.unwrap(), 1.59e-5));
    // In one of two variants: below −3 or above 3, twice 1.35e-3.
    let either = text
        .replace("below = 4", "below = 3")
        .replace("0.6*x + 0.8*y", "c*(0.6*x + 0.8*y)")
        .replace("[parameters]\n", "[parameters]\nc = 1\n")
        + "[[variant]]\nname = \"up\"\n[[variant]]\nname = \"down\"\nset = { c = -1 }\n";
    let (_, found) = swept(&project(&either), &settings, &[]);
    let rare = found.rare.unwrap();
    assert!(covers(&rare, 2.7e-3) && !covers(&rare, 1.35e-3 / 2.0) && rare.variant == "up, down", "{rare:?}");
}

/// What contradicts itself, or has no way that a search could take, is refused with what to do.
#[test]
fn nonsense_is_refused() {
    let text = normal(&["x"])
        + "[[figure]]\nname = \"f\"\nvalue = \"x\"\n[[requirement]]\nfigure = \"f\"\nbelow = 4\n[[requirement]]\nsignal = \"t\"\nmeasure = \"events\"\nbelow = 5\n\
           [[requirement]]\nsignal = \"s.w\"\nmeasure = \"final\"\nbelow = \"2 rad/s\"\nvariants = [\"b\"]\n[[variant]]\nname = \"a\"\n[[variant]]\nname = \"b\"\n";
    let project = project(&text);
    let refused = |samples: u64, variants: &[&str], goal: SweepGoal| {
        let variants = variants.iter().map(ToString::to_string).collect();
        let diagnostics = project.sweep_plan(&SweepSettings { variants, ..sweep_settings(samples, goal) }).unwrap_err();
        assert!(diagnostics[0].help.is_some());
        format!("{} {}", diagnostics[0].code, diagnostics[0].message)
    };
    let worst = |name: &str| SweepGoal::Worst(name.into());
    for (found, reported) in [
        (refused(100, &["a"], worst("9")), "there is no requirement `9`"),
        (refused(100, &["a"], worst("0")), "there is no requirement `0`"),
        (refused(100, &["a"], worst("")), "there is no requirement ``"),
        (refused(100, &["a"], worst("<")), "several requirements have `<`"),
        (refused(100, &["a"], worst("2")), "has no magnitude"),
        (refused(100, &["a"], worst("3")), "applies to no chosen variant"),
        (refused(50, &["a"], SweepGoal::Rare("1".into())), "fewer than 200"),
        (refused(100, &["a"], SweepGoal::Until(0.0)), "between 1e-5 and 0.5"),
        (refused(100, &["a"], SweepGoal::Until(f64::NAN)), "between 1e-5 and 0.5"),
        (refused(0, &["a"], worst("1")), "0 samples"),
        (refused(u64::MAX, &["a"], SweepGoal::Rare("1".into())), "the allowed number is 1 to"),
    ] {
        assert!(found.contains(reported), "{found}: {reported}");
    }
    let mut plan =
        project.sweep_plan(&SweepSettings { variants: vec!["a".into()], ..sweep_settings(200, worst("1")) }).unwrap();
    plan.shard = Some(Shard { number: 1, of: 2 });
    let run = |plan: &SweepPlan, rows: &mut SweepRows| {
        project.sweep(plan, &Default::default(), rows, &Silent, &mut |_, _| Ok(())).unwrap_err()
    };
    let diagnostics = run(&plan, &mut SweepRows::default());
    assert_eq!(diagnostics[0].code, "sweep::shard");
    // Rows of a search that do not follow from those before them.
    plan.shard = None;
    let mut rows = Vec::new();
    let mut write = |_: u64, found: &[SweepRow]| {
        rows.extend_from_slice(found);
        Ok(())
    };
    project.sweep(&plan, &Default::default(), &mut SweepRows::default(), &Silent, &mut write).unwrap();
    rows[3].values[0] += 1e-9;
    let diagnostics = run(&plan, &mut rows.into_iter().collect());
    assert_eq!(diagnostics[0].code, "sweep::resume");
    let grid = Project::open(text.replace("[[sweep.vary]]", "[sweep]\npoints = \"morris\"\n[[sweep.vary]]"));
    let diagnostics = grid.sweep_plan(&sweep_settings(100, SweepGoal::Until(0.1))).unwrap_err();
    assert_eq!(diagnostics[0].code, "sweep::stopping-rule");
}
