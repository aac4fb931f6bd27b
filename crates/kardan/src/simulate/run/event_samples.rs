//! Samples of a step, whether they are close enough, and the state of the missed-event guard.

use crate::num::StateArchive;
use crate::simulate::machine::Discontinuity;

/// Sample positions in a step, as parts of it, incommensurable with any period.
pub(super) const EVENT_SCAN_POINTS: [f64; 6] = [0.1386, 0.3517, 0.4892, 0.6871, 0.8229, 1.0];
/// The curvature, relative to its range over a step, above which samples do not show a number between them; and the
/// distance from zero, in the same parts, within which it may vanish there.
const UNKNOWN: f64 = 0.6;
const NEAR: f64 = 3.0;

/// The curvature of numbers at samples, each relative to its neighbours.
pub(super) fn curvatures(count: usize, look: impl Fn(usize) -> (f64, f64)) -> impl Iterator<Item = f64> {
    (0..count.saturating_sub(2)).map(move |row| {
        let [before, here, after] = [row, row + 1, row + 2].map(&look);
        let part = (here.0 - before.0) / (after.0 - before.0);
        2.0 * (here.1 - before.1 - part * (after.1 - before.1)).abs()
    })
}

/// Whether numbers at samples of a step may vanish between the samples undetected; a range of at most `noise` is only
/// rounding.
pub(super) fn is_coarse(count: usize, noise: f64, look: impl Fn(usize) -> (f64, f64)) -> bool {
    let ends = |(low, high): (f64, f64), row| (low.min(look(row).1), high.max(look(row).1));
    let (least, most) = (0..count).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let near = if least > 0.0 { least } else { (-most).max(0.0) };
    let has_range = least.is_finite() && most.is_finite() && most - least > noise && near <= NEAR * (most - least);
    has_range && curvatures(count, look).fold(0.0, f64::max) > UNKNOWN * (most - least)
}

/// Prevents steps from missing an event.
pub(super) struct Guard {
    /// Where the loop has jumps or kinks that depend on the time alone, if that ends the segment.
    pub(super) discontinuity: Option<Discontinuity>,
    /// Whether modes may depend on a quantity that no state depends on.
    pub(super) blind: bool,
    /// Whether the last step was too long to decide whether they stay valid.
    pub(super) coarse: bool,
    /// How often steps ended where the loop has a jump or kink, each close to the time before, and when the last one
    /// did, s.
    pub(super) bent: usize,
    pub(super) bent_at: f64,
    /// Number of successive series steps that began with a jump.
    pub(super) jumps: usize,
    /// Memory for the numbers that vanish where the loop has a jump or kink by its state: at each sample, and their
    /// signs.
    pub(super) numbers: Vec<f64>,
}

impl Guard {
    pub(super) fn new(blind: bool, kinks: usize) -> Self {
        Self {
            discontinuity: None,
            blind,
            coarse: false,
            bent: 0,
            bent_at: f64::NEG_INFINITY,
            jumps: 0,
            numbers: vec![0.0; (EVENT_SCAN_POINTS.len() + 2) * kinks],
        }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        let [mut low, mut high] = self.discontinuity.map_or([f64::INFINITY; 2], |(low, high)| [low, high]);
        [&mut low, &mut high].into_iter().for_each(|time| archive.number(time));
        self.discontinuity = low.is_finite().then_some((low, high));
        archive.count(&mut self.bent);
        archive.count(&mut self.jumps);
        archive.number(&mut self.bent_at);
    }
}
