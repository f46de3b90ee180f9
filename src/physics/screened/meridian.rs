//! The integral along the meridian: panels that grow with their distance from the target, and the principal value.
//!
//! On each side of a target on the surface, s the arc length from it, t the unit tangent pointing away, sigma the charge per
//! area, the integrand begins with -2 sigma t/s. That much is subtracted on the first panel [0, h] and added as
//! -2 sigma t ln(s_h); the terms -2 sigma t ln(eps) of the two sides cancel if tangent and charge density are continuous, which is
//! the principal value with a gap that is symmetric in arc length, whatever the x of the two sides. What is left is a logarithm,
//! integrated under the map s = h v^7.
//!
//! Normal components near the target are small remainders: x - x' is therefore not the difference of two positions but the
//! integral of (du, dz) from the target on, with a relative rather than an absolute accuracy of machine precision.

use std::f64::consts::PI;
use std::ops::Range;

use super::Field;
use super::ring::Kernel;
use super::rules::{RULES, Rule, dot};
use super::sheet::{NODES, Nodes, Part, Sheet, Spot, Way, norm};

/// Accuracy asked of a panel, in units of the field of a sphere.
const TOLERANCE: f64 = 1e-11;
/// Factor upon the accuracy asked of k times the potential, which is larger than the field.
const POTENTIAL: f64 = 10.0;
/// Part of the absolute integral below which no accuracy is asked, and the estimate of its rounding error.
const ROUNDING: f64 = 1e-14;
const NOISE: f64 = 1.5e-14;
/// Least (d_a + d_b)/length of a panel with ends a and b: Bernstein ellipse of rate 3, and those of the rules with fewer nodes.
const ROUND: [f64; 3] = [5.1, 2.4, 1.66];
/// Greatest k times length of a panel, by rule.
const DECAY: [f64; 3] = [2.0, 6.0, 18.0];
/// k times length of the first panel.
pub const FIRST: f64 = 1.5;
/// Halvings of a panel after which it is taken as it is.
const HALVINGS: usize = 50;
/// Panels refused around a target after which panels are taken whatever their estimated error, as on rough curves; and those after
/// which they are taken whatever their shape, as where the curve is not a number.
const REFUSED: usize = 600;
const LOST: usize = 20_000;
/// Error of the first panel per error of the interpolated density: 2 int dx/x from its first node.
const SINGULAR: f64 = 80.0;
/// Relative error of the interpolation that is rounding, and the one below which it is taken for noise if it does not fall.
const GRAIN: f64 = 5e-15;
const COARSE: f64 = 1e-6;
/// Least length in x of a panel; one that is not longer is taken as it is.
const SHORTEST: f64 = 1e-15;

/// A stretch of a part, from the target outwards.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Part.
    pub part: usize,
    /// Its x at the near end.
    pub from: f64,
    /// Its x at the far end.
    pub to: f64,
}

/// One side of a target on the surface.
pub struct Side {
    /// The rest of the part that it is on, or the next one.
    pub first: Option<Stretch>,
    /// The parts beyond.
    pub beyond: Range<usize>,
    /// True if x grows from the target on.
    pub forwards: bool,
}

/// What is known of the target and of the scale of its field.
pub struct Scale {
    /// Charge per area nearby.
    pub density: f64,
    /// Extent of the surface.
    pub size: f64,
    /// Factor upon 2 pi density that gives the field.
    pub field: f64,
}

/// Sums over the panels: radial and axial field, potential.
pub struct Walk<'a> {
    sheet: &'a Sheet,
    k: f64,
    kernel: Kernel,
    u: f64,
    z: f64,
    tolerance: [f64; 3],
    sum: [f64; 3],
    absolute: [f64; 3],
    error: [f64; 3],
    /// Position minus target, as long as it is integrated.
    offset: Option<[f64; 2]>,
    /// Differences as long as this or longer are taken from positions.
    far: f64,
    /// Arc length of the last panel.
    last: f64,
    /// Panels refused.
    refused: usize,
}

impl<'a> Walk<'a> {
    /// A walk around the target (`u`, `z`) at the distance `nearest` from the charges.
    pub fn new(sheet: &'a Sheet, k: f64, [u, z]: [f64; 2], nearest: f64, scale: &Scale) -> Self {
        let field = (TOLERANCE * scale.field + ROUNDING) * 2.0 * PI * scale.density.abs();
        Self {
            sheet,
            k,
            kernel: Kernel::new(k, nearest),
            u,
            z,
            tolerance: [field, field, POTENTIAL * field / k],
            sum: [0.0; 3],
            absolute: [0.0; 3],
            error: [0.0; 3],
            offset: None,
            far: 0.05 * scale.size,
            last: f64::INFINITY,
            refused: 0,
        }
    }

    /// Integrand per unit x at a ring at the offset (`du`, `dz`) from the target, of the charge `density` per x, radian, radius.
    fn source(&self, density: f64, [du, dz]: [f64; 2]) -> [f64; 3] {
        let radius = (self.u + du).max(0.0);
        let charge = density * radius;
        let angle = self.kernel.angle(4.0 * self.u * radius, norm(du, dz));
        let radial = if self.u > 0.0 { charge * (radius * angle.j3s - du * angle.j3) } else { 0.0 };
        [radial, -charge * dz * angle.j3, charge * angle.j1]
    }

    /// Takes a panel into the sums if it is accurate enough, or if it must; `vague`: relative error of the sources.
    fn take(&mut self, rule: &Rule, length: f64, values: [&[f64]; 3], vague: f64, must: bool) -> bool {
        let mut found = [[0.0; 3]; 3];
        for c in 0..3 {
            let (sum, error) = rule.integral(values[c]);
            let size: f64 = rule.w.iter().zip(values[c]).map(|(w, f)| w * f.abs()).sum();
            found[c] = [length * sum, length * (error + vague * size), length * size];
        }
        // the two components of the field are one vector
        let size = found[0][2] + found[1][2];
        let allowed = [size, size, found[2][2]];
        if !must && (0..3).any(|c| !(found[c][1] <= self.tolerance[c] + ROUNDING * allowed[c])) {
            return false;
        }
        for c in 0..3 {
            self.sum[c] += found[c][0];
            self.error[c] += found[c][1];
            self.absolute[c] += found[c][2];
        }
        true
    }

    /// One side of a target on the surface, at the near end of its first stretch; returns -2 sigma t.
    pub fn side(&mut self, side: &Side, reach: f64, density: f64) -> [f64; 2] {
        let Some(first) = &side.first else { return [0.0; 2] };
        let start = self.sheet.parts[first.part].at(first.from);
        let g = start.speed();
        let sign = (first.to - first.from).signum();
        let pole = [start.du, start.dz].map(|d| -2.0 * density * sign * d / g);
        let whole = (first.to - first.from).abs();
        let mut h = (reach / g).min(whole);
        if h > 0.7 * whole {
            h = whole;
        }
        self.offset = Some([0.0; 2]);
        let (mut halvings, mut rough) = (0, f64::INFINITY);
        while !self.start(first, sign * h, pole, &mut rough, halvings >= HALVINGS || self.refused > REFUSED) {
            h *= 0.5;
            self.refused += 1;
            halvings += 1;
        }
        if h < whole {
            self.stretch(&Stretch { from: first.from + sign * h, ..*first }, 2.0);
        }
        self.beyond(&side.beyond, side.forwards, 3.0);
        pole
    }

    /// Whole parts away from the target, many at a time where they are far from it.
    pub fn beyond(&mut self, parts: &Range<usize>, forwards: bool, growth: f64) {
        let sheet = self.sheet;
        let (mut at, end) = if forwards { (parts.start, parts.end) } else { (parts.end, parts.start) };
        while at != end {
            let union = sheet.unions(at, forwards, parts).find(|(_, part)| {
                let [start, _, end] = &part.marks;
                if forwards {
                    self.panel(part, [part.from, part.to], [start, end], false)
                } else {
                    self.panel(part, [part.to, part.from], [end, start], false)
                }
            });
            let many = union.map_or(1, |(many, _)| many);
            if union.is_none() {
                let part = if forwards { at } else { at - 1 };
                let Part { from, to, .. } = sheet.parts[part];
                let [from, to] = if forwards { [from, to] } else { [to, from] };
                self.stretch(&Stretch { part, from, to }, growth);
            }
            at = if forwards { at + many } else { at - many };
        }
    }

    /// The panel at the target, of signed length `step` in x. It knows the curve by interpolation; `rough` is what that missed in the
    /// last attempt, and becomes what it misses in this one.
    fn start(&mut self, at: &Stretch, step: f64, pole: [f64; 2], rough: &mut f64, must: bool) -> bool {
        let (samples, mapped) = (&RULES.plain[2], &RULES.mapped);
        let (n, m, length) = (mapped.x.len(), samples.x.len(), step.abs());
        let Nodes([_, _, along_u, along_z, charges]) =
            self.sheet.parts[at.part].nodes(&samples.x, at.from, at.from + step);
        let mut known = [along_u, along_z, charges, [0.0; NODES]];
        (0..m).for_each(|i| known[3][i] = norm(along_u[i], along_z[i]));
        let speeds = dot(&samples.w, &known[3]);
        let charge = dot(&samples.w, &known[2].map(f64::abs)) / speeds;
        let [u, z, density, g] = [0, 1, 2, 3].map(|c| samples.tail(&known[c]) / speeds);
        let missing = SINGULAR * (density + charge * (u + z + g));
        let before = std::mem::replace(rough, missing);
        let noise = missing > 0.25 * before && missing < COARSE * SINGULAR * charge;
        if !must && !noise && !(missing <= self.tolerance[0] + GRAIN * SINGULAR * charge) {
            return false;
        }
        let mut values = [[0.0; 24]; 3];
        for i in 0..n {
            let (value, mean) = (&mapped.value[i * m..(i + 1) * m], &mapped.mean[i * m..(i + 1) * m]);
            let xi = length * mapped.x[i];
            let f = self.source(dot(value, &known[2]), [xi * dot(mean, &known[0]), xi * dot(mean, &known[1])]);
            let ratio = dot(value, &known[3]) / (xi * dot(mean, &known[3]));
            for c in 0..3 {
                let singular = if c < 2 { pole[c] * ratio } else { 0.0 };
                values[c][i] = (f[c] - singular) * mapped.slope[i];
            }
        }
        let [a, b, c] = &values;
        if !self.take(&mapped.rule, length, [a, b, c], 0.0, must) {
            return false;
        }
        let along = |f: &[f64; NODES]| length * dot(&samples.w, f);
        self.last = along(&known[3]);
        for (error, scale) in self.error.iter_mut().zip([1.0, 1.0, self.last]) {
            *error += scale * missing;
        }
        let log = (self.k * self.last).ln();
        for c in 0..2 {
            self.sum[c] += pole[c] * log;
            self.absolute[c] += pole[c].abs() * (1.0 + log.abs());
        }
        self.offset = Some([along(&known[0]), along(&known[1])]);
        true
    }

    /// All panels of a stretch away from the target, the first one `growth` times as long as the last panel.
    pub fn stretch(&mut self, stretch: &Stretch, growth: f64) {
        let part = &self.sheet.parts[stretch.part];
        let spot = |x: f64| match x {
            _ if x == part.from => part.marks[0],
            _ if x == part.to => part.marks[2],
            _ => part.at(x),
        };
        let sign = (stretch.to - stretch.from).signum();
        let (mut at, mut here) = (stretch.from, spot(stretch.from));
        let mut step = growth * self.last / here.speed();
        while at != stretch.to {
            let rest = (stretch.to - at).abs();
            step = step.max(SHORTEST);
            if !(1.4 * step < rest) {
                step = rest;
            }
            let mut halvings = 0;
            let (end, next) = loop {
                let end = if step < rest { at + sign * step } else { stretch.to };
                let next = spot(end);
                let must = halvings >= HALVINGS || self.refused > LOST || step < SHORTEST;
                if self.panel(part, [at, end], [&here, &next], must) {
                    break (end, next);
                }
                self.refused += 1;
                step *= 0.5;
                halvings += 1;
            };
            (at, here) = (end, next);
            step *= 3.0;
        }
    }

    /// Takes the panel between two values of x if it is short enough for its distance.
    fn panel(&mut self, part: &Part, [from, to]: [f64; 2], [start, end]: [&Spot; 2], must: bool) -> bool {
        let step = to - from;
        let way = part.way(from, to);
        let middle = if way.is_some() { part.marks[1] } else { part.at(from + 0.5 * step) };
        let away = |r: &Spot| norm(r.u - self.u, r.z - self.z);
        let chord = |a: &Spot, b: &Spot| norm(a.u - b.u, a.z - b.z);
        let ends = match self.offset {
            Some([du, dz]) => norm(du, dz),
            None => away(start),
        } + away(end);
        let length = (chord(start, &middle) + chord(&middle, end))
            .max(step.abs() * (start.speed() + 4.0 * middle.speed() + end.speed()) / 6.0);
        if self.k * 0.5 * (ends - 1.1 * length) > self.kernel.budget {
            self.offset = None;
            self.last = length;
            return true;
        }
        let fits = |i: usize| ends >= ROUND[i] * length && self.k * length <= DECAY[i];
        let Some(first) = (0..3).find(|&i| fits(i)).or(must.then_some(2)) else { return false };
        let must = must || self.refused > REFUSED;
        // What the polynomials of a part miss is seen from the distance.
        let vague = part.missing * (1.0 + 6.0 * self.sheet.size / (ends - length).max(0.1 * length));
        (first..3).any(|i| match way {
            Some(way) => self.gauss(&RULES.plain[i], &part.ways[i][way], vague, must && i == 2),
            None => {
                let rule = &RULES.plain[i];
                self.gauss(rule, &Way::new(part.nodes(&rule.x, from, to), rule, step.abs()), vague, must && i == 2)
            }
        })
    }

    fn gauss(&mut self, rule: &Rule, way: &Way, vague: f64, must: bool) -> bool {
        let n = rule.x.len();
        let Nodes([u, z, _, _, charges]) = &way.nodes;
        let mut values = [[0.0; NODES]; 3];
        for i in 0..n {
            let offset = match self.offset {
                Some(base) => [base[0] + way.offsets[0][i], base[1] + way.offsets[1][i]],
                None => [u[i] - self.u, z[i] - self.z],
            };
            let f = self.source(charges[i], offset);
            (values[0][i], values[1][i], values[2][i]) = (f[0], f[1], f[2]);
        }
        if !self.take(rule, way.span, [&values[0][..n], &values[1][..n], &values[2][..n]], vague, must) {
            return false;
        }
        self.last = way.length;
        if let Some([u, z]) = &mut self.offset {
            (*u, *z) = (*u + way.step[0], *z + way.step[1]);
            if norm(*u, *z) > self.far {
                self.offset = None;
            }
        }
        true
    }

    /// The sums; `missing` is an error from elsewhere, `noise` the relative error of the differences.
    pub fn field(&self, missing: f64, noise: f64) -> Field {
        let size = self.absolute[0] + self.absolute[1];
        let error = self.error[0].max(self.error[1]) + (NOISE + noise) * size;
        let potential = self.error[2] + NOISE * self.absolute[2];
        Field {
            radial: self.sum[0],
            axial: self.sum[1],
            potential: self.sum[2],
            error: error.max(self.k * potential) + missing,
        }
    }
}
