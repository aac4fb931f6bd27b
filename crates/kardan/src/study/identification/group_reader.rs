//! Rows of a group of channels to windows, with errors of its clock.

use std::collections::BTreeMap;

use kardan_rt::functions::{cos, sin};

use super::channels::MappedChannel;
use super::clocks::Clock;
use kardan_identify::{Reading, Windows};
use kardan_results::LogRead;
use kardan_tables::read::Block;

/// A time between rows of at least this many usual steps is a gap.
const GAP: f64 = 5.0;
/// A clock that begins later (s, some 3000 years), or is slower (s), is suspicious.
const LATE: f64 = 1e11;
const SLOW: f64 = 0.5;
/// Fraction of rows without a number from which on the log of a channel counts as damaged.
const MISSING: f64 = 0.01;
/// Largest fraction of rows with a number that follow a row with a number, for a channel slower than others.
const ADJACENT: f64 = 0.1;
/// Number of remarks of one kind that are reported in full.
const MOST_REMARKS: usize = 3;
/// Windows by section (after clock jumps) and number; for each the readings of all slots.
pub(super) type SlotWindows = BTreeMap<(usize, i64), Vec<Reading>>;

/// Times of the rows of a group.
#[derive(Clone, Copy)]
pub(super) struct Timing {
    pub clock: Clock,
    /// s
    pub offset: f64,
}

impl Timing {
    /// The first column that is not the time.
    fn first_column(self) -> usize {
        usize::from(matches!(self.clock, Clock::Channel(..)))
    }

    /// Times and readings of a block in SI.
    pub fn to_si(self, block: &mut Block, channels: &[&MappedChannel]) {
        for (column, channel) in block.columns[self.first_column()..].iter_mut().zip(channels) {
            if channel.factor != 1.0 {
                column.iter_mut().for_each(|x| *x *= channel.factor);
            }
        }
        if let Clock::Channel(_, factor) = self.clock {
            block.columns[0].iter_mut().for_each(|t| *t = *t * factor + self.offset);
        }
    }

    /// The time of the first row, if the block is the first one.
    pub fn start(self, block: &Block) -> f64 {
        match self.clock {
            Clock::Channel(..) => block.columns[0].iter().copied().find(|t| t.is_finite()).unwrap_or(0.0),
            Clock::Step(_) => self.offset,
        }
    }
}

/// The rows of a channel without a measurement.
#[derive(Debug, Clone, Default)]
struct Missing {
    /// Rows without a number.
    none: u64,
    infinite: u64,
    /// Rows with a number after a row with one.
    adjacent: u64,
    /// Whether the last row has a number.
    last: bool,
}

impl Missing {
    fn add(&mut self, column: &[f64]) {
        for x in column {
            let is_number = !x.is_nan();
            self.none += u64::from(!is_number);
            self.infinite += u64::from(x.is_infinite());
            self.adjacent += u64::from(is_number && self.last);
            self.last = is_number;
        }
    }

    /// Whether a channel is slower than others: it has numbers in less than half of the rows, and rarely in two consecutive ones.
    fn is_slower(&self, rows: u64) -> bool {
        let present = rows - self.none;
        present > 0 && 2 * present <= rows && self.adjacent as f64 <= ADJACENT * present as f64
    }
}

/// A group of channels with one clock while it is read.
pub(super) struct GroupReader {
    timing: Timing,
    /// Usual time between rows, s.
    step: f64,
    /// Time of the first row, s.
    pub first: f64,
    /// Time of the last row, s.
    pub last: f64,
    pub rows: u64,
    section: usize,
    gaps: usize,
    jumps: usize,
    repeated: u64,
    /// For each channel.
    missing: Vec<Missing>,
    windows: Windows,
    /// Positions of the channels among all slots.
    pub slots: Vec<usize>,
    /// Harmonics of angles, after the channels: the channel, order n, and whether it is the sine.
    harmonics: Vec<(usize, f64, bool)>,
    derived: Vec<Vec<f64>>,
    /// For each channel the number of samples whose mean is subtracted, the number read so far, and their mean.
    zeros: Vec<(usize, f64, f64)>,
}

/// The usual time between rows; zero if the time never advances.
pub(super) fn median_step(times: &[f64]) -> f64 {
    median(times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect()).unwrap_or(0.0)
}

pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

impl GroupReader {
    /// `block` is the first one; `slots` are the positions of the channels among all, then those of the harmonics.
    pub fn new(
        timing: Timing,
        block: &Block,
        windows: Windows,
        channels: &[&MappedChannel],
        (slots, harmonics): (Vec<usize>, Vec<(usize, f64, bool)>),
    ) -> Self {
        Self {
            derived: vec![Vec::new(); harmonics.len()],
            harmonics,
            timing,
            step: match timing.clock {
                Clock::Step(step) => step,
                Clock::Channel(..) => median_step(&block.columns[0]),
            },
            first: timing.start(block),
            last: f64::NEG_INFINITY,
            rows: 0,
            section: 0,
            gaps: 0,
            jumps: 0,
            repeated: 0,
            missing: vec![Missing::default(); channels.len()],
            windows,
            slots,
            zeros: channels.iter().map(|one| (one.zero_samples, 0.0, 0.0)).collect(),
        }
    }

    /// Subtracts from channels the mean of their first samples.
    fn zero(&mut self, columns: &mut [Vec<f64>]) {
        for ((count, samples, mean), column) in self.zeros.iter_mut().zip(columns) {
            if *count == 0 {
                continue;
            }
            for x in column.iter().filter(|x| x.is_finite()) {
                if *samples >= *count as f64 {
                    break;
                }
                *samples += 1.0;
                *mean += (x - *mean) / *samples;
            }
            column.iter_mut().for_each(|x| *x -= *mean);
        }
    }

    /// Computes the harmonics of angles.
    fn derive(&mut self, columns: &[Vec<f64>]) {
        for (&(channel, order, sine), out) in self.harmonics.iter().zip(&mut self.derived) {
            let of = |angle: &f64| if sine { sin(order * angle) } else { cos(order * angle) };
            out.clear();
            out.extend(columns[channel].iter().map(of));
        }
    }

    /// Adds the rows of a block.
    pub fn add(&mut self, block: &mut Block, slots: usize, windows: &mut SlotWindows, remarks: &mut Vec<String>) {
        let first_column = self.timing.first_column();
        for (missing, column) in self.missing.iter_mut().zip(&block.columns[first_column..]) {
            missing.add(column);
        }
        self.zero(&mut block.columns[first_column..]);
        self.derive(&block.columns[first_column..]);
        let rows = block.rows;
        let made: Vec<f64>;
        let times: &[f64] = match self.timing.clock {
            Clock::Channel(..) => &block.columns[0],
            Clock::Step(step) => {
                made = (0..rows).map(|k| self.timing.offset + (self.rows + k as u64) as f64 * step).collect();
                &made
            }
        };
        let columns: Vec<&[f64]> =
            block.columns[first_column..].iter().chain(&self.derived).map(Vec::as_slice).collect();
        let mut parts: Vec<&[f64]> = vec![&[]; columns.len()];
        let mut from = 0;
        while from < rows {
            // As far as the time increases.
            let mut to = from;
            while to < rows {
                let t = times[to];
                if !(t > self.last) {
                    break;
                }
                if self.last.is_finite() && self.step > 0.0 && t - self.last > GAP * self.step {
                    self.gaps += 1;
                    if self.gaps <= MOST_REMARKS {
                        remarks.push(format!("a gap of {:.3} s after {:.3} s", t - self.last, self.last));
                    }
                }
                self.last = t;
                to += 1;
            }
            parts.iter_mut().zip(&columns).for_each(|(part, column)| *part = &column[from..to]);
            let (section, own) = (self.section, &self.slots);
            self.windows.add(&times[from..to], &parts, &mut stored(windows, section, slots, own));
            from = to;
            if from < rows {
                let t = times[from];
                if t < self.last {
                    self.jumps += 1;
                    if self.jumps <= MOST_REMARKS {
                        let row = self.rows + from as u64 + 1;
                        remarks.push(format!("the clock jumps back by {:.3} s at row {row} ({t:.3} s)", self.last - t));
                    }
                    self.windows.finish(&mut stored(windows, section, slots, own));
                    self.section += 1;
                    self.last = f64::NEG_INFINITY;
                } else {
                    // The same time again, or none.
                    self.repeated += 1;
                    from += 1;
                }
            }
        }
        self.rows += rows as u64;
    }

    /// The remark about readings of a channel that are not numbers, and whether they are so many that its log counts as damaged.
    pub fn lacks(&self, channel: usize) -> Option<(String, bool)> {
        let missing = &self.missing[channel];
        let none = if missing.is_slower(self.rows) { 0 } else { missing.none };
        let text = match (none, missing.infinite) {
            (0, 0) => return None,
            (0, infinite) => format!("is infinite in {infinite} of {} rows, which kardan omits", self.rows),
            (none, 0) => format!("has no number in {none} of {} rows, which kardan omits", self.rows),
            (none, infinite) => format!(
                "has no number in {none} of {} rows and is infinite in {infinite}, which kardan omits",
                self.rows
            ),
        };
        Some((text, (none + missing.infinite) as f64 > MISSING * self.rows as f64))
    }

    /// Ends the windows, and reports errors of the clock.
    pub fn finish(&mut self, slots: usize, windows: &mut SlotWindows, read: &mut LogRead) {
        let remarks = &mut read.remarks;
        let mut clock_issues: Vec<String> = read.clock.take().into_iter().collect();
        let (section, own) = (self.section, &self.slots);
        self.windows.finish(&mut stored(windows, section, slots, own));
        if self.gaps > MOST_REMARKS {
            remarks.push(format!("{} gaps in total", self.gaps));
        }
        if self.jumps > MOST_REMARKS {
            remarks.push(format!("{} jumps of the clock in total", self.jumps));
        }
        if self.jumps > 0 {
            clock_issues.push(format!(
                "jumps back {}",
                if self.jumps == 1 { "once".into() } else { format!("{} times", self.jumps) }
            ));
        }
        // Milliseconds or nanoseconds without a declared unit.
        if self.first.abs() > LATE || self.step >= SLOW {
            clock_issues.push("may not be in seconds".into());
            remarks.push(format!(
                "the clock begins at {:.6} s with a row every {:.3e} s: if its unit is not seconds, set `time_unit` in \
                 `[log.NAME]`",
                self.first, self.step
            ));
        }
        if self.repeated > 0 {
            clock_issues.push(format!("does not advance or is missing in {} rows", self.repeated));
            remarks.push(format!(
                "{} rows repeat the time of the row before, or have none: kardan omits them",
                self.repeated
            ));
        }
        read.clock = (!clock_issues.is_empty()).then(|| clock_issues.join(", "));
    }
}

/// What stores the readings of a window of a section in their slots.
fn stored<'a>(
    windows: &'a mut SlotWindows,
    section: usize,
    slots: usize,
    own: &'a [usize],
) -> impl FnMut(i64, &[Reading]) + 'a {
    move |number, readings| {
        let row = windows.entry((section, number)).or_insert_with(|| vec![Reading::MISSING; slots]);
        own.iter().zip(readings).for_each(|(&slot, reading)| row[slot] = *reading);
    }
}
