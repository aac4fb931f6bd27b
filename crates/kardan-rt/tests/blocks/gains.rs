//! Products of gains: many rows are summed together, each with the bits that it has alone.

use kardan_rt::Gain;

/// Whatever the shapes: also fewer rows than values, fewer values than rows, and vectors shorter than rows.
#[test]
fn batched_rows_equal_rows_one_by_one() {
    let entry = |k: usize| ((k * 37 + 11) % 101) as f64 / 7.0 - 6.0;
    let (entries, x) = ((0..60).map(entry).collect::<Vec<_>>(), (60..66).map(|k| 1.0 / entry(k)).collect::<Vec<_>>());
    for (rows, columns) in (0..=10).flat_map(|rows| (1..=6).map(move |columns| (rows, columns))) {
        let matrix = &entries[..rows * columns];
        let gain = Gain::new(matrix, columns).unwrap();
        for (length, values) in [(columns, rows), (columns - 1, rows), (columns, rows + 3), (columns, rows / 2)] {
            let mut batched = vec![0.25; values];
            assert!(gain.add_to(&x[..length], &mut batched));
            let mut row_by_row = vec![0.25; values];
            for (value, row) in row_by_row.iter_mut().zip(matrix.chunks_exact(columns)) {
                *value = row.iter().zip(&x[..length]).fold(*value, |sum, (g, x)| sum + g * x);
            }
            assert_eq!(batched, row_by_row, "{rows} x {columns}, {length} given, {values} values");
        }
    }
}
