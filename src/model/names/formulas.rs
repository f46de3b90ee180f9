//! From the texts of a file to formulas of the solution: parsed, bound to probes, compiled.

use super::scope::{self, Binder};
use super::{Level, Names};
use crate::diagnostic::{Diagnostic, Severity};
use crate::expr::{self, Builder, Expr, ExprError, Node, Tape};
use crate::model::{bracket, formula_errors, is_condition, token};
use crate::spec::Number;
use crate::system::{Formula, Probe, System, Variable};

/// A text as a formula, or its mistakes at its place.
fn parsed(text: &str, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<Expr> {
    expr::parse(text).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()
}

/// A text as both sides of an equation, or its mistakes at its place.
fn parsed_equation(text: &str, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<(Expr, Expr)> {
    expr::parse_equation(text).map_err(|e| errors.extend(formula_errors(pointer, vec![e]))).ok()
}

impl Names<'_> {
    /// A formula of the solution.
    pub fn formula(
        &mut self,
        system: &System,
        text: &str,
        pointer: &str,
        condition: bool,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Formula> {
        let parsed = parsed(text, pointer, errors)?;
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
        let (lhs, rhs) = parsed_equation(text, pointer, errors)?;
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
        let (lhs, rhs) = parsed_equation(text, pointer, errors)?;
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
            if !errors.iter().any(|d| d.severity == Severity::Error) {
                errors.push(Diagnostic::error("unusable", "this depends on a formula that is wrong").at(pointer, ""));
            }
            return None;
        }
        let node = match nodes[..] {
            [one] => one,
            [lhs, rhs] => builder.sub(lhs, rhs),
            _ => unreachable!("one or two sides"),
        };
        let formula = self.finish(system, builder, node, probes);
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
        Some(self.finish(system, builder, node, probes))
    }

    /// The formula of a node, whose unknowns count as used.
    fn finish(&mut self, system: &System, mut builder: Builder, node: Node, probes: Vec<Probe>) -> Formula {
        builder.output(node);
        self.used.extend(self.touched.borrow_mut().drain());
        system.formula(builder.finish(), probes)
    }

    /// A formula over globals alone, for pressures: the tape and the globals it reads.
    pub fn globals(
        &mut self,
        number: &Number,
        pointer: &str,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<(Tape, Vec<usize>)> {
        let (tape, probes) = self.tape(&[(&bracket(number), pointer.to_owned())], false, errors)?;
        let globals: Option<Vec<usize>> =
            probes.iter().map(|probe| if let Probe::Global(g) = probe { Some(*g) } else { None }).collect();
        if globals.is_none() {
            errors.push(
                Diagnostic::error("not-uniform", "a pressure may depend on parameters and unknowns only")
                    .at(pointer, "depends on the shape"),
            );
        }
        Some((tape, globals?))
    }

    /// A traction: formulas over the local state and globals, as outputs of one tape.
    pub fn field(&mut self, texts: &[(&str, String)], errors: &mut Vec<Diagnostic>) -> Option<(Tape, Vec<Variable>)> {
        let (tape, probes) = self.tape(texts, true, errors)?;
        let variable = |probe: &Probe| match probe {
            Probe::Global(g) => Some(Variable::Global(*g)),
            Probe::Here(v) => Some(*v),
            _ => None,
        };
        let variables: Option<Vec<Variable>> = probes.iter().map(variable).collect();
        if variables.is_none() {
            errors.push(
                Diagnostic::error(
                    "not-local",
                    "a traction may depend on parameters, unknowns and the local state only",
                )
                .at(texts[0].1.clone(), "depends on another place")
                .help("local: u, h, tau, lambda, mu, phi, S, rho0; for another place, declare an unknown and a constraint"),
            );
        }
        Some((tape, variables?))
    }

    /// Numbers, each with its place, as the outputs of one tape over one variable; parameters are constants.
    pub fn curve(
        &self,
        variable: &'static str,
        numbers: &[(&Number, String)],
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Tape> {
        let mut binder = Binder::new(self, Level::Constant, false);
        binder.variable = Some(variable);
        let mut builder = Builder::new();
        let before = errors.len();
        for (number, pointer) in numbers {
            let text = match number {
                Number::Value(v) => format!("{v}"),
                Number::Formula(text) => text.clone(),
            };
            let Some(parsed) = parsed(&text, pointer, errors) else { continue };
            match builder.add(&parsed, &mut binder) {
                Ok(node) => {
                    builder.output(node);
                }
                Err(e) => errors.extend(formula_errors(pointer, e)),
            }
        }
        (errors.len() == before).then(|| builder.finish())
    }

    /// An energy of the stretches lambda (slot 0) and mu (slot 1), which depends on parameters besides.
    pub fn energy(&self, text: &str, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<Tape> {
        let parsed = parsed(text, pointer, errors)?;
        let mut binder = Binder::new(self, Level::Constant, false);
        binder.here = scope::STRETCHES;
        let mut builder = Builder::new();
        for stretch in [Variable::Lambda, Variable::Mu] {
            binder.probe(&mut builder, Probe::Here(stretch));
        }
        match builder.add(&parsed, &mut binder) {
            Ok(node) => {
                builder.output(node);
                return Some(builder.finish());
            }
            Err(e) => errors.extend(formula_errors(pointer, e)),
        }
        if !errors.iter().any(|d| d.severity == Severity::Error) {
            errors.push(Diagnostic::error("unusable", "this depends on a formula that is wrong").at(pointer, ""));
        }
        None
    }

    /// Texts, each with its place, as the outputs of one tape, and what its inputs are.
    fn tape(
        &mut self,
        texts: &[(&str, String)],
        here: bool,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<(Tape, Vec<Probe>)> {
        let mut binder = Binder::new(self, Level::Full, true);
        binder.here = if here { scope::FIELDS } else { &[] };
        let mut builder = Builder::new();
        let before = errors.len();
        for (text, pointer) in texts {
            let Some(parsed) = parsed(text, pointer, errors) else { continue };
            match builder.add(&parsed, &mut binder) {
                Ok(node) => {
                    builder.output(node);
                }
                Err(e) => errors.extend(formula_errors(pointer, e)),
            }
        }
        let probes = binder.probes;
        self.used.extend(self.touched.borrow_mut().drain());
        (errors.len() == before).then(|| (builder.finish(), probes))
    }

    /// Reads every definition for its own mistakes. One that uses the local state is a field, which has a meaning only at a place.
    pub fn definitions(&mut self, system: &System, errors: &mut Vec<Diagnostic>) {
        for (name, number) in &self.problem.definitions {
            let mut own = vec![];
            self.number(system, number, &format!("/definitions/{}", token(name)), &mut own);
            errors.extend(own.into_iter().filter(|d| d.code != "field-without-place"));
        }
    }
}
