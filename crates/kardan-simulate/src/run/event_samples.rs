//! Samples of a step, whether they are close enough, and the state of the missed-event guard.

use crate::machine::{Discontinuity, Machine};
use kardan_math::num::StateArchive;

/// Samples inside a step at which events are searched; between two of them a direction may reverse at most once.
pub(super) const MOST_SCAN_POINTS: usize = 6;
/// Sample positions in a step, as parts of it, incommensurable with any period.
pub(super) const EVENT_SCAN_POINTS: [f64; MOST_SCAN_POINTS] = [0.1386, 0.3517, 0.4892, 0.6871, 0.8229, 1.0];
/// The curvature, relative to its range over a step, above which samples do not show a number between them; and the
/// distance from zero, in the same parts, within which it may vanish there.
const UNKNOWN: f64 = 0.6;
const NEAR: f64 = 3.0;

/// The margins of all directions (columns) at the samples of the last step (rows), allocated once.
pub(super) struct EventSamples {
    pub(super) times: [f64; MOST_SCAN_POINTS + 1],
    pub(super) count: usize,
    margins: Vec<f64>,
    pub(super) directions: usize,
    pub(super) curvatures: Vec<f64>,
}

impl EventSamples {
    pub(super) fn new(directions: usize) -> Self {
        let margins = vec![0.0; (MOST_SCAN_POINTS + 1) * directions];
        Self {
            times: [f64::NAN; MOST_SCAN_POINTS + 1],
            count: 0,
            margins,
            directions,
            curvatures: vec![0.0; directions],
        }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.times);
        archive.count(&mut self.count);
        archive.numbers(&mut self.margins);
    }

    /// Takes the margins at the point that the machine has evaluated last.
    pub(super) fn take(&mut self, row: usize, time: f64, machine: &mut Machine) {
        self.times[row] = time;
        self.count = row + 1;
        machine.margins_here(&mut self.margins[row * self.directions..][..self.directions]);
    }

    /// Begins with the last or first sample at this time; false: there is none.
    pub(super) fn begin(&mut self, time: f64) -> bool {
        if self.count > 0 && self.times[self.count - 1] == time {
            let last = (self.count - 1) * self.directions;
            self.margins.copy_within(last..last + self.directions, 0);
            self.times[0] = time;
        }
        let is_same_time = self.count > 0 && self.times[0] == time;
        self.count = usize::from(is_same_time);
        is_same_time
    }

    pub(super) fn at(&self, row: usize, watch: usize) -> f64 {
        self.margins[row * self.directions + watch]
    }

    /// The curvature of each margin over three samples.
    pub(super) fn measure_curvatures(&mut self) {
        for watch in 0..self.directions {
            let curvatures = curvatures(self.count, |row| (self.times[row], self.at(row, watch)));
            self.curvatures[watch] = curvatures.fold(0.0, f64::max);
        }
    }

    /// Whether the samples are too far apart to show a margin between them; `noise` is the rounding error of each.
    pub(super) fn are_coarse(&self, noise: impl Fn(usize) -> f64) -> bool {
        let sample = |watch| move |row| (self.times[row], self.at(row, watch));
        (0..self.directions).any(|watch| is_coarse(self.count, noise(watch), sample(watch)))
    }
}

/// The curvature of numbers at samples, each relative to its neighbours.
fn curvatures(count: usize, sample: impl Fn(usize) -> (f64, f64)) -> impl Iterator<Item = f64> {
    (0..count.saturating_sub(2)).map(move |row| {
        let [before, here, after] = [row, row + 1, row + 2].map(&sample);
        let part = (here.0 - before.0) / (after.0 - before.0);
        2.0 * (here.1 - before.1 - part * (after.1 - before.1)).abs()
    })
}

/// Whether numbers at samples of a step may vanish between the samples undetected; a range of at most `noise` is only
/// rounding.
pub(super) fn is_coarse(count: usize, noise: f64, sample: impl Fn(usize) -> (f64, f64)) -> bool {
    let ends = |(low, high): (f64, f64), row| (low.min(sample(row).1), high.max(sample(row).1));
    let (least, most) = (0..count).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let near = if least > 0.0 { least } else { (-most).max(0.0) };
    let has_range = least.is_finite() && most.is_finite() && most - least > noise && near <= NEAR * (most - least);
    has_range && curvatures(count, sample).fold(0.0, f64::max) > UNKNOWN * (most - least)
}

/// Prevents steps from missing an event.
#[derive(Default)]
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
        let numbers = vec![0.0; (EVENT_SCAN_POINTS.len() + 2) * kinks];
        Self { blind, bent_at: f64::NEG_INFINITY, numbers, ..Self::default() }
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
