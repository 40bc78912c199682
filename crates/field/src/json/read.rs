//! Reading `.iso.json` files, which may come from strangers.

use std::sync::Arc;

use serde::Deserialize;

use super::{FORMAT, MAX_BYTES, MAX_NODES, NodeRecord, ParamRecord, VERSION};
use crate::FieldError;
use crate::arrange::Arrange;
use crate::model::{Callback, Kind, Model, Param, Payload, PayloadKind, kind, kinds};
use crate::text::suggestion;
use crate::vm::Program;

#[derive(Deserialize)]
struct Header {
    format: Option<String>,
    version: Option<u32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "format")]
    _format: String,
    #[serde(rename = "version")]
    _version: u32,
    nodes: Vec<NodeRecord>,
}

fn fail<T>(line: usize, reason: impl Into<String>) -> Result<T, FieldError> {
    Err(FieldError::File { format: "iso.json", line, reason: reason.into() })
}

fn syntax(e: &serde_json::Error) -> FieldError {
    FieldError::File { format: "iso.json", line: e.line(), reason: e.to_string() }
}

/// Reads a model without functions. Errors carry the line or the number of the node.
pub fn from_json(text: &str) -> Result<Model, FieldError> {
    from_json_with(text, &|_| None)
}

/// Reads a model; `functions` gives the function for each name that the file refers to.
pub fn from_json_with(
    text: &str,
    functions: &dyn Fn(&str) -> Option<Arc<dyn Callback>>,
) -> Result<Model, FieldError> {
    if text.len() > MAX_BYTES {
        let n = text.len();
        return Err(FieldError::TooLarge(format!(
            "an .iso.json file may have {MAX_BYTES} bytes, this one has {n}"
        )));
    }
    let header: Header = serde_json::from_str(text).map_err(|e| syntax(&e))?;
    match (header.format.as_deref(), header.version) {
        (Some(FORMAT), Some(1..=VERSION)) => {}
        (Some(FORMAT), Some(v)) => {
            return fail(
                0,
                format!("expected version 1 to {VERSION}, given {v}: update isoswarm to read it"),
            );
        }
        _ => return fail(0, format!("expected an object with \"format\": \"{FORMAT}\" and \"version\": 1")),
    }
    let file: File = serde_json::from_str(text).map_err(|e| syntax(&e))?;
    if file.nodes.len() > MAX_NODES {
        let n = file.nodes.len();
        return Err(FieldError::TooLarge(format!("a model may have {MAX_NODES} nodes, this file has {n}")));
    }
    let mut missing: Vec<&str> =
        file.nodes.iter().filter_map(|n| n.function.as_deref()).filter(|f| functions(f).is_none()).collect();
    if !missing.is_empty() {
        missing.arrange();
        missing.dedup();
        return fail(
            0,
            format!(
                "the model calls functions that are not given: {}; pass them by name",
                missing.join(", ")
            ),
        );
    }
    let mut models: Vec<Model> = Vec::with_capacity(file.nodes.len());
    for (i, record) in file.nodes.into_iter().enumerate() {
        let what: String = record.kind.chars().take(40).collect();
        match node(record, &models, functions) {
            Ok(m) => models.push(m),
            Err(FieldError::TooLarge(reason)) => return Err(FieldError::TooLarge(reason)),
            Err(FieldError::Invalid(reason)) => return fail(0, format!("node {i} ({what}): {reason}")),
            Err(e) => return fail(0, format!("node {i} ({what}): {e}")),
        }
    }
    match models.pop() {
        Some(m) => Ok(m),
        None => fail(0, "there is no node in it; expected at least one"),
    }
}

fn invalid<T>(reason: impl Into<String>) -> Result<T, FieldError> {
    Err(FieldError::Invalid(reason.into()))
}

fn refer(models: &[Model], place: usize) -> Result<Model, FieldError> {
    match models.get(place) {
        Some(m) => Ok(m.clone()),
        None => invalid(format!(
            "it refers to node {place}, but only to nodes before it (0 to {}) it may",
            models.len() as i64 - 1
        )),
    }
}

fn node(
    r: NodeRecord,
    models: &[Model],
    functions: &dyn Fn(&str) -> Option<Arc<dyn Callback>>,
) -> Result<Model, FieldError> {
    let Some(k) = kind(&r.kind).filter(|k| k.name == r.kind) else {
        let hint = suggestion(&r.kind, kinds().iter().map(|k| k.name));
        return invalid(format!("there is no such kind{hint}"));
    };
    let given = [
        (PayloadKind::Number, r.number.is_some()),
        (PayloadKind::Exponents, r.exponents.is_some()),
        (PayloadKind::Expression, r.expression.is_some()),
        (PayloadKind::Program, r.program.is_some()),
        (PayloadKind::Callback, r.function.is_some()),
    ];
    if let Some((extra, _)) = given.iter().find(|(p, present)| *present && *p != k.payload) {
        return invalid(format!("it has no place for {extra:?}").to_ascii_lowercase());
    }
    let payload = match k.payload {
        PayloadKind::None => Some(Payload::None),
        PayloadKind::Number => r.number.map(Payload::Number),
        PayloadKind::Exponents => r.exponents.map(|e| Payload::Exponents(e.into())),
        PayloadKind::Expression => match r.expression {
            Some(place) => Some(Payload::Expression(refer(models, place)?)),
            None => None,
        },
        PayloadKind::Program => match r.program {
            Some(text) => Some(Payload::Program(Program::parse(&text)?.into())),
            None => None,
        },
        PayloadKind::Callback => r.function.and_then(|name| functions(&name)).map(Payload::Callback),
    };
    let Some(payload) = payload else {
        return invalid(format!("{:?} is missing", k.payload).to_ascii_lowercase());
    };
    let params: Result<Vec<Param>, _> =
        r.params.into_iter().enumerate().map(|(i, p)| param(k, i, p, models)).collect();
    let mut params = params?;
    if let Payload::Callback(function) = &payload {
        // By name: the function may have come to list them in another order since the file was written.
        let order = function.parameters();
        params.arrange_by_key(|p| order.iter().position(|o| o.name == p.name).unwrap_or(usize::MAX));
    }
    let operands: Result<Vec<Model>, _> = r.operands.into_iter().map(|place| refer(models, place)).collect();
    let m = Model::new(k, params, operands?, payload)?;
    match r.name {
        Some(name) => m.named(&name),
        None => Ok(m),
    }
}

fn param(k: &Kind, i: usize, r: ParamRecord, models: &[Model]) -> Result<Param, FieldError> {
    let mut p = k.spec(i).map_or_else(|| Param::new("", 0.0), Param::from_spec);
    match (r.value, r.expr) {
        (Some(v), None) => p.value = v,
        (None, Some(place)) => p.expr = Some(refer(models, place)?),
        _ => return invalid(format!("the parameter {} needs either a value or an expr", r.name)),
    }
    p.name = r.name.into();
    p.frozen = r.frozen.unwrap_or(p.frozen);
    if let Some([lo, hi]) = r.bounds {
        p.bounds = (lo.unwrap_or(f64::NEG_INFINITY), hi.unwrap_or(f64::INFINITY));
    }
    p.scale = r.scale.unwrap_or(p.scale);
    Ok(p)
}
