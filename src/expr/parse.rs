//! Tokens into a tree, by operator precedence (Pratt).

use super::error::{ExprError, nearest, quoted, shortened};
use super::lex::{Lexer, Token};
use super::tree::{Argument, Expr, Function, Operator, Part, Term};
use std::ops::Range;

/// Length in bytes above which a formula is refused.
pub const MAX_LENGTH: usize = 1 << 20;

/// Nesting (parentheses, calls, signs, exponents of exponents) above which a formula is refused.
pub const MAX_DEPTH: usize = 200;

/// Reads a formula.
///
/// # Errors
/// The first mistake in the text.
pub fn parse(text: &str) -> Result<Expr, ExprError> {
    let mut parser = Parser::new(text)?;
    let expr = parser.whole()?;
    match parser.token {
        Token::End => Ok(expr),
        _ => Err(parser.unexpected()),
    }
}

/// Reads an equation `lhs = rhs`.
///
/// # Errors
/// The first mistake in the text.
pub fn parse_equation(text: &str) -> Result<(Expr, Expr), ExprError> {
    let mut parser = Parser::new(text)?;
    let lhs = parser.whole()?;
    match parser.token {
        Token::Equal => parser.advance()?,
        Token::End => {
            let error = ExprError::new("equation-expected", lhs.span(), "an equation `lhs = rhs` is wanted here");
            return Err(error.help(format!("write {} = 0 if this is what shall vanish", shortened(text.trim()))));
        }
        _ => return Err(parser.unexpected()),
    }
    let rhs = parser.whole()?;
    match parser.token {
        Token::End => Ok((lhs, rhs)),
        Token::Equal => Err(ExprError::new("equation-expected", parser.span, "an equation has exactly one `=`")),
        _ => Err(parser.unexpected()),
    }
}

/// Why a name that other languages know is not part of this one: the reason, and what to write instead.
pub(super) fn refused(name: &str) -> Option<(&'static str, Option<&'static str>)> {
    const SMOOTH: Option<&str> = Some("a smooth replacement is sqrt(x^2 + e^2) with a small e");
    const OVER: Option<&str> = Some("the extreme value over a part of the curve is asked of the part: name.max(u)");
    Some(match name {
        "abs" => ("it has no derivative at its kink", SMOOTH),
        "min" | "max" => ("it has no derivative where its arguments are equal", OVER),
        "if" | "then" | "else" => ("a value that switches has no derivative where it does", None),
        "sign" | "sgn" | "floor" | "ceil" | "round" | "mod" | "step" | "heaviside" | "piecewise" => {
            ("it has no derivative where it jumps", None)
        }
        _ => return None,
    })
}

/// How a function that other languages know is written here.
fn written(name: &str) -> Option<&'static str> {
    Some(match name {
        "log" => "write ln(x) for the natural logarithm, ln(x)/ln(10) for the decimal one",
        "log10" => "write ln(x)/ln(10)",
        "log2" => "write ln(x)/ln(2)",
        "pow" => "write x^2",
        "cbrt" => "write x^(1/3)",
        "cot" => "write 1/tan(x)",
        "sec" => "write 1/cos(x)",
        "csc" => "write 1/sin(x)",
        "arcsin" => "write asin(x)",
        "arccos" => "write acos(x)",
        "arctan" | "atan2" => "write atan(x), of one argument",
        "deg" | "rad" => "write a unit behind its number, as in 40[deg]",
        _ => return None,
    })
}

/// How strongly an operator binds the operand on its left and on its right.
fn binding(token: Token) -> Option<(Operator, u8, u8)> {
    Some(match token {
        Token::Plus => (Operator::Add, 1, 2),
        Token::Minus => (Operator::Subtract, 1, 2),
        Token::Star => (Operator::Multiply, 3, 4),
        Token::Slash => (Operator::Divide, 3, 4),
        Token::Caret => (Operator::Power, 8, 7),
        _ => return None,
    })
}

/// A sign binds weaker than a power and stronger than a product.
const SIGN: u8 = 5;

struct Parser<'a> {
    lexer: Lexer<'a>,
    /// The token to be read next, and its place.
    token: Token,
    span: Range<usize>,
    /// The token read last, and its place.
    last: Option<(Token, Range<usize>)>,
    /// The parts of the formula being read.
    parts: Vec<Part>,
    depth: usize,
}

impl<'a> Parser<'a> {
    fn new(text: &'a str) -> Result<Self, ExprError> {
        if text.len() > MAX_LENGTH {
            let message = format!("the formula has {} bytes, more than the {MAX_LENGTH} allowed", text.len());
            return Err(ExprError::new("too-long", 0..0, message));
        }
        let mut lexer = Lexer::new(text);
        let (token, span) = lexer.next()?;
        if token == Token::End {
            return Err(ExprError::new("empty", 0..text.len(), "the formula is empty"));
        }
        Ok(Parser { lexer, token, span, last: None, parts: Vec::new(), depth: 0 })
    }

    fn text(&self, span: Range<usize>) -> &'a str {
        &self.lexer.text[span]
    }

    fn advance(&mut self) -> Result<(), ExprError> {
        let (token, span) = self.lexer.next()?;
        let last = std::mem::replace(&mut self.token, token);
        self.last = Some((last, std::mem::replace(&mut self.span, span)));
        Ok(())
    }

    fn last_end(&self) -> usize {
        self.last.as_ref().map_or(0, |(_, span)| span.end)
    }

    fn push(&mut self, term: Term, span: Range<usize>) -> usize {
        self.parts.push(Part { term, span });
        self.parts.len() - 1
    }

    /// A formula of its own, with its own list of parts.
    fn whole(&mut self) -> Result<Expr, ExprError> {
        let outer = std::mem::take(&mut self.parts);
        self.expression(0)?;
        Ok(Expr::new(std::mem::replace(&mut self.parts, outer)))
    }

    /// Operands joined by operators that bind at least as strongly as `least`. The result is the last part.
    fn expression(&mut self, least: u8) -> Result<usize, ExprError> {
        if self.depth >= MAX_DEPTH {
            let message = format!("the formula is nested more than {MAX_DEPTH} deep");
            return Err(ExprError::new("too-deep", self.span.clone(), message));
        }
        self.depth += 1;
        let start = self.span.start;
        let mut left = self.operand()?;
        if matches!(self.token, Token::Number(_) | Token::Name | Token::Open) {
            return Err(self.side_by_side(start));
        }
        while let Some((operator, binds_left, binds_right)) = binding(self.token) {
            if binds_left < least {
                break;
            }
            self.advance()?;
            let right = self.expression(binds_right)?;
            left = self.push(Term::Binary(operator, left, right), start..self.last_end());
        }
        self.depth -= 1;
        Ok(left)
    }

    fn operand(&mut self) -> Result<usize, ExprError> {
        let (token, span) = (self.token, self.span.clone());
        match token {
            Token::Number(value) => {
                self.advance()?;
                let mut end = span.end;
                let mut unit = None;
                if self.token == Token::Bracket {
                    let (read, place) = self.lexer.unit(self.span.start)?;
                    end = place.end;
                    unit = Some(Box::new(read));
                    self.span = place;
                    self.advance()?;
                }
                self.no_unit("only one unit stands behind a number", "write a compound unit as 3[mN/m]")?;
                Ok(self.push(Term::Number { value, unit }, span.start..end))
            }
            Token::Name => {
                self.advance()?;
                self.named(span)
            }
            Token::Minus => {
                self.advance()?;
                let operand = self.expression(SIGN)?;
                Ok(self.push(Term::Negative(operand), span.start..self.last_end()))
            }
            Token::Plus => {
                self.advance()?;
                self.expression(SIGN)
            }
            Token::Open => {
                self.advance()?;
                if self.token == Token::Close {
                    let span = span.start..self.span.end;
                    return Err(ExprError::new("missing-operand", span, "nothing stands between the parentheses"));
                }
                let inner = self.expression(0)?;
                self.close(span)?;
                self.unit_only_behind_number("parentheses")?;
                Ok(inner)
            }
            _ => Err(self.missing_operand()),
        }
    }

    /// What starts with the name at `span`, which has just been read.
    fn named(&mut self, span: Range<usize>) -> Result<usize, ExprError> {
        let name = self.text(span.clone());
        let called = self.token == Token::Open;
        if let Some((reason, help)) = refused(name)
            && (called || matches!(name, "if" | "then" | "else"))
        {
            let error = ExprError::new("no-derivative", span, format!("there is no `{name}`: {reason}"));
            return Err(ExprError { help: help.map(str::to_owned), ..error });
        }
        if let Some(function) = Function::named(name) {
            if !called {
                let message = format!("`{name}` is a function and stands here without its argument");
                return Err(ExprError::new("function-without-argument", span, message).help(format!("write {name}(x)")));
            }
            return self.function(function, span);
        }
        if name == "pi" {
            self.unit_only_behind_number("`pi`")?;
            return Ok(self.push(Term::Pi, span));
        }
        if called {
            if !name.contains('.') {
                return Err(self.unknown_function(span));
            }
            let arguments = self.arguments()?;
            self.unit_only_behind_number("a call")?;
            return Ok(self.push(Term::Call { name: name.to_owned(), arguments }, span.start..self.last_end()));
        }
        self.unit_only_behind_number("a name")?;
        Ok(self.push(Term::Name(name.to_owned()), span))
    }

    fn function(&mut self, function: Function, span: Range<usize>) -> Result<usize, ExprError> {
        let name = function.name();
        let open = self.span.clone();
        self.advance()?;
        if self.token == Token::Close {
            let place = open.start..self.span.end;
            let message = format!("`{name}` takes one argument and is given none");
            return Err(ExprError::new("argument-count", place, message).help(format!("write {name}(x)")));
        }
        let argument = self.expression(0)?;
        if self.token == Token::Comma {
            let message = format!("`{name}` takes one argument and is given more");
            return Err(ExprError::new("argument-count", self.span.clone(), message)
                .help("a decimal comma is written as a point"));
        }
        self.close(open)?;
        self.unit_only_behind_number("a function")?;
        Ok(self.push(Term::Function(function, argument), span.start..self.last_end()))
    }

    /// The arguments of a call, from the opening to behind the closing parenthesis.
    fn arguments(&mut self) -> Result<Vec<Argument>, ExprError> {
        let open = self.span.clone();
        self.advance()?;
        let mut arguments: Vec<Argument> = Vec::new();
        if self.token == Token::Close {
            self.advance()?;
            return Ok(arguments);
        }
        loop {
            let start = self.span.start;
            let mut value = self.whole()?;
            let mut name = None;
            if self.token == Token::Equal {
                let Some(given) = value.as_name().filter(|n| !n.contains('.')) else {
                    let message = "in front of `=` stands the name of an argument, not a formula";
                    return Err(ExprError::new("argument-name", value.span(), message));
                };
                name = Some(given.to_owned());
                self.advance()?;
                value = self.whole()?;
            }
            arguments.push(Argument { name, value, span: start..self.last_end() });
            if self.token != Token::Comma {
                break;
            }
            if let Some(Argument { name: Some(name), span, .. }) = arguments.last() {
                let message = format!("the named argument `{}` is not the last", shortened(name));
                return Err(ExprError::new("argument-name", span.clone(), message));
            }
            self.advance()?;
        }
        self.close(open)?;
        Ok(arguments)
    }

    /// Reads the parenthesis that closes the one at `open`.
    fn close(&mut self, open: Range<usize>) -> Result<(), ExprError> {
        match self.token {
            Token::Close => self.advance(),
            Token::End => Err(ExprError::new("unclosed", open, "the parenthesis opened here is not closed")),
            _ => Err(self.unexpected()),
        }
    }

    fn no_unit(&self, message: &str, help: &str) -> Result<(), ExprError> {
        if self.token != Token::Bracket {
            return Ok(());
        }
        let rest = &self.lexer.text[self.span.start..];
        let length = rest.find(']').map_or(1, |n| n + 1);
        let span = self.span.start..self.span.start + length;
        Err(ExprError::new("unit-misplaced", span, message).help(help))
    }

    fn unit_only_behind_number(&self, behind: &str) -> Result<(), ExprError> {
        let message = format!("a unit stands directly behind a number, not behind {behind}");
        self.no_unit(&message, "give the number its unit, as in 40[deg]; a parameter may hold it")
    }

    fn missing_operand(&self) -> ExprError {
        let here = (self.token != Token::End).then(|| self.text(self.span.clone()));
        let (message, span) = match (&self.last, here) {
            (Some((Token::Star, last)), Some("*")) if last.end == self.span.start => {
                return ExprError::new("power-operator", last.start..self.span.end, "`**` is not an operator")
                    .help("write ^ for a power");
            }
            (Some((_, last)), _) => {
                (format!("a value is missing behind {}", quoted(self.text(last.clone()))), last.clone())
            }
            (None, Some("[")) => {
                return ExprError::new("unit-misplaced", self.span.clone(), "a unit stands behind a number")
                    .help("write 40[deg]");
            }
            (None, here) => {
                (format!("a value is missing in front of {}", quoted(here.unwrap_or_default())), self.span.clone())
            }
        };
        ExprError::new("missing-operand", span, message)
    }

    /// Two values without an operator between them; the left one starts at `start`.
    fn side_by_side(&self, start: usize) -> ExprError {
        let left = self.text(start..self.last_end());
        let right = match self.token {
            Token::Open => self.group(),
            _ => self.text(self.span.clone()),
        };
        if self.token == Token::Name
            && let Some((reason, _)) = refused(right).filter(|_| matches!(right, "if" | "then" | "else"))
        {
            return ExprError::new("no-derivative", self.span.clone(), format!("there is no `{right}`: {reason}"));
        }
        let message = format!("an operator is missing between {} and {}", quoted(left), quoted(right));
        let error = ExprError::new("missing-operator", start..self.span.end, message);
        match (self.last.as_ref().map(|(token, _)| *token), self.token) {
            (Some(Token::Number(_)), Token::Number(_)) => error,
            _ => error.help(format!("write {}*{} for a product", shortened(left), shortened(right))),
        }
    }

    /// The text of the parenthesis that starts here, if it is short.
    fn group(&self) -> &'a str {
        let rest = &self.lexer.text[self.span.start..];
        let mut open = 0;
        for (i, b) in rest.bytes().enumerate().take(40) {
            match b {
                b'(' => open += 1,
                b')' if open == 1 => return &rest[..=i],
                b')' => open -= 1,
                _ => {}
            }
        }
        "(...)"
    }

    fn unknown_function(&self, span: Range<usize>) -> ExprError {
        let name = self.text(span.clone());
        let names = Function::ALL.map(Function::name);
        let help = match (written(name), nearest(name, names)) {
            (Some(written), _) => written.to_owned(),
            (None, Some(near)) => format!("did you mean {near}?"),
            (None, None) => format!("write {}*{} for a product", shortened(name), self.group()),
        };
        let help = format!("{help}; the functions are {}", names.join(", "));
        ExprError::new("unknown-function", span, format!("there is no function {}", quoted(name))).help(help)
    }

    /// What to say of a token that cannot follow a complete value.
    fn unexpected(&self) -> ExprError {
        let span = self.span.clone();
        match self.token {
            Token::Equal => {
                ExprError::new("equation-not-allowed", span, "an equation is not allowed here, only a value")
            }
            Token::Close => ExprError::new("unmatched", span, "the parenthesis closed here was not opened"),
            Token::Comma => ExprError::new("unexpected-comma", span, "a comma separates the arguments of a call")
                .help("a decimal comma is written as a point: 1.5"),
            _ => {
                ExprError::new("missing-operator", span.clone(), format!("{} is out of place", quoted(self.text(span))))
            }
        }
    }
}
