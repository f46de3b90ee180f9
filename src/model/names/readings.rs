//! What is read off a field: integrals, largest and smallest values, values at a place.

use super::scope::{Binder, Bound, READABLE};
use crate::expr::{Argument, Builder, ExprError};
use crate::system::{FieldFormula, Probe, Reading, Variable, What};
use std::ops::Range;
use std::sync::Arc;

/// What can be called.
const CALLS: &str = "membrane.integral(w), membrane.max(u), side.min(w_m), side.value(mu, phi = 1.2)";

impl Binder<'_, '_> {
    /// A call such as `membrane.max(u)`.
    pub(super) fn reading(
        &mut self,
        builder: &mut Builder,
        name: &str,
        arguments: &[Argument],
        span: Range<usize>,
    ) -> Bound {
        let wrong = |code, at: Range<usize>, message: String, help: &str| -> Vec<ExprError> {
            ExprError::new(code, at, message).help(help.to_owned()).into()
        };
        let at = span.start..span.start + name.len();
        let known = ["integral", "max", "min", "value"];
        let Some((of, what)) = name.rsplit_once('.').filter(|(_, what)| known.contains(what)) else {
            return Err(wrong("unknown-name", at, format!("there is no `{name}(..)` to call here"), CALLS));
        };
        if self.level != super::Level::Full {
            let message = format!("`{name}(..)` is known only once a state is solved, and a constant is needed here");
            return Err(wrong("not-constant", at, message, CALLS));
        }
        if self.names.absent.iter().any(|a| a == of) {
            // Sums over what is absent are zero; nothing can be read there.
            return Ok(if what == "integral" { builder.constant(0.0) } else { self.probe(builder, Probe::Absent) });
        }
        let pieces = match self.names.pieces.iter().position(|p| p.name == of) {
            Some(s) => self.group(s),
            None if of == "membrane" => (0..self.names.pieces.len()).collect(),
            None => {
                let all: Vec<&str> = self.names.pieces.iter().map(|p| p.name.as_str()).collect();
                let message = format!("there is no segment `{of}`");
                return Err(wrong("unknown-name", at, message, &format!("membrane, {}", all.join(", "))));
            }
        };
        let (field, place) = match (what, arguments) {
            ("value", [field @ Argument { name: None, .. }, Argument { name: Some(key), value, span }])
                if key == "phi" =>
            {
                let node = builder.add(value, self)?;
                let Some(phi) = builder.value(node) else {
                    return Err(wrong("not-constant", span.clone(), "the place must be a constant".into(), CALLS));
                };
                (field, Some(phi))
            }
            ("value", _) => {
                let message = "a value is read at a place: a field and phi = ..".to_owned();
                return Err(wrong("arguments", span, message, CALLS));
            }
            (_, [field @ Argument { name: None, .. }]) => (field, None),
            _ => return Err(wrong("arguments", span, format!("`{name}` takes one field"), CALLS)),
        };
        // The largest radius is where the tangent is vertical, or at an end.
        if what == "max" && of == "membrane" && field.value.as_name() == Some("u") {
            return Ok(self.probe(builder, Probe::LargestRadius));
        }
        let mut inner = Binder::new(self.names, self.level, false);
        inner.here = READABLE;
        let mut own = Builder::new();
        let node = own.add(&field.value, &mut inner)?;
        let variables: Option<Vec<Variable>> =
            inner.probes.iter().map(|probe| if let Probe::Here(v) = probe { Some(*v) } else { None }).collect();
        own.output(node);
        let Some(field) = variables.and_then(|v| FieldFormula::new(own.finish(), v)) else {
            let message = "a field depends on parameters and the local state only".to_owned();
            let help = "local: u, tau, lambda, mu, phi, S, rho0, w, w_l, w_m, p_c; take unknowns out of the call";
            return Err(wrong("not-local", field.span.clone(), message, help));
        };
        if what == "integral" {
            let field = Arc::new(field);
            let mut total = builder.constant(0.0);
            for s in pieces {
                let before = self.names.integrals.borrow().iter().filter(|i| i.0 == s).count();
                let at = self.names.shapes[s].reported() + before;
                self.names.integrals.borrow_mut().push((s, field.clone()));
                let part = self.probe(builder, Probe::Reported(s, at));
                total = builder.sum(total, part);
            }
            return Ok(if of == "membrane" { self.scaled(builder, total) } else { total });
        }
        let what = match (what, place) {
            ("max", _) => What::Max,
            ("min", _) => What::Min,
            (_, place) => What::At(place.unwrap_or(0.0)),
        };
        let reading = self.names.readings.borrow().len();
        self.names.readings.borrow_mut().push(Reading { pieces, field, what });
        Ok(self.probe(builder, Probe::Reading(reading)))
    }
}
