//! Confirms least numbers and ranks from the JSON text of an analysis alone. Fractions and JSON are all it takes from others.
use dashu_int::{IBig, ops::RemEuclid};
use dashu_ratio::RBig;
use serde_json::Value;
type Matrix = Vec<Vec<RBig>>;

pub fn check(text: &str) -> Option<()> {
    let all: Value = serde_json::from_str(text).ok()?;
    let n = all["state_names"].as_array().filter(|names| !names.is_empty() && all["states"] == names.len())?.len();
    // Forces act on speeds, sensors measure angles: these rows of a witness are empty.
    let r = if all["kind"] == "state space" { 0 } else { n / 2 };
    let inputs = "controllable controllable_rank min_inputs inputs controllability_minor uncontrollable_invariant B";
    let outputs = "observable observable_rank min_outputs outputs observability_minor unobservable_invariant C";
    side(&all, n, inputs, 0, 0..r).and_then(|()| side(&all, n, outputs, 1, n - r..n))
}

/// The inputs, or (`swap` = 1) the outputs as inputs of the transposed pencil.
fn side(all: &Value, n: usize, keys: &str, swap: usize, empty: std::ops::Range<usize>) -> Option<()> {
    let keys: Vec<&str> = keys.split(' ').collect();
    let read = |name: &str, columns: usize| -> Option<Matrix> {
        let mut out = vec![vec![RBig::ZERO; columns]; n];
        for x in all["certificate"]["pencil"][name].as_array()? {
            *out.get_mut(x[swap].as_u64()? as usize)?.get_mut(x[1 - swap].as_u64()? as usize)? = fraction(&x[2])?;
        }
        Some(out)
    };
    let (e, a, b) = (read("E", n)?, read("A", n)?, read(keys[6], all[keys[3]].as_array()?.len())?);
    let [count, reached, missed] = [3, 4, 5].map(|k| &all["certificate"][keys[k]]);
    let (rank, least) = (all[keys[1]].as_u64()? as usize, all[keys[2]].as_u64()? as usize);
    (all[keys[0]] == (rank == n) && minor([&e, &a, &b], reached)? == rank).then_some(())?;
    if rank < n {
        let y = matrix(missed["rows"].as_array()?)?;
        acts([&e, &a], &y, &matrix(missed["action"].as_array()?)?)?;
        (y.len() == n - rank && times(&y, &b).iter().flatten().all(RBig::is_zero)).then_some(())?;
    }
    let witness = matrix(count["witness"].as_array()?)?;
    let fits = witness.len() == n && witness.iter().all(|row| row.len() == least) && least > 0;
    (fits && count["number"] == least && witness[empty].iter().flatten().all(RBig::is_zero)).then_some(())?;
    (minor([&e, &a, &witness], &count["minor"])? == n).then_some(())?;
    // Each root of q has as many left eigenvectors: Y A = (I ⊗ companion(q)) Y E.
    let (q, y) = (matrix(std::slice::from_ref(&count["common_factor"]))?.remove(0), matrix(count["rows"].as_array()?)?);
    let d = q.len().checked_sub(1).filter(|d| *d > 0 && q[*d] == RBig::ONE && y.len() == least * d);
    let Some(d) = d.filter(|_| least > 1) else { return (least == 1).then_some(()) };
    let companion = |i: usize, j: usize| match (i / d == j / d, (i + 1).is_multiple_of(d)) {
        (true, true) => -q[j % d].clone(),
        (true, false) if j == i + 1 => RBig::ONE,
        _ => RBig::ZERO,
    };
    acts([&e, &a], &y, &(0..y.len()).map(|i| (0..y.len()).map(|j| companion(i, j)).collect()).collect())
}

/// Y has independent rows (modulo 2⁶¹ − 1), and `Y A = M Y E`.
fn acts([e, a]: [&Matrix; 2], y: &Matrix, m: &Matrix) -> Option<()> {
    let fits = |m: &Matrix, width: usize| m.len() == y.len() && m.iter().all(|row| row.len() == width);
    (fits(y, a.len()) && fits(m, y.len()) && times(y, a) == times(&times(m, y), e)).then_some(())?;
    (eliminate(&mut modulo(y, (1 << 61) - 1)?, a.len(), (1 << 61) - 1)?.0 == y.len()).then_some(())
}

/// The order of a minor of `[B, GB, G²B, …]`, `G = E⁻¹A`, if it is what is stated and not zero modulo the prime.
fn minor([e, a, b]: [&Matrix; 3], stated: &Value) -> Option<usize> {
    let (n, p) = (e.len(), stated["prime"].as_u64().filter(|p| (2..1 << 61).contains(p))?.into());
    let mut solved = modulo(&(0..n).map(|i| [&e[i][..], &a[i], &b[i]].concat()).collect(), p)?;
    (eliminate(&mut solved, n, p)?.0 == n).then_some(())?;
    let (rows, columns) = (stated["rows"].as_array()?, stated["columns"].as_array()?);
    let column = |column: &Value| {
        let short = |k: &u64| *k < n as u64 && column.get(2).is_none();
        let (input, power) = (column[0].as_u64()? as usize, column[1].as_u64().filter(short)?);
        let v = solved.iter().map(|row| row[2 * n..].get(input).copied()).collect::<Option<Vec<u128>>>()?;
        let product = |row: &[u128], v: &[u128]| row[n..].iter().zip(v).fold(0, |sum, (x, y)| (sum + x * y) % p);
        let v = (0..power).fold(v, |v, _| solved.iter().map(|row| product(row, &v)).collect());
        rows.iter().map(|i| v.get(i.as_u64()? as usize).copied()).collect()
    };
    let mut square = columns.iter().map(column).collect::<Option<Vec<Vec<u128>>>>()?;
    let (rank, value) = eliminate(&mut square, rows.len(), p)?;
    (rank == rows.len() && rank == columns.len() && u128::from(stated["value"].as_u64()?) == value).then_some(rank)
}

/// Brings the first columns to reduced echelon form; the rank, and the product of the pivots with the sign of the exchanges.
fn eliminate(rows: &mut [Vec<u128>], width: usize, p: u128) -> Option<(usize, u128)> {
    let (mut rank, mut value) = (0, 1);
    for column in 0..width {
        let Some(pivot) = (rank..rows.len()).find(|&i| rows[i][column] != 0) else { continue };
        rows.swap(rank, pivot);
        value = value * if pivot == rank { rows[rank][column] } else { p - rows[rank][column] } % p;
        let inverse = inverse(rows[rank][column], p)?;
        let lead: Vec<u128> = rows[rank].iter().map(|x| x * inverse % p).collect();
        for (factor, row) in rows.iter_mut().map(|row| (p - row[column], row)) {
            row.iter_mut().zip(&lead).for_each(|(x, y)| *x = (*x + factor * y) % p);
        }
        rows[rank] = lead;
        rank += 1;
    }
    Some((rank, value))
}

fn inverse(x: u128, p: u128) -> Option<u128> {
    let bit = |k: u32| if (p - 2) >> k & 1 == 1 { x } else { 1 };
    Some((0..61).rev().fold(1, |y, k| y * y % p * bit(k) % p)).filter(|y| x * y % p == 1)
}

fn modulo(m: &Matrix, p: u128) -> Option<Vec<Vec<u128>>> {
    let low = |x: &IBig| u128::try_from(x.rem_euclid(IBig::from(p))).ok();
    let entry = |x: &RBig| Some(low(x.numerator())? * inverse(low(&x.denominator().clone().into())?, p)? % p);
    m.iter().map(|row| row.iter().map(entry).collect()).collect()
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    let sum = |row: &[RBig], j: usize| row.iter().zip(b).fold(RBig::ZERO, |sum, (x, other)| sum + x * &other[j]);
    a.iter().map(|row| (0..b[0].len()).map(|j| sum(row, j)).collect()).collect()
}

fn fraction(x: &Value) -> Option<RBig> {
    x.to_string().trim_matches('"').parse().ok().filter(|x: &RBig| !x.denominator().is_zero())
}

fn matrix(rows: &[Value]) -> Option<Matrix> {
    let row = |row: &Value| row.as_array()?.iter().map(fraction).collect();
    rows.iter().map(row).collect()
}
