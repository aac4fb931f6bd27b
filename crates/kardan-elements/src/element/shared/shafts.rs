//! Elements over several shafts.

use super::kind::KeyError;
use kardan_schema::schema::Values;

/// The shafts behind these keys must be different ones.
pub(in crate::element) fn check_different(values: &Values, keys: &[&'static str]) -> Vec<KeyError> {
    let again = |k: &usize| {
        values.word(keys[*k]).is_some() && keys[..*k].iter().any(|key| values.word(key) == values.word(keys[*k]))
    };
    let key_error = |k: usize| {
        let message = format!("two of its shafts are `{}`", values.word_or_default(keys[k]));
        KeyError::new(keys[k], message, "name three different shafts")
    };
    (1..keys.len()).filter(again).map(key_error).collect()
}
