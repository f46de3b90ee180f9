//! Numbers and strings, with what is commonly mistaken for them.

use super::{Out, Reader, Tree};
use crate::diagnostic::{Diagnostic, Place, short};
use crate::spec::origin::{Syntax, Written};
use serde_json::Value;

impl Reader<'_> {
    pub(super) fn number(&mut self) -> Out<Tree> {
        let start = self.at;
        let mut last = 0;
        while let Some(byte) = self.peek() {
            let sign = matches!(byte, b'+' | b'-') && (self.at == start || matches!(last, b'e' | b'E'));
            if !(sign || byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.')) {
                break;
            }
            last = byte;
            self.at += 1;
        }
        let span = start..self.at;
        let token = &self.text[span.clone()];
        let placeholder = Value::from(1);
        if self.peek() == Some(b'[') && token.bytes().any(|byte| byte.is_ascii_digit()) {
            let end = self.text[self.at..].find([']', '\n', ',']).map_or(self.bytes.len(), |i| self.at + i);
            self.at = end;
            self.eat(b']');
            let example = short(&self.text[start..self.at]);
            let diagnostic = Diagnostic::error("unquoted-unit", "a number with a unit stands in quotes");
            self.report(diagnostic.label(Place::Bytes(start..self.at), format!("write \"{example}\"")))?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        }
        let plain: String = if self.ron() { token.replace('_', "") } else { token.into() };
        if !decimal(&plain) || token.starts_with('_') {
            let unsigned = plain.trim_start_matches(['+', '-']);
            let (code, message, label) = match unsigned.as_bytes() {
                [b'0', b'x' | b'X' | b'b' | b'o', ..] => ("bad-number", "numbers are written in decimal", ""),
                [b'i' | b'I', b'n', ..] | [b'N', b'a', ..] => {
                    ("non-finite", "numbers are finite", "not a finite number")
                }
                [b'a'..=b'z' | b'A'..=b'Z', ..] => {
                    ("unquoted-formula", "formulas and dotted names stand in quotes", "quotes are missing")
                }
                _ if plain.contains("..") => ("bad-number", "there are no ranges", "not a number"),
                _ => ("bad-number", "this is not a number", "a number with a unit is written \"40[deg]\""),
            };
            self.complain(span, code, message, label)?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        }
        if !self.ron() && !json_decimal(token) {
            self.complain(span.clone(), "syntax", "JSON does not write a number like this", "")?;
        }
        let value = if plain.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-')) {
            match (plain.parse::<u64>(), plain.parse::<i64>()) {
                (Ok(value), _) if !plain.starts_with('-') => Some(Value::from(value)),
                (_, Ok(value)) if value != 0 => Some(Value::from(value)),
                _ => None,
            }
        } else {
            None
        };
        let value =
            value.or_else(|| plain.parse::<f64>().ok().and_then(serde_json::Number::from_f64).map(Value::Number));
        let Some(value) = value else {
            self.complain(span, "non-finite", "the number is too large", "beyond 1.8e308")?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        };
        let tree = self.leaf(value, start, Written::Scalar);
        Ok(self.formula(start)?.unwrap_or(tree))
    }

    pub(super) fn string(&mut self) -> Out<Tree> {
        let start = self.at;
        self.at += 1;
        let mut text = String::new();
        let mut written = Written::Quoted;
        loop {
            let rest = &self.bytes[self.at..];
            let Some(i) = rest.iter().position(|&byte| matches!(byte, b'"' | b'\\') || byte < 0x20) else {
                self.at = self.bytes.len();
                return self.stop(start..start + 1, "syntax", "this string does not end", "opened here");
            };
            text.push_str(&self.text[self.at..self.at + i]);
            self.at += i;
            match rest[i] {
                b'"' => break,
                b'\\' => {
                    written = Written::Escaped;
                    let escape = self.at;
                    match self.escape() {
                        Some(c) => text.push(c),
                        None => {
                            self.at = self.text.ceil_char_boundary(self.at.max(escape + 1));
                            self.complain(
                                escape..self.at,
                                "bad-escape",
                                "this escape is not known",
                                "write \\\\ for \\",
                            )?;
                            text.push('\u{fffd}');
                        }
                    }
                }
                byte => {
                    if !self.ron() {
                        let at = self.at..self.at + 1;
                        self.complain(
                            at,
                            "syntax",
                            "JSON strings have no control characters",
                            "write it as an escape",
                        )?;
                    }
                    text.push(char::from(byte));
                    self.at += 1;
                }
            }
        }
        self.at += 1;
        Ok(self.leaf(Value::String(text), start, written))
    }

    /// The character that an escape stands for. Where there is none, the position is somewhere in the escape.
    pub(super) fn escape(&mut self) -> Option<char> {
        self.at += 1;
        let byte = self.peek()?;
        if !byte.is_ascii() {
            return None;
        }
        self.at += 1;
        match (byte, self.syntax) {
            (b'"' | b'\\', _) => Some(char::from(byte)),
            (b'n', _) => Some('\n'),
            (b'r', _) => Some('\r'),
            (b't', _) => Some('\t'),
            (b'/', Syntax::Json) => Some('/'),
            (b'b', Syntax::Json) => Some('\u{8}'),
            (b'f', Syntax::Json) => Some('\u{c}'),
            (b'u', Syntax::Json) => {
                let high = self.hex(4)?;
                if !(0xd800..0xdc00).contains(&high) {
                    return char::from_u32(high);
                }
                if !(self.eat(b'\\') && self.eat(b'u')) {
                    return None;
                }
                let low = self.hex(4)?;
                if !(0xdc00..0xe000).contains(&low) {
                    return None;
                }
                char::from_u32(0x10000 + ((high - 0xd800) << 10) + (low - 0xdc00))
            }
            (b'0', Syntax::Ron) => Some('\0'),
            (b'\'', Syntax::Ron) => Some('\''),
            (b'x', Syntax::Ron) => char::from_u32(self.hex(2)?),
            (b'u', Syntax::Ron) => {
                if !self.eat(b'{') {
                    return None;
                }
                let digits = self.bytes[self.at..].iter().take(7).take_while(|byte| byte.is_ascii_hexdigit()).count();
                if !(1..=6).contains(&digits) {
                    return None;
                }
                let code = self.hex(digits)?;
                if self.eat(b'}') { char::from_u32(code) } else { None }
            }
            _ => None,
        }
    }

    pub(super) fn hex(&mut self, digits: usize) -> Option<u32> {
        let text = self.bytes.get(self.at..self.at + digits)?;
        if !text.iter().all(u8::is_ascii_hexdigit) {
            return None;
        }
        let code = u32::from_str_radix(std::str::from_utf8(text).ok()?, 16).ok()?;
        self.at += digits;
        Some(code)
    }

    /// The number of `#` of the raw string that starts here, where one does.
    pub(super) fn raw_hashes(&self) -> Option<usize> {
        let rest = self.bytes.get(self.at + 1..)?;
        let hashes = rest.iter().take_while(|&&byte| byte == b'#').count();
        (rest.get(hashes) == Some(&b'"')).then_some(hashes)
    }

    pub(super) fn raw_string(&mut self) -> Out<Tree> {
        let start = self.at;
        let hashes = self.raw_hashes().unwrap_or(0);
        let content = start + hashes + 2;
        let mut at = content;
        while let Some(i) = self.text[at..].find('"') {
            let end = at + i;
            let closing = self.bytes[end + 1..].iter().take(hashes).take_while(|&&byte| byte == b'#').count();
            if closing == hashes {
                self.at = end + 1 + hashes;
                let text = Value::String(self.text[content..end].into());
                return Ok(self.leaf(text, start, Written::Raw(hashes + 2)));
            }
            at = end + 1;
        }
        self.stop(start..content, "syntax", "this raw string does not end", "opened here")
    }

    pub(super) fn single_quoted(&mut self) -> Out<Tree> {
        let start = self.at;
        let line = self.text[start + 1..].find(['\'', '\n']).map(|i| start + 1 + i);
        let Some(end) = line.filter(|&end| self.bytes[end] == b'\'') else {
            return self.stop(start..start + 1, "syntax", "text stands between \"double quotes\"", "");
        };
        self.at = end + 1;
        self.complain(start..self.at, "single-quotes", "text stands between \"double quotes\"", "")?;
        Ok(self.leaf(Value::String(self.text[start + 1..end].into()), start, Written::Quoted))
    }
}

/// Whether this is a decimal number: `1`, `+1.`, `.5`, `1e-3`.
fn decimal(token: &str) -> bool {
    let token = token.strip_prefix(['+', '-']).unwrap_or(token);
    let (mantissa, exponent) = match token.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (token, None),
    };
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let mantissa = (digits(whole) || whole.is_empty()) && (digits(fraction) || fraction.is_empty());
    let some = !(whole.is_empty() && fraction.is_empty());
    mantissa && some && exponent.is_none_or(|exponent| digits(exponent.strip_prefix(['+', '-']).unwrap_or(exponent)))
}

/// Whether a decimal number is written as JSON has it.
fn json_decimal(token: &str) -> bool {
    let token = token.strip_prefix('-').unwrap_or(token);
    let mantissa = token.split(['e', 'E']).next().unwrap_or("");
    let (whole, fraction) = mantissa.split_once('.').map_or((mantissa, None), |(whole, rest)| (whole, Some(rest)));
    let plain = |byte: u8| byte.is_ascii_digit();
    !whole.is_empty()
        && whole.bytes().all(plain)
        && (whole == "0" || !whole.starts_with('0'))
        && fraction.is_none_or(|fraction| !fraction.is_empty())
}
