//! Brakes, split friction, loads and the tyres of TMeasy: against closed forms.

use kardan::results::{Run, Study};
use kardan::simulate::Method;
use kardan::study::{AnalyzeSettings, Project, Settings, Silent};

use crate::common::{close, run_by, signal};

const M: f64 = 1500.0;
const J: f64 = 2500.0;
const A: f64 = 1.2;
const B: f64 = 1.5;
const G: f64 = 9.80665;
const TRACK: f64 = 1.5;
/// Loads of the axles at rest.
const FRONT: f64 = M * G * B / (A + B);
const REAR: f64 = M * G * A / (A + B);

/// Wheels at an angle of the time, with more keys of the car and more of the model.
fn car(angle: &str, keys: &str, more: &str) -> String {
    format!(
        "[shaft.hand]\n[prescribed_motion.driver]\nshaft = \"hand\"\nangle = \"{angle}\"\n\
         [vehicle.car]\nsteered_by = \"hand\"\nsteering_ratio = 1\nmass = \"1500 kg\"\nyaw_inertia = \"2500 kg m^2\"\nfront_axle = \"1.2 m\"\n\
         rear_axle = \"1.5 m\"\nfront_stiffness = \"90 kN/rad\"\nrear_stiffness = \"110 kN/rad\"\n{keys}\n{more}\n"
    )
}

fn by(source: &str) -> Run {
    run_by(source, Method::Automatic, Some(1e-10))
}

fn last(run: &Run, name: &str) -> f64 {
    *signal(run, name).last().expect("a row")
}

/// Of Rill's TMeasy, as he writes it: slope, slip and force of the peak, slip and force of sliding.
fn rill(slip: f64, slope: f64, [peak, most]: [f64; 2], [slide, sliding]: [f64; 2]) -> f64 {
    let sigma = slip / peak;
    match slip {
        slip if slip <= peak => peak * slope * sigma / (1.0 + sigma * (sigma + slope * peak / most - 2.0)),
        slip if slip <= slide => {
            let part = (slip - peak) / (slide - peak);
            most - (most - sliding) * part * part * (3.0 - 2.0 * part)
        }
        _ => sliding,
    }
}

const FIXED_CAR: &str =
    "[constraint.still]\ncoefficients = { car_yaw = 1 }\n[constraint.straight]\ncoefficients = { car_lateral = 1 }\n";

/// A car that is held slips by the tangent of the angle of its wheels: slope, peak, sliding force and all between, also where friction scales them, and the
/// trail that falls to zero at the peak.
#[test]
fn tmeasy_has_its_three_parts() {
    for (mu, keys, peak, slide, factor) in [
        (1.0, "peak_slip = 0.25\nslide_slip = 0.8\nslide_factor = 0.85", 0.25, 0.8, 0.85),
        (0.8, "peak_slip = 0.25\nslide_slip = 0.8\nslide_factor = 0.85", 0.2, 0.64, 0.85),
        (0.5, "", 0.5 * 3.0 * FRONT / 90e3, 0.5 * 9.0 * FRONT / 90e3, 0.9),
        (0.5, "slide_slip = 0.9", 0.5 * 3.0 * FRONT / 90e3, 0.5 * 0.9, 0.9),
    ] {
        let keys = format!("speed = \"20 m/s\"\ntyre = \"tmeasy\"\nmu = {mu}\npneumatic_trail = \"40 mm\"\n{keys}");
        let scenario = "[scenario]\nduration = \"1 s\"\noutput_step = \"0.01 s\"\n";
        let run = by(&car("atan(t / 1 s)", &keys, &format!("{FIXED_CAR}{scenario}")));
        for (k, slip) in run.series.time.iter().enumerate() {
            let expected = rill(*slip, 90e3, [peak, mu * FRONT], [slide, factor * mu * FRONT]);
            let force = signal(&run, "car_side.f")[k] / f64::atan(*slip).cos();
            close(force, expected, 1e-8, &format!("force at a slip of {slip}"));
            let trail = 0.04 * (1.0 - slip / peak).max(0.0);
            close(signal(&run, "car_aligning.tau")[k], -expected * trail, 1e-7, &format!("torque at {slip}"));
            close(signal(&run, "car.slip_front")[k], -slip / peak, 1e-9, "slip over that of the peak");
        }
        let k = run.series.time.iter().position(|t| (t - peak).abs() < 1e-9);
        if let Some(k) = k {
            close(signal(&run, "car_side.f")[k], mu * FRONT * peak.atan().cos(), 1e-10, "peak");
        }
        close(last(&run, "car_side.f"), factor * mu * FRONT * 1_f64.atan().cos(), 1e-10, "sliding");
    }
}

/// At no slip the slope is the stiffness: small motions are those of linear tyres, with and without brakes that stand by.
#[test]
fn small_motions_of_tmeasy_are_those_of_linear_tyres() {
    let modes = |keys: &str| {
        let fixed_hand = "[constraint.held]\ncoefficients = { hand = 1 }\n[signal.later]\nkind = \"ramp\"\nto = \"2 kN\"\nstart = \"1 s\"\nover = \"1 s\"\n";
        let source = car("0 rad", &format!("speed = \"25 m/s\"\nrelaxation_length = \"0.4 m\"\n{keys}"), fixed_hand);
        let source = source.replace("[prescribed_motion.driver]\nshaft = \"hand\"\nangle = \"0 rad\"\n", "");
        let analysis = Project::open(&source).analyze(&AnalyzeSettings::default(), &Silent);
        analysis.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}")).modes
    };
    let linear = modes("");
    for keys in [
        "tyre = \"tmeasy\"\nmu = 0.7",
        "tyre = \"tmeasy\"\nmu_left = 0.9\nmu_right = 0.3\ntrack = \"1.5 m\"\nheight = \"0.5 m\"\nbraking = \"later\"",
    ] {
        let found = modes(keys);
        assert_eq!(found.len(), linear.len());
        for (one, other) in found.iter().zip(&linear) {
            close(one.eigenvalue.re, other.eigenvalue.re, 1e-10, "decay");
            close(one.eigenvalue.im, other.eigenvalue.im, 1e-10, "frequency");
        }
    }
}

/// Left and right as good as the friction of both: the same motion.
#[test]
fn the_same_friction_on_both_sides_is_one() {
    let angle = "0.1 rad * sin(pi * t / 1 s)";
    for tyre in ["magic_formula", "tmeasy"] {
        let run = |mu: &str| {
            let keys = format!(
                "speed = \"25 m/s\"\ntyre = \"{tyre}\"\nrelaxation_length = \"0.4 m\"\ntrack = \"1.5 m\"\n{mu}"
            );
            by(&car(angle, &keys, "[scenario]\nduration = \"2 s\"\n"))
        };
        let (whole, split) = (run("mu = 0.6"), run("mu_left = 0.6\nmu_right = 0.6"));
        assert!(last(&whole, "car.y").abs() > 1.0);
        for name in ["car.yaw_rate", "car.y", "car.a_y", "car_side.f"] {
            for (one, other) in signal(&whole, name).iter().zip(signal(&split, name)) {
                close(*one, *other, 1e-7, name);
            }
        }
    }
}

/// What braking begins with: the weaker side gives its friction times its load, the other one the rest up to its own, and the car turns to the better side by
/// track/2 (left - right)/J.
#[test]
fn split_friction_turns_the_car() {
    let side = M * G / 2.0;
    for (left, right, demand) in [(0.8, 0.1, 4500.0_f64), (0.1, 0.8, 4500.0), (0.8, 0.1, 9000.0), (0.8, 0.5, 4500.0)] {
        let keys = format!(
            "speed = \"20 m/s\"\ntyre = \"tmeasy\"\nrelaxation_length = \"0.5 m\"\ntrack = \"1.5 m\"\nmu_left = {left}\nmu_right = {right}\n\
             braking = \"{demand} N\""
        );
        let run = by(&car("0 rad", &keys, "[scenario]\nduration = \"2 ms\"\noutput_step = \"1 ms\"\n"));
        let give = |own: f64, other: f64| (own * side).min((demand / 2.0).max(demand - other * side));
        let forces = [give(left, right), give(right, left)];
        close(last(&run, "car.braking_left"), forces[0], 1e-9, "left");
        close(last(&run, "car.braking_right"), forces[1], 1e-9, "right");
        close(last(&run, "car.braking_lack"), demand - forces[0] - forces[1], 1e-8, "lack");
        let turns = TRACK / 2.0 * (forces[0] - forces[1]) / J;
        assert_eq!(turns == 0.0, (left, right) == (0.8, 0.5));
        // Side forces follow behind the relaxation length: the rate is off by their share, some t^2.
        close(signal(&run, "car.yaw_rate")[1] / 1e-3, turns, 1e-4 * turns.abs(), "yaw acceleration");
        let shares = [("fl", FRONT, 0), ("rl", REAR, 0), ("fr", FRONT, 1), ("rr", REAR, 1)];
        for (wheel, load, k) in shares {
            close(last(&run, &format!("car.braking_{wheel}")), forces[k] * load / (M * G), 1e-9, wheel);
        }
    }
}

/// Of the friction of a wheel braking leaves a leg of a right triangle to the side, and at the limit nothing.
#[test]
fn braking_takes_from_the_side() {
    for tyre in ["magic_formula", "tmeasy"] {
        for (demand, share) in [(4000.0, 0.6), (9000.0, 0.9), (20000.0, 0.5)] {
            let keys = format!(
                "speed = \"20 m/s\"\ntyre = \"{tyre}\"\ntrack = \"1.5 m\"\nmu_left = 0.8\nmu_right = 0.3\nbraking = \"{demand} N\"\n\
                 brake_share = {share}"
            );
            let run = by(&car(
                "1.2 rad",
                &keys,
                &format!("{FIXED_CAR}[mass.body]\nmass = \"1 kg\"\n[scenario]\nduration = \"10 ms\"\n"),
            ));
            let mut fronts = 0.0;
            for (axle, load, part) in [("front", FRONT, share), ("rear", REAR, 1.0 - share)] {
                let (demand, limits): (f64, [f64; 2]) = (demand * part, [0.8 * load / 2.0, 0.3 * load / 2.0]);
                let brakes = [0, 1].map(|k| limits[k].min((demand / 2.0).max(demand - limits[1 - k])));
                let grip: f64 = (0..2).map(|k| (limits[k] * limits[k] - brakes[k] * brakes[k]).max(0.0).sqrt()).sum();
                // A millionth of the load is left at the limit.
                close(last(&run, &format!("car.grip_{axle}")), grip, 2e-6 * load, axle);
                if axle == "front" {
                    fronts = grip;
                }
            }
            // Wheels that are turned that far slide: TMeasy with 0.9 of the most, the Magic Formula with what C = 1.3 leaves.
            let force = last(&run, "car_side.f") / f64::cos(1.2);
            match tyre {
                "tmeasy" => close(force, 0.9 * fronts, 2e-6 * FRONT, "side force"),
                _ => assert!(force <= fronts + 2e-6 * FRONT && force >= 0.85 * fronts, "{force} of {fronts}"),
            }
            if demand == 20000.0 {
                assert!(fronts == 0.0 && force.abs() < 2e-6 * FRONT, "{force}");
                close(last(&run, "car.braking_lack"), demand - (0.8 + 0.3) * M * G / 2.0, 1e-6, "lack");
            }
        }
    }
}

/// Wheels carry the weight; braking moves F h/L to the front, a bend m u r h/track to the outer side, and no load is negative.
#[test]
fn loads_balance_their_moments() {
    let (h, u) = (0.6, 30.0);
    for (angle, share, demand) in [(0.02, None, 0.0), (0.02, Some(0.7), 3000.0), (-0.02, Some(0.4), 5000.0)] {
        let roll = share.map_or(String::new(), |share| format!("roll_share = {share}\n"));
        let keys = format!(
            "speed = \"{u} m/s\"\ntrack = \"1.5 m\"\nheight = \"{h} m\"\nmu = 1\nbraking = \"{demand} N\"\n{roll}"
        );
        let run = by(&car(&format!("{angle} rad"), &keys, "[scenario]\nduration = \"6 s\"\n"));
        let [fl, fr, rl, rr] = ["fl", "fr", "rl", "rr"].map(|wheel| last(&run, &format!("car.load_{wheel}")));
        let r = last(&run, "car.yaw_rate");
        assert!(r * angle > 0.0 && r.abs() > 0.1);
        close(fl + fr + rl + rr, M * G, 1e-8, "weight");
        close(fl + fr, FRONT + demand * h / (A + B), 1e-8, "front axle");
        close((fr + rr - fl - rl) * TRACK / 2.0, M * u * r * h, 1e-7, "about the axis of the road");
        let part = share.unwrap_or(B / (A + B));
        close((fr - fl) * TRACK / 2.0, part * M * u * r * h, 1e-7, "of the front axle");
    }
    // Higher and faster the inner wheels lift, and braking lifts those behind.
    let keys = "speed = \"40 m/s\"\ntrack = \"1.5 m\"\nheight = \"2 m\"\nmu = 1.5\nbraking = \"push\"\n";
    let push = "[signal.push]\nkind = \"ramp\"\nto = \"20 kN\"\nstart = \"0.5 s\"\nover = \"0.5 s\"\n[scenario]\nduration = \"2 s\"\n";
    let run = by(&car("0.05 rad", keys, push));
    let loads = ["fl", "fr", "rl", "rr"].map(|wheel| signal(&run, &format!("car.load_{wheel}")));
    for k in 0..run.series.time.len() {
        assert!(loads.iter().all(|load| load[k] >= 0.0));
        close(loads.iter().map(|load| load[k]).sum(), M * G, 1e-8, "weight");
    }
    let lifts = |k: usize| loads[k].contains(&0.0);
    assert!(lifts(0) && lifts(2) && lifts(3) && !lifts(1));
}

/// Friction falls with the load of a wheel: an axle that moves load in a bend holds less by k (d/F)^2 of it, where d is what is moved and F half its load.
#[test]
fn moved_loads_cost_side_force() {
    let (h, u, k) = (0.6, 25.0, 0.2);
    let keys = format!(
        "speed = \"{u} m/s\"\ntyre = \"tmeasy\"\ntrack = \"1.5 m\"\nheight = \"{h} m\"\nmu = 0.9\nload_sensitivity = {k}"
    );
    let run = by(&car("0.03 rad", &keys, "[scenario]\nduration = \"2 s\"\n"));
    let r = last(&run, "car.yaw_rate");
    for (axle, load) in [("front", FRONT), ("rear", REAR)] {
        let moved = M * u * r * h / TRACK * load / (M * G);
        let part = moved / (load / 2.0);
        assert!(part > 0.2, "{part}");
        close(last(&run, &format!("car.grip_{axle}")), 0.9 * load * (1.0 - k * part * part), 1e-7, axle);
    }
}

/// A linear car that brakes while it turns: lateral force, moment and the torque at the king-pins in balance.
#[test]
fn a_braked_car_turns_steadily() {
    let (u, delta, demand, scrub, trail) = (20.0, 0.02, 5000.0, 0.03, 0.02);
    let keys = format!(
        "speed = \"{u} m/s\"\nmu_left = 0.9\nmu_right = 0.2\ntrack = \"1.5 m\"\nbraking = \"{demand} N\"\nscrub_radius = \"{scrub} m\"\n\
         caster_trail = \"{trail} m\"\n"
    );
    let run = by(&car(&format!("{delta} rad"), &keys, "[scenario]\nduration = \"12 s\"\n"));
    let [left, right] = [demand - 0.2 * M * G / 2.0, 0.2 * M * G / 2.0];
    let (front, rear, part) = (90e3, 110e3, B / (A + B));
    // m u r = F_f + F_r - B_f d, 0 = a F_f - b F_r - (a + n) B_f d + track/2 (left - right), F_f = C_f (d - (v + a r)/u), F_r = C_r (b r - v)/u; in v and r.
    let direction = demand * part * delta;
    let rows = [
        [(front + rear) / u, M * u + (front * A - rear * B) / u, front * delta - direction],
        [
            (front * A - rear * B) / u,
            (front * A * A + rear * B * B) / u,
            front * A * delta - (A + trail) * direction + TRACK / 2.0 * (left - right),
        ],
    ];
    let determinant = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0];
    let r = (rows[0][0] * rows[1][2] - rows[1][0] * rows[0][2]) / determinant;
    let v = (rows[0][2] * rows[1][1] - rows[1][2] * rows[0][1]) / determinant;
    close(last(&run, "car.yaw_rate"), r, 1e-8, "yaw rate");
    close(last(&run, "car.v_y"), v, 1e-7, "lateral velocity");
    close(last(&run, "car.a_y"), u * r, 1e-7, "lateral acceleration");
    let force = front * (delta - (v + A * r) / u);
    let torque = scrub * part * (left - right) - trail * force;
    close(last(&run, "car_steering.tau"), torque, 1e-6, "torque at the king-pins");
}

/// Forces at four points of the road, turned with their wheels: what they are to the side and about the centre of gravity.
#[test]
fn braking_forces_act_in_the_direction_of_the_wheels() {
    let (delta, scrub, trail) = (0.5_f64, -0.02, 0.03);
    let keys = format!(
        "speed = \"20 m/s\"\ntyre = \"tmeasy\"\nmu_left = 0.2\nmu_right = 0.9\ntrack = \"1.5 m\"\nbraking = \"6 kN\"\nbrake_share = 0.7\n\
         scrub_radius = \"{scrub} m\"\ncaster_trail = \"{trail} m\"\n"
    );
    let more = format!("{FIXED_CAR}[mass.body]\nmass = \"1 kg\"\n[scenario]\nduration = \"10 ms\"\n");
    let run = by(&car(&format!("{delta} rad"), &keys, &more));
    let rotated = |[x, y]: [f64; 2]| [x * delta.cos() - y * delta.sin(), x * delta.sin() + y * delta.cos()];
    let (mut aside, mut about) = (0.0, 0.0);
    for (wheel, y) in [("fl", 1.0), ("fr", -1.0)] {
        // Where the axis of the king-pin meets the road, and from there to where the wheel does.
        let [dx, dy] = rotated([-trail, y * scrub]);
        let at = [A + trail + dx, y * (TRACK / 2.0 - scrub) + dy];
        let force = rotated([-last(&run, &format!("car.braking_{wheel}")), 0.0]);
        aside += force[1];
        about += at[0] * force[1] - at[1] * force[0];
    }
    for (wheel, y) in [("rl", 1.0), ("rr", -1.0)] {
        about += y * TRACK / 2.0 * last(&run, &format!("car.braking_{wheel}"));
    }
    let front = ["fl", "fr"].map(|wheel| last(&run, &format!("car.braking_{wheel}")));
    close(front[0] + front[1], 4200.0, 1e-8, "front axle");
    close(last(&run, "car_braking.f"), aside, 1e-9, "to the side");
    close(last(&run, "car_braking_yaw.tau"), about, 1e-9, "about the centre of gravity");
    close(last(&run, "car_scrub.tau"), scrub * (front[0] - front[1]), 1e-9, "about the king-pins");
}

/// Braking in a bend on split friction: what is stored, put in and lost adds up.
#[test]
fn the_energy_balance_closes() {
    let keys = "speed = \"25 m/s - lost\"\ntyre = \"tmeasy\"\nrelaxation_length = \"0.5 m\"\ntrack = \"1.5 m\"\nheight = \"0.55 m\"\nmu_left = 0.9\n\
                mu_right = \"grip\"\nload_sensitivity = 0.1\nbraking = \"push\"\npneumatic_trail = \"30 mm\"";
    let more = "[signal.lost]\nkind = \"ramp\"\nto = \"12 m/s\"\nover = \"3 s\"\n[signal.push]\nkind = \"ramp\"\nto = \"6 kN\"\nover = \"0.3 s\"\n\
                [signal.grip]\nkind = \"ramp\"\nfrom = 0.9\nto = 0.4\nstart = \"1 s\"\nover = \"0.5 s\"\n[scenario]\nduration = \"3 s\"\n";
    let run = by(&car("0.04 rad * sin(pi * t / 1 s)", keys, more));
    assert!(run.series.signals.iter().flat_map(|signal| &signal.values).all(|x| x.is_finite()));
    assert!(run.energy.residual_share().is_some_and(|part| part < 1e-7), "{:?}", run.energy);
    assert!(last(&run, "car.y").abs() > 0.5);
}

/// On a road that is the same on both sides the car stops on a line.
#[test]
fn even_friction_keeps_the_line() {
    let keys = "speed = \"20 m/s - lost\"\ntyre = \"magic_formula\"\nrelaxation_length = \"0.5 m\"\ntrack = \"1.5 m\"\nheight = \"0.55 m\"\nmu = 0.9\n\
                braking = \"1500 kg * 8 m/s^2\"";
    let more = "[signal.lost]\nkind = \"ramp\"\nto = \"20 m/s\"\nover = \"2.5 s\"\n[scenario]\nduration = \"2.5 s\"\n";
    let run = by(&car("0 rad", keys, more));
    for name in ["car.y", "car.yaw_rate"] {
        assert!(signal(&run, name).iter().all(|x| *x == 0.0), "{name}");
    }
    close(last(&run, "car.x"), 25.0, 1e-8, "way");
    close(last(&run, "car.v_x"), 0.0, 1e-12, "speed");
    close(last(&run, "car.braking_lack"), 0.0, 1e-8, "lack");
}

/// Laws of other elements read what the wheels do.
#[test]
fn laws_read_wheels() {
    let keys = "speed = \"20 m/s\"\nmu_left = 0.9\nmu_right = 0.2\ntrack = \"1.5 m\"\nbraking = \"3000 N\"";
    let more = "[mass.body]\nmass = \"10 kg\"\n[torque.pull]\nshaft = \"body\"\nlaw = \"car.braking_fl + car.braking_fr - 2 * car.load_rl\"\n\
                [scenario]\nduration = \"0.2 s\"\n";
    let run = by(&car("0 rad", keys, more));
    close(last(&run, "pull.f"), 3000.0 * B / (A + B) - REAR, 1e-8, "force");
}

/// A mass that the brakes slow down is the speed of the car: at the limit it loses what both sides bear, mean friction times g, and each second as much.
#[test]
fn the_brakes_slow_a_mass() {
    let keys = "speed = \"body.v\"\nmu_left = 0.8\nmu_right = 0.2\ntrack = \"1.5 m\"\nheight = \"0.5 m\"\nbraking = \"20 kN\"\nroll_share = 0.5";
    let all = ["fl", "fr", "rl", "rr"].map(|wheel| format!("car.braking_{wheel}")).join(" - ");
    let more = format!(
        "[mass.body]\nmass = \"1500 kg\"\n[torque.slows]\nshaft = \"body\"\nlaw = \"-{all}\"\n[constraint.still]\ncoefficients = {{ car_yaw = 1 }}\n\
         [scenario]\nduration = \"2 s\"\ninitial = {{ \"body.v\" = \"30 m/s\" }}\n"
    );
    let run = by(&car("0 rad", keys, &more));
    let rate = 0.5 * G;
    for (k, t) in run.series.time.iter().enumerate() {
        close(signal(&run, "car.v_x")[k], 30.0 - rate * t, 1e-8, "speed");
        close(signal(&run, "car.x")[k], 30.0 * t - rate * t * t / 2.0, 1e-8, "way");
        close(signal(&run, "car.load_front")[k], FRONT + M * rate * 0.5 / (A + B), 1e-8, "front axle");
    }
}

fn value(run: &Run, name: &str) -> f64 {
    let found = run.figures.iter().find(|figure| figure.name == name);
    found.and_then(|figure| figure.value).unwrap_or_else(|| panic!("no {name}: {:?} {:?}", run.figures, run.notes))
}

/// The manoeuvre brakes to standstill and lets go; who looks at the line stays nearer to it than one whose wheel is held straight, and more than the road
/// bears is told.
#[test]
fn split_braking_is_driven() {
    let model = |deceleration: f64, driver: &str, corrects: &str| {
        let car = car(
            "0 rad",
            "speed = \"pace - slowed\"\nbraking = \"braking\"\nmu_left = 0.9\nmu_right = 0.5\ntrack = \"1.5 m\"\nheight = \"0.55 m\"\n\
             tyre = \"tmeasy\"\nrelaxation_length = \"0.5 m\"",
            &format!(
                "[parameters]\npace = \"72 km/h\"\n[driver.anna]\nwheel = \"hand\"\n{driver}\n\
                 [manoeuvre.halt]\nkind = \"split_braking\"\nspeed = \"pace\"\ndeceleration = \"{deceleration} m/s^2\"\nstart = \"0.5 s\"\n{corrects}\n\
                 [manoeuvre.other]\nkind = \"free\"\nduration = \"0.5 s\"\nsteering_angle = \"0 deg\"\n"
            ),
        );
        let source = car
            .replace("[prescribed_motion.driver]\nshaft = \"hand\"\nangle = \"0 rad\"\n", "")
            .replace("[shaft.hand]\n", "[shaft.hand]\ninertia = \"0.04 kg m^2\"\n")
            .replace("steering_ratio = 1\n", "steering_ratio = 16\n");
        let settings = Settings { runs_only: true, ..Settings::default() };
        let study = Project::open(&source).run(&settings, &Silent);
        let study: Study =
            study.unwrap_or_else(|diagnostics| panic!("{}", kardan::diagnostics::plain(&source, &diagnostics)));
        study
    };
    let open_loop = model(6.0, "kind = \"open_loop\"\nangle = \"steer\"", "");
    let [run, other] = &open_loop.runs[..] else { panic!("two runs") };
    close(*run.series.time.last().expect("a row"), 0.5 + 20.0 / 6.0, 1e-9, "duration");
    close(last(run, "car.v_x"), 0.0, 1e-9, "speed");
    assert!(signal(other, "car.v_x").iter().all(|u| *u == 20.0));
    assert!(signal(other, "car.braking_left").iter().all(|f| *f == 0.0));
    for (name, of, unit) in
        [("yaw_rate", "car.yaw_rate", 1.0), ("offset", "car.y", 1.0), ("correction", "hand.phi", 1.0)]
    {
        let most = signal(run, of).iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        close(value(run, &format!("halt_{name}")), most * unit, 1e-6, name);
    }
    assert!(run.requirements.iter().all(|one| one.passed), "{:?}", run.requirements);
    // To the left, where it brakes more.
    assert!(last(run, "car.y") > 0.3, "{}", last(run, "car.y"));
    let preview = "kind = \"preview\"\ncar = \"car\"\npath = \"lane\"\ngain = \"17 deg/m\"\npreview = \"0.8 s\"\nreaction = \"0.1 s\"";
    let corrected = model(6.0, preview, "closed_loop = \"yes\"");
    let (open_loop_offset, corrected_offset) = (value(run, "halt_offset"), value(&corrected.runs[0], "halt_offset"));
    assert!(corrected_offset < 0.6 * open_loop_offset, "{corrected_offset} {open_loop_offset}");
    let hard = model(9.0, "kind = \"open_loop\"\nangle = \"steer\"", "");
    let lack = M * 9.0 - (0.9 + 0.5) / 2.0 * M * G;
    assert!(hard.runs[0].requirements.iter().any(|one| !one.passed));
    assert!(value(&hard.runs[0], "halt_lack") > 0.9 * lack);
}

/// From a speed that the car does not have it would come to drive backwards: told by a criterion.
#[test]
fn braking_from_another_speed_is_reported() {
    let failed = |speed: &str| {
        let keys = "speed = \"20 m/s - slowed\"\nmu = 0.9\nbraking = \"braking\"\nrelaxation_length = \"0.5 m\"";
        let halt =
            format!("[manoeuvre.halt]\nkind = \"split_braking\"\nspeed = \"{speed}\"\ndeceleration = \"5 m/s^2\"\n");
        let settings = Settings { runs_only: true, ..Settings::default() };
        let study = Project::open(car("0 rad", keys, &halt)).run(&settings, &Silent).unwrap();
        let run = &study.runs[0];
        let failed: Vec<String> =
            run.requirements.iter().filter(|one| !one.passed).map(|one| one.text.clone()).collect();
        (value(run, "halt_speed"), failed)
    };
    let (least, none) = failed("20 m/s");
    assert!(least.abs() < 1e-9 && none.is_empty(), "{least} {none:?}");
    let (least, reported) = failed("21 m/s");
    close(least, -1.0, 1e-9, "least speed");
    assert!(matches!(&reported[..], [one] if one.contains("halt_speed")), "{reported:?}");
}

/// Who brakes with another signal than that of the manoeuvre would not brake: that is told.
#[test]
fn braking_that_the_car_does_not_follow_is_reported() {
    let reported = |braking: &str| {
        let keys = format!("speed = \"20 m/s - slowed\"\nmu = 0.9\nbraking = \"{braking}\"");
        let halt = "[manoeuvre.halt]\nkind = \"split_braking\"\nspeed = \"20 m/s\"\ndeceleration = \"5 m/s^2\"\n";
        let project = Project::open(car("0 rad", &keys, halt));
        let reported: Vec<String> = project.diagnostics().iter().map(|one| one.message.clone()).collect();
        reported
    };
    assert_eq!(reported("braking"), [""; 0]);
    assert_eq!(reported("100 N"), ["manoeuvre `halt`: the model does not use its signal `braking`"]);
}
