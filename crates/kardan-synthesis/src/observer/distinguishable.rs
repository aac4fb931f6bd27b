//! Which unknown torques sensors can distinguish: the result, and its text.

use crate::notation::{linear_combination, listed};
use kardan_math::num::{Matrix, Rational, Scalar};

/// Which unknown constant torques a set of sensors can observe.
#[derive(Debug, Clone, PartialEq)]
pub struct Distinguishable {
    /// The sensors.
    pub sensors: Vec<String>,
    /// The torques.
    pub disturbances: Vec<String>,
    /// Rank of the observability matrix of the system extended by the torques.
    pub rank: usize,
    /// Number of its states.
    pub states: usize,
    /// How many combinations of the torques can be observed.
    pub independent: usize,
    /// These combinations, one per row, in reduced echelon form: torques early in the list come first.
    pub combinations: Matrix<Rational>,
    /// Torques, one set per row, that no sensor shows: they cannot be distinguished from zero.
    pub hidden: Matrix<Rational>,
    /// Torques that can be estimated by themselves, by number.
    pub individual: Vec<usize>,
    /// Smallest sets of torques, by number, that make all others known if they are measured; empty if none is needed. Not all
    /// are listed where there are more than [`MOST_SETS`](super::MOST_SETS) candidates.
    pub resolving: Vec<Vec<usize>>,
    /// Motions that no sensor shows even if all torques are known, as text.
    pub hidden_motions: Vec<String>,
    /// The result as sentences.
    pub sentences: Vec<String>,
}

/// The text of the result: the observable combinations (6.42), the hidden ones, the measurements that would resolve them (6.43).
pub(super) fn sentences(found: &Distinguishable) -> Vec<String> {
    let names = &found.disturbances;
    let sensors = listed(&found.sensors);
    let mut out = Vec::new();
    let rows = |m: &Matrix<Rational>| (0..m.rows()).map(|i| m.row(i).to_vec()).collect::<Vec<_>>();
    let combinations: Vec<String> =
        rows(&found.combinations).iter().map(|row| linear_combination(names, row)).collect();
    let (all, independent) = (names.len(), found.independent);
    if all > 0 {
        out.push(match independent {
            0 => format!("With {sensors} no combination of {} can be observed.", torques(names)),
            k if k == all => format!("With {sensors} {} can be observed.", torques(names)),
            1 => format!("With {sensors} one combination of {} can be observed: {}.", torques(names), combinations[0]),
            k => {
                format!(
                    "With {sensors} {k} combinations of {} can be observed: {}.",
                    torques(names),
                    listed(&combinations)
                )
            }
        });
    }
    if independent < all && !found.individual.is_empty() {
        let individual: Vec<&String> = found.individual.iter().map(|&i| &names[i]).collect();
        out.push(format!("Individually only {} can be observed.", listed(&individual)));
    }
    for hidden in rows(&found.hidden) {
        out.push(format!("{} cannot be distinguished from zero torque.", in_proportion(names, &hidden)));
    }
    if independent > 0 && independent < all {
        let sets: Vec<String> =
            found.resolving.iter().map(|set| listed(&set.iter().map(|&i| &names[i]).collect::<Vec<_>>())).collect();
        match sets.as_slice() {
            [] => {}
            [one] => out.push(format!("Measuring {one} as well determines the others.")),
            _ if found.hidden.rows() == 1 => {
                out.push(format!("Measuring any one of {} as well determines the others.", listed(&sets)));
            }
            _ => out.push(format!("Measuring {} as well determines the others.", sets.join(", or "))),
        }
        // The set that the echelon form leaves free: each other torque is its combination minus what is measured.
        for row in rows(&found.combinations) {
            let Some(lead) = row.iter().position(|x| !x.is_zero()) else { continue };
            let rest: Vec<Rational> =
                (0..all).map(|j| if j == lead { Rational::ZERO } else { Rational::ZERO.minus(&row[j]) }).collect();
            if rest.iter().any(|x| !x.is_zero()) {
                let rest = linear_combination(names, &rest);
                let rest = rest.strip_prefix('-').map_or_else(|| format!("+ {rest}"), |size| format!("- {size}"));
                out.push(format!("{} = ({}) {rest}.", names[lead], linear_combination(names, &row)));
            }
        }
    }
    for motion in &found.hidden_motions {
        out.push(format!("Even with all torques known no sensor shows {motion}."));
    }
    out
}

fn torques(names: &[String]) -> String {
    match names {
        [one] => format!("the constant torque {one}"),
        _ => format!("the constant torques {}", listed(names)),
    }
}

/// `T_wg : T_cs : T_fs = 1 : -51 : 50`; the name alone if there is but one.
pub(super) fn in_proportion<S: AsRef<str>>(names: &[S], vector: &[Rational]) -> String {
    let terms: Vec<(&str, &Rational)> =
        names.iter().map(AsRef::as_ref).zip(vector).filter(|(_, x)| !x.is_zero()).collect();
    if let [(name, _)] = terms.as_slice() {
        return (*name).to_string();
    }
    let (names, factors): (Vec<&str>, Vec<String>) = terms.iter().map(|(name, x)| (*name, x.to_string())).unzip();
    format!("{} = {}", names.join(" : "), factors.join(" : "))
}
