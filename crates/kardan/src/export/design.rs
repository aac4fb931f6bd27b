//! A design, and the controller that came of it, as JSON.

use serde_json::{Map, Value, json as object};

use super::printed::printed;
use crate::results::{ControllerData, Design};

/// Version of the format of [`controller_json`]; a key that changes its meaning raises it.
const VERSION: u32 = 1;

/// Gives a design as one JSON object on one line, in SI; a number that is not finite is `null`, a pole is `[re, im]` in
/// 1/s, an exact number a text (`"-51/50"`), and a part that does not apply is `null` or empty. Names that a law uses twice are
/// told apart by `_2`.
///
/// What its keys are says [`schema`](super::schema()) of `design`.
pub fn design_json(design: &Design) -> String {
    printed(design)
}

/// Gives what a designed controller runs with as a JSON object, a line for each key. Numbers are the shortest that read
/// back to the same 64 bits.
///
/// Keys: `format` (`kardan-controller`), `version` of the format, `description` (how to run it), `model`, `variant`,
/// `controller`, `law`, `inputs`, `outputs`, those of `controller_data` in the [`schema`](super::schema()) of `design`, and `observer` with the same keys
/// for the observer that runs before it (`null` without one).
///
/// ```
/// use kardan::{export, results::{ControllerData, DataMatrix, Design}};
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
    let when = if data.sample_time.is_some() { "every sample_time_s seconds" } else { "as often as it can be" };
    let excess = if data.reads.iter().any(|one| one.signal.ends_with(".excess")) {
        " `<motor>.excess`, which moves the block's states, is what the motor's torque limit leaves of the torque just returned, \
         less that torque: zero within the limit."
    } else {
        ""
    };
    let precision = if data.single { "f32" } else { "f64" };
    format!(
        "Make a kardan_rt::{}, computing in {precision}, of the matrices (row by row) and numbers, give it the signals of `reads` in their order and \
         in SI {when}, and send what it returns to the inputs of `writes` in their order.{excess}",
        data.block
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::example;

    const KEYS: [&str; 41] = [
        "schema",
        "model",
        "description",
        "variant",
        "controller",
        "law",
        "other_controllers",
        "design_model",
        "states",
        "inputs",
        "outputs",
        "definitions",
        "hidden_poles",
        "relative_degrees",
        "decoupling_matrix",
        "decouplability",
        "feedback",
        "gains",
        "canonical",
        "channels",
        "closed_loop_poles",
        "closed_loop_poles_exact",
        "zero_dynamics",
        "cancels_zeros",
        "observer",
        "transfer",
        "decoupled",
        "blocks_decoupled",
        "cross_coupling",
        "margins",
        "strains",
        "passage",
        "exploration",
        "robustness",
        "flatness",
        "controller_data",
        "observer_data",
        "warnings",
        "notes",
        "complete",
        "unfinished",
    ];

    fn designs() -> [Design; 4] {
        let hostile = example::hostile_design("<\"\n");
        [Design::default(), example::decoupled_steering(), example::observed_train(), hostile]
    }

    fn read(design: &Design) -> Value {
        let text = design_json(design);
        assert!(!text.contains('\n') && !text.contains("NaN") && !text.contains("inf,"), "{text}");
        serde_json::from_str(&text).unwrap()
    }

    #[test]
    fn the_keys_are_the_documented_ones_in_their_order() {
        for design in designs() {
            assert_eq!(read(&design).as_object().unwrap().keys().collect::<Vec<_>>(), KEYS);
        }
        let schema: Value = serde_json::from_str(&super::super::schema("design").unwrap()).unwrap();
        for key in KEYS {
            assert!(schema["properties"][key]["description"].is_string(), "{key} is not documented");
        }
    }

    #[test]
    fn fractions_are_kept_and_poles_come_in_pairs() {
        let all = read(&example::decoupled_steering());
        assert_eq!(all["law"], "decoupling");
        assert_eq!(all["relative_degrees"], object!([2, 2]));
        assert_eq!(all["decoupling_matrix"]["exact"], object!([["0", "20"], ["-22000/26087", "0"]]));
        assert_eq!(all["decoupling_matrix"]["values"][0][1], 20.0);
        let gains = all["gains"].as_object().unwrap();
        assert_eq!(gains.keys().collect::<Vec<_>>(), ["K", "L"]);
        assert_eq!(gains["K"]["exact"][0][4], "-338911/11000");
        assert_eq!(gains["K"]["columns"][5], "cj.w");
        let zeros = &all["zero_dynamics"];
        assert_eq!(zeros["stable"], true);
        assert_eq!(zeros["poles"].as_array().unwrap().len(), 2);
        assert_eq!(zeros["poles"][1][1].as_f64(), zeros["poles"][0][1].as_f64().map(|im| -im));
        assert_eq!(zeros["modes"][0]["stored"][0], object!({ "element": "torsion_bar", "share": 0.5 }));
        assert_eq!(all["transfer"][1]["zero"], true);
        assert_eq!(all["transfer"][3]["denominator"], object!(["400", "28", "1"]));
        assert_eq!(all["decoupled"], true);
        assert_eq!(all["cross_coupling"][2]["window_s"], 2.0);
        assert_eq!(all["decouplability"]["possible"], "static");
    }

    #[test]
    fn what_does_not_apply_is_null() {
        let empty = read(&Design::default());
        for key in ["canonical", "observer", "decoupled", "flatness"] {
            assert_eq!(empty[key], Value::Null, "{key}");
        }
        assert_eq!(empty["zero_dynamics"]["stable"], Value::Null);
        let train = read(&example::observed_train());
        assert_eq!(train["relative_degrees"], object!([2, 4, null]));
        assert_eq!(train["gains"]["K"]["exact"], Value::Null);
        assert_eq!(train["decouplability"]["blocks"], object!([["rack.phi", "driver.tau"], ["wheel.w"]]));
        assert_eq!(train["cross_coupling"][2]["peak"], Value::Null);
        assert_eq!(train["zero_dynamics"]["poles"], object!([[0.0, 0.0], [420.0, 0.0]]));
        assert_eq!(train["canonical"]["A"]["exact"][1][1], "-3/7");
        let hostile = read(&example::hostile_design("x"));
        assert_eq!(hostile["gains"].as_object().unwrap().keys().collect::<Vec<_>>(), ["x", "x_2", ""]);
        assert_eq!(hostile["gains"]["x"]["values"], object!([[null], [null, 1.0, null]]));
        assert_eq!(hostile["closed_loop_poles"][0], object!([null, null]));
    }

    #[test]
    fn a_controller_reads_back_bit_for_bit() {
        let train = example::observed_train();
        let text = controller_json(&train);
        let all: Value = serde_json::from_str(&text).unwrap();
        let keys = "format version description model variant controller law inputs outputs block reads writes \
                    sample_time_s precision matrices numbers observer";
        assert_eq!(all.as_object().unwrap().keys().collect::<Vec<_>>(), keys.split_whitespace().collect::<Vec<_>>());
        assert_eq!(all["version"], 1);
        assert!(all["description"].as_str().unwrap().contains("kardan_rt::Noninteracting"));
        assert_eq!(all["sample_time_s"], 1e-3);
        // Not what serde makes of the text, but what the text says.
        let line = |key: &str| text.lines().find_map(|line| line.trim().strip_prefix(&format!("\"{key}\": "))).unwrap();
        let numbers = |text: &str| -> Vec<u64> {
            let parts = text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
            parts.filter_map(|part| part.parse::<f64>().ok()).map(f64::to_bits).collect()
        };
        let data = &train.controller_data;
        let entries = data.matrices[0].values.iter().flatten().map(|value| value.to_bits());
        assert_eq!(numbers(line("matrices")), entries.collect::<Vec<_>>());
        let scalars = data.numbers.iter().map(|one| one.value.to_bits());
        assert_eq!(numbers(line("numbers")), scalars.collect::<Vec<_>>());
        for design in designs() {
            let _: Value = serde_json::from_str(&controller_json(&design)).unwrap();
        }
    }
}
