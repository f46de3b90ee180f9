//! The membrane along its meridian, at the points of the mesh.

use super::certificate::heights;
use super::{Carried, Solution, View};
use crate::model::Model;
use crate::system::Kind;

/// The membrane at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the segment.
    pub segment: String,
    /// Material angle from the top pole.
    pub phi: f64,
    /// Reference arc length from the top pole.
    pub arc: f64,
    /// Distance from the axis.
    pub u: f64,
    /// Axial position, downwards.
    pub h: f64,
    /// Tangent angle.
    pub tau: f64,
    /// Meridional stretch.
    pub lambda: f64,
    /// Hoop stretch.
    pub mu: f64,
    /// Meridional tension per reference length.
    pub w_l: f64,
    /// Hoop tension per reference length.
    pub w_m: f64,
    /// Contact pressure per deformed area; nothing on free segments.
    pub p_c: Option<f64>,
}

/// The mesh points of all segments in walking order; both sides of a joint are there.
pub fn profile(model: &Model, solution: &Solution) -> Vec<Row> {
    let disc = &*solution.disc;
    let view = View::new(
        model,
        solution.system(model),
        disc,
        solution.state.iter().map(|&v| Carried::from(v)).collect(),
        None,
    );
    let system = view.system;
    let mut rows = vec![];
    for (s, piece) in system.pieces.iter().enumerate() {
        let p: Vec<f64> = piece.parameters().iter().map(|&g| view.global(g).re).collect();
        let (a, b) = piece.places(&p);
        let n = piece.states();
        let apex = model.bodies.iter().find(|body| body.pieces.contains(&s)).and_then(|body| view.value(&body.h));
        let heights = heights(model, &view, s);
        for i in 0..=disc.intervals(s) {
            let y = &solution.state[disc.y(s, i)..disc.y(s, i) + n];
            let eta = piece.coordinate.at(disc.meshes[s][i], a, b).0;
            let m = piece.local(&system.reference, &system.law, eta, y);
            let phi = system.reference.phi(eta);
            let pressed = || piece.contact_pressure(&system.reference, &system.law, disc.meshes[s][i], y, &p);
            let (tau, h, p_c) = match &piece.kind {
                Kind::Free => (y[2], heights[i], None),
                Kind::Contact(face) => {
                    let t = face.parameter(y[1], m.rho0);
                    let h = apex.map_or(f64::NAN, |h| h.re) + face.drop(t);
                    (face.tangent(face.frame(t).angle), h, Some(pressed()))
                }
            };
            rows.push(Row {
                segment: piece.name.clone(),
                phi,
                arc: phi * system.reference.radius(),
                u: m.u(),
                h,
                tau,
                lambda: m.lambda,
                mu: m.mu,
                w_l: m.response.w_l,
                w_m: m.response.w_m,
                p_c,
            });
        }
    }
    rows
}
