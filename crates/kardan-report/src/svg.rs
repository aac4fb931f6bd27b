//! Plots for paper. The crate `kuva` is used here and nowhere else.

use std::sync::Arc;

use kuva::backend::svg::SvgBackend;
use kuva::plot::LinePlot;
use kuva::plot::legend::{LegendEntry, LegendPosition, LegendShape};
use kuva::plot::line::LineStyle;
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::plots::Plot as Drawn;
use kuva::render::render::render_multiple;
use kuva::render::theme::Theme;

use super::curves::{self, Curve, ON_WHITE};
use super::thin::thin;
use super::ticks::{self, Axis};
use kardan_results::bidi_escaped;
use kardan_results::{Physical, Plot, Study};
use kardan_rt::functions::log10;
use rayon::prelude::*;

const WIDTH: f64 = 760.0;
/// Height without title and legend.
const HEIGHT: f64 = 380.0;
/// Width and height of the frame of the axes, px; least and largest height of a frame of positions over a position.
const FRAME: [f64; 2] = [681.0, 330.0];
const LOWEST: f64 = 200.0;
const HIGHEST: f64 = 560.0;
const POINTS: usize = 2000;
const REFERENCE: &str = "#000000";
const FONTS: &str = "Helvetica Neue, Helvetica, Arial, Liberation Sans, DejaVu Sans, sans-serif";

/// A drawn plot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlotFile {
    /// File name: `rack-angle.svg`; letters, digits, `-`, `_` and `.` only, unique within the study.
    pub name: String,
    /// The picture: an SVG document without references to anything outside it.
    pub svg: String,
    /// Notes on its curves, such as which ones coincide; may be empty.
    pub note: String,
}

/// One SVG for each of the study's plots, in their order.
///
/// All signals of a plot are drawn for every variant it lists, in SI units or that of [`Plot::display`](kardan_results::Plot)
/// over time in s; references are dashed and drawn once, or for each variant where they differ. Of curves that coincide the lower
/// ones are wider, and the legend names them. Long series are thinned to about 2000 points a curve and keep every extreme; values that are not finite
/// leave a gap. A plot without data gives empty axes with a note.
///
/// ```
/// use kardan_results::{Plot, Study};
/// let study = Study { plots: vec![Plot { id: "rack-angle".into(), ..Plot::default() }], ..Study::default() };
/// assert_eq!(kardan_report::plots(&study)[0].name, "rack-angle.svg");
/// ```
pub fn plots(study: &Study) -> Vec<PlotFile> {
    let stems = curves::stems(study);
    let file = |(plot, stem): (&Plot, String)| {
        let (svg, note) = draw(study, plot);
        PlotFile { name: format!("{stem}.svg"), svg: finish(&svg, &stem), note }
    };
    study.plots.par_iter().zip(stems).map(file).collect()
}

/// Additions to `kuva`'s output: a view box, so that the picture can be scaled, and a unique id for the clip path,
/// which `kuva` numbers through the life of the process.
fn finish(svg: &str, stem: &str) -> String {
    let attribute = |name: &str| svg.split_once(&format!("{name}=\""))?.1.split('"').next();
    let (width, height) = (attribute("width").unwrap_or_default(), attribute("height").unwrap_or_default());
    let scalable = svg.replacen("<svg ", &format!("<svg viewBox=\"0 0 {width} {height}\" "), 1);
    match attribute("<clipPath id") {
        Some(id) => scalable
            .replacen(&format!("id=\"{id}\""), &format!("id=\"clip-{stem}\""), 1)
            .replace(&format!("url(#{id})"), &format!("url(#clip-{stem})")),
        None => scalable,
    }
}

/// The picture, and notes on its curves.
fn draw(study: &Study, plot: &Plot) -> (String, String) {
    let curves::Curves { all: curves, least_span, note, .. } = curves::curves(study, plot);
    let (x_label, per_second) = curves::x_axis(study, plot);
    let times = || curves.iter().flat_map(|curve| curve.time.iter().map(|time| time * per_second));
    let margin = if plot.over.is_some() { 0.04 } else { 0.0 };
    let time = if plot.log_x { ticks::decades(times()) } else { ticks::axis(times(), margin, 9) };
    let values = || curves.iter().flat_map(|curve| curve.values.iter().copied()).filter(|value| value.is_finite());
    let (low, high) = ticks::extent(values());
    // Values that are only rounding get an axis that shows them as flat.
    let wider = (high - low < least_span).then_some([0.5 * (low + high - least_span), 0.5 * (low + high + least_span)]);
    let value = match plot.log_y {
        true => ticks::decades(values()),
        false => ticks::axis(values().chain(wider.into_iter().flatten()), 0.04, 7),
    };

    let (time, value, frame) = if is_map(study, plot) { to_scale(time, value) } else { (time, value, FRAME[1]) };
    // The legend is handed over as a list: a curve with gaps is several polylines but one entry.
    let entries: Vec<LegendEntry> = curves.iter().map(entry).collect();
    let drawn = curves.iter().any(|curve| curve.values.iter().any(|value| value.is_finite()));
    let title = if !drawn { format!("{} (no data)", plot.title) } else { plot.title.clone() };
    let mut layout = Layout::new((time.low, time.high), (value.low, value.high))
        .with_theme(Theme { grid_color: "#e4e4e4".into(), font_family: Some(FONTS.into()), ..Theme::light() })
        .with_width(WIDTH)
        .with_title(plain(&title))
        .with_title_size(16)
        .with_title_wrap(78)
        .with_x_label(plain(&x_label))
        .with_y_label(plain(&curves::axis_label(plot, &curves)))
        .with_y_label_wrap(46)
        .with_label_size(13)
        .with_tick_size(12)
        .with_body_size(12)
        .with_box_axes()
        .with_tick_length(4.0)
        .with_axis_line_width(0.8)
        .with_tick_width(0.8)
        .with_grid_line_width(0.6)
        .with_x_axis_min(time.low)
        .with_x_axis_max(time.high)
        .with_x_tick_step(time.step)
        .with_x_tick_format(format(time, plot.log_x))
        .with_y_axis_min(value.low)
        .with_y_axis_max(value.high)
        .with_y_tick_step(value.step)
        .with_y_tick_format(format(value, plot.log_y));
    let mut height = HEIGHT - FRAME[1] + frame + 40.0 * (title.chars().count().div_ceil(78)) as f64;
    // One curve is named by its axis, unless it is a reference.
    if curves.len() > 1 || curves.iter().any(|curve| curve.colour.is_none()) {
        height += legend_height(&entries);
        layout = layout
            .with_legend_position(LegendPosition::OutsideBottomColumns)
            .with_legend_box(false)
            .with_legend_entries(entries);
    }
    let lines: Vec<Drawn> = curves.iter().flat_map(|curve| lines(curve, per_second, plot)).map(Drawn::Line).collect();
    (SvgBackend::new().render_scene(&render_multiple(lines, layout.with_height(height))), note)
}

/// Whether positions are drawn over a position: then both axes have one scale.
fn is_map(study: &Study, plot: &Plot) -> bool {
    let kind = |name: &str| study.runs.iter().find_map(|run| run.series.signal(name)).map(|signal| signal.physical);
    let mut all = plot.over.iter().chain(&plot.signals).map(|name| kind(name));
    plot.over.is_some() && !plot.log_x && !plot.log_y && all.all(|kind| kind == Some(Physical::Position))
}

/// Two axes with one scale, as wide as the longer one needs, and the height of their frame, px.
fn to_scale(x: Axis, y: Axis) -> (Axis, Axis, f64) {
    let [width, _] = FRAME;
    let span = |axis: &Axis| axis.high - axis.low;
    let height = (width * span(&y) / span(&x)).clamp(LOWEST, HIGHEST);
    let size = (span(&x) / width).max(span(&y) / height);
    let wide = |axis: Axis, pixels: f64, ticks: usize| {
        let (middle, half) = (0.5 * (axis.low + axis.high), 0.5 * size * pixels);
        ticks::axis([middle - half, middle + half].into_iter(), 0.0, ticks)
    };
    (wide(x, width, 9), wide(y, height, 7), height)
}

/// What `kuva` adds below the axis for the legend's rows at width [`WIDTH`], px.
fn legend_height(entries: &[LegendEntry]) -> f64 {
    let longest = entries.iter().map(|entry| entry.label.chars().count()).max().unwrap_or(0) as f64;
    let columns = (640.0 / (38.0 + 6.5 * longest)).floor().max(1.0);
    18.0 * (entries.len() as f64 / columns).ceil() + 10.0
}

fn entry(curve: &Curve) -> LegendEntry {
    LegendEntry {
        label: plain(&curve.label),
        color: colour(curve).into(),
        shape: LegendShape::Line,
        // The legend's sample is short: two dashes of a reference just fit.
        dasharray: if curve.colour.is_none() { Some("5 2 5 2".into()) } else { dasharray(curve) },
    }
}

/// The polylines of a curve: one for each stretch between two gaps.
fn lines(curve: &Curve, per_second: f64, plot: &Plot) -> Vec<LinePlot> {
    // `kuva` would enlarge values below 1e-10 to their own axis range.
    let place = |logarithmic: bool, value: f64| if logarithmic { log10(value) } else { value };
    let selected = match plot.over.is_some() {
        true => both(curve),
        false => thin(&curve.time, &curve.values, POINTS),
    };
    let stretches = selected.split(|&index| !(curve.values[index].is_finite() && curve.time[index].is_finite()));
    let drawn = |stretch: &[usize]| {
        let style = dasharray(curve).map_or(LineStyle::Solid, LineStyle::Custom);
        LinePlot::new()
            .with_data(stretch.iter().map(|&index| {
                (place(plot.log_x, curve.time[index] * per_second), place(plot.log_y, curve.values[index]))
            }))
            .with_color(colour(curve))
            .with_stroke_width(curve.width)
            .with_line_style(style)
    };
    stretches.filter(|stretch| stretch.len() > 1).map(drawn).collect()
}

/// Samples to keep of a curve over another signal: in their order, with the ends of both.
fn both(curve: &Curve) -> Vec<usize> {
    let order: Vec<f64> = (0..curve.time.len()).map(|k| k as f64).collect();
    let mut selected = [thin(&order, &curve.values, POINTS), thin(&order, &curve.time, POINTS)].concat();
    selected.sort_unstable();
    selected.dedup();
    selected
}

fn colour(curve: &Curve) -> &'static str {
    curve.colour.map_or(REFERENCE, |index| ON_WHITE[index % ON_WHITE.len()])
}

fn dasharray(curve: &Curve) -> Option<String> {
    let lengths: Vec<String> = curve.dash.iter().map(f64::to_string).collect();
    (!lengths.is_empty()).then(|| lengths.join(" "))
}

fn format(axis: Axis, logarithmic: bool) -> TickFormat {
    TickFormat::Custom(Arc::new(move |value| if logarithmic { ticks::decade(value) } else { axis.label(value) }))
}

/// The text as `kuva` shows it unchanged: it would read `$…$` as mathematics, and XML knows no control characters.
fn plain(text: &str) -> String {
    bidi_escaped(text).replace(|c: char| c.is_control() || c == '\u{fffe}' || c == '\u{ffff}', " ").replace('$', "\\$")
}
