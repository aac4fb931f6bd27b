//! Cuts through gears with load-dependent losses, from which the logs determine the load.

use super::extra::{ExtraTerm, Law, law_parameters};
use super::request::FitRequest;
use kardan_identify::{Coefficient, Teeth};
use kardan_math::num::{Matrix, Rational, Scalar, echelon, rational_to_f64};
use kardan_mechanics::assemble::{CoefficientKind as Kind, DirectionalTerm};
use kardan_mechanics::equations::{GearLoss, UnilateralConstraint};
use kardan_mechanics::reduce::{Kinematics, LawTorques, Reduced, linearise};
use kardan_model::Document;
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::schema::Table;

/// The gear data of a cut, with remarks about it.
struct Cut {
    teeth: Teeth,
    /// Unknown coefficients that enter with the values of the file.
    load_independent: Vec<String>,
    /// Whether the load contains all information of the logs besides the unknowns: then any loss fits.
    explains_itself: bool,
}

/// Whether the gear loss exists only to provide a direction.
fn is_lossless(gear: &GearLoss) -> bool {
    gear.loss.is_none() && [&gear.forth, &gear.back].iter().all(|part| part.to_f64().abs() < 1e-8)
}

/// Inputs of the cut computation.
#[derive(Clone, Copy)]
pub(super) struct Balance<'a> {
    pub reduced: &'a Reduced,
    /// Unmeasured inputs.
    pub unmeasured: &'a [usize],
    /// Positions of the inputs among the measured quantities.
    pub torques: &'a [Option<usize>],
    /// The unknowns.
    pub sought: &'a [Coefficient],
    pub request: &'a FitRequest,
}

/// A condition on the motion of a cut: a row over the shafts, and its required value.
type Condition = (Row, Rational);
/// A direction over the shafts.
type Row = Vec<(usize, Rational)>;

impl Balance<'_> {
    /// The cuts of all gear losses in order, or the reason why a cut is impossible.
    fn cuts(&self) -> impl Iterator<Item = Result<Cut, String>> {
        self.reduced.equations.gear_losses().map(|(unilateral, gear)| self.cut(unilateral, gear))
    }

    /// The requested loss of a gear.
    fn gear_loss(&self, element: &str) -> Option<&ExtraTerm> {
        self.request.extras.iter().find(|one| one.element == element && matches!(one.law, Law::Teeth { .. }))
    }

    fn cut(&self, unilateral: &DirectionalTerm<UnilateralConstraint>, gear: &GearLoss) -> Result<Cut, String> {
        let equations = &self.reduced.equations;
        if !Kinematics::new(self.reduced).is_constant() {
            return Err("ratios of the model depend on the angle".into());
        }
        let first = unilateral.row.iter().find(|(_, x)| *x > Rational::ZERO).map(|(body, _)| *body);
        let entry =
            |row: &[(usize, Rational)]| row.iter().find(|(body, _)| Some(*body) == first).map(|(_, x)| x.clone());
        let own = equations.constraints.iter().position(|one| one.element == unilateral.element);
        let own = own.ok_or("a spring replaces their constraint")?;
        let lever =
            entry(&equations.constraints[own].row).ok_or("their constraint does not contain their first body")?;
        let others = equations.constraints.iter().enumerate().filter(|(k, _)| *k != own).map(|(_, one)| &one.row);
        let unknown_loads = equations.gear_losses().filter(|(other, _)| other.element != unilateral.element);
        let zero: Vec<&Row> = others
            .chain(self.unmeasured.iter().map(|&k| &equations.inputs[k].row))
            .chain(unknown_loads.map(|(other, _)| &other.row))
            .chain(gear.loss.is_some().then_some(&unilateral.row))
            .collect();
        let mut found = self.motion((&equations.constraints[own].row, lever), &zero).ok_or_else(|| {
            let names = self.unmeasured.iter().map(|&k| equations.inputs[k].element.as_str());
            format!("no torque in the logs determines their load ({} are not logged)", quoted(names))
        })?;
        let load_independent = found.unknown(self);
        found.try_condition(&unilateral.row);
        let motion = found.motion;
        let fixed = self.gear_loss(&unilateral.element).is_none() && !is_lossless(gear);
        let [forth, back] = [&gear.forth, &gear.back].map(|part| if fixed { part.to_f64() } else { 0.0 });
        let loss = gear.loss.as_ref().map(|loss| LawTorques::new(self.reduced, &[loss.as_ref()], &[], &[]));
        let teeth = Teeth {
            row: unilateral.row_f64(),
            cut: motion.iter().map(rational_to_f64).collect(),
            fixed: [forth, back],
            loss: loss.transpose().map_err(|_| "their loss is unknown")?,
            rest_speed: 0.0,
        };
        Ok(Cut { teeth, load_independent, explains_itself: !self.has_reference(&motion) })
    }

    /// The cut of a backlash whose torque is an unmeasured input, and the unknowns that enter its torque.
    pub fn cut_of_backlash(&self, input: usize) -> Option<(Teeth, Vec<String>)> {
        let equations = &self.reduced.equations;
        let unknown_loads = self.unmeasured.iter().filter(|&&k| k != input).map(|&k| &equations.inputs[k].row);
        let zero: Vec<&Row> = equations.constraints.iter().map(|one| &one.row).chain(unknown_loads).collect();
        let own = &equations.inputs[input];
        let found = self.motion((&own.row, Rational::ONE), &zero);
        let mut found = found.filter(|_| Kinematics::new(self.reduced).is_constant())?;
        let entering = found.unknown(self);
        let cut = found.motion.iter().map(rational_to_f64).collect();
        Some((Teeth { row: own.row_f64(), cut, ..Teeth::default() }, entering))
    }

    /// A motion with a value along one row and zero along others.
    fn motion(&self, (row, value): (&Row, Rational), zero: &[&Row]) -> Option<Cutting> {
        let mut conditions = vec![(row.clone(), value)];
        conditions.extend(zero.iter().map(|row| ((*row).clone(), Rational::ZERO)));
        let motion = solution(&conditions, self.reduced.equations.coordinates.len())?;
        Some(Cutting { conditions, motion })
    }

    /// Names and directions of the unknowns.
    fn unknown(&self) -> Vec<(String, Vec<Row>)> {
        let equations = &self.reduced.equations;
        let row = |kind: Kind, term: usize| equations.coefficient_row((kind, term)).to_vec();
        let rows = |one: &Coefficient| one.terms.iter().map(|&term| row(one.kind, term)).collect();
        let mut out: Vec<_> = self.sought.iter().map(|one| (one.name.clone(), rows(one))).collect();
        for law in &equations.laws {
            let open = |name: &&String| law.value.names.iter().any(|(candidate, _)| candidate == *name);
            if let Some(name) = law_parameters(&self.request.extras).iter().find(open) {
                out.push((name.clone(), vec![law.row.clone()]));
            }
        }
        out
    }

    /// Whether a known term that moves with the plant is no part of the gear load.
    fn has_reference(&self, motion: &[Rational]) -> bool {
        let equations = &self.reduced.equations;
        let basis = linearise(self.reduced, &vec![0.0; self.reduced.degrees_of_freedom()]).basis;
        let moves = |row: &[(usize, Rational)]| {
            let column = |j: usize| row.iter().fold(Rational::ZERO, |sum, (k, x)| sum.plus(&x.times(&basis[(*k, j)])));
            (0..basis.columns()).any(|j| !column(j).is_zero())
        };
        let apart = |row: &[(usize, Rational)]| row_dot(row, motion).is_zero() && moves(row);
        let sought =
            |kind: Kind, term: usize| self.sought.iter().any(|one| one.kind == kind && one.terms.contains(&term));
        let open = law_parameters(&self.request.extras);
        let is_fixed = |(kind, term): (Kind, usize)| {
            let zero = equations.coefficient((kind, term)).is_zero();
            !zero && !sought(kind, term) && apart(equations.coefficient_row((kind, term)))
        };
        equations.coefficient_slots().into_iter().any(is_fixed)
            || equations.inputs.iter().zip(self.torques).any(|(one, slot)| slot.is_some() && apart(&one.row))
            || equations
                .laws
                .iter()
                .any(|one| one.value.names.iter().all(|(name, _)| !open.contains(name)) && apart(&one.row))
    }
}

/// Whether a term enters the torque of a cut.
pub(super) fn is_cut<T>(term: &DirectionalTerm<T>, cut: &Teeth) -> bool {
    term.row_f64().iter().map(|(shaft, x)| x * cut.cut[*shaft]).sum::<f64>() != 0.0
}

/// A motion with the conditions that it satisfies.
struct Cutting {
    conditions: Vec<Condition>,
    motion: Vec<Rational>,
}

impl Cutting {
    /// Requires that the motion does not move along a row, if possible.
    fn try_condition(&mut self, row: &[(usize, Rational)]) {
        self.conditions.push((row.to_vec(), Rational::ZERO));
        match solution(&self.conditions, self.motion.len()) {
            Some(found) => self.motion = found,
            None => drop(self.conditions.pop()),
        }
    }

    /// Avoids the unknowns one after the other; returns those that enter nevertheless.
    fn unknown(&mut self, balance: &Balance<'_>) -> Vec<String> {
        let enters = |(name, rows): (String, Vec<Row>)| {
            rows.iter().for_each(|row| self.try_condition(row));
            rows.iter().any(|row| !row_dot(row, &self.motion).is_zero()).then_some(name)
        };
        balance.unknown().into_iter().filter_map(enters).collect()
    }
}

fn row_dot(row: &[(usize, Rational)], of: &[Rational]) -> Rational {
    row.iter().fold(Rational::ZERO, |sum, (k, x)| sum.plus(&x.times(&of[*k])))
}

/// A motion of n shafts that satisfies all conditions; exact.
fn solution(conditions: &[Condition], n: usize) -> Option<Vec<Rational>> {
    let mut matrix = Matrix::from_fn(conditions.len(), n + 1, |_, _| Rational::ZERO);
    for (i, (row, value)) in conditions.iter().enumerate() {
        row.iter().for_each(|(k, x)| matrix[(i, *k)] = x.clone());
        matrix[(i, n)] = Rational::ZERO.minus(value);
    }
    let kernel = echelon(&matrix, &(0..=n).collect::<Vec<_>>()).kernel();
    let column = (0..kernel.columns()).find(|&j| !kernel[(n, j)].is_zero())?;
    Some((0..n).map(|k| kernel[(k, column)].over(&kernel[(n, column)])).collect())
}

/// Errors of gear-loss terms, and notes about other gears.
pub(super) fn check_teeth(balance: &Balance<'_>) -> Result<Vec<String>, Vec<Diagnostic>> {
    let mut notes = Vec::new();
    for ((unilateral, gear), cut) in balance.reduced.equations.gear_losses().zip(balance.cuts()) {
        let element = &unilateral.element;
        match (cut, balance.gear_loss(element)) {
            (Err(why), Some(own)) => {
                let message = format!("the gear loss of `{element}` cannot be identified: {why}");
                return Err(vec![Diagnostic::error("identify::gear-loss", message)
                    .help(format!("remove `{}` from the parameters, or log the missing signal", own.term))]);
            }
            (Ok(cut), Some(own)) if cut.explains_itself => {
                let message = format!(
                    "the gear loss of `{element}` is unidentifiable: all parameters on the other side of the gear are unknown too"
                );
                return Err(vec![Diagnostic::error("identify::gear-loss", message).help(format!(
                    "put known values of one side (an inertia, a weight, a logged torque) into the file and identify the others; or remove \
                     `{}` from the parameters",
                    own.term
                ))]);
            }
            (_, None) if is_lossless(gear) => {}
            (Err(why), None) => notes.push(format!("kardan treats the gear {element} as lossless: {why}")),
            (Ok(cut), _) if !cut.load_independent.is_empty() => notes.push(format!(
                "kardan computes the load on the gear {element} with {} of the file, which is exact to first order only: write the \
                 identified values into the file (`--write`) and identify again until they no longer change",
                quoted(cut.load_independent.iter().map(String::as_str))
            )),
            _ => {}
        }
    }
    Ok(notes)
}

/// Gear losses for a regressor; gears without a cut are lossless.
pub(super) fn teeth(balance: &Balance<'_>) -> Vec<Teeth> {
    let n = balance.reduced.equations.coordinates.len();
    let none = || Teeth { cut: vec![0.0; n], ..Teeth::default() };
    balance.cuts().map(|cut| cut.map_or_else(|_| none(), |cut| cut.teeth)).collect()
}

/// All gears whose losses the file does not specify.
pub(super) fn teeth_to_try(document: &Document) -> Vec<ExtraTerm> {
    let has_key = |key: &str, table: &Table| table.values.contains_key(key);
    let own = document.elements.iter().filter(|one| {
        let table = &one.table;
        let has = one.kind.fields.iter().any(|field| field.name == "efficiency");
        has && ["efficiency", "loss", "backlash", "stiffness", "curve"].iter().all(|key| !has_key(key, table))
    });
    own.flat_map(|one| ExtraTerm::teeth(&one.name)).collect()
}

/// Gear-loss terms that the logs can identify. The load must follow from the motion: a measured torque includes everything that the balance does not
/// explain, and the loss would explain it by itself.
pub(super) fn identifiable_teeth(balance: &Balance<'_>) -> Vec<Vec<ExtraTerm>> {
    let all = balance.reduced.equations.gear_losses().zip(balance.cuts());
    let inputs = &balance.reduced.equations.inputs;
    let is_identifiable = |cut: &Cut| !cut.explains_itself && !inputs.iter().any(|input| is_cut(input, &cut.teeth));
    let identifiable = all.filter(|((_, gear), cut)| is_lossless(gear) && cut.as_ref().is_ok_and(is_identifiable));
    identifiable.map(|((unilateral, _), _)| ExtraTerm::teeth(&unilateral.element).to_vec()).collect()
}
