//! Equilibria of a model, as text.

use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{Equilibrium, Reduced, STARTS, equilibria};
use kardan_schema::diagnostics::quoted;

/// Largest number of other equilibria that are listed.
const MAX_FURTHER: usize = 6;

/// Where the test of existence fails.
const NOT_PROVEN: &str =
    "that there is exactly one nearby is not proven, as the derivative of the torques is singular there, or nearly";

/// Bound on the error of a position found to rounding if the derivative of the torques is singular: half of the digits are lost, and more.
const SINGULAR: f64 = 1e-7;

/// An equilibrium without inputs and friction.
pub(in crate::study) struct Rest {
    pub equilibrium: Equilibrium,
    /// Bound on the distance to the true equilibrium, relative to its size or to one.
    pub off: f64,
    /// The position as text, and which properties are proven.
    pub found: String,
    /// Further sentences, in which `CHOICE` is a placeholder for the key that chooses another equilibrium.
    pub more: Vec<String>,
}

/// A reduced position as text: `arm.phi = 60 deg, rotor.phi = 6060.08… deg`.
pub(in crate::study) fn format_position(reduced: &Reduced, position: &[f64]) -> String {
    let names = reduced.coordinate_names();
    let one = |(k, x): (usize, &f64)| {
        let domain = reduced.equations.domain(reduced.coordinates[k]);
        let [quantity, _] = domain.motion();
        let signal = quantity.of(&names[k]);
        match domain {
            Domain::Rotation => format!("{signal} = {:.6} deg", x.to_degrees()),
            _ => format!("{signal} = {x:.6} {}", quantity.unit()),
        }
    };
    position.iter().enumerate().map(one).collect::<Vec<_>>().join(", ")
}

/// Currents that flow at rest: `l.i = 0.2 A`.
pub(in crate::study) fn format_currents(reduced: &Reduced, rates: &[f64]) -> impl Iterator<Item = String> {
    let names = reduced.coordinate_names();
    let flowing = rates.iter().enumerate().filter(|(_, rate)| **rate != 0.0);
    flowing.map(move |(k, rate)| {
        let [_, quantity] = reduced.equations.domain(reduced.coordinates[k]).motion();
        format!("{} = {rate:.6} {}", quantity.of(&names[k]), quantity.unit())
    })
}

/// An equilibrium, and whether its existence and local uniqueness are proven.
fn describe_equilibrium(one: &Equilibrium, place: &str, free: &str) -> String {
    let stays = if free.is_empty() { String::new() } else { format!(" among positions with the same {free}") };
    match one.radius {
        Some(radius) => format!(
            "the equilibrium {place}, proven: there is exactly one within {radius:e} of it{stays}, relative to a radian or metre or its size"
        ),
        None if one.residual == 0.0 => format!("{place}, where no residual torque remains; {NOT_PROVEN}"),
        None => format!("{place}, where torques of {:.1e} remain; {NOT_PROVEN}", one.residual),
    }
}

impl Rest {
    /// The equilibrium near a position; else the reason why there is none.
    pub fn near(reduced: &Reduced, near: &[f64]) -> Result<Self, String> {
        let names = reduced.coordinate_names();
        let domain = |k: usize| reduced.equations.domain(reduced.coordinates[k]);
        let place = |position: &[f64]| format_position(reduced, position);
        let all = equilibria(reduced, near);
        if let Some((k, torque)) = all.constant {
            let (name, unit) = (&names[k], domain(k).effort().unit());
            let torque = if torque.abs() < 1e-4 { format!("{torque:.4e}") } else { torque.to_string() };
            return Err(format!("there is no equilibrium: {torque} {unit} act on `{name}` at every position"));
        }
        let Some(first) = all.found.first() else {
            if let Some((position, unilateral)) = &all.beyond {
                return Err(format!(
                    "the equilibrium {} lies beyond the stop of `{}`, which is rigid, and no equilibrium was found \
                     on the stop",
                    place(position),
                    reduced.equations.unilaterals[*unilateral].element
                ));
            }
            let (best, residual) = all.best.unwrap_or_default();
            if residual == 0.0 && !best.is_empty() {
                return Err(format!(
                    "at {} no residual torque remains, but a law has no derivative there: whether the model stays \
                     there is not decided",
                    place(&best)
                ));
            }
            return Err(format!(
                "no equilibrium was found from {} starts within a turn (that there is none is not proven); the \
                 smallest residual is {residual:.3e}, at {}",
                STARTS + 1,
                place(&best)
            ));
        };
        let free = quoted(all.free.iter().map(|k| &names[*k]));
        let found = if all.free.len() == names.len() {
            format!(
                "{}; no torque depends on the position, so that every one is an equilibrium",
                place(&first.position)
            )
        } else {
            describe_equilibrium(first, &place(&first.position), &free)
        };
        let mut more = Vec::new();
        if !free.is_empty() {
            let stay = match all.free.len() {
                1 => "it stays where `initial` puts it",
                _ => "they stay where `initial` puts them",
            };
            more.push(format!("no torque depends on {free}: {stay}"));
        }
        if let [_, further @ ..] = all.found.as_slice()
            && !further.is_empty()
        {
            let mut listed: Vec<String> = further.iter().take(MAX_FURTHER).map(|one| place(&one.position)).collect();
            if further.len() > MAX_FURTHER {
                listed.push(format!("{} more", further.len() - MAX_FURTHER));
            }
            more.push(format!(
                "other equilibria, of those that {STARTS} starts within a turn led to (there may be more): {}; CHOICE chooses one",
                listed.join("; ")
            ));
        }
        let currents: Vec<String> = format_currents(reduced, &first.rates).collect();
        if !currents.is_empty() {
            more.push(format!("currents flow there: {}", currents.join(", ")));
        }
        // Newton's method halves the digits where the derivative is singular.
        let off = if all.free.len() == names.len() { 0.0 } else { first.radius.unwrap_or(SINGULAR) };
        Ok(Self { equilibrium: first.clone(), off, found, more })
    }
}
