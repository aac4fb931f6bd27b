//! The law `program`, written as expressions.

use std::sync::Arc;

use crate::{Law, LawKind, Reference, Request, SynthesisError, TaskLaw, clock};
use kardan_math::units::parse_quantity;
use kardan_results::Physical;
use kardan_schema::schema::Values;
use kardan_schema::schema::{Keys, LawKeys, keys};

keys! {
    /// A reference of a law written as expressions.
    table ProgramReference {
        required {
            name: Name, "Name of the reference signal, set by the scenario.";
            unit: Text, "Its unit, `rad`.";
        }
        optional {
        }
    }
}

law_keys! {
    /// A law written as expressions: the command of each motor is an expression of measurements, signals and blocks.
    law Program("program") {
        required {
            commands: Expressions, "Command of each motor or source: an expression of sensors, angles and speeds, references, signals and blocks.";
        }
        optional {
            references: Tables(ProgramReference),
                "References that its expressions name, each with its unit; left out: none but those that other laws and blocks introduce.";
        }
    }
}

/// A law written as expressions.
pub const PROGRAM: LawKind = LawKind {
    keyword: Program::KEYWORD,
    summary: "A law as you write it: commands are expressions of sensors, references, signals and blocks.",
    fields: Program::FIELDS,
    example: "\
[control.damping]
law = \"program\"
commands = { rk_motor = \"-2 N m s/rad * lead\" }
sample_time = \"1 ms\"
delay = \"1 ms\"

[block.lead]
kind = \"lead_lag\"
input = \"rk.w\"
lead = \"4 ms\"
lag = \"2 ms\"
sample_time = \"1 ms\"
",
    template: |_, _| None,
    inputs,
    references,
    samples: false,
    design,
};

fn inputs(values: &Values) -> Vec<String> {
    let outputs = values.task("commands").into_iter().flat_map(|task| &task.outputs);
    outputs.map(|output| output.name.clone()).collect()
}

fn references(values: &Values) -> Vec<Reference> {
    let entry = values.tables("references").unwrap_or_default().iter();
    let reference = |entry: &Values| {
        let (_, dimension) = parse_quantity(&format!("1 {}", entry.word("unit")?)).ok()?;
        let description = "reference of a program".to_string();
        Some(Reference { name: entry.word("name")?.into(), physical: Physical::of(dimension), description })
    };
    entry.filter_map(reference).collect()
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let Request { values, plant, .. } = request;
    if values.has("observer") {
        let message = format!("the law `{}` reads its sensors as they are, and has no observer", Program::KEYWORD);
        return Err(SynthesisError::whole(message, "remove `observer`; a block estimates what is not measured"));
    }
    let task = values.task("commands").expect("the model file gives commands");
    let law = TaskLaw::with(task, &plant.reduced, (Program::KEYWORD, clock(values)?));
    Ok(Arc::new(if plant.is_moved() { law.at_operating_point(plant) } else { law }))
}
