//! Text into tokens, one at a time.

use super::error::{ExprError, quoted};
use super::tree::Unit;
use std::ops::Range;

/// What stands at one place of the text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token {
    Number(f64),
    Name,
    Plus,
    Minus,
    Star,
    Slash,
    Caret,
    Open,
    Close,
    Comma,
    Equal,
    /// `[`; the text behind it is read by [`Lexer::unit`].
    Bracket,
    End,
}

pub(super) struct Lexer<'a> {
    pub text: &'a str,
    at: usize,
}

impl<'a> Lexer<'a> {
    pub fn new(text: &'a str) -> Self {
        Lexer { text, at: 0 }
    }

    fn byte(&self, ahead: usize) -> u8 {
        // 0 has no meaning in a formula, so it can stand for the end.
        self.text.as_bytes().get(self.at + ahead).copied().unwrap_or(0)
    }

    fn skip(&mut self, accept: impl Fn(u8) -> bool) {
        let rest = &self.text.as_bytes()[self.at..];
        self.at += rest.iter().position(|&b| !accept(b)).unwrap_or(rest.len());
    }

    /// The next token and its place.
    pub fn next(&mut self) -> Result<(Token, Range<usize>), ExprError> {
        self.skip(|b| b.is_ascii_whitespace());
        let start = self.at;
        if start >= self.text.len() {
            return Ok((Token::End, start..start));
        }
        let single = match self.byte(0) {
            b'+' => Token::Plus,
            b'-' => Token::Minus,
            b'*' => Token::Star,
            b'/' => Token::Slash,
            b'^' => Token::Caret,
            b'(' => Token::Open,
            b')' => Token::Close,
            b',' => Token::Comma,
            b'=' if self.byte(1) != b'=' => Token::Equal,
            b'[' => Token::Bracket,
            b'0'..=b'9' => return self.number(),
            b'.' if self.byte(1).is_ascii_digit() => return self.number(),
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => return self.name(),
            _ => return Err(self.unknown()),
        };
        self.at += 1;
        Ok((single, start..start + 1))
    }

    fn number(&mut self) -> Result<(Token, Range<usize>), ExprError> {
        let start = self.at;
        let digit = |b: u8| b.is_ascii_digit();
        self.skip(digit);
        if self.byte(0) == b'.' {
            self.at += 1;
            self.skip(digit);
        }
        let mantissa = start..self.at;
        if matches!(self.byte(0), b'e' | b'E') {
            let sign = usize::from(matches!(self.byte(1), b'+' | b'-'));
            if self.byte(1 + sign).is_ascii_digit() {
                self.at += 1 + sign;
                self.skip(digit);
            }
        }
        let span = start..self.at;
        let written = &self.text[span.clone()];
        let error = |what: &str| Err(ExprError::new("malformed-number", span.clone(), what));
        if self.byte(0) == b'.' {
            self.at += 1;
            self.skip(|b| digit(b) || b == b'.');
            let span = start..self.at;
            return Err(ExprError::new(
                "malformed-number",
                span,
                "a number has one decimal point, before its exponent",
            ));
        }
        match written.parse::<f64>() {
            Ok(value) if value.is_infinite() => error("the number is too large (the largest is 1.8e308)"),
            Ok(0.0) if self.text[mantissa].bytes().any(|b| matches!(b, b'1'..=b'9')) => {
                error("the number is too small to be told from 0 (the smallest is 4.9e-324)")
            }
            Ok(value) => Ok((Token::Number(value), span)),
            Err(_) => error("this is not a number"),
        }
    }

    fn name(&mut self) -> Result<(Token, Range<usize>), ExprError> {
        let start = self.at;
        loop {
            self.skip(|b| b.is_ascii_alphanumeric() || b == b'_');
            if self.byte(0) != b'.' {
                return Ok((Token::Name, start..self.at));
            }
            if !(self.byte(1).is_ascii_alphabetic() || self.byte(1) == b'_') {
                let message = format!("a name is missing behind {}", quoted(&self.text[start..=self.at]));
                return Err(ExprError::new("malformed-name", start..self.at + 1, message));
            }
            self.at += 1;
        }
    }

    /// The unit whose bracket starts at `open`, from directly behind it to the closing bracket.
    pub fn unit(&mut self, open: usize) -> Result<(Unit, Range<usize>), ExprError> {
        let rest = &self.text[open + 1..];
        let Some(length) = rest.find([']', '[']).filter(|&n| rest[n..].starts_with(']')) else {
            return Err(ExprError::new("unclosed", open..open + 1, "the bracket opened here is not closed")
                .help("write a unit as 40[deg]"));
        };
        let end = open + 1 + length + 1;
        let text = rest[..length].trim();
        if text.is_empty() {
            return Err(ExprError::new("unknown-unit", open..end, "the unit is empty")
                .help("leave out the brackets of a pure number"));
        }
        let start = open + 1 + (rest[..length].len() - rest[..length].trim_start().len());
        self.at = end;
        Ok((Unit::new(text, start..start + text.len()), open..end))
    }

    /// What to say of a character that starts no token.
    fn unknown(&self) -> ExprError {
        let rest = &self.text[self.at..];
        let c = rest.chars().next().unwrap_or(' ');
        let here = |length: usize| self.at..self.at + length;
        for sign in ["<=", ">=", "!=", "==", "<", ">", "!", "&&", "||", "?"] {
            if rest.starts_with(sign) {
                let error = ExprError::new(
                    "comparison",
                    here(sign.len()),
                    format!("`{sign}` has no meaning here: a value that switches has no derivative where it does"),
                );
                return match sign {
                    "==" => error.help("an equation is written with a single `=`"),
                    _ => error,
                };
            }
        }
        let error = ExprError::new(
            "unknown-character",
            here(c.len_utf8()),
            format!("unknown character `{}`", c.escape_debug()),
        );
        let help = match c {
            '.' => "a decimal point needs a digit beside it, a dotted name a name before it",
            ']' => return ExprError::new("unmatched", here(1), "the bracket closed here was not opened"),
            '{' | '}' => "write parentheses ( )",
            '|' => "there is no absolute value: it has no derivative at its kink",
            '%' => "there is neither a remainder nor a percentage; write 0.05 for 5 percent",
            '"' | '\'' => "names in a formula are written without quotes",
            '\u{d7}' | '\u{b7}' | '\u{22c5}' | '\u{2217}' => "write *",
            '\u{f7}' | '\u{2215}' => "write /",
            '\u{2212}' | '\u{2013}' | '\u{2014}' => "write -",
            '\u{b2}' => "write ^2",
            '\u{b3}' => "write ^3",
            '\u{b0}' => "write 40[deg]",
            '\u{221a}' => "write sqrt(x)",
            '\u{3b1}' => "write alpha",
            '\u{3b2}' => "write beta",
            '\u{3b3}' => "write gamma",
            '\u{3b7}' => "write eta",
            '\u{3b8}' => "write theta",
            '\u{3bb}' => "write lambda",
            '\u{3bc}' | '\u{b5}' => "write mu",
            '\u{3c0}' => "write pi",
            '\u{3c1}' => "write rho",
            '\u{3c3}' => "write sigma",
            '\u{3c4}' => "write tau",
            '\u{3c6}' | '\u{3d5}' => "write phi",
            '\u{a0}' | '\u{2009}' | '\u{202f}' | '\u{feff}' => "this is an unusual blank; write a plain one",
            _ if c.is_alphabetic() => "names are made of ASCII letters, digits and _",
            _ => return error,
        };
        error.help(help)
    }
}
