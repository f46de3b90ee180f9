//! Words for the meridian: ends, segments and joints in the order in which a finger meets them along the drawing.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use super::quantity::{Equation, Formula, Name, Number};

/// One element of the meridian.
///
/// An element with `appears` is absent until its event; an absent element is skipped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "an element of the meridian")]
pub enum Element {
    /// An end on the axis: u = 0, and tau = 0 or pi where the membrane is free there.
    Pole,
    /// An end in a mirror plane: tau = pi/2 at this axial position. Volume, energy and area count both halves.
    Mirror {
        /// Axial position of the mirror plane (length, measured downwards).
        h: Number,
    },
    /// An end that is held.
    Clamped {
        /// Distance from the axis (length).
        u: Number,
        /// Axial position (length, measured downwards).
        h: Number,
    },
    /// An end with exactly the conditions written.
    End {
        /// Equations by name.
        conditions: IndexMap<String, Equation>,
    },
    /// A free segment: four state variables u, h, tau, lambda.
    Free {
        /// Name of the segment.
        name: Name,
        /// Pressure outside (pressure); 0 unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        outside_pressure: Option<Number>,
    },
    /// A segment that lies on a face of a body: two state variables.
    Contact {
        /// The body or its face, such as "cone" or "pipette.wall".
        on: Name,
        /// Name of the segment; that of the face unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<Name>,
        /// How the membrane slides; Frictionless unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        law: ContactLaw,
        /// When it appears; from the start unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        appears: Option<Appears>,
    },
    /// A joint with u, h, tau, lambda continuous. It is implied between Free and Contact.
    Smooth,
    /// A joint at a sharp edge of a body, over which the membrane turns.
    Kink {
        /// The edge, such as "pipette.mouth".
        at: Name,
        /// What holds there besides the place; Frictionless unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        law: KinkLaw,
        /// When it appears; from the start unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        appears: Option<Appears>,
    },
    /// The edge of an adhering contact, of zero range: u, h continuous, w_l(free) cos(theta) = w_l(contact), and
    /// lambda w_l - w larger by the energy on the free side.
    AdhesiveEdge {
        /// Energy of adhesion per reference area.
        energy: Number,
    },
    /// A joint with exactly the conditions written.
    Joint {
        /// Name of the joint.
        name: Name,
        /// Formulas in the local state that are equal on both sides.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        continuous: Vec<Formula>,
        /// Equations by name.
        #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
        conditions: IndexMap<String, Equation>,
    },
}

/// How the membrane moves along a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a law of contact")]
pub enum ContactLaw {
    /// It slides freely.
    #[default]
    Frictionless,
    /// Stretches are frozen when a point touches.
    NoSlip,
}

/// What holds at a sharp edge besides its place.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a law of a kink")]
pub enum KinkLaw {
    /// The membrane slides freely: lambda w_l - w continuous.
    #[default]
    Frictionless,
    /// It slides with friction.
    Capstan {
        /// Coefficient of friction (dimensionless).
        friction: Number,
    },
    /// The material point that touches first stays at the edge.
    Stuck,
    /// The material point given by an equation stays at the edge, such as "phi = asin(rhobar)".
    StuckAt(Equation),
    /// Exactly the equations written, by name.
    Conditions(IndexMap<String, Equation>),
}

/// When an element that is absent at the start appears.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "OnTouch or When(\"equation\")")]
pub enum Appears {
    /// When the membrane touches the face or edge.
    OnTouch,
    /// When the equation is met, such as `"cap.end.tau = 90[deg]"`.
    When(Equation),
}

/// How contacts are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "Listed or Detect")]
pub enum ContactSearch {
    /// Segments are those of the meridian as written.
    #[default]
    Listed,
    /// Contacts are detected from bodies and loads.
    Detect,
}
