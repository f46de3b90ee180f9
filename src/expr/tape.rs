//! Formulas as a flat list of operations, evaluated with any scalar.

use super::error::{ExprError, quoted};
use super::parse::parse;
use super::tree::{Argument, Expr, Function, Operator, Term, Unit};
use crate::scalar::Scalar;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;

/// What the names in a formula mean.
///
/// A scope answers with a node of the builder: [`Builder::constant`], [`Builder::input`], or one that it built before, so that
/// a definition used twice is computed once. A scope that builds definitions on demand keeps their nodes, and is the one to
/// notice a cycle.
///
/// The spans of the errors count in the text of the formula that is being added. A mistake inside a definition lies in another
/// text: report it there, not from here.
pub trait Scope {
    /// The node of a name, which stands at `span`.
    ///
    /// # Errors
    /// That the name means nothing here; code `unknown-name` unless the scope knows better. An empty list says that it cannot be
    /// used and that the reason is given elsewhere.
    fn name(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Result<Node, Vec<ExprError>>;

    /// The node of a call of a dotted name. `span` is the whole call; the name itself is its first `name.len()` bytes.
    ///
    /// Arguments are formulas that the scope adds with whichever scope it gives them ([`Builder::add`]).
    ///
    /// # Errors
    /// That there is nothing of that name to call, or what is wrong with the arguments.
    fn call(
        &mut self,
        builder: &mut Builder,
        name: &str,
        arguments: &[Argument],
        span: Range<usize>,
    ) -> Result<Node, Vec<ExprError>> {
        let _ = (builder, arguments);
        let message = format!("there is no {} to call here", quoted(name));
        Err(ExprError::new("unknown-name", span.start..span.start + name.len(), message).into())
    }

    /// The factor that turns numbers of this unit into those that the formula is computed with. Not asked for angles.
    ///
    /// # Errors
    /// That the unit is not known.
    fn unit(&mut self, unit: &Unit) -> Result<f64, ExprError> {
        let message = format!("the unit {} is not known here", quoted(&unit.text));
        Err(ExprError::new("unknown-unit", unit.span.clone(), message))
    }
}

/// The scope without names.
impl Scope for () {
    fn name(&mut self, _: &mut Builder, name: &str, span: Range<usize>) -> Result<Node, Vec<ExprError>> {
        let message = format!("{} is not known here, where only numbers are", quoted(name));
        Err(ExprError::new("unknown-name", span, message).into())
    }
}

/// The value of a formula without names, finite; angles in radians.
///
/// # Errors
/// The first mistake in it, or that its value is not finite.
pub fn constant(text: &str) -> Result<f64, ExprError> {
    let parsed = parse(text)?;
    let mut builder = Builder::new();
    let node = builder.add(&parsed, &mut ()).map_err(|mut errors| errors.swap_remove(0))?;
    // Without inputs every node is a constant.
    match builder.value(node).unwrap_or(f64::NAN) {
        value if value.is_finite() => Ok(value),
        value => Err(ExprError::new("not-finite", 0..text.len(), format!("this is {value}, not a finite number"))),
    }
}

/// A value in a [`Builder`]; of no use with another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Node(u32);

/// A double that can be compared and hashed by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Real(u64);

impl Real {
    fn new(x: f64) -> Self {
        Real(x.to_bits())
    }

    #[inline(always)]
    fn get(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// One operation; its operands are the results of earlier ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Op {
    Constant(Real),
    Input(u32),
    Neg(u32),
    Add(u32, u32),
    Sub(u32, u32),
    Mul(u32, u32),
    Div(u32, u32),
    /// a + c
    AddConstant(u32, Real),
    /// c - a
    SubFromConstant(Real, u32),
    /// a c
    MulConstant(u32, Real),
    /// a / c
    DivConstant(u32, Real),
    /// c / a
    DivIntoConstant(Real, u32),
    Recip(u32),
    Square(u32),
    Powi(u32, i32),
    Powf(u32, Real),
    Apply(Function, u32),
}

impl Op {
    #[inline(always)]
    fn eval<S: Scalar>(self, inputs: &[S], work: &[S]) -> S {
        let at = |i: u32| work[i as usize];
        match self {
            Op::Constant(c) => S::from(c.get()),
            Op::Input(i) => inputs[i as usize],
            Op::Neg(a) => -at(a),
            Op::Add(a, b) => at(a) + at(b),
            Op::Sub(a, b) => at(a) - at(b),
            Op::Mul(a, b) => at(a) * at(b),
            Op::Div(a, b) => at(a) / at(b),
            Op::AddConstant(a, c) => at(a) + c.get(),
            Op::SubFromConstant(c, a) => -at(a) + c.get(),
            Op::MulConstant(a, c) => at(a) * c.get(),
            Op::DivConstant(a, c) => at(a) / c.get(),
            Op::DivIntoConstant(c, a) => S::from(c.get()) / at(a),
            Op::Recip(a) => at(a).recip(),
            Op::Square(a) => at(a) * at(a),
            Op::Powi(a, n) => at(a).powi(n),
            Op::Powf(a, p) => at(a).powf(p.get()),
            Op::Apply(f, a) => f.apply(at(a)),
        }
    }

    /// The operands.
    fn operands(self) -> [Option<u32>; 2] {
        match self {
            Op::Constant(_) | Op::Input(_) => [None, None],
            Op::Add(a, b) | Op::Sub(a, b) | Op::Mul(a, b) | Op::Div(a, b) => [Some(a), Some(b)],
            Op::Neg(a)
            | Op::AddConstant(a, _)
            | Op::SubFromConstant(_, a)
            | Op::MulConstant(a, _)
            | Op::DivConstant(a, _)
            | Op::DivIntoConstant(_, a)
            | Op::Recip(a)
            | Op::Square(a)
            | Op::Powi(a, _)
            | Op::Powf(a, _)
            | Op::Apply(_, a) => [Some(a), None],
        }
    }

    /// The same operation on operands with other numbers.
    fn renumbered(self, new: &[u32]) -> Self {
        let to = |i: u32| new[i as usize];
        match self {
            Op::Constant(_) | Op::Input(_) => self,
            Op::Neg(a) => Op::Neg(to(a)),
            Op::Add(a, b) => Op::Add(to(a), to(b)),
            Op::Sub(a, b) => Op::Sub(to(a), to(b)),
            Op::Mul(a, b) => Op::Mul(to(a), to(b)),
            Op::Div(a, b) => Op::Div(to(a), to(b)),
            Op::AddConstant(a, c) => Op::AddConstant(to(a), c),
            Op::SubFromConstant(c, a) => Op::SubFromConstant(c, to(a)),
            Op::MulConstant(a, c) => Op::MulConstant(to(a), c),
            Op::DivConstant(a, c) => Op::DivConstant(to(a), c),
            Op::DivIntoConstant(c, a) => Op::DivIntoConstant(c, to(a)),
            Op::Recip(a) => Op::Recip(to(a)),
            Op::Square(a) => Op::Square(to(a)),
            Op::Powi(a, n) => Op::Powi(to(a), n),
            Op::Powf(a, p) => Op::Powf(to(a), p),
            Op::Apply(f, a) => Op::Apply(f, to(a)),
        }
    }
}

/// Collects formulas into one [`Tape`].
///
/// Equal operations on equal operands are one node, and operations on constants are done at once. Simplified is only what
/// changes no value: `x + 0`, `x - 0`, `x*1`, `x*(-1)`, `x/1`, `x^1`, `-(-x)` (the sign of a zero aside). In particular `0*x`,
/// `0/x`, `x - x` and `x^0` are computed, so that a NaN or an infinity in `x` is seen. A division by a constant 0 is infinite or
/// NaN like any other.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    ops: Vec<Op>,
    known: HashMap<Op, u32>,
    outputs: Vec<u32>,
}

impl Builder {
    /// Largest |n| for which x^n is computed by multiplication, which loses about |n| units in the last place.
    const MAX_POWI: f64 = 64.0;

    /// Number of mistakes in one formula after which the rest is not looked at.
    const MAX_ERRORS: usize = 20;

    /// A builder without formulas.
    pub fn new() -> Self {
        Builder::default()
    }

    /// Adds a formula.
    ///
    /// # Errors
    /// All mistakes in it that the scope finds, in the order of the text (after 20 the rest is not looked at).
    pub fn add(&mut self, expr: &Expr, scope: &mut dyn Scope) -> Result<Node, Vec<ExprError>> {
        let mut errors = Vec::new();
        // A scope may fail without an error, where what is wrong was said elsewhere.
        let mut failed = false;
        // Stand-in for what could not be built, so that the rest is looked at too.
        let unknown = Node(0);
        let mut nodes: Vec<Node> = Vec::with_capacity(expr.parts().len());
        for part in expr.parts() {
            if errors.len() >= Builder::MAX_ERRORS {
                break;
            }
            let whole = !failed;
            let node = match &part.term {
                Term::Number { value, unit: None } => self.constant(*value),
                Term::Number { value, unit: Some(unit) } => match unit.to_radians(*value) {
                    Some(angle) => self.constant(angle),
                    None => match scope.unit(unit) {
                        Ok(factor) => self.constant(value * factor),
                        Err(error) => {
                            failed = true;
                            errors.push(error);
                            unknown
                        }
                    },
                },
                Term::Pi => self.constant(PI),
                Term::Name(name) => scope.name(self, name, part.span.clone()).unwrap_or_else(|new| {
                    failed = true;
                    errors.extend(new);
                    unknown
                }),
                Term::Call { name, arguments } => {
                    scope.call(self, name, arguments, part.span.clone()).unwrap_or_else(|new| {
                        failed = true;
                        errors.extend(new);
                        unknown
                    })
                }
                Term::Negative(a) if whole => self.neg(nodes[*a]),
                Term::Function(f, a) if whole => self.apply(*f, nodes[*a]),
                Term::Binary(operator, a, b) if whole => {
                    let (a, b) = (nodes[*a], nodes[*b]);
                    match operator {
                        Operator::Add => self.sum(a, b),
                        Operator::Subtract => self.sub(a, b),
                        Operator::Multiply => self.mul(a, b),
                        Operator::Divide => self.div(a, b),
                        Operator::Power => self.pow(a, b),
                    }
                }
                Term::Negative(_) | Term::Function(..) | Term::Binary(..) => unknown,
            };
            nodes.push(node);
        }
        match nodes.last() {
            Some(&node) if !failed => Ok(node),
            _ => Err(errors),
        }
    }

    fn node(&mut self, op: Op) -> Node {
        let ops = &mut self.ops;
        Node(*self.known.entry(op).or_insert_with(|| {
            ops.push(op);
            (ops.len() - 1) as u32
        }))
    }

    /// A number.
    pub fn constant(&mut self, value: f64) -> Node {
        self.node(Op::Constant(Real::new(value)))
    }

    /// The input in slot `slot`.
    ///
    /// # Panics
    /// If the slot is 2^32 or more.
    pub fn input(&mut self, slot: usize) -> Node {
        self.node(Op::Input(u32::try_from(slot).expect("the number of inputs fits into 32 bits")))
    }

    /// The value of a node that is a constant.
    pub fn value(&self, node: Node) -> Option<f64> {
        match self.ops[node.0 as usize] {
            Op::Constant(c) => Some(c.get()),
            _ => None,
        }
    }

    /// -a
    pub fn neg(&mut self, a: Node) -> Node {
        match (self.value(a), self.ops[a.0 as usize]) {
            (Some(x), _) => self.constant(-x),
            (_, Op::Neg(inner)) => Node(inner),
            _ => self.node(Op::Neg(a.0)),
        }
    }

    /// a + b
    pub fn sum(&mut self, a: Node, b: Node) -> Node {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => self.constant(x + y),
            (Some(c), None) => self.shift(b, c),
            (None, Some(c)) => self.shift(a, c),
            (None, None) => self.node(Op::Add(a.0.min(b.0), a.0.max(b.0))),
        }
    }

    fn shift(&mut self, a: Node, c: f64) -> Node {
        if c == 0.0 { a } else { self.node(Op::AddConstant(a.0, Real::new(c))) }
    }

    /// a - b
    pub fn sub(&mut self, a: Node, b: Node) -> Node {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => self.constant(x - y),
            (Some(c), None) => self.node(Op::SubFromConstant(Real::new(c), b.0)),
            (None, Some(c)) => self.shift(a, -c),
            (None, None) => self.node(Op::Sub(a.0, b.0)),
        }
    }

    /// a b
    pub fn mul(&mut self, a: Node, b: Node) -> Node {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => self.constant(x * y),
            (Some(c), None) => self.scale(b, c),
            (None, Some(c)) => self.scale(a, c),
            (None, None) if a == b => self.node(Op::Square(a.0)),
            (None, None) => self.node(Op::Mul(a.0.min(b.0), a.0.max(b.0))),
        }
    }

    fn scale(&mut self, a: Node, c: f64) -> Node {
        match c {
            1.0 => a,
            -1.0 => self.neg(a),
            _ => self.node(Op::MulConstant(a.0, Real::new(c))),
        }
    }

    /// a / b
    pub fn div(&mut self, a: Node, b: Node) -> Node {
        match (self.value(a), self.value(b)) {
            (Some(x), Some(y)) => self.constant(x / y),
            (Some(1.0), None) => self.node(Op::Recip(b.0)),
            (Some(c), None) => self.node(Op::DivIntoConstant(Real::new(c), b.0)),
            (None, Some(1.0)) => a,
            (None, Some(c)) => self.node(Op::DivConstant(a.0, Real::new(c))),
            (None, None) => self.node(Op::Div(a.0, b.0)),
        }
    }

    /// a^b.
    ///
    /// A constant integral b of moderate size is a product, defined for every a; another constant b a real power, for
    /// positive a; else exp(b ln a).
    pub fn pow(&mut self, a: Node, b: Node) -> Node {
        let Some(power) = self.value(b) else {
            let logarithm = self.apply(Function::Ln, a);
            let product = self.mul(b, logarithm);
            return self.apply(Function::Exp, product);
        };
        if power == 1.0 {
            return a;
        }
        let op = |a: u32| match power {
            2.0 => Op::Square(a),
            -1.0 => Op::Recip(a),
            n if n.fract() == 0.0 && n.abs() <= Builder::MAX_POWI => Op::Powi(a, n as i32),
            p => Op::Powf(a, Real::new(p)),
        };
        match self.value(a) {
            // By the very code that runs the tape.
            Some(x) => self.constant(op(0).eval(&[], &[x])),
            None => self.node(op(a.0)),
        }
    }

    /// f(a)
    pub fn apply(&mut self, f: Function, a: Node) -> Node {
        match self.value(a) {
            Some(x) => self.constant(f.apply(x)),
            None => self.node(Op::Apply(f, a.0)),
        }
    }

    /// Makes a node the next output, and returns which one that is.
    pub fn output(&mut self, node: Node) -> usize {
        self.outputs.push(node.0);
        self.outputs.len() - 1
    }

    /// The tape of what the outputs need; everything else is dropped.
    pub fn finish(self) -> Tape {
        let needed = needed(&self.ops, self.outputs.iter().copied());
        let mut new = vec![0; self.ops.len()];
        let mut ops = Vec::new();
        for (i, op) in self.ops.iter().enumerate().filter(|&(i, _)| needed[i]) {
            new[i] = ops.len() as u32;
            ops.push(op.renumbered(&new));
        }
        let outputs = self.outputs.iter().map(|&o| new[o as usize]).collect();
        let inputs = inputs(&ops, |_| true);
        Tape { ops, outputs, inputs }
    }
}

/// Which operations `roots` need.
fn needed(ops: &[Op], roots: impl Iterator<Item = u32>) -> Vec<bool> {
    let mut needed = vec![false; ops.len()];
    roots.for_each(|r| needed[r as usize] = true);
    for i in (0..ops.len()).rev() {
        if needed[i] {
            ops[i].operands().into_iter().flatten().for_each(|o| needed[o as usize] = true);
        }
    }
    needed
}

/// The input slots that the operations named by `which` read, sorted.
fn inputs(ops: &[Op], which: impl Fn(usize) -> bool) -> Vec<usize> {
    let slot = |(i, op): (usize, &Op)| match op {
        Op::Input(slot) if which(i) => Some(*slot as usize),
        _ => None,
    };
    let mut slots: Vec<usize> = ops.iter().enumerate().filter_map(slot).collect();
    slots.sort_unstable();
    slots
}

/// A flat list of operations with several outputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tape {
    ops: Vec<Op>,
    outputs: Vec<u32>,
    inputs: Vec<usize>,
}

impl Tape {
    /// Evaluates all outputs, in the order in which they were declared.
    ///
    /// `inputs` holds all slots up to the last one used; slots that are not used may hold anything. `work` is scratch space;
    /// nothing is allocated once it has grown.
    ///
    /// # Panics
    /// If `inputs` is too short or `out` does not have one place for each output.
    pub fn eval<S: Scalar>(&self, inputs: &[S], work: &mut Vec<S>, out: &mut [S]) {
        assert_eq!(out.len(), self.outputs.len(), "one place for each output");
        work.clear();
        work.reserve(self.ops.len());
        for op in &self.ops {
            let value = op.eval(inputs, work);
            work.push(value);
        }
        for (place, &o) in out.iter_mut().zip(&self.outputs) {
            *place = work[o as usize];
        }
    }

    /// The value of the first output, for a formula alone on its tape; `inputs` as for [`Tape::eval`].
    ///
    /// # Panics
    /// If there is no output, or `inputs` is too short.
    pub fn value<S: Scalar, const N: usize>(&self, inputs: [S; N]) -> S {
        let mut work = Vec::with_capacity(self.ops.len());
        for op in &self.ops {
            let value = op.eval(&inputs, &work);
            work.push(value);
        }
        work[self.outputs[0] as usize]
    }

    /// The input slots that the outputs depend on, sorted.
    pub fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    /// The input slots that one output depends on, sorted.
    ///
    /// # Panics
    /// If there is no such output.
    pub fn inputs_of(&self, output: usize) -> Vec<usize> {
        let needed = needed(&self.ops, std::iter::once(self.outputs[output]));
        inputs(&self.ops, |i| needed[i])
    }

    /// The number of outputs.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// The number of operations, inputs and constants among them.
    pub fn operations(&self) -> usize {
        self.ops.len()
    }
}
