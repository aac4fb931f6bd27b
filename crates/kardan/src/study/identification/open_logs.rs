//! The open logs of an identification, with the number of bytes read.

use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::channels::Quantity;
use super::open_log::{OpenLog, open_log};
use super::reading::{Recording, read, usual_window};
use super::recordings::recordings;
use super::settings::LogFile;
use crate::study::Progress;
use kardan_model::{Document, Model};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_tables::read::{Bytes, ReadSeek};

/// Bytes, or their reader, with a counter of those read.
struct Counted<T> {
    inner: T,
    read: Arc<AtomicU64>,
}

impl Read for Counted<Box<dyn ReadSeek>> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.read.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl Seek for Counted<Box<dyn ReadSeek>> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.inner.seek(to)
    }
}

impl Bytes for Counted<Arc<dyn Bytes>> {
    fn open(&self) -> std::io::Result<Box<dyn ReadSeek>> {
        Ok(Box::new(Counted { inner: self.inner.open()?, read: Arc::clone(&self.read) }))
    }
}

/// Open logs.
pub(super) struct OpenLogs {
    /// One list for each set recorded together.
    experiments: Vec<Vec<OpenLog>>,
    /// The counter of the bytes read.
    counters: Vec<Arc<AtomicU64>>,
    /// All of them.
    bytes: u64,
}

impl OpenLogs {
    pub fn open(document: &Document, model: &Model, files: Vec<LogFile>) -> Result<Self, Vec<Diagnostic>> {
        let mut out = Self { experiments: Vec::new(), counters: Vec::new(), bytes: 0 };
        let mut diagnostics = Vec::new();
        for group in recordings(document, files)? {
            let mut logs = Vec::new();
            for file in group {
                if let Ok(mut bytes) = file.bytes.open() {
                    out.bytes += bytes.seek(SeekFrom::End(0)).unwrap_or(0);
                }
                let read = Arc::new(AtomicU64::new(0));
                out.counters.push(Arc::clone(&read));
                let file = LogFile { name: file.name, bytes: Arc::new(Counted { inner: file.bytes, read }) };
                logs.extend(open_log(document, model, &file, &mut diagnostics));
            }
            out.experiments.push(logs);
        }
        if diagnostics.is_empty() { Ok(out) } else { Err(diagnostics) }
    }

    /// The notes of the files.
    pub fn notes(&self) -> Vec<String> {
        let all = self.experiments.iter().flatten();
        all.flat_map(|open| open.log.notes().into_iter().map(|note| format!("`{}`: {note}", open.name))).collect()
    }

    /// The quantities of the logs: the same in all separate recordings, or those that all have.
    pub fn slots(&self) -> Result<Vec<Quantity>, Vec<Diagnostic>> {
        let mut of: Vec<Vec<Quantity>> = Vec::new();
        for logs in &self.experiments {
            let mut own: Vec<Quantity> = Vec::new();
            for one in logs.iter().flat_map(|log| &log.mapped) {
                if own.contains(&one.quantity) {
                    let message = format!("the logs contain `{}` in two channels", one.quantity.signal());
                    return Err(vec![
                        Diagnostic::error("log::duplicate", message)
                            .help("leave one channel per signal in the `[log.NAME]` tables"),
                    ]);
                }
                own.push(one.quantity.clone());
            }
            of.push(own);
        }
        let first = of.first().cloned().unwrap_or_default();
        for (k, own) in of.iter().enumerate().skip(1) {
            let missing: Vec<String> = first.iter().filter(|one| !own.contains(one)).map(Quantity::signal).collect();
            let more: Vec<String> = own.iter().filter(|one| !first.contains(one)).map(Quantity::signal).collect();
            if !missing.is_empty() || !more.is_empty() {
                let name = self.experiments[k].first().map_or("", |log| log.name.as_str());
                let message = format!("`{name}` contains other signals than the first log");
                let help = format!(
                    "it lacks {} and has {} in addition; all logs of one identification need the same signals. kardan joins two files of one recording by \
                     time if the model has a `[log.NAME]` with `file` for each",
                    if missing.is_empty() { "nothing".into() } else { quoted(missing.iter().map(String::as_str)) },
                    if more.is_empty() { "nothing".into() } else { quoted(more.iter().map(String::as_str)) }
                );
                return Err(vec![Diagnostic::error("log::different-signals", message).help(help)]);
            }
        }
        Ok(first)
    }

    /// The width of windows with enough samples of every channel, s.
    pub fn usual_window(&self) -> Result<f64, Vec<Diagnostic>> {
        let mut widest = 0.0_f64;
        for logs in &self.experiments {
            widest = widest.max(usual_window(logs)?);
        }
        Ok(widest)
    }

    /// Reads all logs into windows; after an early stop the part read so far, and its fraction.
    pub fn read(
        self,
        slots: &[Quantity],
        window: f64,
        progress: &dyn Progress,
    ) -> Result<(Vec<Recording>, Option<String>), Vec<Diagnostic>> {
        let Self { experiments, counters, bytes } = self;
        let part = || {
            let read: u64 = counters.iter().map(|count| count.load(Ordering::Relaxed)).sum();
            if bytes > 0 { (read as f64 / bytes as f64).min(0.999) } else { 0.0 }
        };
        let enough = || {
            progress.advance(0, "logs", part());
            progress.stop().is_some()
        };
        let (mut recorded, mut early) = (Vec::new(), None);
        for logs in experiments {
            recorded.push(read(logs, slots, window, &enough)?);
            if progress.stop().is_some() {
                early = Some(format!("kardan read {:.1} % of the logs", 100.0 * part()));
                break;
            }
        }
        progress.advance(0, "logs", 1.0);
        Ok((recorded, early))
    }
}
