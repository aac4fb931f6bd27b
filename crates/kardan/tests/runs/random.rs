//! Random models with all that holds one way or at times, also beside rows that are kept: their energy balances, and what blocks is not passed.

use std::time::Instant;

use kardan::results::Outcome;
use kardan::simulate::Method;
use kardan::study::{Progress, Project, Settings};

use crate::common::{Dice, runs_only, signal};

/// Shafts in a row with all that holds one way or at times between them and to the housing.
fn random_model(seed: u64) -> String {
    let mut dice = Dice(seed);
    let shafts = 2 + dice.below(4);
    let mut text = String::from(
        "[signal.now]\nkind = \"pulses\"\nhigh = 1\nperiod = \"0.37 s\"\nwidth = \"0.13 s\"\nstart = \"0.05 s\"\n",
    );
    let mut initial = Vec::new();
    for k in 0..shafts {
        text += &format!("[shaft.s{k}]\ninertia = \"0.0{} kg m^2\"\n", dice.between(1, 9));
        if dice.below(3) == 0 {
            text += &format!("friction = \"0.{} N m\"\n", dice.between(1, 9));
        }
        if dice.below(3) == 0 {
            text += &format!("damping = \"0.0{} N m s/rad\"\n", dice.between(1, 9));
        }
        initial.push(format!("\"s{k}.w\" = \"{} rad/s\"", dice.between(-9, 9)));
    }
    for k in 1..shafts {
        let ends = format!("shaft_1 = \"s{}\"\nshaft_2 = \"s{k}\"\n", k - 1);
        let stiffness = [20, 300, 5000][dice.below(3)];
        let coupling = dice.below(8);
        if coupling == 7 {
            // One of them follows from the other.
            initial.retain(|speed: &String| [k - 1, k].iter().all(|k| !speed.starts_with(&format!("\"s{k}."))));
        }
        text += &match coupling {
            7 => {
                let ratio = dice.between(5, 20);
                let loss = match dice.below(3) {
                    0 => String::new(),
                    1 => format!("efficiency = 0.{}\nefficiency_back = 0.{}\n", dice.between(3, 9), dice.between(1, 9)),
                    _ => format!("loss = \"0.0{} N m + 0.{} * load\"\n", dice.below(9), dice.below(9)),
                };
                format!("[gear.c{k}]\n{ends}ratio = \"{ratio}/7\"\n{loss}")
            }
            6 => format!("[spring_damper.c{k}]\n{ends}damping = \"0.2 N m s/rad\"\n"),
            0 => format!(
                "[spring_damper.c{k}]\n{ends}stiffness = \"{stiffness} N m/rad\"\ndamping = \"0.3 N m s/rad\"\nbacklash = \"5 deg\"\n"
            ),
            1 => format!(
                "[gear.c{k}]\n{ends}ratio = \"{}/7\"\nbacklash = \"4 deg\"\nrestitution = 0.{}\n",
                dice.between(5, 20),
                dice.below(10)
            ),
            2 => format!("[clutch.c{k}]\n{ends}torque = \"3 N m * now\"\nstatic_factor = 1.{}\n", dice.below(5)),
            3 => format!("[lock.c{k}]\n{ends}engaged = \"now\"\n"),
            4 => format!("[one_way_clutch.c{k}]\ndriving = \"s{}\"\ndriven = \"s{k}\"\n", k - 1),
            _ => format!("[spring_damper.c{k}]\n{ends}stiffness = \"{stiffness} N m/rad\"\n"),
        };
    }
    for k in 0..shafts {
        text += &match dice.below(5) {
            0 => format!(
                "[end_stop.h{k}]\nshaft_1 = \"s{k}\"\nlower = \"-0.5 rad\"\nupper = \"{} rad\"\nrestitution = 0.{}\n",
                dice.between(1, 5),
                dice.below(10)
            ),
            1 => format!(
                "[end_stop.h{k}]\nshaft_1 = \"s{k}\"\nupper = \"1 rad\"\nstiffness = \"900 N m/rad\"\ndamping = \"{} N m s/rad\"\n",
                dice.below(5)
            ),
            2 => format!(
                "[brake.h{k}]\nshaft = \"s{k}\"\ntorque = \"(1.5 + sin(20 rad/s * t)) * 1 N m\"\nstatic_factor = 1.2\n"
            ),
            3 => format!("[one_way_clutch.h{k}]\ndriven = \"s{k}\"\n"),
            _ => String::new(),
        };
    }
    text += &format!(
        "[torque.drive]\nshaft = \"s0\"\nlaw = \"{} N m * sin({} rad/s * t)\"\n[scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\ninitial = {{ {} }}\n",
        dice.between(1, 9),
        dice.between(3, 30),
        initial.join(", ")
    );
    text
}

/// The same beside a relation of speeds or angles that is kept with its multiplier, or held and struck by what moves as prescribed.
fn beside_multiplier_constraints(seed: u64) -> String {
    let mut dice = Dice(seed.wrapping_add(0x5eed));
    let body = |name: &str, dice: &mut Dice| {
        let friction = if dice.below(2) == 0 { "friction = \"0.2 N m\"\n" } else { "" };
        format!("[shaft.{name}]\ninertia = \"0.0{} kg m^2\"\n{friction}", dice.between(1, 9))
    };
    let kind = dice.below(4);
    let more = match kind {
        0 => body("u", &mut dice) + "[constraint.kept]\nrates = { u = 1, s0 = \"-(1.5 + sin(s0.phi + u.phi))\" }\n",
        1 => body("u", &mut dice) + "[constraint.kept]\nexpression = \"u.phi - 0.7 rad * sin(s0.phi)\"\n",
        _ => {
            let moves = ["speed = \"2 rad/s * sin(5 rad/s * t)\"", "angle = \"0.4 rad * sin(5 rad/s * t)\""][kind - 2];
            let ends = "shaft_1 = \"s0\"\nshaft_2 = \"p\"\n";
            let meets = match dice.below(6) {
                0 => format!("[spring_damper.meets]\n{ends}friction = \"0.8 N m\"\n"),
                1 => format!("[end_stop.meets]\n{ends}lower = \"-0.3 rad\"\nrestitution = 0.{}\n", dice.below(10)),
                2 => format!("[clutch.meets]\n{ends}torque = \"3 N m * now\"\nstatic_factor = 1.1\n"),
                3 => format!("[lock.meets]\n{ends}engaged = \"now\"\n"),
                4 => "[one_way_clutch.meets]\ndriving = \"p\"\ndriven = \"s0\"\n".into(),
                _ => format!(
                    "[gear.meets]\n{ends}ratio = \"9/7\"\nbacklash = \"4 deg\"\nrestitution = 0.{}\n",
                    dice.below(10)
                ),
            };
            format!("{}[prescribed_motion.moves]\nshaft = \"p\"\n{moves}\n{meets}", body("p", &mut dice))
        }
    };
    random_model(seed).replace("[torque.drive]", &format!("{more}[torque.drive]"))
}

/// Which random models are drawn; `KARDAN_MODELS` asks for others, `10000` or `1300..2000`, and `--nocapture` then shows how far it is.
fn models() -> impl Iterator<Item = u64> {
    let requested = std::env::var("KARDAN_MODELS").ok();
    // Beside the first ones those that once failed among the first 20 000: rows parted by rounding, blows among what is
    // held, bodies that a prescribed motion presses, speeds of what rests that were not quite zero, also of what several directions
    // hold together (from 890 on), a contact that ended again within a step, speeds below what the last bits of an instant make of them (2609),
    // a step whose error was not seen (3296), torques that kept rows share with what holds (122).
    let found: &[u64] = if requested.is_some() {
        &[]
    } else {
        &[
            313, 356, 1824, 3090, 4104, 890, 1066, 2257, 2388, 3342, 3445, 3812, 11823, 369, 504, 5415, 1738, 443,
            2609, 3296, 122,
        ]
    };
    let (first, end) = match requested.as_deref().map(|text| text.split_once("..").unwrap_or(("0", text))) {
        Some((first, end)) => (first.parse().expect("a first number"), end.parse().expect("a number of models")),
        None => (0, 120),
    };
    (first..end).chain(found.iter().copied()).inspect(move |seed| {
        if requested.is_some() {
            eprintln!("model {seed}");
        }
    })
}

/// Random models with all that holds one way or at times: the energy balance closes to 1e-8 of what flows, nothing that blocks is passed, and
/// stops are not beyond.
#[test]
fn random_models_that_hold_balance_their_energy() {
    all_balance(random_model);
}

/// The same beside rows that are kept with their multipliers, and what is prescribed.
#[test]
fn random_models_beside_multiplier_constraints_balance_their_energy() {
    all_balance(beside_multiplier_constraints);
}

/// The same beside motions without inertia: a spring in series with a damper, a coil's loop without inductance, and a friction, beside which teeth have no losses.
#[test]
fn random_models_beside_massless_motions_balance_their_energy() {
    all_balance(beside_massless);
}

fn beside_massless(seed: u64) -> String {
    let mut dice = Dice(seed.wrapping_add(0xd1ce));
    let model = random_model(seed);
    let massless = dice.below(3);
    let rubs = |line: &&str| line.starts_with("efficiency") || line.starts_with("loss");
    let retained = model.lines().filter(|line| massless < 2 || !rubs(line));
    let retained: String = retained.map(|line| format!("{line}\n")).collect();
    let more = match massless {
        0 => format!(
            "[shaft.n]\ninertia = \"0 kg m^2\"\n[spring_damper.series]\nshaft_1 = \"s0\"\nshaft_2 = \"n\"\nstiffness = \"{} N m/rad\"\n\
             [spring_damper.against]\nshaft_1 = \"n\"\nshaft_2 = \"{}\"\ndamping = \"0.4 N m s/rad\"\n",
            [9, 70][dice.below(2)],
            ["s1", "ground"][dice.below(2)]
        ),
        1 => "[dc_motor.brakes]\nfrom = \"ground\"\nto = \"x\"\nshaft = \"s0\"\ntorque_constant = \"0.2 N m/A\"\nresistance = \"0.5 Ohm\"\n\
              [capacitor.stores]\nfrom = \"x\"\nto = \"ground\"\ncapacitance = \"20 mF\"\n"
            .into(),
        _ => format!(
            "[shaft.n]\ninertia = \"0 kg m^2\"\n[spring_damper.series]\nshaft_1 = \"s1\"\nshaft_2 = \"n\"\nstiffness = \"{} N m/rad\"\n\
             [spring_damper.slides]\nshaft_1 = \"n\"\nfriction = \"0.{} N m\"\n",
            [9, 70][dice.below(2)],
            dice.between(1, 9)
        ),
    };
    retained.replace("[torque.drive]", &format!("{more}[torque.drive]"))
}

/// What is wrong is shown at once: a long run may be stopped.
fn all_balance(model: impl Fn(u64) -> String) {
    // One alone is asked for to be seen.
    let single_model = std::env::var("KARDAN_MODELS").is_ok() && models().count() == 1;
    let found = models().filter_map(|seed| {
        let source = model(seed);
        if single_model {
            eprintln!("{source}");
        }
        wrong_with(seed, &source)
    });
    let wrong: Vec<String> = found.inspect(|reported| eprintln!("{reported}")).collect();
    assert!(wrong.is_empty(), "{} models, such as\n{}", wrong.len(), wrong[..wrong.len().min(3)].join("\n"));
}

/// Ends runs of models that were asked for after half a minute: those that come later are to be seen too.
struct Patient(Option<Instant>);

impl Progress for Patient {
    fn advance(&self, _variant: usize, _name: &str, _fraction: f64) {}

    fn stop(&self) -> Option<String> {
        self.0.filter(|begun| begun.elapsed().as_secs() >= 30).map(|_| "it takes more than half a minute".into())
    }
}

/// What is wrong with the run of a random model.
fn wrong_with(seed: u64, source: &str) -> Option<String> {
    let settings = Settings { method: Method::Automatic, tolerance: Some(1e-10), ..runs_only() };
    let patient = Patient(std::env::var("KARDAN_MODELS").ok().map(|_| Instant::now()));
    let mut study =
        Project::open(source).run(&settings, &patient).unwrap_or_else(|reported| panic!("{reported:?}\n{source}"));
    let run = study.runs.remove(0);
    // What is prescribed may drive into what is rigid, through the one element that it meets.
    let contradicts = source.contains("[prescribed_motion.")
        && matches!(&run.outcome, Outcome::Failed { cause, .. } if cause.contains("constrain one motion rigidly") && cause.contains("`meets`"));
    if contradicts && std::env::var("KARDAN_MODELS").is_ok() {
        eprintln!("{seed} ends: {:?}", run.outcome);
    }
    if run.outcome != Outcome::Completed && !contradicts {
        return Some(format!("{seed}: {:?}\n{source}", run.outcome));
    }
    let energy = &run.energy;
    // What goes in and comes out again counts, too: at the end nothing may be left of it.
    let powers = |torque: &str, speed: &str| {
        let both = signal(&run, torque).iter().zip(signal(&run, speed));
        both.map(|(torque, speed)| (torque * speed).abs()).sum::<f64>()
    };
    let prescribed = if source.contains("[prescribed_motion.") { powers("moves.tau", "p.w") } else { 0.0 };
    let flows = (powers("drive.tau", "s0.w") + prescribed) * 0.01;
    let size = energy.input.abs().max(energy.stored.abs()).max(energy.dissipated.abs()).max(flows);
    if !(energy.residual.abs() <= 1e-8 * size && energy.dissipated >= -1e-12 * size) {
        return Some(format!("{seed}: {energy:?}, {flows} J\n{source}"));
    }
    let turns_back = |line: &&str| {
        let shaft = line.trim_start_matches("[one_way_clutch.h").trim_end_matches(']');
        signal(&run, &format!("s{shaft}.w")).iter().any(|speed| *speed < -1e-12)
    };
    let line = source.lines().filter(|line| line.starts_with("[one_way_clutch.h")).find(turns_back)?;
    Some(format!("{seed}: {line} turns back\n{source}"))
}
