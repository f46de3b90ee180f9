//! Gauss-Legendre collocation on one interval: nodes, weights and the matrices between them.
//!
//! On an interval [x_i, x_i + h] with local coordinate theta in [0, 1] the derivative of the approximation is the polynomial of
//! degree < k through its values at the k Gauss nodes; the approximation itself is its integral, of degree k. Its values at the
//! ends of the intervals are superconvergent, of order 2k (de Boor and Swartz, 1973).
//!
//! A second, finer set of `fine` nodes on the same interval sees what the k nodes cannot: the defect of the approximation between
//! them. It serves the error estimate alone ([`super::estimate`]).

use crate::legendre;

/// Coefficients (ascending powers) of the Lagrange polynomials on `nodes`; row l belongs to node l.
fn lagrange(nodes: &[f64]) -> Vec<Vec<f64>> {
    let k = nodes.len();
    (0..k)
        .map(|l| {
            let mut c = vec![1.0];
            for j in (0..k).filter(|&j| j != l) {
                let d = nodes[l] - nodes[j];
                let mut next = vec![0.0; c.len() + 1];
                for (i, a) in c.iter().enumerate() {
                    next[i] -= a * nodes[j] / d;
                    next[i + 1] += a / d;
                }
                c = next;
            }
            c
        })
        .collect()
}

fn horner(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |s, a| s * x + a)
}

/// The integral of the polynomial `c` from 0 to `x`.
fn integral(c: &[f64], x: f64) -> f64 {
    c.iter().enumerate().rev().fold(0.0, |s, (i, a)| s * x + a / (i as f64 + 1.0)) * x
}

/// The collocation scheme with k stages. Matrices are row-major; `x.len()` gives their shapes.
#[derive(Clone, Debug)]
pub struct Gauss {
    /// Nodes in (0, 1), length k.
    pub nodes: Vec<f64>,
    /// Weights, length k.
    pub weights: Vec<f64>,
    /// k x k: integral of the Lagrange polynomial l from 0 to node j.
    pub integrate: Vec<f64>,
    /// Finer nodes, length m = k + 3.
    pub fine_nodes: Vec<f64>,
    /// Weights of the finer nodes.
    pub fine_weights: Vec<f64>,
    /// m x m: integrals to the finer nodes of the finer Lagrange polynomials.
    pub fine_integrate: Vec<f64>,
    /// m x k: values of the Lagrange polynomials at the finer nodes.
    pub to_fine: Vec<f64>,
    /// m x k: integrals of the Lagrange polynomials from 0 to the finer nodes.
    pub integrate_to_fine: Vec<f64>,
    /// k x m: least-squares projection of values at the finer nodes onto degree < k, evaluated at the nodes.
    pub project: Vec<f64>,
    polynomials: Vec<Vec<f64>>,
}

impl Gauss {
    /// The scheme with `k` stages, 2 <= k <= 8.
    pub fn new(k: usize) -> Self {
        assert!((2..=8).contains(&k), "Gauss collocation is meant for 2 to 8 stages");
        let (nodes, weights) = legendre::gauss(k);
        let (fine_nodes, fine_weights) = legendre::gauss(k + 3);
        let (polynomials, fine_polynomials) = (lagrange(&nodes), lagrange(&fine_nodes));
        let table = |rows: &[f64], f: &dyn Fn(&[f64], f64) -> f64, p: &[Vec<f64>]| -> Vec<f64> {
            rows.iter().flat_map(|&x| p.iter().map(move |c| f(c, x))).collect()
        };
        // Projection: sum over Legendre polynomials P_n, n < k, of (2n + 1) P_n(node) P_n(fine) weight.
        let mut project = Vec::with_capacity(k * fine_nodes.len());
        for &x in &nodes {
            for (&y, w) in fine_nodes.iter().zip(&fine_weights) {
                let (s, t) = (2.0 * x - 1.0, 2.0 * y - 1.0);
                let (mut p, mut q) = ((1.0, s), (1.0, t));
                let mut sum = 0.0;
                for n in 0..k {
                    sum += (2.0 * n as f64 + 1.0) * p.0 * q.0;
                    let m = n as f64 + 1.0;
                    p = (p.1, ((2.0 * m + 1.0) * s * p.1 - m * p.0) / (m + 1.0));
                    q = (q.1, ((2.0 * m + 1.0) * t * q.1 - m * q.0) / (m + 1.0));
                }
                project.push(w * sum);
            }
        }
        Gauss {
            integrate: table(&nodes, &integral, &polynomials),
            fine_integrate: table(&fine_nodes, &integral, &fine_polynomials),
            to_fine: table(&fine_nodes, &horner, &polynomials),
            integrate_to_fine: table(&fine_nodes, &integral, &polynomials),
            project,
            nodes,
            weights,
            fine_nodes,
            fine_weights,
            polynomials,
        }
    }

    /// Number of stages k.
    pub fn stages(&self) -> usize {
        self.nodes.len()
    }

    /// Number of finer nodes.
    pub fn fine_stages(&self) -> usize {
        self.fine_nodes.len()
    }

    /// Value at `theta` of the Lagrange polynomial of node `l`.
    pub fn value(&self, l: usize, theta: f64) -> f64 {
        horner(&self.polynomials[l], theta)
    }

    /// Integral from 0 to `theta` of the Lagrange polynomial of node `l`.
    pub fn integral(&self, l: usize, theta: f64) -> f64 {
        integral(&self.polynomials[l], theta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quadrature_is_exact_to_degree_2k_minus_1_and_not_beyond() {
        for k in 2..=8 {
            let g = Gauss::new(k);
            let moment = |p: i32| g.nodes.iter().zip(&g.weights).map(|(x, w)| w * x.powi(p)).sum::<f64>();
            for p in 0..2 * k as i32 {
                assert!((moment(p) - 1.0 / f64::from(p + 1)).abs() < 1e-15, "k {k}, degree {p}");
            }
            let p = 2 * k as i32;
            let miss = (moment(p) - 1.0 / f64::from(p + 1)).abs();
            assert!(miss > 1e-11, "k {k}: degree {p} must not be exact, missed by {miss:e}");
        }
    }

    #[test]
    fn the_matrices_integrate_and_project_polynomials() {
        let g = Gauss::new(5);
        let (k, m) = (5, 8);
        let p = |x: f64| 1.0 - 3.0 * x.powi(2) + 2.0 * x.powi(4);
        let primitive = |x: f64| x - x.powi(3) + 0.4 * x.powi(5);
        for j in 0..k {
            let s: f64 = (0..k).map(|l| g.integrate[j * k + l] * p(g.nodes[l])).sum();
            assert!((s - primitive(g.nodes[j])).abs() < 1e-14);
            let s: f64 = (0..m).map(|l| g.project[j * m + l] * p(g.fine_nodes[l])).sum();
            assert!((s - p(g.nodes[j])).abs() < 1e-13);
        }
        for j in 0..m {
            let s: f64 = (0..k).map(|l| g.to_fine[j * k + l] * p(g.nodes[l])).sum();
            assert!((s - p(g.fine_nodes[j])).abs() < 1e-14);
        }
        // The next Legendre polynomial is orthogonal to all of lower degree: its projection vanishes, its values do not.
        let p5 = |x: f64| {
            let t = 2.0 * x - 1.0;
            (63.0 * t.powi(5) - 70.0 * t.powi(3) + 15.0 * t) / 8.0
        };
        for j in 0..k {
            let s: f64 = (0..m).map(|l| g.project[j * m + l] * p5(g.fine_nodes[l])).sum();
            assert!(s.abs() < 1e-13);
        }
    }
}
