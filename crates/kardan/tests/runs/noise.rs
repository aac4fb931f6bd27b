//! Noise of sensors: what it is on average, where it comes from, and who reads it.

use crate::common::{run, runs_only, signal};
use kardan::model::builtin;
use kardan::results::Run;
use kardan::study::{self, Settings, Silent};

/// A shaft that turns at 1 rad/s under two equal sensors and one that counts edges.
fn still(seed: u64) -> Run {
    let sensor = |name: &str, keys: &str| {
        format!("[sensor.{name}]\nmeasures = \"angle\"\nshaft = \"a\"\nsample_time = \"1 ms\"\n{keys}\n")
    };
    run(&format!(
        "[shaft.a]\ninertia = \"1 kg m^2\"\n{}{}{}[sensor.speed]\nmeasures = \"speed\"\nshaft = \"a\"\n\
         sample_time = \"1 ms\"\nlines = 1000\nnoise = \"0.2 rad/s\"\n[scenario]\nduration = \"20 s\"\nseed = {seed}\n\
         initial = {{ \"a.w\" = \"1 rad/s\" }}\n",
        sensor("one", "noise = \"2 mrad\""),
        sensor("two", "noise = \"2 mrad\""),
        sensor("edges", "noise = \"2 mrad\"\nlines = 1000"),
    ))
}

fn errors(run: &Run, name: &str) -> Vec<f64> {
    signal(run, name).iter().zip(signal(run, "a.phi")).map(|(reading, angle)| reading - angle).collect()
}

fn mean(of: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = of.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
    sum / f64::from(count)
}

/// 20 001 readings: mean, variance, the products of neighbours and of two sensors, and the parts beyond one and two standard
/// deviations lie within four standard errors of what white Gaussian noise has.
#[test]
fn noise_is_white_and_gaussian() {
    let run = still(1);
    let (one, two) = (errors(&run, "one.phi"), errors(&run, "two.phi"));
    let n = one.len() as f64;
    assert_eq!(one.len(), 20_001);
    let unit: Vec<f64> = one.iter().map(|x| x / 2e-3).collect();
    let near = |value: f64, expected: f64, variance: f64| {
        let allowed = 4.0 * (variance / n).sqrt();
        assert!((value - expected).abs() < allowed, "{value} against {expected} within {allowed}");
    };
    near(mean(unit.iter().copied()), 0.0, 1.0);
    near(mean(unit.iter().map(|x| x * x)), 1.0, 2.0);
    near(mean(unit.windows(2).map(|pair| pair[0] * pair[1])), 0.0, 1.0);
    near(mean(unit.iter().zip(&two).map(|(x, y)| x * y / 2e-3)), 0.0, 1.0);
    for (bound, part) in [(1.0, 0.317_310_5), (2.0, 0.045_500_3)] {
        near(mean(unit.iter().map(|x| f64::from(u8::from(x.abs() > bound)))), part, part * (1.0 - part));
    }
    // To the speed it is added behind the difference of rounded angles, which lies within an edge per sample of the speed.
    let step = std::f64::consts::TAU / 4000.0;
    let speed: Vec<f64> = signal(&run, "speed.w")[1..].iter().map(|w| w - 1.0).collect();
    let edges = step * 1e3;
    let variance = mean(speed.iter().map(|x| x * x)) - mean(speed.iter().copied()).powi(2);
    assert!(variance > 0.03 && variance < 0.05 + edges * edges, "{variance}");
}

/// It is added before rounding: readings stay on the edges. The seed makes the noise, and nothing else does.
#[test]
fn noise_is_rounded_and_comes_from_the_seed() {
    let (run, again, other) = (still(1), still(1), still(2));
    let step = std::f64::consts::TAU / 4000.0;
    for x in signal(&run, "edges.phi") {
        assert_eq!((x / step).round() * step, *x);
    }
    assert_eq!(run.series, again.series);
    assert_ne!(signal(&run, "one.phi"), signal(&other, "one.phi"));
    assert_eq!(signal(&run, "a.phi"), signal(&other, "a.phi"));
}

/// A sampled controller reads the noise: its commands shake, by the same bits in every run and on any number of threads.
#[test]
fn sampled_controllers_read_it() {
    let source = builtin("harmonic-drive-ecu").expect("built in").source;
    let gauge = "resolution = \"1e-6 rad\"";
    assert!(source.contains(gauge));
    let noisy = |noise: &str, seed: u64| {
        let source = source
            .replace(gauge, &format!("resolution = \"1e-6 rad\"\nsample_time = \"1 ms\"\n{noise}"))
            .replace("duration = \"1 s\"", &format!("duration = \"0.2 s\"\nseed = {seed}"));
        let settings = Settings { variants: vec!["position".into(), "torque".into()], ..runs_only() };
        study::run(&source, &settings, &Silent).expect("no mistakes").runs.remove(0)
    };
    let noise = "noise = \"0.05 N m\"";
    let (one, again, other, noiseless) = (noisy(noise, 1), noisy(noise, 1), noisy(noise, 2), noisy("", 1));
    assert_eq!(one.series, again.series);
    let command = |run: &Run| signal(run, "wg_motor.command").to_vec();
    assert_ne!(command(&one), command(&other));
    // Before the step at 0.1 s all is at rest but for the noise.
    let rough = |run: &Run| -> f64 {
        let before = run.series.time.iter().take_while(|t| **t < 0.1).count();
        command(run)[..before].windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum()
    };
    assert!(rough(&one) > 1e-3 && rough(&noiseless) == 0.0, "{} against {}", rough(&one), rough(&noiseless));
}
