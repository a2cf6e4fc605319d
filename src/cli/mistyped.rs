//! What the parser of arguments says of a number that is none: the standard library's words are for programmers.

use clap::Error;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::error::Error as _;
use std::num::{IntErrorKind, ParseFloatError, ParseIntError};

/// Returns the error in words for those who typed the number; other errors stay.
pub(super) fn in_words(error: Error) -> Error {
    let Some(source) = error.source() else { return error };
    let problem = match source.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "is too large a number",
        Some(_) => "is not a whole number",
        None if source.is::<ParseFloatError>() => "is not a number",
        None => return error,
    };
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.as_str(),
        _ => "",
    };
    let (flag, value) = (text(ContextKind::InvalidArg), text(ContextKind::InvalidValue));
    let message = format!("{flag}: `{value}` {problem}\n\nFor more information, try '--help'.\n");
    Error::raw(ErrorKind::ValueValidation, message)
}
