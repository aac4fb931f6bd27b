//! Play in transmissions: flight over the gap, blows, contact on both sides, soft teeth, and teeth that rub; against closed forms.

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;

use crate::common::{Dice, at, run_by, signal};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method) -> Run {
    let run = run_by(source, method, Some(1e-11));
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    let energy = &run.energy;
    let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated);
    assert!(energy.residual.abs() <= 1e-8 * size.max(1.0), "{energy:?}\n{source}");
    run
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value} instead of {expected}");
}

/// Times at which something meets something.
fn impacts(run: &Run, name: &str) -> Vec<f64> {
    let meets = format!("{name} meets");
    run.events.iter().filter(|event| event.description.starts_with(&meets)).map(|event| event.time).collect()
}

fn scenario(duration: &str, initial: &str) -> String {
    format!("[scenario]\nduration = \"{duration}\"\noutput_step = \"10 ms\"\ninitial = {{ {initial} }}\n")
}

/// The root of an increasing function between two places.
fn root(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if of(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A pinion, a screw and a belt with 0.02 kg m² against 2 kg at 0.1 m, and play of 4 mm: the mass flies 2 mm, and keeps of 1 m/s what the restitution
/// leaves; then it flies over the whole play.
#[test]
fn straight_transmissions_cross_their_backlash() {
    let elements = [
        "[rack_and_pinion.teeth]\npinion = \"shaft\"\nrack = \"mass\"\nradius = \"0.1 m\"\n",
        "[screw.teeth]\nshaft = \"shaft\"\nnut = \"mass\"\nlead = \"0.1 m/rad\"\n",
        "[pulley.teeth]\nshaft = \"shaft\"\nmass = \"mass\"\nradius = \"0.1 m\"\n",
    ];
    for (element, method) in elements.into_iter().flat_map(|element| METHODS.map(|method| (element, method))) {
        let source = format!(
            "[shaft.shaft]\ninertia = \"0.02 kg m^2\"\n[mass.mass]\nmass = \"2 kg\"\n{element}offset = \"1 m\"\nbacklash = \"4 mm\"\nrestitution = 0.5\n{}",
            scenario("40 ms", "\"mass.s\" = \"1 m\", \"mass.v\" = \"1 m/s\"")
        );
        let run = by(&source.replace("10 ms", "1 ms"), method);
        // Both have 2 kg at the teeth: the gap opens with half of 1 m/s, the mass keeps a quarter of it.
        let impacts = impacts(&run, "teeth");
        near(impacts[0], 0.002, 1e-12, element);
        near(at(&run, "mass.v", 0.005), 0.25, 1e-12, element);
        near(at(&run, "shaft.w", 0.005), 7.5, 1e-11, element);
        near(impacts[1], 0.002 + 0.004 / 0.5, 1e-11, element);
        // What is lost: ½ μ (1 − e²) v², μ = 1 kg, with v = 1, 1/2, 1/4, ...
        let loss = (0..impacts.len()).map(|k| 0.5 * 0.75 * 0.25_f64.powi(k as i32)).sum::<f64>();
        near(run.energy.dissipated, loss, 1e-11, element);
        let gaps = signal(&run, "mass.s").iter().zip(signal(&run, "shaft.phi")).map(|(s, phi)| s - 0.1 * phi - 1.0);
        gaps.for_each(|gap| assert!(gap.abs() <= 0.002 + 1e-12, "{element}: {gap}"));
    }
}

/// What a force on one side does to the other in contact: the reading on each body, in its own unit.
#[test]
fn both_sides_of_a_backlash_are_read() {
    let source = format!(
        "[shaft.pinion]\ninertia = \"0.02 kg m^2\"\n[mass.rack]\nmass = \"2 kg\"\n[rack_and_pinion.teeth]\npinion = \"pinion\"\nrack = \"rack\"\n\
         radius = \"0.1 m\"\nbacklash = \"4 mm\"\n[torque.push]\nshaft = \"rack\"\nlaw = \"8 N\"\n{}",
        scenario("1 s", "\"rack.s\" = \"2 mm\"")
    );
    for method in METHODS {
        let run = by(&source, method);
        let what = format!("{method:?}");
        // 4 kg are pushed with 8 N; half of it goes through the teeth.
        near(at(&run, "rack.s", 1.0), 1.002, 1e-9, &what);
        near(at(&run, "rack.s", 1.0) - 0.1 * at(&run, "pinion.phi", 1.0), 0.002, 1e-12, &what);
        near(at(&run, "teeth.f", 0.5), -4.0, 1e-9, &what);
        near(at(&run, "teeth.rack.f", 0.5), -4.0, 1e-9, &what);
        near(at(&run, "teeth.pinion.tau", 0.5), 0.4, 1e-9, &what);
    }
}

const DRIVE: &str = "[shaft.wg]\ninertia = \"1e-3 kg m^2\"\n[shaft.fs]\ninertia = \"2.5 kg m^2\"\n[harmonic_drive.hd]\nwave_generator = \"wg\"\n\
                     circular_spline = \"ground\"\nflexspline = \"fs\"\nratio = 50\nbacklash = \"0.01 rad\"\n";

/// Of the wave generator 0.25 rad are half of the play at the flexspline; both feel 1e-3 kg m² there, so that half of its speed is what the teeth take.
#[test]
fn a_harmonic_drive_crosses_its_backlash() {
    for method in METHODS {
        let source = format!("{DRIVE}restitution = 0.5\n{}", scenario("2 s", "\"wg.w\" = \"1 rad/s\""));
        let run = by(&source, method);
        let what = format!("{method:?}");
        let impacts = impacts(&run, "hd");
        near(impacts[0], 0.25, 1e-11, &what);
        near(at(&run, "wg.w", 0.5), 0.25, 1e-12, &what);
        near(at(&run, "fs.w", 0.5), -0.015, 1e-13, &what);
        near(impacts[1], 0.25 + 0.5 / 0.5, 1e-10, &what);
        // ½ μ (1 − e²) v² with μ = 5e-4 kg m², v = 1, then 1/2.
        near(run.energy.dissipated, 0.5 * 5e-4 * 0.75 * (1.0 + 0.25), 1e-13, &what);
    }
}

/// Soft teeth behind play: half a swing of the reduced inertia 1/(1/J₁ + i²/J₂) on s/i², and back over the whole play; no energy is lost without damping.
#[test]
fn a_soft_harmonic_drive_swings_behind_its_backlash() {
    for method in METHODS {
        let source = format!("{DRIVE}stiffness = \"200 N m/rad\"\n{}", scenario("2 s", "\"wg.w\" = \"1 rad/s\""));
        let run = by(&source, method);
        let what = format!("{method:?}");
        let touched: Vec<f64> =
            run.events.iter().filter(|event| event.description == "hd is touched").map(|event| event.time).collect();
        let omega = f64::sqrt(200.0 / 2500.0 / 5e-4);
        near(touched[0], 0.25, 1e-9, &what);
        near(touched[1], 0.25 + std::f64::consts::PI / omega + 0.5, 1e-8, &what);
        let t = 0.35;
        near(at(&run, "hd.tau", t), -0.08 / omega * (omega * (t - 0.25)).sin(), 1e-9, &what);
        near(run.energy.dissipated, 0.0, 1e-10, &what);
    }
}

/// A joint at 40° flies freely until `φ₁ − γ(φ₂)` is half of its play. There the speeds jump along that direction, `J₁ Δω₁ = Λ`, `J₂ Δω₂ = −γ′ Λ`, as
/// far as the restitution says.
#[test]
fn a_bent_joint_meets_where_its_curve_says() {
    let c = 40.0_f64.to_radians().cos();
    let curve = |x: f64| (c * x.tan()).atan();
    let slope = |x: f64| c / (x.cos().powi(2) + c * c * x.sin().powi(2));
    let (half, e, j1, j2) = (0.05, 0.4, 0.3, 0.8);
    let source = format!(
        "[shaft.a]\ninertia = \"0.3 kg m^2\"\n[shaft.b]\ninertia = \"0.8 kg m^2\"\n[universal_joint.joint]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
         angle = \"40 deg\"\nbacklash = \"0.1 rad\"\nrestitution = {e}\n{}",
        scenario("1 s", "\"a.w\" = \"2 rad/s\", \"b.w\" = \"1 rad/s\"")
    );
    let meets = root(0.0, 1.0, |t| 2.0 * t - curve(t) - half);
    let g = slope(meets);
    let impulse = (1.0 + e) * (2.0 - g) / (1.0 / j1 + g * g / j2);
    let (w1, w2) = (2.0 - impulse / j1, 1.0 + g * impulse / j2);
    let loss = 0.5 * (j1 * (4.0 - w1 * w1) + j2 * (1.0 - w2 * w2));
    for method in METHODS {
        let run = by(&source, method);
        let what = format!("{method:?}");
        near(impacts(&run, "joint")[0], meets, 1e-10, &what);
        let later = (meets * 100.0).ceil() / 100.0;
        near(at(&run, "a.w", later), w1, 1e-10, &what);
        near(at(&run, "b.w", later), w2, 1e-10, &what);
        near(at(&run, "a.phi", later), 2.0 * meets + w1 * (later - meets), 1e-10, &what);
        near(loss, 0.5 * (1.0 - e * e) * (2.0 - g).powi(2) / (1.0 / j1 + g * g / j2), 1e-12, &what);
        if impacts(&run, "joint").len() == 1 {
            near(run.energy.dissipated, loss, 1e-10, &what);
        }
        for (a, b) in signal(&run, "a.phi").iter().zip(signal(&run, "b.phi")) {
            assert!((a - curve(*b)).abs() <= half + 1e-10, "{what}: {a} {b}");
        }
    }
}

/// A light shaft driven against damping presses one flank for turns.
#[test]
fn a_bent_joint_in_contact_is_one_with_no_backlash() {
    let joint = |keys: &str| {
        format!(
            "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\ndamping = \"2 N m s/rad\"\n[torque.drive]\nshaft = \"a\"\n\
             law = \"8 N m\"\n[universal_joint.joint]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"30 deg\"\n{keys}\n"
        )
    };
    // Where b stands at zero, a stands half of the play ahead.
    let source = joint("backlash = \"0.1 rad\"");
    for method in METHODS {
        let with = by(&format!("{source}{}", scenario("4 s", "\"a.phi\" = \"0.05 rad\"")), method);
        let no_backlash = by(&format!("{}{}", joint(""), scenario("4 s", "\"a.phi\" = \"0 rad\"")), method);
        let what = format!("{method:?}");
        for k in 0..with.series.time.len() {
            let of = |run: &Run, name: &str| signal(run, name)[k];
            near(of(&with, "b.phi"), of(&no_backlash, "b.phi"), 2e-8, &what);
            near(of(&with, "a.phi") - 0.05, of(&no_backlash, "a.phi"), 2e-8, &what);
            near(of(&with, "joint.tau"), of(&no_backlash, "joint.tau"), 1e-6, &what);
            near(of(&with, "joint.a.tau"), of(&no_backlash, "joint.a.tau"), 1e-6, &what);
            near(of(&with, "joint.b.tau"), of(&no_backlash, "joint.b.tau"), 1e-6, &what);
        }
        assert!(at(&with, "b.phi", 4.0) > 10.0, "{what}: it turns");
        assert_eq!(with.energy.dissipated > 0.0, no_backlash.energy.dissipated > 0.0);
    }
}

/// A rack whose ratio varies, pressed by its pinion, is one without play half of it behind.
#[test]
fn a_rack_with_a_curve_in_contact_is_one_with_no_backlash() {
    let rack = |behind: i32, keys: &str| {
        let point = |angle: i32, position: i32| {
            format!("{{ angle = \"{angle} rad\", position = \"{} mm\" }}", position - behind)
        };
        let curve: Vec<String> =
            [(-2, -30), (0, 0), (1, 9), (3, 34)].map(|(angle, position)| point(angle, position)).into();
        format!(
            "[shaft.pinion]\ninertia = \"1e-4 kg m^2\"\n[mass.rack]\nmass = \"3 kg\"\ndamping = \"300 N s/m\"\n[torque.drive]\nshaft = \"pinion\"\n\
             law = \"2 N m\"\n[rack_and_pinion.joint]\npinion = \"pinion\"\nrack = \"rack\"\ncurve = [{}]\n{keys}\n",
            curve.join(", ")
        )
    };
    for method in METHODS {
        let with = by(&(rack(0, "backlash = \"2 mm\"") + &scenario("0.1 s", "\"rack.s\" = \"-1 mm\"")), method);
        let no_backlash = by(&(rack(1, "") + &scenario("0.1 s", "\"pinion.phi\" = \"0 rad\"")), method);
        let what = format!("{method:?}");
        for k in 0..with.series.time.len() {
            let of = |run: &Run, name: &str| signal(run, name)[k];
            near(of(&with, "rack.s"), of(&no_backlash, "rack.s"), 1e-9, &what);
            near(of(&with, "pinion.phi"), of(&no_backlash, "pinion.phi"), 1e-7, &what);
            near(of(&with, "joint.f"), of(&no_backlash, "joint.f"), 1e-5, &what);
            near(of(&with, "joint.pinion.tau"), of(&no_backlash, "joint.pinion.tau"), 1e-7, &what);
        }
        assert!(at(&with, "pinion.phi", 0.1) > 0.3, "{what}: it turns");
    }
}

/// A motor with 0.3 kg m² before play of 0.2 rad, a load with 0.5 kg m² behind a gear of ratio 4.
fn lossy(keys: &str, motor: &str, load: &str, initial: &str) -> String {
    format!(
        "[shaft.motor]\ninertia = \"0.3 kg m^2\"\n[shaft.load]\ninertia = \"0.5 kg m^2\"\n\
         [gear.gear]\nshaft_1 = \"motor\"\nshaft_2 = \"load\"\nratio = 4\nbacklash = \"0.2 rad\"\n{keys}\n\
         [torque.drive]\nshaft = \"motor\"\nlaw = \"{motor}\"\n[torque.push]\nshaft = \"load\"\nlaw = \"{load}\"\n{}",
        scenario("2 s", initial)
    )
}

const RUBS: &str = "efficiency = 0.8\nefficiency_back = 0.7";

/// In the gap nothing is carried and nothing lost; behind the blow the motor drives the load with 1/η more, or the load the motor with η less.
#[test]
fn gear_loss_with_backlash_acts_in_contact_only() {
    let (j1, j2, i) = (0.3, 0.5, 4.0);
    let run = by(&lossy(RUBS, "1 N m", "0 N m", ""), Method::Automatic);
    let meets = f64::sqrt(2.0 * 0.1 * j1);
    near(impacts(&run, "gear")[0], meets, 1e-9, "flight");
    near(at(&run, "gear.friction", 0.2), 0.0, 0.0, "no loss in the gap");
    let a = 1.0 / (j1 + j2 / (0.8 * i * i));
    let struck = meets / j1 * j1 / (j1 + j2 / (i * i));
    near(at(&run, "motor.w", 2.0), struck + a * (2.0 - meets), 1e-8, "the motor drives");
    let carried = -j2 * a / (i * i);
    near(at(&run, "gear.tau", 1.0), carried, 1e-9, "carried");
    near(at(&run, "gear.friction", 1.0), carried.abs() * (1.0 / 0.8 - 1.0), 1e-9, "lost");
    // The load drives from the flank on which it stands.
    let run = by(&lossy(RUBS, "0 N m", "10 N m", "\"motor.phi\" = \"-0.1 rad\""), Method::Automatic);
    let a = 0.7 * 10.0 / i / (j1 + 0.7 * j2 / (i * i));
    near(at(&run, "motor.w", 2.0), 2.0 * a, 1e-8, "the load drives");
    near(at(&run, "gear.tau", 1.0) * 0.3, at(&run, "gear.friction", 1.0), 1e-9, "lost");
}

/// At rest teeth that press hold up to their loss: a load that pushes 10 N m is held with anything from η·2.5 to 2.5/η N m.
#[test]
fn a_load_on_a_flank_sticks_between_two_torques() {
    for (motor, moves) in [(-1.7499, 1.0), (-1.7501, 0.0), (-2.5, 0.0), (-3.1249, 0.0), (-3.1251, -1.0)] {
        let initial = "\"motor.phi\" = \"-0.1 rad\"";
        let run = by(&lossy(RUBS, &format!("{motor} N m"), "10 N m", initial), Method::Automatic);
        let speed = at(&run, "motor.w", 2.0);
        assert!(if moves == 0.0 { speed == 0.0 } else { speed * moves > 0.0 }, "{motor} N m: {speed} rad/s");
        near(at(&run, "motor.phi", 2.0) - 4.0 * at(&run, "load.phi", 2.0), -0.1, 1e-10, "it stays on the flank");
    }
}

/// A worm with play: the load moves until it meets the thread, and no further, whatever pushes it.
#[test]
fn a_worm_with_backlash_locks_itself_on_either_flank() {
    let keys = "efficiency = 0.4\nefficiency_back = -0.5";
    for load in ["10 N m", "-1000 N m"] {
        for start in ["0 rad", "0.1 rad", "-0.1 rad"] {
            let run = by(&lossy(keys, "0 N m", load, &format!("\"motor.phi\" = \"{start}\"")), Method::Automatic);
            let what = format!("{load} from {start}");
            assert_eq!([at(&run, "motor.w", 2.0), at(&run, "load.w", 2.0)], [0.0; 2], "{what}: {:?}", run.events);
            let side = if load.starts_with('-') { 0.1 } else { -0.1 };
            near(at(&run, "motor.phi", 2.0) - 4.0 * at(&run, "load.phi", 2.0), side, 1e-9, &what);
        }
    }
}

/// A spring in the teeth of a harmonic drive, play before it, and losses: the load is what the soft flank presses with.
#[test]
fn soft_gears_with_backlash_have_losses() {
    let source = format!(
        "{DRIVE}stiffness = \"200 N m/rad\"\ndamping = \"40 N m s/rad\"\nefficiency = 0.8\n[torque.drive]\nshaft = \"wg\"\nlaw = \"0.1 N m\"\n{}",
        scenario("3 s", "")
    );
    let run = by(&source, Method::Automatic);
    for (k, time) in run.series.time.iter().enumerate() {
        let of = |name: &str| signal(&run, name)[k];
        let (twist, rate) = (of("wg.phi") + 50.0 * of("fs.phi"), of("wg.w") + 50.0 * of("fs.w"));
        let pressed = if twist.abs() > 0.25 { 0.08 * (twist - 0.25 * twist.signum()) + 0.016 * rate } else { 0.0 };
        if pressed * twist <= 0.0 {
            assert!(of("hd.tau") == 0.0 && of("hd.friction") == 0.0, "at {time}");
            continue;
        }
        near(of("hd.tau"), -pressed, 1e-9, &format!("at {time}"));
        if of("wg.w").abs() > 1e-9 {
            let part = if of("hd.tau") * of("wg.w") <= 0.0 { 0.25 } else { 0.2 };
            near(of("hd.friction"), part * pressed.abs() * of("wg.w").signum(), 1e-9, &format!("at {time}"));
        }
    }
    // It comes to the acceleration of the motor that drives through the loss.
    near(at(&run, "hd.tau", 3.0), -0.1 * 1e-3 / (1e-3 * 1.25 + 1e-3), 1e-5, "carried");
}

/// Teeth that lock themselves between two plays, with frictions on their load: where they come to rest no acceleration fits while they slide, and
/// they hold whatever they have to. Bodies that they tie move together all the same, and what drives never gives back more than it got.
#[test]
fn self_locking_gears_stick_beside_frictions() {
    let shaft = |k: usize, inertia: f64, friction: f64| {
        format!("[shaft.s{k}]\ninertia = \"{inertia} kg m^2\"\nfriction = \"{friction} N m\"\n")
    };
    let gear = |k: usize, ratio: u8, keys: &str| {
        format!("[gear.e{k}]\nshaft_1 = \"s{k}\"\nshaft_2 = \"s{}\"\nratio = {ratio}\n{keys}\n", k + 1)
    };
    let torque = |k: usize, law: &str| format!("[torque.t{k}]\nshaft = \"s{k}\"\nlaw = \"{law}\"\n");
    let source = "[shaft.s0]\ninertia = \"1e-2 kg m^2\"\n".to_string()
        + &shaft(1, 0.22, 0.21)
        + &shaft(2, 0.38, 0.02)
        + &shaft(3, 0.81, 0.04)
        + &gear(0, 3, "backlash = \"4e-2 rad\"\nloss = \"17e-2 N m + 0.1 * load\"")
        + &gear(1, 1, "efficiency = 0.5\nefficiency_back = -0.5")
        + &gear(2, 2, "backlash = \"17e-2 rad\"")
        + &torque(0, "1.4 N m * sin(6 rad/s * t)")
        + &torque(3, "3.2 N m * sin(10 rad/s * t)")
        + &scenario("3 s", "");
    let run = run_by(&source, Method::Automatic, Some(1e-10));
    assert_eq!(run.outcome, Outcome::Completed);
    let energy = &run.energy;
    assert!(energy.residual.abs() <= 1e-9 * energy.dissipated, "{energy:?}");
    let rows = signal(&run, "s1.w").iter().zip(signal(&run, "s2.w"));
    rows.clone().for_each(|(a, b)| near(*a, *b, 1e-12, "one shaft for both"));
    // Its load turns the other shaft: locked, it stands however hard that pushes.
    let locked = rows.zip(signal(&run, "t3.tau")).filter(|((a, _), torque)| **a == 0.0 && torque.abs() > 1.0);
    assert!(locked.count() > 20);
}

/// A drive of random gears, joints and harmonic drives with play, losses and frictions, shaken by two torques.
fn random_model(seed: u64) -> String {
    let mut dice = Dice(seed + 7);
    let count = 2 + dice.below(3);
    let mut source = String::new();
    for k in 0..=count {
        source += &format!("[shaft.s{k}]\ninertia = \"{}e-2 kg m^2\"\n", dice.between(1, 90));
        if dice.below(2) == 0 {
            source += &format!("friction = \"{}e-2 N m\"\n", dice.between(1, 30));
        }
    }
    for k in 0..count {
        let next = k + 1;
        let backlash =
            if dice.below(4) == 0 { String::new() } else { format!("backlash = \"{}e-2 rad\"\n", dice.between(1, 20)) };
        let rebound = if backlash.is_empty() { 0 } else { dice.below(8) };
        let backlash = format!("{backlash}restitution = {}\n", rebound as f64 / 10.0);
        if dice.below(3) == 0 {
            let angle = dice.between(5, 50);
            source += &format!(
                "[universal_joint.e{k}]\nshaft_1 = \"s{k}\"\nshaft_2 = \"s{next}\"\nangle = \"{angle} deg\"\n{backlash}"
            );
            continue;
        }
        let loss = match dice.below(4) {
            0 => String::new(),
            1 => format!("loss = \"{}e-2 N m + 0.{} * load\"\n", dice.between(0, 20), dice.between(1, 6)),
            2 => format!("efficiency = 0.{}\n", dice.between(6, 9)),
            _ => format!("efficiency = 0.{}\nefficiency_back = 0.{}\n", dice.between(3, 6), dice.between(1, 5)),
        };
        source += &format!(
            "[gear.e{k}]\nshaft_1 = \"s{k}\"\nshaft_2 = \"s{next}\"\nratio = {}\n{backlash}{loss}",
            dice.between(1, 6)
        );
    }
    for shaft in [0, count] {
        let (size, rate) = (dice.between(1, 40), dice.between(2, 15));
        source +=
            &format!("[torque.t{shaft}]\nshaft = \"s{shaft}\"\nlaw = \"{size}e-1 N m * sin({rate} rad/s * t)\"\n");
    }
    source + &scenario("3 s", "")
}

/// Energy balances close.
#[test]
fn random_drives_with_backlash_balance_their_energy() {
    let (first, end) = match std::env::var("KARDAN_MODELS").ok().and_then(|text| text.parse().ok()) {
        Some(end) => (0, end),
        None => (0, 30),
    };
    let mut wrong = Vec::new();
    for seed in first..end {
        let source = random_model(seed);
        let run = run_by(&source, Method::Automatic, Some(1e-10));
        let energy = &run.energy;
        let flows: f64 = (0..2)
            .flat_map(|_| signal(&run, "t0.tau").iter().zip(signal(&run, "s0.w")))
            .map(|(torque, speed)| (torque * speed).abs() * 0.01)
            .sum();
        let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated).max(flows);
        if run.outcome != Outcome::Completed || energy.residual.abs() > 1e-8 * size || energy.dissipated < -1e-12 * size
        {
            wrong.push(format!("{seed}: {:?} {energy:?}\n{source}", run.outcome));
        }
    }
    assert!(wrong.is_empty(), "{} models, such as\n{}", wrong.len(), wrong[..wrong.len().min(3)].join("\n"));
}
