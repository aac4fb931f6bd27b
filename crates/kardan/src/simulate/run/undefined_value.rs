//! What a run says of values that are none.

/// Whether it says what has no value: of finite numbers no operation makes this but one without a value.
pub(super) fn is_undefined(what: &str) -> bool {
    what.ends_with(" is NaN") && what.contains(", as ")
}

/// What to do about it.
pub(super) fn undefined(what: &str) -> String {
    format!("{what}: it has no value there. Keep what it is of where it has one, such as by `max(0, ...)` or `if(...)`")
}
