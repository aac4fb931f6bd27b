//! Formatting for messages that the folders of the theory share.

use kardan_analysis::plain_combination;
use kardan_math::num::Rational;
use kardan_results::Pole;

/// A combination of names with exact factors: `T_wg - 1/50 T_fs`; terms with the factor zero are left out, `0` if all are.
///
/// ```
/// use kardan_math::num::Rational;
/// use kardan_synthesis::linear_combination;
/// let factors = [Rational::ONE, Rational::from(-51), Rational::from(50)];
/// assert_eq!(linear_combination(&["wg", "cs", "fs"], &factors), "wg - 51 cs + 50 fs");
/// ```
pub fn linear_combination<S: AsRef<str>>(names: &[S], factors: &[Rational]) -> String {
    let terms = names.iter().map(|name| name.as_ref().to_string()).zip(factors.iter().cloned());
    let terms: Vec<_> = terms.filter(|(_, factor)| !factor.is_zero()).collect();
    if terms.is_empty() { "0".into() } else { plain_combination(&terms) }
}

/// Names one after the other: `a, b and c`.
pub(super) fn listed<S: AsRef<str>>(names: &[S]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.split_last() {
        Some((last, [])) => (*last).to_string(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
        None => "nothing".into(),
    }
}

/// A pole for a message: `-50`, `-3 ± 4j`.
pub(super) fn format_pole(pole: &Pole) -> String {
    match (pole.re, pole.im) {
        (re, 0.0) => format!("{re}"),
        (re, im) => format!("{re} {} {}j", if im < 0.0 { '-' } else { '+' }, im.abs()),
    }
}

/// Several poles for a message.
pub(super) fn format_poles(poles: &[Pole]) -> String {
    listed(&poles.iter().map(format_pole).collect::<Vec<_>>())
}
