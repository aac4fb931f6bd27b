//! What decides about the bits of a run calls no function of the platform: sines and powers of the standard library differ from one
//! target to the next. Those of `kardan_rt::Real` are the same everywhere.

use std::fs;

use crate::reader::{code, crate_folder, sources};

/// Where runs are computed.
const FOLDERS: &[&str] = &["src/simulate", "src/reduce", "src/element", "src/plan", "src/expr", "../kardan-rt/src"];

/// Functions whose last bits are the platform's own. Whole powers are products, roots are exact.
const PLATFORM: &[&str] = &[
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log",
    "log2", "log10", "powf", "hypot", "cbrt", "sinh", "cosh", "tanh", "mul_add",
];

/// Files in which such a call is another one, with the reason.
const OTHERS: &[(&str, &str)] = &[
    ("expr/domains.rs", "numbers of `Real`"),
    ("expr/graph.rs", "makes an expression"),
    ("kardan-rt/src/plan.rs", "numbers of `Real`"),
    ("kardan-rt/src/universal_joint.rs", "numbers of `Real`"),
];

/// Calls of such functions as methods in a code.
fn calls(code: &str) -> Vec<&'static str> {
    let called = |name: &&&str| {
        code.match_indices(&format!(".{name}(")).next().is_some() || code.contains(&format!("f64::{name}("))
    };
    PLATFORM.iter().filter(called).copied().collect()
}

#[test]
fn runs_call_no_function_of_the_platform() {
    let mut found = Vec::new();
    let mut excused = vec![false; OTHERS.len()];
    for folder in FOLDERS {
        for file in sources(&crate_folder(folder)) {
            let called = calls(&code(&fs::read_to_string(&file).expect("a source")));
            if called.is_empty() {
                continue;
            }
            match OTHERS.iter().position(|(name, _)| file.ends_with(name)) {
                Some(place) => excused[place] = true,
                None => found.push(format!("{}: {called:?}", file.display())),
            }
        }
    }
    assert!(found.is_empty(), "take the function from kardan_rt::Real:\n{}", found.join("\n"));
    assert!(excused.iter().all(|used| *used), "no longer needed: {OTHERS:?} {excused:?}");
}

#[test]
fn such_calls_are_seen() {
    assert_eq!(calls("let y = x.sin() + f64::exp(x);"), ["sin", "exp"]);
    assert_eq!(calls("let y = Real::sin_cos(x).0 + x.powi(2) + x.sqrt();"), Vec::<&str>::new());
}
