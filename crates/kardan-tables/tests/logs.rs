//! Logs of other tools are read value by value, our own come back bit for bit, and no damage does harm.
//!
//! The files of `data` and the tools that wrote them are described in its README.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use kardan_tables::read::{Block, CsvOptions, Group, LogError, in_memory, open};
use kardan_tables::{Column, Table, write};

fn stored(name: &str) -> Vec<u8> {
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).expect(name)
}

/// Everything that a log gives.
#[derive(Debug)]
struct Whole {
    groups: Vec<Group>,
    columns: Vec<Vec<Vec<f64>>>,
    notes: Vec<String>,
    constants: Vec<(String, f64)>,
    error: Option<LogError>,
}

impl Whole {
    fn column(&self, group: usize, name: &str) -> &[f64] {
        let index = self.groups[group].channel(name).unwrap_or_else(|| panic!("no {name} in {:?}", self.groups));
        &self.columns[group][index]
    }

    fn unit(&self, group: usize, name: &str) -> &str {
        &self.groups[group].channels[self.groups[group].channel(name).expect(name)].unit
    }

    fn rows(&self) -> usize {
        self.columns.iter().map(|group| group[0].len()).sum()
    }

    /// All that is told: the error and the notes.
    fn reported(&self) -> String {
        format!("{} {}", self.error.as_ref().map_or(String::new(), LogError::to_string), self.notes.join(" "))
    }
}

fn read_with(bytes: impl Into<Arc<[u8]>>, options: &CsvOptions) -> Result<Whole, LogError> {
    let mut log = open(in_memory(bytes), options)?;
    let groups = log.groups().to_vec();
    let all: Vec<(usize, usize)> =
        groups.iter().enumerate().flat_map(|(g, group)| (0..group.channels.len()).map(move |c| (g, c))).collect();
    log.choose(&all)?;
    let mut columns: Vec<Vec<Vec<f64>>> = groups.iter().map(|group| vec![Vec::new(); group.channels.len()]).collect();
    let mut block = Block::default();
    let mut error = None;
    loop {
        match log.next(&mut block) {
            Ok(true) => {
                assert!(block.rows > 0 && block.rows <= 65536);
                for (all, column) in columns[block.group].iter_mut().zip(&block.columns) {
                    assert_eq!(column.len(), block.rows);
                    all.extend(column);
                }
            }
            Ok(false) => break,
            Err(one) => {
                error.get_or_insert(one);
            }
        }
        assert!(columns.iter().map(|group| group[0].len()).sum::<usize>() < 50_000_000, "rows without end");
    }
    Ok(Whole { groups, columns, notes: log.notes(), constants: log.constants().to_vec(), error })
}

fn read(bytes: impl Into<Arc<[u8]>>) -> Whole {
    let whole = read_with(bytes, &CsvOptions::default()).unwrap();
    assert_eq!(whole.error, None);
    whole
}

fn text(text: &str) -> Whole {
    read(text.as_bytes())
}

/// Compares a column with a formula of the row, bit for bit; NaN where the formula is NaN.
fn equal(column: &[f64], rows: usize, formula: impl Fn(f64) -> f64) {
    assert_eq!(column.len(), rows);
    for (k, value) in column.iter().enumerate() {
        let expected = formula(k as f64);
        assert!(
            value.to_bits() == expected.to_bits() || (value.is_nan() && expected.is_nan()) || *value == expected,
            "row {k}: {value} is not {expected}"
        );
    }
}

/// As [`equal`], but for the last digits of a sine that another library computed.
fn close(column: &[f64], rows: usize, formula: impl Fn(f64) -> f64) {
    assert_eq!(column.len(), rows);
    for (k, value) in column.iter().enumerate() {
        let expected = formula(k as f64);
        assert!(
            (value - expected).abs() <= 4e-16 || (value.is_nan() && expected.is_nan()),
            "row {k}: {value} is not {expected}"
        );
    }
}

fn sine(k: f64) -> f64 {
    (k / 10.0).sin()
}

fn hundredths(k: f64) -> f64 {
    k * 0.01
}

// ---------------------------------------------------------------------------------------------------------------- MDF

fn check_mdf_signals(log: &Whole) {
    assert_eq!((log.groups[0].name.as_str(), log.groups[0].time, log.groups[0].rows), ("fast", Some(0), Some(100)));
    equal(log.column(0, "time"), 100, hundredths);
    close(log.column(0, "sine"), 100, sine);
    equal(log.column(0, "ramp"), 100, |k| k - 50.0);
    equal(log.column(0, "scaled"), 100, |k| 0.5 * k - 10.0);
    equal(log.column(0, "single"), 100, |k| 0.25 * k);
    let units = ["time", "sine", "ramp", "scaled", "single"].map(|name| log.unit(0, name).to_owned());
    assert_eq!(units, ["s", "rad", "N m", "A", "V"]);
}

#[test]
fn mdf_of_asammdf_with_two_rasters() {
    let log = read(stored("rasters.mf4"));
    check_mdf_signals(&log);
    assert_eq!((log.groups.len(), log.groups[1].name.as_str(), log.unit(1, "slow")), (2, "slow", "degC"));
    equal(log.column(1, "time"), 10, |k| k * 0.1);
    equal(log.column(1, "slow"), 10, |k| 2.0 * k);
}

#[test]
fn mdf_of_asammdf_deflated_and_transposed() {
    check_mdf_signals(&read(stored("deflated.mf4")));
    check_mdf_signals(&read(stored("transposed.mf4")));
}

#[test]
fn mdf_of_asammdf_with_holes_byte_orders_tables_and_repeated_names() {
    let log = read(stored("odd.mf4"));
    close(log.column(0, "holes"), 100, |k| if k % 5.0 == 0.0 { f64::NAN } else { sine(k) });
    equal(log.column(0, "big"), 100, |k| k - 50.0);
    equal(log.column(0, "big_float"), 100, |k| 0.5 * k);
    equal(
        log.column(0, "table"),
        100,
        |k| {
            if k < 50.0 { 100.0 * (k / 50.0) } else { 100.0 - 100.0 * ((k - 50.0) / 50.0) }
        },
    );
    equal(log.column(0, "rational"), 100, |k| k / (0.5 * k + 1.0));
    equal(log.column(0, "sine"), 100, |k| k);
    equal(log.column(0, "sine (2)"), 100, |k| -k);
}

/// Unsorted: two groups in one stream of records with numbers, little and big endian values, bits inside bytes.
/// asammdf reads `unsorted.mf4` the same (see `make.py`).
#[test]
fn mdf_with_unsorted_records() {
    for (name, cut) in [("unsorted.mf4", false), ("unfinished.mf4", true)] {
        let log = read(stored(name));
        assert_eq!(log.groups.len(), 2);
        assert_eq!(log.groups[0].rows, (!cut).then_some(60));
        equal(log.column(0, "t"), 60, |k| k * 0.5);
        equal(log.column(0, "word"), 60, |k| 1000.0 - k);
        equal(log.column(0, "bits"), 60, |k| k % 8.0);
        equal(log.column(1, "t"), 20, |k| k * 1.5);
        equal(log.column(1, "single"), 20, |k| -k);
        assert_eq!(log.reported().contains("not finished"), cut, "{}", log.reported());
        assert_eq!(log.reported().contains("middle of a record"), cut, "{}", log.reported());
    }
}

// ---------------------------------------------------------------------------------------------------------------- MAT

#[test]
fn mat_of_scipy_with_a_matrix_and_constants() {
    let log = read(stored("matrix.mat"));
    equal(log.column(0, "data(:,1)"), 100, hundredths);
    close(log.column(0, "data(:,2)"), 100, sine);
    equal(log.column(0, "data(:,3)"), 100, |k| k);
    assert_eq!(log.constants, [("J".to_owned(), 1.2e-4)]);
    let log = read(stored("rows.mat"));
    equal(log.column(0, "log(1,:)"), 100, hundredths);
    close(log.column(0, "log(2,:)"), 100, sine);
}

#[test]
fn mat_of_scipy_with_vectors_compressed_and_not() {
    let log = read(stored("vectors.mat"));
    assert_eq!((log.groups.len(), log.groups[0].time, log.groups[1].rows), (2, Some(0), Some(10)));
    equal(log.column(0, "single"), 100, |k| 0.25 * k);
    equal(log.column(1, "slow"), 10, |k| k);
    for log in [log, read(stored("columns.mat"))] {
        equal(log.column(0, "time"), 100, hundredths);
        close(log.column(0, "sine"), 100, sine);
        equal(log.column(0, "ramp"), 100, |k| k - 50.0);
    }
}

#[test]
fn mat_with_structures_as_of_simulink_and_control_desk() {
    let log = read(stored("simulink.mat"));
    assert_eq!((log.groups[0].name.as_str(), log.groups[0].time), ("logsout", Some(0)));
    equal(log.column(0, "logsout.time"), 100, hundredths);
    close(log.column(0, "speed(:,1)"), 100, sine);
    equal(log.column(0, "speed(:,2)"), 100, |k| 2.0 * k);
    let log = read(stored("control_desk.mat"));
    assert_eq!((log.groups[0].name.as_str(), log.groups[0].time), ("capture 1ms", Some(0)));
    equal(log.column(0, "time"), 100, hundredths);
    close(log.column(0, "Model/Speed"), 100, sine);
    equal(log.column(0, "Model/Torque"), 100, |k| k - 50.0);
    assert_eq!(log.unit(0, "Model/Torque"), "N m");
}

// ------------------------------------------------------------------------------------------------------------ Parquet

#[test]
fn parquet_of_pyarrow_in_all_compressions() {
    for name in ["snappy.parquet", "plain.parquet", "gzip.parquet", "zstd.parquet"] {
        let log = read(stored(name));
        assert_eq!((log.groups[0].time, log.groups[0].rows), (Some(0), Some(100)), "{name}");
        equal(log.column(0, "time"), 100, hundredths);
        close(log.column(0, "sine"), 100, sine);
        equal(log.column(0, "ramp"), 100, |k| k - 50.0);
        equal(log.column(0, "single"), 100, |k| 0.25 * k);
        equal(log.column(0, "flag"), 100, |k| 1.0 - k % 2.0);
        assert!(log.reported().contains("`word` contains no plain numbers"), "{}", log.reported());
    }
    let log = read(stored("delta.parquet"));
    equal(log.column(0, "time"), 100, hundredths);
    equal(log.column(0, "ramp"), 100, |k| k - 50.0);
}

#[test]
fn parquet_of_pyarrow_with_stamps_holes_units_and_row_groups() {
    let log = read(stored("nulls.parquet"));
    for stamp in ["stamp", "us", "ns"] {
        equal(log.column(0, stamp), 100, |k| k * 10.0 / 1000.0);
        assert_eq!(log.unit(0, stamp), "s");
    }
    close(log.column(0, "holes"), 100, |k| if k % 5.0 == 0.0 { f64::NAN } else { sine(k) });
    assert_eq!(log.unit(0, "holes"), "rad");
    equal(log.column(0, "u64"), 100, |k| 9_223_372_036_854_775_808.0 + 2048.0 * k);
    equal(log.column(0, "none"), 100, |_| f64::NAN);
}

#[test]
fn parquet_of_pyarrow_with_durations_and_old_stamps() {
    let log = read(stored("duration.parquet"));
    assert_eq!(log.groups[0].time, Some(0));
    for name in ["run", "us", "ns"] {
        equal(log.column(0, name), 100, |k| k * 10.0 / 1000.0);
        assert_eq!(log.unit(0, name), "s");
    }
    equal(log.column(0, "s"), 100, |k| k);
    equal(log.column(0, "ramp"), 100, |k| k - 50.0);
    assert_eq!(log.unit(0, "ramp"), "");
    let log = read(stored("int96.parquet"));
    assert_eq!((log.groups[0].time, log.unit(0, "old")), (Some(0), "s"));
    equal(log.column(0, "old"), 100, |k| k * 10.0 / 1000.0);
}

// ---------------------------------------------------------------------------------------------------------------- CSV

#[test]
fn csv_with_signs_of_a_typesetter() {
    for minus in ['-', '\u{2212}', '\u{2013}', '\u{2010}', '\u{2011}', '\u{2012}', '\u{2014}', '\u{fe63}', '\u{ff0d}'] {
        let log = text(&format!("t,x\n0,{minus}1.5\n1,\"{minus}3\"\n2,2e{minus}2\n3,{minus}\n4,{minus}inf\n"));
        let expected = [-1.5, -3.0, 0.02, f64::NAN, f64::NEG_INFINITY];
        equal(log.column(0, "x"), 5, |k| expected[k as usize]);
        assert_eq!(log.notes, [""; 0], "{minus}");
    }
    // The en dash of Windows-1252.
    equal(read(&b"t;x\n0;\x961,5\n1;\x962,5\n"[..]).column(0, "x"), 2, |k| -1.5 - k);
}

#[test]
fn csv_with_decimal_commas_in_quotes() {
    let quoted = "t,x,n\n\"0\",\"1,25\",3\n\"0,001\",\"-2,5\",3\n\"0,002\",\"7\",\n";
    let reported = CsvOptions { decimal_comma: Some(true), ..CsvOptions::default() };
    for options in [CsvOptions::default(), reported, CsvOptions { delimiter: Some(b','), ..reported }] {
        let log = read_with(quoted.as_bytes(), &options).unwrap();
        equal(log.column(0, "t"), 3, |k| k / 1000.0);
        equal(log.column(0, "x"), 3, |k| [1.25, -2.5, 7.0][k as usize]);
        equal(log.column(0, "n"), 3, |k| [3.0, 3.0, f64::NAN][k as usize]);
        assert_eq!(log.reported().contains("decimal comma"), options.decimal_comma.is_none(), "{}", log.reported());
    }
    // Commas without quotes stand between cells, and points in quotes stay points.
    equal(text("t,x\n\"0\",\"1.5\"\n\"1\",\"2.5\"\n").column(0, "x"), 2, |k| k + 1.5);
    equal(text("\"a,b\",x\n0,1\n1,2\n").column(0, "x"), 2, |k| k + 1.0);
    equal(read_with("0,5\n0,6\n".as_bytes(), &reported).unwrap().column(0, "column 1"), 2, |k| (5.0 + k) / 10.0);
}

#[test]
fn csv_with_quotients_of_quantity_and_unit() {
    let log = text("t/s,n/(1/min),M/Nm,phi/\u{b0},eta/1,v/(m/s)\n0,1,2,3,4,5\n1,1,2,3,4,5\n");
    let units: Vec<(&str, &str)> =
        log.groups[0].channels.iter().map(|channel| (channel.name.as_str(), channel.unit.as_str())).collect();
    let expected = [("t", "s"), ("n", "1/min"), ("M", "Nm"), ("phi", "\u{b0}"), ("eta", "1"), ("v", "m/s")];
    assert_eq!((units, log.groups[0].time), (expected.to_vec(), Some(0)));
    // One column of words, and units in other forms beside.
    let log = text(&format!("t/ms;a.w/(rad/s);state;m.tau [N m/s]\n{}", "0,5;1;on;2\n".repeat(9)));
    assert_eq!((log.unit(0, "t"), log.unit(0, "a.w"), log.unit(0, "m.tau")), ("ms", "rad/s", "N m/s"));
    // A `/` that belongs to names.
    for header in ["time,Model/V,Model/A", "time,ctrl/speed,ctrl/s", "t,a/b,c/d", "a,b/c,d/s (x"] {
        let log = text(&format!("{header}\n0,1,2\n1,1,2\n"));
        let names: Vec<&str> = log.groups[0].channels.iter().map(|channel| channel.name.as_str()).collect();
        assert_eq!(names.join(","), header);
    }
}

#[test]
fn csv_as_tools_write_it() {
    // pandas
    let log = text(",time,x\n0,0.0,1.5\n1,0.1,\n2,0.2,-3e-2\n");
    equal(log.column(0, "time"), 3, |k| [0.0, 0.1, 0.2][k as usize]);
    equal(log.column(0, "x"), 3, |k| [1.5, f64::NAN, -0.03][k as usize]);
    assert_eq!(log.groups[0].time, Some(1));
    // numpy.savetxt with a header
    let log = text(
        "# time speed\n0.000000000000000000e+00 1.000000000000000000e+00\n5.000000000000000000e-01 2.000000000000000000e+00\n",
    );
    equal(log.column(0, "speed"), 2, |k| k + 1.0);
    // Excel in German
    let log = text("\u{feff}Zeit;Drehzahl\r\ns;1/min\r\n0,0;1,5\r\n0,1;2,5\r\n");
    equal(log.column(0, "Drehzahl"), 2, |k| k + 1.5);
    assert_eq!((log.groups[0].time, log.unit(0, "Drehzahl")), (Some(0), "1/min"));
    // Latin-1 in the header, tabs
    let log = read(&b"t\tWinkel\n[s]\t[\xb0]\n0\t1\n1\t2\n"[..]);
    assert_eq!(log.unit(0, "Winkel"), "°");
    // Units behind the names; quotes
    let log = text("\"time [s]\",\"torque (N m)\",\"a, b\"\n\"0\",\"1.5\",2\n\"1\",\"2.5\",2\n");
    assert_eq!((log.unit(0, "time"), log.unit(0, "torque")), ("s", "N m"));
    equal(log.column(0, "torque"), 2, |k| k + 1.5);
    equal(log.column(0, "a, b"), 2, |_| 2.0);
    // No header at all
    let log = text("0|1\n1|2\n2|3\n");
    equal(log.column(0, "column 2"), 3, |k| k + 1.0);
    // UTF-16, as a spreadsheet saves "Unicode text"
    for little in [true, false] {
        let units = "\u{feff}time\tφ\n0\t1\n1\t2\n".encode_utf16();
        let bytes: Vec<u8> =
            units.flat_map(|unit| if little { unit.to_le_bytes() } else { unit.to_be_bytes() }).collect();
        equal(read(bytes).column(0, "φ"), 2, |k| k + 1.0);
    }
}

#[test]
fn csv_of_recorders_with_several_header_rows() {
    // Names in two rows and the unit of the time in the second of them.
    let log = text(
        "Axis1\r\nNumber of sampling data,4\r\nTime,Analog 1,Analog 2\r\nms,Servo motor speed,Not selected\r\n0,1,0\r\n0.5,2,0\r\n1,3,0\r\n1.5,4,0\r\n",
    );
    assert_eq!((log.groups[0].time, log.unit(0, "Time")), (Some(0), "ms"));
    equal(log.column(0, "Analog 1"), 4, |k| k + 1.0);
    equal(log.column(0, "Servo motor speed"), 4, |k| k + 1.0);
    // Labels in front of each channel.
    let log = text(
        "Timestamp,2020-03-16 17:04:51,Timestamp,2020-03-16 17:04:51\nInterval,0.5,Interval,0.5\nChannel name,\"Force\",Channel name,\"Input 1\"\nUnit,\"V\",Unit,\"V\"\n0,1,0,5\n0.5,2,0.5,6\n",
    );
    let names: Vec<&str> = log.groups[0].channels.iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!((names, log.unit(0, "Force")), (vec!["time", "Force", "time (2)", "Input 1"], "V"));
    equal(log.column(0, "Input 1"), 2, |k| k + 5.0);
}

#[test]
fn csv_with_stamps_missing_values_and_odd_rows() {
    let log = text("when,x\n2020-03-16T17:04:59.5Z,1\n2020-03-16T17:05:00.5Z,n/a\n2020-03-16T17:05:01.75Z,-\n");
    equal(log.column(0, "when"), 3, |k| [0.0, 1.0, 2.25][k as usize]);
    assert_eq!((log.groups[0].time, log.unit(0, "when")), (Some(0), "s"));
    equal(log.column(0, "x"), 3, |k| if k == 0.0 { 1.0 } else { f64::NAN });

    let mut lines: Vec<String> = (0..50).map(|k| format!("{k},{}", 2 * k)).collect();
    lines[10] = "10".into();
    lines[20] = "20,x7".into();
    lines[30] = "a,b".into();
    lines[40] = "# pause".into();
    let log = text(&format!("t,x\n{}\n", lines.join("\n")));
    assert_eq!(log.rows(), 47);
    for expected in ["2 rows", "row 12", "`x`: `x7`", "row 22"] {
        assert!(log.reported().contains(expected), "{expected}: {}", log.reported());
    }
    let log = text("t,x\n0,1\n1,2\n2,");
    assert_eq!(log.rows(), 3);
    let log = text("t,x\n0,1\n1,2\n2");
    assert!(log.rows() == 2 && log.reported().contains("middle of row 4"), "{}", log.reported());
    let log = text("t,state,x\n0,run,1\n1,run,2\n2,stop,3\n3,stop,4\n");
    equal(log.column(0, "x"), 4, |k| k + 1.0);
    assert!(log.reported().contains("`state` contains text"), "{}", log.reported());
}

#[test]
fn csv_follows_the_specified_options() {
    let options = CsvOptions {
        delimiter: Some(b';'),
        decimal_comma: Some(false),
        names_row: Some(2),
        units_row: Some(1),
        first_row: Some(4),
    };
    let log = read_with("s;V\na;b\n0;0\n1;2\n3;4\n".as_bytes(), &options).unwrap();
    assert_eq!((log.column(0, "a"), log.unit(0, "b")), (&[1.0, 3.0][..], "V"));
}

#[test]
fn csv_of_many_rows_in_parallel_is_in_order() {
    let mut table = String::from("t,x,y\n");
    for k in 0..400_000 {
        table += &format!("{},{},{}\n", f64::from(k) * 1e-3, f64::from(k).sqrt(), -k);
    }
    let log = text(&table);
    equal(log.column(0, "t"), 400_000, |k| k * 1e-3);
    equal(log.column(0, "x"), 400_000, f64::sqrt);
    equal(log.column(0, "y"), 400_000, |k| -k);
    let mut log = open(in_memory(table.into_bytes()), &CsvOptions::default()).unwrap();
    log.choose(&[(0, 2), (0, 0), (0, 2)]).unwrap();
    let mut block = Block::default();
    assert!(log.next(&mut block).unwrap());
    assert_eq!(
        (block.columns.len(), block.columns[0][7], block.columns[1][7], block.columns[2][7]),
        (3, -7.0, 0.007, -7.0)
    );
}

// ------------------------------------------------------------------------------------------------------- round trips

/// Time, an angle with odd values and a torque.
struct Series {
    time: Vec<f64>,
    phi: Vec<f64>,
    tau: Vec<f64>,
}

impl Series {
    fn table(&self) -> Table<'_> {
        let column = |name, unit, values| Column { name, unit, description: "a < b", values };
        Table {
            time: &self.time,
            columns: vec![column("rk.phi", "rad", &self.phi), column("rk_phi", "N m", &self.tau)],
        }
    }
}

fn series(rows: usize, step: f64) -> Series {
    let time: Vec<f64> = (0..rows).map(|k| k as f64 * step).collect();
    let mut phi: Vec<f64> = time.iter().map(|t| t.sin()).collect();
    if rows > 4 {
        phi[1..5].copy_from_slice(&[f64::NAN, f64::INFINITY, 1e-300, -0.1]);
    }
    let tau = time.iter().map(|t| t * t).collect();
    Series { time, phi, tau }
}

fn same(a: &[f64], b: &[f64]) {
    assert!(a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn what_is_exported_comes_back_bit_for_bit() {
    let (fast, slow) = (series(200_000, 1e-3), series(7, 0.5));
    let log = read(write::mdf(&[("fast", &fast.table()), ("slow", &slow.table())]));
    for (group, (name, series)) in [("fast", &fast), ("slow", &slow)].into_iter().enumerate() {
        assert_eq!((log.groups[group].name.as_str(), log.groups[group].time), (name, Some(0)));
        same(log.column(group, "time"), &series.time);
        same(log.column(group, "rk.phi"), &series.phi);
        same(log.column(group, "rk_phi"), &series.tau);
        assert_eq!(
            (log.unit(group, "time"), log.unit(group, "rk.phi"), log.unit(group, "rk_phi")),
            ("s", "rad", "N m")
        );
    }
    let log = read(write::mat(&fast.table()).unwrap());
    assert_eq!(log.groups[0].time, Some(0));
    same(log.column(0, "time"), &fast.time);
    same(log.column(0, "rk_phi"), &fast.phi);
    same(log.column(0, "rk_phi_2"), &fast.tau);
}

#[test]
fn the_guard_of_names_like_formulas_is_removed() {
    let names = ["=1+1", "-x", "@sum", "+a", "'=b", "a,b", "'c'"];
    let column = |name| Column { name, unit: "", description: "", values: &[1.0, 2.0] };
    let bytes = write::csv(&Table { time: &[0.0, 1.0], columns: names.into_iter().map(column).collect() });
    let header = String::from_utf8(bytes.clone()).unwrap();
    assert!(header.starts_with("t,'=1+1,'-x,'@sum,'+a,''=b,\"a,b\",'c'\n"), "{header}");
    let log = read(bytes);
    let back: Vec<&str> = log.groups[0].channels[1..].iter().map(|channel| channel.name.as_str()).collect();
    assert_eq!(back, names);
}

// ------------------------------------------------------------------------------------------------------------- damage

/// A counter of cycles that a recorder never wrote, or wrote too early: what the block holds is read, and the group is named.
#[test]
fn mdf_counters_that_are_wrong_lose_no_rows() {
    let rasters = stored("rasters.mf4");
    // The number of rows stands behind six links and the number of the records.
    let counter = |bytes: &[u8], group: usize| nth(bytes, b"##CG", group) + 24 + 48 + 8;
    let of_rows = |rows: u8| (0..2).map(|group| counter(&rasters, group)).find(|at| rasters[*at] == rows).unwrap();
    let groups = [of_rows(100), of_rows(10)];
    for (rows, fast) in [(0u64, true), (60, true), (0, false)] {
        let (at, name, all) = if fast { (groups[0], "fast", 100) } else { (groups[1], "slow", 10) };
        let log = read(put(rasters.clone(), at, &rows.to_le_bytes()));
        check_rasters(&log);
        let note = format!("the group `{name}` has {all} records, and its cycle counter is {rows}: all are read");
        assert_eq!(log.notes, [note]);
    }
    // Too many are announced: the rows are given, then the group is named.
    let whole = read_with(put(rasters.clone(), groups[0], &101u64.to_le_bytes()), &CsvOptions::default()).unwrap();
    assert_eq!(whole.column(0, "time").len(), 100);
    assert!(whole.reported().contains("group `fast` has 100 of the 101 declared rows"), "{}", whole.reported());
    // Of records that stand mixed in one stream, too.
    let unsorted = stored("unsorted.mf4");
    let at = counter(&unsorted, usize::from(unsorted[counter(&unsorted, 0)] == 20));
    let log = read(put(unsorted, at, &[7]));
    equal(log.column(0, "word"), 60, |k| 1000.0 - k);
    assert!(log.reported().contains("60 records, and its cycle counter is 7"), "{}", log.reported());
}

fn check_rasters(log: &Whole) {
    equal(log.column(0, "time"), 100, hundredths);
    close(log.column(0, "sine"), 100, sine);
    equal(log.column(1, "slow"), 10, |k| 2.0 * k);
}

/// Space that was reserved for more rows is no measurement; a group without records is named.
#[test]
fn mdf_blocks_that_are_not_full_end_where_the_rows_do() {
    let bytes = write::mdf(&[("run", &series(50, 1e-3).table())]);
    let (dt, rows) = (nth(&bytes, b"##DT", 0), 50 * 24);
    let reserved = |counter: u64| {
        let block = [
            &bytes[dt..dt + 8],
            &(24 + 2 * rows as u64).to_le_bytes()[..],
            &bytes[dt + 16..dt + 24 + rows],
            &vec![0; rows],
        ];
        let dg = nth(&bytes, b"##DG", 0) + 40;
        let moved = put(bytes.clone(), dg, &(bytes.len() as u64).to_le_bytes());
        let moved = put(moved, nth(&bytes, b"##CG", 0) + 24 + 48 + 8, &counter.to_le_bytes());
        [moved, block.concat()].concat()
    };
    for counter in [50, 20, 0] {
        let log = read(reserved(counter));
        equal(log.column(0, "time"), 50, |k| k * 1e-3);
        assert_eq!(log.reported().contains("its cycle counter"), counter != 50, "{}", log.reported());
    }
    let empty = read(write::mdf(&[("run", &series(0, 1.0).table()), ("slow", &series(3, 1.0).table())]));
    assert!(empty.rows() == 3 && empty.notes == ["the group `run` has no records"], "{:?}", empty.notes);
}

const STORED: &[&str] = &[
    "rasters.mf4",
    "deflated.mf4",
    "transposed.mf4",
    "odd.mf4",
    "unsorted.mf4",
    "unfinished.mf4",
    "matrix.mat",
    "vectors.mat",
    "columns.mat",
    "rows.mat",
    "simulink.mat",
    "control_desk.mat",
    "snappy.parquet",
    "plain.parquet",
    "gzip.parquet",
    "zstd.parquet",
    "nulls.parquet",
    "delta.parquet",
    "duration.parquet",
    "int96.parquet",
];

/// Where a byte pattern begins for the n-th time.
fn nth(bytes: &[u8], pattern: &[u8], n: usize) -> usize {
    bytes.windows(pattern.len()).enumerate().filter(|(_, window)| *window == pattern).nth(n).expect("the pattern").0
}

fn put(mut bytes: Vec<u8>, at: usize, new: &[u8]) -> Vec<u8> {
    bytes[at..at + new.len()].copy_from_slice(new);
    bytes
}

fn cut(bytes: &[u8], share: f64) -> Vec<u8> {
    bytes[..(bytes.len() as f64 * share) as usize].to_vec()
}

/// What a file gives that is not sound: rows and everything that is told.
fn harm(bytes: Vec<u8>) -> (usize, String) {
    match read_with(bytes, &CsvOptions::default()) {
        Ok(whole) => (whole.rows(), whole.reported()),
        Err(error) => (0, error.to_string()),
    }
}

/// What a harmed file gives, and the most memory that was taken for it, bytes. Memory is counted for one thread: all is done on it.
fn weighed(bytes: Vec<u8>) -> ((usize, String), u64) {
    thread_local! {
        static SINGLE_THREAD: rayon::ThreadPool =
            rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().expect("a pool of this thread");
    }
    let mut outcome = (0, String::new());
    let allocations = SINGLE_THREAD.with(|pool| allocation_counter::measure(|| outcome = pool.install(|| harm(bytes))));
    (outcome, allocations.bytes_max)
}

#[test]
fn every_damage_is_reported_and_the_rows_before_it_are_read() {
    let rasters = stored("rasters.mf4");
    let deflated = stored("deflated.mf4");
    let matrix = stored("matrix.mat");
    let columns = stored("columns.mat");
    let vectors = stored("vectors.mat");
    let snappy = stored("snappy.parquet");
    let plain = stored("plain.parquet");
    let huge = u64::MAX.to_le_bytes();
    let lots = (1u64 << 40).to_le_bytes();
    let dt = nth(&rasters, b"##DT", 0);
    let dz = nth(&deflated, b"##DZ", 0);
    let (cg, cn) = (nth(&rasters, b"##CG", 0), nth(&rasters, b"##CN", 0));
    let dg = nth(&rasters, b"##DG", 0);
    let footer = snappy.len() - 8;
    let length: [u8; 4] = snappy[footer..footer + 4].try_into().unwrap();
    let description = footer - u32::from_le_bytes(length) as usize;
    let csv: String = (0..200).map(|k| format!("{k},{}\n", 2 * k)).collect();
    let csv = format!("t,x\n{csv}");
    let mut garbage = csv.clone().into_bytes();
    garbage.extend(
        (0..40_000u32)
            .map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8)
            .map(|byte| if byte == 0 { 10 } else { byte }),
    );
    let random: Vec<u8> = (0..4096u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 11) as u8).collect();

    let cases: Vec<(&str, Vec<u8>, usize, &str)> = vec![
        // No log at all.
        ("nothing", vec![], 0, "empty (0 bytes)"),
        ("a web page", b"<!DOCTYPE html><html><body>Please log in</body></html>".to_vec(), 0, "web page"),
        ("gzip", b"\x1f\x8b\x08\0\0\0\0\0\0\x03abc".to_vec(), 0, "gunzip"),
        ("zip", b"PK\x03\x04aaaaaaaaaaaaaaaaaa".to_vec(), 0, "ZIP archive"),
        ("HDF5", b"\x89HDF\r\n\x1a\n\0\0\0\0".to_vec(), 0, "-v7"),
        ("MAT 7.3", b"MATLAB 7.3 MAT-file, Platform".to_vec(), 0, "-v7"),
        ("XML", b"<?xml version=\"1.0\"?><a/>".to_vec(), 0, "XML"),
        ("JSON", b"{\"a\": 1}".to_vec(), 0, "JSON"),
        ("a pointer", b"version https://git-lfs.github.com/spec/v1\n".to_vec(), 0, "git lfs pull"),
        ("Arrow", b"ARROW1\0\0".to_vec(), 0, "Parquet"),
        ("random bytes", random, 0, "zero bytes"),
        ("zero bytes", vec![0; 4096], 0, "zero bytes"),
        ("one byte", vec![b'x'], 0, "no row of numbers"),
        ("words", b"this is\nno log at all\n".to_vec(), 0, "no row of numbers"),
        ("a header only", b"time,speed\ns,rpm\n".to_vec(), 0, "no row of numbers"),
        ("blank lines", b"\n\n\n".to_vec(), 0, "blank"),
        // CSV
        ("a row cut", csv.as_bytes()[..csv.len() - 6].to_vec(), 199, "middle of row 201"),
        ("a last number cut", csv.as_bytes()[..csv.len() - 2].to_vec(), 200, "may be cut"),
        ("zeros in the text", put(csv.clone().into_bytes(), 40, &[0; 8]), 0, "zero bytes"),
        ("garbage behind rows", garbage, 200, "damaged at row"),
        ("a row of words", csv.replace("50,100\n", "fifty,hundred\n").into_bytes(), 199, "row 52"),
        ("a row too long", csv.replace("50,100\n", "50,100,7\n").into_bytes(), 199, "row 52"),
        // MDF
        ("an MDF file of 20 bytes", rasters[..20].to_vec(), 0, "truncated"),
        ("an MDF file of 100 bytes", rasters[..100].to_vec(), 0, "truncated"),
        ("an MDF file cut in its middle", cut(&rasters, 0.5), 0, "truncated"),
        ("MDF 3", put(put(rasters.clone(), 8, b"3.30"), 28, &330u16.to_le_bytes()), 0, "convert it to MDF 4"),
        ("an MDF file without its header", put(rasters.clone(), 64, b"####"), 0, "byte 64"),
        ("an MDF header of huge length", put(rasters.clone(), 72, &huge), 0, "truncated"),
        ("an MDF header with many links", put(rasters.clone(), 80, &lots), 0, "links"),
        ("a group that leads to itself", put(rasters.clone(), cg + 24, &(cg as u64).to_le_bytes()), 0, "cycle"),
        ("a data group that leads to itself", put(rasters.clone(), dg + 24, &(dg as u64).to_le_bytes()), 1, "cycle"),
        ("a channel that leads to itself", put(rasters.clone(), cn + 24, &(cn as u64).to_le_bytes()), 0, "cycle"),
        ("a link out of the file", put(rasters.clone(), dg + 40, &lots), 0, "truncated"),
        ("a link into nowhere", put(rasters.clone(), dg + 40, &72u64.to_le_bytes()), 0, "no block begins there"),
        ("a link to another block", put(rasters.clone(), dg + 40, &(cg as u64).to_le_bytes()), 0, "block of records"),
        ("records of huge length", put(rasters.clone(), dt + 8, &lots), 110, ""),
        ("rows without end", put(rasters.clone(), cg + 24 + 48 + 8, &huge), 100, "declared rows"),
        ("records of 4 GB", put(rasters.clone(), cg + 24 + 48 + 24, &[0xff; 4]), 0, "declares records"),
        ("records of one byte", put(rasters.clone(), cg + 24 + 48 + 24, &1u32.to_le_bytes()), 0, "outside the 1 bytes"),
        (
            "a channel of 300 bits",
            put(rasters.clone(), nth(&rasters, b"##CN", 1) + 24 + 64 + 8, &300u32.to_le_bytes()),
            0,
            "300 bits",
        ),
        ("a compressed block of huge length", put(deflated.clone(), dz + 24 + 8, &huge), 0, "compressed block"),
        (
            "a compressed block with wrong bytes",
            put(deflated.clone(), dz + 60, &[0xff; 16]),
            0,
            "cannot be decompressed",
        ),
        ("a compressed block of a new kind", put(deflated.clone(), dz + 26, &[9]), 0, "method 9"),
        // MAT
        ("a MAT file cut in its header", matrix[..127].to_vec(), 0, "truncated"),
        ("a MAT file without variables", matrix[..128].to_vec(), 0, "no channel"),
        ("a MAT file cut in a tag", matrix[..132].to_vec(), 0, "truncated"),
        ("a MAT file without byte order", put(columns.clone(), 126, b"XX"), 0, "byte order"),
        ("a variable of huge length", put(columns.clone(), 132, &[0xff, 0xff, 0xff, 0x7f]), 100, "truncated"),
        ("a variable of no kind", put(columns.clone(), 128, &[99]), 0, "element type 99"),
        ("a compressed variable with wrong bytes", put(vectors.clone(), 140, &[0xff; 24]), 0, "cannot be decompressed"),
        ("a compressed variable cut", vectors[..500].to_vec(), 0, "truncated"),
        ("a matrix cut", cut(&columns, 0.3), 0, "truncated"),
        // Parquet
        ("a Parquet file cut", cut(&snappy, 0.7), 0, "at the end of the file"),
        ("a Parquet file of four bytes", b"PAR1".to_vec(), 0, "at the end of the file"),
        ("a Parquet dictionary without values", put(snappy.clone(), 14, &[0xfe, 0x7f]), 0, "declares 8191 values"),
        ("a Parquet footer of huge length", put(snappy.clone(), footer, &[0xff; 4]), 0, "description of its columns"),
        ("a Parquet footer of no length", put(snappy.clone(), footer, &[0; 4]), 0, "description of its columns"),
        ("a Parquet footer of zeros", put(snappy.clone(), description, &[0; 40]), 0, "description of its columns"),
        ("a Parquet page of zeros", put(plain.clone(), 4, &[0; 30]), 0, "row group 1, column `time`"),
        ("a Parquet page that cannot be inflated", put(snappy.clone(), 40, &[0xff; 60]), 0, "row group 1"),
    ];
    assert!(cases.len() >= 40);
    let mut failed = Vec::new();
    for (name, bytes, rows, expected) in cases {
        let (row_count, reported) = harm(bytes);
        if row_count < rows || !reported.contains(expected) {
            failed.push(format!("{name}: {row_count} rows of {rows}, told `{reported}`, expected `{expected}`"));
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_cut_mdf_file_gives_all_complete_rows() {
    let bytes = write::mdf(&[("run", &series(1000, 1e-3).table())]);
    let dt = nth(&bytes, b"##DT", 0);
    // 24 bytes of the block, then records of three doubles; the data group behind them is written elsewhere.
    let group = bytes[nth(&bytes, b"##DG", 0)..].to_vec();
    let mut moved = bytes[..dt].to_vec();
    let at = moved.len() as u64;
    moved.extend(&group);
    let start = moved.len();
    moved.extend(&bytes[dt..dt + 24 + 500 * 24 + 7]);
    let mut moved = put(moved, at as usize + 40, &(start as u64).to_le_bytes());
    moved = put(moved, 64 + 24, &at.to_le_bytes());
    let (rows, reported) = harm(moved);
    assert_eq!(rows, 500);
    assert!(reported.contains("truncated"), "{reported}");
}

/// Bytes changed at random in every stored file: no panic, no endless loop, no memory for what is not there.
#[test]
fn random_damage_never_panics() {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut random = move |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 16) as usize % below
    };
    let csv = b"# log\ntime;speed;torque\ns;rpm;N m\n0,0;1,5;2\n0,1;2,5;\n0,2;3,5;n/a\n0,3;4,5;5\n".to_vec();
    let mut files: Vec<Vec<u8>> = STORED.iter().map(|name| stored(name)).collect();
    files.push(csv);
    let mut reported = 0;
    for round in 0..150 {
        for file in &files {
            let mut bytes = file.clone();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                match random(4) {
                    0 => bytes[at] ^= 1 << random(8),
                    1 => bytes[at] = random(256) as u8,
                    2 => {
                        let end = (at + 8).min(bytes.len());
                        bytes[at..end].fill([0, 0xff, 0x7f, 1][random(4)]);
                    }
                    _ if round % 3 == 0 => bytes.truncate(at.max(1)),
                    _ => bytes[at] = bytes[at].wrapping_add(1),
                }
            }
            let (outcome, peak_bytes) = weighed(bytes);
            assert!(peak_bytes < 300 << 20, "{peak_bytes} bytes: {}", outcome.1);
            reported += usize::from(!outcome.1.trim().is_empty());
        }
    }
    assert!(reported > 500, "only {reported} damages were told");
}

/// Files of which this test binary has many, each small.
fn small() -> Vec<(String, Vec<u8>)> {
    let csv = "# log\ntime;speed;torque\ns;rpm;N m\n0,0;1,5;2\n0,1;2,5;\n0,2;3,5;n/a\n0,3;4,5;5\n";
    let mut out: Vec<(String, Vec<u8>)> = STORED.iter().map(|name| ((*name).into(), stored(name))).collect();
    out.push(("semicolons.csv".into(), csv.into()));
    out.push(("own.mf4".into(), write::mdf(&[("run", &series(9, 1e-3).table()), ("slow", &series(3, 1.0).table())])));
    out.push(("own.mat".into(), write::mat(&series(9, 1e-3).table()).unwrap()));
    out
}

/// Where the variables of a MAT file end.
fn variables(bytes: &[u8]) -> Vec<usize> {
    let mut ends = vec![128];
    while let Some(size) = bytes.get(ends[ends.len() - 1] + 4..).and_then(|tail| tail.first_chunk::<4>()) {
        ends.push(ends[ends.len() - 1] + 8 + u32::from_le_bytes(*size) as usize);
    }
    ends
}

/// A copy that was stopped: at every byte of every file there is an answer, also where all rows are there, and never a row that the file has not.
#[test]
fn files_cut_at_every_byte() {
    for (name, bytes) in small() {
        let whole = read_with(bytes.clone(), &CsvOptions::default()).unwrap();
        for length in 0..bytes.len() {
            let (outcome, peak_bytes) = weighed(bytes[..length].to_vec());
            assert!(outcome.0 <= whole.rows(), "{name}, {length} bytes: {} rows", outcome.0);
            assert!(peak_bytes < 64 << 20, "{name}, {length} bytes: {peak_bytes} bytes of memory");
            // A text may end anywhere and a MAT file behind each variable; other formats say that something is missing.
            let is_reported = !outcome.1.trim().is_empty();
            let may_end = name.ends_with(".csv") || name.ends_with(".mat") && variables(&bytes).contains(&length);
            assert!(is_reported || may_end, "{name}, {length} bytes: silent");
        }
    }
}

/// Bytes that lie about their numbers, everywhere in small files: no decoder panics, not even where it would be caught, and no memory
/// is taken for what is not there.
#[test]
fn false_sizes_are_reported_and_never_panic() {
    let huge = 1_000_000_000_000_000_000u64.to_le_bytes();
    let mut wrong = Vec::new();
    let mut check = |name: &str, at: usize, bytes: Vec<u8>| {
        let (outcome, peak_bytes) = weighed(bytes);
        if peak_bytes >= 64 << 20 || outcome.1.contains("contradict each other") {
            wrong.push(format!("{name}, byte {at}: {peak_bytes} bytes of memory, {}", outcome.1));
        }
    };
    for (name, bytes) in small() {
        for at in 0..bytes.len() {
            let old = bytes[at];
            let lies = [0, 0xff, 0x7f, old.wrapping_add(1), old.wrapping_sub(1), old ^ 0x80, old ^ 0x10, old ^ 2];
            let parquet = name.ends_with(".parquet");
            for new in lies.into_iter().take(if parquet { 8 } else { 0 }) {
                check(&name, at, put(bytes.clone(), at, &[new]));
            }
            // 10¹⁸ rows, bytes or links.
            if at % 4 == 0 && at + 8 <= bytes.len() {
                check(&name, at, put(bytes.clone(), at, &huge));
            }
            // The same in the description of a Parquet file, where numbers have as many bytes as they need.
            let footer = bytes.len().saturating_sub(8);
            let length =
                bytes.get(footer..footer + 4).map_or(0, |x| u32::from_le_bytes([x[0], x[1], x[2], x[3]]) as usize);
            if parquet && (footer - length..footer).contains(&at) && old < 0x80 {
                let mut number = 2_000_000_000_000_000_000u64;
                let mut new = bytes[..at].to_vec();
                while number >= 0x80 {
                    new.push(number as u8 | 0x80);
                    number >>= 7;
                }
                new.push(number as u8);
                let more = new.len() - at - 1;
                new.extend(&bytes[at + 1..footer]);
                new.extend(((length + more) as u32).to_le_bytes());
                new.extend(b"PAR1");
                check(&name, at, new);
            }
            // A count of 600 million before its first page.
            if parquet && (4..64).contains(&at) {
                let more = bytes[at..].iter().take_while(|byte| **byte >= 0x80).count();
                let new = [&bytes[..at], &[0x80, 0x98, 0x9a, 0xbc, 4], &bytes[at + more + 1..]].concat();
                check(&name, at, new);
            }
        }
    }
    assert!(wrong.is_empty(), "{} lies, such as\n{}", wrong.len(), wrong[..wrong.len().min(12)].join("\n"));
}

/// A MAT file of 12 KiB that breaks off after the name of a matrix of 10,000 columns: each column has a name as long.
#[test]
fn long_names_of_many_columns_need_less_than_64_mib() {
    let element = |kind: u32, body: &[u8]| [&kind.to_le_bytes(), &(body.len() as u32).to_le_bytes(), body].concat();
    let sizes: Vec<u8> = [10_000u32, 10_000].iter().flat_map(|size| size.to_le_bytes()).collect();
    let whole = |name: usize| {
        let mut matrix = element(6, &9u64.to_le_bytes());
        matrix.extend(element(5, &sizes));
        matrix.extend(element(1, &vec![b'n'; name]));
        matrix.extend([2u32, 100_000_000].iter().flat_map(|word| word.to_le_bytes()));
        let mut out = write::mat(&series(1, 1.0).table()).unwrap()[..128].to_vec();
        out.extend([14u32, matrix.len() as u32 + 100_000_000].iter().flat_map(|word| word.to_le_bytes()));
        out.extend(matrix);
        out
    };
    let mut names = Vec::new();
    for length in [8, 12 << 10] {
        let bytes = whole(length);
        let mut channels = 0;
        let allocations = allocation_counter::measure(|| {
            let log = kardan_tables::read::open(kardan_tables::read::in_memory(bytes), &CsvOptions::default()).unwrap();
            channels = log.groups()[0].channels.len();
            names.push(log.notes().join(" "));
        });
        assert!(allocations.bytes_max < 64 << 20, "names of {length} bytes: {} bytes of memory", allocations.bytes_max);
        assert!(if length == 8 { channels == 10_000 } else { (500..1000).contains(&channels) }, "{channels} channels");
    }
    assert!(names[0].is_empty() && names[1].contains("more than 10 MiB"), "{names:?}");
}
