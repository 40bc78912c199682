//! All of a scene but its floaters: see `SceneState` in `protocol.ts`.

use std::collections::HashMap;

use isoswarm_field::model::{NodeInfo, ParamInfo};
use isoswarm_particles::control::Guide;
use isoswarm_scene::{Scene, ScenePin};
use serde_json::{Value, json};
use wasm_bindgen::JsValue;

use crate::failure::Thrown;
use crate::report;

/// Formulas of nodes are for people: longer ones are cut off.
const MOST_TEXT: usize = 4000;

pub fn state(scene: &Scene) -> Result<Value, JsValue> {
    let model = scene.model().thrown()?;
    let nodes = model.nodes();
    let params = scene.field().parameters();
    let size = crate::frame::size(scene);
    let (undo, redo) = scene.history();
    let frame = scene.frame();
    Ok(json!({
        "clock": scene.clock(),
        "nodes": node_states(&nodes, params),
        "parameters": parameter_states(&nodes, params, size),
        "pins": pins(scene)?,
        "settings": scene.settings(),
        "undo": undo,
        "redo": redo,
        "held": scene.is_held(),
        "adapter": scene.adapter().map(|(path, r)| json!({ "path": path, "transfer": report::transfer(r) })),
        "formula": model.to_text().ok(),
        "axes": scene.field().axes(),
        "bounds": [frame.bounds.lo, frame.bounds.hi],
        "spacing": frame.spacing,
        "size": size,
    }))
}

fn node_states(nodes: &[NodeInfo], params: &[ParamInfo]) -> Vec<Value> {
    let mut indices: HashMap<&str, Vec<usize>> = HashMap::new();
    for (i, p) in params.iter().enumerate() {
        let node = p.path.rsplit_once('/').map_or("", |(node, _)| node);
        indices.entry(node).or_default().push(i);
    }
    let mut above: Vec<usize> = Vec::new();
    let mut children = vec![0usize; nodes.len()];
    let mut out = Vec::with_capacity(nodes.len());
    for (k, n) in nodes.iter().enumerate() {
        above.truncate(n.level);
        let parent = above.last().copied();
        let place = parent.map_or(0, |p| {
            children[p] += 1;
            children[p] - 1
        });
        above.push(k);
        let m = n.model();
        let text = m.to_text().ok().filter(|t| t.len() <= MOST_TEXT);
        out.push(json!({
            "path": n.path,
            "kind": n.kind,
            "name": m.name(),
            "category": m.kind().category,
            "level": n.level,
            "hidden": n.hidden,
            "operands": n.operands,
            "parent": parent.map_or(-1, |p| p as i64),
            "place": place,
            "parameters": indices.get(n.path.as_str()).cloned().unwrap_or_default(),
            "text": text,
        }));
    }
    out
}

fn parameter_states(nodes: &[NodeInfo], params: &[ParamInfo], size: f64) -> Vec<Value> {
    let mut docs: HashMap<String, &'static str> = HashMap::new();
    for n in nodes {
        for (i, p) in n.model().params().iter().enumerate() {
            if let Some(spec) = n.model().kind().spec(i) {
                docs.insert(format!("{}/{}", n.path, p.name), spec.doc);
            }
        }
    }
    let finite = |v: f64| v.is_finite().then_some(v);
    params
        .iter()
        .map(|p| {
            json!({
                "path": p.path,
                "name": p.path.rsplit('/').next(),
                "value": p.value,
                "frozen": p.frozen,
                "discrete": p.discrete,
                "bounds": [finite(p.bounds.0), finite(p.bounds.1)],
                "scale": p.scale,
                "unit": p.unit,
                "doc": docs.get(&p.path).copied().unwrap_or(""),
                "slider": slider(p, size),
            })
        })
        .collect()
}

/// A range in which a person may want to move a parameter.
fn slider(p: &ParamInfo, size: f64) -> [f64; 2] {
    let around = |reach: f64| [p.value - reach, p.value + reach];
    let [lo, hi] = match p.unit {
        "length" if p.bounds.0 >= 0.0 => [0.0, 2.0 * p.value.max(0.25 * size)],
        "length" => around((0.5 * size).max(p.value.abs())),
        "angle" => [-std::f64::consts::PI, std::f64::consts::PI],
        _ if p.discrete => around(8.0),
        _ => around((2.0 * p.value.abs()).max(p.scale)),
    };
    let tiny = 1e-3 * size;
    let least = if p.bounds.0 > 0.0 && p.bounds.0 < tiny && p.unit == "length" {
        tiny.min(p.value)
    } else {
        p.bounds.0
    };
    [lo.max(least).min(p.value), hi.min(p.bounds.1).max(p.value)]
}

pub fn pins(scene: &Scene) -> Result<Vec<Value>, JsValue> {
    let off = scene.residuals().thrown()?;
    let slip = scene.dragging().thrown()?.map(|d| d.slip).unwrap_or_default();
    Ok(scene.pins().iter().zip(off).map(|(p, off)| pin(p, off, &slip)).collect())
}

fn pin(p: &ScenePin, residual: f64, slip: &[(u64, [f64; 3])]) -> Value {
    let slip = slip.iter().find(|(id, _)| *id == p.id).map(|(_, by)| by);
    let along = match p.pin.guide {
        Guide::Free => Value::Null,
        Guide::Line(v) => json!({ "line": v }),
        Guide::Plane(v) => json!({ "plane": v }),
    };
    json!({
        "id": p.id,
        "name": p.name,
        "at": p.pin.at,
        "weight": p.pin.weight,
        "softness": p.pin.softness,
        "along": along,
        "grip": p.grip,
        "residual": residual,
        "held": slip.is_some(),
        "slip": slip,
    })
}
