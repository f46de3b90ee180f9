//! Continuation by arclength, where the control turns back or steps in it fail.

use super::outcome::Reason;
use super::state::{self, Halt};
use super::trace::{Stop, Tracer};
use crate::bvp::Problem;
use crate::solution::Solution;
use crate::system::Closing;
use std::sync::Arc;

/// The smallest step of arclength, relative to the first one, before the branch is given up.
const LEAST_ARC: f64 = 1e-4;
/// Steps of arclength in which the control must pass a value or turn.
const ARC_STEPS: usize = 200;

impl Tracer {
    /// Follows the branch by arclength, where steps in the control fail, until the control is nearer to `c` than before by a good part
    /// or turns back.
    pub(super) fn around(&mut self, c: f64, watch: bool, halt: Halt) -> Result<(), Stop> {
        let begun = self.value(self.last());
        let toward = (c - begun).signum();
        let model = self.model.clone();
        // Unit tangent in the globals, relative to their magnitude, pointing towards c.
        let unit = |s: &Solution, sign: f64| -> (Vec<f64>, f64) {
            let p = s.disc.p();
            let weights: Vec<f64> =
                s.state[p..].iter().enumerate().map(|(g, v)| model.system.global_scale(g, *v).powi(-2)).collect();
            let t = &s.tangent[p..];
            let length = t.iter().zip(&weights).map(|(t, w)| t * t * w).sum::<f64>().sqrt();
            (t.iter().zip(&weights).map(|(t, w)| sign * t * w / length).collect(), sign / length)
        };
        let p = |s: &Solution| s.disc.p();
        let globals = |s: &Solution| s.state[p(s)..].to_vec();
        let layout = self.model.system.layout().clone();
        let slots: Vec<usize> = (0..layout.globals).map(|g| layout.global(g)).collect();
        let sign = toward * self.rate(self.last()).signum();
        let (mut direction, mut scale) = unit(self.last(), sign);
        let mut ds = 1e-2;
        let least = LEAST_ARC * ds;
        for _ in 0..ARC_STEPS {
            let s = self.last().clone();
            let base: f64 = globals(&s).iter().zip(&direction).map(|(z, d)| z * d).sum();
            let mut disc = s.disc.clone();
            let mut z: Vec<f64> = s.state.iter().zip(&s.tangent).map(|(z, t)| z + ds * scale * t).collect();
            self.system.closing =
                Closing::Arc { slots: slots.clone(), direction: direction.clone(), target: base + ds };
            match state::solve(&self.model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work) {
                Ok(next) => {
                    // The tangent of `next` is per unit of arclength along `direction`, so it points onwards.
                    if self.rate(&next) * toward <= 0.0 {
                        let (turn, at) = self.turn(&next, &slots, &direction, base, ds)?;
                        self.happen("fold", self.model.branch.control.clone(), self.model.stage(), turn.clone());
                        self.report(Reason::Fold, None, turn.clone());
                        // Not beyond an event: it is found on the way back.
                        let mut beyond = next;
                        let mut left = ds - at;
                        while self.passes(&turn, &beyond) && left > least * (ds - at) {
                            left *= 0.5;
                            beyond = self.along(&turn, &slots, &direction, base + at + left).map_err(Stop::Halt)?;
                        }
                        self.history = vec![beyond];
                        self.entered = false;
                        return Err(Stop::Turned);
                    }
                    if (self.value(&next) - c) * toward >= 0.0 {
                        // Between two states: from there the value itself is found, or the way to it is cut shorter.
                        let kept = std::mem::replace(&mut self.history, vec![s, next]);
                        let landed = self.at(c);
                        self.history = kept;
                        match landed {
                            Ok(solution) => return self.accept(solution, watch),
                            Err(failed) if ds * 0.3 < least => return Err(Stop::Halt(failed)),
                            Err(_) => {
                                ds *= 0.3;
                                continue;
                            }
                        }
                    }
                    self.accept(next, watch)?;
                    if !Arc::ptr_eq(&model, &self.model) {
                        return Ok(()); // another stage, other unknowns
                    }
                    (direction, scale) = unit(self.last(), 1.0);
                    ds *= 1.5;
                    if (self.value(self.last()) - begun).abs() > 0.1 * (c - begun).abs() {
                        return Ok(());
                    }
                }
                Err(failed) => {
                    ds *= 0.3;
                    if ds < least {
                        return Err(Stop::Halt(if matches!(failed, Halt::Newton { .. }) { halt } else { failed }));
                    }
                }
            }
        }
        Err(Stop::Halt(halt))
    }

    /// The state in which the control is stationary, between the state at arclength 0 and `b`, at `ds`, which is beyond it, and its
    /// arclength.
    pub(super) fn turn(
        &mut self,
        b: &Solution,
        slots: &[usize],
        direction: &[f64],
        base: f64,
        ds: f64,
    ) -> Result<(Solution, f64), Stop> {
        // Positive before the turn, negative after it. The rate of `a` is per unit of its own closing condition: its size is unknown.
        let beyond = self.rate(b).signum();
        let (mut xa, mut xb, mut gb) = (0.0, ds, -self.rate(b).abs());
        let mut ga = gb.abs();
        let (end, size) = (ds, ga);
        let (mut best, mut at) = (b.clone(), ds);
        for _ in 0..60 {
            let mut x = (xa * gb - xb * ga) / (gb - ga);
            if !x.is_finite() || (x - xa) * (x - xb) >= 0.0 {
                x = 0.5 * (xa + xb);
            }
            let s = self.along(&best, slots, direction, base + x).map_err(Stop::Halt)?;
            let g = -self.rate(&s) * beyond;
            (best, at) = (s, x);
            if g.abs() <= 1e-13 * size || (xb - xa).abs() <= 1e-12 * end {
                break;
            }
            // Illinois: the end that stays counts half.
            if g > 0.0 {
                (xa, ga) = (x, g);
                gb *= if xb == end { 1.0 } else { 0.5 };
            } else {
                (xb, gb) = (x, g);
                ga *= if xa == 0.0 { 1.0 } else { 0.5 };
            }
        }
        Ok((best, at))
    }

    /// The state at an arclength, from one nearby.
    fn along(&mut self, near: &Solution, slots: &[usize], direction: &[f64], target: f64) -> Result<Solution, Halt> {
        let (mut disc, mut z) = (near.disc.clone(), near.state.clone());
        self.system.closing = Closing::Arc { slots: slots.to_vec(), direction: direction.to_vec(), target };
        state::solve(&self.model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work)
    }
}
