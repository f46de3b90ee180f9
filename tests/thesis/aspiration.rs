//! Chapter 5: the micropipette.

use crate::page::{Chapter, Entry, Reading, claim, digits, input, list, numbers, partial, quoted, reading};
use crate::solve::{Branch, Case, State};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pipette radii over the inflated one, as printed: 0.70, 0.58, 0.52, 0.45.
const PRINTED: [f64; 4] = [0.70, 0.58, 0.52, 0.45];

/// Settings of a pipette.
fn pipette(r0: f64, rhobar: f64) -> Case {
    Case::of("micropipette")
        .set("r0", r0)
        .set("rhobar", rhobar)
        .output("V_inside", "cap.volume + pipette.wall.volume")
        .output("A_inside", "cap.area + pipette.wall.area")
        .output("A", "membrane.area")
}

/// The branch up to a length, with the maxima of dP on it.
fn beginning(case: &Case, to: f64) -> Branch {
    case.set("branch", format!("(control: \"L\", to: {to}, steps: 10, limit_points: [\"dP\"])")).branch()
}

/// With the edge stuck at the material point of first touch.
fn stuck(r0: f64, pipe: &Pipette) -> Case {
    Case::of("micropipette_stuck").set("r0", r0).set("rhobar", pipe.rhobar)
}

/// What is needed of one radius.
struct Pipette {
    case: Case,
    /// Pipette radius over that of the inflated sphere.
    rhobar: f64,
    /// Past the maximum of dP and wall contact.
    beginning: Branch,
    /// States where quantities have values, in the order in which the branch meets them.
    asked: Vec<((&'static str, f64), Vec<State>)>,
}

impl Pipette {
    /// Solves for a radius what is asked, on the whole branch or up to a length.
    fn new(r0: f64, rhobar: f64, asked: &[(&'static str, f64)], to: Option<f64>) -> Pipette {
        let case = pipette(r0, rhobar);
        let part = to.map(|to| case.set("branch", format!("(control: \"L\", to: {to}, steps: 30)")));
        let (beginning, mut states) =
            rayon::join(|| beginning(&case, 1.6), || part.as_ref().unwrap_or(&case).at(asked));
        // Beyond the end of aspiration the equations have solutions that are none.
        states.iter_mut().for_each(|found| found.retain(|s| s.get("tau_out") <= PI / 2.0));
        Pipette { case, rhobar, beginning, asked: asked.iter().copied().zip(states).collect() }
    }

    fn states(&self, name: &str, value: f64) -> &[State] {
        let found = self.asked.iter().find(|a| a.0 == (name, value));
        &found.unwrap_or_else(|| panic!("{name} = {value} was not asked for")).1
    }

    /// The state on the rising side: before the maximum of dP.
    fn rising(&self, name: &str, value: f64) -> Option<&State> {
        self.states(name, value).first().filter(|s| s.get("L") <= self.fold().get("L"))
    }

    /// The state on the falling side.
    fn falling(&self, name: &str, value: f64) -> Option<&State> {
        self.states(name, value).last().filter(|s| s.get("L") > self.fold().get("L"))
    }

    fn start(&self) -> &State {
        &self.beginning.states[0]
    }

    fn fold(&self) -> &State {
        self.beginning.event("fold", "dP").expect("a maximum of dP")
    }

    fn touch(&self) -> &State {
        self.beginning.event("touch", "pipette.wall").expect("wall contact")
    }
}

/// Radii whose branches are examined for compression, and L/R to which they are followed: shortly before the end of aspiration,
/// where the places on a capsule that is almost free to slide are lost in rounding.
const NARROW: [(f64, f64); 4] = [(0.38, 17.5), (0.40, 15.5), (0.42, 14.3), (0.45, 12.5)];

/// A branch up to a length.
fn narrow_branch(r0: f64, rhobar: f64, to: f64) -> Branch {
    pipette(r0, rhobar).set("branch", format!("(control: \"L\", to: {to}, steps: 80)")).branch()
}

/// The largest wall area on a branch.
fn largest_area(branch: &Branch) -> f64 {
    let all = branch.states.iter().chain(branch.events.iter().map(|e| &e.2));
    all.map(|s| s.get("wall_area")).fold(0.0, f64::max)
}

/// The share of the membrane that has passed the edge, in per cent, by a measure.
fn inside(state: &State, measure: &str) -> f64 {
    100.0
        * match measure {
            "reference area" => (1.0 - state.get("phi_c2").cos()) / 2.0,
            "current area" => state.get("A_inside") / state.get("A"),
            _ => state.get("phi_c2") / PI,
        }
}

/// The share of that which lies on the wall.
fn on_wall(state: &State, measure: &str) -> f64 {
    let (cap, edge) = (state.get("phi_c1"), state.get("phi_c2"));
    100.0
        * match measure {
            "reference area" => (cap.cos() - edge.cos()) / (1.0 - edge.cos()),
            "current area" => state.get("wall_area") / state.get("A_inside"),
            _ => (edge - cap) / edge,
        }
}

const MEASURES: [&str; 3] = ["reference area", "phi", "current area"];

/// Chapter 5 for an inflation; the thesis has 2.0.
pub fn chapter5(r0: f64) -> Chapter {
    let mut asked = vec![("dP", 0.019)];
    asked.extend([1.01, 2.35, 6.76, 2.0].iter().flat_map(|&v| [("L", v), ("L_over_rho", v)]));
    asked.extend([0.310, 0.311, 0.871, 0.872, 0.540, 0.505, 0.103, 0.329, 0.636, 1.17].map(|v| ("dP", v)));
    let sines = [10.0, 8.0, 7.0, 6.0].map(|k: f64| (k * PI / 40.0).sin());
    let all: Vec<f64> = PRINTED.into_iter().chain(sines).collect();
    // Of the narrowest pipettes only states before L/R = 4 are asked for.
    let short = [("L", 2.0), ("L_over_rho", 2.0), ("dP", 1.17)];
    let solve = |&rhobar: &f64| {
        if rhobar < 0.5 { Pipette::new(r0, rhobar, &short, Some(4.0)) } else { Pipette::new(r0, rhobar, &asked, None) }
    };
    let (mut pipes, narrow): (Vec<Pipette>, Vec<Branch>) = rayon::join(
        || all.par_iter().with_max_len(1).map(solve).collect(),
        || NARROW.par_iter().with_max_len(1).map(|&(rhobar, to)| narrow_branch(r0, rhobar, to)).collect(),
    );
    let second = pipes.split_off(4);
    let sets = [("", pipes), (", rhobar = sin(k pi/40)", second)];

    let mut entries = vec![
        input("25", "5.1 p. 98", "pipette radius over cell radius in experiments", "0.2 .. 0.8"),
        input("26", "5.4 p. 113", "inflation of figs. 5.3 to 5.11", "r0 = 2 R"),
    ];
    figure3(&sets, &mut entries);
    figure4(&sets, &mut entries);
    portion(&sets, &mut entries);
    curves(r0, &sets, &narrow[3], &mut entries);
    tensions(r0, &sets, &narrow, &mut entries);
    others(r0, &mut entries);
    Chapter {
        title: "Chapter 5: into a pipette",
        about: "rhobar = rho/r0. Text: dP R/G, L/R (5.28); figure 5.5 uses L/rho. The edge is frictionless (lambda w_l - w continuous): the chapter's \
                own conditions leave one free, for its (5.23) follows from the others once its sign is mended. Where a dP is met twice, \
                the state before or beyond its maximum is taken as the text says. \"rhobar = sin(k pi/40)\" are 0.7071, 0.5878, 0.5225, 0.4540.",
        entries,
    }
}

type Sets = [(&'static str, Vec<Pipette>)];

/// One reading for each set of radii.
fn readings<I: IntoIterator<Item = Option<f64>>>(
    sets: &Sets,
    name: &str,
    of: impl Fn(&[Pipette]) -> I,
) -> Vec<Reading> {
    sets.iter().map(|(set, pipes)| partial(format!("{name}{set}"), of(pipes))).collect()
}

/// Rows 27 to 31: rhobar = 0.52, three states.
fn figure3(sets: &Sets, entries: &mut Vec<Entry>) {
    let lengths = [1.01, 2.35, 6.76];
    let at = |name: &'static str| {
        move |pipes: &[Pipette]| lengths.map(|l| pipes[2].states(name, l).first().map(|s| s.get("dP")))
    };
    let pressures = || {
        let mut all = readings(sets, "at those L/R", at("L"));
        all.extend(readings(sets, "at those L/rho", at("L_over_rho")));
        all
    };
    entries.push(numbers(
        "27",
        "5.4 p. 113",
        "rhobar 0.52, fig. 5.3 (b), (c), (d): dP at the lengths of row 29",
        "0.871 0.540 0.103",
        pressures(),
        "Text and caption differ, and neither fits the lengths.",
    ));
    entries.push(numbers("28", "caption of fig. 5.3", "the same; (a) is dP = 0", "0.872 0.505 0.103", pressures(), ""));
    let length = |name: &'static str, dp: [f64; 3]| {
        move |pipes: &[Pipette]| {
            let p = &pipes[2];
            [p.rising("dP", dp[0]), p.falling("dP", dp[1]), p.falling("dP", dp[2])].map(|s| s.map(|s| s.get(name)))
        }
    };
    let (text, caption) = ([0.871, 0.540, 0.103], [0.872, 0.505, 0.103]);
    let mut all = readings(sets, "L/R at the text's dP", length("L", text));
    all.extend(readings(sets, "L/R at the caption's dP", length("L", caption)));
    all.extend(readings(sets, "L/rho at the text's dP", length("L_over_rho", text)));
    all.extend(readings(sets, "L/rho at the caption's dP", length("L_over_rho", caption)));
    entries.push(numbers(
        "29",
        "5.4 p. 113",
        "rhobar 0.52: L/R of (b), (c), (d) at the dP of row 27",
        "1.01 2.35 6.76",
        all,
        "",
    ));
    type Choice = (&'static str, &'static str, [f64; 2]);
    let choices: [Choice; 4] = [
        ("state by L/R", "L", [2.35, 6.76]),
        ("state by the caption's dP", "dP", [0.505, 0.103]),
        ("state by the text's dP", "dP", [0.540, 0.103]),
        ("state by L/rho", "L_over_rho", [2.35, 6.76]),
    ];
    type Share = fn(&State, &str) -> f64;
    let rows: [(&str, &str, &str, Share); 2] = [
        ("30", "rhobar 0.52: per cent of the membrane inside, (c), (d)", "42.5 92.5", inside),
        ("31", "per cent of that part on the wall, (c), (d)", "62.1 96.4", on_wall),
    ];
    for (row, what, printed, share) in rows {
        let mut all = vec![];
        for measure in MEASURES {
            for (name, key, values) in choices {
                all.extend(readings(sets, &format!("share of {measure}, {name}"), |pipes| {
                    values.map(|v| pipes[2].falling(key, v).map(|s| share(s, measure)))
                }));
            }
        }
        entries.push(numbers(row, "5.4 p. 114", what, printed, all, ""));
    }
    entries.push(input("32", "5.4", "pipette sizes studied", "0.20 r0 .. r0"));
    entries.push(input("33", "5.4, fig. 5.4", "dP; rhobar", "0.310; 0.70, 0.58, 0.52"));
}

/// Rows 34 to 36: dP = 0.310, three radii.
fn figure4(sets: &Sets, entries: &mut Vec<Entry>) {
    let of = |name: &'static str, dp: f64| {
        move |pipes: &[Pipette]| [0, 1, 2].map(|i| pipes[i].falling("dP", dp).map(|s| s.get(name)))
    };
    let mut all = readings(sets, "L/R", of("L", 0.310));
    all.extend(readings(sets, "L/rho", of("L_over_rho", 0.310)));
    entries.push(numbers(
        "34",
        "5.4",
        "dP 0.310, beyond the maximum, rhobar 0.70, 0.58, 0.52: L/R",
        "2.38 5.68 8.13",
        all,
        "",
    ));
    type Share = fn(&State, &str) -> f64;
    let rows: [(&str, &str, &str, Share); 2] = [
        ("35", "same: per cent inside", "45.9 87.35 98.1", inside),
        ("36", "same: per cent of that part on the wall", "40.41 90.09 96.58", on_wall),
    ];
    for (row, what, printed, share) in rows {
        let mut all = vec![];
        for measure in MEASURES {
            all.extend(readings(sets, &format!("share of {measure}"), |pipes| {
                [0, 1, 2].map(|i| pipes[i].falling("dP", 0.310).map(|s| share(s, measure)))
            }));
        }
        entries.push(numbers(row, "5.4", what, printed, all, ""));
    }
}

/// Row 37: the portion is not given; it is chosen so that the first number is met.
fn portion(sets: &Sets, entries: &mut Vec<Entry>) {
    let mut all = vec![];
    for (set, pipes) in sets {
        let anchor = pipes[0].rising("dP", 0.019).expect("a first rise");
        for (what, name) in [("L/R", "L"), ("L/rho", "L_over_rho"), ("phi", "phi_c2")] {
            let more = anchor.get(name) - pipes[0].start().get(name);
            let found = [1, 2].map(|i| {
                let p: &Pipette = &pipes[i];
                let aim = p.start().get(name) + more;
                // Close to the start: the whole branch need not be walked.
                let near = format!("(control: \"L\", to: {}, steps: 3)", p.start().get("L") + 0.3);
                p.case.set("branch", near).at(&[(name, aim)])[0].first().map(|s| s.get("dP"))
            });
            all.push(partial(format!("equal increase of {what}{set}"), [Some(0.019), found[0], found[1]]));
        }
    }
    entries.push(numbers(
        "37",
        "5.4",
        "dP to aspirate an equal small portion, rhobar 0.70, 0.58, 0.52",
        "0.019 0.073 0.143",
        all,
        "The portion is not given: it is the one that meets the first number, so that two are judged. None is printed for 0.45, although announced.",
    ));
}

/// Rows 38 to 48 and 53, 54: pressure against length.
fn curves(r0: f64, sets: &Sets, narrow: &Branch, entries: &mut Vec<Entry>) {
    let pipes = &sets[0].1;
    entries.push(input("38", "5.4 pp. 116-117, fig. 5.5", "rhobar", "0.70, 0.58, 0.52, 0.45"));
    let gaps: Vec<(f64, f64)> = pipes
        .iter()
        .map(|p| {
            let ratio = |name: &str| p.touch().get(name) / p.fold().get(name) - 1.0;
            (-100.0 * ratio("dP"), 100.0 * ratio("L"))
        })
        .collect();
    entries.push(claim(
        "39",
        "5.4 p. 117",
        "wall contact (p) at the maximum (p') for rhobar at or above",
        "0.58",
        format!(
            "rhobar 0.70, 0.58, 0.52, 0.45: at wall contact L is longer than at the maximum by {} %, and p smaller than p' by {} %",
            list(gaps.iter().map(|g| g.1), 2),
            list(gaps.iter().map(|g| g.0), 2)
        ),
        gaps.iter().zip(PRINTED).all(|(g, r)| (g.1.abs() < 0.1) == (r >= 0.58)),
        "Rule: at the maximum means at its length within 0.1 %. In wide pipettes the maximum comes before wall contact, in narrow ones after it; the \
         two coincide at one radius, between 0.52 and 0.45, and the pressures hardly differ anywhere.",
    ));
    entries.push(input("40", "5.4 p. 118, fig. 5.6", "dP; rhobar", "0.311; 0.70, 0.58, 0.52"));
    for (row, what, printed, before) in [
        ("41", "dP 0.311 before wall contact, same order: L/R", "0.706 0.474 0.401", true),
        ("42", "dP 0.311 beyond the maximum: L/R", "1.59 4.79 7.79", false),
    ] {
        let of = |name: &'static str| {
            move |pipes: &[Pipette]| {
                [0, 1, 2].map(|i| {
                    let p = &pipes[i];
                    let state = if before { p.rising("dP", 0.311) } else { p.falling("dP", 0.311) };
                    state.map(|s| s.get(name))
                })
            }
        };
        let mut all = readings(sets, "L/R", of("L"));
        all.extend(readings(sets, "L/rho", of("L_over_rho")));
        if before {
            for (length, name) in [("L/R", "L"), ("L/rho", "L_over_rho")] {
                all.extend(readings(sets, &format!("{length}, edge stuck"), |pipes| {
                    [0, 1, 2].map(|i| {
                        let states = stuck(r0, &pipes[i]).at(&[("dP", 0.311)]).remove(0);
                        states.first().map(|s| s.get(name))
                    })
                }));
            }
        }
        entries.push(numbers(row, "5.4 p. 119", what, printed, all, ""));
    }
    threshold(r0, entries);
    entries.push(quoted(
        "44",
        "5.4 p. 120",
        "[29, 30], bending matters for deflections below",
        "20 per cent of the radius",
    ));
    entries.push(quoted("45", "5.4 p. 120", "[31], bending negligible at radius/thickness about", "16"));
    let wide = [&pipes[0], &sets[1].1[0]].map(|p| largest_area(&p.case.branch()));
    entries.push(numbers(
        "46",
        "5.4 p. 121",
        "rhobar 0.70: largest wall area/R^2",
        "20",
        vec![reading("whole branch", [wide[0]]), reading(format!("whole branch{}", sets[1].0), [wide[1]])],
        "It grows to the end of aspiration, where tau outside reaches 90 deg.",
    ));
    let area = largest_area(narrow);
    entries.push(claim(
        "47",
        "5.4 p. 122",
        "rhobar 0.45: wall area/R^2",
        "can exceed 45",
        format!("{} at L/R = {}", digits(area, 3), NARROW[3].1),
        area > 45.0,
        "It grows further from there to the end of aspiration.",
    ));
    let areas =
        Case::of("micropipette").set("r0", r0).output("A_0", "reference.area").output("A_i", "initial.membrane.area");
    let start = areas.state("L", pipes[1].start().get("L") + 0.1);
    let areas = ["A_0", "A_i"].map(|name| start.get(name));
    entries.push(numbers(
        "48",
        "5.4 p. 122",
        "area of the unstressed and of the inflated membrane, in units of pi R^2",
        "1 4",
        vec![
            reading("area of the sphere", areas.map(|a| a / PI)),
            reading("area of its great circle", areas.map(|a| a / (4.0 * PI))),
        ],
        "",
    ));
}

/// Rows 53 and 54: other inflations and outside pressures.
fn others(r0: f64, entries: &mut Vec<Entry>) {
    entries.push(input(
        "53",
        "5.4 p. 125, fig. 5.12",
        "inflations; pipette radius in the text; rhobar in the caption",
        "2.0, 2.2, 2.4, 2.6; 1.41 R; 0.70",
    ));
    entries.push(input("54", "5.4 p. 125, fig. 5.13", "outside pressures; rhobar", "0.0, 0.5, 1.0, 1.5; 0.70"));
    let dp: Vec<f64> = [0.0, 1.5].iter().map(|p| pipette(r0, 0.70).set("P2", p).state("L", 2.0).get("dP")).collect();
    entries.push(claim(
        "-",
        "5.4 p. 125, fig. 5.13",
        "rhobar 0.70: the curves of all outside pressures",
        "collapse",
        format!("dP at L/R 2.0: {} for P2 = 0 and for 1.5", digits(dp[0], 5)),
        (dp[1] / dp[0] - 1.0).abs() < 1e-8,
        "Exact for an incompressible filling, and for it alone.",
    ));
}

/// Row 43, and what of the maximum is a property of the material.
fn threshold(r0: f64, entries: &mut Vec<Entry>) {
    let radii = [0.3, 0.4, 0.45, 0.52, 0.58, 0.70, 0.80, 0.90];
    let folds: Vec<f64> = radii
        .par_iter()
        .map(|&rhobar| {
            let branch = beginning(&pipette(r0, rhobar), 2.2);
            branch.event("fold", "dP").unwrap_or_else(|| panic!("no maximum at {rhobar}")).get("dP")
        })
        .collect();
    let product: Vec<f64> = radii.iter().zip(&folds).map(|(r, p)| r * r0 * p).collect();
    let liquid: Vec<f64> = radii.iter().zip(&folds).map(|(r, p)| p / (1.0 / (r * r0) - 1.0 / r0)).collect();
    let spread = |v: &[f64]| v.iter().copied().fold(0.0, f64::max) / v.iter().copied().fold(f64::INFINITY, f64::min);
    entries.push(claim(
        "43",
        "5.4 p. 119, fig. 5.7",
        "p' against rho",
        "inversely proportional",
        format!(
            "p' rho/G = {} at rhobar {}; p'/(1/rho - 1/r0)/G = {}",
            list(product.iter().copied(), 3),
            list(radii, 2),
            list(liquid.iter().copied(), 3)
        ),
        spread(&product) < 1.05,
        "Rule: proportional means that p' rho is constant within 5 %. A liquid drop has p' = 2 T (1/rho - 1/r0), T its tension; the Cauchy tension of a \
         much stretched neo-Hookean membrane tends to G.",
    ));
    let law = |text: &str, to: f64| {
        let case = pipette(r0, 0.52).set("material", text);
        let branch = beginning(&case, to);
        let fold = branch.event("fold", "dP").expect("a maximum");
        let touch = branch.event("touch", "pipette.wall").expect("wall contact");
        [fold.get("L"), fold.get("dP"), touch.get("L")]
    };
    let [soft, firm] = [("MooneyRivlin(c1: 0.5, c2: 0)", 2.2), ("MooneyRivlin(c1: 0.5, c2: 0.025)", 6.0)]
        .map(|(text, to)| law(text, to));
    entries.push(claim(
        "-",
        "5.4 pp. 117-119",
        "rhobar 0.52: past its maximum near wall contact dP falls, \"liquid-like\"",
        "the membrane's behaviour",
        format!(
            "maximum dP {} at L/R {} (wall contact at {}); with C2/C1 = 0.05 (Mooney-Rivlin): {} at {} (wall contact at {})",
            digits(soft[1], 4),
            digits(soft[0], 3),
            digits(soft[2], 3),
            digits(firm[1], 4),
            digits(firm[0], 3),
            digits(firm[2], 3)
        ),
        firm[0] < 1.5 * firm[2],
        "Rule: near means within half of the length at wall contact. It is a property of the neo-Hookean law, whose Cauchy tension saturates.",
    ));
}

/// Rows 49 to 52: tensions along the meridian.
fn tensions(r0: f64, sets: &Sets, narrow: &[Branch], entries: &mut Vec<Entry>) {
    let pressures = [0.329, 0.636, 1.17];
    let chosen = [0, 1, 3];
    let length = |name: &'static str| {
        move |pipes: &[Pipette]| {
            let states = chosen.iter().zip(pressures).map(|(&i, dp)| pipes[i].falling("dP", dp).map(|s| s.get(name)));
            states.collect::<Vec<_>>()
        }
    };
    let mut all = readings(sets, "L/R at the dP of row 50", length("L"));
    all.extend(readings(sets, "L/rho at the dP of row 50", length("L_over_rho")));
    entries.push(numbers(
        "49",
        "5.4 p. 122, figs. 5.10, 5.11",
        "common aspirated length, rhobar 0.70, 0.58, 0.45",
        "2.0 2.0 2.0",
        all,
        "",
    ));
    let dp = |name: &'static str| {
        move |pipes: &[Pipette]| chosen.map(|i| pipes[i].states(name, 2.0).first().map(|s| s.get("dP")))
    };
    let mut all = readings(sets, "L/R = 2.0", dp("L"));
    all.extend(readings(sets, "L/rho = 2.0", dp("L_over_rho")));
    all.extend(readings(sets, "L/R = 2.0, edge stuck", |pipes| {
        chosen.map(|i| {
            let states = stuck(r0, &pipes[i]).through("L", &[2.0]).branch().states;
            states.last().filter(|s| s.is_admissible()).map(|s| s.get("dP"))
        })
    }));
    entries.push(numbers("50", "5.4 p. 122", "dP there", "0.329 0.636 1.17", all, ""));

    let state = &sets[0].1[1].states("L", 2.0)[0];
    let jump = state.get("lambda_in") / state.get("lambda_out") - 1.0;
    entries.push(claim(
        "-",
        "5.4 p. 123, figs. 5.10, 5.11",
        "lambda and the tensions at the edge",
        "jump",
        format!("lambda, mu, w_l, w_m continuous (lambda within {} at rhobar 0.58, L/R 2.0)", if jump.abs() < 1e-8 { "1e-8".into() } else { digits(jump, 1) }),
        jump.abs() > 1e-3,
        "A frictionless edge pulls on nothing along the meridian; with friction the outer tension would differ by the capstan's factor.",
    ));

    struct Compressed {
        /// L and phi/pi where it begins.
        first: Option<(f64, f64)>,
        /// Of phi/pi.
        range: (f64, f64),
    }
    let found: Vec<Compressed> = narrow
        .par_iter()
        .map(|branch| {
            let least = |s: &State| {
                let rows = s.rows(|_| true).into_iter().map(|r| (r.w_m, r.phi));
                rows.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a mesh")
            };
            let first = branch.event("wrinkling", "least tension").map(|s| (s.get("L"), least(s).1 / PI));
            let mut range = (f64::INFINITY, 0.0_f64);
            for s in &branch.states {
                if s.is_admissible() {
                    continue;
                }
                // Between two points of the mesh, so that the mesh does not show.
                for r in s.rows(|_| true).windows(2).filter(|r| r[0].w_m * r[1].w_m < 0.0) {
                    let at = r[0].phi + (r[1].phi - r[0].phi) * r[0].w_m / (r[0].w_m - r[1].w_m);
                    range = (range.0.min(at / PI), range.1.max(at / PI));
                }
            }
            Compressed { first, range }
        })
        .collect();
    let two = pipette(r0, NARROW[0].0).state("L", 2.0);
    let at_two = two.rows(|_| true).iter().map(|r| r.w_m).fold(f64::INFINITY, f64::min) / two.get("P_i");
    let small = &found[0];
    let (length, place) = small.first.expect("compression at rhobar 0.38");
    entries.push(claim(
        "51",
        "5.4 p. 123",
        "rhobar 0.38 (no length given): w_m < 0 around phi/pi =",
        "0.37",
        format!(
            "from L/R = {} on, first at phi/pi = {}, over {} to {} up to L/R = 17.5; at L/R 2.0 the least w_m/P_i is {}",
            digits(length, 3),
            digits(place, 2),
            digits(small.range.0, 2),
            digits(small.range.1, 2),
            digits(at_two, 2)
        ),
        small.range.0 <= 0.37 && 0.37 <= small.range.1,
        "Not at the length of fig. 5.10, but late on the branch.",
    ));
    let with: Vec<f64> = NARROW.iter().zip(&found).filter(|f| f.1.first.is_some()).map(|f| f.0.0).collect();
    let without: Vec<f64> = NARROW.iter().zip(&found).filter(|f| f.1.first.is_none()).map(|f| f.0.0).collect();
    let lengths: Vec<f64> = found.iter().filter_map(|f| f.first.map(|f| f.0)).collect();
    entries.push(claim(
        "52",
        "5.4 p. 123, 5.5",
        "wrinkling only for rhobar at or below",
        "0.40",
        format!(
            "tried {}, up to L/R = {}: w_m < 0 at {} (from L/R = {} on), not at {}",
            list(NARROW.map(|n| n.0), 2),
            list(NARROW.map(|n| n.1), 3),
            list(with.iter().copied(), 2),
            list(lengths, 3),
            list(without, 2)
        ),
        with.iter().all(|&r| r <= 0.40) && with.contains(&0.40),
        "The bound is a little higher, late on the branch.",
    ));
}
