//! The scope of one formula: what a bare name means in it.

use super::{LOCAL, Level, Names};
use crate::expr::{self, Argument, Builder, ExprError, Node, Scope, UnitKind, nearest};
use crate::spec::Number;
use crate::system::{Field, Probe, Side, Variable};
use std::collections::HashMap;
use std::ops::Range;

/// How deep definitions may use each other.
const MAX_CHAIN: usize = 64;

/// The fields of the local state that a traction may use.
pub(super) const FIELDS: &[(&str, Variable)] = &[
    ("u", Variable::U),
    ("h", Variable::H),
    ("tau", Variable::Tau),
    ("lambda", Variable::Lambda),
    ("mu", Variable::Mu),
    ("phi", Variable::Phi),
    ("S", Variable::S),
    ("rho0", Variable::Rho0),
];
/// Those from which something is read, tensions included; h is known only where a load asks for it.
pub(super) const READABLE: &[(&str, Variable)] = &[
    ("u", Variable::U),
    ("tau", Variable::Tau),
    ("lambda", Variable::Lambda),
    ("mu", Variable::Mu),
    ("phi", Variable::Phi),
    ("S", Variable::S),
    ("rho0", Variable::Rho0),
    ("w", Variable::W),
    ("w_l", Variable::TensionL),
    ("w_m", Variable::TensionM),
    ("p_c", Variable::ContactPressure),
];
/// Those that an energy may use.
pub(super) const STRETCHES: &[(&str, Variable)] = &[("lambda", Variable::Lambda), ("mu", Variable::Mu)];

/// The scope of one formula: binds its names to constants and probes.
pub struct Binder<'n, 'a> {
    pub(super) names: &'n Names<'a>,
    pub(super) level: Level,
    pub(super) condition: bool,
    /// The fields of the local state that have a meaning.
    pub(super) here: &'static [(&'static str, Variable)],
    /// The one name that is an input.
    pub(super) variable: Option<&'static str>,
    pub(super) probes: Vec<Probe>,
    nodes: HashMap<String, Node>,
    stack: Vec<String>,
}

/// A node, or what is wrong with the formula; nothing where that is reported at another place.
pub(super) type Bound = Result<Node, Vec<ExprError>>;

impl<'n, 'a> Binder<'n, 'a> {
    pub(super) fn new(names: &'n Names<'a>, level: Level, condition: bool) -> Self {
        Binder {
            names,
            level,
            condition,
            here: &[],
            variable: None,
            probes: vec![],
            nodes: HashMap::new(),
            stack: vec![],
        }
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
}

impl Scope for Binder<'_, '_> {
    fn name(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Bound {
        if let Some(node) = self.nodes.get(name) {
            return Ok(*node);
        }
        if self.variable == Some(name) {
            return Ok(builder.input(0));
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
        if let Some((_, variable)) = self.here.iter().find(|(field, _)| *field == name) {
            return Ok(self.probe(builder, Probe::Here(*variable)));
        }
        if LOCAL.contains(&name) && !self.here.is_empty() {
            let fields: Vec<&str> = self.here.iter().map(|(field, _)| *field).collect();
            let message = format!("`{name}` cannot be used here");
            return Err(ExprError::new("field-without-place", span, message)
                .help(format!("of the local state: {}", fields.join(", ")))
                .into());
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
        self.reading(builder, name, arguments, span)
    }

    fn unit(&mut self, unit: &expr::Unit) -> Result<f64, ExprError> {
        debug_assert_eq!(unit.kind, UnitKind::Other);
        Err(ExprError::new("unknown-unit", unit.span.clone(), format!("the unit `{}` is not known", unit.text))
            .help("units of angle: deg, rad; this version has no others"))
    }
}
