//! Tests of `src/study/sweep/worst.rs`.

use super::*;
use crate::study::requests::distribution::Distribution;
use crate::study::requests::varied::Varied;
use kardan_math::units::Dimension;

fn searched(axes: usize, samples: u64, margin: impl Fn(&[f64]) -> f64) -> (Worst, Vec<Vec<f64>>) {
    let one = |k: usize| Varied {
        name: format!("x{k}"),
        dimension: Dimension::NONE,
        distribution: Distribution::Uniform { from: 0.0, to: 1.0 },
        text: String::new(),
        laws: Vec::new(),
    };
    let varied: Vec<Varied> = (0..axes).map(one).collect();
    let space = SampleSpace { varied, correlated: Vec::new(), sampling: SamplingMethod::LatinHypercube };
    let (block, mut all) = (40, Vec::new());
    let mut search = Worst::new(5, samples / 2 / block * block, &space);
    for first in (0..samples).step_by(block as usize) {
        let places = search.propose(first..(first + block).min(samples));
        let margins: Vec<f64> = places.iter().map(|place| margin(place)).collect();
        search.update(first, &margins);
        all.extend(places);
    }
    assert!(all.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
    (search, all)
}

fn sought(axes: usize, samples: u64, margin: impl Fn(&[f64]) -> f64) -> (f64, Vec<f64>, u64) {
    let (search, all) = searched(axes, samples, margin);
    let (least, sample) = search.least.unwrap();
    assert!(least <= search.before.unwrap());
    (least, all[sample as usize].clone(), search.rests.len() as u64)
}

/// Corners to the last bit, hollows within the step, one of two hollows that is deeper, and a bent valley to some percent.
#[test]
fn least_margins_are_found() {
    let (least, place, _) = sought(3, 800, |x| x[0] - 2.0 * x[1] + x[2]);
    assert_eq!((least, place), (-2.0, vec![0.0, 1.0, 0.0]));
    let bowl = |x: &[f64]| x.iter().map(|x| (x - 0.37) * (x - 0.37)).sum::<f64>();
    let (least, place, rests) = sought(4, 2000, |x| bowl(x) - 1.0);
    assert!(least + 1.0 < 1e-7 && place.iter().all(|x| (x - 0.37).abs() < 1e-3), "{least} {place:?}");
    let two = |x: &[f64]| {
        let from = |at: f64| x.iter().map(|x| (x - at) * (x - at)).sum::<f64>();
        (from(0.2)).min(from(0.85) - 0.01)
    };
    let (least, ..) = sought(2, 1200, two);
    assert!((least + 0.01).abs() < 1e-6, "{least} {rests}");
    let valley = |x: &[f64]| 100.0 * (x[1] - x[0] * x[0]) * (x[1] - x[0] * x[0]) + (0.8 - x[0]) * (0.8 - x[0]);
    let (least, place, _) = sought(2, 2000, valley);
    assert!(least < 1e-3, "{least} {place:?}");
}

/// Where all fail without a number it ends as all do; where none can be run there is no case.
#[test]
fn flat_margins_are_no_trouble() {
    for margin in [f64::NEG_INFINITY, 1.0] {
        assert_eq!(sought(2, 400, |_| margin).0, margin);
    }
    let (search, _) = searched(2, 400, |_| f64::INFINITY);
    assert_eq!((search.least, search.before), (None, None));
}
