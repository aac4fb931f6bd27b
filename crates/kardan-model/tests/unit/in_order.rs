//! Tests of `src/in_order.rs`.

use proptest::prelude::*;

use super::*;

proptest! {
    /// Each follows its dependencies except those in a cycle with it; cycles are closed, and there is one if no order exists.
    #[test]
    fn what_is_needed_comes_first(needs in prop::collection::vec(prop::collection::vec(0usize..12, 0..3), 12)) {
        let (order, circles) = in_order(&needs);
        let place = |k: usize| order.iter().position(|candidate| *candidate == k).unwrap();
        prop_assert_eq!(order.len(), needs.len());
        let in_order = (0..needs.len()).all(|k| needs[k].iter().all(|needed| place(*needed) < place(k)));
        prop_assert_eq!(in_order, circles.is_empty());
        for circle in &circles {
            for (k, one) in circle.iter().enumerate() {
                prop_assert!(needs[*one].contains(&circle[(k + 1) % circle.len()]));
            }
        }
        let mut members = circles.concat();
        members.sort();
        members.dedup();
        prop_assert_eq!(members.len(), circles.concat().len());
    }
}

#[test]
fn long_chains_and_circles_end() {
    let count = 100_000;
    let chain: Vec<Vec<usize>> = (0..count).map(|k| Vec::from_iter((k + 1 < count).then_some(k + 1))).collect();
    let (order, circles) = in_order(&chain);
    assert!(circles.is_empty() && order.into_iter().eq((0..count).rev()));
    let circle: Vec<Vec<usize>> = (0..count).map(|k| vec![(k + 1) % count]).collect();
    assert_eq!(in_order(&circle).1, [(0..count).collect::<Vec<_>>()]);
}
