//! Contact problems of axisymmetric, hyperelastic, fluid-filled membranes, from declarative problem files.

pub mod expr;
pub mod scalar;
