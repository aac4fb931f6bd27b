//! What a run says of values that are none.

/// Whether it says what has no value: of finite numbers no operation makes this but one without a value.
pub(super) fn is_undefined(what: &str) -> bool {
    what.ends_with(" is NaN") && what.contains(", as ")
}

/// What to do about it.
pub(super) fn undefined(what: &str) -> String {
    format!("{what}: it is undefined there. Limit its argument to the domain, such as by `max(0, ...)` or `if(...)`")
}
