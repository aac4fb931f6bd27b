//! One measurement as tools write it: the same answer, or a word about what is lost.

use kardan::diagnostics::plain;
use kardan::results::{Identification, Verdict};
use kardan::study::{IdentifySettings, LogFile, Silent, identify};
use kardan::tables::read::in_memory;
use kardan::tables::write::{Values, mat_matrices};

const SOURCE: &str = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
const ROWS: u32 = 4000;

/// Speeds from −4 to 3 rad/s in steps of half a second, and torques of the damping 2 N m s/rad with a ripple.
fn row(k: u32) -> [f64; 3] {
    let speed = f64::from(k / 500) - 4.0;
    [0.001 * f64::from(k), speed, 2.0 * speed + 1e-3 * f64::from(k * 7919 % 101)]
}

/// A text with a line for each row; each value times a factor, as `cell` writes it.
fn table(header: &str, factors: [f64; 3], separator: &str, cell: impl Fn(String) -> String) -> String {
    let line = |k| {
        let cells = row(k).into_iter().zip(factors).map(|(value, factor)| cell((value * factor).to_string()));
        cells.collect::<Vec<_>>().join(separator) + "\n"
    };
    header.to_owned() + "\n" + &(0..ROWS).map(line).collect::<String>()
}

fn identified(source: &str, bytes: impl Into<Vec<u8>>) -> Result<Identification, String> {
    let file = LogFile { name: "log".into(), bytes: in_memory(bytes.into()) };
    let settings = IdentifySettings { parameters: vec!["a.damping".into()], ..IdentifySettings::default() };
    identify(source, vec![file], &settings, &Silent).map_err(|diagnostics| plain(source, &diagnostics))
}

fn damping(source: &str, log: String) -> f64 {
    let found = identified(source, log).unwrap();
    assert!(found.verdict().sound, "{}", found.verdict().text);
    found.parameters[0].value.unwrap()
}

#[test]
fn signs_commas_and_units_change_nothing() {
    let plain_cell = |cell: String| cell;
    let expected = damping(SOURCE, table("t,a.w,m.tau", [1.0; 3], ",", plain_cell));
    assert!((expected - 2.0).abs() < 0.1, "{expected}");
    let same = |name: &str, log: String, tolerance: f64| {
        let value = damping(SOURCE, log);
        assert!((value - expected).abs() <= tolerance, "{name}: {value} and not {expected}");
    };
    same("minus", table("t,a.w,m.tau", [1.0; 3], ",", |cell| cell.replace('-', "\u{2212}")), 0.0);
    same("quotes", table("t,a.w,m.tau", [1.0; 3], ",", |cell| format!("\"{}\"", cell.replace('.', ","))), 0.0);
    let turns = 30.0 / std::f64::consts::PI;
    for (header, factors) in [
        ("t/s,a.w/(rad/s),m.tau/Nm", [1.0; 3]),
        ("t/ms,a.w/(1/min),m.tau/Ncm", [1e3, turns, 1e2]),
        ("t/ms,a.w/(U/min),m.tau/mNm", [1e3, turns, 1e3]),
        ("t/s,a.w [U/min],m.tau [Ncm]", [1.0, turns, 1e2]),
        ("t/s,a.w (1/min),m.tau/mNm", [1.0, turns, 1e3]),
        ("t [msec],a.w [min-1],m.tau [Nmm]", [1e3, turns, 1e3]),
        ("t [s],a.w [r/min],m.tau [kNm]", [1.0, turns, 1e-3]),
        ("t [sec],a.w [min^-1],m.tau [N-m]", [1.0, turns, 1.0]),
        ("t [s],a.w [\u{b0}/s],m.tau [N\u{b7}m]", [1.0, 6.0 * turns, 1.0]),
        ("t [s],a.w [U/s],m.tau [Nm]", [1.0, turns / 60.0, 1.0]),
    ] {
        // Speeds that are rounded in other digits are no longer constant to the last one, which weighs the rows a little otherwise.
        same(header, table(header, factors, ",", plain_cell), 1e-4);
    }
    // Of these two may be meant.
    for unit in ["1/s", "Hz"] {
        let why =
            identified(SOURCE, table(&format!("t [s],a.w [{unit}],m.tau"), [1.0; 3], ",", plain_cell)).unwrap_err();
        assert!(why.contains("`rev/s` or `rad/s`"), "{why}");
    }
}

/// A channel may be slower than others; where a hundredth of its numbers is missing otherwise, the log is not whole.
#[test]
fn missing_numbers_count_as_damage_from_one_percent_on() {
    let lines: Vec<String> =
        table("t,a.w,m.tau", [1.0; 3], ",", |cell| cell).lines().map(|line| format!("{line}\n")).collect();
    let with_gaps = |gone: &dyn Fn(usize) -> bool, word: &str| {
        let line = |(k, line): (usize, &String)| match k > 0 && gone(k) {
            true => format!("{},{word}\n", line.trim_end().rsplit_once(',').unwrap().0),
            false => line.clone(),
        };
        let Verdict { sound, text } =
            identified(SOURCE, lines.iter().enumerate().map(line).collect::<String>()).unwrap().verdict();
        (sound, text)
    };
    assert!(with_gaps(&|k| k % 134 == 0, "").0, "29 of 4000");
    assert!(with_gaps(&|k| k % 3 != 0, "").0, "a channel that is slower");
    for (gone, word, count) in [
        (&(|k: usize| k.is_multiple_of(90)) as &dyn Fn(usize) -> bool, "", 44),
        (&|k| k.is_multiple_of(90), "inf", 44),
        (&|k| k.is_multiple_of(90), "n/a", 44),
        (&|k| k > 1500, "", 2500),
    ] {
        let (sound, text) = with_gaps(gone, word);
        assert!(
            !sound && text.contains("damaged") && text.contains(&format!("{count} of 4000 rows")),
            "{word}: {text}"
        );
    }
}

#[test]
fn channels_that_are_not_equally_long_are_named() {
    let column = |k: usize, rows: usize| (0..rows as u32).map(|j| row(j)[k]).collect::<Vec<f64>>();
    let columns = [("t", column(0, 4000)), ("a_w", column(1, 4000)), ("m_tau", column(2, 3999))];
    let all = columns.map(|(name, values)| Values { name, rows: values.len(), columns: 1, values: values.into() });
    let why = identified(SOURCE, mat_matrices(&all, &[]).unwrap()).unwrap_err();
    assert!(["`t` has 4000 rows", "3999 rows have `m_tau`"].iter().all(|fragment| why.contains(fragment)), "{why}");
}
