//! The model of a variant in a few matrices.

use crate::study::loops::blocks::signal_graph;
use crate::study::{Prepared, PreparedVariant};
use kardan_math::num::Matrix;
use kardan_mechanics::equations::Domain;
use kardan_mechanics::reduce::{Reduced, linearise};
use kardan_results::{LawSummary, ModelSummary, NamedMatrix, Pole};
use kardan_synthesis::closed_loop_poles;

/// Name and unit of the reduced inertia, damping and stiffness matrix.
pub(in crate::study) fn matrix_titles(reduced: &Reduced) -> [(&'static str, &'static str); 3] {
    let has = |domain| reduced.coordinates.iter().any(|&k| reduced.equations.domain(k) == domain);
    match (has(Domain::Rotation), has(Domain::Charge)) {
        _ if has(Domain::Translation) && has(Domain::Charge) => {
            [("inertia and inductance", "SI"), ("damping and resistance", "SI"), ("stiffness and elastance", "SI")]
        }
        (true, _) if has(Domain::Translation) => [("inertia and mass", "SI"), ("damping", "SI"), ("stiffness", "SI")],
        _ if has(Domain::Translation) => [("mass", "kg"), ("damping", "N s/m"), ("stiffness", "N/m")],
        (_, false) => [("inertia", "kg m^2"), ("damping", "N m s/rad"), ("stiffness", "N m/rad")],
        (false, true) => [("inductance", "H"), ("resistance", "Ohm"), ("elastance", "1/F")],
        (true, true) => [
            ("inertia and inductance", "kg m^2, H"),
            ("damping and resistance", "N m s/rad, Ohm"),
            ("stiffness and elastance", "N m/rad, 1/F"),
        ],
    }
}

/// Largest number of coordinates of a summary: nobody reads larger matrices and pole lists, and poles cost the cube of the number.
const MOST_COORDINATES: usize = 100;

pub(in crate::study) fn summarise(prepared: &Prepared, variant: &PreparedVariant) -> ModelSummary {
    let laws = &variant.designed;
    // With multiplier constraints these would belong to another model.
    let has_multipliers = !variant.reduced.equations.multiplier_constraints.is_empty();
    let (matrices, closed_loop_poles) = match has_multipliers || variant.reduced.degrees_of_freedom() > MOST_COORDINATES
    {
        true => (Vec::new(), Vec::new()),
        false => numbers(variant),
    };
    ModelSummary {
        name: prepared.name.clone(),
        description: prepared.description.clone(),
        elements: variant.model.elements.clone(),
        mechanism: variant.model.mechanism.clone(),
        signals: signal_graph(&variant.model),
        coordinates: variant.reduced.coordinate_names(),
        matrices,
        laws: laws.iter().map(|law| law.describe().summary()).collect::<Vec<LawSummary>>(),
        closed_loop_poles,
    }
}

/// The reduced matrices at the initial position, and the poles there.
fn numbers(variant: &PreparedVariant) -> (Vec<NamedMatrix>, Vec<Pole>) {
    let linear = linearise(&variant.reduced, &variant.scenario.position);
    let [inertia, damping, stiffness] = matrix_titles(&variant.reduced);
    let matrix = |title: &str, unit: &str, columns: &[String], values: &Matrix<_>| NamedMatrix {
        title: title.into(),
        unit: unit.into(),
        rows: linear.coordinates.clone(),
        columns: columns.to_vec(),
        values: values.to_rows(),
    };
    let matrices = vec![
        matrix(&format!("reduced {}", inertia.0), inertia.1, &linear.coordinates, &linear.inertia),
        matrix(&format!("reduced {}", damping.0), damping.1, &linear.coordinates, &linear.damping),
        matrix(&format!("reduced {}", stiffness.0), stiffness.1, &linear.coordinates, &linear.stiffness),
        matrix("input map", "", &linear.inputs, &linear.input),
    ];
    (matrices, closed_loop_poles(&linear, &variant.designed).unwrap_or_default())
}
