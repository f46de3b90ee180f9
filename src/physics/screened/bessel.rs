//! The modified Bessel functions K_0 and K_1, to a few units in the last place.
//!
//! Up to [`SMALL`] by their series around 0. Beyond it exp(x) sqrt(x) K is a slowly varying function, tabulated as polynomials on
//! quarters of octaves, which are made once from K_n(x) = int_0^inf exp(-x cosh t) cosh(n t) dt by the trapezoidal rule; and beyond the
//! table by the expansion for large x.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// End of the series.
const SMALL: f64 = 1.0;
/// Octaves that are tabulated, from [`SMALL`] on, pieces of each, coefficients of each polynomial.
const OCTAVES: usize = 6;
const PIECES: usize = 4;
const COEFFICIENTS: usize = 14;
/// Terms of the series around 0 and of the expansion for large x.
const TERMS: usize = 10;
const LARGE_TERMS: usize = 12;
/// Euler's constant.
const EULER: f64 = 0.577_215_664_901_532_9;

/// Coefficients of exp(x) sqrt(x) K_0 and K_1 on a piece, ascending, in a variable that runs from -1 to 1.
type Piece = [[f64; 2]; COEFFICIENTS];

static TABLE: LazyLock<Vec<Piece>> = LazyLock::new(|| {
    (0..OCTAVES * PIECES)
        .map(|i| {
            let [from, to] = ends(i);
            let n = COEFFICIENTS as f64;
            let angle = |j: usize| PI * (j as f64 + 0.5) / n;
            let values: Vec<[f64; 2]> =
                (0..COEFFICIENTS).map(|j| scaled(0.5 * (from + to) + 0.5 * (to - from) * angle(j).cos())).collect();
            // Chebyshev coefficients, then powers.
            let mut out = [[0.0; 2]; COEFFICIENTS];
            let (mut before, mut power) = ([0.0; COEFFICIENTS], [0.0; COEFFICIENTS]);
            power[0] = 1.0;
            for m in 0..COEFFICIENTS {
                for c in 0..2 {
                    let sum: f64 = (0..COEFFICIENTS).map(|j| values[j][c] * (m as f64 * angle(j)).cos()).sum();
                    let coefficient = sum * if m == 0 { 1.0 } else { 2.0 } / n;
                    out.iter_mut().zip(&power).for_each(|(o, p)| o[c] += coefficient * p);
                }
                let by = if m == 0 { 1.0 } else { 2.0 };
                let mut next = before.map(|b| -b);
                for (l, p) in power.iter().enumerate().take(COEFFICIENTS - 1) {
                    next[l + 1] += by * p;
                }
                (before, power) = (power, next);
            }
            out
        })
        .collect()
});

/// Ends of a tabulated piece.
fn ends(i: usize) -> [f64; 2] {
    let octave = SMALL * (1 << (i / PIECES)) as f64;
    let piece = (i % PIECES) as f64 / PIECES as f64;
    [octave * (1.0 + piece), octave * (1.0 + piece + 1.0 / PIECES as f64)]
}

/// exp(x) sqrt(x) K by the trapezoidal rule, for x of [`SMALL`] and more.
fn scaled(x: f64) -> [f64; 2] {
    let step = 0.2_f64.min(0.6 / x.sqrt());
    let mut sum = [0.5; 2];
    for j in 1.. {
        let t = step * f64::from(j);
        let e = (-2.0 * x * (0.5 * t).sinh().powi(2)).exp();
        if e < 1e-18 {
            break;
        }
        sum = [sum[0] + e, sum[1] + e * t.cosh()];
    }
    sum.map(|s| step * x.sqrt() * s)
}

/// K_0(x) and K_1(x), x > 0.
#[inline]
pub fn modified(x: f64) -> [f64; 2] {
    if x < SMALL {
        return small(x);
    }
    let front = (-x).exp() / x.sqrt();
    // The octave and the piece are the exponent and the first digits of x.
    let bits = (x / SMALL).to_bits();
    let piece = (((bits >> 50) as usize) & (PIECES - 1)) + PIECES * (((bits >> 52) as usize) - 1023);
    match TABLE.get(piece) {
        Some(table) => {
            let scale = f64::from_bits(bits & !((1 << 50) - 1)) * SMALL;
            let octave = f64::from_bits(bits & !((1 << 52) - 1)) * SMALL;
            let t = (x - scale) * (2 * PIECES) as f64 / octave - 1.0;
            let mut sum = table[COEFFICIENTS - 1];
            for c in table[..COEFFICIENTS - 1].iter().rev() {
                sum = [sum[0] * t + c[0], sum[1] * t + c[1]];
            }
            [front * sum[0], front * sum[1]]
        }
        None => [0.0, 4.0].map(|order| {
            let (mut term, mut sum) = (1.0, 1.0);
            for n in 1..LARGE_TERMS {
                let odd = (2 * n - 1) as f64;
                term *= (order - odd * odd) / (8.0 * n as f64 * x);
                sum += term;
            }
            (0.5 * PI).sqrt() * front * sum
        }),
    }
}

fn small(x: f64) -> [f64; 2] {
    let (q, log) = (0.25 * x * x, (0.5 * x).ln() + EULER);
    // q^m/(m!)^2, q^m/(m! (m+1)!), 1 + 1/2 + .. + 1/m
    let (mut first, mut second, mut harmonic) = (1.0, 1.0, 0.0);
    let (mut zero, mut one) = (-log, log - 0.5);
    for m in 1..TERMS {
        let n = m as f64;
        first *= q / (n * n);
        second *= q / (n * (n + 1.0));
        harmonic += 1.0 / n;
        zero += first * (harmonic - log);
        one += second * (log - harmonic - 0.5 / (n + 1.0));
    }
    [zero, 1.0 / x + 0.5 * x * one]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral itself, with a step and an end that suit every x.
    fn integral(x: f64) -> [f64; 2] {
        let (step, mut sum) = (0.02, [0.5 * (-x).exp(); 2]);
        for j in 1.. {
            let t = step * f64::from(j);
            let e = (-x * t.cosh()).exp();
            if e < 1e-18 * (-x).exp() {
                break;
            }
            sum = [sum[0] + e, sum[1] + e * t.cosh()];
        }
        sum.map(|s| step * s)
    }

    #[test]
    fn every_branch_agrees_with_the_integral() {
        for i in -600..=300 {
            let x = (f64::from(i) / 50.0 + 1e-9).exp();
            let (found, expected) = (modified(x), integral(x));
            for c in 0..2 {
                let miss = (found[c] / expected[c] - 1.0).abs();
                assert!(miss < 6e-15 + 2e-16 * x, "K_{c}({x}) misses by {miss:e}");
            }
        }
        // the argument is not ignored
        assert!((modified(2.0)[0] / integral(2.1)[0] - 1.0).abs() > 0.1);
    }

    #[test]
    fn known_digits() {
        // Abramowitz and Stegun, table 9.8
        assert!((modified(1.0)[0] - 0.421_024_438_2).abs() < 1e-10);
        assert!((modified(1.0)[1] - 0.601_907_230_2).abs() < 1e-10);
    }
}
