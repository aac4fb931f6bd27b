//! Runs alone, from the compiled loop to all rows: `cargo bench -p kardan --bench runs`. The steering system, the stiff drive with a spring, and
//! chains of shafts, with each method.

use divan::{Bencher, black_box};
use kardan::reduce::Dynamics;
use kardan::results::Effort;
use kardan::simulate::{Method, Ready, Recorded, Setup, Tolerance};
use kardan::study::{self, Prepared};
use std::fmt::Write;

fn main() {
    divan::main();
}

/// The work of one bench: a variant of a model, the signals wanted, rows per second.
struct Work {
    prepared: Prepared,
    variant: usize,
    recorded: Option<Recorded>,
    rows: Option<f64>,
}

impl Work {
    fn new(source: &str, variant: &str, recorded: &[&str], rows: Option<f64>) -> Self {
        let (prepared, diagnostics) = study::prepare(source);
        let variant =
            prepared.variants.iter().position(|one| one.name == variant).unwrap_or_else(|| panic!("{diagnostics:?}"));
        let recorded = (!recorded.is_empty())
            .then(|| Recorded { names: recorded.iter().map(ToString::to_string).collect(), as_all: false });
        Self { prepared, variant, recorded, rows }
    }

    fn ready(&self, method: Method, tolerance: f64) -> Ready {
        let variant = &self.prepared.variants[self.variant];
        let mut scenario = variant.scenario.clone();
        scenario.recorded = self.recorded.clone();
        if let Some(rows) = self.rows {
            let count = (scenario.duration * rows).round() as usize;
            scenario.times = (0..=count).map(|k| scenario.duration * k as f64 / count as f64).collect();
        }
        let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &scenario };
        Ready::new(setup, Tolerance { method, ..Tolerance::relative(tolerance) })
    }

    fn bench(&self, bencher: Bencher, method: Method, tolerance: f64) {
        if std::env::var_os("KARDAN_EFFORT").is_some() {
            let Effort { steps, rejected, evaluations, events, .. } =
                self.ready(method, tolerance).run(&mut |_| None).run.effort;
            eprintln!(
                "{method:?} {tolerance:e}: {steps} steps, {rejected} rejected, {evaluations} evaluations, {events} events"
            );
        }
        bencher.with_inputs(|| self.ready(method, tolerance)).bench_values(|ready| black_box(ready.run(&mut |_| None)));
    }
}

const METHODS: [Method; 2] = [Method::Dop853, Method::Taylor];
const ANGLES: [&str; 3] = ["rk.phi", "fs.phi", "cj.phi"];

fn builtin(name: &str) -> &'static str {
    kardan::model::builtin(name).expect("built in").source
}

/// Compiling the steering system's loop.
#[divan::bench]
fn steering_compiled(bencher: Bencher) {
    let work = Work::new(builtin("sia-steering"), "beta-30deg", &ANGLES, Some(1000.0));
    bencher.bench(|| work.ready(Method::Taylor, 1e-6));
}

/// 9 s of the steering system at 30 deg, at 1e-6, three angles in 9001 rows.
#[divan::bench(args = METHODS)]
fn steering_three_angles(bencher: Bencher, method: Method) {
    Work::new(builtin("sia-steering"), "beta-30deg", &ANGLES, Some(1000.0)).bench(bencher, method, 1e-6);
}

/// The same at 1e-4: the angles are then within 4e-7 of full scale of those of a run at 1e-13.
#[divan::bench(args = METHODS)]
fn steering_three_angles_roughly(bencher: Bencher, method: Method) {
    Work::new(builtin("sia-steering"), "beta-30deg", &ANGLES, Some(1000.0)).bench(bencher, method, 1e-4);
}

/// The same at 1e-6 without rows.
#[divan::bench(args = METHODS)]
fn steering_without_rows(bencher: Bencher, method: Method) {
    Work::new(builtin("sia-steering"), "beta-30deg", &ANGLES, Some(1.0 / 9.0)).bench(bencher, method, 1e-6);
}

/// The same at 1e-10, all 30 signals in 10521 rows.
#[divan::bench(args = METHODS)]
fn steering_all_signals(bencher: Bencher, method: Method) {
    Work::new(builtin("sia-steering"), "beta-30deg", &[], None).bench(bencher, method, 1e-10);
}

/// 2 s of the stiff drive with a spring, both angles.
#[divan::bench(args = [Method::Taylor, Method::Radau, Method::Automatic])]
fn stiff_drive(bencher: Bencher, method: Method) {
    Work::new(builtin("harmonic-drive-spring"), "position", &["rk.phi", "fs_torque.tau"], None)
        .bench(bencher, method, 1e-10);
}

/// A chain of shafts with springs, 1 N m on the first one for 1 s, 2 s in all, 962 rows of all angles.
fn chain(n: usize, friction: bool) -> String {
    let mut text = String::from("[model]\nname = \"chain\"\n");
    for k in 0..n {
        let inertia = 0.001 * (1.0 + 0.1 * ((k * 7 % 5) as f64 - 2.0));
        let friction = if friction { "friction = \"0.02 N m\"\n" } else { "" };
        write!(text, "[shaft.s{k:04}]\ninertia = \"{inertia:.6} kg m^2\"\ndamping = \"0.002 N m s/rad\"\n{friction}")
            .unwrap();
    }
    for k in 0..n - 1 {
        let stiffness = 100.0 * (1.0 + 0.1 * ((k * 3 % 7) as f64 - 3.0) / 3.0);
        let (one, other) = (format!("s{k:04}"), format!("s{:04}", k + 1));
        write!(text, "[spring_damper.c{k:04}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{other}\"\nstiffness = \"{stiffness:.6} N m/rad\"\ndamping = \"0.01 N m s/rad\"\n").unwrap();
    }
    let step =
        |at: u32, to: u32| format!("[[scenario.event]]\nat = \"{at} s\"\nsignal = \"m.tau\"\nto = \"{to} N m\"\n");
    write!(text, "[motor.m]\nshaft = \"s0000\"\n[scenario]\nduration = \"2 s\"\n{}{}", step(0, 1), step(1, 0)).unwrap();
    text
}

fn chain_work(n: usize, friction: bool) -> Work {
    let angles: Vec<String> = (0..n).map(|k| format!("s{k:04}.phi")).collect();
    let names: Vec<&str> = angles.iter().map(String::as_str).collect();
    Work::new(&chain(n, friction), "chain", &names, Some(480.5))
}

#[divan::bench(args = [5, 20, 100])]
fn chain_dop853(bencher: Bencher, n: usize) {
    chain_work(n, false).bench(bencher, Method::Dop853, 1e-6);
}

#[divan::bench(args = [5, 20, 100])]
fn chain_taylor(bencher: Bencher, n: usize) {
    chain_work(n, false).bench(bencher, Method::Taylor, 1e-6);
}

#[divan::bench(args = [10, 20, 50])]
fn chain_with_friction_dop853(bencher: Bencher, n: usize) {
    chain_work(n, true).bench(bencher, Method::Dop853, 1e-6);
}

#[divan::bench(args = [10, 20, 50])]
fn chain_with_friction_taylor(bencher: Bencher, n: usize) {
    chain_work(n, true).bench(bencher, Method::Taylor, 1e-6);
}

fn dynamics(model: &str) -> Dynamics {
    let source = match model {
        "chain of 20" => chain(20, true),
        "chain of 100" => chain(100, true),
        _ => builtin(model).to_owned(),
    };
    let (prepared, _) = study::prepare(&source);
    Dynamics::new(&prepared.variants.last().expect("a variant").reduced).0
}

/// One evaluation of the steering system's equations of motion, and of those of chains: interpreted, as machine code, and as machine code
/// for four and for eight at once.
mod evaluation {
    use super::*;
    use kardan_native::{Native, Value};
    use kardan_rt::Lanes;

    const MODELS: [&str; 3] = ["sia-steering", "chain of 20", "chain of 100"];

    #[divan::bench(args = MODELS)]
    fn interpreted(bencher: Bencher, model: &str) {
        let dynamics = dynamics(model);
        let plan = &dynamics.plan().plan;
        let mut memory = plan.memory();
        memory[..plan.inputs.len()].fill(0.3);
        bencher.bench_local(|| black_box(plan.block().evaluate(black_box(&mut memory))));
    }

    #[divan::bench(args = MODELS)]
    fn native(bencher: Bencher, model: &str) {
        let dynamics = dynamics(model);
        let plan = &dynamics.plan().plan;
        let Some(native) = Native::<f64>::new(&plan.block()) else { return };
        let mut memory = plan.memory();
        memory[..plan.inputs.len()].fill(0.3);
        bencher.bench_local(|| black_box(native.evaluate(black_box(&mut memory))));
    }

    #[divan::bench(args = MODELS)]
    fn native_four_lanes(bencher: Bencher, model: &str) {
        native_lanes::<4>(bencher, model);
    }

    #[divan::bench(args = MODELS)]
    fn native_eight_lanes(bencher: Bencher, model: &str) {
        native_lanes::<8>(bencher, model);
    }

    fn native_lanes<const N: usize>(bencher: Bencher, model: &str)
    where
        Lanes<f64, N>: Value,
    {
        let dynamics = dynamics(model);
        let plan = &dynamics.plan().plan;
        let Some(native) = Native::<Lanes<f64, N>>::new(&plan.block()) else { return };
        let mut memory: Vec<Lanes<f64, N>> = plan.memory().iter().map(|value| Lanes([*value; N])).collect();
        memory[..plan.inputs.len()].fill(Lanes([0.3; N]));
        bencher.bench_local(|| black_box(native.evaluate(black_box(&mut memory))));
    }

    /// From the plan to its code.
    #[divan::bench(args = MODELS)]
    fn compiled(bencher: Bencher, model: &str) {
        let dynamics = dynamics(model);
        bencher.bench_local(|| Native::<f64>::new(&dynamics.plan().plan.block()).is_some());
    }
}

/// Taylor coefficients of the steering system's equations of motion, and of those of a chain, up to the order of a relative tolerance of 1e-6 and of
/// 1e-15: of one motion, and of four and of eight side by side. An item is an order of one of them.
mod series {
    use super::*;
    use divan::counter::ItemsCount;
    use kardan::plan::Series;
    use kardan_native::Value;
    use kardan_rt::Lanes;

    const WORK: [(&str, usize); 3] = [("sia-steering", 9), ("sia-steering", 20), ("chain of 20", 9)];

    #[divan::bench(args = WORK)]
    fn one(bencher: Bencher, (model, order): (&str, usize)) {
        expanded::<f64>(bencher, model, order, 1);
    }

    #[divan::bench(args = WORK)]
    fn four(bencher: Bencher, (model, order): (&str, usize)) {
        expanded::<Lanes<f64, 4>>(bencher, model, order, 4);
    }

    #[divan::bench(args = WORK)]
    fn eight(bencher: Bencher, (model, order): (&str, usize)) {
        expanded::<Lanes<f64, 8>>(bencher, model, order, 8);
    }

    fn expanded<N: Value>(bencher: Bencher, model: &str, order: usize, lanes: usize) {
        let dynamics = dynamics(model);
        let plan = &dynamics.plan().plan;
        let wanted: Vec<usize> = (0..plan.outputs.len()).map(|output| plan.place(output)).collect();
        let mut series = Series::<N>::new(plan, order, &wanted, |_| false).expect("no kinks");
        let mut memory = vec![N::all(0.0); plan.memory().len()];
        plan.block().begin(&mut memory);
        memory[..plan.inputs.len()].fill(N::all(0.3));
        assert!(plan.block().evaluate(&mut memory));
        series.begin(&memory);
        for k in 1..=order {
            series.set(0, k, &vec![N::all(0.3 * 0.5_f64.powi(k as i32)); plan.inputs.len()]);
        }
        let counted = bencher.counter(ItemsCount::new(lanes * order));
        counted.bench_local(|| (1..=order).for_each(|k| black_box(&mut series).advance(k)));
    }
}
