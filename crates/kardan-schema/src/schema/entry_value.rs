//! Values of keys in a program.

use crate::entries::{Entries, Entry, RawValue};
use crate::schema::keys::Keys;
use kardan_math::units::{Dimension, Exact};

/// A quantity or a number: a text with a unit (`"1.3 N m"`, with a tolerance where allowed), the name of a parameter, a number
/// without a unit, or an exact value in SI units.
///
/// ```
/// use kardan_schema::schema::Quantity;
/// use kardan_math::units::{Dimension, Exact};
/// let torques: [Quantity; 2] = ["1/3 N m".into(), Quantity::exact(Exact::from_ratio(1, 3), Dimension::TORQUE)];
/// let (ratio, inertia): (Quantity, Quantity) = (0.5.into(), "J_wg".into());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity(RawValue);

impl Quantity {
    /// An exact value in SI units.
    pub fn exact(value: Exact, dimension: Dimension) -> Self {
        Self(RawValue::Quantity(value, dimension))
    }
}

impl Default for Quantity {
    fn default() -> Self {
        "".into()
    }
}

impl From<&str> for Quantity {
    fn from(text: &str) -> Self {
        Self(RawValue::Text(text.into()))
    }
}

impl From<String> for Quantity {
    fn from(text: String) -> Self {
        Self(RawValue::Text(text))
    }
}

impl From<f64> for Quantity {
    /// The shortest decimal number that is nearest to this one: 0.1 is one tenth.
    fn from(number: f64) -> Self {
        Self(RawValue::Number(zmij::Buffer::new().format(number).into()))
    }
}

impl From<i32> for Quantity {
    fn from(number: i32) -> Self {
        Self(RawValue::Number(number.to_string()))
    }
}

/// A list of names: `["wg_motor", "rk_motor"]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Names(pub Vec<String>);

impl<S: Into<String>, I: IntoIterator<Item = S>> From<I> for Names {
    fn from(names: I) -> Self {
        Self(names.into_iter().map(Into::into).collect())
    }
}

/// Quantities by name: `[("beta", "0 deg")]`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Named(pub Vec<(String, Quantity)>);

impl<S: Into<String>, Q: Into<Quantity>, I: IntoIterator<Item = (S, Q)>> From<I> for Named {
    fn from(entries: I) -> Self {
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

impl<Q: Into<Quantity>, I: IntoIterator<Item = Q>> From<I> for Quantities {
    fn from(list: I) -> Self {
        Self(list.into_iter().map(Into::into).collect())
    }
}

/// A value of a key: written as an entry, and read from one.
pub trait EntryValue: Sized {
    /// As an entry.
    fn raw(&self) -> RawValue;
    /// From an entry; `None` if it is of another kind.
    fn read(raw: &RawValue) -> Option<Self>;
}

impl EntryValue for String {
    fn raw(&self) -> RawValue {
        RawValue::Text(self.clone())
    }

    fn read(raw: &RawValue) -> Option<Self> {
        raw.as_text().map(str::to_string)
    }
}

impl EntryValue for Quantity {
    fn raw(&self) -> RawValue {
        self.0.clone()
    }

    fn read(raw: &RawValue) -> Option<Self> {
        matches!(raw, RawValue::Text(_) | RawValue::Number(_) | RawValue::Quantity(..)).then(|| Self(raw.clone()))
    }
}

fn list<T: EntryValue>(values: &[T]) -> RawValue {
    RawValue::List(values.iter().map(|value| Entry::from(value.raw())).collect())
}

fn read_list<T: EntryValue>(raw: &RawValue) -> Option<Vec<T>> {
    let RawValue::List(list) = raw else { return None };
    list.iter().map(|entry| T::read(&entry.value)).collect()
}

fn map<'a>(values: impl Iterator<Item = (&'a String, RawValue)>) -> RawValue {
    let mut out = Entries::default();
    values.for_each(|(name, value)| out.set(name, value));
    RawValue::Table(out)
}

fn read_map<T>(raw: &RawValue, read: impl Fn(&RawValue) -> Option<T>) -> Option<Vec<(String, T)>> {
    let RawValue::Table(table) = raw else { return None };
    table.iter().map(|entry| Some((entry.key.clone(), read(&entry.entry.value)?))).collect()
}

impl EntryValue for Names {
    fn raw(&self) -> RawValue {
        list(&self.0)
    }

    fn read(raw: &RawValue) -> Option<Self> {
        read_list(raw).map(Self)
    }
}

impl EntryValue for Quantities {
    fn raw(&self) -> RawValue {
        list(&self.0)
    }

    fn read(raw: &RawValue) -> Option<Self> {
        read_list(raw).map(Self)
    }
}

impl EntryValue for Named {
    fn raw(&self) -> RawValue {
        map(self.0.iter().map(|(name, value)| (name, value.raw())))
    }

    fn read(raw: &RawValue) -> Option<Self> {
        read_map(raw, Quantity::read).map(Self)
    }
}

impl EntryValue for Lists {
    fn raw(&self) -> RawValue {
        map(self.0.iter().map(|(name, values)| (name, list(values))))
    }

    fn read(raw: &RawValue) -> Option<Self> {
        let one = |raw: &RawValue| read_list(raw).or_else(|| Some(vec![Quantity::read(raw)?]));
        read_map(raw, one).map(Self)
    }
}

impl<T: Keys> EntryValue for T {
    fn raw(&self) -> RawValue {
        RawValue::Table(self.entries())
    }

    fn read(raw: &RawValue) -> Option<Self> {
        T::read_entries(raw.as_table()?)
    }
}

impl<T: Keys> EntryValue for Vec<T> {
    fn raw(&self) -> RawValue {
        list(self)
    }

    fn read(raw: &RawValue) -> Option<Self> {
        read_list(raw).or_else(|| Some(vec![T::read(raw)?]))
    }
}
