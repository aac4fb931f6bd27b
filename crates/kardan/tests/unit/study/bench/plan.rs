//! Tests of `src/study/bench/plan.rs`.

use super::*;

#[test]
fn sections_begin_and_end_at_zero_speed() {
    let mut random = Random::new(1);
    for profile in [sines(4000, 1e-3, 500, &mut random), steps(4000, 500, &mut random)] {
        assert_eq!(profile.len(), 4000);
        assert!(profile[0].abs() < 1e-12 && profile[3999].abs() < 1e-12);
        assert!(profile.iter().all(|x| x.abs() <= 1.0 + 1e-12) && profile.iter().any(|x| x.abs() > 0.3));
        assert!(profile.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.05));
    }
}

/// The speed is linear between samples: the position is the exact integral.
#[test]
fn a_trajectory_integrates_its_speed() {
    let trajectory = Trajectory::new(1, 0.1, (0..=10).map(f64::from).collect());
    let Motion { position, speed, acceleration } = trajectory.at(10);
    assert!((position[0] - 5.0).abs() < 1e-12 && speed[0] == 10.0 && acceleration[0] == 0.0);
    assert!((trajectory.at(3).acceleration[0] - 10.0).abs() < 1e-12 && trajectory.at(99).position == position);
    assert!((trajectory.at(5).position[0] - 1.25).abs() < 1e-12);
}
