use super::estimate::{Plant, of_poles, rounded, settled, staying};
use super::wiring::{BlockKind, List, Wiring, mistake, rational};
use crate::element::Mistake;
use crate::expr::{Rationals, Symbol, Traced, lower};
use crate::num::{Matrix, Polynomial, Rational, held, rational_to_f64};
use crate::schema::{BlockKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A linear state observer.
    block ObserverBlock("observer") {
        required {
            states: Lists, "Its states with what each is at the start, in the unit of the state: { speed = \"0 rad/s\", load = \"0 N m\" }; each is read as `NAME.<state>`.";
            measured: Expressions, "What is measured, by the state that it measures, or by a name in `predicted`: { speed = \"encoder.w\" }.";
        }
        optional {
            rates: Expressions, "The rate of each state, linear in the states (`NAME.<state>`) with constant coefficients, besides of anything that is known: \
                 { speed = \"(command - NAME.load) / J\" }; of one that is left out 0: it is taken as constant.";
            predicted: Expressions, "What the states say of a measurement that is no state, linear in them: { twist = \"NAME.angle - 2 * NAME.column\" }.";
            poles: Poles, "The poles of the error, 1/s, as many as states, all left of 0; kardan places them exactly, for one measurement.";
            gains: Lists, "In place of `poles`: for each state a gain for each measurement, in the order of `measured`: { speed = \"80 /s\", load = \"-4 N m s/rad/s\" }. \
                 At a sample time what the estimate changes by at a sample, so without the `/s`.";
        }
    }
}

pub(super) const OBSERVER: BlockKind = BlockKind {
    keyword: ObserverBlock::KEYWORD,
    summary: "A linear state observer: what a plant does that is not measured, by a model of it and by what is measured.",
    formula: "rate of x = A x + B u + L (y - C x), with A, B u and C as `rates` and `predicted` say. At a sample time h the same for what is held from\n\
              one sample to the next (zero-order hold), x+ = e^(A h) x + integral(e^(A t), 0, h) B u + L (y - C x), and a pole p becomes e^(p h).\n\
              `NAME.<state>` is x, which at a sample was foretold at the one before, so it may close a loop; `NAME.residual_<measurement>` is y - C x.",
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

/// A measurement: its name, what is measured, what the states say of it, and the dimension of both.
type Measured<'g> = (String, Traced<'g>, Traced<'g>, Dimension);

/// A state: its name, its start and its dimension.
type State<'g> = (String, Traced<'g>, Dimension);

/// Names as they stand in a sentence.
fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The states of a list with one start for each.
fn states<'g>(wiring: &Wiring<'g>) -> Result<Vec<State<'g>>, Mistake> {
    let mut found = Vec::new();
    for List { name, values, .. } in wiring.lists_of("states") {
        let [(start, dimension)] = values.as_slice() else {
            let message = format!("`states`: `{name}` has {} values, one is what it starts at", values.len());
            return Err(mistake("states", message, "write `{ speed = \"0 rad/s\", load = \"0 N m\" }`"));
        };
        found.push((name.clone(), wiring.exact(start), *dimension));
    }
    if found.is_empty() {
        let help = "name them, each with what it is at the start: `{ speed = \"0 rad/s\", load = \"0 N m\" }`";
        return Err(mistake("states", "`states` is empty: there is nothing to estimate", help));
    }
    Ok(found)
}

/// Refuses the name of something that is not there.
fn check_name(key: &'static str, name: &str, known: &[State<'_>], besides: &str) -> Result<(), Mistake> {
    if known.iter().any(|(state, ..)| state == name) {
        return Ok(());
    }
    let message = format!("`{key}`: `{name}` is no state{besides}");
    Err(mistake(key, message, format!("its states are {}", names(known.iter().map(|(state, ..)| state.as_str())))))
}

/// The rate of each state, 0 where none is given.
fn rates<'g>(wiring: &Wiring<'g>, states: &[State<'g>]) -> Result<Vec<Traced<'g>>, Mistake> {
    for (name, ..) in wiring.expressions("rates") {
        check_name("rates", name, states, "")?;
    }
    let mut all = Vec::new();
    for (state, _, of) in states {
        let wanted = wiring.over("rates", *of, Dimension::TIME, -1)?;
        let given = wiring.expressions("rates").iter().find(|(name, ..)| name == state);
        all.push(match given {
            None => Wiring::zero(),
            Some((_, rate, found)) if wanted.is_like(found) => *rate,
            Some((.., found)) => {
                let message = format!("`rates`: that of `{state}`: expected {}, found {}", wanted.noun(), found.noun());
                let help = format!("`{state}` starts in {}, so its rate comes out in {}", of.si(), wanted.si());
                return Err(mistake("rates", message, help));
            }
        });
    }
    Ok(all)
}

/// What is measured beside what the states say of it.
fn measured<'g>(wiring: &Wiring<'g>, states: &[State<'g>]) -> Result<Vec<Measured<'g>>, Mistake> {
    let predicted = wiring.expressions("predicted");
    let mut all = Vec::new();
    for (name, value, found) in wiring.expressions("measured") {
        let (said, wanted) = match predicted.iter().find(|(other, ..)| other == name) {
            Some((_, said, wanted)) => (*said, *wanted),
            None => {
                check_name("measured", name, states, ", and `predicted` says nothing of it")?;
                let own = states.iter().zip(&wiring.own).find(|((state, ..), _)| state == name);
                own.map_or((Wiring::zero(), Dimension::NONE), |((.., of), [symbol, _])| (*symbol, *of))
            }
        };
        if !wanted.is_like(found) {
            let message = format!("`measured`: `{name}`: expected {}, found {}", wanted.noun(), found.noun());
            let help = format!("what is measured comes out in a unit such as {}", wanted.example());
            return Err(mistake("measured", message, help));
        }
        let follows = |both: &[Traced<'g>; 2]| both.iter().any(|symbol| wiring.depends(*value, *symbol));
        if let Some(((state, ..), _)) = states.iter().zip(&wiring.own).find(|(_, both)| follows(both)) {
            let message = format!("`measured`: `{name}` follows from the estimate of `{state}` itself");
            let help = "write the sensor alone; what the states say of it is `predicted`";
            return Err(mistake("measured", message, help));
        }
        all.push((name.clone(), *value, said, wanted));
    }
    if all.is_empty() {
        let help = "name a sensor for a state: `{ speed = \"encoder.w\" }`";
        return Err(mistake("measured", "`measured` is empty: nothing corrects the estimate", help));
    }
    match predicted.iter().find(|(name, ..)| all.iter().all(|(other, ..)| other != name)) {
        None => Ok(all),
        Some((name, ..)) => {
            let message = format!("`predicted`: `{name}` is not measured, so nothing is compared with it");
            Err(mistake("predicted", message, "add it to `measured`, or take it out"))
        }
    }
}

/// Expressions as a matrix times the states and what is left without them.
fn linear<'g, 's>(
    wiring: &Wiring<'g>,
    states: &'s [State<'g>],
    (key, of): (&'static str, &[&str]),
    values: &[Traced<'g>],
) -> Result<(Matrix<Rational>, Vec<Traced<'g>>), Mistake> {
    let symbol =
        |(state, both): (&'s State<'g>, &[Traced<'g>; 2])| Some((state.0.as_str(), wiring.symbol_of(both[0])?));
    let own: Vec<(&str, Symbol)> = states.iter().zip(&wiring.own).filter_map(symbol).collect();
    let mut matrix = Matrix::<Rational>::zeros(values.len(), own.len());
    let mut rest = Vec::new();
    for (i, value) in values.iter().enumerate() {
        let expr = value.expr(wiring.graph);
        for (j, (state, symbol)) in own.iter().enumerate() {
            let mut graph = wiring.graph.borrow_mut();
            let slope = graph.derivative(expr, *symbol);
            let Some(slope) = lower(&graph, &[slope], &mut Rationals, |_| None).pop().flatten() else {
                let what = if key == "rates" { "the rate of" } else { "what is said of" };
                let message =
                    format!("`{key}`: {what} `{}` is not linear in `{state}` with a constant coefficient", of[i]);
                let help = "this observer is linear: write the slope at the operating point, and put what bends into a signal of what is measured";
                return Err(mistake(key, message, help));
            };
            matrix[(i, j)] = slope;
        }
        let mut graph = wiring.graph.borrow_mut();
        let zero = graph.number(Rational::ZERO);
        let at_zero: Vec<_> = own.iter().map(|(_, symbol)| (*symbol, zero)).collect();
        let alone = graph.substitute(&[expr], &at_zero)[0];
        drop(graph);
        rest.push(Traced::new(wiring.graph, alone));
    }
    Ok((matrix, rest))
}

/// Refuses states that measurements do not show, by name.
fn check_seen(plant: &Plant, states: &[State<'_>]) -> Result<(), Mistake> {
    let unseen = plant.unseen();
    if unseen.columns() == 0 {
        return Ok(());
    }
    let parts = |k: usize| (0..states.len()).filter(|i| !unseen[(*i, k)].is_zero()).collect::<Vec<usize>>();
    let alone = (0..unseen.columns()).map(parts).min_by_key(Vec::len).unwrap_or_default();
    let name = |i: &usize| states[*i].0.as_str();
    let message = match alone.as_slice() {
        [one] => format!("not observable: nothing that is measured depends on `{}`", name(one)),
        several => {
            let k = (0..unseen.columns()).find(|k| parts(*k) == *several).unwrap_or(0);
            let share =
                |i: &usize| format!("`{}` by {} {}", name(i), rational_to_f64(&unseen[(*i, k)]), states[*i].2.si());
            let shares: Vec<String> = several.iter().map(|i| share(i).trim_end().to_string()).collect();
            format!("not observable: {} may change together, and nothing that is measured shows it", shares.join(", "))
        }
    };
    Err(mistake(
        "measured",
        message,
        "measure more, or take a state out of `states` and put what is known of it into `rates`",
    ))
}

/// The polynomial of the poles, checked.
fn polynomial(wiring: &Wiring<'_>, states: usize) -> Result<Polynomial, Mistake> {
    let poles = wiring.values.poles("poles").unwrap_or_default();
    if poles.len() != states {
        let message = format!("{} `poles` for {states} states", poles.len());
        return Err(mistake("poles", message, "write one for each state; `\"-14 ± 14.3j\"` are two"));
    }
    let time = wiring.sample_time.as_ref().map(|time| time.to_rational());
    for (re, im) in poles {
        let (re, im) = (re.to_f64(), im.to_f64());
        if re >= 0.0 {
            let message =
                format!("`poles`: the error of the estimate does not decay at a pole with the real part {re} 1/s");
            return Err(mistake("poles", message, "write poles left of 0, such as `-50`"));
        }
        if let Some(half) =
            time.as_ref().map(|time| std::f64::consts::PI / rational_to_f64(time)).filter(|half| im.abs() >= *half)
        {
            let message = format!(
                "`poles`: {} 1/s is not below the half of the sampling, {half} 1/s: samples do not show that",
                im.abs()
            );
            return Err(mistake("poles", message, "make the imaginary part smaller, or the sample time shorter"));
        }
    }
    let alone =
        || mistake("poles", "`poles`: a complex one stands without its conjugate", "write a pair, `-14 ± 14.3j`");
    of_poles(poles, time.as_ref()).ok_or_else(alone)
}

/// L as it is given: a row for each state.
fn given_gain(
    wiring: &Wiring<'_>,
    states: &[State<'_>],
    measured: &[Measured<'_>],
) -> Result<Matrix<Rational>, Mistake> {
    for List { name, .. } in wiring.lists_of("gains") {
        check_name("gains", name, states, "")?;
    }
    let mut out = Matrix::<Rational>::zeros(states.len(), measured.len());
    for (i, (state, _, of)) in states.iter().enumerate() {
        let Some(row) = wiring.lists_of("gains").find(|list| list.name == *state) else {
            return Err(mistake(
                "gains",
                format!("`gains`: there are none for `{state}`"),
                "write one for each measurement, 0 in its unit where there is none",
            ));
        };
        if row.values.len() != measured.len() {
            let message = format!("`gains`: `{state}` has {} for {} measurements", row.values.len(), measured.len());
            return Err(mistake("gains", message, "write one for each, in the order of `measured`"));
        }
        for (k, ((value, found), (name, .., by))) in row.values.iter().zip(measured).enumerate() {
            let mut wanted = wiring.over("gains", *of, *by, -1)?;
            if wiring.sample_time.is_none() {
                wanted = wiring.over("gains", wanted, Dimension::TIME, -1)?;
            }
            if !wanted.is_like(found) {
                let message = format!(
                    "`gains`: that of `{state}` for `{name}`: expected {}, found {}",
                    wanted.noun(),
                    found.noun()
                );
                let help = match wiring.sample_time {
                    Some(_) => {
                        format!("what the estimate changes by at a sample, in a unit such as {}", wanted.example())
                    }
                    None => format!("a rate, in a unit such as {}", wanted.example()),
                };
                return Err(mistake("gains", message, help));
            }
            out[(i, k)] = value.to_rational();
        }
    }
    Ok(out)
}

/// L of a plant that is sampled if it has a sample time, with what is checked of it.
fn gain(
    wiring: &Wiring<'_>,
    plant: &Plant,
    states: &[State<'_>],
    measured: &[Measured<'_>],
) -> Result<Matrix<Rational>, Mistake> {
    let sampled = wiring.sample_time.is_some();
    let gain = match (wiring.values.has("poles"), wiring.values.has("gains")) {
        (true, true) => {
            return Err(mistake(
                "gains",
                "`gains` and `poles` are given: one of them says how fast the estimate follows",
                "take one of them out",
            ));
        }
        (false, false) => {
            let message = "neither `poles` nor `gains` say how fast the estimate follows";
            return Err(mistake("kind", message, "write `poles = [\"-60 ± 60j\"]`, as many as there are states"));
        }
        (false, true) => given_gain(wiring, states, measured)?,
        (true, false) => {
            if let [first, second, ..] = measured {
                let message = format!(
                    "`poles` place gains of one measurement, and there are several: `{}`, `{}`",
                    first.0, second.0
                );
                return Err(mistake("poles", message, "write `gains`, or measure one thing alone"));
            }
            let polynomial = polynomial(wiring, states.len())?;
            let blind = || {
                let message = "at this sample time two motions look alike in all samples, so no gain tells them apart";
                mistake("poles", message, "make the sample time shorter")
            };
            plant.gain(&polynomial).ok_or_else(blind)?
        }
    };
    match sampled {
        true => rounded(&gain).ok_or_else(too_fast),
        false => Ok(gain),
    }
}

/// Refuses gains with which the error stays or grows.
fn check_decays(wiring: &Wiring<'_>, error: &Matrix<Rational>) -> Result<(), Mistake> {
    let sampled = wiring.sample_time.is_some();
    let Some((re, im)) = staying(error, sampled).first().copied() else { return Ok(()) };
    let key = if wiring.values.has("gains") { "gains" } else { "poles" };
    let at = if im == 0.0 { format!("{re}") } else { format!("{re} ± {}j", im.abs()) };
    let why = match sampled {
        true => format!("z = {at} is not within the unit circle"),
        false => format!("the pole {at} 1/s is not left of 0"),
    };
    let message = format!("the error of the estimate does not decay: {why}");
    Err(mistake(key, message, "check the signs of `gains`, or write `poles`"))
}

fn too_fast() -> Mistake {
    let message = "within one sample the states grow or decay beyond what numbers hold";
    mistake("rates", message, "make the sample time shorter, or check the units in `rates`")
}

fn write(wiring: &mut Wiring<'_>) -> Result<(), Mistake> {
    wiring.idle("unit", "each state has the unit in which it starts", "take it out")?;
    let states = states(wiring)?;
    let measured = measured(wiring, &states)?;
    let answers: Vec<String> = measured.iter().map(|(name, ..)| format!("residual_{name}")).collect();
    if let Some((state, ..)) = states.iter().find(|(state, ..)| answers.contains(state)) {
        let message = format!("`states`: `{state}` is what is left of a measurement, so no state is called like that");
        return Err(mistake("states", message, "choose another name"));
    }
    let of_states: Vec<&str> = states.iter().map(|(name, ..)| name.as_str()).collect();
    let of_measured: Vec<&str> = measured.iter().map(|(name, ..)| name.as_str()).collect();
    let (a, known) = linear(wiring, &states, ("rates", &of_states), &rates(wiring, &states)?)?;
    let said: Vec<Traced<'_>> = measured.iter().map(|(_, _, said, _)| *said).collect();
    let (c, offsets) = linear(wiring, &states, ("predicted", &of_measured), &said)?;
    let mut plant = Plant { a, c };
    if wiring.values.has("poles") {
        check_seen(&plant, &states)?;
    }
    let seen: Vec<Traced<'_>> = measured.iter().zip(offsets).map(|((_, value, ..), offset)| *value - offset).collect();
    let mut b = Matrix::<Rational>::identity(states.len());
    if let Some(time) = &wiring.sample_time {
        let [transition, integral] = held(&plant.a, &time.to_rational()).ok_or_else(too_fast)?;
        // What kardan places is placed for all digits, and rounded once.
        plant.a = settled(transition, &plant.a, &time.to_rational());
        b = rounded(&integral).ok_or_else(too_fast)?;
    }
    let gain = gain(wiring, &plant, &states, &measured)?;
    if wiring.sample_time.is_some() {
        plant.a = rounded(&plant.a).ok_or_else(too_fast)?;
    }
    check_decays(wiring, &plant.error(&gain))?;
    let numbers = |matrix: &Matrix<Rational>| -> Vec<Traced<'_>> {
        matrix.as_slice().iter().map(|x| rational(wiring.graph, x.clone())).collect()
    };
    let [a, b, c, gain] = [&plant.a, &b, &plant.c, &gain].map(numbers);
    let block = kardan_rt::Observer { a: &a, b: &b, c: &c, gain: &gain };
    let first = wiring.memory.len();
    let mut memory = vec![Wiring::zero(); states.len()];
    memory.extend(states.iter().map(|(_, start, _)| wiring.remember(*start)));
    // A step of the block is the rate of its states where it runs at every instant: the same sum, of other matrices.
    let _ = block.step(&known, &seen, &mut memory);
    let (now, next) = memory.split_at(states.len());
    wiring.next(first, next);
    for ((name, _, dimension), value) in states.iter().zip(now) {
        wiring.answer_as(name, *value, *dimension);
    }
    for (k, ((.., dimension), name)) in measured.iter().zip(&answers).enumerate() {
        let row = c.iter().skip(k * states.len());
        let said = row.zip(now).fold(Wiring::zero(), |sum, (c, x)| sum + *c * *x);
        wiring.answer_as(name, seen[k] - said, *dimension);
    }
    Ok(())
}
