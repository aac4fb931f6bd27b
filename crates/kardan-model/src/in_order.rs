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
#[path = "../tests/unit/in_order.rs"]
mod tests;
