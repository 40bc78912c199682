//! The JSON schema of `.iso.json` files, made from the table of kinds.

use serde_json::{Value, json};

use super::{FORMAT, MAX_NODES, VERSION};
use crate::model::{Kind, Layout, Operands, ParamSpec, PayloadKind, kinds};

fn param(name: Value, spec: Option<&ParamSpec>) -> Value {
    let mut value = json!({ "type": if spec.is_some_and(|s| s.discrete) { "integer" } else { "number" } });
    if let Some(s) = spec {
        if s.bounds.0.is_finite() {
            let open = s.bounds.0 == f64::MIN_POSITIVE;
            value[if open { "exclusiveMinimum" } else { "minimum" }] =
                json!(if open { 0.0 } else { s.bounds.0 });
        }
        if s.bounds.1.is_finite() {
            value["maximum"] = json!(s.bounds.1);
        }
        value["description"] = json!(s.doc);
    }
    json!({
        "type": "object",
        "properties": {
            "name": name,
            "value": value,
            "expr": { "$ref": "#/$defs/place" },
            "frozen": { "type": "boolean" },
            "bounds": {
                "type": "array", "items": { "type": ["number", "null"] }, "minItems": 2, "maxItems": 2,
                "description": "Smallest and largest value; null: no bound."
            },
            "scale": { "type": "number", "exclusiveMinimum": 0 }
        },
        "required": ["name"],
        "oneOf": [{ "required": ["value"] }, { "required": ["expr"] }],
        "additionalProperties": false
    })
}

fn params(k: &Kind) -> Value {
    let fixed: Vec<Value> = k.params.iter().map(|s| param(json!({ "const": s.name }), Some(s))).collect();
    let rest = match k.layout {
        Layout::Fixed => None,
        Layout::Groups => {
            let names: Vec<&str> = k.group.iter().map(|s| s.name).collect();
            let pattern = format!("^({})[0-9]+$", names.join("|"));
            Some(param(json!({ "type": "string", "pattern": pattern }), None))
        }
        Layout::Monomials => {
            Some(param(json!({ "type": "string", "pattern": "^c(_(x[0-9]+)?(y[0-9]+)?(z[0-9]+)?)?$" }), None))
        }
        Layout::Own => Some(param(json!({ "type": "string" }), None)),
        Layout::Function => {
            let mut number = param(json!({ "type": "string" }), None);
            let place = number["properties"].as_object_mut().and_then(|p| p.remove("expr"));
            debug_assert!(place.is_some(), "functions take numbers only");
            number.as_object_mut().and_then(|p| p.remove("oneOf"));
            number["required"] = json!(["name", "value"]);
            Some(number)
        }
    };
    let mut array = json!({ "type": "array", "minItems": fixed.len() });
    match k.layout {
        Layout::Fixed => array["maxItems"] = json!(fixed.len()),
        Layout::Own => array["maxItems"] = json!(1),
        _ => {}
    }
    array["items"] = rest.unwrap_or(json!(false));
    if !fixed.is_empty() {
        array["prefixItems"] = json!(fixed);
    }
    array
}

fn node(k: &Kind) -> Value {
    let mut properties = json!({
        "kind": { "const": k.name },
        "name": { "type": "string", "minLength": 1, "pattern": "^[^/*]+$" }
    });
    let mut required = vec!["kind"];
    if !k.params.is_empty() || k.layout != Layout::Fixed {
        properties["params"] = params(k);
        if k.layout != Layout::Function {
            required.push("params");
        }
    }
    let (least, most) = match k.operands {
        Operands::Exactly(n) => (n, Some(n)),
        Operands::AtLeast(n) => (n, None),
    };
    if most != Some(0) {
        let mut operands =
            json!({ "type": "array", "items": { "$ref": "#/$defs/place" }, "minItems": least });
        if let Some(n) = most {
            operands["maxItems"] = json!(n);
        }
        properties["operands"] = operands;
        required.push("operands");
    }
    let payload = match k.payload {
        PayloadKind::None => None,
        PayloadKind::Number => Some(("number", json!({ "type": "number" }))),
        PayloadKind::Exponents => Some((
            "exponents",
            json!({
                "type": "array", "minItems": 1,
                "items": {
                    "type": "array", "minItems": 3, "maxItems": 3,
                    "items": { "type": "integer", "minimum": 0, "maximum": 255 }
                },
                "description": "Exponents of x, y and z of each monomial, in the order of the parameters."
            }),
        )),
        PayloadKind::Expression => Some(("expression", json!({ "$ref": "#/$defs/place" }))),
        PayloadKind::Program => Some(("program", json!({ "type": "string", "description": "A .vm tape." }))),
        PayloadKind::Callback => Some((
            "function",
            json!({ "type": "string", "description": "Its name; given when the file is read." }),
        )),
    };
    if let Some((name, schema)) = payload {
        properties[name] = schema;
        required.push(name);
    }
    json!({
        "title": k.name,
        "description": format!("{} F = {}", k.doc, k.formula),
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false
    })
}

/// The schema as text (JSON Schema, draft 2020-12).
pub fn schema() -> String {
    let nodes: Vec<Value> = kinds().iter().map(node).collect();
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": FORMAT,
        "description": "A flat list of nodes, each of which refers to nodes before it by their places; the last is the model.",
        "type": "object",
        "properties": {
            "format": { "const": FORMAT },
            "version": { "const": VERSION },
            "nodes": { "type": "array", "minItems": 1, "maxItems": MAX_NODES, "items": { "oneOf": nodes } }
        },
        "required": ["format", "version", "nodes"],
        "additionalProperties": false,
        "$defs": {
            "place": { "type": "integer", "minimum": 0, "description": "The place of an earlier node, from 0." }
        }
    });
    serde_json::to_string_pretty(&schema).expect("a schema is serialisable") + "\n"
}
