//! Messages about invalid numbers, because the standard library's messages are for programmers.

use clap::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error as _;
use std::num::{IntErrorKind, ParseFloatError, ParseIntError};

/// Replaces the message of an error about an invalid number; other errors stay.
pub(crate) fn in_words(error: Error) -> Error {
    let Some(problem) = number(&error) else { return error };
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.as_str(),
        _ => "",
    };
    let (flag, value) = (text(ContextKind::InvalidArg), text(ContextKind::InvalidValue));
    let message = format!("{flag}: `{value}` {problem}\n\nFor more information, try '--help'.\n");
    Error::raw(ErrorKind::ValueValidation, message)
}

/// Returns what is wrong with an invalid number, or `None` for other errors.
pub(crate) fn number(error: &Error) -> Option<&'static str> {
    let source = error.source()?;
    match source.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => Some("is too large a number"),
        Some(_) => Some("is not a whole number"),
        None => source.is::<ParseFloatError>().then_some("is not a number"),
    }
}
