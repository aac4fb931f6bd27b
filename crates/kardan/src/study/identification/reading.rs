//! Logs to windows: streamed, each channel in its own rate, joined by time.

use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::sync_channel;

use super::channels::{Clock, OpenLog, Quantity};
use crate::identify::{Reading, Windows};
use crate::results::{ChannelRead, LogRead, Span};
use kardan_tables::read::{Block, Bytes, Log, LogError, ReadSeek};

/// A time between rows is a gap from so many usual ones on.
const GAP: f64 = 5.0;
/// A clock that begins later (s, some 3000 years), or is slower (s), is doubted.
const LATE: f64 = 1e11;
const SLOW: f64 = 0.5;
/// Remarks of one kind that are told in full.
const TOLD: usize = 3;
/// Blocks that are looked at for the rates of the channels.
const LOOKED_AT: usize = 16;
/// Samples of the slowest channel in a window.
const SAMPLES: f64 = 50.0;

/// All that was recorded together, in windows: for each the readings of the slots.
pub(super) struct Recording {
    /// By section (after clock jumps) and number.
    pub windows: BTreeMap<(usize, i64), Vec<Reading>>,
    /// Start of window 0, s.
    pub origin: f64,
    pub logs: Vec<LogRead>,
    /// Noise of a sample in each slot, SI; whether it was stated.
    pub noise: Vec<(f64, bool)>,
}

/// Bytes that count what was read of them.
pub(super) struct Counted {
    inner: Arc<dyn Bytes>,
    read: Arc<AtomicU64>,
}

struct Counting {
    inner: Box<dyn ReadSeek>,
    read: Arc<AtomicU64>,
}

impl Read for Counting {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.read.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl Seek for Counting {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.inner.seek(to)
    }
}

impl Bytes for Counted {
    fn open(&self) -> std::io::Result<Box<dyn ReadSeek>> {
        Ok(Box::new(Counting { inner: self.inner.open()?, read: Arc::clone(&self.read) }))
    }
}

impl Counted {
    pub fn new(inner: Arc<dyn Bytes>) -> (Arc<Self>, Arc<AtomicU64>) {
        let read = Arc::new(AtomicU64::new(0));
        (Arc::new(Self { inner, read: Arc::clone(&read) }), read)
    }
}

/// The columns that are read of each group: the time first, then the channels.
fn columns(open: &OpenLog, group: usize) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    if let Some(Clock::Channel(channel, _)) = open.clocks[group] {
        out.push((group, channel));
    }
    out.extend(open.wired.iter().filter(|one| one.group == group).map(|one| (group, one.channel)));
    out
}

fn wanted(open: &OpenLog) -> Vec<(usize, usize)> {
    (0..open.clocks.len()).flat_map(|group| columns(open, group)).collect()
}

/// The width of the windows: 50 samples of the slowest channel, as the first rows show it.
pub(super) fn usual_window(logs: &mut [OpenLog]) -> Result<f64, (String, LogError)> {
    let mut slowest = 0.0_f64;
    for open in logs {
        let wanted = wanted(open);
        let fail = |error| (open.name.clone(), error);
        // A reader of its own: the one of the log stays at its start.
        let mut log = kardan_tables::read::open(Arc::clone(&open.file), &open.options).map_err(fail)?;
        log.choose(&wanted).map_err(fail)?;
        let mut block = Block::default();
        let mut seen = vec![false; open.clocks.len()];
        for _ in 0..LOOKED_AT {
            match log.next(&mut block) {
                Ok(true) => {}
                _ => break,
            }
            let Some(clock) = open.clocks.get(block.group).copied().flatten() else { continue };
            if std::mem::replace(&mut seen[block.group], true) || block.rows < 2 {
                continue;
            }
            let (first, row) = match clock {
                Clock::Step(step) => (0, step),
                Clock::Channel(_, factor) => (1, median_step(&block.columns[0]) * factor),
            };
            for column in &block.columns[first..] {
                let there = column.iter().filter(|x| x.is_finite()).count();
                if there > 0 {
                    slowest = slowest.max(row * block.rows as f64 / there as f64);
                }
            }
        }
    }
    Ok(if slowest > 0.0 { SAMPLES * slowest } else { 0.05 })
}

fn median_step(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    if steps.is_empty() {
        return 0.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// What is known of the clock of a group while it is read.
struct Ticking {
    clock: Clock,
    step: f64,
    last: f64,
    row: u64,
    section: usize,
    gaps: usize,
    jumps: usize,
    repeated: u64,
    first: f64,
    windows: Windows,
    slots: Vec<usize>,
    zeros: Vec<(usize, f64, f64)>,
}

/// Reads logs that were recorded together. `slots` are the quantities asked for; `progress` hears the part of the bytes read and says
/// whether that is enough.
pub(super) fn read(
    logs: Vec<OpenLog>,
    slots: &[Quantity],
    width: f64,
    bytes: &dyn Fn() -> f64,
    progress: &dyn Fn(f64) -> bool,
) -> Result<Recording, (String, LogError)> {
    let mut out = Recording {
        windows: BTreeMap::new(),
        origin: f64::NAN,
        logs: Vec::new(),
        noise: vec![(0.0, false); slots.len()],
    };
    for mut open in logs {
        let name = open.name.clone();
        open.log.choose(&wanted(&open)).map_err(|error| (name.clone(), error))?;
        let mut read = LogRead { name: name.clone(), ..LogRead::default() };
        let mut ticking: Vec<Option<Ticking>> = (0..open.clocks.len()).map(|_| None).collect();
        let OpenLog { mut log, wired, clocks, offset, .. } = open;
        let mut failed = None;
        let mut smooth = |block: &mut Block| {
            let group = block.group;
            let Some(clock) = clocks.get(group).copied().flatten() else { return true };
            let own: Vec<_> = wired.iter().filter(|one| one.group == group).collect();
            let first_column = usize::from(matches!(clock, Clock::Channel(..)));
            for (column, wired) in block.columns[first_column..].iter_mut().zip(&own) {
                if wired.factor != 1.0 {
                    column.iter_mut().for_each(|x| *x *= wired.factor);
                }
            }
            if let Clock::Channel(_, factor) = clock {
                block.columns[0].iter_mut().for_each(|t| *t = *t * factor + offset);
            }
            read.rows += block.rows as u64;
            let slots_of = || {
                own.iter()
                    .map(|one| slots.iter().position(|slot| *slot == one.quantity).expect("a slot for each channel"))
                    .collect::<Vec<_>>()
            };
            let tick = ticking[group].get_or_insert_with(|| {
                let start = match clock {
                    Clock::Channel(..) => block.columns[0].iter().copied().find(|t| t.is_finite()).unwrap_or(0.0),
                    Clock::Step(_) => offset,
                };
                if out.origin.is_nan() {
                    out.origin = start;
                }
                let step = match clock {
                    Clock::Step(step) => step,
                    Clock::Channel(..) => median_step(&block.columns[0]),
                };
                Ticking {
                    clock,
                    step,
                    last: f64::NEG_INFINITY,
                    row: 0,
                    section: 0,
                    gaps: 0,
                    jumps: 0,
                    repeated: 0,
                    first: start,
                    windows: Windows::new(width, out.origin, own.len()),
                    slots: slots_of(),
                    zeros: own.iter().map(|one| (one.zero_samples, 0.0, 0.0)).collect(),
                }
            });
            tick.zero(&mut block.columns[first_column..]);
            tick.block(block, first_column, offset, slots.len(), &mut out.windows, &mut read.remarks);
            !progress(bytes())
        };
        stream(&mut *log, &mut smooth, &mut |error| failed = failed.take().or(Some(error)));
        for (group, tick) in ticking.iter_mut().enumerate() {
            let Some(tick) = tick else { continue };
            tick.finish(slots.len(), &mut out.windows, &mut read);
            let before = read.span.unwrap_or(Span { from: tick.first, until: tick.last });
            read.span = Some(Span { from: before.from.min(tick.first), until: before.until.max(tick.last) });
            let names = wired.iter().filter(|one| one.group == group);
            for (slot, one) in tick.slots.iter().zip(names) {
                if let Some(noise) = one.noise {
                    out.noise[*slot] = (noise, true);
                }
                read.channels.push(ChannelRead {
                    signal: one.quantity.signal(),
                    si: one.quantity.unit(),
                    sample_time: (tick.last - tick.first) / (tick.row.max(2) - 1) as f64,
                    ..ChannelRead::default()
                });
            }
        }
        read.remarks.extend(log.notes());
        let mut damage = log.damage();
        for (channel, one) in read.channels.iter_mut().zip(wired_in_order(&wired, &ticking)) {
            let named = &log.groups()[one.group].channels[one.channel];
            channel.name.clone_from(&named.name);
            channel.unit.clone_from(&named.unit);
        }
        if let Some(error) = failed {
            if read.rows == 0 {
                return Err((name, error));
            }
            damage.insert(0, format!("{} rows of it are used", read.rows));
            read.remarks.push(format!("{error}; the {} rows before it are used", read.rows));
        }
        read.damage = (!damage.is_empty()).then(|| damage.join(", "));
        out.logs.push(read);
    }
    // Noise that nobody stated: the median over the windows.
    for slot in 0..slots.len() {
        if out.noise[slot].1 {
            continue;
        }
        let seen = out.windows.values().map(|row| row[slot].noise).filter(|noise| noise.is_finite());
        let mut seen: Vec<f64> = seen.collect();
        if !seen.is_empty() {
            let middle = seen.len() / 2;
            out.noise[slot].0 = *seen.select_nth_unstable_by(middle, f64::total_cmp).1;
        }
    }
    Ok(out)
}

/// More damaged places of one log are not looked at.
const DAMAGED: usize = 100;

/// All blocks of a log, one after the other, until `smooth` has enough: where a thread can wait, one reads while the other one smooths. A worker of the pool that
/// readers share work in must not wait for them: there it is done in turn.
fn stream(log: &mut dyn Log, smooth: &mut dyn FnMut(&mut Block) -> bool, failed: &mut dyn FnMut(LogError)) {
    if rayon::current_thread_index().is_some() {
        let (mut block, mut damaged) = (Block::default(), 0);
        while damaged < DAMAGED {
            match log.next(&mut block) {
                Ok(true) => {
                    if !smooth(&mut block) {
                        return;
                    }
                }
                Ok(false) => return,
                Err(error) => {
                    damaged += 1;
                    failed(error);
                }
            }
        }
        return;
    }
    let (full, filled) = sync_channel::<Result<Block, LogError>>(2);
    let (empty, emptied) = sync_channel::<Block>(4);
    for _ in 0..3 {
        let _ = empty.send(Block::default());
    }
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut damaged = 0;
            while let Ok(mut block) = emptied.recv() {
                // What is damaged may be one group of several.
                let next = loop {
                    match log.next(&mut block) {
                        Ok(true) => break Some(block),
                        Ok(false) => break None,
                        Err(error) => {
                            damaged += 1;
                            if full.send(Err(error)).is_err() || damaged == DAMAGED {
                                break None;
                            }
                        }
                    }
                };
                let Some(block) = next else { break };
                if full.send(Ok(block)).is_err() {
                    break;
                }
            }
        });
        for block in filled {
            match block {
                Ok(mut block) => {
                    if !smooth(&mut block) {
                        break; // the one that reads finds nobody to send to
                    }
                    let _ = empty.send(block);
                }
                Err(error) => failed(error),
            }
        }
        drop(empty); // nothing is read any more
    });
}

fn wired_in_order<'a>(
    wired: &'a [super::channels::Wired],
    ticking: &'a [Option<Ticking>],
) -> impl Iterator<Item = &'a super::channels::Wired> {
    let groups = ticking.iter().enumerate().filter(|(_, tick)| tick.is_some()).map(|(group, _)| group);
    groups.flat_map(move |group| wired.iter().filter(move |one| one.group == group))
}

impl Ticking {
    /// Subtracts from channels the mean of their first samples.
    fn zero(&mut self, columns: &mut [Vec<f64>]) {
        for ((count, taken, mean), column) in self.zeros.iter_mut().zip(columns) {
            if *count == 0 {
                continue;
            }
            for x in column.iter().filter(|x| x.is_finite()) {
                if *taken >= *count as f64 {
                    break;
                }
                *taken += 1.0;
                *mean += (x - *mean) / *taken;
            }
            column.iter_mut().for_each(|x| *x -= *mean);
        }
    }

    fn block(
        &mut self,
        block: &Block,
        first_column: usize,
        offset: f64,
        slots: usize,
        windows: &mut BTreeMap<(usize, i64), Vec<Reading>>,
        remarks: &mut Vec<String>,
    ) {
        let rows = block.rows;
        let made: Vec<f64>;
        let times: &[f64] = match self.clock {
            Clock::Channel(..) => &block.columns[0],
            Clock::Step(step) => {
                made = (0..rows).map(|k| offset + (self.row + k as u64) as f64 * step).collect();
                &made
            }
        };
        let columns: Vec<&[f64]> = block.columns[first_column..].iter().map(Vec::as_slice).collect();
        let mut parts: Vec<&[f64]> = vec![&[]; columns.len()];
        let mut from = 0;
        while from < rows {
            // As far as the time goes on.
            let mut to = from;
            while to < rows {
                let t = times[to];
                if !(t > self.last) {
                    break;
                }
                if self.last.is_finite() && self.step > 0.0 && t - self.last > GAP * self.step {
                    self.gaps += 1;
                    if self.gaps <= TOLD {
                        remarks.push(format!("a gap of {:.3} s after {:.3} s", t - self.last, self.last));
                    }
                }
                self.last = t;
                to += 1;
            }
            parts.iter_mut().zip(&columns).for_each(|(part, column)| *part = &column[from..to]);
            let (section, own) = (self.section, &self.slots);
            self.windows.add(&times[from..to], &parts, &mut |k, readings| {
                keep(windows, section, k, slots, own, readings);
            });
            from = to;
            if from < rows {
                let t = times[from];
                if t < self.last {
                    self.jumps += 1;
                    if self.jumps <= TOLD {
                        let row = self.row + from as u64 + 1;
                        remarks.push(format!("the clock jumps back by {:.3} s at row {row} ({t:.3} s)", self.last - t));
                    }
                    self.windows.finish(&mut |k, readings| keep(windows, section, k, slots, own, readings));
                    self.section += 1;
                    self.last = f64::NEG_INFINITY;
                } else {
                    // The same time again, or none.
                    self.repeated += 1;
                    from += 1;
                }
            }
        }
        self.row += rows as u64;
    }

    fn finish(&mut self, slots: usize, windows: &mut BTreeMap<(usize, i64), Vec<Reading>>, read: &mut LogRead) {
        let remarks = &mut read.remarks;
        let mut doubts: Vec<String> = read.clock.take().into_iter().collect();
        let (section, own) = (self.section, &self.slots);
        self.windows.finish(&mut |k, readings| keep(windows, section, k, slots, own, readings));
        if self.gaps > TOLD {
            remarks.push(format!("{} gaps in all", self.gaps));
        }
        if self.jumps > TOLD {
            remarks.push(format!("{} jumps of the clock in all", self.jumps));
        }
        if self.jumps > 0 {
            doubts.push(format!(
                "jumps back {}",
                if self.jumps == 1 { "once".into() } else { format!("{} times", self.jumps) }
            ));
        }
        // Milliseconds or nanoseconds that nobody called so.
        if self.first.abs() > LATE || self.step >= SLOW {
            doubts.push("may not be in seconds".into());
            remarks.push(format!(
                "the clock begins at {:.6} s with a row every {:.3e} s: if its numbers are no seconds, say so with `time_unit` in \
                 `[log.NAME]`",
                self.first, self.step
            ));
        }
        if self.repeated > 0 {
            doubts.push(format!("stands still or is missing in {} rows", self.repeated));
            remarks.push(format!("{} rows repeat the time of the row before, or have none: left out", self.repeated));
        }
        read.clock = (!doubts.is_empty()).then(|| doubts.join(", "));
    }
}

fn keep(
    windows: &mut BTreeMap<(usize, i64), Vec<Reading>>,
    section: usize,
    number: i64,
    slots: usize,
    own: &[usize],
    readings: &[Reading],
) {
    let row = windows.entry((section, number)).or_insert_with(|| vec![Reading::MISSING; slots]);
    own.iter().zip(readings).for_each(|(&slot, reading)| row[slot] = *reading);
}
