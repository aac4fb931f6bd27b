//! Topological order of dependencies of any depth, and the cycles among them.

/// Numbers from zero on, each after those that it needs, and disjoint cycles of dependencies.
pub(super) fn in_order(needs: &[Vec<usize>]) -> (Vec<usize>, Vec<Vec<usize>>) {
    let (mut order, mut circles) = (Vec::new(), Vec::<Vec<usize>>::new());
    let [mut is_done, mut in_circle] = [(); 2].map(|()| vec![false; needs.len()]);
    // Each open number with the count of its remaining dependencies, and its position there.
    let (mut open, mut depths): (Vec<(usize, usize)>, Vec<Option<usize>>) = (Vec::new(), vec![None; needs.len()]);
    for first in 0..needs.len() {
        let mut next = Some(first);
        loop {
            if let Some(next) = next.filter(|next| !is_done[*next]) {
                depths[next] = Some(open.len());
                open.push((next, needs[next].len()));
            }
            let Some((k, remaining)) = open.last_mut() else { break };
            if *remaining == 0 {
                is_done[*k] = true;
                depths[*k] = None;
                order.push(*k);
                open.pop();
                next = None;
                continue;
            }
            *remaining -= 1;
            let needed = needs[*k][*remaining];
            next = Some(needed).filter(|needed| depths[*needed].is_none());
            if let Some(depth) = depths[needed] {
                let circle: Vec<usize> = open[depth..].iter().map(|(k, _)| *k).collect();
                if !circle.iter().any(|k| in_circle[*k]) {
                    circle.iter().for_each(|k| in_circle[*k] = true);
                    circles.push(circle);
                }
            }
        }
    }
    (order, circles)
}

#[cfg(test)]
mod tests {
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
}
