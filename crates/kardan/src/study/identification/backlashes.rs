//! Backlash between two measured angles: its width, where the sign of the transmitted torque is known.

use super::numbers::interval;
use kardan_identify::{Fit, student_quantile};
use kardan_math::num::dot;
use kardan_mechanics::assemble::{DirectionalTerm, Equations};
use kardan_mechanics::equations::{InputKind, UnilateralConstraint};
use kardan_model::Document;
use kardan_results::IdentifiedParameter;
use kardan_schema::diagnostics::quoted;

/// Fraction of the largest torque from which contact is certain.
const PRESSED: f64 = 0.05;
/// Standard errors from which the sign of a torque is certain.
const CERTAIN: f64 = 3.0;
/// Fewest windows on either side.
const FEWEST: f64 = 5.0;

/// Angle and torque of a backlash, window by window.
#[derive(Debug, Clone, Default)]
pub(super) struct Backlash {
    pub element: String,
    /// Whether it is between masses.
    pub straight: bool,
    /// Angle of the first body against the others (rad), and the torque of the gear on it (N m), by log, section and time; before
    /// [`Self::fitted`] without the contribution of the columns.
    pub windows: Vec<(usize, usize, f64, [f64; 2])>,
    /// Contribution of each column to the torque per value, window by window.
    pub parts: Vec<f64>,
    /// Errors of the torque from those of the values, window by window, N m.
    pub errors: Vec<f64>,
    /// Unknowns that enter the torque.
    pub untold: Vec<String>,
    /// Error of the angle of one contact from the steps and digits of the readings, independent of its length, rad.
    pub grain: f64,
}

/// Consecutive windows with contact on one side.
#[derive(Debug, Clone, Copy, Default)]
struct Contact {
    windows: f64,
    /// Mean of the angle, rad.
    angle: f64,
}

/// The contact angle of one side, from all contacts there.
struct Meeting {
    angle: f64,
    /// Variance of the mean, rad²; NaN for a single contact.
    variance: f64,
    /// Degrees of freedom of the variance: equivalent independent contacts, less one.
    freedom: f64,
    windows: f64,
    contacts: f64,
}

impl Meeting {
    /// The mean over all windows. Contacts are independent of each other, windows within one need not be: the angle of each contact against
    /// the mean gives the variance. It is unbiased for independent windows too, with Satterthwaite's degrees of freedom for those
    /// \[Bell, McCaffrey 2002\].
    fn of(contacts: &[Contact]) -> Self {
        let windows: f64 = contacts.iter().map(|one| one.windows).sum();
        let angle = contacts.iter().map(|one| one.windows * one.angle).sum::<f64>() / windows;
        // Σ a (x − mean)², a = w²/(1 − w): the deviations have the covariance δ/n − 1/N.
        let share = |one: &Contact| one.windows / windows;
        let factor = |one: &Contact| share(one) * share(one) / (1.0 - share(one));
        let variance = contacts.iter().map(|one| factor(one) * (one.angle - angle) * (one.angle - angle)).sum();
        let own = |one: &Contact| 1.0 / one.windows - 1.0 / windows;
        let mean: f64 = contacts.iter().map(|one| factor(one) * own(one)).sum();
        let all: f64 = contacts.iter().map(factor).sum::<f64>() / windows;
        let square_of = |one: &Contact| factor(one) * factor(one) * (own(one) * own(one) - 1.0 / (windows * windows));
        let square = all * all + contacts.iter().map(square_of).sum::<f64>();
        let is_single = contacts.len() < 2;
        Self {
            angle,
            variance: if is_single { f64::NAN } else { variance },
            freedom: if is_single { 0.0 } else { mean * mean / square },
            windows,
            contacts: contacts.len() as f64,
        }
    }
}

/// The torques of backlashes as unmeasured inputs, which are eliminated; returns the elements.
pub(super) fn open_plays(document: &Document, equations: &mut Equations) -> Vec<String> {
    let has_backlash = |element: &str| {
        let of = document.elements.get(element);
        of.is_some_and(|instance| matches!(instance.kind.keyword, "gear" | "spring_damper"))
    };
    let upper = equations.unilaterals.iter().filter(|unilateral| {
        let contact =
            matches!(unilateral.value, UnilateralConstraint::Stop { .. } | UnilateralConstraint::Cushion { .. });
        contact && unilateral.value.is_upper() && has_backlash(&unilateral.element)
    });
    // The upper stop of the torque on the first body is the direction of the first body itself.
    let input = |unilateral: &DirectionalTerm<UnilateralConstraint>| DirectionalTerm {
        element: unilateral.element.clone(),
        row: unilateral.row.clone(),
        value: InputKind::Disturbance,
    };
    let inputs: Vec<_> = upper.map(input).collect();
    let elements = inputs.iter().map(|input| input.element.clone()).collect();
    equations.inputs.extend(inputs);
    elements
}

impl Backlash {
    /// The same with the torques that follow from the values of a fit with these columns.
    pub fn fitted(&self, fit: &Fit, names: &[String]) -> Self {
        let mut out = Self { parts: Vec::new(), ..self.clone() };
        let columns = self.parts.len().checked_div(self.windows.len()).unwrap_or(0);
        let rows: Vec<&[f64]> = if columns == 0 { Vec::new() } else { self.parts.chunks(columns).collect() };
        let open =
            (0..columns).filter(|&k| fit.standard_errors[k].is_infinite() && rows.iter().any(|row| row[k] != 0.0));
        out.untold.extend(open.map(|k| names[k].clone()));
        for (window, row) in out.windows.iter_mut().zip(&rows) {
            window.3[1] += dot(row, &fit.values[..columns]);
            let covariance = |i: usize| (0..columns).map(|j| fit.covariance[(i, j)] * row[j]).sum::<f64>();
            // NaN where a value is at its bound: then only the torque decides.
            let variance: f64 = (0..columns).filter(|&i| row[i] != 0.0).map(|i| row[i] * covariance(i)).sum();
            out.errors.push(variance.max(0.0).sqrt());
        }
        out
    }

    /// Contacts with their side: consecutive windows that agree, without the first and the last.
    fn pressed(&self) -> Vec<(Contact, f64)> {
        let largest = self.windows.iter().map(|(.., [_, torque])| torque.abs()).fold(0.0, f64::max);
        let side = |k: usize| {
            let torque = self.windows[k].3[1];
            let error = self.errors.get(k).copied().unwrap_or(0.0);
            (torque.abs() > (PRESSED * largest).max(CERTAIN * error)).then(|| -torque.signum())
        };
        let near =
            |a: usize, b: usize| (self.windows[a].0, self.windows[a].1) == (self.windows[b].0, self.windows[b].1);
        let inner = 1..self.windows.len().saturating_sub(1);
        let agree = |&k: &usize| near(k - 1, k) && near(k, k + 1) && side(k - 1) == side(k) && side(k) == side(k + 1);
        let mut out: Vec<(Contact, f64)> = Vec::new();
        let mut last = None;
        for (k, own) in inner.filter(agree).filter_map(|k| Some((k, side(k)?))) {
            if last.is_none_or(|last| last + 1 != k) {
                out.push((Contact::default(), own));
            }
            last = Some(k);
            if let Some((contact, _)) = out.last_mut() {
                contact.windows += 1.0;
                contact.angle += (self.windows[k].3[0] - contact.angle) / contact.windows;
            }
        }
        out
    }

    fn named(&self, word: &str, before: Option<f64>) -> IdentifiedParameter {
        IdentifiedParameter {
            name: format!("{}.{word}", self.element),
            unit: if self.straight { "m" } else { "rad" }.into(),
            model_value: before,
            ..IdentifiedParameter::default()
        }
    }

    /// Width and offset: `δ = rest + b/2` on the one side and `rest − b/2` on the other.
    pub fn parameters(&self, before: [Option<f64>; 2], confidence: f64) -> Vec<IdentifiedParameter> {
        let pressed = self.pressed();
        let [upper, lower] = [1.0, -1.0].map(|side| -> Vec<Contact> {
            pressed.iter().filter(|(_, own)| *own == side).map(|(contact, _)| *contact).collect()
        });
        let windows = |side: &[Contact]| side.iter().map(|one| one.windows).sum::<f64>();
        let open = if windows(&upper).min(windows(&lower)) < FEWEST {
            Some("in these logs it rarely has contact on both sides".into())
        } else {
            let names = || quoted(self.untold.iter().map(String::as_str));
            (!self.untold.is_empty()).then(|| {
                format!("its contact side depends on {}, which these data do not identify separately", names())
            })
        };
        let width = self.named("backlash", before[0]);
        if let Some(remark) = open {
            return vec![IdentifiedParameter { standard_error: Some(f64::INFINITY), remark, ..width }];
        }
        let [upper, lower] = both([Meeting::of(&upper), Meeting::of(&lower)]);
        // Sensor steps act in each contact independently.
        let grain = self.grain * self.grain * (1.0 / upper.contacts + 1.0 / lower.contacts);
        let scatter = upper.variance + lower.variance;
        let error = if scatter < grain { grain } else { scatter }.sqrt();
        let parts = [&upper, &lower].map(|one| (1.0 / one.windows, one.freedom));
        let whole = parts.iter().map(|(part, _)| part).sum::<f64>();
        let freedom = whole * whole / parts.iter().map(|(part, freedom)| part * part / freedom).sum::<f64>();
        let quantile = student_quantile(if scatter < grain { f64::INFINITY } else { freedom }, confidence);
        let found = |one: IdentifiedParameter, value: f64, error: f64| {
            let half = quantile * error;
            IdentifiedParameter {
                value: Some(value),
                standard_error: (!error.is_nan()).then_some(error),
                interval: interval(value, half),
                remark: match half.is_finite() {
                    true => String::new(),
                    false => "no interval: it has one contact on each side, so the scatter between contacts is \
                              unknown"
                        .into(),
                },
                ..one
            }
        };
        vec![
            found(width, upper.angle - lower.angle, error),
            found(self.named("offset", before[1]), -(upper.angle + lower.angle) / 2.0, error / 2.0),
        ]
    }
}

/// Two sides, of which one may have a single contact: then the variance of its windows is that of the other.
fn both([upper, lower]: [Meeting; 2]) -> [Meeting; 2] {
    let like = |one: &Meeting, other: &Meeting| match one.variance.is_nan() {
        true => (other.variance * other.windows / one.windows, other.freedom),
        false => (one.variance, one.freedom),
    };
    let (of_upper, of_lower) = (like(&upper, &lower), like(&lower, &upper));
    let with = |one: Meeting, (variance, freedom)| Meeting { variance, freedom, ..one };
    [with(upper, of_upper), with(lower, of_lower)]
}
