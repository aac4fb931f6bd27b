//! The manual of the model file, from the registries.

use std::fmt::Write;

use super::document::{CONTROL, EVENT, MODEL, PLOT, REQUIREMENT, SCENARIO};
use crate::element;
use crate::schema::{Field, Kind, Sign};
use crate::synthesis;

/// An overview of all tables that a model file may have.
pub fn manual() -> String {
    let mut out = String::from("Tables of a model file (`kardan elements NAME` shows one in full):\n\nElements\n");
    for kind in element::REGISTRY {
        let _ = writeln!(out, "  [{}.NAME]\n      {}", kind.keyword, kind.summary);
    }
    out.push_str("\nControl laws\n");
    for law in synthesis::REGISTRY {
        let _ = writeln!(out, "  [control.NAME] with law = \"{}\"\n      {}", law.keyword, law.summary);
    }
    out.push_str("\nStudy\n");
    for (name, what) in STUDY {
        let _ = writeln!(out, "  {name}\n      {what}");
    }
    out
}

const STUDY: &[(&str, &str)] = &[
    ("[model]", "Name, description, reduced coordinates."),
    ("[parameters]", "Named quantities; elements use them by name: angle = \"beta\"."),
    ("[variants]", "Lists of parameter values, one run for each: beta = \"[0, 10, 20, 30] deg\"."),
    ("[scenario]", "Duration, output step, initial state."),
    ("[[scenario.event]]", "A step or ramp of a reference, a disturbance or a motor torque."),
    ("[[requirement]]", "A bound on a signal; `kardan run` ends with exit code 1 if it does not hold."),
    ("[[plot]]", "A plot of the report; without any, angles, speeds and motor torques are drawn."),
];

/// The manual page of one table: an element, a law, `model`, `scenario`, `event`, `requirement` or `plot`.
pub fn manual_of(name: &str) -> Option<String> {
    let mut out = String::new();
    if let Some(kind) = element::find(name) {
        let _ = writeln!(
            out,
            "[{}.NAME]\n\n{}\n\n{}\n\n{}\n\nKeys",
            kind.keyword,
            kind.summary,
            kind.sketch.trim_start_matches('\n'),
            kind.signs
        );
        keys(kind.fields, &mut out);
        let _ = write!(out, "\nExample\n\n{}", kind.example);
    } else if let Some(law) = synthesis::find(name) {
        let _ = writeln!(out, "[control.NAME] with law = \"{}\"\n\n{}\n\nKeys", law.keyword, law.summary);
        keys(&[CONTROL, law.fields].concat(), &mut out);
        let _ = write!(out, "\nExample\n\n{}", law.example);
    } else {
        let (header, fields) = match name {
            "model" => ("[model]", MODEL),
            "scenario" => ("[scenario]", SCENARIO),
            "event" => ("[[scenario.event]]", EVENT),
            "requirement" => ("[[requirement]]", REQUIREMENT),
            "plot" => ("[[plot]]", PLOT),
            _ => return None,
        };
        let _ = writeln!(out, "{header}\n\nKeys");
        keys(fields, &mut out);
    }
    Some(out)
}

fn keys(fields: &[Field], out: &mut String) {
    for field in fields {
        let need = if field.required { "required" } else { "optional" };
        let _ = writeln!(out, "  {} ({}, {need})\n      {}", field.name, describe(&field.kind), field.doc);
        if let Kind::Tables(inner) = field.kind {
            for field in inner {
                let need = if field.required { "required" } else { "optional" };
                let _ =
                    writeln!(out, "      {} ({}, {need})\n          {}", field.name, describe(&field.kind), field.doc);
            }
        }
    }
}

fn describe(kind: &Kind) -> String {
    let sign = |sign: &Sign| match sign {
        Sign::Any => "",
        Sign::NonNegative => ", zero or more",
        Sign::Positive => ", above zero",
        Sign::NonZero => ", not zero",
    };
    match kind {
        Kind::Shaft => "shaft".into(),
        Kind::Node => "node".into(),
        Kind::Shafts(_) => "list of shafts".into(),
        Kind::Quantity(dimension, s) => format!("{}{}", dimension.si(), sign(s)),
        Kind::Number(s) => format!("number{}", sign(s)),
        Kind::Coefficients => "numbers by shaft".into(),
        Kind::Choice(words) => words.join(" | "),
        Kind::Element(kinds) => format!("name of a {}", kinds.join(" or ")),
        Kind::Signal => "signal".into(),
        Kind::Signals => "list of signals".into(),
        Kind::Words => "list of names".into(),
        Kind::Name => "new name".into(),
        Kind::Text => "text".into(),
        Kind::AnyQuantity => "quantity".into(),
        Kind::Overrides => "quantities by name".into(),
        Kind::Tables(_) => "list of tables".into(),
    }
}
