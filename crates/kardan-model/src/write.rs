//! Inserts values into the text of a model file and leaves the rest unchanged.

use std::ops::Range;

use kardan_rt::functions::{log10, powi};

use super::document::{Document, Instance};
use super::reading::read;
use kardan_results::signal_name;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Kind, Placed, Scalar, Sign, Value};

/// A value for a key of an element (`fs.damping`) or an entry of `[parameters]`, SI, with the interval that it lies in.
#[derive(Debug, Clone, PartialEq)]
pub struct NewValue {
    /// The key or entry.
    pub name: String,
    /// SI.
    pub value: f64,
    /// Lower and upper end, SI, if they are known.
    pub interval: Option<(f64, f64)>,
    /// The confidence of the interval (0.95).
    pub confidence: f64,
}

/// A text in place of another.
struct Edit {
    place: Range<usize>,
    text: String,
}

/// The text of a model file with new values, and the values that could not be inserted, with the reason.
///
/// A value takes the place of the one written; comments, order and all other text remain. A key that is an entry of `[parameters]`
/// with no other use is changed there; a missing one is added below the header of its table.
///
/// ```
/// use kardan_model::{NewValue, write_values};
/// let source = "[shaft.a] # motor\ninertia = \"2 kg cm^2\" # guessed\n";
/// let value = |name: &str, value: f64, interval| NewValue { name: name.into(), value, interval, confidence: 0.95 };
/// let new = [value("a.inertia", 3e-4, None), value("a.damping", 0.5, Some((0.25, 0.75)))];
/// let (text, left) = write_values(source, &new).unwrap();
/// assert_eq!(text, "[shaft.a] # motor\ndamping = \"0.5 N m s/rad [0.25, 0.75] 95 %\"\ninertia = \"0.0003 kg m^2\" # guessed\n");
/// assert!(left.is_empty());
/// ```
///
/// # Errors
/// Errors of the file, or of the resulting text.
pub fn write_values(source: &str, values: &[NewValue]) -> Result<(String, Vec<String>), Vec<Diagnostic>> {
    let errors =
        |found: Vec<Diagnostic>| -> Vec<Diagnostic> { found.into_iter().filter(Diagnostic::is_error).collect() };
    let (document, diagnostics) = read(source);
    let diagnostics = errors(diagnostics);
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let mut omissions = Vec::new();
    let mut edits: Vec<Edit> = Vec::new();
    for new in values {
        match edit(source, &document, new) {
            Ok(edit) => edits.push(edit),
            Err(why) => omissions.push(format!("{}: {why}", new.name)),
        }
    }
    // From the end, so that places stay valid.
    edits.sort_by_key(|edit| std::cmp::Reverse((edit.place.start, edit.place.end)));
    let mut text = source.to_string();
    for edit in edits {
        text.replace_range(edit.place, &edit.text);
    }
    let (after, diagnostics) = read(&text);
    let mut diagnostics = errors(diagnostics);
    for variant in after.variant_settings() {
        diagnostics.extend(errors(after.model_with(&variant.settings, variant.controls.as_deref()).1));
    }
    if diagnostics.is_empty() { Ok((text, omissions)) } else { Err(diagnostics) }
}

fn edit(source: &str, document: &Document, new: &NewValue) -> Result<Edit, String> {
    if !new.value.is_finite() {
        return Err("no value was found".into());
    }
    if let Some(parameter) = document.parameters.get(&new.name) {
        if document.is_varied(&new.name) {
            return Err("the file varies it, so no single value applies".into());
        }
        let text = quoted(new, &parameter.dimension.si(), Sign::Any);
        return Ok(Edit { place: parameter.place.span(), text });
    }
    let (element, key) = signal_name::parameter(&new.name).ok_or("no such parameter")?;
    let instance = document.elements.get(element).ok_or("no such element")?;
    let field = instance.kind.fields.iter().find(|field| field.name == key).ok_or("no such key")?;
    let (unit, sign) = match field.kind.for_translation(instance.table.translational) {
        Kind::Quantity(dimension, sign) => (dimension.si(), sign),
        Kind::Number(sign) => (String::new(), sign),
        _ => return Err("no quantity".into()),
    };
    if sign != Sign::Any && new.value < 0.0 {
        return Err("the identified value is below zero, which the file cannot represent".into());
    }
    let text = quoted(new, &unit, sign);
    match instance.table.values.get(key) {
        Some(Placed { value: Value::Scalar(Scalar::Parameter(name)), place }) => {
            let declared = document.parameters.get(name);
            match declared {
                Some(parameter) if users(document, name) == 1 && !document.is_varied(name) => {
                    Ok(Edit { place: parameter.place.span(), text })
                }
                _ => Ok(Edit { place: place.span(), text }),
            }
        }
        Some(Placed { place, .. }) => Ok(Edit { place: place.span(), text }),
        None => {
            let place = below_header(source, instance).ok_or("its table is written in one line: add the key there")?;
            // As the lines of the file end.
            let end = if source.contains("\r\n") { "\r\n" } else { "\n" };
            let before = if place > 0 && source.as_bytes()[place - 1] == b'\n' { "" } else { end };
            Ok(Edit { place: place..place, text: format!("{before}{key} = {text}{end}") })
        }
    }
}

/// Keys of elements and laws that name a parameter.
fn users(document: &Document, parameter: &str) -> usize {
    document
        .model_tables()
        .flat_map(|(_, _, table)| table.values.values())
        .filter(|entry| match &entry.value {
            Value::Scalar(Scalar::Parameter(name)) => name == parameter,
            Value::Scalar(Scalar::Expression(expression)) => expression.names().contains(&parameter),
            _ => false,
        })
        .count()
        + document
            .parameters
            .iter()
            .filter_map(|p| p.expression.as_ref())
            .filter(|e| e.names().contains(&parameter))
            .count()
}

/// The start of the line below `[element.name]`.
fn below_header(source: &str, instance: &Instance) -> Option<usize> {
    let start = source[..instance.place.span().start].rfind('\n').map_or(0, |at| at + 1);
    if !source[start..].trim_start().starts_with('[') {
        return None;
    }
    Some(source[instance.place.span().end..].find('\n').map_or(source.len(), |at| instance.place.span().end + at + 1))
}

/// `"0.5 N m s/rad [0.25, 0.75] 95 %"`
fn quoted(new: &NewValue, unit: &str, sign: Sign) -> String {
    let number = |x: f64| {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(x);
        text.strip_suffix(".0").unwrap_or(text).to_string()
    };
    let digits = |x: f64, reference: f64| {
        // Two digits more than the interval is wide.
        let width = new.interval.map_or(0.0, |(low, high)| high - low).abs();
        let size = reference.abs().max(width);
        if !(width > 0.0 && size > 0.0) {
            return x;
        }
        let places = (1.0 - log10(width).floor() + 1.0).clamp(-300.0, 300.0) as i32;
        let scale = powi(10.0, places);
        let rounded = (x * scale).round() / scale;
        if rounded.is_finite() { rounded } else { x }
    };
    let value = digits(new.value, new.value);
    let Some((low, high)) = new.interval.filter(|(low, high)| low.is_finite() && high.is_finite() && low < high) else {
        let text = format!("{} {unit}", number(new.value));
        return format!("\"{}\"", text.trim_end());
    };
    let low = if sign == Sign::Any { low } else { low.max(0.0) };
    let (low, high) = (digits(low, new.value).min(value), digits(high, new.value).max(value));
    let percent = number((new.confidence * 1e6).round() / 1e4);
    format!("\"{} {unit} [{}, {}] {percent} %\"", number(value), number(low), number(high))
}
