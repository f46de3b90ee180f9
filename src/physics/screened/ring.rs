//! The integral over the angle: what one ring of radius u' does at a point of radius u, at the distance d in the meridian plane.
//!
//! With l^2 = d^2 + a^2 sin^2(theta/2), a = 2 sqrt(u u'), and theta over a whole turn (2 times 0 to pi):
//!
//!   J1 = int exp(-k l)/l dtheta,
//!   J3 = int (1 + k l) exp(-k l)/l^3 dtheta,
//!   J3s = int (1 + k l) exp(-k l)/l^3 (1 - cos theta) dtheta.
//!
//! Where exp(-k l) vanishes before theta = pi, they are a short series in the Bessel functions K_n(k d), from
//! a sin(theta/2) = d sinh t, l = d cosh t, with 1/cos(theta/2) expanded. Elsewhere they are trapezoidal sums in a variable in which
//! the integrand is periodic and analytic in a strip, so that they converge exponentially; in the strip |exp(-k l)| <= 1, hence the
//! error is measured against the forces at distance zero (`digits` says how much more is wanted).
//! * theta itself, where d is not small against a; strip 2 asinh(d/a);
//! * else the elliptic integral of the first kind, dw = l_max dtheta / (2 l): l = d / dn(w), strip K'. The elliptic functions are
//!   quotients of theta functions of the complementary nome q' = exp(-pi K/K'), sums of three or four terms.

use super::bessel;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Exponent of the accuracy of the trapezoidal sums: exp(-37) = 1e-16, and the double poles of the integrand at the strip's edge.
const DIGITS: f64 = 40.0;
/// Exponent beyond which sources do not count.
const CUT: f64 = 40.0;
/// Terms of the series in K_n after which it is taken as it is.
const MOST_TERMS: usize = 60;
/// Largest number of intervals with tabulated angles.
const TABLED: usize = 24;

/// sin^2(pi j/(2 m)), j = 0 to m, for m up to TABLED.
static ANGLES: LazyLock<Vec<Vec<f64>>> = LazyLock::new(|| (0..=TABLED).map(angles).collect());

fn angles(m: usize) -> Vec<f64> {
    (0..=m).map(|j| (PI * j as f64 / (2 * m) as f64).sin().powi(2)).collect()
}

/// Integrals over the angle of a ring.
#[derive(Clone, Copy, Debug, Default)]
pub struct Angle {
    /// int exp(-k l)/l dtheta, 1/length.
    pub j1: f64,
    /// int (1 + k l) exp(-k l)/l^3 dtheta, 1/length^3.
    pub j3: f64,
    /// The same with the factor 1 - cos theta.
    pub j3s: f64,
}

/// The rules for all rings seen from one point.
#[derive(Clone, Copy)]
pub struct Kernel {
    k: f64,
    /// k l beyond which nothing counts.
    pub budget: f64,
    digits: f64,
}

impl Kernel {
    /// Decay rate `k`, and the distance of the point from the nearest source, which sets the scale of its field.
    pub fn new(k: f64, nearest: f64) -> Self {
        let digits = DIGITS + k * nearest;
        Self { k, budget: CUT + k * nearest, digits }
    }

    /// Integrals for a ring with a^2 = 4 u u' `width` at distance `d` > 0.
    pub fn angle(&self, width: f64, d: f64) -> Angle {
        let longest = (d * d + width).sqrt();
        if self.k * d > self.budget {
            Angle::default()
        } else if self.k * longest > self.budget {
            self.far_ends_gone(width, d)
        } else if width < 4.0 * d * d {
            self.plain(width, d)
        } else {
            self.elliptic(width.sqrt(), d, longest)
        }
    }

    /// The series in K_n, with x = k d and A = k a: y_n = x^n K_n(x) obeys y_{n+1} = x^2 y_{n-1} + 2 n y_n, and with
    /// e_n = ((2 n - 1)!!)^2/(2^n n!)
    ///
    ///   J1 = 4/a sum e_n y_n/A^(2n),  J3 = -1/d dJ1/dd = 4 k^2/a sum e_n y_(n-1)/A^(2n),  J3s = 8/a^3 sum (2 n + 1) e_n y_n/A^(2n).
    ///
    /// It is asymptotic: its least term is of the size of exp(-A), which does not count.
    fn far_ends_gone(&self, width: f64, d: f64) -> Angle {
        let x = self.k * d;
        let [zero, one] = bessel::modified(x);
        let by = 1.0 / (self.k * self.k * width);
        let (mut before, mut y) = (zero, x * one);
        let mut sum = [zero, one / x, zero];
        let (mut e, mut size) = (1.0, f64::INFINITY);
        for n in 1..MOST_TERMS {
            let odd = (2 * n - 1) as f64;
            e *= odd * odd * by / (2 * n) as f64;
            let term = (2 * n + 1) as f64 * e * y;
            if !(term < size) {
                break;
            }
            sum[0] += e * y;
            sum[1] += e * before;
            sum[2] += term;
            if term < 1e-17 * zero {
                break;
            }
            size = term;
            (before, y) = (y, x * x * before + (2 * n) as f64 * y);
        }
        let a = width.sqrt();
        Angle { j1: 4.0 / a * sum[0], j3: 4.0 * self.k * self.k / a * sum[1], j3s: 8.0 / (a * width) * sum[2] }
    }

    fn plain(&self, width: f64, d: f64) -> Angle {
        let strip = 2.0 * (d / width.sqrt()).asinh();
        let m = ((self.digits / (2.0 * strip)).ceil() as usize).max(2);
        let own;
        let squares = if m <= TABLED {
            &ANGLES[m]
        } else {
            own = angles(m);
            &own
        };
        let mut sum = [0.0; 3];
        for (j, s2) in squares.iter().enumerate() {
            let l = (d * d + width * s2).sqrt();
            let kl = self.k * l;
            let e = if j == 0 || j == m { 0.5 } else { 1.0 } * (-kl).exp() / l;
            let f = (1.0 + kl) * e / (l * l);
            sum[0] += e;
            sum[1] += f;
            sum[2] += f * s2;
        }
        let step = 2.0 * PI / m as f64;
        Angle { j1: step * sum[0], j3: step * sum[1], j3s: 2.0 * step * sum[2] }
    }

    fn elliptic(&self, a: f64, d: f64, longest: f64) -> Angle {
        let (modulus, other) = (a / longest, d / longest);
        let quarter = 0.5 * PI / mean(1.0, other);
        let quarter_other = 0.5 * PI / mean(1.0, modulus);
        let q = (-PI * quarter / quarter_other).exp();
        let (q2, q4) = (q * q, q * q * q * q);
        let (q6, q9, q12, q16) = (q2 * q4, q4 * q4 * q, q4 * q4 * q4, q4 * q4 * q4 * q4);
        let m = ((self.digits * quarter / (2.0 * PI * quarter_other)).ceil() as usize).max(3);
        let rate = (0.5 * PI * quarter / quarter_other / m as f64).exp();
        let back = 1.0 / rate;
        let sine = q.sqrt().sqrt() * (other / modulus).sqrt();
        let (square, width) = (d * d, a * a);
        // Whether the last terms of the series count.
        let long = q > 1e-3;
        let (mut up, mut down) = (1.0, 1.0);
        let mut sum = [0.0; 3];
        for j in 0..=m {
            let (up2, down2) = (up * up, down * down);
            let (up4, down4) = (up2 * up2, down2 * down2);
            let mut third = 1.0 + q * (up2 + down2) + q4 * (up4 + down4);
            let mut first = (up - down) - q2 * (up * up2 - down * down2) + q6 * (up * up4 - down * down4);
            if long {
                let (up6, down6) = (up2 * up4, down2 * down4);
                third += q9 * (up6 + down6) + q16 * (up4 * up4 + down4 * down4);
                first -= q12 * (up * up6 - down * down6);
            }
            let half = sine * first / third;
            let s2 = half * half;
            let l2 = square + width * s2;
            let kl = self.k * l2.sqrt();
            let end = j == 0 || j == m;
            let f = if end { 0.5 } else { 1.0 } * (-kl).exp();
            let g = (1.0 + kl) * f / l2;
            sum[0] += f;
            sum[1] += g;
            sum[2] += g * s2;
            (up, down) = (up * rate, down * back);
        }
        let step = 4.0 / longest * quarter / m as f64;
        Angle { j1: step * sum[0], j3: step * sum[1], j3s: 2.0 * step * sum[2] }
    }
}

/// Arithmetic-geometric mean.
fn mean(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-8 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integrals by Gauss sums over panels of the angle that shrink towards zero.
    fn brute(k: f64, width: f64, d: f64) -> [f64; 3] {
        let (nodes, weights) = crate::legendre::gauss(24);
        let mut sum = [0.0; 3];
        let (mut from, mut to) = (0.7 * PI, PI);
        for _ in 0..120 {
            for (x, w) in nodes.iter().zip(&weights) {
                let theta = from + (to - from) * x;
                let half = (0.5 * theta).sin().powi(2);
                let l = (d * d + width * half).sqrt();
                let f = 2.0 * (to - from) * w * (-k * l).exp() / l;
                let g = f * (1.0 + k * l) / (l * l);
                sum = [sum[0] + f, sum[1] + g, sum[2] + 2.0 * half * g];
            }
            (from, to) = (0.7 * from, from);
        }
        sum
    }

    #[test]
    fn every_rule_agrees_with_brute_force() {
        let k = 3.0;
        for a in [0.5, 2.0, 8.0, 13.0, 14.0, 20.0, 60.0_f64] {
            for d in [1e-4, 1e-2, 0.1, 0.5, 1.0, 3.0, 8.0, 12.0_f64] {
                let exact = brute(k, a * a, d);
                for (kernel, nearest) in [(Kernel::new(k, 0.0), 0.0), (Kernel::new(k, d), d)] {
                    let Angle { j1, j3, j3s } = kernel.angle(a * a, d);
                    // Measured against what the nearest source does at the distance zero.
                    let unit = (-k * nearest).exp();
                    for (c, (found, size)) in
                        [(j1, 1.0 / a), (j3, 1.0 / (a * d * d)), (j3s, 1.0 / (a * a * a))].into_iter().enumerate()
                    {
                        let miss = (found - exact[c]).abs() / (exact[c] + size * unit);
                        assert!(miss < 5e-13, "a = {a}, d = {d}, J{c}: {found} {} {miss:e}", exact[c]);
                    }
                }
            }
        }
    }
}
