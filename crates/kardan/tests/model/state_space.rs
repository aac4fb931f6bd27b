//! Systems given by their matrices: what is read exactly, and how mistakes are told.
//!
//! The MAT files in `tests/state_space/` were written by SciPy 1.17.1, see `generate.py` there.

use std::fs;
use std::path::{Path, PathBuf};

use kardan::analysis::LinearSystem;
use kardan::diagnostics::{Diagnostic, plain};
use kardan::model::{StateSpace, read_state_space};
use kardan::num::{Matrix, Rational, exact_rank, rational_from_f64};
use proptest::prelude::*;

fn q(text: &str) -> Rational {
    kardan::units::parse_number(text).unwrap().rational
}

fn matrix(rows: &[&[&str]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| q(rows[i][j]))
}

/// The values of binary numbers.
fn binary(rows: &[&[f64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rational_from_f64(rows[i][j]).unwrap())
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/state_space")
}

fn mat(name: &str) -> Vec<u8> {
    fs::read(folder().join(name)).unwrap()
}

fn mat_files() -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "mat"))
        .collect();
    files.sort();
    assert!(files.len() >= 20);
    files
}

fn good(bytes: &[u8]) -> LinearSystem {
    whole(bytes).system
}

fn whole(bytes: &[u8]) -> StateSpace {
    read_state_space(bytes)
        .unwrap_or_else(|diagnostics| panic!("{}", plain(&String::from_utf8_lossy(bytes), &diagnostics)))
}

fn json(text: &str) -> LinearSystem {
    good(text.as_bytes())
}

/// The mistakes of bytes, each of which must say what is wrong and what to do, in places that exist.
fn bad(bytes: &[u8]) -> Vec<Diagnostic> {
    let diagnostics = match read_state_space(bytes) {
        Err(diagnostics) => diagnostics,
        Ok(system) => panic!("accepted: {system:?}"),
    };
    assert!(!diagnostics.is_empty());
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for diagnostic in &diagnostics {
        assert!(diagnostic.help.as_ref().is_some_and(|help| !help.is_empty()), "{diagnostic:?}");
        assert!(!diagnostic.message.is_empty() && diagnostic.message.len() < 500, "{diagnostic:?}");
        for label in &diagnostic.labels {
            assert!(std::str::from_utf8(text).unwrap().get(label.place.span()).is_some(), "{diagnostic:?}");
        }
    }
    diagnostics
}

#[test]
fn json_is_exact() {
    let system = json(
        r#"{"A": [[0.1, "1/3"], [-1.5e-3, "51/50"]], "B": [[0], [123456789012345678901234567890.5]],
            "C": [["0.1", 1E5]], "D": [[1e300]], "E": [[2, 0], [0, -0.5]],
            "states": ["angle", "speed"], "inputs": ["τ"], "outputs": ["y"], "name": "x", "description": "y"}"#,
    );
    assert_eq!(system.a, matrix(&[&["1/10", "1/3"], &["-3/2000", "1.02"]]));
    assert_eq!(system.b, matrix(&[&["0"], &["246913578024691357802469135781/2"]]));
    assert_eq!(system.c, matrix(&[&["1/10", "100000"]]));
    assert_eq!(system.d, matrix(&[&["1e300"]]));
    assert_eq!(system.e, matrix(&[&["2", "0"], &["0", "-1/2"]]));
    assert_eq!((system.states[1].as_str(), system.inputs[0].as_str(), system.degrees_of_freedom), ("speed", "τ", None));
}

#[test]
fn omitted_matrices_have_defaults() {
    let system = json(r#"{"A": [[1, 2], [3, 4]]}"#);
    assert_eq!((system.b.columns(), system.c.rows(), system.d.rows(), system.d.columns()), (0, 0, 0, 0));
    assert_eq!((system.b.rows(), system.c.columns()), (2, 2));
    assert_eq!(system.e, Matrix::identity(2));
    assert_eq!(system.states, ["x1", "x2"]);

    let system =
        json("\u{feff} {\"A\": [[1, 2], [3, 4]], \"B\": [[1, 2, 3], [4, 5, 6]], \"C\": [[1, 0]], \"Ts\": 0}\n");
    assert_eq!((system.inputs.join(" "), system.outputs.join(" ")), ("u1 u2 u3".into(), "y1".into()));
    assert_eq!(system.d, Matrix::zeros(1, 3));
}

#[test]
fn lists_and_numbers_stand_for_columns_and_rows() {
    let wide = json(r#"{"A": [[1, 2], [3, 4]], "B": [5, 6], "C": [7, 8], "D": 9}"#);
    assert_eq!((wide.b, wide.c, wide.d), (matrix(&[&["5"], &["6"]]), matrix(&[&["7", "8"]]), matrix(&[&["9"]])));
    let one = json(r#"{"A": -1, "B": 2, "C": "1/3", "D": 0, "E": 4}"#);
    assert_eq!((one.a, one.b, one.e), (matrix(&[&["-1"]]), matrix(&[&["2"]]), matrix(&[&["4"]])));
    // One state: a list is a row of inputs, and D follows it.
    let inputs = json(r#"{"A": [-1], "B": [[1, 2]], "C": [[1], [2]], "D": [[1, 2], [3, 4]]}"#);
    assert_eq!((inputs.inputs.len(), inputs.outputs.len(), inputs.d[(1, 0)].clone()), (2, 2, q("3")));
    let column = json(r#"{"A": [[-1]], "B": 1, "C": [[1], [2]], "D": [3, 4]}"#);
    assert_eq!(column.d, matrix(&[&["3"], &["4"]]));
    let none = json(r#"{"A": [[-1]], "B": [], "C": [[]], "D": []}"#);
    assert_eq!((none.inputs.len(), none.outputs.len()), (0, 0));
}

/// Sample times of all spellings; the last digit of what is written.
#[test]
fn sample_times_and_last_digits_are_read() {
    let time = |text: &str| whole(text.as_bytes()).sample_time;
    for key in ["Ts", "dt", "sample_time"] {
        assert_eq!(time(&format!(r#"{{"A": 1, "{key}": 0.01}}"#)), Some(Some(q("1/100"))));
        assert_eq!(time(&format!(r#"{{"A": 1, "{key}": -1}}"#)), Some(None));
        assert_eq!(time(&format!(r#"{{"A": 1, "{key}": 0}}"#)), None);
    }
    assert_eq!(whole(&mat("discrete.mat")).sample_time, Some(rational_from_f64(0.01)));
    assert_eq!(whole(&mat("plain.mat")).sample_time, None);
    let digits = |text: &str| whole(text.as_bytes()).digits;
    // Whole numbers and fractions are meant exactly, in whatever way they are written.
    let exact = digits(r#"{"A": [[1, 2.0], ["1/3", 3e2]], "B": [0, 1]}"#);
    assert_eq!((exact.inputs, exact.outputs), (0.0, 0.0));
    // 0.005 of A, 0.5e-4 of B, 0.05e3 of C.
    let hand = digits(r#"{"A": -0.25, "B": 2.5e-3, "C": 1.0001e3}"#);
    assert!(!hand.binary && (hand.inputs / 0.005f64.hypot(0.5e-4) - 1.0).abs() < 1e-12, "{hand:?}");
    assert!((hand.outputs / 0.005f64.hypot(0.05) - 1.0).abs() < 1e-12, "{hand:?}");
    // A number of a program: all of them are binary, a short one too.
    let machine = digits(r#"{"A": [[0.5, 0.3333333333333333], [0, 1]]}"#);
    let expected = 0.5f64.hypot(1.0 / 3.0) * 2f64.powi(-53);
    assert!(machine.binary && (machine.inputs / expected - 1.0).abs() < 1e-12, "{machine:?}");
    let stored = whole(&mat("plain.mat")).digits;
    assert!(stored.binary && (stored.inputs / (0.1f64.hypot(2.5) * 2f64.powi(-53)) - 1.0).abs() < 1e-12);
}

const A: &[&[f64]] = &[&[0.0, 1.0], &[-0.1, -2.5]];

#[test]
fn mat_files_are_read_exactly() {
    for name in ["plain.mat", "compressed.mat", "struct.mat", "struct-compressed.mat"] {
        let system = good(&mat(name));
        assert_eq!(system.a, binary(A), "{name}");
        assert_eq!(system.b, binary(&[&[0.0], &[1.0]]), "{name}");
        assert_eq!(system.c, binary(&[&[1.0, 0.0], &[0.0, 2.0]]), "{name}");
        assert_eq!(system.d, Matrix::zeros(2, 1), "{name}");
    }
    assert_ne!(good(&mat("plain.mat")).a[(1, 0)], q("-0.1"));
    let named = good(&mat("struct.mat"));
    assert_eq!((named.states.join(" "), named.inputs.join(" ")), ("angle speed".into(), "torque".into()));
    assert_eq!(named.outputs, ["p", "q"]);

    for name in ["sparse.mat", "sparse-plain.mat"] {
        let sparse = good(&mat(name));
        assert_eq!((sparse.a, sparse.b), (binary(A), binary(&[&[0.0], &[1.0]])), "{name}");
    }
    let single = good(&mat("single.mat"));
    assert_eq!(single.a[(1, 0)], rational_from_f64(f64::from(-0.1f32)).unwrap());
    let integers = good(&mat("integers.mat"));
    assert_eq!(integers.a, matrix(&[&["0", "1"], &["-4", "-3"]]));
    assert_eq!((integers.b[(1, 0)].clone(), integers.c[(0, 1)].clone()), (q("200"), q("-30000")));
    assert_eq!(integers.d, matrix(&[&["1099511627776"]]));
    assert_eq!(good(&mat("scalar.mat")).a, matrix(&[&["-1/2"]]));
    assert_eq!(good(&mat("descriptor.mat")).e, matrix(&[&["2", "0"], &["0", "3"]]));
    assert_eq!(good(&mat("bool.mat")).a, matrix(&[&["1", "0"], &["1", "1"]]));
    let none = good(&mat("no-inputs.mat"));
    assert_eq!((none.inputs.len(), none.outputs.len()), (0, 0));
}

/// A file of MATLAB itself: doubles stored as bytes, small elements, big-endian, built by hand after the format's manual.
#[test]
fn doubles_stored_as_small_integers_are_read() {
    for little in [true, false] {
        let word = |x: u32| if little { x.to_le_bytes() } else { x.to_be_bytes() };
        let small = |kind: u32, bytes: [u8; 4], length: u32| [word(length << 16 | kind), bytes].concat();
        let mut body = [word(6), word(8), word(6), word(0), word(5), word(8), word(2), word(2)].concat();
        body.extend(small(1, [b'A', 0, 0, 0], 1));
        body.extend(small(1, [0, 0xff, 2, 0x80], 4)); // int8, column by column
        let mut file = b"MATLAB 5.0 MAT-file, Platform: PCWIN64".to_vec();
        file.resize(124, b' ');
        file.extend(if little { *b"\x00\x01IM" } else { *b"\x01\x00MI" });
        file.extend([word(14), word(body.len() as u32)].concat());
        file.extend(&body);
        assert_eq!(good(&file).a, matrix(&[&["0", "2"], &["-1", "-128"]]), "little endian: {little}");
    }
}

#[test]
fn bad_json_is_explained() {
    let deep = format!("{{\"A\": {}1{}}}", "[".repeat(100_000), "]".repeat(100_000));
    let wide = format!("{{\"A\": [[1]], \"B\": [[{}]]}}", vec!["1"; 2001].join(","));
    let tall = format!("{{\"A\": [{}]}}", vec!["[1]"; 2001].join(","));
    let digits = format!("{{\"A\": {}}}", "1".repeat(300));
    let cases: &[(&str, &str, &str)] = &[
        ("", "file::empty", "empty"),
        (" \n\t", "file::empty", "empty"),
        ("A = [0 1; 2 3]", "json::syntax", "line 1, column 1"),
        ("{\"A\": [[1, 2], [3, 4]]", "json::syntax", "EOF"),
        ("{\"A\": [[1, 2],\n [3, 4,]]}", "json::syntax", "line 2"),
        ("{\"A\": [[NaN]]}", "json::syntax", "no JSON"),
        ("{\"A\": [[01]]}", "json::syntax", "invalid number"),
        ("{\"A\": 1} x", "json::syntax", "trailing"),
        ("{\"±a", "json::syntax", "line 1, column 4"),
        ("{\"A\": \"\u{1}\"}", "json::syntax", "control character"),
        ("[[1, 2], [3, 4]]", "state-space::type", "expected an object with the matrix `A`, found a list"),
        ("17", "state-space::type", "found a number"),
        ("{}", "state-space::missing", "no matrix `A`"),
        (r#"{"B": [[1]]}"#, "state-space::missing", "no matrix `A`"),
        (r#"{"A": []}"#, "state-space::empty", "0×0"),
        (r#"{"A": [[], []]}"#, "state-space::shape", "`A` is 2×0"),
        (r#"{"A": [[1, 2]]}"#, "state-space::shape", "`A` is 1×2, but it must be square"),
        (r#"{"A": [1, 2]}"#, "state-space::shape", "must be square"),
        (r#"{"A": [[1, 2], [3]]}"#, "state-space::ragged", "row 2 of `A` has 1 entries, but row 1 has 2"),
        (r#"{"A": [[1, 2], 3]}"#, "state-space::type", "row 2 of `A` is a number"),
        (r#"{"A": null}"#, "state-space::type", "`A` is null"),
        (r#"{"A": {"x": 1}}"#, "state-space::type", "`A` is an object"),
        (r#"{"A": true}"#, "state-space::type", "`A` is a truth value"),
        (r#"{"A": [[1, null], [0, 1]]}"#, "number::not-finite", "entry 2 of row 1 of `A`: null"),
        (r#"{"A": [["NaN"]]}"#, "number::not-finite", "`NaN` is not a finite number"),
        (r#"{"A": [["Infinity"]]}"#, "number::not-finite", "`Infinity`"),
        (r#"{"A": [["-inf"]]}"#, "number::not-finite", "`inf`"),
        (r#"{"A": [[true]]}"#, "state-space::entry", "a truth value is not a number"),
        (r#"{"A": [[[1]]]}"#, "state-space::entry", "a list is not a number"),
        (r#"{"A": [["1/0"]]}"#, "number::syntax", "division by zero"),
        (r#"{"A": [["5 kg"]]}"#, "unit::dimension", "without a unit"),
        (r#"{"A": [["pi/4"]]}"#, "state-space::irrational", "factor π"),
        (r#"{"A": [["one"]]}"#, "number::syntax", "expected a number"),
        (r#"{"A": [[""]]}"#, "number::syntax", "expected a number"),
        (r#"{"A": [["\ud800"]]}"#, "number::syntax", "expected a number"),
        (r#"{"A": [[1e400]]}"#, "number::range", "entry 1 of row 1 of `A`"),
        (r#"{"A": [[1e99999999999999999999]]}"#, "number::range", "`A`"),
        (r#"{"A": [[1]], "B": [[1], [2]]}"#, "state-space::shape", "`B` is 2×1, but it needs 1 rows"),
        (r#"{"A": [[1, 0], [0, 1]], "B": [1, 2, 3]}"#, "state-space::shape", "`B` is a list of 3 numbers"),
        (
            r#"{"A": [[1, 0], [0, 1]], "C": [[1], [2], [3]]}"#,
            "state-space::shape",
            "`C` is 3×1, but it needs 2 columns",
        ),
        (
            r#"{"A": [[1]], "B": [[1]], "C": [[1]], "D": [[1, 2]]}"#,
            "state-space::shape",
            "`D` is 1×2, but it must be 1×1",
        ),
        (r#"{"A": [[1]], "D": [[1]]}"#, "state-space::shape", "it must be 0×0"),
        (r#"{"A": [[1]], "E": [[1, 0], [0, 1]]}"#, "state-space::shape", "`E` is 2×2, but it must be 1×1"),
        (r#"{"A": 1, "A": 2}"#, "state-space::duplicate", "`A` is given twice"),
        (r#"{"A": 1, "b": 2}"#, "state-space::unknown", "unknown key `b`"),
        (r#"{"A": 1, "Ts": -0.01}"#, "state-space::discrete", "`Ts` is no sample time"),
        (r#"{"A": 1, "dt": true}"#, "state-space::discrete", "`dt` is no sample time"),
        (r#"{"A": [[1, 0], [0, 1]], "B": [[1, 2]]}"#, "state-space::shape", "`B` is 1×2, but it needs 2 rows"),
        (r#"{"A": [[1, 0], [0, 1]], "C": [[1], [2]]}"#, "state-space::shape", "`C` is 2×1, but it needs 2 columns"),
        (r#"{"A": 1, "B": [1, 2]}"#, "state-space::shape", "`B` is a list of 2 numbers"),
        (r#"{"A": 1, "states": ["a", "b"]}"#, "state-space::names", "`states` has 2 names for 1 states"),
        (r#"{"A": [[1, 0], [0, 1]], "states": ["a", "a"]}"#, "state-space::names", "is `a` as is name 1"),
        (r#"{"A": 1, "states": [""]}"#, "state-space::names", "name 1 of `states` is empty"),
        (r#"{"A": 1, "states": ["a\nb"]}"#, "state-space::names", "is no name"),
        (r#"{"A": 1, "states": "a"}"#, "state-space::names", "`states` is a text, not a list"),
        (r#"{"A": 1, "states": [1]}"#, "state-space::names", "name 1 of `states` is a number"),
        (r#"{"A": 1, "inputs": ["u"]}"#, "state-space::names", "`inputs` has 1 names for 0 inputs"),
        (&deep, "state-space::entry", "a list is not a number"),
        (&wide, "state-space::too-large", "at most 2000"),
        (&tall, "state-space::too-large", "at most 2000"),
        (&digits, "number::syntax", "256"),
    ];
    for (text, code, part) in cases {
        let shown = &text[..text.len().min(200)];
        let diagnostics = bad(text.as_bytes());
        let rendered = plain(text, &diagnostics);
        assert_eq!(diagnostics.len(), 1, "{shown}\n{rendered}");
        assert!(diagnostics[0].code == *code && diagnostics[0].message.contains(part), "{shown}\n{rendered}");
        let whole = matches!(*code, "file::empty" | "state-space::missing");
        assert_eq!(diagnostics[0].labels.is_empty(), whole, "{shown}\n{rendered}");
    }
}

/// Full matrices with fractions, smaller and larger than what is eliminated exactly.
#[test]
fn the_rank_of_e_is_right() {
    for n in [3usize, 10, 61, 90] {
        let entry = |i: usize, j: usize| ((i * i + 3) * (j + 1) * (j + 7) + i * j * j * j) % 101;
        let list = |last: &dyn Fn(usize) -> String| {
            let rows: Vec<String> = (0..n)
                .map(|i| {
                    let cells: Vec<String> = (0..n)
                        .map(|j| match i + 1 == n {
                            true => last(j),
                            false if i == j => format!("\"{}/7\"", 7000 + entry(i, j)),
                            false => format!("\"-{}/7\"", entry(i, j)),
                        })
                        .collect();
                    format!("[{}]", cells.join(","))
                })
                .collect();
            format!("[{}]", rows.join(","))
        };
        let a = format!("[{}]", vec![format!("[{}]", vec!["0"; n].join(",")); n].join(","));
        // The diagonal outweighs the mean of the rows.
        let regular = list(&|j| if j + 1 == n { "7000".into() } else { "1".into() });
        let sum = |j: usize| {
            let numerator: i64 =
                (0..n - 1).map(|i| if i == j { 7000 + entry(i, j) as i64 } else { -(entry(i, j) as i64) }).sum();
            format!("\"{numerator}/7\"")
        };
        let rank = |e: &str| exact_rank(&json(&format!("{{\"A\": {a}, \"E\": {e}}}")).e);
        assert_eq!((rank(&regular), rank(&list(&sum))), (n, n - 1));
    }
}

#[test]
fn places_are_those_of_the_errors() {
    let text = "{\n  \"A\": [[0, 1],\n        [2, \"x\"]],\n  \"B\": [1, 2, 3]\n}";
    assert!(plain(text, &bad(text.as_bytes())).starts_with("error[number::syntax] 3:13: entry 2 of row 2 of `A`"));
    let text = "{\"A\": [[1, 2],\n [3, 4],\n [5]]}";
    assert!(plain(text, &bad(text.as_bytes())).starts_with("error[state-space::ragged] 3:2: row 3 of `A`"));
    let text = "{\"A\": [[1, 2],\n [3, nan]]}";
    let found = plain(text, &bad(text.as_bytes()));
    assert!(found.starts_with("error[json::syntax] 2:") && found.contains("NaN and Infinity"), "{found}");
    assert!(bad(br#"{"A": 1, "state": ["a"]}"#)[0].help.as_ref().unwrap().contains("did you mean `states`?"));
}

#[test]
fn several_errors_are_reported_at_once() {
    let text = r#"{"A": [[1, 2], [3, 4]], "B": [[1], [2], [3]], "C": [[1, null]], "E": [[1, 1], [1, 1]],
                   "states": ["a", "a"], "x": 1}"#;
    let codes: Vec<&str> = bad(text.as_bytes()).iter().map(|diagnostic| diagnostic.code).collect();
    assert_eq!(codes, ["state-space::shape", "number::not-finite", "state-space::names", "state-space::unknown"]);
    // Many of one kind are not told one by one.
    let many = format!("{{\"A\": [[{}]]}}", vec!["null"; 500].join(","));
    assert_eq!(bad(many.as_bytes()).len(), 9);
}

#[test]
fn bad_mat_files_are_explained() {
    let v73 = [b"MATLAB 7.3 MAT-file".as_slice(), &[b' '; 200]].concat();
    let hdf = b"\x89HDF\r\n\x1a\n\0\0\0\0".to_vec();
    let cases: Vec<(Vec<u8>, &str, &str)> = vec![
        (mat("complex.mat"), "state-space::complex", "`A` is complex"),
        (mat("not-a-number.mat"), "number::not-finite", "`A(1, 2)` is NaN"),
        (mat("not-a-number.mat"), "number::not-finite", "`A(2, 1)` is Inf"),
        (mat("three-dimensional.mat"), "state-space::type", "size 2×2×2"),
        (mat("text.mat"), "state-space::type", "`A` is a text"),
        (mat("nothing.mat"), "state-space::missing", "only `x`, `y`"),
        (mat("two-structs.mat"), "state-space::ambiguous", "`one`, `two`"),
        (mat("empty-matrix.mat"), "state-space::empty", "0×0"),
        (mat("version-4.mat"), "mat::version", "version 4"),
        (mat("shapes.mat"), "state-space::shape", "`B` is 3×1"),
        (mat("shapes.mat"), "state-space::shape", "`C` is 1×3"),
        (mat("huge.mat"), "state-space::too-large", "2001×2001"),
        (mat("row-vectors.mat"), "state-space::shape", "`B` is 1×2, but it needs 2 rows"),
        (mat("cell.mat"), "state-space::type", "`A` is a cell array"),
        (v73, "mat::version", "7.3"),
        (hdf, "mat::version", "7.3"),
        (mat("plain.mat")[..100].to_vec(), "mat::damaged", "ends inside its header"),
        (mat("plain.mat")[..300].to_vec(), "mat::damaged", "truncated"),
        (mat("compressed.mat")[..300].to_vec(), "mat::damaged", "truncated"),
        (mat("plain.mat")[..128].to_vec(), "state-space::missing", "nothing"),
        (vec![0xc3, 0x28, 1, 2], "file::not-utf-8", "byte 0xC3 at offset 0"),
        (b"\xff\xfe{\0}\0".to_vec(), "file::utf-16", "UTF-16"),
    ];
    for (bytes, code, part) in cases {
        let diagnostics = bad(&bytes);
        let found = diagnostics.iter().any(|diagnostic| diagnostic.code == code && diagnostic.message.contains(part));
        assert!(found, "{code} {part}\n{}", plain("", &diagnostics));
    }
    assert!(
        bad(&[b"MATLAB 7.3 MAT-file".as_slice(), &[0; 200]].concat())[0].help.as_ref().unwrap().contains("save -v7")
    );
}

/// A compressed variable of zeros that inflates to far more than it may.
#[test]
fn a_bomb_is_refused() {
    let packed = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 257 << 20], 1);
    let mut bytes = mat("plain.mat")[..128].to_vec();
    bytes.extend(15u32.to_le_bytes());
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend(packed);
    assert_eq!(bad(&bytes)[0].code, "mat::too-large");
}

/// Neither a truncated file nor one with a wrong byte does harm.
#[test]
fn damaged_mat_files_do_no_harm() {
    let mut seed = 1u64;
    let mut random = move |below: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed % below as u64) as usize
    };
    for path in mat_files() {
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() < 10_000);
        for length in 0..bytes.len() {
            if let Ok(found) = read_state_space(&bytes[..length]) {
                // Only at the border between two variables.
                assert!(length > 128 && found.system.states.len() < 3, "{} cut at {length}", path.display());
            }
        }
        for at in 0..bytes.len() {
            for flip in [1 << random(8), 0xff, 1 + random(255) as u8] {
                let mut damaged = bytes.clone();
                damaged[at] ^= flip;
                let _ = read_state_space(&damaged);
            }
        }
        for _ in 0..2000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random(6) {
                let at = 128.min(bytes.len() - 1) + random(bytes.len().saturating_sub(128).max(1));
                damaged[at] = [0, 1, 2, 5, 14, 15, 0xff, random(256) as u8][random(8)];
            }
            let _ = read_state_space(&damaged);
        }
    }
}

/// A copy that was stopped is never taken for the whole.
#[test]
fn json_cut_at_every_byte_is_refused() {
    let text = "\u{feff}{\"A\": [[0, 1], [\"-1/3\", -2.5e-1]], \"B\": [[0], [1]], \"C\": [[1, 0]],\n \"states\": [\"φ\", \"w\"]}";
    assert_eq!(json(text).states.len(), 2);
    for length in 0..text.len() {
        // In the middle of a letter it is no text.
        let cut = &text.as_bytes()[..length];
        match std::str::from_utf8(cut) {
            Ok(_) => drop(bad(cut)),
            Err(_) => assert!(read_state_space(cut).is_err_and(|diagnostics| !diagnostics.is_empty())),
        }
    }
}

proptest! {
    #[test]
    fn random_bytes_do_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_state_space(&bytes);
        let mut file = mat("plain.mat")[..128].to_vec();
        file.extend(bytes);
        let _ = read_state_space(&file);
    }

    /// Pieces of JSON in any order.
    #[test]
    fn scrambled_json_does_no_harm(
        pieces in prop::collection::vec(
            prop::sample::select(vec![
                "{", "}", "[", "]", ",", ":", "\"A\"", "\"B\"", "\"E\"", "\"states\"", "1", "-0.5e3", "\"1/3\"", "null",
                "\"\\\"]\"", "\"ü\\ud800\"", " ", "\n", "[[1,2],[3,4]]", "\"A\":1,", "{\"A\":",
            ]),
            0..30,
        )
    ) {
        let text = pieces.concat();
        if let Err(diagnostics) = read_state_space(text.as_bytes()) {
            for label in diagnostics.iter().flat_map(|diagnostic| &diagnostic.labels) {
                prop_assert!(text.get(label.place.span()).is_some());
            }
        }
    }

    /// What is written is read, whatever the numbers and the spaces are.
    #[test]
    fn numbers_come_back(
        values in prop::collection::vec((any::<i64>(), 0i32..40), 1..5usize).prop_flat_map(|row| {
            let n = row.len();
            prop::collection::vec(prop::collection::vec((any::<i64>(), -40i32..40), n), n)
        }),
        space in prop::sample::select(vec!["", " ", "\n\t", "\r\n"]),
    ) {
        let rows: Vec<String> = values.iter().map(|row| {
            let cells: Vec<String> = row.iter().map(|(x, e)| format!("{space}{x}e{e}{space}")).collect();
            format!("{space}[{}]", cells.join(","))
        }).collect();
        let text = format!("{{{space}\"A\"{space}:{space}[{}{space}]}}{space}", rows.join(&format!("{space},")));
        let system = json(&text);
        for (i, row) in values.iter().enumerate() {
            for (j, (x, e)) in row.iter().enumerate() {
                let power = Rational::from(10).pow(*e as isize);
                prop_assert_eq!(&system.a[(i, j)], &(Rational::from(*x) * power));
            }
        }
    }
}
