//! States of the shipped problems.

use crate::common;
use membrane::model::Model;
use membrane::run::{self, Reason, Request, Status};
use membrane::solution::{Carried, Solution, View};
use membrane::spec::{Document, Number};
use std::ops::ControlFlow;
use std::sync::Arc;

/// A shipped problem with settings.
#[derive(Clone)]
pub struct Case(Document);

/// Points in an interval of the mesh, so that what is read off them does not depend on it.
const FINE: usize = 8;

/// The membrane at a point.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Material angle from the top pole.
    pub phi: f64,
    /// Meridional stretch.
    pub lambda: f64,
    /// Hoop stretch.
    pub mu: f64,
    /// Meridional tension per reference length.
    pub w_l: f64,
    /// Hoop tension per reference length.
    pub w_m: f64,
}

/// A solved state.
#[derive(Clone)]
pub struct State {
    model: Arc<Model>,
    solution: Solution,
}

/// A branch of states.
pub struct Branch {
    /// At the values that were asked for.
    pub states: Vec<State>,
    /// Kind, whose, and the state.
    pub events: Vec<(&'static str, String, State)>,
}

impl Case {
    pub fn of(stem: &str) -> Case {
        Case(common::read(&format!("problems/{stem}.ron")))
    }

    pub fn set(&self, key: &str, value: impl ToString) -> Case {
        Case(common::with(&self.0, &[(key, value.to_string())]))
    }

    /// One output more.
    pub fn output(&self, name: &str, formula: &str) -> Case {
        let mut outputs = self.0.problem.outputs.clone();
        outputs.insert(name.to_owned(), Number::from(formula));
        let list: Vec<String> = outputs
            .iter()
            .map(|(name, number)| match number {
                Number::Value(v) => format!("{name:?}: {v}"),
                Number::Formula(text) => format!("{name:?}: {text:?}"),
            })
            .collect();
        self.set("outputs", format!("{{{}}}", list.join(", ")))
    }

    /// The branch with another control, through given values.
    pub fn through(&self, control: &str, values: &[f64]) -> Case {
        self.set("branch", format!("(control: {control:?}, at: {values:?})"))
    }

    pub fn branch(&self) -> Branch {
        let model = Arc::new(common::resolve(&self.0));
        let outcome = run::run(&model, &[], &mut |_, _| ControlFlow::Continue(()));
        assert_eq!(outcome.status, Status::Complete, "{}", model.title);
        let all: Vec<(Reason, State)> =
            outcome.points.into_iter().map(|p| (p.reason, State { model: p.model, solution: p.solution })).collect();
        // An event is a state of its branch, which knows its stage.
        let state = |solution: &Solution| {
            let at = all.iter().find(|(_, s)| s.solution.state == solution.state);
            at.map_or_else(|| panic!("an event that is no state"), |(_, s)| s.clone())
        };
        let events = outcome.events.into_iter().map(|e| (e.kind, e.of, state(&e.solution))).collect();
        let asked = |(reason, state)| (reason != Reason::Event && reason != Reason::Fold).then_some(state);
        Branch { events, states: all.into_iter().filter_map(asked).collect() }
    }

    /// For each request the states in which a quantity has a value, in the order of the branch; none where it is never met.
    pub fn at(&self, requests: &[(&str, f64)]) -> Vec<Vec<State>> {
        let asked: Vec<Request> = requests.iter().map(|&(name, value)| Request { name: name.into(), value }).collect();
        let outcome = run::run(&common::resolve(&self.0), &asked, &mut |_, _| ControlFlow::Continue(()));
        let answers = |request: &Request| {
            let points = outcome.points.iter().filter(|p| p.at.as_ref() == Some(request));
            points.map(|p| State { model: p.model.clone(), solution: p.solution.clone() }).collect()
        };
        asked.iter().map(answers).collect()
    }

    /// The state in which a quantity has a value.
    pub fn state(&self, name: &str, value: f64) -> State {
        let mut states = self.at(&[(name, value)]).remove(0);
        assert_eq!(states.len(), 1, "{name} = {value}");
        states.remove(0)
    }
}

impl State {
    fn measured(&self, name: &str) -> membrane::solution::Measured {
        let i = self.model.quantities.iter().position(|q| q.name == name);
        let i = i.unwrap_or_else(|| panic!("there is no {name}"));
        self.solution.quantities[i].unwrap_or_else(|| panic!("{name} has no value"))
    }

    /// The value of a quantity.
    pub fn get(&self, name: &str) -> f64 {
        self.measured(name).value
    }

    /// d ln(one)/d ln(other) along the branch, from the exact derivatives.
    pub fn exponent(&self, one: &str, other: &str) -> f64 {
        self.derivative(one, other) * self.get(other) / self.get(one)
    }

    /// d(one)/d(other) along the branch.
    pub fn derivative(&self, one: &str, other: &str) -> f64 {
        self.measured(one).slope / self.measured(other).slope
    }

    pub fn is_infinite(&self, name: &str) -> bool {
        self.solution.infinite.iter().any(|n| n == name)
    }

    pub fn is_admissible(&self) -> bool {
        self.solution.certificate.is_admissible()
    }

    /// The membrane at many points of the segments that `keep` accepts by name, in walking order.
    pub fn rows(&self, keep: impl Fn(&str) -> bool) -> Vec<Row> {
        let state = self.solution.state.iter().map(|&v| Carried::from(v)).collect();
        let system = self.solution.system(&self.model);
        let view = View::new(&self.model, system, &self.solution.disc, state, None);
        let mut rows = vec![];
        for (s, piece) in system.pieces.iter().enumerate().filter(|(_, piece)| keep(&piece.name)) {
            let last = view.disc.intervals(s) * FINE;
            for k in 0..=last {
                let i = (k / FINE).min(view.disc.intervals(s) - 1);
                let theta = k as f64 / FINE as f64 - i as f64;
                let x = if k == last { 1.0 } else { view.disc.meshes[s][i] + theta * view.disc.width(s, i) };
                let m = view.local(s, x, &view.interpolate(s, i, theta, piece.states()));
                rows.push(Row {
                    phi: system.reference.phi(view.eta(s, x).re),
                    lambda: m.lambda.re,
                    mu: m.mu.re,
                    w_l: m.response.w_l.re,
                    w_m: m.response.w_m.re,
                });
            }
        }
        rows
    }
}

impl Branch {
    /// The first event of that kind.
    pub fn event(&self, kind: &str, of: &str) -> Option<&State> {
        self.events.iter().find(|e| e.0 == kind && e.1 == of).map(|e| &e.2)
    }
}
