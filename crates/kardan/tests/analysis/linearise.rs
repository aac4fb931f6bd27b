//! `kardan linearise`: what is written is what `kardan analyze --state-space` reads, and what the analysis of the model knows.

use std::process::Command;

use kardan::export::{linear_json, linear_mat, linear_python};
use kardan::model::{self, read_state_space};
use kardan::num::rational_to_f64;
use kardan::results::Linearised;
use kardan::study::{self, AnalyzeSettings, Silent};

const MODELS: [&str; 4] = ["two-bodies", "sia-steering", "harmonic-drive", "harmonic-drive-spring"];

fn linear(name: &str, descriptor: bool) -> Linearised {
    let source = model::builtin(name).unwrap().source;
    study::linearise(source, &AnalyzeSettings::default(), descriptor).unwrap_or_else(|all| panic!("{all:?}")).0
}

#[test]
fn json_comes_back_exactly_with_the_same_structure() {
    for name in MODELS {
        let whole = study::analyze(model::builtin(name).unwrap().source, &AnalyzeSettings::default(), &Silent).unwrap();
        for descriptor in [false, true] {
            let linear_model = linear(name, descriptor);
            let text = linear_json(&linear_model);
            let read = read_state_space(text.as_bytes()).unwrap_or_else(|all| panic!("{all:?}")).system;
            assert_eq!(
                (&read.a, &read.b, &read.c, &read.d),
                (&linear_model.a, &linear_model.b, &linear_model.c, &linear_model.d),
                "{name}"
            );
            assert_eq!(linear_model.e.as_ref().map(|e| *e == read.e), linear_model.e.as_ref().map(|_| true));
            assert!(descriptor || linear_model.e.is_none());
            let names: Vec<&str> = linear_model.states.iter().map(|one| one.name.as_str()).collect();
            assert_eq!(read.states, names);
            assert!(
                linear_model.inputs.iter().chain(&linear_model.outputs).all(|one| !one.unit.is_empty()),
                "{linear_model:?}"
            );
            let plain = study::analyze_state_space(text.as_bytes(), &AnalyzeSettings::default(), &Silent).unwrap();
            let (found, expected) = (&plain.structure, &whole.structure);
            assert_eq!(
                (found.controllable_rank, found.observable_rank, &found.invariant_factors, &found.relative_degrees),
                (
                    expected.controllable_rank,
                    expected.observable_rank,
                    &expected.invariant_factors,
                    &expected.relative_degrees
                ),
                "{name}"
            );
            assert_eq!(found.zeros.polynomial, expected.zeros.polynomial, "{name}");
        }
    }
}

#[test]
fn mat_files_hold_the_rounded_matrices() {
    for name in MODELS {
        let linear_model = linear(name, true);
        let read = read_state_space(&linear_mat(&linear_model).unwrap()).unwrap_or_else(|all| panic!("{all:?}")).system;
        let pairs = [
            (&read.a, &linear_model.a),
            (&read.b, &linear_model.b),
            (&read.c, &linear_model.c),
            (&read.d, &linear_model.d),
        ];
        for (read, exact) in pairs {
            let rounded: Vec<f64> = exact.as_slice().iter().map(rational_to_f64).collect();
            assert_eq!(read.as_slice().iter().map(rational_to_f64).collect::<Vec<_>>(), rounded, "{name}");
        }
        assert_eq!(read.states, linear_model.states.iter().map(|one| one.name.clone()).collect::<Vec<_>>());
    }
}

/// The program runs, with a stand-in for NumPy that keeps lists: the numbers are those of the matrices, to the last bit.
#[test]
fn python_reads_the_program() {
    let check = "\
import sys, types, json
class Array(list):
    def reshape(self, rows, columns):
        assert len(self) == rows and all(len(row) == columns for row in self)
        return self
numpy = types.ModuleType('numpy')
numpy.array = Array
sys.modules['numpy'] = numpy
sys.modules['control'] = None
found = {}
exec(sys.stdin.read(), found)
assert found['system'] is None
keys = ['A', 'B', 'C', 'D', 'states', 'inputs', 'outputs', 'state_units', 'input_units', 'output_units', 'operating_point']
for key in 'ABCD':
    found[key] = [[repr(x) for x in row] for row in found[key]]
print(json.dumps({key: found[key] for key in keys}))
";
    for name in MODELS {
        let linear_model = linear(name, false);
        let mut command = Command::new("python3");
        let child =
            command.args(["-c", check]).stdin(std::process::Stdio::piped()).stdout(std::process::Stdio::piped());
        let Ok(mut child) = child.spawn() else {
            println!("python3 is not installed: the program is not run");
            return;
        };
        let text = linear_python(&linear_model);
        std::io::Write::write_all(&mut child.stdin.take().unwrap(), text.as_bytes()).unwrap();
        let out = child.wait_with_output().unwrap();
        assert!(out.status.success(), "{text}");
        let found: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        for (key, matrix) in linear_model.matrices() {
            let rows: Vec<Vec<String>> = serde_json::from_value(found[key].clone()).unwrap();
            let number = |x: &String| x.parse::<f64>().unwrap();
            let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.iter().map(number).collect()).collect();
            assert_eq!(rows, matrix.to_f64().to_rows(), "{name} {key}");
        }
        let names: Vec<&String> = linear_model.inputs.iter().map(|one| &one.name).collect();
        assert_eq!(found["inputs"], serde_json::json!(names));
    }
}
