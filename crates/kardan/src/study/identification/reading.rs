//! Logs to windows: streamed, each channel at its own rate, joined by time.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::channels::{Harmonic, MappedChannel, Quantity};
use super::clocks::Clock;
use super::group_reader::{GroupReader, SlotWindows, Timing, median, median_step};
use super::open_log::{OpenLog, log_error};
use super::recordings::base;
use super::stream::stream;
use kardan_identify::Windows;
use kardan_results::{ChannelRead, LogRead, Span};
use kardan_schema::diagnostics::Diagnostic;
use kardan_tables::read::{Block, Group};

/// Blocks examined for the rates of the channels.
const LOOKED_AT: usize = 16;
/// Samples of the slowest channel in a window.
const SAMPLES: f64 = 50.0;

/// All channels recorded together, in windows: for each the readings of the slots.
pub(super) struct Recording {
    pub windows: SlotWindows,
    /// Start of window 0, s.
    pub origin: f64,
    pub logs: Vec<LogRead>,
    /// Noise of a sample in each slot, SI; whether it was stated.
    pub noise: Vec<(f64, bool)>,
}

/// The columns that are read, group by group: the time first, then the channels.
fn selection(open: &OpenLog) -> Vec<(usize, usize)> {
    let columns = |(group, clock): (usize, &Option<Clock>)| {
        let time = if let Some(Clock::Channel(channel, _)) = clock { Some((group, *channel)) } else { None };
        let channels = open.mapped.iter().filter(move |one| one.group == group);
        time.into_iter().chain(channels.map(move |one| (group, one.channel)))
    };
    open.clocks.iter().enumerate().flat_map(columns).collect()
}

/// Harmonics of the angles among channels: the slot, the number of the channel, the order, and whether it is the sine.
fn harmonics(slots: &[Quantity], channels: &[&MappedChannel]) -> Vec<(usize, (usize, f64, bool))> {
    let of = |(slot, quantity): (usize, &Quantity)| {
        let Quantity::Harmonic(Harmonic { shaft, order, sine }) = quantity else { return None };
        let channel = channels.iter().position(|one| one.quantity.is_angle_of(shaft))?;
        Some((slot, (channel, *order, *sine)))
    };
    slots.iter().enumerate().filter_map(of).collect()
}

/// The width of the windows: 50 samples of the slowest channel, estimated from the first rows.
pub(super) fn usual_window(logs: &[OpenLog]) -> Result<f64, Vec<Diagnostic>> {
    let mut slowest = 0.0_f64;
    for open in logs {
        let selection = selection(open);
        let fail = |error| log_error(&open.name, &error);
        // A reader of its own: the one of the log stays at its start.
        let mut log = kardan_tables::read::open(Arc::clone(&open.file), &open.options).map_err(fail)?;
        log.choose(&selection).map_err(fail)?;
        let mut block = Block::default();
        let mut visited = vec![false; open.clocks.len()];
        for _ in 0..LOOKED_AT {
            match log.next(&mut block) {
                Ok(true) => {}
                _ => break,
            }
            let Some(clock) = open.clocks.get(block.group).copied().flatten() else { continue };
            if std::mem::replace(&mut visited[block.group], true) || block.rows < 2 {
                continue;
            }
            let (first, row) = match clock {
                Clock::Step(step) => (0, step),
                Clock::Channel(_, factor) => (1, median_step(&block.columns[0]) * factor),
            };
            for column in &block.columns[first..] {
                let finite_count = column.iter().filter(|x| x.is_finite()).count();
                if finite_count > 0 {
                    slowest = slowest.max(row * block.rows as f64 / finite_count as f64);
                }
            }
        }
    }
    Ok(if slowest > 0.0 { SAMPLES * slowest } else { 0.05 })
}

/// Reads logs that were recorded together. `slots` are the requested quantities; `enough` is queried after every block.
pub(super) fn read(
    logs: Vec<OpenLog>,
    slots: &[Quantity],
    width: f64,
    enough: &dyn Fn() -> bool,
) -> Result<Recording, Vec<Diagnostic>> {
    let mut out = Recording {
        windows: BTreeMap::new(),
        origin: f64::NAN,
        logs: Vec::new(),
        noise: vec![(0.0, false); slots.len()],
    };
    for open in logs {
        out.add(open, slots, width, enough)?;
    }
    out.estimate_noise();
    Ok(out)
}

impl Recording {
    /// The names of its logs, without their folders.
    pub fn name(&self) -> String {
        self.logs.iter().map(|log| base(&log.name)).collect::<Vec<_>>().join(" with ")
    }

    /// Reads a log into the windows.
    fn add(
        &mut self,
        open: OpenLog,
        slots: &[Quantity],
        width: f64,
        enough: &dyn Fn() -> bool,
    ) -> Result<(), Vec<Diagnostic>> {
        let selection = selection(&open);
        let OpenLog { name, mut log, mapped, clocks, offset, .. } = open;
        log.choose(&selection).map_err(|error| log_error(&name, &error))?;
        let mut read = LogRead { name: name.clone(), ..LogRead::default() };
        let mut readers: Vec<Option<GroupReader>> = clocks.iter().map(|_| None).collect();
        let mut failed = None;
        let mut smooth = |block: &mut Block| {
            let Some(clock) = clocks.get(block.group).copied().flatten() else { return true };
            let channels: Vec<&MappedChannel> = mapped.iter().filter(|one| one.group == block.group).collect();
            let timing = Timing { clock, offset };
            timing.to_si(block, &channels);
            read.rows += block.rows as u64;
            let reader = readers[block.group].get_or_insert_with(|| {
                if self.origin.is_nan() {
                    self.origin = timing.start(block);
                }
                let place = |one: &&MappedChannel| slots.iter().position(|slot| *slot == one.quantity);
                let mut places: Vec<usize> =
                    channels.iter().map(|one| place(one).expect("a slot for each channel")).collect();
                let (more, harmonics): (Vec<usize>, Vec<_>) = harmonics(slots, &channels).into_iter().unzip();
                places.extend(more);
                let windows = Windows::new(width, self.origin, places.len());
                GroupReader::new(timing, block, windows, &channels, (places, harmonics))
            });
            reader.add(block, slots.len(), &mut self.windows, &mut read.remarks);
            !enough()
        };
        stream(&mut *log, &mut smooth, &mut |error| failed = failed.take().or(Some(error)));
        let mut damage = log.damage();
        for (group, reader) in readers.iter_mut().enumerate() {
            let Some(reader) = reader else { continue };
            reader.finish(slots.len(), &mut self.windows, &mut read);
            let channels: Vec<&MappedChannel> = mapped.iter().filter(|one| one.group == group).collect();
            damage.extend(self.add_channels(&log.groups()[group], reader, &channels, &mut read));
        }
        read.remarks.extend(log.notes());
        if let Some(error) = failed {
            if read.rows == 0 {
                return Err(log_error(&name, &error));
            }
            damage.insert(0, format!("kardan uses {} rows of it", read.rows));
            read.remarks.push(format!("{error}; kardan uses the {} rows before it", read.rows));
        }
        read.damage = (!damage.is_empty()).then(|| damage.join(", "));
        self.logs.push(read);
        Ok(())
    }

    /// Reports the channels of a group after reading; returns the remarks that count as damage.
    fn add_channels(
        &mut self,
        group: &Group,
        reader: &GroupReader,
        channels: &[&MappedChannel],
        read: &mut LogRead,
    ) -> Vec<String> {
        let mut damage = Vec::new();
        let before = read.span.unwrap_or(Span { start: reader.first, end: reader.last });
        read.span = Some(Span { start: before.start.min(reader.first), end: before.end.max(reader.last) });
        for (number, (slot, one)) in reader.slots.iter().zip(channels).enumerate() {
            if let Some((lacks, is_damage)) = reader.lacks(number) {
                let remark = format!("`{}` {lacks}", group.channels[one.channel].name);
                damage.extend(is_damage.then(|| remark.clone()));
                read.remarks.push(remark);
            }
            if let Some(noise) = one.noise {
                self.noise[*slot] = (noise, true);
            }
            let named = &group.channels[one.channel];
            read.channels.push(ChannelRead {
                name: named.name.clone(),
                unit: named.unit.clone(),
                signal: one.quantity.signal(),
                si: one.quantity.unit(),
                sample_time: (reader.last - reader.first) / (reader.rows.max(2) - 1) as f64,
                ..ChannelRead::default()
            });
        }
        damage
    }

    /// Unstated noise: the median over the windows.
    fn estimate_noise(&mut self) {
        for (slot, (noise, stated)) in self.noise.iter_mut().enumerate() {
            let noises = self.windows.values().map(|row| row[slot].noise).filter(|noise| noise.is_finite());
            if let (false, Some(median)) = (*stated, median(noises.collect())) {
                *noise = median;
            }
        }
    }
}
