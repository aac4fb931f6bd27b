//! Proofs about a designed linear loop, added to the result of a design.

use std::sync::Arc;

use kardan_analysis::{
    LinearSystem, Plane, exact_modes_of_pencil, mode_of_motion, stability_of, stability_of_roots, structure,
};
use kardan_math::names::signed_sum;
use kardan_math::num::{
    Matrix, Polynomial, Rational, Scalar, characteristic_polynomial, exact_rank, rational_from_f64,
};
use kardan_mechanics::reduce::over_states;
use kardan_results::{
    BorderMotion, Canonical, ChannelResult, Complex, Decouplability, Design, ElementShare, Feedback, Flatness,
    Integrators, Mode, Pole, ReadSignal, Stability, StabilityVerdict, StoredShare, TransferEntry, ZeroDynamics,
    ZeroMode,
};
use kardan_synthesis::decoupling::{
    RationalFunction, canonical_form, coupled_entries, integrator_decoupled, relative_degrees, transfer_matrix,
    zero_dynamics,
};
use kardan_synthesis::inversion::{dynamic_extension, finest_blocks, flat_parametrisation, structure_algorithm};
use kardan_synthesis::{ExactLoop, Law, Plant, named, roots};

/// Damping ratio below which a cancelled pole deserves a warning; reduced by the error of its proven digits, so that every pole that is
/// called lightly damped is.
const LIGHT: f64 = 0.2 * (1.0 - 1e-14);

/// Length of the longest fraction that is written in full, in characters.
const LONG: usize = 12;

/// Adds exact results about the loop: decouplability, canonical form, zero dynamics, transfer matrix, channels,
/// flatness.
pub(in crate::study) fn prove(exact: &ExactLoop, plant: &Plant, design: &mut Design) {
    design.decouplability = decouplability(&exact.plant, &design.outputs);
    if design.relative_degrees.is_empty() {
        design.relative_degrees = relative_degrees(&exact.plant).degrees;
    }
    design.canonical = canonical(&exact.system);
    design.zero_dynamics = match &exact.behind {
        Some(polynomial) => zeros_of_polynomial(polynomial),
        None => zeros(&exact.system, plant),
    };
    let closed = &exact.closed;
    let transfer = transfer_matrix(closed);
    let square = exact.channels.iter().copied().eq(0..closed.outputs.len());
    let blocks = &design.decouplability.blocks;
    let names = &design.outputs;
    let coupled_pair =
        |&(i, j): &(usize, usize)| blocks.iter().any(|block| block.contains(&names[i]) && block.contains(&names[j]));
    let coupled = coupled_entries(closed);
    // One output has no other to be decoupled from.
    let claims = square && (exact.inverts || closed.outputs.len() > 1);
    design.decoupled = claims.then_some(coupled.is_empty());
    let in_blocks = design.feedback == Some(Feedback::Block);
    design.blocks_decoupled = (square && in_blocks).then(|| coupled.iter().all(coupled_pair));
    if in_blocks && blocks.len() < 2 && design.outputs.len() > 1 {
        design.warnings.push("all outputs are in one block: nothing is decoupled from anything".into());
    }
    let hidden = design.without_integrals(design.hidden.clone());
    design.zero_dynamics.stability =
        with_hidden(&design.zero_dynamics.stability, &hidden, || whole_zero_dynamics(plant, design));
    design.cancels_zeros = exact.inverts;
    design.transfer = entries(closed, &transfer);
    design.channels = channels(exact, &transfer);
    design.flatness = flatness(&exact.plant);
}

/// Notes where the other controllers of the file couple outputs that this one alone decouples: they act by static feedback of
/// angles and speeds, whose gains enter as the fractions that their doubles are.
pub(in crate::study) fn check_all_laws(
    exact: &ExactLoop,
    plant: &Plant,
    laws: &[Arc<dyn Law>],
    own: usize,
    design: &mut Design,
) {
    let states = plant.state_names();
    if design.decoupled != Some(true) || laws.len() < 2 {
        return;
    }
    let other_laws: Vec<&dyn Law> = laws.iter().enumerate().filter(|(k, _)| *k != own).map(|(_, law)| &**law).collect();
    let whole = exact.closed.states.starts_with(&states) && other_laws.iter().all(|law| law.states().is_empty());
    let closed = whole.then(|| with_all_laws(exact, plant, &other_laws)).flatten();
    match closed.map(|closed| coupled_entries(&closed)) {
        Some(entries) if entries.is_empty() => {}
        Some(entries) => {
            let (i, j) = entries[0];
            design.warnings.push(format!(
                "with the other controllers in the loop the outputs are coupled: {} moves {}; the proof is for this controller \
                 alone",
                exact.closed.inputs[j], exact.closed.outputs[i]
            ));
        }
        None => design.notes.push("the proof is for this controller alone, without the others of the file".into()),
    }
}

fn with_all_laws(exact: &ExactLoop, plant: &Plant, other_laws: &[&dyn Law]) -> Option<LinearSystem> {
    let mut closed = exact.closed.clone();
    for law in other_laws {
        let linear = law.linear();
        let b = plant.system(law.inputs(), &[]).b;
        let rational = |m: &Matrix<f64>| -> Option<Matrix<Rational>> {
            let entries: Vec<Rational> = m.as_slice().iter().map(|x| rational_from_f64(*x)).collect::<Option<_>>()?;
            Some(Matrix::from_fn(m.rows(), m.columns(), |i, j| entries[i * m.columns() + j].clone()))
        };
        let rows = [&rational(&linear.on_angles)?, &rational(&linear.on_speeds)?];
        let gain = over_states(rows, &plant.linear.basis, &plant.linear.moving());
        let added = b.multiply(&gain);
        for i in 0..added.rows() {
            for j in 0..added.columns() {
                closed.a[(i, j)] = closed.a[(i, j)].plus(&added[(i, j)]);
            }
        }
    }
    Some(closed)
}

/// Warns where rounding the gains to 64 bits moves a pole over the axis.
pub(in crate::study) fn check_rounding(floating: &[Pole], design: &mut Design) {
    let size = floating.iter().map(|pole| pole.abs()).fold(0.0, f64::max);
    let worst = floating.iter().copied().max_by(|a, b| a.re.total_cmp(&b.re));
    let Some(Complex { re, im }) = worst.filter(|pole| pole.re > 1e-3 * size) else { return };
    if design.closed_loop_poles.iter().all(|pole| pole.re < 0.5 * re) {
        design.warnings.push(format!(
            "the gains are so large that their rounding to 64 bits moves poles: to {} ± {} j 1/s; the statements are \
             for the exact loop; the loop that runs is unstable according to eigenvalues in floating point",
            digits(re),
            digits(im.abs())
        ));
    }
}

/// All poles of the linear loop with this controller alone: those of the loop, the unobservable ones, and those of the error
/// of the observer, whose poles no gain moves; without those of integrators without effect (charges).
pub(in crate::study) fn exact_poles(exact: &ExactLoop, design: &Design) -> Vec<Pole> {
    let mut poles = roots(&characteristic_polynomial(&exact.closed.a));
    poles.extend(design.without_integrals(design.hidden.clone()));
    poles.extend(design.observer.iter().flat_map(|observer| &observer.poles));
    poles.sort_by(|a, b| a.abs().total_cmp(&b.abs()).then(a.re.total_cmp(&b.re)).then(b.im.total_cmp(&a.im)));
    poles
}

/// Whether all dynamics behind the outputs are stable, including unobservable motions of the plant, which `whole` sees together
/// with the others: what both have in common grows like t if one drives the other.
fn with_hidden(
    verdict: &StabilityVerdict,
    hidden: &[Pole],
    whole: impl FnOnce() -> Option<StabilityVerdict>,
) -> StabilityVerdict {
    if verdict.word == Stability::Undecided || hidden.iter().all(|pole| pole.re < 0.0) {
        return verdict.clone();
    }
    let outside = verdict.word == Stability::Unstable && verdict.border.is_empty();
    let outside = outside || hidden.iter().any(|pole| pole.re > 0.0);
    let mut border = verdict.border.clone();
    let mut repeated = Vec::new();
    for pole in hidden.iter().filter(|pole| pole.re == 0.0 && pole.im >= 0.0) {
        let poles = if pole.im > 0.0 { 2 } else { 1 };
        match border.iter_mut().position(|motion| motion.is_of(*pole)) {
            Some(place) => {
                border[place].poles += poles;
                repeated.push(place);
            }
            None => border.push(BorderMotion { frequency: pole.im, poles, growth_exponent: 0, uncontrolled: false }),
        }
    }
    if outside || repeated.is_empty() {
        return StabilityVerdict::exact(outside, border);
    }
    let Some(whole) = whole() else {
        let why =
            "motions that no output shows have the same poles on the stability boundary as others behind the outputs";
        return StabilityVerdict { border, ..StabilityVerdict::undecided(why) };
    };
    for place in repeated {
        let motion = &mut border[place];
        let pole = Complex { re: 0.0, im: motion.frequency };
        let found = whole.border.iter().find(|candidate| candidate.is_of(pole));
        motion.growth_exponent = found.map_or(motion.growth_exponent, |found| found.growth_exponent);
        // What moves on at constant speed is a free motion.
        motion.uncontrolled = motion.frequency == 0.0 && motion.growth_exponent == 1;
    }
    StabilityVerdict::exact(outside, border)
}

/// The stability of the zero dynamics of the whole plant, with what no output shows; `None` where it is not decided: static feedback does not
/// decouple, or integrators without effect are among its poles at zero.
fn whole_zero_dynamics(plant: &Plant, design: &Design) -> Option<StabilityVerdict> {
    if !design.integrals_without_effect.is_empty() {
        return None;
    }
    let outputs = design.outputs.iter().map(|name| plant.output(name).ok()).collect::<Option<Vec<_>>>()?;
    let found = zero_dynamics(&plant.system(&design.inputs, &outputs)).ok()?;
    Some(stability_of(&found.matrix, Plane::Continuous))
}

fn decouplability(system: &LinearSystem, names: &[String]) -> Decouplability {
    let degrees = relative_degrees(system);
    let outputs = system.outputs.len();
    let rank = exact_rank(&degrees.matrix);
    let normal_rank = structure_algorithm(system).rank();
    let named = |block: Vec<usize>| block.into_iter().map(|k| names[k].clone()).collect();
    let blocks = finest_blocks(system).unwrap_or_default().into_iter().map(named).collect();
    let extension = dynamic_extension(system).ok();
    let possible = match (rank == outputs, normal_rank == outputs) {
        (true, _) => Feedback::Static,
        (false, true) => Feedback::Dynamic,
        _ => Feedback::Impossible,
    };
    let integrators = extension.map(|extension| extension.chains()).unwrap_or_default();
    let integrators = integrators.into_iter().map(|(input, count)| Integrators { input, count }).collect();
    Decouplability { rank, normal_rank, possible, blocks, integrators, reasons: Vec::new() }
}

fn canonical(system: &LinearSystem) -> Option<Canonical> {
    let form = canonical_form(&integrator_decoupled(system).ok()?).ok()?;
    let n = form.a.rows();
    let (states, rows): (Vec<String>, Vec<String>) =
        (system.states.clone(), (1..=n).map(|k| format!("x{k}")).collect());
    let inputs: Vec<String> = (1..=form.b.columns()).map(|k| format!("v{k}")).collect();
    Some(Canonical {
        sizes: form.sizes,
        ranks: form.ranks,
        transformation: named(("Q", "transformation Q", ""), &rows, &states, &form.q),
        a: named(("A_cd", "A of the canonically decoupled form", ""), &rows, &rows, &form.a),
        b: named(("B_cd", "B of the canonically decoupled form", ""), &rows, &inputs, &form.b),
        c: named(("C_cd", "C of the canonically decoupled form", ""), &system.outputs, &rows, &form.c),
    })
}

fn zeros(system: &LinearSystem, plant: &Plant) -> ZeroDynamics {
    let Ok(found) = zero_dynamics(system) else {
        // Not for static feedback; the inverse has the same zeros.
        return flat_parametrisation(system)
            .map_or_else(|_| ZeroDynamics::default(), |found| zeros_of_polynomial(&found.zeros));
    };
    let k = found.matrix.rows();
    let polynomial = found.polynomial.primitive().to_string();
    if k == 0 {
        let stability = StabilityVerdict::exact(false, Vec::new());
        return ZeroDynamics { polynomial, modes: Vec::new(), stability };
    }
    let stability = stability_of(&found.matrix, Plane::Continuous);
    let unforced = LinearSystem::state_space(found.matrix, Matrix::zeros(k, 0), Matrix::zeros(0, k));
    let structural = structure(&unforced).expect("there are states and E is the identity");
    let modes = exact_modes_of_pencil(&unforced, &structural.factors).unwrap_or_default();
    let basis = found.basis.to_f64();
    let modes = modes.iter().map(|mode| zero_mode(system, plant, &basis, mode.eigenvalue, mode)).collect();
    ZeroDynamics { polynomial, modes, stability }
}

/// Zero dynamics of a known polynomial; without statements about their motions.
fn zeros_of_polynomial(polynomial: &Polynomial) -> ZeroDynamics {
    ZeroDynamics {
        polynomial: polynomial.primitive().to_string(),
        modes: roots(polynomial).iter().filter(|pole| pole.im >= 0.0).map(zero_mode_of_pole).collect(),
        stability: stability_of_roots(polynomial, Plane::Continuous),
    }
}

fn zero_mode_of_pole(pole: &Pole) -> ZeroMode {
    let natural_frequency = pole.abs();
    let damping_ratio = if natural_frequency > 0.0 { -pole.re / natural_frequency } else { 1.0 };
    let warning = warning(*pole, natural_frequency, damping_ratio);
    ZeroMode { pole: *pole, natural_frequency, damping_ratio, warning, ..ZeroMode::default() }
}

/// The motion of a zero: which shafts move and where the energy is.
fn zero_mode(system: &LinearSystem, plant: &Plant, basis: &Matrix<f64>, pole: Pole, mode: &Mode) -> ZeroMode {
    let state = |i: usize| {
        let part = |pick: fn(&Complex) -> f64| {
            mode.shape.iter().enumerate().map(|(j, entry)| basis[(i, j)] * pick(&entry.value)).sum::<f64>()
        };
        (part(|value| value.re), part(|value| value.im))
    };
    let all = |rate: usize| -> Vec<(f64, f64)> {
        let place = |read: &ReadSignal| system.states.iter().position(|state| *state == read.signal);
        plant.motions(rate).iter().map(|read| place(read).map_or((0.0, 0.0), state)).collect()
    };
    let moves = |motion: &[(f64, f64)]| motion.iter().any(|(re, im)| *re != 0.0 || *im != 0.0);
    let speeds = all(1);
    let motion = if moves(&speeds) { speeds } else { all(0) };
    let shafts: Vec<(f64, f64)> = (0..plant.coordinates().len())
        .map(|shaft| {
            let row = plant.linear.direction(shaft).to_f64();
            let sum = |pick: fn(&(f64, f64)) -> f64| -> f64 {
                motion.iter().enumerate().map(|(j, x)| row[(0, j)] * pick(x)).sum()
            };
            (sum(|x| x.0), sum(|x| x.1))
        })
        .collect();
    let found = mode_of_motion(&plant.constrained(&[]), pole, &shafts);
    let mut stored: Vec<ElementShare> = Vec::new();
    for StoredShare { element, share, .. } in found.stored {
        match stored.iter_mut().find(|other| other.element == element) {
            Some(other) => other.share += share,
            None => stored.push(ElementShare { element, share }),
        }
    }
    ZeroMode {
        pole,
        natural_frequency: found.natural_frequency,
        damping_ratio: found.damping_ratio,
        stored,
        dissipated: found.dissipated,
        shape: found.shape,
        warning: warning(pole, found.natural_frequency, found.damping_ratio),
    }
}

fn warning(pole: Pole, frequency: f64, damping: f64) -> Option<String> {
    match pole {
        Complex { re, .. } if re > 0.0 => {
            Some(format!("unstable: it grows with {} 1/s behind the outputs", digits(re)))
        }
        Complex { re: 0.0, im: 0.0 } => {
            Some("at zero: an integrator remains behind the outputs, its motion does not decay".into())
        }
        Complex { re: 0.0, .. } => Some(format!(
            "not damped at all: it oscillates without end at {} rad/s behind the outputs",
            digits(frequency)
        )),
        _ if damping < LIGHT => Some(format!(
            "lightly damped ({:.3} % at {frequency:.2} rad/s): the law cancels it, so it and the motors oscillate \
             behind the outputs; an error of the model makes it visible",
            100.0 * damping
        )),
        _ => None,
    }
}

fn text(polynomial: &Polynomial) -> Vec<String> {
    polynomial.coefficients().iter().map(ToString::to_string).collect()
}

fn entries(system: &LinearSystem, transfer: &[Vec<RationalFunction>]) -> Vec<TransferEntry> {
    let entry = |i: usize, j: usize| TransferEntry {
        output: system.outputs[i].clone(),
        reference: system.inputs[j].clone(),
        numerator: text(&transfer[i][j].numerator),
        denominator: text(&transfer[i][j].denominator),
    };
    (0..system.outputs.len())
        .flat_map(|i| (0..system.inputs.len()).map(move |j| (i, j)))
        .map(|(i, j)| entry(i, j))
        .collect()
}

fn channels(exact: &ExactLoop, transfer: &[Vec<RationalFunction>]) -> Vec<ChannelResult> {
    let channel = |(j, &i): (usize, &usize)| {
        let RationalFunction { numerator, denominator } = &transfer[i][j];
        let bracket = |p: &Polynomial| {
            let terms = p.coefficients().iter().filter(|x| !Scalar::is_zero(*x)).count();
            if terms > 1 { format!("({})", readable(p)) } else { readable(p) }
        };
        let transfer = if denominator.degree() == 0 {
            readable(numerator)
        } else {
            format!("{}/{}", bracket(numerator), bracket(denominator))
        };
        ChannelResult {
            output: exact.system.outputs[i].clone(),
            reference: exact.closed.inputs[j].clone(),
            kind: match exact.units[j].as_str() {
                "rad" | "m" => "position",
                "rad/s" | "m/s" => "speed",
                "N" => "force",
                "A" => "current",
                "C" => "charge",
                "V" => "voltage",
                _ => "torque",
            }
            .into(),
            transfer,
            poles: roots(denominator),
        }
    };
    exact.channels.iter().enumerate().map(channel).collect()
}

/// A polynomial with long fractions rounded to nine digits.
fn readable(polynomial: &Polynomial) -> String {
    let coefficients = polynomial.coefficients();
    if coefficients.iter().all(|x| x.to_string().len() <= LONG) {
        return polynomial.to_string();
    }
    let terms = coefficients.iter().enumerate().rev().filter(|(_, x)| !Scalar::is_zero(*x));
    signed_sum(terms.map(|(power, x)| {
        let value = Scalar::to_f64(x);
        let size = if value.abs() == 1.0 && power > 0 { String::new() } else { digits(value.abs()) };
        let s = match power {
            0 => String::new(),
            1 => "s".to_string(),
            power => format!("s^{power}"),
        };
        let gap = if size.is_empty() || s.is_empty() { "" } else { " " };
        (value < 0.0, format!("{size}{gap}{s}"))
    }))
}

/// Nine significant digits, without trailing zeros.
fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-4..1e9).contains(&rounded.abs()) { format!("{rounded:e}") } else { rounded.to_string() }
}

fn flatness(system: &LinearSystem) -> Option<Flatness> {
    let found = flat_parametrisation(system).ok()?;
    let outputs = system.outputs.join(", ");
    let (flat, remainder) = (found.is_flat(), found.zeros.to_string());
    let statement = if flat {
        format!("({outputs}) is a flat output: all states and inputs are functions of it and finitely many derivatives")
    } else {
        format!("({outputs}) is not a flat output: states and inputs follow from it through the filter 1/({remainder})")
    };
    Some(Flatness {
        outputs: system.outputs.clone(),
        flat,
        remainder,
        poles: roots(&found.zeros),
        derivatives: found.derivatives(),
        statement,
    })
}

/// Adds important warnings.
pub(in crate::study) fn judge(design: &mut Design) {
    // A law that does not invert the plant leaves its zeros unchanged.
    if !design.cancels_zeros {
        design.zero_dynamics.modes.iter_mut().for_each(|mode| mode.warning = None);
        return;
    }
    let warnings = design.zero_dynamics.modes.iter().filter_map(|mode| {
        let Complex { re, im } = mode.pole;
        let pole = if im == 0.0 { digits(re) } else { format!("{} ± {} j", digits(re), digits(im.abs())) };
        mode.warning.as_ref().map(|warning| format!("the zero at {pole} 1/s is {warning}"))
    });
    let warnings: Vec<String> = warnings.collect();
    design.warnings.extend(warnings);
}
