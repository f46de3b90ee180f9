//! The root of a problem file and its smaller blocks: units, branch, sweep, figures, expectations.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::Body;
use super::is_default;
use super::matter::{Fluid, Initial, Material, Reference, Traction, Wrinkling};
use super::meridian::{ContactSearch, Element};
use super::quantity::{Count, Equation, FormatVersion, Formula, Name, Number, Tolerance};

/// A contact problem of an axisymmetric membrane.
///
/// Words of the format are bare, names that you invent and formulas are quoted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "the problem")]
pub struct Problem {
    /// Where the schema of this file stands, for editors. In RON this is the line `#![schema = ".."]`.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Version of the format: 1.
    pub format: FormatVersion,
    /// What the problem is, in a few words.
    pub title: String,
    /// More about it, as long as you like.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<String>,
    /// Units in which outputs are reported; numbers as they are, and radians, unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<Units>,
    /// Given scalars by name. `--set` and `sweep` change these.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub parameters: IndexMap<String, Number>,
    /// Scalars that the solution determines, each with its value in the initial state, which is known, not guessed.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub unknowns: IndexMap<String, Number>,
    /// Names for formulas. One that uses the local state is a field.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub definitions: IndexMap<String, Number>,
    /// The stress-free shape of the membrane.
    pub reference: Reference,
    /// The elastic law.
    pub material: Material,
    /// What happens where the membrane would be compressed; Report unless given.
    #[serde(default, skip_serializing_if = "is_default")]
    pub wrinkling: Wrinkling,
    /// The state from which everything starts.
    pub initial: Initial,
    /// The filling; none, and no pressure inside, unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fluid: Option<Fluid>,
    /// Loads that are spread over the membrane, by name.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub tractions: IndexMap<String, Traction>,
    /// Rigid bodies by name.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub bodies: IndexMap<String, Body>,
    /// Whether contacts are those listed in the meridian or detected; Listed unless given.
    #[serde(default, skip_serializing_if = "is_default")]
    pub contact: ContactSearch,
    /// Ends, segments and joints in order. With `contact: Detect`: pole, a free segment `membrane`, pole, unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian: Option<Vec<Element>>,
    /// Global equations by name, one more condition each.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub constraints: IndexMap<String, Equation>,
    /// The family of states that is followed; one state unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branch: Option<Branch>,
    /// Values of parameters for which the branch is repeated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<Sweep>,
    /// What is reported, besides parameters and unknowns: formulas by name.
    pub outputs: IndexMap<String, Number>,
    /// Relative error asked of every output; 1e-9 unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Tolerance>,
    /// Figures by name.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub figures: IndexMap<String, Figure>,
    /// Exact relations by name, checked at every state.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub identities: IndexMap<String, Equation>,
    /// Numbers of independent origin that the solution must reproduce.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub expect: Vec<Expectation>,
}

/// Units in which outputs are reported, such as `(length: "um", pressure: "Pa", angle: "deg")`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "units (length: .., ..)")]
pub struct Units {
    /// Unit of lengths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<String>,
    /// Unit of forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<String>,
    /// Unit of pressures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<String>,
    /// Unit of tensions (force per length).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension: Option<String>,
    /// Unit of energies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy: Option<String>,
    /// Unit of angles; radians unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<String>,
}

/// The family of states that is followed from the initial state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a branch (control: .., ..)")]
pub struct Branch {
    /// The unknown or output that is led through given values.
    pub control: Name,
    /// First value that is reported; the initial one unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<Number>,
    /// Last value; up to a stop or the end of existence unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<Number>,
    /// How many states are reported between `from` and `to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<Count>,
    /// How they are spaced; Linear unless given.
    #[serde(default, skip_serializing_if = "is_default")]
    pub spacing: Spacing,
    /// The values of the control that are reported, instead of `from`, `to` and `steps`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at: Option<Vec<Number>>,
    /// Unknowns and outputs whose limit points (extrema along the branch) are reported.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limit_points: Vec<Name>,
    /// Equations by name; the branch ends where one is met.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub stops: IndexMap<String, Equation>,
}

/// How values are spaced between two ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "Linear or Log")]
pub enum Spacing {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

/// Values of parameters for which a branch is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a sweep")]
pub enum Sweep {
    /// All combinations of the values of the parameters named.
    Grid(IndexMap<String, Values>),
    /// A list of cases, each with what is different in it.
    Cases(Vec<Case>),
}

/// What is different in one case of a sweep: values of parameters, in the unit in which the file writes them, and keys of
/// the root, written as there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a case, parameters and keys of the root with values")]
pub struct Case {
    /// Another stress-free shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<Reference>,
    /// Another elastic law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Another treatment of compression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrinkling: Option<Wrinkling>,
    /// Another state from which everything starts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<Initial>,
    /// Another filling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fluid: Option<Fluid>,
    /// Other loads, all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tractions: Option<IndexMap<String, Traction>>,
    /// Other rigid bodies, all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bodies: Option<IndexMap<String, Body>>,
    /// Another meridian.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meridian: Option<Vec<Element>>,
    /// Another branch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub branch: Option<Branch>,
    /// Another relative error asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Tolerance>,
    /// Values of parameters by name.
    #[serde(flatten)]
    pub parameters: IndexMap<String, Number>,
}

/// The values that one parameter takes in a sweep, in the unit in which the file writes the parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Values([..]), Linear(..) or Log(..)")]
pub enum Values {
    /// The values one by one.
    Values(Vec<Number>),
    /// With equal differences.
    Linear {
        /// First value.
        from: Number,
        /// Last value.
        to: Number,
        /// How many values, both ends included.
        count: Count,
    },
    /// With equal ratios.
    Log {
        /// First value.
        from: Number,
        /// Last value, of the same sign.
        to: Number,
        /// How many values, both ends included.
        count: Count,
    },
}

/// A figure, drawn from the solution.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a figure")]
pub enum Figure {
    /// Quantities along the branch.
    Response {
        /// What is drawn along the abscissa.
        x: Formula,
        /// What is drawn along the ordinate, one curve each.
        y: Vec<Formula>,
        /// Which axes are logarithmic; none unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        scale: Scale,
        /// Parameters that vary from curve to curve.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sweep: Option<Sweep>,
    },
    /// Deformed meridians.
    Shapes {
        /// The states: values of unknowns or outputs.
        at: IndexMap<String, Vec<Number>>,
        /// Parameters that vary from curve to curve.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sweep: Option<Sweep>,
    },
    /// Fields along the meridian.
    Distribution {
        /// What is drawn along the abscissa, such as "phi" or "S".
        x: Formula,
        /// What is drawn along the ordinate, such as "w_l", one curve each.
        y: Vec<Formula>,
        /// The states: values of unknowns or outputs.
        at: IndexMap<String, Vec<Number>>,
        /// Parameters that vary from curve to curve.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        sweep: Option<Sweep>,
    },
}

/// Which axes of a figure are logarithmic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a scale")]
pub enum Scale {
    /// None.
    #[default]
    Linear,
    /// The abscissa.
    LogX,
    /// The ordinate.
    LogY,
    /// Both.
    LogLog,
}

/// Numbers of independent origin at one state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "an expectation (at: .., values: .., ..)")]
pub struct Expectation {
    /// Parameters that differ from the file's.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub set: IndexMap<String, Number>,
    /// The state: unknowns or outputs with their values.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub at: IndexMap<String, Number>,
    /// The numbers expected, by name.
    pub values: IndexMap<String, Number>,
    /// Relative error allowed.
    pub relative: Tolerance,
    /// Where the numbers come from.
    pub source: String,
    /// Why a converged solution must NOT reproduce these published numbers, where that is so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refuted: Option<String>,
}
