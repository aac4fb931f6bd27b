//! True values of a virtual bench as a file for `kardan bench --truth`.

use std::fmt::Write;

use kardan_results::TrueValue;

/// The table `[bench.truth]` with these values; every number reads back as the same `f64`.
///
/// ```
/// use kardan::export::truth_toml;
/// use kardan::results::TrueValue;
/// let one = TrueValue { name: "wg.damping".into(), value: 0.5, unit: "N m s/rad".into(), nominal: Some(0.4) };
/// assert!(truth_toml(&[one]).ends_with("\"wg.damping\" = \"0.5 N m s/rad\"   # the model has 0.4\n"));
/// ```
pub fn truth_toml(values: &[TrueValue]) -> String {
    let mut out = "# True values of the plant on the bench.\n[bench.truth]\n".to_string();
    for TrueValue { name, value, unit, nominal } in values {
        let text = format!("{value:?} {unit}");
        let _ = write!(out, "\"{name}\" = \"{}\"", text.trim_end());
        let _ = match nominal {
            Some(nominal) => writeln!(out, "   # the model has {nominal:?}"),
            None => writeln!(out, "   # the model has none"),
        };
    }
    out
}
