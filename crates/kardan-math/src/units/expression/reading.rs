//! Texts as expressions.

use std::ops::Range;

use super::super::catalogue::{find_unit, unit_help};
use super::super::quantity::check_length;
use super::super::reader::Reader;
use super::super::{Dimension, Exact, UnitError};
use super::tree::{FUNCTIONS, Kind, Node};
use super::truth;

/// Signs that compare.
const COMPARISONS: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];
/// The longest expression, in bytes; of coordinates, as composed by elements.
const TEXT_LIMIT: usize = 1024;
const LAW_LIMIT: usize = 16 * TEXT_LIMIT;
/// Parentheses inside each other.
const DEPTH_LIMIT: usize = 64;

fn syntax(span: Range<usize>, message: impl Into<String>, help: impl Into<String>) -> UnitError {
    UnitError::new("expression::syntax", span, message).help(help)
}

/// An unknown function; `tables` can be called besides the functions.
pub(super) fn unknown_function(name: &str, span: Range<usize>, tables: &[&str]) -> UnitError {
    let function_names =
        || FUNCTIONS.iter().map(|(function_names, ..)| *function_names).chain(["if"]).chain(tables.iter().copied());
    let help = match crate::names::nearest(name, function_names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", function_names().collect::<Vec<_>>().join(", ")),
    };
    UnitError::new("expression::function", span, format!("unknown function `{name}`")).help(help)
}

/// The parts of a text; `of_time`: `t` is the time, and tables may be called.
pub(super) fn read(text: &str, of_time: bool) -> Result<Node, UnitError> {
    check_length(text, if of_time { LAW_LIMIT } else { TEXT_LIMIT })?;
    let mut parser = Parser { reader: Reader { text, at: 0 }, depth: 0, of_time };
    let root = parser.whole()?;
    parser.reader.spaces();
    if parser.reader.peek().is_some() {
        let (here, found) = (parser.reader.here(), parser.reader.found());
        let help = match parser.reader.rest().chars().next() {
            Some(',') if text[..parser.reader.at].ends_with(|c: char| c.is_ascii_digit()) => {
                return Err(parser.reader.separator());
            }
            Some('=') => "two things are compared by `==`",
            Some('&' | '|' | '!') => "write `and`, `or` and `not`",
            Some('±') => {
                "only a number can have a tolerance: declare `x = \"3 N m ± 5 %\"` under `[parameters]`, and write `x` here"
            }
            Some('1') if parser.reader.rest().starts_with("1/") => {
                "a rate per second is a quotient: write `5 / 1 s`, or `5 Hz`"
            }
            _ if parser.at_unit() => "a unit must follow a number: write `sin(beta) * 1 N m`",
            _ => "write `*` between two factors",
        };
        return Err(syntax(here, format!("unexpected {found} in an expression"), help));
    }
    if root.is_deeper_than(MOST_IN_A_ROW) {
        let message = format!("more than {MOST_IN_A_ROW} sums and products follow from each other in one expression");
        let help =
            "give parts of it names of their own, under `[parameters]` or as `[signal.NAME]`, and write these here";
        return Err(syntax(0..text.len(), message, help));
    }
    Ok(root)
}

/// The most parts of an expression each of which is part of the next: the depth of recursion over them.
const MOST_IN_A_ROW: usize = 1000;

struct Parser<'t> {
    reader: Reader<'t>,
    depth: usize,
    /// Whether `t` is the time.
    of_time: bool,
}

impl Parser<'_> {
    fn binary(operator: char, left: Node, right: Node) -> Node {
        Node { span: left.span.start..right.span.end, kind: Kind::Binary(operator, Box::new([left, right])) }
    }

    /// One level deeper, up to the limit.
    fn deeper(&mut self, span: Range<usize>, message: impl Into<String>, help: &str) -> Result<(), UnitError> {
        self.depth += 1;
        if self.depth > DEPTH_LIMIT { Err(syntax(span, message, help)) } else { Ok(()) }
    }

    fn sum(&mut self) -> Result<Node, UnitError> {
        let message = format!("more than {DEPTH_LIMIT} nested parentheses");
        self.deeper(self.reader.here(), message, "give a part of it a name under `[parameters]`")?;
        let mut left = self.product()?;
        loop {
            self.reader.spaces();
            if !self.reader.at_sign() {
                break;
            }
            let operator = if self.reader.sign() { '-' } else { '+' };
            left = Self::binary(operator, left, self.product()?);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn product(&mut self) -> Result<Node, UnitError> {
        let mut left = self.signed(true)?;
        loop {
            let before = self.reader.at;
            self.reader.spaces();
            let operator = if self.reader.eat_times() {
                '*'
            } else if self.reader.eat('/') {
                self.tight_fraction(before)?;
                '/'
            } else if self.at_time() {
                if matches!(left.kind, Kind::Binary('/', _)) {
                    let help = "write `*`, or parentheses";
                    return Err(syntax(self.reader.here(), "it is not clear whether `/` also divides by `t`", help));
                }
                '*'
            } else {
                return Ok(left);
            };
            left = Self::binary(operator, left, self.signed(operator != '/')?);
        }
    }

    /// After a `/` with spaces around it, `a / 2/3` may mean either of two things; `a/2/3` goes from left to right.
    fn tight_fraction(&self, before: usize) -> Result<(), UnitError> {
        let mut ahead = Reader { ..self.reader };
        ahead.spaces();
        let start = ahead.at;
        let mut number = || Ok::<_, UnitError>(ahead.factor_of_number()?.is_some());
        let spaced = start > before + 1;
        if !(spaced && number()?) {
            return Ok(());
        }
        let first = &self.reader.text[start..ahead.at];
        if !(ahead.eat('/') && ahead.factor_of_number()?.is_some()) {
            return Ok(());
        }
        let fraction = &self.reader.text[start..ahead.at];
        let last = &fraction[first.len() + 1..];
        let message = format!("it is not clear whether the first `/` divides by `{first}` or by `{fraction}`");
        let help = format!("write `/({fraction})`, or `/({first} * {last})`");
        Err(syntax(start..ahead.at, message, help))
    }

    /// `fractions`: whether a number may be a fraction, which binds before `*` and `/`.
    fn signed(&mut self, fractions: bool) -> Result<Node, UnitError> {
        self.reader.spaces();
        let start = self.reader.at;
        if self.reader.at_sign() {
            self.deeper(start..start + 1, "too many signs", "write one sign")?;
            let negative = self.reader.sign();
            let inner = self.signed(fractions)?;
            self.depth -= 1;
            let span = start..inner.span.end;
            return Ok(if negative { Node { span, kind: Kind::Negative(Box::new(inner)) } } else { inner });
        }
        if let Some(number) = self.scalar(fractions)? {
            return Ok(number);
        }
        let base = self.atom()?;
        self.raised(base)
    }

    /// A part with its power, from the right: `a^b^c` is `a^(b^c)`.
    fn raised(&mut self, base: Node) -> Result<Node, UnitError> {
        let before = self.reader.at;
        self.reader.spaces();
        if !self.reader.eat_power() {
            self.reader.at = before;
            return Ok(base);
        }
        Ok(Self::binary('^', base, self.exponent()?))
    }

    /// The exponent after `^`: only one number, as the following text is not part of it: `2^3 kg`, `x^1/2`.
    fn exponent(&mut self) -> Result<Node, UnitError> {
        self.reader.spaces();
        let start = self.reader.at;
        self.deeper(self.reader.here(), "too many powers", "write parentheses")?;
        let power = if self.reader.at_sign() {
            let negative = self.reader.sign();
            let inner = self.exponent()?;
            let span = start..inner.span.end;
            if negative { Node { span, kind: Kind::Negative(Box::new(inner)) } } else { inner }
        } else if let Some(number) = self.factor()? {
            number
        } else {
            let base = self.atom()?;
            self.raised(base)?
        };
        self.depth -= 1;
        Ok(power)
    }

    fn atom(&mut self) -> Result<Node, UnitError> {
        let reader = &mut self.reader;
        let start = reader.at;
        if reader.eat('(') {
            let inner = self.whole()?;
            self.close(start)?;
            return Ok(Node { span: start..self.reader.at, ..inner });
        }
        let word = ["and", "or", "not"].into_iter().find(|word| self.at_word(word));
        if let Some(word) = word {
            let message = format!("expected a number, a name or `(`, found `{word}`");
            let help = format!(
                "`{word}` joins conditions: `a < b {} c > d`; quote a name: `'{word}'`",
                if word == "not" { "and not" } else { word }
            );
            return Err(syntax(start..start + word.len(), message, help));
        }
        let name = self.name()?;
        if name.is_empty() {
            let message = format!("expected a number, a name or `(`, found {}", self.reader.found());
            return Err(syntax(self.reader.here(), message, "write it like `m_rack * r_pinion^2` or `200 N * 7.5 mm`"));
        }
        let span = start..self.reader.at;
        if self.reader.eat('(') {
            return self.call(&name, span);
        }
        Ok(Node { span, kind: Kind::Name(name) })
    }

    /// A name: words with dots between them, or anything within `'...'`.
    fn name(&mut self) -> Result<String, UnitError> {
        let start = self.reader.at;
        if self.reader.eat('\'') {
            let name = self.reader.run(|c| c != '\'').to_string();
            if !self.reader.eat('\'') || name.is_empty() {
                let span = start..self.reader.at;
                return Err(syntax(span, "a name within `'` needs its second `'`", "write it like `'my-shaft.phi'`"));
            }
            return Ok(name);
        }
        let mut name = self.reader.run(|c| c.is_ascii_alphanumeric() || c == '_').to_string();
        let goes_on = |rest: &str| {
            let mut next = rest.chars();
            next.next() == Some('.') && next.next().is_some_and(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        while !name.is_empty() && goes_on(self.reader.rest()) {
            self.reader.eat('.');
            name.push('.');
            name += self.reader.run(|c| c.is_ascii_alphanumeric() || c == '_');
        }
        Ok(name)
    }

    /// Whether the time is next.
    fn at_time(&self) -> bool {
        let mut next = self.reader.rest().chars();
        let one = next.next() == Some('t');
        one && self.of_time && !next.next().is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '.')
    }

    /// A decimal or π, with its power.
    fn factor(&mut self) -> Result<Option<Node>, UnitError> {
        let start = self.reader.at;
        let Some(number) = self.reader.factor_of_number()? else { return Ok(None) };
        let kind = Kind::Literal(number, Dimension::NONE);
        self.raised(Node { span: start..self.reader.at, kind }).map(Some)
    }

    /// Numbers and π, each with its power, as a fraction without spaces around `/` and as products with π, and the units of it all.
    fn scalar(&mut self, fractions: bool) -> Result<Option<Node>, UnitError> {
        let Some(mut number) = self.factor()? else { return Ok(None) };
        loop {
            let start = self.reader.at;
            let by = if fractions && self.reader.eat('/') {
                Some('/')
            } else {
                self.reader.spaces();
                self.reader.at_pi().then_some('*')
            };
            match (by, if by.is_some() { self.factor()? } else { None }) {
                (Some(by), Some(next)) => number = Self::folded(by, number, next)?,
                _ => {
                    self.reader.at = start;
                    break;
                }
            }
        }
        let start = self.reader.at;
        let (size, dimension) = self.units()?;
        if self.reader.at > start {
            let kind = Kind::Literal(size, dimension);
            number = Self::folded('*', number, Node { span: start..self.reader.at, kind })?;
        }
        let before = self.reader.at;
        self.reader.spaces();
        if self.reader.eat_power() {
            let message = "it is not clear what this is a power of";
            return Err(syntax(before..self.reader.at, message, "write parentheses around what it is a power of"));
        }
        self.reader.at = before;
        Ok(Some(number))
    }

    /// A product or quotient of numbers: of literals a literal.
    fn folded(operator: char, left: Node, right: Node) -> Result<Node, UnitError> {
        let (Kind::Literal(a, _), Kind::Literal(b, dimension)) = (&left.kind, &right.kind) else {
            return Ok(Self::binary(operator, left, right));
        };
        let span = left.span.start..right.span.end;
        let value = if operator == '/' { a.div(b) } else { Some(a * b) };
        let value = value.ok_or_else(|| syntax(span.clone(), "division by zero", "divide by another number"))?;
        Ok(Node { span, kind: Kind::Literal(value, *dimension) })
    }

    /// Whether a unit is next, and no name or function.
    fn at_unit(&self) -> bool {
        if self.at_time() {
            return false;
        }
        let rest = self.reader.rest();
        let end = rest.find(|c: char| !(c.is_alphabetic() || c == '°' || c == '%')).unwrap_or(rest.len());
        let behind = &rest[end..];
        let goes_on = behind.starts_with(|c: char| c == '_' || c == '(' || c.is_ascii_digit())
            || behind.strip_prefix('.').is_some_and(|word| word.starts_with(char::is_alphabetic));
        !goes_on && find_unit(&rest[..end]).is_some()
    }

    /// Units after a number: with spaces between, and with `*` and `/` without spaces around.
    fn units(&mut self) -> Result<(Exact, Dimension), UnitError> {
        let start = self.reader.at;
        let mut product = (Exact::one(), Dimension::NONE);
        let (mut divided, mut first) = (false, true);
        loop {
            let before = self.reader.at;
            self.reader.spaces();
            let tight = self.reader.at == before;
            let (divides, times) = match () {
                () if tight && !first && self.reader.eat('/') => (true, false),
                () if tight && !first && self.reader.eat_times() => (false, true),
                () => (false, false),
            };
            let group = divides && self.reader.rest().starts_with('(');
            if !group && !self.at_unit() {
                if first
                    && !self.at_time()
                    && !["and", "or"].into_iter().any(|word| self.at_word(word))
                    && self.reader.peek().is_some_and(|c| c.is_alphabetic() || c == '°' || c == '%')
                {
                    let at = self.reader.at;
                    let name = self.reader.run(|c| c.is_alphanumeric() || "°%_".contains(c));
                    return Err(UnitError::new("unit::unknown", at..self.reader.at, format!("unknown unit `{name}`"))
                        .help(format!("{}; or write `*` before the name of a parameter", unit_help(name))));
                }
                self.reader.at = before;
                return Ok(product);
            }
            let at = self.reader.at;
            // A parenthesis without units is an operand.
            let read = if group { self.reader.factor().ok() } else { Some(self.unit(at)?) };
            let Some(factor) = read else {
                self.reader.at = before;
                return Ok(product);
            };
            if divided && !divides && !times {
                let last = &self.reader.text[at..self.reader.at];
                let message = format!("it is not clear whether `/` also divides by `{last}`");
                return Err(UnitError::new("unit::syntax", at..self.reader.at, message)
                    .help(format!("write `*{last}` without spaces, or parentheses")));
            }
            divided |= divides;
            product = self.reader.times(&product, &factor, if divides { -1 } else { 1 }, start)?;
            first = false;
        }
    }

    /// The unit that is next, with its power.
    fn unit(&mut self, at: usize) -> Result<(Exact, Dimension), UnitError> {
        let name = self.reader.run(|c| c.is_alphabetic() || c == '°' || c == '%');
        let Some(unit) = find_unit(name) else { return Ok((Exact::one(), Dimension::NONE)) };
        self.reader.raised(&unit, at)
    }

    fn close(&mut self, start: usize) -> Result<(), UnitError> {
        self.reader.spaces();
        if self.reader.eat(')') {
            return Ok(());
        }
        let span = start..self.reader.at;
        let found = self.reader.found();
        if self.reader.peek().is_some_and(|c| c.is_alphanumeric() || "_'(".contains(c)) {
            let message = format!("expected an operator or `)`, found {found}");
            return Err(syntax(self.reader.here(), message, "write `*` between two factors"));
        }
        Err(syntax(span, format!("a `(` without its `)`: found {found}"), "close it"))
    }

    fn call(&mut self, name: &str, span: Range<usize>) -> Result<Node, UnitError> {
        if name == "if" {
            return self.condition(span);
        }
        let function_entry = FUNCTIONS.iter().find(|(function_entry, ..)| *function_entry == name);
        if function_entry.is_none() && !self.of_time {
            return Err(unknown_function(name, span, &[]));
        }
        let mut arguments = vec![self.whole()?];
        loop {
            self.reader.spaces();
            if !self.reader.eat(',') {
                break;
            }
            arguments.push(self.whole()?);
        }
        self.close(span.start)?;
        let span = span.start..self.reader.at;
        let Some((_, function, count)) = function_entry else {
            return Ok(Node { span, kind: Kind::Lookup(name.to_string(), arguments) });
        };
        if !count.contains(&arguments.len()) {
            let expected = match (count.start, count.end) {
                (1, _) => "one value".to_string(),
                (least, usize::MAX) => format!("at least {least} values"),
                (exactly, _) => format!("{exactly} values"),
            };
            let message = format!("`{name}` takes {expected}, not {}", arguments.len());
            return Err(syntax(span, message, "separate values by commas"));
        }
        Ok(Node { span, kind: Kind::Call(*function, arguments) })
    }

    fn condition(&mut self, span: Range<usize>) -> Result<Node, UnitError> {
        const HELP: &str = "write it like `if(a < b, x, y)`";
        let condition = self.whole()?;
        let mut comma = || {
            self.reader.spaces();
            let found = self.reader.found();
            let here = self.reader.here();
            if self.reader.eat(',') {
                self.whole()
            } else {
                Err(syntax(here, format!("expected `,`, found {found}"), HELP))
            }
        };
        let (yes, no) = (comma()?, comma()?);
        self.close(span.start)?;
        Ok(truth::chosen(span.start..self.reader.at, condition, yes, no))
    }

    /// A sum, or a condition, which is 1 where it is true, else 0.
    fn whole(&mut self) -> Result<Node, UnitError> {
        let mut left = self.all_of()?;
        while self.eat_word("or") {
            left = truth::either(left, self.all_of()?);
        }
        Ok(left)
    }

    fn all_of(&mut self) -> Result<Node, UnitError> {
        let mut left = self.one_of_all()?;
        while self.eat_word("and") {
            left = truth::both(left, self.one_of_all()?);
        }
        Ok(left)
    }

    fn one_of_all(&mut self) -> Result<Node, UnitError> {
        self.reader.spaces();
        let start = self.reader.at;
        if self.eat_word("not") {
            self.deeper(start..self.reader.at, "too many `not`", "write one")?;
            let of = self.one_of_all()?;
            self.depth -= 1;
            return Ok(truth::not(start..of.span.end, of));
        }
        let left = self.sum()?;
        let Some(comparison) = self.comparison() else { return Ok(left) };
        let right = self.sum()?;
        let here = self.reader.here();
        if self.comparison().is_some() {
            let help = "compare two at a time: `a < b and b < c`";
            return Err(syntax(here, "a comparison of a comparison", help));
        }
        Ok(truth::compared(comparison, left, right))
    }

    fn comparison(&mut self) -> Option<&'static str> {
        self.reader.spaces();
        let found = COMPARISONS.into_iter().find(|sign| self.reader.rest().starts_with(sign))?;
        self.reader.at += found.len();
        Some(found)
    }

    /// Whether a word is next, and no longer name that begins with it.
    fn at_word(&self, word: &str) -> bool {
        let behind = self.reader.rest().trim_start().strip_prefix(word);
        behind.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_' || c == '.'))
    }

    fn eat_word(&mut self, word: &str) -> bool {
        let found = self.at_word(word);
        if found {
            self.reader.spaces();
            self.reader.at += word.len();
        }
        found
    }
}
