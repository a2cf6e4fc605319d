//! Scans the words and values of a text layer.

use labelgs_scene::{Error, Result};
use std::path::Path;
use std::str::FromStr;

/// A value in the text: byte offsets of its start and end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: usize,
    pub(super) end: usize,
}

/// A position in the text.
#[derive(Clone, Debug)]
pub(super) struct Scanner<'a> {
    path: &'a Path,
    /// The layer's name, if it is in a package.
    entry: Option<&'a str>,
    text: &'a str,
    at: usize,
    end: usize,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(path: &'a Path, entry: Option<&'a str>, text: &'a str) -> Self {
        Self { path, entry, text, at: 0, end: text.len() }
    }

    /// Returns a scanner of a value.
    pub(super) fn within(&self, span: Span) -> Self {
        Self { at: span.start, end: span.end, ..self.clone() }
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn skip(&mut self, bytes: usize) {
        self.at = (self.at + bytes).min(self.end);
    }

    /// Returns the text of a value.
    pub(super) fn part(&self, span: Span) -> &'a str {
        self.text.get(span.start..span.end).unwrap_or_default()
    }

    /// Returns an error at a position.
    pub(super) fn bad(&self, at: usize, problem: impl Into<String>) -> Error {
        let before = self.text.as_bytes().get(..at).unwrap_or(self.text.as_bytes());
        let line = format!("line {}", 1 + before.iter().filter(|&&byte| byte == b'\n').count());
        let place = self.entry.map_or_else(|| line.clone(), |entry| format!("{entry}, {line}"));
        Error::data(self.path, place, problem)
    }

    fn rest(&self) -> &'a [u8] {
        self.text.as_bytes().get(self.at..self.end).unwrap_or_default()
    }

    pub(super) fn starts(&self, text: &str) -> bool {
        self.rest().starts_with(text.as_bytes())
    }

    /// Returns the next byte that is neither white space nor part of a comment.
    pub(super) fn peek(&mut self) -> Option<u8> {
        loop {
            let byte = *self.rest().first()?;
            if byte.is_ascii_whitespace() || byte == b';' {
                self.at += 1;
            } else if byte == b'#' || self.starts("//") {
                self.skip_to("\n");
            } else if self.starts("/*") {
                self.skip_to("*/");
            } else {
                return Some(byte);
            }
        }
    }

    /// Moves past the next `mark`, or to the end if there is none. Returns whether the mark was found.
    fn skip_to(&mut self, mark: &str) -> bool {
        let mark = mark.as_bytes();
        let found = self.rest().windows(mark.len()).position(|part| part == mark);
        self.at = found.map_or(self.end, |found| self.at + found + mark.len());
        found.is_some()
    }

    /// Consumes the next byte if it is `expected`.
    pub(super) fn take(&mut self, expected: u8) -> bool {
        let is_there = self.peek() == Some(expected);
        self.at += usize::from(is_there);
        is_there
    }

    /// Consumes the next byte, which must be `expected`.
    pub(super) fn need(&mut self, expected: u8, after: &str) -> Result<()> {
        if self.take(expected) {
            return Ok(());
        }
        let found = self.found();
        Err(self.bad(self.at, format!("expected `{}` after {after}, found {found}", char::from(expected))))
    }

    /// Describes what comes next, for a message.
    fn found(&mut self) -> String {
        match self.peek() {
            None => "the end; the file was cut short".into(),
            Some(_) => {
                let rest = String::from_utf8_lossy(self.rest());
                format!("`{}`", rest.chars().take_while(|c| !c.is_control()).take(20).collect::<String>())
            }
        }
    }

    /// Reads a name, a number or a type without brackets; returns an empty string if anything else comes next.
    pub(super) fn word(&mut self) -> &'a str {
        self.peek();
        let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"_:.|+-!".contains(byte) || *byte >= 0x80;
        let length = self.rest().iter().take_while(|byte| is_part(byte)).count();
        let span = Span { start: self.at, end: self.at + length };
        self.at = span.end;
        self.part(span)
    }

    /// Reads a required word.
    pub(super) fn name(&mut self, what: &str) -> Result<&'a str> {
        let word = self.word();
        if word.is_empty() {
            let found = self.found();
            return Err(self.bad(self.at, format!("expected {what}, found {found}")));
        }
        Ok(word)
    }

    /// Reads a string and returns the raw text between its quotation marks.
    pub(super) fn string(&mut self) -> Result<&'a str> {
        let start = self.at;
        let quote = match self.peek() {
            Some(b'"') if self.starts("\"\"\"") => "\"\"\"",
            Some(b'\'') if self.starts("'''") => "'''",
            Some(b'"') => "\"",
            Some(b'\'') => "'",
            _ => {
                let found = self.found();
                return Err(self.bad(self.at, format!("expected a string in quotation marks, found {found}")));
            }
        };
        self.at += quote.len();
        let inside = self.at;
        loop {
            match self.rest().first() {
                None => return Err(self.bad(start, "has an unterminated string; the file was cut short or changed")),
                Some(b'\\') => self.skip(2),
                Some(b'\n') if quote.len() == 1 => {
                    return Err(self.bad(start, "has a string that does not end on its line; close it"));
                }
                Some(_) if self.starts(quote) => break,
                Some(_) => self.at += 1,
            }
        }
        let span = Span { start: inside, end: self.at };
        self.at += quote.len();
        Ok(self.part(span))
    }

    /// Skips a value of any type and returns its span.
    pub(super) fn value(&mut self) -> Result<Span> {
        let first = self.peek();
        let start = self.at;
        self.item(first)?;
        if first == Some(b'@') {
            // An asset may be followed by a prim path and a time offset.
            if self.starts("<") {
                self.item(Some(b'<'))?;
            }
            if self.peek() == Some(b'(') {
                self.item(Some(b'('))?;
            }
        }
        Ok(Span { start, end: self.at })
    }

    fn item(&mut self, first: Option<u8>) -> Result<()> {
        match first {
            Some(b'"' | b'\'') => self.string().map(drop),
            Some(b'@') => self.enclosed(if self.starts("@@@") { "@@@" } else { "@" }),
            Some(b'<') => self.enclosed(">"),
            Some(b'(' | b'[' | b'{') => self.brackets(),
            _ => self.name("a value").map(drop),
        }
    }

    fn enclosed(&mut self, end: &str) -> Result<()> {
        let start = self.at;
        self.skip(end.len());
        if self.skip_to(end) {
            Ok(())
        } else {
            Err(self.bad(start, format!("has no closing `{end}`; the file was cut short")))
        }
    }

    /// Skips brackets and their content.
    fn brackets(&mut self) -> Result<()> {
        let start = self.at;
        let mut open = Vec::new();
        while let Some(byte) = self.peek() {
            match byte {
                b'(' => open.push(b')'),
                b'[' => open.push(b']'),
                b'{' => open.push(b'}'),
                b')' | b']' | b'}' => {
                    if open.pop() != Some(byte) {
                        return Err(self.bad(self.at, format!("`{}` closes nothing; correct it", char::from(byte))));
                    }
                    if open.is_empty() {
                        self.at += 1;
                        return Ok(());
                    }
                }
                b'"' | b'\'' | b'@' | b'<' => {
                    self.item(Some(byte))?;
                    continue;
                }
                _ => {}
            }
            self.at += 1;
        }
        Err(self.bad(start, "has no closing bracket; the file was cut short or changed"))
    }

    /// Parses the numbers of a value of any shape, in order.
    pub(super) fn numbers<T: FromStr>(&self, span: Span) -> Result<Vec<T>> {
        let mut inside = self.within(span);
        let mut numbers = Vec::new();
        while let Some(byte) = inside.peek() {
            if b"()[],".contains(&byte) {
                inside.at += 1;
                continue;
            }
            let at = inside.at;
            let word = inside.word();
            let number = word.parse().map_err(|_| {
                let found = if word.is_empty() { inside.found() } else { format!("`{word}`") };
                self.bad(at, format!("expected a number, found {found}"))
            })?;
            numbers.push(number);
        }
        Ok(numbers)
    }

    /// Returns the first string in a value, or the value itself if it is a string.
    pub(super) fn first_string(&self, span: Span) -> Option<String> {
        let mut inside = self.within(span);
        inside.take(b'[');
        inside.string().ok().map(unescaped)
    }
}

/// Resolves the escapes of a string.
fn unescaped(text: &str) -> String {
    let (mut plain, mut rest) = (String::new(), text.chars());
    while let Some(c) = rest.next() {
        plain.push(match (c, c == '\\') {
            (_, true) => match rest.next() {
                Some('n') => '\n',
                Some('r') => '\r',
                Some('t') => '\t',
                Some(other) => other,
                None => break,
            },
            (c, false) => c,
        });
    }
    plain
}
