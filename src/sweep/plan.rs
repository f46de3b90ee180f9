//! The cases of a sweep, in order.

use crate::diagnostic::{Diagnostic, Label, Place, Severity, suggest};
use crate::expr;
use crate::model::{self, Refused, formula_errors, in_unit_of, token};
use crate::number::plain;
use crate::spec::{self, Count, Number, Problem, Sweep, Values};
use rayon::prelude::*;
use serde_json::{Map, Value, json};

/// Cases of a sweep at most.
const MOST_CASES: usize = Count::MAX as usize;
/// Different complaints about cases at most.
const MOST_COMPLAINTS: usize = 20;

/// What a problem is solved for, one case after the other. The problem of a case is made when it is asked for.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The problem without its sweep.
    base: Problem,
    kind: Kind,
    cases: usize,
}

#[derive(Clone, Debug)]
enum Kind {
    /// All combinations of the values on each axis; the last axis goes fastest.
    Grid(Vec<Axis>),
    /// One after the other.
    List(Vec<(spec::Case, Vec<Setting>)>),
}

/// The values of one parameter.
#[derive(Clone, Debug)]
struct Axis {
    values: Vec<Setting>,
}

/// A value of a parameter.
#[derive(Clone, Debug)]
struct Setting {
    name: String,
    /// As the file could have it, with its unit.
    number: Number,
    /// As it is reported, in the unit of the file.
    shown: Value,
    /// Where it stands in the file.
    pointer: String,
}

/// One case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its number, from 0.
    pub index: usize,
    /// What is set in it: parameters in the unit in which the file writes them, keys of the root as they stand there.
    pub set: Map<String, Value>,
    /// The problem as it is in this case.
    pub problem: Problem,
    /// Pointers into that problem, and where in the file of the sweep their values come from.
    places: Vec<(String, String)>,
}

impl Plan {
    /// The cases of a problem's sweep; nothing if it has none.
    ///
    /// # Errors
    /// Names that are no parameters, values that are no numbers, no cases or too many; places are pointers into the file.
    pub fn new(problem: &Problem) -> Result<Option<Plan>, Vec<Diagnostic>> {
        let Some(sweep) = &problem.sweep else { return Ok(None) };
        let base = Problem { sweep: None, ..problem.clone() };
        let mut errors = vec![];
        let (kind, cases) = match sweep {
            Sweep::Grid(axes) => {
                let axes: Vec<Axis> =
                    axes.iter().filter_map(|(name, values)| axis(&base, name, values, &mut errors)).collect();
                let count = axes.iter().try_fold(1usize, |n, axis| n.checked_mul(axis.values.len()));
                let cases = if axes.is_empty() { Some(0) } else { count };
                (Kind::Grid(axes), cases)
            }
            Sweep::Cases(list) => {
                let cases: Vec<_> = list
                    .iter()
                    .enumerate()
                    .map(|(i, case)| {
                        let pointer = |name: &str| format!("/sweep/Cases/{i}/{}", token(name));
                        let numbers = case.parameters.iter();
                        let set = |(name, number): (&String, &Number)| {
                            declared(&base, name, &pointer(name), true, &mut errors)
                                .then(|| setting(&base, name, number, pointer(name), &mut errors))
                                .flatten()
                        };
                        (case.clone(), numbers.filter_map(set).collect())
                    })
                    .collect();
                let n = cases.len();
                (Kind::List(cases), Some(n))
            }
        };
        if errors.is_empty() {
            match cases {
                Some(1..=MOST_CASES) => {}
                Some(0) => errors.push(Diagnostic::error("no-cases", "the sweep has no cases").at("/sweep", "empty")),
                _ => {
                    let message = format!("the sweep has more than {MOST_CASES} cases");
                    errors.push(Diagnostic::error("too-many-cases", message).at_key("/sweep", ""));
                }
            }
        }
        if errors.is_empty() { Ok(Some(Plan { base, kind, cases: cases.unwrap_or(0) })) } else { Err(errors) }
    }

    /// How many cases there are.
    pub fn cases(&self) -> usize {
        self.cases
    }

    /// The names that are set in any of the cases.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = vec![];
        let cases = if let Kind::Grid(_) = self.kind { 1 } else { self.cases };
        for name in (0..cases).flat_map(|index| self.case(index).set.into_iter().map(|set| set.0)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// The case of a number below [`Plan::cases`]. In a grid the parameter named last changes fastest.
    pub fn case(&self, index: usize) -> Case {
        let mut case = Case { index, set: Map::new(), problem: self.base.clone(), places: vec![] };
        match &self.kind {
            Kind::Grid(axes) => {
                let (mut rest, mut chosen) = (index, vec![]);
                for axis in axes.iter().rev() {
                    chosen.push(&axis.values[rest % axis.values.len()]);
                    rest /= axis.values.len();
                }
                chosen.into_iter().rev().for_each(|setting| case.put(setting));
            }
            Kind::List(list) => {
                let (said, settings) = &list[index];
                case.replace(said);
                settings.iter().for_each(|setting| case.put(setting));
            }
        }
        case
    }

    /// What is wrong with the cases, each complaint once; places are pointers into the file of the sweep.
    pub fn examine(&self) -> Vec<Diagnostic> {
        let refused: Vec<(usize, Vec<Diagnostic>)> = (0..self.cases)
            .into_par_iter()
            .filter_map(|index| self.case(index).complaints().map(|list| (index, list)))
            .collect();
        let mut said: Vec<(Diagnostic, usize, usize)> = vec![];
        for (index, diagnostic) in refused.into_iter().flat_map(|(i, list)| list.into_iter().map(move |d| (i, d))) {
            let same = |d: &Diagnostic| d.code == diagnostic.code && d.message == diagnostic.message;
            let room = said.len() < MOST_COMPLAINTS;
            match said.iter_mut().find(|(d, ..)| same(d)) {
                Some((_, _, more)) => *more += 1,
                None if room => said.push((diagnostic, index, 0)),
                None => {}
            }
        }
        let told = |(diagnostic, index, more): (Diagnostic, usize, usize)| {
            let place = self.case(index).to_string();
            diagnostic.help(match more {
                0 => format!("in {place}"),
                more => format!("in {place}, and in {more} more"),
            })
        };
        said.into_iter().map(told).collect()
    }
}

impl Case {
    fn put(&mut self, setting: &Setting) {
        self.set.insert(setting.name.clone(), setting.shown.clone());
        self.problem.parameters.insert(setting.name.clone(), setting.number.clone());
        self.places.push((format!("/parameters/{}", token(&setting.name)), setting.pointer.clone()));
    }

    /// Puts keys of the root in the place of the problem's.
    fn replace(&mut self, said: &spec::Case) {
        let problem = &mut self.problem;
        #[rustfmt::skip] // without `..`: a key that is added to the format must be thought of here
        let spec::Case { reference, material, wrinkling, initial, fluid, tractions, bodies, meridian, branch, accuracy,
                         parameters: _ } = said;
        fn over<T: Clone>(old: &mut T, new: &Option<T>) {
            if let Some(new) = new {
                old.clone_from(new);
            }
        }
        over(&mut problem.reference, reference);
        over(&mut problem.material, material);
        over(&mut problem.wrinkling, wrinkling);
        over(&mut problem.initial, initial);
        over(&mut problem.tractions, tractions);
        over(&mut problem.bodies, bodies);
        over(&mut problem.fluid, &fluid.clone().map(Some));
        over(&mut problem.meridian, &meridian.clone().map(Some));
        over(&mut problem.branch, &branch.clone().map(Some));
        over(&mut problem.accuracy, &accuracy.map(Some));
        let keys = spec::Case { parameters: Default::default(), ..said.clone() };
        if let Ok(Value::Object(keys)) = serde_json::to_value(keys) {
            for (key, value) in keys {
                self.places.push((format!("/{key}"), format!("/sweep/Cases/{}/{key}", self.index)));
                self.set.insert(key, value);
            }
        }
    }

    /// What the case means.
    ///
    /// # Errors
    /// What is wrong with it; places are pointers into the problem of the case.
    pub fn resolve(&self) -> Result<model::Model, Refused> {
        model::resolve(&self.problem)
    }

    /// What is wrong with it, at the places of the values that are set.
    fn complaints(&self) -> Option<Vec<Diagnostic>> {
        let refused = self.resolve().err()?;
        let errors = refused.diagnostics.into_iter().filter(|d| d.severity == Severity::Error);
        Some(errors.map(|d| self.moved(d)).collect())
    }

    /// A complaint with places in the file of the sweep: those of values that are set, or, where it is about something that
    /// follows from them, all of these in front of it.
    fn moved(&self, mut diagnostic: Diagnostic) -> Diagnostic {
        let mut found = false;
        for label in &mut diagnostic.labels {
            let (Place::Pointer(pointer) | Place::Key(pointer) | Place::Within(pointer, _)) = &label.at else {
                continue;
            };
            let inside = |from: &str| {
                let rest = pointer.strip_prefix(from)?;
                (rest.is_empty() || rest.starts_with('/')).then_some(rest)
            };
            let Some((rest, to)) = self.places.iter().find_map(|(from, to)| Some((inside(from)?, to))) else {
                continue;
            };
            let pointer = format!("{to}{rest}");
            label.at = match &label.at {
                Place::Within(_, range) if to.starts_with("/sweep/Cases") => Place::Within(pointer, range.clone()),
                Place::Key(_) => Place::Key(pointer),
                _ => Place::Pointer(pointer),
            };
            found = true;
        }
        if !found {
            let labels =
                self.places.iter().map(|(_, to)| Label { at: Place::Pointer(to.clone()), text: String::new() });
            diagnostic.labels = labels.chain(diagnostic.labels).collect();
        }
        diagnostic
    }
}

impl std::fmt::Display for Case {
    /// `case 3 (r0 = 1.2, material = Skalak)`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let set: Vec<String> = self.set.iter().map(|(name, value)| format!("{name} = {}", short(value))).collect();
        write!(f, "case {}", self.index)?;
        if set.is_empty() { Ok(()) } else { write!(f, " ({})", set.join(", ")) }
    }
}

/// A value that is set, in a word.
pub(super) fn short(value: &Value) -> String {
    match value {
        Value::Number(number) => plain(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) => text.clone(),
        // `Skalak(..)`, `(control: .., ..)`.
        Value::Object(map) if map.len() == 1 => map.keys().next().cloned().unwrap_or_default(),
        _ => "..".into(),
    }
}

/// True if there is such a parameter; else there is a complaint now.
fn declared(problem: &Problem, name: &str, pointer: &str, keys: bool, errors: &mut Vec<Diagnostic>) -> bool {
    if problem.parameters.contains_key(name) {
        return true;
    }
    let message = format!("there is no parameter `{name}` that a sweep could set");
    let parameters = problem.parameters.keys().map(String::as_str);
    let mut d = Diagnostic::error("unknown-name", message)
        .at_key(pointer, "no parameter has this name")
        .help(suggest(name, parameters));
    if problem.unknowns.contains_key(name) || problem.outputs.contains_key(name) {
        d = d.help(format!("states in which `{name}` has a value are asked for with `branch` or --at"));
    }
    if spec::schema::root_keys().any(|key| key == name) {
        d = d.help(if keys {
            "this key cannot differ from case to case"
        } else {
            "keys of the root differ in `Cases([..])`"
        });
    }
    errors.push(d);
    false
}

/// A value of a parameter, read.
fn setting(
    problem: &Problem,
    name: &str,
    number: &Number,
    pointer: String,
    errors: &mut Vec<Diagnostic>,
) -> Option<Setting> {
    let parameter = problem.parameters.get(name)?;
    let with_unit = |text: &str| expr::parse(text).is_ok_and(|parsed| !parsed.units().is_empty());
    if let Number::Formula(text) = number
        && with_unit(text)
    {
        return Some(Setting { name: name.into(), number: number.clone(), shown: json!(text), pointer });
    }
    let value = value(number, &pointer, errors)?;
    Some(Setting { name: name.into(), number: in_unit_of(parameter, value), shown: json!(value), pointer })
}

/// A number without names.
fn value(number: &Number, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<f64> {
    match number {
        Number::Value(value) => Some(*value),
        Number::Formula(text) => match expr::constant(text) {
            Ok(value) => Some(value),
            Err(error) => {
                errors.extend(formula_errors(pointer, vec![error]));
                None
            }
        },
    }
}

/// The values of one parameter of a grid.
fn axis(problem: &Problem, name: &str, values: &Values, errors: &mut Vec<Diagnostic>) -> Option<Axis> {
    let pointer = format!("/sweep/Grid/{}", token(name));
    if !declared(problem, name, &pointer, false, errors) {
        return None;
    }
    let (word, from, to, count) = match values {
        Values::Values(list) => {
            if list.is_empty() {
                errors.push(
                    Diagnostic::error("no-cases", format!("the parameter `{name}` is given no values"))
                        .at(pointer.clone(), "empty"),
                );
            }
            let read = |(i, number)| setting(problem, name, number, format!("{pointer}/Values/{i}"), errors);
            return Some(Axis { values: list.iter().enumerate().filter_map(read).collect() });
        }
        Values::Linear { from, to, count } => ("Linear", from, to, count),
        Values::Log { from, to, count } => ("Log", from, to, count),
    };
    let mut end = |number: &Number, key: &str| {
        let pointer = format!("{pointer}/{word}/{key}");
        if number.formula().and_then(|text| expr::parse(text).ok()).is_some_and(|parsed| !parsed.units().is_empty()) {
            errors.push(
                Diagnostic::error(
                    "unit-misplaced",
                    "the ends of a sweep are in the unit of the parameter, without one",
                )
                .at(pointer, "with a unit"),
            );
            return None;
        }
        value(number, &pointer, errors)
    };
    let (from, to) = (end(from, "from"), end(to, "to"));
    let (from, to) = (from?, to?);
    let last = count.get() - 1;
    if word == "Log" && !(from * to > 0.0) {
        errors.push(
            Diagnostic::error("log-spacing", "equal ratios need `from` and `to` of the same sign, not zero")
                .at(pointer, "not possible here"),
        );
        return None;
    }
    if last == 0 && from != to {
        errors.push(
            Diagnostic::error("one-value", "one value cannot be at both ends")
                .at(format!("{pointer}/{word}/count"), "at least 2 where `from` and `to` differ"),
        );
        return None;
    }
    let parameter = problem.parameters.get(name)?;
    let values = (0..=last).map(|i| {
        let t = i as f64 / last.max(1) as f64;
        let value = match i {
            0 => from,
            i if i == last => to,
            _ if word == "Log" => from * (to / from).powf(t),
            _ => from + (to - from) * t,
        };
        let number = in_unit_of(parameter, value);
        Setting { name: name.into(), number, shown: json!(value), pointer: pointer.clone() }
    });
    Some(Axis { values: values.collect() })
}
