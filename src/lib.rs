//! Contact problems of axisymmetric, hyperelastic, fluid-filled membranes, from declarative problem files.

pub mod expr;
pub mod scalar;
pub mod diagnostic;
pub mod spec;
