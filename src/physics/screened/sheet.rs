//! The surface as polynomials, made once for all targets.
//!
//! Each stretch between breaks is a polynomial through Chebyshev nodes, halved where that does not resolve it. Next to the axis it is
//! the quotient of the radius and the distance in x that is smooth, and known to rounding.

use super::rules::{RULES, Rule, dot};
use super::{Charged, Ring};
use std::array;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::LazyLock;

/// Coefficients of each polynomial, Chebyshev.
const COEFFICIENTS: usize = 16;
/// Last coefficients, relative to the size of a function, below which it is resolved; above, a stretch is halved ..
const RESOLVED: f64 = 5e-15;
/// .. if they are above this or fall by halving, and not more often than that.
const NOISE: f64 = 1e-11;
const HALVINGS: usize = 8;
/// Distance from the axis, relative to the extent, that is none.
const AXIS: f64 = 1e-12;
/// Unions that miss more, relative to the size of each function, are of no use.
const VAGUE: f64 = 1e-6;
/// Error of a field per charge density and per relative error of the polynomials.
const ROUGH: f64 = 80.0;
/// Most nodes of a panel.
pub const NODES: usize = 16;

/// What is known at a place of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spot {
    /// Radius.
    pub u: f64,
    /// Axial position.
    pub z: f64,
    /// Derivative of the radius by x.
    pub du: f64,
    /// Derivative of the axial position by x.
    pub dz: f64,
    /// Charge per unit x, radian and radius.
    pub charge: f64,
}

impl Spot {
    /// Length of the meridian per unit x.
    pub fn speed(&self) -> f64 {
        norm(self.du, self.dz)
    }

    /// Charge per area.
    pub fn density(&self) -> f64 {
        let speed = self.speed();
        if speed > 0.0 { self.charge / speed } else { 0.0 }
    }
}

/// The nodes of a rule on a panel: u, z, du, dz, charge per radius at each; derivatives along the panel.
#[derive(Clone, Copy, Debug)]
pub struct Nodes(pub [[f64; NODES]; 5]);

/// The nodes of a rule on a panel, with their offsets from where the panel begins.
#[derive(Clone, Debug)]
pub struct Way {
    /// The nodes.
    pub nodes: Nodes,
    /// Their positions minus that of the beginning.
    pub offsets: [[f64; NODES]; 2],
    /// The same for the end.
    pub step: [f64; 2],
    /// Length in x.
    pub span: f64,
    /// Length of the meridian.
    pub length: f64,
}

impl Way {
    /// Integrates along the nodes of a panel of length `span` in x.
    pub fn new(nodes: Nodes, rule: &Rule, span: f64) -> Self {
        let n = rule.x.len();
        let (mut offsets, mut step) = ([[0.0; NODES]; 2], [0.0; 2]);
        for c in 0..2 {
            let slopes = &nodes.0[2 + c][..n];
            (0..n).for_each(|i| offsets[c][i] = span * dot(&rule.upto[i * n..(i + 1) * n], slopes));
            step[c] = span * dot(&rule.w, slopes);
        }
        let length = span * (0..n).map(|i| rule.w[i] * norm(nodes.0[2][i], nodes.0[3][i])).sum::<f64>();
        Way { nodes, offsets, step, span, length }
    }
}

/// Length of a vector.
pub fn norm(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// A polynomial part of the surface.
#[derive(Clone, Debug)]
pub struct Part {
    /// Piece of the surface.
    pub piece: usize,
    /// Its ends in x.
    pub from: f64,
    pub to: f64,
    /// The end on the axis.
    axis: Option<f64>,
    /// What the polynomials of a union miss of its parts, relative to the size of each function.
    pub missing: f64,
    coefficients: [[f64; COEFFICIENTS]; 5],
    /// Beginning, middle and end.
    pub marks: [Spot; 3],
    /// The whole part as a panel, by rule; forwards, backwards.
    pub ways: Vec<[Way; 2]>,
}

/// A charged surface of revolution, ready for the evaluation of its field.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// The parts in the order of the meridian.
    pub parts: Vec<Part>,
    /// Unions of 2, 4, 8, .. neighbouring parts that start at a multiple of that, as one polynomial: for those who are far from them.
    unions: Vec<Vec<Option<Part>>>,
    /// Extent.
    pub size: f64,
    /// Its least and greatest axial position.
    pub span: [f64; 2],
    /// Largest charge density.
    pub most: f64,
    /// What the polynomials miss, relative to the size of each function.
    pub rough: f64,
}

impl Sheet {
    /// Reads a surface.
    pub fn new(curve: &impl Charged) -> Self {
        let (size, most, span) = extent(curve);
        let mut sheet = Sheet { parts: vec![], unions: vec![], size, span, most, rough: 0.0 };
        for piece in 0..curve.pieces() {
            for w in curve.breaks(piece).windows(2).filter(|w| w[0] < w[1]) {
                sheet.add(curve, piece, [w[0], w[1]], f64::INFINITY, 0);
            }
        }
        let mut below: Vec<Option<Part>> = sheet.parts.iter().cloned().map(Some).collect();
        while below.len() > 1 {
            let pairs = below.chunks_exact(2).map(|pair| match pair {
                [Some(a), Some(b)] if a.piece == b.piece => {
                    let at = |x: f64| if x <= b.from { a.at(x) } else { b.at(x) };
                    let part = Part::new(at, a.piece, [a.from, b.to], a.axis.or(b.axis), [size, most]);
                    (part.missing < VAGUE).then_some(part)
                }
                _ => None,
            });
            let next: Vec<Option<Part>> = pairs.collect();
            sheet.unions.push(std::mem::replace(&mut below, next));
        }
        sheet.unions.push(below);
        sheet
    }

    /// The unions that begin (walking forwards) or end there (backwards) before the part of a number, within a range of parts: the
    /// largest first, with the number of parts in each.
    pub fn unions(&self, at: usize, forwards: bool, within: &Range<usize>) -> impl Iterator<Item = (usize, &Part)> {
        let within = within.clone();
        (1..self.unions.len()).rev().filter_map(move |level| {
            let many = 1 << level;
            let first = if forwards { at } else { at.checked_sub(many)? };
            let fits = first % many == 0 && first >= within.start && first + many <= within.end;
            let part = self.unions[level].get(first / many)?.as_ref()?;
            fits.then_some((many, part))
        })
    }

    fn add(&mut self, curve: &impl Charged, piece: usize, [from, to]: [f64; 2], before: f64, halvings: usize) {
        let at = |x: f64| {
            let r = curve.at(piece, x);
            Spot { u: r.u, z: r.z, du: r.du, dz: r.dz, charge: if r.u > 0.0 { r.charge / r.u } else { 0.0 } }
        };
        let axis = [from, to].into_iter().find(|&x| (x == 0.0 || x == 1.0) && at(x).u < AXIS * self.size);
        let part = Part::new(at, piece, [from, to], axis, [self.size, self.most]);
        let missing = part.missing;
        let falls = missing < 0.1 * before || missing > NOISE;
        if missing > RESOLVED && halvings < HALVINGS && falls {
            let middle = 0.5 * (from + to);
            self.add(curve, piece, [from, middle], missing, halvings + 1);
            self.add(curve, piece, [middle, to], missing, halvings + 1);
            return;
        }
        self.rough = if missing > self.rough || missing.is_nan() { missing } else { self.rough };
        self.parts.push(Part { missing: 0.0, ..part });
    }

    /// The error of a field that comes from what the polynomials miss.
    pub fn missing(&self) -> f64 {
        ROUGH * self.rough * self.most
    }

    /// The surface at `x` of a piece.
    pub fn at(&self, piece: usize, x: f64) -> Spot {
        let after = self.parts.partition_point(|p| (p.piece, p.from) <= (piece, x));
        self.parts.get(after.saturating_sub(1)).map_or(Spot::default(), |part| part.at(x))
    }
}

/// Extent of a meridian, largest absolute charge density and least and greatest axial position, from one ring within each stretch and both ends.
fn extent(curve: &impl Charged) -> (f64, f64, [f64; 2]) {
    let (mut low, mut high, mut wide, mut most) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64, 0.0_f64);
    let mut see = |ring: Ring| {
        (low, high, wide) = (low.min(ring.z), high.max(ring.z), wide.max(ring.u));
        let area = ring.u * ring.du.hypot(ring.dz);
        if area > 0.0 {
            most = most.max((ring.charge / area).abs());
        }
    };
    for piece in 0..curve.pieces() {
        let breaks = curve.breaks(piece);
        breaks.windows(2).for_each(|w| see(curve.at(piece, 0.5 * (w[0] + w[1]))));
        for x in breaks.iter().take(1).chain(breaks.last()) {
            see(curve.at(piece, *x));
        }
    }
    (wide.max(0.5 * (high - low)), most, [low, high])
}

/// Angle of a Chebyshev node.
fn angle(j: usize) -> f64 {
    PI * (j as f64 + 0.5) / COEFFICIENTS as f64
}

/// Rows: the Chebyshev coefficients of a function given at the nodes.
static TRANSFORM: LazyLock<[[f64; COEFFICIENTS]; COEFFICIENTS]> = LazyLock::new(|| {
    let by = |m: usize| if m == 0 { 1.0 } else { 2.0 } / COEFFICIENTS as f64;
    array::from_fn(|m| array::from_fn(|j| by(m) * (m as f64 * angle(j)).cos()))
});

impl Part {
    /// The polynomials through the Chebyshev nodes of a stretch of a surface of extent `size` and largest charge density `most`.
    fn new(
        at: impl Fn(f64) -> Spot,
        piece: usize,
        [from, to]: [f64; 2],
        axis: Option<f64>,
        [size, most]: [f64; 2],
    ) -> Self {
        const N: usize = COEFFICIENTS;
        let mut values = [[0.0; N]; 5];
        for j in 0..N {
            // From the nearer end, where distances count.
            let half = 0.5 * angle(j);
            let x =
                if j < N / 2 { to - (to - from) * half.sin().powi(2) } else { from + (to - from) * half.cos().powi(2) };
            let r = at(x);
            let over = axis.map_or(1.0, |axis| (x - axis).abs());
            [r.u / over, r.z, r.du, r.dz, r.charge].into_iter().enumerate().for_each(|(c, v)| values[c][j] = v);
        }
        let mut coefficients = [[0.0; N]; 5];
        for (row, v) in coefficients.iter_mut().zip(&values) {
            row.iter_mut().zip(TRANSFORM.iter()).for_each(|(c, weights)| *c = dot(weights, v));
        }
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |a, b| if b.abs() > a || b.is_nan() { b.abs() } else { a });
        let speed = largest(&values[2]).max(largest(&values[3]));
        let scales = [if axis.is_some() { size / (to - from) } else { size }, size, speed, speed, most * speed];
        let missing = coefficients.iter().zip(scales).fold(0.0_f64, |a, (row, scale)| {
            let miss = largest(&row[N - 3..]) / scale.max(f64::MIN_POSITIVE);
            if miss > a || miss.is_nan() { miss } else { a }
        });
        let mut part = Part { piece, from, to, axis, missing, coefficients, marks: Default::default(), ways: vec![] };
        part.marks = [from, 0.5 * (from + to), to].map(|x| part.at(x));
        let way = |rule: &Rule, a, b| Way::new(part.nodes(&rule.x, a, b), rule, to - from);
        let ways = RULES.plain.iter().map(|rule| [way(rule, from, to), way(rule, to, from)]).collect();
        part.ways = ways;
        part
    }

    /// Which of its two ways leads from `from` to `to`, if one does.
    pub fn way(&self, from: f64, to: f64) -> Option<usize> {
        [[self.from, self.to], [self.to, self.from]].iter().position(|ends| *ends == [from, to])
    }

    /// The surface at `x`.
    pub fn at(&self, x: f64) -> Spot {
        let Nodes(v) = self.nodes(&[0.0; 4], x, x);
        Spot { u: v[0][0], z: v[1][0], du: v[2][0], dz: v[3][0], charge: v[4][0] }
    }

    /// The surface at the places `x` (parts of the way, multiples of four) between `from` and `to`; derivatives by the way.
    pub fn nodes(&self, x: &[f64], from: f64, to: f64) -> Nodes {
        let mut out = [[0.0; NODES]; 5];
        let width = self.to - self.from;
        // Twice the variable of the polynomials, and the distance from the axis.
        let (first, slope) = (2.0 * ((from - self.from) - (self.to - from)) / width, 4.0 * (to - from) / width);
        for (block, x) in x.chunks_exact(4).enumerate() {
            let at = 4 * block;
            let t = [0, 1, 2, 3].map(|l| first + slope * x[l]);
            for (c, row) in self.coefficients.iter().enumerate() {
                let (mut b1, mut b2) = ([0.0; 4], [0.0; 4]);
                for a in row[1..].iter().rev() {
                    for l in 0..4 {
                        (b1[l], b2[l]) = (a + t[l] * b1[l] - b2[l], b1[l]);
                    }
                }
                for l in 0..4 {
                    out[c][at + l] = row[0] + 0.5 * t[l] * b1[l] - b2[l];
                }
            }
        }
        if let Some(axis) = self.axis {
            let (first, slope) = ((from - axis).abs(), if axis > 0.5 { from - to } else { to - from });
            out[0].iter_mut().zip(x).for_each(|(u, x)| *u *= first + slope * x);
        }
        if to < from {
            out[2..4].iter_mut().flatten().for_each(|v| *v = -*v);
        }
        Nodes(out)
    }
}
