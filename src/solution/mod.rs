//! A solved state: its quantities with their errors, and the certificate.
//!
//! Everything is read off a state in one pass with numbers that carry four directions: along the branch ([`TANGENT`]), along the
//! estimated error ([`ERROR`]), along a sample of what that neglects ([`NEGLECTED`]), and along a sample of rounding errors
//! ([`ROUNDING`]). The first gives exact slopes, the others the error of every quantity, however it is computed.

mod certificate;
mod profile;
mod reading;
mod view;

pub use certificate::Certificate;
pub use profile::{Row, profile};
pub use view::View;

use crate::bvp::{Discretization, Estimate};
use crate::model::Model;
use crate::scalar::Dual;
use crate::system::System;
use std::sync::Arc;

/// Numbers with a slope in each of the four directions.
pub type Carried = Dual<4>;

/// Direction along the branch.
pub const TANGENT: usize = 0;
/// Direction of the estimated discretisation error.
pub const ERROR: usize = 1;
/// Direction of a sample of what the estimated discretisation error neglects.
pub const NEGLECTED: usize = 2;
/// Direction of a sample of rounding errors.
pub const ROUNDING: usize = 3;

/// The estimate of the discretisation error is asymptotically exact; this covers what it neglects where nothing cancels.
const SAFETY: f64 = 4.0;
/// One sample of rounding errors with random signs; their worst sum may be several times larger.
const ROUNDING_SAFETY: f64 = 8.0;
/// No number is known better than this, relative to itself.
const LEAST_ERROR: f64 = 1e-13;

/// A number with its slope along the branch and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Value.
    pub value: f64,
    /// Derivative along the branch, per unit of the closing condition.
    pub slope: f64,
    /// Estimated absolute error.
    pub error: f64,
    /// The part of the error that a finer mesh would reduce.
    pub discretisation: f64,
}

impl From<Carried> for Measured {
    fn from(v: Carried) -> Self {
        let discretisation = SAFETY * v.du[ERROR].abs() + v.du[NEGLECTED].abs();
        let error = discretisation + ROUNDING_SAFETY * v.du[ROUNDING].abs() + LEAST_ERROR * v.re.abs();
        Measured { value: v.re, slope: v.du[TANGENT], error, discretisation }
    }
}

/// A converged state with everything known about it.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Mesh and scheme.
    pub disc: Arc<Discretization>,
    /// The equations, where they hold something that is given in this state only.
    own: Option<Arc<System>>,
    /// All unknowns.
    pub state: Vec<f64>,
    /// Derivative of all unknowns along the branch, per unit of the closing condition.
    pub tangent: Vec<f64>,
    /// Quantities in the order of the model; nothing where a quantity does not exist or is infinite by nature.
    pub quantities: Vec<Option<Measured>>,
    /// Names of what is infinite by nature.
    pub infinite: Vec<String>,
    /// True if a quantity that should be a number, or its error, is none.
    undefined: bool,
    /// What proves the state.
    pub certificate: Certificate,
}

impl Solution {
    /// Reads a state: quantities, errors, certificate.
    pub fn read(
        model: &Model,
        system: &System,
        disc: &Arc<Discretization>,
        state: &[f64],
        tangent: &[f64],
        estimate: &Estimate,
        rounding: &[f64],
    ) -> Self {
        let carried: Vec<Carried> = (0..disc.unknowns())
            .map(|i| Dual { re: state[i], du: [tangent[i], estimate.delta[i], estimate.neglected[i], rounding[i]] })
            .collect();
        let view = View::new(model, system, disc, carried, Some(estimate));
        let mut infinite = view.infinite();
        let mut quantities = vec![];
        let mut undefined = false;
        for q in &model.quantities {
            let value = view.value(&q.formula);
            if value.is_none() && view.is_infinite(&q.formula) {
                infinite.push(q.name.clone());
            }
            let number = value.filter(|v| v.re.is_finite()).map(Measured::from);
            // Of a number whose error is none nothing is known.
            undefined |= value.is_some() && !number.is_some_and(|m| m.error.is_finite());
            quantities.push(number);
        }
        let certificate = Certificate::new(model, &view);
        Solution {
            own: system.repels().then(|| Arc::new(system.clone())),
            disc: disc.clone(),
            state: state.to_vec(),
            tangent: tangent.to_vec(),
            quantities,
            infinite,
            undefined,
            certificate,
        }
    }

    /// The equations that it solves, all but the closing one.
    pub fn system<'a>(&'a self, model: &'a Model) -> &'a System {
        self.own.as_deref().unwrap_or(&model.system)
    }

    /// The largest error relative to the accuracy asked for, and whose it is; below 1 all is well. A quantity that vanishes is
    /// measured against a thousandth of its `typical` magnitude, and none against less than a ten-thousandth.
    pub fn worst_error(&self, accuracy: f64, typical: &[f64]) -> (f64, usize) {
        self.worst(accuracy, typical, |m| if m.error.is_finite() { m.error } else { f64::INFINITY })
    }

    /// The same for the part that a finer mesh would reduce, where it stands out from rounding; infinite where a quantity is not a
    /// number.
    pub fn worst_discretisation(&self, accuracy: f64, typical: &[f64]) -> f64 {
        if self.undefined {
            return f64::INFINITY;
        }
        let reducible =
            |m: &Measured| if m.discretisation > m.error - m.discretisation { m.discretisation } else { 0.0 };
        self.worst(accuracy, typical, reducible).0
    }

    /// The same for all that a finer mesh would reduce, whether it stands out from rounding or not.
    pub fn worst_of_mesh(&self, accuracy: f64, typical: &[f64]) -> f64 {
        self.worst(accuracy, typical, |m| m.discretisation).0
    }

    fn worst(&self, accuracy: f64, typical: &[f64], error: impl Fn(&Measured) -> f64) -> (f64, usize) {
        let mut worst = (0.0, 0);
        for (i, q) in self.quantities.iter().enumerate() {
            if let Some(q) = q {
                let size = q.value.abs().max(1e-3 * typical.get(i).copied().unwrap_or(0.0));
                let ratio = error(q) / (accuracy * size.max(1e-4)).max(1e-13);
                if !(ratio <= worst.0) {
                    worst = (ratio, i);
                }
            }
        }
        worst
    }

    /// The least stiffness of the material relative to its tension, lambda w_ll/w_l, at a point of the mesh, and the segment.
    pub fn softest(&self, model: &Model) -> Option<(f64, String)> {
        let system = self.system(model);
        let globals = self.disc.globals(&self.state);
        let mut softest: Option<(f64, String)> = None;
        for (s, piece) in system.pieces.iter().enumerate() {
            let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
            let (a, b) = piece.places(&p);
            for (i, x) in self.disc.meshes[s].iter().enumerate() {
                let y = &self.state[self.disc.y(s, i)..][..piece.states()];
                let m = piece.local(&system.reference, &system.law, piece.coordinate.at(*x, a, b).0, y);
                let stiffness = m.lambda * m.response.w_ll / m.response.w_l;
                if stiffness.is_finite() && softest.as_ref().is_none_or(|(least, _)| stiffness < *least) {
                    softest = Some((stiffness, piece.name.clone()));
                }
            }
        }
        softest
    }

    /// The value of a quantity by its place in the model.
    pub fn quantity(&self, i: usize) -> Option<Measured> {
        self.quantities[i]
    }
}
