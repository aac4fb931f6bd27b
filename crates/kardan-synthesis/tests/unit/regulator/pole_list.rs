//! Tests of `src/regulator/pole_list.rs`.

use super::*;

#[test]
fn conjugates_find_each_other() {
    let poles = [(-1.0, 2.0), (-3.0, 0.0), (-1.0, 2.0), (-1.0, -2.0), (-1.0, -2.0)].map(Pole::from);
    assert_eq!(
        paired(&poles),
        Ok(vec![TargetPole::Real(-3.0), TargetPole::Pair(-1.0, 2.0), TargetPole::Pair(-1.0, 2.0)])
    );
    assert_eq!(paired(&poles[..3]), Err(Pole::new(-1.0, 2.0)));
    assert_eq!(
        multiplicities(&poles),
        [((-1.0, 2.0), 2), ((-3.0, 0.0), 1), ((-1.0, -2.0), 2)].map(|(pole, times)| (Pole::from(pole), times))
    );
}
