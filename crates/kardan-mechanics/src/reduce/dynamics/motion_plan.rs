//! The equations of motion as one plan: what is computed at each evaluation, and where its results are.

use std::ops::Range;

use kardan_native::Native;

use crate::reduce::motion::{Motion, SparseRow};
use kardan_expr::expr::{Expr, Symbol};
use kardan_expr::plan::{Plan, compile};

/// Further expressions evaluated with the equations of motion, and their symbols besides those of the motion.
#[derive(Debug, Clone, Default)]
pub struct Extension {
    /// The input symbols.
    pub inputs: Vec<Symbol>,
    /// The requested expressions, by name.
    pub outputs: Vec<(String, Expr)>,
}

/// The results of an evaluation of [`Dynamics`](super::Dynamics): for each list the index in it and the number of the output.
///
/// The inputs of the plan are the reduced coordinates, their speeds, and those of an [`Extension`].
#[derive(Debug)]
pub struct MotionPlan {
    /// The plan to evaluate.
    pub plan: Plan,
    /// Angles of shafts that follow from the coordinates, by shaft.
    pub angles: Vec<(usize, usize)>,
    /// Their speeds.
    pub speeds: Vec<(usize, usize)>,
    pub(super) basis: Vec<(usize, usize)>,
    pub(super) bias: Vec<(usize, usize)>,
    pub(super) passive: Vec<(usize, usize)>,
    /// Entries of H_r that depend on the position, row by row.
    pub inertia: Vec<(usize, usize)>,
    /// Entries of the friction directions that do, row by row.
    pub friction_rows: Vec<(usize, usize)>,
    /// aᵀk in the friction directions.
    pub friction_bias: Vec<(usize, usize)>,
    pub(super) input_rows: Vec<(usize, usize)>,
    /// Numbers of the outputs of an extension.
    pub more: Range<usize>,
    /// Angles and speeds alone; its outputs are those of `angles`, then those of `speeds`.
    pub(super) shafts: Plan,
    pub(super) native_shafts: Option<Native<f64>>,
    /// Kinetic and potential energy, J.
    pub(super) energy: Plan,
    /// The inputs of these two besides the motion, by their numbers among the inputs of the plan.
    pub(super) beside: Vec<usize>,
    /// The plan as machine code, where there is such code.
    pub(super) native: Option<Native<f64>>,
}

impl MotionPlan {
    /// All entries that depend on the motion; constant ones are in the memory already.
    ///
    /// `own_speeds` are those of the shafts without the inputs of an extension.
    pub(super) fn new(motion: &Motion, r: usize, extension: Extension, (energy, own_speeds): (Expr, &[Expr])) -> Self {
        let mut outputs: Vec<(String, Expr)> = Vec::new();
        let varying = motion.graph.varying();
        let mut list = |name: &str, entries: &mut dyn Iterator<Item = (usize, Expr)>| -> Vec<(usize, usize)> {
            let entries = entries.filter(|(_, expr)| varying(*expr));
            let place = |(place, expr)| {
                outputs.push((format!("{name}.{place}"), expr));
                (place, outputs.len() - 1)
            };
            entries.map(place).collect()
        };
        let numbered = |exprs: &[Expr]| exprs.iter().copied().enumerate().collect::<Vec<_>>().into_iter();
        let rows = |rows: &[SparseRow]| {
            let row =
                |(k, row): (usize, &SparseRow)| row.iter().map(|(i, entry)| (k * r + i, *entry)).collect::<Vec<_>>();
            rows.iter().enumerate().flat_map(row).collect::<Vec<_>>().into_iter()
        };
        let both = |(&(i, j), &entry): (&(usize, usize), &Expr)| {
            let mirrored = (i != j).then_some((j * r + i, entry));
            std::iter::once((i * r + j, entry)).chain(mirrored)
        };
        let angles = list("angle", &mut numbered(&motion.angles));
        let speeds = list("speed", &mut numbered(&motion.speeds));
        let basis = list("basis", &mut rows(&motion.basis));
        let bias = list("bias", &mut numbered(&motion.bias));
        let passive = list("passive", &mut numbered(&motion.passive));
        let inertia = list("inertia", &mut motion.inertia.iter().flat_map(both));
        let friction_rows = list("friction", &mut rows(&motion.frictions));
        let friction_bias = list("friction_bias", &mut numbered(&motion.friction_bias));
        let input_rows = list("input", &mut rows(&motion.inputs));
        let own = speeds.iter().map(|(shaft, output)| (outputs[*output].0.clone(), own_speeds[*shaft]));
        let shafts: Vec<(String, Expr)> = outputs[..angles.len()].iter().cloned().chain(own).collect();
        let symbols: Vec<Symbol> = motion.symbols.iter().copied().chain(extension.inputs).collect();
        let used = motion.graph.symbols(&shafts.iter().map(|(_, expr)| *expr).chain([energy]).collect::<Vec<_>>());
        let beside: Vec<usize> =
            (motion.symbols.len()..symbols.len()).filter(|input| used.contains(&symbols[*input])).collect();
        let needed_symbols: Vec<Symbol> =
            motion.symbols.iter().copied().chain(beside.iter().map(|input| symbols[*input])).collect();
        let compiled = |outputs: &[(String, Expr)]| {
            compile(&motion.graph, &needed_symbols, outputs).expect("an extension declares all its inputs")
        };
        let (shafts, energy) = (compiled(&shafts), compiled(&[("energy".into(), energy)]));
        let more = outputs.len()..outputs.len() + extension.outputs.len();
        outputs.extend(extension.outputs);
        let plan = compile(&motion.graph, &symbols, &outputs).expect("an extension declares all its inputs");
        let [native, native_shafts] = [&plan, &shafts].map(|plan| Native::new(&plan.block()));
        Self {
            plan,
            angles,
            speeds,
            basis,
            bias,
            passive,
            inertia,
            friction_rows,
            friction_bias,
            input_rows,
            more,
            shafts,
            native_shafts,
            energy,
            beside,
            native,
        }
    }
}
