//! The core's errors as Python exceptions, variant by variant.
use std::io::ErrorKind;

use isoswarm_field::FieldError;
use isoswarm_geometry::GeometryError;
use isoswarm_particles::Error as ParticlesError;
use isoswarm_scene::Error as SceneError;
use pyo3::exceptions::{
    PyFileNotFoundError, PyIsADirectoryError, PyKeyboardInterrupt, PyOSError, PyPermissionError, PyValueError,
};
use pyo3::prelude::*;

use crate::callback;

pyo3::import_exception!(isoswarm.errors, CallbackError);
pyo3::import_exception!(isoswarm.errors, EmptySurfaceError);
pyo3::import_exception!(isoswarm.errors, FileFormatError);
pyo3::import_exception!(isoswarm.errors, ParseError);
pyo3::import_exception!(isoswarm.errors, SceneStateError);
pyo3::import_exception!(isoswarm.errors, TooFewError);
pyo3::import_exception!(isoswarm.errors, TooLargeError);
pyo3::import_exception!(isoswarm.errors, UnknownParameterError);
pyo3::import_exception!(isoswarm.errors, UnknownPinError);

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

/// A [`SceneError`] as an exception.
pub fn scene(error: SceneError) -> PyErr {
    let message = error.to_string();
    match error {
        SceneError::Field(error) => field(error),
        SceneError::Particles(error) => particles(error),
        SceneError::NoPin { .. } => UnknownPinError::new_err(message),
        SceneError::Vanished { .. } => EmptySurfaceError::new_err(message),
        SceneError::Nothing(_) => SceneStateError::new_err(message),
        SceneError::File { line, .. } => FileFormatError::new_err((message, line)),
        SceneError::FarPin { .. } | SceneError::Unbounded | SceneError::Option { .. } => {
            PyValueError::new_err(message)
        }
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
        GeometryError::Field(error) => field(error),
        GeometryError::Png(_) => PyOSError::new_err(message),
        GeometryError::Cancelled => PyKeyboardInterrupt::new_err(message),
        _ => PyValueError::new_err(message),
    }
}
