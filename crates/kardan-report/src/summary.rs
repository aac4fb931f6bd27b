//! The model in tables: elements, coordinates, matrices, laws, poles.

use super::table::{Cell, section, table};
use super::text::{escape, figure, unit};
use kardan::results::{ModelSummary, NamedMatrix, Pole};

/// A matrix with more rows or columns is not shown.
const LARGE: usize = 40;

/// The section on the model.
pub(super) fn summary(model: &ModelSummary) -> String {
    let mut body = String::new();
    if !model.elements.is_empty() {
        let rows: Vec<Vec<Cell>> = model
            .elements
            .iter()
            .map(|(kind, name, values)| {
                vec![Cell::Head(name.clone(), 1), Cell::text(kind.clone()), Cell::text(values.clone())]
            })
            .collect();
        body += &format!("<h3>Elements</h3>\n{}", table(&["name", "kind", "values"], &rows));
    }
    if !model.coordinates.is_empty() {
        let names: Vec<String> =
            model.coordinates.iter().map(|name| format!("<code>{}</code>", escape(name))).collect();
        body += &format!("<h3>Reduced coordinates</h3>\n<p>{}</p>\n", names.join(", "));
    }
    if !model.matrices.is_empty() {
        body += &format!("<h3>Reduced matrices at the initial position</h3>\n{}", matrices(&model.matrices));
    }
    for law in &model.laws {
        body += &format!("<h3>Law {} <span class=\"hint\">({})</span></h3>\n", escape(&law.name), escape(&law.law));
        let notes: String = law.notes.iter().map(|note| format!("<li>{}</li>\n", escape(&unit(note)))).collect();
        if !notes.is_empty() {
            body += &format!("<ul>\n{notes}</ul>\n");
        }
        body += &matrices(&law.gains);
    }
    if !model.closed_loop_poles.is_empty() {
        body += &format!(
            "<h3>Closed-loop poles</h3>\n<p class=\"hint\">Linearised at the initial position, first variant, without \
             Coulomb friction, in floating point.</p>\n{}",
            poles(&model.closed_loop_poles)
        );
    }
    if body.is_empty() {
        body = "<p>No summary of the model is given.</p>\n".into();
    }
    section("model", "Model", &body)
}

/// Matrices side by side.
pub(super) fn matrices(matrices: &[NamedMatrix]) -> String {
    let blocks: String = matrices.iter().map(matrix).collect();
    if blocks.is_empty() { blocks } else { format!("<div class=\"matrices\">\n{blocks}</div>\n") }
}

fn matrix(matrix: &NamedMatrix) -> String {
    let (height, width) = (matrix.values.len(), matrix.columns.len());
    if height.max(width) > LARGE {
        let title = escape(&matrix.title);
        return format!(
            "<div class=\"matrix\"><h4>{title}</h4>\n<p class=\"hint\">{height} × {width}: too large to be shown, see the \
             exported data.</p>\n</div>\n"
        );
    }
    let unit = if matrix.unit.is_empty() { String::new() } else { format!(" [{}]", unit(&matrix.unit)) };
    let mut headers = vec![String::new()];
    headers.extend(matrix.columns.iter().map(|column| format!("#{column}")));
    let rows: Vec<Vec<Cell>> = matrix
        .values
        .iter()
        .enumerate()
        .map(|(index, values)| {
            let name = matrix.rows.get(index).cloned().unwrap_or_default();
            let numbers = values.iter().map(|&value| Cell::figure(value));
            std::iter::once(Cell::Head(name, 1)).chain(numbers).collect()
        })
        .collect();
    format!(
        "<div class=\"matrix\"><h4>{}</h4>\n{}</div>\n",
        escape(&format!("{}{unit}", matrix.title)),
        table(&headers, &rows)
    )
}

/// One row for each real pole and each conjugate pair.
pub(super) fn poles(poles: &[Pole]) -> String {
    let mut rest = poles.to_vec();
    let mut rows = Vec::new();
    while !rest.is_empty() {
        let (real, imaginary) = rest.remove(0);
        let size = real.hypot(imaginary);
        let conjugate = |pole: &Pole| (pole.0 - real).hypot(pole.1 + imaginary) <= 1e-9 * size;
        let pair = if imaginary == 0.0 { None } else { rest.iter().position(conjugate) };
        let value = match (pair, imaginary) {
            (Some(_), _) => format!("{} ± {} j", figure(real, 5), figure(imaginary.abs(), 5)),
            (None, 0.0) => figure(real, 5),
            (None, _) => format!("{} + {} j", figure(real, 5), figure(imaginary, 5)),
        };
        pair.map(|index| rest.remove(index));
        let damping = if size > 0.0 { figure(-real / size, 4) } else { "–".into() };
        let stability = if real < 0.0 { "good" } else { "bad" };
        let word = if real < 0.0 {
            "decays"
        } else if real > 0.0 {
            "grows"
        } else {
            "does not decay"
        };
        rows.push(vec![
            Cell::Number(value),
            Cell::figure(size),
            Cell::Number(damping),
            Cell::Html(format!("<span class=\"{stability}\">{word}</span>")),
        ]);
    }
    table(&["#pole [1/s]", "#natural frequency [rad/s]", "#damping ratio", ""], &rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conjugate_poles_share_a_row() {
        let html = poles(&[(-3.0, 4.0), (-1.0, 0.0), (-3.0, -4.0)]);
        assert_eq!(html.matches("<tr>").count(), 3, "a header and two rows: {html}");
        assert!(html.contains("−3 ± 4 j") && html.contains(">5<") && html.contains(">0.6<"), "{html}");
    }
}
