//! The screened repulsion of a charged membrane by itself, and by its image in a charged plane.
//!
//! Where the screening length 1/k is small against the radii of curvature, the repulsion is a local energy per reference area
//!
//! ```text
//! w_local = (pi C/k)/(lambda mu) (1 + s exp(-2 k d))
//! ```
//!
//! to leading order, d the distance from the plane and s the sign of the images. It is added to the elastic energy, inside Newton's
//! iteration. What the whole field exerts beyond it is small, and is brought up to date between solves as a traction that is given
//! where the equations are collocated.

use crate::bvp::Gauss;
use crate::legendre::polynomials;
use crate::physics::material::Response;
use crate::physics::membrane::Local;
use crate::scalar::Scalar;
use std::f64::consts::PI;
use std::sync::Arc;

/// The mirror image of the membrane's charge in a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Image {
    /// Charge of an image over that of its original: 1 behind an insulator, -1 behind a conductor.
    pub sign: f64,
    /// Axial position of the plane.
    pub plane: f64,
    /// 1 where the plane is below the membrane, -1 where it is above.
    pub side: f64,
}

/// The repulsion on a piece.
#[derive(Clone, Debug)]
pub struct Repulsion {
    /// C = sigma_0^2 R/(4 pi eps G), in the unit of tension times length.
    pub coupling: f64,
    /// Inverse screening length.
    pub k: f64,
    /// 1 where the membrane repels itself, 0 where its image alone acts on it.
    pub own: f64,
    /// Its image.
    pub image: Option<Image>,
    /// What the local energy misses.
    pub rest: Option<Arc<Rest>>,
}

/// A traction per reference area that is given at the Gauss nodes of a mesh.
#[derive(Clone, Debug)]
pub struct Rest {
    /// The scheme.
    pub gauss: Arc<Gauss>,
    /// Mesh points on [0, 1].
    pub mesh: Vec<f64>,
    /// At each node the traction away from the axis over the reference radius (both vanish at a pole, the quotient is regular there)
    /// and downwards, the energy of the whole field of the membrane per reference area, and of the field of its image the force
    /// downwards and the energy.
    pub values: Vec<Given>,
    /// Reference radius at each node.
    pub radii: Vec<f64>,
    /// Largest error of the tractions.
    pub error: f64,
    /// What the polynomial through the nodes of an interval misses: its effect on ln(lambda) and tau across the interval.
    pub unresolved: Vec<f64>,
    /// The factor by which changes of the field fell, each time that it was brought up to date, on the way to this state or before.
    pub contraction: Option<f64>,
}

/// What is given at a node of a [`Rest`].
pub type Given = [f64; 5];

impl Repulsion {
    /// Quadratures that are reported: the axial force of all of it, the energy, and the force and the energy of the image.
    pub fn reported(&self) -> usize {
        if self.image.is_some() { 4 } else { 2 }
    }

    /// The factor upon the local energy at the axial position `h`, and its derivative.
    #[inline]
    pub fn factor<S: Scalar>(&self, h: S) -> [S; 2] {
        match self.image {
            None => [S::from(self.own), S::from(0.0)],
            Some(Image { sign, plane, side }) => {
                let decay = 2.0 * self.k * side;
                let image = ((h - plane) * decay).exp() * sign;
                [image + self.own, image * decay]
            }
        }
    }

    /// The local energy of a membrane without image per reference area, and its derivatives by the stretches.
    #[inline]
    pub fn local<S: Scalar>(&self, lambda: S, mu: S) -> Response<S> {
        let (by_l, by_m) = (lambda.recip(), mu.recip());
        let w = by_l * by_m * (PI * self.coupling / self.k);
        Response { w, w_l: -(w * by_l), w_m: -(w * by_m), w_ll: w * by_l * by_l * 2.0, w_lm: w * by_l * by_m }
    }

    /// The membrane with the local energy in its response, at the axial position `h`.
    #[inline]
    pub fn added_to<S: Scalar>(&self, m: &Local<S>, h: S) -> Local<S> {
        let (mut out, d, [f, _]) = (*m, self.local(m.lambda, m.mu), self.factor(h));
        let r = &mut out.response;
        r.w = r.w + d.w * f;
        r.w_l = r.w_l + d.w_l * f;
        r.w_m = r.w_m + d.w_m * f;
        r.w_ll = r.w_ll + d.w_ll * f;
        r.w_lm = r.w_lm + d.w_lm * f;
        out
    }

    /// The axial force downwards that the local energy exerts through its dependence on h, per reference area.
    #[inline]
    pub fn pull<S: Scalar>(&self, m: &Local<S>, h: S) -> S {
        -(self.local(m.lambda, m.mu).w * self.factor(h)[1])
    }

    /// What the local energy misses at `x`, away from the axis and downwards, where the reference radius is `rho0`.
    pub fn rest<S: Scalar>(&self, x: f64, rho0: S) -> [S; 2] {
        let [radial, axial, ..] = self.given(x);
        [rho0 * radial, S::from(axial)]
    }

    /// All that is given at `x`.
    pub fn given(&self, x: f64) -> Given {
        self.rest.as_ref().map_or(Given::default(), |rest| rest.at(x))
    }
}

impl Rest {
    /// The size of what a polynomial through the nodes of an interval hides from Gauss quadrature, from its Legendre coefficients.
    /// Inside a piece they decay geometrically, and c_{2k} ~ c_{k-1} (c_{k-1}/c_{k-2})^(k+1); half of that power is counted on. At an
    /// edge, where the curvature jumps, the field behaves like s ln s or ln s, whose quadrature misses up to a fiftieth of the last
    /// coefficient.
    pub fn hidden(gauss: &Gauss, values: &[Given], radius: f64, edge: bool) -> f64 {
        let k = gauss.stages();
        let basis: Vec<Vec<f64>> = gauss.nodes.iter().map(|x| polynomials(k, 2.0 * x - 1.0)).collect();
        let coefficient = |n: usize| {
            let mut c = [0.0; 2];
            for ((p, w), v) in basis.iter().zip(&gauss.weights).zip(values) {
                let p = (2 * n + 1) as f64 * w * p[n];
                c[0] += p * v[0] * radius;
                c[1] += p * v[1];
            }
            c[0].hypot(c[1])
        };
        let (last, before) = (coefficient(k - 1), coefficient(k - 2).max(coefficient(k - 3)));
        match (last > 0.0, edge) {
            (false, _) => 0.0,
            (true, true) => 0.05 * last,
            (true, false) => last * (last / before).min(1.0).powi((k as i32 + 1) / 2),
        }
    }

    /// The place of each node.
    pub fn places(&self) -> impl Iterator<Item = f64> + '_ {
        self.mesh.windows(2).flat_map(|w| self.gauss.nodes.iter().map(|node| w[0] + (w[1] - w[0]) * node))
    }

    /// The value at `x`: of the polynomial through the nodes of its interval.
    pub fn at(&self, x: f64) -> Given {
        let k = self.gauss.stages();
        let i = self.mesh.partition_point(|m| *m <= x).clamp(1, self.mesh.len() - 1) - 1;
        let theta = (x - self.mesh[i]) / (self.mesh[i + 1] - self.mesh[i]);
        let mut out = Given::default();
        for (l, value) in self.values[i * k..(i + 1) * k].iter().enumerate() {
            let weight = self.gauss.value(l, theta);
            out.iter_mut().zip(value).for_each(|(o, v)| *o += weight * v);
        }
        out
    }
}
