//! Formulas as people write them: reading and printing.
//!
//! ```
//! use isoswarm_field::text::parse;
//!
//! let model = parse("sphere(r) | translate(box(2, 1, 1), x=1.5) - cylinder(0.2, 3)", &[("r", 1.0)])?;
//! assert_eq!(model.parameters()[0].path, "r");
//! assert!(model.to_text()?.starts_with("sphere(r=r) | "));
//!
//! let error = parse("sphere(r=1) + spehre(r=2)", &[]).unwrap_err();
//! assert!(error.to_string().contains("did you mean `sphere`? at position 14"));
//! # Ok::<(), isoswarm_field::FieldError>(())
//! ```

mod lexer;
mod parser;
mod print;
mod suggest;

pub(crate) use lexer::number as read_number;
pub use parser::{MAX_NESTING, MAX_TEXT, Options, parse, parse_with};
pub(crate) use print::number;
pub(crate) use suggest::suggestion;

#[cfg(test)]
mod tests;
