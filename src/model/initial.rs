//! The initial state: the fluid alone, no body, in closed form.

use super::names::Names;
use super::tractions::sphere_repulsion;
use crate::diagnostic::Diagnostic;
use crate::physics::material::{Energy, Gent, Law, MooneyRivlin, NeoHookean, Skalak};
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

fn law(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) -> Option<Law> {
    use spec::Material as M;
    let at = |tail: &str| format!("/material/{tail}");
    let shear = "the shear modulus";
    let name = match &problem.material {
        M::NeoHookean { shear_modulus } => {
            let g = positive(names, shear_modulus, &at("NeoHookean/shear_modulus"), shear, errors)?;
            return Some(NeoHookean { shear_modulus: g }.into());
        }
        M::MooneyRivlin { c1, c2 } => {
            let c1 = positive(names, c1, &at("MooneyRivlin/c1"), "c1", errors);
            let pointer = at("MooneyRivlin/c2");
            let c2 = names.constant(c2, &pointer, errors)?;
            if c2 < 0.0 {
                let d = Diagnostic::error("not-positive", format!("c2 must not be negative, not {c2}"));
                errors.push(d.at(pointer, format!("is {c2}")));
                return None;
            }
            return Some(MooneyRivlin { c1: c1?, c2 }.into());
        }
        M::Skalak { shear_modulus, area_ratio } => {
            let g = positive(names, shear_modulus, &at("Skalak/shear_modulus"), shear, errors);
            let pointer = at("Skalak/area_ratio");
            let c = names.constant(area_ratio, &pointer, errors)?;
            // w_ll - w_lm = 2 G and w_ll + w_lm = 2 G (1 + 2 C): stable against dilatation only above -1/2.
            if c <= -0.5 {
                let d = Diagnostic::error("not-positive", format!("the area ratio must exceed -1/2, not be {c}"));
                errors.push(d.at(pointer, "no stiffness against dilatation"));
                return None;
            }
            return Some(Skalak { shear_modulus: g?, area_ratio: c }.into());
        }
        M::Gent { shear_modulus, locking } => {
            let g = positive(names, shear_modulus, &at("Gent/shear_modulus"), shear, errors);
            let j = positive(names, locking, &at("Gent/locking"), "the locking value", errors);
            return Some(Gent { shear_modulus: g?, locking: j? }.into());
        }
        M::Ogden(_) => "Ogden",
        M::Yeoh(_) => "Yeoh",
        M::Fung { .. } => "Fung",
        M::Varga { .. } => "Varga",
        M::EvansSkalak { .. } => "EvansSkalak",
        M::Hooke { .. } => "Hooke",
        M::Energy(_) => "Energy",
    };
    errors.push(
        Diagnostic::error("not-supported", format!("the material {name} cannot be solved by this version"))
            .at("/material", "not supported yet")
            .help("supported: NeoHookean, MooneyRivlin, Skalak, Gent"),
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
    let law = law(problem, names, errors);
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
