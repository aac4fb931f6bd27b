//! Thinning of samples without a visible change.

/// Indices of the samples to keep so that a curve looks unchanged, ascending.
///
/// The samples are cut into `limit / 2 - 1` buckets of which each gives its lowest and its highest value; the first and
/// the last sample stay. Half of a bucket's width is time and half is sample count: neither a long smooth stretch with
/// few samples nor a short dense one is starved. One sample that is not finite stays in each bucket that has one, to
/// mark the gap; these come on top of `limit`.
pub(super) fn thin(time: &[f64], values: &[f64], limit: usize) -> Vec<usize> {
    let count = time.len().min(values.len());
    if count <= limit {
        return (0..count).collect();
    }
    let buckets = (limit / 2).saturating_sub(1).max(1) as f64;
    let (start, span) = (time[0], time[count - 1] - time[0]);
    let bucket = |index: usize| (0.5 * buckets * (index as f64 / count as f64 + (time[index] - start) / span)) as usize;

    let mut selected = vec![0];
    let mut from = 0;
    while from < count {
        let to = (from + 1..count).find(|&index| bucket(index) != bucket(from)).unwrap_or(count);
        let finite = || (from..to).filter(|&index| values[index].is_finite());
        let lowest = finite().min_by(|&a, &b| values[a].total_cmp(&values[b]));
        let highest = finite().max_by(|&a, &b| values[a].total_cmp(&values[b]));
        let gap = (from..to).find(|&index| !values[index].is_finite());
        selected.extend([lowest, highest, gap].into_iter().flatten());
        from = to;
    }
    selected.push(count - 1);
    selected.sort_unstable();
    selected.dedup();
    selected
}

#[cfg(test)]
mod tests {
    use kardan_rt::functions::{powi, sin};

    use super::*;

    #[test]
    fn a_short_series_stays_whole() {
        assert_eq!(thin(&[0.0, 1.0, 2.0], &[5.0, f64::NAN, 7.0], 10), [0, 1, 2]);
        assert!(thin(&[], &[], 10).is_empty());
    }

    #[test]
    fn extremes_ends_and_gaps_survive_within_the_limit() {
        // Uneven grid, one spike up and one down of a single sample each, one hole.
        let time: Vec<f64> = (0..50_000).map(|i| powi(i as f64 / 50_000.0, 3)).collect();
        let mut values: Vec<f64> = time.iter().map(|t| sin(40.0 * t)).collect();
        values[31_415] = 9.0;
        values[27_182] = -8.0;
        values[12_345] = f64::NAN;
        let selected = thin(&time, &values, 2000);
        assert!(selected.len() <= 2001, "{} points", selected.len());
        assert!(selected.windows(2).all(|pair| pair[0] < pair[1]));
        for index in [0, 31_415, 27_182, 12_345, 49_999] {
            assert!(selected.contains(&index), "sample {index} was lost");
        }
    }

    #[test]
    fn neither_the_sparse_nor_the_dense_half_starves() {
        // 1000 samples over 9 s, then 99 000 within 1 ms: thinning by count alone would leave 20 points for the 9 s.
        let time: Vec<f64> =
            (0..100_000).map(|i| if i < 1000 { 0.009 * i as f64 } else { 9.0 + 1e-8 * (i - 1000) as f64 }).collect();
        let values: Vec<f64> = (0..100_000).map(|i| sin(i as f64)).collect();
        let selected = thin(&time, &values, 2000);
        let sparse = selected.iter().filter(|&&index| index < 1000).count();
        assert!(sparse >= 900 && selected.len() - sparse >= 900, "{sparse} of {}", selected.len());
    }
}
