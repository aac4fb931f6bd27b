//! The plant in measured coordinates, and the columns that its logs can identify.

use super::backlashes::open_plays;
use super::channels::{Harmonic, Quantity};
use super::cutting::{Balance, check_teeth};
use super::extra::{ExtraTerm, extra_columns};
use super::laws::law_torques;
use super::request::FitRequest;
use super::unknowns::{UnknownParameter, coefficients, with_terms};
use kardan_identify::{Coefficient, Excitation, Extra, Regressor, undetermined};
use kardan_math::num::{Matrix, Rational, echelon, rational_to_f64};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::{CoefficientKind as Kind, Equations, assemble};
use kardan_mechanics::equations::{Domain, Meaning, UnilateralConstraint};
use kardan_mechanics::reduce::{Kinematics, Reduced, linearise, reduce};
use kardan_model::{Document, Model, Setting};
use kardan_schema::diagnostics::{Diagnostic, quoted};

/// Positions of the angle and the speed of a coordinate among the slots.
pub(super) type Sensors = (Option<usize>, Option<usize>);

/// A plant whose motion was measured, ready for rows.
#[derive(Clone)]
pub(super) struct Plant {
    pub reduced: Reduced,
    pub model: Model,
    /// Of each coordinate.
    pub sensors: Vec<Sensors>,
    /// Positions of the inputs among the slots.
    pub torques: Vec<Option<usize>>,
    /// Unmeasured inputs.
    pub unmeasured: Vec<usize>,
    /// Harmonics of angles in use, and their positions among the slots.
    pub harmonics: Vec<(Harmonic, usize)>,
    /// Elements with backlash, whose torque is eliminated.
    pub backlashes: Vec<String>,
    /// Notes about it.
    pub notes: Vec<String>,
}

/// The fitted columns and their meaning.
pub(super) struct Columns {
    pub coefficients: Vec<Coefficient>,
    /// Those of them that are columns; each with the others that enter its value: `(number, factor)`.
    pub identifiable: Vec<(usize, Vec<(usize, f64)>)>,
    pub structural: Vec<Vec<Rational>>,
    pub extras: Vec<Extra>,
}

impl Columns {
    /// The coefficients that are columns.
    pub fn identified(&self) -> impl Iterator<Item = &Coefficient> {
        self.identifiable.iter().map(|(k, _)| &self.coefficients[*k])
    }

    /// Names of the columns.
    pub fn names(&self, request: &FitRequest) -> Vec<String> {
        let extras = request.extras.iter().map(|extra| extra.name.clone());
        self.identified().map(|one| one.name.clone()).chain(extras).collect()
    }
}

/// The model with terms for the whole request, in measured coordinates.
pub(super) fn plant(
    document: &Document,
    set: &[Setting],
    request: &FitRequest,
    slots: &[Quantity],
    tried: &[ExtraTerm],
) -> Result<Plant, Vec<Diagnostic>> {
    let terms: Vec<ExtraTerm> = request.declared.iter().cloned().chain(tried.iter().cloned()).collect();
    let (document, set) = with_terms(document, set, &request.unknowns, &terms);
    let (model, diagnostics) = document.model_with(&set, Some(&[]));
    let diagnostics: Vec<_> = diagnostics.into_iter().filter(Diagnostic::is_error).collect();
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let mut equations = assemble(&model.all_coordinates, &model.terms);
    let backlashes = open_plays(&document, &mut equations);
    let failed = |error: &dyn std::fmt::Display| {
        wrong(format!("the model cannot be reduced: {error}"), "`kardan check` reports the details")
    };
    let free = reduce(equations.clone(), None).map_err(|error| failed(&error))?;
    let coordinates = measured_coordinates(&model, &free, slots)?;
    let reduced = reduce(equations, Some(&coordinates)).map_err(|error| failed(&error))?;
    let place = |is: &dyn Fn(&Quantity) -> bool| slots.iter().position(is);
    let sensors = reduced.coordinate_names().into_iter();
    let sensors = sensors
        .map(|shaft| (place(&|slot| slot.is_angle_of(&shaft)), place(&|slot| slot.is_speed_of(&shaft))))
        .collect();
    let inputs = &reduced.equations.inputs;
    let torques: Vec<_> = inputs.iter().map(|input| place(&|slot| slot.is_torque_of(&input.element))).collect();
    let unmeasured = (0..inputs.len())
        .filter(|&k| torques[k].is_none() && !request.inactive_inputs.contains(&inputs[k].element))
        .collect();
    let harmonic = |(k, slot): (usize, &Quantity)| match slot {
        Quantity::Harmonic(harmonic) => Some((harmonic.clone(), k)),
        _ => None,
    };
    let harmonics = slots.iter().enumerate().filter_map(harmonic).collect();
    let mut plant = Plant { reduced, model, sensors, torques, unmeasured, harmonics, backlashes, notes: Vec::new() };
    plant.check_angles()?;
    law_torques(&plant.reduced, &request.extras, &plant.harmonics)?;
    plant.check_torques(request)?;
    let sought = coefficients(&plant.reduced.equations, &request.unknowns);
    plant.notes = check_teeth(&plant.balance(&plant.reduced, &sought, request))?;
    plant.notes.extend(plant.open_unilaterals());
    Ok(plant)
}

fn wrong(message: String, help: impl Into<String>) -> Vec<Diagnostic> {
    vec![Diagnostic::error("identify::motion", message).help(help)]
}

/// Shafts whose measured motion determines that of all others; those of the file's coordinates first.
fn measured_coordinates(model: &Model, free: &Reduced, slots: &[Quantity]) -> Result<Vec<String>, Vec<Diagnostic>> {
    let mut measured: Vec<String> = Vec::new();
    for slot in slots {
        if let Quantity::Angle(shaft, _) | Quantity::Speed(shaft, _) = slot
            && !measured.contains(shaft)
        {
            measured.push(shaft.clone());
        }
    }
    let preferred = model.coordinates.as_deref().unwrap_or_default();
    measured.sort_by_key(|shaft| preferred.iter().position(|name| name == shaft).unwrap_or(usize::MAX));
    let freedom = free.degrees_of_freedom();
    let basis = linearise(free, &vec![0.0; freedom]).basis;
    let rows: Vec<usize> = measured.iter().filter_map(|shaft| free.coordinate(shaft)).collect();
    let transposed = Matrix::from_fn(basis.columns(), rows.len(), |i, j| basis[(rows[j], i)].clone());
    let pivots = echelon(&transposed, &(0..rows.len()).collect::<Vec<_>>()).pivots;
    if pivots.len() < freedom {
        let message =
            format!("the model has {freedom} degrees of freedom, and the logs determine {} of them", pivots.len());
        let help = if measured.is_empty() {
            "no angle and no speed of a shaft is in the logs; map the columns to signals in `[log.NAME]`".to_string()
        } else {
            let loggable =
                free.equations.coordinates.iter().filter(|shaft| !measured.contains(shaft)).map(String::as_str);
            let measured = quoted(measured.iter().map(String::as_str));
            format!("the logs contain {measured}; log the motion of one of {} too", quoted(loggable))
        };
        return Err(wrong(message, help));
    }
    Ok(pivots.iter().map(|&k| measured[k].clone()).collect())
}

impl Plant {
    /// If torques depend on angles, the logs must contain them.
    fn check_angles(&self) -> Result<(), Vec<Diagnostic>> {
        let reduced = &self.reduced;
        if let Some(moving) = reduced.equations.moving.keys().next() {
            let message = format!("identification does not support moving constraints: `{moving}`");
            return Err(wrong(message, "give it a constant offset"));
        }
        let names = reduced.coordinate_names();
        let blind = names.iter().zip(&self.sensors).filter(|(_, (angle, _))| angle.is_none());
        let blind: Vec<&str> = blind.map(|(name, _)| name.as_str()).collect();
        let constant = || Kinematics::new(reduced).is_constant() && reduced.equations.springs.is_empty();
        if blind.is_empty() {
            return Ok(());
        }
        if constant() {
            return self.check_angles_of_laws(&blind);
        }
        let blind = quoted(blind);
        let message = format!("the torques depend on angles, but of {blind} only the speed is in the logs");
        Err(wrong(message, "log the angles too: springs and universal joints need them"))
    }

    /// Inputs of the cut computation for these equations.
    pub fn balance<'a>(
        &'a self,
        reduced: &'a Reduced,
        sought: &'a [Coefficient],
        request: &'a FitRequest,
    ) -> Balance<'a> {
        Balance { reduced, unmeasured: &self.unmeasured, torques: &self.torques, sought, request }
    }

    /// Notes about stops, brakes and contacts, which are no part of the balance.
    fn open_unilaterals(&self) -> Vec<String> {
        let unilaterals = self.reduced.equations.unilaterals.iter();
        let open = unilaterals.filter(|one| !matches!(one.value, UnilateralConstraint::GearLoss(_)));
        let mut names: Vec<&str> = open.map(|one| one.element.as_str()).collect();
        names.retain(|name| !self.backlashes.iter().any(|backlash| backlash == name));
        names.dedup();
        let note = |name| format!("kardan treats {name} as open: the torque balance contains no force of it");
        names.into_iter().map(note).collect()
    }

    /// The same for laws that depend on an angle.
    fn check_angles_of_laws(&self, blind: &[&str]) -> Result<(), Vec<Diagnostic>> {
        let (reduced, basis) = (&self.reduced, self.basis());
        let hidden = |shaft: &str| {
            let row = reduced.coordinate(shaft).expect("a formula names coordinates of its model");
            let names = reduced.coordinate_names();
            (0..basis.columns()).any(|k| basis[(row, k)] != Rational::ZERO && blind.contains(&names[k].as_str()))
        };
        for law in &reduced.equations.laws {
            let angle = law.value.all_names().into_iter().find_map(|(name, meaning)| match meaning {
                Meaning::Position(shaft) if hidden(shaft) => Some(name),
                _ => None,
            });
            if let Some(angle) = angle {
                let message = format!(
                    "the torque of `{}` depends on `{angle}`, of which only the speed is in the logs",
                    law.element
                );
                return Err(wrong(message, "log the angle too"));
            }
        }
        Ok(())
    }

    /// The logs must contain a torque, those on which extra terms depend, and enough of them that a row of the balance remains.
    fn check_torques(&self, request: &FitRequest) -> Result<(), Vec<Diagnostic>> {
        let inputs = &self.reduced.equations.inputs;
        if self.torques.iter().all(Option::is_none) {
            let names = quoted(inputs.iter().map(|input| input.element.as_str()));
            return Err(wrong(
                "no torque of an input is in the logs: without one only ratios of parameters are identifiable".into(),
                format!("log the torque of one of {names}"),
            ));
        }
        let unmeasured: Vec<&str> = self.unmeasured.iter().map(|&k| inputs[k].element.as_str()).collect();
        for extra in &request.extras {
            if let Some(motor) = extra.torque().filter(|motor| unmeasured.contains(motor)) {
                return Err(wrong(
                    format!("`{}` depends on the torque of `{motor}`, which is not in the logs", extra.name),
                    format!("log the torque of `{motor}`, or remove `{}` from the parameters", extra.name),
                ));
            }
        }
        if Regressor::new(&self.reduced, &[], &self.unmeasured, 0.0).rows() == 0 {
            let names = quoted(unmeasured);
            return Err(wrong(
                format!("no torque balance remains: the torques of {names} are not in the logs"),
                "log them, or list those that were zero under `inactive_inputs` in `[identification]`",
            ));
        }
        Ok(())
    }

    /// The speeds of the coordinates, as signals.
    pub fn speed_names(&self) -> Vec<String> {
        let speed = |shaft: &String| self.domain_of_coordinate(shaft).motion()[1].of(shaft);
        self.reduced.coordinate_names().iter().map(speed).collect()
    }

    /// The domain of a coordinate; rotation for another name.
    pub fn domain_of_coordinate(&self, name: &str) -> Domain {
        let equations = &self.reduced.equations;
        self.reduced.coordinate(name).map_or(Domain::Rotation, |number| equations.domain(number))
    }

    /// Names of this many rows of the balance.
    pub fn row_names(&self, rows: usize) -> Vec<String> {
        let names = self.reduced.coordinate_names();
        if rows == names.len() {
            return names;
        }
        (0..rows).map(|k| format!("row {}, without the unmeasured torques", k + 1)).collect()
    }

    /// `K` at rest: the angles of the shafts by the coordinates.
    pub fn basis(&self) -> Matrix<Rational> {
        linearise(&self.reduced, &vec![0.0; self.reduced.degrees_of_freedom()]).basis
    }
}

/// A direction over the shafts by the coordinates of a basis.
pub(super) fn in_coordinates(row: &[(usize, Rational)], basis: &Matrix<Rational>) -> Vec<f64> {
    let component = |j: usize| row.iter().map(|(s, a)| rational_to_f64(a) * rational_to_f64(&basis[(*s, j)])).sum();
    (0..basis.columns()).map(component).collect()
}

/// The columns for a kind of excitation, without structurally dependent ones.
pub(super) fn columns(plant: &Plant, request: &FitRequest, excitation: Excitation) -> Columns {
    let all = coefficients(&plant.reduced.equations, &request.unknowns);
    let structural = undetermined(&plant.reduced, &all, &plant.unmeasured, excitation);
    // Of each dependent combination the last parameter is the free one.
    let free: Vec<usize> = structural
        .iter()
        .map(|row| (0..row.len()).rev().find(|&k| row[k] != Rational::ZERO).expect("a combination is not zero"))
        .collect();
    let identifiable = (0..all.len())
        .filter(|k| !free.contains(k))
        .map(|k| {
            let with = structural.iter().zip(&free).filter_map(|(row, &f)| {
                let factor = -rational_to_f64(&row[k]) / rational_to_f64(&row[f]);
                (factor != 0.0).then_some((f, factor))
            });
            (k, with.collect())
        })
        .collect();
    let harmonics: Vec<&Harmonic> = plant.harmonics.iter().map(|(harmonic, _)| harmonic).collect();
    let extras = extra_columns(&plant.reduced.equations, &request.extras, &harmonics);
    Columns { identifiable, structural, extras, coefficients: all }
}

/// A plant in which some parameters are zero.
pub(super) fn plant_excluding(plant: &Plant, silent: &[&UnknownParameter]) -> Plant {
    let mut out = plant.clone();
    for one in silent {
        for coefficient in coefficients(&out.reduced.equations, &[(*one).clone()]) {
            silence(&mut out.reduced.equations, &coefficient);
        }
    }
    out
}

/// Sets a coefficient to zero.
pub(super) fn silence(equations: &mut Equations, coefficient: &Coefficient) {
    for &term in &coefficient.terms {
        *equations.coefficient_mut((coefficient.kind, term)) = Exact::zero();
        if coefficient.kind == Kind::Friction {
            equations.frictions[term].value.stribeck = None;
        }
    }
}
