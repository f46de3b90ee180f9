//! The fluid: the law that fixes its pressure, as an equation in the words of a file.

use super::bracket;
use super::ledger::Ledger;
use super::names::Names;
use crate::diagnostic::Diagnostic;
use crate::spec::{Fluid, Problem};
use crate::system::System;

/// Refuses constants that no fluid has. What is no constant is examined with the equation.
fn constants(fluid: &Fluid, names: &Names, errors: &mut Vec<Diagnostic>) {
    let (number, pointer, what, least) = match fluid {
        Fluid::Compressible { bulk_modulus } => {
            (bulk_modulus, "/fluid/Compressible/bulk_modulus", "the bulk modulus must be positive", f64::MIN_POSITIVE)
        }
        Fluid::IdealGas { ambient_pressure } => {
            (ambient_pressure, "/fluid/IdealGas/ambient_pressure", "the ambient pressure must not be negative", 0.0)
        }
        Fluid::Osmotic { excluded_volume, .. } => {
            (excluded_volume, "/fluid/Osmotic/excluded_volume", "the excluded volume must not be negative", 0.0)
        }
        _ => return,
    };
    if let Some(v) = names.constant(number, pointer, &mut vec![]).filter(|v| *v < least) {
        errors.push(Diagnostic::error("not-positive", format!("{what}, not {v}")).at(pointer, format!("is {v}")));
    }
}

/// The pressure of the fluid and its equation.
pub(super) fn fluid(
    problem: &Problem,
    names: &mut Names,
    system: &mut System,
    ledger: &mut Ledger,
    errors: &mut Vec<Diagnostic>,
) {
    let (Some(fluid), Some(_)) = (&problem.fluid, names.fluid_pressure) else { return };
    constants(fluid, names, errors);
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
