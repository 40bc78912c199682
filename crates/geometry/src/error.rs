//! The one error type of this crate.

use std::path::{Path, PathBuf};

/// What can go wrong between points in memory and a file or a picture. Every message says what was expected, what
/// was given and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A column has another length than the points.
    #[error(
        "{column}: expected {expected} rows, one for each point, but got {given}; pass one value a point, or leave the column out"
    )]
    ColumnLength {
        /// Name of the column, such as `normals`.
        column: &'static str,
        /// Number of points.
        expected: usize,
        /// Number of rows of the column.
        given: usize,
    },
    /// A number is NaN or infinite where only finite numbers make sense.
    #[error(
        "{column}: expected finite numbers, but row {row} holds {value}; remove the row (and the same row of the other columns) or repair it"
    )]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// First row that is not finite, counted from 0.
        row: usize,
        /// The number found there.
        value: f64,
    },
    /// A number is finite and still makes no sense, such as a negative radius.
    #[error(
        "{column}: expected {expected}, but row {row} holds {value}; repair the row or leave the column out"
    )]
    OutOfRange {
        /// Name of the column.
        column: &'static str,
        /// First offending row, counted from 0.
        row: usize,
        /// The number found there.
        value: f64,
        /// The range that is accepted, in words.
        expected: &'static str,
    },
    /// A triangle names a vertex that is not there.
    #[error(
        "faces: expected numbers of vertices from 0 to below {vertices}, but row {face} holds {given:?}; number the vertices from 0"
    )]
    NoSuchVertex {
        /// Row of the triangle, counted from 0.
        face: usize,
        /// The three numbers.
        given: [u32; 3],
        /// Number of vertices.
        vertices: usize,
    },
    /// A colouring needs a column that the cloud does not have.
    #[error(
        "{needed_for} needs the column `{column}`, which this cloud does not have; add it or choose another colouring"
    )]
    MissingColumn {
        /// Name of the column.
        column: &'static str,
        /// What needs it.
        needed_for: &'static str,
    },
    /// The file's ending says nothing that this crate can write.
    #[error("cannot tell the file format of '{}': expected an ending out of {known}, but got {given}; rename the file", path.display(), given = if ending.is_empty() { "none".to_owned() } else { format!(".{ending}") })]
    UnknownFormat {
        /// The path as given.
        path: PathBuf,
        /// Its ending without the dot; empty if it has none.
        ending: String,
        /// The endings that are known, such as `.ply, .obj`.
        known: &'static str,
    },
    /// An option of a picture is outside its range, or the name of a style or colouring is unknown.
    #[error("{name}: expected {expected}, but got {given}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// What is accepted, in words.
        expected: &'static str,
        /// What was given.
        given: String,
    },
    /// The file could not be written. What stood at the path before is unchanged, and nothing else is left behind.
    #[error("cannot write '{}': {source}; {advice}", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
        /// What to do about it.
        advice: &'static str,
    },
    /// The PNG encoder refused the picture.
    #[error("cannot encode the picture as PNG: {0}; report this, it is a bug")]
    Png(String),
    /// The caller asked to stop before the picture was done.
    #[error("the picture was cancelled before it was done; nothing was written")]
    Cancelled,
    /// A function to integrate failed, or gave something that is not a finite number.
    #[error("integrand: {0}")]
    Integrand(String),
    /// The surface could not be evaluated.
    #[error(transparent)]
    Field(#[from] isoswarm_field::FieldError),
}

impl GeometryError {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind::*;
        let advice = match source.kind() {
            StorageFull | QuotaExceeded | WriteZero => {
                "free some space or save to another disk; an earlier file of that name is unchanged"
            }
            PermissionDenied | ReadOnlyFilesystem => "choose a folder that you may write to",
            NotFound | NotADirectory => "create the folder first",
            Unsupported => "there are no files here: write to memory with the format's `write`",
            IsADirectory => "this is a folder: add a file name",
            FileTooLarge => {
                "save to a file system that allows larger files; an earlier file of that name is unchanged"
            }
            _ => "try another folder; an earlier file of that name is unchanged",
        };
        Self::Io { path: path.to_owned(), source, advice }
    }
}
