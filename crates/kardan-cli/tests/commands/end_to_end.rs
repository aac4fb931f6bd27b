//! The main job as the README says it: one command, the built-in steering model, files and report.

use std::path::PathBuf;
use std::process::Command;

use super::schemas::printed;

const ANGLES: [&str; 4] = ["beta-0deg", "beta-10deg", "beta-20deg", "beta-30deg"];

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("kardan-end-to-end-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

fn kardan(folder: &PathBuf, arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_kardan")).current_dir(folder).args(arguments).output().expect("kardan starts")
}

#[test]
fn the_command_of_the_readme() {
    let folder = folder("run");
    let done = kardan(&folder, &["run", "--json"]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let json = printed(&done.stdout);
    assert_eq!(json["model"], "sia-steering");
    let variants = json["variants"].as_array().expect("a list");
    let names: Vec<&str> = variants.iter().filter_map(|v| v["name"].as_str()).collect();
    assert_eq!(names, ANGLES);
    for (variant, degrees) in variants.iter().zip([0.0f64, 10.0, 20.0, 30.0]) {
        let beta = variant["parameters"]["beta"].as_f64().expect("beta");
        assert!((beta - degrees.to_radians()).abs() < 1e-15);
        let rack = &variant["signals"]["rk.phi"];
        for key in ["min", "max", "final", "t_min", "t_max"] {
            assert!(rack[key].is_number(), "{key}");
        }
        // After the road torque of 10 N m the rack stands off by 10/(J w^2) = 0.5 rad, up to its friction of 0.01 N m.
        let end = rack["final"].as_f64().expect("a number");
        let off = 10.0 / (0.05 * 400.0);
        assert!((end - std::f64::consts::PI - off).abs() < 0.01 / (0.05 * 400.0) + 1e-6, "{end}");
        // The balance closes far below what is converted.
        let energy = &variant["energy"];
        let of = |key: &str| energy[key].as_f64().expect("a number");
        assert!((of("input") - of("stored") - of("dissipated") - of("residual")).abs() < 1e-9);
        assert!(of("residual").abs() < 1e-7 * of("input"));
        let table = folder.join("kardan-out").join(format!("{}.csv", variant["name"].as_str().expect("a name")));
        let text = std::fs::read_to_string(&table).expect("the table is there");
        let header: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
        for column in [
            "t",
            "rk.phi",
            "fs.phi",
            "cj.phi",
            "wg.w",
            "driver.tau",
            "rk_motor.tau",
            "wg_motor.tau",
            "hd.tau",
            "cardan.tau",
            "ref_rk",
        ] {
            assert!(header.contains(&column), "{column} in {header:?}");
        }
        assert!(text.lines().count() > 9000);
    }
    let report = folder.join(json["report"].as_str().expect("the report's path"));
    let report = std::fs::read_to_string(report).expect("the report is there");
    assert!(!report.contains("https://") && !report.contains("src="), "the report opens offline");
    for name in ["rack-angle", "wheel-angle", "driver-torque", "joint-angle", "rack-motor", "wave-generator-motor"] {
        let plot = std::fs::read_to_string(folder.join(format!("kardan-out/{name}.svg"))).expect("the plot is there");
        assert!(plot.starts_with("<svg") || plot.starts_with("<?xml"), "{name}");
        assert!(report.contains(name), "{name}");
    }
    std::fs::remove_dir_all(&folder).expect("cleaning up");
}

/// Every built-in model runs, as CSV and as Parquet.
#[test]
fn every_built_in_model_runs() {
    let folder = folder("models");
    let models = kardan::model::BUILTIN;
    assert!(!models.is_empty());
    for model in models {
        let mut arguments = vec!["run", model.name, "--out", model.name, "--format", "parquet"];
        // Those with a car have many variants, which `runs` has too.
        if model.name.ends_with("-road") || model.name == "afs-steering" {
            arguments.extend(["--variant", "waves", "--runs-only"]);
        }
        let done = kardan(&folder, &arguments);
        assert_eq!(done.status.code(), Some(0), "{}: {}", model.name, String::from_utf8_lossy(&done.stderr));
        let tables = std::fs::read_dir(folder.join(model.name)).expect("a folder").filter_map(Result::ok);
        assert!(tables.filter(|file| file.path().extension().is_some_and(|e| e == "parquet")).count() > 0);
    }
    std::fs::remove_dir_all(&folder).expect("cleaning up");
}

/// A run that diverges ends with exit code 2, names time and cause, and keeps what was computed.
#[test]
fn a_diverging_run_keeps_its_results() {
    let folder = folder("diverging");
    // A position loop of 1e6 rad/s on a motor with a lag of 1 ms is unstable.
    let model = "\
[shaft.load]\ninertia = \"1 kg m^2\"\n[motor.drive]\nshaft = \"load\"\nlag = \"1 ms\"\n\
[control.loop]\nlaw = \"position_loop\"\noutput = \"load.phi\"\ninput = \"drive\"\nnatural_frequency = \"1e5 rad/s\"\n\
reference = \"ref\"\n[scenario]\nduration = \"2 s\"\n[[scenario.event]]\nat = \"10 ms\"\nsignal = \"ref\"\nto = \"1 rad\"\n";
    std::fs::write(folder.join("diverging.toml"), model).expect("a model file");
    let done = kardan(&folder, &["run", "diverging.toml", "--json"]);
    assert_eq!(done.status.code(), Some(2), "{}", String::from_utf8_lossy(&done.stderr));
    let json = printed(&done.stdout);
    let variant = &json["variants"][0];
    let text = variant["outcome"].to_string();
    assert!(text.contains("diverge") && text.contains("at t = "), "{text}");
    let table = variant["files"][0].as_str().expect("a file");
    assert!(std::fs::read_to_string(folder.join(table)).expect("the table").lines().count() > 10);
    std::fs::remove_dir_all(&folder).expect("cleaning up");
}

/// A requirement that does not hold gives exit code 1, with all files written.
#[test]
fn a_failed_requirement_gives_exit_code_1() {
    let folder = folder("requirement");
    let model = kardan::model::builtin("two-bodies").expect("built in").source.to_string()
        + "\n[[requirement]]\nsignal = \"body_1.phi\"\nmeasure = \"max\"\nbelow = \"1 deg\"\n";
    std::fs::write(folder.join("strict.toml"), model).expect("a model file");
    let done = kardan(&folder, &["run", "strict.toml"]);
    assert_eq!(done.status.code(), Some(1), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(folder.join("kardan-out/report.html").exists());
    std::fs::remove_dir_all(&folder).expect("cleaning up");
}

/// Machine code and interpreter give the same bits.
#[test]
fn a_portable_run_writes_the_same_tables() {
    let folder = folder("portable");
    let table = |arguments: &[&str]| {
        let done =
            kardan(&folder, &[&["run", "two-bodies", "--no-report", "--runs-only", "-o", "out"], arguments].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(folder.join("out/two-bodies.csv")).expect("a table")
    };
    assert_eq!(table(&[]), table(&["--portable"]));
}
