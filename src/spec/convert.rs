//! A problem as text: RON or JSON of the same values.
//!
//! Keys that have their default are left out, and comments are lost.

use ron::extensions::Extensions;
use ron::ser::PrettyConfig;

use super::origin::Syntax;
use super::problem::Problem;

/// The extensions of RON that problem files use without saying so.
pub fn extensions() -> Extensions {
    Extensions::IMPLICIT_SOME | Extensions::UNWRAP_NEWTYPES | Extensions::UNWRAP_VARIANT_NEWTYPES
}

/// The problem in this syntax; reading it again gives the same problem.
///
/// # Errors
///
/// What the writer says; it has nothing to say about a problem that was read.
pub fn write(problem: &Problem, syntax: Syntax) -> Result<String, String> {
    let mut text = match syntax {
        Syntax::Json => serde_json::to_string_pretty(problem).map_err(|error| error.to_string())?,
        Syntax::Ron => {
            let schema = problem.schema.as_ref().map(|schema| format!("#![schema = {schema:?}]\n"));
            let problem = Problem { schema: None, ..problem.clone() };
            let pretty = PrettyConfig::new().new_line("\n").indentor("    ").depth_limit(2).struct_names(false);
            let options = ron::Options::default().with_default_extension(extensions());
            let body = options.to_string_pretty(&problem, pretty).map_err(|error| error.to_string())?;
            schema.unwrap_or_default() + &body
        }
    };
    text.push('\n');
    Ok(text)
}
