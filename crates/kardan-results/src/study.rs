//! The results of a study: the model, its runs, plots, analysis and designs.

use super::numbers::{NamedMatrix, Pole, Span};
use super::physical::{DisplayUnit, Physical};
use super::run::Run;
use super::{Analysis, Design, LawSummary, Mechanism, SignalNode};

/// An element of a model as text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ElementSummary {
    /// `harmonic_drive`
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Its values as one line.
    pub values: String,
}

/// What the model is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelSummary {
    /// Name.
    pub name: String,
    /// From the file.
    pub description: String,
    /// Every element.
    pub elements: Vec<ElementSummary>,
    /// Their connections.
    pub mechanism: Mechanism,
    /// Blocks with their inputs, in the order in which they compute.
    pub signals: Vec<SignalNode>,
    /// Shafts chosen as reduced coordinates.
    pub coordinates: Vec<String>,
    /// The reduced matrices at the initial position; none of more than 100 coordinates.
    pub matrices: Vec<NamedMatrix>,
    /// The designed laws.
    pub laws: Vec<LawSummary>,
    /// Poles of the linearised loop at the initial position, first variant, without Coulomb friction; none of more than 100 coordinates.
    pub closed_loop_poles: Vec<Pole>,
}

/// A plot of the model file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// File name stem and anchor: `rack-angle`.
    pub id: String,
    /// Title.
    pub title: String,
    /// A sentence beneath it.
    pub caption: String,
    /// Signals, drawn for every variant listed.
    pub signals: Vec<String>,
    /// References, drawn dashed.
    pub references: Vec<PlottedReference>,
    /// Legend texts of the signals, then of the references; by default their names.
    pub labels: Vec<String>,
    /// Names of variants; empty: all.
    pub variants: Vec<String>,
    /// The display unit of signals of one kind; `None`: the SI unit.
    pub display: Option<PlotUnit>,
    /// The drawn time span, s; without an end the whole run.
    pub window: Option<Span>,
    /// The signal on the horizontal axis; `None`: the time.
    pub over: Option<String>,
    /// Whether the horizontal axis is logarithmic.
    pub log_x: bool,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// Whether it shows amplitudes over the frequency: [`Study::spectra`].
    pub spectrum: bool,
}

/// Amplitudes of a signal over the frequency, with a window of Hann and without the mean: a sine shows its amplitude.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectrum {
    /// The plot that shows it, by its id.
    pub plot: String,
    /// The run.
    pub run: String,
    /// The signal.
    pub signal: String,
    /// Frequencies, Hz.
    pub frequency: Vec<f64>,
    /// As many amplitudes, in the unit of the signal, SI.
    pub amplitude: Vec<f64>,
    /// Why there is none.
    pub missing: Option<String>,
}

/// A reference of a plot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlottedReference {
    /// The signal.
    pub signal: String,
    /// Whether it is drawn with the opposite sign.
    pub opposite: bool,
}

impl From<&str> for PlottedReference {
    /// `-u2` is `u2` with the opposite sign.
    fn from(text: &str) -> Self {
        let signal = text.strip_prefix('-').unwrap_or(text);
        Self { signal: signal.into(), opposite: signal.len() < text.len() }
    }
}

/// A unit for all signals of one kind in a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotUnit {
    /// The kind of signals.
    pub physical: Physical,
    /// The unit.
    pub unit: DisplayUnit,
}

/// All results of a study.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Study {
    /// The model.
    pub model: ModelSummary,
    /// One run for each variant, in the order of the file.
    pub runs: Vec<Run>,
    /// Whether variants are labelled by their names: the file defines names, or they differ in controllers or faults too.
    pub named: bool,
    /// The plots to draw.
    pub plots: Vec<Plot>,
    /// The data of spectrum plots.
    pub spectra: Vec<Spectrum>,
    /// Warnings of the model file, in plain text.
    pub warnings: Vec<String>,
    /// Structure analysis of the model, where one was made.
    pub analysis: Option<Analysis>,
    /// The designs of the controllers, each as in the first variant that uses it.
    pub designs: Vec<Design>,
}
