//! Words for rigid bodies: shape, orientation and place.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use super::quantity::{Name, Number};

/// A rigid, axisymmetric body that the membrane may touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a body (shape: .., facing: .., h: ..)")]
pub struct Body {
    /// The body's shape.
    pub shape: Shape,
    /// The side on which the membrane is.
    pub facing: Facing,
    /// Axial position (length, measured downwards) of the body's point on the axis: apex, or front plane of a punch
    /// or pipette.
    pub h: Number,
}

/// The side of a body on which the membrane is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "Up or Down")]
pub enum Facing {
    /// The membrane is above, the solid below: a support.
    Up,
    /// The membrane is below, the solid above: an indenter.
    Down,
}

/// The shape of a body. `d` is the depth behind its foremost point on the axis, `u` the distance from the axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a shape")]
pub enum Shape {
    /// A flat plate across the axis.
    Plane,
    /// A cone about the axis.
    Cone {
        /// Angle of its side from the horizontal, positive; 0 is flat. A half-angle is written `"90[deg] - half_angle"`.
        inclination: Number,
        /// Radius of the sphere that rounds the tip (length); sharp unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tip_radius: Option<Number>,
        /// Whether the membrane is inside, as in a funnel; not unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        hollow: bool,
    },
    /// A sphere, centred on the axis.
    Sphere {
        /// Its radius (length).
        radius: Number,
        /// Whether the membrane is inside, as in a bowl; not unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        hollow: bool,
    },
    /// A paraboloid d = u^2/(2 radius).
    Paraboloid {
        /// Radius of curvature at the apex (length).
        radius: Number,
        /// Whether the membrane is inside; not unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        hollow: bool,
    },
    /// A round bar or, hollow, a tube about the axis.
    Cylinder {
        /// Its radius (length).
        radius: Number,
        /// Whether the membrane is inside, as in a tube; not unless given.
        #[serde(default, skip_serializing_if = "is_default")]
        hollow: bool,
    },
    /// A flat-ended bar with the faces `face` and `side` and the sharp `edge` between them.
    Punch {
        /// Its radius (length).
        radius: Number,
    },
    /// The end of a thick-walled tube: the faces `wall` (inside) and `rim` (front plane) and the sharp edge `mouth`.
    Pipette {
        /// Inner radius (length).
        radius: Number,
    },
    /// Any smooth profile: the depth d as a formula in `u`.
    Profile(Number),
    /// A profile drawn face by face, from the axis outwards, in points (u, d).
    Faces {
        /// The first point (u, d).
        from: (Number, Number),
        /// The faces, each from where the last one ended.
        faces: Vec<Face>,
    },
}

/// One face of a drawn profile.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a face")]
pub enum Face {
    /// A straight line.
    Line {
        /// Name of the face, `body.name` elsewhere.
        name: Name,
        /// End point (u, d).
        to: (Number, Number),
        /// Name of the sharp edge at its end; a smooth end or none unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge: Option<Name>,
    },
    /// A circular arc.
    Arc {
        /// Name of the face, `body.name` elsewhere.
        name: Name,
        /// A point (u, d) on the arc between its ends.
        through: (Number, Number),
        /// End point (u, d).
        to: (Number, Number),
        /// Name of the sharp edge at its end; a smooth end or none unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge: Option<Name>,
    },
    /// A curve by two formulas in the parameter `t`.
    Curve {
        /// Name of the face, `body.name` elsewhere.
        name: Name,
        /// Distance from the axis as a formula in `t` (length).
        u: Number,
        /// Depth as a formula in `t` (length).
        d: Number,
        /// First and last value of `t`.
        t: (Number, Number),
        /// Name of the sharp edge at its end; a smooth end or none unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edge: Option<Name>,
    },
}
