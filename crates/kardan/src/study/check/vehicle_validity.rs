//! Cars that a run has driven backwards or sideways, on roads without friction, or with wheels off the ground.

use kardan_rt::functions::hypot;

use kardan_model::Model;
use kardan_results::Series;

/// Excess of the total speed of a car over its longitudinal speed, as a fraction and in m/s, above which `speed` no longer describes its motion.
const FASTER: f64 = 1.1;
const MORE: f64 = 0.5;

/// Sides and axles of a car with their wheels, and the real motion of a car with both of them off the ground.
const PAIRS: [(&str, [&str; 2], &str); 4] = [
    ("on its left", ["load_fl", "load_rl"], "rolls over"),
    ("on its right", ["load_fr", "load_rr"], "rolls over"),
    ("at its front", ["load_fl", "load_fr"], "pitches over"),
    ("at its rear", ["load_rl", "load_rr"], "pitches over"),
];

/// Warnings about cars that drive backwards, slide sideways, have a road without friction, or have both wheels of a side or an axle off the
/// ground, where the tyre model is not valid. Evaluated in the rows of the run.
pub(in crate::study) fn vehicle_warnings(model: &Model, series: &Series) -> Vec<String> {
    let cars = model.elements.iter().filter(|element| element.kind == "vehicle").map(|element| element.name.as_str());
    // The first time at which a signal is wrong, and its minimum.
    let first = |name: &str, is_wrong: fn(&f64) -> bool| {
        let values = &series.signal(name)?.values;
        let row = values.iter().position(is_wrong)?;
        Some((series.time[row], values.iter().copied().fold(f64::INFINITY, f64::min)))
    };
    let sentence = |car: &str| {
        let (time, least) = first(&format!("{car}.v_x"), |speed| *speed < 0.0)?;
        Some(format!(
            "`{car}` drives backwards from {time:.4} s on, at up to {:.4} m/s: its tyre model is valid only for forward \
             driving, so all its results after that are wrong; keep `speed` at zero or more, `max(0 m/s, ...)`.",
            -least
        ))
    };
    let slips = |car: &str| {
        let names = ["friction", "friction_rear", "friction_left", "friction_right"];
        let of = |name: &str| {
            let name = format!("{car}.{name}");
            let (time, least) = first(&name, |friction| *friction <= 0.0)?;
            Some(format!(
                "`{name}` is zero or less from {time:.4} s on, its minimum is {least:.4}: no road has that, and the tyre \
                 model uses 0.001 instead; keep it above zero, `max(0.05, ...)`."
            ))
        };
        names.into_iter().filter_map(of).collect::<Vec<String>>()
    };
    let sideways = |car: &str| {
        let [forward, across] = ["v_x", "v_y"].map(|name| series.signal(&format!("{car}.{name}")));
        let both = || forward.into_iter().zip(across).flat_map(|(x, y)| x.values.iter().zip(&y.values));
        let row = both().position(|(x, y)| hypot(*x, *y) > (FASTER * *x).max(*x + MORE))?;
        let (most, with) =
            both().map(|(x, y)| (hypot(*x, *y), *x)).fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
        Some(format!(
            "`{car}` slides sideways from {:.4} s on, at a total speed of up to {most:.4} m/s with {with:.4} m/s \
             along its longitudinal axis: the sliding is plausible, but its speed and position are wrong, as `speed` \
             prescribes the longitudinal speed for any tyre forces.",
            series.time[row]
        ))
    };
    let lifts = |car: &str| {
        let of = |(place, wheels, what): &(&str, [&str; 2], &str)| {
            let names = wheels.map(|wheel| format!("{car}.{wheel}"));
            let [one, two] = [&names[0], &names[1]].map(|name| series.signal(name));
            let row = one?.values.iter().zip(&two?.values).position(|(a, b)| *a <= 0.0 && *b <= 0.0)?;
            Some(format!(
                "Both wheels of `{car}` {place} are off the ground from {:.4} s on (`{}` and `{}` are zero): a real \
                 car {what} there, but this model stays upright, so all its results after that are wrong; drive \
                 slower, steer or brake less, or give it a lower `height`.",
                series.time[row], names[0], names[1]
            ))
        };
        PAIRS.iter().filter_map(of).collect::<Vec<String>>()
    };
    cars.flat_map(|car| sentence(car).into_iter().chain(sideways(car)).chain(slips(car)).chain(lifts(car))).collect()
}
