//! The search for locations of motors and sensors.

use schemars::JsonSchema;
use serde::Serialize;

/// Possible locations of motors and sensors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Placement {
    /// Smallest sets of motors, best first.
    pub inputs: Option<PlacementSearch>,
    /// Smallest sets of sensors, best first.
    pub outputs: Option<PlacementSearch>,
}

/// The result of one search.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PlacementSearch {
    /// `2 of the 5 places are needed: 3 of the 10 possible sets of 2 are enough (all were tried)`, or `bounded search …`.
    pub method: String,
    /// Whether every set was tried.
    pub exhaustive: bool,
    /// Bound on the gain of a better set if the search was not exhaustive: `(cost found − lower bound) / cost`.
    pub gap: f64,
    /// Sets tried.
    pub tried: usize,
    /// The candidates.
    pub candidates: Vec<Place>,
    /// The sets, best first.
    #[serde(skip)]
    pub sets: Vec<PlacedSet>,
    /// The meaning of `score`: `smallest eigenvalue of the Gramian over 1 s`.
    pub measure: String,
    /// Its unit.
    pub unit: String,
    /// Whether a larger score is better.
    pub larger_is_better: bool,
    /// Why there is none, in terms of shafts.
    pub infeasible_reason: Option<String>,
}

/// A possible location of a motor or a sensor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Place {
    /// The location.
    pub place: String,
    /// The cost given by the user.
    pub cost: f64,
}

/// A set of locations with which the model is controllable (observable).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlacedSet {
    /// The locations.
    pub places: Vec<String>,
    /// Sum of the user's costs.
    pub cost: f64,
    /// The physical measure.
    pub score: f64,
    /// Whether every set with a better score costs more, and every set as good costs no less.
    pub efficient: bool,
}
