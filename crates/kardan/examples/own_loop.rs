//! A model run, analysed, redesigned, and stepped by hand with a loop of one's own.
//!
//!     cargo run --release --example own_loop

use kardan::model::builtin;
use kardan::simulate::{Setup, Simulation, Tolerance};
use kardan::study::{AnalyzeSettings, DesignSettings, Project, Settings, Silent};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let project = Project::open(builtin("sia-steering").ok_or("no such model")?.source);
    let words = |mistakes: Vec<kardan::diagnostics::Diagnostic>| mistakes[0].message.clone();

    // The study of the file: every variant through its scenario.
    let study = project.run(&Settings::default(), &Silent).map_err(words)?;
    for run in &study.runs {
        let kept = run.requirements.iter().filter(|one| one.passed).count();
        println!("{}: {} steps, {kept} of {} requirements hold", run.name, run.effort.steps, run.requirements.len());
    }
    let analysis = project.analyze(&AnalyzeSettings::default(), &Silent).map_err(words)?;
    println!(
        "at least {} motors and {} sensors are needed",
        analysis.structure.min_inputs, analysis.structure.min_outputs
    );
    let law = DesignSettings { law: Some("lqr".into()), ..DesignSettings::default() };
    let design = project.design(&law, &Silent).map_err(words)?;
    println!("{}: {}", design.law, design.margins.map_or(String::new(), |margins| margins.verdict));

    // The loop by hand: the rack follows a sine that no scenario knows, a millisecond at a time.
    let variant = &project.prepared().variants[0];
    let setup = Setup { reduced: &variant.reduced, laws: &variant.running, scenario: &variant.scenario };
    let mut column = Simulation::new(setup, Tolerance::default());
    let wanted = column.input("ref_rk")?;
    let (rack, hands) = (column.signal("rk.phi")?, column.signal("driver.tau")?);
    let (mut farthest, mut felt, mut taken) = (0.0f64, 0.0f64, None);
    for step in 0..2000 {
        let time = 1e-3 * f64::from(step);
        column.set(wanted, 0.3 * (4.0 * time).sin())?;
        column.advance(time + 1e-3)?;
        farthest = farthest.max(column.get(rack).abs());
        felt = felt.max(column.get(hands).abs());
        if step == 999 {
            taken = Some(column.snapshot().to_bytes());
        }
    }
    println!("the rack moves by up to {farthest:.3} rad, and the driver feels at most {felt:.4} N m");

    // Back to the middle, in a loop that never ran: as if it had.
    let bytes = taken.ok_or("no snapshot")?;
    column.restore(&kardan::simulate::Snapshot::from_bytes(&bytes)?)?;
    println!(
        "from a snapshot of {} bytes it goes on at {} s, rack at {:.4} rad",
        bytes.len(),
        column.time(),
        column.get(rack)
    );
    Ok(())
}
