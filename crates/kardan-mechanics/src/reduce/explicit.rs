//! The choice of coordinates, and how all other shafts follow from them.

use super::error::MOST_IN_SERIES;
use super::redundant::independent_rows;
use super::{Affine, ReduceError, Reduced, Step};
use crate::assemble::{Equations, TransmissionRow};
use kardan_math::num::{Echelon, Rational, Scalar, echelon, rational_to_f64};

/// Chooses reduced coordinates (or takes the named ones) and brings all constraints to explicit form.
///
/// Without names it prefers inertias as coordinates and drops, in this order of preference, the driven shafts of
/// transmissions, massless shafts, and shafts with large coefficients (so that the basis stays well scaled); ties are
/// broken by name.
///
/// ```
/// use kardan_mechanics::assemble::assemble;
/// use kardan_mechanics::reduce::reduce;
/// let (document, _) = kardan_model::read(kardan_model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let reduced = reduce(assemble(&drive.all_coordinates, &drive.terms), None).unwrap();
/// // Three shafts, one constraint; the shaft with the largest coefficient follows from the others.
/// assert_eq!(reduced.coordinate_names(), ["fs", "wg"]);
/// ```
///
/// # Errors
/// [`ReduceError`], with the exact reason.
///
/// # Panics
/// If `named` contains a name that is not a shaft or contains one two times (the model checks this before).
pub fn reduce(equations: Equations, named: Option<&[String]>) -> Result<Reduced, ReduceError> {
    let moving: Vec<String> = equations.moving.keys().cloned().collect();
    let behind = (!moving.is_empty()).then(|| equations.clone());
    let found = explicit(equations, named);
    let (Err(ReduceError::NotExplicit { one_way, .. }), Some(equations)) = (&found, behind) else { return found };
    if one_way.is_empty() {
        return found;
    }
    // A prescribed motion behind a curve that can be followed only from its other end is a multiplier constraint: one
    // such constraint, or all.
    let with_moving = |names: &[String]| {
        let mut equations = equations.clone();
        equations.prefer_moving(names);
        explicit(equations, named).ok()
    };
    moving
        .iter()
        .find_map(|name| with_moving(std::slice::from_ref(name)))
        .or_else(|| with_moving(&moving))
        .map_or(found, Ok)
}

/// The same where no prescribed motion is behind a curve.
fn explicit(mut equations: Equations, named: Option<&[String]>) -> Result<Reduced, ReduceError> {
    let redundant = independent_rows(&mut equations)?;
    let constraints = check_motion(&equations)?;
    let number = |name: &String| {
        equations.coordinates.iter().position(|shaft| shaft == name).unwrap_or_else(|| panic!("no shaft `{name}`"))
    };
    let explicit = match named {
        None => automatic(&equations),
        Some(names) => {
            let chosen: Vec<usize> = names.iter().map(number).collect();
            let suggestion = || match automatic(&equations) {
                Ok((coordinates, _)) => coordinates.iter().map(|&shaft| equations.coordinates[shaft].clone()).collect(),
                Err(_) => Vec::new(),
            };
            let degrees_of_freedom = equations.coordinates.len() - constraints;
            if chosen.len() != degrees_of_freedom {
                let (named, suggestion) = (names.to_vec(), suggestion());
                return Err(ReduceError::CoordinateCount { degrees_of_freedom, named, suggestion });
            }
            with_coordinates(&equations, &chosen, suggestion)
        }
    };
    let (coordinates, steps) = explicit?;
    check_depth(&equations, &steps)?;
    Ok(Reduced { equations, redundant, coordinates, steps, massless: None })
}

/// Refuses shafts that follow through more transmissions than their exact ratios allow.
fn check_depth(equations: &Equations, steps: &[Step]) -> Result<(), ReduceError> {
    let mut depth = vec![0; equations.coordinates.len()];
    for Step { shaft, argument, curve } in steps {
        let deepest = argument.terms.iter().map(|(shaft, _)| depth[*shaft]).max().unwrap_or(0);
        depth[*shaft] = deepest + usize::from(curve.is_some());
    }
    let deepest = (0..depth.len()).rev().max_by_key(|&shaft| depth[shaft]);
    match deepest {
        Some(shaft) if depth[shaft] > MOST_IN_SERIES => {
            Err(ReduceError::TooDeep { shaft: equations.coordinates[shaft].clone(), transmissions: depth[shaft] })
        }
        _ => Ok(()),
    }
}

/// Reduced coordinates and the steps that follow from them.
type Explicit = (Vec<usize>, Vec<Step>);

/// The number of all constraints, if they leave a motion.
fn check_motion(equations: &Equations) -> Result<usize, ReduceError> {
    let (n, constraints) = (equations.coordinates.len(), equations.constraints.len() + equations.transmissions.len());
    // Prescribed motions may use the last one.
    if constraints > n || constraints == n && equations.moving.is_empty() {
        return Err(ReduceError::NoMotion { shafts: n, constraints });
    }
    Ok(constraints)
}

/// Most sets of coordinates that [`automatic`] tries.
const MOST_TRIED: usize = 500;

fn automatic(equations: &Equations) -> Result<Explicit, ReduceError> {
    let order = from_dropped_to_retained(equations);
    let e = echelon(&equations.constraint_matrix(), &order);
    let mut free = e.free();
    // Each transmission makes one of the free shafts dependent: its driven one if that is free, else its driving one,
    // else any that its driven shaft depends on.
    for transmission in &equations.transmissions {
        let expression =
            |shaft: usize| affine(equations, &e, shaft).terms.into_iter().map(|(s, _)| s).collect::<Vec<_>>();
        let candidates = [
            vec![transmission.driven, transmission.driving],
            expression(transmission.driven),
            expression(transmission.driving),
        ]
        .concat();
        if let Some(shaft) = candidates.iter().find(|shaft| free.contains(shaft)) {
            free.retain(|s| s != shaft);
        }
    }
    let degrees_of_freedom = order.len() - e.rank() - equations.transmissions.len();
    let open = if free.len() == degrees_of_freedom {
        plan(equations, &free)
    } else {
        Err(equations.transmissions.iter().collect())
    };
    match open {
        Ok(steps) => Ok((free, steps)),
        // Where transmissions and gears are coupled, the first choice can require solving an equation that another
        // choice avoids.
        Err(open) => {
            let order_of_retained: Vec<usize> = order.into_iter().rev().collect();
            search(equations, &order_of_retained, degrees_of_freedom, &mut Vec::new(), &mut 0)
                .ok_or_else(|| not_explicit(&open, Vec::new()))
        }
    }
}

/// Shafts in the order in which they become dependent: ends of transmissions last, massless ones and those with large
/// coefficients first; ties are broken by name.
fn from_dropped_to_retained(equations: &Equations) -> Vec<usize> {
    let n = equations.coordinates.len();
    let mut massless = vec![true; n];
    for term in &equations.inertias {
        for (shaft, _) in &term.row {
            massless[*shaft] = false;
        }
    }
    let mut largest = vec![0.0f64; n];
    for term in &equations.constraints {
        for (shaft, x) in &term.row {
            largest[*shaft] = largest[*shaft].max(rational_to_f64(x).abs());
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| {
        let end = |shaft: usize| equations.transmissions.iter().any(|t| t.driven == shaft || t.driving == shaft);
        end(a).cmp(&end(b)).then(massless[b].cmp(&massless[a])).then(largest[b].total_cmp(&largest[a])).then(a.cmp(&b))
    });
    order
}

/// The first set of coordinates, in the order given, from which all shafts follow one after another.
fn search(
    equations: &Equations,
    candidates: &[usize],
    degrees_of_freedom: usize,
    chosen: &mut Vec<usize>,
    tried: &mut usize,
) -> Option<Explicit> {
    if chosen.len() == degrees_of_freedom {
        *tried += 1;
        let mut coordinates = chosen.clone();
        coordinates.sort_unstable();
        return plan(equations, &coordinates).ok().map(|steps| (coordinates, steps));
    }
    for (k, &candidate) in candidates.iter().enumerate() {
        if *tried >= MOST_TRIED {
            return None;
        }
        chosen.push(candidate);
        let found = search(equations, &candidates[k + 1..], degrees_of_freedom, chosen, tried);
        if found.is_some() {
            return found;
        }
        chosen.pop();
    }
    None
}

/// The affine expression of a shaft over the free shafts of an echelon form.
fn affine(equations: &Equations, e: &Echelon, shaft: usize) -> Affine {
    match e.pivots.iter().position(|&pivot| pivot == shaft) {
        None => Affine { constant: 0.0, moving: Vec::new(), terms: vec![(shaft, Rational::ONE)] },
        Some(row) => {
            let constant = (0..equations.constraints.len())
                .map(|k| rational_to_f64(&e.transform[(row, k)]) * equations.constraints[k].value.to_f64())
                .sum();
            let moving = (0..equations.constraints.len())
                .filter(|&k| equations.moving.contains_key(&equations.constraints[k].element))
                .map(|k| (k, e.transform[(row, k)].clone()))
                .filter(|(_, share)| !Scalar::is_zero(share))
                .collect();
            let terms = (0..equations.coordinates.len())
                .filter(|&j| j != shaft && !Scalar::is_zero(&e.form[(row, j)]))
                .map(|j| (j, Rational::ZERO.minus(&e.form[(row, j)])))
                .collect();
            Affine { constant, moving, terms }
        }
    }
}

fn with_coordinates(
    equations: &Equations,
    chosen: &[usize],
    suggestion: impl Fn() -> Vec<String>,
) -> Result<Explicit, ReduceError> {
    let e = echelon(&equations.constraint_matrix(), &dependent_first(equations, chosen));
    if e.pivots.iter().any(|pivot| chosen.contains(pivot)) {
        let named = chosen.iter().map(|&shaft| equations.coordinates[shaft].clone()).collect();
        return Err(ReduceError::CoordinatesDependent { named, suggestion: suggestion() });
    }
    let steps = plan(equations, chosen).map_err(|open| not_explicit(&open, suggestion()))?;
    Ok((chosen.to_vec(), steps))
}

fn not_explicit(open: &[&TransmissionRow], suggestion: Vec<String>) -> ReduceError {
    let one_way = open.iter().filter(|t| t.curve.inverse().is_none()).map(|t| t.element.clone()).collect();
    ReduceError::NotExplicit { elements: open.iter().map(|t| t.element.clone()).collect(), one_way, suggestion }
}

fn dependent_first(equations: &Equations, resolved: &[usize]) -> Vec<usize> {
    let unknown = (0..equations.coordinates.len()).filter(|shaft| !resolved.contains(shaft));
    unknown.chain(resolved.iter().copied()).collect()
}

/// Steps that compute all shafts from the coordinates; the transmissions that stay open if that is not possible.
///
/// Method: a transmission with one end that follows from known shafts through the linear constraints determines its
/// other end; when none is left, the linear constraints must determine the rest.
fn plan<'a>(equations: &'a Equations, coordinates: &[usize]) -> Result<Vec<Step>, Vec<&'a TransmissionRow>> {
    let matrix = equations.constraint_matrix();
    let mut resolved = coordinates.to_vec();
    let mut steps = Vec::new();
    let mut open: Vec<&TransmissionRow> = equations.transmissions.iter().collect();
    loop {
        let e = echelon(&matrix, &dependent_first(equations, &resolved));
        let follows = |shaft: usize| {
            resolved.contains(&shaft) || {
                let value = affine(equations, &e, shaft);
                e.pivots.contains(&shaft) && value.terms.iter().all(|(s, _)| resolved.contains(s))
            }
        };
        let next = open.iter().enumerate().find_map(|(k, t)| match (follows(t.driving), follows(t.driven)) {
            (true, false) => Some((k, t.driving, t.driven, std::sync::Arc::clone(&t.curve))),
            (false, true) => t.curve.inverse().map(|inverse| (k, t.driven, t.driving, inverse)),
            _ => None,
        });
        if let Some((k, from, shaft, curve)) = next {
            steps.push(Step { shaft, argument: affine(equations, &e, from), curve: Some(curve) });
            resolved.push(shaft);
            open.remove(k);
            continue;
        }
        let unknown: Vec<usize> = (0..equations.coordinates.len()).filter(|shaft| !resolved.contains(shaft)).collect();
        if !open.is_empty() || !unknown.iter().all(|&shaft| follows(shaft)) {
            return Err(open);
        }
        let linear = |shaft| Step { shaft, argument: affine(equations, &e, shaft), curve: None };
        steps.extend(unknown.into_iter().map(linear));
        return Ok(steps);
    }
}
