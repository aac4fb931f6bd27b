//! Tests of `src/detect.rs`.

use super::*;

/// A double integrator with its position read: a constant fault of the sensor has the same effect as another position, one of the input does not;
/// with the input unknown no fault is detected.
#[test]
fn faults_with_position_and_speed_sensors() {
    let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
    let system =
        LinearSystem::state_space(matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0], &[0, 1]]));
    let position_only =
        LinearSystem { c: matrix(&[&[1, 0]]), d: Matrix::zeros(1, 1), outputs: vec!["y".into()], ..system.clone() };
    let transfer = Transfer::new(&position_only).unwrap();
    assert!(transfer.is_exact());
    assert!(
        transfer.detects(&[0], ParitySignal::Output(0), &[]) && !transfer.detects(&[0], ParitySignal::Output(0), &[0])
    );
    assert_eq!(constant_is_detectable(&position_only, ParitySignal::Output(0), &[]), Some(false));
    assert_eq!(constant_is_detectable(&position_only, ParitySignal::Input(0), &[]), Some(true));
    assert_eq!(
        transfer.groups(&[0], &[ParitySignal::Output(0), ParitySignal::Input(0)], &[]),
        (vec![vec![0, 1]], vec![])
    );
    // Position and velocity: p' − v isolates the sensors from the input, not from each other; v' − u isolates these.
    let transfer = Transfer::new(&system).unwrap();
    let faults = [ParitySignal::Output(0), ParitySignal::Output(1), ParitySignal::Input(0)];
    assert_eq!(transfer.groups(&[0, 1], &faults, &[]).0.len(), 3);
    assert_eq!(transfer.groups(&[0, 1], &faults, &[0]), (vec![vec![0, 1]], vec![2]));
    assert_eq!(constant_is_detectable(&system, ParitySignal::Output(0), &[]), Some(false));
    assert_eq!(constant_is_detectable(&system, ParitySignal::Output(1), &[]), Some(true));
    let sets = |goal| smallest_sets(&transfer, goal, &[0], &[]).sets;
    assert_eq!(sets(Goal::Shows(0)), [vec![0], vec![1]]);
    assert_eq!(sets(Goal::Isolates), [vec![0, 1]]);
}
