//! Numbers that carry derivatives.
//!
//! A formula is written once, generic in its scalar; which derivatives come with its value is the choice of the caller:
//!
//! | scalar | carries | used for |
//! |---|---|---|
//! | `f64` | the value | residuals, output |
//! | [`Dual<N>`] | N first directional derivatives | Jacobians |
//! | [`Jet<N>`](Jet) | all partial derivatives up to order 2 or 3 in two variables | energies w(lambda, mu) |
//!
//! This module knows no membrane and no mesh.

mod dual;
mod jet;

pub use dual::Dual;
pub use jet::{Jet, lift};

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number together with the derivatives that its type carries.
///
/// Every elementary function is a [`compose`](Scalar::compose) with its first three derivatives, so a new scalar type writes
/// the arithmetic and that one method.
pub trait Scalar:
    Copy
    + Debug
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// True if derivatives are carried; where not, nothing needs to be computed for them.
    const CARRIES: bool = true;

    /// The value without its derivatives.
    fn value(self) -> f64;

    /// The composition f(self), given `f` and its first three derivatives at the value of `self`.
    fn compose(self, f: [f64; 4]) -> Self;

    /// 1 / self.
    fn recip(self) -> Self {
        let r = 1.0 / self.value();
        let r2 = r * r;
        self.compose([r, -r2, 2.0 * r2 * r, -6.0 * r2 * r2])
    }

    /// Square root.
    fn sqrt(self) -> Self {
        let x = self.value();
        let r = x.sqrt();
        self.compose([r, 0.5 / r, -0.25 / (r * x), 0.375 / (r * x * x)])
    }

    /// Exponential.
    fn exp(self) -> Self {
        let e = self.value().exp();
        self.compose([e; 4])
    }

    /// Natural logarithm.
    fn ln(self) -> Self {
        let x = self.value();
        let r = 1.0 / x;
        self.compose([x.ln(), r, -r * r, 2.0 * r * r * r])
    }

    /// Sine and cosine of the same angle.
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value().sin_cos();
        (self.compose([s, c, -s, -c]), self.compose([c, -s, -c, s]))
    }

    /// Sine.
    fn sin(self) -> Self {
        self.sin_cos().0
    }

    /// Cosine.
    fn cos(self) -> Self {
        self.sin_cos().1
    }

    /// Tangent.
    fn tan(self) -> Self {
        let t = self.value().tan();
        let d = 1.0 + t * t;
        self.compose([t, d, 2.0 * t * d, 2.0 * d * (d + 2.0 * t * t)])
    }

    /// Arc sine.
    fn asin(self) -> Self {
        let x = self.value();
        let q = 1.0 / (1.0 - x * x);
        let r = q.sqrt();
        self.compose([x.asin(), r, x * q * r, (1.0 + 2.0 * x * x) * q * q * r])
    }

    /// Arc cosine.
    fn acos(self) -> Self {
        -self.asin() + std::f64::consts::FRAC_PI_2
    }

    /// Arc tangent.
    fn atan(self) -> Self {
        let x = self.value();
        let q = 1.0 / (1.0 + x * x);
        self.compose([x.atan(), q, -2.0 * x * q * q, (6.0 * x * x - 2.0) * q * q * q])
    }

    /// Hyperbolic sine.
    fn sinh(self) -> Self {
        let (s, c) = (self.value().sinh(), self.value().cosh());
        self.compose([s, c, s, c])
    }

    /// Hyperbolic cosine.
    fn cosh(self) -> Self {
        let (s, c) = (self.value().sinh(), self.value().cosh());
        self.compose([c, s, c, s])
    }

    /// Hyperbolic tangent.
    fn tanh(self) -> Self {
        let t = self.value().tanh();
        let d = 1.0 - t * t;
        self.compose([t, d, -2.0 * t * d, 2.0 * d * (3.0 * t * t - 1.0)])
    }

    /// Integral power; exact also at zero and for negative bases.
    fn powi(self, n: i32) -> Self {
        let x = self.value();
        let k = f64::from(n);
        // A vanishing factor ends the chain before a negative power of zero can make 0 * inf of it.
        let term = |factor: f64, power: i32| if factor == 0.0 { 0.0 } else { factor * x.powi(power) };
        self.compose([x.powi(n), term(k, n - 1), term(k * (k - 1.0), n - 2), term(k * (k - 1.0) * (k - 2.0), n - 3)])
    }

    /// Real constant power of a positive base.
    fn powf(self, a: f64) -> Self {
        let x = self.value();
        let term = |factor: f64, power: f64| if factor == 0.0 { 0.0 } else { factor * x.powf(power) };
        self.compose([
            x.powf(a),
            term(a, a - 1.0),
            term(a * (a - 1.0), a - 2.0),
            term(a * (a - 1.0) * (a - 2.0), a - 3.0),
        ])
    }
}

impl Scalar for f64 {
    const CARRIES: bool = false;

    #[inline(always)]
    fn value(self) -> f64 {
        self
    }

    #[inline(always)]
    fn compose(self, f: [f64; 4]) -> f64 {
        f[0]
    }
}
