//! Formulas as people write them: reading and printing.

mod lexer;
mod parser;
mod print;
mod suggest;

pub use parser::{MAX_NESTING, MAX_TEXT, Options, parse, parse_with};
pub(crate) use suggest::suggestion;

#[cfg(test)]
mod tests;
