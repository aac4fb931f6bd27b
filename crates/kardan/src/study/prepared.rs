//! Prepared studies: the plain data between preparation and the studies.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use crate::study::measure::computed_signals::Computed;
use crate::study::read::faults::NamedFault;
use crate::study::read::locations::no_such_name;
use crate::study::{AnalysisSpec, Figure, Requirement, SafetySpec, SweepSpec};
use kardan_expr::expr::Side;
use kardan_math::names::unknown_name;
use kardan_mechanics::reduce::{LinearModel, OperatingPoint, Reduced, linearise_at};
use kardan_model::{Model, VariantSettings};
use kardan_results::{Plot, SweepRow};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_simulate::{Scenario, Tolerance};
use kardan_synthesis::{Law, LinearTask, LoopPlant, Plant, VariedPlant};

/// A study that is ready to run, as far as the file has no errors.
#[derive(Debug, Clone, Default)]
pub struct Prepared {
    /// Name of the model.
    pub name: String,
    /// One-sentence description.
    pub description: String,
    /// Whether the file names its variants; messages then use these names.
    pub named: bool,
    /// One entry for each run.
    pub variants: Vec<Arc<PreparedVariant>>,
    /// Bounds on signals.
    pub requirements: Vec<Requirement>,
    /// Numbers computed from each run.
    pub figures: Vec<Figure>,
    /// Plots of the report.
    pub plots: Vec<Plot>,
    /// The fault cases of `kardan safety`; none in a file without named faults.
    pub safety: Option<SafetySpec>,
    /// The settings of `kardan sweep`.
    pub sweep: Option<SweepSpec>,
    /// Accuracy of the runs.
    pub tolerance: Tolerance,
}

impl Prepared {
    /// The runs, in order.
    pub fn all(&self) -> impl Iterator<Item = &PreparedVariant> {
        self.variants.iter().map(|variant| &**variant)
    }

    /// Everything that is measured in a run: its requirements, and the measures of its figures.
    pub(in crate::study) fn measured(&self) -> impl Iterator<Item = &Requirement> {
        self.requirements.iter().chain(self.figures.iter().filter_map(Figure::measure))
    }

    /// The variant of that name; without a name the first.
    pub(in crate::study) fn variant(&self, name: Option<&str>) -> Result<&PreparedVariant, Vec<Diagnostic>> {
        let Some(name) = name else {
            let none = || vec![Diagnostic::error("variant::none", "the model has no variant to analyse")];
            return self.all().next().ok_or_else(none);
        };
        self.all().find(|variant| variant.name == name).ok_or_else(|| {
            let help = unknown_name(name, self.variants.iter().map(|variant| variant.name.as_str()));
            let message = format!("there is no variant `{}`", shortened(name));
            vec![Diagnostic::error("variant::unknown", message).help(help)]
        })
    }
}

/// Steady state of the blocks after some samples with the plant at rest.
#[derive(Debug, Clone)]
pub(in crate::study) struct Settled {
    /// Their linearisation there.
    pub tasks: Vec<LinearTask>,
    /// The values of signals and blocks there.
    pub outputs: BTreeMap<String, f64>,
    /// Whether some blocks are nonlinear or switch, so that they behave differently elsewhere.
    pub nonlinear: bool,
    /// Blocks with zero gain there, as they are at a limit or in a dead zone.
    pub flat: Vec<String>,
}

/// One run, ready to start.
#[derive(Debug, Clone)]
pub struct PreparedVariant {
    /// Its name: `beta-10deg`, or the model's name if there are no variants.
    pub name: String,
    /// The model with its parameter values.
    pub model: Model,
    /// In explicit form.
    pub reduced: Reduced,
    /// The models that the laws are designed on, in the order of `model.controls`.
    pub design_models: Vec<Plant>,
    /// The laws as they were designed, in the same order.
    pub designed: Vec<Arc<dyn Law>>,
    /// The laws as they run: those with a sample time at that sample time.
    pub implemented: Vec<Arc<dyn Law>>,
    /// The scenario.
    pub scenario: Scenario,
    /// Its possible faults, by name.
    pub faults: Vec<NamedFault>,
    /// What makes this variant: values of parameters, controllers, and the faults that always occur in it.
    pub(in crate::study) own: VariantSettings,
    /// Signals computed from those of its run.
    pub computed: Computed,
    /// The options of the analysis.
    pub analysis: AnalysisSpec,
    /// The operating point of its laws, with its own parameters.
    pub point: OperatingPoint,
    /// Errors of motions without inertia; only an analysis may continue with them, and then no law is designed.
    pub(in crate::study) massless: Vec<Diagnostic>,
    /// The model whose multiplier constraints an analysis linearises.
    pub(in crate::study) unfrozen: Option<Box<Reduced>>,
    /// The same with its multiplier constraints frozen at the operating point of its laws, if it has both.
    pub(in crate::study) looped: Option<Box<PreparedVariant>>,
    /// Notes on the start of its run.
    pub(in crate::study) start_notes: Vec<String>,
    /// Results of the sweep that it is a row of.
    pub(in crate::study) swept: Option<Box<SweepRow>>,
    /// The steady state of its blocks at the start of its run, once requested.
    pub(in crate::study) settled: OnceLock<Settled>,
}

impl PreparedVariant {
    /// Its scenario with these faults too.
    ///
    /// # Errors
    /// A fault that does not exist, or a second one of a part at the same time.
    pub(in crate::study) fn failing(&self, names: &[String]) -> Result<Scenario, Diagnostic> {
        let mut scenario = self.scenario.clone();
        for (number, name) in names.iter().enumerate() {
            if names[..number].contains(name) {
                let message = format!("the fault `{}` is named twice", shortened(name));
                return Err(Diagnostic::error("fault::overlap", message).help("name it once: its table gives its time"));
            }
            let Some(fault) = self.faults.iter().find(|fault| fault.name == *name) else {
                let names = self.faults.iter().map(|fault| fault.name.as_str());
                return Err(no_such_name(("fault::unknown", "fault"), name, names, "the file has no `[fault.NAME]`"));
            };
            scenario.faults = scenario.faults.with(&fault.faults).map_err(|part| {
                let message = format!("with the fault `{name}` `{part}` would fail in two ways at once");
                Diagnostic::error("fault::overlap", message).help("a part has one fault at a time")
            })?;
        }
        Ok(scenario)
    }

    /// The same with another model of its loop, at an operating point of that model.
    pub(in crate::study) fn with_model(&self, reduced: Reduced, point: OperatingPoint) -> Self {
        let position = point.position.clone();
        let speed = vec![0.0; position.len()];
        Self {
            reduced,
            scenario: Scenario { position, speed, ..self.scenario.clone() },
            analysis: AnalysisSpec { at: Vec::new(), ..self.analysis.clone() },
            point,
            massless: Vec::new(),
            looped: None,
            swept: None,
            settled: OnceLock::new(),
            ..self.clone()
        }
    }

    /// The model for small motions of the loop.
    pub(in crate::study) fn in_loop(&self) -> &Self {
        self.looped.as_deref().unwrap_or(self)
    }

    /// The same with its torques, laws and blocks linearised on a side of their kinks.
    pub(in crate::study) fn on_side(&self, side: &Side) -> Self {
        let on = |law: &Arc<dyn Law>| law.on_side(side).unwrap_or_else(|| Arc::clone(law));
        Self {
            design_models: self.design_models.iter().map(|plant| plant.on_side(side)).collect(),
            designed: self.designed.iter().map(on).collect(),
            implemented: self.implemented.iter().map(on).collect(),
            point: OperatingPoint { side: side.clone(), ..self.point.clone() },
            looped: None,
            settled: OnceLock::new(),
            ..self.clone()
        }
    }

    /// A position with relaxed springs, on the analysed side of the kinks of the variant.
    pub(in crate::study) fn unloaded_at(&self, position: &[f64]) -> OperatingPoint {
        OperatingPoint { side: self.point.side.clone(), ..OperatingPoint::unloaded(position) }
    }

    /// The linear model at the operating point.
    pub(in crate::study) fn linear_model(&self) -> LinearModel {
        linearise_at(&self.reduced, &self.point)
    }

    /// The model of the loop of a controller with all elements that laws use: that of its design, if the design leaves nothing out.
    pub(in crate::study) fn whole_model(&self, number: usize) -> Cow<'_, Plant> {
        let design = &self.design_models[number];
        match self.leaves_out(number) {
            false => Cow::Borrowed(design),
            true => Cow::Owned(Plant::at(self.reduced.clone(), self.point.clone())),
        }
    }

    /// Whether the design of a controller leaves elements out.
    pub(in crate::study) fn leaves_out(&self, number: usize) -> bool {
        self.model.controls[number].values.names("excluded_elements").is_some_and(|names| !names.is_empty())
    }

    /// The linear plant of its loop at the operating point, with its motors and sensors.
    pub(in crate::study) fn loop_plant(&self) -> LoopPlant {
        LoopPlant::new(&self.linear_model(), &self.reduced.equations.lags())
            .with_sensors(&self.reduced)
            .with_block_torques(&self.reduced)
    }

    /// The same with coefficients that vary, of a linear model.
    pub(in crate::study) fn varied_plant(&self, model: &LinearModel) -> VariedPlant {
        VariedPlant::new(&self.reduced, model, &self.reduced.equations.lags())
    }
}
