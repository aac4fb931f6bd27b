//! The page around charts and tables.

use super::charts;
use super::curves::{ON_DARK, ON_WHITE};
use super::summary::summary;
use super::tables;
use super::text::escape;
use crate::results::Study;

const UPLOT: &str = include_str!("../../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../../assets/uplot/LICENSE");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// See [`super::html`].
pub(super) fn html(study: &Study) -> String {
    let name = if study.model.name.is_empty() { "Study" } else { &study.model.name };
    let (good, verdict) = tables::verdict(study);
    let description: String = study
        .model
        .description
        .split("\n\n")
        .filter(|paragraph| !paragraph.trim().is_empty())
        .map(|paragraph| format!("<p class=\"description\">{}</p>\n", escape(paragraph.trim())))
        .collect();
    let sections = [
        charts::charts(study),
        tables::key_figures(study),
        tables::requirements(study),
        tables::energy(study),
        tables::events(study),
        tables::notes(study),
        tables::warnings(study),
        summary(&study.model),
        tables::variants(study),
    ];
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
         script-src 'unsafe-inline'; img-src data:\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"generator\" content=\"kardan {version}\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{name} – kardan</title>\n\
         <style>\n{UPLOT_STYLE}\n{palette}{STYLE}</style>\n\
         <script>document.documentElement.className = \"scripted\";</script>\n</head>\n<body>\n\
         <header>\n<h1>{name}</h1>\n{description}<p class=\"verdict {class}\">{verdict}</p>\n</header>\n{failures}\
         {contents}<main>\n{sections}</main>\n\
         <footer>Written by kardan {version}. Units are SI; angles in rad. Charts by uPlot 1.6.32 (MIT).</footer>\n\
         <script type=\"application/json\" id=\"data\">{data}</script>\n\
         <script>\n/* uPlot 1.6.32\n{UPLOT_LICENSE}*/\n{uplot}</script>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        version = env!("CARGO_PKG_VERSION"),
        name = escape(name),
        palette = palette(),
        class = if good { "good" } else { "bad" },
        verdict = escape(&verdict),
        failures = tables::failures(study),
        contents = contents(&sections),
        sections = sections.concat(),
        data = charts::data(study),
        uplot = without_banner(UPLOT),
    )
}

/// Links to the sections that are there.
fn contents(sections: &[String]) -> String {
    let link = |section: &String| {
        let anchor = section.strip_prefix("<section id=\"")?.split('"').next()?;
        let title = section.split("<h2>").nth(1)?.split("</h2>").next()?;
        Some(format!("<a href=\"#{anchor}\">{title}</a>\n"))
    };
    format!("<nav>\n{}</nav>\n", sections.iter().filter_map(link).collect::<String>())
}

/// The library without the first comment, whose address has no place in a page that names none; the licence stands
/// before it instead.
fn without_banner(library: &str) -> &str {
    match library.strip_prefix("/*!").and_then(|rest| rest.split_once("*/")) {
        Some((_, code)) => code,
        None => library,
    }
}

/// The curves' colours as custom properties of the style sheet.
fn palette() -> String {
    let properties = |colours: &[&str]| -> String {
        colours.iter().enumerate().map(|(index, colour)| format!("--curve-{index}:{colour};")).collect()
    };
    format!(
        ":root{{{}}}\n@media (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        properties(&ON_WHITE),
        properties(&ON_DARK)
    )
}
