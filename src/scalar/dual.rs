//! First derivatives in N directions.

use super::Scalar;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value with its derivatives in N directions (forward mode).
///
/// N = 8 fills whole vector registers; a function of more variables is evaluated in several passes of 8 directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// The derivative in each direction.
    pub du: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The variable that varies along direction `i` only.
    #[inline(always)]
    pub fn variable(re: f64, i: usize) -> Self {
        let mut du = [0.0; N];
        du[i] = 1.0;
        Dual { re, du }
    }

    #[inline(always)]
    fn map2(self, other: Self, re: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        Dual { re, du: std::array::from_fn(|i| f(self.du[i], other.du[i])) }
    }

    #[inline(always)]
    fn scale(self, re: f64, a: f64) -> Self {
        Dual { re, du: std::array::from_fn(|i| a * self.du[i]) }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline(always)]
    fn from(re: f64) -> Self {
        Dual { re, du: [0.0; N] }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.map2(o, self.re + o.re, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.map2(o, self.re - o.re, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.map2(o, self.re * o.re, |a, b| a * o.re + self.re * b)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let r = 1.0 / o.re;
        let q = self.re * r;
        self.map2(o, q, |a, b| (a - q * b) * r)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.scale(-self.re, -1.0)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Dual { re: self.re + o, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: f64) -> Self {
        Dual { re: self.re - o, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        self.scale(self.re * o, o)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: f64) -> Self {
        let r = 1.0 / o;
        self.scale(self.re * r, r)
    }
}

impl<const N: usize> Scalar for Dual<N> {
    #[inline(always)]
    fn value(self) -> f64 {
        self.re
    }

    #[inline(always)]
    fn compose(self, f: [f64; 4]) -> Self {
        self.scale(f[0], f[1])
    }
}
