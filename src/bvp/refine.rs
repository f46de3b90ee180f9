//! Meshes: how many intervals, and where.

use super::{Discretization, Estimate};

/// A mesh of `intervals` equal intervals.
pub fn uniform(intervals: usize) -> Vec<f64> {
    (0..=intervals).map(|i| i as f64 / intervals as f64).collect()
}

/// The local error, of order h^(k+1), above which an interval is refined whatever it adds at its end: below it the error estimate
/// is to be trusted.
const TRUSTED: f64 = 1e-5;
/// An error that an interval adds at its end cannot be told from rounding below this.
const ROUNDING: f64 = 1e-16;

/// Meshes on which every interval adds about as much error, `factor` times less than the worst of the present ones (or more, for
/// a factor below 1), with at least `least` intervals on each segment.
///
/// An interval of width h adds an error of h^(2k+1) at its end, and its local error goes as h^(k+1); the number of pieces that
/// it should be cut in for either gives the density of the new mesh (Ascher, Christiansen and Russell, 1979). A floor keeps
/// neighbouring widths comparable.
pub fn equidistribute(disc: &Discretization, estimate: &Estimate, factor: f64, least: usize) -> Vec<Vec<f64>> {
    let k = disc.gauss.stages() as f64;
    let added = estimate.injected.iter().flatten().chain(estimate.unresolved.iter().flatten());
    let worst = added.fold(ROUNDING, |a: f64, b| a.max(*b));
    let wanted = (worst / factor).max(ROUNDING);
    (0..disc.meshes.len())
        .map(|s| {
            let pieces: Vec<f64> = (0..disc.intervals(s))
                .map(|i| {
                    let ends = (estimate.injected[s][i].max(ROUNDING) / wanted).powf(1.0 / (2.0 * k + 1.0));
                    let inside = (estimate.local[s][i] / TRUSTED).powf(1.0 / (k + 1.0));
                    // Where the data are singular a cut helps little, so many are made; where they are smooth, a join costs much.
                    let hidden = estimate.unresolved[s][i] / wanted;
                    let given = hidden.powf(if hidden > 1.0 { 0.5 } else { 1.0 / (k + 1.0) });
                    ends.max(inside).max(given).clamp(0.1, 8.0)
                })
                .collect();
            let count = (pieces.iter().sum::<f64>().ceil() as usize).max(least);
            let mut density: Vec<f64> = pieces.iter().enumerate().map(|(i, p)| p / disc.width(s, i)).collect();
            let floor = 0.05 * pieces.iter().sum::<f64>();
            density.iter_mut().for_each(|d| *d = d.max(floor));
            spread(&disc.meshes[s], &density, count)
        })
        .collect()
}

/// A mesh of `count` intervals that share the integral of a piecewise constant density evenly.
fn spread(old: &[f64], density: &[f64], count: usize) -> Vec<f64> {
    let width = |i: usize| old[i + 1] - old[i];
    let share = density.iter().enumerate().map(|(i, d)| d * width(i)).sum::<f64>() / count as f64;
    let mut mesh = vec![0.0];
    let (mut i, mut done) = (0, 0.0);
    for j in 1..count {
        let target = share * j as f64;
        while i + 1 < density.len() && done + density[i] * width(i) < target {
            done += density[i] * width(i);
            i += 1;
        }
        mesh.push(old[i] + (target - done) / density[i]);
    }
    mesh.push(1.0);
    mesh
}
