//! The steering system built in Rust: run, analysed, redesigned, and stepped by hand with a loop of one's own.
//!
//!     cargo run --release --example steering

use kardan::project::*;
use kardan::simulate::Snapshot;
use kardan::study::{AnalyzeSettings, DesignSettings, Settings, Silent};

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let shaft = |inertia: &str, damping: &str| Shaft::new().inertia(inertia).damping(damping);
    let bar = SpringDamper::new("rk").shaft_2("cj").stiffness("100 N m/rad").damping("0.02 N m s/rad");
    let rack = NoninteractingChannel::new("rk.phi", "rk_motor", "position", "ref_rk").natural_frequency("20 rad/s");
    let wheel = NoninteractingChannel::new("fs.phi", "wg_motor", "torque", "u2");
    let project = Project::build(
        Builder::new("steering")
            .header(Header::new().name("steering").coordinates(["rk", "fs", "cj"]))
            .parameter("beta", "0 deg")
            .vary("beta", ["0 deg", "30 deg"])
            .element("wg", shaft("50 kg mm^2", "0.0005 N m s/rad"))
            .element("cs", shaft("100 kg mm^2", "0.0005 N m s/rad"))
            .element("fs", shaft("50000 kg mm^2", "0.1 N m s/rad").friction("0.2 N m"))
            .element("cj", shaft("10 kg mm^2", "0.0001 N m s/rad"))
            .element("rk", shaft("50000 kg mm^2", "0.01 N m s/rad"))
            .element("hd", HarmonicDrive::new("wg", "cs", "fs", 50))
            .element("cardan", UniversalJoint::new("cj", "cs").angle("beta"))
            .element("torsion_bar", bar)
            .element("wg_motor", Motor::new("wg"))
            .element("rk_motor", Motor::new("rk"))
            .element("driver", Motor::new("fs"))
            .control("column", Noninteracting::new([rack, wheel]).design([("beta", "0 deg")]))
            .control("hands", PositionLoop::new("fs.phi", "driver", "ref_fs").design([("beta", "0 deg")]))
            .scenario(Scenario::new().duration("3 s"))
            .event(Event::new("1 s", "ref_rk", "180 deg"))
            .requirement(Requirement::on("driver.tau", "max_abs").below("0.21 N m")),
    );
    println!("{}", project.to_toml().lines().take(9).collect::<Vec<_>>().join("\n"));
    let words = |diagnostics: Vec<kardan::diagnostics::Diagnostic>| diagnostics[0].to_string();
    for run in project.run(&Settings::default(), &Silent).map_err(words)?.runs {
        println!("{}: {:.4} N m felt", run.name, run.requirements[0].measured.unwrap_or(f64::NAN));
    }
    let structure = project.analyze(&AnalyzeSettings::default(), &Silent).map_err(words)?.structure;
    println!("at least {} motors and {} sensors are needed", structure.min_inputs, structure.min_outputs);
    let [inputs, outputs] =
        [["wg_motor", "rk_motor"], ["rk.phi", "fs.phi"]].map(|names| names.map(String::from).to_vec());
    let lqr = DesignSettings { law: Some("lqr".into()), inputs, outputs, ..DesignSettings::default() };
    println!("{}", project.design(&lqr, &Silent).map_err(words)?.margins.map_or(String::new(), |found| found.verdict));

    // By hand: the rack follows a sine that no scenario knows, a millisecond at a time.
    let mut column = project.simulation(Some("beta-0deg")).map_err(words)?;
    let (wanted, rack) = (column.input("ref_rk")?, column.signal("rk.phi")?);
    for step in 0..2000 {
        let time = 1e-3 * f64::from(step);
        column.set(wanted, 0.3 * (4.0 * time).sin())?;
        column.advance(time + 1e-3)?;
    }
    let bytes = column.snapshot().to_bytes();
    column.restore(&Snapshot::from_bytes(&bytes)?)?;
    println!("at {} s the rack is at {:.3} rad; {} bytes go on", column.time(), column.get(rack), bytes.len());
    Ok(())
}
