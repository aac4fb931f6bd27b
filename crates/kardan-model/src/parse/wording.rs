//! Expected types and source values as phrases.

use kardan_math::names::{did_you_mean, how_to_fix_shaft, is_fixed_name, nearest_or_similar};
use kardan_math::units::{Dimension, format_quantity};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::{KeyedEntry, RawValue};
use kardan_schema::schema::{Kind, present_name};

/// `owner` is the name of the table, if it has one.
pub(super) fn unknown_key(entry: &KeyedEntry, keys: &[&str], what: &str, owner: &str) -> Diagnostic {
    let name = entry.key.as_str();
    let help = match present_name(name, keys) {
        Some(new) => format!("it is called `{new}`"),
        None => did_you_mean(nearest_or_similar(name, keys.iter().copied()), || match keys {
            _ if is_fixed_name(name) && what.starts_with("shaft ") => how_to_fix_shaft(owner),
            [] => format!("{what} takes no keys; remove it"),
            keys => format!("known keys are {}", listed(keys, "and")),
        }),
    };
    Diagnostic::error("key::unknown", format!("{what} has no key `{}`", shortened(name)))
        .at(&entry.place, "unknown key")
        .help(help)
}

/// A value as a phrase.
pub(super) fn describe_value(value: &RawValue) -> String {
    match value {
        RawValue::Text(text) if text.chars().count() <= 40 => format!("the text {text:?}"),
        RawValue::Text(_) => "a text".to_string(),
        RawValue::Number(number) | RawValue::Other("a number", number) if number.len() <= 40 => {
            format!("the number {number}")
        }
        RawValue::Number(_) => "a number".to_string(),
        RawValue::Quantity(number, dimension) => format_quantity(number, *dimension),
        RawValue::Other(what, _) => (*what).to_string(),
        RawValue::List(_) => "a list".to_string(),
        RawValue::Table(_) => "a table".to_string(),
        RawValue::Broken => "an unreadable value".to_string(),
    }
}

/// The expected type as a phrase.
pub(super) fn expected(kind: &Kind) -> String {
    match kind {
        Kind::Shaft => "the name of a shaft".to_string(),
        Kind::Mass => "the name of a mass".to_string(),
        Kind::Body => "the name of a shaft or mass".to_string(),
        Kind::Node => "the name of a node".to_string(),
        Kind::Shafts(0) => "a list of one or more shaft names".to_string(),
        Kind::Shafts(1) => "a list of one shaft name".to_string(),
        Kind::Shafts(count) => format!("a list of {count} shaft names"),
        Kind::Quantity(dimension, _) | Kind::Mechanical(dimension, _) => {
            format!("{} such as {}", dimension.noun(), dimension.example())
        }
        Kind::Number(_) => "a decimal number or the name of a parameter".to_string(),
        Kind::Coefficients => "a table from names of shafts and masses to numbers".to_string(),
        Kind::Coefficient => "a number, or a length for each angle".to_string(),
        Kind::Choice(choices) => format!("one of {}", listed(choices, "or")),
        Kind::Element(kinds) => format!("the name of an element of the kind {}", listed(kinds, "or")),
        Kind::Elements(kinds) => format!("a list of one or more names of elements of the kind {}", listed(kinds, "or")),
        Kind::Signal => "the name of a signal".to_string(),
        Kind::Signals => "a list of signal names".to_string(),
        Kind::Names => "a list of names".to_string(),
        Kind::Name => "a new name".to_string(),
        Kind::Text => "a text".to_string(),
        Kind::AnyQuantity => "a quantity such as \"1.3 N m\"".to_string(),
        Kind::Overrides => "a table from names to quantities".to_string(),
        Kind::Point => "a table from signals to quantities, or a text such as \"t = 3.2 s\"".to_string(),
        Kind::Lists => "a table from names to lists of quantities".to_string(),
        Kind::Functions => "a table from names to functions of time".to_string(),
        Kind::Expressions => "a table from names to expressions".to_string(),
        Kind::Expression => format!("an expression such as {}", example(kind)),
        Kind::Surface => format!("an expression of angles and positions such as {}", example(kind)),
        Kind::Formulas => "a table from names of shafts and masses to expressions".to_string(),
        Kind::Formula(dimension) => format!("an expression of {} such as {}", dimension.si(), example(kind)),
        Kind::OfTime(dimension) => format!("{}, or a function of time such as {}", dimension.noun(), example(kind)),
        Kind::Tables(_) => "a list of tables".to_string(),
        Kind::Table(_) => "a table".to_string(),
        Kind::Output => "an angle or speed of a shaft, or a sensor".to_string(),
        Kind::Outputs => "a list of angles and speeds of shafts, and of sensors".to_string(),
        Kind::Poles => "a list of poles in 1/s".to_string(),
    }
}

/// A value of a kind as it stands in a file.
pub(crate) fn example(kind: &Kind) -> String {
    match kind {
        Kind::Shaft | Kind::Body => "\"wg\"".to_string(),
        Kind::Mass => "\"rack\"".to_string(),
        Kind::Node => "\"out\"".to_string(),
        Kind::Shafts(1) => "[\"wg\"]".to_string(),
        Kind::Shafts(0 | 2) => "[\"wg\", \"cs\"]".to_string(),
        Kind::Shafts(3) => "[\"wg\", \"cs\", \"fs\"]".to_string(),
        Kind::Shafts(_) => "[\"wg\", \"cs\", \"fs\", …]".to_string(),
        Kind::Quantity(dimension, _) | Kind::Mechanical(dimension, _) => dimension.example(),
        Kind::Number(_) => "1.5".to_string(),
        Kind::Coefficient => "1.5".to_string(),
        Kind::Coefficients => "{ wg = 1, cs = -51, fs = 50 }".to_string(),
        Kind::Choice(choices) => format!("\"{}\"", choices.first().unwrap_or(&"")),
        Kind::Element(kinds) => format!("\"my_{}\"", kinds.first().unwrap_or(&"element")),
        Kind::Elements(kinds) => format!("[\"my_{}\"]", kinds.first().unwrap_or(&"element")),
        Kind::Signal => "\"rk.phi\"".to_string(),
        Kind::Signals => "[\"rk.phi\", \"rk.w\"]".to_string(),
        Kind::Names => "[\"nominal\"]".to_string(),
        Kind::Name => "\"ref_rk\"".to_string(),
        Kind::Text => "\"a text\"".to_string(),
        Kind::AnyQuantity => "\"1.3 N m\"".to_string(),
        Kind::Overrides => "{ beta = \"0 deg\" }".to_string(),
        Kind::Point => "{ \"car.v\" = \"20 km/h\" }".to_string(),
        Kind::Lists => "{ wg = [\"20 rad/s\", \"60 rad/s\"] }".to_string(),
        Kind::Formula(dimension) => match *dimension == Dimension::FORCE {
            true => "\"-0.4 N s^2/m^2 * car.v * abs(car.v)\"".to_string(),
            false => "\"-2 N m * sin(arm.phi)\"".to_string(),
        },
        Kind::OfTime(dimension) => {
            let amplitude = dimension.example();
            format!("\"{} * sin(2 pi t / 1 s)\"", amplitude.trim_matches('"'))
        }
        Kind::Expressions => "{ assist = \"0.5 * torque_sensor.tau\" }".to_string(),
        Kind::Expression => "\"0.5 * torque_sensor.tau\"".to_string(),
        Kind::Surface => "\"q1.phi - 0.5 * sin(q2.phi)\"".to_string(),
        Kind::Formulas => "{ x = \"-sin(heading.phi)\", y = \"cos(heading.phi)\" }".to_string(),
        Kind::Functions => "{ load = \"2 N m * sin(2 pi t / 1 s)\" }".to_string(),
        Kind::Output => "\"rk.phi\"".to_string(),
        Kind::Outputs => "[\"rk.phi\", \"fs.phi\"]".to_string(),
        Kind::Poles => "[-50, \"-14 ± 14.3j\"]".to_string(),
        Kind::Tables(fields) | Kind::Table(fields) => {
            let keys: Vec<String> = fields
                .iter()
                .filter(|field| field.required)
                .map(|field| format!("{} = {}", field.name, example(&field.kind)))
                .collect();
            let table = format!("{{ {} }}", keys.join(", "));
            if matches!(kind, Kind::Table(_)) { table } else { format!("[{table}]") }
        }
    }
}

/// `` `a`, `b` or `c` ``
fn listed(items: &[&str], conjunction: &str) -> String {
    let quoted: Vec<String> = items.iter().map(|word| format!("`{word}`")).collect();
    match quoted.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} {conjunction} {last}", rest.join(", ")),
        None => String::new(),
    }
}
