//! How often intervals cover the truth, and how fast logs are read: `cargo bench -p kardan --bench identification`.
//!
//! Coverage: the built-in `harmonic-drive-bench` is logged with 1000 seeds (or as many as the argument says), each log written as MDF 4,
//! read back and identified; told is how often the interval of 95 % holds the true value of Table 6.1, which the model does not know.
//! Speed: 10 million rows of eight channels from MDF 4 in memory.

use std::time::Instant;

use kardan::export;
use kardan::model::builtin;
use kardan::results::{Physical, Series, Signal};
use kardan::study::{self, BenchRun, BenchSettings, IdentifySettings, LogFile, Silent, identify};
use kardan::tables::read::in_memory;
use rayon::prelude::*;

fn main() {
    let asked = std::env::args().skip(1).find_map(|argument| argument.parse::<u64>().ok());
    coverage(asked.unwrap_or(1000));
    speed(10_000_000);
}

fn coverage(repetitions: u64) {
    let source = builtin("harmonic-drive-bench").expect("built in").source;
    let settings = BenchSettings { run: BenchRun::Excitation, ..BenchSettings::default() };
    let bench = study::prepare_bench(&study::Project::open(source), &settings).expect("a bench");
    let truth: Vec<(String, f64)> = bench.truth().iter().map(|one| (one.name.clone(), one.value)).collect();
    let start = Instant::now();
    let found: Vec<_> = (0..repetitions)
        .into_par_iter()
        .map(|k| {
            let log = bench.log(k, &mut |_| None);
            let bytes = export::mdf(&[("bench", &log.series)]);
            let files = vec![LogFile { name: format!("{k}.mf4"), bytes: in_memory(bytes) }];
            identify(source, files, &IdentifySettings::default(), &Silent).expect("an identification").parameters
        })
        .collect();
    println!("{repetitions} logs made and identified in {:.1} s", start.elapsed().as_secs_f64());
    println!("{:14} {:>8} {:>12} {:>12} {:>12}", "parameter", "covered", "true", "mean found", "spread");
    let (mut hits, mut all) = (0, 0);
    for (k, one) in found[0].iter().enumerate() {
        let Some((_, value)) = truth.iter().find(|(name, _)| *name == one.name) else { continue };
        let covers = |of: &Vec<kardan::results::IdentifiedParameter>| {
            of[k].interval.is_some_and(|it| (it.lower..=it.upper).contains(value))
        };
        let covered = found.iter().filter(|of| covers(of)).count();
        let n = found.len() as f64;
        let mean = found.iter().filter_map(|of| of[k].value).sum::<f64>() / n;
        let spread = (found.iter().filter_map(|of| of[k].value).map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
        println!("{:14} {:>6.1} % {value:>12.4e} {mean:>12.4e} {spread:>12.2e}", one.name, 100.0 * covered as f64 / n);
        hits += covered;
        all += found.len();
    }
    println!("all together   {:>6.1} %", 100.0 * hits as f64 / all as f64);
}

fn speed(rows: usize) {
    let source = builtin("harmonic-drive").expect("built in").source;
    let time: Vec<f64> = (0..rows).map(|k| 1e-3 * k as f64).collect();
    // Two speeds that change every second, by steps of a fixed pattern.
    let level = |k: usize, large: f64, turn: usize| large * [1.0, -0.5, 0.7, -1.0, 0.4, -0.8][(k / 1000 / turn) % 6];
    let signal = |name: &str, physical: Physical, of: &dyn Fn(usize) -> f64| Signal {
        name: name.into(),
        physical,
        description: String::new(),
        values: (0..rows).map(of).collect(),
    };
    let (wg, cs) = (|k: usize| level(k, 100.0, 1), |k: usize| level(k, 5.0, 5));
    let fs = |k: usize| -wg(k) / 50.0 + 51.0 / 50.0 * cs(k);
    let hiss = |k: usize| (k * 7919 % 1009) as f64 / 1009.0 - 0.5;
    let series = Series {
        time,
        signals: vec![
            signal("wg.w", Physical::Speed, &wg),
            signal("cs.w", Physical::Speed, &cs),
            signal("fs.w", Physical::Speed, &fs),
            signal("wg.phi", Physical::Angle, &|k| 1e-3 * k as f64),
            signal("cs.phi", Physical::Angle, &|k| 1e-4 * k as f64),
            signal("fs.phi", Physical::Angle, &|k| 1e-4 * k as f64),
            signal("wg_motor.tau", Physical::Torque, &|k| 5e-4 * wg(k) + 0.036 * wg(k).signum() + 0.01 * hiss(k)),
            signal("cs_motor.tau", Physical::Torque, &|k| 8e-3 * cs(k) + 0.18 * cs(k).signum() + 0.01 * hiss(k + 500)),
        ],
    };
    let bytes = export::mdf(&[("bench", &series)]);
    drop(series);
    let files = vec![LogFile { name: "long.mf4".into(), bytes: in_memory(bytes) }];
    let settings = IdentifySettings { variant: Some("position-friction".into()), ..IdentifySettings::default() };
    let start = Instant::now();
    let found = identify(source, files, &settings, &Silent).expect("an identification");
    let seconds = start.elapsed().as_secs_f64();
    println!("{rows} rows of 8 channels from MDF 4 in memory: {seconds:.2} s, {} windows", found.windows.all);
}
