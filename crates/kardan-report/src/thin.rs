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
#[path = "../tests/unit/thin.rs"]
mod tests;
