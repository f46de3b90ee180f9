//! Grammar, meaning, derivatives, places of mistakes, hostile text.

use super::*;
use crate::scalar::{Dual, Jet, Scalar};
use num_dual::{Dual64, DualNum};
use proptest::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Names in a fixed order as input slots, and definitions that are built once.
struct Names<'a> {
    inputs: &'a [&'a str],
    definitions: HashMap<&'a str, Node>,
}

impl<'a> Names<'a> {
    fn new(inputs: &'a [&'a str]) -> Self {
        Names { inputs, definitions: HashMap::new() }
    }
}

impl Scope for Names<'_> {
    fn name(&mut self, builder: &mut Builder, name: &str, span: Range<usize>) -> Result<Node, Vec<ExprError>> {
        if let Some(&node) = self.definitions.get(name) {
            return Ok(node);
        }
        match self.inputs.iter().position(|n| *n == name) {
            Some(slot) => Ok(builder.input(slot)),
            None => Err(ExprError::new("unknown-name", span, format!("there is no {name}")).into()),
        }
    }

    fn call(
        &mut self,
        builder: &mut Builder,
        name: &str,
        arguments: &[Argument],
        span: Range<usize>,
    ) -> Result<Node, Vec<ExprError>> {
        match (name, arguments) {
            ("twice.of", [argument]) => {
                let node = builder.add(&argument.value, self)?;
                Ok(builder.sum(node, node))
            }
            _ => Err(ExprError::new("unknown-name", span, "no such call").into()),
        }
    }

    fn unit(&mut self, unit: &Unit) -> Result<f64, ExprError> {
        match unit.text.as_str() {
            "um" => Ok(1e-6),
            _ => Err(ExprError::new("unknown-unit", unit.span.clone(), "no such unit")),
        }
    }
}

fn tape(text: &str, inputs: &[&str]) -> Tape {
    let mut builder = Builder::new();
    let node = builder.add(&parse(text).unwrap(), &mut Names::new(inputs)).unwrap();
    builder.output(node);
    builder.finish()
}

fn run<S: Scalar>(tape: &Tape, inputs: &[S]) -> S {
    let mut out = [S::from(f64::NAN)];
    tape.eval(inputs, &mut Vec::new(), &mut out);
    out[0]
}

fn number(text: &str) -> f64 {
    run::<f64>(&tape(text, &[]), &[])
}

#[test]
fn operators_mean_what_they_mean_in_mathematics() {
    let table: &[(&str, f64)] = &[
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("2^-1^2", 0.5),
        ("2^-2*8", 2.0),
        ("1/2/2", 0.25),
        ("1e3+1E-2", 1000.01),
        ("1E+2", 100.0),
        (".5+2.", 2.5),
        ("2.e1", 20.0),
        ("1-2-3", -4.0),
        ("2-3*4+5", -5.0),
        ("2*-3", -6.0),
        ("2--3", 5.0),
        ("+2", 2.0),
        ("-+-2", 2.0),
        ("-2*3", -6.0),
        ("(1+2)*3", 9.0),
        ("-(1+2)^2", -9.0),
        ("(-2)^3", -8.0),
        ("(-2)^-1", -0.5),
        ("4^(1/2)", 2.0),
        ("\t1 \n+ 1\r", 2.0),
        ("90[deg]", std::f64::consts::FRAC_PI_2),
        ("180[deg]", std::f64::consts::PI),
        ("2*45 [ deg ]", std::f64::consts::FRAC_PI_2),
        ("2[rad]", 2.0),
        ("3[um]", 3e-6),
        ("2^90[deg]/2^(pi/2)", 1.0),
        ("twice.of(3)", 6.0),
        ("1/0", f64::INFINITY),
        ("-1/0", f64::NEG_INFINITY),
        ("0^0", 1.0),
    ];
    for &(text, value) in table {
        assert_eq!(number(text), value, "{text}");
    }
    assert!(number("0/0").is_nan());
    assert!(number("0*(1/0)").is_nan());
    assert!(number("(-2)^0.5").is_nan());
}

#[test]
fn functions_are_those_of_the_library() {
    let x = 0.3_f64;
    let table: [(&str, f64); 12] = [
        ("sqrt", x.sqrt()),
        ("exp", x.exp()),
        ("ln", x.ln()),
        ("sin", x.sin()),
        ("cos", x.cos()),
        ("tan", x.tan()),
        ("asin", x.asin()),
        ("acos", x.acos()),
        ("atan", x.atan()),
        ("sinh", x.sinh()),
        ("cosh", x.cosh()),
        ("tanh", x.tanh()),
    ];
    assert_eq!(table.map(|(name, _)| name), Function::ALL.map(Function::name));
    for (name, value) in table {
        assert!((number(&format!("{name}(0.3)")) - value).abs() < 1e-15, "{name}");
        assert!((run(&tape(&format!("{name} (x)"), &["x"]), &[x]) - value).abs() < 1e-15, "{name}");
    }
}

#[test]
fn the_tree_keeps_what_was_written() {
    let expr = parse("2*(cone.end.phi - 40[deg]) + cap.value(mu, phi = 1.2)").unwrap();
    assert_eq!(expr.span(), 0..53);
    assert_eq!(expr.names(), [("cone.end.phi", 3..15), ("cap.value", 29..38), ("mu", 39..41)]);
    assert_eq!(expr.units().iter().map(|u| (u.text.as_str(), u.kind)).collect::<Vec<_>>(), [("deg", UnitKind::Degree)]);
    assert_eq!(expr.units()[0].span, 21..24);
    let Some(Part { term: Term::Call { arguments, .. }, span }) = expr.parts().iter().rev().nth(1) else { panic!() };
    assert_eq!(*span, 29..53);
    assert_eq!(arguments.len(), 2);
    assert_eq!((arguments[0].name.as_deref(), arguments[0].span.clone()), (None, 39..41));
    assert_eq!((arguments[1].name.as_deref(), arguments[1].span.clone()), (Some("phi"), 43..52));
    assert_eq!(arguments[1].value.literal(), Some((1.2, None)));
    assert_eq!(arguments[1].value.span(), 49..52);
    // Operands come before what uses them, and the whole comes last.
    for (i, part) in expr.parts().iter().enumerate() {
        match part.term {
            Term::Negative(a) | Term::Function(_, a) => assert!(a < i),
            Term::Binary(_, a, b) => assert!(a < b && b < i),
            _ => {}
        }
    }
    assert_eq!("cap.integral()".parse::<Expr>().unwrap().names(), [("cap.integral", 0..12)]);
}

#[test]
fn a_literal_is_read_in_its_own_unit() {
    let read = |text: &str| {
        parse(text).unwrap().literal().map(|(value, unit)| (value, unit.map(|u| u.text.clone()).unwrap_or_default()))
    };
    assert_eq!(read("40[deg]"), Some((40.0, "deg".into())));
    assert_eq!(read("-40[deg]"), Some((-40.0, "deg".into())));
    assert_eq!(read("(3 [ mN/m ])"), Some((3.0, "mN/m".into())));
    assert_eq!(read("8[\u{b5}m]"), Some((8.0, "\u{b5}m".into())));
    assert_eq!(read("--1.5"), Some((1.5, String::new())));
    assert_eq!(read("pi"), None);
    assert_eq!(read("2*3"), None);
    assert_eq!(read("-(2*3)"), None);
    let unit = parse("1[deg]").unwrap().literal().unwrap().1.unwrap().clone();
    assert_eq!(unit.to_radians(180.0), Some(std::f64::consts::PI));
    assert_eq!(unit.from_radians(std::f64::consts::PI), Some(180.0));
}

#[test]
fn equations_have_two_sides() {
    let (lhs, rhs) = parse_equation("cap.end.tau = 90[deg]").unwrap();
    assert_eq!(lhs.as_name(), Some("cap.end.tau"));
    assert_eq!((rhs.literal().unwrap().0, rhs.span()), (90.0, 14..21));
    let (lhs, rhs) = parse_equation("cap.value(mu, phi = 1) = 2*pi*3").unwrap();
    assert_eq!((lhs.span(), rhs.span()), (0..22, 25..31));
}

#[test]
fn mistakes_are_shown_where_they_are() {
    // Text, code, the part of the text that is marked, words of the message or help.
    let table: &[(&str, &str, &str, &str)] = &[
        ("", "empty", "", "empty"),
        ("  ", "empty", "  ", "empty"),
        ("1 + $x", "unknown-character", "$", "unknown character `$`"),
        ("2*\u{3bb}", "unknown-character", "\u{3bb}", "write lambda"),
        ("2\u{b7}x", "unknown-character", "\u{b7}", "write *"),
        ("x\u{b2}", "unknown-character", "\u{b2}", "write ^2"),
        ("\u{1f600}", "unknown-character", "\u{1f600}", "unknown"),
        ("{x}", "unknown-character", "{", "parentheses"),
        ("|x|", "unknown-character", "|", "absolute value"),
        ("x + .", "unknown-character", ".", "digit"),
        ("1 + ", "missing-operand", "+", "behind `+`"),
        ("1 + * 2", "missing-operand", "+", "behind `+`"),
        ("* 2", "missing-operand", "*", "in front of `*`"),
        ("2*()", "missing-operand", "()", "between the parentheses"),
        ("(2*)", "missing-operand", "*", "behind `*`"),
        ("a.max(u,)", "missing-operand", ",", "behind `,`"),
        ("(", "missing-operand", "(", "behind `(`"),
        ("2*(1 + (x)", "unclosed", "(", "not closed"),
        ("sin(x", "unclosed", "(", "not closed"),
        ("3[mN", "unclosed", "[", "not closed"),
        ("1 + 2)", "unmatched", ")", "not opened"),
        ("x]", "unmatched", "]", "not opened"),
        ("1 + 2r0", "missing-operator", "2r0", "write 2*r0"),
        ("2(x) + 1", "missing-operator", "2(", "write 2*(x)"),
        ("2e", "missing-operator", "2e", "write 2*e"),
        ("(a+b)(c)", "missing-operator", "(a+b)(", "write (a+b)*(c)"),
        ("x y", "missing-operator", "x y", "write x*y"),
        ("sin(x)cos(x)", "missing-operator", "sin(x)cos", "write sin(x)*cos"),
        ("pi(2)", "missing-operator", "pi(", "write pi*(2)"),
        ("1 2", "missing-operator", "1 2", "between `1` and `2`"),
        ("x**2", "power-operator", "**", "write ^"),
        ("x* *2", "missing-operand", "*", "behind `*`"),
        ("1.2.3", "malformed-number", "1.2.3", "decimal point"),
        ("2*1e999", "malformed-number", "1e999", "too large"),
        ("1e-999", "malformed-number", "1e-999", "too small"),
        ("cone..phi", "malformed-name", "cone.", "behind `cone.`"),
        ("1 + cone.", "malformed-name", "cone.", "behind `cone.`"),
        ("cap.1", "malformed-name", "cap.", "missing"),
        ("1,5", "unexpected-comma", ",", "1.5"),
        ("(1, 2)", "unexpected-comma", ",", "separates"),
        ("x < 2", "comparison", "<", "no derivative"),
        ("x >= 2", "comparison", ">=", "no derivative"),
        ("x == 2", "comparison", "==", "single `=`"),
        ("a && b", "comparison", "&&", "no meaning"),
        ("if(x, 1, 2)", "no-derivative", "if", "switches"),
        ("1 + if x then 2", "no-derivative", "if", "switches"),
        ("x if y", "no-derivative", "if", "switches"),
        ("min(a, b)", "no-derivative", "min", "name.max(u)"),
        ("1+max(a, b)", "no-derivative", "max", "equal"),
        ("abs(x)", "no-derivative", "abs", "sqrt(x^2 + e^2)"),
        ("floor(x)", "no-derivative", "floor", "jumps"),
        ("1 + sinn(x)", "unknown-function", "sinn", "did you mean sin?"),
        ("log(x)", "unknown-function", "log", "write ln(x)"),
        ("pow(x, 2)", "unknown-function", "pow", "x^2"),
        ("radius(x)", "unknown-function", "radius", "write radius*(x)"),
        ("1 + sin", "function-without-argument", "sin", "sin(x)"),
        ("sin()", "argument-count", "()", "given none"),
        ("sin(a, b)", "argument-count", ",", "given more"),
        ("40 + x[deg]", "unit-misplaced", "[deg]", "behind a name"),
        ("(1+2)[deg]", "unit-misplaced", "[deg]", "behind parentheses"),
        ("sin(1)[deg]", "unit-misplaced", "[deg]", "behind a function"),
        ("a.b(1)[deg]", "unit-misplaced", "[deg]", "behind a call"),
        ("pi[rad]", "unit-misplaced", "[rad]", "behind `pi`"),
        ("[deg]", "unit-misplaced", "[", "behind a number"),
        ("2*[deg]", "missing-operand", "*", "behind `*`"),
        ("3[mN][m]", "unit-misplaced", "[m]", "compound"),
        ("3[ ]", "unknown-unit", "[ ]", "empty"),
        ("a = 2", "equation-not-allowed", "=", "only a value"),
        ("sin(a = 2)", "equation-not-allowed", "=", "only a value"),
        ("cap.value(2*a = 2)", "argument-name", "2*a", "name of an argument"),
        ("cap.value(a.b = 2)", "argument-name", "a.b", "name of an argument"),
        ("cap.value(a = 2, mu)", "argument-name", "a = 2", "not the last"),
        ("cap.value(a = 2 = 3)", "equation-not-allowed", "=", "only a value"),
    ];
    for &(text, code, marked, words) in table {
        let error = parse(text).expect_err(text);
        check(text, error, code, marked, words);
    }
    let equations: &[(&str, &str, &str, &str)] = &[
        ("a + 1", "equation-expected", "a + 1", "lhs = rhs"),
        ("a = b = c", "equation-expected", "=", "exactly one"),
        ("a == b", "comparison", "==", "single"),
        ("= 3", "missing-operand", "=", "in front of `=`"),
        ("a =", "missing-operand", "=", "behind `=`"),
        ("(a = b)", "equation-not-allowed", "=", "value"),
        ("", "empty", "", "empty"),
    ];
    for &(text, code, marked, words) in equations {
        let error = parse_equation(text).expect_err(text);
        check(text, error, code, marked, words);
    }
}

fn check(text: &str, error: ExprError, code: &str, marked: &str, words: &str) {
    assert_eq!((error.code, &text[error.span.clone()]), (code, marked), "{text}: {error:?}");
    let said = format!("{} / {}", error.message, error.help.as_deref().unwrap_or_default());
    assert!(said.contains(words), "{text}: {said}");
    assert!(CODES.iter().any(|(known, _)| *known == code), "{code}");
}

#[test]
fn the_last_equal_sign_of_two_is_marked() {
    assert_eq!(parse_equation("a = b = c").unwrap_err().span, 6..7);
    assert_eq!(parse("1 + (2 + (3").unwrap_err().span, 9..10);
    assert_eq!(parse("x + 1").unwrap().span(), 0..5);
    assert_eq!(ExprError::new("empty", 1..2, "").shifted(10).span, 11..12);
}

#[test]
fn all_unknown_names_are_reported_at_once() {
    let mut builder = Builder::new();
    let expr = parse("foo + sin(bar)*x^baz + twice.of(qux + quux) + 3[furlong]").unwrap();
    let errors = builder.add(&expr, &mut Names::new(&["x"])).unwrap_err();
    let places: Vec<_> = errors.iter().map(|e| e.span.clone()).collect();
    assert_eq!(places, [0..3, 10..13, 17..20, 32..35, 38..42, 48..55]);
    assert_eq!(builder.add(&parse("x").unwrap(), &mut ()).unwrap_err()[0].code, "unknown-name");
    assert_eq!(builder.add(&parse("a.b(x)").unwrap(), &mut ()).unwrap_err()[0].span, 0..3);
    assert_eq!(builder.add(&parse("1[m]").unwrap(), &mut ()).unwrap_err()[0].code, "unknown-unit");
    // The stand-in for what could not be built leaves no trace.
    let many = parse("y+".repeat(1000).trim_end_matches('+')).unwrap();
    assert_eq!(builder.add(&many, &mut ()).unwrap_err().len(), 20);
}

#[test]
fn words_of_the_language_are_reserved() {
    for word in ["pi", "sin", "sqrt", "if", "max", "abs"] {
        assert!(is_reserved(word) && is_identifier(word), "{word}");
    }
    for word in ["x", "p_f", "max_u", "Pi"] {
        assert!(!is_reserved(word) && is_identifier(word), "{word}");
    }
    for word in ["", "2x", "a.b", "a b", "\u{3bb}", "a-b"] {
        assert!(!is_identifier(word), "{word}");
    }
}

#[test]
fn near_words_are_found() {
    let names = ["lambda", "mu", "tau", "cone_angle"];
    assert_eq!(nearest("lamda", names), Some("lambda"));
    assert_eq!(nearest("Lambda", names), Some("lambda"));
    assert_eq!(nearest("tua", names), Some("tau"));
    assert_eq!(nearest("coneangle", names), Some("cone_angle"));
    assert_eq!(nearest("pressure", names), None);
    assert_eq!(nearest("x", ["u"]), None);
    assert_eq!(nearest("", names), None);
    assert_eq!(nearest(&"a".repeat(1 << 20), names), None);
}

#[test]
fn common_parts_are_computed_once() {
    // x, y, x + y, sin, square of it, sum.
    assert_eq!(tape("sin(x+y) + sin(y+x)^2", &["x", "y"]).operations(), 6);
    assert_eq!(tape("x*y - y*x", &["x", "y"]).operations(), 4);
    assert_eq!(tape("x*x + x^2", &["x"]).operations(), 3);
    // Constants fold; units of one and shifts by nothing vanish.
    assert_eq!(tape("2*3*x/(1+2*3)", &["x"]).operations(), 3);
    assert_eq!(tape("1*x^1/1 + 0 - 0", &["x"]).operations(), 1);
    assert_eq!(tape("--x", &["x"]).operations(), 1);
    assert_eq!(tape("sin(1) + cos(2)^3", &[]).operations(), 1);

    let mut builder = Builder::new();
    let mut names = Names::new(&["x", "y", "unused"]);
    let shared = builder.add(&parse("exp(x)*2 + sin(y)").unwrap(), &mut names).unwrap();
    names.definitions.insert("d", shared);
    for text in ["d", "d^2 + unused*0.5", "y + 0*1", "7"] {
        let node = builder.add(&parse(text).unwrap(), &mut names).unwrap();
        builder.output(node);
    }
    let dropped = builder.add(&parse("cosh(x)").unwrap(), &mut names).unwrap();
    assert_eq!(builder.value(dropped), None);
    let tape = builder.finish();
    assert_eq!(tape.inputs(), [0, 1, 2]);
    assert_eq!(tape.inputs_of(0), [0, 1]);
    assert_eq!(tape.inputs_of(2), [1]);
    assert!(tape.inputs_of(3).is_empty());
    // x, exp, *2, y, sin, +; square, unused, *0.5, +; 7.
    assert_eq!((tape.outputs(), tape.operations()), (4, 11));
    let mut out = [0.0; 4];
    tape.eval(&[0.0, 0.0, 1.0], &mut Vec::new(), &mut out);
    assert_eq!(out, [2.0, 4.5, 0.0, 7.0]);
}

#[test]
fn inputs_that_do_not_matter_are_not_read() {
    let mut builder = Builder::new();
    let (_, b) = (builder.input(0), builder.input(5));
    builder.output(b);
    let tape = builder.finish();
    assert_eq!(tape.inputs(), [5]);
    assert_eq!(run(&tape, &[f64::NAN, 0.0, 0.0, 0.0, 0.0, 3.0]), 3.0);
    let empty = Builder::new().finish();
    empty.eval::<f64>(&[], &mut Vec::new(), &mut []);
}

#[test]
fn nothing_not_a_number_is_hidden() {
    for text in ["0*x", "0/x", "x - x", "x*0 + 1", "x^0 - x^0 + 0*x"] {
        assert!(run(&tape(text, &["x"]), &[f64::NAN]).is_nan(), "{text}");
    }
    assert!(run(&tape("0*x", &["x"]), &[f64::INFINITY]).is_nan());
    assert_eq!(run(&tape("x/0", &["x"]), &[1.0]), f64::INFINITY);
}

#[test]
fn integral_powers_hold_for_every_base() {
    for n in [-64, -3, -2, -1, 0, 1, 2, 3, 4, 7, 64, 101] {
        let tape = tape(&format!("x^({n})"), &["x"]);
        let x = -1.1_f64;
        let d = run(&tape, &[Dual::<1>::variable(x, 0)]);
        let (value, slope) = (x.powi(n), f64::from(n) * x.powi(n - 1));
        assert!((d.re - value).abs() <= 1e-13 * value.abs(), "{n}: {d:?}");
        assert!((d.du[0] - slope).abs() <= 1e-13 * slope.abs(), "{n}: {d:?}");
    }
    for (text, slope) in
        [("x^2", 0.0), ("x^1", 1.0), ("x^3", 0.0), ("x^0", 0.0), ("(x+1)^0.5", 0.5), ("2^x", 2f64.ln())]
    {
        let d = run(&tape(text, &["x"]), &[Dual::<1>::variable(0.0, 0)]);
        assert!((d.du[0] - slope).abs() < 1e-15, "{text}: {d:?}");
    }
}

#[test]
fn jets_carry_the_derivatives_of_energies_to_third_order() {
    let (x, y, g) = (1.3_f64, 0.8_f64, 0.7_f64);
    let jet = |text: &str| {
        let mut builder = Builder::new();
        let mut names = Names::new(&["lambda", "mu"]);
        let shear = builder.constant(g);
        names.definitions.insert("G", shear);
        let i1 = builder.add(&parse("lambda^2 + mu^2 + 1/(lambda*mu)^2").unwrap(), &mut names).unwrap();
        names.definitions.insert("I1", i1);
        let node = builder.add(&parse(text).unwrap(), &mut names).unwrap();
        builder.output(node);
        run(&builder.finish(), &[Jet::<10>::x(x), Jet::y(y)]).derivatives()
    };
    // Derivatives of x^a y^b are falling factorials times powers.
    let monomial = |c: f64, a: i32, b: i32| {
        Jet::<10>::MONOMIALS.map(|(i, j)| {
            let falling = |n: i32, k: u8| (0..i32::from(k)).map(|m| f64::from(n - m)).product::<f64>();
            c * falling(a, i) * falling(b, j) * x.powi(a - i32::from(i)) * y.powi(b - i32::from(j))
        })
    };
    let sum = |terms: &[[f64; 10]]| std::array::from_fn::<f64, 10, _>(|k| terms.iter().map(|t| t[k]).sum());
    let close = |a: [f64; 10], b: [f64; 10], tolerance: f64| {
        (0..10).all(|k| (a[k] - b[k]).abs() <= tolerance * (1.0 + b[k].abs()))
    };

    let half = g / 2.0;
    let neo_hooke =
        sum(&[monomial(half, 2, 0), monomial(half, 0, 2), monomial(half, -2, -2), monomial(-3.0 * half, 0, 0)]);
    // Round-off only: some ten operations on numbers of order 10.
    assert!(close(jet("G/2*(lambda^2+mu^2+(lambda*mu)^-2-3)"), neo_hooke, 1e-14));
    assert!(close(jet("G/2*(I1 - 3)"), neo_hooke, 1e-14));
    assert!(!close(jet("1.001*G/2*(I1 - 3)"), neo_hooke, 1e-14));

    let mooney = sum(&[monomial(1.0, -2, 0), monomial(1.0, 0, -2), monomial(1.0, 2, 2)]);
    assert!(close(jet("1/lambda^2 + 1/mu^2 + (lambda*mu)^2"), mooney, 1e-14));

    // The third derivatives of a strain-stiffening energy, from differences of its second ones; the error of a central
    // difference of step 1e-4 is 1e-8 times the fifth derivative.
    let fung = tape(
        "lambda^2.5 + exp((lambda^2 + mu^2 + 1/(lambda*mu)^2 - 3)^2) - ln(1 - (lambda - mu)^2/2) + mu^lambda",
        &["lambda", "mu"],
    );
    let at = |x: f64, y: f64| run(&fung, &[Jet::<10>::x(x), Jet::y(y)]).derivatives();
    let (d, step) = (at(x, y), 1e-4);
    let along = |dx: f64, dy: f64| -> [f64; 10] {
        let (p, m) = (at(x + dx * step, y + dy * step), at(x - dx * step, y - dy * step));
        std::array::from_fn(|k| (p[k] - m[k]) / (2.0 * step))
    };
    let (fx, fy) = (along(1.0, 0.0), along(0.0, 1.0));
    let pairs = [
        (d[1], fx[0]),
        (d[2], fy[0]),
        (d[3], fx[1]),
        (d[4], fy[1]),
        (d[5], fy[2]),
        (d[6], fx[3]),
        (d[7], fy[3]),
        (d[8], fx[5]),
        (d[9], fy[5]),
    ];
    for (k, (exact, difference)) in pairs.into_iter().enumerate() {
        assert!((exact - difference).abs() < 1e-5 * (1.0 + exact.abs()), "{k}: {exact} {difference}");
    }
}

/// A formula in x, y, z whose value is near 1 and smooth for values near 1.
fn formulas() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("z".to_owned()),
        (0.5..2.0f64).prop_map(|c| format!("{c:.3}")),
        Just("pi".to_owned()),
    ];
    leaf.prop_recursive(5, 40, 2, |inner| {
        prop_oneof![
            (inner.clone(), inner.clone(), prop::sample::select(vec!["+", "-", "*"]))
                .prop_map(|(a, b, o)| format!("({a}) {o} ({b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("({a})/(2 + sin({b}))")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("(1.5 + sin({a}))^cos({b})")),
            (inner.clone(), -3..4i32).prop_map(|(a, n)| format!("(1.5 + sin({a}))^({n})")),
            (inner.clone(), 0.3..2.7f64).prop_map(|(a, p)| format!("(1.5 + cos({a}))^{p:.2}")),
            (inner, prop::sample::select(Function::ALL.to_vec()))
                .prop_map(|(a, f)| format!("{}(0.5 + 0.4*sin({a}))", f.name())),
        ]
    })
}

/// The value of the tree itself, without the tape.
fn oracle(expr: &Expr, x: &[Dual64; 3]) -> Dual64 {
    let mut values: Vec<Dual64> = Vec::new();
    for part in expr.parts() {
        let value = match &part.term {
            Term::Number { value, .. } => Dual64::from(*value),
            Term::Pi => Dual64::from(std::f64::consts::PI),
            Term::Name(name) => x[["x", "y", "z"].iter().position(|n| n == name).unwrap()],
            Term::Negative(a) => -values[*a],
            Term::Binary(operator, a, b) => {
                let (a, b) = (values[*a], values[*b]);
                match operator {
                    Operator::Add => a + b,
                    Operator::Subtract => a - b,
                    Operator::Multiply => a * b,
                    Operator::Divide => a / b,
                    Operator::Power => a.powd(b),
                }
            }
            Term::Function(f, a) => {
                let a = values[*a];
                match f {
                    Function::Sqrt => a.sqrt(),
                    Function::Exp => a.exp(),
                    Function::Ln => a.ln(),
                    Function::Sin => a.sin(),
                    Function::Cos => a.cos(),
                    Function::Tan => a.tan(),
                    Function::Asin => a.asin(),
                    Function::Acos => a.acos(),
                    Function::Atan => a.atan(),
                    Function::Sinh => a.sinh(),
                    Function::Cosh => a.cosh(),
                    Function::Tanh => a.tanh(),
                }
            }
            Term::Call { .. } => unreachable!("no calls among the formulas"),
        };
        values.push(value);
    }
    values.pop().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn gradients_agree_with_another_implementation(
        text in formulas(), x in 0.5..2.0f64, y in 0.5..2.0f64, z in 0.5..2.0f64,
    ) {
        let expr = parse(&text).unwrap();
        let tape = tape(&text, &["x", "y", "z"]);
        let at = [x, y, z];
        let value = run(&tape, &at);
        let dual = run(&tape, &std::array::from_fn::<Dual<3>, 3, _>(|i| Dual::variable(at[i], i)));
        prop_assume!(value.is_finite() && value.abs() < 1e6 && dual.du.iter().all(|d| d.abs() < 1e6));
        // Two orders of the same operations differ by round-off, amplified by the condition of the formula.
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
        prop_assert!(near(value, dual.re), "{text}: {value} {}", dual.re);
        for i in 0..3 {
            let seeds = std::array::from_fn(|j| Dual64::new(at[j], f64::from(u8::from(i == j))));
            let other = oracle(&expr, &seeds);
            prop_assert!(near(value, other.re), "{text}: {value} {}", other.re);
            prop_assert!(near(dual.du[i], other.eps), "{text}: d{i} {} {}", dual.du[i], other.eps);
        }
    }

    #[test]
    fn any_text_is_read_or_refused_at_a_place_inside_it(text in "\\PC{0,40}") {
        refused_inside(&text);
    }

    #[test]
    fn any_text_of_tokens_is_read_or_refused_at_a_place_inside_it(
        tokens in prop::collection::vec(prop::sample::select(vec![
            "1", ".", "2.5", "e", "x", "a.b", "sin", "max", "if", "pi", "+", "-", "*", "/", "^", "(", ")", ",", "=", "[deg]", "[",
            "]", "<", " ", "\u{3bb}",
        ]), 0..30),
    ) {
        refused_inside(&tokens.concat());
    }
}

fn refused_inside(text: &str) {
    for result in [parse(text).map(|e| vec![e]), parse_equation(text).map(|(a, b)| vec![a, b])] {
        match result {
            Ok(exprs) => {
                for expr in exprs {
                    assert!(text.get(expr.span()).is_some());
                    for (name, span) in expr.names() {
                        assert_eq!(&text[span], name);
                    }
                    let _ = Builder::new().add(&expr, &mut ());
                }
            }
            Err(error) => {
                assert!(text.get(error.span.clone()).is_some(), "{text:?}: {error:?}");
                assert!(CODES.iter().any(|(code, _)| *code == error.code), "{error:?}");
            }
        }
    }
}

#[test]
fn hostile_texts_are_met_with_little_stack_and_linear_time() {
    const LONG: usize = 1_000_000;
    let refused = |text: String, code: &str| {
        let error = parse(&text).unwrap_err();
        assert_eq!(error.code, code, "{:.20}", text);
        assert!(error.message.len() < 300 && error.help.is_none_or(|h| h.len() < 300), "{text:.20}");
        assert!(text.get(error.span.clone()).is_some());
    };
    // A thread with a quarter of the usual stack.
    let run = move || {
        for open in ["(", "-", "+", "2^", "sin(", "a.b(", "1+(", "a.b(1,", "a.b(c="] {
            refused(open.repeat(LONG / open.len()), "too-deep");
        }
        refused("9".repeat(LONG), "malformed-number");
        refused(format!("0.{}1", "0".repeat(LONG)), "malformed-number");
        refused("1+".repeat(LONG / 2), "missing-operand");
        refused("1.".repeat(LONG / 2), "malformed-number");
        refused("a.".repeat(LONG / 2), "malformed-name");
        refused(format!("{}(x)", "a".repeat(LONG)), "unknown-function");
        refused(format!("{} {}", "a".repeat(LONG / 2), "b".repeat(LONG / 2)), "missing-operator");
        refused("x[".repeat(LONG / 2), "unit-misplaced");
        refused("1[".repeat(LONG / 2), "unclosed");
        refused("\u{3bb}".repeat(LONG / 2), "unknown-character");
        refused(" ".repeat(LONG), "empty");
        refused("\0".repeat(LONG), "unknown-character");
        refused("1".repeat(MAX_LENGTH + 1), "too-long");
        let deep = |n: usize| format!("{}1{}", "(".repeat(n), ")".repeat(n));
        assert!(parse(&deep(MAX_DEPTH - 1)).is_ok());
        refused(deep(MAX_DEPTH), "too-deep");
        let calls = |n: usize| format!("{}1{}", "twice.of(".repeat(n), ")".repeat(n));
        assert_eq!(number(&calls(MAX_DEPTH - 1)), 2f64.powi(MAX_DEPTH as i32 - 1));

        let digits = format!("0.{}", "3".repeat(LONG));
        assert_eq!(number(&digits), 1.0 / 3.0);
        assert!(parse(&"a".repeat(LONG)).is_ok());
        let terms = LONG / 2;
        for (operator, value) in [("+", terms as f64), ("*", 1.0), ("-", 2.0 - terms as f64), ("/", 1.0)] {
            let text = format!("1{}", format!("{operator}1").repeat(terms - 1));
            assert_eq!(number(&text), value, "{operator}");
        }
        let text = format!("x{}", "+x".repeat(terms - 1));
        let tape = tape(&text, &["x"]);
        let d = super::tests::run(&tape, &[Dual::<1>::variable(2.0, 0)]);
        assert_eq!((d.re, d.du[0]), (2.0 * terms as f64, terms as f64));
        let (lhs, rhs) = parse_equation(&format!("{text} = 1")).unwrap();
        assert_eq!((lhs.parts().len(), rhs.parts().len()), (2 * terms - 1, 1));
    };
    std::thread::Builder::new().stack_size(512 << 10).spawn(run).unwrap().join().unwrap();
}

#[test]
#[ignore = "prints times"]
fn timing() {
    use std::hint::black_box;
    use std::time::Instant;
    let names = ["pf", "p1", "r", "a", "k"];
    let at = [1.1, 0.2, 0.7, 0.9, 1.4];
    for text in ["pf - p1*(r/a)^2 + k*r - 2*r/(a*k)", "pf*exp(-k*r) + sin(a*r)*sqrt(p1 + r^2) - 2*r/(a*k)"] {
        let tape = tape(text, &names);
        let time = |what: &str, f: &mut dyn FnMut()| {
            let (start, n) = (Instant::now(), 1_000_000);
            (0..n).for_each(|_| f());
            println!(
                "{what}: {:.0} ns ({} operations)",
                start.elapsed().as_nanos() as f64 / n as f64,
                tape.operations()
            );
        };
        let (mut work, mut out) = (Vec::new(), [0.0]);
        time("value", &mut || tape.eval(black_box(&at), &mut work, &mut out));
        let duals: [Dual<5>; 5] = std::array::from_fn(|i| Dual::variable(at[i], i));
        let (mut work, mut out) = (Vec::new(), [Dual::from(0.0)]);
        time("value and gradient", &mut || tape.eval(black_box(&duals), &mut work, &mut out));
        time("parse and build", &mut || {
            let mut builder = Builder::new();
            black_box(builder.add(&parse(text).unwrap(), &mut Names::new(&names)).unwrap());
        });
    }
    let energy = tape("0.5*(lambda^2+mu^2+(lambda*mu)^-2-3)", &["lambda", "mu"]);
    let jets = [Jet::<10>::x(1.2), Jet::y(0.9)];
    let (mut work, mut out) = (Vec::new(), [Jet::from(0.0)]);
    let start = Instant::now();
    (0..1_000_000).for_each(|_| energy.eval(black_box(&jets), &mut work, &mut out));
    println!("neo-Hookean jet: {} ns", start.elapsed().as_nanos() / 1_000_000);
}
