//! Progress of the variants, on standard error if that is a terminal.

use std::collections::HashMap;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use kardan::study::{Part, Progress};

use crate::args::Limits;
use crate::render::note;
use crate::stop;

const STEPS: u64 = 1000;
/// Shorter computations show no bar.
const QUICK: Duration = Duration::from_millis(400);
/// Time between two drawings of a bar, so that its times go on where a part takes long.
const TICK: Duration = Duration::from_millis(200);

/// One bar for each variant that is running; drawn only on a terminal.
pub struct Bars {
    all: MultiProgress,
    quiet: bool,
    /// Whether there is a terminal to draw on.
    visible: bool,
    /// Drawing has stopped.
    over: Arc<AtomicBool>,
    /// By the number of the variant; `None`: the preparation.
    running: Mutex<HashMap<Option<usize>, ProgressBar>>,
    /// Start time of a count of many runs, and the number of runs done before.
    counted: Mutex<Option<(Instant, usize)>>,
    most_steps: Option<u64>,
    show: Option<Show>,
}

/// Shows a part of the results of a command that ends early, and gives the exit code.
type Show = Arc<dyn Fn(Part) -> u8 + Send + Sync>;

impl Bars {
    /// Bars, or none with `--quiet`; drawn once the computation takes long enough.
    pub fn new(quiet: bool) -> Self {
        let visible = !quiet && std::io::stderr().is_terminal() && crate::render::obeys();
        stop::computing(true);
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::hidden());
        let over = Arc::new(AtomicBool::new(false));
        if visible {
            let (all, over) = (all.clone(), Arc::clone(&over));
            std::thread::spawn(move || {
                std::thread::sleep(QUICK);
                if !over.load(Ordering::Relaxed) {
                    all.set_draw_target(ProgressDrawTarget::stderr());
                }
            });
        }
        Self {
            all,
            quiet,
            visible,
            over,
            running: Mutex::default(),
            counted: Mutex::default(),
            most_steps: None,
            show: None,
        }
    }

    /// The same for a command that shows partial results if it ends early.
    pub fn showing(self, show: impl Fn(Part) -> u8 + Send + Sync + 'static) -> Self {
        Self { show: Some(Arc::new(show)), ..self }
    }

    /// The same for simulations that take no more steps than this.
    pub fn limited(quiet: bool, limits: Limits) -> Self {
        Self { most_steps: Some(limits.max_steps), ..Self::new(quiet) }
    }

    /// Removes the bars from the screen.
    pub fn clear(&self) {
        self.over.store(true, Ordering::Relaxed);
        for bar in self.running.lock().unwrap_or_else(PoisonError::into_inner).values() {
            bar.finish_and_clear();
        }
        let _ = self.all.clear();
    }

    /// Removes the bars from the screen before text is written.
    pub fn finish(&self) {
        self.clear();
        stop::computing(false);
    }

    /// Computes while there are bars.
    pub fn during<T>(self, work: impl FnOnce(&Self) -> T) -> T {
        let found = work(&self);
        self.finish();
        found
    }

    /// Moves a bar, which is there from its first part to its last.
    fn draw(&self, key: Option<usize>, name: &str, fraction: f64) {
        if !self.visible {
            return;
        }
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        if fraction >= 1.0 {
            if let Some(bar) = running.remove(&key) {
                bar.finish_and_clear();
                self.all.remove(&bar);
            }
            return;
        }
        let bar = running.entry(key).or_insert_with(|| {
            let style = ProgressStyle::with_template("{msg:32!} [{bar:40}] {percent:>3} %  {remaining_time}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            let style = style.progress_chars("=> ").with_key("left", remaining_time);
            let bar = self.all.add(ProgressBar::new(STEPS).with_style(style));
            bar.enable_steady_tick(TICK);
            bar
        });
        bar.set_message(crate::render::visible(name));
        bar.set_position((fraction.max(0.0) * STEPS as f64) as u64);
    }
}

/// How many of many runs are done, and the rate per second, once it can be estimated.
fn counted(done: usize, all: usize, (since, before): (Instant, usize)) -> String {
    let (seconds, made) = (since.elapsed().as_secs_f64(), done.saturating_sub(before));
    match made as f64 / seconds {
        rate if made > 0 && rate >= 10.0 && rate.is_finite() => format!("{done} of {all} runs, {rate:.0}/s"),
        rate if made > 0 && rate.is_finite() => format!("{done} of {all} runs, {rate:.1}/s"),
        _ => format!("{done} of {all} runs"),
    }
}

/// The time left, once it can be estimated.
fn remaining_time(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    let _ = match state.pos() {
        0 => write!(out, "{} so far", HumanDuration(state.elapsed())),
        _ => write!(out, "{:#} left", HumanDuration(state.eta())),
    };
}

impl Progress for Bars {
    fn advance(&self, variant: usize, name: &str, fraction: f64) {
        self.draw(Some(variant), name, fraction);
    }

    fn counted(&self, done: usize, all: usize) {
        if !self.visible {
            return;
        }
        let mut first = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = *first.get_or_insert_with(|| (Instant::now(), done));
        drop(first);
        self.draw(Some(0), &counted(done, all, begun), done as f64 / all as f64);
    }

    fn message(&self, text: &str) {
        if !self.quiet {
            self.all.suspend(|| note(text));
        }
    }

    fn preparing(&self, fraction: f64) {
        self.draw(None, "preparing", fraction);
    }

    fn stop(&self) -> Option<String> {
        stop::reason()
    }

    fn store_partial(&self, part: &dyn Fn() -> Part) {
        if let Some(show) = self.show.clone() {
            let part = part();
            stop::store_partial(Some(Box::new(move |reason| show(early(part, reason)))));
        }
    }

    fn release(&self) {
        if self.show.is_some() {
            stop::store_partial(None);
        }
    }

    fn most_steps(&self) -> usize {
        let own = self.most_steps.map(|most| usize::try_from(most).unwrap_or(usize::MAX));
        own.unwrap_or_else(|| kardan::simulate::Tolerance::default().most_steps)
    }
}

/// Adds to partial results the reason why they are partial.
fn early(mut part: Part, reason: &str) -> Part {
    match &mut part {
        Part::Study(study) => {
            let warning = format!("{reason}: {}", study.warnings.last().map_or("", String::as_str));
            Arc::make_mut(study).warnings.push(warning);
        }
        Part::Analysis(found) => because(&mut found.unfinished, reason),
        Part::Design(found) => because(&mut found.incomplete_reason, reason),
        Part::Identification(found) => because(&mut found.incomplete_reason, reason),
        Part::Safety(table) => {
            if let Some(last) = table.warnings.last_mut().filter(|_| table.missing > 0) {
                *last = format!("{reason}: {last}");
            }
        }
    }
    part
}

/// Puts the reason before what is missing.
pub fn because(unfinished: &mut Option<String>, reason: &str) {
    if let Some(missing) = unfinished {
        *missing = format!("{reason}: {missing}");
    }
}

#[cfg(test)]
#[path = "../tests/unit/progress.rs"]
mod tests;
