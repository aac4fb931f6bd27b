//! The mechanism of a model as a graph: its parts and their connections.

use schemars::JsonSchema;
use serde::Serialize;

/// How a kind of element is drawn; each kind of element names one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Symbol {
    /// A rotating body.
    #[default]
    Shaft,
    /// A translating body.
    Mass,
    /// Two wheels.
    Gear,
    /// A strain-wave gear with its three shafts.
    StrainWaveGear,
    /// A planetary gear with its three shafts.
    PlanetaryGear,
    /// Spring, dashpot and friction in parallel.
    SpringDamper,
    /// Two forks and a cross.
    UniversalJoint,
    /// A constraint between shafts; with one shaft alone it fixes it.
    Relation,
    /// A commanded torque.
    Motor,
    /// An external torque.
    Torque,
    /// A sensor.
    Sensor,
    /// A coil.
    Inductor,
    /// A resistor.
    Resistor,
    /// A capacitor.
    Capacitor,
    /// Two coupled windings.
    Transformer,
    /// A source of voltage.
    Source,
    /// A source of current.
    CurrentSource,
    /// An electric machine between a circuit and a shaft.
    Machine,
    /// A unilateral or switched constraint: a clutch, a brake, a freewheel, a lock.
    Clutch,
    /// End stops.
    Stop,
    /// A car on a road.
    Vehicle,
}

impl Symbol {
    /// Whether it is a body that others act on.
    pub fn is_body(self) -> bool {
        matches!(self, Self::Shaft | Self::Mass)
    }
}

/// The other end of a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JoinKind {
    /// A shaft.
    #[default]
    Shaft,
    /// A node of a circuit.
    Node,
    /// Another element, whose torque is measured.
    Element,
    /// The fixed housing.
    Housing,
    /// The node at 0 V.
    Ground,
}

/// An end of an element.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Terminal {
    /// The key of the model file that names it: `wave_generator`.
    pub key: String,
    /// The kind of its other end.
    pub kind: JoinKind,
    /// The shaft, the node or the element; empty for the housing.
    pub name: String,
    /// Its coefficient, where the element gives each shaft one.
    pub coefficient: Option<f64>,
}

/// An element of a model, with its ends.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MechanismPart {
    /// `harmonic_drive`
    pub kind: String,
    /// Its name.
    pub name: String,
    /// How it is drawn.
    pub symbol: Symbol,
    /// Its values as one line.
    pub values: String,
    /// Its effects: `inertia`, `stiffness`, `damping`, `friction`, `backlash`; of a sensor the measured quantity.
    pub laws: Vec<String>,
    /// Its ratio, if it has one.
    pub ratio: Option<f64>,
    /// Its ends; a shaft has none.
    pub terminals: Vec<Terminal>,
}

/// The parts of a model, sorted by kind and name: the order of the file changes nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Mechanism {
    /// Shafts and all other elements.
    pub parts: Vec<MechanismPart>,
}
