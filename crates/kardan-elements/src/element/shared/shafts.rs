//! Elements over several bodies.

use super::kind::KeyError;
use kardan_schema::schema::Values;

/// The body or node that two keys name both, if they do.
pub(in crate::element) fn shared_name<'a>(values: &'a Values, [first, second]: [&str; 2]) -> Option<&'a str> {
    values.word(first).filter(|body| values.word(second) == Some(*body))
}

/// The keys of the bodies at both ends.
pub(in crate::element) const ENDS: [&str; 2] = ["shaft_1", "shaft_2"];

/// The bodies at both ends must be different ones.
pub(in crate::element) fn check_ends(values: &Values, ends: [&'static str; 2]) -> Vec<KeyError> {
    let error = |body| KeyError::new(ends[1], format!("both ends are `{body}`"), "name two different ones");
    shared_name(values, ends).map(error).into_iter().collect()
}

/// The shafts behind these keys must be different ones.
pub(in crate::element) fn check_different(values: &Values, keys: &[&'static str]) -> Vec<KeyError> {
    let again = |k: &usize| keys[..*k].iter().any(|key| shared_name(values, [*key, keys[*k]]).is_some());
    let key_error = |k: usize| {
        let message = format!("two of its shafts are `{}`", values.word_or_default(keys[k]));
        KeyError::new(keys[k], message, "name three different shafts")
    };
    (1..keys.len()).filter(again).map(key_error).collect()
}
