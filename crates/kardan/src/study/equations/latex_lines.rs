//! Long equations in LaTeX, in lines that fit on a page.

use kardan_mechanics::equations::Domain;

/// Width of a line of text, in widths of a letter.
pub(in crate::study) const LINE: f64 = 62.0;

/// Functions whose names are written out.
const FUNCTION_NAMES: [&str; 11] =
    ["sin", "cos", "tan", "exp", "ln", "min", "max", "arcsin", "arccos", "arctan", "operatorname"];

/// Indices and powers are smaller.
const SMALL: f64 = 0.65;

/// Approximate width of a typeset formula, in widths of a letter.
pub(in crate::study) fn width(latex: &str) -> f64 {
    let (mut rest, mut all) = (latex, 0.0);
    while let Some(sign) = rest.chars().next() {
        let (own, after) = match sign {
            '\\' => command(&rest[1..]),
            '^' | '_' => {
                let (inner, after) = argument(&rest[1..]);
                (SMALL * width(inner), after)
            }
            '{' => {
                let (inner, after) = argument(rest);
                (width(inner), after)
            }
            ' ' | '}' | '&' => (0.0, &rest[1..]),
            '+' | '-' | '=' => (1.8, &rest[1..]),
            _ => (1.0, &rest[sign.len_utf8()..]),
        };
        all += own;
        rest = after;
    }
    all
}

/// The width of a command, and the rest after it.
fn command(rest: &str) -> (f64, &str) {
    let end = rest.find(|sign: char| !sign.is_ascii_alphabetic()).unwrap_or(rest.len());
    if end == 0 {
        let after = &rest[rest.chars().next().map_or(0, char::len_utf8)..];
        return (if rest.starts_with('_') { 1.0 } else { 0.3 }, after);
    }
    let (name, after) = rest.split_at(end);
    match name {
        "frac" => {
            let (above, after) = argument(after);
            let (below, after) = argument(after);
            (width(above).max(width(below)), after)
        }
        "begin" | "end" => (0.0, argument(after).1),
        "left" | "right" | "biggl" | "biggr" | "dot" | "ddot" | "mathrm" | "mathit" | "mathsf" | "text" => (0.0, after),
        "operatorname" => (0.5, after),
        "quad" => (2.0, after),
        name if FUNCTION_NAMES.contains(&name) => (name.len() as f64, after),
        _ => (1.0, after),
    }
}

/// A group in braces, or one character; and the rest after it.
fn argument(rest: &str) -> (&str, &str) {
    let rest = rest.trim_start();
    if !rest.starts_with('{') {
        let end = rest.chars().next().map_or(0, char::len_utf8);
        return rest.split_at(end);
    }
    let mut depth = 0i32;
    for (at, sign) in rest.char_indices() {
        depth += i32::from(sign == '{') - i32::from(sign == '}');
        if depth == 0 {
            return (&rest[1..at], &rest[at + 1..]);
        }
    }
    (&rest[1..], "")
}

/// Possible breaks of a formula, before ` + `, ` - ` or ` = `, each with the number of open parentheses there. Within braces, and
/// within parentheses that grow, it is never broken.
fn places(latex: &str) -> Vec<(usize, i32)> {
    let (mut braces, mut growing, mut parentheses) = (0i32, 0i32, 0i32);
    let mut out = Vec::new();
    for (at, sign) in latex.char_indices() {
        let before = &latex[..at];
        match sign {
            '{' => braces += 1,
            '}' => braces -= 1,
            '(' if before.ends_with(r"\left") => growing += 1,
            ')' if before.ends_with(r"\right") => growing -= 1,
            '(' => parentheses += 1,
            ')' => parentheses -= 1,
            ' ' if braces == 0 && growing == 0 && at > 0 => {
                let operator = [" + ", " - ", " = "].into_iter().any(|operator| latex[at..].starts_with(operator));
                out.extend(operator.then_some((at, parentheses)));
            }
            _ => {}
        }
    }
    out
}

/// The parts of a formula that fit in lines: broken where the fewest parentheses are open, as late as possible.
fn parts(latex: &str, line: f64) -> Vec<&str> {
    let (places, mut out, mut begin) = (places(latex), Vec::new(), 0);
    while width(&latex[begin..]) > line {
        let open = || places.iter().filter(|(at, _)| *at > begin);
        let fitting = open().filter(|(at, _)| (0.3 * line..=line).contains(&width(&latex[begin..*at])));
        let best = fitting.min_by_key(|(at, depth)| (*depth, std::cmp::Reverse(*at))).or_else(|| open().next());
        let Some((at, _)) = best else { break };
        out.push(latex[begin..*at].trim());
        begin = *at;
    }
    out.push(latex[begin..].trim());
    out
}

/// Text for a comment, which ends with its line.
pub(in crate::study) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A formula in lines of `align*`, if it does not fit in one line with the text `before` it.
pub(in crate::study) fn in_lines(latex: &str, before: f64) -> String {
    parts(latex, LINE - before).join(" \\\\\n  &\\quad {} ")
}

/// Lines of equations, each with its left and right side, aligned where all of them fit in a line.
pub(in crate::study) fn aligned(equations: &[(String, String)]) -> String {
    let widths = |side: fn(&(String, String)) -> &String| equations.iter().map(move |one| width(side(one)));
    let left = widths(|one| &one.0).fold(0.0, f64::max);
    let line = |(own, right): &(String, String)| match left > LINE / 2.0 {
        true => format!("  &{}", in_lines(&format!("{own} = {right}"), 0.0)),
        false => format!("  {own} &= {}", in_lines(right, left + 2.0)),
    };
    let lines: Vec<String> = equations.iter().map(line).collect();
    format!("\\begin{{align*}}\n{}\n\\end{{align*}}\n", lines.join(" \\\\\n"))
}

/// A name as an index.
pub(in crate::study) fn index(name: &str) -> String {
    format!(r"\mathrm{{{}}}", name.replace('_', r"\_").replace('-', r"\text{-}"))
}

/// A coordinate, its rate or its acceleration, by the order of the derivative.
pub(in crate::study) fn motion(domain: Domain, order: usize, name: &str) -> String {
    let letter = match domain {
        Domain::Charge => " q",
        Domain::Number => " z",
        Domain::Translation => " s",
        Domain::Rotation => r"\varphi",
    };
    let (dots, letter) = match order {
        0 => ("", letter.trim_start()),
        1 => (r"\dot", letter),
        _ => (r"\ddot", letter),
    };
    format!("{dots}{letter}_{{{}}}", index(name))
}

/// A name without characters that have a meaning in a formula.
pub(in crate::study) fn word(name: &str) -> String {
    name.replace(['-', '.'], "_")
}

#[cfg(test)]
#[path = "../../../tests/unit/study/equations/latex_lines.rs"]
mod tests;
