//! The plant in coordinates that were measured, and the columns that its logs can tell.

use super::asked::{Asked, Method};
use super::channels::{Quantity, quantity_of};
use super::extra::{ExtraTerm, extra_columns};
use super::wanted::{Wanted, coefficients, with_terms};
use crate::assemble::{CoefficientKind as Kind, Equations, assemble};
use crate::diagnostics::{Diagnostic, quoted};
use crate::equations::Term;
use crate::identify::{Coefficient, Extra, Regressor, undetermined};
use crate::model::{Document, Model, Setting};
use crate::num::{Matrix, Rational, echelon, rational_to_f64};
use crate::reduce::{Kinematics, Reduced, linearise, reduce};
use crate::study::prepare::is_error;
use crate::units::Exact;

/// A plant whose motion was measured, ready for rows.
pub(super) struct Plant {
    pub reduced: Reduced,
    pub model: Model,
    /// Places of the coordinates among the slots: angle, speed.
    pub sensors: Vec<(Option<usize>, Option<usize>)>,
    /// Places of the inputs among the slots.
    pub torques: Vec<Option<usize>>,
    /// Inputs that nobody measured.
    pub unmeasured: Vec<usize>,
    /// Step of the sensor of each slot, rad.
    pub steps: Vec<Option<f64>>,
}

/// What is fitted: columns and what they mean.
pub(super) struct Columns {
    pub asked: Vec<Coefficient>,
    /// Those of them that are columns; each with what else enters its value: `(number, factor)`.
    pub kept: Vec<(usize, Vec<(usize, f64)>)>,
    pub structural: Vec<Vec<Rational>>,
    pub extras: Vec<Extra>,
}

/// The model with terms for all that is asked for, in coordinates that were measured.
pub(super) fn plant(
    document: &Document,
    set: &[Setting],
    asked: &Asked,
    slots: &[Quantity],
    plain: &Model,
) -> Result<Plant, Vec<Diagnostic>> {
    let (document, set) = with_terms(document, set, &asked.wanted, &asked.declared);
    let (model, mistakes) = document.model_with(&set, Some(&[]));
    let mistakes: Vec<_> = mistakes.into_iter().filter(is_error).collect();
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let wrong = |message: String, help: String| vec![Diagnostic::error("identify::motion", message).help(help)];
    let equations = assemble(&model.shafts, &model.terms);
    let failed = |error: &dyn std::fmt::Display| {
        wrong(format!("the model cannot be reduced: {error}"), "`kardan check` says more".into())
    };
    let free = reduce(equations.clone(), None).map_err(|error| failed(&error))?;
    let mut measured: Vec<String> = Vec::new();
    for slot in slots {
        if let Quantity::Angle(shaft) | Quantity::Speed(shaft) = slot
            && !measured.contains(shaft)
        {
            measured.push(shaft.clone());
        }
    }
    // The coordinates of the file first, where they were measured.
    let preferred: Vec<String> = model.coordinates.clone().unwrap_or_default();
    measured.sort_by_key(|shaft| preferred.iter().position(|name| name == shaft).unwrap_or(usize::MAX));
    let basis = linearise(&free, &vec![0.0; free.degrees_of_freedom()]).basis;
    let rows: Vec<usize> = measured.iter().filter_map(|shaft| free.shaft(shaft)).collect();
    let transposed = Matrix::from_fn(basis.columns(), rows.len(), |i, j| basis[(rows[j], i)].clone());
    let pivots = echelon(&transposed, &(0..rows.len()).collect::<Vec<_>>()).pivots;
    if pivots.len() < free.degrees_of_freedom() {
        let others: Vec<&str> = free
            .equations
            .shafts
            .iter()
            .map(String::as_str)
            .filter(|shaft| !measured.iter().any(|m| m == shaft))
            .collect();
        let message = format!(
            "the model has {} degrees of freedom, and the logs tell {} of them",
            free.degrees_of_freedom(),
            pivots.len()
        );
        let help = if measured.is_empty() {
            "no angle and no speed of a shaft is in the logs; say in `[log.NAME]` which column is which".to_string()
        } else {
            format!(
                "measured are {}; log the motion of one of {} too",
                quoted(measured.iter().map(String::as_str)),
                quoted(others.into_iter())
            )
        };
        return Err(wrong(message, help));
    }
    let coordinates: Vec<String> = pivots.iter().map(|&k| measured[k].clone()).collect();
    let reduced = reduce(equations, Some(&coordinates)).map_err(|error| failed(&error))?;
    let names = reduced.coordinate_names();
    let place = |quantity: &Quantity| slots.iter().position(|slot| slot == quantity);
    let sensors: Vec<_> = names
        .iter()
        .map(|shaft| (place(&Quantity::Angle(shaft.clone())), place(&Quantity::Speed(shaft.clone()))))
        .collect();
    let position_matters = !Kinematics::new(&reduced).is_constant() || !reduced.equations.springs.is_empty();
    let blind: Vec<&str> =
        names.iter().zip(&sensors).filter(|(_, (angle, _))| angle.is_none()).map(|(name, _)| name.as_str()).collect();
    if position_matters && !blind.is_empty() {
        return Err(wrong(
            format!(
                "the torques depend on angles, but of {} only the speed is in the logs",
                quoted(blind.iter().copied())
            ),
            "log the angles too: springs and universal joints need them".into(),
        ));
    }
    let inputs = &reduced.equations.inputs;
    let torques: Vec<_> = inputs.iter().map(|input| place(&Quantity::Torque(input.element.clone()))).collect();
    let unmeasured: Vec<usize> =
        (0..inputs.len()).filter(|&k| torques[k].is_none() && !asked.absent.contains(&inputs[k].element)).collect();
    if torques.iter().all(Option::is_none) {
        let names = quoted(inputs.iter().map(|input| input.element.as_str()));
        return Err(wrong(
            "no torque of an input is in the logs: without one only ratios of parameters could be told".into(),
            format!("log the torque of one of {names}"),
        ));
    }
    let lost = |extra: &&ExtraTerm| {
        extra.torque.as_ref().is_some_and(|name| unmeasured.iter().any(|&k| inputs[k].element == *name))
    };
    if let Some(extra) = asked.extras.iter().find(lost) {
        let motor = extra.torque.as_deref().unwrap_or_default();
        return Err(wrong(
            format!("`{}` goes with the torque of `{motor}`, which is not in the logs", extra.name),
            format!("log the torque of `{motor}`, or leave `{}` out of the parameters", extra.name),
        ));
    }
    let steps = slots
        .iter()
        .map(|slot| {
            plain.terms.iter().filter(|named| matches!(named.term, Term::Output(_))).find_map(|named| {
                let (quantity, step) = quantity_of(&named.element, plain)?;
                (quantity == *slot).then_some(step).flatten()
            })
        })
        .collect();
    let out = Plant { reduced, model, sensors, torques, unmeasured, steps };
    let regressor = Regressor::new(&out.reduced, &[], &out.unmeasured, 0.0);
    if regressor.rows() == 0 {
        let names: Vec<&str> =
            out.unmeasured.iter().map(|&k| out.reduced.equations.inputs[k].element.as_str()).collect();
        return Err(wrong(
            format!("nothing is left to compare: the torques of {} are not in the logs", quoted(names.iter().copied())),
            "log them, or name those that did nothing under `absent` in `[identification]`".into(),
        ));
    }
    Ok(out)
}

/// The columns for a kind of excitation: what is dependent by structure is left out.
pub(super) fn columns(plant: &Plant, asked: &Asked, method: Method) -> Columns {
    let all = coefficients(&plant.reduced.equations, &asked.wanted);
    let structural = undetermined(&plant.reduced, &all, &plant.unmeasured, method.excitation());
    // Of each dependent combination the last parameter is the free one.
    let free: Vec<usize> = structural
        .iter()
        .map(|row| (0..row.len()).rev().find(|&k| row[k] != Rational::ZERO).expect("a combination is not zero"))
        .collect();
    let kept = (0..all.len())
        .filter(|k| !free.contains(k))
        .map(|k| {
            let with = structural.iter().zip(&free).filter_map(|(row, &f)| {
                let factor = -rational_to_f64(&row[k]) / rational_to_f64(&row[f]);
                (factor != 0.0).then_some((f, factor))
            });
            (k, with.collect())
        })
        .collect();
    Columns { kept, structural, extras: extra_columns(&plant.reduced.equations, &asked.extras), asked: all }
}

/// A plant in which some parameters are zero.
pub(super) fn plant_without(plant: &Plant, silent: &[&Wanted]) -> Plant {
    let mut reduced = plant.reduced.clone();
    for one in silent {
        for coefficient in coefficients(&reduced.equations, &[(*one).clone()]) {
            silence(&mut reduced.equations, &coefficient);
        }
    }
    Plant {
        reduced,
        model: plant.model.clone(),
        sensors: plant.sensors.clone(),
        torques: plant.torques.clone(),
        unmeasured: plant.unmeasured.clone(),
        steps: plant.steps.clone(),
    }
}

/// Sets a coefficient to zero.
pub(super) fn silence(equations: &mut Equations, coefficient: &Coefficient) {
    for &term in &coefficient.terms {
        match coefficient.kind {
            Kind::Inertia => equations.inertias[term].value = Exact::zero(),
            Kind::Damping => equations.dampers[term].value = Exact::zero(),
            Kind::Stiffness => equations.springs[term].value.stiffness = Exact::zero(),
            Kind::Friction => {
                let law = &mut equations.frictions[term].value;
                (law.torque, law.stribeck) = (Exact::zero(), None);
            }
        }
    }
}
