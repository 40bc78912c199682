//! The project's own file of a model, `.iso.json`, version 1: a flat list of nodes, each of which refers to
//! nodes before it by their places. The last is the model. Shared parts stay shared, numbers are exact.

mod read;
mod schema;

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

pub use read::{from_json, from_json_with};
pub use schema::schema;

use crate::model::{Model, Param, Payload, guarded};

/// The version of the format that this code writes, and the newest that it reads.
pub const VERSION: u32 = 1;
/// Largest size of a file in bytes.
pub const MAX_BYTES: usize = 256 << 20;
/// Largest number of nodes.
pub const MAX_NODES: usize = 1_000_000;

/// What a file of a model calls itself.
pub const FORMAT: &str = "isoswarm model";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct NodeRecord {
    kind: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    params: Vec<ParamRecord>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    operands: Vec<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    number: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    exponents: Option<Vec<[u8; 3]>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expression: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    program: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    function: Option<String>,
}

/// What is left out is as the table has it.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParamRecord {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expr: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frozen: Option<bool>,
    /// null: no bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bounds: Option<[Option<f64>; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    scale: Option<f64>,
}

/// The model as the text of an `.iso.json` file, one node a line. Functions are stored by name.
pub fn to_json(model: &Model) -> String {
    fn visit(m: &Model, places: &mut FxHashMap<usize, usize>, lines: &mut Vec<String>) {
        if places.contains_key(&m.id()) {
            return;
        }
        for b in m.below() {
            guarded(|| visit(b, places, lines));
        }
        let line =
            serde_json::to_string(&record(m, places)).expect("names and finite numbers are serialisable");
        places.insert(m.id(), lines.len());
        lines.push(line);
    }
    let (mut places, mut lines) = (FxHashMap::default(), Vec::new());
    visit(model, &mut places, &mut lines);
    let nodes = lines.join(",\n    ");
    format!(
        "{{\n  \"format\": \"{FORMAT}\",\n  \"version\": {VERSION},\n  \"nodes\": [\n    {nodes}\n  ]\n}}\n"
    )
}

fn record(m: &Model, places: &FxHashMap<usize, usize>) -> NodeRecord {
    let place = |m: &Model| places[&m.id()];
    let mut record = NodeRecord {
        kind: m.kind().name.to_string(),
        name: m.name().map(String::from),
        params: Vec::with_capacity(m.params().len()),
        operands: m.operands().iter().map(place).collect(),
        number: None,
        exponents: None,
        expression: None,
        program: None,
        function: None,
    };
    for (i, p) in m.params().iter().enumerate() {
        let plain = m.kind().spec(i).map_or_else(|| Param::new("", 0.0), Param::from_spec);
        let bound = |v: f64| v.is_finite().then_some(v);
        record.params.push(ParamRecord {
            name: p.name.to_string(),
            value: p.expr.is_none().then_some(p.value),
            expr: p.expr.as_ref().map(place),
            frozen: (p.frozen != plain.frozen).then_some(p.frozen),
            bounds: (p.bounds != plain.bounds).then_some([bound(p.bounds.0), bound(p.bounds.1)]),
            scale: (p.scale != plain.scale).then_some(p.scale),
        });
    }
    match m.payload() {
        Payload::None => {}
        Payload::Number(v) => record.number = Some(*v),
        Payload::Exponents(e) => record.exponents = Some(e.to_vec()),
        Payload::Expression(h) => record.expression = Some(place(h)),
        Payload::Program(p) => record.program = Some(p.to_text()),
        Payload::Callback(f) => record.function = Some(f.name().to_string()),
    }
    record
}

#[cfg(test)]
mod tests;
