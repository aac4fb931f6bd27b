//! A bench in words: what it is to tell, where it measures, what that promises.

use std::fmt::Write;

use kardan::results::{BenchPlan, TrueValue};

use crate::layout::{heading, sentence, table};

/// The plan, without what the plant has.
pub fn plan(model: &str, plan: &BenchPlan) -> String {
    let mut out = format!("Bench of {model}: {}\n", plan.kind.replace('_', " "));
    let measured = format!(
        "{} points of {} that keep the limits, {:.1} s in all.",
        plan.points.len(),
        plan.candidates,
        plan.duration
    );
    sentence(&mut out, &measured);
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
    if !plan.known.is_empty() {
        sentence(&mut out, &format!("Taken from the model: {}.", plan.known.join(", ")));
    }
    let compared = format!(
        "ln det(XᵀX) = {:.3}; as many points of all candidates alike have {:.3}: for the same precision the undesigned plan takes \
         {:.2} times as long.",
        plan.log_det, plan.undesigned_log_det, plan.gain
    );
    sentence(&mut out, &compared);
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
