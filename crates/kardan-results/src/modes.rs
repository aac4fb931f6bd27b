//! Modes with their shapes and the shares of elements in their energy.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{Complex, Pole};

/// One mode (a conjugate pair counts once).
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Mode {
    /// λ, 1/s; the one with imaginary part ≥ 0.
    #[serde(rename = "eigenvalue_per_s")]
    pub eigenvalue: Pole,
    /// |λ|, rad/s.
    #[serde(flatten, serialize_with = "frequencies")]
    #[schemars(with = "Frequencies")]
    pub natural_frequency: f64,
    /// −Re λ / |λ|; 1 for λ = 0.
    pub damping_ratio: f64,
    /// Its mode shape.
    pub shape: Vec<ShapePart>,
    /// Shares of the energy stored during the motion, kinetic and potential, by element.
    pub stored: Vec<StoredShare>,
    /// Shares of the loss by element.
    pub dissipated: Vec<ElementShare>,
    /// The exact factor of the characteristic polynomial with this root: `s + 2`.
    pub factor: String,
    /// Whether it is controllable (Hautus).
    #[serde(skip)]
    pub controllable: bool,
    /// Whether it is observable (Hautus).
    #[serde(skip)]
    pub observable: bool,
}

/// The frequency of a mode.
#[derive(Serialize, JsonSchema)]
struct Frequencies {
    /// |λ|/(2π), Hz.
    #[serde(rename = "frequency_Hz")]
    frequency: f64,
    /// |λ|, rad/s.
    natural_frequency_rad_per_s: f64,
}

fn frequencies<S: Serializer>(natural: &f64, to: S) -> Result<S::Ok, S::Error> {
    Frequencies { frequency: natural / TAU, natural_frequency_rad_per_s: *natural }.serialize(to)
}

/// A component of a mode shape.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ShapePart {
    /// The shaft or state.
    pub name: String,
    /// Its motion relative to the largest one.
    pub value: Complex,
}

impl ShapePart {
    /// The same without its imaginary part.
    #[must_use]
    pub fn real(self) -> Self {
        Self { value: Complex { im: 0.0, ..self.value }, ..self }
    }
}

/// The share of an element in the energy stored during a motion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct StoredShare {
    /// The element.
    pub element: String,
    /// The form of the energy.
    pub energy: EnergyKind,
    /// The share.
    pub share: f64,
}

/// The share of an element in a total: stored energy or loss.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ElementShare {
    /// The element.
    pub element: String,
    /// The share.
    pub share: f64,
}

/// A component of a failing mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct NamedShare {
    /// The shaft, state or element.
    pub name: String,
    /// The share.
    pub share: f64,
}

/// The form of stored energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum EnergyKind {
    /// In an inertia.
    #[default]
    Kinetic,
    /// In a spring.
    Potential,
}
