//! Impacts: the impulses of rigid contacts that close at one instant.
//!
//! With `W = G H⁻¹ Gᵀ` the speeds of contacts change from u to `u − W Λ`. Where one contact closes, `u⁺ = −e u⁻`
//! (Newton). Where contacts with different e share an impulse, or one closes that was opening, that gains energy.
//! Poisson's law does not (Glocker, Set-Valued Force Laws, 2001, 11): impulses C of *compression* stop all closing
//! contacts (the law with e = 0), then each contact returns `e C`, while contacts without restitution, and bilateral
//! constraints, stay closed. Contacts that still close then have another impact, until none does. Each round is a
//! continuous map of the speeds, so the result is; with e = 1 everywhere it conserves the energy.
//!
//! Where all contacts that take an impulse have one e, Newton's law is Poisson's, in one round.

use super::friction::{Bounds, BoxProblem};

/// Rounds after which an impact ends without restitution: for a light body between a wall and one that is m times as
/// heavy a bounce takes about `π √m`.
const MOST_ROUNDS: usize = 2000;
/// Rounding error of a speed, or of an energy that is neither lost nor gained, relative to the terms that cancel in it.
const ROUNDING: f64 = 1e-12;

/// Closing contacts, and active constraints beside them.
pub(super) struct Contacts<'a> {
    /// W, row by row.
    pub w: &'a [f64],
    /// The coefficient of restitution of each.
    pub restitution: &'a [f64],
    /// Rebounds that are no faster than these end at rest.
    pub least: &'a [f64],
    /// The bounds of the impulse forward and backward: zero or infinite.
    pub bounds: Bounds<'a>,
}

/// The result of an impact.
pub(super) struct Impact {
    /// All impulses against the motion of each contact.
    pub impulses: Vec<f64>,
    /// Those of the last round, and the restitution in it.
    pub last: Vec<f64>,
    pub rebounds: Vec<f64>,
    /// Contacts that shared an impulse with restitution; of an impact that was cut short those that would continue.
    pub shared: Vec<usize>,
    /// Whether it reached the round limit, so that its end was computed without restitution.
    pub cut_short: bool,
}

impl Contacts<'_> {
    fn count(&self) -> usize {
        self.restitution.len()
    }

    /// `u − W Λ` of a contact, and the size of the terms that cancel in it.
    pub(super) fn after(&self, speeds: &[f64], impulses: &[f64], a: usize) -> (f64, f64) {
        let m = self.count();
        let row = self.w[a * m..(a + 1) * m].iter().zip(impulses);
        let (sum, size) = row.fold((0.0, 0.0), |(sum, size), (w, x)| (sum + w * x, size + (w * x).abs()));
        (speeds[a] - sum, size + speeds[a].abs())
    }

    /// The same for all: zero where it is only rounding, which dependent contacts would contradict.
    fn all_after(&self, speeds: &[f64], impulses: &[f64]) -> Vec<f64> {
        let clear = |(speed, size): (f64, f64)| if speed.abs() <= ROUNDING * size { 0.0 } else { speed };
        (0..self.count()).map(|a| clear(self.after(speeds, impulses, a))).collect()
    }

    /// Whether a contact is bilateral.
    fn is_bilateral(&self, a: usize) -> bool {
        self.bounds.forward[a] > 0.0 && self.bounds.backward[a] > 0.0
    }

    /// The restitution of each contact with an impact.
    fn rebounds(&self, speeds: &[f64]) -> Vec<f64> {
        let rebound =
            |a: usize| if -self.restitution[a] * speeds[a] > self.least[a] { self.restitution[a] } else { 0.0 };
        (0..self.count()).map(rebound).collect()
    }

    /// The energy that impulses dissipate.
    pub(super) fn lost(&self, speeds: &[f64], impulses: &[f64]) -> (f64, f64) {
        let part = |a: usize| {
            let after = self.after(speeds, impulses, a).0;
            (0.5 * impulses[a] * (speeds[a] + after), impulses[a].abs() * (speeds[a].abs() + after.abs()))
        };
        (0..self.count()).map(part).fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1))
    }

    /// The impulses of Newton's law, where they are those of Poisson's too: all contacts that take one have the same restitution e, or were at rest.
    /// Then the part `1/(1 + e)` of them is the compression.
    fn newton(&self, problem: &mut BoxProblem, speeds: &[f64], rebounds: &[f64]) -> Option<Vec<f64>> {
        let m = self.count();
        let right: Vec<f64> = speeds.iter().zip(rebounds).map(|(speed, e)| speed * (1.0 + e)).collect();
        let mut impulses = vec![0.0; m];
        if !problem.solve(self.w, &right, self.bounds, &mut impulses) {
            return None;
        }
        let noise = |a: usize| self.least[a].max(ROUNDING * self.after(speeds, &impulses, a).1);
        let struck = |a: &usize| impulses[*a] != 0.0 && speeds[*a].abs() > noise(*a);
        let e = (0..m).find(struck).map_or(0.0, |a| rebounds[a]);
        let part: Vec<f64> = impulses.iter().map(|x| x / (1.0 + e)).collect();
        let fits = |a: usize| match (impulses[a] != 0.0, self.is_bilateral(a)) {
            _ if e == 0.0 && impulses[a] != 0.0 && speeds[a] > noise(a) => {
                self.is_bilateral(a) || self.restitution[a] == 0.0
            }
            (true, _) => rebounds[a] == e || speeds[a].abs() <= noise(a),
            (false, true) => true,
            (false, false) => self.after(speeds, &part, a).0 >= -noise(a),
        };
        (0..m).all(fits).then_some(impulses)
    }

    /// The restitution of a compression's impulses at these speeds, with the active constraints; `None` where no
    /// contact has any.
    fn expansion(
        &self,
        problem: &mut BoxProblem,
        compressed: &[f64],
        compression: &[f64],
        most: f64,
    ) -> Option<Vec<f64>> {
        let m = self.count();
        let rebound = |a: usize| {
            let back = self.restitution[a] * compression[a];
            if self.is_bilateral(a) || back.abs() * self.w[a * m + a] <= self.least[a] { 0.0 } else { back }
        };
        let back: Vec<f64> = (0..m).map(rebound).collect();
        if back.iter().all(|x| *x == 0.0) {
            return None;
        }
        let closed = |bounds: &[f64]| -> Vec<f64> {
            let is_plastic = |a: usize| self.is_bilateral(a) || self.restitution[a] == 0.0;
            bounds.iter().enumerate().map(|(a, bound)| if is_plastic(a) { *bound } else { 0.0 }).collect()
        };
        let [forward, backward] = [self.bounds.forward, self.bounds.backward].map(closed);
        let bounds = Bounds { forward: &forward, backward: &backward };
        let mut with = |part: f64| -> Vec<f64> {
            let back: Vec<f64> = back.iter().map(|x| part * x).collect();
            let mut correction = vec![0.0; m];
            problem.solve(self.w, &self.all_after(compressed, &back), bounds, &mut correction);
            back.iter().zip(correction).map(|(back, correction)| back + correction).collect()
        };
        let whole = with(1.0);
        // The energy gained is a convex function of the restitution.
        let gained = -self.lost(compressed, &whole).0;
        Some(if gained > most * (1.0 + ROUNDING) { with(most / gained) } else { whole })
    }

    /// The impulses of contacts at these speeds, so that no contact still closes and no energy is gained. Where active
    /// constraints contradict each other without a bound, `problem` names them.
    pub(super) fn collide(&self, problem: &mut BoxProblem, before: &[f64]) -> Impact {
        let m = self.count();
        let (mut speeds, mut impulses) = (before.to_vec(), vec![0.0; m]);
        let mut shared: Vec<usize> = Vec::new();
        let add = |impulses: &mut Vec<f64>, more: &[f64]| impulses.iter_mut().zip(more).for_each(|(sum, x)| *sum += x);
        let mut share = |removed_impulses: &[f64]| {
            let own: Vec<usize> = (0..m).filter(|a| removed_impulses[*a] != 0.0 && !self.is_bilateral(*a)).collect();
            if own.len() > 1 {
                shared.extend(own);
            }
        };
        for _ in 0..MOST_ROUNDS {
            let rebounds = self.rebounds(&speeds);
            if let Some(last) = self.newton(problem, &speeds, &rebounds) {
                if rebounds.iter().zip(&last).any(|(e, x)| *e * *x != 0.0) {
                    share(&last);
                }
                add(&mut impulses, &last);
                return Impact { impulses, last, rebounds, shared, cut_short: false };
            }
            let mut compression = vec![0.0; m];
            let solved = problem.solve(self.w, &speeds, self.bounds, &mut compression);
            let compressed = self.all_after(&speeds, &compression);
            let lost = self.lost(&speeds, &compression).0;
            let expansion = if solved { self.expansion(problem, &compressed, &compression, lost) } else { None };
            add(&mut impulses, &compression);
            let Some(expansion) = expansion else {
                return Impact { impulses, last: compression, rebounds: vec![0.0; m], shared, cut_short: false };
            };
            share(&compression);
            add(&mut impulses, &expansion);
            speeds = self.all_after(before, &impulses);
        }
        let mut last = vec![0.0; m];
        problem.solve(self.w, &speeds, self.bounds, &mut last);
        add(&mut impulses, &last);
        let shared = (0..m).filter(|a| impulses[*a] != 0.0 && self.restitution[*a] > 0.0).collect();
        Impact { impulses, last, rebounds: vec![0.0; m], shared, cut_short: true }
    }
}
