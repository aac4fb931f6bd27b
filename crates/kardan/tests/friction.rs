//! Set-valued friction: the convex problem behind it, and drivetrains that stick and slip.

use kardan::simulate::friction::BoxProblem;
use proptest::prelude::*;

#[derive(Debug, Clone)]
struct Problem {
    w: Vec<f64>,
    r: Vec<f64>,
    c: Vec<f64>,
    room: usize,
}

fn problems() -> impl Strategy<Value = Problem> {
    (1usize..9, 0usize..9, 0usize..4).prop_flat_map(|(m, rank, more)| {
        let entry = prop_oneof![2 => -1.0..1.0f64, 1 => (-2i32..3).prop_map(f64::from)];
        (
            prop::collection::vec(prop::collection::vec(entry.clone(), rank), m),
            prop::collection::vec(-6.0..6.0f64, m),
            prop::bool::ANY,
            prop::collection::vec(prop::option::weighted(0.2, 0..m), m),
            prop::collection::vec(entry.clone(), rank),
            -6.0..6.0f64,
            prop::collection::vec(prop_oneof![3 => Just(0.0), 1 => entry], m),
            prop::collection::vec(-6.0..3.0f64, m),
        )
            .prop_map(move |(mut g, scale, scaled, copies, x, load, outside, c)| {
                for i in 0..m {
                    if let Some(other) = copies[i] {
                        g[i] = g[other].clone();
                    }
                }
                let size = |i: usize| if scaled { 10f64.powf(0.5 * scale[i]) } else { 1.0 };
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let w = (0..m * m).map(|k| dot(&g[k / m], &g[k % m]) * size(k / m) * size(k % m)).collect();
                let load = 10f64.powf(load);
                let r = (0..m).map(|i| (dot(&g[i], &x) + outside[i]) * size(i) * load).collect();
                Problem { w, r, c: c.iter().map(|c| 10f64.powf(*c)).collect(), room: m + more }
            })
    })
}

/// The largest violation of the optimality conditions, relative to the size of each row.
fn violation(p: &Problem, lambda: &[f64]) -> f64 {
    let m = p.r.len();
    (0..m)
        .map(|i| {
            let row = &p.w[i * m..(i + 1) * m];
            let alpha = p.r[i] - row.iter().zip(lambda).map(|(w, x)| w * x).sum::<f64>();
            let size = p.r[i].abs() + row.iter().zip(&p.c).map(|(w, c)| (w * c).abs()).sum::<f64>();
            let inside = lambda[i].abs() <= p.c[i];
            let wrong = if lambda[i] == p.c[i] {
                (-alpha).max(0.0)
            } else if lambda[i] == -p.c[i] {
                alpha.max(0.0)
            } else {
                alpha.abs()
            };
            if !inside { f64::INFINITY } else if wrong == 0.0 { 0.0 } else { wrong / size }
        })
        .fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: std::env::var("CASES").ok().and_then(|x| x.parse().ok()).unwrap_or(512), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn box_problem_reaches_the_optimum(p in problems()) {
        let mut lambda = vec![0.0; p.r.len()];
        let done = BoxProblem::new(p.room).solve(&p.w, &p.r, &p.c, &mut lambda);
        let violation = violation(&p, &lambda);
        prop_assert!(done && violation < 1e-9, "{done} {violation:e} {lambda:?}");
    }
}
