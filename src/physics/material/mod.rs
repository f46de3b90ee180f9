//! Materials. A material answers one question: what is your energy?
//!
//! Each law is one file with the energy per reference area, generic in the scalar; tensions and stiffnesses are its derivatives
//! ([`Law::response`]). Energies are symmetric in (lambda, mu), as they must be where the membrane has a pole.

mod evans_skalak;
mod fung;
mod gent;
mod hooke;
mod mooney_rivlin;
mod neo_hookean;
mod ogden;
mod skalak;
mod varga;
mod written;
mod yeoh;

pub use evans_skalak::EvansSkalak;
pub use fung::Fung;
pub use gent::Gent;
pub use hooke::Hooke;
pub use mooney_rivlin::MooneyRivlin;
pub use neo_hookean::NeoHookean;
pub use ogden::Ogden;
pub use skalak::Skalak;
pub use varga::Varga;
pub use written::Written;
pub use yeoh::Yeoh;

use crate::scalar::{Jet, Scalar, lift};

/// The one question.
pub trait Energy {
    /// Strain energy per reference area at the stretches (lambda, mu), zero in the reference state.
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S;

    /// First invariant sum at which the energy is infinite, for laws that lock.
    fn locking(&self) -> Option<f64> {
        None
    }
}

/// First strain invariant of an incompressible sheet, I1 = lambda^2 + mu^2 + (lambda mu)^-2.
pub(crate) fn first_invariant<S: Scalar>(lambda: S, mu: S) -> S {
    let product = lambda * mu;
    lambda * lambda + mu * mu + (product * product).recip()
}

macro_rules! laws {
    ($($name:ident),+ $(,)?) => {
        /// The materials, a closed set.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Law {
            $(
                #[doc = concat!("See [`", stringify!($name), "`].")]
                $name($name),
            )+
        }

        impl Energy for Law {
            #[inline(always)]
            fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
                match self { $(Law::$name(law) => law.energy(lambda, mu),)+ }
            }
            fn locking(&self) -> Option<f64> {
                match self { $(Law::$name(law) => law.locking(),)+ }
            }
        }

        $(
            impl From<$name> for Law {
                fn from(law: $name) -> Law { Law::$name(law) }
            }
        )+
    };
}

laws!(NeoHookean, MooneyRivlin, Ogden, Yeoh, Gent, Fung, Varga, Skalak, EvansSkalak, Hooke, Written);

/// Energy, tensions and stiffnesses at one pair of stretches.
#[derive(Clone, Copy, Debug)]
pub struct Response<S> {
    /// Energy per reference area.
    pub w: S,
    /// Meridional tension per reference length, dw/dlambda.
    pub w_l: S,
    /// Hoop tension per reference length, dw/dmu.
    pub w_m: S,
    /// d2w/dlambda2.
    pub w_ll: S,
    /// d2w/dlambda dmu.
    pub w_lm: S,
}

impl Law {
    /// Energy, tensions and stiffnesses, with the derivatives that the stretches carry.
    #[inline(always)]
    pub fn response<S: Scalar>(&self, lambda: S, mu: S) -> Response<S> {
        let (x, y) = (lambda.value(), mu.value());
        let [w, l, m, ll, lm, mm, lll, llm, lmm, _] = if S::CARRIES {
            self.energy(Jet::<10>::x(x), Jet::y(y)).derivatives()
        } else {
            self.energy(Jet::<6>::x(x), Jet::y(y)).derivatives()
        };
        // Beyond the locking of a law its energy is undefined, but the derivatives of its formula are not: without this a solution
        // could run through infinity to the other side.
        let w_l = if w.is_finite() { l } else { f64::NAN };
        Response {
            w: lift(w, l, m, lambda, mu),
            w_l: lift(w_l, ll, lm, lambda, mu),
            w_m: lift(m, lm, mm, lambda, mu),
            w_ll: lift(ll, lll, llm, lambda, mu),
            w_lm: lift(lm, llm, lmm, lambda, mu),
        }
    }

    /// True for the law whose behaviour at a cone's tip is a pure power.
    pub fn is_neo_hookean(&self) -> bool {
        matches!(self, Law::NeoHookean(_))
    }

    /// The small-strain moduli in the reference state.
    pub fn moduli(&self) -> Moduli {
        let [_, _, _, ll, lm, ..] = self.energy(Jet::<6>::x(1.0), Jet::y(1.0)).derivatives();
        // Isotropic plane stress: w_ll = E/(1 - nu^2), w_lm = nu E/(1 - nu^2).
        let poisson = lm / ll;
        Moduli { shear: 0.5 * (ll - lm), area: 0.5 * (ll + lm), young: ll * (1.0 - poisson * poisson), poisson }
    }
}

/// Small-strain surface moduli (force per length), from the second derivatives of the energy in the reference state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// Surface shear modulus G_s.
    pub shear: f64,
    /// Area dilatation modulus K_s.
    pub area: f64,
    /// Surface Young modulus E_s.
    pub young: f64,
    /// Surface Poisson ratio nu_s.
    pub poisson: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn all() -> Vec<(Law, f64)> {
        vec![
            (NeoHookean { shear_modulus: 1.3 }.into(), 1.3),
            (MooneyRivlin { c1: 0.5, c2: 0.05 }.into(), 1.1),
            (Skalak { shear_modulus: 0.7, area_ratio: 2.0 }.into(), 0.7),
            (Gent { shear_modulus: 1.1, locking: 30.0 }.into(), 1.1),
        ]
    }

    #[test]
    fn every_law_is_stress_free_symmetric_and_has_its_shear_modulus() {
        for (law, shear) in all() {
            let r = law.response(1.0, 1.0);
            assert!(r.w.abs() < 1e-14 && r.w_l.abs() < 1e-14 && r.w_m.abs() < 1e-14, "{law:?}");
            assert_relative_eq!(law.moduli().shear, shear, max_relative = 1e-13);
            let (a, b) = (law.response(1.3, 1.7), law.response(1.7, 1.3));
            assert_relative_eq!(a.w, b.w, max_relative = 1e-14);
            assert_relative_eq!(a.w_l, b.w_m, max_relative = 1e-13);
            // Baker-Ericksen: the larger stretch carries the larger Cauchy tension.
            assert!(a.w_m / 1.3 > a.w_l / 1.7, "{law:?}");
        }
    }

    #[test]
    fn the_skalak_constant_is_the_poisson_ratio_of_the_table() {
        let law: Law = Skalak { shear_modulus: 1.0, area_ratio: 3.0 }.into();
        assert_relative_eq!(law.moduli().poisson, 0.75, max_relative = 1e-13);
    }

    /// Limit points of a free sphere, p = W'(l)/l^2 with W(l) = w(l, l): closed forms of their own.
    #[test]
    fn inflation_limit_points_stand_where_the_closed_forms_say() {
        let pressure = |law: &Law, l: f64| 2.0 * law.response(l, l).w_l / (l * l);
        let slope = |law: &Law, l: f64| (pressure(law, l + 1e-5) - pressure(law, l - 1e-5)) / 2e-5;
        let neo: Law = NeoHookean { shear_modulus: 1.0 }.into();
        assert!(slope(&neo, 7.0_f64.powf(1.0 / 6.0)).abs() < 1e-9);
        assert_relative_eq!(pressure(&neo, 7.0_f64.powf(1.0 / 6.0)), 1.2394629, max_relative = 1e-7);
        let merge: Law = MooneyRivlin { c1: 1.0, c2: 0.2144584 }.into();
        assert!(slope(&merge, 1.840734).abs() < 1e-5);
        let twin: Law = MooneyRivlin { c1: 1.0, c2: 0.22 }.into();
        assert!(slope(&twin, 1.840734) > 1e-3, "beyond the merging there is no limit point");
    }
}
