//! The law `pole_placement`.

use std::sync::Arc;

use crate::outputs::{AS_MANY_INPUTS, OUTPUT, REFERENCE, Task, decaying_poles, inputs, references};
use crate::regulator::place_poles;
use crate::state_feedback::state_feedback;
use crate::{Law, LawKind, Request, SynthesisError};
use kardan_schema::schema::{Keys, LawKeys, keys};

keys! {
    /// A channel of the law `pole_placement`.
    table PolePlacementChannel {
        required {
            output: Output as OUTPUT;
            reference: Name as REFERENCE;
        }
        optional {
        }
    }
}

law_keys! {
    /// Robust pole placement by state feedback.
    law PolePlacement("pole_placement") {
        required {
            inputs: Elements(&["motor", "voltage_source"]) as AS_MANY_INPUTS;
            poles: Poles,
                "As many poles as states: angles and speeds of the reduced coordinates, no speed of one without inertia, no charge that acts on nothing.";
        }
        optional {
            channels: Tables(PolePlacementChannel), "One table for each output, as many as motors; left out: none.";
        }
    }
}

/// Robust pole placement by state feedback.
pub const POLE_PLACEMENT: LawKind = LawKind {
    keyword: PolePlacement::KEYWORD,
    summary: "State feedback u = -K x + L r with chosen poles, as insensitive to errors of the model as the inputs allow; \
              references are reached at rest, the outputs are not decoupled during transients.",
    fields: PolePlacement::FIELDS,
    example: "\
[control.column]
law = \"pole_placement\"
inputs = [\"wg_motor\", \"rk_motor\"]
poles = [-20, \"-14 ± 14.3j\", \"-60 ± 60j\", -30]

[[control.column.channels]]
output = \"rk.phi\"
reference = \"ref_rk\"

[[control.column.channels]]
output = \"fs.phi\"
reference = \"ref_fs\"
",
    template: |_, _| None,
    inputs,
    references,
    samples: false,
    design,
};

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let mut task = Task::new(request)?;
    task.leave_counters(request.plant);
    let poles = decaying_poles(request.values)?;
    let found = place_poles(&task.system, &poles)?;
    let notes = vec![format!(
        "the poles are met with the relative residual {:.1e}; the condition of the eigenvectors is {:.3}",
        found.residual, found.condition
    )];
    state_feedback(request, &task, POLE_PLACEMENT.keyword, &found.gain, Vec::new(), notes)
}
