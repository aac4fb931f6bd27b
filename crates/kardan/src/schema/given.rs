//! What a program gives for the keys of a table.

use crate::entries::{Entries, Entry, Written};
use crate::schema::keys::Keys;
use crate::units::{Dimension, Exact};

/// A quantity or a number: a text with a unit (`"1.3 N m"`, with a tolerance where one may stand), the name of a parameter, a number
/// without a unit, or an exact value in SI units.
///
/// ```
/// use kardan::schema::Quantity;
/// use kardan::units::{Dimension, Exact};
/// let torques: [Quantity; 2] = ["1/3 N m".into(), Quantity::exact(Exact::from_ratio(1, 3), Dimension::TORQUE)];
/// let (ratio, inertia): (Quantity, Quantity) = (0.5.into(), "J_wg".into());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity(Written);

impl Quantity {
    /// An exact value in SI units.
    pub fn exact(value: Exact, dimension: Dimension) -> Self {
        Self(Written::Quantity(value, dimension))
    }
}

impl Default for Quantity {
    fn default() -> Self {
        "".into()
    }
}

impl From<&str> for Quantity {
    fn from(text: &str) -> Self {
        Self(Written::Text(text.into()))
    }
}

impl From<String> for Quantity {
    fn from(text: String) -> Self {
        Self(Written::Text(text))
    }
}

impl From<f64> for Quantity {
    /// The shortest decimal number that is nearest to this one: 0.1 is one tenth.
    fn from(number: f64) -> Self {
        Self(Written::Number(zmij::Buffer::new().format(number).into()))
    }
}

impl From<i32> for Quantity {
    fn from(number: i32) -> Self {
        Self(Written::Number(number.to_string()))
    }
}

/// A list of names: `["wg_motor", "rk_motor"]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Words(pub Vec<String>);

impl<S: Into<String>, const N: usize> From<[S; N]> for Words {
    fn from(words: [S; N]) -> Self {
        Self(words.into_iter().map(Into::into).collect())
    }
}

impl<S: Into<String>> From<Vec<S>> for Words {
    fn from(words: Vec<S>) -> Self {
        Self(words.into_iter().map(Into::into).collect())
    }
}

/// Quantities by name: `[("beta", "0 deg")]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Named(pub Vec<(String, Quantity)>);

impl<S: Into<String>, Q: Into<Quantity>, const N: usize> From<[(S, Q); N]> for Named {
    fn from(entries: [(S, Q); N]) -> Self {
        Self(entries.into_iter().map(|(name, value)| (name.into(), value.into())).collect())
    }
}

impl<S: Into<String>, Q: Into<Quantity>> From<Vec<(S, Q)>> for Named {
    fn from(entries: Vec<(S, Q)>) -> Self {
        Self(entries.into_iter().map(|(name, value)| (name.into(), value.into())).collect())
    }
}

/// Lists of quantities by name: `[("wg", ["20 rad/s", "60 rad/s"])]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lists(pub Vec<(String, Vec<Quantity>)>);

impl<S: Into<String>, Q: Into<Quantity>, const N: usize, const M: usize> From<[(S, [Q; M]); N]> for Lists {
    fn from(entries: [(S, [Q; M]); N]) -> Self {
        let list = |list: [Q; M]| list.into_iter().map(Into::into).collect();
        Self(entries.into_iter().map(|(name, values)| (name.into(), list(values))).collect())
    }
}

/// A list of quantities, numbers or poles: `["-14 ± 14.3j", "-50"]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Quantities(pub Vec<Quantity>);

impl<Q: Into<Quantity>, const N: usize> From<[Q; N]> for Quantities {
    fn from(list: [Q; N]) -> Self {
        Self(list.into_iter().map(Into::into).collect())
    }
}

impl<Q: Into<Quantity>> From<Vec<Q>> for Quantities {
    fn from(list: Vec<Q>) -> Self {
        Self(list.into_iter().map(Into::into).collect())
    }
}

/// What can stand behind a key: written as an entry, and read from one.
pub trait Given: Sized {
    /// As an entry.
    fn written(&self) -> Written;
    /// From an entry; nothing if it is of another kind.
    fn read(written: &Written) -> Option<Self>;
}

impl Given for String {
    fn written(&self) -> Written {
        Written::Text(self.clone())
    }

    fn read(written: &Written) -> Option<Self> {
        if let Written::Text(text) = written { Some(text.clone()) } else { None }
    }
}

impl Given for Quantity {
    fn written(&self) -> Written {
        self.0.clone()
    }

    fn read(written: &Written) -> Option<Self> {
        matches!(written, Written::Text(_) | Written::Number(_) | Written::Quantity(..)).then(|| Self(written.clone()))
    }
}

fn list<T: Given>(values: &[T]) -> Written {
    Written::List(values.iter().map(|value| Entry::from(value.written())).collect())
}

fn read_list<T: Given>(written: &Written) -> Option<Vec<T>> {
    let Written::List(list) = written else { return None };
    list.iter().map(|entry| T::read(&entry.value)).collect()
}

fn map<'a>(values: impl Iterator<Item = (&'a String, Written)>) -> Written {
    let mut out = Entries::default();
    values.for_each(|(name, value)| out.set(name, value));
    Written::Table(out)
}

fn read_map<T>(written: &Written, read: impl Fn(&Written) -> Option<T>) -> Option<Vec<(String, T)>> {
    let Written::Table(table) = written else { return None };
    table.iter().map(|entry| Some((entry.key.clone(), read(&entry.entry.value)?))).collect()
}

impl Given for Words {
    fn written(&self) -> Written {
        list(&self.0)
    }

    fn read(written: &Written) -> Option<Self> {
        read_list(written).map(Self)
    }
}

impl Given for Quantities {
    fn written(&self) -> Written {
        list(&self.0)
    }

    fn read(written: &Written) -> Option<Self> {
        read_list(written).map(Self)
    }
}

impl Given for Named {
    fn written(&self) -> Written {
        map(self.0.iter().map(|(name, value)| (name, value.written())))
    }

    fn read(written: &Written) -> Option<Self> {
        read_map(written, Quantity::read).map(Self)
    }
}

impl Given for Lists {
    fn written(&self) -> Written {
        map(self.0.iter().map(|(name, values)| (name, list(values))))
    }

    fn read(written: &Written) -> Option<Self> {
        let one = |written: &Written| read_list(written).or_else(|| Some(vec![Quantity::read(written)?]));
        read_map(written, one).map(Self)
    }
}

impl<T: Keys> Given for T {
    fn written(&self) -> Written {
        Written::Table(self.entries())
    }

    fn read(written: &Written) -> Option<Self> {
        if let Written::Table(table) = written { T::read_entries(table) } else { None }
    }
}

impl<T: Keys> Given for Vec<T> {
    fn written(&self) -> Written {
        list(self)
    }

    fn read(written: &Written) -> Option<Self> {
        read_list(written).or_else(|| Some(vec![T::read(written)?]))
    }
}
