//! The law `decoupling`: decoupling by state feedback.

use std::cell::RefCell;
use std::sync::Arc;

use crate::channels::{CROSSOVER, DAMPING_RATIO, NATURAL_FREQUENCY, POLES};
use crate::decoupling::{NotDecouplable, decouple, observable_quotient, relative_degrees};
use crate::exact::{decoupling_matrix, gain_matrices};
use crate::inversion::{Obstruction, decouple_blocks, dynamic_extension, finest_blocks, obstruction, reasons};
use crate::linear_law::{Linear, LinearBlock};
use crate::matrix_parts::{side_by_side, stacked, window};
use crate::outputs::{INPUTS, OUTPUT, REFERENCE, Task, channels_for, inputs, references};
use crate::zeros::{check_stable, check_zeros, roots};
use crate::{ExactLaw, ExactLoop, Law, LawKind, Plant, Request, SynthesisError};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational};
use kardan_results::{Design, Feedback};
use kardan_schema::schema::{Keys, LawKeys, keys};

keys! {
    /// A channel of the law `decoupling`.
    table DecouplingChannel {
        required {
            output: Output as OUTPUT;
            reference: Name as REFERENCE;
        }
        optional {
            natural_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as NATURAL_FREQUENCY;
            damping_ratio: Number(Sign::Positive) as DAMPING_RATIO;
            crossover_frequency: Quantity(Dimension::ANGULAR_VELOCITY, Sign::Positive) as CROSSOVER;
            poles: Poles as POLES;
        }
    }
}

law_keys! {
    /// Decoupling by state feedback after Gilbert, \[diss. 6.2.2\].
    law Decoupling("decoupling") {
        required {
            inputs: Elements(&["motor", "voltage_source"]) as INPUTS;
            channels: Tables(DecouplingChannel),
                "One table for each output.";
        }
        optional {
            feedback: Choice(&["static", "block", "dynamic"]) = "static",
                "`static`: state feedback only; `block`: outputs that static feedback cannot decouple form one block; \
                 `dynamic`: integrators before motors where static feedback does not suffice.";
        }
    }
}

/// Decoupling by state feedback after Gilbert, \[diss. 6.2.2\].
pub const DECOUPLING: LawKind = LawKind {
    keyword: Decoupling::KEYWORD,
    summary: "Decoupling by state feedback u = -K x + L r: every chosen output (angle, speed, torque) follows its own \
              reference and no other, decided and designed exactly on the linear model.",
    fields: Decoupling::FIELDS,
    example: "\
[control.column]
law = \"decoupling\"
design = { beta = \"0 deg\" }
inputs = [\"wg_motor\", \"rk_motor\"]

[[control.column.channels]]
output = \"rk.phi\"
reference = \"ref_rk\"
natural_frequency = \"20 rad/s\"
damping_ratio = 0.7

[[control.column.channels]]
output = \"fs.phi\"
reference = \"ref_fs\"
poles = [\"-14 ± 14.3j\"]
",
    template: |inputs, outputs| {
        let channels = channels_for(outputs, |output, reference| DecouplingChannel::new(output, reference));
        Some(Decoupling::new(inputs.to_vec(), channels).entries())
    },
    inputs,
    references,
    samples: false,
    design,
};

/// The most outputs more than inputs whose relations are listed.
const MOST_MORE: usize = 50;

/// The specification for the part of the plant that the outputs show.
struct Observable<'a> {
    request: &'a Request<'a>,
    task: &'a Task,
    system: LinearSystem,
    /// How the disturbances act on its states and on the outputs.
    disturbance: [Matrix<Rational>; 2],
}

/// The gains of `v = −K x + L r − M d` over the states of the system, to which `u = U_x x + U_v v` adds integrators.
struct Gains {
    system: LinearSystem,
    k: Matrix<Rational>,
    l: Matrix<Rational>,
    m: Matrix<Rational>,
    from_state: Matrix<Rational>,
    from_input: Matrix<Rational>,
    /// The unobservable part of the outputs of blocks.
    behind: Option<Polynomial>,
}

impl Observable<'_> {
    fn polynomial(&self, output: usize, degree: usize) -> Result<Polynomial, SynthesisError> {
        let found = self.task.dynamics[output].polynomial(degree);
        found.map_err(|error| SynthesisError::compensation(&self.task.names[output], &error))
    }

    fn polynomials(&self, system: &LinearSystem) -> Result<Vec<Polynomial>, SynthesisError> {
        let degrees = relative_degrees(system).degrees.into_iter().enumerate();
        // The decoupling matrix shows an output that no input reaches.
        degrees
            .map(|(output, degree)| match degree {
                Some(degree) => self.polynomial(output, degree),
                None => Ok(Polynomial::constant(Rational::ONE)),
            })
            .collect()
    }

    /// `u = v` with static gains on the system itself.
    fn by_static_feedback(&self) -> Result<Gains, SynthesisError> {
        let identity = Matrix::identity(self.task.inputs.len());
        let none = Matrix::zeros(self.task.inputs.len(), self.system.states.len());
        self.gains(self.system.clone(), none, identity)
    }

    fn by_dynamic_feedback(&self) -> Result<Gains, SynthesisError> {
        let extension = dynamic_extension(&self.system).map_err(|obstruction| self.impossible(&obstruction))?;
        self.gains(extension.extended, extension.from_state, extension.from_input)
    }

    fn gains(
        &self,
        system: LinearSystem,
        from_state: Matrix<Rational>,
        from_input: Matrix<Rational>,
    ) -> Result<Gains, SynthesisError> {
        let [on_states, on_outputs] = &self.disturbance;
        let integrators = system.states.len() - on_states.rows();
        let on_states = stacked(&[on_states, &Matrix::zeros(integrators, on_states.columns())]);
        let found = decouple(&system, &on_states, Some(on_outputs), &self.polynomials(&system)?);
        let found = found.map_err(|error| self.not_static(&error))?;
        Ok(Gains { system, k: found.k, l: found.l, m: found.m, from_state, from_input, behind: None })
    }

    /// Outputs that static feedback cannot decouple form one block.
    fn in_blocks(&self) -> Result<Gains, SynthesisError> {
        let Some(blocks) = finest_blocks(&self.system) else {
            let why =
                obstruction(&self.system).expect("outputs that do not depend on each other are one block at least");
            return Err(self.impossible(&why));
        };
        let (n, m) = (self.system.states.len(), self.task.inputs.len());
        let wrong = RefCell::new(None);
        let dynamics = |output: usize, order: usize| {
            self.polynomial(output, order).unwrap_or_else(|error| {
                wrong.replace(Some(error));
                Polynomial::from_roots(&vec![Rational::NEG_ONE; order])
            })
        };
        let found = decouple_blocks(&self.system, &blocks, &dynamics)?;
        match wrong.into_inner() {
            Some(error) => Err(error),
            None => Ok(Gains {
                system: self.system.clone(),
                k: found.k,
                l: found.l,
                m: Matrix::zeros(m, self.request.disturbances.len()),
                from_state: Matrix::zeros(m, n),
                from_input: Matrix::identity(m),
                behind: Some(found.hidden),
            }),
        }
    }

    fn impossible(&self, obstruction: &Obstruction) -> SynthesisError {
        let constrained = self.request.plant.constrained(&self.task.inputs);
        let element = |name: &str| self.request.plant.element(name);
        let reasons = reasons(obstruction, &self.task.outputs, &constrained, &element);
        SynthesisError::impossible(&self.task.names, &reasons)
    }

    /// Alternatives where static feedback fails.
    fn not_static(&self, error: &NotDecouplable) -> SynthesisError {
        let extension = match dynamic_extension(&self.system) {
            Ok(extension) => extension,
            Err(obstruction) => return self.impossible(&obstruction),
        };
        let before: Vec<String> = extension
            .chains()
            .into_iter()
            .map(|(input, count)| format!("{count} integrator{} before {input}", if count == 1 { "" } else { "s" }))
            .collect();
        let mut reasons =
            vec![format!("dynamic feedback decouples them, with {}: `feedback = \"dynamic\"`", before.join(" and "))];
        if let Some(blocks) = finest_blocks(&self.system).filter(|blocks| blocks.len() > 1) {
            let block = |block: &Vec<usize>| {
                let names: Vec<&str> = block.iter().map(|&i| self.task.names[i].as_str()).collect();
                format!("{{{}}}", names.join(", "))
            };
            let blocks: Vec<String> = blocks.iter().map(block).collect();
            reasons
                .push(format!("static feedback decouples the blocks {}: `feedback = \"block\"`", blocks.join(" and ")));
        }
        SynthesisError::not_static(&self.task.names, error, &reasons)
    }
}

fn design(request: &Request<'_>) -> Result<Arc<dyn Law>, SynthesisError> {
    let (plant, values) = (request.plant, request.values);
    let task = Task::new(request)?;
    // All relations of very many outputs would take long, and say no more.
    let [outputs, inputs] = [task.outputs.len(), task.inputs.len()];
    if outputs > inputs + MOST_MORE {
        let plural = if inputs == 1 { "" } else { "s" };
        return Err(SynthesisError::impossible(&task.names, &[format!("{outputs} outputs, {inputs} input{plural}")]));
    }
    let quotient = observable_quotient(&task.system, &plant.twists());
    let [torques, direct] = &task.disturbance;
    let shown = Observable {
        request,
        task: &task,
        disturbance: [quotient.project(torques), direct.clone()],
        system: quotient.system.clone(),
    };
    let mut notes: Vec<String> = Vec::new();
    let (found, feedback) = match values.word("feedback") {
        Some("dynamic") => {
            let found = shown.by_dynamic_feedback()?;
            if found.system.states.len() == quotient.system.states.len() {
                notes.push("static feedback suffices: no integrator is needed".into());
                (found, Feedback::Static)
            } else {
                (found, Feedback::Dynamic)
            }
        }
        Some("block") => {
            if !task.disturbed.is_empty() {
                notes.push("block decoupling does not feed estimated disturbances forward".into());
            }
            (shown.in_blocks()?, Feedback::Block)
        }
        _ => (shown.by_static_feedback()?, Feedback::Static),
    };
    match &found.behind {
        Some(behind) => check_stable(behind, &task.names)?,
        None => check_zeros(&found.system, &task.names)?,
    }
    let relative = relative_degrees(&quotient.system);
    let commanded = &found.system.inputs;
    let states = &found.system.states;
    let references = task.reference_names();
    let columns: [&[String]; 3] = [states, &references, &task.disturbed];
    let design = Design {
        controller: request.name.into(),
        law: DECOUPLING.keyword.into(),
        states: states.clone(),
        definitions: quotient.definitions.iter().filter(|one| one.state != one.expression).cloned().collect(),
        hidden: roots(&quotient.hidden),
        decoupling_matrix: decoupling_matrix(&task.names, &task.inputs, &relative),
        relative_degrees: relative.degrees,
        gains: gain_matrices(commanded, columns, [&found.k, &found.l, &found.m]),
        inputs: task.inputs.clone(),
        outputs: task.names.clone(),
        feedback: Some(feedback),
        notes,
        ..Design::default()
    };
    let law = exact_law(&found, &quotient.projection);
    let block = block(&found, &law, plant);
    let mut exact = ExactLoop::feedback(quotient.system, found.system, [&found.k, &found.l], &task.references);
    exact.behind = found.behind;
    exact.law = Some(law);
    let limits: Vec<Option<f64>> = task.inputs.iter().map(|name| plant.torque_reserve(name)).collect();
    Ok(Arc::new(Linear::new(request, design, Some(exact), task.references, block).against_windup(&limits)))
}

/// The law before its gains are rounded, z = P x over the states of the plant.
fn exact_law(found: &Gains, projection: &Matrix<Rational>) -> ExactLaw {
    let Gains { system, k, from_state, from_input, .. } = found;
    let (minus, shown) = (Rational::NEG_ONE, projection.rows());
    let feedback = from_state.plus(&from_input.multiply(k).scale(&minus));
    let closed = system.a.plus(&system.b.multiply(k).scale(&minus));
    let (inputs, all) = (feedback.rows(), system.states.len());
    ExactLaw {
        a: window(&closed, shown..all, shown..all),
        b: window(&closed, shown..all, 0..shown).multiply(projection),
        c: window(&feedback, 0..inputs, shown..all),
        d: window(&feedback, 0..inputs, 0..shown).multiply(projection),
    }
}

/// The law over the reduced coordinates and their speeds, with references and disturbances.
fn block(found: &Gains, law: &ExactLaw, plant: &Plant) -> LinearBlock {
    let Gains { system, l, m, from_input, .. } = found;
    let all = system.states.len();
    let shown = all - law.a.rows();
    let of_own = |rows: &Matrix<Rational>| window(rows, shown..all, 0..rows.columns());
    let beside = |on_states: &Matrix<Rational>, on_references: &Matrix<Rational>, load: &Matrix<Rational>| {
        let on_motions = plant.over_motions(on_states);
        side_by_side(&[&on_motions.to_f64(), &on_references.to_f64(), &load.scale(&Rational::NEG_ONE).to_f64()])
    };
    LinearBlock {
        states: system.states[shown..].to_vec(),
        a: law.a.to_f64(),
        b: beside(&law.b, &of_own(&system.b.multiply(l)), &of_own(&system.b.multiply(m))),
        c: law.c.to_f64(),
        d: beside(&law.d, &from_input.multiply(l), &from_input.multiply(m)),
    }
}
