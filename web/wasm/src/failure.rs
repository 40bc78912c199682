//! What goes wrong, as a value.

use isoswarm_field::FieldError;
use isoswarm_scene::Error;
use serde::Serialize;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Told the reason of a panic before the module ends.
    #[wasm_bindgen(js_namespace = globalThis, js_name = isoswarmPanicked)]
    fn panicked(message: &str);
}

/// Reports panics. Called once, by itself, when the module is loaded.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|info| panicked(&info.to_string())));
}

/// For tests of what comes after: a panic, or memory used up.
#[wasm_bindgen]
pub fn provoke(what: &str) {
    if what == "memory" {
        let mut hoard = Vec::new();
        loop {
            hoard.push(vec![1u8; 1 << 20]);
        }
    }
    panic!("asked to stop ({what})");
}

/// See `Failure` in `protocol.ts`.
#[derive(Debug, Serialize)]
pub struct Failure {
    kind: &'static str,
    message: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    position: Option<usize>,
}

impl Failure {
    /// What was asked makes no sense.
    pub fn input(message: impl Into<String>) -> Self {
        Self { kind: "input", message: message.into(), position: None }
    }
}

impl From<FieldError> for Failure {
    fn from(e: FieldError) -> Self {
        let position = match &e {
            FieldError::Parse { position, .. } => Some(*position),
            _ => None,
        };
        Self { position, ..Self::input(e.to_string()) }
    }
}

impl From<Error> for Failure {
    fn from(e: Error) -> Self {
        match e {
            Error::Field(e) => e.into(),
            Error::Vanished { .. } => Self { kind: "vanished", ..Self::input(e.to_string()) },
            _ => Self::input(e.to_string()),
        }
    }
}

#[cfg(feature = "jobs")]
impl From<isoswarm_geometry::GeometryError> for Failure {
    fn from(e: isoswarm_geometry::GeometryError) -> Self {
        Self::input(e.to_string())
    }
}

impl From<isoswarm_particles::Error> for Failure {
    fn from(e: isoswarm_particles::Error) -> Self {
        Self::input(e.to_string())
    }
}

impl From<Failure> for JsValue {
    fn from(f: Failure) -> Self {
        JsValue::from_str(&serde_json::to_string(&f).unwrap_or(f.message))
    }
}

/// Errors of the core as what JavaScript catches.
pub trait Thrown<T> {
    /// The value, or the failure to throw.
    fn thrown(self) -> Result<T, JsValue>;
}

impl<T, E: Into<Failure>> Thrown<T> for Result<T, E> {
    fn thrown(self) -> Result<T, JsValue> {
        self.map_err(|e| e.into().into())
    }
}
