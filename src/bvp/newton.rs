//! Newton's method with factors that are kept while they contract, and affine-invariant damping when they are fresh
//! (Deuflhard, Newton Methods for Nonlinear Problems, 2004, sections 2.1 and 3.2).

use super::assembly::{Singular, residual};
use super::estimate::rounding;
use super::{Discretization, Linearization, Problem, Residual, State};

/// What was spent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Newton corrections applied.
    pub iterations: usize,
    /// Jacobians evaluated and factorised.
    pub factorisations: usize,
}

impl std::ops::AddAssign for Effort {
    fn add_assign(&mut self, o: Effort) {
        self.iterations += o.iterations;
        self.factorisations += o.factorisations;
    }
}

/// Why no solution was reached. The state then holds the last finite iterate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The residual is not finite at the start (may try again from elsewhere).
    #[error("the equations are not finite at the starting state")]
    NotFinite,
    /// The Jacobian has no inverse in floating point (may try again from elsewhere).
    #[error("the linearised equations are singular")]
    Singular,
    /// No damped step reduces the correction (may try again from nearer).
    #[error("Newton's method does not converge: no damped step reduces the correction")]
    Diverged,
    /// The iteration limit was reached (may try again from nearer).
    #[error("Newton's method does not converge within its limit of iterations")]
    Limit,
}

/// The parameters of the iteration.
#[derive(Clone, Copy, Debug)]
pub struct Newton {
    /// The correction, relative to the scales of the problem, that counts as none.
    pub tolerance: f64,
    /// Iteration limit.
    pub limit: usize,
}

/// Contraction above which kept factors are renewed.
const KEEP: f64 = 0.25;
/// The smallest damping factor tried.
const LEAST_STEP: f64 = 1e-4;
/// A correction that no longer shrinks counts as none if it is within this factor of the response to one sample of rounding errors.
const NOISE: f64 = 30.0;

impl Newton {
    /// Solves the discrete problem from `z`, in place. `kept` may hold factors from a neighbouring state and afterwards holds
    /// factors good enough to solve with at the solution.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn solve<P: Problem>(
        &self,
        problem: &P,
        disc: &Discretization,
        z: &mut State,
        kept: &mut Option<Linearization>,
        effort: &mut Effort,
    ) -> Result<(), Failure> {
        let noise =
            |factors: &Linearization, z: &[f64]| NOISE * norm(problem, disc, z, &rounding(problem, disc, z, factors));
        let mut r = Residual::default();
        let mut delta = vec![0.0; disc.unknowns()];
        let mut next = delta.clone();
        residual(problem, disc, z, &mut r);
        if !finite(&r) {
            *kept = None;
            return Err(Failure::NotFinite);
        }
        if kept.is_some() {
            let start = z.clone();
            if self.simplified(problem, disc, z, kept, effort)? {
                return Ok(());
            }
            *kept = None;
            residual(problem, disc, z, &mut r);
            if !finite(&r) {
                z.copy_from_slice(&start);
                residual(problem, disc, z, &mut r);
            }
        }
        // Tried first with factors that serve nearly always; where no step helps, the factors may be what is wrong.
        let mut even = false;
        for _ in 0..self.limit {
            let factorise = if even { Linearization::even } else { Linearization::new };
            let factors = factorise(problem, disc, z).map_err(|e| match e {
                Singular::Stage { .. } | Singular::Matching => Failure::Singular,
            })?;
            effort.factorisations += 1;
            factors.solve(disc, &r, &mut delta);
            let size = norm(problem, disc, z, &delta);
            if !size.is_finite() {
                return Err(Failure::Singular);
            }
            let mut step = 1.0_f64.min(2.0 / size);
            loop {
                let trial: State = z.iter().zip(&delta).map(|(a, b)| a + step * b).collect();
                residual(problem, disc, &trial, &mut r);
                let mut size_next = f64::INFINITY;
                if finite(&r) {
                    factors.solve(disc, &r, &mut next);
                    size_next = norm(problem, disc, &trial, &next);
                }
                let shrinks = size_next <= (1.0 - 0.25 * step) * size;
                let floor = step == 1.0 && size_next > KEEP * size && size.max(size_next) <= noise(&factors, z);
                if shrinks || floor {
                    z.copy_from_slice(&trial);
                    effort.iterations += 1;
                    if step == 1.0 && (size_next <= self.tolerance || floor) {
                        for (a, b) in z.iter_mut().zip(&next) {
                            *a += b;
                        }
                        effort.iterations += 1;
                        *kept = Some(factors);
                        return Ok(());
                    }
                    if step == 1.0 && size_next <= KEEP * size {
                        *kept = Some(factors);
                        if self.simplified(problem, disc, z, kept, effort)? {
                            return Ok(());
                        }
                        *kept = None;
                        residual(problem, disc, z, &mut r);
                    }
                    break;
                }
                step *= 0.5;
                if step < LEAST_STEP {
                    if even {
                        return Err(Failure::Diverged);
                    }
                    even = true;
                    residual(problem, disc, z, &mut r);
                    break;
                }
            }
        }
        Err(Failure::Limit)
    }

    /// Iterates with kept factors. True when converged; false when they no longer contract (z is then the best iterate).
    fn simplified<P: Problem>(
        &self,
        problem: &P,
        disc: &Discretization,
        z: &mut State,
        kept: &mut Option<Linearization>,
        effort: &mut Effort,
    ) -> Result<bool, Failure> {
        let factors = kept.as_ref().expect("simplified iteration has factors");
        let mut r = Residual::default();
        let mut delta = vec![0.0; disc.unknowns()];
        let mut before = f64::INFINITY;
        let mut last = State::new();
        for _ in 0..self.limit {
            residual(problem, disc, z, &mut r);
            let size = if finite(&r) {
                factors.solve(disc, &r, &mut delta);
                norm(problem, disc, z, &delta)
            } else {
                f64::NAN
            };
            let contraction = size / before;
            let shrinks = size <= KEEP * before || size <= self.tolerance;
            let floor =
                !shrinks && before.max(size) <= NOISE * norm(problem, disc, z, &rounding(problem, disc, z, factors));
            if !(shrinks || floor) {
                if !last.is_empty() && !(size <= before) {
                    z.copy_from_slice(&last);
                }
                return Ok(false);
            }
            if before == f64::INFINITY && size > 0.5 {
                return Ok(false);
            }
            last.clone_from(z);
            for (a, b) in z.iter_mut().zip(&delta) {
                *a += b;
            }
            effort.iterations += 1;
            let remaining = if contraction < 1.0 { size * contraction / (1.0 - contraction) } else { size };
            if size <= self.tolerance || floor || (before < f64::INFINITY && remaining <= self.tolerance) {
                return Ok(true);
            }
            before = size;
        }
        Ok(false)
    }
}

fn finite(r: &Residual) -> bool {
    r.iter().all(|v| v.is_finite())
}

/// The largest change among mesh values and globals, relative to the scales of the problem.
fn norm<P: Problem>(problem: &P, disc: &Discretization, z: &[f64], delta: &[f64]) -> f64 {
    let mut worst: f64 = 0.0;
    for (s, segment) in disc.layout.segments.iter().enumerate() {
        let n = segment.states;
        let y = disc.y(s, 0);
        for i in 0..=disc.intervals(s) {
            for c in 0..n {
                worst = max(worst, delta[y + i * n + c].abs() / problem.state_scale(s, c));
            }
        }
    }
    for g in 0..disc.layout.globals {
        let at = disc.p() + g;
        worst = max(worst, delta[at].abs() / problem.global_scale(g, z[at]));
    }
    worst
}

/// The larger one; NaN wins.
fn max(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
