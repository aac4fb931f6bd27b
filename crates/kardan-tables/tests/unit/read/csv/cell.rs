//! Tests of `src/read/csv/cell.rs`.

use super::*;

#[test]
fn stamps_are_nanoseconds() {
    let ns = |text: &str| match read(text.as_bytes(), b'.') {
        Cell::Stamp(ns) => ns,
        other => panic!("{text}: {other:?}"),
    };
    assert_eq!(ns("1970-01-01T00:00:00Z"), 0);
    assert_eq!(ns("2020-03-16 17:04:51.25"), 1_584_378_291_250_000_000);
    assert_eq!(ns("16.03.2020 17:04:51,25"), ns("2020-03-16T18:04:51.25+01:00"));
    assert_eq!(ns("00:01:00.5"), 60_500_000_000);
    for text in ["2020-13-01", "25:61", "12:", "2020-03", "a:b", "1-2-3", "-:-", "+", "12:00:00.x"] {
        assert_eq!(read(text.as_bytes(), b'.'), Cell::Text, "{text}");
    }
}

#[test]
fn cells_are_split_at_delimiters_outside_quotes() {
    let mut cells = Vec::new();
    for (line, delimiter, expected) in [
        (r#" 1 ,"a,b", "say ""x""",,"#, b',', vec!["1", r#""a,b""#, r#""say ""x""""#, "", ""]),
        ("  1  2\t3 ", b' ', vec!["1", "2", "3"]),
        (r#""a b" c "#, b' ', vec![r#""a b""#, "c"]),
        (r#""open"#, b',', vec![r#""open"#]),
        ("", b',', vec![""]),
    ] {
        split(line.as_bytes(), delimiter, &mut cells);
        assert_eq!(cells, expected.iter().map(|cell| cell.as_bytes()).collect::<Vec<_>>(), "{line}");
    }
}
