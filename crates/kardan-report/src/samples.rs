//! The runs of a sweep as points of a page: which of them, and how they are written.

use std::collections::BTreeSet;

use super::text::{json_array, json_string};
use kardan::results::{DisplayUnit, Sweep, SweepHead, SweepRow};

/// More runs are not drawn.
const MOST: usize = 100_000;
/// Nor more numbers: a page of 100 columns has fewer runs.
const MOST_NUMBERS: usize = 4_000_000;
/// The word for a verdict that a run does not have.
const NONE: u8 = 2;

/// Runs that a page draws. Where there are too many it keeps those of least and largest numbers, then those that fail, then others, by lots that
/// follow from the numbers of samples.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    head: SweepHead,
    told: BTreeSet<u64>,
    most: usize,
    kept: Vec<SweepRow>,
    all: usize,
    failing: usize,
}

/// How a run is made again: its command is `command` with the file of its block behind, and its number.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Again {
    /// The command up to the file of rows.
    pub command: String,
    /// Samples of a block.
    pub block: u64,
    /// Files of rows, as words for a shell, by blocks; empty where there is none.
    pub files: Vec<String>,
    /// The page with the full runs of the worst cases beside this one, if there is one.
    pub full: Option<String>,
}

impl Again {
    /// The command that runs a sample again.
    pub fn of(&self, sample: u64) -> Option<String> {
        let block = usize::try_from(sample / self.block.max(1)).ok()?;
        let file = self.files.get(block).filter(|file| !file.is_empty())?;
        Some(format!("{} {file} --sample {sample}", self.command))
    }
}

impl Samples {
    /// None yet, of a sweep with these answers.
    pub fn new(head: &SweepHead, found: &Sweep) -> Self {
        let columns = head.varied.len() + 2 * head.requirements.len() + head.figures.len() + 1;
        let measured = found.requirements.iter().map(|one| &one.measured);
        let ends = measured.chain(found.figures.iter().map(|one| &one.values)).filter_map(|values| values.ends);
        Self {
            head: head.clone(),
            told: ends.flatten().chain(found.worst.iter().map(|worst| worst.sample)).collect(),
            most: MOST.min(MOST_NUMBERS / columns),
            ..Self::default()
        }
    }

    /// Takes runs.
    pub fn take(&mut self, rows: impl IntoIterator<Item = SweepRow>) {
        for row in rows {
            self.all += 1;
            self.failing += usize::from(fails(&row));
            self.kept.push(row);
            if self.kept.len() >= 2 * self.most {
                self.thin();
            }
        }
    }

    /// Leaves the first ones of [`Self::rank`], whatever order they came in.
    fn thin(&mut self) {
        let mut kept = std::mem::take(&mut self.kept);
        if kept.len() > self.most {
            kept.select_nth_unstable_by_key(self.most, |row| self.rank(row));
            kept.truncate(self.most);
        }
        self.kept = kept;
    }

    fn rank(&self, row: &SweepRow) -> (u8, u64, u64, usize) {
        let group = match (self.told.contains(&row.sample), fails(row)) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => 2,
        };
        (group, lot(row.sample), row.sample, row.variant)
    }

    /// The runs that are drawn, by samples.
    pub fn kept(mut self) -> Self {
        self.thin();
        self.kept.sort_by_key(|row| (row.sample, row.variant));
        self
    }

    /// Which runs are drawn, in words.
    pub fn in_words(&self) -> String {
        let (drawn, failing) = (self.kept.len(), self.kept.iter().filter(|row| fails(row)).count());
        if drawn == self.all {
            return format!("All {drawn} runs, {failing} of which fail a requirement or did not come to their end.");
        }
        let fate = if failing == self.failing {
            format!("all {failing} that fail")
        } else {
            format!("{failing} of {} that fail, by lot", self.failing)
        };
        let others = drawn - failing;
        format!(
            "{drawn} of {} runs are drawn: {fate}, and {others} of {} others, by lot; those of least and largest numbers are among them. \
             Where points lie close does not tell how likely failures are: the tables count all runs.",
            self.all,
            self.all - self.failing
        )
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
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
        for (k, (text, unit)) in head.requirements.iter().enumerate() {
            let told = found.requirements.iter().find(|one| one.text == *text);
            let display = told.and_then(|one| one.display.as_ref());
            let bound = |bound: Option<f64>| {
                bound.map_or("null".into(), |bound| exact(display.map_or(bound, |display| display.of(bound))))
            };
            let passed: Vec<u8> = self.kept.iter().map(|row| verdict(row.passed[k])).collect();
            requirements.push(format!(
                "{{\"text\":{},\"column\":{},\"below\":{},\"above\":{},\"passed\":\"{}\"}}",
                json_string(text),
                columns.len(),
                bound(told.and_then(|one| one.below)),
                bound(told.and_then(|one| one.above)),
                base64(&passed)
            ));
            columns.push(self.column("measured", (text, unit, display), |row| row.measured[k]));
        }
        for (k, (name, unit)) in head.figures.iter().enumerate() {
            let told = found.figures.iter().find(|one| one.name == *name);
            columns.push(
                self.column("figure", (name, unit, told.and_then(|one| one.display.as_ref())), |row| row.figures[k]),
            );
        }
        let followed = found.requirements.first().map(|one| &one.measured);
        let followed = followed.or_else(|| found.figures.first().map(|one| &one.values));
        let across = followed.and_then(|values| values.shares.first()).map_or("", |share| share.parameter.as_str());
        let bytes = |of: &dyn Fn(&SweepRow) -> u32| -> Vec<u8> {
            self.kept.iter().flat_map(|row| of(row).to_le_bytes()).collect()
        };
        let ended: Vec<u8> = self.kept.iter().map(|row| u8::from(row.reason.is_empty())).collect();
        format!(
            "{{\"count\":{},\"across\":{},\"sample\":\"{}\",\"ended\":\"{}\",\"variants\":{},\"variant\":\"{}\",\"columns\":{},\"requirements\":{},\
             \"again\":{{\"command\":{},\"block\":{},\"files\":{}}}}}",
            self.kept.len(),
            json_string(across),
            base64(&bytes(&|row| u32::try_from(row.sample).unwrap_or(u32::MAX))),
            base64(&ended),
            json_array(head.variants.iter().map(|name| json_string(name))),
            if head.variants.len() > 1 { base64(&bytes(&|row| row.variant as u32)) } else { String::new() },
            json_array(columns),
            json_array(requirements),
            json_string(&again.command),
            again.block.max(1),
            json_array(again.files.iter().map(|file| json_string(file)))
        )
    }

    fn column(
        &self,
        kind: &str,
        (name, unit, display): (&str, &str, Option<&DisplayUnit>),
        value: impl Fn(&SweepRow) -> f64,
    ) -> String {
        let values: Vec<f64> =
            self.kept.iter().map(&value).map(|x| display.map_or(x, |display| display.of(x))).collect();
        let least = values.iter().copied().filter(|x| x.is_finite()).fold(f64::INFINITY, f64::min);
        // Small differences of large numbers have their digits too.
        let from = if least.is_finite() { least } else { 0.0 };
        let bytes: Vec<u8> = values.iter().flat_map(|x| ((x - from) as f32).to_le_bytes()).collect();
        format!(
            "{{\"kind\":\"{kind}\",\"name\":{},\"unit\":{},\"from\":{},\"data\":\"{}\"}}",
            json_string(name),
            json_string(display.map_or(unit, |display| display.unit.as_str())),
            exact(from),
            base64(&bytes)
        )
    }
}

/// Whether a run did not come to its end, or fails a requirement.
fn fails(row: &SweepRow) -> bool {
    !row.reason.is_empty() || row.passed.iter().any(|&passed| passed < 0.5)
}

fn verdict(passed: f64) -> u8 {
    if passed.is_nan() { NONE } else { u8::from(passed > 0.5) }
}

/// A lot that follows from the number (SplitMix64: Steele, Lea, Flood, OOPSLA 2014).
fn lot(number: u64) -> u64 {
    let x = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
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
mod tests {
    use super::*;
    use kardan::results::SweptParameter;

    fn row(sample: u64, value: f64, measured: f64) -> SweepRow {
        let passed = f64::from(u8::from(measured < 1.0));
        let reason = if measured.is_nan() { "refused".into() } else { String::new() };
        SweepRow {
            sample,
            variant: 0,
            reason,
            values: vec![value],
            measured: vec![measured],
            passed: vec![passed],
            figures: vec![],
        }
    }

    fn samples() -> Samples {
        let varied = vec![SweptParameter { name: "</script>".into(), unit: "m".into(), distribution: String::new() }];
        let head = SweepHead {
            varied,
            requirements: vec![("x < 1".into(), "m".into())],
            variants: vec!["model".into()],
            ..Default::default()
        };
        Samples::new(&head, &Sweep::default())
    }

    fn decoded(text: &str) -> Vec<u8> {
        const DIGITS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let mut out = Vec::new();
        for four in text.as_bytes().chunks(4) {
            let digit = |k: usize| DIGITS.find(char::from(four[k])).unwrap_or(0);
            let word = digit(0) << 18 | digit(1) << 12 | digit(2) << 6 | digit(3);
            out.extend([word >> 16, word >> 8, word].map(|x| x as u8));
        }
        out.truncate(out.len() - text.bytes().filter(|&c| c == b'=').count());
        out
    }

    /// What stands behind each `"key":"`.
    fn strings<'t>(json: &'t str, key: &str) -> Vec<&'t str> {
        json.split(&format!("\"{key}\":\"")).skip(1).map(|rest| rest.split('"').next().unwrap()).collect()
    }

    #[test]
    fn base64_gives_the_examples_of_the_rfc() {
        for (plain, written) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), written);
        }
    }

    /// The data decode to the rows, those without a number too; no name closes the script.
    #[test]
    fn data_are_the_rows() {
        let mut samples = samples();
        let rows = [row(2, 1e9 + 0.25, 0.5), row(0, 1e9, 2.0), row(1, 1e9 + 1.0, f64::NAN)];
        samples.take(rows);
        let data = samples.kept().data(&Sweep::default(), &Again::default());
        assert!(!data.contains("</script"), "{data}");
        let columns = strings(&data, "data");
        let numbers = |text: &str| -> Vec<f32> {
            decoded(text).chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
        };
        assert!(data.contains("\"from\":1000000000.0,"), "{data}");
        assert_eq!(numbers(columns[0]), [0.0, 1.0, 0.25]);
        let measured = numbers(columns[1]);
        assert!(measured[0] == 1.5 && measured[1].is_nan() && measured[2] == 0.0, "{measured:?}");
        assert_eq!(decoded(strings(&data, "passed")[0]), [0, 0, 1]);
        assert_eq!(decoded(strings(&data, "ended")[0]), [1, 0, 1]);
        assert_eq!(decoded(strings(&data, "sample")[0]), [0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    }

    /// Too many rows: what is told and what fails stays, the others by lots, in whatever order they come.
    #[test]
    fn too_many_runs_are_thinned_openly() {
        let all = |order: &dyn Fn(u64) -> u64, failing: u64| {
            let mut samples = Samples { most: 100, told: [7].into(), ..samples() };
            samples.take(
                (0..1000).map(order).map(|k| row(k, 0.0, if k % 1000 < failing { 2.0 } else { k as f64 * 1e-4 })),
            );
            samples.kept()
        };
        let (one, other) = (all(&|k| k, 5), all(&|k| 999 - k, 5));
        let numbers = |samples: &Samples| samples.kept.iter().map(|row| row.sample).collect::<Vec<_>>();
        assert_eq!(numbers(&one), numbers(&other));
        assert!(numbers(&one).starts_with(&[0, 1, 2, 3, 4]) && numbers(&one).contains(&7));
        let told = one.in_words();
        assert!(
            told.starts_with("100 of 1000 runs are drawn: all 5 that fail, and 95 of 995 others, by lot"),
            "{told}"
        );
        let told = all(&|k| k, 200).in_words();
        assert!(told.starts_with("100 of 1000 runs are drawn: 100 of 200 that fail, by lot, and 0 of 800"), "{told}");
    }
}
