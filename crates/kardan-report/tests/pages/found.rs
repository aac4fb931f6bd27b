//! What is found out about a model stands in its page too.

use kardan::project::Project;
use kardan::study::{DesignSettings, IdentifySettings, LogFile, Settings, Silent, SweepSettings, design, identify};
use kardan::tables::read::in_memory;

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
    let factor = margins.channels.iter().find(|one| !one.reading).expect("a motor").gain[1];
    let page = kardan_report::design(&found).html();
    assert!(!found.verdict().sound && page.contains("class=\"verdict bad\""));
    for said in [&format!("times {factor:.4} makes the loop unstable"), "but hardly"] {
        assert!(page.contains(said), "{said}");
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
    let source = "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
                  [[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n\
                  [[requirement]]\nsignal = \"a.w\"\nmeasure = \"final\"\nabove = \"2 rad/s\"\n";
    let project = Project::open(source);
    let plan = project.sweep_plan(&SweepSettings { samples: Some(100), ..SweepSettings::default() }).expect("a plan");
    let found = project
        .sweep(&plan, &Settings::default(), kardan::results::SweepRows::default(), &Silent, &mut |_, _| Ok(()))
        .expect("a sweep");
    let rule = &found.requirements[0].rules[0];
    let page = kardan_report::sweep(&found).markdown();
    let told = format!("a.inertia ≥ 2 kg m^2: {0} of {0} samples there fail", rule.inside);
    for said in ["Where they fail", "fails where:", &told, "100 % of all failures", "one half of the samples"] {
        assert!(page.contains(said), "{said}: {page}");
    }
}
