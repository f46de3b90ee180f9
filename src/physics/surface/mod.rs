//! Rigid surfaces. A surface answers one question: where does your generator run?
//!
//! The generator is a curve in (u, d): distance from the axis, and depth behind the body's foremost point on the axis, along the
//! axis, into the body. Its parameter t starts at 0 and is a length. Tangents, curvatures and volumes follow from it. A generator
//! that starts on the axis has u = O(t) there.

mod arc;
mod cone;
mod curve;
mod cylinder;
mod face;
mod line;
mod paraboloid;
mod plane;
mod sphere;

pub use arc::Arc;
pub use cone::Cone;
pub use curve::Curve;
pub use cylinder::Cylinder;
pub use face::{Face, Facing};
pub use line::Line;
pub use paraboloid::Paraboloid;
pub use plane::Plane;
pub use sphere::Sphere;

use crate::legendre;
use crate::scalar::{Jet, Scalar, lift};
use std::f64::consts::PI;

/// The one question, with what has a closed form for some.
pub trait Generator {
    /// Radius u and depth d at the parameter t.
    fn point<S: Scalar>(&self, t: S) -> [S; 2];

    /// True where the generator starts on the axis.
    fn axial(&self) -> bool {
        true
    }

    /// The parameter at its end; infinite where it has none.
    fn end(&self) -> f64 {
        f64::INFINITY
    }

    /// A length along which it is nearly a plane or cone, from the axis; infinite for one.
    fn straight(&self) -> f64 {
        f64::INFINITY
    }

    /// The first parameter at which it has a radius.
    fn at_radius(&self, u: f64) -> Option<f64> {
        search(self, u)
    }

    /// u/t, also on the axis, where it starts there.
    fn ratio<S: Scalar>(&self, t: S) -> S {
        if t.value() == 0.0 {
            let [_, du, dduh, ..] = derivatives(|t| self.point(t)[0], 0.0);
            return lift(du, 0.5 * dduh, 0.0, t, t);
        }
        self.point(t)[0] / t
    }

    /// Direction of the generator with all depths times `depth`.
    fn frame<S: Scalar>(&self, t: S, depth: f64) -> Frame<S> {
        let u = derivatives(|t| self.point(t)[0], t.value());
        let d = derivatives(|t| self.point(t)[1], t.value()).map(|v| v * depth);
        let square = u[1] * u[1] + d[1] * d[1];
        let speed = square.sqrt();
        let (cross, dot) = (u[1] * d[2] - d[1] * u[2], u[1] * u[2] + d[1] * d[2]);
        let bend = cross / square;
        let bend_slope = (u[1] * d[3] - d[1] * u[3]) / square - 2.0 * bend * dot / square;
        Frame {
            angle: lift(d[1].atan2(u[1]), bend, 0.0, t, t),
            speed: lift(speed, dot / speed, 0.0, t, t),
            bend: lift(bend, bend_slope, 0.0, t, t),
        }
    }

    /// Integral of pi u^2 dd along the generator from 0 to t.
    fn volume<S: Scalar>(&self, t: S) -> S {
        integral(t, |t| {
            let [u, d] = self.point(Jet::<6>::x(t)).map(Jet::derivatives);
            PI * u[0] * u[0] * d[1]
        })
    }

    /// Length of the generator from 0 to t.
    fn length<S: Scalar>(&self, t: S) -> S {
        integral(t, |t| self.frame(t, 1.0).speed)
    }
}

/// The integral of a smooth function from 0 to t.
fn integral<S: Scalar>(t: S, integrand: impl Fn(f64) -> f64) -> S {
    let end = t.value();
    if end == 0.0 {
        return lift(0.0, integrand(0.0), 0.0, t, t);
    }
    let (nodes, weights) = legendre::gauss(NODES);
    let sum = |panels: usize| -> f64 {
        let h = end / panels as f64;
        let panel =
            |i: usize| nodes.iter().zip(&weights).map(|(x, w)| w * h * integrand((i as f64 + x) * h)).sum::<f64>();
        (0..panels).map(panel).sum()
    };
    let (mut panels, mut value) = (1, sum(1));
    while panels < MOST_PANELS {
        panels *= 2;
        let finer = sum(panels);
        let change = (finer - value).abs();
        value = finer;
        if !(change > 1e-15 * value.abs()) {
            break;
        }
    }
    lift(value, integrand(end), 0.0, t, t)
}

/// Places that are looked at for a radius.
const SEARCHED: f64 = 64.0;
/// Nodes of a panel, and panels at most, of the volume of a surface without closed form.
const NODES: usize = 16;
const MOST_PANELS: usize = 256;

/// The first parameter at which a generator has a radius, without closed form.
fn search<G: Generator + ?Sized>(generator: &G, u: f64) -> Option<f64> {
    let radius = |t: f64| generator.point(t)[0];
    let mut far = generator.end();
    if far.is_infinite() {
        far = u.max(1e-12);
        while radius(far) < u && far < 1e9 {
            far *= 2.0;
        }
    }
    let step = far / SEARCHED;
    let first = (1..=SEARCHED as usize).map(|i| step * i as f64).find(|t| radius(*t) >= u * (1.0 - 1e-14))?;
    let (mut a, mut b) = (first - step, first);
    if radius(a) > u {
        return None;
    }
    for _ in 0..60 {
        let m = 0.5 * (a + b);
        if radius(m) < u { a = m } else { b = m }
    }
    Some(0.5 * (a + b))
}

/// Value and first three derivatives of a function of one variable.
fn derivatives(f: impl Fn(Jet<10>) -> Jet<10>, t: f64) -> [f64; 4] {
    let [v, d, _, dd, _, _, ddd, ..] = f(Jet::x(t)).derivatives();
    [v, d, dd, ddd]
}

/// Direction of a generator at a point.
#[derive(Clone, Copy, Debug)]
pub struct Frame<S> {
    /// Its angle from the outward radius, towards depth.
    pub angle: S,
    /// Length per t.
    pub speed: S,
    /// d angle/dt.
    pub bend: S,
}

macro_rules! surfaces {
    ($($name:ident),+ $(,)?) => {
        /// The surfaces, a closed set.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Surface {
            $(
                #[doc = concat!("See [`", stringify!($name), "`].")]
                $name($name),
            )+
        }

        impl Generator for Surface {
            fn point<S: Scalar>(&self, t: S) -> [S; 2] {
                match self { $(Surface::$name(s) => s.point(t),)+ }
            }
            fn axial(&self) -> bool {
                match self { $(Surface::$name(s) => s.axial(),)+ }
            }
            fn end(&self) -> f64 {
                match self { $(Surface::$name(s) => s.end(),)+ }
            }
            fn straight(&self) -> f64 {
                match self { $(Surface::$name(s) => s.straight(),)+ }
            }
            fn at_radius(&self, u: f64) -> Option<f64> {
                match self { $(Surface::$name(s) => s.at_radius(u),)+ }
            }
            #[inline(always)]
            fn ratio<S: Scalar>(&self, t: S) -> S {
                match self { $(Surface::$name(s) => s.ratio(t),)+ }
            }
            #[inline(always)]
            fn frame<S: Scalar>(&self, t: S, depth: f64) -> Frame<S> {
                match self { $(Surface::$name(s) => s.frame(t, depth),)+ }
            }
            fn volume<S: Scalar>(&self, t: S) -> S {
                match self { $(Surface::$name(s) => s.volume(t),)+ }
            }
            fn length<S: Scalar>(&self, t: S) -> S {
                match self { $(Surface::$name(s) => s.length(t),)+ }
            }
        }

        $(
            impl From<$name> for Surface {
                fn from(s: $name) -> Surface { Surface::$name(s) }
            }
        )+
    };
}

surfaces!(Plane, Cone, Sphere, Paraboloid, Cylinder, Line, Arc, Curve);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    /// A surface by its question alone.
    struct Asked<'a>(&'a Surface);

    impl Generator for Asked<'_> {
        fn point<S: Scalar>(&self, t: S) -> [S; 2] {
            self.0.point(t)
        }
    }

    fn all() -> Vec<Surface> {
        vec![
            Plane.into(),
            Cone { inclination: 0.7 }.into(),
            Sphere { radius: 0.9 }.into(),
            Paraboloid { radius: 0.6 }.into(),
            Cylinder { radius: 0.4 }.into(),
            Line::new([0.2, 0.1], [1.5, -0.4]).into(),
            Line::ray([0.3, 0.1], 0.6).into(),
            Arc::new([0.3, 0.0], [0.9, 0.2], [1.2, 0.9]).unwrap().into(),
            curve("b*u^4").into(),
        ]
    }

    /// A profile d(u) with b = 1.3.
    fn curve(text: &str) -> Curve {
        struct Names;
        impl crate::expr::Scope for Names {
            fn name(
                &mut self,
                builder: &mut crate::expr::Builder,
                name: &str,
                _: std::ops::Range<usize>,
            ) -> Result<crate::expr::Node, Vec<crate::expr::ExprError>> {
                Ok(if name == "u" { builder.input(0) } else { builder.constant(1.3) })
            }
        }
        let mut builder = crate::expr::Builder::new();
        let node = builder.add(&crate::expr::parse(text).unwrap(), &mut Names).unwrap();
        builder.output(node);
        Curve::profile(builder.finish())
    }

    /// What has a closed form is what follows from the generator; and with flattened depths as well.
    #[test]
    fn closed_forms_follow_from_the_generator() {
        for s in all() {
            for depth in [1.0, -1.0, 0.3] {
                let t = Dual::<1>::variable(0.8, 0);
                let (ours, theirs) = (s.frame(t, depth), Asked(&s).frame(t, depth));
                for (a, b) in [(ours.angle, theirs.angle), (ours.speed, theirs.speed), (ours.bend, theirs.bend)] {
                    assert_relative_eq!(a.re, b.re, epsilon = 1e-13, max_relative = 1e-12);
                    assert_relative_eq!(a.du[0], b.du[0], epsilon = 1e-12, max_relative = 1e-11);
                }
                let [u, d] = s.point(t);
                assert_relative_eq!(
                    u.du[0],
                    ours.speed.re * ours.angle.re.cos(),
                    epsilon = 1e-13,
                    max_relative = 1e-12
                );
                assert_relative_eq!(
                    d.du[0] * depth,
                    ours.speed.re * ours.angle.re.sin(),
                    epsilon = 1e-13,
                    max_relative = 1e-12
                );
                assert_relative_eq!(ours.angle.du[0], ours.bend.re, epsilon = 1e-13, max_relative = 1e-12);
            }
            let (v, w) = (s.volume(Dual::<1>::variable(0.8, 0)), Asked(&s).volume(0.8));
            assert_relative_eq!(v.re, w, epsilon = 1e-14, max_relative = 1e-5);
            let [u, d] = s.point(Dual::<1>::variable(0.8, 0));
            assert_relative_eq!(v.du[0], PI * u.re * u.re * d.du[0], epsilon = 1e-13, max_relative = 1e-12);
            assert_eq!(s.volume(0.0), 0.0);
            let l = s.length(Dual::<1>::variable(0.8, 0));
            assert_relative_eq!(l.re, Asked(&s).length(0.8), max_relative = 1e-5);
            assert_relative_eq!(l.du[0], s.frame(0.8, 1.0).speed, max_relative = 1e-12);
            if s.axial() {
                assert_eq!(s.point(0.0)[0], 0.0);
                let (a, b) = (s.ratio(t0()), s.ratio(t0() + 1e-7));
                assert_relative_eq!(a.re, b.re, max_relative = 1e-6);
                assert_relative_eq!(s.ratio(0.8), s.point(0.8)[0] / 0.8, max_relative = 1e-14);
            }
        }
    }

    fn t0() -> Dual<1> {
        Dual::variable(0.0, 0)
    }

    /// The twin: a depth off by a thousandth is seen by each of the comparisons above.
    #[test]
    fn another_sphere_is_another() {
        let (a, b) = (Sphere { radius: 0.9 }, Sphere { radius: 0.9009 });
        assert!((a.frame(0.8, 1.0).angle - b.frame(0.8, 1.0).angle).abs() > 1e-4);
        assert!((a.volume(0.8) / b.volume(0.8) - 1.0).abs() > 1e-4);
    }
}
