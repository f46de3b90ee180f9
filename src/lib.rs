//! Contact problems of axisymmetric, hyperelastic, fluid-filled membranes, from declarative problem files.

pub mod bvp;
pub mod diagnostic;
pub mod expr;
mod legendre;
pub mod model;
mod number;
pub mod output;
pub mod physics;
pub mod run;
pub mod scalar;
pub mod solution;
pub mod spec;
pub mod sweep;
pub mod system;
