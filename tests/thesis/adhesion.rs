//! Chapter 6: a charged membrane on a charged plane.

use crate::page::{Chapter, Entry, claim, digits, input, list, numbers, reading};
use crate::solve::{Branch, Case, State};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Places where exponents are taken: ln(k a).
const PLACES: [f64; 3] = [1.16, 1.40, 2.6];
/// Charges of the base case.
const CHARGES: [f64; 6] = [0.1, 30.0, 36.0, 48.0, 50.0, 60.0];
/// Contact radii of the base case.
const RADII: [f64; 4] = [0.30, 0.39, 0.46, 0.60];

/// What chapter 6 is computed for.
#[derive(Clone, Copy)]
pub struct Charged {
    /// Inflation of the base case, 1.2 in the thesis.
    pub r0: f64,
}

/// A set of parameters: inflation, inverse Debye length.
type Set = (f64, f64);

enum Job {
    /// The base case at given charges.
    Charges,
    /// A set at the places for exponents, the base case at given contact radii as well.
    Places(Set),
    /// A set at the charge 50.
    Fifty(Set),
}

impl Charged {
    fn case(&self, (r0, k): Set) -> Case {
        // Four digits are printed at most.
        Case::of("electrostatic").set("r0", r0).set("k", k).set("accuracy", 1e-5)
    }

    fn solve(&self, job: &Job) -> Branch {
        let base = (self.r0, 100.0);
        match *job {
            Job::Charges => self.case(base).through("sigma_hat", &CHARGES).branch(),
            Job::Places(set) => {
                let mut a: Vec<f64> = PLACES.iter().map(|l| l.exp() / set.1).collect();
                if set == base {
                    a.extend(RADII);
                }
                self.case(set).through("a", &a).branch()
            }
            Job::Fifty(set) => self.case(set).through("sigma_hat", &[50.0]).branch(),
        }
    }

    pub fn chapter(&self) -> Chapter {
        let r0 = self.r0;
        let sets = [(r0, 10.0), (r0, 100.0), (r0, 1000.0), (1.4, 100.0), (1.6, 100.0), (2.0, 100.0)];
        // The long ones first.
        let mut jobs: Vec<Job> = sets.into_iter().map(Job::Places).collect();
        jobs.push(Job::Charges);
        jobs.extend(sets[2..].iter().copied().map(Job::Fifty));
        let mut branches: Vec<Branch> = jobs.par_iter().with_max_len(1).map(|job| self.solve(job)).collect();
        let fifty: Vec<State> = branches.split_off(7).into_iter().map(|b| b.states[0].clone()).collect();
        let charges = branches.remove(6).states;
        let radii = branches[1].states.split_off(PLACES.len());
        let found = Found { r0, charges, radii, places: branches, fifty };
        let mut entries = vec![];
        parameters(&mut entries);
        forces(&found, &mut entries);
        shapes(&found, &mut entries);
        exponents(&found, &mut entries);
        Chapter {
            title: "Chapter 6: adhesion by electrostatic attraction",
            about: "Normalisation (A-1): F/(G R), a/R, C = sigma_0^2 R/(4 pi eps_0 eps G) = 0.05, H/R = 0.001; contact is phi > phi_c. The \
                    base case is r0 = 1.2, k R = 100. Exponents are d ln F/d ln a from the exact derivatives along the branch. No state has \
                    more force than all its charge would feel at the gap, F/(G R) <= 8 pi^2 C sigma_hat exp(-k H).",
            entries,
        }
    }
}

/// Everything that is solved for the chapter.
struct Found {
    r0: f64,
    charges: Vec<State>,
    radii: Vec<State>,
    places: Vec<Branch>,
    /// k = 1000, then r0 = 1.4, 1.6, 2.0.
    fifty: Vec<State>,
}

impl Found {
    fn charge(&self, sigma_hat: f64) -> &State {
        &self.charges[CHARGES.iter().position(|&c| c == sigma_hat).expect("a charge of the list")]
    }

    fn radius(&self, a: f64) -> &State {
        &self.radii[RADII.iter().position(|&c| c == a).expect("a radius of the list")]
    }
}

fn exponent(state: &State) -> f64 {
    state.exponent("force", "a")
}

fn parameters(entries: &mut Vec<Entry>) {
    // SI: C/m^2, m, F/m, N/m.
    let (charge, radius, permittivity, modulus) = (0.022_f64, 1e-6, 80.0 * 8.8541878128e-12, 1.0);
    let group = charge * charge * radius / (4.0 * PI * permittivity * modulus);
    entries.extend([
        input("55", "6.4 p. 153", "radius assumed", "1 micron"),
        input("56", "6.4 p. 153", "contact gap; H/R used", "a few angstrom to 1 nm; 0.001"),
        input("57", "6.4 p. 153", "charge density of the membrane; dielectric constant", "0.022 C/m^2; 80"),
        input("58", "6.4 p. 153", "modulus; thickness; G", "100 MPa; 10 nm; 1 N/m"),
        numbers(
            "59",
            "6.4 p. 153",
            "sigma_0^2 R/(4 pi eps_0 eps G) from these",
            "0.05",
            vec![reading("", [group])],
            "0.05 is used.",
        ),
        input("60", "6.4 p. 153", "Debye lengths; k R", "1 .. 100 nm; 10 .. 1000"),
        input("61", "6.4 p. 153", "sigma_hat; inflations", "0.1 .. 60; 1.2 .. 2.0"),
        input("62", "6.4, fig. 6.4", "r0; k R; sigma_hat", "1.2; 100; 0.1, 30, 60"),
    ]);
}

fn forces(found: &Found, entries: &mut Vec<Entry>) {
    let slope = |c: f64| found.charge(c).derivative("force", "sigma_hat");
    let growth = [slope(48.0) / slope(36.0) - 1.0, slope(60.0) / slope(48.0) - 1.0];
    entries.push(claim(
        "63",
        "6.4, fig. 6.5a",
        "F nearly linear in sigma_hat beyond",
        "48",
        format!(
            "dF/d sigma_hat grows by {} % from 36 to 48, by {} % from 48 to 60; d ln F/d ln sigma_hat = {} at 48",
            digits(100.0 * growth[0], 2),
            digits(100.0 * growth[1], 2),
            digits(found.charge(48.0).exponent("force", "sigma_hat"), 3)
        ),
        growth[1] < 0.05,
        "Rule: linear means that the slope grows by less than 5 %. The coupling does not weaken.",
    ));
    let steep: Vec<f64> = RADII.iter().map(|&a| exponent(found.radius(a))).collect();
    entries.push(claim(
        "64",
        "6.4, fig. 6.5b",
        "contact radius a/R from which F rises steeply",
        "0.39",
        format!("d ln F/d ln a = {} at a/R = {}", list(steep.iter().copied(), 3), list(RADII, 2)),
        steep[2] - steep[0] > 1.0,
        "Rule: steeper means that the exponent is larger by 1 at 0.46 than at 0.30. It changes slowly; nothing happens at 0.39.",
    ));
    let at = |states: [&State; 2], factor: f64| states.map(|s| factor * s.get("force"));
    let (ends, top) = ([found.radius(0.39), found.radius(0.46)], [found.charge(48.0), found.charge(60.0)]);
    entries.push(numbers(
        "65",
        "6.4",
        "F/(G R) while a/R goes from 0.39 to 0.46",
        "2.66e5 8.89e5",
        vec![
            reading("F/(G R)", at(ends, 1.0)),
            reading("F/(G R), sigma_hat 48 and 60", at(top, 1.0)),
            reading("(3/4) F (k R)^3/(G R)", at(ends, 0.75e6)),
            reading("(3/4) F (k R)^3/(G R), sigma_hat 48 and 60", at(top, 0.75e6)),
        ],
        "The printed numbers are impossible, see the next line. No factor helps: they have another ratio.",
    ));
    let bound = |s: &State| 8.0 * PI * PI * 0.05 * s.get("sigma_hat") * (-0.1_f64).exp();
    let last = found.charge(60.0);
    entries.push(claim(
        "65",
        "6.4",
        "the bound F/(G R) <= 8 pi^2 C sigma_hat exp(-k H), all charge at the gap",
        "8.89e5",
        format!(
            "bound {} at sigma_hat = 60, F/(G R) there {}; the printed number is {} times the bound",
            digits(bound(last), 4),
            digits(last.get("force"), 4),
            digits(8.89e5 / bound(last), 2)
        ),
        8.89e5 <= bound(last),
        "A membrane of this charge cannot be pulled with the printed force, however it is deformed.",
    ));
    let rise = |states: [&State; 2], name: &str| 100.0 * (states[1].get(name) / states[0].get(name) - 1.0);
    entries.push(numbers(
        "65",
        "6.4",
        "increase of F in per cent",
        "234.13",
        vec![reading("a/R 0.39 to 0.46", [rise(ends, "force")]), reading("sigma_hat 48 to 60", [rise(top, "force")])],
        "",
    ));
    let both = |states: [&State; 2], factor: f64| states.map(|s| factor * s.get("a"));
    entries.push(numbers(
        "66",
        "6.4",
        "a/R at the end of the range, sigma_hat 48 and 60",
        "0.39 0.46",
        vec![reading("a/R", both(top, 1.0)), reading("a/r0", both(top, 1.0 / found.r0))],
        "The charges are those of row 63 and of the end of the range; with the printed forces no state exists.",
    ));
    entries.push(numbers(
        "66",
        "6.4",
        "increase of a in per cent",
        "18.56",
        vec![reading("sigma_hat 48 to 60", [rise(top, "a")])],
        "0.46/0.39 is 17.9 %.",
    ));
}

fn shapes(found: &Found, entries: &mut Vec<Entry>) {
    let base = found.charge(0.1);
    let stretch = base.get("lambda_i");
    entries.push(numbers(
        "67",
        "6.4, fig. 6.6a",
        "initial sigma/sigma_0 at r0 = 1.2",
        "0.69",
        vec![reading("", [1.0 / (stretch * stretch)])],
        "",
    ));
    let angles = [0.1, 30.0, 60.0].map(|c| found.charge(c).get("phi_c") / PI);
    entries.push(numbers(
        "68",
        "6.4, fig. 6.6a",
        "phi_c/pi for sigma_hat = 0.1, 30, 60",
        "0.98 0.74 0.65",
        vec![reading("", angles)],
        "",
    ));
    // What lies on the plane has the reference area 2 pi (1 + cos phi_c); where both tensions pull, areas are not smaller.
    let least = |phi: f64| (2.0 * (1.0 + phi.cos())).sqrt();
    let end = found.charge(60.0);
    entries.push(claim(
        "68",
        "6.4",
        "a/R and phi_c/pi together at sigma_hat = 60",
        "0.46 (the largest printed), 0.65",
        format!(
            "a/R >= {} is needed for 0.65; converged: a/R = {}, needed {}",
            digits(least(0.65 * PI), 3),
            digits(end.get("a"), 4),
            digits(least(end.get("phi_c")), 4)
        ),
        0.46 >= least(0.65 * PI),
        "w_l, w_m >= 0 of a neo-Hookean membrane imply lambda mu >= 1, so the contact cannot be smaller than its reference area: \
         a^2 >= 2 (1 + cos phi_c) R^2. The printed pair is a contact under compression.",
    ));
    entries.push(numbers(
        "69",
        "6.4, fig. 6.6b, c",
        "lambda_i; P_i/G at r0 = 1.2",
        "1.2 0.80",
        vec![reading("", [stretch, base.get("P_i")])],
        "",
    ));
    let zone = |c: f64| {
        let rows = found.charge(c).rows(|s| s == "contact_plane");
        let all = || rows.iter().flat_map(|r| [r.lambda, r.mu]);
        (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max))
    };
    let (thirty, sixty) = (zone(30.0), zone(60.0));
    entries.push(claim(
        "70",
        "6.4, fig. 6.6b",
        "stretches over lambda_i in the contact zone, sigma_hat 30, 60",
        "mostly below one",
        format!(
            "{} to {} (30), {} to {} (60); the stretches themselves are at least {}",
            digits(thirty.0 / stretch, 4),
            digits(thirty.1 / stretch, 4),
            digits(sixty.0 / stretch, 4),
            digits(sixty.1 / stretch, 4),
            digits(sixty.0.min(thirty.0), 3)
        ),
        thirty.1 < stretch && sixty.1 < stretch,
        "Below one relative to the inflated state only. The text calls it surface compression; the membrane stays stretched.",
    ));
    entries.push(input("71", "6.4, fig. 6.7a", "sigma_hat; k R; r0", "50; 100; 1.2, 1.4, 1.6, 2.0"));
    let relative: Vec<f64> = std::iter::once(found.charge(50.0).get("a") / found.r0)
        .chain(found.fifty[1..].iter().zip([1.4, 1.6, 2.0]).map(|(s, r0)| s.get("a") / r0))
        .collect();
    entries.push(claim(
        "-",
        "6.4, fig. 6.7a",
        "relative deformation at sigma_hat 50",
        "falls with inflation",
        format!("a/r0 = {} for r0 = 1.2, 1.4, 1.6, 2.0", list(relative.iter().copied(), 4)),
        relative.windows(2).all(|w| w[1] < w[0]),
        "",
    ));
    entries.push(input("72", "6.4, fig. 6.7b", "r0; sigma_hat; k R; 1/(k R)", "1.2; 50; 10, 100, 1000; 0.001 .. 0.1"));
    let long = &found.places[0];
    let at_end = long.states.last().expect("a state at k = 10");
    entries.push(claim(
        "-",
        "6.4, fig. 6.7b",
        "contact at sigma_hat 50",
        "grows with the Debye length",
        format!(
            "a/R = {} (k R = 1000), {} (100), already {} at sigma_hat = {} (10)",
            digits(found.fifty[0].get("a"), 4),
            digits(found.charge(50.0).get("a"), 4),
            digits(at_end.get("a"), 4),
            digits(at_end.get("sigma_hat"), 3)
        ),
        found.fifty[0].get("a") < found.charge(50.0).get("a") && found.charge(50.0).get("a") < at_end.get("a"),
        "",
    ));
    let compressed = long.event("wrinkling", "least tension");
    entries.push(claim(
        "-",
        "6.4, fig. 6.7b",
        "k R = 10, sigma_hat 50: a membrane under tension",
        "w_l, w_m >= 0 (its own condition)",
        match compressed {
            Some(s) => format!(
                "the contact is compressed from sigma_hat = {} on, a/R = {}",
                digits(s.get("sigma_hat"), 4),
                digits(s.get("a"), 4)
            ),
            None => "nowhere compressed".into(),
        },
        compressed.is_none_or(|s| s.get("sigma_hat") > 50.0),
        "Beyond, a plain membrane solution is not physical.",
    ));
}

fn exponents(found: &Found, entries: &mut Vec<Entry>) {
    let hertz = |a: f64| 4.0 / 3.0 * a.powi(3);
    entries.push(numbers(
        "73",
        "6.4 p. 163, (6.29)",
        "slope of Hertz's line",
        "3",
        vec![reading("", [(hertz(2.0) / hertz(1.0)).ln() / 2.0_f64.ln()])],
        "By definition; Hertz's law is that of solids, not of membranes.",
    ));
    entries.push(input("74", "6.4 pp. 163-164, fig. 6.8", "sigma_hat varied", "0.1 .. 50"));
    let names = "(r0, k R) = (1.2, 10), (1.2, 100), (1.2, 1000), (1.4, 100), (1.6, 100), (2.0, 100)";
    let slopes: Vec<Vec<f64>> = found.places.iter().map(|b| b.states.iter().map(exponent).collect()).collect();
    let column = |i: usize| slopes.iter().map(move |s| s[i]);
    let charges: Vec<f64> = found.places.iter().map(|b| b.states[0].get("sigma_hat")).collect();
    entries.push(claim(
        "75",
        "6.4 p. 164",
        "slopes for ln(k a) between 1.16 and 1.4, all sets",
        "2.9 .. 3.2",
        format!(
            "{} at 1.16, {} at 1.4, for {names}; sigma_hat at 1.16: {}",
            list(column(0), 3),
            list(column(1), 3),
            list(charges, 2)
        ),
        column(0).chain(column(1)).all(|n| (2.9..=3.2).contains(&n)),
        "At k R = 1000 that range lies below sigma_hat = 0.1.",
    ));
    let high: Vec<f64> = std::iter::once(found.charge(50.0)).chain(&found.fifty).map(exponent).collect();
    entries.push(claim(
        "76",
        "6.4 p. 164",
        "slope for ln(k a) above 2.6, all curves parallel",
        "about 5",
        format!(
            "{} at 2.6, same sets; {} at sigma_hat 50, (1.2, 100), (1.2, 1000), (1.4, 100), (1.6, 100), (2.0, 100)",
            list(column(2), 3),
            list(high.iter().copied(), 3)
        ),
        column(2).chain(high.iter().copied()).all(|n| (4.5..=5.5).contains(&n)),
        "Rule: about 5 means 4.5 to 5.5. The slope rises slowly along every curve. At k R = 10 the state is under compression.",
    ));
    let ends = [exponent(found.charge(0.1)), exponent(found.charge(60.0))];
    entries.push(claim(
        "77",
        "6.5 p. 166",
        "exponent n of F ~ a^n, small and very large deformation",
        "3, approximately 5",
        format!("{} at sigma_hat 0.1, {} at 60 (base case)", digits(ends[0], 3), digits(ends[1], 3)),
        (ends[0] - 3.0).abs() < 0.3 && (ends[1] - 5.0).abs() < 0.5,
        "Rule: within 10 %.",
    ));
    entries.push(input("78", "6.5 p. 166", "G; inflations of the results", "1 N/m; above 1.2"));
}
