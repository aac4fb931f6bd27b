//! The block `observer`: a linear state observer.

use super::builder::{BlockBuilder, BlockKind, List, rational};
use super::estimate::{Plant, of_poles, rounded, settled, staying};
use crate::element::KeyError;
use kardan_expr::expr::{Rationals, Symbol, Traced, lower};
use kardan_math::names::backquoted;
use kardan_math::num::{Matrix, Polynomial, Rational, exact_zoh, rational_to_f64};
use kardan_math::units::Dimension;
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A linear state observer.
    block ObserverBlock("observer") {
        required {
            states: Lists,
                "Its states with their initial values, in the unit of the state: { speed = \"0 rad/s\", load = \"0 N m\" }; each is read as \
                 `NAME.<state>`.";
            measured: Expressions, "The measurements, by the state that each measures, or by a name in `predicted`: { speed = \"encoder.w\" }.";
        }
        optional {
            rates: Expressions,
                "The rate of each state, linear in the states (`NAME.<state>`) with constant coefficients, and any function of known signals: { \
                 speed = \"(command - NAME.load) / J\" }; left out for a state: 0, so the state is constant.";
            predicted: Expressions,
                "The prediction of a measurement that is not a state, linear in the states: { twist = \"NAME.angle - 2 * NAME.column\" }.";
            poles: Poles,
                "The poles of the error, 1/s, as many as states, all with negative real part; kardan places them exactly, for one measurement.";
            gains: Lists,
                "In place of `poles`: for each state a gain for each measurement, in the order of `measured`: { speed = \"80 /s\", load = \"-4 N \
                 m s/rad/s\" }. At a sample time each gain is the change of the estimate at a sample, so without the `/s`.";
        }
    }
}

pub(super) const OBSERVER: BlockKind = BlockKind {
    keyword: ObserverBlock::KEYWORD,
    summary: "A linear state observer: it estimates unmeasured states of a plant from a model and from measurements.",
    formula: "rate of x = A x + B u + L (y - C x), with A, B u and C from `rates` and `predicted`. At a sample time h the same for inputs\n\
              with zero-order hold, x+ = e^(A h) x + integral(e^(A t), 0, h) B u + L (y - C x), and a pole p becomes e^(p h).\n\
              `NAME.<state>` is x, which at a sample was predicted at the previous one, so it may close a loop; `NAME.residual_<measurement>` is y \
              - C x.",
    fields: ObserverBlock::FIELDS,
    example: "\
[block.estimate]
kind = \"observer\"
states = { speed = \"0 rad/s\", load = \"0 N m\" }
rates = { speed = \"(motor_torque - estimate.load) / J\" }
measured = { speed = \"encoder.w\" }
poles = [\"-60 ± 60j\"]
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

/// A measurement: its name, its expression, its prediction from the states, and the dimension of both.
type Measured<'g> = (String, Traced<'g>, Traced<'g>, Dimension);

/// A state: its name, its initial value and its dimension.
type State<'g> = (String, Traced<'g>, Dimension);

/// The states of a list with one initial value for each.
fn states<'g>(builder: &BlockBuilder<'g>) -> Result<Vec<State<'g>>, KeyError> {
    let mut found = Vec::new();
    for List { name, values, .. } in builder.lists_of("states") {
        let [(start, dimension)] = values.as_slice() else {
            let message = format!("`states`: `{name}` has {} values, and it needs one initial value", values.len());
            return Err(KeyError::new("states", message, "write `{ speed = \"0 rad/s\", load = \"0 N m\" }`"));
        };
        found.push((name.clone(), builder.exact(start), *dimension));
    }
    if found.is_empty() {
        let help = "name them, each with its initial value: `{ speed = \"0 rad/s\", load = \"0 N m\" }`";
        return Err(KeyError::new("states", "`states` is empty: there is nothing to estimate", help));
    }
    Ok(found)
}

/// Rejects an unknown name.
fn check_name(key: &'static str, name: &str, states: &[State<'_>], besides: &str) -> Result<(), KeyError> {
    if states.iter().any(|(state, ..)| state == name) {
        return Ok(());
    }
    let message = format!("`{key}`: `{name}` is not a state{besides}");
    Err(KeyError::new(
        key,
        message,
        format!("its states are {}", backquoted(&states.iter().map(|(state, ..)| state).collect::<Vec<_>>())),
    ))
}

/// The rate of each state, 0 by default.
fn rates<'g>(builder: &BlockBuilder<'g>, states: &[State<'g>]) -> Result<Vec<Traced<'g>>, KeyError> {
    for (name, ..) in builder.expressions("rates") {
        check_name("rates", name, states, "")?;
    }
    let mut all = Vec::new();
    for (state, _, of) in states {
        let expected = builder.over("rates", *of, Dimension::TIME, -1)?;
        let entry = builder.expressions("rates").iter().find(|(name, ..)| name == state);
        all.push(match entry {
            None => BlockBuilder::zero(),
            Some((_, rate, found)) if expected.is_like(found) => *rate,
            Some((.., found)) => {
                let message =
                    format!("`rates`: that of `{state}`: expected {}, found {}", expected.noun(), found.noun());
                let help =
                    format!("the initial value of `{state}` is in {}, so its rate is in {}", of.si(), expected.si());
                return Err(KeyError::new("rates", message, help));
            }
        });
    }
    Ok(all)
}

/// The measurements with their predictions.
fn measured<'g>(builder: &BlockBuilder<'g>, states: &[State<'g>]) -> Result<Vec<Measured<'g>>, KeyError> {
    let predicted = builder.expressions("predicted");
    let mut all = Vec::new();
    for (name, value, found) in builder.expressions("measured") {
        let (prediction, expected) = match predicted.iter().find(|(candidate, ..)| candidate == name) {
            Some((_, prediction, expected)) => (*prediction, *expected),
            None => {
                check_name("measured", name, states, ", and `predicted` does not contain it")?;
                let own = states.iter().zip(&builder.own).find(|((state, ..), _)| state == name);
                own.map_or((BlockBuilder::zero(), Dimension::NONE), |((.., of), [symbol, _])| (*symbol, *of))
            }
        };
        if !expected.is_like(found) {
            let message = format!("`measured`: `{name}`: expected {}, found {}", expected.noun(), found.noun());
            let help = format!("write the measurement in a unit such as {}", expected.example());
            return Err(KeyError::new("measured", message, help));
        }
        let follows = |both: &[Traced<'g>; 2]| both.iter().any(|symbol| builder.depends(*value, *symbol));
        if let Some(((state, ..), _)) = states.iter().zip(&builder.own).find(|(_, both)| follows(both)) {
            let message = format!("`measured`: `{name}` follows from the estimate of `{state}` itself");
            let help = "write only the sensor; write its prediction in `predicted`";
            return Err(KeyError::new("measured", message, help));
        }
        all.push((name.clone(), *value, prediction, expected));
    }
    if all.is_empty() {
        let help = "name a sensor for a state: `{ speed = \"encoder.w\" }`";
        return Err(KeyError::new("measured", "`measured` is empty: nothing corrects the estimate", help));
    }
    match predicted.iter().find(|(name, ..)| all.iter().all(|(candidate, ..)| candidate != name)) {
        None => Ok(all),
        Some((name, ..)) => {
            let message = format!("`predicted`: `{name}` is not measured, so nothing is compared with it");
            Err(KeyError::new("predicted", message, "add it to `measured`, or remove it"))
        }
    }
}

/// Expressions as a matrix times the states, and the remaining parts without states.
fn linear<'g, 's>(
    builder: &BlockBuilder<'g>,
    states: &'s [State<'g>],
    (key, of): (&'static str, &[&str]),
    values: &[Traced<'g>],
) -> Result<(Matrix<Rational>, Vec<Traced<'g>>), KeyError> {
    let symbol =
        |(state, both): (&'s State<'g>, &[Traced<'g>; 2])| Some((state.0.as_str(), builder.symbol_of(both[0])?));
    let own: Vec<(&str, Symbol)> = states.iter().zip(&builder.own).filter_map(symbol).collect();
    let mut matrix = Matrix::<Rational>::zeros(values.len(), own.len());
    let mut rest = Vec::new();
    for (i, value) in values.iter().enumerate() {
        let expr = value.expr(builder.graph);
        for (j, (state, symbol)) in own.iter().enumerate() {
            let mut graph = builder.graph.borrow_mut();
            let slope = graph.derivative(expr, *symbol);
            let Some(slope) = lower(&graph, &[slope], &mut Rationals, |_| None).pop().flatten() else {
                let what = if key == "rates" { "the rate of" } else { "the prediction of" };
                let message =
                    format!("`{key}`: {what} `{}` is not linear in `{state}` with a constant coefficient", of[i]);
                let help = "this observer is linear: write the slope at the operating point, and put the nonlinear part into a signal of measurements";
                return Err(KeyError::new(key, message, help));
            };
            matrix[(i, j)] = slope;
        }
        let mut graph = builder.graph.borrow_mut();
        let zero = graph.number(Rational::ZERO);
        let at_zero: Vec<_> = own.iter().map(|(_, symbol)| (*symbol, zero)).collect();
        let constant_part = graph.substitute(&[expr], &at_zero)[0];
        drop(graph);
        rest.push(Traced::new(builder.graph, constant_part));
    }
    Ok((matrix, rest))
}

/// Rejects unobservable states, by name.
fn check_observable(plant: &Plant, states: &[State<'_>]) -> Result<(), KeyError> {
    let unobservable = plant.unobservable();
    if unobservable.columns() == 0 {
        return Ok(());
    }
    let parts = |k: usize| (0..states.len()).filter(|i| !unobservable[(*i, k)].is_zero()).collect::<Vec<usize>>();
    let constant_part = (0..unobservable.columns()).map(parts).min_by_key(Vec::len).unwrap_or_default();
    let name = |i: &usize| states[*i].0.as_str();
    let message = match constant_part.as_slice() {
        [one] => format!("not observable: no measurement depends on `{}`", name(one)),
        several => {
            let k = (0..unobservable.columns()).find(|k| parts(*k) == *several).unwrap_or(0);
            let share = |i: &usize| {
                format!("`{}` by {} {}", name(i), rational_to_f64(&unobservable[(*i, k)]), states[*i].2.si())
            };
            let shares: Vec<String> = several.iter().map(|i| share(i).trim_end().to_string()).collect();
            format!("not observable: {} can change together without effect on any measurement", shares.join(", "))
        }
    };
    Err(KeyError::new(
        "measured",
        message,
        "add a measurement, or remove a state from `states` and put its known value into `rates`",
    ))
}

/// The polynomial of the poles, checked.
fn polynomial(builder: &BlockBuilder<'_>, states: usize) -> Result<Polynomial, KeyError> {
    let poles = builder.values.poles("poles").unwrap_or_default();
    if poles.len() != states {
        let message = format!("{} `poles` for {states} states", poles.len());
        return Err(KeyError::new("poles", message, "write one for each state; `\"-14 ± 14.3j\"` are two"));
    }
    let time = builder.sample_time.as_ref().map(|time| time.to_rational());
    for (re, im) in poles {
        let (re, im) = (re.to_f64(), im.to_f64());
        if re >= 0.0 {
            let message =
                format!("`poles`: the error of the estimate does not decay at a pole with the real part {re} 1/s");
            return Err(KeyError::new("poles", message, "write poles with negative real part, such as `-50`"));
        }
        if let Some(half) =
            time.as_ref().map(|time| std::f64::consts::PI / rational_to_f64(time)).filter(|half| im.abs() >= *half)
        {
            let message = format!(
                "`poles`: {} 1/s is not below half the sampling rate (Nyquist), {half} 1/s: samples cannot represent it",
                im.abs()
            );
            return Err(KeyError::new("poles", message, "make the imaginary part smaller, or the sample time shorter"));
        }
    }
    let constant_part =
        || KeyError::new("poles", "`poles`: a complex value has no conjugate", "write a pair, `-14 ± 14.3j`");
    of_poles(poles, time.as_ref()).ok_or_else(constant_part)
}

/// L from `gains`: a row for each state.
fn gain_from_file(
    builder: &BlockBuilder<'_>,
    states: &[State<'_>],
    measured: &[Measured<'_>],
) -> Result<Matrix<Rational>, KeyError> {
    for List { name, .. } in builder.lists_of("gains") {
        check_name("gains", name, states, "")?;
    }
    let mut out = Matrix::<Rational>::zeros(states.len(), measured.len());
    for (i, (state, _, of)) in states.iter().enumerate() {
        let Some(row) = builder.lists_of("gains").find(|list| list.name == *state) else {
            return Err(KeyError::new(
                "gains",
                format!("`gains`: there are none for `{state}`"),
                "write one for each measurement, 0 in its unit where there is none",
            ));
        };
        if row.values.len() != measured.len() {
            let message = format!("`gains`: `{state}` has {} for {} measurements", row.values.len(), measured.len());
            return Err(KeyError::new("gains", message, "write one for each, in the order of `measured`"));
        }
        for (k, ((value, found), (name, .., by))) in row.values.iter().zip(measured).enumerate() {
            let mut expected = builder.over("gains", *of, *by, -1)?;
            if builder.sample_time.is_none() {
                expected = builder.over("gains", expected, Dimension::TIME, -1)?;
            }
            if !expected.is_like(found) {
                let message = format!(
                    "`gains`: that of `{state}` for `{name}`: expected {}, found {}",
                    expected.noun(),
                    found.noun()
                );
                let help = match builder.sample_time {
                    Some(_) => {
                        format!("the change of the estimate at a sample, in a unit such as {}", expected.example())
                    }
                    None => format!("a rate, in a unit such as {}", expected.example()),
                };
                return Err(KeyError::new("gains", message, help));
            }
            out[(i, k)] = value.to_rational();
        }
    }
    Ok(out)
}

/// L of a plant, sampled if there is a sample time, with its checks.
fn gain(
    builder: &BlockBuilder<'_>,
    plant: &Plant,
    states: &[State<'_>],
    measured: &[Measured<'_>],
) -> Result<Matrix<Rational>, KeyError> {
    let sampled = builder.sample_time.is_some();
    let gain = match (builder.values.has("poles"), builder.values.has("gains")) {
        (true, true) => {
            return Err(KeyError::new(
                "gains",
                "`gains` and `poles` are given: only one of them may define the speed of the estimate",
                "remove one of them",
            ));
        }
        (false, false) => {
            let message = "the speed of the estimate is not defined: there are neither `poles` nor `gains`";
            return Err(KeyError::new("kind", message, "write `poles = [\"-60 ± 60j\"]`, as many as there are states"));
        }
        (false, true) => gain_from_file(builder, states, measured)?,
        (true, false) => {
            if let [first, second, ..] = measured {
                let message = format!(
                    "`poles` need exactly one measurement, and there are several: `{}`, `{}`",
                    first.0, second.0
                );
                return Err(KeyError::new("poles", message, "write `gains`, or keep one measurement"));
            }
            let polynomial = polynomial(builder, states.len())?;
            let blind = || {
                let message = "at this sample time all samples of two motions are equal, so no gain distinguishes them";
                KeyError::new("poles", message, "make the sample time shorter")
            };
            plant.gain(&polynomial).ok_or_else(blind)?
        }
    };
    match sampled {
        true => rounded(&gain).ok_or_else(too_fast),
        false => Ok(gain),
    }
}

/// Rejects gains with which the error does not decay.
fn check_decays(builder: &BlockBuilder<'_>, error: &Matrix<Rational>) -> Result<(), KeyError> {
    let sampled = builder.sample_time.is_some();
    let Some((re, im)) = staying(error, sampled).first().copied() else { return Ok(()) };
    let key = if builder.values.has("gains") { "gains" } else { "poles" };
    let at = if im == 0.0 { format!("{re}") } else { format!("{re} ± {}j", im.abs()) };
    let why = match sampled {
        true => format!("z = {at} is not within the unit circle"),
        false => format!("the pole {at} 1/s has no negative real part"),
    };
    let message = format!("the error of the estimate does not decay: {why}");
    Err(KeyError::new(key, message, "check the signs of `gains`, or write `poles`"))
}

fn too_fast() -> KeyError {
    let message = "within one sample the states grow or decay beyond the range of floating point";
    KeyError::new("rates", message, "make the sample time shorter, or check the units in `rates`")
}

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    builder.idle("unit", "each state has the unit of its initial value", "take it out")?;
    let states = states(builder)?;
    let measured = measured(builder, &states)?;
    let outputs: Vec<String> = measured.iter().map(|(name, ..)| format!("residual_{name}")).collect();
    if let Some((state, ..)) = states.iter().find(|(state, ..)| outputs.contains(state)) {
        let message = format!("`states`: `{state}` is the residual of a measurement, so no state can have that name");
        return Err(KeyError::new("states", message, "choose another name"));
    }
    let of_states: Vec<&str> = states.iter().map(|(name, ..)| name.as_str()).collect();
    let of_measured: Vec<&str> = measured.iter().map(|(name, ..)| name.as_str()).collect();
    let (a, rate_terms) = linear(builder, &states, ("rates", &of_states), &rates(builder, &states)?)?;
    let prediction: Vec<Traced<'_>> = measured.iter().map(|(_, _, prediction, _)| *prediction).collect();
    let (c, offsets) = linear(builder, &states, ("predicted", &of_measured), &prediction)?;
    let mut plant = Plant { a, c };
    if builder.values.has("poles") {
        check_observable(&plant, &states)?;
    }
    let deviations: Vec<Traced<'_>> =
        measured.iter().zip(offsets).map(|((_, value, ..), offset)| *value - offset).collect();
    let mut b = Matrix::<Rational>::identity(states.len());
    if let Some(time) = &builder.sample_time {
        let [transition, integral] = exact_zoh(&plant.a, &time.to_rational()).ok_or_else(too_fast)?;
        // kardan computes placed gains exactly, and rounds them once.
        plant.a = settled(transition, &plant.a, &time.to_rational());
        b = rounded(&integral).ok_or_else(too_fast)?;
    }
    let gain = gain(builder, &plant, &states, &measured)?;
    if builder.sample_time.is_some() {
        plant.a = rounded(&plant.a).ok_or_else(too_fast)?;
    }
    check_decays(builder, &plant.error(&gain))?;
    let numbers = |matrix: &Matrix<Rational>| -> Vec<Traced<'_>> {
        matrix.as_slice().iter().map(|x| rational(builder.graph, x.clone())).collect()
    };
    let [a, b, c, gain] = [&plant.a, &b, &plant.c, &gain].map(numbers);
    let block = kardan_rt::Observer { a: &a, b: &b, c: &c, gain: &gain };
    let mut entries = vec![BlockBuilder::zero(); states.len()];
    entries.extend(states.iter().map(|(_, start, _)| builder.new_state(*start)));
    // In continuous time the step of the block gives the rates of its states: the same sum with other matrices.
    let _ = block.step(&rate_terms, &deviations, &mut entries);
    let (now, next) = entries.split_at(states.len());
    builder.next(next);
    for ((name, _, dimension), value) in states.iter().zip(now) {
        builder.output_as(name, *value, *dimension);
    }
    for (k, ((.., dimension), name)) in measured.iter().zip(&outputs).enumerate() {
        let row = c.iter().skip(k * states.len());
        let prediction = row.zip(now).fold(BlockBuilder::zero(), |sum, (c, x)| sum + *c * *x);
        builder.output_as(name, deviations[k] - prediction, *dimension);
    }
    Ok(())
}
