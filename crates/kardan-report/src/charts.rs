//! The plots of the page: interactive charts, and the pictures that replace them on paper.

use super::curves::{self, Curve};
use super::model::Chart;
use super::svg::PlotFile;
use super::text::{json_array, json_number, json_numbers, json_string};
use super::thin::thin;
use kardan_results::{Plot, Study};
use rayon::prelude::*;

const POINTS: usize = 4000;
/// Largest number of zoom buttons.
const MARKS: usize = 12;

/// A plot with the picture that replaces it on paper; `index` is its index in the data.
pub(super) fn chart(index: usize, plot: &Plot, picture: &PlotFile) -> Chart {
    Chart {
        still: curves::still(plot),
        anchor: picture.name.trim_end_matches(".svg").into(),
        title: if plot.title.is_empty() { plot.id.clone() } else { plot.title.clone() },
        index,
        svg: picture.svg.clone(),
        caption: [plot.caption.as_str(), &picture.note]
            .into_iter()
            .filter(|text| !text.is_empty())
            .collect::<Vec<_>>()
            .join(" "),
    }
}

/// Data for the page's script, as JSON: `{"marks": [s, …], "plots": [{"y", "least_span", "curves": [{"label", "unit",
/// "colour", "dash", "width", "t", "v"}]}], "clock": {"per_second", "unit"}}`; `t` in s, to be shown in the unit of the clock.
pub(super) fn data(study: &Study) -> String {
    let plot = |plot: &Plot| {
        let mut curves = curves::curves(study, plot);
        if curves::still(plot) {
            // The page shows its picture.
            curves.all.clear();
        }
        let label = json_string(&curves::axis_label(plot, &curves.all));
        let least = json_number(curves.least_span);
        format!("{{\"y\":{label},\"least_span\":{least},\"curves\":{}}}", json_array(curves.all.iter().map(curve)))
    };
    let plots: Vec<String> = study.plots.par_iter().map(plot).collect();
    let clock = curves::clock(study);
    format!(
        "{{\"marks\":{},\"plots\":{},\"clock\":{{\"per_second\":{},\"unit\":{}}}}}",
        json_numbers(marks(study)),
        json_array(plots),
        json_number(clock.per_second),
        json_string(clock.unit)
    )
}

fn curve(curve: &Curve) -> String {
    let selected = thin(&curve.time, &curve.values, POINTS);
    format!(
        "{{\"label\":{},\"unit\":{},\"colour\":{},\"dash\":{},\"width\":{},\"t\":{},\"v\":{}}}",
        json_string(&curve.label),
        json_string(curve.unit),
        curve.colour.map_or("null".into(), |index| (index % curves::ON_WHITE.len()).to_string()),
        json_numbers(curve.dash.iter().copied()),
        json_number(curve.width),
        json_numbers(selected.iter().map(|&index| curve.time[index])),
        json_numbers(selected.iter().map(|&index| curve.values[index])),
    )
}

/// The times at which references step or ramp, s: readers zoom in there.
fn marks(study: &Study) -> Vec<f64> {
    let events = study.runs.iter().flat_map(|run| &run.events);
    let commanded =
        events.filter(|event| event.description.contains("steps to") || event.description.contains("ramps to"));
    let mut marks: Vec<f64> = commanded.map(|event| event.time).filter(|time| time.is_finite()).collect();
    marks.sort_by(f64::total_cmp);
    let resolution = 1e-6 / curves::clock(study).per_second;
    marks.dedup_by(|next, selected| *next - *selected < resolution);
    marks.truncate(MARKS);
    marks
}
