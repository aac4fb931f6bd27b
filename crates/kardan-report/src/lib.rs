//! Report: one self-contained HTML file and SVG plots from [`results`](kardan::results).
//!
//! Nothing physical is computed here. What is computed serves the eye only: extremes of plotted signals, thinning of
//! long series, axis ticks, and the natural frequency and damping ratio by which poles are listed.
//!
//! ```text
//! Study ─► curves (what is drawn, in which colour, under which name) ─┬─► svg      one picture for each plot
//!                                                                    ├─► charts   the same, interactive
//!                                                                    └─► tables, summary ─► page
//! Analysis ─► words, analysis_pictures ─► analysis ─► page
//! Design ─► words::design, design_pictures ─► design ─► page
//! Identification ─► words::identification, identification_pictures ─► identification ─┬─► page
//! BenchStudy ─► words::bench ─► bench ────────────────────────────────────────────────┘
//! ```

mod analysis;
mod analysis_pictures;
mod bench;
mod charts;
mod curves;
mod design;
mod design_pictures;
mod frame;
mod identification;
mod identification_pictures;
mod page;
mod pareto;
mod summary;
mod svg;
mod table;
mod tables;
#[cfg(test)]
mod tests;
mod text;
mod thin;
mod ticks;
pub mod words;

use kardan::results::{Analysis, BenchStudy, Design, Identification, Study};

/// A drawn plot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotFile {
    /// File name: `rack-angle.svg`; letters, digits, `-`, `_` and `.` only, unique within the study.
    pub name: String,
    /// The picture: an SVG document without references to anything outside it.
    pub svg: String,
}

/// One SVG for each of the study's plots, in their order.
///
/// All signals of a plot are drawn for every variant it lists, in SI units over time in s; references are dashed and
/// drawn once. Long series are thinned to about 2000 points a curve and keep every extreme; values that are not finite
/// leave a gap. A plot without data gives empty axes that say so.
///
/// ```
/// use kardan::results::{Plot, Study};
/// let study = Study { plots: vec![Plot { id: "rack-angle".into(), ..Plot::default() }], ..Study::default() };
/// assert_eq!(kardan_report::plots(&study)[0].name, "rack-angle.svg");
/// ```
pub fn plots(study: &Study) -> Vec<PlotFile> {
    svg::plots(study)
}

/// The study as one HTML file that opens offline: interactive charts, key figures, requirements, energy balance,
/// events, the model with its laws and poles, notes and warnings.
///
/// Nothing is fetched: styles, scripts and data are inside, and the page's own content policy forbids the rest. On
/// paper and without JavaScript the pictures of [`plots`] take the place of the charts. Every text of the study is
/// escaped. Curves are thinned to about 4000 points and keep every extreme.
///
/// ```
/// let page = kardan_report::html(&kardan::results::Study::default());
/// assert!(page.starts_with("<!doctype html>"));
/// ```
pub fn html(study: &Study) -> String {
    page::html(study)
}

/// An analysis of structure as one HTML file that opens offline and fetches nothing: class, reduction, modes with their
/// shapes and energies, poles and zeros, ranks, least numbers, placement, sensitivity and certificate.
///
/// [`html`] shows the same as one section where [`Study::analysis`] is there. Every text of the analysis is escaped.
///
/// ```
/// let page = kardan_report::analysis_html(&kardan::results::Analysis::default());
/// assert!(page.starts_with("<!doctype html>"));
/// ```
pub fn analysis_html(analysis: &Analysis) -> String {
    page::analysis_html(analysis)
}

/// A design as one HTML file that opens offline and fetches nothing: what was designed, whether the outputs can be
/// decoupled, gains, channels, poles, zero dynamics, observer, the exact transfer matrix, cross coupling, flatness and
/// what runs in firmware. Warnings stand above everything. Every text of the design is escaped.
///
/// ```
/// let page = kardan_report::design_html(&kardan::results::Design::default());
/// assert!(page.starts_with("<!doctype html>"));
/// ```
pub fn design_html(design: &Design) -> String {
    page::design_html(design)
}

/// An identification as one HTML file that opens offline and fetches nothing: parameters with intervals, measured and predicted
/// torque, friction over speed, what cannot be told, tests of what is left over, validation, models compared, logs.
///
/// ```
/// let page = kardan_report::identification_html(&kardan::results::Identification::default());
/// assert!(page.starts_with("<!doctype html>"));
/// ```
pub fn identification_html(found: &Identification) -> String {
    page::identification_html(found)
}

/// A study on a virtual bench as one HTML file that opens offline and fetches nothing: each step in the simulation and on the bench side
/// by side, what makes the two differ, parameters found beside true ones, the excitation, the identification and the design.
pub fn bench_html(study: &BenchStudy) -> String {
    page::bench_html(study)
}
