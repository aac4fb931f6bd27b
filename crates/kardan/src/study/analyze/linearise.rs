//! The computation of `kardan linearise`: the linear model of a variant with names and units.

use crate::study::check::massless_elimination::{Mechanical, not_eliminated};
use crate::study::operating_point::working_point::{AnalyzeSettings, WorkingPoint};
use crate::study::read::state_names::{NonAngleDomains, non_angle_domains, state_name};
use crate::study::{Prepared, PreparedVariant, Project};
use kardan_analysis::LinearSystem;
use kardan_math::num::Matrix;
use kardan_mechanics::equations::Domain;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{Linearised, NamedUnit};
use kardan_schema::diagnostics::Diagnostic;

/// The linear model of a model file; see [`Project::linearise`].
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("two-bodies").unwrap().source;
/// let (found, _) = study::linearise(source, &Default::default(), false).unwrap();
/// assert_eq!((found.a.rows(), found.inputs[0].unit.as_str()), (found.states.len(), "N m"));
/// ```
///
/// # Errors
/// All errors of the file, or the reason why kardan cannot linearise it.
pub fn linearise(
    source: &str,
    settings: &AnalyzeSettings,
    descriptor: bool,
) -> Result<(Linearised, Vec<Diagnostic>), Vec<Diagnostic>> {
    Project::open(source).linearise(settings, descriptor)
}

impl Project {
    /// One variant at the operating point of `[analysis]`, with the inputs and outputs of [`AnalyzeSettings`]; with
    /// `descriptor` the inertia stays on the left side as E, else E is the identity. Also the warnings of the file.
    ///
    /// # Errors
    /// All errors, or the reason why kardan cannot linearise it.
    pub fn linearise(
        &self,
        settings: &AnalyzeSettings,
        descriptor: bool,
    ) -> Result<(Linearised, Vec<Diagnostic>), Vec<Diagnostic>> {
        if !settings.at.is_empty() {
            let here = AnalyzeSettings { at: Vec::new(), ..settings.clone() };
            return self.looked_at(&settings.at).linearise(&here, descriptor);
        }
        let (prepared, diagnostics) = self.for_analysis()?;
        let variant = prepared.variant(settings.variant.as_deref())?;
        Ok((linear_model(prepared, variant, settings, descriptor)?, diagnostics.to_vec()))
    }
}

/// A variant at its operating point; if a torque has a kink there, also with the opposite side.
fn linear_model(
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    descriptor: bool,
) -> Result<Linearised, Vec<Diagnostic>> {
    let mut notes = Vec::new();
    let point = WorkingPoint::of(variant, settings, &mut notes)?;
    let non_angle_domains = non_angle_domains(&variant.reduced);
    let mut system = system_at(variant, &point, &non_angle_domains, &mut notes)?;
    if !descriptor {
        system = system.explicit().ok_or_else(|| {
            let message = "the inertia matrix is singular: there is no ẋ = A x + B u";
            Diagnostic::error("analysis::singular", message).help("write the matrices with E: `--descriptor`")
        })?;
    }
    let unit = |name: &String| NamedUnit { name: name.clone(), unit: SignalName::new(name).unit().into() };
    let outputs = system.outputs.iter().zip(&point.outputs).map(|(name, output)| {
        let quantity = variant.reduced.equations.reading(&output.measured);
        NamedUnit { name: name.clone(), unit: quantity.unit().into() }
    });
    let inputs = system.inputs.iter().zip(&point.system.inputs).map(|(name, input)| {
        let first = input.row.first().and_then(|(k, _)| non_angle_domains.get(&point.system.coordinates[*k]));
        let quantity = first.map_or(Domain::Rotation, |domain| *domain).effort();
        NamedUnit { name: name.clone(), unit: quantity.unit().into() }
    });
    let coordinates = variant.reduced.coordinate_names();
    let places = coordinates.iter().zip(&point.position);
    let angle = |name: &String| unit(&state_name(&Quantity::Angle.of(name), &non_angle_domains));
    let motion = point.motion.iter();
    let motion = motion.map(|one| (NamedUnit { name: one.name.clone(), unit: one.unit.clone() }, one.value));
    let opposite = || point.kinks.opposite().filter(|_| variant.point.side.below.is_empty());
    let opposite_side = opposite().map(|side| linear_model(prepared, &variant.on_side(&side), settings, descriptor));
    Ok(Linearised {
        name: prepared.name.clone(),
        variant: variant.name.clone(),
        states: system.states.iter().map(unit).collect(),
        inputs: inputs.collect(),
        outputs: outputs.collect(),
        operating_point: places.map(|(name, position)| (angle(name), *position)).chain(motion).collect(),
        e: (system.e != Matrix::identity(system.states.len())).then_some(system.e),
        a: system.a,
        b: system.b,
        c: system.c,
        d: system.d,
        side: point.kinks.opposite().map(|_| point.kinks.description(&variant.point.side)),
        opposite_side: opposite_side.transpose()?.map(Box::new),
        notes,
    })
}

/// The system in its coordinates, with motions without inertia eliminated on request.
fn system_at(
    variant: &PreparedVariant,
    point: &WorkingPoint,
    non_angle_domains: &NonAngleDomains,
    notes: &mut Vec<String>,
) -> Result<LinearSystem, Vec<Diagnostic>> {
    let mechanical = Mechanical::of(&point.system, &variant.reduced.coordinates, &point.outputs)?;
    let (mut system, massless) =
        mechanical.settled().map_err(|error| not_eliminated(error, non_angle_domains, variant))?;
    if massless {
        notes.push("motions without inertia are eliminated: variables that follow algebraically are no states".into());
    }
    system.states.iter_mut().for_each(|state| *state = state_name(state, non_angle_domains));
    Ok(system)
}
