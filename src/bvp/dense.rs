//! Small dense factorisations on flat, row-major storage: LU for the stages of one interval, Householder QR for the elimination
//! between intervals and for the matching system.
//!
//! The elimination is orthogonal because row-pivoted LU grows exponentially, without an error, on boundary-value problems such as
//! S. J. Wright's (SIAM J. Sci. Comput. 14, 1993). The stage systems I - h A (x) J are well conditioned on a sensible mesh, so LU
//! serves there.

use crate::scalar::Scalar;

/// LU factors with row pivoting of an n x n matrix, in place.
///
/// `pivots[c]` is the row exchanged with row c at step c. Returns false when a pivot vanishes or is not finite.
pub fn lu(a: &mut [f64], n: usize, pivots: &mut [usize]) -> bool {
    for c in 0..n {
        let mut p = c;
        let mut best = a[c * n + c].abs();
        for r in c + 1..n {
            let v = a[r * n + c].abs();
            if v > best {
                (best, p) = (v, r);
            }
        }
        if !(best > 0.0 && best.is_finite()) {
            return false;
        }
        pivots[c] = p;
        if p != c {
            for j in 0..n {
                a.swap(c * n + j, p * n + j);
            }
        }
        let inverse = 1.0 / a[c * n + c];
        let (upper, lower) = a.split_at_mut((c + 1) * n);
        let row = &upper[c * n + c + 1..c * n + n];
        for below in lower.chunks_exact_mut(n) {
            let f = below[c] * inverse;
            below[c] = f;
            if f != 0.0 {
                for (x, y) in below[c + 1..].iter_mut().zip(row) {
                    *x -= f * y;
                }
            }
        }
    }
    true
}

/// Solves A x = b with the factors of [`lu`], in place; b may carry derivatives, which are solved for as well.
pub fn lu_solve<S: Scalar>(a: &[f64], n: usize, pivots: &[usize], b: &mut [S]) {
    for c in 0..n {
        b.swap(c, pivots[c]);
    }
    for r in 1..n {
        b[r] = a[r * n..r * n + r].iter().zip(&*b).fold(b[r], |s, (x, y)| s - *y * *x);
    }
    for r in (0..n).rev() {
        let s = a[r * n + r + 1..r * n + n].iter().zip(&b[r + 1..n]).fold(b[r], |s, (x, y)| s - *y * *x);
        b[r] = s / a[r * n + r];
    }
}

/// Solves A^T X = B for `columns` right-hand sides, in place; `b` is row-major n x columns.
pub fn lu_solve_transposed(a: &[f64], n: usize, pivots: &[usize], b: &mut [f64], columns: usize) {
    for c in 0..n {
        let (done, rest) = b.split_at_mut((c + 1) * columns);
        let row = &mut done[c * columns..];
        let d = 1.0 / a[c * n + c];
        row.iter_mut().for_each(|x| *x *= d);
        for (r, below) in (c + 1..n).zip(rest.chunks_exact_mut(columns)) {
            let f = a[c * n + r];
            for (x, y) in below.iter_mut().zip(&*row) {
                *x -= f * y;
            }
        }
    }
    for c in (1..n).rev() {
        let (rest, done) = b.split_at_mut(c * columns);
        let row = &done[..columns];
        for (r, above) in rest.chunks_exact_mut(columns).enumerate() {
            let f = a[c * n + r];
            for (x, y) in above.iter_mut().zip(row) {
                *x -= f * y;
            }
        }
    }
    for c in (0..n).rev() {
        if pivots[c] != c {
            for j in 0..columns {
                b.swap(c * columns + j, pivots[c] * columns + j);
            }
        }
    }
}

/// Householder QR of the first `n` columns of a `rows` x `cols` matrix, applied to the others too, in place.
///
/// Afterwards the upper triangle of the first n columns is R; `vectors` (n x rows, unit norm or zero) holds the reflections in
/// order for [`reflect`].
pub fn householder(a: &mut [f64], rows: usize, cols: usize, n: usize, vectors: &mut [f64]) {
    for c in 0..n {
        let v = &mut vectors[c * rows..(c + 1) * rows];
        v.fill(0.0);
        let mut norm2 = 0.0;
        for r in c..rows {
            v[r] = a[r * cols + c];
            norm2 += v[r] * v[r];
        }
        let norm = norm2.sqrt();
        if norm == 0.0 {
            continue;
        }
        let alpha = if v[c] > 0.0 { -norm } else { norm };
        // |v - alpha e_c|^2 = 2 (norm^2 - alpha v_c)
        let scale = 1.0 / (2.0 * (norm2 - alpha * v[c])).sqrt();
        v[c] -= alpha;
        v[c..].iter_mut().for_each(|x| *x *= scale);
        for r in c + 1..rows {
            a[r * cols + c] = 0.0;
        }
        a[c * cols + c] = alpha;
        for j in c + 1..cols {
            let s: f64 = 2.0 * (c..rows).map(|r| v[r] * a[r * cols + j]).sum::<f64>();
            for r in c..rows {
                a[r * cols + j] -= s * v[r];
            }
        }
    }
}

/// Applies the reflections of [`householder`] to one column.
pub fn reflect(vectors: &[f64], rows: usize, n: usize, b: &mut [f64]) {
    for c in 0..n {
        let v = &vectors[c * rows..(c + 1) * rows];
        let s: f64 = 2.0 * (c..rows).map(|r| v[r] * b[r]).sum::<f64>();
        for r in c..rows {
            b[r] -= s * v[r];
        }
    }
}

/// Solves R x = b in place, R the upper triangle of the first n columns of a matrix with `cols` columns.
pub fn back_substitute(r: &[f64], cols: usize, n: usize, b: &mut [f64]) {
    for i in (0..n).rev() {
        let s: f64 = (i + 1..n).map(|j| r[i * cols + j] * b[j]).sum();
        b[i] = (b[i] - s) / r[i * cols + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(n: usize, m: usize) -> Vec<f64> {
        let mut s = 1u32;
        (0..n * m)
            .map(|_| {
                s = s.wrapping_mul(1664525).wrapping_add(1013904223);
                f64::from(s) / 4294967296.0 - 0.4
            })
            .collect()
    }

    #[test]
    fn lu_solves_both_ways() {
        let n = 9;
        let a = sample(n, n);
        let x: Vec<f64> = (0..n).map(|i| i as f64 - 3.0).collect();
        let (mut f, mut p) = (a.clone(), vec![0; n]);
        assert!(lu(&mut f, n, &mut p));
        let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect();
        lu_solve(&f, n, &p, &mut b);
        let mut t: Vec<f64> = (0..n)
            .flat_map(|i| {
                let s: f64 = (0..n).map(|j| a[j * n + i] * x[j]).sum();
                [s, -s]
            })
            .collect();
        lu_solve_transposed(&f, n, &p, &mut t, 2);
        for i in 0..n {
            assert!((b[i] - x[i]).abs() < 1e-12);
            assert!((t[2 * i] - x[i]).abs() < 1e-12 && (t[2 * i + 1] + x[i]).abs() < 1e-12);
        }
        assert!(!lu(&mut [0.0; 4], 2, &mut [0, 0]), "a singular matrix is refused");
        assert!(!lu(&mut [f64::NAN; 4], 2, &mut [0, 0]), "NaN is refused");
    }

    #[test]
    fn householder_solves_a_square_system() {
        let n = 7;
        let a = sample(n, n);
        let x: Vec<f64> = (0..n).map(|i| 1.0 / (i as f64 + 1.0)).collect();
        let mut b: Vec<f64> = (0..n).map(|i| (0..n).map(|j| a[i * n + j] * x[j]).sum()).collect();
        let (mut r, mut v) = (a, vec![0.0; n * n]);
        householder(&mut r, n, n, n, &mut v);
        reflect(&v, n, n, &mut b);
        back_substitute(&r, n, n, &mut b);
        for i in 0..n {
            assert!((b[i] - x[i]).abs() < 1e-12);
        }
    }
}
