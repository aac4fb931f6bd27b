//! Presentation: [`results`](kardan_results) as plain [`Page`]s, and those as HTML, text and Markdown.
//!
//! This crate does no physics. It computes only for display: extremes of plotted signals, thinning of
//! long series, axis ticks, and the natural frequency and damping ratio by which poles are listed.
//!
//! ```text
//! Analysis, Design, Identification, BenchStudy, Study ─► present (words, pictures, charts) ─► Page ─┬─► html
//!                                                                                                  ├─► terminal
//! Study ─► curves (what is drawn, in which colour, under which name) ─► svg                        └─► markdown
//! ```
#![deny(clippy::disallowed_methods)]

mod analysis_pictures;
mod bench_pictures;
mod charts;
mod curves;
mod design_pictures;
mod drawing;
mod frame;
mod frequency_pictures;
mod groups;
mod html;
mod identification_pictures;
mod markdown;
mod mechanism;
mod mode_shapes;
pub mod model;
mod pareto;
mod phrases;
mod present;
mod prose;
mod samples;
mod signal_graph;
mod svg;
mod terminal;
mod text;
mod thin;
mod ticks;

use kardan_results::Mechanism;

pub use model::Page;
pub use present::analysis::page as analysis;
pub use present::analysis::text_page as analysis_text;
pub use present::bench::{page as bench, plan};
pub use present::design::page as design;
pub use present::identification::page as identification;
pub use present::safety::page as safety;
pub use present::study::page as study;
pub use present::study::text_page as study_text;
pub use present::summary::page as summary;
pub use present::sweep::page as sweep;
pub use present::sweep::page_with as sweep_with;
pub use samples::{Again, Samples};
pub use svg::{PlotFile, plots};

impl Page {
    /// One HTML file that opens offline: styles, scripts and data are inside, and the page's content
    /// policy forbids external resources. Every text is escaped. Pictures replace charts on paper and without
    /// JavaScript.
    ///
    /// ```
    /// let page = kardan_report::study(&kardan_results::Study::default());
    /// assert!(page.html().starts_with("<!doctype html>"));
    /// ```
    pub fn html(&self) -> String {
        html::html(self)
    }

    /// The pictures of its charts, each with a name for a file.
    pub fn plots(&self) -> impl Iterator<Item = (&str, &str)> {
        let blocks = self.sections.iter().flat_map(|section| &section.body.0);
        blocks.filter_map(|block| match block {
            model::Block::Chart(chart) => Some((chart.anchor.as_str(), chart.svg.as_str())),
            _ => None,
        })
    }

    /// Text in 100 columns for a terminal, without pictures and details; `origin` is its source, if known.
    pub fn text(&self, origin: &str) -> String {
        self.text_of_width(origin, terminal::WIDTH)
    }

    /// The same in so many columns, at most 100: tables that do not fit are written row by row.
    pub fn text_of_width(&self, origin: &str, columns: usize) -> String {
        terminal::text(self, origin, columns)
    }

    /// The same in so many lines at most; those left out are counted.
    pub fn text_on_screen(&self, origin: &str, columns: usize, lines: usize) -> String {
        terminal::on_screen(&self.text_of_width(origin, columns), lines)
    }

    /// Markdown with tables, without pictures. Every text is escaped.
    ///
    /// ```
    /// let page = kardan_report::design(&kardan_results::Design::default());
    /// assert!(page.markdown().starts_with("# Design\n"));
    /// ```
    pub fn markdown(&self) -> String {
        markdown::markdown(self)
    }
}

/// The drawing of a mechanism as an SVG document; none of one without parts.
///
/// ```
/// let project = kardan::project::Project::open("[shaft.axle]\ninertia = \"2 kg cm^2\"\n");
/// let study = project.run(&Default::default(), &kardan::study::Silent).unwrap();
/// let drawn = kardan_report::mechanism(&study.model.mechanism).unwrap();
/// assert!(drawn.starts_with("<svg") && drawn.contains("axle"));
/// ```
pub fn mechanism(mechanism: &Mechanism) -> Option<String> {
    mechanism::document(mechanism)
}
