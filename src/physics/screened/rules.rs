//! Quadrature on one panel [0, 1]: Gauss rules that also integrate to their own nodes, and a rule for a logarithm at the start.

use crate::legendre::{gauss, polynomials};
use std::sync::LazyLock;

/// Power of the map x = v^POWER that takes a logarithm at x = 0 away.
const POWER: i32 = 7;

/// Sum of products.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A Gauss rule on [0, 1].
pub struct Rule {
    /// Nodes.
    pub x: Vec<f64>,
    /// Weights.
    pub w: Vec<f64>,
    /// Row i: weights of the integral from 0 to node i.
    pub upto: Vec<f64>,
    /// Rows: the Legendre coefficients 0, 1, n - 2, n - 1 of a function given at the nodes.
    ends: [Vec<f64>; 4],
}

impl Rule {
    fn new(n: usize) -> Self {
        let (x, w) = gauss(n);
        let basis: Vec<Vec<f64>> = x.iter().map(|x| polynomials(n + 1, 2.0 * x - 1.0)).collect();
        let coefficient = |j: usize, i: usize| (2 * j + 1) as f64 * w[i] * basis[i][j];
        let mut upto = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                let mut sum = x[i] * coefficient(0, j);
                for m in 1..n {
                    sum += (basis[i][m + 1] - basis[i][m - 1]) / (2 * (2 * m + 1)) as f64 * coefficient(m, j);
                }
                upto[i * n + j] = sum;
            }
        }
        let ends = [0, 1, n - 2, n - 1].map(|j| (0..n).map(|i| coefficient(j, i)).collect());
        Self { x, w, upto, ends }
    }

    /// Integral of a function given at the nodes, and an estimate of its error: the coefficients fall like r^n with r the rate
    /// of the Bernstein ellipse, the error of the rule like r^(2 n), hence tail * (tail / head).
    pub fn integral(&self, f: &[f64]) -> (f64, f64) {
        let [c0, c1, y, z] = [0, 1, 2, 3].map(|i| dot(&self.ends[i], f).abs());
        let (head, tail) = (c0.max(c1), y.max(z));
        let error = if tail > 0.0 { tail * (SAFETY * tail / head).min(1.0) } else { 0.0 };
        (dot(&self.w, f), error)
    }

    /// The larger of the last two Legendre coefficients of a function given at the nodes: what interpolation between them may miss.
    pub fn tail(&self, f: &[f64]) -> f64 {
        dot(&self.ends[2], f).abs().max(dot(&self.ends[3], f).abs())
    }
}

/// Factor upon the estimated error of a rule.
const SAFETY: f64 = 100.0;

/// A rule for functions with a logarithm at 0, on functions that are known at the nodes of a Gauss rule.
pub struct Mapped {
    /// The Gauss rule in v whose images under x = v^7 are the nodes; its weights do not contain the derivative of the map.
    pub rule: Rule,
    /// The nodes x.
    pub x: Vec<f64>,
    /// dx/dv at the nodes.
    pub slope: Vec<f64>,
    /// Row i: weights of the value at node i.
    pub value: Vec<f64>,
    /// Row i: weights of the mean over [0, node i].
    pub mean: Vec<f64>,
}

impl Mapped {
    fn new(n: usize, samples: &Rule) -> Self {
        let rule = Rule::new(n);
        let m = samples.x.len();
        let x: Vec<f64> = rule.x.iter().map(|v| v.powi(POWER)).collect();
        let slope = rule.x.iter().map(|v| f64::from(POWER) * v.powi(POWER - 1)).collect();
        let basis: Vec<Vec<f64>> = samples.x.iter().map(|x| polynomials(m, 2.0 * x - 1.0)).collect();
        let (mut value, mut mean) = (Vec::new(), Vec::new());
        for &x in &x {
            let here = polynomials(m, 2.0 * x - 1.0);
            let mut average = vec![0.0; m];
            for (y, w) in samples.x.iter().zip(&samples.w) {
                for (sum, p) in average.iter_mut().zip(polynomials(m, 2.0 * x * y - 1.0)) {
                    *sum += w * p;
                }
            }
            for j in 0..m {
                let row =
                    |p: &[f64]| (0..m).map(|l| (2 * l + 1) as f64 * samples.w[j] * basis[j][l] * p[l]).sum::<f64>();
                value.push(row(&here));
                mean.push(row(&average));
            }
        }
        Self { rule, x, slope, value, mean }
    }
}

/// All rules in use.
pub struct Rules {
    /// Gauss rules with 8, 12 and 16 nodes.
    pub plain: [Rule; 3],
    /// The rule for a logarithm; its samples are those of the last plain rule.
    pub mapped: Mapped,
}

/// The rules, made once.
pub static RULES: LazyLock<Rules> = LazyLock::new(|| {
    let plain = [8, 12, 16].map(Rule::new);
    let mapped = Mapped::new(24, &plain[2]);
    Rules { plain, mapped }
});
