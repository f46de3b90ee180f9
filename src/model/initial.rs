//! The initial state: the fluid alone, no body, in closed form.

use super::material;
use super::names::Names;
use super::tractions::sphere_repulsion;
use crate::diagnostic::Diagnostic;
use crate::physics::material::Law;
use crate::physics::reference::Reference;
use crate::spec::{self, Problem};
use std::f64::consts::PI;

/// A sphere, inflated uniformly (or not at all), or a flat disc, stretched to its clamp.
#[derive(Clone, Debug, PartialEq)]
pub struct Initial {
    /// The stress-free shape.
    pub reference: Reference,
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
    /// Radius, of the rim for a disc.
    pub radius: f64,
    /// Volume.
    pub volume: f64,
    /// Elastic energy.
    pub energy: f64,
    /// Axial position of the middle of the sphere, or of the disc.
    pub middle: f64,
    /// Coupling and inverse screening length of the charge that the membrane carries.
    pub charge: Option<(f64, f64)>,
}

impl Initial {
    fn new(reference: Reference, law: Law, stretch: f64) -> Self {
        let response = law.response(stretch, stretch);
        let radius = stretch * reference.radius();
        let sphere = matches!(reference, Reference::Sphere { .. });
        Initial {
            stretch,
            tension: response.w_l,
            pressure: if sphere { 2.0 * response.w_l / (stretch * stretch * reference.radius()) } else { 0.0 },
            outside: 0.0,
            radius,
            volume: reference.volume() * stretch.powi(3),
            energy: reference.area() * response.w,
            middle: 0.0,
            charge: None,
            reference,
            law,
        }
    }

    /// Distance from the axis and height above the middle at a material coordinate, in radii.
    pub fn profile(&self, phi: f64) -> [f64; 2] {
        match self.reference {
            Reference::Sphere { .. } => [phi.sin(), phi.cos()],
            Reference::Disc { .. } => [phi, 0.0],
        }
    }

    /// Tangent angle at a material coordinate.
    pub fn tau(&self, phi: f64) -> f64 {
        if matches!(self.reference, Reference::Sphere { .. }) { phi } else { 0.0 }
    }

    /// The material coordinate at the end of the meridian.
    pub fn last_phi(&self) -> f64 {
        if matches!(self.reference, Reference::Sphere { .. }) { PI } else { 1.0 }
    }

    /// The same sphere with a charge that repels itself: the fluid holds less pressure.
    pub fn charged(self, charge: Option<(f64, f64)>) -> Self {
        let own = charge.map_or(0.0, |(c, k)| sphere_repulsion(c, k, self.reference.radius(), self.radius));
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
                .map(|radius| Reference::Sphere { radius })
        }
        spec::Reference::Disc { radius } => {
            positive(names, radius, "/reference/Disc/radius", "the radius of the reference disc", errors)
                .map(|radius| Reference::Disc { radius })
        }
        _ => {
            errors.push(
                Diagnostic::error("not-supported", "this reference shape cannot be solved by this version")
                    .at("/reference", "not supported yet")
                    .help("supported: Sphere, Disc"),
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
        let (radius, r0) = (reference.radius(), stretch * reference.radius());
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
    let response = law.response(stretch, stretch);
    let mut refuse = |code, message: String, label: &str| {
        errors.push(Diagnostic::error(code, message).at("/initial", label).at("/material", "this material"));
        None
    };
    if !response.w.is_finite() {
        let message = format!("the material locks before the initial stretch {stretch} is reached");
        return refuse("locked", message, "energy infinite or undefined there");
    }
    if !unloaded && !(response.w_l > 0.0) {
        let message = format!("the material has no tension at the initial stretch {stretch}");
        return refuse("no-tension", message, &format!("w_l = {} there", response.w_l));
    }
    if !(response.w_ll > 0.0) {
        let message =
            format!("the material has no stiffness at the initial stretch {stretch}: its energy is not convex");
        return refuse("no-stiffness", message, &format!("d2w/dlambda2 = {} there", response.w_ll));
    }
    Some(Initial::new(reference, law, stretch))
}

/// The stretch of a disc in its clamp.
fn clamped(problem: &Problem, names: &Names, radius: f64, errors: &mut Vec<Diagnostic>) -> Option<f64> {
    if problem.initial != spec::Initial::Unloaded {
        errors.push(
            Diagnostic::error("no-inflation", "a flat disc is not inflated to start with")
                .at("/initial", "has no closed shape")
                .help("initial: Unloaded; the pressure is then an unknown that starts at 0"),
        );
        return None;
    }
    let elements = problem.meridian.as_deref().unwrap_or_default();
    let Some(spec::Element::Clamped { u, .. }) = elements.last() else {
        errors.push(
            Diagnostic::error("no-clamp", "a disc is held at its rim")
                .at("/meridian", "the last element is no clamp")
                .help("end the meridian with Clamped(u: .., h: ..)"),
        );
        return None;
    };
    let at = format!("/meridian/{}/Clamped/u", elements.len() - 1);
    let stretch = positive(names, u, &at, "the radius of the clamp", errors)? / radius;
    if stretch < 1.0 {
        errors.push(
            Diagnostic::error("no-tension", format!("the clamp compresses the disc to {stretch} of its radius"))
                .at(at, "no tension: wrinkled or slack states are not solved by this version"),
        );
        return None;
    }
    Some(stretch)
}

/// The first stretch at which a sphere that is inflated from rest is under the pressure `p`.
///
/// # Errors
/// Why there is none, in words.
fn inflation(pressure: impl Fn(f64) -> f64, p: f64) -> Result<f64, String> {
    const MOST: f64 = 100.0;
    const STEP: f64 = 0.01;
    // Where the energy has ended (NaN) the pressure has passed every value.
    let below = |l: f64| pressure(l) < p;
    let (mut before, mut a, mut b) = (1.0, 1.0, 1.0 + STEP);
    let mut highest = (0.0, 1.0);
    while below(b) {
        if b > MOST {
            let (most, at) = highest;
            return Err(format!("it does not exceed {most:.6}, at the stretch {at:.4}"));
        }
        let (mut top, mut value) = (b, pressure(b));
        if pressure(a) > value && pressure(a) >= pressure(before) {
            // A limit point, found by thirds.
            let (mut left, mut right) = (before, b);
            for _ in 0..100 {
                let third = (right - left) / 3.0;
                if pressure(left + third) < pressure(right - third) { left += third } else { right -= third }
            }
            top = 0.5 * (left + right);
            value = pressure(top);
            if !(value < p) {
                (a, b) = (before, top);
                break;
            }
        }
        if value > highest.0 {
            highest = (value, top);
        }
        (before, a, b) = (a, b, b + STEP);
    }
    for _ in 0..60 {
        let m = 0.5 * (a + b);
        if below(m) { a = m } else { b = m }
    }
    let found = pressure(a);
    if (found / p - 1.0).abs() < 1e-9 {
        return Ok(a);
    }
    Err(format!("the energy ends at the stretch {a:.6}, where the pressure is {found:.6}"))
}

/// The stretch of the initial sphere: each number is examined also where the others are wrong.
fn stretch(
    problem: &Problem,
    names: &Names,
    reference: Option<&Reference>,
    law: Option<&Law>,
    errors: &mut Vec<Diagnostic>,
) -> Option<f64> {
    if let Some(Reference::Disc { radius }) = reference {
        return clamped(problem, names, *radius, errors);
    }
    Some(match &problem.initial {
        spec::Initial::Unloaded => 1.0,
        spec::Initial::Inflated(spec::Inflation::Radius(n)) => {
            let pointer = "/initial/Inflated/radius";
            let r = positive(names, n, pointer, "the inflated radius", errors)?;
            r / reference?.radius()
        }
        spec::Initial::Inflated(spec::Inflation::Volume(n)) => {
            let v = positive(names, n, "/initial/Inflated/volume", "the inflated volume", errors)?;
            (v / (4.0 / 3.0 * PI)).cbrt() / reference?.radius()
        }
        spec::Initial::Inflated(spec::Inflation::Pressure(n)) => {
            let p = positive(names, n, "/initial/Inflated/pressure", "the inflating pressure", errors)?;
            let (reference, law) = (reference?, law?);
            let pressure = |l: f64| 2.0 * law.response(l, l).w_l / (l * l * reference.radius());
            match inflation(pressure, p) {
                Ok(stretch) => stretch,
                Err(why) => {
                    errors.push(
                        Diagnostic::error(
                            "no-inflation",
                            format!("no inflation of this material reaches the pressure {p}"),
                        )
                        .at("/initial/Inflated/pressure", why),
                    );
                    return None;
                }
            }
        }
    })
}
