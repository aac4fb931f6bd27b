//! What is found out about a model stands in its page too.

use kardan::project::Project;
use kardan::results::{Sweep, SweepRows};
use kardan::study::{
    DesignSettings, IdentifySettings, LogFile, Settings, Silent, SweepPlan, SweepSettings, design, identify,
};
use kardan::tables::read::in_memory;
use kardan_report::{Again, Samples, sweep_with};

/// A loop whose torque may hardly be larger is no good design, and its page says at which factor.
#[test]
fn a_warning_of_a_design() {
    let source = "[model]\nname = \"far\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
                  [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"100 N m/rad\"\n\
                  damping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\nlag = \"1 ms\"\n[control.far]\n\
                  law = \"position_loop\"\noutput = \"b.phi\"\ninput = \"m\"\nnatural_frequency = \"1.4146 rad/s\"\n\
                  damping_ratio = 0.7\ninertia = \"2 kg m^2\"\nreference = \"r\"\n\
                  [scenario]\nduration = \"1 s\"\noutput_step = \"1 ms\"\n";
    let settings = DesignSettings { simulate: false, ..DesignSettings::default() };
    let found = design(source, &settings, &Silent).expect("a design");
    let margins = found.margins.as_ref().expect("margins");
    let factor = margins.channels.iter().find(|one| !one.is_sensor).expect("a motor").gain[1];
    let page = kardan_report::design(&found).html();
    assert!(!found.verdict().sound && page.contains("class=\"verdict bad\""));
    for expected in [&format!("times {factor:.4} makes the loop unstable"), "with low margins"] {
        assert!(page.contains(expected), "{expected}");
    }
}

/// A log that is damaged is told beside the verdict.
#[test]
fn a_damaged_log() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
    let row = |k: u32| {
        let speed = f64::from(1 + k / 500);
        format!("{},{speed},{}\n", 0.001 * f64::from(k), 2.0 * speed + 1e-3 * f64::from(k * 7919 % 101))
    };
    let mut rows: Vec<String> = (0..4000).map(row).collect();
    rows[2000] = "~~~ restarted ~~~\n".into();
    let text = format!("time,a.w,m.tau\ns,rad/s,N m\n{}", rows.concat());
    let log = LogFile { name: "log.csv".into(), bytes: in_memory(text.into_bytes()) };
    let found = identify(source, vec![log], &IdentifySettings::default(), &Silent).expect("an identification");
    let verdict = found.verdict().text;
    let sound = found.verdict().sound;
    let page = kardan_report::identification(&found).html();
    assert!(!sound && page.contains("The parameter is determined"), "{verdict}");
    assert!(page.contains("class=\"verdict bad\"") && page.contains("damaged"), "{verdict}");
}

/// Where a requirement fails stands below its probability, with units and with what was counted; the speed of a is 4 N m · 1 s / J.
#[test]
fn where_samples_fail() {
    let (_, found, _) = swept(PUSHED, 100);
    let rule = &found.requirements[0].rules[0];
    let page = kardan_report::sweep(&found).markdown();
    let reported = format!("a.inertia ≥ 2 kg m^2: {0} of {0} samples there fail", rule.inside);
    for expected in
        ["Where requirements fail", "fails where:", &reported, "100 % of all failures", "a random half of the samples"]
    {
        assert!(page.contains(expected), "{expected}: {page}");
    }
}

/// Of 3000 samples that all hold, the interval and what fails at most are told with digits that tell them from 100 % and from nothing: 1 − 0.025^(1/3000) is 0.00123,
/// which as a bound is rounded up.
#[test]
fn an_interval_near_certainty_has_digits() {
    let (_, found, _) = swept(&PUSHED.replace("above = \"2 rad/s\"", "above = \"1 rad/s\""), 3000);
    let page = kardan_report::sweep(&found).markdown();
    assert!(page.contains("99.88 % to 100 %") && page.contains("0.0013"), "{page}");
}

/// How many runs have a value is told where some have none: the speed 4 N m · 1 s / J comes to 2 rad/s in a part of them, and none has J below zero.
#[test]
fn runs_that_have_no_value_are_counted() {
    let figure = "[[figure]]\nname = \"rise\"\nsignal = \"a.w\"\nmeasure = \"rise_time\"\ntarget = \"2 rad/s\"\nband = 0.1\n\
                  [[sweep.vary]]\nparameter = \"a.inertia\"\nfrom = \"-1 kg m^2\"\nto = \"3 kg m^2\"\n";
    let (_, found, _) = swept(&format!("{PUSHED}{figure}"), 80);
    let page = kardan_report::sweep(&found).markdown();
    let rise = &found.figures[0].values;
    assert!((rise.runs, rise.invalid_runs) == (80, 20) && (10..60).contains(&rise.count), "{rise:?}");
    let none = 60 - rise.count;
    let reported =
        format!("rise: {} of 80 runs have a value: 20 did not complete and are left out, {none}", rise.count);
    assert!(page.contains(&reported) && page.contains("final a.w \\> 2 rad/s: 60 of 80 runs have a value"), "{page}");
}

/// The speed of a is 4 N m · 1 s / J.
const PUSHED: &str = "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
                      [[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n\
                      [[requirement]]\nsignal = \"a.w\"\nmeasure = \"final\"\nabove = \"2 rad/s\"\n";

fn swept(source: &str, samples: u64) -> (SweepPlan, Sweep, SweepRows) {
    let project = Project::open(source);
    let settings = SweepSettings { samples: Some(samples), ..SweepSettings::default() };
    let plan = project.sweep_plan(&settings).expect("a plan");
    let mut rows = SweepRows::default();
    let found = project.sweep(&plan, &Settings::default(), &mut rows, &Silent, &mut |_, _| Ok(())).expect("a sweep");
    (plan, found, rows)
}

/// With a script and without the page shows the runs; commands are copied as they are, and why there are no full runs is said.
#[test]
fn runs_of_a_sweep_are_drawn() {
    let (plan, found, rows) = swept(PUSHED, 100);
    let mut again = Again {
        command: "kardan run m.toml --set 'a.inertia=2 kg m^2' --variants-from".into(),
        block: plan.block(),
        files: vec!["a.parquet".into(), "b.parquet".into()],
        variants: Vec::new(),
        full: Some(Ok("worst.html".into())),
    };
    let samples = Samples::new(&plan.head, &found, &rows);
    let page = sweep_with(&found, &samples, &again).html();
    let (still, data) = page.split_once("id=\"samples-data\">").expect("data of the runs");
    assert!(data.contains("\"across\":0,\"up\":1,") && data.contains("\"above\":2.0"), "{}", &data[..400]);
    let still = still.split("class=\"unscripted\"").nth(1).expect("a picture that stands still");
    for expected in
        ["final a.w [rad/s] over a.inertia [kg m²]", "class=\"bound\"", "fails final a.w &gt; 2 rad/s", "passes"]
    {
        assert!(still.contains(expected), "{expected}: {}", &still[..2000.min(still.len())]);
    }
    assert!(
        page.contains("--set &#39;a.inertia=2 kg m^2&#39; --variants-from") && page.contains("href=\"worst.html\"")
    );
    again.full = Some(Err("2 runs are missing".into()));
    let page = sweep_with(&found, &samples, &again).html();
    assert!(page.contains("no full runs of the worst cases: 2 runs are missing") && !page.contains("worst.html"));
    assert!(!kardan_report::sweep(&found).html().contains("samples-data"));
}

/// What is the same in all runs is told once.
#[test]
fn what_does_not_spread_is_one_case() {
    let (plan, found, rows) = swept(
        &PUSHED.replace("above = \"2 rad/s\"", "above = \"-2 rad/s\"").replace("to = \"4 N m\"", "to = \"0 N m\""),
        64,
    );
    let page = sweep_with(&found, &Samples::new(&plan.head, &found, &rows), &Again::default()).html();
    let cases = page.split("id=\"cases\"").nth(1).expect("cases").split("</section>").next().unwrap_or_default();
    assert!(cases.contains("the same in all") && !cases.contains("<td>largest"), "{cases}");
}
