//! Play between two angles that are measured: its width, where the sense of what the teeth carry is known.

use crate::assemble::{Along, Equations};
use crate::diagnostics::quoted;
use crate::equations::{Hold, InputKind};
use crate::identify::{Fit, student_quantile};
use crate::model::Document;
use crate::num::{Rational, dot};
use crate::results::{IdentifiedParameter, Interval};

/// Part of the largest torque from which teeth are pressed together for certain.
const PRESSED: f64 = 0.05;
/// Standard errors from which the sense of a torque is certain.
const CERTAIN: f64 = 3.0;
/// Fewest windows on either side.
const FEWEST: usize = 5;

/// What the teeth of a play did, window by window.
#[derive(Debug, Clone, Default)]
pub(super) struct Play {
    pub element: String,
    /// Whether it is one between masses.
    pub straight: bool,
    /// Angle of the first body against the others (rad), and the torque that the teeth put on it (N m), by log, section and time; until
    /// [`Self::fitted`] without what the columns add.
    pub windows: Vec<(usize, usize, f64, [f64; 2])>,
    /// What each column adds to the torque by its value, window by window.
    pub parts: Vec<f64>,
    /// Errors of the torque from those of the values, window by window, N m.
    pub errors: Vec<f64>,
    /// What enters the torque and is not known.
    pub untold: Vec<String>,
}

/// Elements with a play, and its direction over the shafts.
pub(super) fn plays(document: &Document, equations: &Equations) -> Vec<(String, Vec<(usize, Rational)>)> {
    let has_play = |element: &str| {
        let of = document.elements.iter().find(|instance| instance.name == element);
        of.is_some_and(|instance| matches!(instance.kind.keyword, "gear" | "spring_damper"))
    };
    let upper = equations.holds.iter().filter(|hold| {
        let contact = matches!(hold.value, Hold::Stop { .. } | Hold::Cushion { .. });
        contact && hold.value.is_upper() && has_play(&hold.element)
    });
    // The upper stop of the torque on the first body is the direction of the first body itself.
    upper.map(|hold| (hold.element.clone(), hold.row.clone())).collect()
}

/// The torques of plays as inputs that nobody measured: they are eliminated.
pub(super) fn open_plays(document: &Document, equations: &mut Equations) -> Vec<String> {
    let found = plays(document, equations);
    for (element, row) in &found {
        equations.inputs.push(Along { element: element.clone(), row: row.clone(), value: InputKind::Disturbance });
    }
    found.into_iter().map(|(element, _)| element).collect()
}

impl Play {
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
            // No number where a value is at its bound: then the torque alone tells.
            let variance: f64 = (0..columns).filter(|&i| row[i] != 0.0).map(|i| row[i] * covariance(i)).sum();
            out.errors.push(variance.max(0.0).sqrt());
        }
        out
    }

    /// Angles with the side on which the teeth are pressed: windows in a row that agree.
    fn pressed(&self) -> Vec<(f64, f64)> {
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
        inner.filter(agree).filter_map(|k| Some((self.windows[k].3[0], side(k)?))).collect()
    }

    /// Width and offset: `δ = rest + b/2` on the one side and `rest − b/2` on the other.
    pub fn parameters(&self, before: [Option<f64>; 2], confidence: f64) -> Vec<IdentifiedParameter> {
        let pressed = self.pressed();
        let side =
            |sign: f64| -> Vec<f64> { pressed.iter().filter(|(_, own)| *own == sign).map(|(x, _)| *x).collect() };
        let [upper, lower] = [1.0, -1.0].map(side);
        let unit = if self.straight { "m" } else { "rad" };
        let named = |word: &str, before: Option<f64>| IdentifiedParameter {
            name: format!("{}.{word}", self.element),
            unit: unit.into(),
            before,
            ..IdentifiedParameter::default()
        };
        if upper.len().min(lower.len()) < FEWEST {
            let remark = "in these logs its teeth are hardly ever pressed on both sides".to_string();
            return vec![IdentifiedParameter {
                standard_error: Some(f64::INFINITY),
                remark,
                ..named("backlash", before[0])
            }];
        }
        if !self.untold.is_empty() {
            let names = quoted(self.untold.iter().map(String::as_str));
            let remark = format!("which way its teeth are pressed needs {names}, which these data do not tell alone");
            return vec![IdentifiedParameter {
                standard_error: Some(f64::INFINITY),
                remark,
                ..named("backlash", before[0])
            }];
        }
        let mean = |list: &[f64]| list.iter().sum::<f64>() / list.len() as f64;
        let squares = |list: &[f64]| {
            let middle = mean(list);
            list.iter().map(|x| (x - middle) * (x - middle)).sum::<f64>()
        };
        let (n, m) = (upper.len() as f64, lower.len() as f64);
        let variance = (squares(&upper) + squares(&lower)) / (n + m - 2.0);
        let error = (variance * (1.0 / n + 1.0 / m)).sqrt();
        let quantile = student_quantile(n + m - 2.0, confidence);
        let found = |one: IdentifiedParameter, value: f64, error: f64| IdentifiedParameter {
            value: Some(value),
            standard_error: Some(error),
            interval: Some(Interval { lower: value - quantile * error, upper: value + quantile * error }),
            ..one
        };
        vec![
            found(named("backlash", before[0]), mean(&upper) - mean(&lower), error),
            found(named("offset", before[1]), -(mean(&upper) + mean(&lower)) / 2.0, error / 2.0),
        ]
    }
}
