//! The mechanics of axisymmetric membranes: what a material, a surface, a reference shape is, and how a membrane is in equilibrium.
//!
//! Notation, as everywhere in the program: `lambda`, `mu` meridional and hoop stretch; `tau` tangent angle of the deformed
//! meridian (0 at a top pole, pi at a bottom pole, n = sin tau i + cos tau k outward, k upwards); `u` radius; `h` axial position,
//! measured DOWNWARDS; `w(lambda, mu)` strain energy per reference area, `w_l`, `w_m` its derivatives, the tensions per reference
//! length; `phi` the angle of the reference sphere from the top pole; `eta` the conformal coordinate of the reference meridian,
//! d eta = dS / rho0, for the sphere ln tan(phi/2).
//!
//! This layer knows no mesh and no solver, and no word of a problem file.

pub mod material;
pub mod membrane;
pub mod reference;
pub mod screened;
pub mod surface;
pub mod tip;
