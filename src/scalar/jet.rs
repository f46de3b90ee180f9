//! All partial derivatives up to order three in two variables.

use super::Scalar;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The value of a function of two variables (x, y) with its partial derivatives up to order 2 (N = 6) or 3 (N = 10),
/// Taylor-scaled.
///
/// `c[k]` is the coefficient of the monomial in [`Jet::MONOMIALS`]`[k]`: f_xx/2, f_xxy/2, f_xyy/2, f_xxx/6 and so on, so that
/// the product of two jets is the truncated product of their polynomials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet<const N: usize = 10> {
    c: [f64; N],
}

impl<const N: usize> Jet<N> {
    /// The exponents (i, j) of x^i y^j, in the order of the coefficients.
    pub const MONOMIALS: [(u8, u8); 10] =
        [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

    /// The first variable, at `x`.
    #[inline(always)]
    pub fn x(x: f64) -> Self {
        let mut j = Self::from(x);
        j.c[1] = 1.0;
        j
    }

    /// The second variable, at `y`.
    #[inline(always)]
    pub fn y(y: f64) -> Self {
        let mut j = Self::from(y);
        j.c[2] = 1.0;
        j
    }

    /// The partial derivatives `[f, f_x, f_y, f_xx, f_xy, f_yy, f_xxx, f_xxy, f_xyy, f_yyy]`; those that are not carried are zero.
    #[inline(always)]
    pub fn derivatives(self) -> [f64; 10] {
        let factorial = [1.0, 1.0, 1.0, 2.0, 1.0, 2.0, 6.0, 2.0, 2.0, 6.0];
        std::array::from_fn(|k| if k < N { factorial[k] * self.c[k] } else { 0.0 })
    }

    #[inline(always)]
    fn scale(self, a: f64) -> Self {
        Jet { c: self.c.map(|x| a * x) }
    }
}

impl<const N: usize> From<f64> for Jet<N> {
    #[inline(always)]
    fn from(v: f64) -> Self {
        let mut c = [0.0; N];
        c[0] = v;
        Jet { c }
    }
}

impl<const N: usize> Add for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Jet { c: std::array::from_fn(|i| self.c[i] + o.c[i]) }
    }
}

impl<const N: usize> Sub for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Jet { c: std::array::from_fn(|i| self.c[i] - o.c[i]) }
    }
}

impl<const N: usize> Mul for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let (a, b) = (self.c, o.c);
        let mut c = [0.0; N];
        c[0] = a[0] * b[0];
        c[1] = a[0] * b[1] + a[1] * b[0];
        c[2] = a[0] * b[2] + a[2] * b[0];
        c[3] = a[0] * b[3] + a[1] * b[1] + a[3] * b[0];
        c[4] = a[0] * b[4] + a[1] * b[2] + a[2] * b[1] + a[4] * b[0];
        c[5] = a[0] * b[5] + a[2] * b[2] + a[5] * b[0];
        if N > 6 {
            c[6] = a[0] * b[6] + a[1] * b[3] + a[3] * b[1] + a[6] * b[0];
            c[7] = a[0] * b[7] + a[1] * b[4] + a[2] * b[3] + a[3] * b[2] + a[4] * b[1] + a[7] * b[0];
            c[8] = a[0] * b[8] + a[1] * b[5] + a[2] * b[4] + a[4] * b[2] + a[5] * b[1] + a[8] * b[0];
            c[9] = a[0] * b[9] + a[2] * b[5] + a[5] * b[2] + a[9] * b[0];
        }
        Jet { c }
    }
}

impl<const N: usize> Div for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        self * o.recip()
    }
}

impl<const N: usize> Neg for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.scale(-1.0)
    }
}

impl<const N: usize> Add<f64> for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, o: f64) -> Self {
        self.c[0] += o;
        self
    }
}

impl<const N: usize> Sub<f64> for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, o: f64) -> Self {
        self.c[0] -= o;
        self
    }
}

impl<const N: usize> Mul<f64> for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.scale(o)
    }
}

impl<const N: usize> Div<f64> for Jet<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        self.scale(1.0 / o)
    }
}

impl<const N: usize> Scalar for Jet<N> {
    #[inline(always)]
    fn value(self) -> f64 {
        self.c[0]
    }

    /// With d = self - value (no constant term, so d^4 vanishes): f + f' d + f''/2 d^2 + f'''/6 d^3, by Horner.
    #[inline(always)]
    fn compose(self, f: [f64; 4]) -> Self {
        let mut d = self;
        d.c[0] = 0.0;
        if N > 6 {
            ((d * (f[3] / 6.0) + f[2] / 2.0) * d + f[1]) * d + f[0]
        } else {
            (d * (f[2] / 2.0) + f[1]) * d + f[0]
        }
    }
}

/// A partial derivative of a bivariate function as a scalar that depends on x and y: its value and its slopes in both.
#[inline(always)]
pub fn lift<S: Scalar>(value: f64, slope_x: f64, slope_y: f64, x: S, y: S) -> S {
    (x - x.value()) * slope_x + (y - y.value()) * slope_y + value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;
    use num_dual::{Dual3_64, DualNum};

    fn ours<S: Scalar>(x: S, y: S) -> S {
        (x * y).exp() / (x + 2.0).sqrt() + (y * x.ln()).sin() * x.powi(-3) - (x * y).powf(1.7) * y.tanh().atan()
            + (x * 0.2).asin() * y.tan()
            + (y * 0.1).acos() * x.sinh() / y.cosh()
    }

    fn oracle(x: Dual3_64, y: Dual3_64) -> Dual3_64 {
        (x * y).exp() / (x + 2.0).sqrt() + (y * x.ln()).sin() * x.powi(-3) - (x * y).powf(1.7) * y.tanh().atan()
            + (x * 0.2).asin() * y.tan()
            + (y * 0.1).acos() * x.sinh() / y.cosh()
    }

    /// Along any line (x + a t, y + b t) the third derivative of the jet's polynomial is num-dual's. Four lines fix all four
    /// third partials; a wrong coefficient of any order shows.
    #[test]
    fn jets_agree_with_an_independent_library_along_lines() {
        let (x, y) = (1.3, 0.7);
        let j = ours(Jet::<10>::x(x), Jet::y(y));
        for (a, b) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -2.0), (0.3, 0.9)] {
            let d = oracle(Dual3_64::new(x, a, 0.0, 0.0), Dual3_64::new(y, b, 0.0, 0.0));
            let order = |n: u8| -> f64 {
                let factorial = [1.0, 1.0, 2.0, 6.0][usize::from(n)];
                Jet::<10>::MONOMIALS
                    .iter()
                    .zip(j.c)
                    .filter(|((p, q), _)| p + q == n)
                    .map(|((p, q), c)| c * a.powi(i32::from(*p)) * b.powi(i32::from(*q)))
                    .sum::<f64>()
                    * factorial
            };
            assert_relative_eq!(order(0), d.re, max_relative = 1e-14);
            assert_relative_eq!(order(1), d.v1, max_relative = 1e-13);
            assert_relative_eq!(order(2), d.v2, max_relative = 1e-12);
            assert_relative_eq!(order(3), d.v3, max_relative = 1e-11);
        }
    }

    #[test]
    fn duals_agree_with_jets() {
        let (x, y) = (0.9, 1.4);
        let d = ours(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        let j = ours(Jet::<10>::x(x), Jet::y(y)).derivatives();
        assert_relative_eq!(d.re, j[0], max_relative = 1e-14);
        assert_relative_eq!(d.du[0], j[1], max_relative = 1e-13);
        assert_relative_eq!(d.du[1], j[2], max_relative = 1e-13);
    }

    #[test]
    fn jets_of_second_order_are_those_of_third_cut_short() {
        let (x, y) = (0.9, 1.4);
        let two = ours(Jet::<6>::x(x), Jet::y(y)).derivatives();
        let three = ours(Jet::<10>::x(x), Jet::y(y)).derivatives();
        for k in 0..6 {
            assert_relative_eq!(two[k], three[k], max_relative = 1e-14);
        }
        assert_eq!(two[6..], [0.0; 4]);
    }

    #[test]
    fn integral_powers_are_exact_at_zero() {
        let d = Dual::<1>::variable(0.0, 0);
        assert_eq!(d.powi(2).du[0], 0.0);
        assert_eq!(d.powi(1).du[0], 1.0);
        assert_eq!(d.powi(0).du[0], 0.0);
        assert_eq!(Jet::<10>::x(0.0).powi(2).derivatives()[3], 2.0);
    }
}
