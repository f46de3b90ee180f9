//! Fields: formulas of the local state of the membrane, evaluated along its meridian.

use super::load::{Site, Variable};
use crate::expr::Tape;
use crate::scalar::Scalar;

/// A formula of the local state alone.
#[derive(Clone, Debug)]
pub struct FieldFormula {
    tape: Tape,
    variables: Vec<Variable>,
}

impl FieldFormula {
    /// A field from a tape of one output and what its inputs are; nothing where one of them is no field.
    pub fn new(tape: Tape, variables: Vec<Variable>) -> Option<Self> {
        let local = |v: &Variable| !matches!(v, Variable::Global(_) | Variable::H);
        variables.iter().all(local).then_some(FieldFormula { tape, variables })
    }

    /// Its value at a place.
    pub fn at<S: Scalar>(&self, site: &Site<S>) -> S {
        let inputs: Vec<S> = self.variables.iter().map(|v| site.value(*v)).collect();
        let (mut work, mut out) = (vec![], [S::from(0.0)]);
        self.tape.eval(&inputs, &mut work, &mut out);
        out[0]
    }
}

/// A number that is read off a field.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The pieces along which it is read.
    pub pieces: Vec<usize>,
    /// The field.
    pub field: FieldFormula,
    /// What is read.
    pub what: What,
}

/// What is read off a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// The largest value.
    Max,
    /// The smallest value.
    Min,
    /// The value at a material coordinate phi.
    At(f64),
}
