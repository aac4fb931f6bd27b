//! Rational functions of s as blocks: the bilinear rule at a sample time, else differential equations.

use kardan_rt::TransferFunction;

use super::BlockBuilder;
use crate::element::KeyError;
use kardan_expr::expr::Traced;

/// A product of polynomials, constant first.
pub(super) fn product<'g>(a: &[Traced<'g>], b: &[Traced<'g>]) -> Vec<Traced<'g>> {
    let mut out = vec![BlockBuilder::zero(); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] = out[i + j] + *x * *y;
        }
    }
    out
}

/// `s = (2/h)(1 − z⁻¹)/(1 + z⁻¹)` in a polynomial of s, times `(1 + z⁻¹)ⁿ`: coefficients of powers of z⁻¹.
fn bilinear<'g>(polynomial: &[Traced<'g>], order: usize, h: Traced<'g>) -> Vec<Traced<'g>> {
    let one = BlockBuilder::one();
    let mut out = vec![BlockBuilder::zero(); order + 1];
    for (k, coefficient) in polynomial.iter().enumerate() {
        let mut term = vec![*coefficient];
        for _ in 0..k {
            term = product(&term, &[(one + one) / h, -((one + one) / h)]);
        }
        for _ in k..order {
            term = product(&term, &[one, one]);
        }
        for (sum, x) in out.iter_mut().zip(term) {
            *sum = *sum + x;
        }
    }
    out
}

/// The output of `numerator/denominator` (polynomials of s, constant first) for an input; it starts in equilibrium at an output.
///
/// The denominator is no shorter than the numerator; its last coefficient is not zero.
pub(super) fn filtered<'g>(
    builder: &mut BlockBuilder<'g>,
    (numerator, denominator): (&[Traced<'g>], &[Traced<'g>]),
    input: Traced<'g>,
    start: Traced<'g>,
) -> Result<Traced<'g>, KeyError> {
    let order = denominator.len() - 1;
    let Some(time) = builder.sample_time.clone() else {
        return Ok(flowing(builder, (numerator, denominator), input, start));
    };
    let h = builder.exact(&time);
    let (b, a) = (bilinear(numerator, order, h), bilinear(denominator, order, h));
    let scale = a[0];
    let list = |list: &[Traced<'g>]| list.iter().map(|x| *x / scale).collect::<Vec<_>>();
    let (b, a) = (list(&b), list(&a[1..]));
    // In equilibrium at an output y the input is y over the static gain, `Σ b/(1 + Σ a)`, and the states follow from both.
    let mut memory = vec![BlockBuilder::zero()];
    memory.extend(resting((&b, &a), start));
    let block = TransferFunction { numerator: &b, denominator: &a };
    Ok(builder.step(|memory| block.step(input, memory), memory))
}

/// The states of the sampled form in equilibrium at an output y, if the static gain is finite: `s_k = Σ_{j≥k} (b_j u − a_j y)`.
fn resting<'g>((b, a): (&[Traced<'g>], &[Traced<'g>]), y: Traced<'g>) -> Vec<Traced<'g>> {
    let zero = BlockBuilder::zero();
    if let Traced::Fraction(0, _) = y {
        return vec![zero; a.len()];
    }
    let sum = |list: &[Traced<'g>]| list.iter().fold(zero, |sum, x| sum + *x);
    let u = y * (BlockBuilder::one() + sum(a)) / sum(b);
    let share = |k: usize| b[k + 1] * u - a[k] * y;
    (0..a.len()).map(|k| (k..a.len()).fold(zero, |sum, j| sum + share(j))).collect()
}

/// The same as differential equations, in the observer's form: `y = β_n u + x_n`, `ẋ_k = x_{k−1} + β_{k−1} u − α_{k−1} y`.
fn flowing<'g>(
    builder: &mut BlockBuilder<'g>,
    (numerator, denominator): (&[Traced<'g>], &[Traced<'g>]),
    input: Traced<'g>,
    start: Traced<'g>,
) -> Traced<'g> {
    let (zero, order) = (BlockBuilder::zero(), denominator.len() - 1);
    let scale = denominator[order];
    let alpha = |k: usize| denominator[k] / scale;
    let beta = |k: usize| numerator.get(k).map_or(zero, |x| *x / scale);
    // In equilibrium at an output y: u = y α₀/β₀, and each rate is zero.
    let at_rest = |k: usize| match start {
        Traced::Fraction(0, _) => zero,
        y => {
            let u = y * alpha(0) / beta(0);
            // x_k = α_k y − β_k u, and x_n = y − β_n u.
            if k == order { y - beta(order) * u } else { alpha(k) * y - beta(k) * u }
        }
    };
    let states: Vec<Traced<'g>> = (1..=order).map(|k| builder.new_state(at_rest(k))).collect();
    let output = beta(order) * input + states.last().map_or(zero, |x| *x);
    let rate = |k: usize| if k == 0 { zero } else { states[k - 1] } + beta(k) * input - alpha(k) * output;
    let rates: Vec<Traced<'g>> = (0..order).map(rate).collect();
    builder.next(&rates);
    output
}
