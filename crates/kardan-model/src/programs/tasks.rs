//! The order in which blocks compute, and the tasks that they are.

use std::collections::{BTreeSet, HashMap, HashSet, VecDeque};

use super::{BREAK_CIRCLE, Blocks, Command, Ordered, outside_name};
use crate::in_order::in_order;
use kardan_expr::expr::{Expr, Floating, Graph, Substitution, Symbol, lower};
use kardan_math::names::circle;
use kardan_math::units::{Dimension, Exact, shown_quantity};
use kardan_mechanics::program::{Entry, Lists, Read, Step, Task, TaskOutput};
use kardan_results::signal_name::SignalName;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::{Scalar, Value};

/// The names in all expressions of a value.
fn names_in(value: &Value, out: &mut BTreeSet<String>) {
    for scalar in value.scalars() {
        if let Scalar::Expression(read) = scalar {
            out.extend(read.names().into_iter().map(String::from));
        }
    }
}

impl<'a> Blocks<'a, '_, '_> {
    /// The block whose output a name is.
    pub(super) fn of_name(&self, name: &str) -> Option<&str> {
        let head = SignalName::new(name).element;
        let blocks = &self.document.blocks;
        blocks.get(name).or_else(|| blocks.get(head)).map(|block| block.name.as_str())
    }

    /// Rejects blocks that read those of another sample time without a declared hold.
    pub(super) fn check_rates(&self, out: &mut Vec<Diagnostic>) {
        for block in self.document.blocks.iter().filter(|block| !block.kind.crosses) {
            let Some(Some(made)) = self.made.get(block.name.as_str()) else { continue };
            let what = format!("block `{}`", shortened(&block.name));
            self.check_reads(&what, &block.place, (&made.period, &made.reads), out);
        }
    }

    /// The same for anything with a sample time.
    pub(super) fn check_reads(
        &self,
        what: &str,
        place: &Place,
        (own, reads): (&Option<Exact>, &BTreeSet<String>),
        out: &mut Vec<Diagnostic>,
    ) {
        let shown = |period: &Exact| shown_quantity(period, Dimension::TIME);
        let Some(own) = own else { return };
        for name in reads {
            let other = self.of_name(name).and_then(|block| self.made.get(block)?.as_ref());
            let Some(period) = other.and_then(|other| other.period.as_ref()).filter(|period| *period != own) else {
                continue;
            };
            let message = format!(
                "{what} computes every {} and reads `{name}`, which computes every {}",
                shown(own),
                shown(period)
            );
            let head = SignalName::new(name).element;
            let help = format!(
                "sample it by a block: `[block.{head}_held]` with kind = \"hold\", input = \"{name}\" and sample_time = \"{}\"",
                shown(own)
            );
            out.push(Diagnostic::error("block::rate", message).at(place, "another sample time").help(help));
        }
    }

    /// All outputs in the order of blocks, each with its direct feedthrough dependencies.
    fn all_outputs(&self) -> Vec<Ordered<'a>> {
        let graph = self.graph.borrow();
        let named: HashMap<Symbol, &str> = self
            .outputs
            .iter()
            .filter_map(|(name, (expr, _))| Some((graph.symbol_of(*expr)?, name.as_str())))
            .collect();
        let made = self.made.iter().filter_map(|(block, made)| Some((*block, made.as_ref()?)));
        let outputs = made.flat_map(|(block, made)| made.outputs.iter().map(move |output| (block, output)));
        let mut all: Vec<Ordered<'a>> = outputs
            .map(|(block, (output, value, dimension))| Ordered {
                block,
                output: output.clone(),
                name: outside_name(block, output),
                value: *value,
                dimension: *dimension,
                at_once: Vec::new(),
            })
            .collect();
        let values: Vec<Expr> = all.iter().map(|output| output.value).collect();
        for (output, symbols) in all.iter_mut().zip(graph.symbols_of_each(&values)) {
            output.at_once = symbols.iter().filter_map(|symbol| named.get(symbol)).map(ToString::to_string).collect();
            output.at_once.sort();
        }
        all
    }

    /// All outputs in the order of direct feedthrough. Reports algebraic loops.
    pub(super) fn order(&self, out: &mut Vec<Diagnostic>) -> Option<Vec<Ordered<'a>>> {
        let all = self.all_outputs();
        let places: HashMap<&str, usize> =
            all.iter().enumerate().map(|(k, output)| (output.name.as_str(), k)).collect();
        let period = |block: &str| self.made.get(block)?.as_ref().map(|made| &made.period);
        let needs = |output: &Ordered<'_>| {
            // The outputs of another task are constant.
            let of_task = |name: &&String| {
                self.of_name(name).and_then(period).is_some_and(|candidate| Some(candidate) == period(output.block))
            };
            let names = output.at_once.iter().filter(of_task);
            names.filter_map(|name| places.get(name.as_str()).copied()).collect()
        };
        let needs: Vec<Vec<usize>> = all.iter().map(needs).collect();
        let (order, circles) = in_order(&needs);
        for circle in &circles {
            let outputs: Vec<(&str, &str)> = circle.iter().map(|k| (all[*k].block, all[*k].name.as_str())).collect();
            out.push(self.circle(&outputs));
        }
        let mut all: Vec<Option<Ordered<'a>>> = all.into_iter().map(Some).collect();
        circles.is_empty().then(|| order.into_iter().filter_map(|k| all[k].take()).collect())
    }

    /// The error for an algebraic loop of block outputs, with the signals between them if there are few.
    fn circle(&self, outputs: &[(&str, &str)]) -> Diagnostic {
        let mut names: Vec<&str> = Vec::new();
        for (k, (block, output)) in outputs.iter().enumerate() {
            names.push(output);
            if outputs.len() <= MOST_WITH_SIGNALS {
                names.extend(self.signals_between(block, outputs[(k + 1) % outputs.len()].1));
            }
        }
        let message = format!("blocks depend on each other at the same sample: {}", circle(&names));
        let found = outputs.first().and_then(|(block, _)| self.document.blocks.get(block));
        Diagnostic::error("block::algebraic-loop", message)
            .at_optional(found.map(|block| &block.place), "circular")
            .help(BREAK_CIRCLE)
    }

    /// The signals through which a block reads an output, by the shortest path; none if it names it itself.
    fn signals_between(&self, block: &str, output: &str) -> Vec<&'a str> {
        let Some(block) = self.document.blocks.get(block) else { return Vec::new() };
        let mut ways: VecDeque<(Vec<&'a str>, BTreeSet<String>)> = VecDeque::new();
        let mut first = BTreeSet::new();
        block.table.values.values().for_each(|found| names_in(&found.value, &mut first));
        ways.push_back((Vec::new(), first));
        let mut visited: BTreeSet<&'a str> = BTreeSet::new();
        while let Some((way, names)) = ways.pop_front() {
            if names.contains(output) {
                return way;
            }
            for signal in names.iter().filter_map(|name| self.document.signals.get(name)) {
                let Some(formula) = signal.formula.as_ref().filter(|_| visited.insert(&signal.name)) else { continue };
                let own = formula.value.names().into_iter().map(String::from).collect();
                ways.push_back((way.iter().copied().chain([signal.name.as_str()]).collect(), own));
            }
        }
        Vec::new()
    }

    /// The blocks of one sample time, those in order, with the outputs of others as external inputs.
    pub(super) fn task(
        &self,
        period: Option<Exact>,
        order: &[Ordered<'a>],
        keeps_symbol: impl Fn(&str) -> bool,
    ) -> Task {
        let mut graph = self.graph.borrow().clone();
        let mut values = Substitution::default();
        let (mut outputs, mut steps): (Vec<TaskOutput>, Vec<Step>) = (Vec::new(), Vec::new());
        let mut places: HashMap<&str, usize> = HashMap::new();
        let of_period = |block: &str| self.made.get(block)?.as_ref().filter(|made| made.period == period);
        for Ordered { block, output, name, value, dimension, at_once } in order {
            let Some(made) = of_period(block) else { continue };
            let of_block = self.document.blocks.get(block);
            let kind = of_block.map_or("expression", |block| block.kind.keyword);
            let value = values.of(&mut graph, &[*value])[0];
            let symbol = self.outputs.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
            if let Some(symbol) = symbol.filter(|_| !keeps_symbol(block)) {
                values.set(symbol, if graph.is_large(value) { graph.group(value) } else { value });
            }
            let whose = kind.replace('_', " ");
            let description = if of_block.is_none() {
                "a formula of coordinates".into()
            } else if output.is_empty() {
                format!("output of the {whose}")
            } else {
                format!("{output} of the {whose} {block}")
            };
            outputs.push(TaskOutput { name: name.clone(), dimension: *dimension, description, value });
            let place = *places.entry(block).or_insert(steps.len());
            match steps.get_mut(place) {
                Some(step) => step.at_once.extend(at_once.iter().cloned()),
                None => steps.push(Step {
                    block: (*block).into(),
                    kind,
                    reads: made.reads.iter().cloned().collect(),
                    at_once: at_once.clone(),
                }),
            }
        }
        let mut block_states = Vec::new();
        for Step { block, .. } in &steps {
            for (symbol, start, next) in of_period(block).into_iter().flat_map(|made| &made.states) {
                let next = values.of(&mut graph, &[*next])[0];
                let start = lower(&graph, &[*start], &mut Floating::<f64>::default(), |_| f64::NAN)[0];
                let symbol = graph.symbol_of(*symbol).expect("an entry of a memory is a symbol");
                block_states.push(Entry { name: block.clone(), symbol, start, next });
            }
        }
        let exprs: Vec<Expr> =
            outputs.iter().map(|output| output.value).chain(block_states.iter().map(|entry| entry.next)).collect();
        let reads = self.reads_of(&graph, &exprs);
        let name = match &period {
            Some(period) => format!("blocks at {}", shown_quantity(period, Dimension::TIME)),
            None => "blocks at every instant".into(),
        };
        let moving = self.moving(&reads, &block_states);
        let (names, lists) = (Vec::new(), Lists::default());
        Task { name, period, graph, reads, states: block_states, outputs, moving, names, order: steps, lists }
    }

    /// The commands of a law, with the blocks of its sample time that it needs.
    pub(super) fn command_task(
        &self,
        (name, period): (&str, Option<Exact>),
        order: &[Ordered<'a>],
        commands: Vec<Command>,
    ) -> Task {
        // Readers of another sample time use the values of the blocks, which computed before.
        let crosses = |name: &str| self.document.blocks.get(name).is_some_and(|block| block.kind.crosses);
        let mut task = self.task(period, order, crosses);
        let symbol = |graph: &Graph, name: &str| self.outputs.get(name).and_then(|(expr, _)| graph.symbol_of(*expr));
        let inside = task.outputs.iter().filter(|output| !crosses(&output.name));
        let substitutions: Vec<(Symbol, Expr)> =
            inside.filter_map(|output| Some((symbol(&task.graph, &output.name)?, output.value))).collect();
        task.outputs = Vec::new();
        let names: BTreeSet<String> = commands.iter().flat_map(|command| command.reads.iter().cloned()).collect();
        task.names = names.into_iter().collect();
        for Command { name, value, dimension, .. } in commands {
            let value = task.graph.substitute(&[value], &substitutions)[0];
            task.outputs.push(TaskOutput { description: format!("command of {name}"), name, dimension, value });
        }
        // States that are needed, until no new ones appear.
        let mut exprs: Vec<Expr> = task.outputs.iter().map(|output| output.value).collect();
        let places: HashMap<Symbol, usize> =
            task.states.iter().enumerate().map(|(place, entry)| (entry.symbol, place)).collect();
        let mut block_states: Vec<Option<Entry>> = std::mem::take(&mut task.states).into_iter().map(Some).collect();
        let (mut needed, mut new): (Vec<Entry>, Vec<Expr>) = (Vec::new(), exprs.clone());
        while !new.is_empty() {
            let used = task.graph.symbols(&new);
            let mut used: Vec<usize> = used.iter().filter_map(|symbol| places.get(symbol).copied()).collect();
            used.sort();
            let first = needed.len();
            needed.extend(used.into_iter().filter_map(|place| block_states[place].take()));
            new = needed[first..].iter().map(|entry| entry.next).collect();
            exprs.extend(&new);
        }
        let blocks: HashSet<&str> = needed.iter().map(|entry| entry.name.as_str()).collect();
        task.order.retain(|step| blocks.contains(step.block.as_str()));
        task.states = needed;
        task.reads = self.reads_of(&task.graph, &exprs);
        task.moving = self.moving(&task.reads, &task.states);
        task.name = name.to_string();
        task
    }

    /// The part of it that depends on the plant.
    fn moving(&self, reads: &[(Symbol, Read)], block_states: &[Entry]) -> Vec<Symbol> {
        let moving = self.moving.get_or_init(|| self.all_moving());
        let all = reads.iter().map(|(symbol, _)| *symbol).chain(block_states.iter().map(|entry| entry.symbol));
        all.filter(|symbol| moving.contains(symbol)).collect()
    }

    /// All symbols that depend on coordinates by value, not only by switching.
    fn all_moving(&self) -> HashSet<Symbol> {
        let graph = self.graph.borrow();
        let moves = |read: &Read| match read {
            Read::Time => false,
            Read::Source(name) => self.document.controls.has(SignalName::new(name).element),
            _ => true,
        };
        let outside = self.outside.iter().filter(|outside| moves(&outside.read));
        let moving: Vec<Symbol> =
            outside.filter_map(|outside| graph.symbol_of(self.read.get(&outside.name)?.0)).collect();
        let mut represented = Vec::new();
        for (block, made) in self.made.iter().filter_map(|(block, made)| Some((block, made.as_ref()?))) {
            let symbols = made.states.iter().filter_map(|(own, _, next)| Some((graph.symbol_of(*own)?, *next)));
            represented.extend(symbols);
            for (output, value, _) in &made.outputs {
                let symbol = self.outputs.get(&outside_name(block, output));
                represented.extend(symbol.and_then(|(own, _)| Some((graph.symbol_of(*own)?, *value))));
            }
        }
        graph.carriers(&moving, &represented)
    }

    /// External inputs of expressions of a task, sorted.
    fn reads_of(&self, graph: &Graph, exprs: &[Expr]) -> Vec<(Symbol, Read)> {
        let used = graph.symbols(exprs);
        let outside = self.outside.iter().filter_map(|outside| {
            let symbol = graph.symbol_of(self.read.get(&outside.name)?.0)?;
            Some((symbol, outside.read.clone()))
        });
        let outputs_read = self.outputs.iter().filter_map(|(name, (expr, _))| {
            let symbol = graph.symbol_of(*expr)?;
            Some((symbol, Read::Source(name.clone())))
        });
        let mut reads: Vec<_> =
            outside.chain(outputs_read).filter(|(symbol, _)| used.binary_search(symbol).is_ok()).collect();
        reads.sort_by(|a, b| a.1.cmp(&b.1));
        reads
    }
}

/// The most blocks of an algebraic loop that is reported with the signals between them.
const MOST_WITH_SIGNALS: usize = 20;
