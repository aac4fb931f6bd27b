//! HTML tables.

use super::text::{escape, figure};

/// A cell.
pub(super) enum Cell {
    /// A text, escaped on output.
    Text(String),
    /// A number with a text after it, such as a unit; right-aligned.
    Number(String),
    /// A number and what it was rounded from, which appears under the pointer.
    Rounded(String, String),
    /// The name of this row and of as many rows below as the number says.
    Head(String, usize),
    /// HTML as it is.
    Html(String),
}

impl Cell {
    /// A number of five significant digits.
    pub(super) fn figure(value: f64) -> Cell {
        Cell::Number(figure(value, 5))
    }

    /// A text.
    pub(super) fn text(text: impl Into<String>) -> Cell {
        Cell::Text(text.into())
    }

    fn html(&self) -> String {
        match self {
            Cell::Text(text) => format!("<td>{}</td>", escape(text)),
            Cell::Number(text) => format!("<td class=\"number\">{}</td>", escape(text)),
            Cell::Rounded(text, exact) => {
                format!("<td class=\"number\" title=\"{}\">{}</td>", escape(exact), escape(text))
            }
            Cell::Head(text, 1) => format!("<th scope=\"row\">{}</th>", escape(text)),
            Cell::Head(text, rows) => format!("<th scope=\"rowgroup\" rowspan=\"{rows}\">{}</th>", escape(text)),
            Cell::Html(html) => format!("<td>{html}</td>"),
        }
    }
}

/// A table that scrolls within itself where it is larger than the page. A header that starts with `#` stands above
/// numbers.
pub(super) fn table(headers: &[impl AsRef<str>], rows: &[Vec<Cell>]) -> String {
    let mut html = String::from("<div class=\"scroll\"><table><thead><tr>");
    for header in headers {
        match header.as_ref().strip_prefix('#') {
            Some(number) => html += &format!("<th scope=\"col\" class=\"number\">{}</th>", escape(number)),
            None => html += &format!("<th scope=\"col\">{}</th>", escape(header.as_ref())),
        }
    }
    html += "</tr></thead><tbody>\n";
    for row in rows {
        html += "<tr>";
        row.iter().for_each(|cell| html += &cell.html());
        html += "</tr>\n";
    }
    html + "</tbody></table></div>\n"
}

/// A section of the page with its anchor.
pub(super) fn section(anchor: &str, title: &str, body: &str) -> String {
    format!("<section id=\"{anchor}\">\n<h2>{}</h2>\n{body}</section>\n", escape(title))
}
