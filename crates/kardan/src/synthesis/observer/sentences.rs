use super::Distinguishable;
use super::distinguish::in_proportion;
use crate::num::{Rational, Scalar};
use crate::synthesis::words::{in_words, listed};

/// What the sensors can tell, for a reader: the combinations (6.42), what stays hidden, what would resolve it (6.43).
pub(super) fn sentences(found: &Distinguishable) -> Vec<String> {
    let names = &found.disturbances;
    let sensors = listed(&found.sensors);
    let mut out = Vec::new();
    let rows = |m: &crate::num::Matrix<Rational>| (0..m.rows()).map(|i| m.row(i).to_vec()).collect::<Vec<_>>();
    let combinations: Vec<String> = rows(&found.combinations).iter().map(|row| in_words(names, row)).collect();
    let (all, independent) = (names.len(), found.independent);
    if all > 0 {
        out.push(match independent {
            0 => format!("With {sensors} nothing can be told about {}.", torques(names)),
            k if k == all => format!("With {sensors} {} can be told.", torques(names)),
            1 => format!("With {sensors} one combination of {} can be told: {}.", torques(names), combinations[0]),
            k => {
                format!("With {sensors} {k} combinations of {} can be told: {}.", torques(names), listed(&combinations))
            }
        });
    }
    if independent < all && !found.individual.is_empty() {
        let known: Vec<&String> = found.individual.iter().map(|&i| &names[i]).collect();
        out.push(format!("By itself only {} can be told.", listed(&known)));
    }
    for hidden in rows(&found.hidden) {
        out.push(format!("{} cannot be told from no torque.", in_proportion(names, &hidden)));
    }
    if independent > 0 && independent < all {
        let sets: Vec<String> =
            found.resolving.iter().map(|set| listed(&set.iter().map(|&i| &names[i]).collect::<Vec<_>>())).collect();
        match sets.as_slice() {
            [] => {}
            [one] => out.push(format!("Measuring {one} as well makes the others known.")),
            _ if found.hidden.rows() == 1 => {
                out.push(format!("Measuring any one of {} as well makes the others known.", listed(&sets)));
            }
            _ => out.push(format!("Measuring {} as well makes the others known.", sets.join(", or "))),
        }
        // The set that the echelon form leaves free: each other torque is its combination minus what is measured.
        for row in rows(&found.combinations) {
            let Some(lead) = row.iter().position(|x| !x.is_zero()) else { continue };
            let rest: Vec<Rational> =
                (0..all).map(|j| if j == lead { Rational::ZERO } else { Rational::ZERO.minus(&row[j]) }).collect();
            if rest.iter().any(|x| !x.is_zero()) {
                let rest = in_words(names, &rest);
                let rest = rest.strip_prefix('-').map_or_else(|| format!("+ {rest}"), |size| format!("- {size}"));
                out.push(format!("{} = ({}) {rest}.", names[lead], in_words(names, &row)));
            }
        }
    }
    for motion in &found.hidden_motions {
        out.push(format!("Even with all torques known {motion} shows in no sensor."));
    }
    out
}

fn torques(names: &[String]) -> String {
    match names {
        [one] => format!("the constant torque {one}"),
        _ => format!("the constant torques {}", listed(names)),
    }
}
