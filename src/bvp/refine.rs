//! Meshes: how many intervals, and where.

use super::{Discretization, Estimate};

/// A mesh of `intervals` equal intervals.
pub fn uniform(intervals: usize) -> Vec<f64> {
    (0..=intervals).map(|i| i as f64 / intervals as f64).collect()
}

/// Meshes on which the local error of `estimate` is spread evenly, with about `factor` times the present number of intervals in
/// all, and at least `least` on each segment.
///
/// The local error of an interval of width h goes as h^(k+1); its (k+1)-th root over h is the density to be equalised
/// (Ascher, Christiansen and Russell, 1979). A floor of a twentieth of the mean keeps neighbouring widths comparable.
pub fn equidistribute(disc: &Discretization, estimate: &Estimate, factor: f64, least: usize) -> Vec<Vec<f64>> {
    let power = 1.0 / (disc.gauss.stages() as f64 + 1.0);
    let densities: Vec<Vec<f64>> = estimate
        .local
        .iter()
        .enumerate()
        .map(|(s, sizes)| sizes.iter().enumerate().map(|(i, e)| e.max(1e-15).powf(power) / disc.width(s, i)).collect())
        .collect();
    let mass = |s: usize, d: &[f64]| d.iter().enumerate().map(|(i, d)| d * disc.width(s, i)).sum::<f64>();
    let masses: Vec<f64> = densities.iter().enumerate().map(|(s, d)| mass(s, d)).collect();
    let total: f64 = masses.iter().sum();
    let wanted = factor * disc.total_intervals() as f64;
    densities
        .into_iter()
        .enumerate()
        .map(|(s, mut density)| {
            let count = ((wanted * masses[s] / total).ceil() as usize).max(least);
            let floor = 0.05 * masses[s];
            density.iter_mut().for_each(|d| *d = d.max(floor));
            let share = mass(s, &density) / count as f64;
            let old = &disc.meshes[s];
            let mut mesh = vec![0.0];
            let (mut i, mut done) = (0, 0.0);
            for j in 1..count {
                let target = share * j as f64;
                while i + 1 < density.len() && done + density[i] * disc.width(s, i) < target {
                    done += density[i] * disc.width(s, i);
                    i += 1;
                }
                mesh.push(old[i] + (target - done) / density[i]);
            }
            mesh.push(1.0);
            mesh
        })
        .collect()
}
