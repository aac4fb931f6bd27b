//! Tests of `src/radau/tableau.rs`.

use super::TABLEAUS;
use kardan_rt::functions::powi;

#[test]
fn the_quadratures_have_their_orders() {
    for tableau in &TABLEAUS {
        let s = tableau.stages;
        assert_eq!(tableau.nodes.len(), s);
        // Powers up to 2s − 2 are integrated to the end of the step, up to s − 1 to each node.
        for power in 0..2 * s - 1 {
            for i in 0..s {
                if power >= s && i < s - 1 {
                    continue;
                }
                let row = &tableau.integrals[i * s..][..s];
                let sum: f64 = row.iter().zip(&tableau.nodes).map(|(b, c)| b * powi(*c, power as i32)).sum();
                let exact = powi(tableau.nodes[i], power as i32 + 1) / (power as f64 + 1.0);
                assert!((sum - exact).abs() < 4e-16, "{s} {power} {i}: {sum} {exact}");
            }
        }
        // The difference of two solutions vanishes for polynomials up to degree s.
        for power in 1..=s {
            let increments: f64 =
                tableau.error.iter().zip(&tableau.nodes).map(|(e, c)| e * powi(*c, power as i32)).sum();
            let slope_at_begin = if power == 1 { 1.0 } else { 0.0 };
            assert!((increments + slope_at_begin / tableau.real).abs() < 1e-12, "{s} {power}");
        }
    }
}

#[test]
fn weights_reproduce_polynomials() {
    for tableau in &TABLEAUS {
        let mut weights = vec![0.0; tableau.stages];
        for part in [-0.3, 0.0, 0.1, 0.7, 1.0, 1.4] {
            let correction = tableau.weights(part, &mut weights);
            assert!(part != 0.0 || correction == 0.0);
            let cubic: f64 = weights.iter().zip(&tableau.nodes).map(|(w, c)| w * c * c * c).sum();
            assert!((cubic - part * part * part).abs() < 1e-12, "{} {part}", tableau.stages);
        }
    }
}
