//! Lists of target poles: real poles and conjugate pairs.

use kardan_rt::functions::hypot;

use kardan_results::{Complex, Pole};

/// A real pole or a conjugate pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TargetPole {
    /// A real pole.
    Real(f64),
    /// `re ± im j`, im > 0.
    Pair(f64, f64),
}

/// Joins conjugate poles; the error is one without its partner.
pub(super) fn paired(poles: &[Pole]) -> Result<Vec<TargetPole>, Pole> {
    let mut out = Vec::new();
    let mut open: Vec<Pole> = Vec::new();
    for &Complex { re, im } in poles {
        if im == 0.0 {
            out.push(TargetPole::Real(re));
        } else if let Some(at) = open.iter().position(|candidate| *candidate == Complex { re, im: -im }) {
            open.swap_remove(at);
            out.push(TargetPole::Pair(re, im.abs()));
        } else {
            open.push(Complex { re, im });
        }
    }
    open.first().map_or(Ok(out), |unpaired| Err(*unpaired))
}

/// The poles with the requested multiplicity of each.
pub(super) fn multiplicities(poles: &[Pole]) -> Vec<(Pole, usize)> {
    let mut out: Vec<(Pole, usize)> = Vec::new();
    for pole in poles {
        // −0 and 0 are the same pole.
        match out.iter_mut().find(|(candidate, _)| candidate == pole) {
            Some((_, times)) => *times += 1,
            None => out.push((*pole, 1)),
        }
    }
    out
}

/// Takes from `poles` the one nearest to each of `references`, and gives the distances; as many as there are others.
pub(super) fn take_nearest(poles: &mut Vec<Pole>, references: &[Pole]) -> Vec<f64> {
    let mut out = Vec::new();
    for reference in references {
        let distance = |p: &Pole| hypot(p.re - reference.re, p.im - reference.im);
        let nearest = (0..poles.len()).min_by(|&i, &j| distance(&poles[i]).total_cmp(&distance(&poles[j])));
        out.push(nearest.map_or(f64::INFINITY, |at| distance(&poles.swap_remove(at))));
    }
    out
}

#[cfg(test)]
#[path = "../../tests/unit/regulator/pole_list.rs"]
mod tests;
