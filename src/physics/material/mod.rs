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
    use crate::expr::{Builder, Function};
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    /// An energy as a file may write it, counted from anywhere: cosh(lambda - 1) + cosh(mu - 1) + shift.
    fn written(shift: f64) -> Law {
        let mut b = Builder::new();
        let (l, m) = (b.input(0), b.input(1));
        let one = b.constant(1.0);
        let (e1, e2) = (b.sub(l, one), b.sub(m, one));
        let (c1, c2) = (b.apply(Function::Cosh, e1), b.apply(Function::Cosh, e2));
        let (sum, shift) = (b.sum(c1, c2), b.constant(shift));
        let all = b.sum(sum, shift);
        b.output(all);
        Written::new(b.finish()).into()
    }

    /// Laws with their small-strain moduli against shear and dilatation.
    fn all() -> Vec<(Law, f64, f64)> {
        vec![
            (NeoHookean { shear_modulus: 1.3 }.into(), 1.3, 3.9),
            (MooneyRivlin { c1: 0.5, c2: 0.05 }.into(), 1.1, 3.3),
            (Ogden { terms: vec![(0.8, 1.7), (0.2, -1.4), (0.05, 4.0)] }.into(), 1.05, 3.15),
            (Yeoh { factors: vec![0.6, -0.01, 0.002] }.into(), 1.2, 3.6),
            (Gent { shear_modulus: 1.1, locking: 30.0 }.into(), 1.1, 3.3),
            (Fung { shear_modulus: 0.9, exponent: 0.2 }.into(), 0.9, 2.7),
            (Varga { shear_modulus: 1.4 }.into(), 1.4, 4.2),
            (Skalak { shear_modulus: 0.7, area_ratio: 2.0 }.into(), 0.7, 3.5),
            (EvansSkalak { shear_modulus: 0.7, area_modulus: 5.0 }.into(), 0.7, 5.0),
            (Hooke { young_modulus: 2.6, poisson_ratio: 0.3 }.into(), 1.0, 2.6 / 1.4),
            (written(7.0), 0.5, 0.5),
        ]
    }

    #[test]
    fn every_law_is_stress_free_symmetric_and_has_its_moduli() {
        for (law, shear, area) in all() {
            let r = law.response(1.0, 1.0);
            assert!(r.w.abs() < 1e-14 && r.w_l.abs() < 1e-14 && r.w_m.abs() < 1e-14, "{law:?}");
            let moduli = law.moduli();
            assert_relative_eq!(moduli.shear, shear, max_relative = 1e-13);
            assert_relative_eq!(moduli.area, area, max_relative = 1e-13);
            assert_relative_eq!(moduli.young, 4.0 * area * shear / (area + shear), max_relative = 1e-13);
            assert_relative_eq!(moduli.poisson, (area - shear) / (area + shear), max_relative = 1e-12, epsilon = 1e-15);
            let (a, b) = (law.response(1.3, 1.7), law.response(1.7, 1.3));
            assert_relative_eq!(a.w, b.w, max_relative = 1e-13);
            assert_relative_eq!(a.w_l, b.w_m, max_relative = 1e-13);
            // Baker-Ericksen: the larger stretch carries the larger Cauchy tension.
            assert!(a.w_m / 1.3 > a.w_l / 1.7, "{law:?}");
        }
    }

    /// Every derivative that a response holds or carries, against differences of the order below; twin: with one direction wrong.
    #[test]
    fn derivatives_are_those_of_the_energy() {
        let (l, m, d) = (1.31, 0.94, 1e-5);
        for (law, ..) in all() {
            let at = |l: f64, m: f64| law.response(l, m);
            let r = at(l, m);
            let by_l = |f: fn(&Response<f64>) -> f64| (f(&at(l + d, m)) - f(&at(l - d, m))) / (2.0 * d);
            let by_m = |f: fn(&Response<f64>) -> f64| (f(&at(l, m + d)) - f(&at(l, m - d))) / (2.0 * d);
            let near = |a: f64, b: f64| (a - b).abs() < 1e-7 * (1.0 + b.abs());
            assert!(near(by_l(|r| r.w), r.w_l) && near(by_m(|r| r.w), r.w_m), "{law:?}");
            assert!(near(by_l(|r| r.w_l), r.w_ll) && near(by_m(|r| r.w_l), r.w_lm), "{law:?}");
            assert!(near(by_l(|r| r.w_m), r.w_lm), "{law:?}");
            assert!(!near(by_m(|r| r.w), r.w_l), "{law:?}: a wrong derivative would show");
            let carried = law.response(Dual::<2>::variable(l, 0), Dual::variable(m, 1));
            assert_eq!((carried.w.re, carried.w_l.re, carried.w_ll.re), (r.w, r.w_l, r.w_ll));
            for (found, wanted) in [
                (carried.w.du, [r.w_l, r.w_m]),
                (carried.w_l.du, [r.w_ll, r.w_lm]),
                (carried.w_m.du, [r.w_lm, by_m(|r| r.w_m)]),
                (carried.w_ll.du, [by_l(|r| r.w_ll), by_m(|r| r.w_ll)]),
                (carried.w_lm.du, [by_l(|r| r.w_lm), by_m(|r| r.w_lm)]),
            ] {
                assert!(near(found[0], wanted[0]) && near(found[1], wanted[1]), "{law:?}: {found:?}, {wanted:?}");
            }
        }
    }

    #[test]
    fn small_strains_of_an_exponential_law_have_an_exact_energy() {
        let (soft, neo) = (Fung { shear_modulus: 1.0, exponent: 1e-12 }, NeoHookean { shear_modulus: 1.0 });
        assert_relative_eq!(soft.energy(1.2, 1.1), neo.energy(1.2, 1.1), max_relative = 1e-11);
    }

    #[test]
    fn an_energy_that_a_file_writes_locks_where_it_ends_and_not_where_it_overflows() {
        let unary = |make: fn(&mut Builder, crate::expr::Node) -> crate::expr::Node| {
            let mut b = Builder::new();
            let (l, m) = (b.input(0), b.input(1));
            let (l2, m2, j) = (b.mul(l, l), b.mul(m, m), b.mul(l, m));
            let j2 = b.mul(j, j);
            let one = b.constant(1.0);
            let (sum, inverse) = (b.sum(l2, m2), b.div(one, j2));
            let i1 = b.sum(sum, inverse);
            let out = make(&mut b, i1);
            b.output(out);
            Written::new(b.finish()).locking()
        };
        // -ln(1 - (I1 - 3)/30) and exp(I1)
        let gent = unary(|b, i1| {
            let c = b.constant(33.0);
            let gap = b.sub(c, i1);
            let ln = b.apply(Function::Ln, gap);
            b.neg(ln)
        });
        assert_relative_eq!(gent.unwrap(), 30.0, max_relative = 1e-9);
        // 1/(33 - I1): a pole, behind which the formula goes on.
        let pole = unary(|b, i1| {
            let c = b.constant(33.0);
            let gap = b.sub(c, i1);
            let one = b.constant(1.0);
            b.div(one, gap)
        });
        assert_relative_eq!(pole.unwrap(), 30.0, max_relative = 1e-9);
        assert_eq!(unary(|b, i1| b.apply(Function::Exp, i1)), None);
        assert_eq!(unary(|_, i1| i1), None);
    }

    /// Limit points of a free sphere, p = W'(l)/l^2 with W(l) = w(l, l): closed forms of their own.
    #[test]
    fn inflation_limit_points_stand_where_the_closed_forms_say() {
        let pressure = |law: &Law, l: f64| 2.0 * law.response(l, l).w_l / (l * l);
        let slope = |law: &Law, l: f64| (pressure(law, l + 1e-5) - pressure(law, l - 1e-5)) / 2e-5;
        let neo: Law = NeoHookean { shear_modulus: 1.0 }.into();
        assert!(slope(&neo, 7.0_f64.powf(1.0 / 6.0)).abs() < 1e-9);
        assert_relative_eq!(pressure(&neo, 7.0_f64.powf(1.0 / 6.0)), 1.2394629, max_relative = 1e-7);
        // Varga: p = 4 G (l^-2 - l^-5).
        let varga: Law = Varga { shear_modulus: 1.0 }.into();
        assert!(slope(&varga, 2.5_f64.cbrt()).abs() < 1e-9);
        let merge: Law = MooneyRivlin { c1: 1.0, c2: 0.2144584 }.into();
        assert!(slope(&merge, 1.840734).abs() < 1e-5);
        let twin: Law = MooneyRivlin { c1: 1.0, c2: 0.22 }.into();
        assert!(slope(&twin, 1.840734) > 1e-3, "beyond the merging there is no limit point");
        // Above a constant there is a stretch at which the pressure falls, below none.
        let falls = |law: Law, to: f64| {
            let steps = (1e4 * (to - 1.1)) as usize;
            (0..steps).any(|i| slope(&law, 1.1 + 1e-4 * i as f64) < 0.0)
        };
        let mooney = |ratio: f64| MooneyRivlin { c1: 1.0, c2: ratio }.into();
        assert!(falls(mooney(0.21445), 3.0) && !falls(mooney(0.21447), 3.0));
        let gent = |locking: f64| Gent { shear_modulus: 1.0, locking }.into();
        assert!(falls(gent(17.639), 3.1) && !falls(gent(17.638), 3.1));
    }
}
