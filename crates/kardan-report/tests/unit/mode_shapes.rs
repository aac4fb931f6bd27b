//! Tests of `src/mode_shapes.rs`.

use super::*;
use kardan::results::{ShapePart, StoredShare};

fn mode(shape: &[(&str, f64, f64)], stored: &[(&str, EnergyKind, f64)]) -> Mode {
    let part = |&(name, re, im): &(&str, f64, f64)| ShapePart { name: name.into(), value: Complex::new(re, im) };
    let share =
        |&(element, energy, share): &(&str, EnergyKind, f64)| StoredShare { element: element.into(), energy, share };
    Mode { shape: shape.iter().map(part).collect(), stored: stored.iter().map(share).collect(), ..Mode::default() }
}

fn lengths(mode: &Mode) -> Vec<f64> {
    let modes = std::slice::from_ref(mode);
    rows(modes).iter().filter_map(|row| bar_of(mode, row)).map(|bar| bar.parts[0].abs() + bar.parts[1].abs()).collect()
}

/// Two equal bodies against each other: each has a quarter of the energy, the spring half of it; by hand.
#[test]
fn lengths_are_shares_and_add_up_to_one() {
    use EnergyKind::{Kinetic, Potential};
    let even = mode(
        &[("a", 1.0, 0.0), ("b", -1.0, 0.0)],
        &[("a", Kinetic, 0.25), ("b", Kinetic, 0.25), ("spring", Potential, 0.5)],
    );
    assert_eq!(lengths(&even), [0.25, 0.25, 0.5]);
    let rows = rows(std::slice::from_ref(&even));
    assert_eq!(bar_of(&even, &rows[1]).expect("a bar").parts, [-0.25, 0.0], "the other way");
    let rotated = mode(
        &[("a", 0.6, -0.8), ("b", 0.3, 0.4), ("light", 0.0, 0.0)],
        &[
            ("a", Kinetic, 0.5),
            ("b", Kinetic, 0.125),
            ("light", Kinetic, 0.0),
            ("s", Potential, 0.25),
            ("t", Potential, 0.125),
        ],
    );
    assert!((lengths(&rotated).iter().sum::<f64>() - 1.0).abs() < 1e-15);
}

#[test]
fn bars_are_motions_if_no_energies_are_stored() {
    let bare = mode(&[("a", 1.0, 0.0), ("b", 0.5, -0.5)], &[]);
    assert_eq!(lengths(&bare), [1.0, 1.0]);
    let picture = shapes(&[bare]).expect("a picture");
    assert!(picture.caption.starts_with("Motion of each shaft relative to the largest"));
}
