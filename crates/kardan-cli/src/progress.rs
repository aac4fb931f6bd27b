//! How far the variants are, on standard error if somebody looks.

use std::collections::HashMap;
use std::io::IsTerminal;
use std::sync::{Arc, Mutex, PoisonError};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use kardan::study::{Part, Progress};

use crate::args::Limits;
use crate::stop;

const STEPS: u64 = 1000;

/// One bar for each variant that is running; drawn only on a terminal.
pub struct Bars {
    all: MultiProgress,
    running: Mutex<HashMap<usize, ProgressBar>>,
    most_steps: Option<u64>,
    show: Option<Show>,
}

/// Shows a part of the results of a command that ends early, and gives the exit code.
type Show = Arc<dyn Fn(Part) -> u8 + Send + Sync>;

impl Bars {
    /// Bars, or nothing if the user wants it quiet.
    pub fn new(quiet: bool) -> Self {
        let seen = !quiet && std::io::stderr().is_terminal();
        let target = if seen { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        stop::computing(true);
        Self { all: MultiProgress::with_draw_target(target), running: Mutex::default(), most_steps: None, show: None }
    }

    /// The same for a command that shows what is finished, should it end early.
    pub fn showing(self, show: impl Fn(Part) -> u8 + Send + Sync + 'static) -> Self {
        Self { show: Some(Arc::new(show)), ..self }
    }

    /// The same for simulations that take no more steps than this.
    pub fn within(quiet: bool, limits: Limits) -> Self {
        Self { most_steps: Some(limits.max_steps), ..Self::new(quiet) }
    }

    /// Takes the bars off the screen.
    pub fn finish(&self) {
        for bar in self.running.lock().unwrap_or_else(PoisonError::into_inner).values() {
            bar.finish_and_clear();
        }
        let _ = self.all.clear();
        stop::computing(false);
    }
}

impl Progress for Bars {
    fn advance(&self, variant: usize, name: &str, fraction: f64) {
        if self.all.is_hidden() {
            return;
        }
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let bar = running.entry(variant).or_insert_with(|| {
            let style = ProgressStyle::with_template("{msg:24!} [{bar:40}] {percent:>3} %  {eta} left")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            let bar = ProgressBar::new(STEPS).with_style(style.progress_chars("=> "));
            self.all.add(bar).with_message(crate::render::visible(name))
        });
        if fraction >= 1.0 {
            bar.finish_and_clear();
            self.all.remove(bar);
        } else {
            bar.set_position((fraction.max(0.0) * STEPS as f64) as u64);
        }
    }

    fn stop(&self) -> Option<String> {
        stop::reason()
    }

    fn keep(&self, part: &dyn Fn() -> Part) {
        if let Some(show) = self.show.clone() {
            let part = part();
            stop::keep(Some(Box::new(move |reason| show(early(part, reason)))));
        }
    }

    fn release(&self) {
        if self.show.is_some() {
            stop::keep(None);
        }
    }

    fn most_steps(&self) -> usize {
        let own = self.most_steps.map(|most| usize::try_from(most).unwrap_or(usize::MAX));
        own.unwrap_or_else(|| kardan::simulate::Tolerance::default().most_steps)
    }
}

/// Says in what was finished why there is no more of it.
fn early(mut part: Part, reason: &str) -> Part {
    match &mut part {
        Part::Study(study) => {
            let warning = format!("{reason}: {}", study.warnings.last().map_or("", String::as_str));
            Arc::make_mut(study).warnings.push(warning);
        }
        Part::Analysis(found) => because(&mut found.unfinished, reason),
        Part::Design(found) => because(&mut found.unfinished, reason),
        Part::Identification(found) => because(&mut found.unfinished, reason),
    }
    part
}

/// Puts the reason before what is missing.
pub fn because(unfinished: &mut Option<String>, reason: &str) {
    if let Some(missing) = unfinished {
        *missing = format!("{reason}: {missing}");
    }
}
