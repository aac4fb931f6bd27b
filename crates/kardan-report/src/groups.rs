//! Lists without repetition, in the order in which their entries come first.

use std::collections::HashMap;

/// Each value once.
pub(super) fn distinct<T: PartialEq>(all: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut out = Vec::new();
    for one in all {
        if !out.contains(&one) {
            out.push(one);
        }
    }
    out
}

/// Each key once, with all its values.
pub(super) fn grouped<K: PartialEq, V>(pairs: impl IntoIterator<Item = (K, V)>) -> Vec<(K, Vec<V>)> {
    let mut out: Vec<(K, Vec<V>)> = Vec::new();
    for (key, value) in pairs {
        match out.iter_mut().find(|(own, _)| *own == key) {
            Some((_, values)) => values.push(value),
            None => out.push((key, vec![value])),
        }
    }
    out
}

/// Each name once, with the sums of its numbers.
pub(super) fn summed<'a, const N: usize>(
    pairs: impl IntoIterator<Item = (&'a str, [f64; N])>,
) -> Vec<(&'a str, [f64; N])> {
    let mut out: Vec<(&str, [f64; N])> = Vec::new();
    let mut places = HashMap::new();
    for (name, numbers) in pairs {
        let place = *places.entry(name).or_insert_with(|| {
            out.push((name, [0.0; N]));
            out.len() - 1
        });
        out[place].1.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
    }
    out
}
