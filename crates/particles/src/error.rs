//! The one error type of this crate.

use isoswarm_field::FieldError;

/// Why a request could not be carried out. Every message says what was expected, what was given and what to do.
///
/// A run that goes ahead but does not reach its goal is not an error: see [`Status`](crate::Status).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// An option outside what it accepts.
    #[error("{name}: expected {expected}, given {given}")]
    Option {
        /// Name of the option, as in [`Options`](crate::Options).
        name: &'static str,
        /// What it accepts.
        expected: String,
        /// What came.
        given: String,
    },
    /// Bounds that are not a box with finite, ordered corners.
    #[error(
        "bounds: expected finite corners with lo < hi on every axis, given {given}; swap or complete them"
    )]
    Bounds {
        /// The corners as they came.
        given: String,
    },
    /// Fewer samples asked for than the surface has connected components.
    #[error(
        "n: the surface has {components} components and each gets a sample; ask for n >= {components} (given {n})"
    )]
    TooFew {
        /// What was asked for.
        n: usize,
        /// The least number that can be met.
        components: usize,
    },
    /// More samples than the limit on points or memory allows.
    #[error(
        "about {estimate:.3e} samples ({bytes:.1e} bytes) would be needed and the limit is {limit}; \
         ask for a larger spacing or fewer samples, or raise the limit"
    )]
    TooMany {
        /// Estimated number of samples.
        estimate: f64,
        /// Estimated memory in bytes.
        bytes: f64,
        /// The limit in samples.
        limit: usize,
    },
    /// The density callback failed or gave something that is not a density.
    #[error("density: {reason}")]
    Density {
        /// What it said or gave, and where.
        reason: String,
    },
    /// The surface could not be evaluated.
    #[error(transparent)]
    Field(#[from] FieldError),
}
