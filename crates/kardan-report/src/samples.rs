//! The runs of a sweep as points of a page: which of them, and how they are written.

mod still;

use std::collections::BTreeSet;

use super::text::{json_array, json_string, powers};
use kardan_results::{DisplayUnit, Sweep, SweepHead, SweepRequirement, SweepRow, SweepRows};

/// More runs are not drawn.
const MOST: usize = 100_000;
/// Nor more numbers: a page of 100 columns has fewer runs.
const MOST_NUMBERS: usize = 4_000_000;
/// The word for a verdict that a run does not have.
const NONE: u8 = 2;

/// Runs that a page draws. If there are too many it draws those of least and largest numbers, and of the others equally many failing and passing runs, if
/// there are enough, at random as determined by the seed and the numbers of samples.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    head: SweepHead,
    drawn_rows: Vec<SweepRow>,
    all: usize,
    failing: usize,
}

/// How to rerun a run: its command is `command`, then the file of its block, its number, and its variant.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Again {
    /// The command up to the file of rows.
    pub command: String,
    /// Samples of a block.
    pub block: u64,
    /// Files of rows, as words for a shell, by blocks; empty where there is none.
    pub files: Vec<String>,
    /// Variants, as words for a shell; none where there is but one.
    pub variants: Vec<String>,
    /// The page with the full runs of the worst cases beside this one, or why there is none; `None` where none was to be made.
    pub full: Option<Result<String, String>>,
}

impl Again {
    /// The command that runs a sample in a variant again.
    pub fn of(&self, sample: u64, variant: usize) -> Option<String> {
        let block = usize::try_from(sample / self.block.max(1)).ok()?;
        let file = self.files.get(block).filter(|file| !file.is_empty())?;
        let variant = self.variants.get(variant).map(|name| format!(" --variant {name}")).unwrap_or_default();
        Some(format!("{} {file} --sample {sample}{variant}", self.command))
    }
}

impl Samples {
    /// The rows that the page of a sweep with these results draws.
    pub fn new(head: &SweepHead, found: &Sweep, rows: &SweepRows) -> Self {
        let columns = head.varied.len() + 2 * head.requirements.len() + head.figures.len() + 1;
        let measured = found.requirements.iter().map(|one| &one.measured);
        let ends =
            measured.chain(found.figures.iter().map(|one| &one.values)).filter_map(|values| values.extreme_samples);
        let always_drawn: BTreeSet<u64> = ends.flatten().chain(found.worst.iter().map(|worst| worst.sample)).collect();
        Self::at_most(MOST.min(MOST_NUMBERS / columns), head, &always_drawn, rows)
    }

    fn at_most(most: usize, head: &SweepHead, always_drawn: &BTreeSet<u64>, rows: &SweepRows) -> Self {
        let (all, failing) = (rows.len(), rows.iter().filter(|row| fails(row.reason, row.passed)).count());
        let drawn = (all > most).then(|| drawn(most, head.seed, always_drawn, rows));
        let is_drawn = |number: usize| drawn.as_ref().is_none_or(|drawn| drawn[number]);
        let own = rows.iter().enumerate().filter(|(number, _)| is_drawn(*number));
        let mut drawn_rows: Vec<SweepRow> = own.map(|(_, row)| row.to_row()).collect();
        drawn_rows.sort_unstable_by_key(|row| (row.sample, row.variant));
        Self { head: head.clone(), drawn_rows, all, failing }
    }

    /// Which runs are drawn, in words.
    pub fn describe(&self) -> String {
        let (drawn, failing) =
            (self.drawn_rows.len(), self.drawn_rows.iter().filter(|row| fails(&row.reason, &row.passed)).count());
        if drawn == self.all {
            return format!("All {drawn} runs, {failing} of which fail a requirement or did not complete.");
        }
        let fate = if failing == self.failing {
            format!("all {failing} that fail")
        } else {
            format!("{failing} of {} that fail, at random", self.failing)
        };
        let passing = drawn - failing;
        format!(
            "{drawn} of {} runs are drawn: {fate}, and {passing} of {} others, at random; those of least and largest numbers are among them. \
             The density of points does not show how likely failures are: the tables count all runs.",
            self.all,
            self.all - self.failing
        )
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.drawn_rows.is_empty()
    }

    /// The axes drawn first: the number with most values, over the parameter that explains most of it; indices among all columns.
    fn first(&self, found: &Sweep) -> (usize, usize) {
        let SweepHead { varied, requirements, .. } = &self.head;
        let numbers = varied.len();
        let place = |text: &str| requirements.iter().position(|one| one.text == text);
        let explained = found.requirements.iter().filter_map(|one| Some((place(&one.text)?, &one.measured)));
        let figures = found.figures.iter().filter_map(|figure| {
            let k = self.head.figures.iter().position(|(name, _)| *name == figure.name)?;
            Some((requirements.len() + k, &figure.values))
        });
        let explained_axes = explained.chain(figures).find_map(|(k, values)| {
            let most = values.shares.first()?;
            let across = varied.iter().position(|one| one.name == most.parameter)?;
            Some((across, numbers + k))
        });
        let sought = found.worst.iter().map(|one| &one.text).chain(found.rare.iter().map(|one| &one.text));
        let sought = sought.filter_map(|text| place(text)).map(|k| (0, numbers + k)).next();
        let last = numbers + requirements.len() + self.head.figures.len() - 1;
        explained_axes.or(sought).unwrap_or((0, numbers.min(last)))
    }

    /// What the script of the page draws, as JSON: `columns` of 32-bit floats behind `from`, in the unit that is shown, `requirements` with their
    /// bounds and verdicts, `sample`, `ended`, `variant`; arrays are little-endian, in base64.
    pub fn data(&self, found: &Sweep, again: &Again) -> String {
        let head = &self.head;
        let mut columns = Vec::new();
        for (k, one) in head.varied.iter().enumerate() {
            columns.push(self.column("parameter", (&one.name, &one.unit, None), |row| row.values[k]));
        }
        let mut requirements = Vec::new();
        for (k, one) in head.requirements.iter().enumerate() {
            let display = one.display.as_ref();
            let bound = |bound: Option<f64>| bound.map_or("null".into(), |bound| exact(shown(bound, display)));
            let passed: Vec<u8> = self.drawn_rows.iter().map(|row| verdict(row.passed[k])).collect();
            requirements.push(format!(
                "{{\"text\":{},\"column\":{},\"below\":{},\"above\":{},\"passed\":\"{}\"}}",
                json_string(&powers(&one.text)),
                columns.len(),
                bound(one.below),
                bound(one.above),
                base64(&passed)
            ));
            columns.push(self.column("measured", (self.name(one), &one.unit, display), |row| row.measured[k]));
        }
        for (k, (name, unit)) in head.figures.iter().enumerate() {
            columns.push(self.column("figure", (name, unit, display_of_figure(found, name)), |row| row.figures[k]));
        }
        let (across, up) = self.first(found);
        let bytes = |of: &dyn Fn(&SweepRow) -> u32| -> Vec<u8> {
            self.drawn_rows.iter().flat_map(|row| of(row).to_le_bytes()).collect()
        };
        let ended: Vec<u8> = self.drawn_rows.iter().map(|row| u8::from(row.reason.is_empty())).collect();
        let several = head.variants.len() > 1;
        format!(
            "{{\"count\":{},\"across\":{across},\"up\":{up},\"sample\":\"{}\",\"ended\":\"{}\",\"variants\":{},\"variant\":\"{}\",\"columns\":{},\
             \"requirements\":{},\"again\":{{\"command\":{},\"block\":{},\"files\":{},\"variants\":{}}}}}",
            self.drawn_rows.len(),
            base64(&bytes(&|row| u32::try_from(row.sample).unwrap_or(u32::MAX))),
            base64(&ended),
            json_array(head.variants.iter().map(|name| json_string(name))),
            if several { base64(&bytes(&|row| row.variant as u32)) } else { String::new() },
            json_array(columns),
            json_array(requirements),
            json_string(&again.command),
            again.block.max(1),
            json_array(again.files.iter().map(|file| json_string(file))),
            json_array(again.variants.iter().map(|name| json_string(name)))
        )
    }

    /// The quantity that a requirement measures; the full text if another one measures the same.
    fn name<'s>(&self, one: &'s SweepRequirement) -> &'s str {
        let same = self.head.requirements.iter().filter(|candidate| candidate.measured == one.measured).count();
        if same > 1 { &one.text } else { &one.measured }
    }

    fn column(
        &self,
        kind: &str,
        (name, unit, display): (&str, &str, Option<&DisplayUnit>),
        value: impl Fn(&SweepRow) -> f64,
    ) -> String {
        let values: Vec<f64> = self.drawn_rows.iter().map(|row| shown(value(row), display)).collect();
        let least = values.iter().copied().filter(|x| x.is_finite()).fold(f64::INFINITY, f64::min);
        // Small differences of large numbers have their digits too.
        let from = if least.is_finite() { least } else { 0.0 };
        let bytes: Vec<u8> = values.iter().flat_map(|x| ((x - from) as f32).to_le_bytes()).collect();
        format!(
            "{{\"kind\":\"{kind}\",\"name\":{},\"unit\":{},\"from\":{},\"data\":\"{}\"}}",
            json_string(&powers(name)),
            json_string(&powers(display.map_or(unit, |display| display.unit.as_str()))),
            exact(from),
            base64(&bytes)
        )
    }
}

/// The unit in which a figure is shown, where that is not the SI unit.
fn display_of_figure<'a>(found: &'a Sweep, name: &str) -> Option<&'a DisplayUnit> {
    found.figures.iter().find(|one| one.name == name)?.display.as_ref()
}

/// Which rows are drawn, so many of them.
fn drawn(most: usize, seed: u64, always_drawn: &BTreeSet<u64>, rows: &SweepRows) -> Vec<bool> {
    let mut groups: [Vec<(u64, usize, usize)>; 3] = Default::default();
    for (k, row) in rows.iter().enumerate() {
        let group = match (always_drawn.contains(&row.sample), fails(row.reason, row.passed)) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => 2,
        };
        groups[group].push((lot(seed, row.sample), row.variant, k));
    }
    let [own, failing, holding] = &groups;
    let free = most.saturating_sub(own.len());
    let of_failing = failing.len().min(free - holding.len().min(free / 2));
    let mut selected = vec![false; rows.len()];
    for (group, count) in groups.iter_mut().zip([most, of_failing, free - of_failing]) {
        if count < group.len() {
            group.select_nth_unstable(count);
            group.truncate(count);
        }
        group.iter().for_each(|&(_, _, k)| selected[k] = true);
    }
    selected
}

/// A number in the unit that is shown.
fn shown(value: f64, display: Option<&DisplayUnit>) -> f64 {
    display.map_or(value, |display| display.of(value))
}

/// Whether a run did not complete, or fails a requirement.
fn fails(reason: &str, passed: &[f64]) -> bool {
    !reason.is_empty() || passed.iter().any(|&passed| passed < 0.5)
}

fn verdict(passed: f64) -> u8 {
    if passed.is_nan() { NONE } else { u8::from(passed > 0.5) }
}

/// A random number determined by the seed and the number (SplitMix64: Steele, Lea, Flood, OOPSLA 2014).
fn lot(seed: u64, number: u64) -> u64 {
    let mixed = |x: u64| {
        let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    mixed(mixed(seed) ^ number)
}

/// A number as JSON, to the last bit.
fn exact(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { "null".into() }
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |k: usize| u32::from(chunk.get(k).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let digit = char::from(ALPHABET[(word >> (18 - 6 * k)) as usize & 63]);
            out.push(if k <= chunk.len() { digit } else { '=' });
        }
    }
    out
}

#[cfg(test)]
#[path = "../tests/unit/samples.rs"]
mod tests;
