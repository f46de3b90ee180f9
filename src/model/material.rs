//! The material: the words of a file with numbers for their constants, and whether the law makes sense.

use super::names::Names;
use super::token;
use crate::diagnostic::Diagnostic;
use crate::expr;
use crate::physics::material::{
    EvansSkalak, Fung, Gent, Hooke, Law, MooneyRivlin, NeoHookean, Ogden, Skalak, Varga, Written, Yeoh,
};
use crate::physics::tip;
use crate::spec::{self, Element, Number, Problem};
use crate::system::{Coordinate, Kind, System};

/// Names of the place of a material point, on which constants cannot depend yet.
const PLACES: [&str; 5] = ["S", "phi", "t", "rho0", "h0"];

/// Reads the constants of a material.
struct Reader<'r, 'a> {
    names: &'r Names<'a>,
    errors: &'r mut Vec<Diagnostic>,
}

impl Reader<'_, '_> {
    /// A constant.
    fn any(&mut self, number: &Number, key: &str) -> Option<f64> {
        let pointer = format!("/material/{key}");
        if number.formula().is_some_and(|text| graded(text, &pointer, self.errors)) {
            return None;
        }
        self.names.constant(number, &pointer, self.errors)
    }

    /// A constant that must be positive.
    fn positive(&mut self, number: &Number, key: &str, what: &str) -> Option<f64> {
        self.within(number, key, what, "be positive", |v| v > 0.0)
    }

    /// A constant for which something must hold, told in words.
    fn within(&mut self, number: &Number, key: &str, what: &str, must: &str, holds: fn(f64) -> bool) -> Option<f64> {
        let v = self.any(number, key)?;
        if holds(v) {
            return Some(v);
        }
        let code = if must == "be positive" { "not-positive" } else { "out-of-range" };
        self.refuse(code, format!("{what} must {must}"), key, format!("is {v}"));
        None
    }

    fn refuse(&mut self, code: &'static str, message: String, key: &str, label: String) {
        self.errors.push(Diagnostic::error(code, message).at(format!("/material/{key}"), label));
    }

    /// A sum of terms whose parts of the shear modulus may have either sign.
    fn balance(&mut self, word: &str, shear: f64, largest: f64, terms: &[f64]) -> Option<()> {
        if terms.is_empty() {
            self.refuse("out-of-range", format!("{word} needs a term at least"), word, "empty".into());
            return None;
        }
        if !(shear > 0.0) {
            self.refuse(
                "not-positive",
                format!("the shear modulus of {word} must be positive"),
                word,
                format!("is {shear}"),
            );
            return None;
        }
        if largest < 0.0 {
            self.errors.push(
                Diagnostic::warning(
                    "unbounded-energy",
                    format!("the energy of {word} falls without bound at large stretch"),
                )
                .at(format!("/material/{word}"), "the term that grows most is negative"),
            );
        }
        Some(())
    }
}

/// True, and said, where a formula depends on the place.
fn graded(text: &str, pointer: &str, errors: &mut Vec<Diagnostic>) -> bool {
    let Ok(parsed) = expr::parse(text) else { return false };
    let found: Vec<_> = parsed.names().into_iter().filter(|(name, _)| PLACES.contains(name)).collect();
    for (name, span) in &found {
        errors.push(
            Diagnostic::error(
                "not-supported",
                format!("a material that depends on the place, by `{name}`, cannot be solved by this version"),
            )
            .within(pointer, span.clone(), "not supported yet"),
        );
    }
    !found.is_empty()
}

/// The law of a file: every constant is examined, also where others are wrong.
pub(super) fn law(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) -> Option<Law> {
    use spec::Material as M;
    const SHEAR: &str = "the shear modulus";
    let mut read = Reader { names, errors };
    let law: Law = match &problem.material {
        M::NeoHookean { shear_modulus } => {
            NeoHookean { shear_modulus: read.positive(shear_modulus, "NeoHookean/shear_modulus", SHEAR)? }.into()
        }
        M::MooneyRivlin { c1, c2 } => {
            let c1 = read.positive(c1, "MooneyRivlin/c1", "c1");
            let c2 = read.within(c2, "MooneyRivlin/c2", "c2", "not be negative", |v| v >= 0.0);
            MooneyRivlin { c1: c1?, c2: c2? }.into()
        }
        M::Ogden(terms) => {
            let mut known = vec![];
            for (i, term) in terms.iter().enumerate() {
                let g = read.any(&term.shear_modulus, &format!("Ogden/{i}/shear_modulus"));
                let key = format!("Ogden/{i}/exponent");
                known.push((g, read.within(&term.exponent, &key, "an exponent", "not be 0", |v| v != 0.0)));
            }
            let terms: Vec<(f64, f64)> = known.into_iter().map(|(g, a)| Some((g?, a?))).collect::<Option<_>>()?;
            // What grows most at large stretch: lambda^a, or (lambda mu)^-a, which is of degree -2 a.
            let degree = |a: f64| if a > 0.0 { a } else { -2.0 * a };
            let largest = terms.iter().max_by(|s, t| degree(s.1).total_cmp(&degree(t.1))).map_or(0.0, |t| t.0);
            let parts: Vec<f64> = terms.iter().map(|t| t.0).collect();
            read.balance("Ogden", parts.iter().sum(), largest, &parts)?;
            Ogden { terms }.into()
        }
        M::Yeoh(factors) => {
            let known: Vec<_> = factors.iter().enumerate().map(|(i, c)| read.any(c, &format!("Yeoh/{i}"))).collect();
            let factors: Vec<f64> = known.into_iter().collect::<Option<_>>()?;
            let largest = factors.iter().rev().find(|c| **c != 0.0).copied().unwrap_or(0.0);
            read.balance("Yeoh", factors.first().map_or(0.0, |c| 2.0 * c), largest, &factors)?;
            Yeoh { factors }.into()
        }
        M::Gent { shear_modulus, locking } => {
            let g = read.positive(shear_modulus, "Gent/shear_modulus", SHEAR);
            let j = read.positive(locking, "Gent/locking", "the locking value");
            Gent { shear_modulus: g?, locking: j? }.into()
        }
        M::Fung { shear_modulus, exponent } => {
            let g = read.positive(shear_modulus, "Fung/shear_modulus", SHEAR);
            let b = read.positive(exponent, "Fung/exponent", "the factor in the exponent");
            Fung { shear_modulus: g?, exponent: b? }.into()
        }
        M::Varga { shear_modulus } => {
            Varga { shear_modulus: read.positive(shear_modulus, "Varga/shear_modulus", SHEAR)? }.into()
        }
        M::Skalak { shear_modulus, area_ratio } => {
            let g = read.positive(shear_modulus, "Skalak/shear_modulus", SHEAR);
            // w_ll - w_lm = 2 G and w_ll + w_lm = 2 G (1 + 2 C): stable against dilatation only above -1/2.
            let c = read.within(area_ratio, "Skalak/area_ratio", "the area ratio", "exceed -1/2", |v| v > -0.5);
            Skalak { shear_modulus: g?, area_ratio: c? }.into()
        }
        M::EvansSkalak { shear_modulus, area_modulus } => {
            let g = read.positive(shear_modulus, "EvansSkalak/shear_modulus", SHEAR);
            let k = read.positive(area_modulus, "EvansSkalak/area_modulus", "the area modulus");
            EvansSkalak { shear_modulus: g?, area_modulus: k? }.into()
        }
        M::Hooke { young_modulus, poisson_ratio } => {
            let e = read.positive(young_modulus, "Hooke/young_modulus", "Young's modulus");
            let nu = read.within(
                poisson_ratio,
                "Hooke/poisson_ratio",
                "the Poisson ratio of a surface",
                "lie between -1 and 1",
                |v| v.abs() < 1.0,
            );
            Hooke { young_modulus: e?, poisson_ratio: nu? }.into()
        }
        M::Energy(text) => {
            if graded(text.as_str(), "/material/Energy", errors) {
                return None;
            }
            let law: Law = Written::new(names.energy(text.as_str(), "/material/Energy", errors)?).into();
            return sound(&law, problem, errors).then_some(law);
        }
    };
    Some(law)
}

/// True if an energy that the file writes itself is one of a material at rest in its reference shape, the same in both directions
/// where these are the same.
fn sound(law: &Law, problem: &Problem, errors: &mut Vec<Diagnostic>) -> bool {
    let mut refuse = |code, message: String, label: String, help: &str| {
        errors.push(Diagnostic::error(code, message).at("/material/Energy", label).help(help));
        false
    };
    let rest = law.response(1.0, 1.0);
    let all = [rest.w, rest.w_l, rest.w_m, rest.w_ll, rest.w_lm];
    if all.iter().any(|v| !v.is_finite()) {
        let message = "the energy or a derivative of it is not finite in the reference state".to_owned();
        return refuse("not-finite", message, "at lambda = mu = 1".into(), "");
    }
    if let Some((l, m)) = asymmetry(law).filter(|_| has_pole(problem)) {
        let (a, b) = (law.response(l, m).w, law.response(m, l).w);
        return refuse(
            "not-symmetric",
            "the energy is not symmetric in lambda and mu, although the meridian has a pole: no regular pole, no uniform inflation"
                .to_owned(),
            format!("{a} at ({l}, {m}), {b} at ({m}, {l})"),
            "at a pole both directions are the same",
        );
    }
    let m = law.moduli();
    if !(m.shear > 0.0 && m.area > 0.0) {
        return refuse(
            "not-stable",
            format!(
                "the reference state is not stable: surface shear modulus {}, area dilatation modulus {}",
                m.shear, m.area
            ),
            "both must be positive".into(),
            "",
        );
    }
    if rest.w_l.abs().max(rest.w_m.abs()) > 1e-9 * rest.w_ll {
        return refuse(
            "prestressed",
            "the reference state is not free of tension".to_owned(),
            format!("w_l = {}, w_m = {} at lambda = mu = 1", rest.w_l, rest.w_m),
            "stretches are measured from the shape without load: the derivatives of the energy vanish at lambda = mu = 1",
        );
    }
    true
}

/// Stretches at which an energy is not symmetric, if it is not.
fn asymmetry(law: &Law) -> Option<(f64, f64)> {
    const SAMPLES: [(f64, f64); 6] = [(1.0, 1.1), (1.1, 1.3), (0.9, 1.6), (1.05, 2.0), (1.4, 0.8), (2.5, 1.2)];
    let scale = law.response(1.0, 1.0).w_ll.abs();
    SAMPLES.into_iter().find(|&(l, m)| {
        let (a, b) = (law.response(l, m), law.response(m, l));
        let differ = |x: f64, y: f64| (x - y).abs() > 1e-9 * (x.abs() + y.abs() + scale);
        a.w.is_finite() && (differ(a.w, b.w) || differ(a.w_l, b.w_m))
    })
}

/// True if a meridian of the file, written or found, has an end on the axis.
fn has_pole(problem: &Problem) -> bool {
    problem.meridian.as_ref().is_none_or(|list| list.iter().any(|e| matches!(e, Element::Pole)))
}

/// Refuses cones whose tip the material cannot close over.
pub(super) fn tips(system: &System, bodies: &[super::Body], errors: &mut Vec<Diagnostic>) {
    for (s, piece) in system.pieces.iter().enumerate() {
        let (Kind::Contact(face), Coordinate::FromTip(_) | Coordinate::ToTip(_)) = (&piece.kind, piece.coordinate)
        else {
            continue;
        };
        if tip::ratio(&system.law, face.tip_inclination().cos()).is_some() {
            continue;
        }
        let d = Diagnostic::error(
            "no-tip",
            format!("this material cannot close over the tip of a cone, on `{}`", piece.name),
        )
        .at("/material", "its tensions grow too slowly with the stretches, or it locks before: a hole would open");
        let body = bodies.iter().find(|b| b.pieces.contains(&s));
        let d = match body {
            Some(body) => {
                d.at(format!("/bodies/{}/shape", token(&body.name)), "has a tip where the membrane has a pole")
            }
            None => d,
        };
        errors.push(d.help("a body without a tip, or an energy that grows faster, such as NeoHookean"));
    }
}
