//! The element `universal_joint`: one cross-type joint or two in series.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use kardan_rt::functions::{atan2, cos, sin_cos};

use super::shared::contact::{RESTITUTION, Side, backlash_of, backlash_terms, check_backlash};
use super::shared::shafts::{ENDS, check_ends};
use super::shared::straight::check_moves;
use super::{Element, KeyError};
use kardan_expr::expr::{Expr, Function, Graph, Surd};
use kardan_math::num::{Rational, rational_from_f64, rational_to_f64};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Curve, CurveFormulas, Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A cross-type (Cardan, Hooke) joint, or two of them in series, \[diss. (6.99)-(6.104)\].
    element UniversalJoint("universal_joint") {
        required {
            shaft_1: Shaft, "The shaft whose speed is C/(cos^2 q2 + C^2 sin^2 q2) times the other's.";
            shaft_2: Shaft, "The other shaft.";
        }
        optional {
            angle: Quantity(Dimension::ANGLE, Sign::Any), "Bend angle of a single joint, below 90 deg.";
            angle_1: Quantity(Dimension::ANGLE, Sign::Any), "Bend angle of the joint at shaft_1 of a double joint.";
            angle_2: Quantity(Dimension::ANGLE, Sign::Any),
                "Bend angle of the joint at shaft_2 of a double joint; equal angles give a uniform transmission.";
            phase: Quantity(Dimension::ANGLE, Sign::Any) = "0 deg", "Mounting angle of shaft_2.";
            backlash: Quantity(Dimension::ANGLE, Sign::NonNegative),
                "Backlash of the joint, as an angle of shaft_1: within half of it either way no torque is transmitted. Left out: none.";
            restitution: Number(Sign::NonNegative) as RESTITUTION;
        }
    }
}

pub(super) const UNIVERSAL_JOINT: Element = Element {
    keyword: UniversalJoint::KEYWORD,
    summary: "A universal (Cardan) joint: tan q1 = C tan(q2 + phase) with C = cos(angle); a double joint has \
              C = cos(angle_1)/cos(angle_2).",
    sketch: r"
                   angle
    shaft_1 ======+ .
                    \
                     \ shaft_2",
    signs: "Both shafts rotate in the same direction and have equal angles at every quarter turn (for phase 0); `<name>.tau` is the constraint \
            torque on shaft_1.",
    symbol: Symbol::UniversalJoint,
    fields: UniversalJoint::FIELDS,
    example: "\
[universal_joint.cardan]
shaft_1 = \"cj\"
shaft_2 = \"cs\"
angle = \"20 deg\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = [check_ends(values, ENDS), check_moves(values, &ENDS), check_backlash(values)].concat();
    let single = values.has("angle");
    let double = (values.has("angle_1"), values.has("angle_2"));
    if single && double != (false, false) {
        out.push(KeyError::new(
            "angle",
            "both the bend angle of a single joint and of a double joint are given",
            "keep `angle` for a single joint, or `angle_1` and `angle_2` for a double joint",
        ));
    } else if !single && double != (true, true) {
        out.push(KeyError::new(
            "angle",
            "the bend angle is missing",
            "give `angle` for a single joint, or both `angle_1` and `angle_2` for a double joint",
        ));
    }
    for key in ANGLES {
        if let Some(angle) = values.number(key)
            && angle.abs() > FRAC_PI_2 - 1e-3
        {
            out.push(KeyError::new(
                key,
                format!("a universal joint cannot turn at a bend angle of {:.6} deg", angle.to_degrees()),
                "the bend angle must lie below 90 deg either way",
            ));
        }
    }
    out
}

/// The cosine of an angle, if it is rational.
fn exact_cosine(angle: f64) -> Option<f64> {
    Some(rational_to_f64(&Surd::recognise_double(angle)?.cosine()?.to_rational()?))
}

fn terms(name: &str, values: &Values) -> Vec<Term> {
    // The cosine of 60° is a half, not the double next to it.
    let cosine = |key: &str| values.number(key).map(|angle| exact_cosine(angle).unwrap_or_else(|| cos(angle)));
    let ratio = match (cosine("angle"), cosine("angle_1"), cosine("angle_2")) {
        (Some(c), _, _) => c,
        (None, Some(c1), Some(c2)) => c1 / c2,
        _ => 1.0,
    };
    let phase = values.number_or_default("phase");
    let joint = UniversalJointCurve { ratio, phase_in: phase, phase_out: 0.0 };
    let angles: Vec<(&'static str, Exact)> =
        ANGLES.into_iter().filter_map(|key| Some((key, values.exact(key)?.clone()))).collect();
    let named = angles.iter().any(|(_, angle)| angle.in_names().is_some());
    let curve: Arc<dyn Curve> = match named {
        true => Arc::new(NamedJoint { joint, angles, phase: values.exact_or_default("phase"), inverted: false }),
        false => Arc::new(joint),
    };
    let [first, driving] = ["shaft_1", "shaft_2"].map(|key| values.word_or_default(key).to_string());
    let Some(backlash) = backlash_of(values) else { return vec![Term::Transmission { driven: first, driving, curve }] };
    let flanks = |second: &str, offset: Exact| {
        backlash_terms(&Direction::difference(&first, Some(second)), &offset, backlash, &Side::of(values))
    };
    if let Some(shift) = curve.shifted_identity() {
        return flanks(&driving, Exact::new(rational_from_f64(shift).unwrap_or_default(), 0));
    }
    // The angle that shaft_1 would have without backlash follows from shaft_2; the backlash is between these two.
    let angle = Term::Coordinate { name: name.into(), domain: Domain::Rotation };
    let behind = [angle, Term::Transmission { driven: name.into(), driving, curve }];
    behind.into_iter().chain(flanks(name, Exact::zero())).collect()
}

const ANGLES: [&str; 3] = ["angle", "angle_1", "angle_2"];

/// A joint with named angles: for all their values, also those at which it is a plain shaft.
#[derive(Debug, Clone)]
struct NamedJoint {
    joint: UniversalJointCurve,
    /// The explicit ones, by key.
    angles: Vec<(&'static str, Exact)>,
    phase: Exact,
    /// From shaft_1 to shaft_2.
    inverted: bool,
}

impl Curve for NamedJoint {
    fn value(&self, x: f64) -> f64 {
        self.joint.value(x)
    }

    fn derivatives(&self, x: f64) -> (f64, f64) {
        self.joint.derivatives(x)
    }

    fn expressions(&self, graph: &mut Graph, x: Expr) -> [Expr; 3] {
        self.joint.expressions(graph, x)
    }

    fn inverse(&self) -> Option<Arc<dyn Curve>> {
        let joint = UniversalJointCurve {
            ratio: 1.0 / self.joint.ratio,
            phase_in: self.joint.phase_out,
            phase_out: self.joint.phase_in,
        };
        Some(Arc::new(Self { joint, inverted: !self.inverted, ..self.clone() }))
    }

    fn repeats_each_half_turn(&self) -> bool {
        true
    }

    /// Of both directions with the same C and R, which is that of (6.119) from shaft_1 to shaft_2.
    fn formulas(&self) -> Option<CurveFormulas> {
        let cosine = match self.angles.as_slice() {
            [(key, _)] => format!("cos({key})"),
            _ => "cos(angle_1)/cos(angle_2)".to_string(),
        };
        let has_phase = !self.phase.is_zero() || self.phase.in_names().is_some();
        let before = if has_phase && !self.inverted { "(x + phase)" } else { "x" };
        let after = if has_phase && self.inverted { " - phase" } else { "" };
        let [first, second, sign] = if self.inverted { ["sin", "cos", ""] } else { ["cos", "sin", "-"] };
        let lead = if self.inverted { "1 - C" } else { "C - 1" };
        let below = if self.inverted {
            format!("sin({before})^2 + C*cos({before})^2")
        } else {
            format!("cos({before})^2 + C*sin({before})^2")
        };
        let mut values = self.angles.clone();
        values.push(("phase", self.phase.clone()));
        Some(CurveFormulas {
            values,
            letters: vec![("C", cosine), ("R", format!("{first}({before})^2 + C^2*{second}({before})^2"))],
            curve: [
                format!("{before} + atan2(({lead})*sin(2*{before})/2, {below}){after}"),
                "C/R".to_string(),
                format!("{sign}C*(C^2 - 1)*sin(2*{before})/R^2"),
            ],
        })
    }
}

/// γ with `tan(γ(x) + phase_out) = C·tan(x + phase_in)`, continuous over any number of turns.
///
/// With θ = x + phase_in, `γ + phase_out − θ = atan2((C−1) sin θ cos θ, cos²θ + C sin²θ)`: the second argument is never
/// negative, so the branch never jumps.
/// `γ′ = C/(cos²θ + C² sin²θ)` \[diss. (6.106)\], `γ″ = −C (C²−1) sin 2θ/(cos²θ + C² sin²θ)²`.
///
/// ```
/// use kardan_elements::element::UniversalJointCurve;
/// use kardan_mechanics::equations::Curve;
/// let joint = UniversalJointCurve { ratio: 0.5, phase_in: 0.0, phase_out: 0.0 };
/// let turns = 1000.0 * std::f64::consts::TAU;
/// assert!((joint.value(turns + 0.7) - turns - (0.5 * 0.7_f64.tan()).atan()).abs() < 1e-11);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniversalJointCurve {
    /// C, above zero.
    pub ratio: f64,
    /// Added to the argument, rad.
    pub phase_in: f64,
    /// Taken from the value, rad.
    pub phase_out: f64,
}

impl Curve for UniversalJointCurve {
    fn value(&self, x: f64) -> f64 {
        let theta = x + self.phase_in;
        let (sin, cos) = sin_cos(theta);
        let c = self.ratio;
        theta + atan2((c - 1.0) * sin * cos, cos * cos + c * sin * sin) - self.phase_out
    }

    fn derivatives(&self, x: f64) -> (f64, f64) {
        let (sin, cos) = sin_cos(x + self.phase_in);
        let c = self.ratio;
        let r = cos * cos + c * c * sin * sin;
        (c / r, -c * (c * c - 1.0) * 2.0 * sin * cos / (r * r))
    }

    fn expressions(&self, graph: &mut Graph, x: Expr) -> [Expr; 3] {
        // A NaN ratio or phase is not a joint; the check of the file rejects it.
        let exact = |value: f64| rational_from_f64(value).unwrap_or(Rational::ZERO);
        let (c, one) = (exact(self.ratio), Rational::ONE);
        let theta = graph.sum(exact(self.phase_in), &[(x, one.clone())]);
        let (sin, cos) = (graph.apply(Function::Sin, theta), graph.apply(Function::Cos, theta));
        let both = graph.multiply(sin, cos);
        // cos² + a sin² as one square and a number, without cancellation.
        let mut weighted = |factor: Rational| match factor < one {
            true => {
                let square = graph.power(cos, 2);
                graph.sum(factor.clone(), &[(square, &one - &factor)])
            }
            false => {
                let square = graph.power(sin, 2);
                graph.sum(one.clone(), &[(square, factor - &one)])
            }
        };
        let (below, r) = (weighted(c.clone()), weighted(&c * &c));
        let quotient = graph.divide(both, below);
        let quotient = graph.scale(&c - &one, quotient);
        let lead = graph.apply(Function::Atan, quotient);
        let value = graph.sum(-exact(self.phase_out), &[(theta, one.clone()), (lead, one.clone())]);
        let slope = graph.power(r, -1);
        let slope = graph.scale(c.clone(), slope);
        let curvature = graph.product(&[(both, 1), (r, -2)]);
        let curvature = graph.scale(Rational::from(-2) * &c * (&c * &c - one), curvature);
        [value, slope, curvature]
    }

    fn inverse(&self) -> Option<Arc<dyn Curve>> {
        Some(Arc::new(Self { ratio: 1.0 / self.ratio, phase_in: self.phase_out, phase_out: self.phase_in }))
    }

    fn shifted_identity(&self) -> Option<f64> {
        (self.ratio == 1.0).then_some(self.phase_in - self.phase_out)
    }

    fn repeats_each_half_turn(&self) -> bool {
        true
    }
}

#[cfg(test)]
#[path = "../../tests/unit/element/universal_joint.rs"]
mod tests;
