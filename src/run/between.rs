//! States between two states of a branch: where a quantity has a value, is stationary, or a function of the state vanishes.

use super::outcome::Reason;
use super::state;
use super::trace::{Tracer, same};
use crate::solution::Solution;
use crate::system::{Closing, Probe};

/// A root is one where the function is this much smaller than where it was bracketed.
const ROOT: f64 = 1e-3;

impl Tracer {
    /// Answers the requests that are met between two states of one stage of the branch, `b` included.
    pub(super) fn meet(&mut self, a: Option<&Solution>, b: &Solution) {
        let Some(mut asked) = self.asked.take() else { return };
        for k in 0..asked.requests.len() {
            let request = asked.requests[k].clone();
            let Some(q) = self.model.quantities.iter().position(|q| q.name == request.name) else { continue };
            let Some(vb) = b.quantity(q) else { continue };
            let range = &mut asked.ranges[k];
            *range = (range.0.min(vb.value), range.1.max(vb.value));
            let hit = |v: f64| same(v, request.value) || v == request.value;
            let mut found = vec![];
            match a.and_then(|a| Some((a, a.quantity(q)?))) {
                None if hit(vb.value) => found.push(b.clone()),
                None => {}
                Some((a, va)) => {
                    // The quantity may turn in between: then each side of its extremum is searched.
                    let mut parts = vec![(a.clone(), b.clone())];
                    if (va.slope / self.rate(a)) * (vb.slope / self.rate(b)) < 0.0
                        && let Some(top) = self.extremum(q, a, b)
                    {
                        parts = vec![(a.clone(), top.clone()), (top, b.clone())];
                    }
                    for (a, b) in parts {
                        let (Some(va), Some(vb)) = (a.quantity(q), b.quantity(q)) else { continue };
                        if hit(va.value) {
                            continue; // answered as the end of the part before
                        }
                        if hit(vb.value) {
                            found.push(b.clone());
                        } else if (va.value - request.value) * (vb.value - request.value) < 0.0 {
                            found.extend(self.crossing(q, request.value, &a, &b));
                        }
                    }
                }
            }
            for solution in found {
                self.report(Reason::At, Some(request.clone()), solution);
                asked.answers[k].extend(self.outcome.points.pop());
            }
        }
        self.asked = Some(asked);
    }

    /// The state between two states in which quantity `q` has a value.
    pub(super) fn crossing(&mut self, q: usize, value: f64, a: &Solution, b: &Solution) -> Option<Solution> {
        let formula = &self.model.clone().quantities[q].formula;
        let near = self.between(a, b, |s| s.quantity(q).map(|m| m.value - value), 1e-4)?;
        if formula.probes().all(Probe::is_local) {
            // Close the problem with the quantity itself: exact in one solution.
            let kept =
                std::mem::replace(&mut self.system.closing, Closing::Value { of: formula.clone(), target: value });
            let (mut disc, mut z) = (near.disc.clone(), near.state.clone());
            let exact = state::solve(&self.model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work);
            self.system.closing = kept;
            if let Ok(exact) = exact {
                return Some(exact);
            }
        }
        self.between(a, b, |s| s.quantity(q).map(|m| m.value - value), 1e-15)
    }

    /// The state between two states in which quantity `q` is stationary along the branch.
    pub(super) fn extremum(&mut self, q: usize, a: &Solution, b: &Solution) -> Option<Solution> {
        let control = self.control;
        self.between(a, b, |s| Some(s.quantity(q)?.slope / s.quantity(control)?.slope), 1e-12)
    }

    /// Root of `g` on the branch between two states where it has opposite signs: regula falsi with halved weights (Illinois)
    /// in the control, to a relative width of `width`.
    pub(super) fn between(
        &mut self,
        a: &Solution,
        b: &Solution,
        g: impl Fn(&Solution) -> Option<f64>,
        width: f64,
    ) -> Option<Solution> {
        let (mut ca, mut cb) = (self.value(a), self.value(b));
        let (mut ga, mut gb) = (g(a)?, g(b)?);
        let (scale, g0) = ((cb - ca).abs(), ga.abs().max(gb.abs()));
        let kept = self.history.clone();
        self.history = vec![a.clone(), b.clone()];
        let mut best: Option<(f64, Solution)> = None;
        let mut side = 0;
        for _ in 0..60 {
            let mut c = (ca * gb - cb * ga) / (gb - ga);
            if !(c - ca).is_finite() || (c - ca) * (c - cb) >= 0.0 {
                c = 0.5 * (ca + cb);
            }
            let Ok(s) = self.at(c) else { break };
            let Some(gc) = g(&s) else { break };
            self.history = vec![b.clone(), s.clone()];
            if best.as_ref().is_none_or(|(v, _)| gc.abs() <= *v) {
                best = Some((gc.abs(), s));
            }
            if gc == 0.0 || (cb - ca).abs() <= width * scale.max(c.abs()) {
                break;
            }
            let move_a = (gc > 0.0) == (ga > 0.0);
            let step = if move_a { (c - ca).abs() } else { (c - cb).abs() };
            if move_a {
                (ca, ga) = (c, gc);
                if side == 1 {
                    gb *= 0.5;
                }
                side = 1;
            } else {
                (cb, gb) = (c, gc);
                if side == -1 {
                    ga *= 0.5;
                }
                side = -1;
            }
            if step <= width * scale.max(c.abs()) {
                break;
            }
        }
        self.history = kept;
        // A sign may also change where the branch was left: no root then.
        best.filter(|b| b.0 <= ROOT * g0).map(|b| b.1)
    }
}
