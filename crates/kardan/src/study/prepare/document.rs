//! Preparation of all variants of a model file: all errors at once, and the runs ready to start.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::sync::Arc;

use rayon::prelude::*;

use crate::study::Prepared;
use crate::study::check::debounce::late_monitors;
use crate::study::check::safety_rows::check_rows;
use crate::study::measure::figure_spec::figures_and_requirements;
use crate::study::measure::plot_spec::plots;
use crate::study::progress::Progress;
use crate::study::read::scenario::scenario;
use crate::study::read::signal_table::SignalContext;
use crate::study::read::tolerance::tolerance;
use crate::study::read::variant_diagnostics::add_new;
use crate::study::requests::analysis_spec::analysis_spec;
use crate::study::requests::bench_spec::check_bench;
use crate::study::requests::safety_spec::safety_spec;
use crate::study::requests::sweep_spec::sweep_spec;
use kardan_mechanics::assemble::assemble;
use kardan_mechanics::equations::{Direction, Domain, Measured, NamedTerm, Term};
use kardan_mechanics::reduce::Reduced;
use kardan_model::{Document, Model, VariantSettings};
use kardan_schema::diagnostics::{Diagnostic, Severity};
use kardan_simulate::signal_names;

use super::variants::{Purpose, Steps, prepare_variant};

/// The runs of a document, ready to start; errors are added to the diagnostics.
pub(in crate::study) fn prepare_document(
    purpose: Purpose,
    document: &Document,
    progress: &dyn Progress,
    out: &mut Vec<Diagnostic>,
) -> Prepared {
    let mut prepared = Prepared { named: !document.named_variants.is_empty(), ..Prepared::default() };
    let unread = out.iter().any(Diagnostic::is_error);
    let all_settings = document.variant_settings();
    let mut first = None;
    // Of a variant: its equations, each law in its loop, the sampled loop, its margins.
    let laws = |variant: &VariantSettings| variant.controls.as_ref().map_or(document.controls.len(), Vec::len);
    let steps = Steps::new(all_settings.iter().map(|variant| laws(variant) + 3).sum(), progress);
    // The preparation of one variant does not depend on the others; its diagnostics do.
    let one = |variant: &VariantSettings| {
        let VariantSettings { name: label, settings, controls, .. } = variant;
        let (model, mut reported) = document.model_with(settings, controls.as_deref());
        let is_complete =
            !document.suppressed.equations && !model.programs.broken && !reported.iter().any(Diagnostic::is_error);
        let ready = is_complete.then(|| {
            let name = if label.is_empty() { file_stem(&model.name) } else { label.clone() };
            prepare_variant((purpose, &steps, None), document, name, model.clone(), variant, &mut reported)
        });
        document.check_tolerances(settings, &mut reported);
        (model, ready.flatten(), reported)
    };
    let all: Vec<_> = all_settings.par_iter().map(one).collect();
    progress.preparing(1.0);
    for (k, (model, variant, diagnostics)) in all.into_iter().enumerate() {
        prepared.variants.extend(variant.map(Arc::new));
        add_new(out, diagnostics, (k > 0).then_some(&all_settings[k].name));
        prepared.name.clone_from(&model.name);
        prepared.description.clone_from(&model.description);
        if k == 0 {
            first = Some(model);
        }
    }
    let mut diagnostics = Vec::new();
    let all_settings_of_first = all_settings.first().map(|first| first.settings.clone()).unwrap_or_default();
    let context = match (prepared.variants.first(), first) {
        (Some(variant), _) => {
            let signals = signal_names(&variant.reduced, &variant.scenario);
            SignalContext { document, signals, doubtful: BTreeSet::new() }
        }
        (None, Some(mut model)) => {
            let reduced = unreduced(&mut model);
            let settings = &all_settings[0].settings;
            let (scenario, _) = scenario(document, &model, (&reduced.equations, None), settings, &mut diagnostics);
            let signals = signal_names(&reduced, &scenario);
            let context = SignalContext { document, signals, doubtful: model.doubtful };
            analysis_spec(&context, &reduced.equations, None, settings, &mut diagnostics);
            context
        }
        (None, None) => SignalContext { document, signals: Vec::new(), doubtful: BTreeSet::new() },
    };
    (prepared.figures, prepared.requirements) = figures_and_requirements(&context, &all_settings, &mut diagnostics);
    let names: Vec<String> = all_settings.into_iter().map(|variant| variant.name).collect();
    prepared.plots = plots(&context, &names, &mut diagnostics);
    let faults = prepared.variants.first().map(|variant| variant.faults.clone()).unwrap_or_default();
    let ends: Vec<(String, f64)> =
        prepared.all().map(|variant| (variant.name.clone(), variant.scenario.duration)).collect();
    late_monitors(document, &ends, &mut diagnostics);
    prepared.safety = safety_spec(&context, &names, (&faults, &ends), &mut diagnostics);
    check_rows(document, &prepared, &mut diagnostics);
    prepared.sweep = Some(sweep_spec(&context, &names, &mut diagnostics));
    prepared.tolerance = tolerance(document, &mut diagnostics);
    if !document.suppressed.equations {
        check_bench(document, &all_settings_of_first, &mut diagnostics);
    }
    add_new(out, diagnostics, None);
    // Unreadable parts may be what connects them.
    if unread {
        out.retain(|diagnostic| diagnostic.code != "model::disconnected");
    }
    out.sort_by_key(|d| {
        (d.labels.first().map_or(usize::MAX, |label| label.place.start()), d.severity == Severity::Warning)
    });
    prepared
}

/// The part of a model that can be numbered, as if there were no constraints: enough to determine its signals. Elements that name
/// missing parts are left out and marked as doubtful.
fn unreduced(model: &mut Model) -> Reduced {
    let shafts: HashSet<String> = model.all_coordinates.iter().cloned().collect();
    // Only the element that introduces a charge knows it.
    let mut charges: HashMap<String, Vec<String>> = HashMap::new();
    for NamedTerm { element, term, .. } in &model.terms {
        if let Term::Coordinate { name, domain: Domain::Charge } = term {
            charges.entry(name.clone()).or_default().push(element.clone());
        }
    }
    let has_coordinate = |name: &str| shafts.contains(name) && !charges.contains_key(name);
    let knows = |named: &NamedTerm, name: &str| {
        has_coordinate(name) || charges.get(name).is_some_and(|elements| elements.contains(&named.element))
    };
    let of_element =
        |named: &NamedTerm, direction: &Direction| direction.entries.iter().all(|(name, _)| knows(named, name));
    let (constraints, free_terms): (Vec<_>, Vec<_>) =
        std::mem::take(&mut model.terms).into_iter().partition(|named| !matches!(named.term, Term::Output(_)));
    let (mut good, mut bad): (Vec<_>, Vec<_>) = constraints.into_iter().partition(|named| match &named.term {
        Term::UnilateralConstraint { direction, unilateral } => {
            let mut named_by_it = unilateral.formula().into_iter().flat_map(|formula| formula.coordinates());
            of_element(named, direction) && named_by_it.all(has_coordinate)
        }
        Term::Torque { direction, law } => of_element(named, direction) && law.coordinates().all(has_coordinate),
        Term::Transmission { .. } | Term::MultiplierLaw(_) => named.term.coordinates().into_iter().all(has_coordinate),
        term => term.coordinates().into_iter().all(|name| knows(named, name)),
    });
    let is_row =
        |term: &Term| matches!(term, Term::Constraint { .. } | Term::Compliance { .. } | Term::Transmission { .. });
    let rows: HashSet<String> =
        good.iter().filter(|named| is_row(&named.term)).map(|named| named.element.clone()).collect();
    let constrains = |element: &String| rows.contains(element);
    let (sensors, lost): (Vec<_>, Vec<_>) = free_terms.into_iter().partition(|named| match &named.term {
        Term::Output(sensor) => match &sensor.measured {
            Measured::Angle(shaft) | Measured::Speed(shaft) | Measured::NetTorque(shaft) => has_coordinate(shaft),
            Measured::ConstraintTorque(element, shaft) | Measured::ComplianceTorque(element, shaft) => {
                has_coordinate(shaft) && constrains(element)
            }
            Measured::SpringTorque(_) | Measured::Signal(_) => true,
        },
        _ => true,
    });
    good.extend(sensors);
    bad.extend(lost);
    model.doubtful.extend(bad.into_iter().map(|named| named.element));
    let equations = assemble(&model.all_coordinates, &good);
    model.terms = good;
    let coordinates = (0..equations.coordinates.len()).collect();
    Reduced { coordinates, equations, redundant: Vec::new(), steps: Vec::new(), massless: None }
}

pub(in crate::study) fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' }).collect();
    if stem.chars().all(|c| c == '.' || c == '-') { "run".into() } else { stem }
}
