//! Manoeuvres, drivers and figures: against their definitions and closed forms.

use std::f64::consts::PI;

use kardan::results::{Run, Study};
use kardan::simulate::Method;
use kardan::study::{Project, Settings, Silent};

use crate::common::{close, run_by, signal};

fn study(source: &str) -> Study {
    let project = Project::open(source);
    let settings = Settings { runs_only: true, ..Settings::default() };
    project.run(&settings, &Silent).unwrap_or_else(|diagnostics| panic!("{diagnostics:?}"))
}

fn value(run: &Run, name: &str) -> f64 {
    let found = run.figures.iter().find(|figure| figure.name == name);
    let found = found.unwrap_or_else(|| panic!("no figure {name}: {:?}", run.figures));
    found.value.unwrap_or_else(|| panic!("{name} has no value: {:?}", run.notes))
}

/// A linear car at a speed, steered by a robot at a shaft that turns its wheels.
const CAR: &str = "
[parameters]
pace = \"20 m/s\"

[shaft.wheel]
inertia = \"0.01 kg m^2\"

[vehicle.car]
mass = \"1500 kg\"
yaw_inertia = \"2500 kg m^2\"
front_axle = \"1.2 m\"
rear_axle = \"1.5 m\"
front_stiffness = \"90 kN/rad\"
rear_stiffness = \"110 kN/rad\"
speed = \"pace\"
steered_by = \"wheel\"
steering_ratio = 16
";

const ROBOT: &str = "
[driver.robot]
wheel = \"wheel\"
kind = \"open_loop\"
angle = \"steer\"
stiffness = \"5 kN m/rad\"
damping = \"100 N m s/rad\"
lag = \"5 ms\"
";

/// FMVSS 126: three quarters of a sine, a pause at its second peak, the last quarter.
#[test]
fn a_sine_with_dwell_is_that_of_its_definition() {
    let (amplitude, f, dwell, start) = (2.0, 0.7, 0.5, 0.3);
    let run = run_by(
        &format!(
            "[shaft.hand]\ninertia = \"1 kg m^2\"\n[torque.push]\nshaft = \"hand\"\nlaw = \"turn\"\n\
             [signal.turn]\nkind = \"sine_with_dwell\"\namplitude = \"{amplitude} N m\"\nstart = \"{start} s\"\noffset = \"0.1 N m\"\n\
             [scenario]\nduration = \"4 s\"\noutput_step = \"7 ms\"\n"
        ),
        Method::Automatic,
        None,
    );
    for (t, found) in run.series.time.iter().zip(signal(&run, "push.tau")) {
        let x = t - start;
        let exact = match x {
            x if x < 0.0 || x > 1.0 / f + dwell => 0.0,
            x if x < 0.75 / f => (2.0 * PI * f * x).sin(),
            x if x < 0.75 / f + dwell => -1.0,
            x => (2.0 * PI * f * (x - dwell)).sin(),
        };
        close(*found, 0.1 + amplitude * exact, 1e-12, &format!("at {t}"));
    }
}

/// A smooth step has no corners: 3 x^2 - 2 x^3.
#[test]
fn a_smooth_step_is_that_of_its_definition() {
    let run = run_by(
        "[shaft.hand]\n[prescribed_motion.hands]\nshaft = \"hand\"\nangle = \"turn\"\n[shaft.other]\ninertia = \"1 kg m^2\"\n\
         [signal.turn]\nkind = \"smooth_step\"\nfrom = \"-1 rad\"\nto = \"2 rad\"\nstart = \"0.2 s\"\nover = \"0.5 s\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"3 ms\"\n",
        Method::Automatic,
        None,
    );
    for ((t, angle), speed) in run.series.time.iter().zip(signal(&run, "hand.phi")).zip(signal(&run, "hand.w")) {
        let x = ((t - 0.2) / 0.5).clamp(0.0, 1.0);
        close(*angle, -1.0 + 3.0 * (3.0 - 2.0 * x) * x * x, 1e-12, "angle");
        close(*speed, 3.0 * 6.0 * x * (1.0 - x) / 0.5, 1e-11, "speed");
    }
}

/// A spring-mass system under a sine: gain 1/|k - J w^2 + i d w| and its delay, once the transients are gone.
#[test]
fn gain_and_lag_of_a_second_order_system() {
    let (j, k, d, f) = (0.5, 40.0, 6.0, 1.3);
    let study = study(&format!(
        "[shaft.body]\ninertia = \"{j} kg m^2\"\ndamping = \"{d} N m s/rad\"\n[spring_damper.spring]\nshaft_1 = \"body\"\nstiffness = \"{k} N m/rad\"\n\
         [torque.push]\nshaft = \"body\"\nlaw = \"3 N m * sin(2 pi * 1.3 Hz * t)\"\n[scenario]\nduration = \"9 s\"\n\
         [[figure]]\nname = \"gain\"\nsignal = \"body.phi\"\nmeasure = \"gain\"\nover = \"push.tau\"\nfrequency = \"1.3 Hz\"\nfrom = \"6 s\"\n\
         [[figure]]\nname = \"lag\"\nsignal = \"body.phi\"\nmeasure = \"lag\"\nover = \"push.tau\"\nfrequency = \"1.3 Hz\"\nfrom = \"6 s\"\ndisplay_unit = \"ms\"\n\
         [[figure]]\nname = \"phase\"\nsignal = \"body.phi\"\nmeasure = \"phase_lag\"\nover = \"push.tau\"\nfrequency = \"1.3 Hz\"\nfrom = \"6 s\"\n\
         [[figure]]\nname = \"turns\"\nvalue = \"lag * 1.3 Hz * 2 pi / phase\"\n"
    ));
    let run = &study.runs[0];
    let w = 2.0 * PI * f;
    let (re, im): (f64, f64) = (k - j * w * w, d * w);
    close(value(run, "gain"), 1.0 / re.hypot(im), 1e-6 / k, "gain");
    close(value(run, "lag"), im.atan2(re) / w, 1e-6, "lag");
    close(value(run, "phase"), im.atan2(re), 1e-6, "phase");
    close(value(run, "turns"), 1.0, 1e-9, "an expression of figures");
    let lag = run.figures.iter().find(|figure| figure.name == "lag").unwrap();
    assert_eq!(lag.display.as_ref().map(|unit| unit.unit.as_str()), Some("ms"));
}

/// A spring and a friction beside each other, moved to and fro: the branches of the force are 2 c apart, and its slope is s.
#[test]
fn the_loop_of_friction_beside_a_spring() {
    let study = study(
        "[shaft.hand]\ninertia = \"1e-6 kg m^2\"\n[prescribed_motion.drive]\nshaft = \"hand\"\nangle = \"0.3 rad * sin(2 pi t / 2 s)\"\n\
         [spring_damper.loop]\nshaft_1 = \"hand\"\nstiffness = \"40 N m/rad\"\nfriction = \"1.5 N m\"\n\
         [shaft.other]\ninertia = \"1 kg m^2\"\n[scenario]\nduration = \"6 s\"\n\
         [[figure]]\nname = \"apart\"\nsignal = \"drive.tau\"\nmeasure = \"hysteresis\"\nover = \"hand.phi\"\nfrom = \"0.5 s\"\n\
         [[figure]]\nname = \"slope\"\nsignal = \"drive.tau\"\nmeasure = \"gradient\"\nover = \"hand.phi\"\nfrom = \"0.5 s\"\n\
         [[figure]]\nname = \"swing\"\nsignal = \"hand.phi\"\nmeasure = \"peak_to_peak\"\n\
         [[figure]]\nname = \"middle\"\nsignal = \"hand.phi\"\nmeasure = \"mean\"\n\
         [[figure]]\nname = \"top\"\nsignal = \"hand.phi\"\nmeasure = \"time_of_max\"\nfrom = \"1 s\"\n\
         [[figure]]\nname = \"then\"\nsignal = \"hand.phi\"\nmeasure = \"at\"\nat = \"0.25 s\"\n",
    );
    let run = &study.runs[0];
    close(value(run, "apart"), 3.0, 1e-3, "branches");
    close(value(run, "slope"), 40.0, 1e-2, "slope");
    close(value(run, "swing"), 0.6, 1e-9, "peak to peak");
    close(value(run, "middle"), 0.0, 1e-9, "mean");
    close(value(run, "top"), 1.5, 1e-9, "time of the peak");
    close(value(run, "then"), 0.3 * (PI / 4.0).sin(), 1e-9, "at a time");
}

/// ISO 4138 with linear tyres: m/l (b/C_f - a/C_r), the slope of every state of a ramp that goes on long enough.
#[test]
fn the_understeer_gradient_of_a_linear_car() {
    let manoeuvre = "[manoeuvre.circle]\nkind = \"steady_circle\"\namplitude = \"60 deg\"\nover = \"20 s\"\n";
    let study = study(&format!("{CAR}{ROBOT}{manoeuvre}"));
    let run = &study.runs[0];
    let gradient = 1500.0 / 2.7 * (1.2_f64 / -110e3 + 1.5 / 90e3);
    close(value(run, "circle_understeer"), gradient, 1e-6 * gradient, "understeer gradient");
    // The angle of sideslip at the rear is that of the rear tyres.
    let slope = -1500.0 * 1.2 / 2.7 / 110e3 + 1.5 / 400.0;
    close(value(run, "circle_sideslip"), slope, 1e-3 * gradient, "sideslip over lateral acceleration");
    assert_eq!((run.name.as_str(), run.series.time.last()), ("circle", Some(&21.0)));
}

/// A step: the yaw rate's steady value, and TB factor as the product of its two figures.
#[test]
fn the_step_of_a_linear_car() {
    let manoeuvre = "[manoeuvre.step]\nkind = \"step_steer\"\namplitude = \"-48 deg\"\nset = { pace = \"30 m/s\" }\nduration = \"6 s\"\n";
    let study = study(&format!("{CAR}{ROBOT}{manoeuvre}"));
    let run = &study.runs[0];
    let gradient = 1500.0 / 2.7 * (1.5_f64 / 90e3 - 1.2 / 110e3);
    let gain = 30.0 / (2.7 + gradient * 900.0) / 16.0;
    close(value(run, "step_yaw_gain"), gain, 1e-3 * gain, "yaw gain");
    let (peak, slip) = (value(run, "step_peak_time"), value(run, "step_sideslip"));
    close(value(run, "step_tb"), peak * slip.abs(), 1e-12, "TB factor");
    assert!(value(run, "step_overshoot") > 0.0 && peak > 0.1 && peak < 1.0);
    assert!(value(run, "step_response_time") < peak);
}

/// Variants drive what they name, with their own values before those of the manoeuvre; each has its own criteria, also within a grid.
#[test]
fn variants_drive_manoeuvres() {
    let more = "
[manoeuvre.dwell]
kind = \"sine_with_dwell\"
amplitude = \"60 deg\"
set = { pace = \"22 m/s\" }

[manoeuvre.weave]
kind = \"weave\"
amplitude = \"10 deg\"
evaluate = \"no\"

[[variant]]
name = \"swerve\"
manoeuvre = \"dwell\"

[[variant]]
name = \"slow\"
manoeuvre = \"dwell\"
set = { pace = \"15 m/s\" }

[[variant]]
name = \"straight\"

[[variant]]
name = \"wave\"
manoeuvre = \"weave\"

[variants]
load = \"[0, 1]\"

[scenario]
duration = \"0.5 s\"

[disturbance.gust]
shaft = \"car_yaw\"
";
    let car = CAR.replace("[parameters]", "[parameters]\nload = 0").replace("1500 kg", "1500 kg * (1 + load / 10)");
    let study = study(&format!("{car}{ROBOT}{more}"));
    let names: Vec<&str> = study.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names[..3], ["swerve_load-0", "swerve_load-1", "slow_load-0"]);
    for run in &study.runs {
        let criteria: Vec<&str> = run.requirements.iter().map(|one| one.text.as_str()).collect();
        let end = *run.series.time.last().unwrap();
        let speed = signal(run, "car.v_x")[0];
        if run.name.starts_with("swerve") || run.name.starts_with("slow") {
            assert_eq!(criteria, ["dwell_ratio_1 < 0.35", "dwell_ratio_2 < 0.2", "dwell_way > 1.83 m"]);
            close(end, 3.5 + 1.0 / 0.7, 1e-9, "duration");
            close(speed, if run.name.starts_with("slow") { 15.0 } else { 22.0 }, 1e-12, "speed");
            // FMVSS 126: 1 s behind the end of the wave over the peak against its first half.
            let at = |time: f64| {
                let k = run.series.time.iter().position(|t| *t >= time - 1e-9).unwrap();
                -signal(run, "car.yaw_rate")[k]
            };
            let rows = run.series.time.iter().zip(signal(run, "car.yaw_rate"));
            let (from, until) = (1.0 + 0.5 / 0.7, 1.5 + 1.0 / 0.7);
            let peak = rows.filter(|(t, _)| (from..=until).contains(*t)).map(|(_, r)| -r).fold(0.0, f64::max);
            close(value(run, "dwell_ratio_1"), at(until + 1.0) / peak, 1e-4, "ratio");
        } else {
            assert!(criteria.is_empty() && run.figures.is_empty());
            close(end, if run.name.starts_with("wave") { 18.5 } else { 0.5 }, 1e-9, "duration");
        }
    }
}

/// Drivers stay between the cones of ISO 3888-1 at 20 m/s, to both sides; with hands off nobody does.
#[test]
fn drivers_follow_the_double_lane_change() {
    let model = |kind: &str, side: &str, grip: f64| {
        format!(
            "{CAR}
[driver.anna]
wheel = \"wheel\"
path = \"lane\"
car = \"car\"
grip = {grip}
{kind}

[manoeuvre.change]
kind = \"double_lane_change\"
width = \"1.8 m\"
side = \"{side}\"
duration = \"9 s\"
"
        )
    };
    // i (l + K u^2) = 16 (2.7 m + 1.28 m).
    let two_level = "kind = \"two_level\"\ngain = \"8 deg/m\"\ncurvature_gain = \"64 rad m\"";
    let preview = "kind = \"preview\"\ngain = \"17 deg/m\"\npreview = \"1.05 s\"\nreaction = \"0.1 s\"";
    for (kind, side) in [(two_level, "left"), (two_level, "right"), (preview, "left"), (preview, "right")] {
        let study = study(&model(kind, side, 1.0));
        let run = &study.runs[0];
        assert!(run.requirements.iter().all(|one| one.passed), "{side}: {:?}", run.requirements);
        let most = signal(run, "car.y").iter().fold(0.0_f64, |most, y| if y.abs() > most.abs() { *y } else { most });
        close(most.abs(), 3.5, 0.3, "offset of the lanes");
        assert_eq!(most > 0.0, side == "left");
        if kind == two_level {
            // Of lanes of 2.23 m for a car of 1.8 m 0.215 m are left on each side.
            assert!(value(run, "change_room") > 0.1);
        }
    }
    let free = study(&model(two_level, "left", 0.0));
    assert!(!free.runs[0].requirements[0].passed);
}

/// A run that ends before the car is through all cones has not shown that it would be: its room has no value, and that is told with both places.
#[test]
fn a_run_that_ends_between_the_cones_passes_nothing() {
    for (kind, end) in [("double_lane_change", 155.0), ("obstacle_avoidance", 91.0)] {
        let model = |duration: f64| {
            format!(
                "{CAR}{ROBOT}[manoeuvre.change]\nkind = \"{kind}\"\nsteering_signal = \"steer\"\nwidth = \"1.8 m\"\nduration = \"{duration} s\"\n"
            )
            .replace("angle = \"steer\"", "angle = \"0 deg\"")
        };
        let room = |run: &Run| run.figures.iter().find(|figure| figure.name == "change_room").unwrap().value;
        // Straight on at 20 m/s, with the rear axle 1.5 m behind.
        let early = study(&model(1.2)).runs.remove(0);
        assert!(room(&early).is_none() && !early.requirements[0].passed, "{:?}", early.requirements);
        let reported = format!("its rear axle reaches x = 22.5 m and the last cones are at x = {end:.1} m");
        let found =
            early.notes.iter().find(|note| note.contains(&reported)).unwrap_or_else(|| panic!("{:?}", early.notes));
        assert!(found.contains("lengthen `duration` of the manoeuvre `change`"), "{found}");
        let last = (end + 1.5) / 20.0;
        assert!(room(&study(&model(last - 0.01)).runs[0]).is_none());
        assert!(room(&study(&model(last + 0.01)).runs[0]).is_some_and(|room| room < 0.0));
    }
}

/// What a weave measures are means over whole waves: a part of one is refused.
#[test]
fn a_weave_has_whole_waves() {
    let reported = |periods: &str| {
        let weave = format!("[manoeuvre.on_centre]\nkind = \"weave\"\namplitude = \"15 deg\"\nperiods = {periods}\n");
        Project::open(format!("{CAR}{ROBOT}{weave}")).diagnostics().to_vec()
    };
    for periods in ["2", "3.0", "\"4\""] {
        assert!(
            reported(periods).iter().all(|one| one.code != "manoeuvre::periods"),
            "{periods}: {:?}",
            reported(periods)
        );
    }
    for (periods, help) in [("2.5", "periods = 3"), ("0.5", "periods = 1"), ("\"2.5\"", "periods = 3")] {
        let all = reported(periods);
        let found = all.iter().find(|one| one.code == "manoeuvre::periods").unwrap_or_else(|| panic!("{all:?}"));
        assert!(found.message.starts_with("manoeuvre `on_centre`: `periods` is"), "{found:?}");
        assert!(found.help.as_ref().is_some_and(|text| text.contains(help)) && !found.labels.is_empty(), "{found:?}");
    }
}

/// Lanes of both parts: middles, widths and offsets as the standard has them, for a car of 2 m.
#[test]
fn lanes_have_the_sizes_of_the_standard() {
    for (kind, ends, widths, middle) in [
        ("iso_3888_1", [15.0, 45.0, 70.0, 95.0, 125.0], [2.45, 2.65, 2.85], 3.5),
        ("iso_3888_2", [12.0, 25.5, 36.5, 49.0, 61.0], [2.45, 3.0, 3.0], 1.225 + 1.0 + 1.5),
    ] {
        let run = run_by(
            &format!(
                "[shaft.a]\ninertia = \"1 kg m^2\"\n[path.lane]\nkind = \"{kind}\"\nwidth = \"2 m\"\nstart = \"-10 m\"\n\
                 [block.middle]\nkind = \"gain\"\ngain = 1\ninput = \"lane(t * 1 m/s - 10 m)\"\n\
                 [block.left]\nkind = \"gain\"\ngain = 1\ninput = \"lane_left(t * 1 m/s - 10 m)\"\n\
                 [block.right]\nkind = \"gain\"\ngain = 1\ninput = \"lane_right(t * 1 m/s - 10 m)\"\n\
                 [scenario]\nduration = \"125 s\"\noutput_step = \"0.5 s\"\n"
            ),
            Method::Automatic,
            None,
        );
        let [y, left, right] = ["middle", "left", "right"].map(|name| signal(&run, name));
        for (k, x) in run.series.time.iter().enumerate() {
            let lane = [0.0..=ends[0], ends[1]..=ends[2], ends[3]..=ends[4]].iter().position(|part| part.contains(x));
            if let Some(lane) = lane {
                let at = if lane == 1 { middle } else { 0.0 };
                close(y[k], at, 1e-12, &format!("{kind}: middle at {x}"));
                close(left[k] - y[k], widths[lane] / 2.0, 1e-9, &format!("{kind}: left at {x}"));
                close(y[k] - right[k], widths[lane] / 2.0, 1e-9, &format!("{kind}: right at {x}"));
            } else {
                assert!(left[k] - y[k] > 1.0 && y[k] - right[k] > 1.0);
            }
        }
    }
}

/// A manoeuvre that nobody follows would be a run in which nobody steers: that is told with its name, and not where something reads what it makes.
#[test]
fn a_manoeuvre_that_nothing_follows_is_reported() {
    let step = "[manoeuvre.turn]\nkind = \"step_steer\"\namplitude = \"30 deg\"\n[scenario]\noutput_step = \"10 ms\"\n";
    let reported = |parts: &str| {
        let project = Project::open(format!("{CAR}{step}{parts}"));
        let all: Vec<_> =
            project.diagnostics().iter().filter(|one| one.code == "manoeuvre::unused-signal").cloned().collect();
        all.into_iter().map(|one| (one.message, one.help.unwrap_or_default())).collect::<Vec<_>>()
    };
    let message = "manoeuvre `turn`: the model does not use its signal `steer`, so no run of it has steering";
    let torque = "[torque.push]\nshaft = \"wheel\"\nlaw = \"2 N m/rad * ";
    let other = ROBOT.replace("angle = \"steer\"", "angle = \"20 deg\"");
    // What a signal that nothing reads makes of it moves nothing.
    let shown = "[signal.twice]\nkind = \"expression\"\nvalue = \"2 * steer\"\n";
    for (parts, help) in [
        ("", "add a `[driver.NAME]` with `angle = \"steer\"`"),
        (other.as_str(), "write `angle = \"steer\"` in `[driver.robot]`"),
        (shown, "add a `[driver.NAME]`"),
    ] {
        let found = reported(parts);
        assert!(found.len() == 1 && found[0].0 == message && found[0].1.starts_with(help), "{parts}: {found:#?}");
    }
    for parts in [ROBOT.to_string(), format!("{torque}steer\"\n"), format!("{torque}twice\"\n{shown}")] {
        assert_eq!(reported(&parts), [], "{parts}");
    }
}

/// The model of the page on manoeuvres runs, and its requirements hold.
#[test]
fn the_page_runs() {
    let page = include_str!("../../../../docs/manoeuvres.md");
    let model = page.split("```toml\n").nth(1).and_then(|tail| tail.split("```").next()).expect("a model");
    let study = study(model);
    assert!(study.runs.len() >= 4);
    for run in &study.runs {
        assert!(run.requirements.iter().all(|one| one.passed), "{}: {:?}", run.name, run.requirements);
        assert!(run.figures.iter().all(|one| one.value.is_some()), "{}: {:?}", run.name, run.notes);
    }
}
