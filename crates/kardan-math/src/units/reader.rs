//! The syntax of numbers and units, read from left to right.

use std::ops::Range;

use dashu_int::{IBig, UBig};
use dashu_ratio::RBig;

use super::catalogue::{find_unit, unit_help};
use super::{Dimension, Exact, UnitError};
use kardan_tables::is_minus;

/// The largest exponent of ten.
const EXPONENT_LIMIT: i64 = 400;

/// The largest power of a unit.
const POWER_LIMIT: i32 = 9;

/// Reads a text from left to right.
pub(super) struct Reader<'t> {
    pub text: &'t str,
    pub at: usize,
}

impl<'t> Reader<'t> {
    pub fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    pub fn peek(&self) -> Option<char> {
        self.rest().chars().next()
    }

    /// The span of the next character; empty at the end.
    pub fn here(&self) -> Range<usize> {
        self.at..self.at + self.peek().map_or(0, char::len_utf8)
    }

    /// The next character for a message.
    pub fn found(&self) -> String {
        self.peek().map_or("the end of the text".to_string(), |c| format!("`{c}`"))
    }

    pub fn eat(&mut self, expected: char) -> bool {
        let is_next = self.rest().starts_with(expected);
        if is_next {
            self.at += expected.len_utf8();
        }
        is_next
    }

    /// `*` (unless it starts `**`) or a raised dot.
    pub fn eat_times(&mut self) -> bool {
        (!self.rest().starts_with("**") && self.eat('*')) || self.eat('·') || self.eat('⋅')
    }

    pub fn spaces(&mut self) {
        self.at = self.text.len() - self.rest().trim_start().len();
    }

    /// Takes the longest run of characters of a kind.
    pub fn run(&mut self, kind: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let run = &rest[..rest.find(|c| !kind(c)).unwrap_or(rest.len())];
        self.at += run.len();
        run
    }

    /// Takes a sign; whether it is a minus.
    pub fn sign(&mut self) -> bool {
        let negative = self.peek().is_some_and(is_minus);
        if self.at_sign() {
            self.at = self.here().end;
        }
        negative
    }

    /// Whether a sign is next.
    pub fn at_sign(&self) -> bool {
        self.peek().is_some_and(|c| c == '+' || is_minus(c))
    }

    /// `sign? (decimal | pi) ('*'? pi | '/' decimal | '/' pi)*`
    pub fn number(&mut self) -> Result<Exact, UnitError> {
        self.spaces();
        let negative = self.sign();
        self.spaces();
        let mut number = match self.factor_of_number()? {
            Some(number) => number,
            None => return Err(self.no_number()),
        };
        loop {
            let start = self.at;
            self.spaces();
            if self.eat('/') {
                self.spaces();
                if let Some(divisor) = self.factor_of_number()? {
                    number = number.div(&divisor).ok_or_else(|| {
                        UnitError::new("number::syntax", start..self.at, "division by zero")
                            .help("write a fraction with a denominator other than zero")
                    })?;
                    continue;
                }
            } else {
                if self.eat_times() {
                    self.spaces();
                }
                if self.eat_pi() {
                    number = &number * &Exact::new(RBig::ONE, 1);
                    continue;
                }
            }
            self.at = start;
            return Ok(if negative { -&number } else { number });
        }
    }

    pub fn no_number(&mut self) -> UnitError {
        let start = self.at;
        let word = self.run(char::is_alphanumeric);
        if ["inf", "infinity", "nan"].contains(&word.to_lowercase().as_str()) {
            return UnitError::new("number::not-finite", start..self.at, format!("`{word}` is not a finite number"))
                .help("write a decimal number");
        }
        let expression = !word.is_empty() && self.eat('(');
        self.at = start;
        let message = format!("expected a number, found {}", self.found());
        let help = match expression {
            true => "no expression is allowed here: write its value",
            false => "start with a number: \"0.05\", \"-1e-3\", \"51/50\" or \"pi/4\"",
        };
        UnitError::new("number::syntax", start..self.text.len().max(start), message).help(help)
    }

    pub fn factor_of_number(&mut self) -> Result<Option<Exact>, UnitError> {
        if self.eat_pi() {
            return Ok(Some(Exact::new(RBig::ONE, 1)));
        }
        Ok(self.decimal()?.map(|rational| Exact::new(rational, 0)))
    }

    /// `^` or `**`.
    pub fn eat_power(&mut self) -> bool {
        self.eat('^') || (self.rest().starts_with("**") && self.eat('*') && self.eat('*'))
    }

    /// Whether π is next.
    pub fn at_pi(&self) -> bool {
        Reader { ..*self }.eat_pi()
    }

    pub fn eat_pi(&mut self) -> bool {
        let Some(after) = self.rest().strip_prefix("pi").or_else(|| self.rest().strip_prefix('π')) else {
            return false;
        };
        let whole = !after.starts_with(|c: char| c.is_alphanumeric() || c == '_');
        if whole {
            self.at = self.text.len() - after.len();
        }
        whole
    }

    /// `digits ('.' digits)? ([eE] sign? digits)?`, or nothing if no digit is there.
    pub fn decimal(&mut self) -> Result<Option<RBig>, UnitError> {
        let start = self.at;
        let digit = |c: char| c.is_ascii_digit() || c == '_';
        let mut digits = if self.rest().starts_with('_') { "" } else { self.run(digit) }.to_string();
        let mut decimals = 0;
        if self.eat('.') {
            let fraction = if self.rest().starts_with('_') { "" } else { self.run(digit) };
            digits.push_str(fraction);
            decimals = fraction.chars().filter(|c| *c != '_').count() as i64;
        }
        digits.retain(|c| c != '_');
        if digits.is_empty() {
            self.at = start;
            return Ok(None);
        }
        let exponent = self.exponent()? - decimals;
        // Only digits are left, so this never fails.
        let integer = UBig::from_str_radix(&digits, 10).map_err(|error| {
            UnitError::new("number::syntax", start..self.at, format!("`{digits}` is not a number: {error}"))
        })?;
        let scale = UBig::from(10u8).pow(exponent.unsigned_abs() as usize);
        let (numerator, denominator) = if exponent < 0 { (integer, scale) } else { (integer * scale, UBig::ONE) };
        Ok(Some(RBig::from_parts(IBig::from(numerator), denominator)))
    }

    /// The exponent of ten after `e`, or zero if none is there.
    pub fn exponent(&mut self) -> Result<i64, UnitError> {
        let start = self.at;
        if !(self.eat('e') || self.eat('E')) {
            return Ok(0);
        }
        let negative = self.sign();
        let digits = self.run(|c| c.is_ascii_digit());
        if digits.is_empty() {
            self.at = start;
            return Ok(0);
        }
        match digits.parse::<i64>() {
            Ok(exponent) if exponent <= EXPONENT_LIMIT => Ok(if negative { -exponent } else { exponent }),
            _ => {
                let message = format!("the exponent `{}` is out of range", &self.text[start..self.at]);
                Err(UnitError::new("number::range", start..self.at, message)
                    .help(format!("exponents of ten go from -{EXPONENT_LIMIT} to {EXPONENT_LIMIT}")))
            }
        }
    }

    /// The unit after a number, to the end of the text; an empty text is the unit 1.
    pub fn unit(&mut self) -> Result<(Exact, Dimension), UnitError> {
        self.spaces();
        if self.rest().is_empty() {
            return Ok((Exact::one(), Dimension::NONE));
        }
        if self.eat_times() {
            self.spaces();
        }
        let unit = self.product()?;
        match self.peek() {
            None => Ok(unit),
            Some(_) => Err(UnitError::new("unit::syntax", self.here(), "a `)` without its `(`").help("remove it")),
        }
    }

    /// `'/'? factor (('*' | '/' | space) factor)*` up to the end or a closing parenthesis.
    pub fn product(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.at;
        let mut product = (Exact::one(), Dimension::NONE);
        let mut divided = false;
        for first in std::iter::once(true).chain(std::iter::repeat(false)) {
            self.spaces();
            if !first && matches!(self.peek(), None | Some(')')) {
                break;
            }
            let divides = self.eat('/');
            let times = !first && !divides && self.eat_times();
            self.spaces();
            let factor_start = self.at;
            let factor = self.factor()?;
            if divided && !divides && !times {
                let (before, last) = (self.text[start..factor_start].trim(), &self.text[factor_start..self.at]);
                let bottom = before.rsplit('/').next().unwrap_or(before).trim();
                let top = before[..before.len() - bottom.len()].trim_end().trim_end_matches('/').trim_end();
                return Err(UnitError::new(
                    "unit::syntax",
                    factor_start..self.at,
                    format!("it is not clear whether `/` also divides by `{last}`"),
                )
                .help(format!("write `{before} * {last}` or `{top}/({bottom} {last})`")));
            }
            divided |= divides;
            product = self.times(&product, &factor, if divides { -1 } else { 1 }, start)?;
        }
        Ok(product)
    }

    /// A unit, `1` or a product in parentheses, with a power.
    pub fn factor(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.at;
        let unit = if self.eat('(') {
            let inner = self.product()?;
            if !self.eat(')') {
                return Err(UnitError::new("unit::syntax", start..self.at, "a `(` without its `)`").help("close it"));
            }
            inner
        } else if self.rest().starts_with(|c: char| c.is_ascii_digit()) {
            let digits = self.run(|c| c.is_ascii_digit() || c == '.');
            if digits != "1" {
                return Err(UnitError::new(
                    "unit::syntax",
                    start..self.at,
                    format!("unexpected number `{digits}` in a unit"),
                )
                .help("write one number (products worked out, digits without spaces), then its unit, powers with `^`: \"1000 kg m^2\""));
            }
            (Exact::one(), Dimension::NONE)
        } else {
            let name = self.run(|c| c.is_alphabetic() || c == '°' || c == '%' || c == '_');
            if self.rest().starts_with([',', '.']) {
                return Err(self.separator());
            }
            if name.is_empty() {
                let message = format!("expected a unit, found {}", self.found());
                return Err(UnitError::new("unit::syntax", self.here(), message)
                    .help("write units like `N m s/rad`, `kg m^2` or `rad/s`"));
            }
            find_unit(name).ok_or_else(|| {
                UnitError::new("unit::unknown", start..self.at, format!("unknown unit `{name}`")).help(unit_help(name))
            })?
        };
        self.raised(&unit, start)
    }

    /// A unit that began at a place, with its power.
    pub fn raised(&mut self, unit: &(Exact, Dimension), start: usize) -> Result<(Exact, Dimension), UnitError> {
        let power = self.power(start)?;
        self.times(&(Exact::one(), Dimension::NONE), unit, power, start)
    }

    /// A product of units that began at a place, times a power of another unit.
    pub fn times(
        &self,
        product: &(Exact, Dimension),
        unit: &(Exact, Dimension),
        power: i32,
        start: usize,
    ) -> Result<(Exact, Dimension), UnitError> {
        let size = if power == 1 { Some(unit.0.clone()) } else { unit.0.pow(power) };
        size.map(|size| &product.0 * &size).zip(product.1.times(&unit.1, power)).ok_or_else(|| {
            UnitError::new("unit::syntax", start..self.at, "the powers of the unit are too high")
                .help("check the exponents")
        })
    }

    /// `^2`, `**-1`, `²`, `⁻¹`, or nothing.
    pub fn power(&mut self, start: usize) -> Result<i32, UnitError> {
        const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
        let name = &self.text[start..self.at];
        let end = self.at;
        // `kg ^ 2` is no power of a quantity.
        self.spaces();
        if !(self.rest().starts_with('^') || self.rest().starts_with("**")) {
            self.at = end;
        }
        let power_start = self.at;
        let raised = self.run(|c| RAISED.contains(&c) || c == '⁻' || c == '⁺');
        let digits: String = if !raised.is_empty() {
            let plain = |c| match RAISED.iter().position(|r| *r == c) {
                Some(digit) => char::from(b'0' + digit as u8),
                None if c == '⁻' => '-',
                None => '+',
            };
            raised.chars().map(plain).collect()
        } else if self.eat_power() {
            self.spaces();
            self.run(|c| c.is_ascii_digit() || c == '+' || is_minus(c)).replace(is_minus, "-")
        } else {
            let digits = self.run(|c| c.is_ascii_digit());
            if !digits.is_empty() && name != "1" {
                return Err(UnitError::new("unit::syntax", start..self.at, format!("unexpected `{digits}` in a unit"))
                    .help(format!("write a power as `{name}^{digits}`")));
            }
            return Ok(1);
        };
        match digits.parse::<i32>() {
            Ok(power) if power.abs() <= POWER_LIMIT => Ok(power),
            _ => Err(UnitError::new(
                "unit::syntax",
                power_start..self.at.max(self.here().end),
                format!("expected a power between -{POWER_LIMIT} and {POWER_LIMIT}"),
            )
            .help("write powers like `m^2`, `m**2`, `m²` or `s^-1`")),
        }
    }

    /// A comma or a second point in a number.
    pub fn separator(&self) -> UnitError {
        let message = format!("unexpected {} in a number", self.found());
        UnitError::new("number::syntax", self.here(), message).help(self.with_point())
    }

    /// The intended spelling of the number that continues here: the last of its separators is its point if it comes once, and the digits behind
    /// may be thousands or not.
    fn with_point(&self) -> String {
        let is_part = |c: char| c.is_ascii_digit() || matches!(c, '.' | ',');
        let start = self.text[..self.at].rfind(|c| !is_part(c)).map_or(0, |at| at + 1);
        let start = (start..=self.at).find(|at| self.text.is_char_boundary(*at)).unwrap_or(self.at);
        let end = self.rest().find(|c| !is_part(c)).map_or(self.text.len(), |end| self.at + end);
        let number = &self.text[start..end];
        let general = "write one decimal point and no separators: \"1234.5\"";
        let Some(last) = number.rfind(['.', ',']) else { return general.into() };
        let digits = |text: &str| text.replace(['.', ','], "");
        let (whole, fraction) = (digits(&number[..last]), &number[last + 1..]);
        if fraction.is_empty() || whole.is_empty() {
            return general.into();
        }
        let with_unit =
            |number: String| format!("\"{}{number}{}\"", self.text[..start].trim_start(), self.text[end..].trim_end());
        let (decimal, all) = (with_unit(format!("{whole}.{fraction}")), with_unit(digits(number)));
        let separator = &number[last..=last];
        let once = number.matches(separator).count() == 1;
        let is_decimal = once && (number[..last].contains(['.', ',']) || fraction.len() != 3 || whole.starts_with('0'));
        match (is_decimal, once) {
            (true, _) => format!("write {decimal}, with a decimal point"),
            (false, true) => format!("write {decimal} if it is a decimal comma, {all} if it separates thousands"),
            (false, false) if fraction.len() == 3 => format!("write {all}, without separators"),
            (false, false) => general.into(),
        }
    }
}
