//! The page around charts and tables.

use super::analysis;
use super::bench;
use super::charts;
use super::curves::{ON_DARK, ON_WHITE, variant_label};
use super::design;
use super::identification;
use super::summary::summary;
use super::tables;
use super::text::escape;
use super::words;
use kardan::results::{Analysis, BenchStudy, Design, Identification, Study};

const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../assets/uplot/LICENSE");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// See [`super::html`].
pub(super) fn html(study: &Study) -> String {
    let (good, verdict) = tables::verdict(study);
    let sections = [
        charts::charts(study),
        tables::key_figures(study),
        tables::requirements(study),
        tables::motors(study),
        tables::energy(study),
        tables::events(study),
        tables::notes(study),
        tables::warnings(study),
        summary(&study.model),
        study.designs.iter().enumerate().map(|(k, found)| design::section(found, k)).collect(),
        study.analysis.as_ref().map(|analysis| analysis::section(analysis, &whose(study))).unwrap_or_default(),
        tables::variants(study),
    ];
    let scripts = format!(
        "<script type=\"application/json\" id=\"data\">{}</script>\n\
         <script>\n/* uPlot 1.6.32\n{UPLOT_LICENSE}*/\n{}</script>\n<script>\n{SCRIPT}</script>\n",
        charts::data(study),
        without_banner(UPLOT),
    );
    let page = Page {
        name: if study.model.name.is_empty() { "Study" } else { &study.model.name },
        description: &study.model.description,
        verdict: Some((good, verdict)),
        alerts: tables::failures(study),
        sections: &sections,
        credits: " Charts by uPlot 1.6.32 (MIT).",
        style: UPLOT_STYLE,
        head: "<script>document.documentElement.className = \"scripted\";</script>\n",
        scripts: &scripts,
    };
    page.html()
}

/// Whose analysis the report shows.
fn whose(study: &Study) -> String {
    let open = "Without the laws, linearised at the operating point.";
    match &study.runs[..] {
        [first, _, ..] => {
            format!("{open} Variant {}; `kardan analyze --variant NAME` shows another.", variant_label(study, first))
        }
        _ => open.into(),
    }
}

/// See [`super::analysis_html`].
pub(super) fn analysis_html(analysis: &Analysis) -> String {
    let page = Page {
        name: if analysis.name.is_empty() { "Structure analysis" } else { &analysis.name },
        description: &analysis.description,
        verdict: analysis::verdict(analysis).map(|(good, text)| (good && analysis.unfinished.is_none(), text)),
        alerts: analysis::alerts(analysis),
        sections: &analysis::sections(analysis),
        credits: "",
        style: "",
        head: "",
        scripts: "",
    };
    page.html()
}

/// See [`super::design_html`].
pub(super) fn design_html(found: &Design) -> String {
    let name = match (found.model.is_empty(), found.controller.is_empty()) {
        (true, true) => "Design".into(),
        (true, _) => found.controller.clone(),
        (_, true) => found.model.clone(),
        _ => format!("{}: {}", found.model, found.controller),
    };
    let page = Page {
        name: &name,
        description: &found.description,
        verdict: (!found.law.is_empty()).then(|| found.verdict()),
        alerts: design::alerts(found),
        sections: &design::sections(found),
        credits: "",
        style: "",
        head: "",
        scripts: "",
    };
    page.html()
}

/// See [`super::identification_html`].
pub(super) fn identification_html(found: &Identification) -> String {
    let name =
        if found.model.is_empty() { "Identification".into() } else { format!("Identification: {}", found.model) };
    let page = Page {
        name: &name,
        description: &found.description,
        verdict: (!found.parameters.is_empty()).then(|| found.verdict()),
        alerts: identification::alerts(found),
        sections: &identification::sections(found),
        credits: "",
        style: "",
        head: "",
        scripts: "",
    };
    page.html()
}

/// See [`super::bench_html`].
pub(super) fn bench_html(study: &BenchStudy) -> String {
    let page = Page {
        name: &format!("Bench: {}", study.model),
        description: &study.description,
        verdict: Some(words::bench::verdict(study)),
        alerts: identification::alerts(&study.identification) + &design::alerts(&study.closed_loop.design),
        sections: &bench::sections(study),
        credits: "",
        style: "",
        head: "",
        scripts: "",
    };
    page.html()
}

/// A page: what stands around its sections.
struct Page<'a> {
    name: &'a str,
    description: &'a str,
    /// Whether it is good, and why.
    verdict: Option<(bool, String)>,
    /// HTML above the contents.
    alerts: String,
    /// HTML.
    sections: &'a [String],
    /// What the footer says besides.
    credits: &'a str,
    /// Style sheet before ours.
    style: &'a str,
    /// HTML at the end of the head.
    head: &'a str,
    /// HTML at the end of the body.
    scripts: &'a str,
}

impl Page<'_> {
    fn html(&self) -> String {
        let description: String = self
            .description
            .split("\n\n")
            .filter(|paragraph| !paragraph.trim().is_empty())
            .map(|paragraph| format!("<p class=\"description\">{}</p>\n", escape(paragraph.trim())))
            .collect();
        let verdict = self.verdict.as_ref().map(|(good, verdict)| {
            let class = if *good { "good" } else { "bad" };
            format!("<p class=\"verdict {class}\">{}</p>\n", escape(verdict))
        });
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; \
             script-src 'unsafe-inline'; img-src data:\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta name=\"generator\" content=\"kardan {version}\">\n\
             <link rel=\"icon\" href=\"data:,\">\n<title>{name} – kardan</title>\n\
             <style>\n{style}\n{palette}{STYLE}</style>\n{head}</head>\n<body>\n\
             <header>\n<h1>{name}</h1>\n{description}{verdict}</header>\n{alerts}\
             {contents}<main>\n{sections}</main>\n\
             <footer>Written by kardan {version}. Units are SI; angles in rad.{credits}</footer>\n\
             {scripts}</body>\n</html>\n",
            version = env!("CARGO_PKG_VERSION"),
            name = escape(self.name),
            style = self.style,
            palette = palette(),
            head = self.head,
            verdict = verdict.unwrap_or_default(),
            alerts = self.alerts,
            contents = contents(self.sections),
            sections = self.sections.concat(),
            credits = self.credits,
            scripts = self.scripts,
        )
    }
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
