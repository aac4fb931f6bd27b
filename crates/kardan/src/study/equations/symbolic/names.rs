//! Notation of letters.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::study::equations::latex_lines::{index, motion, word};
use kardan_expr::expr::{Style, parenthesised};
use kardan_math::names::unused;
use kardan_math::units::Dimension;
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::{Domain, InputKind};
use kardan_mechanics::symbolic::{Laurent, Letter, Letters, Symbol, collected, printed};
use kardan_model::SymbolValue;
use kardan_results::SymbolicText;
use kardan_results::signal_name::Quantity;

/// Letters of keys, as in the literature source; other keys have their own name.
const KEYS: [(&str, &str); 19] = [
    ("inertia", "J"),
    ("mass", "m"),
    ("damping", "d"),
    ("stiffness", "s"),
    ("friction", "c"),
    ("ratio", "i"),
    ("radius", "r"),
    ("lead", "p"),
    ("travel", "p"),
    ("inductance", "L"),
    ("resistance", "R"),
    ("capacitance", "C"),
    ("angle", "beta"),
    ("angle_1", "beta1"),
    ("angle_2", "beta2"),
    ("breakaway", "cb"),
    ("stribeck_speed", "vs"),
    ("sun_teeth", "zs"),
    ("ring_teeth", "zr"),
];

const GREEK: [&str; 20] = [
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu", "nu", "xi", "rho",
    "sigma", "tau", "phi", "chi", "psi", "omega",
];

/// The names of the letters of one model.
pub(super) struct Names<'a> {
    pub(super) letters: &'a Letters,
    pub(super) equations: &'a Equations,
    pub(super) values: &'a BTreeMap<String, SymbolValue>,
    /// Of letters that stand for values and formulas.
    own: HashMap<Letter, SymbolicText>,
    /// Of functions of time, by element.
    functions: HashMap<String, SymbolicText>,
    /// Names of coordinates that are one word.
    pub(super) coordinates: Vec<String>,
}

impl<'a> Names<'a> {
    /// Unique names for the letters that are used.
    pub(super) fn new(
        letters: &'a Letters,
        used: &[Letter],
        equations: &'a Equations,
        values: &'a BTreeMap<String, SymbolValue>,
    ) -> Self {
        let mut used_names: HashSet<String> = ["pi", "t"].map(String::from).into();
        let coordinates = equations.coordinates.iter().map(|name| unique_name(&word(name), &mut used_names)).collect();
        let (mut own, mut functions) = (HashMap::new(), HashMap::new());
        for letter in used {
            if let Symbol::OfTime(element, _) = letters.symbol(*letter)
                && !functions.contains_key(element)
            {
                let text = unique_name(&format!("b_{}", word(element)), &mut used_names);
                functions.insert(element.clone(), SymbolicText { text, latex: format!("_{{{}}}", index(element)) });
            }
            let (base, element) = match letters.symbol(*letter) {
                Symbol::Value(name) => match name.split_once('.') {
                    Some((element, key)) => {
                        let base = KEYS.iter().find(|(candidate, _)| *candidate == key).map_or(key, |(_, base)| base);
                        (base, Some(element))
                    }
                    None => (name.as_str(), None),
                },
                Symbol::Of(base, element) => (*base, Some(element.as_str())),
                Symbol::Sliding(element, _) => ("T", Some(element.as_str())),
                _ => continue,
            };
            let preferred = element.map_or_else(|| word(base), |element| word(&format!("{base}_{element}")));
            let text = unique_name(&preferred, &mut used_names);
            let again = text.strip_prefix(&preferred).unwrap_or_default();
            let latex = match element {
                Some(element) => with_index(base, &format!("{element}{again}")),
                // A letter before the first `_` has the rest as its index; a word is one name.
                None => match base.split_once('_') {
                    Some((letter, index)) if letter.len() == 1 || GREEK.contains(&letter) => {
                        with_index(letter, &format!("{index}{again}"))
                    }
                    _ => with_index(base, again),
                },
            };
            own.insert(*letter, SymbolicText { text, latex });
        }
        Self { letters, equations, values, own, functions, coordinates }
    }

    /// A sum of products.
    pub(super) fn formula(&self, value: &Laurent) -> SymbolicText {
        both(|form| self.rendered(value, form))
    }

    /// A sum of unchanged members, those with a minus last.
    pub(super) fn sum(&self, members: &[Laurent]) -> SymbolicText {
        both(|form| {
            let mut members: Vec<String> = members.iter().map(|member| self.rendered(member, form)).collect();
            members.sort_by_key(|member| member.starts_with('-'));
            let sign = |member: &String| match member.strip_prefix('-') {
                Some(rest) => format!(" - {rest}"),
                None => format!(" + {member}"),
            };
            let mut members = members.iter();
            let first = members.next().cloned().unwrap_or_else(|| "0".into());
            members.fold(first, |sum, member| sum + &sign(member))
        })
    }

    fn rendered(&self, value: &Laurent, form: Style) -> String {
        let ratio = |name: &str| self.values.get(name).is_some_and(|value| value.dimension == Dimension::NONE);
        printed(&collected(value, self.letters, &ratio), form, &|letter| self.one(letter, form))
    }

    /// A letter.
    pub(super) fn letter(&self, letter: Letter) -> SymbolicText {
        both(|form| self.one(letter, form))
    }

    fn one(&self, letter: Letter, form: Style) -> String {
        let latex = form == Style::Latex;
        if let Some(own) = self.own.get(&letter) {
            return if latex { own.latex.clone() } else { own.text.clone() };
        }
        match self.letters.symbol(letter) {
            Symbol::Pi => if latex { r"\pi" } else { "pi" }.to_string(),
            Symbol::Call(function, parts) => self.call(function, parts, form),
            Symbol::Sum(sum) => enclosed(&self.rendered(sum, form), latex),
            Symbol::Curve(element, order, x) => {
                let name = self.curve(element);
                let name = if latex { name.latex } else { name.text };
                format!("{name}{}{}", "'".repeat(*order), enclosed(&self.rendered(x, form), latex))
            }
            Symbol::Position(k) => self.motion(*k, 0, form),
            Symbol::Speed(k) => self.motion(*k, 1, form),
            Symbol::Acceleration(k) => self.motion(*k, 2, form),
            Symbol::Sign(speed) => {
                let name = if latex { r"\operatorname{sgn}" } else { "sgn" };
                format!("{name}{}", enclosed(&self.rendered(speed, form), latex))
            }
            Symbol::Input(k) => self.input(*k, latex),
            Symbol::Time => "t".into(),
            Symbol::OfTime(element, order) => self.of_time(element, *order, form),
            Symbol::Multiplier(k) => self.multiplier(*k, form),
            Symbol::Unilateral(element, is_loss) => self.unilateral(element, *is_loss, form),
            Symbol::Value(name) | Symbol::Of(_, name) | Symbol::Sliding(name, _) => name.clone(),
        }
    }

    /// The function for the curve of an element.
    pub(super) fn curve(&self, element: &str) -> SymbolicText {
        SymbolicText { text: format!("gamma_{}", word(element)), latex: with_index("gamma", element) }
    }

    /// A coordinate, its rate or its acceleration.
    pub(super) fn motion(&self, k: usize, order: usize, style: Style) -> String {
        match style {
            Style::Text => format!("{}{}", self.coordinates[k], "'".repeat(order)),
            Style::Latex => motion(self.equations.domain(k), order, &self.equations.coordinates[k]),
        }
    }

    /// The prescribed motion of an element, or a rate of it.
    pub(super) fn of_time(&self, element: &str, order: usize, form: Style) -> String {
        let Some(name) = self.functions.get(element) else { return String::new() };
        match form {
            Style::Text => format!("{}{}", name.text, "'".repeat(order)),
            Style::Latex => format!("{}{}", ["b", r"\dot b", r"\ddot b"][order.min(2)], name.latex),
        }
    }

    /// The multiplier of a constraint.
    pub(super) fn multiplier(&self, k: usize, form: Style) -> String {
        let constraint = &self.equations.multiplier_constraints[k];
        match (self.equations.domain_of_multiplier(constraint), form) {
            (Some(domain), _) => effort(domain, &constraint.element, form),
            (None, Style::Latex) => format!(r"\lambda_{{{}}}", index(&constraint.element)),
            (None, Style::Text) => Quantity::Multiplier.of(&word(&constraint.element)),
        }
    }

    /// The torque of a unilateral or switched constraint, or the gear loss of an element.
    pub(super) fn unilateral(&self, element: &str, is_loss: bool, form: Style) -> String {
        match (is_loss, form) {
            (true, Style::Text) => Quantity::Friction.of(&word(element)),
            (true, Style::Latex) => format!(r"\tau_{{{},\mathrm{{loss}}}}", index(element)),
            (false, _) => {
                let own = self.equations.unilaterals.iter().find(|unilateral| unilateral.element == element);
                effort(
                    own.map(|unilateral| self.equations.domain_of_unilateral(unilateral)).unwrap_or_default(),
                    element,
                    form,
                )
            }
        }
    }

    fn input(&self, k: usize, latex: bool) -> String {
        let input = &self.equations.inputs[k];
        let effort = self.equations.domain_of(input).effort();
        let letter = match (&input.value, effort) {
            (InputKind::Disturbance, _) => None,
            (_, Quantity::Force) => Some("f"),
            (_, Quantity::Voltage) => Some("u"),
            _ => Some("tau"),
        };
        match (letter, latex) {
            (None, false) => word(&input.element),
            (None, true) => index(&input.element),
            (Some(_), false) => effort.of(&word(&input.element)),
            (Some(letter), true) => with_index(letter, &input.element),
        }
    }

    fn call(&self, function: &str, parts: &[Laurent], form: Style) -> String {
        let latex = form == Style::Latex;
        let parts: Vec<String> = parts.iter().map(|part| self.rendered(part, form)).collect();
        match (function, parts.as_slice(), latex) {
            ("^", [base, power], false) => format!("(({base})^({power}))"),
            ("^", [base, power], true) => format!("{}^{{{power}}}", parenthesised(base)),
            (_, [a, b, yes, no], false) => format!("if({a} {function} {b}, {yes}, {no})"),
            (_, [a, b, yes, no], true) => {
                let sign = match function {
                    "<=" => r"\le",
                    ">=" => r"\ge",
                    "==" => "=",
                    "!=" => r"\ne",
                    other => other,
                };
                format!(r"\begin{{cases}} {yes} & \text{{if }} {a} {sign} {b} \\ {no} & \text{{else}} \end{{cases}}")
            }
            (_, _, false) => format!("{function}({})", parts.join(", ")),
            ("sqrt", [x], true) => format!(r"\sqrt{{{x}}}"),
            ("abs", [x], true) => format!(r"\left|{x}\right|"),
            ("asin" | "acos" | "atan", _, true) => {
                format!(r"\arc{}{}", &function[1..], parenthesised(&parts.join(", ")))
            }
            ("sin" | "cos" | "tan" | "exp" | "ln" | "min" | "max", _, true) => {
                format!(r"\{function}{}", parenthesised(&parts.join(", ")))
            }
            (_, _, true) => format!(r"\operatorname{{{function}}}{}", parenthesised(&parts.join(", "))),
        }
    }
}

/// The same in both forms.
pub(super) fn both(of: impl Fn(Style) -> String) -> SymbolicText {
    SymbolicText { text: of(Style::Text), latex: of(Style::Latex) }
}

/// A torque, force or voltage of an element.
fn effort(domain: Domain, element: &str, form: Style) -> String {
    let letter = match domain {
        Domain::Rotation => "tau",
        Domain::Translation => "f",
        Domain::Charge => "u",
        Domain::Number => "r",
    };
    if form == Style::Latex { with_index(letter, element) } else { domain.effort().of(&word(element)) }
}

fn enclosed(text: &str, latex: bool) -> String {
    if latex { parenthesised(text) } else { format!("({text})") }
}

/// An unused name.
fn unique_name(preferred: &str, used_names: &mut HashSet<String>) -> String {
    let name = unused(preferred, 2, |name| used_names.contains(name));
    used_names.insert(name.clone());
    name
}

/// A letter with an index; digits at its end belong to the index.
pub(super) fn with_index(base: &str, name: &str) -> String {
    let letters = base.trim_end_matches(|c: char| c.is_ascii_digit());
    let (letters, digits) = if letters.is_empty() { (base, "") } else { (letters, &base[letters.len()..]) };
    let letters = if digits.is_empty() { letters } else { letters.trim_end_matches('_') };
    let letter = match letters {
        greek if GREEK.contains(&greek) => format!(r"\{greek}"),
        one if one.len() == 1 => one.to_string(),
        other => format!(r"\mathit{{{}}}", other.replace('_', r"\_").replace('-', r"\text{-}")),
    };
    match (digits, name) {
        ("", "") => letter,
        (digits, "") => format!("{letter}_{{{digits}}}"),
        ("", name) => format!("{letter}_{{{}}}", index(name)),
        (digits, name) => format!(r"{letter}_{{{digits}\,{}}}", index(name)),
    }
}
