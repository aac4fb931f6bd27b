//! Products as text and LaTeX.

use super::{Base, Collected, Letter};
use kardan_expr::expr::{Style, bare, parenthesised, raised};
use kardan_math::names::signed_sum;
use kardan_math::num::{Rational, rational_to_f64};

/// A product in words of its letters' names; as text it is an expression of a model file, `i*(i + 1)*J/R^2`.
pub fn printed(value: &Collected, style: Style, name: &dyn Fn(Letter) -> String) -> String {
    Printer { style, name }.product(value)
}

struct Printer<'a> {
    style: Style,
    name: &'a dyn Fn(Letter) -> String,
}

impl Printer<'_> {
    fn latex(&self) -> bool {
        self.style == Style::Latex
    }

    fn product(&self, value: &Collected) -> String {
        let negative = value.number < Rational::ZERO;
        let sign = if negative { "-" } else { "" };
        format!("{sign}{}", self.size(value))
    }

    /// A product without its sign.
    fn size(&self, value: &Collected) -> String {
        let number = if value.number < Rational::ZERO { -value.number.clone() } else { value.number.clone() };
        let (above, below) = numbers(&number);
        if value.factors.is_empty() {
            return self.fraction(above, below);
        }
        let side = |positive: bool| {
            let own = value.factors.iter().filter(move |(_, power)| (*power > 0) == positive);
            own.map(|(base, power)| self.power(base, power.unsigned_abs())).collect::<Vec<_>>()
        };
        let (mut top, mut bottom) = (side(true), side(false));
        // A sum alone needs no parentheses.
        let single = match value.factors.as_slice() {
            [(Base::Sum(members), 1)] if number.is_one() && value.number.is_one() => Some(members),
            _ => None,
        };
        if let Some(members) = single {
            return self.sum(members);
        }
        // Neither does one above the bar of a fraction.
        let over: Vec<&(Base, i32)> = value.factors.iter().filter(|(_, power)| *power > 0).collect();
        if let ([(Base::Sum(members), 1)], "1", true, true) =
            (over.as_slice(), above.as_str(), self.latex(), below != "1" || !bottom.is_empty())
        {
            top = vec![self.sum(members)];
        }
        if above != "1" || top.is_empty() {
            top.insert(0, above);
        }
        if below != "1" {
            bottom.insert(0, below);
        }
        self.quotient(&top, &bottom)
    }

    fn fraction(&self, above: String, below: String) -> String {
        match (below.as_str(), self.latex()) {
            ("1", _) => above,
            (_, true) => format!(r"\frac{{{above}}}{{{below}}}"),
            (_, false) => format!("{above}/{below}"),
        }
    }

    fn quotient(&self, top: &[String], bottom: &[String]) -> String {
        let times = if self.latex() { r" \, " } else { "*" };
        let above = top.join(times);
        match (bottom, self.latex()) {
            ([], _) => above,
            ([one], true) => format!(r"\frac{{{}}}{{{}}}", bare(&above), bare(one)),
            (_, true) => format!(r"\frac{{{}}}{{{}}}", bare(&above), bottom.join(times)),
            ([one], false) => format!("{above}/{one}"),
            (_, false) => format!("{above}/({})", bottom.join(times)),
        }
    }

    fn power(&self, base: &Base, power: u32) -> String {
        let text = match base {
            Base::Letter(letter) => (self.name)(*letter),
            Base::Sum(members) if self.latex() => parenthesised(&self.sum(members)),
            Base::Sum(members) => format!("({})", self.sum(members)),
        };
        match (power, self.latex()) {
            (1, _) => text,
            (_, true) => raised(&text, power),
            (_, false) => format!("{text}^{power}"),
        }
    }

    fn sum(&self, members: &[Collected]) -> String {
        signed_sum(members.iter().map(|member| (member.number < Rational::ZERO, self.size(member))))
    }
}

/// Numerator and denominator of a number above zero; a decimal where that is the shorter way.
fn numbers(value: &Rational) -> (String, String) {
    let (numerator, denominator) = (value.numerator().to_string(), value.denominator().to_string());
    let decimal = rational_to_f64(value);
    let exact = Rational::try_from(decimal).is_ok_and(|same| same == *value) || shown(decimal) == *value;
    if denominator.len() > 1 && exact && (1e-4..1e15).contains(&decimal) && decimal.to_string().len() < 12 {
        return (decimal.to_string(), "1".to_string());
    }
    (numerator, denominator)
}

/// The number that a decimal text is.
fn shown(value: f64) -> Rational {
    let text = value.to_string();
    let (whole, part) = text.split_once('.').unwrap_or((&text, ""));
    let digits: Option<Rational> = format!("{whole}{part}").parse().ok();
    digits.unwrap_or(Rational::ZERO) / Rational::from(10).pow(part.len() as isize)
}
