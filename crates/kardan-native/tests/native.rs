//! Machine code against the interpreter, bit for bit.

use kardan_native::{Native, NativeSeries, Step, Value, lanes};
use kardan_rt::{Lanes, Operator, Plan, Run};

const OPERATORS: [Operator; 20] = [
    Operator::Add,
    Operator::Subtract,
    Operator::Multiply,
    Operator::Divide,
    Operator::AddProduct,
    Operator::SubtractProduct,
    Operator::Negate,
    Operator::Absolute,
    Operator::SquareRoot,
    Operator::SineCosine,
    Operator::Tangent,
    Operator::ArcSine,
    Operator::ArcCosine,
    Operator::ArcTangent,
    Operator::ArcTangent2,
    Operator::Exponential,
    Operator::Logarithm,
    Operator::Minimum,
    Operator::Maximum,
    Operator::Select,
];

/// Random numbers with a given begin.
struct Random(u64);

impl Random {
    fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % most
    }

    /// Mostly from −2 to 2, at times an edge.
    fn number(&mut self) -> f64 {
        match self.below(40) {
            0 => 0.0,
            1 => -0.0,
            2 => f64::INFINITY,
            3 => f64::NAN,
            4 => 1e300,
            5 => 5e-324,
            6 => 3e7,
            _ => self.below(1 << 31) as f64 / f64::from(1 << 29) - 2.0,
        }
    }
}

/// A random list of operations.
struct Owned {
    inputs: usize,
    constants: Vec<f64>,
    runs: Vec<Run>,
    operands: Vec<u32>,
    outputs: Vec<u32>,
}

impl Owned {
    fn random(random: &mut Random) -> Self {
        let inputs = 1 + random.below(6) as usize;
        let constants: Vec<f64> = (0..random.below(4)).map(|_| random.number()).collect();
        let mut known = (inputs + constants.len()) as u64;
        let (mut runs, mut operands) = (Vec::new(), Vec::new());
        for _ in 0..1 + random.below(12) {
            let operator = OPERATORS[random.below(20) as usize];
            let count = 1 + random.below(8) as usize;
            for _ in 0..count * operator.operands() {
                operands.push(random.below(known) as u32);
            }
            runs.push(Run { operator, count });
            known += (count * operator.values()) as u64;
        }
        let outputs = (0..3).map(|_| random.below(known) as u32).collect();
        Self { inputs, constants, runs, operands, outputs }
    }

    fn plan(&self) -> Plan<'_, f64> {
        let Self { inputs, constants, runs, operands, outputs } = self;
        Plan { inputs: *inputs, constants, runs, operands, outputs, tables: &[], numbers: &[] }
    }
}

/// The same number, or both none.
fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Evaluates both ways and compares all values, which it gives; none where there is no machine code here.
fn agrees<N: Value>(plan: &Plan<'_, f64>, inputs: &[N], lanes: impl Fn(&N) -> Vec<f64>) -> Option<Vec<N>> {
    let native = Native::<N>::new(plan)?;
    let mut one = vec![N::all(0.0); plan.memory()];
    plan.begin(&mut one);
    one[..plan.inputs].copy_from_slice(inputs);
    let mut other = one.clone();
    assert_eq!(plan.evaluate(&mut one), native.evaluate(&mut other), "{plan:?}");
    for (k, (a, b)) in one.iter().zip(&other).enumerate() {
        let (a, b) = (lanes(a), lanes(b));
        assert!(a.iter().zip(&b).all(|(a, b)| same(*a, *b)), "place {k}: {a:?} and {b:?} of {plan:?}");
    }
    Some(other)
}

/// Random points side by side, both ways, and each by itself; false where there is no machine code of this width here.
fn lanes_agree<const N: usize>(plan: &Plan<'_, f64>, random: &mut Random) -> bool
where
    Lanes<f64, N>: Value,
{
    let inputs: Vec<Lanes<f64, N>> =
        (0..plan.inputs).map(|_| Lanes(std::array::from_fn(|_| random.number()))).collect();
    let Some(together) = agrees(plan, &inputs, |x| x.0.to_vec()) else { return false };
    for lane in 0..N {
        let point: Vec<f64> = inputs.iter().map(|x| x.0[lane]).collect();
        let alone = agrees(plan, &point, |x| vec![*x]).expect("code for one");
        let different = together.iter().zip(&alone).position(|(x, alone)| !same(x.0[lane], *alone));
        assert_eq!(different, None, "lane {lane} of {N}: {plan:?}");
    }
    true
}

#[test]
fn machine_code_has_the_bits_of_the_interpreter() {
    let mut random = Random(41);
    for _ in 0..3000 {
        let owned = Owned::random(&mut random);
        let plan = owned.plan();
        let inputs: Vec<f64> = (0..owned.inputs).map(|_| random.number()).collect();
        assert_eq!(agrees(&plan, &inputs, |x| vec![*x]).is_some(), has_avx2());
        assert_eq!(lanes_agree::<4>(&plan, &mut random), has_avx2());
        assert_eq!(lanes_agree::<8>(&plan, &mut random), has_avx512());
    }
}

#[test]
fn as_many_lanes_as_the_processor_has() {
    assert_eq!(
        lanes(),
        if has_avx512() {
            8
        } else if has_avx2() {
            4
        } else {
            1
        }
    );
}

/// Whether there is machine code for one number and for four.
#[cfg(all(target_arch = "x86_64", unix))]
fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

/// Whether there is machine code for eight.
#[cfg(all(target_arch = "x86_64", unix))]
fn has_avx512() -> bool {
    has_avx2() && std::arch::is_x86_feature_detected!("avx512f")
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
fn has_avx2() -> bool {
    false
}

#[cfg(not(all(target_arch = "x86_64", unix)))]
fn has_avx512() -> bool {
    false
}

#[test]
fn what_cannot_be_code_is_left_to_the_interpreter() {
    let runs = [Run { operator: Operator::Add, count: 1 }];
    let plan =
        Plan { inputs: 1, constants: &[], runs: &runs, operands: &[0, 7], outputs: &[1], tables: &[], numbers: &[] };
    assert!(Native::<f64>::new(&plan).is_none(), "an operand that is not there yet");
    let short = Plan { operands: &[0], ..plan };
    assert!(Native::<f64>::new(&short).is_none(), "too few operands");
    let tables = Plan { runs: &[Run { operator: Operator::Table, count: 1 }], operands: &[0, 0], ..plan };
    assert!(Native::<f64>::new(&tables).is_none(), "a table");
    let whole = Plan { operands: &[0, 0], ..plan };
    if let Some(native) = Native::<f64>::new(&whole) {
        assert!(!native.evaluate(&mut [1.0]), "too little memory");
        let mut memory = [f64::NAN, 0.0];
        assert!(!native.evaluate(&mut memory), "an input that is no number");
    }
}

/// The coefficient of order k by its rule: a_k and b_k for sums, `Σ a_j b_(k−j)` for products (of squares each pair once), and `(a_k − Σ q_j b_(k−j))/b_0` for quotients.
fn coefficient(step: &Step, memory: &[f64], width: usize, k: usize) -> f64 {
    let at = |place: u32, order: usize| memory[order * width + place as usize];
    let [a, b, c] = step.operands;
    let sum = |a: u32, orders: usize| (0..orders).fold(0.0, |sum, j| sum + at(a, j) * at(b, k - j));
    let product = match (step.scaled, a == b) {
        (true, _) => at(a, k) * at(b, 0),
        (false, false) => sum(a, k + 1),
        (false, true) => {
            let half = sum(a, k.div_ceil(2));
            half + half + if k.is_multiple_of(2) { at(a, k / 2) * at(a, k / 2) } else { 0.0 }
        }
    };
    match step.operator {
        Operator::Add => at(a, k) + at(b, k),
        Operator::Subtract => at(a, k) - at(b, k),
        Operator::Negate => -at(a, k),
        Operator::Multiply => product,
        Operator::AddProduct => at(c, k) + product,
        Operator::SubtractProduct => at(c, k) - product,
        Operator::Divide if step.scaled => at(a, k) / at(b, 0),
        Operator::Divide => (at(a, k) - sum(step.out, k)) / at(b, 0),
        // What has no code stands for any other rule.
        _ => at(a, k) + 1.0,
    }
}

#[test]
fn code_of_series_has_the_bits_of_their_rules() {
    let mut random = Random(43);
    for _ in 0..1000 {
        let (inputs, width, orders) = (5, 40, 1 + random.below(14) as usize);
        let operators = &OPERATORS[..8];
        let step = |out: u32, random: &mut Random| Step {
            operator: operators[random.below(8) as usize],
            scaled: random.below(2) == 0,
            out,
            operands: match random.below(4) {
                // A square.
                0 => [random.below(u64::from(out)) as u32; 3],
                _ => std::array::from_fn(|_| random.below(u64::from(out)) as u32),
            },
            more: 0,
        };
        let steps: Vec<Step> = (inputs..width).map(|out| step(out, &mut random)).collect();
        let Some(native) = NativeSeries::new(&steps, width as usize) else {
            assert!(!has_avx2(), "no code");
            return;
        };
        let width = width as usize;
        let mut one: Vec<f64> = (0..width * (orders + 1)).map(|_| random.number()).collect();
        let mut other = one.clone();
        for k in 1..=orders {
            for step in &steps {
                one[k * width + step.out as usize] = coefficient(step, &one, width, k);
            }
            native.advance(&mut other, k, |memory, number| {
                let step = &steps[number];
                memory[k * width + step.out as usize] = coefficient(step, memory, width, k);
            });
        }
        let different = one.iter().zip(&other).position(|(a, b)| !same(*a, *b));
        assert_eq!(different, None, "{steps:?}");
    }
}
