//! Whole numbers for a system, and bounds of its minors by the norms of rows (Hadamard).

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};

use crate::LinearSystem;
use kardan_math::num::{Matrix, Polynomial, Rational, common_denominator};

/// The same system with whole numbers: rows of `[E, A, B]` and of `[C, D]` times their common denominators.
pub(super) fn whole(system: &LinearSystem) -> LinearSystem {
    let mut out = system.clone();
    let clear = |parts: &mut [&mut Matrix<Rational>], row: usize| {
        let common = common_denominator(parts.iter().flat_map(|part| part.row(row)));
        if common != UBig::ONE {
            let common = Rational::from(common);
            for part in parts.iter_mut() {
                for j in 0..part.columns() {
                    part[(row, j)] = &part[(row, j)] * &common;
                }
            }
        }
    };
    for i in 0..out.e.rows() {
        clear(&mut [&mut out.e, &mut out.a, &mut out.b], i);
    }
    for i in 0..out.c.rows() {
        clear(&mut [&mut out.c, &mut out.d], i);
    }
    out
}

/// `sE − A` alone.
pub(super) fn without_ports(system: &LinearSystem) -> LinearSystem {
    let n = system.states.len();
    LinearSystem {
        e: system.e.clone(),
        ..LinearSystem::state_space(system.a.clone(), Matrix::zeros(n, 0), Matrix::zeros(0, n))
    }
}

/// `sI − M` with whole numbers.
pub(crate) fn pencil_of(action: &Matrix<Rational>) -> LinearSystem {
    let n = action.rows();
    whole(&LinearSystem::state_space(action.clone(), Matrix::zeros(n, 0), Matrix::zeros(0, n)))
}

fn square(x: &IBig) -> UBig {
    let size = x.clone().into_parts().1;
    &size * &size
}

fn squares(matrix: &Matrix<Rational>, row: usize) -> UBig {
    matrix.row(row).iter().fold(UBig::ZERO, |sum, x| sum + square(x.numerator()))
}

/// Two times log₂ of a norm given its square, rounded up.
fn half_bits(square: &UBig) -> u64 {
    square.bit_len() as u64
}

/// A bound of log₂ of the coefficients of all minors of S, with the rows of [`whole`]; [step "Bound"](super).
pub(crate) fn norm_bits(system: &LinearSystem) -> u64 {
    let size = |x: &Rational, common: &UBig| x.numerator().clone().into_parts().1 * (common / x.denominator());
    let sum_of_squares = |sizes: &mut dyn Iterator<Item = UBig>| sizes.fold(UBig::ZERO, |sum, x| sum + &x * &x);
    let state = |i: usize| {
        let [e, a, b] = [&system.e, &system.a, &system.b].map(|part| part.row(i));
        let common = common_denominator([e, a, b].into_iter().flatten());
        let both = e.iter().zip(a).filter(|(e, a)| !(e.is_zero() && a.is_zero()));
        let sum = sum_of_squares(&mut both.map(|(e, a)| size(e, &common) + size(a, &common)));
        sum + sum_of_squares(&mut b.iter().map(|x| size(x, &common)))
    };
    let output = |i: usize| {
        let entries = || system.c.row(i).iter().chain(system.d.row(i)).filter(|x| !x.is_zero());
        let common = common_denominator(entries());
        sum_of_squares(&mut entries().map(|x| size(x, &common)))
    };
    let states = (0..system.e.rows()).map(|i| half_bits(&state(i)));
    let halves: u64 = states.chain((0..system.c.rows()).map(|i| half_bits(&output(i)))).sum();
    halves / 2 + 1
}

/// A bound of log₂ of the minors of K for a polynomial f; steps 4 and 9 of [the argument](super).
pub(super) fn nullity_bits(system: &LinearSystem, f: &Polynomial) -> u64 {
    let coefficients = f.whole_coefficients();
    let degree = f.degree() as u64;
    let leading = square(&coefficients[f.degree()]);
    let lower = coefficients[..f.degree()].iter().map(square).fold(UBig::ZERO, |sum, x| sum + x);
    let mut halves = 0;
    for i in 0..system.e.rows() {
        let (e, a) = (squares(&system.e, i), squares(&system.a, i) + squares(&system.b, i));
        // (x + y)² ≤ 2x² + 2y² where E and A meet in a column.
        halves += half_bits(&(UBig::from(2u8) * (&leading * &a + &lower * &e)));
        halves += (degree - 1) * half_bits(&(e + a));
    }
    for i in 0..system.c.rows() {
        halves += degree * half_bits(&(squares(&system.c, i) + squares(&system.d, i)));
    }
    halves / 2 + 1
}
