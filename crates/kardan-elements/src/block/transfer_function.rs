//! The block `transfer_function`, by zeros, poles and gain.

use kardan_rt::functions::hypot;

use super::builder::{BlockBuilder, BlockKind, rational};
use super::rational::{filtered, product};
use crate::element::KeyError;
use kardan_expr::expr::Traced;
use kardan_math::units::{Dimension, Exact};
use kardan_schema::schema::{BlockKeys, ExactPole, Keys, keys};

keys! {
    /// A rational transfer function by its zeros, poles and gain.
    block TransferFunction("transfer_function") {
        required {
            input: Expression, "The input signal.";
            poles: Poles, "Its poles, 1/s; a pole at 0 integrates.";
        }
        optional {
            zeros: Poles, "Its zeros, 1/s, at most as many as poles; left out: none.";
            gain: Expression, "Its static gain, without the poles and zeros at 0; left out: 1.";
            initial: Expression, "Output at the start, in equilibrium; left out: 0.";
        }
    }
}

pub(super) const TRANSFER_FUNCTION: BlockKind = BlockKind {
    keyword: TransferFunction::KEYWORD,
    summary: "A rational transfer function by its zeros, poles and static gain.",
    formula: "gain * product(1 - s/zero) / product(1 - s/pole); s for a zero or 1/s for a pole at 0. At a sample time h by the bilinear rule,\n\
              s = (2/h)(z - 1)/(z + 1), in a cascade of first- and second-order sections.",
    fields: TransferFunction::FIELDS,
    example: "\
[block.notch]
kind = \"transfer_function\"
input = \"torque_sensor.tau\"
zeros = [\"-2 ± 60j\"]
poles = [\"-40 ± 45j\"]
sample_time = \"1 ms\"
",
    crosses: false,
    write,
};

/// A factor `1 − s/r`, `s` for a root at 0, of a pair their product; constant first.
type Factor<'g> = Vec<Traced<'g>>;

/// The factors of roots, the slow ones first; `None` if a complex root has no conjugate.
fn factors<'g>(builder: &BlockBuilder<'g>, roots: &[ExactPole]) -> Option<Vec<Factor<'g>>> {
    let (graph, one, zero) = (builder.graph, BlockBuilder::one(), BlockBuilder::zero());
    let number = |x: &Exact| rational(graph, x.to_rational());
    let size = |(re, im): &&ExactPole| hypot(re.to_f64(), im.to_f64());
    let mut open: Vec<&ExactPole> = roots.iter().collect();
    open.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let mut out = Vec::new();
    while let Some(root) = open.pop() {
        let (real, imaginary) = root;
        out.push(if imaginary.is_zero() {
            match real.is_zero() {
                true => vec![zero, one],
                false => vec![one, -(one / number(real))],
            }
        } else {
            let conjugate = open.iter().position(|(re, im)| re == real && *im == -imaginary)?;
            open.remove(conjugate);
            // 1 − 2 Re(r)/|r|² s + s²/|r|²
            let (re, im) = (number(real), number(imaginary));
            let size = re * re + im * im;
            vec![one, -((re + re) / size), one / size]
        });
    }
    Some(out)
}

/// First- and second-order sections with numerator and denominator, whose product is that of all factors: a cascade preserves the digits
/// of slow poles and zeros at a fast sample time, which the coefficients of the whole product lose.
fn sections<'g>(zeros: Vec<Factor<'g>>, poles: Vec<Factor<'g>>) -> Vec<[Factor<'g>; 2]> {
    let (pairs, single): (Vec<Factor<'g>>, Vec<Factor<'g>>) = zeros.into_iter().partition(|zero| zero.len() > 2);
    let (mut second, mut first): (Vec<Factor<'g>>, Vec<Factor<'g>>) =
        poles.into_iter().partition(|pole| pole.len() > 2);
    // A pair of zeros needs two poles: two single ones if no pair remains.
    while second.len() < pairs.len() && first.len() > 1 {
        let two = product(&first[0], &first[1]);
        first.drain(..2);
        second.push(two);
    }
    let (mut pairs, mut single) = (pairs.into_iter(), single.into_iter());
    let one = || vec![BlockBuilder::one()];
    let matched: Vec<[Factor<'g>; 2]> =
        second.into_iter().map(|pole| [pairs.next().unwrap_or_else(one), pole]).collect();
    let mut out: Vec<[Factor<'g>; 2]> =
        first.into_iter().map(|pole| [single.next().unwrap_or_else(one), pole]).collect();
    out.extend(matched.into_iter().map(|[mut zero, pole]| {
        while zero.len() < pole.len()
            && let Some(more) = single.next()
        {
            zero = product(&zero, &more);
        }
        [zero, pole]
    }));
    out
}

fn write(builder: &mut BlockBuilder<'_>) -> Result<(), KeyError> {
    let (input, of) = builder.input("input")?;
    let (gain, by) = builder.inputs.get("gain").copied().unwrap_or((BlockBuilder::one(), Dimension::NONE));
    let (zeros, poles) =
        (builder.values.poles("zeros").unwrap_or_default(), builder.values.poles("poles").unwrap_or_default());
    if zeros.len() > poles.len() {
        let message = format!(
            "there are {} zeros and {} poles: the output would depend on derivatives of the input",
            zeros.len(),
            poles.len()
        );
        return Err(KeyError::new("zeros", message, "add fast poles until there are as many as zeros"));
    }
    let of_roots = |key, roots| {
        let not_factored =
            || KeyError::new(key, format!("`{key}`: a complex value has no conjugate"), "write a pair, `-14 ± 14.3j`");
        factors(builder, roots).ok_or_else(not_factored)
    };
    let sections = sections(of_roots("zeros", zeros)?, of_roots("poles", poles)?);
    let at_zero = |roots: &[ExactPole]| roots.iter().filter(|(re, im)| re.is_zero() && im.is_zero()).count() as i32;
    let power = at_zero(poles) - at_zero(zeros);
    let dimension = builder.over("gain", of, by, 1)?;
    let dimension =
        (0..power.abs()).try_fold(dimension, |all, _| builder.over("poles", all, Dimension::TIME, power.signum()))?;
    let start = builder.of("initial", dimension)?;
    if start.is_some() && power != 0 {
        let message = "`initial`: with a pole or a zero at 0 the output has no unique equilibrium";
        return Err(KeyError::new("initial", message, "take it out"));
    }
    if start.is_some() && builder.is_zero(gain) {
        return Err(KeyError::new(
            "initial",
            "`initial`: with a `gain` of 0 the only equilibrium output is 0",
            "take it out",
        ));
    }
    let start = start.unwrap_or(BlockBuilder::zero());
    let mut output = gain * input;
    for [numerator, denominator] in sections {
        output = filtered(builder, (&numerator, &denominator), output, start)?;
    }
    builder.output(output, dimension);
    Ok(())
}
