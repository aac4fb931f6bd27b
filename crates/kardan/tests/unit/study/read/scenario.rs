//! Tests of `src/study/read/scenario.rs`.

use super::*;

fn exact(numerator: i64, denominator: i64) -> Exact {
    Exact::from_ratio(numerator, denominator)
}

/// The rows of a run, and their bound computed before.
fn both(duration: &Exact, step: &Exact, events: &[Exact]) -> (usize, f64) {
    let mut sorted: Vec<f64> = events.iter().map(Exact::to_f64).collect();
    sorted.sort_by(f64::total_cmp);
    let times = output_times(duration, step, events);
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "not in order");
    assert!(events.iter().all(|event| times.contains(&event.to_f64())), "an event has no row");
    (times.len(), most_rows(duration.to_f64(), step.to_f64(), &sorted))
}

#[test]
fn windows_that_overlap_are_counted_once() {
    let (duration, step) = (exact(1, 1), exact(1, 100));
    // 101 multiples of the step.
    assert_eq!(both(&duration, &step, &[]), (101, 102.0));
    // One window of 0.2 s: 400 twentieths after the event, of which 21 with the event are multiples of the step.
    let (rows, bound) = both(&duration, &step, &[exact(3, 10)]);
    assert_eq!(rows, 101 + 401 - 21);
    assert!((bound - (102.0 + 402.0)).abs() < 1e-9, "{bound}");
    // The second window begins in the first, in addition to its rows: 0.3 s together, and a row of its own for the event.
    let (rows, bound) = both(&duration, &step, &[exact(4003, 10000), exact(3, 10)]);
    assert_eq!(rows, 101 + 601 - 31 + 1);
    assert!((bound - (102.0 + 602.0 + 1.0 + 0.6)).abs() < 1e-9, "{bound}");
    // The last window ends with the run.
    assert_eq!(both(&duration, &step, &[exact(19, 20)]).0, 101 + 101 - 6);
    // Eight thousand ends of ramps in a second fill it with twentieths once.
    let events: Vec<Exact> = (0..8000).map(|k| exact(k, 8000)).collect();
    let (rows, bound) = both(&duration, &step, &events);
    // 2001 twentieths of half a millisecond; every fourth event falls on one, and so does every multiple of the step.
    assert_eq!(rows, 2001 + 8000 - 2000);
    assert!(bound >= rows as f64 && bound < rows as f64 + 2000.0 + 102.0 + 10.0, "{bound} for {rows}");
}

/// Rows are those fractions, rounded to nearest.
#[test]
fn rows_are_rounded_once() {
    let (step, event) = (exact(1, 300), exact(1234, 10_000));
    let times = output_times(&exact(1, 1), &step, std::slice::from_ref(&event));
    for k in 0..=300_i64 {
        assert!(times.contains(&exact(k, 300).to_f64()), "{k}");
    }
    for k in 0..=400_i64 {
        // 0.1234 + k/6000, except where a multiple of the step is closer than rounding.
        let fine = exact(1234 * 3 + 5 * k, 30_000).to_f64();
        assert!(times.contains(&fine), "{k}");
    }
}

#[test]
fn the_hint_for_too_many_rows_will_do() {
    let source = |step: &str| {
        let mut text = format!(
            "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1000 s\"\n\
                 output_step = \"{step}\"\n"
        );
        for k in 0..8000 {
            text += &format!(
                "[[scenario.event]]\nat = \"{} s\"\nover = \"0.05 s\"\nsignal = \"m.tau\"\nto = \"{} N m\"\n",
                0.125 * f64::from(k),
                k % 3
            );
        }
        text
    };
    let rows = |step: &str| {
        let (prepared, found) = crate::study::prepare(&source(step));
        let diagnostic = found.into_iter().find(|d| d.code == "scenario::rows");
        (prepared.variants.first().map(|variant| variant.scenario.times.len()), diagnostic)
    };
    // Windows of 2 ms after 16 000 ends of ramps: 400 rows each, and none overlap.
    let (_, diagnostic) = rows("0.1 ms");
    let help = diagnostic.unwrap().help.unwrap();
    let step = help.strip_prefix("choose an output_step of at least ").unwrap();
    let (found, diagnostic) = rows(step);
    assert_eq!(diagnostic, None, "{help} does not help");
    assert!(found.unwrap() as f64 <= MOST_ROWS);
    // Windows that overlap everywhere: twentieths of 10 ms, each of which is a multiple of the millisecond grid of the events.
    let (found, diagnostic) = rows("10 ms");
    assert_eq!((found, diagnostic), (Some(2_000_001), None));
}
