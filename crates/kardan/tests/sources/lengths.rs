//! Functions and files that can be read: no function above [`MOST`] lines but those of a list, each with its reason.

use std::fs;

use crate::reader::{code, crates, inside_name, name_at, sources};

/// From the line of `fn` to that of the closing brace.
const MOST: usize = 80;

/// Longer functions that stand for now: file, function, why. The list may only shrink.
const LONG: &[(&str, &str, &str)] = &[(
    "kardan-analysis/uncontrollability.rs",
    "descend",
    "one Newton step: every part of it reads the pencil, the vector and the decomposition of the same point",
)];

/// Names and lengths of the functions of a code.
fn functions(code: &str) -> Vec<(String, usize)> {
    let mut out = Vec::new();
    for (at, _) in code.match_indices("fn ") {
        let name = name_at(&code[at + 3..]);
        if inside_name(code, at) || name.is_empty() {
            continue;
        }
        let mut depth = 0;
        for (end, c) in code[at..].char_indices() {
            match c {
                '{' | '(' | '[' => depth += 1,
                '}' | ')' | ']' => depth -= 1,
                ';' if depth == 0 => break,
                _ => {}
            }
            if depth == 0 && c == '}' {
                out.push((name, code[at..at + end].matches('\n').count() + 1));
                break;
            }
        }
    }
    out
}

#[test]
fn functions_can_be_read() {
    let (mut wrong, mut found) = (Vec::new(), Vec::new());
    let mut read = 0;
    for (name, src) in crates() {
        for file in sources(&src) {
            let place = format!("{name}/{}", file.strip_prefix(&src).expect("a file of the root").to_string_lossy());
            for (function, lines) in functions(&code(&fs::read_to_string(&file).expect("a source"))) {
                read += 1;
                if lines <= MOST {
                    continue;
                }
                match LONG.iter().any(|(file, long, _)| *file == place && *long == function) {
                    true => found.push((place.clone(), function)),
                    false => wrong.push(format!("{place}: `{function}` has {lines} lines")),
                }
            }
        }
    }
    for (place, function, _) in LONG {
        if !found.iter().any(|(file, name)| file == place && name == function) {
            wrong.push(format!("{place}: `{function}` is not long: take it out of the list"));
        }
    }
    assert!(wrong.is_empty(), "functions above {MOST} lines:\n{}", wrong.join("\n"));
    assert!(read > 1000, "only {read} functions were read");
}

/// Files that can be read at one sitting.
#[test]
fn files_can_be_read() {
    const MOST_LINES: usize = 700;
    for (_, src) in crates() {
        for file in sources(&src) {
            let lines = fs::read_to_string(&file).expect("a source").lines().count();
            assert!(lines <= MOST_LINES, "{} has {lines} lines: split it by concept", file.display());
        }
    }
}

#[test]
fn lengths_are_counted() {
    let code =
        "fn one() {}\ntrait T { fn no(&self, x: [Vec<f64>; 3]);\n fn two(\n x: [u8; 2],\n) {\n { } }\n}\nlet sufn = 1;";
    assert_eq!(functions(code), [("one".into(), 1), ("two".into(), 4)]);
}
