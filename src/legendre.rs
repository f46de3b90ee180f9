//! Legendre polynomials and the quadrature that Gauss made of them.

/// Legendre polynomials P_0 to P_{n-1} at y.
pub fn polynomials(n: usize, y: f64) -> Vec<f64> {
    let mut p = vec![1.0, y];
    for j in 2..n {
        let m = j as f64;
        p.push(((2.0 * m - 1.0) * y * p[j - 1] - (m - 1.0) * p[j - 2]) / m);
    }
    p.truncate(n);
    p
}

/// Gauss-Legendre nodes and weights on [0, 1].
pub fn gauss(n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut nodes, mut weights) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        // Newton from Tricomi's estimate; the recurrence gives P_n and its slope.
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..100 {
            let (mut p0, mut p1) = (1.0, x);
            for j in 2..=n {
                let j = j as f64;
                (p0, p1) = (p1, ((2.0 * j - 1.0) * x * p1 - (j - 1.0) * p0) / j);
            }
            slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
            let step = p1 / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        nodes[n - 1 - i] = 0.5 * (1.0 + x);
        weights[n - 1 - i] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}
