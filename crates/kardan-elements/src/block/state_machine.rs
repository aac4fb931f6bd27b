//! The block `state_machine`.

use kardan_rt::{Arithmetic, Transition};

use super::builder::{BlockBuilder, BlockKind, List};
use crate::element::KeyError;
use kardan_expr::expr::Traced;
use kardan_math::units::{Dimension, Exact};
use kardan_schema::schema::{BlockKeys, Keys, keys};

keys! {
    /// A transition between two states.
    table StateMachineTransition {
        required {
            from: Text, "The state that it leaves.";
            to: Text, "The state that it leads to.";
            when: Expression, "The guard condition: a monitor, `mode.since > 0.2 s and not hands_on`; a number above 0.5 is true.";
        }
    }
}

keys! {
    /// A state machine.
    block StateMachine("state_machine") {
        required {
            states: Names, "Names of its states; it starts in the first.";
            transitions: Tables(StateMachineTransition), "The transitions; of several enabled ones, the first in this list is taken.";
        }
        optional {
            outputs: Lists, "Outputs for each state, in the order of `states`: `{ fade = [1, 0.5, 0] }` is read as `NAME.fade`.";
        }
    }
}

pub(super) const STATE_MACHINE: BlockKind = BlockKind {
    keyword: StateMachine::KEYWORD,
    summary: "A machine of states, guards and outputs; it needs a sample time.",
    formula: "At each sample the first transition from its state whose guard is above 0.5 is taken; kardan reports transitions that overlap. `NAME` \
              is the number of the state, from 0;\n\
              `NAME.<state>` is 1 there, else 0; `NAME.since` is the time in it when the sample began; `NAME.<output>` is its listed value.",
    fields: StateMachine::FIELDS,
    example: "\
[block.mode]
kind = \"state_machine\"
states = [\"normal\", \"fading\", \"off\"]
transitions = [
  { from = \"normal\", to = \"fading\", when = \"encoder_lost\" },
  { from = \"fading\", to = \"off\", when = \"mode.since > 0.2 s\" },
]
outputs = { gain = [1, 0.5, 0] }
sample_time = \"1 ms\"

[block.encoder_lost]
kind = \"monitor\"
residual = \"encoder.phi - column.phi\"
threshold = \"0.5 deg\"
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

/// The output with the time in the state.
const SINCE: &str = "since";

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let h = builder.period("it changes its state at samples")?;
    let states = builder.values.names("states").unwrap_or_default().to_vec();
    if states.iter().any(|state| state == SINCE) {
        let message = format!("`states`: `{SINCE}` is the time in a state, so no state can have that name");
        return Err(KeyError::new("states", message, "choose another name"));
    }
    let outputs = std::mem::take(&mut builder.lists);
    for List { name, values, .. } in &outputs {
        if name == SINCE || states.contains(name) {
            let message = format!("`outputs`: `{name}` is the name of a state, or of the time in it");
            return Err(KeyError::new("outputs", message, "choose another name"));
        }
        if values.len() != states.len() {
            let message = format!("`outputs`: `{name}` has {} values for {} states", values.len(), states.len());
            return Err(KeyError::new("outputs", message, "write one for each state, in their order"));
        }
        if let Some((_, different)) = values.iter().find(|(_, found)| !values[0].1.is_like(found)) {
            let message = format!(
                "`outputs`: `{name}` is {} in one state and {} in another",
                values[0].1.noun(),
                different.noun()
            );
            return Err(KeyError::new("outputs", message, "write them in units of one kind"));
        }
    }
    let (transitions, guards): (Vec<Transition>, Vec<Traced<'_>>) =
        builder.guards.iter().map(|guard| (guard.transition, guard.when)).unzip();
    let first = builder.states.len();
    // No time has passed at the first sample.
    let starts = [BlockBuilder::zero(), -BlockBuilder::one()];
    let machine = kardan_rt::StateMachine { transitions: &transitions };
    let [now, _] = builder.go_on(|memory| machine.step(&guards, memory), starts);
    let since = builder.states[first + 1].symbol;
    builder.output(now, Dimension::NONE);
    // When a sample begins: guards may read it.
    builder.output_as(SINCE, (since + BlockBuilder::one()) * h, Dimension::TIME);
    let half = BlockBuilder::one() / Traced::whole(2);
    // Of each state 1, else 0: |state − k| < 1/2.
    let is = |k: usize| {
        let away = now - Traced::whole(k);
        let away = away.select(BlockBuilder::zero(), -away, away);
        away.select(half, BlockBuilder::one(), BlockBuilder::zero())
    };
    for (k, name) in states.iter().enumerate() {
        builder.output_as(name, is(k), Dimension::NONE);
    }
    for List { name, values, .. } in &outputs {
        let value = |(value, _): &(Exact, Dimension)| builder.exact(value);
        let chosen = values
            .iter()
            .enumerate()
            .skip(1)
            .fold(value(&values[0]), |so_far, (k, different)| half.select(is(k), value(different), so_far));
        builder.output_as(name, chosen, values[0].1);
    }
    Ok(())
}
