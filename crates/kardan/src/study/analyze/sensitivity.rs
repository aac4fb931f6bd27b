//! Distance to the next change of structure, within the tolerances of a model file.

use std::collections::BTreeSet;

use crate::study::operating_point::working_point::WorkingPoint;
use crate::study::{AnalyzeSettings, Prepared, PreparedVariant, Progress};
use kardan_analysis::{
    BoxProof, ConstrainedSystem, FARTHEST, Family, Mechanics, Parameter, Pencil, PencilBox, SamplingPlan, Side,
    controllable_rank, distance_to_uncontrollability, failing_modes, linear_system, prove_box, sample, structure,
};
use kardan_math::num::{Rational, rational_from_f64, rational_to_f64};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::assemble;
use kardan_mechanics::equations::{Domain, Measured};
use kardan_mechanics::reduce::reduce;
use kardan_model::{Document, Setting};
use kardan_results::{
    Analysis, BoxVerdict, DistanceToUncontrollability, Mode, NamedShare, ParameterPoint, ParameterRange, Pole,
    Sensitivity, Structure, UncontrollablePoint,
};
use kardan_schema::diagnostics::Diagnostic;

/// Samples if the file names no number.
const SAMPLES: usize = 1000;

/// Largest number of columns of a pencil for the search of the nearest loss.
const MOST_COLUMNS: usize = 120;

/// The seed of all samples.
const SEED: u64 = 1;

/// The subject and the operating point of the analysis.
struct Subject<'a> {
    varied: Varied<'a>,
    variant: &'a PreparedVariant,
    at: WorkingPoint,
    structure: &'a Structure,
    modes: &'a [Mode],
    /// Shafts of the reduced coordinates.
    coordinates: Vec<usize>,
}

/// A model with variable parameter values.
pub(in crate::study) struct Varied<'a> {
    document: &'a Document,
    /// Parameter values of the variant.
    settings: Vec<Setting>,
    variant: &'a PreparedVariant,
    position: Vec<f64>,
    stuck: BTreeSet<String>,
}

impl<'a> Varied<'a> {
    /// A variant at its operating point.
    pub(in crate::study) fn of(
        document: &'a Document,
        prepared: &Prepared,
        variant: &'a PreparedVariant,
        at: &WorkingPoint,
    ) -> Self {
        let number = prepared.variants.iter().position(|candidate| candidate.name == variant.name).unwrap_or(0);
        let settings = document.variant_settings().swap_remove(number).settings;
        Self { document, settings, variant, position: at.position.clone(), stuck: at.stuck.clone() }
    }

    /// The variant with other values of some parameters.
    pub(in crate::study) fn system(
        &self,
        values: &[(&str, &Rational)],
        inputs: &[String],
    ) -> Option<ConstrainedSystem> {
        let named = |name: &str| values.iter().any(|(candidate, _)| *candidate == name);
        let mut settings: Vec<Setting> = self.settings.iter().filter(|s| !named(&s.name)).cloned().collect();
        settings.extend(values.iter().map(|(name, value)| Setting {
            name: (*name).into(),
            value: Exact::new((*value).clone(), 0),
            text: String::new(),
        }));
        let (model, _) = self.document.model(&settings);
        let coordinates = self.variant.reduced.coordinate_names();
        let reduced = reduce(assemble(&model.all_coordinates, &model.terms), Some(&coordinates)).ok()?;
        Some(ConstrainedSystem::at(&reduced, &self.position, &self.stuck, inputs))
    }

    /// The variant at the two ends of the tolerance of each parameter, all others unchanged.
    pub(in crate::study) fn ends(&self, inputs: &[String]) -> Vec<[Option<ConstrainedSystem>; 2]> {
        let tolerances = self.variant.model.tolerances.iter();
        let end = |name: &str, value: &Exact| self.system(&[(name, &value.to_rational())], inputs);
        tolerances.map(|t| [&t.lower, &t.upper].map(|value| end(&t.parameter, value))).collect()
    }
}

/// Adds nearest losses, verdicts over the box of tolerances, and sampling, for a model with tolerances.
pub(in crate::study) fn sensitivity(
    document: &Document,
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    analysis: &mut Analysis,
    progress: &dyn Progress,
) -> Result<(), Vec<Diagnostic>> {
    if analysis.elimination.is_some() {
        analysis.notes.push("after the elimination the tolerances of the parameters are not considered".into());
        return Ok(());
    }
    let at = WorkingPoint::of(variant, settings, &mut Vec::new())?;
    let subject = Subject {
        varied: Varied::of(document, prepared, variant, &at),
        variant,
        structure: &analysis.structure,
        modes: &analysis.modes,
        coordinates: at.system.explicit_basis(&variant.reduced.coordinates).0,
        at,
    };
    let (found, note) = subject.sensitivity(progress);
    analysis.sensitivity = Some(found);
    analysis.notes.extend(note);
    Ok(())
}

impl Subject<'_> {
    fn sensitivity(&self, progress: &dyn Progress) -> (Sensitivity, Option<String>) {
        let tolerances = &self.variant.model.tolerances;
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
        let at = |values: &[Rational]| self.system(&parameters, values);
        let mut idle: BTreeSet<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
        let mut search = |side: Side, signals: usize| {
            let family = Family::new(&parameters, &at, side, &self.at.outputs)?;
            (0..parameters.len()).filter(|&i| family.depends_on(i)).for_each(|i| {
                idle.remove(parameters[i].name.as_str());
            });
            (signals > 0).then(|| self.search(&family, side, progress))
        };
        let controllability = search(Side::Inputs, self.at.inputs.len());
        let observability = search(Side::Outputs, self.at.outputs.len());
        let idle: Vec<&str> = idle.into_iter().collect();
        let note =
            (!idle.is_empty()).then(|| format!("these tolerances do not enter the linear model: {}", idle.join(", ")));
        let row = |p: &Parameter| {
            let [nominal, lower, upper] = [&p.nominal, &p.lower, &p.upper].map(rational_to_f64);
            ParameterRange { name: p.name.clone(), nominal, lower, upper, unit: p.unit.clone() }
        };
        let parameters = parameters.iter().map(row).collect();
        (Sensitivity { parameters, controllability, observability }, note)
    }

    /// The model with other values of the parameters.
    fn system(&self, parameters: &[Parameter], values: &[Rational]) -> Option<ConstrainedSystem> {
        let named = parameters.iter().map(|p| p.name.as_str()).zip(values).collect::<Vec<_>>();
        self.varied.system(&named, &self.at.inputs)
    }

    fn search(&self, family: &Family<'_>, side: Side, progress: &dyn Progress) -> DistanceToUncontrollability {
        // A progress bar of its own in addition to that of the structure; one half for each side.
        let (begin, end) = if side == Side::Inputs { (0.0, 0.5) } else { (0.5, 1.0) };
        let advance = |part: f64| progress.advance(1, "sensitivity", begin + (end - begin) * part);
        advance(0.0);
        let shafts = &self.variant.reduced.equations.coordinates;
        let failing = match side {
            Side::Inputs => &self.structure.uncontrollable,
            Side::Outputs => &self.structure.unobservable,
        };
        let columns = family.exact().0[0].columns();
        let mut out = DistanceToUncontrollability::default();
        if let Some(mode) = failing.first() {
            let at = family.parameters().iter();
            out.nearest = Some(UncontrollablePoint {
                distance: 0.0,
                at: at.map(|p| point(p, &p.nominal)).collect(),
                eigenvalue: mode.eigenvalue,
                residual: 0.0,
                shafts: mode.shafts.clone(),
            });
            out.box_verdict = BoxVerdict::Lost;
            out.method = "the nominal model itself; exact".into();
        } else {
            // A start costs some 40 decompositions of the pencil.
            if columns <= MOST_COLUMNS {
                out.starts = (1_000_000 / columns.pow(3)).clamp(4, 96);
                let eigenvalues: Vec<_> = self.modes.iter().map(|mode| mode.eigenvalue).collect();
                out.nearest = distance_to_uncontrollability(family, shafts, &eigenvalues, out.starts);
            }
            let vanishing = self.vanishing(family.parameters(), side);
            // Exact ones before those that are only close to the same.
            let mut all: Vec<UncontrollablePoint> = vanishing.into_iter().chain(out.nearest.take()).collect();
            all.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let least = all.first().map_or(0.0, |loss| loss.distance);
            let close = all.iter().position(|loss| loss.residual == 0.0 && loss.distance <= least * (1.0 + 1e-6));
            out.nearest = (!all.is_empty()).then(|| all.swap_remove(close.unwrap_or(0)));
            if let Some(loss) = &mut out.nearest {
                let mut nominal = family.parameters().iter().map(|p| rational_to_f64(&p.nominal));
                loss.at.retain(|point| nominal.next() != Some(point.value));
            }
            advance(0.4);
            self.judge(family, &mut out);
            advance(0.8);
        }
        let spec = &self.variant.analysis;
        if failing.is_empty() || spec.threshold.is_some() {
            let plan = SamplingPlan {
                // Gramians cost the cube of the number of states.
                samples: spec.samples.unwrap_or_else(|| (SAMPLES * 4000 / columns.pow(3)).clamp(20, SAMPLES)),
                seed: SEED,
                horizon: spec.horizon.to_f64(),
                threshold: spec.threshold,
            };
            let equations = &self.variant.reduced.equations;
            let circuit = self.coordinates.iter().any(|&q| equations.domain(q) != Domain::Rotation);
            let unit = match side {
                _ if circuit => "SI",
                Side::Inputs => "rad^2/(N^2 m^2 s)",
                Side::Outputs if self.at.outputs.iter().all(|o| matches!(o.measured, Measured::Angle(_))) => "s",
                Side::Outputs => "SI",
            };
            out.sampling = sample(family, side, shafts.len(), &self.coordinates, &plan, unit);
        }
        advance(1.0);
        out
    }

    /// The nearest loss where one parameter vanishes, decided exactly.
    fn vanishing(&self, parameters: &[Parameter], side: Side) -> Option<UncontrollablePoint> {
        let distance = |p: &Parameter| {
            let width = if p.nominal > Rational::ZERO { &p.nominal - &p.lower } else { &p.upper - &p.nominal };
            let apart = !p.nominal.is_zero() && !width.is_zero();
            apart.then(|| rational_to_f64(&(&p.nominal / width)).abs()).filter(|distance| *distance <= FARTHEST)
        };
        let mut order: Vec<(f64, usize)> =
            parameters.iter().enumerate().filter_map(|(i, p)| Some((distance(p)?, i))).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        order.into_iter().find_map(|(distance, i)| {
            let mut values: Vec<Rational> = parameters.iter().map(|p| p.nominal.clone()).collect();
            values[i] = Rational::ZERO;
            let (eigenvalue, shafts) = self.lost_at(parameters, &values, side)?;
            let at = parameters.iter().zip(&values).map(|(p, x)| point(p, x));
            Some(UncontrollablePoint { distance, at: at.collect(), eigenvalue, residual: 0.0, shafts })
        })
    }

    /// The first mode lost at these values, exact; `None` if there is none.
    fn lost_at(&self, parameters: &[Parameter], values: &[Rational], side: Side) -> Option<(Pole, Vec<NamedShare>)> {
        let system = self.system(parameters, values)?;
        let (coordinates, basis) = system.explicit_basis(&self.variant.reduced.coordinates);
        if coordinates != self.coordinates {
            return None;
        }
        let linear = linear_system(&system, &coordinates, &basis, &self.at.outputs);
        let (inputs, dual) = (side == Side::Inputs, linear.transpose());
        if controllable_rank(if inputs { &linear } else { &dual })? == linear.states.len() {
            return None;
        }
        let mut found = structure(&linear).ok()?;
        failing_modes(&mut found, &mut [], &linear, Some(Mechanics { system: &system, basis: &basis }));
        let mode = if inputs { found.uncontrollable } else { found.unobservable }.into_iter().next()?;
        Some((mode.eigenvalue, mode.shafts))
    }

    /// The verdict over the box, and the range of the proof.
    fn judge(&self, family: &Family<'_>, out: &mut DistanceToUncontrollability) {
        let nearest = out.nearest.as_ref().map_or(FARTHEST, |loss| loss.distance);
        if nearest <= 1.0 {
            out.box_verdict = BoxVerdict::Lost;
            let exact = out.nearest.as_ref().is_some_and(|loss| loss.residual == 0.0);
            out.method = format!("a loss was found in it, {}", if exact { "exactly" } else { "to rounding" });
        }
        let Some(proof) = Proof::of(family) else {
            if nearest > 1.0 {
                out.method = "no proof: some parameters enter otherwise than linearly, such as in products".into();
            }
            return;
        };
        let (mut low, mut high) = (0.0, nearest);
        if nearest > 1.0 {
            match proof.run(1.0, 1) {
                BoxProof::Proven { cells } => {
                    low = 1.0;
                    out.box_verdict = BoxVerdict::Certified;
                    out.method = match cells {
                        0 => "no tolerance affects it".into(),
                        _ => format!("rigorous bounds on {cells} cells of eigenvalues and parameters"),
                    };
                    if out.nearest.is_none() && matches!(proof.run(FARTHEST, 4), BoxProof::Proven { .. }) {
                        low = FARTHEST;
                    }
                }
                BoxProof::Undecided { cells, at, .. } => {
                    high = 1.0;
                    let near =
                        if at.im == 0.0 { format!("{:.4}", at.re) } else { format!("{:.4} ± {:.4} j", at.re, at.im) };
                    out.method = format!("{cells} cells of eigenvalues and parameters did not suffice near {near} 1/s");
                }
            }
        }
        // The range of the proof: bisection between the proven range and the loss that was found.
        for _ in 0..5 {
            let middle = if low == 0.0 { 0.7 * high } else { (low * high).sqrt() };
            // Four digits, which reports show unchanged: rounding must not enlarge the proven range.
            let middle: f64 = format!("{middle:.3e}").parse().expect("Rust reads what it prints");
            if high < 1.02 * low || middle < 1e-3 {
                break;
            }
            match proof.run(middle, 4) {
                BoxProof::Proven { .. } => low = middle,
                BoxProof::Undecided { .. } => high = middle,
            }
        }
        out.proven_distance = low;
    }
}

/// A family for proofs.
struct Proof<'a> {
    parameters: &'a [Parameter],
    base: &'a Pencil,
    slopes: &'a [Pencil],
    budget: usize,
}

fn point(parameter: &Parameter, value: &Rational) -> ParameterPoint {
    ParameterPoint { parameter: parameter.name.clone(), value: rational_to_f64(value), unit: parameter.unit.clone() }
}

impl<'a> Proof<'a> {
    /// `None` if the family is not affine in the parameters.
    fn of(family: &'a Family<'a>) -> Option<Self> {
        let (base, slopes) = family.exact();
        let (rows, columns) = (base[0].rows(), base[0].columns());
        let work = (rows * rows * (rows + 4 * columns)).max(1);
        let budget = (150_000_000 / work).clamp(50, 20_000);
        Some(Self { parameters: family.parameters(), base, slopes: slopes?, budget })
    }

    /// Tries a proof over this many tolerances, with a part of the budget. Values do not pass through zero.
    fn run(&self, tolerances: f64, part: usize) -> BoxProof {
        let reach = rational_from_f64(tolerances).expect("a finite number");
        let mut base = self.base.clone();
        let mut slopes = Vec::new();
        for (parameter, slope) in self.parameters.iter().zip(self.slopes) {
            let Parameter { nominal, lower, upper, .. } = parameter;
            let half = parameter.half_width();
            // A value whose interval has one sign retains it.
            let keeps = !nominal.is_zero() && lower * upper >= Rational::ZERO;
            let clipped = |x: Rational| if keeps && &x * nominal < Rational::ZERO { Rational::ZERO } else { x };
            let low = clipped(nominal - &reach * (nominal - lower));
            let high = clipped(nominal + &reach * (upper - nominal));
            // In half widths of the tolerance: the middle and the half width of the covered part.
            let two = Rational::from(2);
            let (middle, width) = ((&low + &high) / &two - nominal, (&high - &low) / &two);
            let (middle, width) = (middle / &half, width / &half);
            if !middle.is_zero() {
                base = [0, 1, 2].map(|k| base[k].plus(&slope[k].scale(&middle)));
            }
            slopes.push([0, 1, 2].map(|k| slope[k].scale(&width)));
        }
        prove_box(&PencilBox { coefficients: base, slopes }, self.budget / part, &mut |_| {})
    }
}
