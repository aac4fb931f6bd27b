//! `kardan safety`: each row against what its fault does by construction, and against the run that its command names.

use crate::common::runs_only;
use kardan::diagnostics::plain;
use kardan::results::{Safety, SafetyRow, SafetyVerdict};
use kardan::study::{self, Project, SafetySettings, Settings, Silent};

/// A wheel of 2 kg m² that a motor pushes with `push`, from a speed of 1 rad/s on, read by two encoders each 10 ms; a monitor that waits for 50 ms and a
/// machine that goes from `on` to `off`; the number of faults that are asked for, and the rest of the file.
fn wheel(faults: &str, safety: &str) -> String {
    format!(
        "[parameters]\npush = \"4 N m\"\nthreshold = \"0.01 rad\"\n[shaft.a]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n[motor.n]\nshaft = \"a\"\n\
         [sensor.one]\nmeasures = \"angle\"\nshaft = \"a\"\n[sensor.two]\nmeasures = \"angle\"\nshaft = \"a\"\n\
         [block.differ]\nkind = \"monitor\"\nresidual = \"one - two\"\nthreshold = \"threshold\"\ndebounce = \"50 ms\"\nsample_time = \"10 ms\"\n\
         [block.deaf]\nkind = \"monitor\"\nresidual = \"one - two\"\nthreshold = \"90 rad\"\nsample_time = \"10 ms\"\n\
         [block.mode]\nkind = \"state_machine\"\nstates = [\"on\", \"off\"]\n\
         transitions = [{{ from = \"on\", to = \"off\", when = \"differ\" }}]\nsample_time = \"10 ms\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"2 ms\"\ninitial = {{ \"a.w\" = \"1 rad/s\" }}\n\
         [[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"push\"\n{faults}{safety}"
    )
}

const OFFSET: &str = "[fault.offset]\nsensor = \"one\"\nkind = \"offset\"\nvalue = \"3 rad\"\nat = \"0.5 s\"\n";
const LATER: &str = "[fault.later]\nsensor = \"one\"\nkind = \"offset\"\nvalue = \"3 rad\"\nat = \"0.505 s\"\n";
const LITTLE: &str = "[fault.little]\nsensor = \"two\"\nkind = \"offset\"\nvalue = \"0.001 rad\"\nat = \"0.5 s\"\n";
const DEAD: &str = "[fault.dead]\nmotor = \"m\"\nat = \"0.5 s\"\n";
const SPEED: &str =
    "[[safety.effect]]\nname = \"speed\"\nsignal = \"a.w\"\nwindow = \"100 ms\"\nbelow = \"0.1 rad/s\"\n";

fn tried(source: &str) -> Safety {
    let settings = SafetySettings { origin: "wheel.toml".into(), changes: Vec::new() };
    Project::open(source)
        .safety(&settings, &Silent)
        .unwrap_or_else(|reported| panic!("{}\n{source}", plain(source, &reported)))
}

fn row<'a>(table: &'a Safety, faults: &[&str]) -> &'a SafetyRow {
    table.rows.iter().find(|row| row.faults == faults).unwrap_or_else(|| panic!("no row {faults:?}"))
}

/// The alarm comes with the fifth sample that sees the offset, the machine goes with it; a dead motor lacks 2 rad/s² for the length of the window.
#[test]
fn rows_are_what_their_faults_do() {
    let safety =
        format!("[safety]\ndetected = \"mode.off\"\nreaction = \"mode\"\ndetection_time_limit = \"42 ms\"\n{SPEED}");
    let table = tried(&wheel(&[OFFSET, LATER, LITTLE, DEAD].concat(), &safety));
    assert_eq!((table.rows.len(), table.missing), (5, 0));
    let free = row(&table, &[]);
    assert_eq!((free.verdict, free.command.as_str()), (SafetyVerdict::NoAlarm, "kardan run wheel.toml"));
    let offset = row(&table, &["offset"]);
    assert!((offset.detection_time.unwrap() - 0.04).abs() < 1e-9, "{offset:?}");
    assert!((offset.reaction[0].after - 0.04).abs() < 1e-9 && offset.reaction[0].state == "off", "{offset:?}");
    assert!(offset.detection_resolution.is_some_and(|to| to < 1.1e-4), "rows lie close behind a fault: {offset:?}");
    assert_eq!((offset.verdict, offset.effects[0].measured), (SafetyVerdict::Detected, Some(0.0)));
    assert_eq!(offset.command, "kardan run wheel.toml --fault offset");
    // The next sample comes 5 ms after it: too late by 3 ms, and harmless.
    let later = row(&table, &["later"]);
    assert!((later.detection_time.unwrap() - 0.045).abs() < 2e-3, "{later:?}");
    assert_eq!(later.verdict, SafetyVerdict::LateHarmless);
    assert_eq!(
        (row(&table, &["little"]).verdict, row(&table, &["little"]).detection_time),
        (SafetyVerdict::Harmless, None)
    );
    let dead = row(&table, &["dead"]);
    assert!((dead.effects[0].measured.unwrap() - 0.2).abs() < 1e-12, "{dead:?}");
    assert_eq!((dead.verdict, dead.worst, dead.fault_time), (SafetyVerdict::Harmful, Some(0), Some(0.5)));
    assert!(!table.passes() && table.failing().count() == 1);
    let differ = table.monitors.iter().find(|one| one.name == "differ").unwrap();
    assert_eq!((differ.raised_by.len(), differ.false_alarms.len()), (2, 0), "{differ:?}");
    assert!(
        table.notes.iter().any(|note| note == "Monitor `deaf`: no fault of this list raises it."),
        "{:?}",
        table.notes
    );
}

/// Each row has the numbers of the run that it names, to the last bit: with its variant, its values and its faults.
#[test]
fn a_row_is_the_run_of_its_command() {
    let variants = "[[variant]]\nname = \"slow\"\n[[variant]]\nname = \"fast\"\nset = { threshold = \"0.02 rad\" }\n";
    let safety = format!(
        "[safety]\npairs = \"yes\"\nvalues = {{ push = [\"4 N m\", \"8 N m\"] }}\ndetected = \"differ\"\n{SPEED}{variants}"
    );
    let source = wheel(&[OFFSET, LITTLE, DEAD].concat(), &safety);
    let (table, project) = (tried(&source), Project::open(source.as_str()));
    assert_eq!(table.rows.len(), 2 * 2 * 7);
    let run = |row: &SafetyRow, faults: &[String]| {
        let values: Vec<String> = row.values.iter().map(|one| format!("{}={}", one.name, one.value)).collect();
        let (project, _) = project.with(&values).unwrap();
        let settings = Settings { variants: vec![row.variant.clone()], faults: faults.to_vec(), ..runs_only() };
        project.run(&settings, &Silent).unwrap().runs.remove(0)
    };
    for row in table.rows.iter().filter(|row| !row.faults.is_empty()) {
        let (faulty, healthy) = (run(row, &row.faults), run(row, &[]));
        let speeds = [&faulty, &healthy].map(|run| run.series.signal("a.w").unwrap().values.clone());
        let mut most = 0.0_f64;
        for (k, _) in faulty.series.time.iter().enumerate().filter(|(_, time)| (0.5..=0.6 + 1e-12).contains(*time)) {
            most = most.max((speeds[0][k] - speeds[1][k]).abs());
        }
        assert_eq!(row.effects[0].measured, Some(most), "{}", row.command);
        let alarms = faulty.series.signal("differ").unwrap().values.iter().zip(&faulty.series.time);
        let first = alarms.into_iter().find(|(alarm, _)| **alarm > 0.5).map(|(_, time)| time - 0.5);
        assert_eq!(row.detection_time, first, "{}", row.command);
        let push = if row.values[0].value == "4 N m" { 4.0 } else { 8.0 };
        let expected = if row.faults.contains(&"dead".to_string()) { 0.1 * push / 2.0 } else { 0.0 };
        assert!((most - expected).abs() < 1e-12, "{}: {most}", row.command);
    }
    let last = table.rows.last().unwrap();
    assert_eq!(last.command, "kardan run wheel.toml --variant fast --set 'push=8 N m' --fault little,dead");
    assert_eq!(last.verdict, SafetyVerdict::Harmful);
    // The offset of one sensor and a little one of the other: the sum is seen.
    assert_eq!(row(&table, &["offset", "little"]).verdict, SafetyVerdict::Detected);
}

/// An alarm without a fault is a verdict of its own, and no detection of a fault; what is there before it is told.
#[test]
fn false_alarms() {
    let safety = format!("[safety]\ndetected = \"a.w > 1.5 rad/s\"\n{SPEED}");
    let table = tried(&wheel(&[OFFSET, DEAD].concat(), &safety));
    let free = row(&table, &[]);
    assert_eq!(free.verdict, SafetyVerdict::FalseAlarm);
    // 1 + 2 t rad/s.
    assert!((free.detection_time.unwrap() - 0.25).abs() < 2.1e-3, "{free:?}");
    let offset = row(&table, &["offset"]);
    assert!(
        offset.detection_time.is_none()
            && offset.note.as_ref().is_some_and(|note| note.contains("before the fault begins"))
    );
    assert!(table.notes.iter().any(|note| note.contains("No fault of this list makes")), "{:?}", table.notes);
    assert!(table.notes.iter().any(|note| note.contains("is true without a fault in")), "{:?}", table.notes);
}

/// A value that the model cannot take makes rows that say so, and the others are there.
#[test]
fn rows_that_cannot_be_run_give_the_reason() {
    let safety =
        format!("[safety]\nvalues = {{ threshold = [\"0.01 rad\", \"-1 rad\"] }}\ndetected = \"differ\"\n{SPEED}");
    let table = tried(&wheel(OFFSET, &safety));
    let failed: Vec<&SafetyRow> = table.rows.iter().filter(|row| row.verdict == SafetyVerdict::Failed).collect();
    assert_eq!((table.rows.len(), failed.len()), (4, 2));
    assert!(
        failed
            .iter()
            .all(|row| row.values[0].value == "-1 rad"
                && row.note.as_ref().is_some_and(|note| note.contains("threshold")))
    );
}

/// Pairs of one part at the same time are left out and told; a fault that nobody in the loop would see is a row.
#[test]
fn pairs_that_cannot_be() {
    let safety = format!("[safety]\npairs = \"yes\"\n{SPEED}");
    let table = tried(&wheel(&[OFFSET, LATER, DEAD].concat(), &safety));
    assert_eq!(table.rows.len(), 1 + 3 + 2);
    assert!(table.notes.iter().any(|note| note.contains("offset with later")), "{:?}", table.notes);
}

/// What cannot be asked is told with its place and what to do.
#[test]
fn invalid_requests_are_reported() {
    let cases = [
        ("[safety]\nfaults = [\"dad\"]\ndetected = \"differ\"\n", "there is no fault `dad`", "did you mean `dead`?"),
        ("[safety]\nfaults = []\ndetected = \"differ\"\n", "empty list", "omit it"),
        ("[safety]\ndetected = \"difer\"\n", "no signal", "differ"),
        ("[safety]\ndetected = \"one.phi - two.phi\"\n", "not a condition", "compare it"),
        ("[safety]\ndetected = \"differ\"\nreaction = \"differ\"\n", "no state machine `differ`", "mode"),
        (
            "[safety]\ndetection_time_limit = \"1 s\"\n",
            "`detection_time_limit` has no effect without `detected`",
            "add",
        ),
        ("[safety]\ndetected = \"differ\"\nvariants = [\"x\"]\n", "no variant `x`", "leave this key out"),
        ("[safety]\ndetected = \"differ\"\nvalues = { pusch = \"1 N m\" }\n", "no such parameter", "push"),
        ("[safety]\ndetected = \"differ\"\nvalues = { push = [\"1 rad\"] }\n", "expected a torque", "N m"),
        (
            "[safety]\n[[safety.effect]]\nname = \"x\"\nsignal = \"a.phi\"\nbelow = \"1 N m\"\n",
            "expected an angle",
            "deg",
        ),
        ("[safety]\n[[safety.effect]]\nname = \"x\"\nsignal = \"a.ph\"\n", "no signal `a.ph`", "a.phi"),
        (
            "[safety]\n[[safety.effect]]\nname = \"x\"\nsignal = \"a.phi\"\nwindow = \"0.6 s\"\n",
            "after the end of the run",
            "duration",
        ),
        (
            "[safety]\n[[safety.effect]]\nname = \"x\"\nsignal = \"a.phi\"\nabove = \"2 deg\"\nbelow = \"1 deg\"\n",
            "no value is above",
            "less",
        ),
    ];
    for (safety, message, help) in cases {
        let source = wheel(&[OFFSET, DEAD].concat(), safety);
        let reported = study::prepare(&source).1;
        let found = reported.iter().find(|one| one.message.contains(message));
        let found = found.unwrap_or_else(|| panic!("{safety}: {}", plain(&source, &reported)));
        assert!(found.help.as_ref().is_some_and(|text| text.contains(help)), "{safety}: {found:?}");
        assert!(!found.labels.is_empty(), "{safety}: {found:?}");
    }
    let refused = |source: &str| {
        Project::open(source).safety(&SafetySettings::default(), &Silent).expect_err("refused").remove(0)
    };
    assert!(refused(&wheel("", "")).message.contains("no faults to analyse"));
    assert!(refused(&wheel(DEAD, "[safety]\n")).message.contains("neither"));
    let own = "[[variant]]\nname = \"ill\"\nfaults = [\"dead\"]\n";
    assert!(
        refused(&wheel(DEAD, &format!("[safety]\ndetected = \"differ\"\n{own}"))).message.contains("faults of its own")
    );
}

/// A value is refused where a variant that the table runs sets it, and only there.
#[test]
fn values_that_a_variant_sets() {
    let variants = "[[variant]]\nname = \"plain\"\n[[variant]]\nname = \"strong\"\nset = { push = \"8 N m\" }\n\
                    [[variant]]\nname = \"ill\"\nset = { threshold = \"1 rad\" }\nfaults = [\"dead\"]\n";
    let of = |chosen: &str, value: &str| {
        let section = format!("[safety]\ndetected = \"differ\"\n{chosen}values = {{ {value} }}\n{SPEED}");
        wheel(DEAD, &(section + variants))
    };
    let table = tried(&of("variants = [\"plain\"]\n", "push = [\"4 N m\", \"0 N m\"]"));
    // 2 rad/s² are missing for 0.1 s, and nothing where nothing was asked for.
    let measured: Vec<_> = table.rows.iter().filter(|row| !row.faults.is_empty()).collect();
    let missing = |k: usize| measured[k].effects[0].measured.unwrap();
    assert!(measured.len() == 2 && (missing(0) - 0.2).abs() < 1e-9 && missing(1) == 0.0, "{measured:?}");
    // Without a list those with faults of their own are not run.
    assert_eq!(tried(&of("", "threshold = [\"0.02 rad\"]")).rows.len(), 4);
    for chosen in ["", "variants = [\"plain\", \"strong\"]\n"] {
        let reported = study::prepare(&of(chosen, "push = [\"4 N m\"]")).1;
        let found =
            reported.iter().find(|one| one.code == "safety::set-by-variant").unwrap_or_else(|| panic!("{reported:?}"));
        assert!(found.message.contains("the variant `strong` sets it") && !found.labels.is_empty(), "{found:?}");
        assert!(found.help.as_ref().is_some_and(|help| help.contains("variants")), "{found:?}");
    }
    // A limit that differs between the variants, by itself or within an expression, is refused.
    for limit in ["rate", "2 * rate"] {
        let varied = of("", "push = [\"4 N m\"]")
            .replace("[parameters]\n", "[parameters]\nrate = \"0.1 rad/s\"\n")
            .replace("below = \"0.1 rad/s\"", &format!("below = \"{limit}\""))
            + "[[variant]]\nname = \"fast\"\nset = { rate = \"1 rad/s\" }\n";
        let reported = study::prepare(&varied).1;
        let found = reported.iter().find(|one| one.code == "requirement::set-by-variant");
        assert!(found.is_some_and(|one| one.message.contains("`rate` differs")), "{limit}: {reported:?}");
    }
}

/// A grid of more rows than anybody reads is refused before it is written out, however many they would be.
#[test]
fn an_oversized_grid_is_refused_at_once() {
    let values: Vec<String> = (0..60).map(|k| format!("\"{k} N m\"")).collect();
    let (mut names, mut lists) = (String::new(), Vec::new());
    for k in 0..8 {
        names += &format!("p{k} = \"1 N m\"\n");
        lists.push(format!("p{k} = [{}]", values.join(", ")));
    }
    let used = "[[scenario.event]]\nsignal = \"n.tau\"\nat = \"0 s\"\nto = \"p0 + p1 + p2 + p3 + p4 + p5 + p6 + p7\"\n";
    let safety = format!("{used}[safety]\nvalues = {{ {} }}\n{SPEED}", lists.join(", "));
    let source = wheel(DEAD, &safety).replace("[parameters]\n", &format!("[parameters]\n{names}"));
    let reported = Project::open(&source).safety(&SafetySettings::default(), &Silent).unwrap_err();
    // 60^8 combinations, each with and without the fault.
    assert_eq!(
        reported[0].message,
        format!("the table would have {} rows, more than 20000", 60_u64.pow(8) * 2),
        "{reported:#?}"
    );
}
