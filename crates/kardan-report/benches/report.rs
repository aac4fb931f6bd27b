//! Speed of report and plots: `cargo bench -p kardan-report`.

use divan::Bencher;
use kardan::{export, model, study};
use kardan_report as report;

fn main() {
    divan::main();
}

fn steering() -> &'static str {
    model::builtin("sia-steering").expect("built in").source
}

/// Four joint angles from text to results, report, plots and tables: all of `kardan run` but the files.
#[divan::bench]
fn whole_study_with_report(bencher: Bencher) {
    bencher.bench(|| {
        let study = study::run(steering(), &study::Settings::default(), &study::Silent).expect("the model is right");
        let tables: Vec<Vec<u8>> = study.runs.iter().map(export::csv).collect();
        (report::study(&study).html(), report::plots(&study), tables)
    });
}

/// Report and plots of the finished study.
#[divan::bench]
fn report_and_plots(bencher: Bencher) {
    let study = study::run(steering(), &study::Settings::default(), &study::Silent).expect("the model is right");
    bencher.bench(|| (report::study(&study).html(), report::plots(&study)));
}
