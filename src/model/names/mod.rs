//! Names: what is declared, and what a name means in a formula.
//!
//! [`Names`] knows everything that has a name: parameters, unknowns, definitions, bodies, and, once the meridian is walked,
//! its pieces and joints. It is filled in steps, and a formula may use what is known at its step (`Level`). [`formulas`]
//! turns the texts of a file into formulas of the solution, [`scope`] gives bare names their meaning, [`places`] dotted
//! ones, such as `cone.end.u`, and [`readings`] calls, such as `membrane.max(w_l)`.

mod formulas;
mod places;
mod readings;
mod scope;

pub use scope::Binder;

use super::{Initial, formula_errors, token};
use crate::diagnostic::Diagnostic;
use crate::expr::{self, Builder};
use crate::spec::{Number, Problem};
use crate::system::{FieldFormula, Piece, Reading};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};

/// Fields of the local state, which a formula without a place cannot use.
const LOCAL: [&str; 14] = ["S", "phi", "t", "rho0", "h0", "u", "h", "lambda", "mu", "tau", "w", "w_l", "w_m", "p_c"];

/// A piece of the meridian as formulas see it.
#[derive(Clone, Debug)]
pub struct PieceName {
    /// Its name.
    pub name: String,
    /// The body it lies on, as an index into the bodies of the file.
    pub body: Option<usize>,
    /// The element of the meridian that it is, or is a part of.
    pub element: usize,
    /// Which of the faces that meet smoothly it lies on.
    pub part: usize,
    /// How many they are.
    pub chain: usize,
    /// The global that is the axial position of its start; nothing on a face, and where h is a state.
    pub h0: Option<usize>,
}

/// A joint with a name.
#[derive(Clone, Debug)]
pub struct JointName {
    /// Its name.
    pub name: String,
    /// The body whose edge it is, as an index into the bodies of the file.
    pub body: Option<usize>,
    /// Its position below the foremost point of that body on the axis.
    pub behind: f64,
    /// The piece before it.
    pub before: usize,
    /// The piece after it.
    pub after: usize,
}

/// Where the initial sphere stands, and what touches it.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Axial position of its middle.
    pub middle: f64,
    /// The material angle at which each joint starts.
    pub joints: Vec<f64>,
}

/// Everything that has a name.
pub struct Names<'a> {
    problem: &'a Problem,
    parameters: HashMap<&'a str, f64>,
    /// True while the parameters themselves are read.
    reading: bool,
    reported: Vec<(String, f64)>,
    initial_values: HashMap<&'a str, f64>,
    initial: Option<Initial>,
    /// Globals of the declared unknowns.
    pub unknowns: HashMap<String, usize>,
    /// The global that is the pressure of the fluid.
    pub fluid_pressure: Option<usize>,
    /// The pieces in walking order.
    pub pieces: Vec<PieceName>,
    /// The joints that have names.
    pub joints: Vec<JointName>,
    /// Names of segments and joints that are absent in this stage.
    pub absent: Vec<String>,
    /// 2 where the model is half of the membrane.
    pub images: f64,
    /// The initial membrane, once it is known where it stands.
    pub standing: Option<Standing>,
    shapes: Vec<Piece>,
    /// Fields whose integrals over a piece are asked for.
    pub integrals: RefCell<Vec<(usize, std::sync::Arc<FieldFormula>)>>,
    /// Numbers read off fields.
    pub readings: RefCell<Vec<Reading>>,
    /// The unknowns that conditions depend on.
    pub used: HashSet<String>,
    touched: RefCell<HashSet<String>>,
}

/// What a formula may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    /// Parameters.
    Constant,
    /// The initial state: unknowns have their declared values.
    Initial,
    /// Everything.
    Full,
}

impl<'a> Names<'a> {
    /// Names of what is given. Definitions are read for their own mistakes here, once.
    pub fn new(problem: &'a Problem, errors: &mut Vec<Diagnostic>) -> Self {
        let mut names = Names {
            problem,
            parameters: HashMap::new(),
            reading: true,
            reported: vec![],
            initial_values: HashMap::new(),
            initial: None,
            unknowns: HashMap::new(),
            fluid_pressure: None,
            pieces: vec![],
            joints: vec![],
            absent: vec![],
            images: 1.0,
            standing: None,
            shapes: vec![],
            integrals: RefCell::default(),
            readings: RefCell::default(),
            used: HashSet::new(),
            touched: RefCell::default(),
        };
        names.declared_once(errors);
        for (name, number) in &problem.parameters {
            let pointer = format!("/parameters/{}", token(name));
            let value = match number {
                Number::Value(v) => Some((*v, *v)),
                Number::Formula(text) => match expr::parse(text) {
                    Err(e) => {
                        errors.extend(formula_errors(&pointer, vec![e]));
                        None
                    }
                    Ok(parsed) => {
                        let unit = parsed.units().first().map(|u| (*u).clone());
                        names.constant(number, &pointer, errors).map(|v| {
                            (v, unit.and_then(|u| u.from_radians(v)).map_or(v, |w| parsed.literal().map_or(w, |l| l.0)))
                        })
                    }
                },
            };
            if let Some((value, reported)) = value {
                if !value.is_finite() {
                    errors.push(
                        Diagnostic::error("not-finite", format!("the parameter `{name}` is {value}"))
                            .at(pointer, "not a finite number"),
                    );
                }
                names.parameters.insert(name, value);
                names.reported.push((name.clone(), reported));
            }
        }
        names.reading = false;
        names
    }

    /// The same names, with the initial state known; unknowns get their initial values.
    pub fn with_initial(mut self, initial: &Initial) -> Self {
        self.initial = Some(initial.clone());
        self
    }

    /// Evaluates the initial values of the unknowns.
    pub fn initial_values(&mut self, errors: &mut Vec<Diagnostic>) {
        for (name, number) in &self.problem.unknowns {
            let pointer = format!("/unknowns/{}", token(name));
            if let Some(v) = self.evaluate(number, &pointer, Level::Constant, errors) {
                if !v.is_finite() {
                    errors.push(
                        Diagnostic::error("not-finite", format!("the initial value of `{name}` is {v}"))
                            .at(pointer, "not a finite number"),
                    );
                }
                self.initial_values.insert(name, v);
            }
        }
    }

    /// Pieces, once they are known.
    pub fn with_pieces(
        mut self,
        pieces: Vec<PieceName>,
        joints: Vec<JointName>,
        absent: Vec<String>,
        shapes: Vec<Piece>,
        images: f64,
    ) -> Self {
        self.pieces = pieces;
        self.joints = joints;
        self.absent = absent;
        self.shapes = shapes;
        self.images = images;
        self
    }

    /// The initial state, with the pressure outside.
    pub fn surrounded(&mut self, outside: f64) -> Option<Initial> {
        let initial = self.initial.as_mut()?;
        initial.outside = outside;
        Some(initial.clone())
    }

    /// The pieces, when more is known of them.
    pub fn set_shapes(&mut self, pieces: &[Piece]) {
        self.shapes = pieces.to_vec();
    }

    /// Axial positions of the top and bottom of the initial membrane, once it is known where it stands.
    pub fn extent(&self) -> Option<(f64, f64)> {
        let (initial, standing) = (self.initial.as_ref()?, self.standing.as_ref()?);
        Some((standing.middle - initial.radius, standing.middle + initial.radius))
    }

    /// True where a body of the file faces down.
    pub fn faces_down(&self, body: usize) -> bool {
        self.problem.bodies[body].facing == crate::spec::Facing::Down
    }

    /// Parameters as they are reported.
    pub fn reported_parameters(&self) -> Vec<(String, f64)> {
        self.reported.clone()
    }

    /// No name may mean two things, and none may be a word of the language.
    fn declared_once(&self, errors: &mut Vec<Diagnostic>) {
        let p = self.problem;
        let blocks: [(&str, Vec<&String>); 6] = [
            ("parameters", p.parameters.keys().collect()),
            ("unknowns", p.unknowns.keys().collect()),
            ("definitions", p.definitions.keys().collect()),
            ("outputs", p.outputs.keys().collect()),
            ("bodies", p.bodies.keys().collect()),
            ("tractions", p.tractions.keys().collect()),
        ];
        let mut seen: HashMap<&str, &str> = HashMap::new();
        for (block, names) in &blocks {
            for name in names {
                let pointer = format!("/{block}/{}", token(name));
                if !expr::is_identifier(name) {
                    errors.push(
                        Diagnostic::error("malformed-name", format!("`{name}` cannot be used in a formula"))
                            .at_key(pointer.clone(), "letters, digits and _, not starting with a digit"),
                    );
                } else if (if *block == "bodies" { expr::has_meaning(name) } else { expr::is_reserved(name) })
                    || LOCAL.contains(&name.as_str())
                    || ["p_f", "membrane", "initial", "reference"].contains(&name.as_str())
                {
                    errors.push(
                        Diagnostic::error("reserved-name", format!("`{name}` already means something in formulas"))
                            .at_key(pointer.clone(), "choose another name"),
                    );
                }
                if let Some(before) = seen.insert(name, block) {
                    errors.push(
                        Diagnostic::error("declared-twice", format!("`{name}` is declared twice"))
                            .at_key(pointer, "declared again here")
                            .at_key(format!("/{before}/{}", token(name)), "declared here"),
                    );
                }
            }
        }
    }

    fn evaluate(&self, number: &Number, pointer: &str, level: Level, errors: &mut Vec<Diagnostic>) -> Option<f64> {
        let text = match number {
            Number::Value(v) => return Some(*v),
            Number::Formula(text) => text,
        };
        let parsed = match expr::parse(text) {
            Ok(e) => e,
            Err(e) => {
                errors.extend(formula_errors(pointer, vec![e]));
                return None;
            }
        };
        let mut binder = Binder::new(self, level, false);
        let mut builder = Builder::new();
        match builder.add(&parsed, &mut binder) {
            Ok(node) => builder.value(node).or_else(|| {
                errors
                    .push(Diagnostic::error("not-constant", "a constant is needed here").at(pointer, "not a constant"));
                None
            }),
            Err(e) => {
                errors.extend(formula_errors(pointer, e));
                None
            }
        }
    }

    /// A number that depends on parameters only.
    pub fn constant(&self, number: &Number, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<f64> {
        let value = self.evaluate(number, pointer, Level::Constant, errors)?;
        if !value.is_finite() {
            errors.push(Diagnostic::error("not-finite", format!("this is {value}")).at(pointer, "not a finite number"));
            return None;
        }
        Some(value)
    }

    /// A number in the initial state.
    pub fn at_start(&self, number: &Number, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<f64> {
        self.evaluate(number, pointer, Level::Initial, errors)
    }

    /// The initial value of an unknown, or of the pressure of the fluid.
    pub fn initial_value(&self, name: &str, initial: &Initial) -> Option<f64> {
        if name == "p_f" {
            return Some(initial.pressure + initial.outside);
        }
        self.initial_values.get(name).copied()
    }

    fn known(&self) -> Vec<&str> {
        let p = self.problem;
        let mut k: Vec<&str> = p
            .parameters
            .keys()
            .chain(p.unknowns.keys())
            .chain(p.definitions.keys())
            .chain(p.outputs.keys())
            .map(String::as_str)
            .collect();
        if p.fluid.is_some() {
            k.push("p_f");
        }
        k
    }
}
