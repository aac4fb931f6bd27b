//! Results as pages.

mod alternatives;
pub mod analysis;
pub mod bench;
mod descriptor;
pub mod design;
pub mod identification;
mod margins;
mod parity;
mod responses;
pub mod safety;
pub mod study;
pub mod summary;
pub mod sweep;

use crate::model::{Body, Cell, Section, row};
use crate::text::number;
use kardan_results::{Complex, Mechanism, Pole};
use kardan_rt::functions::hypot;

/// The drawing of the mechanism, the first section of a report.
fn mechanism(found: &Mechanism) -> (&'static str, &'static str, Body) {
    let drawn = Body::default().pictures(crate::mechanism::picture(found));
    (Section::MECHANISM, "Mechanism", Body::default().detail(drawn))
}

/// The body of a part of a result, where there is one.
fn optional<T>(found: &Option<T>, body: impl FnOnce(&T) -> Body) -> Body {
    found.as_ref().map(body).unwrap_or_default()
}

/// Poles, one row for each real one and each conjugate pair.
fn poles(poles: &[Pole]) -> Body {
    let mut rest = poles.to_vec();
    let mut rows = Vec::new();
    while !rest.is_empty() {
        let Complex { re: real, im: imaginary } = rest.remove(0);
        let size = hypot(real, imaginary);
        let conjugate = |pole: &Pole| hypot(pole.re - real, pole.im + imaginary) <= 1e-9 * size;
        let pair = if imaginary == 0.0 { None } else { rest.iter().position(conjugate) };
        let value = match (pair, imaginary) {
            (Some(_), _) => format!("{} ± {} j", number(real), number(imaginary.abs())),
            (None, 0.0) => number(real),
            (None, _) => format!("{} + {} j", number(real), number(imaginary)),
        };
        pair.map(|index| rest.remove(index));
        let damping = if size > 0.0 { number(-real / size) } else { "–".into() };
        let word = match real {
            _ if real < 0.0 => "decays",
            _ if real > 0.0 => "grows",
            _ => "does not decay",
        };
        rows.push(row![value, size, damping, Cell::Mark(real < 0.0, word.into())]);
    }
    Body::default().table(&["#pole [1/s]", "#natural frequency [rad/s]", "#damping ratio", ""], rows)
}

#[cfg(test)]
#[path = "../../tests/unit/present.rs"]
mod tests;
