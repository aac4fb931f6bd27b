//! Tests of `src/symbolic/change.rs`.

use kardan_rt::functions;

use super::*;

/// Against central differences of what is differentiated, at one place: every function that a formula may have.
#[test]
fn changes_are_those_of_differences() {
    for text in [
        "sqrt(2 + x^2)",
        "sin(3*x)*cos(x)",
        "tan(x/3)",
        "asin(x/2)",
        "acos(x/2)",
        "atan(2*x)",
        "atan2(x, 1 + x^2)",
        "exp(-x)*x",
        "ln(1 + x^2)",
        "(2 + x)^1.5",
        "2^x",
        "1/(1 + x)^2",
        "if(a < 1, x^2, x)",
        "x/(2 + sin(x))",
        "(1 + x)^20",
    ] {
        let (mut letters, mut assumed) = (Letters::default(), Assumed::default());
        let x = letters.letter(Symbol::Position(0));
        let names = BTreeMap::from([("x", Laurent::letter(x)), ("a", Laurent::number(Rational::ZERO))]);
        let value = letters.formula(text, &names);
        let slope = letters.change(&value, &BTreeMap::from([(x, Laurent::number(Rational::ONE))]), &mut assumed);
        let at = |of: &Laurent, place: f64| numeric(&letters, of, place);
        let (step, place) = (1e-5, 0.37);
        let expected = (at(&value, place + step) - at(&value, place - step)) / (2.0 * step);
        let found = at(&slope, place);
        assert!((found - expected).abs() < 1e-8 * (1.0 + expected.abs()), "{text}: {found} instead of {expected}");
    }
}

fn numeric(letters: &Letters, value: &Laurent, x: f64) -> f64 {
    value.value(&|letter| match letters.symbol(letter) {
        Symbol::Position(_) => x,
        Symbol::Sum(sum) => numeric(letters, sum, x),
        Symbol::Call(function, parts) => {
            let parts: Vec<f64> = parts.iter().map(|part| numeric(letters, part, x)).collect();
            match (*function, parts.as_slice()) {
                ("sqrt", [x]) => x.sqrt(),
                ("sin", [x]) => functions::sin(*x),
                ("cos", [x]) => functions::cos(*x),
                ("tan", [x]) => functions::tan(*x),
                ("asin", [x]) => functions::asin(*x),
                ("acos", [x]) => functions::acos(*x),
                ("atan", [x]) => functions::atan(*x),
                ("atan2", [y, x]) => functions::atan2(*y, *x),
                ("exp", [x]) => functions::exp(*x),
                ("ln", [x]) => functions::ln(*x),
                ("^", [base, power]) => functions::exp(power * functions::ln(*base)),
                ("<", [a, b, yes, no]) => {
                    if a < b {
                        *yes
                    } else {
                        *no
                    }
                }
                other => panic!("{other:?}"),
            }
        }
        other => panic!("{other:?}"),
    })
}
