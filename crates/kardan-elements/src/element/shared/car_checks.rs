//! Checks of the tyres and the wheels of a car.

use super::kind::KeyError;
use super::tmeasy::PEAK;
use kardan_math::num::rational_to_f64;
use kardan_mechanics::equations::{Formula, Meaning};
use kardan_schema::schema::Values;

/// Largest accepted friction.
const MOST_FRICTION: f64 = 2.0;
/// As in the loads of the car, m/s².
const GRAVITY: f64 = 9.80665;

/// Errors of friction and tyres.
pub(in crate::element) fn check_tyres(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    let nonlinear = values.word("tyre").is_some_and(|tyre| tyre != "linear");
    let slides = nonlinear || ["bore_torque", "braking"].into_iter().any(|key| values.has(key));
    if slides && !["mu", "mu_left", "mu_right"].into_iter().any(|key| values.has(key)) {
        let key = match (nonlinear, values.has("braking")) {
            (true, _) => "tyre",
            (false, true) => "braking",
            (false, false) => "bore_torque",
        };
        let message = "it needs the friction between tyres and road";
        out.push(KeyError::new(key, message, "add `mu = 1`, or a signal: `mu = \"grip\"`"));
    }
    for key in ["mu", "mu_rear", "mu_left", "mu_right"].into_iter().filter(|key| values.has(key)) {
        if !slides || (key == "mu_rear" && !nonlinear && !values.has("braking")) {
            let message = "linear tyres have no friction limit";
            out.push(KeyError::new(key, message, "remove it, or write `tyre = \"magic_formula\"`"));
        }
        let formula = values.formula(key);
        if let Some((what, least)) = formula.and_then(|formula| least(formula))
            && least <= 0.0
        {
            let message = format!("{what} is {least}: a friction has to be above zero");
            out.push(KeyError::new(key, message, "ice has about 0.1, a wet road 0.6, a dry one 1"));
        }
        if let Some(most) = formula.and_then(|formula| formula.number()).map(|mu| rational_to_f64(&mu))
            && most > MOST_FRICTION
        {
            let message = format!("a friction of {most} is above {MOST_FRICTION}");
            out.push(KeyError::new(key, message, "it is the largest force of a tyre over its load"));
        }
    }
    if values.number("shape").is_some_and(|c| c > 2.0) {
        let message = "above two the force changes its sign at large slip";
        out.push(KeyError::new("shape", message, "C is between 1 and 2, 1.3 for forces across"));
    }
    if values.number("curvature").is_some_and(|e| e > 1.0) {
        let message = "above one the force changes its sign at large slip";
        out.push(KeyError::new("curvature", message, "E is at most 1, and often below zero"));
    }
    let (torque, stiffness) = (values.has("bore_torque"), values.has("bore_stiffness"));
    if torque != stiffness {
        let key = if torque { "bore_torque" } else { "bore_stiffness" };
        out.push(KeyError::new(key, "`bore_torque` and `bore_stiffness` go together", "give both, or none of them"));
    }
    if torque && !values.has("relaxation_length") {
        let message = "the twist of a tyre at standstill decays over its relaxation length as it rolls";
        out.push(KeyError::new("bore_torque", message, "give `relaxation_length`, such as \"0.5 m\""));
    }
    out
}

/// The known smallest value of a formula, with its description: a number; a signal, at its start and at its breakpoints; a formula of the
/// time, at its start.
pub(in crate::element) fn least(formula: &Formula) -> Option<(String, f64)> {
    if let Some(number) = formula.number() {
        return Some(("it".into(), rational_to_f64(&number)));
    }
    let text = formula.expression.text().trim().trim_matches('\'');
    let Some((_, Meaning::Signal(function))) = formula.names.iter().find(|(name, _)| name == text) else {
        return Some(("its value at the start".into(), rational_to_f64(&formula.at_begin()?)));
    };
    let starts = function.parts().flat_map(|part| part.pieces.starts()).copied();
    let times = starts.flat_map(|start| [start, start.next_down()]).filter(|time| *time >= 0.0).chain([0.0]);
    let (time, value) = times.map(|time| (time, function.value(time))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((format!("the signal `{text}` at {time} s"), value))
}

/// Errors of sides, braking, loads and the curve of TMeasy.
pub(in crate::element) fn check_wheels(values: &Values) -> Vec<KeyError> {
    let mut out = [check_sides(values), check_braking(values), check_loads(values), check_roll(values)].concat();
    if values.word("tyre") == Some("tmeasy") {
        out.extend(check_curve(values));
        return out;
    }
    for key in ["peak_slip", "slide_slip", "slide_factor"].into_iter().filter(|key| values.has(key)) {
        out.push(KeyError::new(key, "these tyres do not use it", "remove it, or write `tyre = \"tmeasy\"`"));
    }
    out
}

fn check_sides(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    let [left, right] = ["mu_left", "mu_right"].map(|key| values.has(key));
    if !left && !right {
        return out;
    }
    let key = if left { "mu_left" } else { "mu_right" };
    if left != right {
        let message = "the friction of the other side is missing";
        out.push(KeyError::new(key, message, "give both `mu_left` and `mu_right`, or `mu`"));
    }
    for whole in ["mu", "mu_rear"].into_iter().filter(|whole| values.has(whole)) {
        let message = format!("both `{whole}` and `{key}` are given");
        out.push(KeyError::new(key, message, "keep `mu` with `mu_rear`, or `mu_left` with `mu_right`"));
    }
    if !values.has("track") {
        let message = "the track width is missing";
        out.push(KeyError::new(key, message, "add `track = \"1.5 m\"`, the distance between left and right wheels"));
    }
    out
}

fn check_braking(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if let Some((what, least)) = values.formula("braking").and_then(|formula| least(formula))
        && least < 0.0
    {
        let message = format!("{what} is {least} N: brakes do not drive");
        out.push(KeyError::new("braking", message, "a braking force is positive, `max(0 N, ...)`"));
    }
    out.extend(above_one(values, "brake_share"));
    for key in ["brake_share", "scrub_radius"].into_iter().filter(|key| values.has(key) && !values.has("braking")) {
        let message = "there is no braking force, so it has no effect";
        out.push(KeyError::new(key, message, "add `braking`, the requested force, or remove it"));
    }
    out
}

/// A fraction above one.
fn above_one(values: &Values, key: &'static str) -> Option<KeyError> {
    let part = values.number(key).filter(|part| *part > 1.0)?;
    let message = format!("{part} is more than the whole");
    Some(KeyError::new(key, message, "it is the part of the front axle, from 0 to 1"))
}

fn check_loads(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::from_iter(above_one(values, "roll_share"));
    if values.has("height") && !values.has("track") {
        let message = "the track width is missing, over which cornering transfers the load";
        out.push(KeyError::new(
            "height",
            message,
            "add `track = \"1.5 m\"`, the distance between left and right wheels",
        ));
    }
    for key in ["roll_share", "load_sensitivity"].into_iter().filter(|key| values.has(key) && !values.has("height")) {
        let message = "the wheel loads stay at their static values, so it has no effect";
        out.push(KeyError::new(key, message, "add `height`, that of the centre of gravity, or remove it"));
    }
    if let Some(lost) = values.number("load_sensitivity").filter(|lost| *lost >= 1.0) {
        let message = format!("at double the load no friction remains: it loses {lost} of it");
        out.push(KeyError::new("load_sensitivity", message, "tyres of cars lose 0.05 to 0.3"));
    }
    out
}

/// A car that rolls needs its three numbers, a height, and springs that balance its weight.
fn check_roll(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if !values.has("roll_stiffness") {
        for key in ["roll_damping", "roll_inertia", "roll_height"].into_iter().filter(|key| values.has(key)) {
            let help = "add `roll_stiffness`, such as \"60 kN m/rad\", or remove it";
            out.push(KeyError::new(key, "the car does not roll, so it has no effect", help));
        }
        return out;
    }
    for (key, help) in [
        ("roll_damping", "add it, such as \"3500 N m s/rad\""),
        ("roll_inertia", "add it, such as \"500 kg m^2\""),
        ("height", "add it, that of the centre of gravity, such as \"0.55 m\""),
    ] {
        if !values.has(key) {
            out.push(KeyError::new("roll_stiffness", format!("a car that rolls needs `{key}`"), help));
        }
    }
    let [stiffness, mass, height] = ["roll_stiffness", "mass", "height"].map(|key| values.number(key));
    let arm = height.map(|height| height - values.number_or_default("roll_height"));
    if let Some(arm) = arm.filter(|arm| *arm < 0.0) {
        let message = format!("the roll axis is {} m above the centre of gravity", -arm);
        out.push(KeyError::new("roll_height", message, "lower it below `height`"));
    }
    if let (Some(stiffness), Some(mass), Some(arm)) = (stiffness, mass, arm) {
        let needed = mass * GRAVITY * arm;
        if stiffness <= needed {
            let message = format!(
                "the car tips over: its weight about the roll axis acts with {needed:.0} N m for each radian of roll"
            );
            out.push(KeyError::new("roll_stiffness", message, "raise it above that; cars have 40 to 100 kN m/rad"));
        }
    }
    out
}

/// The rational part of the curve needs `slope · slip ≥ 2 force` at the peak.
fn check_curve(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if let Some(factor) = values.number("slide_factor").filter(|factor| *factor > 1.0) {
        let message = format!("the force of a sliding tyre is at most its largest force, and {factor} of that is more");
        out.push(KeyError::new("slide_factor", message, "it is at most 1, on dry roads about 0.9"));
    }
    let [a, b, mass] = ["front_axle", "rear_axle", "mass"].map(|key| values.number(key));
    let (Some(a), Some(b), Some(mass)) = (a, b, mass) else { return out };
    let weight = mass * GRAVITY / (a + b);
    for (axle, load) in [("front", weight * b), ("rear", weight * a)] {
        let Some(stiffness) = values.number(&format!("{axle}_stiffness")) else { continue };
        let peak = values.number("peak_slip").unwrap_or(PEAK * load / stiffness);
        let needed = 2.0 * load / stiffness;
        if peak < needed {
            let message = format!(
                "with `{axle}_stiffness` the {axle} tyres cannot be at their largest force at a slip of {peak}: that takes {needed:.4} at least"
            );
            let help = "raise it, or leave it out: then it is three times the force over the stiffness";
            out.push(KeyError::new("peak_slip", message, help));
            break;
        }
        if let Some(slide) = values.number("slide_slip").filter(|slide| *slide <= peak) {
            let message =
                format!("the {axle} tyres slide from a slip of {slide} on, before their largest force at {peak:.4}");
            out.push(KeyError::new("slide_slip", message, "raise it above the slip of the peak, or leave it out"));
            break;
        }
    }
    out
}
