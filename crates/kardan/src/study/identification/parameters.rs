//! The identified parameters, and their values for the model file.

use super::backlashes::Backlash;
use super::cutting::teeth;
use super::extra::{ExtraTerm, Law};
use super::fitted::{Fitted, stiffness};
use super::numbers::{interval, short};
use super::request::FitRequest;
use kardan_identify::{Coefficient, Extra, Shape};
use kardan_math::num::{Definiteness, definiteness, rational_from_f64};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_mechanics::equations::{Domain, UnilateralConstraint};
use kardan_mechanics::reduce::linearise;
use kardan_results::{
    FIXED_REMARK, FileContent, FileLaw, FileTerm, FileValue, IdentifiedDamping, IdentifiedParameter, Interval,
};

/// Parameters in the order of the request, then those of the extra terms.
pub(super) fn parameters(fitted: &Fitted<'_>) -> Vec<IdentifiedParameter> {
    let Fitted { request, columns, .. } = fitted;
    let mut out: Vec<IdentifiedParameter> =
        (0..columns.coefficients.len()).map(|number| fitted.coefficient(number)).collect();
    let first = columns.identifiable.len();
    let mut speed = first + request.extras.len();
    for (k, extra) in request.extras.iter().enumerate() {
        let mut found = {
            let before = if let Law::Parameter { before, .. } = extra.law { Some(before) } else { None };
            fitted.column(extra.name.clone(), extra.unit(fitted.domain(&extra.element)), first + k, before)
        };
        if found.remark.is_empty() {
            found.remark.clone_from(&extra.remark);
        }
        out.push(found);
        if let Some((_, fixed_speed)) = extra.shape() {
            out.push(fitted.stribeck_speed(k, extra, fixed_speed, speed));
            speed += 1;
        }
        if matches!(extra.law, Law::Backlash { .. }) {
            out.push(fitted.backlash(extra, first + k));
        }
        if let Law::Teeth { back } = extra.law {
            out.push(fitted.efficiency(extra, back, first + k));
        }
    }
    out.extend(fitted.widths());
    out
}

fn published(request: &FitRequest, name: &str) -> Option<f64> {
    request.published.iter().find(|(candidate, _)| candidate == name).map(|(_, value)| *value)
}

impl Fitted<'_> {
    /// The domain of an element.
    pub fn domain(&self, element: &str) -> Domain {
        self.plant.reduced.equations.domain_of_element(element)
    }

    /// The result of a column of the fit.
    fn column(&self, name: String, unit: &str, column: usize, before: Option<f64>) -> IdentifiedParameter {
        let fit = self.fit;
        let (value, error) = (fit.values[column], fit.standard_errors[column]);
        let (bounded, undetermined) = (fit.bounded.contains(&column), error.is_infinite());
        let half = fit.quantile(column, self.request.confidence) * error;
        IdentifiedParameter {
            interval: interval(value, half).filter(|_| !bounded && !undetermined),
            remark: match (bounded, undetermined) {
                (true, _) => "at its bound, zero".into(),
                (_, true) => "these data do not determine it".into(),
                _ if half.is_nan() => "no interval: the fit has no residual from which to estimate the errors".into(),
                _ => String::new(),
            },
            published: published(self.request, &name),
            standard_error: (!bounded && !error.is_nan()).then_some(error),
            name,
            unit: unit.into(),
            model_value: before,
            value: Some(value),
            combination: String::new(),
        }
    }

    /// A requested coefficient: with others in a combination, or omitted because no test of this kind determines it.
    fn coefficient(&self, number: usize) -> IdentifiedParameter {
        let (columns, before) = (self.columns, self.request.unknowns[number].before);
        let Coefficient { name, kind, .. } = &columns.coefficients[number];
        let unit = kind.unit(self.domain(&self.request.unknowns[number].keys[0].0));
        let Some(column) = columns.identifiable.iter().position(|(identifiable, _)| *identifiable == number) else {
            return IdentifiedParameter {
                name: name.clone(),
                unit: unit.into(),
                model_value: before,
                value: before,
                standard_error: Some(f64::INFINITY),
                remark: "a test of this kind does not determine it, whichever signals are logged".into(),
                published: published(self.request, name),
                ..IdentifiedParameter::default()
            };
        };
        let mut found = self.column(name.clone(), unit, column, before);
        let with = &columns.identifiable[column].1;
        let part = |(candidate, factor): &(usize, f64)| {
            let sign = if *factor < 0.0 { "-" } else { "+" };
            format!(" {sign} {} {}", short(factor.abs()), columns.coefficients[*candidate].name)
        };
        found.combination = with.iter().map(part).collect();
        if !with.is_empty() {
            found.remark = "only this combination is identifiable".into();
        }
        found
    }

    /// The speed of the extra term `number`, in its column.
    fn stribeck_speed(
        &self,
        number: usize,
        extra: &ExtraTerm,
        fixed_speed: Option<f64>,
        column: usize,
    ) -> IdentifiedParameter {
        let unit = self.domain(&extra.element).motion()[1].unit();
        let mut found = self.column(extra.speed_name(), unit, column, None);
        if fixed_speed.is_some() {
            found.remark = FIXED_REMARK.into();
            found.interval = None;
            found.standard_error = None;
        } else if self.fit.at_end.contains(&number) {
            found.remark = "at the end of the measured speed range: these data do not determine it".into();
            found.interval = None;
            found.standard_error = Some(f64::INFINITY);
        }
        found
    }

    /// The width of a backlash, `2 p / s`: its error to first order in those of the torque p and the stiffness s.
    fn backlash(&self, extra: &ExtraTerm, column: usize) -> IdentifiedParameter {
        let Fitted { request, columns, fit, plant, .. } = self;
        let own = |key: &(String, Kind)| key.0 == extra.element && key.1 == Kind::Stiffness;
        let is_sought = request.unknowns.iter().any(|one| one.keys.iter().any(own));
        let (place, stiffness) = stiffness(plant, columns, fit, &extra.element);
        let width = 2.0 * fit.values[column] / stiffness;
        let mut found = IdentifiedParameter {
            name: format!("{}.backlash", extra.element),
            unit: self.domain(&extra.element).motion()[0].unit().into(),
            value: width.is_finite().then_some(width),
            ..IdentifiedParameter::default()
        };
        let apart = !is_sought || place.is_some_and(|k| columns.identifiable[k].1.is_empty());
        let errors = [Some(column), place].into_iter().flatten().map(|k| fit.standard_errors[k]);
        if !(apart && width.is_finite() && errors.fold(0.0, f64::max).is_finite()) {
            found.remark = "its torque or its stiffness is not determined".into();
            found.standard_error = Some(f64::INFINITY);
            return found;
        }
        let mut variance = 4.0 * fit.covariance[(column, column)];
        if let Some(k) = place {
            variance += width * width * fit.covariance[(k, k)] - 4.0 * width * fit.covariance[(column, k)];
        }
        let error = variance.max(0.0).sqrt() / stiffness.abs();
        let half = fit.quantile(column, request.confidence) * error;
        found.standard_error = Some(error);
        found.interval = interval(width, half);
        found
    }

    /// Widths of the requested backlashes.
    fn widths(&self) -> Vec<IdentifiedParameter> {
        let is_sought = |backlash: &&Backlash| {
            self.request.backlashes.as_ref().is_none_or(|backlashes| backlashes.contains(&backlash.element))
        };
        let of = |backlash: &Backlash| {
            let unilaterals = self.plant.reduced.equations.unilaterals.iter();
            let stops = unilaterals.filter(|unilateral| unilateral.element == backlash.element);
            // δ is at most the first value, and at least the negative of the second.
            let ends = stops.map(|unilateral| match &unilateral.value {
                UnilateralConstraint::Stop { upper: true, offset, .. } => [offset.to_f64(), 0.0],
                UnilateralConstraint::Stop { offset, .. } => [0.0, offset.to_f64()],
                _ => [0.0; 2],
            });
            let [a, b] = ends.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            let before = [Some(-a - b), Some((b - a) / 2.0)];
            let mut found = backlash.parameters(before, self.request.confidence);
            found.iter_mut().for_each(|one| one.published = published(self.request, &one.name));
            found
        };
        self.backlashes.iter().filter(is_sought).flat_map(of).collect()
    }

    /// The efficiency of a gear with this loss of the load at its cut.
    fn efficiency(&self, extra: &ExtraTerm, back: bool, column: usize) -> IdentifiedParameter {
        let mut found = self.column(extra.efficiency_name(back), "1", column, None);
        let Extra::Teeth { teeth: number, .. } = self.columns.extras[column - self.columns.identifiable.len()] else {
            return found;
        };
        let Some(teeth) = teeth(&self.plant.balance(&self.plant.reduced, &self.columns.coefficients, self.request))
            .into_iter()
            .nth(number)
        else {
            return found;
        };
        let of = |share: f64| {
            let part = teeth.part_of_share(share, back);
            if back { 1.0 - part } else { 1.0 / (1.0 + part) }
        };
        let share = self.fit.values[column];
        let slope = (of(share + 1e-6) - of(share - 1e-6)) / 2e-6;
        found.value = Some(of(share));
        found.standard_error = found.standard_error.map(|error| error * slope.abs());
        found.interval = found.interval.map(|it| Interval { lower: of(it.upper), upper: of(it.lower) });
        found
    }
}

/// The value of a parameter that is identified individually, with an interval.
fn determined(one: &IdentifiedParameter) -> Option<f64> {
    one.value.filter(|_| one.combination.is_empty() && one.interval.is_some())
}

/// The results that a model file can contain, and the others with reasons. The file gets Stribeck friction as the breakaway torque.
pub(super) fn for_file(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> FileContent {
    let Fitted { request, columns, .. } = fitted;
    let mut out = FileContent::default();
    for one in parameters.iter().take(columns.coefficients.len()) {
        if one.value == Some(0.0) && one.standard_error.is_none() {
            // At its bound: all others were fitted with it at zero.
            out.values.push(FileValue { name: one.name.clone(), value: 0.0, interval: None });
        } else {
            put(one, &mut out);
        }
    }
    for extra in &request.extras {
        let Some(own) = parameters.iter().find(|one| one.name == extra.name) else { continue };
        match &extra.law {
            Law::Parameter { .. } => put(own, &mut out),
            Law::Stribeck { shape: Shape::Gaussian, speed } => {
                let found = breakaway(fitted, extra, own, *speed, parameters);
                if found.is_none() {
                    let friction = format!("{}.friction", extra.element);
                    out.omissions.push(format!("{}: it or {friction} is not determined well enough", extra.name));
                }
                out.values.extend(found.into_iter().flatten());
            }
            Law::Stribeck { .. } => {
                out.omissions.push(format!("{}: a model file supports the gaussian shape only", extra.name));
            }
            // A law of a torque, or an efficiency.
            _ if is_in_file(extra) => {}
            law => out.omissions.push(format!("{}: {}", extra.name, not_in_a_file(law))),
        }
    }
    put_contacts_and_backlash(fitted, parameters, &mut out);
    put_terms(request, parameters, &mut out);
    out
}

/// Adds a parameter that is identified individually to the values, or another one with its remark to the omissions.
fn put(one: &IdentifiedParameter, out: &mut FileContent) {
    match determined(one) {
        Some(value) => out.values.push(FileValue { name: one.name.clone(), value, interval: one.interval }),
        None => out.omissions.push(format!("{}: {}", one.name, one.remark)),
    }
}

/// Breakaway torque and Stribeck speed of a Gaussian term, where they and the Coulomb friction are determined.
fn breakaway(
    fitted: &Fitted<'_>,
    extra: &ExtraTerm,
    own: &IdentifiedParameter,
    fixed_speed: Option<f64>,
    parameters: &[IdentifiedParameter],
) -> Option<[FileValue; 2]> {
    let name = extra.speed_name();
    let speed = parameters.iter().find(|one| one.name == name)?;
    let own_friction = |key: &(String, Kind)| key.0 == extra.element && key.1 == Kind::Friction;
    let sliding = match fitted.request.unknowns.iter().position(|one| one.keys.iter().any(own_friction)) {
        Some(k) => parameters.get(k).and_then(determined)?,
        None => {
            let mut frictions = fitted.plant.reduced.equations.frictions.iter();
            frictions.find(|term| term.element == extra.element)?.value.torque.to_f64()
        }
    };
    let excess = determined(own).filter(|excess| *excess > 0.0)?;
    if determined(speed).is_none() && fixed_speed.is_none() {
        return None;
    }
    let interval = determined(speed).and(speed.interval);
    let breakaway = format!("{}.breakaway", extra.element);
    Some([
        FileValue { name: breakaway, value: sliding + excess, interval: None },
        FileValue { name, value: speed.value?, interval },
    ])
}

/// Adds gear losses and backlashes.
fn put_contacts_and_backlash(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter], out: &mut FileContent) {
    for extra in &fitted.request.extras {
        let Law::Teeth { back } = extra.law else { continue };
        let name = extra.efficiency_name(back);
        let found = parameters.iter().find(|one| one.name == name);
        match found.and_then(determined).filter(|value| *value <= 1.0 && (back || *value > 0.0)) {
            Some(value) => out.values.push(FileValue { name, value, interval: None }),
            None => out.omissions.push(format!("{name}: it is not distinguishable from 1, or not determined")),
        }
    }
    // A file needs `efficiency` beside `efficiency_back`.
    for (unilateral, gear) in fitted.plant.reduced.equations.gear_losses() {
        let named = |word: &str| {
            let name = format!("{}.{word}", unilateral.element);
            out.values.iter().any(|one| one.name == name)
        };
        if named("efficiency_back") && !named("efficiency") && gear.forth.to_f64() < 1e-8 {
            let name = format!("{}.efficiency", unilateral.element);
            out.values.push(FileValue { name, value: 1.0, interval: None });
        }
    }
    for backlash in fitted.backlashes {
        for word in ["backlash", "offset"] {
            let name = format!("{}.{word}", backlash.element);
            if let Some(one) = parameters.iter().find(|one| one.name == name) {
                put(one, out);
            }
        }
    }
}

/// The law of a torque that expresses a term, if any.
fn law_of_file(extra: &ExtraTerm) -> Option<FileLaw> {
    match &extra.law {
        Law::FrictionAsymmetry => Some(FileLaw::FrictionAsymmetry),
        Law::DampingAsymmetry => Some(FileLaw::DampingAsymmetry),
        Law::Quadratic => Some(FileLaw::Quadratic),
        Law::Cogging(harmonic) => Some(FileLaw::Cogging(harmonic.order)),
        _ => None,
    }
}

/// Adds terms as laws of torques; undetermined ones are omitted, with the reason.
fn put_terms(request: &FitRequest, parameters: &[IdentifiedParameter], out: &mut FileContent) {
    let FileContent { terms, omissions, .. } = out;
    for extra in &request.extras {
        let Some(law) = law_of_file(extra) else { continue };
        let found = parameters.iter().find(|one| one.name == extra.name && one.interval.is_some());
        let Some((one, value)) = found.and_then(|one| Some((one, one.value?))) else {
            omissions.push(format!("{}: these data do not determine it", extra.name));
            terms.retain(|other| other.term != extra.term);
            continue;
        };
        let coefficient = FileValue { name: one.name.clone(), value, interval: one.interval };
        match terms.iter_mut().find(|other| other.term == extra.term) {
            Some(other) => other.coefficients.push(coefficient),
            None => terms.push(FileTerm {
                term: extra.term.clone(),
                element: extra.element.clone(),
                law,
                unit: one.unit.clone(),
                coefficients: vec![coefficient],
            }),
        }
    }
    terms.retain(|one| !matches!(one.law, FileLaw::Cogging(_)) || one.coefficients.len() == 2);
}

/// Whether a law of a torque, or a key of an element, expresses a term.
pub(super) fn is_in_file(extra: &ExtraTerm) -> bool {
    law_of_file(extra).is_some() || matches!(extra.law, Law::Teeth { .. } | Law::Parameter { .. })
}

/// Why an additional term cannot be written into the model file.
fn not_in_a_file(law: &Law) -> &'static str {
    match law {
        Law::Load { .. } => "no key of an element describes it; for a gear loss use the kind `gear_loss`",
        Law::Recordings | Law::Recording { .. } | Law::Drift => "friction of a model does not change with time",
        Law::Offset => "it belongs to the sensor: subtract it from the readings",
        Law::Backlash { .. } => "kardan writes its width there",
        _ => "no key of an element describes it",
    }
}

/// Kᵀ D K at the identified values, if dampings were requested.
pub(super) fn damping(fitted: &Fitted<'_>, parameters: &[IdentifiedParameter]) -> Option<IdentifiedDamping> {
    let Fitted { plant, columns, .. } = fitted;
    let damping_terms = || columns.coefficients.iter().filter(|one| one.kind == Kind::Damping);
    let determined = |one: &Coefficient| {
        let is_determined = |found: &IdentifiedParameter| found.interval.is_some() || found.standard_error.is_none();
        parameters.iter().any(|found| found.name == one.name && is_determined(found))
    };
    if damping_terms().next().is_none() || !damping_terms().all(determined) {
        return None;
    }
    let mut reduced = plant.reduced.clone();
    for one in damping_terms() {
        let value = rational_from_f64(own_value(&one.name, parameters, fitted)?)?;
        for &term in &one.terms {
            reduced.equations.dampers[term].value = Exact::new(value.clone(), 0);
        }
    }
    let damping = linearise(&reduced, &vec![0.0; reduced.degrees_of_freedom()]).damping;
    let passive = !matches!(definiteness(&damping), Definiteness::Indefinite { .. });
    let coordinates = reduced.coordinate_names();
    let mut units: Vec<&str> = coordinates.iter().map(|name| plant.domain_of_coordinate(name).units()[1]).collect();
    units.dedup();
    let unit = if let [unit] = units.as_slice() { (*unit).into() } else { "SI".into() };
    Some(IdentifiedDamping { coordinates, values: damping.to_rows(), unit, passive })
}

/// The value of a parameter, with the others of its combination at the values of the file.
fn own_value(name: &str, parameters: &[IdentifiedParameter], fitted: &Fitted<'_>) -> Option<f64> {
    let found = parameters.iter().find(|one| one.name == name)?;
    let columns = fitted.columns;
    let number = columns.coefficients.iter().position(|one| one.name == name)?;
    let with =
        columns.identifiable.iter().find(|(identifiable, _)| *identifiable == number).map_or(&[][..], |(_, with)| with);
    let fixed_part: f64 =
        with.iter().map(|(other, factor)| factor * fitted.request.unknowns[*other].before.unwrap_or(0.0)).sum();
    let value = found.value? - fixed_part;
    value.is_finite().then_some(value)
}
