use super::{Frame, Generator};
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A straight face between two points (u, d), t the length from the first.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    from: [f64; 2],
    angle: f64,
    length: f64,
}

impl Line {
    /// The line from one point (u, d) to another.
    pub fn new(from: [f64; 2], to: [f64; 2]) -> Self {
        let [u, d] = [to[0] - from[0], to[1] - from[1]];
        Line { from, angle: d.atan2(u), length: u.hypot(d) }
    }

    /// The line from a point (u, d) at an angle from the horizontal, without an end.
    pub fn ray(from: [f64; 2], angle: f64) -> Self {
        Line { from, angle, length: f64::INFINITY }
    }
}

impl Generator for Line {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        [t * self.angle.cos() + self.from[0], t * self.angle.sin() + self.from[1]]
    }
    fn axial(&self) -> bool {
        self.from[0] == 0.0
    }
    fn end(&self) -> f64 {
        self.length
    }
    fn ratio<S: Scalar>(&self, _: S) -> S {
        S::from(self.angle.cos())
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, _: S, depth: f64) -> Frame<S> {
        let (sin, cos) = self.angle.sin_cos();
        let (u, d) = (cos, sin * depth);
        Frame { angle: S::from(d.atan2(u)), speed: S::from(u.hypot(d)), bend: S::from(0.0) }
    }
    fn volume<S: Scalar>(&self, t: S) -> S {
        let (sin, cos) = self.angle.sin_cos();
        let u = self.from[0];
        // pi sin times the integral of (u + t cos)^2.
        (((t * cos / 3.0 + u) * t * cos + u * u) * t) * (PI * sin)
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t
    }
}
