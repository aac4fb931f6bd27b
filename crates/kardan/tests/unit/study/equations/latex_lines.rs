//! Tests of `src/study/equations/latex_lines.rs`.

use super::*;

/// A broken formula is the same without its breaks, and every line fits.
#[test]
fn lines_fit_and_preserve_the_formula() {
    let term = |k: usize| format!(r"\frac{{a_{{\mathrm{{{k}}}}}}}{{b + c}} \, \dot\varphi_{{\mathrm{{wheel}}}}");
    let sum = (0..20).map(term).collect::<Vec<_>>().join(" + ");
    for formula in [sum.clone(), format!("({sum}) \\, x = 0"), r"\left(a + b\right) \, c".to_string()] {
        let found = parts(&formula, 40.0);
        assert_eq!(found.join(" "), formula);
        assert!(found.iter().all(|part| width(part) <= 40.0), "{found:?}");
        assert_eq!(found.len() > 1, width(&formula) > 40.0);
    }
    assert_eq!(width(r"\frac{a}{b + c}"), width("b + c"));
    assert!(in_lines(&sum, 10.0).contains("} \\\\\n  &\\quad {} + \\frac"));
    assert_eq!(in_lines("a + b", 10.0), "a + b");
    let short = [("a".to_string(), "b".to_string()), ("c".to_string(), "d".to_string())];
    assert_eq!(aligned(&short), "\\begin{align*}\n  a &= b \\\\\n  c &= d\n\\end{align*}\n");
    let long = [(sum, "b".to_string()), ("c".to_string(), "d".to_string())];
    assert!(
        aligned(&long).starts_with("\\begin{align*}\n  &\\frac")
            && aligned(&long).ends_with("  &c = d\n\\end{align*}\n")
    );
}
