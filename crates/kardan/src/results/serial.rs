//! How results are written in JSON where that is more, or less, than their fields: names as keys, figures that follow from others.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{
    Complex, DataMatrix, DataNumber, Entry, ExactMatrix, FreeKnown, Interval, MinorColumn, MotorStrain, ScenarioStrain,
    Span, SparseMatrix, TransferEntry, ZeroDynamics, ZeroMode,
};

impl From<Complex> for [f64; 2] {
    fn from(number: Complex) -> Self {
        [number.re, number.im]
    }
}

impl From<Span> for [f64; 2] {
    fn from(span: Span) -> Self {
        [span.from, span.until]
    }
}

impl From<Interval> for [f64; 2] {
    fn from(interval: Interval) -> Self {
        [interval.lower, interval.upper]
    }
}

impl From<MinorColumn> for [usize; 2] {
    fn from(column: MinorColumn) -> Self {
        [column.input, column.power]
    }
}

impl From<Entry> for (usize, usize, String) {
    fn from(entry: Entry) -> Self {
        (entry.row, entry.column, entry.value)
    }
}

/// Writes an object with these names as keys; a name that comes again is told apart (`K`, `K_2`), so that nothing is lost.
pub(crate) fn by_name<'a, S: Serializer, V: Serialize>(
    pairs: impl Iterator<Item = (&'a str, V)>,
    to: S,
) -> Result<S::Ok, S::Error> {
    let mut taken = BTreeSet::new();
    to.collect_map(pairs.map(|(name, value)| {
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let key = std::iter::once(name.to_string()).chain(numbered).find(|key| !taken.contains(key));
        let key = key.unwrap_or_default();
        taken.insert(key.clone());
        (key, value)
    }))
}

pub(super) fn gains<S: Serializer>(all: &[ExactMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), one)), to)
}

pub(super) fn matrices<S: Serializer>(all: &[DataMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), &one.values)), to)
}

pub(super) fn numbers<S: Serializer>(all: &[DataNumber], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), one.value)), to)
}

pub(super) fn pencil<S: Serializer>(all: &[SparseMatrix], to: S) -> Result<S::Ok, S::Error> {
    by_name(all.iter().map(|one| (one.name.as_str(), &one.entries)), to)
}

/// Precision of a block.
#[derive(Serialize, JsonSchema)]
pub(super) enum Precision {
    #[serde(rename = "f64")]
    Double,
    #[serde(rename = "f32")]
    Single,
}

pub(super) fn precision<S: Serializer>(single: &bool, to: S) -> Result<S::Ok, S::Error> {
    if *single { Precision::Single } else { Precision::Double }.serialize(to)
}

/// Whether nothing ended early.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Ending<'a> {
    /// Whether nothing ended early.
    complete: bool,
    /// Why it ended early, and what is missing: such parts are empty. `null` if nothing is.
    unfinished: Option<&'a str>,
}

impl<'a> Ending<'a> {
    pub(crate) fn of(unfinished: &'a Option<String>) -> Self {
        Self { complete: unfinished.is_none(), unfinished: unfinished.as_deref() }
    }
}

pub(super) fn ending<S: Serializer>(unfinished: &Option<String>, to: S) -> Result<S::Ok, S::Error> {
    Ending::of(unfinished).serialize(to)
}

/// How it is known that poles are at zero.
#[derive(Serialize, JsonSchema)]
pub(super) enum KnownWord {
    /// With the gains of the design, before they are rounded.
    #[serde(rename = "exactly, gains of the design")]
    Design,
    /// With gains that are the fractions which their doubles are.
    #[serde(rename = "exactly, gains as rounded")]
    Rounded,
    /// Numbers of the size of rounding count as zero.
    #[serde(rename = "to rounding")]
    Within,
}

impl From<FreeKnown> for KnownWord {
    fn from(known: FreeKnown) -> Self {
        match known {
            FreeKnown::Design => Self::Design,
            FreeKnown::Rounded => Self::Rounded,
            FreeKnown::Within(_) => Self::Within,
        }
    }
}

/// What was asked of a motor with limits.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "MotorStrain")]
pub(crate) struct StrainView<'a> {
    /// Name of the motor.
    name: &'a str,
    /// The controller that commands it, if one does.
    controller: Option<&'a str>,
    /// Its torque limit, N m.
    torque_limit_n_m: Option<f64>,
    /// Its rate limit, N m/s.
    rate_limit_n_m_per_s: Option<f64>,
    /// Largest torque asked of it, N m.
    asked_n_m: f64,
    /// How long it was at its torque limit, s.
    time_at_torque_limit_s: f64,
    /// How long it moved at its rate limit, s.
    time_at_rate_limit_s: f64,
    /// When it was at its torque limit first, s.
    first_at_torque_limit_s: Option<f64>,
}

impl<'a> StrainView<'a> {
    /// In a run of this length, s.
    pub(crate) fn of(strain: &'a MotorStrain, length: f64) -> Self {
        Self {
            name: &strain.motor,
            controller: strain.controller.as_deref(),
            torque_limit_n_m: strain.torque_limit,
            rate_limit_n_m_per_s: strain.rate_limit,
            asked_n_m: strain.asked,
            time_at_torque_limit_s: strain.seconds_at_limit(0.0, length),
            time_at_rate_limit_s: strain.seconds_at_rate_limit(0.0, length),
            first_at_torque_limit_s: strain.at_torque_limit.first().map(|span| span.from),
        }
    }
}

/// What the scenario of a file asks of a motor.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ScenarioStrain")]
pub(super) struct ScenarioView<'a> {
    /// Name of the variant.
    variant: &'a str,
    /// Length of its run, s.
    duration_s: f64,
    /// What it asked.
    motor: StrainView<'a>,
}

pub(super) fn strains<S: Serializer>(all: &[ScenarioStrain], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(all.iter().map(|one| ScenarioView {
        variant: &one.variant,
        duration_s: one.duration,
        motor: StrainView::of(&one.strain, one.duration),
    }))
}

/// What goes on while the outputs are held still.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "ZeroDynamics")]
pub(super) struct ZerosView<'a> {
    /// The exact polynomial; `1` if there is none.
    polynomial: &'a str,
    /// Its roots, both of a conjugate pair, 1/s.
    poles: Vec<Complex>,
    /// Whether all of them are in the open left half-plane, decided exactly; `null` if it was not asked.
    stable: Option<bool>,
    /// Its modes, by size; of a pair the upper one.
    modes: &'a [ZeroMode],
}

pub(super) fn zero_dynamics<S: Serializer>(found: &ZeroDynamics, to: S) -> Result<S::Ok, S::Error> {
    let both = |mode: &ZeroMode| {
        let mirrored = Complex { im: -mode.pole.im, ..mode.pole };
        std::iter::once(mode.pole).chain((mode.pole.im != 0.0).then_some(mirrored))
    };
    let asked = !(found.polynomial.is_empty() && found.modes.is_empty());
    let view = ZerosView {
        polynomial: &found.polynomial,
        poles: found.modes.iter().flat_map(both).collect(),
        stable: asked.then_some(found.stable),
        modes: &found.modes,
    };
    view.serialize(to)
}

/// One entry of an exact transfer matrix.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "TransferEntry")]
pub(super) struct TransferView<'a> {
    /// The output.
    output: &'a str,
    /// The reference.
    reference: &'a str,
    /// Whether it is exactly zero.
    zero: bool,
    /// Coefficients of 1, s, s², …
    numerator: &'a [String],
    /// Coefficients of 1, s, s², …
    denominator: &'a [String],
}

pub(super) fn transfer<S: Serializer>(all: &[TransferEntry], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(all.iter().map(|one| TransferView {
        output: &one.output,
        reference: &one.reference,
        zero: one.numerator.is_empty(),
        numerator: &one.numerator,
        denominator: &one.denominator,
    }))
}
