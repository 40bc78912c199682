//! The one error type of this crate.

/// What can go wrong with a field. Every message says what was expected, what was given and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// A text that is not a formula.
    #[error("{reason} at position {position}: {excerpt}")]
    Parse {
        /// What was expected and what was found.
        reason: String,
        /// Offset into the text, in characters, from 0.
        position: usize,
        /// The text around the position, with a caret below it.
        excerpt: String,
    },
    /// A malformed file (`.vm`, `.iso.json`).
    #[error("{format} line {line}: {reason}")]
    File {
        /// Name of the format.
        format: &'static str,
        /// Line number, from 1 (0: the file as a whole).
        line: usize,
        /// What is wrong and what to do.
        reason: String,
    },
    /// A parameter, operand or setting outside what a kind accepts.
    #[error("{0}")]
    Invalid(String),
    /// A bound on depth, size or time that was exceeded.
    #[error("{0}")]
    TooLarge(String),
    /// An array of the wrong shape.
    #[error("{what}: expected {expected}, given {given}")]
    Shape {
        /// The argument.
        what: &'static str,
        /// The shape that is needed.
        expected: String,
        /// The shape that came.
        given: String,
    },
    /// A callback that failed or answered nonsense; the message is the callback's own.
    #[error("{name}: {reason}")]
    Callback {
        /// Name of the function.
        name: String,
        /// What it did.
        reason: String,
    },
    /// A name that no parameter has.
    #[error("no parameter is called `{path}`; there are: {known}")]
    UnknownParameter {
        /// The path that was asked for.
        path: String,
        /// The paths that exist.
        known: String,
    },
}
