//! Numbers read off fields: largest and smallest values along the membrane, and values at a material point.

use super::{Carried, View};
use crate::bvp::{Problem, value_at};
use crate::scalar::Dual;
use crate::system::{Coordinate, Reading, Site, What};

/// Places inside an interval that are looked at.
const PLACES: usize = 4;

impl View<'_> {
    /// The number; nothing where the field has no largest value because it grows without bound towards a tip, or where no piece
    /// reaches the place.
    pub(super) fn read(&self, reading: &Reading) -> Option<Carried> {
        match reading.what {
            What::Max => self.extreme(reading, 1.0),
            What::Min => self.extreme(reading, -1.0),
            What::At(phi) => self.at(reading, phi),
        }
    }

    /// The states at a place between mesh points, as accurate as at them.
    fn states(&self, s: usize, i: usize, theta: f64) -> Vec<Carried> {
        let n = self.system.pieces[s].states();
        if theta == 0.0 || theta == 1.0 {
            let at = self.disc.y(s, i + theta as usize);
            return (0..n).map(|c| self.unknown(at + c)).collect();
        }
        value_at(self.system, self.disc, &|u| self.unknown(u), s, i, theta)
            .unwrap_or_else(|| self.interpolate(s, i, theta, n))
    }

    fn parameters(&self, s: usize) -> Vec<Carried> {
        self.system.pieces[s].parameters().iter().map(|&g| self.global(g)).collect()
    }

    fn site(&self, s: usize, i: usize, theta: f64) -> Site<Carried> {
        let piece = &self.system.pieces[s];
        let x = self.disc.meshes[s][i] + theta * self.disc.width(s, i);
        let y = self.states(s, i, theta);
        piece.site(&self.system.reference, &self.system.law, x, &y, &self.parameters(s))
    }

    /// The largest value of the field times a sign. The field is stationary there, or the place is an end of a piece: an error of the
    /// place is an error of second order.
    fn extreme(&self, reading: &Reading, sign: f64) -> Option<Carried> {
        let mut best: Option<(f64, (usize, usize, f64))> = None;
        for &s in &reading.pieces {
            let plain = |i: usize, theta: f64| {
                let piece = &self.system.pieces[s];
                let x = self.disc.meshes[s][i] + theta * self.disc.width(s, i);
                let y: Vec<f64> = self.interpolate(s, i, theta, piece.states()).iter().map(|v| v.re).collect();
                let p: Vec<f64> = self.parameters(s).iter().map(|v| v.re).collect();
                sign * reading.field.at(&piece.site(&self.system.reference, &self.system.law, x, &y, &p))
            };
            let mut consider = |i: usize, theta: f64, value: f64| {
                if value.is_finite() && best.is_none_or(|b| value > b.0) {
                    best = Some((value, (s, i, theta)));
                }
            };
            for i in 0..self.disc.intervals(s) {
                let place = |k: usize| k as f64 / (PLACES + 1) as f64;
                let values: Vec<f64> = (0..PLACES + 2).map(|k| plain(i, place(k))).collect();
                for (k, v) in values.iter().enumerate() {
                    consider(i, place(k), *v);
                }
                let top = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
                let (mut a, mut b) = (place(top.max(1) - 1), place((top + 1).min(PLACES + 1)));
                for _ in 0..60 {
                    let (c, d) = (a + 0.382 * (b - a), b - 0.382 * (b - a));
                    if plain(i, c) > plain(i, d) { b = d } else { a = c }
                }
                let theta = 0.5 * (a + b);
                if theta > 1e-9 && theta < 1.0 - 1e-9 {
                    consider(i, theta, plain(i, theta));
                }
            }
        }
        let (_, (s, i, theta)) = best?;
        let tip = match self.system.pieces[s].coordinate {
            Coordinate::FromTip(_) => i == 0 && theta == 0.0,
            Coordinate::ToTip(_) => i + 1 == self.disc.intervals(s) && theta == 1.0,
            _ => false,
        };
        (!tip).then(|| reading.field.at(&self.site(s, i, theta)))
    }

    /// The value at a material point, which moves along the mesh as its places move.
    fn at(&self, reading: &Reading, phi: f64) -> Option<Carried> {
        let reference = &self.system.reference;
        let goal = reference.eta(phi);
        for &s in &reading.pieces {
            let eta = |x: f64| self.eta(s, x).re;
            if !(eta(0.0) <= goal && goal <= eta(1.0)) {
                continue;
            }
            let (mut a, mut b) = (0.0, 1.0);
            for _ in 0..100 {
                let m = 0.5 * (a + b);
                if eta(m) < goal { a = m } else { b = m }
            }
            let x = 0.5 * (a + b);
            let (i, theta) = self.disc.locate(s, x);
            let value = reading.field.at(&self.site(s, i, theta));
            // At this x the material point moves by d eta: the field there is taken back along its slope.
            let piece = &self.system.pieces[s];
            let p: Vec<f64> = self.parameters(s).iter().map(|v| v.re).collect();
            let y: Vec<f64> = self.states(s, i, theta).iter().map(|v| v.re).collect();
            let mut slope = vec![0.0; y.len()];
            self.system.flow(s, x, &y, &p, &mut slope);
            let along: Vec<Dual<1>> = y.iter().zip(&slope).map(|(v, d)| Dual { re: *v, du: [*d] }).collect();
            let constants: Vec<Dual<1>> = p.iter().map(|v| Dual::from(*v)).collect();
            let (from, to) = piece.places(&p);
            let (here, stretch) = piece.coordinate.at(x, from, to);
            let here = Dual { re: here, du: [stretch] };
            let site = piece.site_at(reference, &self.system.law, x, here, &along, &constants);
            let by_eta = reading.field.at(&site).du[0] / stretch;
            let moved = self.eta(s, x);
            let mut value = value;
            for (v, m) in value.du.iter_mut().zip(moved.du) {
                *v -= by_eta * m;
            }
            return Some(value);
        }
        None
    }
}
