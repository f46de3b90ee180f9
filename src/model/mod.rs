//! What a problem file means: names bound, the meridian walked, unknowns and conditions counted.
//!
//! [`resolve`] turns the words of a file ([`crate::spec`]) into a [`Model`]: a [`System`] with a name for every unknown and
//! every condition. It collects every mistake before it gives up. A `Model` is proof that the count closes.

mod branch;
mod fluid;
mod initial;
mod ledger;
mod material;
mod meridian;
mod names;
mod reported;
mod set;
mod stage;
mod tractions;

pub use branch::{Branch, Steps};
pub use initial::Initial;
pub use ledger::{Entry, Ledger};
pub use meridian::Rigid;
pub use reported::{Expectation, Quantity};
pub use set::{in_unit_of, set};
pub use stage::{Change, Grip, Part, Presence, To, When};

use crate::diagnostic::{Diagnostic, Severity};
use crate::expr;
use crate::physics::surface::Facing;
use crate::spec::{self, Element, Number, Problem, Sweep};
use crate::system::{Formula, Probe, Reading, System};
use names::Names;
use std::collections::HashSet;
use std::sync::Arc;

/// A rigid body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// Its faces and edges.
    pub rigid: Rigid,
    /// Axial position of its foremost point on the axis.
    pub h: Formula,
    /// The pieces that lie on it.
    pub pieces: Vec<usize>,
    /// The face on which each of these pieces lies.
    pub faces: Vec<usize>,
}

impl Body {
    /// How deep a point at radius `u`, `drop` below the foremost point on the axis, lies inside the solid (length); negative outside,
    /// nothing where no face stands there.
    pub fn penetration(&self, u: f64, drop: f64) -> Option<f64> {
        self.rigid.penetration(u, drop)
    }

    /// How far the point at parameter `t` of the face on which a piece lies is beyond the end of that face (length), and the name of
    /// the face; nothing where it is on the face.
    pub fn overhang(&self, piece: usize, t: f64) -> Option<(f64, &str)> {
        let on = self.pieces.iter().position(|&p| p == piece)?;
        let face = &self.rigid.faces[self.faces[on]];
        face.overhang(t).map(|far| (far, face.name.as_str()))
    }
}

/// A sharp edge over which the membrane is bent.
#[derive(Clone, Debug)]
pub struct Edge {
    /// Its name.
    pub name: String,
    /// The piece before it; the next one is after it.
    pub before: usize,
    /// The faces that meet in it, each with the direction (outwards, downwards) into its solid.
    pub faces: [(String, [f64; 2]); 2],
    /// Its friction and how it holds the membrane, where it has friction.
    pub grip: Option<(f64, Grip)>,
}

impl Edge {
    /// The force of the edge on the membrane, (outwards, downwards), as what each face would push with.
    pub fn pushes(&self, force: [f64; 2]) -> [(&str, f64); 2] {
        let [(first, m), (second, n)] = &self.faces;
        let cross = m[0] * n[1] - m[1] * n[0];
        let a = (force[0] * n[1] - force[1] * n[0]) / cross;
        let b = (m[0] * force[1] - m[1] * force[0]) / cross;
        [(first, -a), (second, -b)]
    }
}

/// The edge of an adhering contact.
#[derive(Clone, Debug)]
pub struct Adhesion {
    /// The piece before it; the next one is after it.
    pub before: usize,
    /// True if the piece before it is the free one.
    pub free_first: bool,
    /// Energy per reference area.
    pub energy: Formula,
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
    /// The rigid bodies.
    pub bodies: Vec<Body>,
    /// The sharp edges over which it is bent.
    pub edges: Vec<Edge>,
    /// The edges at which it adheres.
    pub adhesions: Vec<Adhesion>,
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
    /// Numbers that are read off fields.
    pub readings: Vec<Reading>,
    /// What is right, but probably not meant.
    pub warnings: Vec<Diagnostic>,
}

/// Why a problem could not be understood.
#[derive(Clone, Debug)]
pub struct Refused {
    /// Everything that is wrong with it, and the warnings; places are JSON pointers.
    pub diagnostics: Vec<Diagnostic>,
    /// What was counted, where every condition could be read; empty otherwise.
    pub ledger: Ledger,
}

impl Model {
    /// The same problem after a change of the elements, in a state in which the joint that it concerns lies at the material angle `phi`.
    ///
    /// # Errors
    /// As [`resolve`].
    pub fn after(&self, change: &Change, phi: f64) -> Result<Model, Refused> {
        resolve_stage(&self.problem, &self.presence.after(change, phi))
    }

    /// True if the membrane lies on a face.
    pub fn touches(&self) -> bool {
        self.system.pieces.iter().any(|p| matches!(p.kind, crate::system::Kind::Contact(_)))
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
pub fn token(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// Understands a problem in its first stage, and makes sure that the stages with one element more mean something too.
///
/// # Errors
/// Everything that is wrong with it, and the count where it does not close.
pub fn resolve(problem: &Problem) -> Result<Model, Refused> {
    let mut model = resolve_stage(problem, &Presence::default())?;
    let mut warnings = std::mem::take(&mut model.warnings);
    for change in &model.changes {
        let next = resolve_stage(problem, &model.presence.after(change, 1.0))?;
        let new: Vec<Diagnostic> = next.warnings.into_iter().filter(|w| !warnings.contains(w)).collect();
        warnings.extend(new);
    }
    Ok(Model { warnings, ..model })
}

/// True if there is an error among these, rather than warnings alone.
fn wrong(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(|d| d.severity == Severity::Error)
}

/// Understands a problem in a stage of its own.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_stage(problem: &Problem, presence: &Presence) -> Result<Model, Refused> {
    let (mut found, mut ledger) = (vec![], Ledger::default());
    match understand(problem, presence, &mut found, &mut ledger) {
        Some(model) if !wrong(&found) => Ok(Model { warnings: found, ..model }),
        _ => Err(Refused { diagnostics: found, ledger }),
    }
}

/// Collects what there is to say, and the count where every condition could be read.
fn understand(
    problem: &Problem,
    presence: &Presence,
    errors: &mut Vec<Diagnostic>,
    counted: &mut Ledger,
) -> Option<Model> {
    unsupported(problem, errors);
    let names = Names::new(problem, errors);
    let Some(initial) = initial::resolve(problem, &names, errors) else {
        // What does not depend on the initial state is examined all the same.
        meridian::examine(problem, presence, &names, errors);
        reported::expectations(problem, &names, errors);
        return None;
    };
    let initial = initial.charged(tractions::repulsion(problem, &names));
    if initial.charge.is_some() && initial.pressure <= 0.0 {
        errors.push(
            Diagnostic::error("no-tension", "the repulsion of the charge leaves the inflated membrane no tension")
                .at(
                    tractions::place_of_repulsion(problem),
                    format!("its over-pressure would be {:.6}", initial.pressure),
                )
                .help("a smaller coupling, or more inflation"),
        );
        return None;
    }
    let names = names.with_initial(&initial);
    let walk = meridian::walk(problem, presence, names, &initial, errors)?;
    let meridian::Walk { mut names, initial, mut system, mut ledger, globals, initial_globals, mut bodies, .. } = walk;
    let (edges, adhesions, images, heights) = (walk.edges, walk.adhesions, walk.images, walk.heights);
    names.definitions(&system, errors);
    material::tips(&system, &bodies, errors);

    // Fluid, constraints, branch: the conditions that belong to no place.
    fluid::fluid(problem, &mut names, &mut system, &mut ledger, errors);
    for (name, equation) in &problem.constraints {
        let pointer = format!("/constraints/{}", token(name));
        if let Some(f) = names.equation(&system, equation.as_str(), &pointer, true, errors) {
            system.conditions.push(f);
            ledger.condition(name.clone(), equation.as_str().to_owned(), "constraint".into());
        }
    }
    let branch = branch::branch(problem, &mut names, &initial, &mut system, &mut ledger, errors);
    if !wrong(errors) {
        // Otherwise a condition that could not be read would look like a missing one.
        ledger.check(problem, &system, errors);
        counted.clone_from(&ledger);
    }

    let quantities = reported::quantities(problem, &mut names, &system, errors);
    for body in &mut bodies {
        let at = problem.bodies.get_index_of(&body.name).expect("a body of the file");
        let number = &problem.bodies[at].h;
        if let Some(h) = names.number(&system, number, &format!("/bodies/{}/h", token(&body.name)), errors) {
            body.h = h;
        }
    }
    let mut identities = vec![];
    for (name, equation) in &problem.identities {
        let pointer = format!("/identities/{}", token(name));
        if let Some((lhs, rhs)) = names.sides(&system, equation.as_str(), &pointer, errors) {
            identities.push((name.clone(), lhs, rhs));
        }
    }
    let known_conditions = reported::known_conditions(&mut names, &system);
    let changes = stage::changes(problem, presence, &mut names, &system, &bodies, errors);
    let mut present: Vec<String> = vec![];
    for (i, element) in problem.meridian.iter().flatten().enumerate() {
        match element {
            Element::Contact { on, name, .. } if presence.has(element, i) => {
                present.push(name.as_ref().unwrap_or(on).as_str().to_owned());
                present.extend(names.pieces.iter().filter(|p| p.element == i && p.part > 0).map(|p| p.name.clone()));
            }
            Element::Kink { at, .. } if presence.has(element, i) => {
                let slides = matches!(presence.grip(i), Grip::Forward | Grip::Backward);
                present.push(format!("{}{}", at.as_str(), if slides { " (sliding)" } else { "" }));
            }
            _ => {}
        }
    }
    reported::unused(problem, &names, errors);
    let expectations = reported::expectations(problem, &names, errors);
    for (piece, field) in names.integrals.take() {
        system.integrate(piece, field);
    }
    let readings = names.readings.take();
    unused_parameters(problem, errors);
    Some(Model {
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
        adhesions,
        presence: presence.clone(),
        changes,
        present,
        ledger,
        branch: branch?,
        identities,
        expectations,
        accuracy: problem.accuracy.map_or(1e-9, |a| a.get()),
        images,
        heights,
        known_conditions,
        readings,
        warnings: vec![],
    })
}

/// Parameters that no formula of the file names.
fn unused_parameters(problem: &Problem, warnings: &mut Vec<Diagnostic>) {
    if problem.parameters.is_empty() {
        return;
    }
    let mut rest = problem.clone();
    (rest.title, rest.about) = (String::new(), None);
    rest.parameters.clear();
    rest.expect.clear();
    // What a sweep sets is not used by that; what its cases use is.
    match &mut rest.sweep {
        Some(Sweep::Cases(cases)) => cases.iter_mut().for_each(|case| case.parameters.clear()),
        sweep => *sweep = None,
    }
    let text = serde_json::to_string(&rest).unwrap_or_default().replace("\\n", " ").replace("\\t", " ");
    let words: HashSet<&str> = text.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    for name in problem.parameters.keys().filter(|name| !words.contains(name.as_str())) {
        warnings.push(
            Diagnostic::warning("unused-parameter", format!("nothing depends on the parameter `{name}`"))
                .at_key(format!("/parameters/{}", token(name)), "used nowhere"),
        );
    }
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
}

/// A number as a part of a longer formula.
pub(crate) fn bracket(number: &Number) -> String {
    match number {
        Number::Value(v) => format!("({v})"),
        Number::Formula(f) => format!("({f})"),
    }
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
