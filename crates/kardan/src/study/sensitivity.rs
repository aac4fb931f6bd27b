//! How far away the next change of structure is, within the tolerances of a model file.

use std::collections::BTreeSet;

use super::{PreparedVariant, Progress};
use crate::analysis::{ConstrainedSystem, Family, OutputSignal, Parameter, SamplingPlan, Side, nearest_loss, sample};
use crate::assemble::assemble;
use crate::model::{Document, Setting};
use crate::num::{Rational, rational_to_f64};
use crate::reduce::reduce;
use crate::results::{BoxVerdict, Loss, LossSearch, Mode, Sensitivity, Structure};
use crate::units::Exact;

/// Samples if the file names no number.
const SAMPLES: usize = 1000;

/// The seed of all samples.
const SEED: u64 = 1;

/// What is analysed, and where.
pub(super) struct Subject<'a> {
    pub document: &'a Document,
    /// Parameter values of the variant.
    pub settings: &'a [Setting],
    pub variant: &'a PreparedVariant,
    /// The reduced position, rad.
    pub position: &'a [f64],
    pub stuck: &'a BTreeSet<String>,
    pub inputs: &'a [String],
    pub outputs: &'a [OutputSignal],
    pub structure: &'a Structure,
    pub modes: &'a [Mode],
    /// Shafts of the reduced coordinates.
    pub coordinates: &'a [usize],
}

/// Nearest losses, verdicts over the box of tolerances, and sampling; `None` if no parameter has a tolerance.
pub(super) fn sensitivity(
    subject: &Subject<'_>,
    notes: &mut Vec<String>,
    progress: &dyn Progress,
) -> Option<Sensitivity> {
    let tolerances = &subject.variant.model.tolerances;
    if tolerances.is_empty() {
        return None;
    }
    let parameters: Vec<Parameter> = tolerances
        .iter()
        .map(|t| Parameter {
            name: t.parameter.clone(),
            nominal: t.nominal.to_rational(),
            lower: t.lower.to_rational(),
            upper: t.upper.to_rational(),
            unit: t.dimension.si(),
            confidence: t.confidence.as_ref().map(Exact::to_f64),
        })
        .collect();
    let at = |values: &[Rational]| subject.system(&parameters, values);
    let mut idle: BTreeSet<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
    let mut search = |side: Side, signals: usize| {
        let family = Family::new(&parameters, &at, side, subject.outputs)?;
        (0..parameters.len()).filter(|&i| family.depends_on(i)).for_each(|i| {
            idle.remove(parameters[i].name.as_str());
        });
        (signals > 0).then(|| subject.search(&family, side, progress))
    };
    let controllability = search(Side::Inputs, subject.inputs.len());
    let observability = search(Side::Outputs, subject.outputs.len());
    if !idle.is_empty() {
        let idle: Vec<&str> = idle.into_iter().collect();
        notes.push(format!("these tolerances do not enter the linear model: {}", idle.join(", ")));
    }
    let row = |p: &Parameter| {
        let [nominal, lower, upper] = [&p.nominal, &p.lower, &p.upper].map(rational_to_f64);
        (p.name.clone(), nominal, lower, upper, p.unit.clone())
    };
    Some(Sensitivity { parameters: parameters.iter().map(row).collect(), controllability, observability })
}

impl Subject<'_> {
    /// The model with other values of the parameters.
    fn system(&self, parameters: &[Parameter], values: &[Rational]) -> Option<ConstrainedSystem> {
        let named = |name: &str| parameters.iter().any(|p| p.name == name);
        let mut settings: Vec<Setting> = self.settings.iter().filter(|s| !named(&s.name)).cloned().collect();
        settings.extend(parameters.iter().zip(values).map(|(p, value)| Setting {
            name: p.name.clone(),
            value: Exact::new(value.clone(), 0),
            text: String::new(),
        }));
        let (model, _) = self.document.model(&settings);
        let coordinates = self.variant.reduced.coordinate_names();
        let reduced = reduce(assemble(&model.shafts, &model.terms), Some(&coordinates)).ok()?;
        Some(ConstrainedSystem::at(&reduced, self.position, self.stuck, self.inputs))
    }

    fn search(&self, family: &Family<'_>, side: Side, progress: &dyn Progress) -> LossSearch {
        let shafts = &self.variant.reduced.equations.shafts;
        let failing = match side {
            Side::Inputs => &self.structure.uncontrollable,
            Side::Outputs => &self.structure.unobservable,
        };
        let columns = family.exact().0[0].columns();
        let mut out = LossSearch::default();
        if let Some(mode) = failing.first() {
            let at = family.parameters().iter();
            out.nearest = Some(Loss {
                distance: 0.0,
                at: at.map(|p| (p.name.clone(), rational_to_f64(&p.nominal), p.unit.clone())).collect(),
                eigenvalue: mode.eigenvalue,
                residual: 0.0,
                shafts: mode.shafts.clone(),
            });
            out.box_verdict = BoxVerdict::Lost;
            out.method = "the nominal model itself; exact".into();
        } else {
            // A start costs some 40 decompositions of the pencil.
            out.starts = (20_000_000 / columns.pow(3)).clamp(8, 96);
            let eigenvalues: Vec<_> = self.modes.iter().map(|mode| mode.eigenvalue).collect();
            out.nearest = nearest_loss(family, shafts, &eigenvalues, out.starts);
            self.judge(family, &mut out);
        }
        let spec = &self.variant.analysis;
        if failing.is_empty() || spec.threshold.is_some() {
            let plan = SamplingPlan {
                // Gramians cost the cube of the number of states.
                samples: spec.samples.unwrap_or_else(|| (SAMPLES * 8000 / columns.pow(3)).clamp(20, SAMPLES)),
                seed: SEED,
                horizon: spec.horizon.to_f64(),
                threshold: spec.threshold,
            };
            let unit = if side == Side::Inputs { "rad^2/(N^2 m^2 s)" } else { "s" };
            out.sampling = sample(family, side, shafts.len(), self.coordinates, &plan, unit);
        }
        progress.advance(0, "sensitivity", 1.0);
        out
    }

    /// The verdict over the box.
    fn judge(&self, family: &Family<'_>, out: &mut LossSearch) {
        if out.nearest.as_ref().is_some_and(|loss| loss.distance <= 1.0) {
            out.box_verdict = BoxVerdict::Lost;
            out.method = "a loss was found in it".into();
        }
        let _ = family;
    }
}
