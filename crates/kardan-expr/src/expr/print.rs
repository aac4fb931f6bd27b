//! Expressions as text and LaTeX.

use std::cell::Cell;

use super::nodes::Node;
use super::{Expr, Function, Graph};
use kardan_math::names::sign;
use kardan_math::num::Rational;

/// How an expression is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// As in a program: `2*sin(a.phi)^2`.
    Text,
    /// LaTeX.
    Latex,
}

/// The precedence of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Strength {
    Sum,
    Product,
    Power,
    Atom,
}

/// An expression as text with its symbols' names, `name` writes one.
///
/// ```
/// use kardan_expr::expr::{Function, Graph, Style, printed};
/// use kardan_math::units::Dimension;
/// let mut graph = Graph::default();
/// let x = graph.symbol("x", Dimension::NONE);
/// let (sine, square) = (graph.apply(Function::Sin, x), graph.power(x, -2));
/// let product = graph.multiply(sine, square);
/// let all = graph.sum(1.into(), &[(product, (-3).into())]);
/// assert_eq!(printed(&graph, all, Style::Text, &|name| name.into()), "1 - 3*sin(x)/x^2");
/// assert_eq!(printed(&graph, all, Style::Latex, &|name| name.into()), r"1 - 3\frac{\sin(x)}{x^{2}}");
/// ```
pub fn printed(graph: &Graph, expr: Expr, style: Style, name: &dyn Fn(&str) -> String) -> String {
    let (depth, budget) = (Cell::new(0), Cell::new(MOST_PARTS));
    Printer { graph, style, name, depth, budget }.rendered(expr).0
}

/// LaTeX within parentheses that are as high as it is; around long sums they have a fixed height, so that these can go on in another line.
///
/// ```
/// use kardan_expr::expr::parenthesised;
/// assert_eq!(parenthesised("a + b"), "(a + b)");
/// assert_eq!(parenthesised(r"\frac{a}{b}"), r"\left(\frac{a}{b}\right)");
/// ```
pub fn parenthesised(latex: &str) -> String {
    let high = [r"\frac", r"\sqrt", r"\begin", r"\left", r"\biggl"].into_iter().any(|word| latex.contains(word));
    match (high, latex.len() > LONG) {
        (false, _) => format!("({latex})"),
        (true, false) => format!(r"\left({latex}\right)"),
        (true, true) => format!(r"\biggl({latex}\biggr)"),
    }
}

/// Longer text may need several lines.
const LONG: usize = 300;

/// Without parentheses around all of it, which a bar of a fraction does not need.
pub fn bare(latex: &str) -> &str {
    let (open, close) = if latex.starts_with(r"\left(") { (r"\left(", r"\right)") } else { ("(", ")") };
    let Some(inner) = latex.strip_prefix(open).and_then(|rest| rest.strip_suffix(close)) else { return latex };
    let mut depth = 0i32;
    let closes = inner.chars().any(|sign| {
        depth += i32::from(sign == '(') - i32::from(sign == ')');
        depth < 0
    });
    if closes { latex } else { inner }
}

/// A power in LaTeX: that of a sine is before its angle.
pub fn raised(latex: &str, power: u32) -> String {
    for function in [r"\sin", r"\cos", r"\tan"] {
        if let Some(rest) = latex.strip_prefix(function) {
            return format!("{function}^{{{power}}}{rest}");
        }
    }
    // Marks of rates and functions are no powers.
    let together = latex.starts_with('\\') && ![r"\left", r"\biggl"].into_iter().any(|open| latex.starts_with(open));
    if together { format!("{{{latex}}}^{{{power}}}") } else { format!("{latex}^{{{power}}}") }
}

struct Printer<'a> {
    graph: &'a Graph,
    style: Style,
    name: &'a dyn Fn(&str) -> String,
    /// Parts within each other that are being written, and how many may still be.
    depth: Cell<usize>,
    budget: Cell<usize>,
}

/// Most nested parts, and most parts, of a printed expression; dots replace the rest.
const MOST_DEPTH: usize = 100;
const MOST_PARTS: usize = 100_000;

impl Printer<'_> {
    fn latex(&self) -> bool {
        self.style == Style::Latex
    }

    fn bracketed(&self, expr: Expr, least: Strength) -> String {
        let (text, strength) = self.rendered(expr);
        self.enclosed(text, strength < least)
    }

    fn enclosed(&self, text: String, needed: bool) -> String {
        match (needed, self.latex()) {
            (false, _) => text,
            (true, false) => format!("({text})"),
            (true, true) => parenthesised(&text),
        }
    }

    fn number(&self, value: &Rational) -> (String, Strength) {
        let (numerator, denominator) = (value.numerator(), value.denominator());
        let text = match (value.is_int(), self.latex()) {
            (true, _) => return (numerator.to_string(), Strength::Atom),
            (false, false) => format!("{numerator}/{denominator}"),
            (false, true) => format!(r"\frac{{{numerator}}}{{{denominator}}}"),
        };
        (text, Strength::Product)
    }

    fn rendered(&self, expr: Expr) -> (String, Strength) {
        let (depth, budget) = (self.depth.get(), self.budget.get());
        if depth == MOST_DEPTH || budget == 0 {
            return (if self.latex() { r"\dots" } else { "..." }.into(), Strength::Atom);
        }
        self.depth.set(depth + 1);
        self.budget.set(budget - 1);
        let rendered = self.render_node(expr);
        self.depth.set(depth);
        rendered
    }

    fn render_node(&self, expr: Expr) -> (String, Strength) {
        let call = |name: &str, parts: &[Expr]| {
            let parts: Vec<String> = parts.iter().map(|part| self.rendered(*part).0).collect();
            let name = if self.latex() { format!(r"\operatorname{{{name}}}") } else { name.to_owned() };
            (name + &self.enclosed(parts.join(", "), true), Strength::Atom)
        };
        match self.graph.node(expr) {
            Node::Number(value) => self.number(value),
            Node::Group(a) => self.rendered(*a),
            Node::Pi => (if self.latex() { r"\pi" } else { "pi" }.into(), Strength::Atom),
            Node::Symbol(symbol) => ((self.name)(self.graph.name(*symbol).0), Strength::Atom),
            Node::Sum { constant, terms } => self.sum(constant, terms),
            Node::Product(factors) => self.product(factors),
            Node::Apply(function, a) if self.latex() => {
                let inner = self.rendered(*a).0;
                let text = match function {
                    Function::Sqrt => format!(r"\sqrt{{{inner}}}"),
                    Function::Abs => format!(r"\left|{inner}\right|"),
                    Function::Asin => format!(r"\arcsin{}", parenthesised(&inner)),
                    Function::Acos => format!(r"\arccos{}", parenthesised(&inner)),
                    Function::Atan => format!(r"\arctan{}", parenthesised(&inner)),
                    _ => format!(r"\{}{}", function.name(), parenthesised(&inner)),
                };
                (text, Strength::Atom)
            }
            Node::Apply(function, a) => call(function.name(), &[*a]),
            Node::Atan2(y, x) => call("atan2", &[*y, *x]),
            Node::Min(a, b) => call("min", &[*a, *b]),
            Node::Max(a, b) => call("max", &[*a, *b]),
            Node::Select([a, b, then, otherwise]) => {
                let [a, b, then, otherwise] = [a, b, then, otherwise].map(|part| self.rendered(*part).0);
                let text = if self.latex() {
                    format!(
                        r"\begin{{cases}} {then} & \text{{if }} {a} < {b} \\ {otherwise} & \text{{else}} \end{{cases}}"
                    )
                } else {
                    format!("(if {a} < {b} then {then} else {otherwise})")
                };
                (text, Strength::Atom)
            }
            Node::Table(number, x) => call(&format!("table_{number}"), &[*x]),
        }
    }

    fn sum(&self, constant: &Rational, terms: &[(Expr, Rational)]) -> (String, Strength) {
        let mut text = if constant.is_zero() { String::new() } else { self.number(constant).0 };
        for (term, factor) in terms {
            let negative = *factor < Rational::ZERO;
            text += sign(text.is_empty(), negative);
            let size = if negative { -factor.clone() } else { factor.clone() };
            if !size.is_one() {
                text += &self.number(&size).0;
                text += if self.latex() { "" } else { "*" };
            }
            text += &self.bracketed(*term, Strength::Product);
        }
        let is_single = constant.is_zero() && terms.len() == 1;
        (text, if is_single { Strength::Product } else { Strength::Sum })
    }

    fn product(&self, factors: &[(Expr, i32)]) -> (String, Strength) {
        let times = if self.latex() { r"\," } else { "*" };
        let side = |positive: bool| {
            let own = factors.iter().filter(|(_, power)| (*power > 0) == positive);
            own.map(|(factor, power)| self.power(*factor, power.unsigned_abs())).collect::<Vec<_>>()
        };
        let (above, below) = (side(true), side(false));
        let numerator = if above.is_empty() { "1".to_owned() } else { above.join(times) };
        match (below.len(), self.latex()) {
            (0, _) => (numerator, Strength::Product),
            (1, true) => (format!(r"\frac{{{numerator}}}{{{}}}", bare(&below[0])), Strength::Product),
            (_, true) => (format!(r"\frac{{{numerator}}}{{{}}}", below.join(times)), Strength::Product),
            (1, false) => (format!("{numerator}/{}", below[0]), Strength::Product),
            (_, false) => (format!("{numerator}/({})", below.join(times)), Strength::Product),
        }
    }

    fn power(&self, factor: Expr, power: u32) -> String {
        match (power, self.latex()) {
            (1, _) => self.bracketed(factor, Strength::Power),
            (_, false) => format!("{}^{power}", self.bracketed(factor, Strength::Atom)),
            (_, true) => raised(&self.bracketed(factor, Strength::Atom), power),
        }
    }
}
