//! Messages about undefined values in a run.

/// Whether the text names an undefined operation: from finite numbers only an undefined operation makes NaN.
pub(super) fn is_undefined(what: &str) -> bool {
    what.ends_with(" is NaN") && what.contains(", as ")
}

/// The message with help.
pub(super) fn undefined(what: &str) -> String {
    format!("{what}: it is undefined there. Limit its argument to the domain, such as by `max(0, ...)` or `if(...)`")
}
