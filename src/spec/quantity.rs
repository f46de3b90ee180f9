//! The smallest words of a problem file: numbers, formulas, equations, names, counts and tolerances.
//!
//! They say what was written, not what it means: formulas are kept as text, and nothing is evaluated here.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::ser::{Serialize, Serializer};

/// A number, or a formula in quotes that gives one.
///
/// Numbers are finite. A unit stands in brackets behind its number inside the quotes, `"40[deg]"`.
#[derive(Clone, Debug, PartialEq)]
pub enum Number {
    /// A plain number, in the unit of the quantity it is given for.
    Value(f64),
    /// A formula in the names that are visible at this place, such as `"2*r0"`.
    Formula(String),
}

impl Number {
    /// Whether this is the plain number zero.
    pub fn is_zero(&self) -> bool {
        matches!(self, Number::Value(value) if *value == 0.0)
    }

    /// The formula's text, where it is one.
    pub fn formula(&self) -> Option<&str> {
        match self {
            Number::Value(_) => None,
            Number::Formula(text) => Some(text),
        }
    }
}

impl Default for Number {
    fn default() -> Self {
        Number::Value(0.0)
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Number::Value(value)
    }
}

impl From<&str> for Number {
    fn from(text: &str) -> Self {
        Number::Formula(text.to_owned())
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number::Value(value) => write!(f, "{value}"),
            Number::Formula(text) => f.write_str(text),
        }
    }
}

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Number::Value(value) => serialize_f64(*value, serializer),
            Number::Formula(text) => serializer.serialize_str(text),
        }
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;
        impl Visitor<'_> for Read {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a formula in quotes")
            }
            fn visit_f64<E: Error>(self, value: f64) -> Result<Number, E> {
                finite(value).map(Number::Value)
            }
            fn visit_i64<E: Error>(self, value: i64) -> Result<Number, E> {
                Ok(Number::Value(value as f64))
            }
            fn visit_u64<E: Error>(self, value: u64) -> Result<Number, E> {
                Ok(Number::Value(value as f64))
            }
            fn visit_str<E: Error>(self, text: &str) -> Result<Number, E> {
                Ok(Number::Formula(text.to_owned()))
            }
        }
        deserializer.deserialize_any(Read)
    }
}

impl JsonSchema for Number {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "title": "a number or a formula in quotes",
            "description": "A number, or a formula in quotes that gives one. A unit stands in brackets behind its \
                            number, inside the quotes: \"40[deg]\".",
            "anyOf": [{ "type": "number" }, { "type": "string" }],
        })
    }
}

/// How many: a whole number from 1 to 1 000 000.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Count(u32);

impl Count {
    /// The largest count a file may ask for.
    pub const MAX: u32 = 1_000_000;

    /// The count, where it is within 1 and [`Count::MAX`].
    pub fn new(count: u32) -> Option<Count> {
        (1..=Count::MAX).contains(&count).then_some(Count(count))
    }

    /// The number itself.
    pub fn get(self) -> usize {
        self.0 as usize
    }
}

impl Serialize for Count {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(self.0)
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = whole(deserializer)?;
        Count::new(value).ok_or_else(|| D::Error::custom("expected a whole number from 1 to 1000000"))
    }
}

impl JsonSchema for Count {
    fn schema_name() -> Cow<'static, str> {
        "Count".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "title": "a whole number from 1 to 1000000",
            "type": "integer", "minimum": 1, "maximum": Count::MAX,
        })
    }
}

/// A relative error: a positive number, at most 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Tolerance(f64);

impl Tolerance {
    /// The tolerance, where it is positive and at most 1.
    pub fn new(value: f64) -> Option<Tolerance> {
        (value > 0.0 && value <= 1.0).then_some(Tolerance(value))
    }

    /// The number itself.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl Serialize for Tolerance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize_f64(self.0, serializer)
    }
}

impl<'de> Deserialize<'de> for Tolerance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = f64::deserialize(deserializer)?;
        Tolerance::new(value).ok_or_else(|| D::Error::custom("expected a positive number, at most 1"))
    }
}

impl JsonSchema for Tolerance {
    fn schema_name() -> Cow<'static, str> {
        "Tolerance".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "title": "a positive number, at most 1",
            "type": "number", "exclusiveMinimum": 0, "maximum": 1,
        })
    }
}

/// The version of the format in which a file is written. There is one so far: 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FormatVersion;

impl Serialize for FormatVersion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(1)
    }
}

impl<'de> Deserialize<'de> for FormatVersion {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match whole(deserializer)? {
            1 => Ok(FormatVersion),
            other => Err(D::Error::custom(format_args!("format {other} is not known, only format 1 is"))),
        }
    }
}

impl JsonSchema for FormatVersion {
    fn schema_name() -> Cow<'static, str> {
        "FormatVersion".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "title": "the version of the format, 1", "type": "integer", "const": 1 })
    }
}

macro_rules! text {
    ($(#[$doc:meta])* $name:ident, $title:literal) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, JsonSchema)]
        #[serde(transparent)]
        #[schemars(title = $title)]
        pub struct $name(pub String);

        impl $name {
            /// The text as it was written.
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl From<&str> for $name {
            fn from(text: &str) -> Self {
                $name(text.to_owned())
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    };
}

text! {
    /// A formula in the names that are visible at its place, such as `"lambda^2 + mu^2"`.
    Formula, "a formula in quotes"
}
text! {
    /// An equation `"lhs = rhs"` between two formulas.
    Equation, "an equation in quotes, \"lhs = rhs\""
}
text! {
    /// A name that is declared elsewhere in the file, such as `"cone"`, `"pipette.wall"` or `"force"`, or that is
    /// given here.
    Name, "a name in quotes"
}

/// Whole numbers are written as such, so that files keep `2` and do not get `2.0`.
fn serialize_f64<S: Serializer>(value: f64, serializer: S) -> Result<S::Ok, S::Error> {
    let whole = value as i64;
    if whole as f64 == value && whole.unsigned_abs() < 1 << 53 && !(whole == 0 && value.is_sign_negative()) {
        serializer.serialize_i64(whole)
    } else {
        serializer.serialize_f64(value)
    }
}

fn finite<E: Error>(value: f64) -> Result<f64, E> {
    if value.is_finite() { Ok(value) } else { Err(E::custom("numbers are finite")) }
}

/// A whole number, also where it is written `100.0` or `1e2`, as JSON Schema has it.
fn whole<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    struct Read;
    impl Visitor<'_> for Read {
        type Value = u32;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a whole number")
        }
        fn visit_u64<E: Error>(self, value: u64) -> Result<u32, E> {
            u32::try_from(value).map_err(|_| E::custom("the number is too large"))
        }
        fn visit_i64<E: Error>(self, value: i64) -> Result<u32, E> {
            u32::try_from(value).map_err(|_| E::custom("the number is negative or too large"))
        }
        fn visit_f64<E: Error>(self, value: f64) -> Result<u32, E> {
            if value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value) {
                Ok(value as u32)
            } else {
                Err(E::custom("expected a whole number"))
            }
        }
    }
    deserializer.deserialize_any(Read)
}
