//! Every kind of element and every law through one harness each, then closed-form runs with a sketch above each.
//!
//! The harnesses walk the registries: a new element or law is tested by being listed there, around its own `example`.

use std::collections::BTreeSet;

use crate::common::multipliers::Multipliers;
use crate::common::*;
use kardan::assemble::assemble;
use kardan::element;
use kardan::equations::{Domain, GROUND, InputKind, Term};
use kardan::model;
use kardan::num::{Definiteness, Matrix, Rational, definiteness};
use kardan::reduce::{Reduced, linearise};
use kardan::results::Run;
use kardan::schema::{Field, Kind, Table, Value};
use kardan::synthesis::{self, ChannelDesign, LinearLaw, Observation, design_noninteracting};

// ---- all elements -------------------------------------------------------------------------------------------------

/// Nodes that a table names, but ground.
fn nodes_in(fields: &[Field], table: &Table) -> BTreeSet<String> {
    let nodes = fields.iter().filter(|field| field.kind == Kind::Node).filter_map(|field| table.values.get(field.name));
    let word = |value: &Value| if let Value::Word(name) = value { Some(name.clone()) } else { None };
    nodes.filter_map(|spanned| word(&spanned.value)).filter(|name| name != GROUND).collect()
}

/// Masses that a table names.
fn masses_in(fields: &[Field], table: &Table) -> BTreeSet<String> {
    let named = fields.iter().filter(|field| field.kind == Kind::Mass).filter_map(|field| table.values.get(field.name));
    let word = |value: &Value| if let Value::Word(name) = value { Some(name.clone()) } else { None };
    named.filter_map(|spanned| word(&spanned.value)).collect()
}

/// Shafts that a table names.
fn shafts_in(fields: &[Field], table: &Table, out: &mut BTreeSet<String>) {
    for field in fields {
        let Some(value) = table.values.get(field.name).map(|spanned| &spanned.value) else { continue };
        match (field.kind, value) {
            (Kind::Shaft | Kind::Body, Value::Word(name)) => {
                out.insert(name.clone());
            }
            (Kind::Shafts(_), Value::Names(names)) => out.extend(names.iter().map(|name| name.value.clone())),
            (Kind::Coefficients, Value::Map(entries)) => out.extend(entries.iter().map(|(name, _)| name.value.clone())),
            (Kind::Tables(fields), Value::Tables(tables)) => {
                tables.iter().for_each(|table| shafts_in(fields, table, out))
            }
            _ => {}
        }
    }
}

/// The tables of a model around an element's example: its shafts with different inertias, damping and friction, one more
/// shaft, springs from that one to all, a motor on it, and a disturbance on the last.
///
/// Every shaft keeps a freedom of its own but those that the example ties. Each node of the example is reached by a source
/// through a resistor and a coil, and a coil and a capacitor lead from there to ground.
fn tables_with(kind: &element::Element) -> Vec<String> {
    let (document, diagnostics) = model::read(kind.example);
    // The example alone may lack a shaft; all else is right.
    assert!(
        diagnostics.iter().all(|d| d.code == "model::no-shaft"),
        "the example of `{}`: {diagnostics:?}",
        kind.keyword
    );
    let instance =
        document.elements.first().unwrap_or_else(|| panic!("the example of `{}` has no element", kind.keyword));
    assert_eq!(instance.kind.keyword, kind.keyword);
    let mut shafts = BTreeSet::new();
    shafts_in(kind.fields, &instance.table, &mut shafts);
    let declared: BTreeSet<String> =
        document.elements.iter().filter(|e| e.kind.keyword == "shaft").map(|e| e.name.clone()).collect();
    let mut tables = vec![kind.example.to_string()];
    let needed = shafts.iter().filter(|shaft| !declared.contains(*shaft));
    for (k, shaft) in needed.chain(std::iter::once(&"base".to_string())).enumerate() {
        tables.push(format!(
            "[shaft.{shaft}]\ninertia = \"0.{} kg m^2\"\ndamping = \"0.0{} N m s/rad\"\nfriction = \"0.0{} N m\"\n",
            3 + k,
            1 + k,
            1 + k
        ));
    }
    for (k, shaft) in shafts.union(&declared).enumerate() {
        tables.push(format!(
            "[spring_damper.to_{shaft}]\nshaft_1 = \"base\"\nshaft_2 = \"{shaft}\"\nstiffness = \"{} N m/rad\"\n\
             damping = \"0.{} N m s/rad\"\nfriction = \"0.0{} N m\"\n",
            5 + 3 * k,
            1 + k,
            2 + k
        ));
    }
    let mut masses = masses_in(kind.fields, &instance.table);
    for (k, mass) in masses.iter().enumerate() {
        tables.push(format!(
            "[mass.{mass}]\nmass = \"1.{k} kg\"\ndamping = \"0.{} N s/m\"\nfriction = \"0.{} N\"\n",
            2 + k,
            1 + k
        ));
    }
    masses.extend(document.elements.iter().filter(|e| e.kind.keyword == "mass").map(|e| e.name.clone()));
    for (k, mass) in masses.iter().enumerate() {
        tables.push(format!(
            "[spring_damper.of_{mass}]\nmass_1 = \"{mass}\"\nstiffness = \"{} N/m\"\ndamping = \"0.{} N s/m\"\n\
             [disturbance.on_{mass}]\nmass = \"{mass}\"\n",
            20 + 7 * k,
            3 + k
        ));
    }
    tables.push("[motor.drive]\nshaft = \"base\"\n".into());
    for (k, node) in nodes_in(kind.fields, &instance.table).into_iter().enumerate() {
        let parts = [
            ("voltage_source", "ground".to_string(), format!("s_{k}"), String::new()),
            ("resistor", format!("s_{k}"), format!("r_{k}"), format!("resistance = \"{} Ohm\"", 2 + k)),
            ("inductor", format!("r_{k}"), node.clone(), format!("inductance = \"0.{} H\"", 2 + k)),
            ("inductor", node, format!("l_{k}"), format!("inductance = \"0.{} H\"", 5 + k)),
            ("capacitor", format!("l_{k}"), "ground".to_string(), format!("capacitance = \"{} mF\"", 30 + k)),
        ];
        for (part, (keyword, from, to, value)) in parts.into_iter().enumerate() {
            tables.push(format!("[{keyword}.part_{k}_{part}]\nfrom = \"{from}\"\nto = \"{to}\"\n{value}\n"));
        }
    }
    tables
}

/// Steps and ramps of everything that the scenario can set in the model.
fn driven(tables: &[String]) -> String {
    let bare = tables.concat();
    let equations = first(&bare).reduced.equations.clone();
    let mut out = "[scenario]\nduration = \"3 s\"\noutput_step = \"5 ms\"\n".to_string();
    for (k, input) in equations.inputs.iter().enumerate() {
        let effort = equations.domain_of(input).effort();
        let signal = match input.value {
            InputKind::Motor(_) => effort.of(&input.element),
            InputKind::Disturbance => input.element.clone(),
        };
        let unit = effort.unit();
        for (at, to, over) in [(0.1, 2.0, 0.0), (0.8, -1.0, 0.5), (2.0, 0.0, 0.0)] {
            out += &format!(
                "[[scenario.event]]\nat = \"{} s\"\nsignal = \"{signal}\"\nto = \"{to} {unit}\"\nover = \"{over} s\"\n",
                at + 0.05 * k as f64
            );
        }
    }
    out
}

/// Torque and speed of each coordinate that a constraint acts on: of a node its potential and the currents that leave it,
/// of a transformer voltages and currents of its windings.
fn shares(run: &Run, reduced: &Reduced, element: &str) -> Vec<(Vec<f64>, Vec<f64>)> {
    let equations = &reduced.equations;
    let read = |name: String| signal(run, &name).to_vec();
    let row =
        equations.constraints.iter().find(|row| row.element == element && equations.domain_of(row) == Domain::Charge);
    let Some(row) = row else {
        return equations
            .coordinates
            .iter()
            .zip(&equations.domains)
            .map(|(body, domain)| (format!("{element}.{}", domain.effort().of(body)), domain.motion()[1].of(body)))
            .filter(|(torque, _)| run.series.signal(torque).is_some())
            .map(|(torque, speed)| (read(torque), read(speed)))
            .collect();
    };
    let name = |charge: usize| &equations.coordinates[charge];
    let currents = row.row_f64().into_iter().map(|(charge, x)| (charge, x, read(format!("{}.i", name(charge)))));
    if !equations.nodes.iter().any(|node| node == element) {
        return currents.map(|(charge, _, current)| (read(format!("{}.v", name(charge))), current)).collect();
    }
    let out = |x: f64, current: Vec<f64>| current.into_iter().map(|i| x * i).collect();
    currents.map(|(_, x, current)| (read(format!("{element}.v")), out(x, current))).collect()
}

/// Ideal constraints do no work: over the shafts of each element, torque times speed sums to zero in every row.
///
/// The multiplier drops out, so that only the rounding of speeds and coefficients is left: 1e-12 of the shares.
fn constraints_do_no_work(run: &Run, source: &str) -> usize {
    let reduced = first(source).reduced.clone();
    let elements = Multipliers::new(&reduced).elements;
    // A prescribed motion does work: the balance of energy counts it.
    for element in elements.iter().filter(|element| !reduced.equations.moving.contains_key(*element)) {
        let pairs = shares(run, &reduced, element);
        assert!(!pairs.is_empty(), "`{element}` shows no constraint torques");
        let mut moved = false;
        for row in 0..run.series.time.len() {
            let power: f64 = pairs.iter().map(|(torque, speed)| torque[row] * speed[row]).sum();
            let shares: f64 = pairs.iter().map(|(torque, speed)| (torque[row] * speed[row]).abs()).sum();
            assert!(
                power.abs() <= 1e-12 * shares + 1e-15,
                "`{element}` does {power:e} W at {} s",
                run.series.time[row]
            );
            moved |= shares > 1e-6;
        }
        assert!(moved, "`{element}` carries torque while it moves");
    }
    elements.len()
}

/// The energy balance closes to the tolerance of the integrator, a relative 1e-10 per step over some hundred steps.
fn balanced(run: &Run, what: &str) {
    let e = run.energy;
    let scale = e.input.abs() + e.stored.abs() + e.dissipated.abs();
    assert!(scale > 1e-3, "{what}: nothing moved: {e:?}");
    assert!(e.residual.abs() <= 1e-8 * scale, "{what}: {e:?}");
    assert!(e.dissipated >= 0.0, "{what}: {e:?}");
}

#[test]
fn every_element_keeps_the_laws() {
    let mut exercised = BTreeSet::new();
    let mut constraints = 0;
    for kind in element::REGISTRY {
        let mut tables = tables_with(kind);
        if kind.keyword == "prescribed_motion" {
            // Friction along a prescribed motion is refused.
            tables.iter_mut().for_each(|table| {
                *table = table.replace("friction", "# friction").replace("motor.drive", "motor.push")
            });
        }
        let source = tables.concat() + &driven(&tables);
        let variant = first(&source);
        // Symmetric and positive semidefinite, of its own terms and of all together.
        let parts: Vec<String> = model::read(kind.example).0.elements.iter().map(|part| part.name.clone()).collect();
        let is_own = |element: &String| kind.example.contains(element) || parts.contains(element);
        let own: Vec<_> = variant.model.terms.iter().filter(|t| is_own(&t.element)).cloned().collect();
        assert!(!own.is_empty(), "`{}` makes terms", kind.keyword);
        for terms in [&own, &variant.model.terms] {
            let equations = assemble(&variant.model.all_coordinates, terms);
            for matrix in [equations.inertia_matrix(), equations.damping_matrix(), equations.stiffness_matrix()] {
                assert_eq!(matrix, matrix.transpose(), "{}", kind.keyword);
                let indefinite = matches!(definiteness(&matrix), Definiteness::Indefinite { .. });
                assert!(!indefinite, "{}", kind.keyword);
            }
        }
        // Coefficients that cannot be negative in a passive law.
        for named in &own {
            if let Term::Friction { torque, .. } = &named.term {
                assert!(torque.signum() > 0, "{}", kind.keyword);
            }
        }
        let result = run(&source);
        balanced(&result, kind.keyword);
        constraints += constraints_do_no_work(&result, &source);
        // The order of the tables does not matter, to the last bit.
        let scenario = driven(&tables);
        tables.reverse();
        let reversed = run(&(tables.concat() + &scenario));
        assert_eq!((&reversed.series, &reversed.events), (&result.series, &result.events), "{}", kind.keyword);
        exercised.insert(kind.keyword);
    }
    assert!(!exercised.is_empty());
    assert_eq!(exercised.len(), element::REGISTRY.len(), "keywords are different");
    assert!(constraints >= 30, "only {constraints} constraints were seen");
}

/// All elements of the registry in one model would hide a missing example: each file name is a keyword too.
#[test]
fn every_file_of_the_folder_is_in_the_registry() {
    for (folder, keywords) in [
        ("kardan-elements/src/element", element::REGISTRY.iter().map(|kind| kind.keyword).collect::<BTreeSet<_>>()),
        ("kardan-synthesis/src/law", synthesis::REGISTRY.iter().map(|law| law.keyword).collect()),
    ] {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(folder);
        let files: BTreeSet<String> = std::fs::read_dir(path)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| !path.ends_with("mod.rs") && !path.ends_with("shared"))
            .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
            .collect();
        assert_eq!(files, keywords.iter().map(|word| word.to_string()).collect(), "{folder}");
    }
}

// ---- all laws -----------------------------------------------------------------------------------------------------

/// The steering system without its laws, requirements and plots, with another law's example.
fn steering_with(law: &str) -> String {
    let source = model::builtin("sia-steering").expect("built in").source;
    let plant = &source[..source.find("[control.").expect("its laws")];
    format!("{plant}\n{law}")
}

#[test]
fn every_law_equals_its_gains() {
    let mut exercised = BTreeSet::new();
    for kind in synthesis::REGISTRY {
        let variant = first(&steering_with(kind.example));
        let laws = &variant.designed;
        assert_eq!(laws.len(), 1, "the example of `{}` is one law", kind.keyword);
        let law = &*laws[0];
        let mut runtime = law.run();
        assert_eq!(law.describe().law, kind.keyword);
        let (m, n) = (law.inputs().len(), variant.reduced.equations.coordinates.len());
        assert!(m > 0);
        let references = vec![0.0; law.references().len()];
        let LinearLaw { on_angles, on_speeds, .. } = law.linear();
        assert_eq!((on_angles.rows(), on_angles.columns()), (m, n));
        let states = vec![0.0; law.states().len()];
        let mut base = vec![0.0; m];
        let zeros = vec![0.0; n];
        let nothing = Observation {
            time: 0.0,
            angles: &zeros,
            speeds: &zeros,
            references: &references,
            disturbances: &[],
            readings: &[],
            states: &states,
        };
        runtime.command(nothing, &mut base);
        assert!(base.iter().all(|u| *u == 0.0), "at rest with nothing asked, nothing is commanded");
        // Linear in the state: one evaluation per column gives the gain but for rounding of its own terms.
        for shaft in 0..n {
            let mut unit = vec![0.0; n];
            unit[shaft] = 1.0;
            for (gains, on_angle) in [(&on_angles, true), (&on_speeds, false)] {
                let (angles, speeds) =
                    if on_angle { (unit.clone(), vec![0.0; n]) } else { (vec![0.0; n], unit.clone()) };
                let mut out = vec![0.0; m];
                runtime.command(Observation { angles: &angles, speeds: &speeds, ..nothing }, &mut out);
                for input in 0..m {
                    close(out[input], gains[(input, shaft)], 1e-12, &format!("{} gain {input}, {shaft}", kind.keyword));
                }
            }
        }
        if let Some(clock) = law.clock() {
            // The next states too, and the sampled loop is stable but for motions that nobody holds, at one.
            let linear = law.linear();
            let states_of = |column: &Matrix<f64>, shaft: usize| {
                (0..states.len()).map(move |i| column[(i, shaft)]).collect::<Vec<_>>()
            };
            for shaft in 0..n {
                let mut unit = vec![0.0; n];
                unit[shaft] = 1.0;
                let (mut command, mut next) = (vec![0.0; m], vec![0.0; states.len()]);
                let observation = Observation { angles: &unit, ..nothing };
                runtime.command(observation, &mut command);
                runtime.next(observation, &base, &mut next);
                for (found, expected) in next.iter().zip(states_of(&linear.angles, shaft)) {
                    close(*found, expected, 1e-9, &format!("{} next state after shaft {shaft}", kind.keyword));
                }
            }
            let plant = &variant.design_models[0];
            let plant = synthesis::LoopPlant::new(&plant.linear, &plant.lags());
            let parts = [synthesis::SampledPart::of(law, &plant)];
            let found = synthesis::SampledLoop::new(&plant, &parts).expect("a loop");
            assert_eq!(found.period, clock.period);
            let controlled =
                found.multipliers().expect("eigenvalues").into_iter().filter(|(re, im)| (re - 1.0).hypot(*im) > 1e-5);
            controlled.for_each(|(re, im)| assert!(re.hypot(im) < 1.0, "{}: {re} {im}", kind.keyword));
            exercised.insert(kind.keyword);
            continue;
        }
        // In closed loop without friction the linear model is stable where the law says so: no pole to the right beyond
        // what a double pole at zero makes of rounding, √(1e-16 · 1e6) = 1e-5 1/s.
        let poles = kardan::synthesis::closed_loop_poles(&variant.design_models[0].linear, laws).expect("poles");
        assert!(poles.iter().all(|pole| pole.re < 1e-4), "{}: {poles:?}", kind.keyword);
        exercised.insert(kind.keyword);
    }
    assert!(!exercised.is_empty());
    assert_eq!(exercised.len(), synthesis::REGISTRY.len());
}

/// `C H⁻¹ (F (Kx x + Ku v) − D q̇ − S q) = v` for every pair of outputs and every pair of inputs that can be decoupled, as
/// an identity of fractions; the others are refused with the exact rank.
#[test]
fn noninteracting_decouples_exactly() {
    let variant = first(model::builtin("sia-steering").expect("built in").source);
    let model = linearise(&variant.reduced, &[0.0; 3]);
    let (shafts, inputs) = (variant.reduced.equations.coordinates.len(), model.inputs.len());
    let (mut designed, mut refused) = (0, 0);
    for (a, b) in pairs(shafts) {
        for (u, v) in pairs(inputs) {
            let channels = [ChannelDesign { shaft: a, input: u }, ChannelDesign { shaft: b, input: v }];
            let names = |c: &ChannelDesign| (format!("output {}", c.shaft), format!("input {}", c.input));
            let c = Matrix::from_fn(2, 3, |i, j| model.basis[(channels[i].shaft, j)].clone());
            let f = Matrix::from_fn(3, 2, |i, j| model.input[(i, channels[j].input)].clone());
            let weighted = model.inertia.solve(&c.transpose()).expect("positive definite").transpose();
            let determinant = {
                let m = weighted.multiply(&f);
                &m[(0, 0)] * &m[(1, 1)] - &m[(0, 1)] * &m[(1, 0)]
            };
            match design_noninteracting(&model, &channels, &names) {
                Ok(design) => {
                    let reached = weighted.multiply(&f).multiply(&design.acceleration_gain);
                    assert_eq!(reached, Matrix::identity(2));
                    let fed_back = f.multiply(&design.state_gain);
                    let remainder = Matrix::from_fn(3, 6, |i, j| {
                        let passive = if j < 3 { &model.stiffness[(i, j)] } else { &model.damping[(i, j - 3)] };
                        &fed_back[(i, j)] - passive
                    });
                    assert!(weighted.multiply(&remainder).as_slice().iter().all(|x| *x == Rational::ZERO));
                    designed += 1;
                }
                Err(_) => {
                    assert_eq!(determinant, Rational::ZERO);
                    refused += 1;
                }
            }
        }
    }
    assert!(designed > 10 && refused > 0, "{designed} designed, {refused} refused");
}

fn pairs(n: usize) -> Vec<(usize, usize)> {
    (0..n).flat_map(|a| (0..n).filter(move |b| *b != a).map(move |b| (a, b))).collect()
}

// ---- closed forms -------------------------------------------------------------------------------------------------
//
// Unless stated otherwise, 1e-8 is asked: the integrator allows a relative 1e-10 per step, and a run takes up to a
// hundred steps whose errors add at worst.

const ACCURATE: f64 = 1e-8;

fn body(name: &str, inertia: f64, keys: &str) -> String {
    format!("[shaft.{name}]\ninertia = \"{inertia} kg m^2\"\n{keys}\n")
}

fn motor(name: &str, shaft: &str, keys: &str) -> String {
    format!("[motor.{name}]\nshaft = \"{shaft}\"\n{keys}\n")
}

fn event(at: f64, signal: &str, to: f64, over: f64) -> String {
    format!("[[scenario.event]]\nat = \"{at} s\"\nsignal = \"{signal}\"\nto = \"{to} N m\"\nover = \"{over} s\"\n")
}

fn scenario(duration: f64, step: f64, initial: &str) -> String {
    format!("[scenario]\nduration = \"{duration} s\"\noutput_step = \"{step} s\"\ninitial = {{ {initial} }}\n")
}

/// All rows of a signal against a closed form over time.
#[track_caller]
fn follows(run: &Run, name: &str, tolerance: f64, closed: impl Fn(f64) -> f64) {
    let values = signal(run, name);
    assert!(values.len() > 10);
    for (time, value) in run.series.time.iter().zip(values) {
        close(*value, closed(*time), tolerance, &format!("{name} at {time} s"));
    }
}

/// ```text
///   housing |--/\/\/-- [ J ]        φ = φ0 cos √(s/J) t
///               s
/// ```
#[test]
fn spring_mass_oscillator() {
    let model = body("a", 0.5, "")
        + "[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"8 N m/rad\"\nrest = \"0.25 rad\"\n"
        + &scenario(3.0, 0.01, "\"a.phi\" = \"1.5 rad\"");
    let run = run(&model);
    follows(&run, "a.phi", ACCURATE, |t| 0.25 + 1.25 * (4.0 * t).cos());
    follows(&run, "a.w", ACCURATE, |t| -5.0 * (4.0 * t).sin());
    follows(&run, "k.tau", ACCURATE, |t| 10.0 * (4.0 * t).cos());
    // No loss: the energy s·1.25²/2 stays.
    assert_eq!((run.energy.input, run.energy.dissipated), (0.0, 0.0));
    assert!(run.energy.stored.abs() < 1e-8 * 6.25);
}

/// ```text
///   housing |--/\/\/-- [ J ]        φ = e^(−δt) (φ0 cos ωt + (φ0 δ/ω) sin ωt)
///           |--[ d ]--              δ = d/2J, ω² = s/J − δ²
/// ```
#[test]
fn damped_oscillator() {
    let model = body("a", 0.5, "")
        + "[spring_damper.k]\nshaft_1 = \"a\"\nstiffness = \"8.5 N m/rad\"\ndamping = \"1 N m s/rad\"\n"
        + &scenario(3.0, 0.01, "\"a.phi\" = \"1 rad\"");
    let run = run(&model);
    follows(&run, "a.phi", ACCURATE, |t| (-t).exp() * ((4.0 * t).cos() + 0.25 * (4.0 * t).sin()));
    let remaining = (-6.0_f64).exp() * 4.25; // no more than this is left after 3 s
    close(run.energy.dissipated, 4.25, remaining, "the energy goes into the damper");
}

/// ```text
///   τ → [ J1 ]====[ ]               q1 = i q2: J1 + J2/i² is felt at shaft 1
///                 [ ]               a constant torque: φ = τ t² / 2 (J1 + J2/i²)
///                 [ ]====[ J2 ]     on shaft 2 acts τ i J2/(i² J1 + J2)
/// ```
#[test]
fn gear_with_reflected_inertia() {
    let model = body("a", 0.5, "")
        + &body("b", 12.0, "")
        + "[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = -4\n"
        + &motor("m", "a", "")
        + &scenario(2.0, 0.01, "")
        + &event(0.0, "m.tau", 5.0, 0.0);
    let run = run(&model);
    let acceleration = 5.0 / (0.5 + 12.0 / 16.0);
    follows(&run, "a.w", ACCURATE, |t| acceleration * t);
    follows(&run, "b.phi", ACCURATE, |t| -acceleration / 4.0 * t * t / 2.0);
    follows(&run, "g.b.tau", ACCURATE, |_| 12.0 * -acceleration / 4.0);
    follows(&run, "g.a.tau", ACCURATE, |_| 0.5 * acceleration - 5.0);
}

/// ```text
///   ring  ======[     ]
///   held -------[  o  ]======= carrier     30 w_sun + 70 w_ring − 100 w_carrier = 0
///   sun   ======[     ]                    w_ring = 0: carrier at 0.3 of the sun
/// ```
#[test]
fn planetary_with_a_fixed_ring() {
    let model = body("sun", 0.1, "")
        + &body("carrier", 2.0, "")
        + &body("ring", 3.0, "")
        + "[planetary.p]\nsun = \"sun\"\nring = \"ring\"\ncarrier = \"carrier\"\nsun_teeth = 30\nring_teeth = 70\n\
           [constraint.hold]\ncoefficients = { ring = 1 }\n"
        + &motor("m", "sun", "")
        + &scenario(1.0, 0.01, "")
        + &event(0.0, "m.tau", 1.4, 0.0);
    let run = run(&model);
    let acceleration = 1.4 / (0.1 + 0.09 * 2.0);
    follows(&run, "sun.w", ACCURATE, |t| acceleration * t);
    follows(&run, "carrier.w", ACCURATE, |t| 0.3 * acceleration * t);
    assert!(signal(&run, "ring.w").iter().all(|w| *w == 0.0));
    // The gear pushes the ring with 70 λ, λ = −2 · 0.3 a/100 from the carrier; the hold pushes back.
    let multiplier = -2.0 * 0.3 * acceleration / 100.0;
    follows(&run, "p.tau", ACCURATE, |_| multiplier);
    follows(&run, "hold.tau", ACCURATE, |_| -70.0 * multiplier);
}

/// ```text
///   fs ====(  flexspline  )
///   cs ----( circular sp. ) held      w_fs = −w_wg/i
///   wg ====( wave gen.    )
/// ```
#[test]
fn harmonic_drive_with_a_fixed_spline() {
    let model = body("wg", 0.001, "")
        + &body("fs", 5.0, "")
        + &body("cs", 1.0, "")
        + "[harmonic_drive.hd]\nwave_generator = \"wg\"\ncircular_spline = \"cs\"\nflexspline = \"fs\"\nratio = 50\n\
           [constraint.hold]\ncoefficients = { cs = 1 }\n"
        + &motor("m", "wg", "")
        + &scenario(1.0, 0.01, "")
        + &event(0.0, "m.tau", 0.3, 0.0);
    let run = run(&model);
    let acceleration = 0.3 / (0.001 + 5.0 / 2500.0);
    follows(&run, "wg.w", ACCURATE, |t| acceleration * t);
    follows(&run, "fs.w", ACCURATE, |t| -acceleration / 50.0 * t);
    // Torques on the shafts are as 1 : −51 : 50.
    follows(&run, "hd.fs.tau", ACCURATE, |_| -5.0 * acceleration / 50.0);
    follows(&run, "hd.cs.tau", ACCURATE, |_| 51.0 / 50.0 * 5.0 * acceleration / 50.0);
}

/// ```text
///   a ======+ .                      w_a/w_b = C/(cos² φ_b + C² sin² φ_b)
///             \\                     between C at φ_b = 0 and 1/C at 90°
///    30°       \\ b, at 2π rad/s
/// ```
#[test]
fn universal_joint_over_one_revolution() {
    let c = 30.0_f64.to_radians().cos();
    let model = body("b", 1.0, "")
        + "[shaft.a]\n[universal_joint.j]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"30 deg\"\n"
        + &scenario(1.0, 0.0025, "\"b.w\" = \"360 deg/s\"");
    // The only inertia is on b, which then turns evenly.
    let run = run(&model);
    let revolution = std::f64::consts::TAU;
    follows(&run, "b.phi", ACCURATE, |t| revolution * t);
    follows(&run, "a.w", ACCURATE, |t| {
        let (sin, cos) = (revolution * t).sin_cos();
        revolution * c / (cos * cos + c * c * sin * sin)
    });
    let speeds = signal(&run, "a.w");
    let (least, most) = speeds.iter().fold((f64::MAX, 0.0f64), |(low, high), w| (low.min(*w), high.max(*w)));
    close(least, revolution * c, ACCURATE, "slowest");
    close(most, revolution / c, ACCURATE, "fastest");
    close(at(&run, "a.phi", 1.0), revolution, ACCURATE, "a whole turn is a whole turn");
    assert!(signal(&run, "j.tau").iter().all(|torque| torque.abs() < ACCURATE), "a carries no load");
}

/// ```text
///   w0 → [ J ]           |w| falls by c/J per time, is zero at t = J w0/c,
///         | c            and stays exactly there
///      -------
/// ```
#[test]
fn coulomb_block_stops_and_sticks() {
    let model = body("a", 0.5, "friction = \"2 N m\"") + &scenario(2.0, 0.01, "\"a.w\" = \"3 rad/s\"");
    let run = run(&model);
    let stop = 0.5 * 3.0 / 2.0;
    // Located on the dense output, which is exact for a parabola: the time is right to its last bits.
    close(time_of(&run, "a sticks"), stop, 1e-13, "stop");
    follows(&run, "a.w", 1e-12, |t| (3.0 - 4.0 * t).max(0.0));
    for (time, speed) in run.series.time.iter().zip(signal(&run, "a.w")) {
        // The row at the stop itself may lie one ulp of time before it.
        assert!(*time < stop + 1e-12 || *speed == 0.0, "{speed} at {time} s");
    }
    let angles = signal(&run, "a.phi");
    let after = run.series.time.iter().position(|t| *t > stop).expect("rows after the stop");
    assert!(angles[after..].iter().all(|phi| *phi == angles[after]), "no creep");
    close(angles[after], 0.5 * 3.0 * 3.0 / 2.0 / 2.0, 1e-12, "way to the stop, J w0²/2c");
    close(run.energy.dissipated, 0.5 * 0.5 * 9.0, 1e-12, "all energy goes into friction");
}

/// ```text
///   τ = 0.999 c → [ J ]      1000 s: not one bit of motion, and the friction torque is τ
///                  | c
///               -------
/// ```
#[test]
fn stiction_lasts_1000_s() {
    let model = body("a", 0.5, "friction = \"2 N m\"")
        + &motor("m", "a", "")
        + &scenario(1000.0, 1.0, "")
        + &event(1.0, "m.tau", 1.998, 10.0);
    let run = run(&model);
    assert!(signal(&run, "a.phi").iter().chain(signal(&run, "a.w")).all(|x| *x == 0.0));
    close(at(&run, "a.friction", 1000.0), 1.998, 1e-14, "friction torque");
    close(at(&run, "a.friction", 6.0), 0.999, 1e-14, "friction torque on the ramp");
    assert_eq!(run.energy.input, 0.0);
}

/// ```text
///   τ → [ J1 ]==1:1==[ J2 ]      two frictions on one freedom: τ is shared, and the split is not unique
///         | c1         | c2      (the note says so); together they hold c1 + c2
///      -------      -------
/// ```
#[test]
fn parallel_frictions_share() {
    let model = body("a", 0.5, "friction = \"2 N m\"")
        + &body("b", 0.25, "friction = \"1 N m\"")
        + "[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 1\n"
        + &motor("m", "a", "")
        + &scenario(4.0, 0.01, "")
        + &event(0.0, "m.tau", 4.0, 4.0);
    let run = run(&model);
    assert_eq!(
        run.notes.iter().filter(|note| note.contains("`a`, `b`") && note.contains("not unique")).count(),
        1,
        "{:?}",
        run.notes
    );
    for (k, time) in run.series.time.iter().enumerate() {
        let (a, b) = (signal(&run, "a.friction")[k], signal(&run, "b.friction")[k]);
        assert!(a.abs() <= 2.0 + 1e-12 && b.abs() <= 1.0 + 1e-12);
        if *time < 3.0 {
            close(a + b, *time, 1e-12, "together they hold the torque");
        }
    }
    // Breakaway of both at 3 N m: 3 s. A breakaway counts from 1e-9 of the torques on, here 3e-9 s.
    for what in ["a slips forward", "b slips forward"] {
        close(time_of(&run, what), 3.0, 1e-8, what);
    }
    close(at(&run, "a.w", 4.0), 0.5 / 0.75, ACCURATE, "∫ (τ − 3)/(J1 + J2)");
}

/// ```text
///   τ = r t → [ J ]         breaks away at t = c/r, then φ̈ = (r t − c)/J
///              | c
///           -------
/// ```
#[test]
fn ramp_breaks_away() {
    let model = body("a", 0.5, "friction = \"2 N m\"")
        + &motor("m", "a", "")
        + &scenario(4.0, 0.01, "")
        + &event(0.25, "m.tau", 4.0, 3.0);
    let run = run(&model);
    // Rate 4/3 N m/s: 2 N m after 1.5 s. A breakaway counts from 1e-9 of c on, hence 2e-9 s late at most.
    let away = 0.25 + 1.5;
    close(time_of(&run, "a slips forward"), away, 3e-9, "breakaway");
    follows(&run, "a.w", ACCURATE, |t| {
        let ramp = (t.min(3.25) - away).max(0.0);
        4.0 / 3.0 * ramp * ramp / 2.0 / 0.5 + if t > 3.25 { 4.0 * (t - 3.25) } else { 0.0 }
    });
    let before = run.series.time.iter().position(|t| *t > away).expect("rows");
    assert!(signal(&run, "a.w")[..before].iter().all(|w| *w == 0.0));
}

/// ```text
///   command -->[ limit ]-->[ rate ]-->[ 1/(T s + 1) ]--> τ
/// ```
/// A step of 5 N m: cut to 3 N m, reached in 0.2 s at 15 N m/s, and behind it the lag with T = 0.1 s.
#[test]
fn motor_limit_rate_and_lag() {
    let with = |keys: &str| {
        run(&(body("a", 1.0, "")
            + &motor("m", "a", keys)
            + &scenario(1.0, 0.005, "")
            + &event(0.1, "m.tau", 5.0, 0.0)
            + &event(0.7, "m.tau", 1.0, 0.0)))
    };
    let after = |t: f64, start: f64| if t < start { 0.0 } else { t - start };
    let limited = with("torque_limit = \"3 N m\"");
    follows(&limited, "m.tau", 1e-12, |t| {
        if t < 0.1 {
            0.0
        } else if t < 0.7 {
            3.0
        } else {
            1.0
        }
    });
    follows(&limited, "m.command", 1e-12, |t| {
        if t < 0.1 {
            0.0
        } else if t < 0.7 {
            5.0
        } else {
            1.0
        }
    });
    let slow = with("rate_limit = \"15 N m/s\"");
    follows(&slow, "m.tau", ACCURATE, |t| {
        if t < 0.7 { (15.0 * after(t, 0.1)).min(5.0) } else { (5.0 - 15.0 * (t - 0.7)).max(1.0) }
    });
    // At the end the motor has given ∫ τ dt = 5 · 0.6 − 5²/30 + 1 · 0.3 + 4²/30.
    close(at(&slow, "a.w", 1.0), 3.0 - 25.0 / 30.0 + 0.3 + 16.0 / 30.0, ACCURATE, "impulse");
    let lagging = with("lag = \"0.1 s\"");
    let at_step = 5.0 * (1.0 - (-6.0_f64).exp());
    follows(&lagging, "m.tau", ACCURATE, |t| {
        if t < 0.7 {
            5.0 * (1.0 - (-after(t, 0.1) / 0.1).exp())
        } else {
            1.0 + (at_step - 1.0) * (-(t - 0.7) / 0.1).exp()
        }
    });
    let all = with("torque_limit = \"3 N m\"\nrate_limit = \"15 N m/s\"\nlag = \"0.1 s\"");
    // The answer of the lag to a ramp r t is r (t − T + T e^(−t/T)); at 0.3 s the ramp ends at the limit.
    let ramp = |t: f64| 15.0 * (t - 0.1 + 0.1 * (-t / 0.1).exp());
    follows(&all, "m.tau", ACCURATE, |t| match t {
        t if t < 0.3 => ramp(after(t, 0.1)),
        t if t < 0.7 => 3.0 + (ramp(0.2) - 3.0) * (-(t - 0.3) / 0.1).exp(),
        _ => {
            let start = 3.0 + (ramp(0.2) - 3.0) * (-4.0_f64).exp();
            let (rise, since) = (2.0 / 15.0, t - 0.7);
            let falling = |s: f64| 3.0 - ramp(s) + (start - 3.0) * (-s / 0.1).exp();
            if since < rise { falling(since) } else { 1.0 + (falling(rise) - 1.0) * (-(since - rise) / 0.1).exp() }
        }
    });
    assert!(time_of(&all, "m reaches its torque limit") == 0.1);
}

/// ```text
///   φ -->[ floor to 2π/4N ]-->[ hold 10 ms ]--> reading
/// ```
#[test]
fn encoder_quantises_and_samples() {
    let model = body("a", 1.0, "")
        + "[sensor.fine]\nmeasures = \"angle\"\nshaft = \"a\"\nresolution = \"0.125 rad\"\n\
           [sensor.lines]\nmeasures = \"angle\"\nshaft = \"a\"\nlines = 4\nsample_time = \"10 ms\"\n\
           [sensor.speed]\nmeasures = \"speed\"\nshaft = \"a\"\nresolution = \"0.125 rad\"\nsample_time = \"10 ms\"\n"
        + &scenario(1.0, 0.003, "\"a.w\" = \"-3 rad/s\", \"a.phi\" = \"1.0123 rad\"");
    let run = run(&model);
    let floor = |x: f64, step: f64| (x / step).floor() * step;
    let angle = |t: f64| 1.0123 - 3.0 * t;
    // No row or sample comes closer to an edge than 1e-4 rad (1.0123 has a digit more than rows and edges have).
    follows(&run, "fine.phi", 1e-12, |t| floor(angle(t), 0.125));
    let sampled = |t: f64| ((t + 1e-9) / 0.01).floor() * 0.01;
    follows(&run, "lines.phi", 1e-12, |t| floor(angle(sampled(t)), std::f64::consts::TAU / 16.0));
    follows(&run, "speed.w", 1e-9, |t| match sampled(t) {
        s if s < 0.005 => 0.0,
        s => (floor(angle(s), 0.125) - floor(angle(s - 0.01), 0.125)) / 0.01,
    });
}

/// ```text
///   τ:  ___|_|___  1000 N m for 1 µs between two rows      Δw = impulse/J
/// ```
#[test]
fn a_short_pulse_between_rows_is_not_missed() {
    let model = body("a", 0.5, "")
        + &motor("m", "a", "")
        + &scenario(1.0, 0.1, "")
        + "[[scenario.event]]\nat = \"0.333333 s\"\nsignal = \"m.tau\"\nto = \"1000 N m\"\n\
           [[scenario.event]]\nat = \"0.333334 s\"\nsignal = \"m.tau\"\nto = \"0 N m\"\n";
    let run = run(&model);
    // The two times are floats: their difference is 1e-6 to a relative 2⁻⁵³/1e-6 = 1e-10.
    close(at(&run, "a.w", 1.0) / (1000.0 * 1e-6 / 0.5), 1.0, 1e-9, "speed after the pulse");
    assert_eq!(at(&run, "a.w", 0.3), 0.0);
    close(run.energy.stored, 0.25 * 0.002 * 0.002, 1e-12, "energy");
}

/// ```text
///   τ → [ J ]===|hold|        friction on a shaft that cannot move takes no part
/// ```
#[test]
fn friction_on_a_locked_shaft() {
    let model = body("a", 0.5, "friction = \"1 N m\"")
        + &body("b", 0.5, "friction = \"2 N m\"")
        + "[constraint.hold]\ncoefficients = { a = 1 }\n[spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
           stiffness = \"1 N m/rad\"\n"
        + &motor("m", "b", "")
        + &scenario(2.0, 0.01, "")
        + &event(0.5, "m.tau", 3.0, 0.0);
    let run = run(&model);
    assert!(signal(&run, "a.w").iter().all(|w| *w == 0.0));
    // φ̈ = (3 − 2 − φ)/J from 0.5 s on: φ = 1 − cos √2 t, until it comes back to rest at t = π/√2.
    let omega = 2.0_f64.sqrt();
    follows(&run, "b.phi", ACCURATE, |t| if t < 0.5 { 0.0 } else { 1.0 - (omega * (t - 0.5)).cos() });
}
