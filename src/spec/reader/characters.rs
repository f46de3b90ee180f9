//! Where the reader stands in the text: characters, blanks, comments and words, and complaints about them.

use super::{MAX_COMPLAINTS, Out, Reader, Stop};
use crate::diagnostic::{Diagnostic, Place};
use crate::spec::origin::Syntax;
use std::ops::Range;

impl Reader<'_> {
    pub(super) fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    pub(super) fn peek_char(&self) -> Option<char> {
        self.text.get(self.at..).and_then(|rest| rest.chars().next())
    }

    pub(super) fn eat(&mut self, byte: u8) -> bool {
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    pub(super) fn ron(&self) -> bool {
        self.syntax == Syntax::Ron
    }

    /// Skips blanks and comments.
    pub(super) fn blank(&mut self) -> Out<()> {
        loop {
            match self.peek() {
                Some(b' ' | b'\t' | b'\n' | b'\r') => self.at += 1,
                Some(b'/') if matches!(self.bytes.get(self.at + 1), Some(b'/' | b'*')) => self.comment()?,
                Some(byte) if byte == 0x0b || byte == 0x0c || byte >= 0x80 => match self.peek_char() {
                    Some(c) if c.is_whitespace() && self.ron() => self.at += c.len_utf8(),
                    _ => return Ok(()),
                },
                _ => return Ok(()),
            }
        }
    }

    pub(super) fn comment(&mut self) -> Out<()> {
        let start = self.at;
        if !self.ron() {
            self.complain(start..start + 2, "syntax", "JSON has no comments", "")?;
        }
        if self.bytes[self.at + 1] == b'/' {
            self.at = self.text[self.at..].find('\n').map_or(self.bytes.len(), |i| self.at + i + 1);
            return Ok(());
        }
        let mut open = 0usize;
        while let Some(byte) = self.peek() {
            match (byte, self.bytes.get(self.at + 1)) {
                (b'/', Some(b'*')) => (open, self.at) = (open + 1, self.at + 2),
                (b'*', Some(b'/')) => {
                    (open, self.at) = (open - 1, self.at + 2);
                    if open == 0 {
                        return Ok(());
                    }
                }
                _ => self.at += 1,
            }
        }
        self.stop(start..start + 2, "syntax", "this comment does not end", "opened here")
    }

    /// The word that starts here; empty where there is none.
    pub(super) fn word_range(&mut self) -> Range<usize> {
        let start = self.at;
        while let Some(c) = self.peek_char() {
            if c == '_' || c.is_alphanumeric() && (self.at > start || !c.is_ascii_digit()) {
                self.at += c.len_utf8();
            } else {
                break;
            }
        }
        start..self.at
    }

    // Complaints -----------------------------------------------------------------------------------------------------

    pub(super) fn report(&mut self, diagnostic: Diagnostic) -> Out<()> {
        self.diagnostics.push(diagnostic);
        if self.diagnostics.len() < MAX_COMPLAINTS {
            return Ok(());
        }
        self.diagnostics.push(Diagnostic::error("too-many-errors", "there are more errors than are reported"));
        Err(Stop)
    }

    pub(super) fn complain(&mut self, at: Range<usize>, code: &'static str, message: &str, label: &str) -> Out<()> {
        self.report(Diagnostic::error(code, message).label(Place::Bytes(at), label))
    }

    pub(super) fn stop<T>(&mut self, at: Range<usize>, code: &'static str, message: &str, label: &str) -> Out<T> {
        self.complain(at, code, message, label)?;
        Err(Stop)
    }
}
