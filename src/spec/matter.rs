//! Words for the membrane itself: its reference shape, material, initial state, filling and loads.

use super::is_default;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

use super::quantity::{Equation, Formula, Name, Number};

/// The stress-free shape of the membrane, from which stretches are measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a reference shape")]
pub enum Reference {
    /// A full sphere. The material angle phi runs from the top pole (0) to the bottom pole (pi).
    Sphere {
        /// Radius of the sphere (length).
        radius: Number,
    },
    /// A spheroid about the axis, from the top pole to the bottom pole.
    Spheroid {
        /// Radius at the equator (length).
        radius: Number,
        /// Half of the height along the axis (length).
        half_height: Number,
    },
    /// A flat circular sheet, from its centre to its rim.
    Disc {
        /// Radius of the rim (length).
        radius: Number,
    },
    /// An open tube about the axis, from its upper to its lower rim.
    Cylinder {
        /// Radius of the tube (length).
        radius: Number,
        /// Length along the axis (length).
        length: Number,
    },
    /// Any meridian, given by two formulas in the parameter `t`.
    Meridian {
        /// Distance from the axis as a formula in `t` (length, not negative).
        rho0: Number,
        /// Axial position as a formula in `t` (length, measured downwards).
        h0: Number,
        /// First and last value of `t`.
        t: (Number, Number),
    },
}

/// The elastic law: strain energy per reference area as a function of the two stretches.
///
/// Constants are numbers or formulas of parameters; those that depend on the reference position (`S phi t rho0 h0`) are for later.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a material")]
pub enum Material {
    /// G/2 (I1 - 3), with I1 = lambda^2 + mu^2 + (lambda mu)^-2.
    NeoHookean {
        /// Small-strain surface shear modulus G (tension).
        shear_modulus: Number,
    },
    /// c1 (I1 - 3) + c2 (I2 - 3), with I2 = lambda^-2 + mu^-2 + (lambda mu)^2; shear modulus 2 (c1 + c2).
    MooneyRivlin {
        /// Factor of I1 - 3 (tension).
        c1: Number,
        /// Factor of I2 - 3 (tension).
        c2: Number,
    },
    /// Sum of 2 G_i/a_i^2 (lambda^a_i + mu^a_i + (lambda mu)^-a_i - 3) over the terms (G_i, a_i); shear modulus: the
    /// sum of the G_i.
    Ogden(
        /// The terms, each `(shear_modulus: .., exponent: ..)` or `(G_i, a_i)`.
        Vec<OgdenTerm>,
    ),
    /// Sum of C_n (I1 - 3)^n, n = 1, 2, ..; shear modulus 2 C_1.
    Yeoh(
        /// The factors C_1, C_2, .. (tension).
        Vec<Number>,
    ),
    /// -(G Jm/2) ln(1 - (I1 - 3)/Jm).
    Gent {
        /// Shear modulus G (tension).
        shear_modulus: Number,
        /// Jm: the value of I1 - 3 at which the material locks (dimensionless).
        locking: Number,
    },
    /// G/(2 b) (exp(b (I1 - 3)) - 1).
    Fung {
        /// Shear modulus G (tension).
        shear_modulus: Number,
        /// Factor b in the exponent (dimensionless).
        exponent: Number,
    },
    /// 2 G (lambda + mu + 1/(lambda mu) - 3).
    Varga {
        /// Shear modulus G (tension).
        shear_modulus: Number,
    },
    /// G/4 (I1^2 + 2 I1 - 2 I2 + C I2^2), with I1 = lambda^2 + mu^2 - 2 and I2 = (lambda mu)^2 - 1 (red blood cell).
    Skalak {
        /// Surface shear modulus G (tension).
        shear_modulus: Number,
        /// C: resistance to area change over resistance to shear (dimensionless).
        area_ratio: Number,
    },
    /// K/2 (lambda mu - 1)^2 + G ((lambda^2 + mu^2)/(2 lambda mu) - 1).
    EvansSkalak {
        /// Surface shear modulus G (tension).
        shear_modulus: Number,
        /// Area modulus K (tension).
        area_modulus: Number,
    },
    /// E/(2 (1 - nu^2)) (e1^2 + 2 nu e1 e2 + e2^2), e = stretch - 1.
    Hooke {
        /// Surface Young's modulus E (tension).
        young_modulus: Number,
        /// Surface Poisson's ratio nu (dimensionless).
        poisson_ratio: Number,
    },
    /// Any strain energy per reference area, as a formula in `lambda` and `mu`; counted from its value at `lambda = mu = 1`.
    Energy(Formula),
}

/// One term of an Ogden material, written `(shear_modulus: 0.6, exponent: 1.3)` or in short `(0.6, 1.3)`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OgdenTerm {
    /// Contribution G_i to the shear modulus (tension).
    pub shear_modulus: Number,
    /// Exponent a_i (dimensionless, not 0).
    pub exponent: Number,
}

impl<'de> Deserialize<'de> for OgdenTerm {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(field_identifier, rename_all = "snake_case")]
        enum Key {
            ShearModulus,
            Exponent,
        }
        struct Read;
        impl<'de> Visitor<'de> for Read {
            type Value = OgdenTerm;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("(shear_modulus: .., exponent: ..)")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut terms: A) -> Result<OgdenTerm, A::Error> {
                let length = |n| A::Error::invalid_length(n, &"a shear modulus and an exponent");
                let shear_modulus = terms.next_element()?.ok_or_else(|| length(0))?;
                let exponent = terms.next_element()?.ok_or_else(|| length(1))?;
                if terms.next_element::<serde::de::IgnoredAny>()?.is_some() {
                    return Err(length(3));
                }
                Ok(OgdenTerm { shear_modulus, exponent })
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<OgdenTerm, A::Error> {
                let (mut shear_modulus, mut exponent) = (None, None);
                while let Some(key) = map.next_key()? {
                    match key {
                        Key::ShearModulus => shear_modulus = Some(map.next_value()?),
                        Key::Exponent => exponent = Some(map.next_value()?),
                    }
                }
                Ok(OgdenTerm {
                    shear_modulus: shear_modulus.ok_or_else(|| A::Error::missing_field("shear_modulus"))?,
                    exponent: exponent.ok_or_else(|| A::Error::missing_field("exponent"))?,
                })
            }
        }
        deserializer.deserialize_any(Read)
    }
}

impl JsonSchema for OgdenTerm {
    fn schema_name() -> Cow<'static, str> {
        "OgdenTerm".into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let number = generator.subschema_for::<Number>();
        json_schema!({
            "title": "a term (shear_modulus: .., exponent: ..)",
            "description": "One term of an Ogden material: shear modulus (tension) and exponent.",
            "anyOf": [
                {
                    "type": "object",
                    "properties": { "shear_modulus": number, "exponent": number },
                    "required": ["shear_modulus", "exponent"],
                    "additionalProperties": false,
                },
                { "type": "array", "prefixItems": [number, number], "minItems": 2, "maxItems": 2 },
            ],
        })
    }
}

/// What happens where the membrane would be compressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a treatment of wrinkling")]
pub enum Wrinkling {
    /// States with a negative tension are not accepted: the branch ends there.
    Forbid,
    /// States with a negative tension are computed and reported as not admissible.
    #[default]
    Report,
    /// The relaxed energy is used: the membrane carries no compression, wrinkles cost nothing.
    Relax,
}

/// The state from which everything starts: fluid alone, no body, no other traction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "an initial state")]
pub enum Initial {
    /// Inflated from the reference shape; exactly one of radius, volume and pressure says how far.
    Inflated(Inflation),
    /// The reference shape, stretched to its clamps.
    Unloaded,
}

/// How far the membrane is inflated: exactly one of `radius`, `volume` and `pressure`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "InflationKeys", into = "InflationKeys")]
#[schemars(!try_from, !into, rename_all = "snake_case", title = "one of radius, volume, pressure")]
pub enum Inflation {
    /// Largest radius of the inflated membrane (length).
    Radius(Number),
    /// Volume of the inflated membrane, mirror image included.
    Volume(Number),
    /// Over-pressure inside the inflated membrane (pressure).
    Pressure(Number),
}

/// The keys of [`Inflation`] as they stand in a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct InflationKeys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius: Option<Number>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    volume: Option<Number>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pressure: Option<Number>,
}

impl TryFrom<InflationKeys> for Inflation {
    type Error = &'static str;
    fn try_from(keys: InflationKeys) -> Result<Self, Self::Error> {
        match (keys.radius, keys.volume, keys.pressure) {
            (Some(radius), None, None) => Ok(Inflation::Radius(radius)),
            (None, Some(volume), None) => Ok(Inflation::Volume(volume)),
            (None, None, Some(pressure)) => Ok(Inflation::Pressure(pressure)),
            _ => Err("expected exactly one of radius, volume and pressure"),
        }
    }
}

impl From<Inflation> for InflationKeys {
    fn from(inflation: Inflation) -> Self {
        let none = InflationKeys { radius: None, volume: None, pressure: None };
        match inflation {
            Inflation::Radius(radius) => InflationKeys { radius: Some(radius), ..none },
            Inflation::Volume(volume) => InflationKeys { volume: Some(volume), ..none },
            Inflation::Pressure(pressure) => InflationKeys { pressure: Some(pressure), ..none },
        }
    }
}

/// The filling. It brings the unknown `p_f`, the pressure inside, and one equation for it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a fluid")]
pub enum Fluid {
    /// The volume keeps its initial value.
    Incompressible,
    /// The pressure inside is given.
    Pressure(Number),
    /// The volume is given, mirror image included.
    Volume(Number),
    /// The over-pressure falls linearly with the volume: p - p_out = p_0 + K (1 - V/V_0).
    Compressible {
        /// Bulk modulus K (pressure).
        bulk_modulus: Number,
    },
    /// A gas at constant temperature: (p + p_a) V keeps its initial value.
    IdealGas {
        /// Ambient pressure p_a, from which pressures are measured.
        ambient_pressure: Number,
    },
    /// A solution behind a semi-permeable membrane (van 't Hoff): p - p_out = Pi (V_0 - b)/(V - b) - Pi_out.
    Osmotic {
        /// Osmotic pressure Pi inside in the initial state.
        osmotic_pressure: Number,
        /// Volume b that the solute takes and the solvent cannot; 0 unless given.
        #[serde(default, skip_serializing_if = "Number::is_zero")]
        excluded_volume: Number,
    },
    /// Any equation for `p_f`, such as `"p_f = initial.p_f + 10*ln(V0/membrane.volume)"`.
    Law(Equation),
}

/// A load that is spread over the membrane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "a traction")]
pub enum Traction {
    /// Given components, as formulas that may use the local state. Components that are not given are 0.
    Applied {
        /// Along the outward normal (force per area).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        normal: Option<Number>,
        /// Along the meridian, in the direction of growing S (force per area).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        tangential: Option<Number>,
        /// Away from the axis (force per area).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        radial: Option<Number>,
        /// Along the axis, downwards (force per area).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axial: Option<Number>,
        /// The area that is meant.
        per: Area,
        /// Names of the segments on which it acts; all unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        on: Option<Vec<Name>>,
    },
    /// Screened attraction of the charged membrane by a charged plane:
    /// 2 pi coupling charge_ratio exp(-d/debye_length) per reference area, d = distance to the plane.
    ChargedPlane {
        /// Axial position of the charged plane (length, measured downwards).
        h: Number,
        /// Charge density of the plane over that of the membrane, with opposite sign (dimensionless).
        charge_ratio: Number,
        /// Coupling constant C = sigma_0^2 R/(4 pi eps G).
        coupling: Number,
        /// Screening length (length).
        debye_length: Number,
        /// What is behind the plane: says what images of the membrane's charge it makes.
        #[serde(default, skip_serializing_if = "is_default")]
        substrate: Substrate,
        /// Names of the segments on which it acts; all unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        on: Option<Vec<Name>>,
    },
    /// Screened repulsion of the charged membrane by itself.
    SelfRepulsion {
        /// Coupling constant C = sigma_0^2 R/(4 pi eps G).
        coupling: Number,
        /// Screening length (length).
        debye_length: Number,
        /// Names of the segments on which it acts; all unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        on: Option<Vec<Name>>,
    },
}

/// What is behind a charged plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "a substrate")]
pub enum Substrate {
    /// The same electrolyte: no images; the screened forces add up.
    #[default]
    Transparent,
    /// A solid without ions, of a low permittivity: images of the same sign, and twice the force of the plane's own charge.
    Insulating,
    /// A solid without ions, of a high permittivity: images of the opposite sign, and twice the force of the plane's own charge.
    Conducting,
}

/// The area to which a traction refers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(title = "an area")]
pub enum Area {
    /// The area in the reference shape.
    ReferenceArea,
    /// The area in the deformed shape.
    CurrentArea,
}
