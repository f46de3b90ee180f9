use super::{Frame, Generator};
use crate::scalar::Scalar;

/// A circular arc in (u, d), t the arc length from its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Arc {
    centre: [f64; 2],
    radius: f64,
    /// Angle of the radius vector at the start.
    start: f64,
    /// 1 where that angle grows.
    turn: f64,
    length: f64,
    axial: bool,
}

impl Arc {
    /// The arc from a point (u, d) through another to a third; nothing where they lie on a line.
    pub fn new(from: [f64; 2], through: [f64; 2], to: [f64; 2]) -> Option<Self> {
        let sub = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let (a, b) = (sub(through, from), sub(to, from));
        let cross = a[0] * b[1] - a[1] * b[0];
        let (aa, bb) = (a[0] * a[0] + a[1] * a[1], b[0] * b[0] + b[1] * b[1]);
        if cross.abs() <= 1e-12 * (aa * bb).sqrt() {
            return None;
        }
        let centre =
            [from[0] + (b[1] * aa - a[1] * bb) / (2.0 * cross), from[1] + (a[0] * bb - b[0] * aa) / (2.0 * cross)];
        let angle = |p: [f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
        let turn = cross.signum();
        let sweep = (turn * (angle(to) - angle(from))).rem_euclid(2.0 * std::f64::consts::PI);
        let radius = sub(from, centre)[0].hypot(sub(from, centre)[1]);
        Some(Arc { centre, radius, start: angle(from), turn, length: radius * sweep, axial: from[0] == 0.0 })
    }
}

impl Generator for Arc {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        // From the start by the chord: exact there.
        let (r, half) = (self.radius, t * (self.turn / (2.0 * self.radius)));
        let (sin, cos) = half.sin_cos();
        let (sin0, cos0) = self.start.sin_cos();
        let chord = sin * (2.0 * r);
        let start = if self.axial { 0.0 } else { self.centre[0] + r * cos0 };
        // The chord stands at a right angle to the bisecting radius.
        [-(chord * (sin * cos0 + cos * sin0)) + start, chord * (cos * cos0 - sin * sin0) + (self.centre[1] + r * sin0)]
    }
    fn axial(&self) -> bool {
        self.axial
    }
    fn end(&self) -> f64 {
        self.length
    }
    fn straight(&self) -> f64 {
        self.radius
    }
    fn frame<S: Scalar>(&self, t: S, depth: f64) -> Frame<S> {
        let at = t * (self.turn / self.radius) + self.start;
        let (sin, cos) = at.sin_cos();
        let (u, d) = (-(sin * self.turn), cos * (self.turn * depth));
        let square = u * u + d * d;
        // The angle without jumps: that of the circle, and what the factor on depths adds.
        let circle = at + self.turn * std::f64::consts::FRAC_PI_2;
        let angle = if depth == 1.0 {
            circle
        } else if depth == -1.0 {
            -circle
        } else {
            let (v, w) = (u.value(), d.value());
            crate::scalar::lift(w.atan2(v), -w / (v * v + w * w), v / (v * v + w * w), u, d)
        };
        let angle = wrapped(angle);
        Frame { angle, speed: square.sqrt(), bend: square.recip() * (depth * self.turn / self.radius) }
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t
    }
}

/// The angle in (-pi, pi].
fn wrapped<S: Scalar>(angle: S) -> S {
    let turns = (angle.value() / (2.0 * std::f64::consts::PI)).round();
    angle - turns * 2.0 * std::f64::consts::PI
}
