//! A page as one HTML file without external resources.

use super::curves::{ON_DARK, ON_WHITE};
use super::model::{Alert, Block, Body, Cell, Chart, Matrix, Page, Picture, Section, Tone};
use super::prose::{Piece, pieces};
use super::text::{escape as escaped, powers};
use kardan_results::Verdict;

const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../assets/uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("../assets/uplot/LICENSE");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const SAMPLES: &str = include_str!("samples.js");

/// A matrix with more rows or columns is not shown.
const LARGE: usize = 40;
/// More rows of a long table are counted, not shown.
const ROWS: usize = 100;
/// More columns of a matrix go below the first ones.
const ACROSS: usize = 10;
/// How to use charts; `still`: whether some of them cannot be zoomed.
fn charts(still: bool) -> String {
    let chart_note = if still { "the charts over time follow, the others do not" } else { "all charts follow" };
    format!(
        "<p class=\"hint\">Drag across a chart to zoom in time, double-click to return; {chart_note}. Click a name in a legend to hide or \
         show its curve.</p>\n"
    )
}
/// Digits of rounded entries of a matrix.
const DIGITS: usize = 6;

/// See [`Page::html`].
pub(super) fn html(page: &Page) -> String {
    let scripts = page.data.as_ref().map_or(String::new(), |data| {
        format!(
            "<script type=\"application/json\" id=\"data\">{data}</script>\n\
             <script>\n/* uPlot 1.6.32\n{UPLOT_LICENSE}*/\n{}</script>\n<script>\n{SCRIPT}</script>\n",
            strip_banner(UPLOT),
        )
    });
    let samples = page.samples.as_ref().map_or(String::new(), |data| {
        format!("<script type=\"application/json\" id=\"samples-data\">{data}</script>\n<script>\n{SAMPLES}</script>\n")
    });
    let scripts = scripts + &samples;
    let scripted = "<script>document.documentElement.className = \"scripted\";</script>\n";
    let (style, head, credits) = match (&page.data, &page.samples) {
        (Some(_), _) => (UPLOT_STYLE, scripted, " Charts by uPlot 1.6.32 (MIT)."),
        (None, Some(_)) => ("", scripted, ""),
        (None, None) => ("", "", ""),
    };
    let paragraphs = page.description.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty());
    let description: String =
        paragraphs.map(|text| format!("<p class=\"description\">{}</p>\n", prose(text.trim()))).collect();
    let verdict = page.verdict.as_ref().map_or(String::new(), |verdict| {
        let class = if verdict.sound { "good" } else { "bad" };
        format!("<p class=\"verdict {class}\">{}</p>\n", prose(&verdict.text))
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
        name = escape(&page.name),
        palette = palette(),
        alerts = page.alerts.iter().map(alert).collect::<String>(),
        contents = contents(&page.sections),
        sections = page.sections.iter().map(section).collect::<String>(),
    )
}

/// Plain text with superscript powers, escaped for HTML.
fn escape(text: &str) -> String {
    escaped(&powers(text))
}

/// The same with text between backticks as code, and long fractions as decimals with the exact value.
fn prose(text: &str) -> String {
    let markup = |piece: &Piece| match piece {
        Piece::Plain(text) => escape(text),
        Piece::Code(text) => format!("<code>{}</code>", escaped(text)),
        Piece::Fraction(exact, decimals) => format!("<abbr title=\"{exact}\">{decimals}</abbr>"),
    };
    pieces(text).iter().map(markup).collect()
}

/// A prominent box.
fn alert(alert: &Alert) -> String {
    let (kind, text) = (escape(&alert.kind), prose(&alert.text));
    format!("<div class=\"failure\" role=\"alert\"><strong>{kind}:</strong> {text}</div>\n")
}

/// Links to sections.
fn contents<'a>(sections: impl IntoIterator<Item = &'a Section>) -> String {
    let link = |one: &Section| format!("<a href=\"#{}\">{}</a>\n", escape(&one.anchor), escape(&one.title));
    format!("<nav>\n{}</nav>\n", sections.into_iter().map(link).collect::<String>())
}

/// A section with its title.
fn section(one: &Section) -> String {
    let (anchor, title) = (escape(&one.anchor), escape(&one.title));
    let all = &one.body.0;
    let parts: Vec<&Section> = all.iter().filter_map(anchored).collect();
    // Its own contents precede the first of its parts.
    let (before, after) = all.split_at(all.iter().position(|block| anchored(block).is_some()).unwrap_or(all.len()));
    let contents = if parts.is_empty() { String::new() } else { contents(parts) };
    let (before, after) = (blocks(before, 3), blocks(after, 3));
    let of = |still: bool| all.iter().any(|block| matches!(block, Block::Chart(chart) if chart.still == still));
    let hint = if of(false) { charts(of(true)) } else { String::new() };
    format!("<section id=\"{anchor}\">\n<h2>{title}</h2>\n{hint}{before}{contents}{after}</section>\n")
}

/// A part that may be a link target.
fn anchored(block: &Block) -> Option<&Section> {
    match block {
        Block::Part(part) if !part.anchor.is_empty() => Some(part),
        _ => None,
    }
}

/// Blocks below a heading; `level` is that of the next heading.
fn blocks(all: &[Block], level: usize) -> String {
    all.iter().map(|one| block(one, level)).collect()
}

fn block(block: &Block, level: usize) -> String {
    let inner = |body: &Body| blocks(&body.0, (level + 1).min(4));
    match block {
        Block::Text(tone, text) => {
            let class = match tone {
                Tone::Plain => "",
                Tone::Hint => " class=\"hint\"",
                Tone::Good => " class=\"good\"",
                Tone::Bad => " class=\"bad\"",
            };
            format!("<p{class}>{}</p>\n", prose(text))
        }
        Block::Verdict(Verdict { sound, text }) => {
            format!("<p class=\"{}\">{}</p>\n", if *sound { "good" } else { "bad" }, prose(text))
        }
        Block::Alert(one) => alert(one),
        Block::List(texts) => {
            let items: String = texts.iter().map(|text| format!("<li>{}</li>\n", prose(text))).collect();
            format!("<ul>\n{items}</ul>\n")
        }
        Block::Names(what, names) => {
            let codes: Vec<String> = names.iter().map(|name| format!("<code>{}</code>", prose(name))).collect();
            let codes = if codes.is_empty() { "none".into() } else { codes.join(", ") };
            format!("<p>{} ({}): {codes}</p>\n", escape(what), names.len())
        }
        Block::Table(found) => {
            let shown = ROWS.max(found.brief);
            let rest = found.rows.len().saturating_sub(shown);
            let hint = format!("<p class=\"hint\">{rest} more are in the exported data.</p>\n");
            table(&found.columns, found.rows.iter().take(shown)) + if rest > 0 { &hint } else { "" }
        }
        Block::Matrices(all) => matrices(all),
        Block::Picture(picture) => figure(picture, level),
        Block::Chart(one) => chart(one, level),
        Block::Part(Section { anchor, title, body }) => {
            let id = if anchor.is_empty() { String::new() } else { format!(" id=\"{}\"", escape(anchor)) };
            format!("<h{level}{id}>{}</h{level}>\n{}", prose(title), inner(body))
        }
        Block::Fold(title, body) => {
            format!("<details><summary>{}</summary>\n{}</details>\n", prose(title), inner(body))
        }
        Block::Detail(body) => blocks(&body.0, level),
    }
}

/// A table that scrolls within itself where it is larger than the page.
fn table<'a>(columns: &[String], rows: impl Iterator<Item = &'a Vec<Cell>>) -> String {
    let mut html = String::from("<div class=\"scroll\"><table>");
    if columns.iter().any(|title| !title.is_empty()) {
        html += "<thead><tr>";
        for title in columns {
            html += &match title.strip_prefix('#') {
                Some(number) => format!("<th scope=\"col\" class=\"number\">{}</th>", escape(number)),
                None => format!("<th scope=\"col\">{}</th>", escape(title)),
            };
        }
        html += "</tr></thead>";
    }
    html += "<tbody>\n";
    for row in rows {
        html += "<tr>";
        for (k, (one, title)) in row.iter().zip(columns).enumerate() {
            html += &cell(one, title.starts_with('#'), k == 0);
        }
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

fn cell(cell: &Cell, number: bool, first: bool) -> String {
    let class = if number { " class=\"number\"" } else { "" };
    match cell {
        Cell::Text(text) if first && !number => format!("<th scope=\"row\">{}</th>", prose(text)),
        Cell::Text(text) => format!("<td{class}>{}</td>", prose(text)),
        Cell::Code(text) => format!("<td><code>{}</code></td>", prose(text)),
        Cell::Verbatim(text) => format!("<td><code>{}</code></td>", escaped(text)),
        Cell::Mark(good, word) => {
            let (class, sign) = if *good { ("good", "✓") } else { ("bad", "✗") };
            format!("<td><span class=\"{class}\">{sign} {}</span></td>", prose(word))
        }
        Cell::Span(text, rows) => format!("<th scope=\"rowgroup\" rowspan=\"{rows}\">{}</th>", prose(text)),
        Cell::Under => String::new(),
        Cell::Entry(entry) => {
            let (text, rounded) = entry.rounded_text(DIGITS);
            let title = entry.exact.as_ref().filter(|_| rounded);
            let title = title.map_or(String::new(), |exact| format!(" title=\"{}\"", escape(exact)));
            format!("<td class=\"number\"{title}>{}</td>", escape(&text))
        }
    }
}

/// Matrices side by side, fractions where they are short.
fn matrices(all: &[Matrix]) -> String {
    let rounded = all.iter().flat_map(|one| one.entries.iter().flatten()).any(|entry| entry.rounded_text(DIGITS).1);
    let hint = "<p class=\"hint\">Long fractions are rounded here; they appear under the pointer and are in the exported \
                data.</p>\n";
    let shown: String = all.iter().map(matrix).collect();
    format!("<div class=\"matrices\">\n{shown}</div>\n{}", if rounded { hint } else { "" })
}

fn matrix(matrix: &Matrix) -> String {
    let (height, width) = (matrix.entries.len(), matrix.columns.len());
    let title = escape(&matrix.title);
    if height.max(width) > LARGE {
        return format!(
            "<div class=\"matrix\"><h4>{title}</h4>\n<p class=\"hint\">{height} × {width}: too large to be shown, see \
             the exported data.</p>\n</div>\n"
        );
    }
    let mut tables = String::new();
    for from in (0..width).step_by(ACROSS) {
        let part = matrix.table(from..(from + ACROSS).min(width));
        tables += &table(&part.columns, part.rows.iter());
    }
    format!("<div class=\"matrix\"><h4>{title}</h4>\n{tables}</div>\n")
}

/// A drawing with its title and how to read it.
fn figure(picture: &Picture, level: usize) -> String {
    let Picture { title, drawing, caption } = picture;
    if title.is_empty() {
        let caption = if caption.is_empty() { String::new() } else { format!("<p class=\"hint\">{caption}</p>\n") };
        return format!("{drawing}{caption}");
    }
    format!(
        "<figure class=\"analysis\">\n<h{level}>{}</h{level}>\n{drawing}<figcaption>{caption}</figcaption>\n</figure>\n",
        escape(title)
    )
}

/// A chart, with the picture that replaces it on paper and without scripts.
fn chart(chart: &Chart, level: usize) -> String {
    let Chart { anchor, title, index, still, svg, caption } = chart;
    let caption =
        if caption.is_empty() { String::new() } else { format!("<figcaption>{}</figcaption>\n", prose(caption)) };
    let zoomed = format!(
        "<div class=\"tools\" data-plot=\"{index}\"></div>\n\
         <div class=\"chart\" data-plot=\"{index}\" role=\"img\" aria-label=\"{}\"></div>\n",
        escape(title)
    );
    let zoomed = if *still { String::new() } else { zoomed };
    format!(
        "<figure id=\"plot-{anchor}\"{class}>\n<h{level}>{title}</h{level}>\n{zoomed}<div class=\"picture\">{svg}</div>\n{caption}</figure>\n",
        class = if *still { " class=\"still\"" } else { "" },
        anchor = escaped(anchor),
        title = escape(title),
        // Inside HTML the namespace is implied.
        svg = svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1),
    )
}

/// The library without the first comment, whose address the page must not contain; the licence is
/// before it instead.
fn strip_banner(library: &str) -> &str {
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
        ":root{{{}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}\n",
        properties(&ON_WHITE),
        properties(&ON_DARK)
    )
}

#[cfg(test)]
#[path = "../tests/unit/html.rs"]
mod tests;
