//! A problem explained: what is given, what is unknown, which equations are solved and where each comes from. Markdown.

use crate::model::{Change, Entry, Model, Steps, When};
use crate::number::plain;
use crate::physics::surface::Generator;
use crate::spec::{Number, Problem, convert};
use crate::sweep::Plan;
use crate::system::{Coordinate, Kind, Place};
use comfy_table::{Table, presets};
use ron::ser::PrettyConfig;
use serde::Serialize;
use std::fmt::Write;

/// Equilibrium along the meridian, as it is solved.
const EQUILIBRIUM: &str = "\
Along every segment, with d eta = dS/rho0 and tensions w_l, w_m = dw/d(lambda, mu) per reference length:

```text
d ln(lambda)/d eta = [(w_m - lambda w_lm) cos tau - (w_l - mu w_lm) rho0'] / (lambda w_ll)
d ln(mu)/d eta     = (lambda/mu) cos tau - rho0'                      u = mu rho0
free:     d tau/d eta = (lambda mu rho0 p - w_m sin tau) / w_l        dh/d eta = rho0 lambda sin tau
contact:  u, h and tau follow from the parameter t of the face's generator, dt/d eta = rho0 lambda/(ds/dt);
          the contact pressure carries the rest of p
```
";

/// The explanation of a problem and, if it has one, its sweep.
pub fn explain(problem: &Problem, model: &Model, plan: Option<&Plan>) -> String {
    let mut text = format!("# {}\n", model.title.trim());
    if let Some(about) = &problem.about {
        let _ = write!(text, "\n{}\n", about.trim());
    }
    if !model.parameters.is_empty() {
        let written = |name: &str| problem.parameters.get(name).map(ToString::to_string).unwrap_or_default();
        let rows = model.parameters.iter().map(|(name, value)| [name.clone(), plain(*value), written(name)]);
        section(&mut text, "Parameters", ["name", "value", "written"], rows);
    }
    initial(problem, model, &mut text);
    material(problem, model, &mut text);
    if !problem.bodies.is_empty() {
        let rows = problem
            .bodies
            .iter()
            .map(|(name, body)| [name.clone(), ron(&body.shape), ron(&body.facing), body.h.to_string()]);
        section(&mut text, "Bodies", ["name", "shape", "facing", "h (axial position, downwards)"], rows);
    }
    segments(model, &mut text);
    let (unknowns, conditions) = (&model.ledger.unknowns, &model.ledger.conditions);
    let entry = |e: &Entry| [e.name.clone(), e.text.clone(), e.origin.clone()];
    section(&mut text, "Unknowns", ["name", "what it is", "from"], unknowns.iter().map(entry));
    section(&mut text, "Conditions", ["name", "equation", "from"], conditions.iter().map(entry));
    let _ = writeln!(text, "\n{} unknowns, {} conditions.", unknowns.len(), conditions.len());
    let formula = |(name, number): (&String, &Number)| [name.clone(), number.to_string()];
    section(&mut text, "Outputs", ["name", "formula"], problem.outputs.iter().map(formula));
    if !problem.identities.is_empty() {
        let rows = problem.identities.iter().map(|(name, equation)| [name.clone(), equation.to_string()]);
        section(&mut text, "Identities, checked at every state", ["name", "equation"], rows);
    }
    for change in &model.changes {
        next(model, change, &mut text);
    }
    branch(problem, model, &mut text);
    if let Some(plan) = plan {
        let _ = writeln!(text, "\n## Sweep\n\nAll this for each of {} cases, with other values of:", plan.cases());
        for name in plan.names() {
            let _ = writeln!(text, "* `{name}`");
        }
    }
    text
}

/// What an event changes: unknowns and conditions that come and go, and what undoes it.
fn next(model: &Model, change: &Change, text: &mut String) {
    let Ok(after) = model.after(change, 1.0) else { return };
    let (old, new) = (&model.ledger, &after.ledger);
    let differ = |sign: &str, what: &str, of: &[Entry], than: &[Entry]| -> Vec<[String; 4]> {
        let entries = of.iter().filter(|e| !than.contains(e));
        entries.map(|e| [format!("{sign} {what}"), e.name.clone(), e.text.clone(), e.origin.clone()]).collect()
    };
    let rows = [
        differ("-", "unknown", &old.unknowns, &new.unknowns),
        differ("+", "unknown", &new.unknowns, &old.unknowns),
        differ("-", "condition", &old.conditions, &new.conditions),
        differ("+", "condition", &new.conditions, &old.conditions),
    ];
    let header = ["comes (+), goes (-)", "name", "what it is, or equation", "from"];
    section(text, &format!("Event: {} of {}", change.kind, change.of), header, rows.concat());
    let _ = write!(text, "\nIt happens where {}", told(change));
    let _ = writeln!(text, "; the stage {} becomes {}.", code(&model.stage()), code(&after.stage()));
    let _ = writeln!(text, "{} unknowns, {} conditions.", new.unknowns.len(), new.conditions.len());
    for back in after.changes.iter().filter(|back| back.at == change.at) {
        let _ = writeln!(text, "The event {} undoes it where {}.", back.kind, told(back));
    }
}

/// When a change happens, in words.
fn told(change: &Change) -> String {
    match change.when {
        When::Formula(_) | When::Exceeded(_) => code(&change.text),
        _ => change.text.clone(),
    }
}

fn initial(problem: &Problem, model: &Model, text: &mut String) {
    let i = &model.initial;
    let rows = [
        ("reference radius", i.reference.radius()),
        ("stretch", i.stretch),
        ("radius", i.radius),
        ("tension (per reference length)", i.tension),
        ("over-pressure", i.pressure),
        ("volume", i.volume),
        ("energy", i.energy),
    ];
    let rows = rows.map(|(name, value)| [name.to_owned(), plain(value)]);
    section(text, "Initial state, in closed form", ["quantity", "value"], rows);
    let _ = writeln!(text, "\nReference: {}  ", code(&ron(&problem.reference)));
    let _ = writeln!(text, "Initial: {}  ", code(&ron(&problem.initial)));
    let fluid = problem.fluid.as_ref().map_or("none".into(), |fluid| code(&ron(fluid)));
    let _ = writeln!(text, "Fluid: {fluid}");
}

fn material(problem: &Problem, model: &Model, text: &mut String) {
    let m = model.initial.law.moduli();
    let rows = [
        ("surface shear modulus G_s (tension)", m.shear),
        ("area dilatation modulus K_s (tension)", m.area),
        ("surface Young modulus E_s (tension)", m.young),
        ("surface Poisson ratio nu_s (no unit)", m.poisson),
    ];
    let rows = rows.map(|(name, value)| [name.to_owned(), plain(value)]);
    section(text, "Material", ["at small strain", "value"], rows);
    let _ = writeln!(text, "\nMaterial: {}", code(&ron(&problem.material)));
}

fn segments(model: &Model, text: &mut String) {
    let place = |place: Place, pole: &str| match place {
        Place::Pole => pole.to_owned(),
        Place::Fixed(eta) => format!("phi = {}", plain(2.0 * eta.exp().atan())),
        Place::Unknown(global) => model.globals[global].clone(),
    };
    let rows = model.system.pieces.iter().enumerate().map(|(i, piece)| {
        let body = model.bodies.iter().find(|b| b.pieces.contains(&i)).map_or("a face", |b| &b.name);
        let kind = match &piece.kind {
            Kind::Free => "free".to_owned(),
            Kind::Contact(_) => format!("contact on {body}, frictionless"),
        };
        let states = match &piece.kind {
            Kind::Free => "ln lambda, ln mu, tau; h by quadrature",
            Kind::Contact(face) if face.surface.axial() => "ln lambda, ln(t/rho0)",
            Kind::Contact(_) => "ln lambda, t",
        };
        let coordinate = match piece.coordinate {
            Coordinate::Between => "eta, linear in x".to_owned(),
            Coordinate::FromPole(order) => format!("from a pole, x = (e^eta)^{order:.0}"),
            Coordinate::ToPole(order) => format!("to a pole, 1 - x = (e^-eta)^{order:.0}"),
            Coordinate::FromTip(length) => format!("from a tip, {length:.1} in eta"),
            Coordinate::ToTip(length) => format!("to a tip, {length:.1} in eta"),
            Coordinate::PoleToPole => "from pole to pole, x = phi/pi".to_owned(),
        };
        let pressure = match (piece.pressure.fluid, &piece.pressure.outside) {
            (Some(_), None) => "p_f",
            (Some(_), Some(_)) => "p_f - outside",
            (None, Some(_)) => "- outside",
            (None, None) => "0",
        };
        [
            piece.name.clone(),
            kind,
            format!("{} .. {}", place(piece.from, "top pole"), place(piece.to, "bottom pole")),
            states.to_owned(),
            coordinate,
            pressure.to_owned(),
        ]
    });
    section(text, "Segments", ["name", "kind", "from .. to", "states", "coordinate", "p"], rows);
    let _ = write!(text, "\n{EQUILIBRIUM}");
}

fn branch(problem: &Problem, model: &Model, text: &mut String) {
    let branch = &model.branch;
    let _ = write!(text, "\n## Branch\n\nControl: {}", code(&branch.control));
    let _ = match &branch.steps {
        Steps::Listed(values) => {
            let values: Vec<String> = values.iter().map(|v| plain(*v)).collect();
            writeln!(text, " = {}.", values.join(", "))
        }
        Steps::Open { from, step } => {
            let from = from.map_or("the initial state".to_owned(), plain);
            writeln!(text, ", from {from} in steps of {} until a stop, or as far as states exist.", plain(*step))
        }
        Steps::Spaced { from, to, count, log } => {
            let from = from.map_or("the initial state".to_owned(), plain);
            let spacing = if *log { ", in equal ratios" } else { "" };
            writeln!(text, ", {count} values from {from} to {}{spacing}.", plain(*to))
        }
    };
    if !branch.limit_points.is_empty() {
        let names: Vec<String> = branch.limit_points.iter().map(|n| code(n)).collect();
        let _ = writeln!(text, "Limit points are located of: {}.", names.join(", "));
    }
    for (name, equation) in problem.branch.iter().flat_map(|b| &b.stops) {
        let _ = writeln!(text, "It stops at {name}: {}.", code(equation.as_str()));
    }
    let _ = writeln!(text, "Relative error asked of every quantity: {}.", plain(model.accuracy));
}

/// A value of the file in the words of the file.
fn ron(value: &impl Serialize) -> String {
    let options = ron::Options::default().with_default_extension(convert::extensions());
    let line = PrettyConfig::new().depth_limit(0).struct_names(false);
    options.to_string_pretty(value, line).unwrap_or_default()
}

/// Text in Markdown's backquotes.
fn code(text: &str) -> String {
    if text.contains('`') { format!("`` {text} ``") } else { format!("`{text}`") }
}

/// A heading with a table.
fn section<const N: usize>(
    text: &mut String,
    title: &str,
    header: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header);
    for row in rows {
        table.add_row(row.map(|cell| cell.replace('|', "\\|").replace(['\n', '\r'], " ")));
    }
    let _ = write!(text, "\n## {title}\n\n{table}\n");
}
