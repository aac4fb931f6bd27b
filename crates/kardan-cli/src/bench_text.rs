//! A bench in words: what it is to tell, where it measures, what that promises.

use std::fmt::Write;

use kardan::results::{BenchPlan, BenchStudy, TrueValue};
use kardan_report::words::bench as said;

use crate::layout::{heading, sentence, table};
use crate::summary::number;

/// The plan, without what the plant has.
pub fn plan(model: &str, plan: &BenchPlan) -> String {
    let mut out = format!("Bench of {model}\n");
    for line in said::plan(plan, number) {
        sentence(&mut out, &line);
    }
    heading(&mut out, "What the log is to tell");
    let rows: Vec<Vec<String>> = plan
        .parameters
        .iter()
        .map(|one| {
            let error = one.standard_error.map_or("-".to_string(), |error| format!("{error:.2e}"));
            vec![one.name.clone(), format!("{:.4e}", one.nominal), error, one.unit.clone()]
        })
        .collect();
    table(&mut out, &["parameter", "#of the model", "#standard error", "unit"], &rows, usize::MAX);
    if plan.parameters.iter().any(|one| one.standard_error.is_none()) {
        sentence(
            &mut out,
            "No noise of the torques is stated (`torque_noise`), so no standard errors can be promised.",
        );
    }
    heading(&mut out, "Points");
    let speeds = plan.shafts.iter().map(|name| format!("#{name}.w"));
    let torques = plan.motors.iter().map(|name| format!("#{name}.tau"));
    let headers: Vec<String> =
        ["#from s", "#until s"].map(String::from).into_iter().chain(speeds).chain(torques).collect();
    let headers: Vec<&str> = headers.iter().map(String::as_str).collect();
    let rows: Vec<Vec<String>> = plan
        .points
        .iter()
        .map(|point| {
            let numbers = point.speeds.iter().chain(&point.torques).map(|x| format!("{x:.4}"));
            [point.from, point.until].iter().map(|t| format!("{t:.3}")).chain(numbers).collect()
        })
        .collect();
    table(&mut out, &headers, &rows, usize::MAX);
    sentence(&mut out, "Speeds in rad/s; torques in N m as the model expects them.");
    if plan.kind == "constant_speeds" {
        sentence(&mut out, "Other seeds hold each speed for other times, never for less than the dwell.");
    }
    out
}

/// What came of a study.
pub fn study(found: &BenchStudy) -> String {
    let mut out = String::new();
    heading(&mut out, "Found and true");
    let rows: Vec<Vec<String>> =
        said::compared(found).iter().map(|(one, truth)| said::parameter(one, truth, number).to_vec()).collect();
    let interval = format!("#{} % interval", number(100.0 * found.identification.confidence));
    table(&mut out, &["parameter", "unit", "#in the file", "#true", "#found", &interval, ""], &rows, usize::MAX);
    for experiment in &found.closed_loop.experiments {
        heading(&mut out, &format!("Simulation and bench: {}", experiment.name));
        let rows: Vec<Vec<String>> =
            experiment.responses.iter().map(|one| said::response(one, number).to_vec()).collect();
        let headers = ["output", "unit", "#settles: sim.", "#bench", "#farthest: sim.", "#bench", "#distance", "#at s"];
        table(&mut out, &headers, &rows, usize::MAX);
    }
    heading(&mut out, "What makes them differ");
    for line in said::causes(&found.closed_loop, number) {
        sentence(&mut out, &line);
    }
    sentence(&mut out, &said::verdict(found).1);
    for note in found.notes.iter().chain(&found.closed_loop.notes) {
        sentence(&mut out, note);
    }
    out
}

/// What was made.
pub fn summary(truth: &[TrueValue], notes: &[String], files: &[String], shown: usize) -> String {
    let mut out = String::new();
    for note in notes {
        sentence(&mut out, note);
    }
    let _ = writeln!(out, "\nThe plant differs from its model in {} values.", truth.len());
    let _ = writeln!(out, "Written:");
    for file in files.iter().take(shown) {
        let _ = writeln!(out, "  {file}");
    }
    if files.len() > shown {
        let _ = writeln!(out, "  and {} more", files.len() - shown);
    }
    out
}
