//! The side of a surface on which a membrane lies.

use super::{Frame, Generator, Surface};
use crate::physics::membrane::Local;
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// The side of a rigid body on which the membrane lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Solid above, membrane below.
    Down,
    /// Solid below, membrane above.
    Up,
}

/// Where a membrane lies on a surface: the surface, its side, and the direction in which the meridian is walked along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The surface.
    pub surface: Surface,
    /// The side.
    pub facing: Facing,
    /// Factor on all depths: 1 is the surface itself, -1 the cavity of its shape, 0 a plane. A first contact is found on the plane
    /// and raised from there.
    pub depth: f64,
    /// 1 where the meridian is walked towards growing t, else -1.
    pub sense: f64,
}

impl Face {
    /// A face whose solid, or whose cavity (`hollow`), is on the side of its body.
    ///
    /// The meridian is walked with the membrane's outward side towards the solid: outwards on a face looking down, inwards on one
    /// looking up; on the side of a tube, which has the solid outside, the other way.
    pub fn new(surface: Surface, facing: Facing, hollow: bool) -> Self {
        let tube = matches!(surface, Surface::Cylinder(_)) && hollow;
        let outwards = (facing == Facing::Down) != tube;
        Face {
            depth: if hollow && !tube { -1.0 } else { 1.0 },
            sense: if outwards { 1.0 } else { -1.0 },
            surface,
            facing,
        }
    }

    /// True on the inside of a tube.
    pub fn is_tube(&self) -> bool {
        matches!(self.surface, Surface::Cylinder(_)) && (self.facing == Facing::Down) != (self.sense > 0.0)
    }

    /// Parameter of the generator from the second state of a piece and the reference radius.
    ///
    /// Where the generator starts on the axis the state is ln(t/rho0), regular at a pole and free of scale at a tip; elsewhere t itself.
    #[inline(always)]
    pub fn parameter<S: Scalar>(&self, state: S, rho0: S) -> S {
        if self.surface.axial() { state.exp() * rho0 } else { state }
    }

    /// The second state of a piece from the parameter, the inverse of [`Face::parameter`].
    pub fn state<S: Scalar>(&self, t: S, rho0: S) -> S {
        if self.surface.axial() { (t / rho0).ln() } else { t }
    }

    /// ln(u/rho0) at a state.
    #[inline(always)]
    pub fn ln_mu<S: Scalar>(&self, state: S, t: S, rho0: S) -> S {
        match &self.surface {
            Surface::Plane(_) | Surface::Cone(_) | Surface::Paraboloid(_) => state,
            surface if surface.axial() => state + surface.ratio(t).ln(),
            surface => (surface.point(t)[0] / rho0).ln(),
        }
    }

    /// The direction of the generator.
    #[inline(always)]
    pub fn frame<S: Scalar>(&self, t: S) -> Frame<S> {
        self.surface.frame(t, self.depth)
    }

    /// Tangent angle tau of the meridian, from the angle of the generator.
    #[inline(always)]
    pub fn tangent<S: Scalar>(&self, angle: S) -> S {
        match (self.facing, self.sense > 0.0) {
            (Facing::Down, true) => -angle,
            (Facing::Down, false) => -angle + PI,
            (Facing::Up, true) => angle,
            (Facing::Up, false) => angle + PI,
        }
    }

    /// d tau/dt.
    pub fn bend<S: Scalar>(&self, frame: &Frame<S>) -> S {
        if self.facing == Facing::Down { -frame.bend } else { frame.bend }
    }

    /// Slope of the second state, d/d eta, at a point of the membrane.
    #[inline(always)]
    pub fn advance<S: Scalar>(&self, frame: &Frame<S>, t: S, m: &Local<S>) -> S {
        let sense = frame.speed.recip() * self.sense;
        if self.surface.axial() {
            m.lambda / m.mu * self.surface.ratio(t) * sense - m.slope0
        } else {
            m.rho0 * m.lambda * sense
        }
    }

    /// sin(tau)/u, also on the axis.
    pub fn hoop<S: Scalar>(&self, frame: &Frame<S>, t: S, u: S) -> S {
        let tau = self.tangent(frame.angle);
        if t.value() > 0.0 || !self.surface.axial() {
            return tau.sin() / u;
        }
        // tau turns as u grows.
        self.bend(frame) * self.sense / frame.speed
    }

    /// Position below the apex: h - h(apex).
    pub fn drop<S: Scalar>(&self, t: S) -> S {
        let d = self.surface.point(t)[1] * self.depth;
        if self.facing == Facing::Down { -d } else { d }
    }

    /// Length of the walk between two parameters.
    pub fn length<S: Scalar>(&self, from: S, to: S) -> S {
        (self.surface.length(to) - self.surface.length(from)) * self.sense
    }

    /// Integral of pi u^2 dh along the walk between two parameters.
    pub fn swept_volume<S: Scalar>(&self, from: S, to: S) -> S {
        let v = (self.surface.volume(to) - self.surface.volume(from)) * self.depth;
        if self.facing == Facing::Down { -v } else { v }
    }

    /// The inclination at the axis, in radians; not zero on a tip.
    pub fn tip_inclination(&self) -> f64 {
        if self.surface.axial() { self.frame(0.0_f64).angle } else { 0.0 }
    }

    /// How deep a point at radius `u`, `drop` below the apex, lies inside the solid (length); negative outside. Measured along the axis,
    /// along the radius on the side of a cylinder, and towards the centre of a sphere. Nothing where the surface does not stand
    /// above or below that radius.
    pub fn penetration(&self, u: f64, drop: f64) -> Option<f64> {
        let behind = if self.facing == Facing::Down { -drop } else { drop };
        match &self.surface {
            Surface::Cylinder(c) => (behind > 0.0).then_some(if self.is_tube() { u - c.radius } else { c.radius - u }),
            Surface::Sphere(s) if self.depth > 0.0 => Some(s.radius - u.hypot(behind - s.radius)),
            surface => Some(behind - surface.point(surface.at_radius(u)?)[1] * self.depth),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::surface::{Cone, Cylinder, Plane, Sphere};
    use std::f64::consts::FRAC_PI_2;

    /// The membrane's outward normal (sin tau, cos tau up) points into the solid on every face.
    #[test]
    fn the_walk_has_the_solid_on_its_outward_side() {
        let close = |a: f64, b: f64| assert!((a - b).rem_euclid(2.0 * PI).min((b - a).rem_euclid(2.0 * PI)) < 1e-12);
        let tau = |face: &Face, t: f64| face.tangent(face.frame(t).angle);
        use Facing::{Down, Up};
        let cone = |facing, hollow| Face::new(Cone { inclination: 0.4 }.into(), facing, hollow);
        close(tau(&cone(Down, false), 1.0), -0.4); // under an indenter: outwards and up
        close(tau(&cone(Up, false), 1.0), PI + 0.4); // over a peak, from outside: inwards and up
        close(tau(&cone(Down, true), 1.0), 0.4); // in an inverted funnel: outwards and down
        close(tau(&cone(Up, true), 1.0), PI - 0.4); // in a funnel: inwards and down
        let side = |facing, hollow| Face::new(Cylinder { radius: 0.3 }.into(), facing, hollow);
        close(tau(&side(Down, true), 1.0), FRAC_PI_2); // in a pipette: down
        close(tau(&side(Up, true), 1.0), FRAC_PI_2);
        close(tau(&side(Down, false), 1.0), -FRAC_PI_2); // along a punch: up
        close(tau(&side(Up, false), 1.0), -FRAC_PI_2);
        close(tau(&Face::new(Plane.into(), Up, false), 1.0), PI);
        let bead = Face::new(Sphere { radius: 0.5 }.into(), Down, false);
        close(tau(&bead, 0.5 * 2.0), -2.0); // beyond its equator
    }

    #[test]
    fn a_point_inside_the_solid_is_seen() {
        let bead = Face::new(Sphere { radius: 0.5 }.into(), Facing::Down, false);
        // The bead's foremost point is at drop 0, its solid above (negative drop).
        assert!(bead.penetration(0.0, -0.1).unwrap() > 0.09);
        assert!(bead.penetration(0.0, 0.1).unwrap() < -0.09);
        assert!(bead.penetration(0.6, -0.1).unwrap() < 0.0);
        let tube = Face::new(Cylinder { radius: 0.5 }.into(), Facing::Down, true);
        assert!(tube.penetration(0.6, -0.1).unwrap() > 0.09);
        assert!(tube.penetration(0.4, -0.1).unwrap() < -0.09);
        assert!(tube.penetration(0.6, 0.1).is_none());
        let bar = Face::new(Cylinder { radius: 0.5 }.into(), Facing::Up, false);
        assert!(bar.penetration(0.4, 0.1).unwrap() > 0.09);
    }
}
