//! From the text of a model file, or from a program, to a model: parse, resolve, describe.
//!
//! It runs nothing. Begin with [`Document`] (a file as read), [`Model`] (one variant of it) and [`Builder`].
//!
//! ```
//! use kardan_model::read;
//!
//! let text = "[model]\nname = \"axle\"\n[shaft.axle]\ninertia = \"2 kg cm^2\"\n";
//! let (document, diagnostics) = read(text);
//! assert!(diagnostics.is_empty(), "{diagnostics:?}");
//! let (model, _) = document.model(&[]);
//! assert_eq!(model.all_coordinates.len(), 1);
//! ```
#![deny(clippy::disallowed_methods)]

mod assignment;
mod builder;
mod composites;
mod document;
mod examples;
mod functions;
mod in_order;
mod json_schema;
mod keys;
mod manoeuvres;
mod manual;
mod mechanism;
mod parameters;
pub mod parse;
pub mod programs;
mod reading;
mod resolve;
mod state_space;
mod symbols;
mod table_reader;
pub mod tables;
mod tolerance;
mod units_as_names;
mod variants;
mod write;

pub use assignment::assign;
pub use builder::Builder;
pub use document::{
    BlockTable, Control, Document, FileBytes, Instance, KindTable, NamedVariant, Parameter, Setting, SignalTable,
    SuppressedChecks, Tolerance, VariantSettings, Variants,
};
pub use functions::Functions;
pub use json_schema::json_schema;
pub use manual::{manual, manual_of, manual_tables, study_pages};
pub use reading::{open, read, read_entries};
pub use resolve::{ControlSpec, Model};
pub use state_space::{DataDigits, StateSpace, read_state_space};
pub use symbols::{NamedTerms, SymbolValue, constants};
pub use table_reader::{Rounded, TableReader, occurrences};
pub use variants::no_such_fault;
pub use write::{NewValue, write_values};

/// A model that is part of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Builtin {
    /// Its name on the command line.
    pub name: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The model file.
    pub source: &'static str,
}

impl Builtin {
    /// Drawing of the mechanism: the lines that begin with `#|` in the comment at the head of its file; empty where there are none.
    ///
    /// ```
    /// let model = kardan_model::builtin("two-bodies").unwrap();
    /// assert!(model.sketch().lines().any(|line| line.contains("motor ===[ ]")));
    /// ```
    pub fn sketch(&self) -> String {
        let comment = self.source.lines().take_while(|line| line.starts_with('#'));
        let lines = comment.filter_map(|line| line.strip_prefix("#|"));
        lines.map(|line| line.trim_end().to_owned() + "\n").collect()
    }
}

/// A list of models by their names, which are those of their files, each with one sentence.
macro_rules! builtin_models {
    ($($name:literal: $summary:literal,)*) => {
        &[$(Builtin {
            name: $name,
            summary: $summary,
            source: include_str!(concat!("../../../models/", $name, ".toml")),
        }),*]
    };
}

/// The models that are part of the program; the files are in `models/`.
pub const BUILTIN: &[Builtin] = builtin_models! {
    "sia-steering":
        "Car steering with a harmonic drive in differential mode, noninteracting control (source 6.3, Table 6.4)",
    "sia-joint-angle":
        "the same with a bent joint: force feedback of the linear and the nonlinear law, and a wrong joint angle",
    "sia-steering-ecu":
        "the same on a real control unit: 1 kHz, delay, motor lag, torque limits, encoders, Coulomb friction",
    "steering-on-road":
        "The complete steering system: a car on a road, a driver, functions, force feedback, monitors, brake and lock",
    "afs-steering":
        "State of the art to compare: active front steering with planetary gear and worm, on the same car and road",
    "harmonic-drive": "The harmonic drive alone with its identified friction (source 6.1, Table 6.1)",
    "harmonic-drive-ecu":
        "the same with a flexible cup, angle and torque decoupled at 1 kHz with delay, lag, limits and encoders",
    "harmonic-drive-bench":
        "the same on a virtual test bench, its damping and friction to be identified (source 6.1.4)",
    "harmonic-drive-spring": "A harmonic drive with a rack behind a torsion bar (source 6.2, Table 6.3)",
    "harmonic-drive-spring-ecu": "the same at 1 kHz with delay, motor lag, limits and encoders",
    "robot-joint":
        "A robot's joint: motor, flexible harmonic drive, arm under gravity; controlled at 1 kHz on either side",
    "eps-column":
        "Electric power steering at the column, rack in kg and N: boost curve, and lane keeping with hands off",
    "hybrid-driveline": "Power split by a planetary gear, with road load: engine and car speed decoupled by two motors",
    "universal-joints":
        "Two universal joints in series: Cardan error of equal, unequal and misaligned joints (source, figures 6.9, 6.10)",
    "unicycle":
        "A wheel that rolls on a plane without slip, driven on a circle: nonholonomic constraints (source, (4.4))",
    "two-bodies": "Two equal bodies joined by a spring and a damper (source, appendix B)",
    "rack-and-pinion": "A measured rack-and-pinion mechanism: `kardan identify rack-and-pinion a3MR.csv a3NI.csv`",
    "two-motor-drive": "Two measured servo motors on one shaft: `kardan identify two-motor-drive idf_*.mat`",
    "rlc-ladder": "A lossy line as an electrical ladder of four sections, driven by a voltage step (source, Table 4.3)",
};

/// The built-in model of that name.
pub fn builtin(name: &str) -> Option<&'static Builtin> {
    BUILTIN.iter().find(|builtin| builtin.name == name)
}
