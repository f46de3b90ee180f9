//! The integral over the angle: what one ring of radius u' does at a point of radius u, at the distance d in the meridian plane.
//!
//! With l^2 = d^2 + a^2 sin^2(theta/2), a = 2 sqrt(u u'), and theta over a whole turn (2 times 0 to pi):
//!
//!   J1 = int exp(-k l)/l dtheta,
//!   J3 = int (1 + k l) exp(-k l)/l^3 dtheta,
//!   J3s = int (1 + k l) exp(-k l)/l^3 (1 - cos theta) dtheta.
//!
//! All three rules are trapezoidal sums in a variable in which the integrand is analytic in a strip and either periodic or cut
//! by the exponential, so that they converge exponentially; in the strip |exp(-k l)| <= 1, hence the error is measured against
//! the forces at distance zero (`digits` says how much more is wanted).
//! * a sin(theta/2) = d sinh t, l = d cosh t, where exp(-k l) vanishes before theta = pi; strip pi/2;
//! * theta itself, where d is not small against a; strip 2 asinh(d/a);
//! * else the elliptic integral of the first kind, dw = l_max dtheta / (2 l): l = d / dn(w), strip K'. The elliptic functions are
//!   quotients of theta functions of the complementary nome q' = exp(-pi K/K'), sums of three or four terms.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// Exponent of the accuracy of the trapezoidal sums: exp(-37) = 1e-16, and the double poles of the integrand at the strip's edge.
const DIGITS: f64 = 44.0;
/// Exponent beyond which sources do not count.
const CUT: f64 = 40.0;
/// Number of halvings of the step in t that are tabulated.
const LEVELS: usize = 3;
/// Largest t in the table.
const LONGEST: f64 = 46.0;
/// Largest number of intervals with tabulated angles.
const TABLED: usize = 24;

/// Rows of (cosh t, 1/cosh^2 t, tanh^2 t, sinh^2 t) at the finest step.
static HYPERBOLIC: LazyLock<Vec<[f64; 4]>> = LazyLock::new(|| {
    let step = PI * PI / DIGITS / (1 << LEVELS) as f64;
    (0..(LONGEST / step) as usize)
        .map(|j| {
            let t = j as f64 * step;
            let (c, s) = (t.cosh(), t.sinh());
            [c, 1.0 / (c * c), t.tanh() * t.tanh(), s * s]
        })
        .collect()
});

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
    level: usize,
}

impl Kernel {
    /// Decay rate `k`, and the distance of the point from the nearest source, which sets the scale of its field.
    pub fn new(k: f64, nearest: f64) -> Self {
        let digits = DIGITS + k * nearest;
        let level = (digits / DIGITS - 1e-9).log2().ceil().clamp(0.0, LEVELS as f64) as usize;
        Self { k, budget: CUT + k * nearest, digits, level }
    }

    /// Integrals for a ring with a^2 = 4 u u' `width` at distance `d` > 0.
    pub fn angle(&self, width: f64, d: f64) -> Angle {
        let longest = (d * d + width).sqrt();
        if self.k * d > self.budget {
            Angle::default()
        } else if self.k * longest > self.budget {
            self.cut(width, d)
        } else if width < 4.0 * d * d {
            self.plain(width, d)
        } else {
            self.elliptic(width.sqrt(), d, longest)
        }
    }

    fn cut(&self, width: f64, d: f64) -> Angle {
        let stride = 1 << (LEVELS - self.level);
        let step = PI * PI / DIGITS / (1 << self.level) as f64;
        let (kd, ratio) = (self.k * d, d * d / width);
        let first = (-kd).exp();
        let mut sum = [0.5 * first, 0.5 * (1.0 + kd) * first, 0.0];
        for [c, c2, t2, s2] in HYPERBOLIC.iter().skip(stride).step_by(stride) {
            let kl = kd * c;
            let left = 1.0 - ratio * s2;
            if kl > self.budget || left <= 0.0 {
                break;
            }
            let e = (-kl).exp() / left.sqrt();
            let f = (1.0 + kl) * e;
            sum[0] += e;
            sum[1] += f * c2;
            sum[2] += f * t2;
        }
        let scale = 4.0 * step / width.sqrt();
        Angle { j1: scale * sum[0], j3: scale / (d * d) * sum[1], j3s: 2.0 * scale / width * sum[2] }
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
        let head = 2.0 * q.sqrt().sqrt();
        let (shrink, grow) = (head * d / other.sqrt(), head * head * other / modulus);
        let mut e = 1.0;
        let mut sum = [0.0; 3];
        for j in 0..=m {
            let (up, down) = (e, 1.0 / e);
            let (up2, down2) = (up * up, down * down);
            let (up4, down4) = (up2 * up2, down2 * down2);
            let (up6, down6) = (up2 * up4, down2 * down4);
            let (p1, p3, p5, p7) = (up, up * up2, up * up4, up * up6);
            let (n1, n3, n5, n7) = (down, down * down2, down * down4, down * down6);
            let third = 1.0
                + q * (up2 + down2)
                + q4 * (up4 + down4)
                + q9 * (up6 + down6)
                + if q16 > 0.0 { q16 * (up4 * up4 + down4 * down4) } else { 0.0 };
            let (second, first) = if q12 > 0.0 {
                (
                    0.5 * ((p1 + n1) + q2 * (p3 + n3) + q6 * (p5 + n5) + q12 * (p7 + n7)),
                    0.5 * ((p1 - n1) - q2 * (p3 - n3) + q6 * (p5 - n5) - q12 * (p7 - n7)),
                )
            } else {
                (0.5 * ((p1 + n1) + q2 * (p3 + n3)), 0.5 * ((p1 - n1) - q2 * (p3 - n3)))
            };
            let l = shrink * second / third;
            let kl = self.k * l;
            let end = j == 0 || j == m;
            let f = if end { 0.5 } else { 1.0 } * (-kl).exp();
            let g = (1.0 + kl) * f / (l * l);
            let s = first / third;
            sum[0] += f;
            sum[1] += g;
            sum[2] += g * s * s;
            e *= rate;
        }
        let step = 4.0 / longest * quarter / m as f64;
        Angle { j1: step * sum[0], j3: step * sum[1], j3s: 2.0 * step * grow * sum[2] }
    }
}

/// Arithmetic-geometric mean.
fn mean(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-8 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    0.5 * (a + b)
}
