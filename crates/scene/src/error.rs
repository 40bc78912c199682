//! The one error type of this crate.

use isoswarm_field::FieldError;

/// Why a command could not be carried out. The scene then is as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A model, parameter or formula that makes no sense, or a field that cannot be evaluated.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A request to the particles that makes no sense.
    #[error(transparent)]
    Particles(#[from] isoswarm_particles::Error),
    /// A pin that does not exist.
    #[error("there is no pin {given}; there are: {known}")]
    NoPin {
        /// What was asked for.
        given: String,
        /// The pins that exist.
        known: String,
    },
    /// A pin that is not near the surface.
    #[error(
        "the pin at {at:?} is {distance:.3e} off the surface, farther than {limit:.3e}; \
             give a point on it (`Field.project` moves points onto the surface)"
    )]
    FarPin {
        /// The point that was given.
        at: [f64; 3],
        /// How far it is from the surface (infinite where no way leads there).
        distance: f64,
        /// How far it may be.
        limit: f64,
    },
    /// The model has no surface within its bounds.
    #[error("{what} leaves no surface within the bounds; the scene is as it was")]
    Vanished {
        /// What was being done.
        what: String,
    },
    /// A surface without end, and no bounds.
    #[error("no box that contains the surface was found; give `bounds`")]
    Unbounded,
    /// Nothing to undo, redo, release, accept or cancel.
    #[error("{0}")]
    Nothing(String),
    /// An option outside what it accepts.
    #[error("{name}: expected {expected}, given {given}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What it accepts.
        expected: String,
        /// What came.
        given: String,
    },
    /// A malformed scene or script.
    #[error("{format} line {line}: {reason}")]
    File {
        /// Which format.
        format: &'static str,
        /// Line, from 1 (0: the file as a whole).
        line: usize,
        /// What is wrong and what to do.
        reason: String,
    },
}

impl Error {
    pub(crate) fn option(name: &'static str, expected: impl Into<String>, given: impl ToString) -> Self {
        Error::Option { name, expected: expected.into(), given: given.to_string() }
    }
}
