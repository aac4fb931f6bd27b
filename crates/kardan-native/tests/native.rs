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
        let mut value_count = (inputs + constants.len()) as u64;
        let (mut runs, mut operands) = (Vec::new(), Vec::new());
        for _ in 0..1 + random.below(12) {
            let operator = OPERATORS[random.below(20) as usize];
            let count = 1 + random.below(8) as usize;
            for _ in 0..count * operator.operands() {
                operands.push(random.below(value_count) as u32);
            }
            runs.push(Run { operator, count });
            value_count += (count * operator.values()) as u64;
        }
        let outputs = (0..3).map(|_| random.below(value_count) as u32).collect();
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
    let Some(in_lanes) = agrees(plan, &inputs, |x| x.0.to_vec()) else { return false };
    for lane in 0..N {
        let point: Vec<f64> = inputs.iter().map(|x| x.0[lane]).collect();
        let scalar = agrees(plan, &point, |x| vec![*x]).expect("code for one");
        let different = in_lanes.iter().zip(&scalar).position(|(x, scalar)| !same(x.0[lane], *scalar));
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
fn plans_that_cannot_be_compiled_are_interpreted() {
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
        let mut values = [f64::NAN, 0.0];
        assert!(!native.evaluate(&mut values), "an input that is no number");
    }
}

/// Steps over so many inputs, each with a place for what it keeps beside; operands are of those before it.
fn random_steps(random: &mut Random, inputs: u32, count: u32) -> Vec<Step> {
    let mut steps = Vec::new();
    while steps.len() < count as usize {
        let out = inputs + 2 * steps.len() as u32;
        let mut below = || random.below(u64::from(out)) as u32;
        let operands = [below(), below(), below()];
        let operator = OPERATORS[random.below(20) as usize];
        // A square at times.
        let operands = if random.below(4) == 0 { [operands[0]; 3] } else { operands };
        use Operator::{AddProduct, Divide, Multiply, SubtractProduct};
        let scaled = matches!(operator, Multiply | Divide | AddProduct | SubtractProduct) && random.below(2) == 0;
        let step = Step { operator, scaled, out, operands, more: out + 1 };
        if step.has_rule() {
            steps.push(step);
        }
    }
    steps
}

/// The series of random steps by code, in each lane those of the rules; false where there is no code of this width.
fn series_agree<N: Value>(random: &mut Random, lanes: usize, lane: impl Fn(&mut N, usize) -> &mut f64) -> bool {
    let (inputs, count, orders) = (5, 1 + random.below(20) as u32, 1 + random.below(14) as usize);
    let steps = random_steps(random, inputs, count);
    let width = (inputs + 2 * count) as usize;
    // Orders up to this one have code without loops.
    let Some(native) = NativeSeries::<N>::new(&steps, width, random.below(16) as usize) else { return false };
    let mut in_lanes = vec![N::all(0.0); width * (orders + 1)];
    // Where one lane has edges, the others mostly have none.
    let edges = random.below(1 + lanes as u64) as usize;
    for place in &mut in_lanes {
        for k in 0..lanes {
            let number = random.number();
            let plain = random.below(1 << 31) as f64 / f64::from(1 << 29) - 2.0;
            *lane(place, k) = if k == edges { number } else { plain };
        }
    }
    let mut scalar: Vec<Vec<f64>> =
        (0..lanes).map(|k| in_lanes.iter_mut().map(|place| *lane(place, k)).collect()).collect();
    for order in 1..=orders {
        native.advance(&mut in_lanes, order);
        scalar.iter_mut().for_each(|series| steps.iter().for_each(|step| step.find(series, width, order)));
    }
    for (k, scalar) in scalar.iter().enumerate() {
        let different = in_lanes.iter_mut().zip(scalar).position(|(a, b)| !same(*lane(a, k), *b));
        assert_eq!(different, None, "lane {k} of {lanes}, {width} values: {steps:?}");
    }
    true
}

#[test]
fn code_of_series_has_the_bits_of_their_rules() {
    let mut random = Random(43);
    for _ in 0..1500 {
        assert_eq!(series_agree::<f64>(&mut random, 1, |x, _| x), has_avx2());
        assert_eq!(series_agree::<Lanes<f64, 4>>(&mut random, 4, |x, k| &mut x.0[k]), has_avx2());
        assert_eq!(series_agree::<Lanes<f64, 8>>(&mut random, 8, |x, k| &mut x.0[k]), has_avx512());
    }
}

/// Rules for lanes without code have the bits of those for one number.
#[test]
fn rules_have_the_same_bits_in_lanes() {
    let mut random = Random(47);
    for _ in 0..300 {
        let steps = random_steps(&mut random, 5, 12);
        let width = 29;
        let mut in_lanes: Vec<Lanes<f64, 3>> =
            (0..width * 8).map(|_| Lanes(std::array::from_fn(|_| random.number()))).collect();
        let mut scalar: [Vec<f64>; 3] = std::array::from_fn(|k| in_lanes.iter().map(|x| x.0[k]).collect());
        steps.iter().for_each(|step| step.begin(&mut in_lanes[..width]));
        scalar.iter_mut().for_each(|series| steps.iter().for_each(|step| step.begin(&mut series[..width])));
        for order in 1..8 {
            steps.iter().for_each(|step| step.find(&mut in_lanes, width, order));
            scalar.iter_mut().for_each(|series| steps.iter().for_each(|step| step.find(series, width, order)));
        }
        for (k, scalar) in scalar.iter().enumerate() {
            assert!(in_lanes.iter().zip(scalar).all(|(a, b)| same(a.0[k], *b)), "lane {k}: {steps:?}");
        }
    }
}

/// Up to so many steps that no order has code of its own.
#[test]
fn long_series_have_the_bits_of_their_rules() {
    let mut random = Random(53);
    for count in [20, 30, 40, 250] {
        let (inputs, orders) = (9, 24);
        let steps = random_steps(&mut random, inputs, count);
        let width = (inputs + 2 * count) as usize;
        let Some(native) = NativeSeries::new(&steps, width, orders) else { return };
        let number = |_| random.below(1 << 31) as f64 / f64::from(1 << 30);
        let mut one: Vec<f64> = (0..width * (orders + 1)).map(number).collect();
        let mut other = one.clone();
        for order in 1..=orders {
            steps.iter().for_each(|step| step.find(&mut one, width, order));
            native.advance(&mut other, order);
        }
        assert!(one.iter().zip(&other).all(|(a, b)| same(*a, *b)), "{count} steps");
    }
}

/// Steps that no plan has: over each other's places, over their own, out of order.
#[test]
fn invalid_steps_do_no_harm() {
    let mut random = Random(59);
    for _ in 0..500 {
        let width = 1 + random.below(6) as usize;
        let step = |random: &mut Random| {
            let most = width as u64 + u64::from(random.below(20) == 0);
            let mut place = || random.below(most) as u32;
            let (out, more, operands) = (place(), place(), [place(), place(), place()]);
            let operator = OPERATORS[random.below(20) as usize];
            Step { operator, scaled: random.below(2) == 0, out, operands, more }
        };
        let steps: Vec<Step> = (0..4).map(|_| step(&mut random)).collect();
        let sound = |step: &Step| {
            step.has_rule()
                && step.operands.iter().chain([&step.out, &step.more]).all(|place| (*place as usize) < width)
        };
        let native = NativeSeries::<f64>::new(&steps, width, 3);
        assert_eq!(native.is_some(), has_avx2() && steps.iter().all(sound));
        let mut series = vec![1.0; 6 * width];
        if let Some(native) = native {
            let before = series.clone();
            native.advance(&mut series, 0);
            assert_eq!(series, before, "of order 0 nothing is found");
            (1..6).for_each(|order| native.advance(&mut series, order));
        }
    }
    assert!(NativeSeries::<f64>::new(&[], usize::MAX, 3).is_none(), "too many values");
    assert_eq!(NativeSeries::<f64>::new(&[], 0, usize::MAX).is_some(), has_avx2());
}

#[test]
#[should_panic(expected = "no coefficients of order 2")]
fn orders_larger_than_the_buffer_are_refused() {
    let step = Step { operator: Operator::Add, scaled: false, out: 0, operands: [0; 3], more: 0 };
    match NativeSeries::new(&[step], 1, 4) {
        Some(native) => native.advance(&mut [1.0, 2.0], 2),
        None => panic!("no coefficients of order 2: there is no code"),
    }
}
