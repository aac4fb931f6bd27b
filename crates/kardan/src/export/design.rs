//! A design, and the controller that came of it, as JSON.

use serde_json::{Map, Value, json as object};

use super::json::motor_strain;
use crate::results::{
    Alternative, Canonical, ChannelResult, Complex, ControllerData, CrossCoupling, DataMatrix, DataNumber,
    Decouplability, Design, ElementShare, ExactMatrix, Exploration, Feedback, Flatness, FreeKnown, Integrators,
    Interaction, Interval, LoopLimit, Margins, ObserverResult, Passage, PassedInteraction, Pole, ReadSignal,
    Robustness, ShapePart, Spread, TransferEntry, VariedParameter, WithSensor, WrongTorque, ZeroDynamics, ZeroMode,
};

/// Version of the format of [`controller_json`]; a key that changes its meaning raises it.
const VERSION: u32 = 1;

/// Gives a design as one JSON object on one line, in SI; a number that is not finite is `null`, a pole is `[re, im]` in
/// 1/s, an exact number a text (`"-51/50"`), and a part that does not apply is `null` or empty.
///
/// A matrix is `title`, `unit`, `rows`, `columns` (names), `values` (row by row) and `exact`: the same entries as
/// fractions, `null` for what comes from floating point. Names that a law uses twice are told apart by `_2`.
///
/// Keys, always in this order:
///
/// | key | what it is |
/// |---|---|
/// | `model`, `description`, `variant` | what it was designed for |
/// | `controller`, `law` | name in the file (`design` if it is not in the file); keyword of the law |
/// | `other_controllers` | names of those that are in the loop too |
/// | `design_model` | the model it was designed on, in words |
/// | `states`, `inputs`, `outputs` | names |
/// | `definitions` | states that stand for combinations of coordinates too long to be names: `state`, `is` |
/// | `hidden_poles` | motions of the model that the reduction took away |
/// | `relative_degrees` | one for each output; `null`: no input ever reaches it |
/// | `decoupling_matrix` | G, outputs × inputs |
/// | `decouplability` | `rank` of G, `normal_rank` of the transfer matrix, `possible`: `static`, `block`, `dynamic` or `impossible`; `blocks` (names of outputs), `integrators` (`input`, `count`), `reasons` |
/// | `feedback` | how this law decouples: `static`, `block` or `dynamic`; `null` if it does not, or does not say |
/// | `gains` | an object from the name of a matrix to the matrix |
/// | `canonical` | the canonically decoupled form: `sizes`, `ranks`, `Q`, `A`, `B`, `C` |
/// | `channels` | `output`, `reference`, `kind`, `transfer`, `poles` |
/// | `closed_loop_poles` | of the linear loop with all controllers |
/// | `closed_loop_poles_exact` | whether they are roots of an exact polynomial with proven signs, not eigenvalues in floating point |
/// | `zero_dynamics` | `polynomial`; `poles`, both of a conjugate pair; `stable` (decided exactly; `null` if it was not asked); `modes`: `pole` (the upper one of a pair), `natural_frequency_rad_per_s`, `damping_ratio`, `shape` (`name`, `value`: complex), `stored`, `dissipated` (`element`, `share`), `warning` |
/// | `cancels_zeros` | whether the law inverts the plant, so that its zeros become poles behind the outputs |
/// | `observer` | `method`, `sensors`, `states`, `disturbances`, `poles`, `gain` (a matrix), `distinguishable` |
/// | `transfer` | the exact transfer matrix of the linear loop, entry by entry: `output`, `reference`, `zero` (exactly), `numerator`, `denominator` (coefficients of 1, s, s², …) |
/// | `decoupled` | whether every entry of another channel is exactly zero; `null` where no such claim is made |
/// | `blocks_decoupled` | the same between different blocks; `null` for a law that does not decouple blocks |
/// | `cross_coupling` | steps in the nonlinear simulation: `reference`, `step`, `step_unit`, `output`, `unit`, `own` (the same channel), `peak`, `rms`, `window_s`, `failure` |
/// | `margins` | `sample_time_s` (`null`: continuous time), `delay_s`, `single`, `spectral_radius` (per sample time of this controller), `stable` (`null`: not known), `rates` (slowest stable ones: `delay_samples`, `rate_hz`: 0 for any, `null` for none below 1 MHz, `motion`), `longest_delay_s`, `longest_lag_s`, `gain_margin` (smallest, largest), each `value` (`null`: not limited) and `motion` or `null`, `free` (shafts that move in motions at zero which nobody holds), `free_poles`, `free_known` (`exactly, gains of the design`, `exactly, gains as rounded`, `to rounding`), `next_to_zero_1_s` (poles that only exact arithmetic tells from zero), `proven` (`stable` is decided over the rationals), `drift_per_s` (how fast these grow at the sample time), `channels` (`name`, `reading` or motor, `gain` below and above one, `gain_rad_s`, `phase_rad`, `phase_rad_s`, `delay_s`, `delay_rad_s`, `disk`, `disk_rad_s`, `disk_gain`, `disk_phase_rad`, `searched` over the common period of several clocks; `null`: not limited, or not known), `together` (`disk` from below and above, `rad_s`, `worst`: `motor`, `factor`, `turn_rad`) or `null`, `hardly` (stable, but not with 10 % more or less torque of a motor), `peaks` (`reference`, `step`, `step_unit`, `input`, `peak_n_m`, `limit_n_m`), `verdict` |
/// | `strains` | what the scenario of the file asks of its motors, where it was run: `variant`, `duration_s`, `motor` (`name`, `controller`, `torque_limit_n_m`, `rate_limit_n_m_per_s`, `asked_n_m`, `time_at_torque_limit_s`, `time_at_rate_limit_s`, `first_at_torque_limit_s`) |
/// | `passage` | the loop with the parameters of the variant where its joints stand, linear, in floating point: `turned` (what turns, in words; empty if no joint is bent), `positions` (how many), `range_rad`, `stable`, `growth_per_s` (of the motion that grows most; negative: it decays), `growth_at_rad`, `interactions` (`reference`, `step`, `step_unit`, `signal`, `unit`, `largest` or `null` if unstable, `at_rad`, `acceptable`); `null` where it is the linear loop of the design |
/// | `exploration` | designs beside this one: `interaction` (what is meant by it), `unit`, `limited` (whether torque and noise are parts of the motors' limits, else N m), `failed` (combinations without a stable design), `not_judged` (whose sample times have no short common period), `designs` (that of the file first) and `sensors` (with one more, by `name`), each `sample_time_s`, `delay_s`, `bandwidth` and `effort` (factors), `sensors`, `interaction`, `torque`, `noise`, `spectral_radius`, `best`; `advice` (sentences); `null` if it was not asked for |
/// | `robustness` | the loop over a box of plants: `range`, `parameters` (`name`, `factors`: smallest, largest), `samples`, `seed`, `stable` (how many samples are), `worst_stable` (whether the worst corner is), `spectral_radius`, `interactions` and `peaks` (`reference`, `step`, `step_unit`, `signal`, `unit`, `size`); a spread is `nominal`, `median`, `q90`, `q99`, `sampled` (largest), `worst` (of the corners), each `null` if the loop is unstable there, `at` (factors there); `null` if it was not asked for |
/// | `flatness` | `outputs`, `flat`, `remainder`, `poles`, `derivatives`, `statement` |
/// | `controller_data` | `block` of kardan-rt, `reads` (`signal`, `unit`), `writes`, `sample_time_s` (`null`: continuous time), `precision` (`f64`, `f32`), `matrices`, `numbers` |
/// | `observer_data` | the same for the observer that runs before it; `null` without one |
/// | `warnings`, `notes` | sentences |
/// | `complete`, `unfinished` | whether nothing ended early; else why it did and what is missing (such parts are empty), `null` if nothing is |
pub fn design_json(design: &Design) -> String {
    object!({
        "model": design.model,
        "description": design.description,
        "variant": design.variant,
        "controller": design.controller,
        "law": design.law,
        "other_controllers": design.others,
        "design_model": design.design_model,
        "states": design.states,
        "inputs": design.inputs,
        "outputs": design.outputs,
        "definitions": list(&design.definitions, |one| object!({ "state": one.state, "is": one.is })),
        "hidden_poles": list(&design.hidden, pole),
        "relative_degrees": design.relative_degrees,
        "decoupling_matrix": matrix(&design.decoupling_matrix),
        "decouplability": decouplability(&design.decouplability, &design.outputs),
        "feedback": design.feedback.map(feedback),
        "gains": by_name(design.gains.iter().map(|gain| (&gain.name, matrix(gain)))),
        "canonical": design.canonical.as_ref().map(canonical),
        "channels": list(&design.channels, channel),
        "closed_loop_poles": list(&design.closed_loop_poles, pole),
        "closed_loop_poles_exact": design.exact_poles,
        "zero_dynamics": zero_dynamics(&design.zero_dynamics),
        "cancels_zeros": design.cancels_zeros,
        "observer": design.observer.as_ref().map(observer),
        "transfer": list(&design.transfer, transfer),
        "decoupled": design.decoupled,
        "blocks_decoupled": design.blocks_decoupled,
        "cross_coupling": list(&design.cross_coupling, cross_coupling),
        "margins": design.margins.as_ref().map(margins),
        "strains": list(&design.strains, |found| object!({
            "variant": found.variant, "duration_s": found.duration, "motor": motor_strain(&found.strain, found.duration),
        })),
        "passage": design.passage.as_ref().map(passage),
        "exploration": design.exploration.as_ref().map(exploration),
        "robustness": design.robustness.as_ref().map(robustness),
        "flatness": design.flatness.as_ref().map(flatness),
        "controller_data": Value::Object(data(&design.controller_data)),
        "observer_data": design.observer_data.as_ref().map(|found| Value::Object(data(found))),
        "warnings": design.warnings,
        "notes": design.notes,
        "complete": design.unfinished.is_none(),
        "unfinished": design.unfinished,
    })
    .to_string()
}

fn passage(found: &Passage) -> Value {
    let interaction = |one: &PassedInteraction| {
        object!({
            "reference": one.reference, "step": one.step, "step_unit": one.step_unit, "signal": one.signal,
            "unit": one.unit, "largest": one.largest, "at_rad": one.at, "acceptable": one.acceptable,
        })
    };
    object!({
        "turned": found.turned,
        "positions": found.positions,
        "range_rad": [found.range.from, found.range.until],
        "stable": found.stable,
        "growth_per_s": found.growth,
        "growth_at_rad": found.growth_at,
        "interactions": list(&found.interactions, interaction),
    })
}

fn exploration(found: &Exploration) -> Value {
    let design = |one: &Alternative| {
        object!({
            "sample_time_s": one.sample_time, "delay_s": one.delay, "bandwidth": one.bandwidth, "effort": one.effort,
            "sensors": one.sensors, "interaction": one.interaction, "torque": one.torque, "noise": one.noise,
            "spectral_radius": one.spectral_radius, "best": one.best,
        })
    };
    object!({
        "interaction": found.interaction,
        "unit": found.unit,
        "limited": found.limited,
        "failed": found.failed,
        "not_judged": found.not_judged,
        "designs": list(&found.designs, design),
        "sensors": list(&found.sensors, |WithSensor { name, design: with }| object!({ "name": name, "design": design(with) })),
        "advice": found.advice,
    })
}

fn robustness(found: &Robustness) -> Value {
    let spread = |found: &Spread| {
        object!({
            "nominal": found.nominal, "median": found.median, "q90": found.q90, "q99": found.q99,
            "sampled": found.sampled, "worst": found.worst, "at": found.at,
        })
    };
    let interaction = |one: &Interaction| {
        object!({
            "reference": one.reference, "step": one.step, "step_unit": one.step_unit, "signal": one.signal,
            "unit": one.unit, "size": spread(&one.size),
        })
    };
    object!({
        "range": found.range,
        "parameters": list(&found.parameters, |VariedParameter { name, factors: Interval { lower: low, upper: high } }| object!({ "name": name, "factors": [low, high] })),
        "samples": found.samples,
        "seed": found.seed,
        "stable": found.stable,
        "worst_stable": found.worst_stable,
        "spectral_radius": spread(&found.spectral_radius),
        "interactions": list(&found.interactions, interaction),
        "peaks": list(&found.peaks, interaction),
    })
}

fn margins(found: &Margins) -> Value {
    let limit = |limit: &LoopLimit| object!({ "value": limit.value, "motion": limit.motion });
    object!({
        "sample_time_s": found.sample_time,
        "delay_s": found.delay,
        "single": found.single,
        "spectral_radius": found.spectral_radius,
        "stable": found.stable,
        "rates": list(&found.rates, |rate| object!({
            "delay_samples": rate.delay, "rate_hz": rate.rate, "motion": rate.motion,
        })),
        "longest_delay_s": found.longest_delay.as_ref().map(limit),
        "longest_lag_s": found.longest_lag.as_ref().map(limit),
        "gain_margin": found.gain_margin.as_ref().map(|both| list(both, limit)),
        "free": found.free,
        "free_poles": found.free_poles,
        "free_known": match found.free_known {
            FreeKnown::Design => "exactly, gains of the design",
            FreeKnown::Rounded => "exactly, gains as rounded",
            FreeKnown::Within(_) => "to rounding",
        },
        "next_to_zero_1_s": found.next_to_zero,
        "proven": found.proven,
        "drift_per_s": found.drift,
        "channels": list(&found.channels, |one| object!({
            "name": one.name, "reading": one.reading, "gain": one.gain, "gain_rad_s": one.gain_frequency,
            "phase_rad": one.phase, "phase_rad_s": one.phase_frequency, "delay_s": one.delay,
            "delay_rad_s": one.delay_frequency, "disk": one.disk, "disk_rad_s": one.disk_frequency,
            "disk_gain": one.disk_gain, "disk_phase_rad": one.disk_phase, "searched": one.searched,
        })),
        "together": found.together.as_ref().map(|all| object!({
            "disk": all.disk, "rad_s": all.frequency,
            "worst": list(&all.worst, |WrongTorque { motor: name, factor, turn }| object!({
                "motor": name, "factor": factor, "turn_rad": turn,
            })),
        })),
        "hardly": found.hardly,
        "peaks": list(&found.peaks, |peak| object!({
            "reference": peak.reference, "step": peak.step, "step_unit": peak.step_unit, "input": peak.input,
            "peak_n_m": peak.peak, "limit_n_m": peak.limit,
        })),
        "verdict": found.verdict,
    })
}

/// Gives what a designed controller runs with as a JSON object, a line for each key. Numbers are the shortest that read
/// back to the same 64 bits.
///
/// Keys: `format` (`kardan-controller`), `version` of the format, `description` (how to run it), `model`, `variant`,
/// `controller`, `law`, `inputs`, `outputs`, those of `controller_data` in [`design_json`], and `observer` with the same keys
/// for the observer that runs before it (`null` without one).
///
/// ```
/// use kardan::{export, results::{ControllerData, Design}};
/// let matrices = vec![("K".into(), vec![vec![0.1 + 0.2, -1.0 / 3.0]])];
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
    keys.extend(data(&design.controller_data));
    keys.insert("observer".into(), object!(design.observer_data.as_ref().map(|found| Value::Object(data(found)))));
    let lines: Vec<String> = keys.iter().map(|(key, value)| format!("  {}: {value}", object!(key))).collect();
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

fn how_to_run(data: &ControllerData) -> String {
    let when = if data.sample_time.is_some() { "every sample_time_s seconds" } else { "as often as it can be" };
    let excess = if data.reads.iter().any(|ReadSignal { signal, .. }| signal.ends_with(".excess")) {
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

fn list<T>(items: &[T], one: impl Fn(&T) -> Value) -> Vec<Value> {
    items.iter().map(one).collect()
}

/// An object with these names as keys; a name that comes again is told apart, so that nothing is lost.
fn by_name<'a>(pairs: impl Iterator<Item = (&'a String, Value)>) -> Value {
    let mut out = Map::new();
    for (name, value) in pairs {
        let numbered = (2..).map(|k| format!("{name}_{k}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|key| !out.contains_key(key));
        out.extend(free.map(|key| (key, value)));
    }
    Value::Object(out)
}

fn pole(pole: &Pole) -> Value {
    object!([pole.re, pole.im])
}

fn matrix(matrix: &ExactMatrix) -> Value {
    object!({
        "title": matrix.title,
        "unit": matrix.unit,
        "rows": matrix.rows,
        "columns": matrix.columns,
        "values": matrix.values,
        "exact": matrix.exact,
    })
}

fn decouplability(found: &Decouplability, outputs: &[String]) -> Value {
    let block = |block: &Vec<usize>| object!(block.iter().filter_map(|&k| outputs.get(k)).collect::<Vec<_>>());
    object!({
        "rank": found.rank,
        "normal_rank": found.normal_rank,
        "possible": feedback(found.possible),
        "blocks": list(&found.blocks, block),
        "integrators": list(&found.integrators, |Integrators { input, count }| object!({ "input": input, "count": count })),
        "reasons": found.reasons,
    })
}

fn feedback(feedback: Feedback) -> &'static str {
    match feedback {
        Feedback::Static => "static",
        Feedback::Block => "block",
        Feedback::Dynamic => "dynamic",
        Feedback::Impossible => "impossible",
    }
}

fn canonical(found: &Canonical) -> Value {
    object!({
        "sizes": found.sizes,
        "ranks": found.ranks,
        "Q": matrix(&found.transformation),
        "A": matrix(&found.a),
        "B": matrix(&found.b),
        "C": matrix(&found.c),
    })
}

fn channel(channel: &ChannelResult) -> Value {
    object!({
        "output": channel.output,
        "reference": channel.reference,
        "kind": channel.kind,
        "transfer": channel.transfer,
        "poles": list(&channel.poles, pole),
    })
}

fn zero_dynamics(found: &ZeroDynamics) -> Value {
    let both = |mode: &ZeroMode| {
        let Complex { re, im } = mode.pole;
        if im == 0.0 { vec![object!([re, im])] } else { vec![object!([re, im]), object!([re, -im])] }
    };
    let asked = !(found.polynomial.is_empty() && found.modes.is_empty());
    object!({
        "polynomial": found.polynomial,
        "poles": found.modes.iter().flat_map(both).collect::<Vec<_>>(),
        "stable": asked.then_some(found.stable),
        "modes": list(&found.modes, zero_mode),
    })
}

fn zero_mode(mode: &ZeroMode) -> Value {
    let share = |one: &ElementShare| object!({ "element": one.element, "share": one.share });
    object!({
        "pole": pole(&mode.pole),
        "natural_frequency_rad_per_s": mode.natural_frequency,
        "damping_ratio": mode.damping_ratio,
        "shape": list(&mode.shape, |ShapePart { name, value: Complex { re, im } }| object!({ "name": name, "value": [re, im] })),
        "stored": list(&mode.stored, share),
        "dissipated": list(&mode.dissipated, share),
        "warning": mode.warning,
    })
}

fn observer(observer: &ObserverResult) -> Value {
    object!({
        "method": observer.method,
        "sensors": observer.sensors,
        "states": observer.states,
        "disturbances": observer.disturbances,
        "poles": list(&observer.poles, pole),
        "gain": matrix(&observer.gain),
        "distinguishable": observer.distinguishable,
    })
}

fn transfer(entry: &TransferEntry) -> Value {
    object!({
        "output": entry.output,
        "reference": entry.reference,
        "zero": entry.numerator.is_empty(),
        "numerator": entry.numerator,
        "denominator": entry.denominator,
    })
}

fn cross_coupling(coupling: &CrossCoupling) -> Value {
    object!({
        "reference": coupling.reference,
        "step": coupling.step,
        "step_unit": coupling.step_unit,
        "output": coupling.output,
        "unit": coupling.unit,
        "own": coupling.own,
        "peak": coupling.peak,
        "rms": coupling.rms,
        "window_s": coupling.window,
        "failure": coupling.failure,
    })
}

fn flatness(found: &Flatness) -> Value {
    object!({
        "outputs": found.outputs,
        "flat": found.flat,
        "remainder": found.remainder,
        "poles": list(&found.poles, pole),
        "derivatives": found.derivatives,
        "statement": found.statement,
    })
}

fn data(data: &ControllerData) -> Map<String, Value> {
    [
        ("block", object!(data.block)),
        (
            "reads",
            object!(list(&data.reads, |ReadSignal { signal, unit }| object!({ "signal": signal, "unit": unit }))),
        ),
        ("writes", object!(data.writes)),
        ("sample_time_s", object!(data.sample_time)),
        ("precision", object!(if data.single { "f32" } else { "f64" })),
        ("matrices", by_name(data.matrices.iter().map(|DataMatrix { name, values: rows }| (name, object!(rows))))),
        ("numbers", by_name(data.numbers.iter().map(|DataNumber { name, value }| (name, object!(value))))),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into_iter()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::example;

    const KEYS: [&str; 40] = [
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
        let page = include_str!("design.rs");
        for key in KEYS {
            assert!(page.contains(&format!("`{key}`")), "{key} is not documented");
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
        let scalars = data.numbers.iter().map(|DataNumber { value, .. }| value.to_bits());
        assert_eq!(numbers(line("numbers")), scalars.collect::<Vec<_>>());
        for design in designs() {
            let _: Value = serde_json::from_str(&controller_json(&design)).unwrap();
        }
    }
}
