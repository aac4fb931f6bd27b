//! Margins, singular values and norms of plain loops against python-control and Slycot, on their own examples: see
//! `golden/margins.py`, which writes the numbers.

use faer::{Mat, c64};
use kardan::num::Matrix;
use kardan::synthesis::margins::{Response, channel_margins, multiloop_margin, structured_singular_value};
use serde_json::Value;

/// Both sides compute in floating point by other methods, some of theirs on interpolated grids.
const TOLERANCE: f64 = 1e-5;
/// By how much the two bounds of errors of several channels may differ.
const BRACKET: f64 = 2e-3;

fn golden() -> Value {
    serde_json::from_str(include_str!("../golden/margins.json")).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

fn matrix(value: &Value) -> Matrix<f64> {
    let rows: Vec<Vec<f64>> = value.as_array().expect("rows").iter().map(numbers).collect();
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn system(value: &Value) -> Response {
    let [a, b, c, d] = ["A", "B", "C", "D"].map(|name| matrix(&value[name]));
    Response::state_space([&a, &b, &c, &d], value["dt"].as_f64()).expect("finite")
}

fn close(found: f64, expected: f64, what: &str) {
    assert!(
        (found - expected).abs() <= TOLERANCE * expected.abs().max(1e-3),
        "{what}: {found}, and {expected} expected"
    );
}

#[test]
fn gain_and_phase_margins_and_the_distance_from_minus_one_are_those_of_python_control() {
    for one in golden()["loops"].as_array().expect("loops") {
        let origin = one["origin"].as_str().expect("a text");
        let closed = system(&one["system"]).feedback_transform().expect("proper");
        let found = channel_margins(&closed).expect("converges");
        let pairs = |key: &str| -> Vec<Vec<f64>> { one[key].as_array().expect("a list").iter().map(numbers).collect() };
        let above = pairs("gain").into_iter().filter(|pair| pair[0] > 1.0).min_by(|a, b| a[0].total_cmp(&b[0]));
        let above = above.expect("each of these loops has a largest gain");
        close(found.gain[1], above[0], origin);
        close(found.gain_frequency[1].expect("known"), above[1], origin);
        match pairs("phase_deg").into_iter().min_by(|a, b| a[0].abs().total_cmp(&b[0].abs())) {
            Some(least) => {
                close(found.phase.to_degrees(), least[0].abs(), origin);
                close(found.phase_frequency.expect("known"), least[1], origin);
            }
            None => assert_eq!(found.phase, f64::INFINITY, "{origin}"),
        }
        let distance = numbers(&one["distance"]);
        let sensitivity = closed.sensitivity().largest_gain().expect("stable");
        close(1.0 / sensitivity.value, distance[0], origin);
        // Where the distance is least it is flat: its place is known to the root of its tolerance.
        assert!((sensitivity.frequency / distance[1] - 1.0).abs() < 1e-3, "{origin}: at {}", sensitivity.frequency);
    }
}

#[test]
fn the_disk_margin_of_two_loops_at_once_is_that_of_python_control() {
    let golden = golden();
    let one = &golden["disk"];
    let found = multiloop_margin(&system(&one["system"]).feedback_transform().expect("proper")).expect("converges");
    let expected = one["disk"].as_f64().expect("a number");
    assert!(found.disk[0] <= expected * (1.0 + TOLERANCE), "{:?}, and {expected} expected", found.disk);
    assert!((found.disk[0] / expected - 1.0).abs() < BRACKET && (found.disk[1] / expected - 1.0).abs() < BRACKET);
}

#[test]
fn singular_values_are_those_of_python_control() {
    for one in golden()["singular_values"].as_array().expect("a list") {
        let origin = one["origin"].as_str().expect("a text");
        let response = system(&one["system"]);
        for (frequency, values) in numbers(&one["frequencies"]).iter().zip(one["values"].as_array().expect("rows")) {
            let found = response.singular_values(*frequency).expect("no pole there");
            found.iter().zip(numbers(values)).for_each(|(found, expected)| close(*found, expected, origin));
        }
        let largest = response.largest_gain().expect("stable");
        close(largest.value, one["norm"].as_f64().expect("a number"), origin);
    }
}

#[test]
fn norms_are_those_of_slycot() {
    for one in golden()["norms"].as_array().expect("a list") {
        let origin = one["origin"].as_str().expect("a text");
        let found = system(&one["system"]).largest_gain().expect("stable");
        let expected = one["norm"].as_f64().expect("a number");
        // The resolvent of the second one is a number with five digits fewer than its matrix.
        assert!((found.value / expected - 1.0).abs() < 1e-4, "{origin}: {} and {expected}", found.value);
        assert!((found.frequency / one["norm_at"].as_f64().expect("a number") - 1.0).abs() < 1e-3, "{origin}");
    }
}

#[test]
fn structured_singular_values_are_those_of_slycot() {
    for one in golden()["structured"].as_array().expect("a list") {
        let (re, im) = (matrix(&one["re"]), matrix(&one["im"]));
        let values = Mat::from_fn(re.rows(), re.columns(), |i, j| c64::new(re[(i, j)], im[(i, j)]));
        let [lower, upper] = structured_singular_value(&values);
        let expected = one["bound"].as_f64().expect("a number");
        let origin = one["origin"].as_str().expect("a text");
        assert!(lower <= upper * (1.0 + 1e-9), "{origin}: {lower} above {upper}");
        assert!((upper / expected - 1.0).abs() < BRACKET, "{origin}: {upper} and {expected}");
        // With up to three channels the bound is the value (Doyle 1982).
        assert!(re.rows() > 3 || (lower / expected - 1.0).abs() < BRACKET, "{origin}: {lower} and {expected}");
    }
}
