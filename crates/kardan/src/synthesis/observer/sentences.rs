use super::super::regulator::words::listed;
use super::Distinguishable;
use super::distinguish::in_proportion;
use crate::num::{Rational, Scalar};
use crate::synthesis::regulator::in_words;

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
            0 => format!("None of the constant torques {} shows in {sensors}.", listed(names)),
            k if k == all && all == 1 => format!("{sensors} tell the constant torque {}.", names[0]),
            k if k == all => format!("{sensors} tell all {all} constant torques by themselves: {}.", listed(names)),
            1 => format!("Of the {all} constant torques {sensors} tell one combination: {}.", combinations[0]),
            k => format!("Of the {all} constant torques {sensors} tell {k} combinations: {}.", listed(&combinations)),
        });
    }
    if independent < all && !found.individual.is_empty() {
        let known: Vec<&String> = found.individual.iter().map(|&i| &names[i]).collect();
        out.push(format!("By themselves they tell {} only.", listed(&known)));
    }
    for hidden in rows(&found.hidden) {
        out.push(format!("{} cannot be told from no torque.", in_proportion(names, &hidden)));
    }
    if independent > 0 && independent < all {
        let sets: Vec<String> =
            found.resolving.iter().map(|set| listed(&set.iter().map(|&i| &names[i]).collect::<Vec<_>>())).collect();
        if !sets.is_empty() {
            out.push(format!("Measuring {} as well makes all others known.", sets.join(", or ")));
        }
        // The set that the echelon form leaves free: each other torque is its combination minus what is measured.
        for row in rows(&found.combinations) {
            let Some(lead) = row.iter().position(|x| !x.is_zero()) else { continue };
            let rest: Vec<Rational> =
                (0..all).map(|j| if j == lead { Rational::ZERO } else { Rational::ZERO.minus(&row[j]) }).collect();
            if rest.iter().any(|x| !x.is_zero()) {
                out.push(format!("{} = ({}) + ({}).", names[lead], in_words(names, &row), in_words(names, &rest)));
            }
        }
    }
    for motion in &found.hidden_motions {
        out.push(format!("Whatever the torques, {sensors} do not show {motion}."));
    }
    out
}
