//! Names and scopes: what a name in a formula means.

use super::{Initial, bracket, formula_errors, is_condition, token};
use crate::diagnostic::Diagnostic;
use crate::expr::{self, Argument, Builder, ExprError, Function, Node, Scope, Tape, UnitKind, nearest};
use crate::spec::{Number, Problem, Traction};
use crate::system::{Coordinate, Field, Formula, Kind, Piece, Probe, Side, System, Variable};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::ops::Range;

/// How deep definitions may use each other.
const MAX_CHAIN: usize = 64;

/// Fields of the local state, which a formula without a place cannot use.
const LOCAL: [&str; 15] =
    ["S", "phi", "t", "rho0", "h0", "u", "h", "lambda", "mu", "tau", "w", "w_l", "w_m", "p_c", "d"];

/// A piece of the meridian as formulas see it.
#[derive(Clone, Debug)]
pub struct PieceName {
    /// Its name.
    pub name: String,
    /// The body it lies on, as an index into the bodies of the file.
    pub body: Option<usize>,
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
    /// The piece before it.
    pub before: usize,
    /// The piece after it.
    pub after: usize,
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
    /// Axial positions of the top and bottom of the initial membrane, once they are known.
    pub extent: Option<(f64, f64)>,
    shapes: Vec<Piece>,
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
            extent: None,
            shapes: vec![],
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

    /// The pieces themselves.
    pub fn shapes(&self) -> &[Piece] {
        &self.shapes
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
                } else if expr::is_reserved(name)
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

    /// A formula of the solution.
    pub fn formula(
        &mut self,
        system: &System,
        text: &str,
        pointer: &str,
        condition: bool,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let parsed = expr::parse(text).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()?;
        self.bind(system, &[&parsed], pointer, condition, errors)
    }

    /// A number of the solution.
    pub fn number(
        &mut self,
        system: &System,
        number: &Number,
        pointer: &str,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        match number {
            Number::Value(v) => self.formula(system, &format!("{v}"), pointer, false, errors),
            Number::Formula(text) => self.formula(system, text, pointer, false, errors),
        }
    }

    /// lhs - rhs of an equation.
    pub fn equation(
        &mut self,
        system: &System,
        text: &str,
        pointer: &str,
        condition: bool,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let (lhs, rhs) =
            expr::parse_equation(text).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()?;
        self.bind(system, &[&lhs, &rhs], pointer, condition, errors)
    }

    /// Both sides of an equation.
    pub fn sides(
        &mut self,
        system: &System,
        text: &str,
        pointer: &str,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<(Formula, Formula)> {
        let (lhs, rhs) =
            expr::parse_equation(text).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()?;
        Some((self.bind(system, &[&lhs], pointer, false, errors)?, self.bind(system, &[&rhs], pointer, false, errors)?))
    }

    /// One formula, or the difference of two.
    fn bind(
        &mut self,
        system: &System,
        sides: &[&expr::Expr],
        pointer: &str,
        condition: bool,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let mut binder = Binder::new(self, Level::Full, condition);
        let mut builder = Builder::new();
        let mut nodes = vec![];
        let mut wrong = vec![];
        for side in sides {
            match builder.add(side, &mut binder) {
                Ok(node) => nodes.push(node),
                Err(e) => wrong.extend(e),
            }
        }
        let probes = binder.probes;
        if nodes.len() < sides.len() {
            errors.extend(formula_errors(pointer, wrong));
            if errors.is_empty() {
                errors.push(Diagnostic::error("unusable", "this depends on a formula that is wrong").at(pointer, ""));
            }
            return None;
        }
        let node = match nodes[..] {
            [one] => one,
            [lhs, rhs] => builder.sub(lhs, rhs),
            _ => unreachable!("one or two sides"),
        };
        builder.output(node);
        let formula = finish(system, builder.finish(), probes);
        self.used.extend(self.touched.borrow_mut().drain());
        if condition && !is_condition(&formula) {
            errors.push(
                Diagnostic::error("not-a-condition", "a condition cannot depend on a quantity that is only reported")
                    .at(pointer, "energies, areas, largest values and tip coefficients are evaluated afterwards"),
            );
            return None;
        }
        Some(formula)
    }

    /// A formula put together by the program rather than written in the file.
    pub fn build(
        &mut self,
        system: &System,
        condition: bool,
        make: impl FnOnce(&mut Builder, &mut Binder) -> Result<Node, Vec<ExprError>>,
    ) -> Option<Formula> {
        let mut binder = Binder::new(self, Level::Full, condition);
        let mut builder = Builder::new();
        let node = make(&mut builder, &mut binder).ok()?;
        let probes = binder.probes;
        builder.output(node);
        let formula = finish(system, builder.finish(), probes);
        self.used.extend(self.touched.borrow_mut().drain());
        Some(formula)
    }

    /// A formula over globals alone, for pressures: the tape and the globals it reads.
    pub fn globals(
        &mut self,
        number: &Number,
        pointer: &str,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<(Tape, Vec<usize>)> {
        let parsed = expr::parse(&bracket(number)).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()?;
        let mut binder = Binder::new(self, Level::Full, true);
        let mut builder = Builder::new();
        let node = builder.add(&parsed, &mut binder).map_err(|e| errors.extend(formula_errors(pointer, e))).ok()?;
        let probes = binder.probes;
        builder.output(node);
        let mut globals = vec![];
        for probe in &probes {
            match probe {
                Probe::Global(g) => globals.push(*g),
                _ => {
                    errors.push(
                        Diagnostic::error("not-uniform", "a pressure may depend on parameters and unknowns only")
                            .at(pointer, "depends on the shape"),
                    );
                    return None;
                }
            }
        }
        self.used.extend(self.touched.borrow_mut().drain());
        Some((builder.finish(), globals))
    }

    /// A traction: formulas over the local state and globals, as outputs of one tape.
    pub fn field(&mut self, texts: &[(&str, String)], errors: &mut Vec<Diagnostic>) -> Option<(Tape, Vec<Variable>)> {
        let mut binder = Binder { here: true, ..Binder::new(self, Level::Full, true) };
        let mut builder = Builder::new();
        let before = errors.len();
        for (text, pointer) in texts {
            let bound = expr::parse(text)
                .map_err(|e| formula_errors(pointer, vec![e]))
                .and_then(|parsed| builder.add(&parsed, &mut binder).map_err(|e| formula_errors(pointer, e)));
            match bound {
                Ok(node) => {
                    builder.output(node);
                }
                Err(e) => errors.extend(e),
            }
        }
        let mut variables = vec![];
        for probe in &binder.probes {
            match probe {
                Probe::Global(g) => variables.push(Variable::Global(*g)),
                Probe::Here(v) => variables.push(*v),
                _ => {
                    errors.push(
                        Diagnostic::error(
                            "not-local",
                            "a traction may depend on parameters, unknowns and the local state only",
                        )
                        .at(texts[0].1.clone(), "depends on another place")
                        .help("local: u, h, tau, lambda, mu, phi, S, rho0; for another place, declare an unknown and a constraint"),
                    );
                    return None;
                }
            }
        }
        self.used.extend(self.touched.borrow_mut().drain());
        (errors.len() == before).then(|| (builder.finish(), variables))
    }

    /// Reads every definition for its own mistakes. One that uses the local state is a field, which has a meaning only at a place.
    pub fn definitions(&mut self, system: &System, errors: &mut Vec<Diagnostic>) {
        for (name, number) in &self.problem.definitions {
            let mut own = vec![];
            self.number(system, number, &format!("/definitions/{}", token(name)), &mut own);
            errors.extend(own.into_iter().filter(|d| d.code != "field-without-place"));
        }
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

fn finish(system: &System, tape: Tape, probes: Vec<Probe>) -> Formula {
    system.formula(tape, probes)
}

/// The scope of one formula: binds its names to constants and probes.
pub struct Binder<'n, 'a> {
    names: &'n Names<'a>,
    level: Level,
    condition: bool,
    /// True where fields of the local state have a meaning.
    here: bool,
    probes: Vec<Probe>,
    nodes: HashMap<String, Node>,
    stack: Vec<String>,
}

type Bound = Result<Node, Vec<ExprError>>;

impl<'n, 'a> Binder<'n, 'a> {
    fn new(names: &'n Names<'a>, level: Level, condition: bool) -> Self {
        Binder { names, level, condition, here: false, probes: vec![], nodes: HashMap::new(), stack: vec![] }
    }

    /// The node of a probe.
    pub fn probe(&mut self, builder: &mut Builder, probe: Probe) -> Node {
        let slot = self.probes.iter().position(|p| *p == probe).unwrap_or_else(|| {
            self.probes.push(probe);
            self.probes.len() - 1
        });
        builder.input(slot)
    }

    /// A field at an end of a piece.
    pub fn end(&mut self, builder: &mut Builder, piece: usize, side: Side, field: Field) -> Node {
        self.probe(builder, Probe::End(piece, side, field))
    }

    /// The number of a body's position.
    pub fn body_h(&mut self, builder: &mut Builder, body: usize) -> Bound {
        let number = &self.names.problem.bodies[body].h;
        match number {
            Number::Value(v) => Ok(builder.constant(*v)),
            Number::Formula(text) => {
                // Its own mistakes are reported where the body is read.
                let parsed = expr::parse(text).map_err(|_| vec![])?;
                self.nested(builder, &parsed, &format!("body {body}"))
            }
        }
    }

    /// A formula inside another one; its own mistakes are reported at its own place.
    fn nested(&mut self, builder: &mut Builder, parsed: &expr::Expr, name: &str) -> Bound {
        if self.stack.len() >= MAX_CHAIN {
            return Err(vec![]);
        }
        self.stack.push(name.to_owned());
        let node = builder.add(parsed, self).map_err(|e| e.into_iter().filter(|e| e.code == "cyclic").collect());
        self.stack.pop();
        node
    }

    /// Axial position of an end of a piece.
    pub fn h(&mut self, builder: &mut Builder, piece: usize, side: Side) -> Bound {
        let info = &self.names.pieces[piece];
        if let (Some(body), None) = (info.body, info.h0) {
            let apex = self.body_h(builder, body)?;
            let drop = match (self.names.shapes[piece].coordinate, side) {
                (Coordinate::FromTip(_), Side::Start) | (Coordinate::ToTip(_), Side::End) => builder.constant(0.0),
                _ => self.end(builder, piece, side, Field::Drop),
            };
            return Ok(builder.sum(apex, drop));
        }
        let Some(start) = info.h0 else { return Ok(self.end(builder, piece, side, Field::Height)) };
        let start = self.probe(builder, Probe::Global(start));
        Ok(match side {
            Side::Start => start,
            Side::End => {
                let fall = self.probe(builder, Probe::Quadrature(piece, 0));
                builder.sum(start, fall)
            }
        })
    }

    /// Axial force of the membrane on the body under a piece, positive when it presses.
    ///
    /// Balance of the patch: p pi [u^2] - 2 pi [rho0 w_l sin tau]; both vanish at a pole or tip.
    fn force(&mut self, builder: &mut Builder, piece: usize) -> Bound {
        let shape = self.names.shapes[piece].clone();
        let p = match shape.pressure.fluid {
            Some(g) => self.probe(builder, Probe::Global(g)),
            None => builder.constant(0.0),
        };
        let mut total = builder.constant(0.0);
        for (side, sign) in [(Side::Start, -1.0), (Side::End, 1.0)] {
            use Coordinate::{FromPole, FromTip, PoleToPole, ToPole, ToTip};
            let closed = matches!(
                (side, shape.coordinate),
                (Side::Start, FromPole(_) | FromTip(_) | PoleToPole) | (Side::End, ToPole(_) | ToTip(_) | PoleToPole)
            );
            if closed {
                continue;
            }
            let (u, rho0) = (self.end(builder, piece, side, Field::U), self.end(builder, piece, side, Field::Rho0));
            let (w_l, tau) =
                (self.end(builder, piece, side, Field::TensionL), self.end(builder, piece, side, Field::Tau));
            let square = builder.mul(u, u);
            let pi = builder.constant(PI);
            let disc = builder.mul(square, pi);
            let disc = builder.mul(disc, p);
            let sin = builder.apply(Function::Sin, tau);
            let pull = builder.mul(rho0, w_l);
            let pull = builder.mul(pull, sin);
            let two_pi = builder.constant(2.0 * PI);
            let pull = builder.mul(pull, two_pi);
            let part = builder.sub(disc, pull);
            let sign = builder.constant(sign);
            let part = builder.mul(part, sign);
            total = builder.sum(total, part);
        }
        // Other tractions press the membrane on the body as well.
        let own = shape.repulsion.as_ref().map(|_| shape.repulsion_at());
        for q in (2..2 + shape.loads.len()).chain(own) {
            let other = self.probe(builder, Probe::Reported(piece, q));
            total = builder.sub(total, other);
        }
        let down = match &shape.kind {
            Kind::Contact(face) => face.facing == crate::physics::surface::Facing::Down,
            _ => true,
        };
        Ok(if down { total } else { builder.neg(total) })
    }

    fn sum_of(&mut self, builder: &mut Builder, pieces: &[usize], mut f: impl FnMut(&Names, usize) -> Probe) -> Node {
        let mut total = builder.constant(0.0);
        for &s in pieces {
            let probe = f(self.names, s);
            let node = self.probe(builder, probe);
            total = builder.sum(total, node);
        }
        total
    }

    fn scaled(&self, builder: &mut Builder, node: Node) -> Node {
        let images = builder.constant(self.names.images);
        builder.mul(node, images)
    }

    /// Sums over pieces: `energy`, `area`, `volume`.
    fn over(&mut self, builder: &mut Builder, pieces: &[usize], what: &str) -> Option<Node> {
        let kind = |names: &Names, s: usize| names.shapes[s].kind.coupled() > 0;
        Some(match what {
            "energy" => self.sum_of(builder, pieces, |_, s| Probe::Reported(s, 0)),
            "area" => self.sum_of(builder, pieces, |_, s| Probe::Reported(s, 1)),
            "volume" => self.sum_of(builder, pieces, |names, s| {
                if kind(names, s) { Probe::Quadrature(s, 1) } else { Probe::SweptVolume(s) }
            }),
            _ => return None,
        })
    }

    fn initial(&mut self, builder: &mut Builder, rest: &str, span: Range<usize>) -> Bound {
        let Some(i) = self.names.initial.as_ref() else {
            return Err(ExprError::new("no-initial", span, "the initial state is not known yet here").into());
        };
        let value = match rest {
            "p_f" => i.pressure + i.outside,
            "overpressure" => i.pressure,
            "lambda" | "mu" => i.stretch,
            "w_l" | "w_m" => i.tension,
            "membrane.volume" => i.volume,
            "membrane.energy" => i.energy,
            "membrane.height" => 2.0 * i.radius,
            "membrane.area" => i.reference.area() * i.stretch * i.stretch,
            "membrane.reference_area" => i.reference.area(),
            name => match self.names.initial_values.get(name) {
                Some(v) => *v,
                None => {
                    let help = "p_f, overpressure, lambda, mu, w_l, w_m, membrane.volume, membrane.energy, membrane.height, membrane.area, \
                                membrane.reference_area, or an unknown";
                    return Err(ExprError::new("unknown-name", span, format!("`initial.{name}` is not known"))
                        .help(format!("after `initial.`: {help}"))
                        .into());
                }
            },
        };
        Ok(builder.constant(value))
    }

    fn dotted(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let (first, rest) = name.split_once('.').expect("a dotted name");
        if first == "initial" {
            return self.initial(builder, rest, span);
        }
        if first == "reference" {
            let Some(i) = self.names.initial.as_ref() else {
                return Err(ExprError::new("no-initial", span, "the reference shape is not known yet here").into());
            };
            let r = i.reference.radius;
            return match rest {
                "volume" => Ok(builder.constant(4.0 / 3.0 * PI * r.powi(3))),
                "area" => Ok(builder.constant(i.reference.area())),
                _ => Err(unknown(format!("`{name}` is not known"), "reference.volume, reference.area".into())),
            };
        }
        if self.level != Level::Full {
            let message = format!("`{name}` is known only once a state is solved, and a constant is needed here");
            return Err(ExprError::new("not-constant", span, message).into());
        }
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        if let Some(traction) = self.names.problem.tractions.get(first) {
            return self.traction(builder, first, traction, rest, span);
        }
        if first == "membrane" {
            if let Some(node) = self.over(builder, &all, rest) {
                return Ok(self.scaled(builder, node));
            }
            let last = all.len() - 1;
            return match rest {
                "reference_area" => {
                    let area = self.names.initial.as_ref().map_or(0.0, |i| i.reference.area());
                    Ok(builder.constant(area))
                }
                "start.h" => self.h(builder, 0, Side::Start),
                "end.h" => self.h(builder, last, Side::End),
                "height" => {
                    let (top, bottom) = (self.h(builder, 0, Side::Start)?, self.h(builder, last, Side::End)?);
                    let half = builder.sub(bottom, top);
                    Ok(self.scaled(builder, half))
                }
                _ => Err(unknown(
                    format!("`{name}` is not known"),
                    "after `membrane.`: volume, energy, area, reference_area, height, start.h, end.h, max(u)".into(),
                )),
            };
        }
        let after = |prefix: &str| name.strip_prefix(prefix).and_then(|rest| rest.strip_prefix('.')).map(str::to_owned);
        // A joint: limits from both sides, its place, its force.
        let joint = self.names.joints.iter().find_map(|j| after(&j.name).map(|rest| (j.clone(), rest)));
        if let Some((joint, rest)) = joint {
            return self.joint(builder, &joint, &rest, span);
        }
        if let Some(rest) = self.names.absent.iter().find_map(|a| after(a)) {
            // Sums over what is absent are zero; a limit there does not exist.
            return Ok(match rest.as_str() {
                "energy" | "area" | "volume" | "force" => builder.constant(0.0),
                _ => self.probe(builder, Probe::Absent),
            });
        }
        // The longest piece name that is a prefix, then a side and a field; or something of the whole piece or body.
        let piece = (0..self.names.pieces.len())
            .filter(|&s| {
                let p = &self.names.pieces[s].name;
                name.starts_with(p.as_str()) && name[p.len()..].starts_with('.')
            })
            .max_by_key(|&s| self.names.pieces[s].name.len());
        if let Some(s) = piece {
            let rest = &name[self.names.pieces[s].name.len() + 1..];
            if let Some((side, field)) = rest.split_once('.') {
                let side = match side {
                    "start" => Side::Start,
                    "end" => Side::End,
                    _ => {
                        return Err(unknown(
                            format!("`{side}` is not an end of `{}`", self.names.pieces[s].name),
                            "ends: start, end".into(),
                        ));
                    }
                };
                return self.limit(builder, s, side, field, span);
            }
            if let Some(node) = self.over(builder, &[s], rest) {
                return Ok(node);
            }
        }
        self.of_body(builder, name, first, rest, span)
    }

    /// The whole axial force of a traction, downwards, or the energy of an electrostatic one.
    fn traction(
        &mut self,
        builder: &mut Builder,
        name: &str,
        traction: &Traction,
        rest: &str,
        span: Range<usize>,
    ) -> Bound {
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        let repels = matches!(traction, Traction::SelfRepulsion { .. });
        let place = |names: &Names, s: usize| {
            let piece = &names.shapes[s];
            if repels {
                return piece.repulsion.as_ref().map(|_| piece.repulsion_at());
            }
            piece.loads.iter().position(|load| load.name == name).map(|i| 2 + i)
        };
        let sum = |binder: &mut Self, builder: &mut Builder, further: usize| {
            let on: Vec<usize> = all.iter().copied().filter(|&s| place(binder.names, s).is_some()).collect();
            let sum = binder
                .sum_of(builder, &on, |names, s| Probe::Reported(s, place(names, s).expect("it acts there") + further));
            binder.scaled(builder, sum)
        };
        match (rest, traction) {
            ("force", _) => Ok(sum(self, builder, 0)),
            ("energy", Traction::SelfRepulsion { .. }) => Ok(sum(self, builder, 1)),
            ("energy", Traction::ChargedPlane { debye_length, .. }) => {
                // The force falls off as exp(-d/debye_length), so its potential is the force times that length.
                let force = sum(self, builder, 0);
                let length = self.names.constant(debye_length, "", &mut vec![]).unwrap_or(f64::NAN);
                let length = builder.constant(-length);
                Ok(builder.mul(force, length))
            }
            _ => {
                let more = if matches!(traction, Traction::Applied { .. }) { "" } else { ", energy" };
                Err(ExprError::new("unknown-name", span, format!("`{name}.{rest}` is not known"))
                    .help(format!("of this traction: force{more}"))
                    .into())
            }
        }
    }

    /// A field at an end of a piece, by its name.
    fn limit(&mut self, builder: &mut Builder, s: usize, side: Side, field: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let field = match field {
            "lambda" => Field::Lambda,
            "mu" => Field::Mu,
            "tau" => Field::Tau,
            "u" => Field::U,
            "phi" => Field::Phi,
            "S" => Field::S,
            "rho0" => Field::Rho0,
            "w" => Field::W,
            "w_l" => Field::TensionL,
            "w_m" => Field::TensionM,
            "p_c" if self.names.pieces[s].body.is_some() => Field::ContactPressure,
            "h" => return self.h(builder, s, side),
            "tip_coefficient" if self.names.pieces[s].body.is_some() => {
                return Ok(self.probe(builder, Probe::TipCoefficient(s, side)));
            }
            _ => {
                let fields = ["phi", "S", "rho0", "u", "h", "lambda", "mu", "tau", "w", "w_l", "w_m"];
                let mut all = fields.join(", ");
                if self.names.pieces[s].body.is_some() {
                    all += ", p_c, tip_coefficient";
                }
                let near = nearest(field, fields).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
                return Err(unknown(format!("`{field}` is not a field"), format!("{near}fields: {all}")));
            }
        };
        Ok(self.end(builder, s, side, field))
    }

    /// Something of a joint, by its name.
    fn joint(&mut self, builder: &mut Builder, joint: &JointName, rest: &str, span: Range<usize>) -> Bound {
        if let Some((which, field)) = rest.split_once('.') {
            match which {
                "before" => return self.limit(builder, joint.before, Side::End, field, span),
                "after" => return self.limit(builder, joint.after, Side::Start, field, span),
                _ => {}
            }
        }
        match (rest, joint.body) {
            ("phi" | "S" | "rho0" | "u", _) => self.limit(builder, joint.after, Side::Start, rest, span),
            ("h", Some(body)) => self.body_h(builder, body),
            ("h", None) => self.limit(builder, joint.after, Side::Start, "h", span),
            ("force", Some(_)) => {
                // Axial pull of the edge on the membrane, out of the pipette: each side with its own tension.
                let mut total = builder.constant(0.0);
                for (piece, side, sign) in [(joint.before, Side::End, 1.0), (joint.after, Side::Start, -1.0)] {
                    let parts = [Field::Rho0, Field::TensionL].map(|f| self.end(builder, piece, side, f));
                    let tau = self.end(builder, piece, side, Field::Tau);
                    let sin = builder.apply(Function::Sin, tau);
                    let factor = builder.constant(sign * 2.0 * PI);
                    let pull = builder.mul(parts[0], parts[1]);
                    let pull = builder.mul(pull, sin);
                    let pull = builder.mul(pull, factor);
                    total = builder.sum(total, pull);
                }
                Ok(total)
            }
            _ => Err(ExprError::new("unknown-name", span, format!("`{}.{rest}` is not known", joint.name))
                .help(format!(
                    "of a joint: {0}.phi, {0}.u, {0}.h, {0}.before.lambda, {0}.after.tau, .., {0}.force",
                    joint.name
                ))
                .into()),
        }
    }

    /// Something of a whole body.
    fn of_body(&mut self, builder: &mut Builder, name: &str, first: &str, rest: &str, span: Range<usize>) -> Bound {
        let unknown = |message: String, help: String| -> Vec<ExprError> {
            ExprError::new("unknown-name", span.clone(), message).help(help).into()
        };
        let all: Vec<usize> = (0..self.names.pieces.len()).collect();
        if let Some(body) = self.names.problem.bodies.get_index_of(first) {
            let on: Vec<usize> = all.iter().copied().filter(|&s| self.names.pieces[s].body == Some(body)).collect();
            return match rest {
                "h" => self.body_h(builder, body),
                "force" => {
                    let mut total = builder.constant(0.0);
                    for s in on {
                        let f = self.force(builder, s)?;
                        total = builder.sum(total, f);
                    }
                    for joint in self.names.joints.clone().iter().filter(|j| j.body == Some(body)) {
                        let f = self.joint(builder, joint, "force", span.clone())?;
                        total = builder.sum(total, f);
                    }
                    Ok(total)
                }
                "area" => Ok(self.over(builder, &on, "area").expect("areas can be summed")),
                _ => Err(unknown(
                    format!("`{name}` is not known"),
                    format!(
                        "of a body: {first}.force, {first}.h, {first}.area; of a contact: {first}.start.u, {first}.end.phi, .."
                    ),
                )),
            };
        }
        let mut known: Vec<&str> = self.names.pieces.iter().map(|p| p.name.as_str()).collect();
        known.extend(self.names.joints.iter().map(|j| j.name.as_str()));
        known.extend(
            self.names.problem.bodies.keys().map(String::as_str).filter(|b| !known.contains(b)).collect::<Vec<_>>(),
        );
        known.extend(self.names.problem.tractions.keys().map(String::as_str));
        known.extend(["membrane", "initial", "reference"]);
        let near = nearest(first, known.iter().copied()).map(|n| format!("did you mean `{n}`? ")).unwrap_or_default();
        Err(ExprError::new(
            "unknown-name",
            span.start..span.start + first.len(),
            format!("there is no segment or body `{first}`"),
        )
        .help(format!("{near}segments and bodies: {}", known.join(", ")))
        .into())
    }
}

impl Scope for Binder<'_, '_> {
    fn name(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Bound {
        if let Some(node) = self.nodes.get(name) {
            return Ok(*node);
        }
        if name.contains('.') {
            return self.dotted(builder, name, span);
        }
        let problem = self.names.problem;
        if let Some(v) = self.names.parameters.get(name) {
            return Ok(builder.constant(*v));
        }
        if problem.parameters.contains_key(name) {
            if self.names.reading && self.level == Level::Constant {
                let message =
                    format!("`{name}` is not known here: a parameter is a number, not a formula of other names");
                return Err(ExprError::new("unknown-name", span, message)
                    .help("write formulas of parameters under `definitions`")
                    .into());
            }
            return Err(vec![]); // its own mistake is reported at its own place
        }
        let global = if name == "p_f" && problem.fluid.is_some() {
            self.names.fluid_pressure
        } else {
            self.names.unknowns.get(name).copied()
        };
        if name == "p_f" && problem.fluid.is_none() {
            return Ok(builder.constant(0.0));
        }
        if problem.unknowns.contains_key(name) || name == "p_f" {
            match self.level {
                Level::Full => {
                    if self.condition {
                        self.names.touched.borrow_mut().insert(name.to_owned());
                    }
                    let Some(g) = global else { return Err(vec![]) };
                    return Ok(self.probe(builder, Probe::Global(g)));
                }
                Level::Initial => {
                    let value = match name {
                        "p_f" => self.names.initial.as_ref().map(|i| i.pressure + i.outside),
                        _ => self.names.initial_values.get(name).copied(),
                    };
                    return value.map(|v| builder.constant(v)).ok_or_else(Vec::new);
                }
                Level::Constant => {
                    let message = format!("`{name}` is an unknown, and a constant is needed here");
                    return Err(ExprError::new("not-constant", span, message).into());
                }
            }
        }
        let text = problem
            .definitions
            .get(name)
            .map(|n| (n, "definition"))
            .or_else(|| problem.outputs.get(name).map(|n| (n, "output")));
        if let Some((number, what)) = text {
            if self.stack.iter().any(|s| s == name) {
                let mut chain: Vec<&str> = self.stack.iter().map(String::as_str).skip_while(|s| *s != name).collect();
                chain.push(name);
                let message = format!("`{name}` is defined by itself: {}", chain.join(" -> "));
                return Err(ExprError::new("cyclic", span, message).into());
            }
            if self.stack.len() >= MAX_CHAIN {
                let message = format!("more than {MAX_CHAIN} definitions use each other in a chain");
                return Err(ExprError::new("cyclic", span, message).into());
            }
            let node = match number {
                Number::Value(v) => builder.constant(*v),
                Number::Formula(text) => {
                    let parsed = expr::parse(text).map_err(|_| vec![])?;
                    self.stack.push(name.to_owned());
                    let bound = builder.add(&parsed, self);
                    self.stack.pop();
                    bound.map_err(|errors| {
                        // Its own mistakes are reported at its own place; what depends on where it is used, here.
                        let here = ["cyclic", "field-without-place", "not-constant"];
                        let found = errors.iter().find(|e| here.contains(&e.code));
                        found.map_or(vec![], |e| {
                            let message = match e.code {
                                "cyclic" => e.message.clone(),
                                _ => format!("the {what} `{name}` cannot be used here: {}", e.message),
                            };
                            vec![ExprError::new(e.code, span, message)]
                        })
                    })?
                }
            };
            self.nodes.insert(name.to_owned(), node);
            return Ok(node);
        }
        let here = match name {
            _ if !self.here => None,
            "u" => Some(Variable::U),
            "h" => Some(Variable::H),
            "tau" => Some(Variable::Tau),
            "lambda" => Some(Variable::Lambda),
            "mu" => Some(Variable::Mu),
            "phi" => Some(Variable::Phi),
            "S" => Some(Variable::S),
            "rho0" => Some(Variable::Rho0),
            _ => None,
        };
        if let Some(variable) = here {
            return Ok(self.probe(builder, Probe::Here(variable)));
        }
        if LOCAL.contains(&name) {
            let message = format!("`{name}` is a field of the membrane: say where");
            let place = self.names.pieces.first().map_or("side", |p| p.name.as_str());
            return Err(ExprError::new("field-without-place", span, message)
                .help(format!("for example {place}.end.{name}, or membrane.max({name})"))
                .into());
        }
        let known = self.names.known();
        let mut e = ExprError::new("unknown-name", span, format!("`{name}` is not known"));
        e = match nearest(name, known.iter().copied()) {
            Some(near) => e.help(format!("did you mean `{near}`? known names: {}", known.join(", "))),
            None => e.help(format!("known names: {}", known.join(", "))),
        };
        Err(e.into())
    }

    fn call(&mut self, builder: &mut Builder, name: &str, arguments: &[Argument], span: Range<usize>) -> Bound {
        let whole = ["membrane.max"];
        if whole.contains(&name) && self.level == Level::Full {
            return match arguments {
                [Argument { name: None, value, .. }] if value.as_name() == Some("u") => {
                    Ok(self.probe(builder, Probe::LargestRadius))
                }
                _ => Err(ExprError::new("not-supported", span, "this version finds the largest radius only")
                    .help("membrane.max(u)")
                    .into()),
            };
        }
        let at = span.start..span.start + name.len();
        Err(ExprError::new("unknown-name", at, format!("there is no `{name}(..)` to call here"))
            .help("membrane.max(u)")
            .into())
    }

    fn unit(&mut self, unit: &expr::Unit) -> Result<f64, ExprError> {
        debug_assert_eq!(unit.kind, UnitKind::Other);
        Err(ExprError::new("unknown-unit", unit.span.clone(), format!("the unit `{}` is not known", unit.text))
            .help("units of angle: deg, rad; this version has no others"))
    }
}
