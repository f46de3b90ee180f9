//! Field and potential of a charged surface of revolution with screened Coulomb (Yukawa) interaction.
//!
//! With l = |x - x'| and the charge dq' of the surface elements,
//!
//!   E(x) = PV int (1 + k l) exp(-k l)/l^3 (x - x') dq',   Phi(x) = int exp(-k l)/l dq'.
//!
//! Units: lengths in any unit, the decay rate `k` in its inverse, charges in any unit; E is a charge per length squared, Phi a
//! charge per length (multiply by 1/(4 pi eps0 eps) for SI units). On a sphere of radius r with sigma per area, x = k r,
//!
//!   E_n = 2 pi sigma/x (1 - (1 + x) exp(-2 x)),   Phi = 2 pi sigma r/x (1 - exp(-2 x)).
//!
//! On the surface E is the principal value, the mean of the values on both sides, which differ by 4 pi sigma n. For k much larger
//! than the curvature it is a remainder of order curvature/k of parts of order one that cancel.
//!
//! Limits: the meridian must have a continuous tangent and a continuous charge per area (else the principal value does not exist;
//! the error then contains a jump at the target) and du/dx, dz/dx must not both vanish at a target. Next to the axis charge/u must
//! be accurate to rounding: it is the density, and the error does not know what it lacks. Sheets closer to each other than 1e-7 of
//! the extent lose digits, and the error says so. The error is that of the integral over the surface as it is given: a slope that
//! jumps by delta at a break moves E there by about 2 sigma delta ln(1/(k s)), s the distance of the break, and does not show.

mod bessel;
mod meridian;
mod ring;
mod rules;
mod sheet;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use meridian::{Scale, Side, Stretch, Walk};
pub use sheet::Sheet;
use sheet::{Part, Spot, norm};

/// One ring of the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ring {
    /// Radius.
    pub u: f64,
    /// Axial position, upwards as the axial field.
    pub z: f64,
    /// Derivative of the radius by x.
    pub du: f64,
    /// Derivative of the axial position by x.
    pub dz: f64,
    /// Charge per unit x and radian.
    pub charge: f64,
}

/// A charged surface of revolution: pieces that follow each other along the meridian from axis to axis, each with its own x in
/// [0, 1].
pub trait Charged {
    /// Number of pieces.
    fn pieces(&self) -> usize;
    /// Where the representation of a piece (a piecewise polynomial) changes, 0 and 1 included, ascending.
    fn breaks(&self, piece: usize) -> &[f64];
    /// The ring at `x` of a piece.
    fn at(&self, piece: usize, x: f64) -> Ring;
}

/// Field and potential at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Radial component of E.
    pub radial: f64,
    /// Axial component of E.
    pub axial: f64,
    /// Phi.
    pub potential: f64,
    /// Estimate from above of the errors of both components of E; error/k is one for the potential.
    pub error: f64,
}

/// Distance from a break, and k times distance from the axis, below which a target is moved there.
const SNAP: f64 = 1e-15;
const AXIS: f64 = 1e-11;
/// Distance from the axis, as part of the extent and times k, below which the field is interpolated, since rounded radii spoil it.
/// It has to be short against all features of the meridian, such as a first small contact at the pole.
const POLAR: [f64; 2] = [1e-7, 0.02];
/// Part of the largest charge density that sets the accuracy where there is hardly any charge.
const FAINT: f64 = 0.01;

/// Field at the point `x` of a piece of the surface, as a principal value.
pub fn on_surface(sheet: &Sheet, k: f64, piece: usize, x: f64) -> Field {
    let size = sheet.size;
    let rate = k.max(1.0 / size);
    let u = sheet.at(piece, x).u;
    let polar = (POLAR[0] * size).min(POLAR[1] / rate);
    let direct = |x: f64| principal(sheet, k, (piece, x));
    if u * rate < AXIS || u > polar {
        return direct(x);
    }
    // near the pole: even and odd polynomials in u through the axis and two other points
    let end = x.round();
    let axis = sheet.at(piece, end);
    let step = (0.5 - end).signum() * polar / axis.speed();
    if !(2.0 * step.abs() < 0.5 && axis.u * rate < AXIS) {
        return direct(x);
    }
    let points = [end, end + step, end + 2.0 * step];
    let [u1, u2] = [points[1], points[2]].map(|x| sheet.at(piece, x).u);
    let [f0, f1, f2] = points.map(direct);
    let (s, s1, s2) = (u * u, u1 * u1, u2 * u2);
    let blend = |a: f64, b: f64| (a * (s2 - s) + b * (s - s1)) / (s2 - s1);
    let slopes = |f: fn(&Field) -> f64| [(f(&f1) - f(&f0)) / s1, (f(&f2) - f(&f0)) / s2];
    let even = |f: fn(&Field) -> f64| f(&f0) + s * blend(slopes(f)[0], slopes(f)[1]);
    // what the last terms contribute is more than what the next ones would
    let (odd, bend) = ([f1.radial / u1, f2.radial / u2], slopes(|f| f.axial));
    let missing = u * (odd[1] - odd[0]).abs() + s * (bend[1] - bend[0]).abs();
    Field {
        radial: u * blend(odd[0], odd[1]),
        axial: even(|f| f.axial),
        potential: even(|f| f.potential),
        error: f0.error + (u / u1).min(1.0) * f1.error.max(f2.error) + missing,
    }
}

/// Field at the place (piece, x) from the sources themselves.
fn principal(sheet: &Sheet, k: f64, (piece, x): (usize, f64)) -> Field {
    let (size, parts) = (sheet.size, &sheet.parts);
    let mut here = sheet.at(piece, x);
    let axis = here.u * k.max(1.0 / size) < AXIS;
    // The parts before and after the target, and the one that it is on.
    let on = |p: &Part| p.piece == piece && p.from < x - SNAP && p.to > x + SNAP;
    let count = parts.partition_point(|p| (p.piece, p.to) <= (piece, x + SNAP));
    let own = parts.get(count).filter(|p| on(p)).map(|_| count);
    let whole = |part: usize, forwards: bool| {
        let p = &parts[part];
        let [from, to] = if forwards { [p.from, p.to] } else { [p.to, p.from] };
        Stretch { part, from, to }
    };
    let mut before = Side { first: None, beyond: 0..count, forwards: false };
    let mut after = Side { first: None, beyond: count..parts.len(), forwards: true };
    if let Some(part) = own {
        before.first = Some(Stretch { part, from: x, to: parts[part].from });
        after.first = Some(Stretch { part, from: x, to: parts[part].to });
        after.beyond.start += 1;
    } else {
        if count > 0 {
            before.first = Some(whole(count - 1, false));
            before.beyond.end -= 1;
        }
        if count < parts.len() {
            after.first = Some(whole(count, true));
            after.beyond.start += 1;
        }
    }
    if axis {
        // the target is the pole: one side only
        let (lost, kept, end) = if x < 0.5 { (&mut before, &mut after, 0.0) } else { (&mut after, &mut before, 1.0) };
        if let (Some(s), Some(_)) = (&mut kept.first, &lost.first) {
            s.from = end;
        }
        (lost.first, lost.beyond) = (None, 0..0);
    }
    let shift = if axis { here.u } else { 0.0 };
    if axis {
        here = Spot { u: 0.0, ..sheet.at(piece, x.round()) };
    }
    let own = |side: &Side| side.first.map_or(0.0, |s| parts[s.part].at(s.from).density());
    let local = here.density();
    let scale = Scale { density: local.abs().max(FAINT * sheet.most), size, field: (1.0 / (k * size)).min(1.0) };
    let mut walk = Walk::new(sheet, k, [here.u, here.z], 0.0, &scale);
    let reach = (meridian::FIRST / k).min(0.5 * size).min(if axis { f64::INFINITY } else { 0.7 * here.u });
    let mut jump = [0.0; 2];
    if axis {
        // a meridian that is not level at the axis is a cone
        jump[1] = PI * local * here.dz / here.speed();
    }
    for side in [&before, &after] {
        let pole = walk.side(side, reach, if axis { 0.0 } else { own(side) });
        jump = [jump[0] + pole[0], jump[1] + pole[1]];
    }
    let rounding = DIGITS + if axis { 0.0 } else { 0.5 * f64::EPSILON * size / here.u };
    let missing = JUMP * norm(jump[0], jump[1]) + rounding * local.abs() + sheet.missing();
    let mut field = walk.field(missing, 0.0);
    field.error += 2.0 * shift * k.max(1.0 / size) * field.axial.abs();
    field
}

/// Error per jump of 2 sigma t.
const JUMP: f64 = 5.0;
/// Rounding error per charge density at the target, to which a radius that is rounded adds.
const DIGITS: f64 = 1e-12;

/// Rounding error of a position, relative to the extent.
const PLACE: f64 = 2.0 * f64::EPSILON;

/// Field at a point off the surface, which may be as near to it as 1e-4 of its extent and nearer.
pub fn near(sheet: &Sheet, k: f64, u: f64, z: f64) -> Field {
    let size = sheet.size;
    let (nearest, spot) = nearest(sheet, [u, z]);
    let scale = Scale { density: spot.density().abs().max(FAINT * sheet.most), size, field: (-k * nearest).exp() };
    let mut walk = Walk::new(sheet, k, [u, z], nearest, &scale);
    walk.beyond(&(0..sheet.parts.len()), true, f64::INFINITY);
    walk.field(sheet.missing(), PLACE * (size / nearest + 2.0 * k * (size + nearest)))
}

/// Distance of a point from the meridian, and what is there (both approximate, the distance from above).
fn nearest(sheet: &Sheet, [u, z]: [f64; 2]) -> (f64, Spot) {
    const POINTS: usize = 8;
    let distance = |part: usize, x: f64| {
        let spot = sheet.parts[part].at(x);
        (norm(spot.u - u, spot.z - z), spot)
    };
    let mut best = (f64::INFINITY, Spot::default());
    let mut place = None;
    for (part, p) in sheet.parts.iter().enumerate() {
        for i in 0..POINTS {
            let x = p.from + (p.to - p.from) * (i as f64 + 0.5) / POINTS as f64;
            let found = distance(part, x);
            if found.0 < best.0 {
                (best, place) = (found, Some((part, x)));
            }
        }
    }
    if let Some((part, mut x)) = place {
        let p = &sheet.parts[part];
        let mut width = (p.to - p.from) / POINTS as f64;
        for _ in 0..50 {
            for trial in [x - width, x + width] {
                let trial = trial.clamp(p.from, p.to);
                let found = distance(part, trial);
                if found.0 < best.0 {
                    (best, x) = (found, trial);
                }
            }
            width *= 0.6;
        }
    }
    best
}
