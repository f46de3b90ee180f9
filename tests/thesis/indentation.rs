//! Chapters 3 and 4: cones and plates.

use crate::page::{Chapter, Entry, claim, digits, input, list, numbers, quoted, reading};
use crate::solve::{Case, Row, State};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Cone angles from the horizontal, in degrees.
const ANGLES: [f64; 5] = [0.0, 20.0, 40.0, 60.0, 80.0];

/// Something for each of these, on all processors.
fn each<T: Sync, R: Send>(of: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    of.par_iter().map(f).collect()
}

/// The value at phi of a field that is nearly a power of phi between mesh points, as it is under a tip.
fn at_phi(rows: &[Row], phi: f64, field: impl Fn(&Row) -> f64) -> f64 {
    let i = rows.partition_point(|row| row.phi < phi).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[i - 1], &rows[i]);
    let t = (phi.ln() - a.phi.ln()) / (b.phi.ln() - a.phi.ln());
    (field(a).ln() * (1.0 - t) + field(b).ln() * t).exp()
}

/// The place where a field that falls with phi has a value.
fn phi_at(rows: &[Row], value: f64, field: impl Fn(&Row) -> f64) -> f64 {
    let i = rows.partition_point(|row| field(row) > value).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[i - 1], &rows[i]);
    let t = (value.ln() - field(a).ln()) / (field(b).ln() - field(a).ln());
    (a.phi.ln() * (1.0 - t) + b.phi.ln() * t).exp()
}

/// Largest relative difference of the principal tensions.
fn difference(rows: &[Row]) -> f64 {
    rows.iter().map(|r| (r.w_l - r.w_m).abs() / r.w_l.max(r.w_m)).fold(0.0, f64::max)
}

/// True if the list does not fall anywhere.
fn rises(values: &[f64]) -> bool {
    values.windows(2).all(|w| w[1] >= w[0] * (1.0 - 1e-9))
}

pub fn chapter3() -> Chapter {
    let cones = |angle: f64| Case::of("two_cones").set("cone_angle", angle);
    let plates =
        |r0: f64| Case::of("flat_plates").set("r0", r0).output("P_0", "plate.start.w_l").output("P_e", "side.end.w_l");

    let flat = plates(2.0).state("hbar", 0.35);
    let rows = flat.rows(|_| true);
    let along: Vec<f64> = rows.iter().flat_map(|r| [r.w_l.min(r.w_m)]).collect();
    let (pole, equator) = (flat.get("P_0") / flat.get("P_i"), flat.get("P_e") / flat.get("P_i"));
    let mut entries = vec![
        input("1", "3.4 p. 55, fig. 3.2", "inflation r0/R; tip height hbar", "2; 0.35"),
        input("2", "3.4 pp. 56-60", "cone angles from the axis; inflation", "90, 70, 50, 30, 10 deg; r0 = 2"),
        input("3", "3.4 pp. 57-58", "indentation of figs. 3.6 to 3.8", "dbar = 0.65"),
        input("4", "3.4 p. 58", "inflations, flat indenter", "1.03, 1.5, 2.0"),
        claim(
            "-",
            "3.4 p. 57",
            "flat, dbar 0.65, r0 2: tension from pole to equator",
            "rises; lowest at the pole, largest at the equator",
            format!("P/P_i = {} at the pole, {} at the equator (w_l)", digits(pole, 4), digits(equator, 4)),
            rises(&along) && equator > pole,
            "Rule: the smaller principal tension nowhere falls from pole to equator.",
        ),
    ];

    let spread = each(&[1.03, 1.5, 2.0], |&r0| difference(&plates(r0).state("hbar", 0.35).rows(|_| true)));
    entries.push(claim(
        "-",
        "3.4 p. 58, fig. 3.7",
        "flat, dbar 0.65: the principal tensions are nearly equal for large inflation and differ for small",
        "r0 = 1.03, 1.5, 2.0",
        format!("largest relative difference {} %", list(spread.iter().map(|s| 100.0 * s), 2)),
        spread[2] < 0.05 && spread[0] > 0.05,
        "Rule: nearly equal means within 5 %.",
    ));

    let hbar: Vec<f64> = (1..=30).map(|i| 1.0 - 0.03 * f64::from(i)).collect();
    let poles: Vec<f64> =
        plates(2.0).through("hbar", &hbar).branch().states.iter().map(|s| s.get("P_0") / s.get("P_i")).collect();
    let lowest = (0..poles.len()).min_by(|&a, &b| poles[a].total_cmp(&poles[b])).unwrap();
    let until = &poles[..=20]; // dbar 0.63
    let change = until.iter().map(|p| (p - 1.0).abs()).fold(0.0, f64::max);
    entries.push(claim(
        "-",
        "3.4 p. 59, fig. 3.9",
        "flat, r0 2: pole tension",
        "approximately constant, rises only at the last stage",
        format!(
            "P_0/P_i = {} at dbar 0.03, 0.30, 0.63, 0.90; lowest, {}, at dbar {}",
            list([poles[0], poles[9], poles[20], poles[29]], 4),
            digits(poles[lowest], 4),
            digits(1.0 - hbar[lowest], 2)
        ),
        change < 0.05,
        "Rule: constant means within 5 % up to dbar 0.63. It falls first, then rises.",
    ));

    let dbar = [0.05, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95];
    let tips = each(&ANGLES[1..], |&angle| {
        let states = cones(angle).through("dbar", &dbar).branch().states;
        let c: Vec<f64> = states.iter().map(|s| s.get("tip_coefficient")).collect();
        let u: Vec<f64> = states.iter().map(|s| s.get("u_c")).collect();
        (c, rises(&u), states.iter().all(|s| s.is_infinite("cone.start.w_l")))
    });
    let ends = tips.iter().map(|t| format!("{} to {}", digits(t.0[0], 3), digits(t.0[6], 3))).collect::<Vec<_>>();
    entries.push(claim(
        "-",
        "3.4 p. 60, fig. 3.9",
        "cones, r0 2: pole tension",
        "rises, stays constant, even decreases at the end",
        format!(
            "infinite in every state; its coefficient C (w_l = G C phi^(cos alpha - 1)) from dbar 0.05 to 0.95, alpha 20, 40, 60, 80: {}",
            ends.join(", ")
        ),
        !tips.iter().all(|t| t.2),
        format!(
            "A sharp frictionless tip has no finite tension: a finite number is that of the first mesh point. From dbar 0.80 to 0.95 C {}.",
            if tips.iter().all(|t| rises(&t.0[5..])) { "rises for every angle" } else { "does not rise for every angle" }
        ),
    ));
    entries.push(claim(
        "-",
        "3.4 p. 57, fig. 3.5",
        "cones, r0 2: contact radius",
        "grows until the tips meet",
        "checked at dbar 0.05 to 0.95, alpha 20, 40, 60, 80",
        tips.iter().all(|t| t.1),
        "The flat plates cannot meet.",
    ));
    Chapter {
        title: "Chapter 3: between two cones",
        about: "Angles are given here from the horizontal, `cone_angle` = 90 deg - the thesis' angle. dbar = 1 - h/r0, h the tip's height above \
                the mid-plane. The chapter prints no result as a number; the lines without a row number are its claims in words.",
        entries,
    }
}

/// What chapter 4 is computed for.
#[derive(Clone, Copy)]
pub struct Cones {
    /// Inflation, 2.0 in the thesis.
    pub r0: f64,
    /// Height at which forces are given, 0.4 in the thesis.
    pub height: f64,
}

impl Cones {
    fn cone(&self, angle: f64) -> Case {
        Case::of("cone_on_flat").set("cone_angle", angle).set("r0", self.r0)
    }

    pub fn chapter(&self) -> Chapter {
        let mut entries = vec![input(
            "5",
            "4.4 pp. 78-79, fig. 4.2",
            "angles; height of the shapes; inflation",
            "0, 20, 40, 60, 80 deg; dbar = 0.50; r0 = 2",
        )];
        self.linear(&mut entries);
        self.forces(&mut entries);
        self.tensions(&mut entries);
        self.distributions(&mut entries);
        self.poles(&mut entries);
        self.equality(&mut entries);
        Chapter {
            title: "Chapter 4: cone on a flat support",
            about: "Angles from the horizontal, 0 = flat. dbar = tip to support over 2 r0, 1 at first contact. Text: fbar = F R/(G r0), \
                    pbar = p_f R/G.",
            entries,
        }
    }

    fn linear(&self, entries: &mut Vec<Entry>) {
        let start = self.cone(40.0).output("first", "initial.membrane.height/(2*r0)").state("dbar", 0.99);
        entries.push(numbers(
            "6",
            "4.4 p. 79",
            "height of first contact",
            "1.0",
            vec![reading("", [start.get("first")])],
            "By definition.",
        ));
        let places: Vec<(f64, f64)> = ANGLES.into_iter().zip([0.98, 0.96, 0.93, 0.78, 0.65]).collect();
        // F over the approach, whole against a tenth; the tangent stiffness, likewise; and the exponent at the end.
        let found = each(&places, |&(angle, end)| {
            let depth = 1.0 - end;
            let states = self.cone(angle).through("dbar", &[1.0 - 0.1 * depth, end]).branch().states;
            let (a, b) = (&states[0], &states[1]);
            let secant = b.get("force") / a.get("force") / 10.0 - 1.0;
            let tangent = b.derivative("force", "dbar") / a.derivative("force", "dbar") - 1.0;
            let exponent = -b.exponent("force", "dbar") * depth / end;
            (secant, tangent, exponent)
        });
        for (row, range, what, printed) in [
            ("7", 0..1, "flat: force linear down to dbar", "0.98"),
            ("8", 1..5, "alpha = 20, 40, 60, 80: force linear down to dbar", "0.96, 0.93, 0.78, 0.65"),
        ] {
            let found = &found[range];
            let percent = |of: fn(&(f64, f64, f64)) -> f64| list(found.iter().map(|f| 100.0 * of(f)), 2);
            entries.push(claim(
                row,
                "4.4 p. 79",
                what,
                printed,
                format!(
                    "from a tenth of that range to its end F/(1 - dbar) grows by {} %, dF/d dbar by {} %; \
                     d ln F/d ln(1 - dbar) = {} at the end",
                    percent(|f| f.0),
                    percent(|f| f.1),
                    list(found.iter().map(|f| f.2), 3)
                ),
                found.iter().all(|f| f.0.abs() < 0.1 || f.1.abs() < 0.1),
                "Rule: linear means that one of the two is constant within 10 %. Without bending F/(1 - dbar) tends to 0 at first contact, \
                 like 1/ln under a plate: nothing is linear there.",
            ));
        }
    }

    fn forces(&self, entries: &mut Vec<Entry>) {
        let Cones { r0, height } = *self;
        let low = each(&ANGLES, |&angle| self.cone(angle).state("dbar", height));
        let flat = &low[0];
        let f = flat.get("force");
        let part = |name: &str| -> Vec<f64> { low[1..].iter().map(|s| 100.0 * s.get(name) / flat.get(name)).collect() };
        entries.push(numbers(
            "9",
            "4.4 p. 80",
            "flat, dbar 0.4, r0 2: fbar",
            "4.74",
            vec![
                reading("F R/(G r0)", [f / r0]),
                reading("F/(G R)", [f]),
                reading("F R^2/(G r0^2)", [f / (r0 * r0)]),
                reading("F/(pi r0^2 p_f0)", [f / (PI * r0 * r0 * flat.get("p_f0"))]),
            ],
            "About half of what (4.23) gives.",
        ));
        entries.push(numbers(
            "10",
            "4.4 p. 80",
            "alpha = 20, 40, 60, 80: force in per cent of the flat one",
            "48.94 30.71 19.36 6.77",
            vec![reading("", part("force"))],
            "No normalisation enters. A start at a finite distance from the tip spoils the force like the power 2 cos(alpha) of that distance: most for the \
             sharpest cone.",
        ));
        let sharp = [20.0, 40.0, 60.0, 80.0, 85.0, 89.0];
        let falling = each(&sharp, |&angle| 100.0 * self.cone(angle).state("dbar", height).get("force") / f);
        entries.push(claim(
            "11",
            "4.4 p. 80",
            "force against sharpness, from flat (0) to a point load (90 deg)",
            "0 .. 90 deg; falls",
            format!(
                "{} % of the flat force at alpha = 20, 40, 60, 80, 85, 89; dbar 0.4",
                list(falling.iter().copied(), 3)
            ),
            falling.windows(2).all(|w| w[1] < w[0]) && falling[0] < 100.0,
            "The force goes to 0 with the needle: the limit is no point load.",
        ));
        entries.push(input("12", "4.4 p. 81", "inflation of the chapter", "r0 = 2.0"));
        entries.push(numbers(
            "13",
            "4.4 pp. 81-82",
            "flat, dbar 0.4, r0 2: pbar",
            "1.56",
            vec![reading("p_f R/G", [flat.get("p_f")]), reading("p_f/p_f0", [flat.get("p_f") / flat.get("p_f0")])],
            "",
        ));
        entries.push(numbers(
            "14",
            "4.4 p. 82",
            "alpha = 20, 40, 60, 80: pressure in per cent of the flat one",
            "83.27 76.91 72.60 67.33",
            vec![reading("", part("p_f"))],
            "No normalisation enters.",
        ));
    }

    fn tensions(&self, entries: &mut Vec<Entry>) {
        // Between plates the plane of symmetry is the end of a segment: the equator's tension is exact.
        let largest = each(&[0.50, 0.75], |&dbar| {
            let plates =
                Case::of("flat_plates").set("r0", self.r0).output("P_e", "side.end.w_l").output("Q_e", "side.end.w_m");
            let state = plates.state("hbar", dbar);
            let all = state.rows(|_| true).into_iter().map(|r| (r.w_l.max(r.w_m), r.phi));
            let (tension, phi) = all.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            [tension / state.get("P_i"), phi / PI]
        });
        entries.push(numbers(
            "15",
            "4.4 p. 83",
            "flat, dbar 0.50: largest tension/P_i, and its phi/pi",
            "1.083 0.5",
            vec![reading("dbar = 0.50", largest[0]), reading("dbar = 0.75", largest[1])],
            "",
        ));
        let printed = [1.263, 3.385, 14.48, 91.14];
        let cases: Vec<(f64, f64)> = ANGLES[1..].iter().copied().zip(printed).collect();
        let places = each(&cases, |&(angle, tension)| {
            let states = [0.50, 0.75].map(|dbar| self.cone(angle).state("dbar", dbar));
            let place =
                |state: &State| phi_at(&state.rows(|s| s == "cone")[1..], tension * state.get("P_i"), |r| r.w_l) / PI;
            (place(&states[0]), place(&states[1]), states.iter().all(|s| s.is_infinite("cone.start.w_l")))
        });
        entries.push(claim(
            "16",
            "4.4 p. 83",
            "alpha = 20, 40, 60, 80, dbar 0.50: largest tension/P_i, at phi/pi = 0",
            "1.263, 3.385, 14.48, 91.14",
            format!(
                "infinite; w_l has the printed values at phi/pi = {} (at dbar 0.75: {})",
                list(places.iter().map(|p| p.0), 2),
                list(places.iter().map(|p| p.1), 2)
            ),
            !places.iter().all(|p| p.2),
            "w_l = G C phi^(cos alpha - 1) at a sharp tip: a finite number is that of the first mesh point, and another mesh gives another.",
        ));
        entries.push(quoted("17", "4.4 p. 83", "[21], cone against sphere", "almost ten times"));
        entries.push(input(
            "18",
            "4.4 pp. 83-84, figs. 4.6-4.8",
            "inflations; angle",
            "2.0, 1.5, 1.3; 60 deg, 0 deg in fig. 4.7",
        ));
    }

    fn distributions(&self, entries: &mut Vec<Entry>) {
        let small = Case::of("cone_on_flat").set("cone_angle", 60).set("r0", 1.5);
        let states: Vec<State> = small.at(&[("dbar", 0.50), ("dbar", 0.75)]).into_iter().flatten().collect();
        let edge = |name: &str, i: usize| states[i].get(name) / PI;
        let crossing = |i: usize| {
            let rows = states[i].rows(|s| s == "side");
            let gap = |r: &Row| r.w_l - r.w_m;
            let w = rows.windows(2).find(|w| gap(&w[0]) > 0.0 && gap(&w[1]) <= 0.0).expect("a crossing");
            (w[0].phi + (w[1].phi - w[0].phi) * gap(&w[0]) / (gap(&w[0]) - gap(&w[1]))) / PI
        };
        let extreme = |segment: &str| {
            let rows = states[0].rows(|s| s == segment);
            let all = rows.iter().map(|r| r.w_m / r.w_l);
            all.fold((f64::INFINITY, 0.0_f64), |(a, b), v| (a.min(v), b.max(v)))
        };
        let (cone, side, support) = (extreme("cone"), extreme("side"), extreme("support"));
        entries.push(numbers(
            "19",
            "4.4 p. 84",
            "alpha 60, r0 1.5, dbar 0.50: phi/pi at the edge of the contact with the cone",
            "0.17",
            vec![
                reading("dbar = 0.50", [edge("phi_c1", 0)]),
                reading("dbar = 0.75", [edge("phi_c1", 1)]),
                reading("where w_l = w_m, dbar = 0.50", [crossing(0)]),
                reading("where w_l = w_m, dbar = 0.75", [crossing(1)]),
            ],
            "",
        ));
        entries.push(claim(
            "19",
            "4.4 p. 84",
            "same: on that contact",
            "w_m < w_l",
            format!("w_m/w_l from {} to {}", digits(cone.0, 3), digits(cone.1, 3)),
            cone.1 < 1.0 + 1e-6,
            "At the tip the ratio tends to 1.",
        ));
        entries.push(claim(
            "20",
            "4.4 p. 84",
            "same: on the free part",
            "w_m > w_l, 0.17 < phi/pi <= 0.9",
            format!(
                "w_m/w_l from {} to {}; w_l = w_m at phi/pi = {}",
                digits(side.0, 3),
                digits(side.1, 3),
                digits(crossing(0), 2)
            ),
            side.0 > 1.0,
            "The two cross on the free part, not at the edge of the contact.",
        ));
        entries.push(numbers(
            "21",
            "4.4 p. 84",
            "same: phi/pi at the edge of the contact with the support",
            "0.9",
            vec![reading("dbar = 0.50", [edge("phi_c2", 0)]), reading("dbar = 0.75", [edge("phi_c2", 1)])],
            "",
        ));
        entries.push(claim(
            "21",
            "4.4 p. 84",
            "same: on that contact",
            "nearly equal",
            format!("w_m/w_l from {} to {}", digits(support.0, 4), digits(support.1, 4)),
            (support.0 - 1.0).abs().max((support.1 - 1.0).abs()) < 0.05,
            "Rule: nearly equal means within 5 %.",
        ));
    }

    fn poles(&self, entries: &mut Vec<Entry>) {
        let dbar: Vec<f64> = (1..=45).map(|i| 1.0 - 0.02 * f64::from(i)).collect();
        let states = |angle: f64| self.cone(angle).through("dbar", &dbar).branch().states;
        // The angle from which on something rises at every step, between 5 and 60.
        let threshold = |of: &(dyn Fn(&[State]) -> Vec<f64> + Sync)| {
            let (mut a, mut b) = (5.0, 60.0);
            while b - a > 0.05 {
                let m = 0.5 * (a + b);
                if rises(&of(&states(m))) { b = m } else { a = m }
            }
            0.5 * (a + b)
        };
        let near = |phi: f64| {
            move |states: &[State]| -> Vec<f64> {
                let tension = |s: &State| at_phi(&s.rows(|s| s == "cone" || s == "side")[1..], phi, |r| r.w_l);
                states.iter().map(tension).collect()
            }
        };
        let coefficient = |states: &[State]| -> Vec<f64> { states.iter().map(|s| s.get("tip_coefficient")).collect() };
        let found = each(&[0.0, 0.01, 0.001], |&phi| match phi {
            0.0 => threshold(&coefficient),
            _ => threshold(&near(phi)),
        });
        entries.push(numbers(
            "22",
            "4.4 p. 86, fig. 4.9",
            "pole tension against height: rises at every step (0.02 in dbar) above alpha = (deg), falls somewhere below it",
            "20",
            vec![
                reading("coefficient C", [found[0]]),
                reading("w_l at phi = 0.01", [found[1]]),
                reading("w_l at phi = 0.001", [found[2]]),
            ],
            "The tension itself is infinite at every height for alpha > 0; its coefficient and its values at a fixed small phi have such an angle.",
        ));
        entries.push(input("23", "4.4 pp. 86-87, fig. 4.10", "final state", "hbar = 0, dbar = 0"));
    }

    /// Row 24.
    fn equality(&self, entries: &mut Vec<Entry>) {
        let ratio = each(
            &[(0.0, self.r0), (0.0, 1.5), (0.0, 1.3), (60.0, self.r0), (60.0, 1.5), (60.0, 1.3)],
            |&(angle, r0)| {
                let state = Case::of("cone_on_flat").set("cone_angle", angle).set("r0", r0).state("dbar", 0.50);
                let least = |keep: fn(&str) -> bool| {
                    state.rows(keep).iter().map(|r| r.mu / r.lambda).fold(f64::INFINITY, f64::min)
                };
                (least(|_| true), least(|s| s == "side"), difference(&state.rows(|_| true)))
            },
        );
        entries.push(claim(
            "-",
            "4.4 p. 86, fig. 4.7",
            "flat, r0 2.0, 1.5, 1.3: mu against lambda",
            "mu always greater",
            format!("least mu/lambda {}", list(ratio[..3].iter().map(|r| r.0), 4)),
            ratio[..3].iter().all(|r| r.0 > 1.0 - 1e-9),
            "They are equal at the poles.",
        ));
        entries.push(claim(
            "-",
            "4.4 p. 86, fig. 4.8",
            "alpha 60, r0 2.0, 1.5, 1.3: mu against lambda on the free part",
            "mu greater",
            format!("least mu/lambda {}", list(ratio[3..].iter().map(|r| r.1), 4)),
            ratio[3..].iter().all(|r| r.1 > 1.0),
            "",
        ));
        entries.push(claim(
            "24",
            "4.5 p. 89",
            "principal tensions nearly equal for r0 above, different below",
            "2.0",
            format!(
                "largest relative difference at dbar 0.50, r0 2.0, 1.5, 1.3: {} % (flat), {} % (alpha 60)",
                list(ratio[..3].iter().map(|r| 100.0 * r.2), 2),
                list(ratio[3..].iter().map(|r| 100.0 * r.2), 2)
            ),
            ratio[0].2 < 0.05 && ratio[3].2 < 0.05 && ratio[1].2 > 0.05 && ratio[4].2 > 0.05,
            "Rule: nearly equal means within 5 %.",
        ));
    }
}
