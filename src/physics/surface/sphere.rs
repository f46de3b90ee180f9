use super::{Frame, Generator};
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A sphere, t the arc length from its foremost point.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// Its radius.
    pub radius: f64,
}

impl Generator for Sphere {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        let r = self.radius;
        let (sin, half) = ((t / r).sin(), (t / (2.0 * r)).sin());
        [sin * r, half * half * (2.0 * r)]
    }
    fn straight(&self) -> f64 {
        self.radius
    }
    fn end(&self) -> f64 {
        PI * self.radius
    }
    fn at_radius(&self, u: f64) -> Option<f64> {
        (u <= self.radius).then(|| self.radius * (u / self.radius).asin())
    }
    #[inline(always)]
    fn ratio<S: Scalar>(&self, t: S) -> S {
        let x = t / self.radius;
        if x.value().abs() < 1e-2 {
            // sin x / x, to x^8/9!
            let q = x * x;
            return ((q / 72.0 - 1.0) * q / 42.0 + 1.0) * q * q / 120.0 - q / 6.0 + 1.0;
        }
        x.sin() / x
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, t: S, depth: f64) -> Frame<S> {
        let x = t / self.radius;
        if depth.abs() == 1.0 {
            return Frame { angle: x * depth, speed: S::from(1.0), bend: S::from(depth / self.radius) };
        }
        // The ellipse to which a factor on its depths makes it.
        let (sin, cos) = x.sin_cos();
        let square = cos * cos + sin * sin * (depth * depth);
        let angle = (x.tan() * depth).atan();
        let half_turns = (x.value() / PI).round();
        Frame {
            angle: angle + half_turns * PI * depth.signum(),
            speed: square.sqrt(),
            bend: square.recip() * (depth / self.radius),
        }
    }
    fn volume<S: Scalar>(&self, t: S) -> S {
        // pi d^2 (R - d/3), as a cap of the sphere: the disc below is not part of it.
        let r = self.radius;
        let [_, d] = self.point(t);
        // Integral of pi u^2 dd, u^2 = d (2 R - d).
        d * d * (-(d / 3.0) + r) * PI
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t
    }
}
