//! The initial state: the fluid alone, no body, in closed form.

use super::material;
use super::names::Names;
use super::tractions::sphere_repulsion;
use crate::diagnostic::Diagnostic;
use crate::physics::material::{Energy, Law};
use crate::physics::reference::Sphere;
use crate::spec::{self, Problem};
use std::f64::consts::PI;

/// A sphere, inflated uniformly (or not at all).
#[derive(Clone, Debug, PartialEq)]
pub struct Initial {
    /// The stress-free shape.
    pub reference: Sphere,
    /// The material.
    pub law: Law,
    /// Stretch in both directions; 1 where nothing is loaded.
    pub stretch: f64,
    /// Tension per reference length.
    pub tension: f64,
    /// Over-pressure of the fluid.
    pub pressure: f64,
    /// Pressure outside.
    pub outside: f64,
    /// Radius.
    pub radius: f64,
    /// Volume.
    pub volume: f64,
    /// Elastic energy.
    pub energy: f64,
    /// Axial position of the middle.
    pub middle: f64,
    /// Coupling and inverse screening length of the charge that the membrane carries.
    pub charge: Option<(f64, f64)>,
}

impl Initial {
    fn new(reference: Sphere, law: Law, stretch: f64) -> Self {
        let response = law.response(stretch, stretch);
        let radius = stretch * reference.radius;
        Initial {
            stretch,
            tension: response.w_l,
            pressure: 2.0 * response.w_l / (stretch * stretch * reference.radius),
            outside: 0.0,
            radius,
            volume: 4.0 / 3.0 * PI * radius.powi(3),
            energy: reference.area() * response.w,
            middle: 0.0,
            charge: None,
            reference,
            law,
        }
    }

    /// The same sphere with a charge that repels itself: the fluid holds less pressure.
    pub fn charged(self, charge: Option<(f64, f64)>) -> Self {
        let own = charge.map_or(0.0, |(c, k)| sphere_repulsion(c, k, self.reference.radius, self.radius));
        Initial { charge, pressure: self.pressure - own, ..self }
    }

    /// The same sphere at another stretch.
    pub fn at(&self, stretch: f64) -> Self {
        let other = Initial::new(self.reference.clone(), self.law.clone(), stretch);
        Initial { outside: self.outside, middle: self.middle, ..other }.charged(self.charge)
    }
}

/// A constant that must be positive.
fn positive(names: &Names, n: &spec::Number, pointer: &str, what: &str, errors: &mut Vec<Diagnostic>) -> Option<f64> {
    let v = names.constant(n, pointer, errors)?;
    if v > 0.0 {
        return Some(v);
    }
    errors.push(
        Diagnostic::error("not-positive", format!("{what} must be positive, not {v}")).at(pointer, format!("is {v}")),
    );
    None
}

/// Understands reference shape, material and initial state.
pub fn resolve(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) -> Option<Initial> {
    let reference = match &problem.reference {
        spec::Reference::Sphere { radius } => {
            positive(names, radius, "/reference/Sphere/radius", "the radius of the reference sphere", errors)
                .map(|radius| Sphere { radius })
        }
        _ => {
            errors.push(
                Diagnostic::error(
                    "not-supported",
                    "a reference shape other than a sphere cannot be solved by this version",
                )
                .at("/reference", "not supported yet"),
            );
            None
        }
    };
    let law = material::law(problem, names, errors);
    let stretch = stretch(problem, names, reference.as_ref(), law.as_ref(), errors);
    let unloaded = problem.initial == spec::Initial::Unloaded;
    if !unloaded && problem.fluid.is_none() {
        errors.push(
            Diagnostic::error("no-fluid", "nothing holds the inflated initial state: the file has no fluid")
                .at("/initial", "inflated, by what?")
                .help("fluid: Incompressible, Pressure(..), Volume(..), Compressible(..), IdealGas(..), Osmotic(..), Law(..)"),
        );
        return None;
    }
    let (reference, stretch) = (reference?, stretch?);
    if !unloaded && !(stretch > 1.0 + 1e-6) {
        let (radius, r0) = (reference.radius, stretch * reference.radius);
        let message =
            format!("the initial sphere of radius {r0} is not larger than the reference sphere of radius {radius}");
        errors.push(
            Diagnostic::error("no-tension", message)
                .at("/initial", "no tension: wrinkled or slack states are not solved by this version")
                .help(
                "an initial state under tension is needed: an inflated sphere that is larger than the reference sphere",
            ),
        );
        return None;
    }
    let law = law?;
    let energy = law.energy(stretch, stretch);
    if !energy.is_finite() {
        errors.push(
            Diagnostic::error("locked", format!("the material locks before the initial stretch {stretch} is reached"))
                .at("/initial", "energy infinite or undefined there"),
        );
        return None;
    }
    Some(Initial::new(reference, law, stretch))
}

/// The stretch of the initial sphere: each number is examined also where the others are wrong.
fn stretch(
    problem: &Problem,
    names: &Names,
    reference: Option<&Sphere>,
    law: Option<&Law>,
    errors: &mut Vec<Diagnostic>,
) -> Option<f64> {
    Some(match &problem.initial {
        spec::Initial::Unloaded => 1.0,
        spec::Initial::Inflated(spec::Inflation::Radius(n)) => {
            let pointer = "/initial/Inflated/radius";
            let r = positive(names, n, pointer, "the inflated radius", errors)?;
            r / reference?.radius
        }
        spec::Initial::Inflated(spec::Inflation::Volume(n)) => {
            let v = positive(names, n, "/initial/Inflated/volume", "the inflated volume", errors)?;
            (v / (4.0 / 3.0 * PI)).cbrt() / reference?.radius
        }
        spec::Initial::Inflated(spec::Inflation::Pressure(n)) => {
            let p = positive(names, n, "/initial/Inflated/pressure", "the inflating pressure", errors)?;
            let (reference, law) = (reference?, law?);
            let pressure = |l: f64| 2.0 * law.response(l, l).w_l / (l * l * reference.radius);
            // The first stretch at which the pressure is reached, coming from the unloaded sphere.
            let mut l = 1.0;
            while pressure(l) < p && l < 100.0 {
                l += 0.01;
            }
            if !(pressure(l) >= p) {
                errors.push(
                    Diagnostic::error(
                        "no-inflation",
                        format!("no inflation of this material reaches the pressure {p}"),
                    )
                    .at("/initial/Inflated/pressure", "beyond its limit point"),
                );
                return None;
            }
            let (mut a, mut b) = (l - 0.01, l);
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if pressure(m) < p { a = m } else { b = m }
            }
            0.5 * (a + b)
        }
    })
}
