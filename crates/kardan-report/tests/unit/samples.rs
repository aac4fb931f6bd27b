//! Tests of `src/samples.rs`.

use super::*;
use kardan::results::SweptParameter;

fn row(sample: u64, value: f64, measured: f64) -> SweepRow {
    let passed = f64::from(u8::from(measured < 1.0));
    let reason = if measured.is_nan() { "refused".into() } else { String::new() };
    SweepRow {
        sample,
        variant: 0,
        reason,
        values: vec![value],
        measured: vec![measured],
        passed: vec![passed],
        figures: vec![],
        difference: None,
    }
}

fn head() -> SweepHead {
    let varied = vec![SweptParameter { name: "</script>".into(), unit: "m^2".into(), distribution: String::new() }];
    let requirement = SweepRequirement {
        text: "x < 50 cm".into(),
        measured: "x".into(),
        unit: "m".into(),
        display: Some(DisplayUnit { unit: "cm".into(), size: 0.01 }),
        below: Some(0.5),
        above: None,
    };
    SweepHead { varied, requirements: vec![requirement], variants: vec!["model".into()], ..Default::default() }
}

fn decoded(text: &str) -> Vec<u8> {
    const DIGITS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = Vec::new();
    for four in text.as_bytes().chunks(4) {
        let digit = |k: usize| DIGITS.find(char::from(four[k])).unwrap_or(0);
        let word = digit(0) << 18 | digit(1) << 12 | digit(2) << 6 | digit(3);
        out.extend([word >> 16, word >> 8, word].map(|x| x as u8));
    }
    out.truncate(out.len() - text.bytes().filter(|&c| c == b'=').count());
    out
}

/// The value after each `"key":"`.
fn strings<'t>(json: &'t str, key: &str) -> Vec<&'t str> {
    json.split(&format!("\"{key}\":\"")).skip(1).map(|tail| tail.split('"').next().unwrap()).collect()
}

#[test]
fn base64_gives_the_examples_of_the_rfc() {
    for (plain, encoded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(plain.as_bytes()), encoded);
    }
}

/// The data decode to the rows, those without a number too; no name closes the script.
#[test]
fn data_are_the_rows() {
    let rows = vec![row(2, 1e9 + 0.25, 0.5), row(0, 1e9, 2.0), row(1, 1e9 + 1.0, f64::NAN)];
    let data = Samples::new(&head(), &Sweep::default(), &rows.into_iter().collect())
        .data(&Sweep::default(), &Again::default());
    assert!(!data.contains("</script"), "{data}");
    let columns = strings(&data, "data");
    let numbers = |text: &str| -> Vec<f32> {
        decoded(text).chunks(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect()
    };
    assert!(data.contains("\"from\":1000000000.0,"), "{data}");
    assert_eq!(numbers(columns[0]), [0.0, 1.0, 0.25]);
    let measured = numbers(columns[1]);
    assert!(measured[0] == 150.0 && measured[1].is_nan() && measured[2] == 0.0, "{measured:?}");
    // A sweep that is a search has no results of its requirements, but bounds and units are known.
    assert!(data.contains("\"column\":1,\"below\":50.0,\"above\":null") && data.contains("\"unit\":\"cm\""), "{data}");
    assert!(data.contains("\"unit\":\"m²\"") && data.contains("\"name\":\"x\""), "{data}");
    assert_eq!(decoded(strings(&data, "passed")[0]), [0, 0, 1]);
    assert_eq!(decoded(strings(&data, "ended")[0]), [1, 0, 1]);
    assert_eq!(decoded(strings(&data, "sample")[0]), [0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
}

/// Too many rows: those that the tables name stay, then equally many failing and passing runs, if there are enough, at random, independent of the order of the rows.
#[test]
fn too_many_runs_are_thinned_openly() {
    let of = |seed: u64, order: &dyn Fn(u64) -> u64, failing: u64| {
        let rows = (0..1000).map(order).map(|k| row(k, 0.0, if k % 1000 < failing { 2.0 } else { k as f64 * 1e-4 }));
        Samples::at_most(100, &SweepHead { seed, ..head() }, &[7].into(), &rows.collect())
    };
    let numbers = |samples: &Samples| samples.drawn_rows.iter().map(|row| row.sample).collect::<Vec<_>>();
    let (one, other) = (of(3, &|k| k, 5), of(3, &|k| 999 - k, 5));
    assert_eq!(numbers(&one), numbers(&other));
    assert!(numbers(&one).starts_with(&[0, 1, 2, 3, 4]) && numbers(&one).contains(&7));
    assert_ne!(numbers(&one), numbers(&of(4, &|k| k, 5)));
    let text = one.describe();
    assert!(text.starts_with("100 of 1000 runs are drawn: all 5 that fail, and 95 of 995 others, at random"), "{text}");
    // Sample 7, which the tables name, fails, and is one of 50.
    let text = of(3, &|k| k, 600).describe();
    assert!(text.starts_with("100 of 1000 runs are drawn: 51 of 600 that fail, at random, and 49 of 400"), "{text}");
    let text = of(3, &|k| k, 990).describe();
    assert!(text.starts_with("100 of 1000 runs are drawn: 90 of 990 that fail, at random, and 10 of 10"), "{text}");
}

#[test]
fn commands_name_file_sample_and_variant() {
    let mut again =
        Again { command: "run".into(), block: 10, files: vec![String::new(), "b".into()], ..Again::default() };
    assert_eq!((again.of(9, 0), again.of(20, 0)), (None, None));
    assert_eq!(again.of(12, 0).as_deref(), Some("run b --sample 12"));
    again.variants = vec!["one".into(), "'the other'".into()];
    assert_eq!(again.of(12, 1).as_deref(), Some("run b --sample 12 --variant 'the other'"));
}
