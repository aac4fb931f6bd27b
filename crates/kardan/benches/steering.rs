//! Speed of the main job and of its parts: `cargo bench -p kardan`.

use divan::{Bencher, black_box};
use kardan::{export, model, study};

fn main() {
    divan::main();
}

fn steering() -> &'static str {
    model::builtin("sia-steering").expect("built in").source
}

/// Four joint angles from text to results, both cores.
#[divan::bench]
fn four_angles(bencher: Bencher) {
    bencher.bench(|| study::run(steering(), &study::Settings::default(), &study::Silent));
}

/// One joint angle, 9 s with set-valued friction, 10521 rows of 30 signals.
#[divan::bench]
fn one_angle(bencher: Bencher) {
    let settings = study::Settings { variants: vec!["beta-30deg".into()], ..Default::default() };
    bencher.bench(|| study::run(steering(), &settings, &study::Silent));
}

/// Reading, checking, reducing and designing, four angles.
#[divan::bench]
fn check() -> Vec<kardan::diagnostics::Diagnostic> {
    study::check(black_box(steering()))
}

/// Tables of the finished study, about 16 MB of CSV.
#[divan::bench]
fn csv_tables(bencher: Bencher) {
    let study = study::run(steering(), &study::Settings::default(), &study::Silent).expect("the model is right");
    bencher.bench(|| study.runs.iter().map(export::csv).collect::<Vec<_>>());
}
