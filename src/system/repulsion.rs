//! The screened repulsion of a charged membrane by itself.
//!
//! Where the screening length 1/k is small against the radii of curvature, the repulsion is a local energy per reference area
//!
//! ```text
//! w_local = (pi C/k)/(lambda mu)
//! ```
//!
//! to leading order. It is added to the elastic energy, inside Newton's iteration. What the whole field exerts beyond it is small, and
//! is brought up to date between solves as a traction that is given where the equations are collocated.

use crate::bvp::Gauss;
use crate::physics::membrane::Local;
use crate::scalar::Scalar;
use std::f64::consts::PI;
use std::sync::Arc;

/// The repulsion on a piece.
#[derive(Clone, Debug)]
pub struct Repulsion {
    /// C = sigma_0^2 R/(4 pi eps G), in the unit of tension times length.
    pub coupling: f64,
    /// Inverse screening length.
    pub k: f64,
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
    /// Traction away from the axis and downwards, and the energy of the whole field per reference area, at each node.
    pub values: Vec<[f64; 3]>,
}

impl Repulsion {
    /// The factor of 1/(lambda mu) in the local energy.
    pub fn strength(&self) -> f64 {
        PI * self.coupling / self.k
    }

    /// The membrane with the local energy in its response.
    #[inline]
    pub fn added_to<S: Scalar>(&self, m: &Local<S>) -> Local<S> {
        let (mut out, by_l, by_m) = (*m, m.lambda.recip(), m.mu.recip());
        let w = by_l * by_m * self.strength();
        let r = &mut out.response;
        r.w = r.w + w;
        r.w_l = r.w_l - w * by_l;
        r.w_m = r.w_m - w * by_m;
        r.w_ll = r.w_ll + w * by_l * by_l * 2.0;
        r.w_lm = r.w_lm + w * by_l * by_m;
        out
    }

    /// What the local energy misses at `x`, away from the axis and downwards.
    pub fn rest<S: Scalar>(&self, x: f64) -> [S; 2] {
        let [radial, axial, _] = self.rest.as_ref().map_or([0.0; 3], |rest| rest.at(x));
        [radial, axial].map(S::from)
    }

    /// Energy per reference area at `x`: half the potential of the rest of the membrane.
    pub fn energy(&self, x: f64) -> f64 {
        self.rest.as_ref().map_or(0.0, |rest| rest.at(x)[2])
    }
}

impl Rest {
    /// The value at `x`: of the polynomial through the nodes of its interval.
    pub fn at(&self, x: f64) -> [f64; 3] {
        let k = self.gauss.stages();
        let i = self.mesh.partition_point(|m| *m <= x).clamp(1, self.mesh.len() - 1) - 1;
        let theta = (x - self.mesh[i]) / (self.mesh[i + 1] - self.mesh[i]);
        let mut out = [0.0; 3];
        for (l, value) in self.values[i * k..(i + 1) * k].iter().enumerate() {
            let weight = self.gauss.value(l, theta);
            out.iter_mut().zip(value).for_each(|(o, v)| *o += weight * v);
        }
        out
    }
}
