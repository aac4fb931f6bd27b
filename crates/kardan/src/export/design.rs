//! A design and its controller as JSON.

use serde_json::{Map, Value, json as object};

use super::printed::printed;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{ControllerData, Design};

/// Version of the format of [`controller_json`]; a key that changes its meaning raises it.
const VERSION: u32 = 1;

/// Gives a design as one JSON object on one line, in SI; a number that is not finite is `null`, a pole is `[re, im]` in
/// 1/s, an exact number a text (`"-51/50"`), and a part that does not apply is `null` or empty. Duplicate names of a law are
/// distinguished by `_2`.
///
/// Its keys are described by [`schema`](super::schema()) of `design`.
pub fn design_json(design: &Design) -> String {
    printed(design)
}

/// Gives the data of a designed controller as a JSON object, a line for each key. Numbers are the shortest that read
/// back to the same 64 bits.
///
/// Keys: `format` (`kardan-controller`), `version` of the format, `description` (how to run it), `model`, `variant`,
/// `controller`, `law`, `inputs`, `outputs`, those of `controller_data` in the [`schema`](super::schema()) of `design`, and `observer` with the same keys
/// for the observer that runs before it (`null` without one).
///
/// ```
/// use kardan::export;
/// use kardan::results::{ControllerData, DataMatrix, Design};
/// let matrices = vec![DataMatrix::new("K", vec![vec![0.1 + 0.2, -1.0 / 3.0]])];
/// let controller_data = ControllerData { block: "StateSpace".into(), matrices, ..ControllerData::default() };
/// let text = export::controller_json(&Design { controller_data, ..Design::default() });
/// assert!(text.contains(r#"{"K":[[0.30000000000000004,-0.3333333333333333]]}"#));
/// ```
pub fn controller_json(design: &Design) -> String {
    let mut keys: Map<String, Value> = [
        ("format", object!("kardan-controller")),
        ("version", object!(VERSION)),
        ("description", object!(how_to_run(&design.controller_data))),
        ("model", object!(design.model)),
        ("variant", object!(design.variant)),
        ("controller", object!(design.controller)),
        ("law", object!(design.law)),
        ("inputs", object!(design.inputs)),
        ("outputs", object!(design.outputs)),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect();
    if let Value::Object(data) = object!(design.controller_data) {
        keys.extend(data);
    }
    keys.insert("observer".into(), object!(design.observer_data));
    let lines: Vec<String> = keys.iter().map(|(key, value)| format!("  {}: {value}", object!(key))).collect();
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

fn how_to_run(data: &ControllerData) -> String {
    let when = if data.sample_time.is_some() { "every sample_time_s seconds" } else { "as often as possible" };
    let excess = if data.reads.iter().any(|one| SignalName::new(&one.signal).is(Quantity::Excess)) {
        " `<motor>.excess`, an input to the block's states, is the torque just returned after the motor's torque limit, minus that torque: zero \
         within the limit."
    } else {
        ""
    };
    let precision = if data.single { "f32" } else { "f64" };
    format!(
        "Construct a kardan_rt::{}, computing in {precision}, from the matrices (row by row) and numbers, pass it the signals of `reads` in their \
         order and in SI {when}, and send its outputs to the inputs of `writes` in their order.{excess}",
        data.block
    )
}
