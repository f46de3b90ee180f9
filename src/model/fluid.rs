//! The fluid: the law that fixes its pressure, as an equation in the words of a file.

use super::bracket;
use super::ledger::Ledger;
use super::names::Names;
use crate::diagnostic::Diagnostic;
use crate::spec::{Fluid, Problem};
use crate::system::System;

/// The pressure of the fluid and its equation.
pub(super) fn fluid(
    problem: &Problem,
    names: &mut Names,
    system: &mut System,
    ledger: &mut Ledger,
    errors: &mut Vec<Diagnostic>,
) {
    let (Some(fluid), Some(_)) = (&problem.fluid, names.fluid_pressure) else { return };
    let volume = "membrane.volume";
    let (text, pointer, origin) = match fluid {
        Fluid::Incompressible => (format!("{volume} = initial.{volume}"), "/fluid", "fluid (Incompressible)"),
        Fluid::Volume(v) => (format!("{volume} = {}", bracket(v)), "/fluid/Volume", "fluid (Volume)"),
        Fluid::Pressure(p) => (format!("p_f = {}", bracket(p)), "/fluid/Pressure", "fluid (Pressure)"),
        Fluid::Compressible { bulk_modulus } => (
            format!("p_f = initial.p_f + {}*(1 - {volume}/initial.{volume})", bracket(bulk_modulus)),
            "/fluid/Compressible/bulk_modulus",
            "fluid (Compressible)",
        ),
        Fluid::IdealGas { ambient_pressure } => {
            let a = bracket(ambient_pressure);
            (
                format!("(p_f + {a})*{volume} = (initial.p_f + {a})*initial.{volume}"),
                "/fluid/IdealGas/ambient_pressure",
                "fluid (IdealGas)",
            )
        }
        Fluid::Osmotic { osmotic_pressure, excluded_volume } => {
            let (o, b) = (bracket(osmotic_pressure), bracket(excluded_volume));
            (
                format!("p_f = initial.p_f + {o}*((initial.{volume} - {b})/({volume} - {b}) - 1)"),
                "/fluid/Osmotic",
                "fluid (Osmotic)",
            )
        }
        Fluid::Law(law) => (law.as_str().to_owned(), "/fluid/Law", "fluid (Law)"),
    };
    if let Some(f) = names.equation(system, &text, pointer, true, errors) {
        system.conditions.push(f);
        let name = if matches!(fluid, Fluid::Pressure(_)) { "fluid: pressure" } else { "fluid: volume" };
        ledger.condition(name.into(), text, origin.into());
    }
}
