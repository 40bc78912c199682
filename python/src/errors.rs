//! The core's errors as Python exceptions, variant by variant.
use std::io::ErrorKind;

use isoswarm_field::FieldError;
use isoswarm_geometry::GeometryError;
use isoswarm_particles::Error as ParticlesError;
use pyo3::exceptions::{
    PyFileNotFoundError, PyIsADirectoryError, PyKeyboardInterrupt, PyOSError, PyPermissionError, PyValueError,
};
use pyo3::prelude::*;

use crate::callback;

pyo3::import_exception!(isoswarm.errors, CallbackError);
pyo3::import_exception!(isoswarm.errors, FileFormatError);
pyo3::import_exception!(isoswarm.errors, ParseError);
pyo3::import_exception!(isoswarm.errors, TooFewError);
pyo3::import_exception!(isoswarm.errors, TooLargeError);
pyo3::import_exception!(isoswarm.errors, UnknownParameterError);

/// A [`FieldError`] as an exception.
pub fn field(error: FieldError) -> PyErr {
    let message = error.to_string();
    match error {
        FieldError::Callback { .. } => callback::raised().unwrap_or_else(|| CallbackError::new_err(message)),
        FieldError::Parse { position, .. } => ParseError::new_err((message, position)),
        FieldError::File { line, .. } => FileFormatError::new_err((message, line)),
        FieldError::Invalid(_) | FieldError::Shape { .. } => PyValueError::new_err(message),
        FieldError::TooLarge(_) => TooLargeError::new_err(message),
        FieldError::UnknownParameter { .. } => UnknownParameterError::new_err(message),
    }
}

/// A [`ParticlesError`] as an exception.
pub fn particles(error: ParticlesError) -> PyErr {
    let message = error.to_string();
    match error {
        ParticlesError::Option { .. } | ParticlesError::Bounds { .. } => PyValueError::new_err(message),
        ParticlesError::TooFew { components, .. } => TooFewError::new_err((message, components)),
        ParticlesError::TooMany { .. } => TooLargeError::new_err(message),
        ParticlesError::Density { .. } => {
            callback::raised().unwrap_or_else(|| CallbackError::new_err(message))
        }
        ParticlesError::Field(error) => field(error),
    }
}

/// A [`GeometryError`] as an exception.
pub fn geometry(error: GeometryError) -> PyErr {
    let message = error.to_string();
    match error {
        // With the system's number Python makes it a FileNotFoundError, PermissionError and so on.
        GeometryError::Io { source, .. } => match source.raw_os_error() {
            Some(number) => PyOSError::new_err((number, message)),
            None => match source.kind() {
                ErrorKind::NotFound => PyFileNotFoundError::new_err(message),
                ErrorKind::PermissionDenied => PyPermissionError::new_err(message),
                ErrorKind::IsADirectory => PyIsADirectoryError::new_err(message),
                _ => PyOSError::new_err(message),
            },
        },
        GeometryError::Png(_) => PyOSError::new_err(message),
        GeometryError::Cancelled => PyKeyboardInterrupt::new_err(message),
        _ => PyValueError::new_err(message),
    }
}
