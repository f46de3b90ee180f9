//! What a problem file means: names bound, the meridian walked, unknowns and conditions counted.
//!
//! [`resolve`] turns the words of a file ([`crate::spec`]) into a [`Model`]: a [`System`] with a name for every unknown and
//! every condition. It collects every mistake before it gives up. A `Model` is proof that the count closes.

mod binder;
mod initial;
mod ledger;
mod meridian;
mod set;
mod tractions;

pub use initial::Initial;
pub use ledger::{Entry, Ledger};
pub use set::set;

use crate::diagnostic::Diagnostic;
use crate::expr;
use crate::physics::surface::Facing;
use crate::spec::{self, Element, Number, Problem};
use crate::system::{Formula, Probe, System};
use binder::Names;
use std::sync::Arc;

/// A named number that is reported.
#[derive(Clone, Debug)]
pub struct Quantity {
    /// Its name in the result.
    pub name: String,
    /// How it is computed.
    pub formula: Formula,
}

/// A rigid body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// The side where the membrane is, and the surface.
    pub face: crate::physics::surface::Face,
    /// Axial position of its apex.
    pub h: Formula,
    /// The pieces that lie on it.
    pub pieces: Vec<usize>,
}

/// A sharp edge over which the membrane is bent.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Its name.
    pub name: String,
    /// The piece before it; the next one is after it.
    pub before: usize,
    /// Its radius.
    pub radius: f64,
    /// The side of its body where the membrane is.
    pub facing: Facing,
}

/// Which of the elements of the meridian that may be absent are present: one bit for each, by its place in the list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Presence(Vec<usize>);

impl Presence {
    /// True if an element, at its place in the list, is present.
    pub fn has(&self, element: &Element, at: usize) -> bool {
        match element {
            Element::Contact { appears: Some(_), .. } | Element::Kink { appears: Some(_), .. } => self.0.contains(&at),
            _ => true,
        }
    }

    /// The same with one element more, or less.
    pub fn toggled(&self, at: usize) -> Self {
        let mut list = self.0.clone();
        match list.iter().position(|&i| i == at) {
            Some(i) => {
                list.remove(i);
            }
            None => list.push(at),
        }
        list.sort_unstable();
        Presence(list)
    }
}

/// A change of the list of elements: what happens when a formula crosses zero.
#[derive(Clone, Debug)]
pub struct Change {
    /// `touch` or `lift_off`.
    pub kind: &'static str,
    /// The element.
    pub of: String,
    /// Its place in the list.
    pub at: usize,
    /// Negative before, positive after; or nothing where it is the least contact pressure of a piece.
    pub when: When,
}

/// What is watched.
#[derive(Clone, Debug)]
pub enum When {
    /// A formula that crosses zero.
    Formula(Formula),
    /// The length of a piece in eta, which vanishes when its contact is undone.
    Length(usize),
    /// The least contact pressure on a piece.
    Pressure(usize),
}

/// The branch that is asked for.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Name of the control.
    pub control: String,
    /// The values of the control at which states are reported.
    pub steps: Steps,
    /// Quantities whose limit points are located.
    pub limit_points: Vec<String>,
    /// Named stops: lhs - rhs = 0.
    pub stops: Vec<(String, Formula)>,
}

/// Values of the control, in order.
#[derive(Clone, Debug, PartialEq)]
pub enum Steps {
    /// As listed.
    Listed(Vec<f64>),
    /// Equally spaced.
    Spaced {
        /// The first state reported; without it the initial state is reported and the steps follow.
        from: Option<f64>,
        /// The last one.
        to: f64,
        /// How many are reported, `from` and `to` included, the initial state not.
        count: usize,
        /// Equal ratios instead of equal differences.
        log: bool,
    },
    /// Growing without a last one: until a stop, or as far as states exist.
    Open {
        /// The first state reported, if not the initial one.
        from: Option<f64>,
        /// The difference between two.
        step: f64,
    },
}

/// Values of the control at most, where no last one is given.
const MOST_STEPS: usize = 2000;

impl Steps {
    /// True if the first state reported is given, rather than the initial state.
    pub fn has_first(&self) -> bool {
        matches!(self, Steps::Spaced { from: Some(_), .. } | Steps::Open { from: Some(_), .. } | Steps::Listed(_))
    }

    /// The values, given the control in the initial state.
    pub fn targets(&self, start: f64) -> Vec<f64> {
        match *self {
            Steps::Listed(ref list) => list.clone(),
            Steps::Open { from, step } => {
                let first = from.unwrap_or(start + step);
                (0..MOST_STEPS).map(|i| first + step * i as f64).collect()
            }
            Steps::Spaced { from, to, count, log } => {
                let (first, skip) = match from {
                    Some(from) => (from, 0),
                    None => (start, 1),
                };
                let last = count + skip - 1;
                (skip..=last)
                    .map(|i| match i as f64 / last.max(1) as f64 {
                        _ if i == last => to,
                        t if log => first * (to / first).powf(t),
                        t => first + (to - first) * t,
                    })
                    .collect()
            }
        }
    }
}

/// An expected value of independent origin.
#[derive(Clone, Debug)]
pub struct Expectation {
    /// Settings under which it holds, as `--set` takes them.
    pub set: Vec<(String, String)>,
    /// The state: a quantity and its value; nothing means the only state.
    pub at: Option<(String, f64)>,
    /// Quantity and expected value.
    pub values: Vec<(String, f64)>,
    /// Relative tolerance.
    pub relative: f64,
    /// Where the values come from.
    pub source: String,
    /// True where a converged solution must *not* reproduce them.
    pub refuted: bool,
}

/// A problem, understood.
#[derive(Clone, Debug)]
pub struct Model {
    /// Its title.
    pub title: String,
    /// What it was understood from.
    pub problem: Arc<Problem>,
    /// Name of each global, in the order of the system.
    pub globals: Vec<String>,
    /// The initial state, in closed form.
    pub initial: Initial,
    /// Initial value of each global.
    pub initial_globals: Vec<f64>,
    /// Parameters with the values that are reported (in the unit of the file).
    pub parameters: Vec<(String, f64)>,
    /// Everything that is reported besides the parameters.
    pub quantities: Vec<Quantity>,
    /// The equations.
    pub system: System,
    /// The bodies that the membrane touches along a face.
    pub bodies: Vec<Body>,
    /// The sharp edges over which it is bent.
    pub edges: Vec<Edge>,
    /// The elements that are present in this stage.
    pub presence: Presence,
    /// What may change them.
    pub changes: Vec<Change>,
    /// Names of the contacts and kinks that are present.
    pub present: Vec<String>,
    /// Names of unknowns and conditions, with origin.
    pub ledger: Ledger,
    /// The branch.
    pub branch: Branch,
    /// Exact relations, lhs - rhs and both sides, checked at every state.
    pub identities: Vec<(String, Formula, Formula)>,
    /// Expected values.
    pub expectations: Vec<Expectation>,
    /// Relative error asked of every reported quantity.
    pub accuracy: f64,
    /// 2 where the model is half of the membrane, 1 else.
    pub images: f64,
    /// The global that is the pressure of the fluid.
    pub fluid_pressure: Option<usize>,
    /// Axial position of the start of each piece.
    pub heights: Vec<Formula>,
    /// Known conditions that the file does not necessarily have, by name: what may close a set that leaves something free.
    pub known_conditions: Vec<(String, Formula)>,
}

impl Model {
    /// The same problem with one element of the meridian more, or less.
    ///
    /// # Errors
    /// As [`resolve`].
    pub fn toggled(&self, element: usize) -> Result<Model, Vec<Diagnostic>> {
        resolve_stage(&self.problem, &self.presence.toggled(element))
    }

    /// The stage: the names of the contacts and kinks that are present.
    pub fn stage(&self) -> String {
        if self.present.is_empty() { "free".to_owned() } else { self.present.join("+") }
    }

    /// The quantity of that name.
    pub fn quantity(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|q| q.name == name)
    }
}

/// Escapes a name for a JSON pointer.
pub(crate) fn token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// Understands a problem in its first stage, and makes sure that the stages with one element more mean something too.
///
/// # Errors
/// Everything that is wrong with it, with places as JSON pointers.
pub fn resolve(problem: &Problem) -> Result<Model, Vec<Diagnostic>> {
    let model = resolve_stage(problem, &Presence::default())?;
    for change in &model.changes {
        resolve_stage(problem, &model.presence.toggled(change.at))?;
    }
    Ok(model)
}

/// Understands a problem in a stage of its own.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_stage(problem: &Problem, presence: &Presence) -> Result<Model, Vec<Diagnostic>> {
    let mut errors = vec![];
    unsupported(problem, &mut errors);
    let names = Names::new(problem, &mut errors);
    let Some(initial) = initial::resolve(problem, &names, &mut errors) else { return Err(errors) };
    let initial = initial.charged(tractions::repulsion(problem, &names));
    if initial.charge.is_some() && initial.pressure <= 0.0 {
        errors.push(
            Diagnostic::error("no-tension", "the repulsion of the charge leaves the inflated membrane no tension")
                .at("/tractions", format!("its over-pressure would be {:.6}", initial.pressure))
                .help("a smaller coupling, or more inflation"),
        );
        return Err(errors);
    }
    let names = names.with_initial(&initial);
    let Some(walk) = meridian::walk(problem, presence, names, &initial, &mut errors) else { return Err(errors) };
    let meridian::Walk { mut names, initial, mut system, mut ledger, globals, initial_globals, mut bodies, .. } = walk;
    let (edges, images, heights) = (walk.edges, walk.images, walk.heights);
    names.definitions(&system, &mut errors);

    // Fluid, constraints, branch: the conditions that belong to no place.
    fluid(problem, &mut names, &initial, &mut system, &mut ledger, images, &mut errors);
    for (name, equation) in &problem.constraints {
        let pointer = format!("/constraints/{}", token(name));
        if let Some(f) = names.equation(&system, equation.as_str(), &pointer, true, &mut errors) {
            system.conditions.push(f);
            ledger.condition(name.clone(), equation.as_str().to_owned(), "constraint".into());
        }
    }
    let branch = branch(problem, &mut names, &initial, &mut system, &mut ledger, &mut errors);
    ledger.check(problem, &system, &mut errors);

    let quantities = quantities(problem, &mut names, &system, &mut errors);
    for body in &mut bodies {
        let at = problem.bodies.get_index_of(&body.name).expect("a body of the file");
        let number = &problem.bodies[at].h;
        if let Some(h) = names.number(&system, number, &format!("/bodies/{}/h", token(&body.name)), &mut errors) {
            body.h = h;
        }
    }
    let mut identities = vec![];
    for (name, equation) in &problem.identities {
        let pointer = format!("/identities/{}", token(name));
        if let Some((lhs, rhs)) = names.sides(&system, equation.as_str(), &pointer, &mut errors) {
            identities.push((name.clone(), lhs, rhs));
        }
    }
    let known_conditions = known_conditions(&mut names, &system);
    let changes = changes(problem, presence, &mut names, &system, &mut errors);
    let mut present: Vec<String> = vec![];
    for (i, element) in problem.meridian.iter().flatten().enumerate() {
        match element {
            Element::Contact { on, name, .. } if presence.has(element, i) => {
                present.push(name.as_ref().unwrap_or(on).as_str().to_owned());
            }
            Element::Kink { at, .. } if presence.has(element, i) => present.push(at.as_str().to_owned()),
            _ => {}
        }
    }
    unused(problem, &names, &mut errors);
    let expectations = expectations(problem, &names, &mut errors);
    if !errors.iter().all(|e| e.severity == crate::diagnostic::Severity::Warning) {
        return Err(errors);
    }
    let Some(branch) = branch else { return Err(errors) };
    Ok(Model {
        title: problem.title.clone(),
        problem: Arc::new(problem.clone()),
        globals,
        fluid_pressure: names.fluid_pressure,
        initial,
        initial_globals,
        parameters: names.reported_parameters(),
        quantities,
        system,
        bodies,
        edges,
        presence: presence.clone(),
        changes,
        present,
        ledger,
        branch,
        identities,
        expectations,
        accuracy: problem.accuracy.map_or(1e-9, |a| a.get()),
        images,
        heights,
        known_conditions,
    })
}

/// Conditions of the catalogue at the joints that have names, and what fixes the membrane on the axis.
fn known_conditions(names: &mut Names, system: &System) -> Vec<(String, Formula)> {
    let mut texts = vec![];
    for joint in &names.joints {
        let j = &joint.name;
        let sides = |field: &str| format!("{j}.before.{field} = {j}.after.{field}");
        texts.push((
            format!("{j}: frictionless edge (lambda w_l - w continuous)"),
            format!("{j}.before.lambda*{j}.before.w_l - {j}.before.w = {j}.after.lambda*{j}.after.w_l - {j}.after.w"),
        ));
        for field in ["lambda", "w_l", "u", "tau"] {
            texts.push((format!("{j}: {field} continuous"), sides(field)));
        }
        texts.push((format!("{j}: material place given"), format!("{j}.phi = 0")));
        texts.push((format!("{j}: axial position given"), format!("{j}.after.h = 0")));
    }
    texts.push(("axial position of the membrane given".to_owned(), "membrane.start.h = 0".to_owned()));
    let mut found = vec![];
    for (name, text) in texts {
        if let Some(f) = names.equation(system, &text, "", true, &mut vec![]) {
            found.push((name, f));
        }
    }
    found
}

/// What changes the list of elements, from this stage.
fn changes(
    problem: &Problem,
    presence: &Presence,
    names: &mut Names,
    system: &System,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Change> {
    let mut list = vec![];
    for (i, element) in problem.meridian.iter().flatten().enumerate() {
        let Element::Contact { on, name, appears: Some(appears), .. } = element else {
            if let Element::Kink { appears: Some(_), .. } = element {
                errors.push(
                    Diagnostic::error(
                        "not-supported",
                        "a kink that appears by an event cannot be solved by this version",
                    )
                    .at(format!("/meridian/{i}"), "not supported yet"),
                );
            }
            continue;
        };
        let of = name.as_ref().unwrap_or(on).as_str().to_owned();
        if presence.has(element, i) {
            let Some(piece) = names.pieces.iter().position(|p| p.name == of) else { continue };
            list.push(Change { kind: "lift_off", of: of.clone(), at: i, when: When::Length(piece) });
            list.push(Change { kind: "lift_off", of, at: i, when: When::Pressure(piece) });
            continue;
        }
        let pointer = format!("/meridian/{i}/Contact/appears");
        let text = match appears {
            spec::Appears::When(equation) => equation.as_str().to_owned(),
            // A wall is touched where the free segment before or after it stands upright at its radius.
            spec::Appears::OnTouch => {
                let neighbour = |j: usize| match problem.meridian.as_ref()?.get(j)? {
                    Element::Free { name, .. } => Some(name.as_str().to_owned()),
                    _ => None,
                };
                match (i.checked_sub(1).and_then(neighbour), neighbour(i + 1)) {
                    (Some(before), None) => format!("{before}.end.tau = pi/2"),
                    (None, Some(after)) => format!("{after}.start.tau = pi/2"),
                    _ => {
                        errors.push(
                            Diagnostic::error("not-supported", "this contact needs to be told when it appears")
                                .at(pointer, "write When(\"..\")"),
                        );
                        continue;
                    }
                }
            }
        };
        if let Some(f) = names.equation(system, &text, &format!("{pointer}/When"), false, errors) {
            list.push(Change { kind: "touch", of, at: i, when: When::Formula(f) });
        }
    }
    list
}

/// Words that the format has and this version does not solve.
fn unsupported(problem: &Problem, errors: &mut Vec<Diagnostic>) {
    let mut refuse = |present: bool, pointer: &str, what: &str| {
        if present {
            errors.push(
                Diagnostic::error("not-supported", format!("{what} cannot be solved by this version"))
                    .at(pointer, "not supported yet"),
            );
        }
    };
    refuse(problem.units.is_some(), "/units", "a file with units of measurement");
    refuse(problem.contact == spec::ContactSearch::Detect, "/contact", "detected contact");
    refuse(problem.wrinkling == spec::Wrinkling::Relax, "/wrinkling", "the relaxed energy");
    refuse(problem.sweep.is_some(), "/sweep", "a sweep");
}

/// The pressure of the fluid and its equation.
fn fluid(
    problem: &Problem,
    names: &mut Names,
    initial: &Initial,
    system: &mut System,
    ledger: &mut Ledger,
    images: f64,
    errors: &mut Vec<Diagnostic>,
) {
    let (Some(fluid), Some(p_f)) = (&problem.fluid, names.fluid_pressure) else { return };
    let volume = "membrane.volume";
    let (text, pointer, origin) = match fluid {
        spec::Fluid::Incompressible => (format!("{volume} = initial.{volume}"), "/fluid", "fluid (Incompressible)"),
        spec::Fluid::Volume(v) => (format!("{volume} = {}", bracket(v)), "/fluid/Volume", "fluid (Volume)"),
        spec::Fluid::Pressure(p) => (format!("p_f = {}", bracket(p)), "/fluid/Pressure", "fluid (Pressure)"),
        spec::Fluid::Compressible { bulk_modulus } => (
            format!("p_f = initial.p_f + {}*(1 - {volume}/initial.{volume})", bracket(bulk_modulus)),
            "/fluid/Compressible/bulk_modulus",
            "fluid (Compressible)",
        ),
        spec::Fluid::IdealGas { ambient_pressure } => {
            let a = bracket(ambient_pressure);
            (
                format!("(p_f + {a})*{volume} = (initial.p_f + {a})*initial.{volume}"),
                "/fluid/IdealGas/ambient_pressure",
                "fluid (IdealGas)",
            )
        }
        spec::Fluid::Osmotic { osmotic_pressure, excluded_volume } => {
            let (o, b) = (bracket(osmotic_pressure), bracket(excluded_volume));
            (
                format!("p_f = initial.p_f + {o}*((initial.{volume} - {b})/({volume} - {b}) - 1)"),
                "/fluid/Osmotic",
                "fluid (Osmotic)",
            )
        }
        spec::Fluid::Law(law) => (law.as_str().to_owned(), "/fluid/Law", "fluid (Law)"),
    };
    let _ = (p_f, initial, images);
    if let Some(f) = names.equation(system, &text, pointer, true, errors) {
        system.conditions.push(f);
        let name = if matches!(fluid, spec::Fluid::Pressure(_)) { "fluid: pressure" } else { "fluid: volume" };
        ledger.condition(name.into(), text, origin.into());
    }
}

/// A number as a part of a longer formula.
pub(crate) fn bracket(number: &Number) -> String {
    match number {
        Number::Value(v) => format!("({v})"),
        Number::Formula(f) => format!("({f})"),
    }
}

fn branch(
    problem: &Problem,
    names: &mut Names,
    initial: &Initial,
    system: &mut System,
    ledger: &mut Ledger,
    errors: &mut Vec<Diagnostic>,
) -> Option<Branch> {
    let Some(said) = &problem.branch else {
        // One state: nothing moves. The last condition must then come from the file.
        errors.push(
            Diagnostic::error("no-branch", "the file does not say which branch of states is asked for")
                .at("", "no `branch` in this problem")
                .help("name the unknown or output that moves: branch: (control: \"..\", from: .., to: .., steps: ..)"),
        );
        return None;
    };
    let control = said.control.as_str();
    let pointer = "/branch/control";
    if problem.parameters.contains_key(control) {
        errors.push(
            Diagnostic::error("control-is-given", format!("the control `{control}` is a parameter, which is given"))
                .at(pointer, "given, so it cannot be found")
                .at_key(format!("/parameters/{}", token(control)), "declared as a parameter here")
                .help(format!(
                    "declare it among the unknowns with its initial value: unknowns: {{ \"{control}\": .. }}"
                )),
        );
        return None;
    }
    if !problem.unknowns.contains_key(control) && !problem.outputs.contains_key(control) && control != "p_f" {
        let known: Vec<&str> = problem.unknowns.keys().chain(problem.outputs.keys()).map(String::as_str).collect();
        let mut d =
            Diagnostic::error("unknown-name", format!("the control `{control}` is neither an unknown nor an output"))
                .at(pointer, "no unknown or output has this name");
        if let Some(near) = crate::expr::nearest(control, known.iter().copied()) {
            d = d.help(format!("did you mean `{near}`?"));
        }
        errors.push(d.help(format!("unknowns and outputs: {}", known.join(", "))));
        return None;
    }
    let of = names.formula(system, control, pointer, true, errors)?;
    if of.slots().is_empty() {
        errors.push(
            Diagnostic::error("control-is-constant", format!("the control `{control}` is the same in every state"))
                .at(pointer, "changes nothing"),
        );
        return None;
    }
    ledger.condition(format!("branch: {control}"), format!("{control} = given"), "branch".into());
    let before = errors.len();
    let mut constant = |number: &Option<Number>, key: &str| -> Option<f64> {
        number.as_ref().and_then(|n| names.constant(n, &format!("/branch/{key}"), errors))
    };
    let (from, to) = (constant(&said.from, "from"), constant(&said.to, "to"));
    let count = said.steps.map_or(20, |s| s.get());
    let log = said.spacing == spec::Spacing::Log;
    let steps = if let Some(at) = &said.at {
        if said.from.is_some() || said.to.is_some() || said.steps.is_some() {
            errors.push(
                Diagnostic::error("branch-at", "a branch has either a list `at` or `from`, `to` and `steps`")
                    .at("/branch", "both are given"),
            );
        }
        let values = at.iter().enumerate();
        Steps::Listed(values.filter_map(|(i, n)| names.constant(n, &format!("/branch/at/{i}"), errors)).collect())
    } else if let Some(to) = to {
        if log && !from.or(names.initial_value(control, initial)).is_some_and(|first| first * to > 0.0) {
            errors.push(
                Diagnostic::error(
                    "log-spacing",
                    "logarithmic spacing needs `from` and `to` of the same sign, not zero",
                )
                .at("/branch/spacing", "not possible here"),
            );
        }
        Steps::Spaced { from, to, count, log }
    } else {
        // The control grows until a stop, or as far as states exist; `steps` of them span five times the size of the initial shape.
        Steps::Open { from, step: 10.0 * initial.radius / count as f64 }
    };
    let _ = before;
    let mut stops = vec![];
    for (name, equation) in &said.stops {
        let pointer = format!("/branch/stops/{}", token(name));
        if let Some(f) = names.equation(system, equation.as_str(), &pointer, false, errors) {
            stops.push((name.clone(), f));
        }
    }
    let mut limit_points = vec![];
    for (i, name) in said.limit_points.iter().enumerate() {
        let name = name.as_str();
        if problem.unknowns.contains_key(name) || problem.outputs.contains_key(name) || name == "p_f" {
            limit_points.push(name.to_owned());
        } else {
            let known: Vec<&str> = problem.unknowns.keys().chain(problem.outputs.keys()).map(String::as_str).collect();
            errors.push(
                Diagnostic::error("unknown-name", format!("`{name}` is neither an unknown nor an output"))
                    .at(format!("/branch/limit_points/{i}"), "no quantity has this name")
                    .help(format!("unknowns and outputs: {}", known.join(", "))),
            );
        }
    }
    system.closing = crate::system::Closing::Value { of, target: 0.0 };
    Some(Branch { control: control.to_owned(), steps, limit_points, stops })
}

fn quantities(problem: &Problem, names: &mut Names, system: &System, errors: &mut Vec<Diagnostic>) -> Vec<Quantity> {
    let mut list = vec![];
    let mut add = |list: &mut Vec<Quantity>, name: &str, text: &str, pointer: String, errors: &mut Vec<Diagnostic>| {
        if list.iter().any(|q: &Quantity| q.name == name) {
            return;
        }
        if let Some(formula) = names.formula(system, text, &pointer, false, errors) {
            list.push(Quantity { name: name.to_owned(), formula });
        }
    };
    for name in problem.unknowns.keys() {
        add(&mut list, name, name, format!("/unknowns/{}", token(name)), errors);
    }
    if problem.fluid.is_some() {
        add(&mut list, "p_f", "p_f", "/fluid".into(), errors);
    }
    for (name, number) in &problem.outputs {
        let text = match number {
            Number::Value(v) => format!("{v}"),
            Number::Formula(f) => f.clone(),
        };
        add(&mut list, name, &text, format!("/outputs/{}", token(name)), errors);
    }
    for (name, text) in [("P_i", "initial.w_l"), ("lambda_i", "initial.lambda"), ("p_f0", "initial.overpressure")] {
        if !problem.outputs.contains_key(name) && !problem.parameters.contains_key(name) {
            add(&mut list, name, text, String::new(), errors);
        }
    }
    list
}

/// Unknowns that nothing depends on.
fn unused(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) {
    for name in problem.unknowns.keys() {
        if !names.used.contains(name.as_str()) {
            errors.push(
                Diagnostic::error("unused-unknown", format!("no condition depends on the unknown `{name}`"))
                    .at_key(format!("/unknowns/{}", token(name)), "used nowhere, so nothing can determine it"),
            );
        }
    }
}

fn expectations(problem: &Problem, names: &Names, errors: &mut Vec<Diagnostic>) -> Vec<Expectation> {
    let mut list = vec![];
    for (i, e) in problem.expect.iter().enumerate() {
        let pointer = format!("/expect/{i}");
        let mut at = vec![];
        for (name, number) in &e.at {
            if let Some(v) = names.constant(number, &format!("{pointer}/at/{}", token(name)), errors) {
                at.push((name.clone(), v));
            }
        }
        if at.len() > 1 {
            errors.push(
                Diagnostic::error("expect-at", "an expectation names one quantity in `at`; parameters belong in `set`")
                    .at(format!("{pointer}/at"), "more than one"),
            );
        }
        let mut values = vec![];
        for (name, number) in &e.values {
            let known = problem.outputs.contains_key(name) || problem.unknowns.contains_key(name) || name == "p_f";
            if !known {
                errors.push(
                    Diagnostic::error("unknown-name", format!("`{name}` is not a reported quantity"))
                        .at_key(format!("{pointer}/values/{}", token(name)), "no output or unknown has this name"),
                );
            }
            if let Some(v) = names.constant(number, &format!("{pointer}/values/{}", token(name)), errors) {
                values.push((name.clone(), v));
            }
        }
        let set = e.set.iter().map(|(k, v)| (k.clone(), v.to_string())).collect();
        list.push(Expectation {
            set,
            at: at.into_iter().next(),
            values,
            relative: e.relative.get(),
            source: e.source.clone(),
            refuted: e.refuted.is_some(),
        });
    }
    list
}

/// Errors of a formula as diagnostics at its place in the file.
pub(crate) fn formula_errors(pointer: &str, errors: Vec<expr::ExprError>) -> Vec<Diagnostic> {
    errors
        .into_iter()
        .map(|e| {
            let mut d = Diagnostic::error(e.code, e.message).within(pointer, e.span, "");
            if let Some(help) = e.help {
                d = d.help(help);
            }
            d
        })
        .collect()
}

/// The direction of facing in the words of the physics.
pub(crate) fn facing(f: spec::Facing) -> Facing {
    match f {
        spec::Facing::Up => Facing::Up,
        spec::Facing::Down => Facing::Down,
    }
}

/// True where a formula can be a condition.
pub(crate) fn is_condition(formula: &Formula) -> bool {
    formula.probes().all(Probe::is_local)
}
